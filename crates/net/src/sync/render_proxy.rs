//! An object that is only drawn. It represents an object of the server that the scene file does not
//! have.

use super::cloud::Spheres;
use super::visuals::Looks;
use tumble_collide::Shape;
use tumble_core::{Appearance, Cloud, Collidable, Object, PartSurface, Renderable, Visual};

/// Parts with visuals, at the poses that were set for display.
#[derive(Clone)]
pub(crate) struct RenderProxy {
    name: String,
    parts: usize,
    visuals: Vec<Visual>,
    surface: Option<PartSurface>,
    cloud: Option<Appearance>,
    /// The spheres of its cloud.
    pub spheres: Spheres,
}

impl RenderProxy {
    pub fn new(name: &str, parts: usize, looks: Looks) -> RenderProxy {
        let Looks { visuals, surface, cloud } = looks;
        RenderProxy { name: name.to_owned(), parts, visuals, surface, cloud, spheres: Spheres::default() }
    }
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

    fn cloud<'a>(&'a self, _: &'a [f64]) -> Option<Cloud<'a>> {
        let appearance = self.cloud.as_ref()?;
        let Spheres { transparent, spheres } = &self.spheres;
        Some(Cloud { appearance, transparent: *transparent, spheres: Box::new(spheres.iter().copied()) })
    }
}
