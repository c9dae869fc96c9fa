//! A particle that carries a camera and a lamp: what the bird sees of its flock (thesis §III.A:
//! cameras and lights are interfaces of objects).

use crate::Particle;
use tumble_core::collide::Pose;
use tumble_core::{
    Cache, CameraCarrier, CameraMount, Integratable, LightCarrier, LightMount, Object, PartState, Spread,
};

/// A [`Particle`] with a camera that looks along the world's x axis and a white lamp.
#[derive(Clone)]
pub struct Lookout {
    name: String,
    particle: Particle,
    cameras: [CameraMount; 1],
    lights: [LightMount; 1],
}

impl Lookout {
    /// A lookout; the camera is `height` m above its particle.
    pub fn new(name: impl Into<String>, particle: Particle, height: f64) -> Lookout {
        let pose = Pose::translation(0.0, 0.0, height);
        let lamp = LightMount {
            part: 0,
            pose,
            spread: Spread::Point { radius: 0.05 },
            color: [1.0; 3],
            intensity: 1.0,
            casts_shadow: false,
        };
        Lookout { name: name.into(), particle, cameras: [CameraMount::new("", 0, pose)], lights: [lamp] }
    }
}

impl Object for Lookout {
    fn name(&self) -> &str {
        &self.name
    }

    fn refresh(&self, x: &[f64], cache: &mut Cache, part_states: &mut [PartState]) {
        self.particle.refresh(x, cache, part_states);
    }

    fn integratable(&self) -> Option<&dyn Integratable> {
        self.particle.integratable()
    }

    fn camera(&self) -> Option<&dyn CameraCarrier> {
        Some(self)
    }

    fn light(&self) -> Option<&dyn LightCarrier> {
        Some(self)
    }
}

impl CameraCarrier for Lookout {
    fn cameras(&self) -> &[CameraMount] {
        &self.cameras
    }
}

impl LightCarrier for Lookout {
    fn lights(&self) -> &[LightMount] {
        &self.lights
    }
}
