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
        match self.late(id, sensor) {
            Some(late) => late,
            None => self.present_depth(id, sensor),
        }
    }

    fn present_depth(&self, id: ObjectId, sensor: &Sensor) -> Option<SensorImage<f64>> {
        let mut error = self.image_error(id, sensor);
        let depth = |hit: Option<(RayCastHit, f64)>| {
            let error = error();
            let Some((hit, per_meter)) = hit else { return -1.0 };
            quantized((hit.distance * per_meter + error).max(0.0), sensor.noise().quantization)
        };
        Some(self.image(sensor)?.map(depth))
    }

    /// Returns a function that gives the error of one number of the present image after the other.
    fn image_error(&self, id: ObjectId, sensor: &Sensor) -> impl FnMut() -> f64 + use<> {
        let noise = *sensor.noise();
        let x = self.state_of(id).unwrap_or_default();
        let mut found = noise.of_image(&sensor.layout(), x, self.core.state.frame);
        move || found.as_mut().map_or(0.0, |(bias, generator)| *bias + noise.deviation * generator.normal())
    }

    /// Returns the image of a segmentation camera in the present poses: the object and part behind each pixel, as
    /// [`depth_image`](Self::depth_image) sees them.
    pub fn segmentation_image(&self, id: ObjectId) -> Option<SensorImage<Option<(ObjectId, usize)>>> {
        let sensor = self.get::<Sensor>(id).filter(|sensor| sensor.kind() == SensorKind::Segmentation)?;
        match self.late(id, sensor) {
            Some(late) => Some(late?.map(|number| self.core.part_of_number(number))),
            None => self.present_parts(sensor),
        }
    }

    fn present_parts(&self, sensor: &Sensor) -> Option<SensorImage<Option<(ObjectId, usize)>>> {
        Some(self.image(sensor)?.map(|hit| hit.map(|(hit, _)| (hit.id, hit.part))))
    }

    /// Returns the image of a color camera in the present poses: sRGB, 0 to 255; black where nothing is within the cutoff.
    ///
    /// It sees what [`depth_image`](Self::depth_image) sees, in the base color of its visual, by a light in the camera: no
    /// lights of the scene, no shadows, patterns and textures. What has no visual has the default color. Its noise is added to
    /// the values of 0 to 255.
    pub fn color_image(&self, id: ObjectId) -> Option<SensorImage<[u8; 3]>> {
        let sensor = self.get::<Sensor>(id).filter(|sensor| sensor.kind() == SensorKind::Color)?;
        match self.late(id, sensor) {
            Some(late) => Some(late?.map(|number| {
                let [.., red, green, blue] = (number as u32).to_be_bytes();
                [red, green, blue]
            })),
            None => self.present_colors(id, sensor),
        }
    }

    fn present_colors(&self, id: ObjectId, sensor: &Sensor) -> Option<SensorImage<[u8; 3]>> {
        let noise = *sensor.noise();
        let mut error = self.image_error(id, sensor);
        let mut with_errors = |seen: [u8; 3]| match noise.is_exact() {
            true => seen,
            false => {
                seen.map(|c| quantized(f64::from(c) + error(), noise.quantization).round().clamp(0.0, 255.0) as u8)
            }
        };
        let SensorPlace::Site(site) = sensor.place() else { return None };
        let pose = self.core.site_pose(site)?;
        let SensorImage { width, height, pixels } = self.image(sensor)?;
        let looks = self.looks();
        let mut palette: BTreeMap<(ObjectId, usize), Vec<&Visual>> = BTreeMap::new();
        let color = |(hit, direction): (Option<(RayCastHit, f64)>, Vec3)| {
            let Some((hit, per_meter)) = hit else { return with_errors([0; 3]) };
            let direction = pose.rotation * direction * per_meter;
            let visuals = palette.entry((hit.id, hit.part)).or_insert_with(|| self.core.visuals_of(hit.id, hit.part));
            let seen = self.core.seen(visuals, &hit, &pose.translation.vector, &direction);
            let light = AMBIENT + (1.0 - AMBIENT) * (-hit.normal.dot(&direction)).max(0.0);
            let own = seen.map_or(Appearance::default().color, |visual| visual.appearance.color);
            let base = looks.colors.get(&hit.id).copied().unwrap_or(own);
            with_errors(base.map(|c| encoded(light * decoded(f64::from(c)))))
        };
        let pixels = pixels.into_iter().zip(sensor.optics().directions()).map(color).collect();
        Some(SensorImage { width, height, pixels })
    }

    /// Returns the image that a camera with a delay shows now, as numbers; `None` for a camera without one, and `None` in it if
    /// the body of the camera was removed.
    fn late(&self, id: ObjectId, sensor: &Sensor) -> Option<Option<SensorImage<f64>>> {
        let SensorPlace::Site(site) = sensor.place() else { return Some(None) };
        (sensor.noise().delay > 0).then(|| {
            self.core.site_pose(site)?;
            let pixels = self.state_of(id)?.get(..sensor.layout().numbers())?.to_vec();
            let [width, height] = sensor.optics().resolution.map(|n| n as usize);
            Some(SensorImage { width, height, pixels })
        })
    }

    /// Takes the images of cameras with a delay at the end of a frame, and moves the biases of cameras.
    pub(super) fn take_images(&mut self) {
        for id in std::mem::take(&mut self.core.cameras) {
            self.take_image(id, Some(self.core.settings.dt));
        }
    }

    /// Takes the image of a camera after a frame of `dt` seconds, or at its addition for `None`.
    pub(super) fn take_image(&mut self, id: ObjectId, dt: Option<f64>) {
        let Some(sensor) = self.get::<Sensor>(id) else { return };
        let (noise, layout, kind) = (*sensor.noise(), sensor.layout(), sensor.kind());
        let Some(range) = self.view().state_range(id).map(|span| span.x.clone()) else { return };
        if let Some(dt) = dt {
            noise.walk_image(&layout, dt, self.core.state.frame, &mut self.core.state.x[range.clone()]);
        }
        if noise.delay == 0 {
            return;
        }
        let Some(sensor) = self.get::<Sensor>(id) else { return };
        let number = |part: Option<(ObjectId, usize)>| part.map_or(-1.0, |part| self.core.number_of_part(part));
        let present = match kind {
            SensorKind::Segmentation => self.present_parts(sensor).map(|image| image.map(number)),
            SensorKind::Color => self
                .present_colors(id, sensor)
                .map(|image| image.map(|[r, g, b]| f64::from(u32::from_be_bytes([0, r, g, b])))),
            _ => self.present_depth(id, sensor),
        };
        if let Some(present) = present {
            noise.delay_image(&layout, dt.is_none(), &present.pixels, &mut self.core.state.x[range]);
        }
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

fn quantized(value: f64, step: f64) -> f64 {
    if step > 0.0 { step * (value / step).round() } else { value }
}

/// Number of parts of an object that a late segmentation distinguishes.
const PARTS: f64 = 2_097_152.0;

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
    /// Returns a part as a number of the state: the serial number of its object, times 2²¹, plus its own.
    fn number_of_part(&self, (id, part): (ObjectId, usize)) -> f64 {
        let serial = self.table.place(id).map(|place| self.state.objects[place].serial);
        serial.map_or(-1.0, |serial| f64::from(serial) * PARTS + part as f64)
    }

    /// Returns the part of such a number; `None` for −1, and if its object was removed.
    fn part_of_number(&self, number: f64) -> Option<(ObjectId, usize)> {
        let serial = (number >= 0.0).then(|| (number / PARTS).floor())?;
        let place = self.by_serial(serial as u32)?;
        Some((self.table.order[place], (number - serial * PARTS) as usize))
    }

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
