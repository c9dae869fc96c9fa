//! Exact geometric predicates of the tetrahedralization.
//!
//! Source: Shewchuk, *Adaptive precision floating-point arithmetic and fast robust geometric
//! predicates* (1997), in the crate `robust`, which uses a floating-point filter first and exact
//! arithmetic where the filter is uncertain.

use crate::Vec3;
use robust::{Coord, Coord3D};

fn coord(p: &Vec3) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// Returns six times the volume of `abcd`, with exact sign: positive iff `a, b, c` are
/// counterclockwise seen from the side opposite to `d`.
pub(in crate::tree) fn orient(a: &Vec3, b: &Vec3, c: &Vec3, d: &Vec3) -> f64 {
    robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// Positive iff `e` is strictly inside the sphere through `abcd`, which must have positive
/// `orient`; zero on the sphere.
pub(super) fn in_sphere([a, b, c, d]: [&Vec3; 4], e: &Vec3) -> f64 {
    robust::insphere(coord(a), coord(b), coord(c), coord(d), coord(e))
}

/// Returns whether three points lie on one line: their projections on the three coordinate planes
/// do.
pub(super) fn collinear(a: &Vec3, b: &Vec3, c: &Vec3) -> bool {
    [(0, 1), (1, 2), (2, 0)].iter().all(|&(x, y)| {
        let flat = |p: &Vec3| Coord { x: p[x], y: p[y] };
        robust::orient2d(flat(a), flat(b), flat(c)) == 0.0
    })
}
