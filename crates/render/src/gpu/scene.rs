//! Lights, shadows, sky and settings as the shaders' `struct Scene`.

use super::data::Eye;
use super::shadow;
use super::targets::MAX_LAYERS;
use crate::list::bounds::{Bounds, sphere_around};
use crate::material::linear3;
use crate::{DrawList, Light, MAX_LIGHTS, MAX_SHADOWS};

/// Returns the views of the lights that cast shadows, with the light's index, in the list's order.
/// Each takes one or six layers of the shadow maps; lights beyond the last layer have none.
pub fn shadow_eyes(list: &DrawList, seen: Option<&Bounds>) -> Vec<(usize, Eye)> {
    let Some(seen) = seen else { return Vec::new() };
    let each = list
        .lights
        .iter()
        .enumerate()
        .map(|(i, light)| (i, shadow::eyes_of(light, list, seen)))
        .filter(|(_, eyes)| !eyes.is_empty());
    let mut out = Vec::new();
    for (i, eyes) in each.take(MAX_SHADOWS) {
        if out.len() + eyes.len() <= MAX_LAYERS {
            out.extend(eyes.into_iter().map(|eye| (i, eye)));
        }
    }
    out
}

/// Reach of ambient occlusion, m; 0 for none.
pub fn occlusion_reach(list: &DrawList, seen: Option<&Bounds>, part: bool) -> f32 {
    match (list.settings.occlusion_m, list.sky.ambient > 0.0) {
        (_, false) => 0.0,
        (Some(reach), _) => reach,
        // the whole world may be wide: then the median size of the items gives the reach
        (None, _) if part => seen.map_or(0.0, |b| (sphere_around(b).1 / 12.0).min(4.0 * list.default_radius())),
        (None, _) => seen.map_or(0.0, |b| sphere_around(b).1 / 12.0),
    }
}

/// Middle x and y of the floor, its reach and its height.
pub fn floor(list: &DrawList, seen: Option<&Bounds>) -> [f32; 4] {
    let middle = seen.map_or([0.0; 2], |b| sphere_around(b).0.xy().into());
    [
        middle[0],
        middle[1],
        list.ground.as_ref().map_or(1.0, |g| g.reach_m),
        list.ground.as_ref().map_or(0.0, |g| g.height_m),
    ]
}

/// Linear radiance from below, in units of the ambient factor. A floor returns its color times the
/// light that falls on it (sky and suns; lamps light it unevenly). Without a floor it is the sky's
/// ground color.
fn bounce(list: &DrawList) -> [f32; 3] {
    let sky = &list.sky;
    let Some(floor) = &list.ground else { return linear3(sky.ground) };
    let (albedo, zenith, horizon) = (linear3(floor.material.color), linear3(sky.zenith), linear3(sky.horizon));
    let mut light: [f32; 3] = std::array::from_fn(|k| 0.5 * zenith[k] + 0.5 * horizon[k]);
    for light_source in &list.lights {
        if let Light::Directional { direction, color, intensity, .. } = light_source {
            let fall = (-direction.normalize().z).max(0.0) * intensity;
            let color = linear3(*color);
            // shade and occlusion below and around the objects take half
            (0..3).for_each(|k| light[k] += 0.5 * fall * color[k]);
        }
    }
    std::array::from_fn(|k| albedo[k] * light[k])
}

/// `struct Scene`.
pub fn floats(list: &DrawList, seen: Option<&Bounds>, shadows: &[(usize, Eye)]) -> Vec<f32> {
    let mut out = Vec::new();
    for (i, light) in list.lights.iter().enumerate() {
        let layer = shadows.iter().position(|(of, _)| *of == i).map_or(-1.0, |layer| layer as f32);
        let layers = shadows.iter().filter(|(of, _)| *of == i).count();
        push_light(light, [layer, layers as f32], &mut out);
    }
    out.resize(12 * MAX_LIGHTS, 0.0);
    for (_, eye) in shadows {
        out.extend(shadow::floats(eye, list.settings.shadow_map_size));
    }
    out.resize(12 * MAX_LIGHTS + 40 * MAX_LAYERS, 0.0);
    let (sky, s) = (&list.sky, &list.settings);
    let mut color = |c: [f32; 3], w: f32| {
        let [r, g, b] = linear3(c);
        out.extend([r, g, b, w]);
    };
    color(sky.zenith, list.lights.len() as f32);
    color(sky.horizon, sky.ambient);
    color(sky.ground, sky.softbox);
    color(sky.backdrop.unwrap_or_default(), flag(sky.backdrop.is_some()));
    out.extend([s.exposure, flag(s.tone_map), 0.0, s.shadow_map_size as f32]);
    out.extend(floor(list, seen));
    let [r, g, b] = bounce(list);
    out.extend([r, g, b, 0.0]);
    out
}

fn push_light(light: &Light, [layer, layers]: [f32; 2], out: &mut Vec<f32>) {
    let (at, kind, color, intensity, size) = match light {
        Light::Directional { direction, color, intensity, angular_radius_rad, .. } => {
            (-direction.normalize(), 0.0, color, intensity, angular_radius_rad)
        }
        Light::Point { position, color, intensity, radius_m, .. } => (position.coords, 1.0, color, intensity, radius_m),
    };
    let [r, g, b] = linear3(*color).map(|c| c * intensity);
    out.extend([at.x, at.y, at.z, kind, r, g, b, *size, layer, layers, 0.0, 0.0]);
}

fn flag(on: bool) -> f32 {
    f32::from(u8::from(on))
}
