//! Changes of a picture by scripted events: colors, lights and the camera.

use super::{LIGHT, small};
use crate::{Camera, DrawList, Light, RenderError};
use nalgebra::Point3;
use tumble_core::{CameraChange, Looks, Visual, World};

/// Returns a visual in another color.
pub(super) fn recolored(visual: &Visual, color: Option<&[f32; 3]>) -> Option<Visual> {
    let mut visual = color.map(|_| visual.clone())?;
    visual.appearance.color = *color?;
    Some(visual)
}

/// Changes the lights of the scene.
pub(super) fn change_lights(list: &mut DrawList, looks: &Looks) {
    for (index, change) in &looks.lights {
        let Some(Light::Directional { color, intensity, .. } | Light::Point { color, intensity, .. }) =
            list.lights.get_mut(*index)
        else {
            continue; // a scene has at least the lights that its events name
        };
        *intensity = change.intensity.map_or(*intensity, |new| LIGHT * new as f32);
        *color = change.color.map_or(*color, |new| new.map(|c| c as f32));
    }
}

/// Looks from the camera of the latest event that chose one.
pub(super) fn change_camera(list: &mut DrawList, looks: &Looks, world: &World) -> Result<(), RenderError> {
    match &looks.camera {
        None => {}
        Some(CameraChange::Named(name)) => list.look_from(world, name).map_err(|unknown| RenderError::BadValue {
            what: "camera",
            index: 0,
            field: "name in an event",
            value: unknown.to_string(),
            expected: "the name of a camera of an enabled object, or `scene`",
        })?,
        Some(CameraChange::LookAt { eye, target, vertical_fov }) => {
            let [eye, target] = [eye, target].map(|point| Point3::from(small(point)));
            list.camera = Camera::look_at(eye, target).with_fov(*vertical_fov as f32);
        }
    }
    Ok(())
}
