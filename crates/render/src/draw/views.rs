//! Named viewpoints, and the lights mounted on objects (thesis §III.A: cameras and lights are
//! interfaces of objects).

use super::{LIGHT, small};
use crate::{Camera, DrawList, Light};
use nalgebra::{Point3, Vector3};
use tumble_core::collide::Pose;
use tumble_core::{CameraMount, LightMount, Spread, World};

/// The name of the scene's own camera.
const SCENE: &str = "scene";

/// A named viewpoint: `scene` for the scene's camera; for a mounted one the object's name, followed
/// by `/` and the camera's name if it has one.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedView {
    /// Unique in a world.
    pub name: String,
    /// Its present camera.
    pub camera: Camera,
}

/// A name that no camera has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no camera is named '{name}'; expected one of {}", known.join(", "))]
pub struct UnknownView {
    /// The requested name.
    pub name: String,
    /// The existing names.
    pub known: Vec<String>,
}

impl DrawList {
    /// Returns all viewpoints of the world that this list was made from: the scene's camera first,
    /// then those mounted on enabled objects.
    pub fn views(&self, world: &World) -> Vec<NamedView> {
        let mut out = vec![NamedView { name: SCENE.into(), camera: self.camera }];
        for &id in world.ids() {
            let Some(object) = world.object(id).filter(|_| world.status(id).is_some_and(|s| s.enabled)) else {
                continue;
            };
            let owner = world.name(id).unwrap_or_default();
            for mount in object.camera().map_or(&[][..], |c| c.cameras()) {
                let Some(part_state) = world.part_state(id, mount.part) else { continue };
                let name = if mount.name.is_empty() { owner.to_string() } else { format!("{owner}/{}", mount.name) };
                out.push(NamedView { name, camera: seen_from(mount, &(part_state.pose * mount.pose)) });
            }
        }
        out
    }

    /// Sets the camera to the viewpoint of that name.
    ///
    /// # Errors
    /// [`UnknownView`] lists the existing names.
    pub fn look_from(&mut self, world: &World, name: &str) -> Result<(), UnknownView> {
        let views = self.views(world);
        match views.iter().find(|view| view.name == name) {
            Some(view) => self.camera = view.camera,
            None => {
                return Err(UnknownView {
                    name: name.to_string(),
                    known: views.into_iter().map(|view| view.name).collect(),
                });
            }
        }
        Ok(())
    }
}

fn seen_from(mount: &CameraMount, pose: &Pose) -> Camera {
    let eye = Point3::from(small(&pose.translation.vector));
    Camera::LookAt {
        eye,
        target: eye + small(&(pose.rotation * Vector3::x())),
        up: small(&(pose.rotation * Vector3::z())),
        vertical_fov_rad: mount.vertical_fov as f32,
        near_m: mount.near as f32,
        far_m: mount.far as f32,
    }
}

/// Returns a mounted light at its present pose.
pub(super) fn carried_light(mount: &LightMount, pose: &Pose) -> Light {
    let (color, intensity, casts_shadow) =
        (mount.color.map(|c| c as f32), LIGHT * mount.intensity as f32, mount.casts_shadow);
    match mount.spread {
        Spread::Directional => Light::Directional {
            direction: small(&(pose.rotation * Vector3::x())),
            color,
            intensity,
            angular_radius_rad: 0.02,
            casts_shadow,
        },
        Spread::Point { radius } => Light::Point {
            position: Point3::from(small(&pose.translation.vector)),
            color,
            intensity,
            radius_m: radius as f32,
            casts_shadow,
        },
    }
}
