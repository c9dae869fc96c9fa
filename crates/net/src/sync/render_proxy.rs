//! An object that is only drawn. It represents an object of the server that the scene file does not
//! have.

use tumble_collide::Shape;
use tumble_core::{Collidable, Object, PartSurface, Renderable, Visual};

/// Parts with visuals, at the poses that were set for display.
#[derive(Clone)]
pub(crate) struct RenderProxy {
    pub name: String,
    pub parts: usize,
    pub visuals: Vec<Visual>,
    pub surface: Option<PartSurface>,
}

impl Object for RenderProxy {
    fn name(&self) -> &str {
        &self.name
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
}

impl Renderable for RenderProxy {
    fn visuals(&self) -> &[Visual] {
        &self.visuals
    }

    fn surface(&self) -> Option<&PartSurface> {
        self.surface.as_ref()
    }
}
