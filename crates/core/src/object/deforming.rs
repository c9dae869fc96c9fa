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
    /// Center, m, world axes, and radius, m, above 0, of each.
    pub spheres: Box<dyn Iterator<Item = (Vec3, f64)> + 'a>,
}
