//! The `surface` mode: elements of each body against the signed distance of the other.
//!
//! ```text
//! point x        d_B(x) where it is
//! edge x(s)      min over s of d_B(x(s))      slope g(s) = n(x(s))·u,  u the edge's direction, n the field's normal
//! core           the same for the points and axes of rounded bodies, less their radius
//! ```
//!
//! Source for elements against fields: Macklin et al., *Local optimization for robust signed distance field collision* (2020), whose
//! search of a face we need in deep overlaps alone ([`deep`], [`deepest`]), since edges and vertices of both bodies are exact.

mod arc;
mod deep;
mod deepest;
mod line;
mod parting;
mod pass;
mod rim;
mod smooth;

use super::reduce::Collector;
use crate::surface::Field;
use crate::surface::elements::Elements;
use crate::surface::field::MeshField;
use crate::{Contact, Pose, Vec3};
use deep::DEEP;
use parting::Seen;
use pass::{Memory, Pass};

/// A body as the pass sees it that takes its elements.
pub(in crate::narrow) enum Source<'a> {
    /// A mesh.
    Mesh(&'a Elements),
    /// A block's corners and edges.
    Box(Vec3),
    /// All within a radius of the segment `±half_length` on z; a ball if that is 0.
    Round { radius: f64, half_length: f64 },
    /// Rims and axis.
    Cylinder { radius: f64, half_length: f64 },
    /// A half-space has no elements.
    Nothing,
}

/// A body in the `surface` mode.
pub(in crate::narrow) struct Body<'a> {
    pub source: Source<'a>,
    pub field: &'a dyn Field,
    /// The field again, where it is a mesh's.
    pub mesh: Option<&'a MeshField>,
    pub radius: f64,
}

/// All contacts of `a` and `b`.
pub(in crate::narrow) fn surface(
    a: &Body,
    pose_a: &Pose,
    b: &Body,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let a_in_b = pose_b.inv_mul(pose_a);
    let size = a.radius.min(b.radius);
    let mut found = Collector::new(margin, size, out);
    let seen = elements(a, b, &a_in_b, size, &mut found);
    parting::part(a, b, &a_in_b, size, &seen, &mut found);
    found.finish(pose_b);
}

/// The contacts of the elements of both, in B's frame; of deep overlaps that of their faces too.
fn elements(a: &Body, b: &Body, a_in_b: &Pose, size: f64, found: &mut Collector) -> Seen {
    let b_in_a = a_in_b.inverse();
    let memory_first = Memory::new();
    let memory_second = Memory::new();
    let first = Pass::new([a, b], a_in_b, size, None, &memory_first);
    let second = Pass::new([b, a], &b_in_a, size, Some(a_in_b), &memory_second);
    first.run(&a.source, found);
    second.run(&b.source, found);
    if found.overlap() > DEEP * size {
        faces([&first, &second], [a, b], found);
    }
    Seen { least: first.least().min(second.least()) }
}

/// The deepest place of the faces of each mesh in the other body.
fn faces(passes: [&Pass; 2], bodies: [&Body; 2], found: &mut Collector) {
    for (pass, body) in passes.into_iter().zip(bodies) {
        if let Some(mesh) = body.mesh {
            pass.faces(mesh, found);
        }
    }
}
