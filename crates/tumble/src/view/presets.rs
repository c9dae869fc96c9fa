//! Named viewpoints that a key steps through.

use nalgebra::Vector3;
use tumble::dynamics::World;
use tumble::render::{Camera, DrawList};

/// The origin of a viewpoint.
enum Source {
    /// A camera at rest: the scene's.
    Fixed(Camera),
    /// A camera mounted on a body or link.
    Carried,
    /// A camera that shows the whole scene from a direction.
    Framing(Vector3<f32>),
}

/// The viewpoints, and the index of the active one.
pub struct Presets {
    list: Vec<(String, Source)>,
    current: usize,
    /// Whether the view still follows the active viewpoint; moving the user ends it.
    attached: bool,
}

impl Presets {
    /// Lists the scene's camera, then the mounted ones, then views of the whole scene from the
    /// front, left, back, right and top.
    pub fn new(world: &World, list: &DrawList) -> Presets {
        let around = [
            ("front", [0.0, 1.0, -0.3]),
            ("left", [1.0, 0.0, -0.3]),
            ("back", [0.0, -1.0, -0.3]),
            ("right", [-1.0, 0.0, -0.3]),
            ("top", [0.0, 0.02, -1.0]),
        ];
        let framing = around.map(|(name, d)| (name.to_string(), Source::Framing(Vector3::from(d))));
        let carried = list.views(world).into_iter().skip(1).map(|view| (view.name, Source::Carried));
        let list =
            std::iter::once(("scene".to_string(), Source::Fixed(list.camera))).chain(carried).chain(framing).collect();
        Presets { list, current: 0, attached: false }
    }

    /// Steps through the list by `by`.
    pub fn go(&mut self, by: isize) {
        let count = self.list.len() as isize;
        self.current = (self.current as isize + by).rem_euclid(count) as usize;
        self.attached = true;
    }

    /// Returns to the scene's camera.
    pub fn home(&mut self) {
        self.current = 0;
    }

    /// Activates the viewpoint of this name. Returns whether there is one.
    pub fn find(&mut self, name: &str) -> bool {
        let found = self.list.iter().position(|(known, _)| known == name);
        self.current = found.unwrap_or(self.current);
        self.attached = true;
        found.is_some()
    }

    /// All names in order.
    pub fn names(&self) -> Vec<&str> {
        self.list.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// The active name.
    pub fn name(&self) -> &str {
        &self.list[self.current].0
    }

    /// Stops following the active viewpoint.
    pub fn release(&mut self) {
        self.attached = false;
    }

    /// The active camera for the world's present state; `None` if the object that it was mounted on
    /// is gone.
    pub fn camera(&self, world: &World, list: &DrawList) -> Option<Camera> {
        match &self.list[self.current].1 {
            Source::Fixed(camera) => Some(*camera),
            Source::Carried => {
                list.views(world).into_iter().find(|view| view.name == self.name()).map(|view| view.camera)
            }
            Source::Framing(direction) => Some(walking_depths(list.framing_camera(*direction))),
        }
    }

    /// Returns the active camera if it is mounted and the user has not moved since it was chosen.
    pub fn followed(&self, world: &World, list: &DrawList) -> Option<Camera> {
        let follows = self.attached && matches!(self.list[self.current].1, Source::Carried);
        if follows { self.camera(world, list) } else { None }
    }
}

/// Widens the depth range of a framing camera, because the user may walk closer and farther away.
fn walking_depths(mut camera: Camera) -> Camera {
    if let Camera::LookAt { near_m, far_m, .. } = &mut camera {
        (*near_m, *far_m) = (near_m.min(0.05), far_m.max(500.0));
    }
    camera
}

/// Distance from the eye of a camera to its target, m.
pub fn distance(camera: &Camera) -> f64 {
    match camera {
        Camera::LookAt { eye, target, .. } => f64::from((target - eye).norm()),
        Camera::Raw { .. } => 4.0,
    }
}
