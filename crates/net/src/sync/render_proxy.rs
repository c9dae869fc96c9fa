//! An object that is drawn and nothing else: what came by name, and the scene file has not.

use tumble_collide::{Shape, Vec3};
use tumble_core::{Cache, Collidable, CollisionGroup, Material, Object, PartState, Renderable, Visual};

/// Parts with pictures, which stand where they are shown.
#[derive(Clone)]
pub(crate) struct RenderProxy {
    pub name: String,
    pub parts: usize,
    pub visuals: Vec<Visual>,
}

impl Object for RenderProxy {
    fn name(&self) -> &str {
        &self.name
    }

    fn fork(&self) -> Box<dyn Object> {
        Box::new(self.clone())
    }

    fn collidable(&self) -> Option<&dyn Collidable> {
        Some(self)
    }

    fn renderable(&self) -> Option<&dyn Renderable> {
        Some(self)
    }
}

impl Collidable for RenderProxy {
    fn parts(&self) -> usize {
        self.parts
    }

    fn shape(&self, _: usize) -> Option<&Shape> {
        None
    }

    fn material(&self, _: usize) -> Material {
        Material::default()
    }

    fn collision_group(&self, _: usize) -> CollisionGroup {
        CollisionGroup::default()
    }

    fn collides_with(&self, _: usize, _: CollisionGroup) -> bool {
        false
    }

    fn test_impulse(&self, _: &mut Cache, _: usize, _: &PartState, _: &Vec3, _: &[Vec3], _: f64, _: &mut [f64]) {}
}

impl Renderable for RenderProxy {
    fn visuals(&self) -> &[Visual] {
        &self.visuals
    }
}
