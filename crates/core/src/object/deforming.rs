//! Visuals that change their shape with the state: surfaces through parts, and clouds of spheres.
//!
//! Both are read from a world at each picture, so they are drawn wherever the parts or the state are known: after
//! a step, in a replay, and on a facet that gets poses and messages.

use super::Appearance;
use std::sync::Arc;
use tumble_collide::Vec3;

/// Triangles whose corners are the origins of an object's parts. Both sides are drawn.
#[derive(Clone, Debug)]
pub struct PartSurface {
    /// Three parts each, counter-clockwise from outside.
    pub triangles: Arc<[[u32; 3]]>,
    /// Appearance; patterns are in world axes.
    pub appearance: Appearance,
    /// Edges sharper than this are drawn sharp, rad; π for none.
    pub crease: f64,
}

/// Spheres whose places and number follow the state of an object, such as particles.
pub struct Cloud<'a> {
    /// Appearance of all of them; without a texture.
    pub appearance: &'a Appearance,
    /// Whether they are drawn as soft spheres with their opacity, like smoke. Otherwise they are solid.
    pub transparent: bool,
    /// The spheres.
    pub spheres: Box<dyn Iterator<Item = CloudSphere> + 'a>,
}

/// A sphere of a [`Cloud`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudSphere {
    /// Center, m, world axes.
    pub center: Vec3,
    /// Radius, m, above 0.
    pub radius: f64,
    /// Share of the light from behind that its middle blocks, 0 to 1; without effect if the cloud is not transparent.
    pub opacity: f64,
    /// Color of its own, sRGB, each 0 to 1; `None` for that of the appearance.
    pub color: Option<[f32; 3]>,
}

impl CloudSphere {
    /// Makes an opaque sphere of the cloud's color.
    pub fn new(center: Vec3, radius: f64) -> CloudSphere {
        CloudSphere { center, radius, opacity: 1.0, color: None }
    }
}
