//! Images of the cameras of a world; the equations are in `sensor/camera.rs`.

use super::{Core, Ray, RayCastHit, World};
use crate::constraint::loop_joint::Anchor;
use crate::sensor::{Sensor, SensorImage, SensorKind, SensorPlace};
use crate::world::view::ObjectId;

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

impl Core {
    /// Returns whether a part moves with a site.
    pub(crate) fn carries(&self, site: &Anchor, id: ObjectId, part: usize) -> bool {
        site.part.is_some_and(|(on, at)| on == id && self.carrier(on, at) == self.carrier(id, part))
    }
}
