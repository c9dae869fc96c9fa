//! The key by which visuals of equal geometry share a mesh.

use super::visual::Drawn;
use std::sync::Arc;
use tumble_collide::Shape;

/// The dimensions of a shape, or the address of a shared mesh: equal for visuals that one mesh can draw, while the mesh
/// lives. Lists of thousands of visuals look up one each: no text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MeshKey {
    kind: u8,
    numbers: [u64; 4],
}

impl MeshKey {
    /// Returns the key of a geometry.
    pub fn of(drawn: Drawn<'_>) -> MeshKey {
        let shape = match drawn {
            Drawn::Mesh(mesh) => return MeshKey { kind: 0, numbers: at(Arc::as_ptr(mesh)) },
            Drawn::Shape(shape) => shape,
        };
        let (kind, numbers) = match shape {
            Shape::Mesh(mesh) => (1, at(Arc::as_ptr(mesh))),
            Shape::Compound(compound) => (2, at(Arc::as_ptr(compound))),
            Shape::HalfSpace => (3, [0; 4]),
            Shape::Sphere { radius } => (4, bits([*radius])),
            Shape::Box { half_extents: h } => (5, bits([h.x, h.y, h.z])),
            Shape::Capsule { radius, half_length } => (6, bits([*radius, *half_length])),
            Shape::Cylinder(c) => (7, bits([c.radius(), c.half_length()])),
            Shape::Ellipsoid { half_axes: a } => (8, bits([a.x, a.y, a.z])),
            Shape::Cone { radius, height } => (9, bits([*radius, *height])),
            Shape::RoundedBox { half_extents: h, rounding } => (10, bits([h.x, h.y, h.z, *rounding])),
            Shape::RoundedCylinder { core: c, rounding } => (11, bits([c.radius(), c.half_length(), *rounding])),
        };
        MeshKey { kind, numbers }
    }
}

fn at<T>(address: *const T) -> [u64; 4] {
    [address as usize as u64, 0, 0, 0]
}

fn bits<const N: usize>(sizes: [f64; N]) -> [u64; 4] {
    std::array::from_fn(|k| sizes.get(k).map_or(0, |size| size.to_bits()))
}
