//! Named points of view that a key goes through.

use nalgebra::Vector3;
use tumble::dynamics::World;
use tumble::render::{Camera, DrawList};

/// Where a view comes from.
enum Source {
    /// Stands still: the scene's camera.
    Fixed(Camera),
    /// Goes with a body or link that carries it.
    Carried,
    /// Shows everything from a direction.
    Framing(Vector3<f32>),
}

/// The list, and which of it is in use.
pub struct Presets {
    list: Vec<(String, Source)>,
    current: usize,
    /// Whether the user has not moved by himself since.
    attached: bool,
}

impl Presets {
    /// The scene's camera first, then those that objects carry, then everything from the front, both sides, behind and above.
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

    /// Goes on in the list, or back.
    pub fn go(&mut self, by: isize) {
        let count = self.list.len() as isize;
        self.current = (self.current as isize + by).rem_euclid(count) as usize;
        self.attached = true;
    }

    /// To the first.
    pub fn home(&mut self) {
        self.current = 0;
    }

    /// To the one of that name; whether there is one.
    pub fn find(&mut self, name: &str) -> bool {
        let found = self.list.iter().position(|(known, _)| known == name);
        self.current = found.unwrap_or(self.current);
        self.attached = true;
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

    /// The user goes by himself from here.
    pub fn release(&mut self) {
        self.attached = false;
    }

    /// The camera in use, for the world as it is; `None` where it is gone with its object.
    pub fn camera(&self, world: &World, list: &DrawList) -> Option<Camera> {
        match &self.list[self.current].1 {
            Source::Fixed(camera) => Some(*camera),
            Source::Carried => {
                list.views(world).into_iter().find(|view| view.name == self.name()).map(|view| view.camera)
            }
            Source::Framing(direction) => Some(walking_depths(list.framing_camera(*direction))),
        }
    }

    /// The camera to follow, where the one in use moves and the user is still with it.
    pub fn followed(&self, world: &World, list: &DrawList) -> Option<Camera> {
        let follows = self.attached && matches!(self.list[self.current].1, Source::Carried);
        if follows { self.camera(world, list) } else { None }
    }
}

/// Whoever walks off from a framing camera comes nearer and goes farther than it was made for.
fn walking_depths(mut camera: Camera) -> Camera {
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
