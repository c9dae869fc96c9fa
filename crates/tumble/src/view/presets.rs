//! Named points of view that a key goes through.

use nalgebra::Vector3;
use tumble::core::World;
use tumble::render::{Camera, DrawList};

/// Where a view comes from.
enum Source {
    /// Stands still: the scene's camera.
    Fixed(Camera),
    /// Shows everything from a direction.
    Framing(Vector3<f32>),
}

/// The list, and which of it is in use.
pub struct Presets {
    list: Vec<(String, Source)>,
    current: usize,
}

impl Presets {
    /// The scene's camera first, then everything from the front, both sides, behind and above.
    pub fn new(scene: Camera) -> Presets {
        let around = [("front", [0.0, 1.0, -0.3]), ("left", [1.0, 0.0, -0.3]), ("back", [0.0, -1.0, -0.3]), ("right", [-1.0, 0.0, -0.3]), ("top", [0.0, 0.02, -1.0])];
        let framing = around.map(|(name, d)| (name.to_string(), Source::Framing(Vector3::from(d))));
        let list = std::iter::once(("scene".to_string(), Source::Fixed(scene))).chain(framing).collect();
        Presets { list, current: 0 }
    }

    /// Goes on in the list, or back.
    pub fn go(&mut self, by: isize) {
        let count = self.list.len() as isize;
        self.current = (self.current as isize + by).rem_euclid(count) as usize;
    }

    /// To the first.
    pub fn home(&mut self) {
        self.current = 0;
    }

    /// To the one of that name; whether there is one.
    pub fn find(&mut self, name: &str) -> bool {
        let found = self.list.iter().position(|(known, _)| known == name);
        self.current = found.unwrap_or(self.current);
        found.is_some()
    }

    /// Names in their order.
    pub fn names(&self) -> Vec<&str> {
        self.list.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// The name in use.
    pub fn name(&self) -> &str {
        &self.list[self.current].0
    }

    /// The camera in use, for the world as it is.
    pub fn camera(&self, _world: &World, list: &DrawList) -> Camera {
        match &self.list[self.current].1 {
            Source::Fixed(camera) => *camera,
            Source::Framing(direction) => usual_depths(list.framing_camera(*direction)),
        }
    }
}

/// Whoever walks off from a framing camera comes nearer and goes farther than it was made for.
fn usual_depths(mut camera: Camera) -> Camera {
    if let Camera::LookAt { near_m, far_m, .. } = &mut camera {
        (*near_m, *far_m) = (near_m.min(0.05), far_m.max(500.0));
    }
    camera
}

/// How far the eye of a camera is from what it looks at, m.
pub fn distance(camera: &Camera) -> f64 {
    match camera {
        Camera::LookAt { eye, target, .. } => f64::from((target - eye).norm()),
        Camera::Raw { .. } => 4.0,
    }
}
