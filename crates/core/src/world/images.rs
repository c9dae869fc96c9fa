//! Images of the cameras of a world; the equations are in `sensor/camera.rs`.
//!
//! A color camera carries its light: the color of a pixel is that of the surface, dimmed by the angle between its normal
//! and the ray,
//!
//! ```text
//! c = c_surface·(a + (1 − a)·max(0, −n·d/|d|))        a = AMBIENT, in linear light; sRGB is the IEC 61966-2-1 curve of it
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `n`, `d` | outward unit normal of the surface; direction of the ray |
//! | `a` | light from all sides |

use super::{Core, Ray, RayCastHit, World};
use crate::articulated::ArticulatedBody;
use crate::constraint::loop_joint::Anchor;
use crate::object::Appearance;
use crate::object::visual::Visual;
use crate::sensor::{Sensor, SensorImage, SensorKind, SensorPlace};
use crate::world::view::ObjectId;
use nalgebra::ComplexField;
use std::any::Any;
use std::collections::BTreeMap;
use tumble_collide::Vec3;

impl World {
    /// Returns the image of a depth camera in the present poses: distances along the z axis of the site, m, with its
    /// noise; −1 where nothing is within the cutoff. `None` if it or its body was removed, or it is none.
    ///
    /// It sees what collides, except the part that carries it and triggers. A convex shape in which the camera is, it does
    /// not see.
    pub fn depth_image(&self, id: ObjectId) -> Option<SensorImage<f64>> {
        let sensor = self.get::<Sensor>(id).filter(|sensor| sensor.kind() == SensorKind::Depth)?;
        let noise = *sensor.noise();
        let mut generator = noise.of_image(sensor.kind(), self.state_of(id)?, self.core.state.frame);
        let depth = |hit: Option<(RayCastHit, f64)>| {
            let error = generator.as_mut().map_or(0.0, |generator| noise.deviation * generator.normal());
            let Some((hit, per_meter)) = hit else { return -1.0 };
            let seen = (hit.distance * per_meter + error).max(0.0);
            if noise.quantization > 0.0 { noise.quantization * (seen / noise.quantization).round() } else { seen }
        };
        Some(self.image(sensor)?.map(depth))
    }

    /// Returns the image of a segmentation camera in the present poses: the object and part behind each pixel, as
    /// [`depth_image`](Self::depth_image) sees them.
    pub fn segmentation_image(&self, id: ObjectId) -> Option<SensorImage<Option<(ObjectId, usize)>>> {
        let sensor = self.get::<Sensor>(id).filter(|sensor| sensor.kind() == SensorKind::Segmentation)?;
        Some(self.image(sensor)?.map(|hit| hit.map(|(hit, _)| (hit.id, hit.part))))
    }

    /// Returns the image of a color camera in the present poses: sRGB, 0 to 255; black where nothing is within the cutoff.
    ///
    /// It sees what [`depth_image`](Self::depth_image) sees, in the base color of its visual, by a light in the camera: no
    /// lights of the scene, no shadows, patterns and textures. What has no visual has the default color.
    pub fn color_image(&self, id: ObjectId) -> Option<SensorImage<[u8; 3]>> {
        let sensor = self.get::<Sensor>(id).filter(|sensor| sensor.kind() == SensorKind::Color)?;
        let SensorPlace::Site(site) = sensor.place() else { return None };
        let pose = self.core.site_pose(site)?;
        let SensorImage { width, height, pixels } = self.image(sensor)?;
        let looks = self.looks();
        let mut palette: BTreeMap<(ObjectId, usize), Vec<&Visual>> = BTreeMap::new();
        let color = |(hit, direction): (Option<(RayCastHit, f64)>, Vec3)| {
            let Some((hit, per_meter)) = hit else { return [0; 3] };
            let direction = pose.rotation * direction * per_meter;
            let visuals = palette.entry((hit.id, hit.part)).or_insert_with(|| self.core.visuals_of(hit.id, hit.part));
            let seen = self.core.seen(visuals, &hit, &pose.translation.vector, &direction);
            let light = AMBIENT + (1.0 - AMBIENT) * (-hit.normal.dot(&direction)).max(0.0);
            let own = seen.map_or(Appearance::default().color, |visual| visual.appearance.color);
            let base = looks.colors.get(&hit.id).copied().unwrap_or(own);
            base.map(|c| encoded(light * decoded(f64::from(c))))
        };
        let pixels = pixels.into_iter().zip(sensor.optics().directions()).map(color).collect();
        Some(SensorImage { width, height, pixels })
    }

    /// Returns the hit behind each pixel, with the depth per meter of the ray.
    fn image(&self, sensor: &Sensor) -> Option<SensorImage<Option<(RayCastHit, f64)>>> {
        let SensorPlace::Site(site) = sensor.place() else { return None };
        let (optics, cutoff) = (sensor.optics(), sensor.cutoff());
        let pose = self.core.site_pose(site)?;
        let rays: Vec<Ray> = optics
            .directions()
            .map(|d| Ray {
                origin: pose.translation.vector,
                direction: pose.rotation * d,
                max_distance: cutoff * d.norm(),
            })
            .collect();
        let own = |id, part| self.core.carries(site, id, part);
        let hits = self.core.parts_along(&rays, own);
        let [width, height] = optics.resolution.map(|n| n as usize);
        let pixels = hits.into_iter().zip(optics.directions()).map(|(hit, d)| Some((hit?, 1.0 / d.norm()))).collect();
        Some(SensorImage { width, height, pixels })
    }
}

/// Light from all sides, of a surface that faces the camera.
const AMBIENT: f64 = 0.25;

/// Returns the linear light of an sRGB value, both 0 to 1.
fn decoded(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { <f64 as ComplexField>::powf((c + 0.055) / 1.055, 2.4) }
}

/// Returns the sRGB value of linear light in [0, 1], 0 to 255.
fn encoded(light: f64) -> u8 {
    let c = if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * <f64 as ComplexField>::powf(light, 1.0 / 2.4) - 0.055
    };
    (255.0 * c).round() as u8
}

impl Core {
    /// Returns the visuals that move with a part.
    fn visuals_of(&self, id: ObjectId, part: usize) -> Vec<&Visual> {
        let visuals = self.objects().get(id).and_then(|entry| entry.object.renderable()).map(|r| r.visuals());
        let any = self.objects().get(id).map(|entry| entry.object as &dyn Any);
        let links = any.and_then(|any| any.downcast_ref::<ArticulatedBody>());
        let moves = |visual: &&Visual| match links {
            Some(body) => body.link_of(visual.part) == body.link_of(part),
            None => visual.part == part,
        };
        visuals.into_iter().flatten().filter(moves).collect()
    }

    /// Returns the visual that a ray shows where it enters a part: that which it enters at the nearest distance to the hit.
    fn seen<'v>(
        &self,
        visuals: &[&'v Visual],
        hit: &RayCastHit,
        origin: &Vec3,
        direction: &Vec3,
    ) -> Option<&'v Visual> {
        if let [only] = visuals {
            return Some(only);
        }
        let off = |visual: &&Visual| {
            let pose = self.objects().get(hit.id).and_then(|entry| {
                self.derived.part_states.get(entry.state_range.parts.start + visual.part).map(|state| state.pose)
            });
            let distance = pose.and_then(|pose| visual.ray(&pose, origin, direction));
            distance.map_or(f64::INFINITY, |distance| (distance - hit.distance).abs())
        };
        visuals.iter().map(|visual| (off(visual), *visual)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, visual)| visual)
    }

    /// Returns whether a part moves with a site.
    pub(crate) fn carries(&self, site: &Anchor, id: ObjectId, part: usize) -> bool {
        site.part.is_some_and(|(on, at)| on == id && self.carrier(on, at) == self.carrier(id, part))
    }
}
