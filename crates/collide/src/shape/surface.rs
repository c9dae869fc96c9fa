//! Surfaces of ellipsoids, cones and rounded shapes as triangles, for drawing and buoyancy.

use crate::mesh::revolve;
use crate::{Shape, TriMesh, Vec3};
use nalgebra::ComplexField;
use std::f64::consts::FRAC_PI_2;

/// Arcs of a rounded edge.
const ARCS: usize = 6;

impl Shape {
    /// Returns the surface of an ellipsoid, cone or rounded shape as a closed mesh about the shape's
    /// origin, with `sides` around; empty for all others. Its vertices are points of the surface.
    pub fn surface_mesh(&self, sides: usize) -> TriMesh {
        match self {
            Shape::Ellipsoid { half_axes } => {
                let mut mesh = TriMesh::uv_sphere(1.0, sides, sides / 2);
                mesh.vertices.iter_mut().for_each(|v| *v = v.component_mul(half_axes));
                mesh
            }
            Shape::Cone { radius, height } => TriMesh::cone(*radius, *height, sides),
            Shape::RoundedCylinder { core, rounding } => {
                let arc = |n: usize| {
                    let (sin, cos) = ComplexField::sin_cos(FRAC_PI_2 * n as f64 / ARCS as f64);
                    (core.radius() + rounding * sin, core.half_length() + rounding * cos)
                };
                let upper: Vec<(f64, f64)> = (0..=ARCS).map(arc).collect();
                let end = core.half_length() + rounding;
                let lower = upper.iter().map(|(r, z)| (*r, -z));
                let around = lower.chain(upper.iter().rev().copied());
                revolve(&[(0.0, -end)].into_iter().chain(around).chain([(0.0, end)]).collect::<Vec<_>>(), sides)
            }
            Shape::RoundedBox { half_extents, rounding } => rounded_cuboid(half_extents, *rounding),
            _ => TriMesh::default(),
        }
    }
}

/// A cube's surface as a grid whose points are moved to the rounded box: `ARCS` cells across each
/// rounded edge and one across each face.
fn rounded_cuboid(half: &Vec3, rounding: f64) -> TriMesh {
    let core = half.add_scalar(-rounding);
    let lines = 2 * ARCS + 2;
    // the coordinate of a grid line on the cube that is projected: the core's corner and an angle
    let line = |n: usize| {
        let angle = |m: usize| 0.5 * FRAC_PI_2 * m as f64 / ARCS as f64;
        let tan = |m: usize| ComplexField::tan(angle(m));
        if n <= ARCS { (-1.0, -tan(ARCS - n)) } else { (1.0, tan(n - ARCS - 1)) }
    };
    let mut mesh = TriMesh::default();
    let mut known = std::collections::BTreeMap::new();
    for face in 0..6 {
        let (k, sign) = (face / 2, if face % 2 == 0 { -1.0 } else { 1.0 });
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let mut at = |a: usize, b: usize| -> u32 {
            let mut name = [0; 3];
            (name[i], name[j], name[k]) = (a, b, if sign < 0.0 { 0 } else { lines - 1 });
            *known.entry(name).or_insert_with(|| {
                let (mut corner, mut direction) = (Vec3::zeros(), Vec3::zeros());
                for (axis, n) in [(i, a), (j, b)] {
                    let (side, slope) = line(n);
                    (corner[axis], direction[axis]) = (side * core[axis], slope);
                }
                (corner[k], direction[k]) = (sign * core[k], sign);
                mesh.vertices.push(corner + direction.normalize() * rounding);
                mesh.vertices.len() as u32 - 1
            })
        };
        let mut quads = Vec::new();
        for a in 0..lines - 1 {
            for b in 0..lines - 1 {
                let quad = [at(a, b), at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)];
                quads.push(if sign > 0.0 { quad } else { [quad[0], quad[3], quad[2], quad[1]] });
            }
        }
        mesh.triangles.extend(quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]));
    }
    mesh
}
