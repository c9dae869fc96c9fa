//! The `surface` mode: elements of each body against the signed distance field of the other.
//!
//! ```text
//! point x        d_B(x) where it is
//! edge x(s)      min over s of d_B(x(s))      slope g(s) = n(x(s))·u,  u the edge's direction, n the field's normal
//! core           the same for the points and axes of rounded bodies, minus their radius
//! ```
//!
//! Two convex bodies that all but touch with sharp features have the direction of their distance ([`touching`]).
//!
//! Source for elements against fields: Macklin et al., *Local optimization for robust signed
//! distance field collision* (2020). Departure: faces are searched only in deep overlaps
//! ([`mesh_convex_depth`], [`mesh_mesh_depth`]), since edges and vertices of both bodies are exact.

mod cone;
mod ellipsoid;
mod hyperbola;
mod line;
mod line_parts;
mod mesh_convex_depth;
mod mesh_mesh_depth;
mod min_translation;
mod query;
mod rim;
mod smooth;
mod support_plane;
mod tolerances;
mod touching;

use super::reduce::Collector;
use crate::sdf::DistanceField;
use crate::sdf::elements::Elements;
use crate::sdf::field::MeshField;
use crate::shape::Cone;
use crate::{Contact, Pose, Vec3};
use min_translation::SampledDistance;
use query::{NearestCache, Query};
use support_plane::SupportPlane;
use tolerances::DEEP_OVERLAP;

/// The elements of a body.
pub(in crate::narrow) enum BodyElements<'a> {
    /// A mesh.
    Mesh(&'a Elements),
    /// Corners and edges of a box; half extents.
    Box(Vec3),
    /// All points within a radius of the segment `±half_length` on z; a sphere if that is 0.
    Round { radius: f64, half_length: f64 },
    /// Rims and axis.
    Cylinder { radius: f64, half_length: f64 },
    /// The whole surface; half axes.
    Ellipsoid(Vec3),
    /// Tip, rim and side.
    Cone(Cone),
    /// A half-space has no elements.
    Empty,
}

/// A body in the `surface` mode.
pub(in crate::narrow) struct Body<'a> {
    pub elements: BodyElements<'a>,
    pub field: &'a dyn DistanceField,
    /// The same field, if it is that of a mesh.
    pub mesh: Option<&'a MeshField>,
    pub radius: f64,
}

/// Appends all contacts of `a` and `b`.
pub(in crate::narrow) fn contacts(
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
    let sampled = elements(a, b, &a_in_b, size, &mut found);
    min_translation::separate(a, b, &a_in_b, size, &sampled, &mut found);
    min_translation::remove_distant(a, b, &a_in_b, size, &mut found);
    touching::settle([a, b], &a_in_b, size, &mut found);
    found.finish(pose_b);
}

/// Adds the contacts of the elements of both, in B's frame, and those of their faces for deep
/// overlaps.
fn elements(a: &Body, b: &Body, a_in_b: &Pose, size: f64, found: &mut Collector) -> SampledDistance {
    match SupportPlane::pair([a, b], a_in_b, size, found.limit()) {
        [Some(plane), _] if plane.is_beyond => SampledDistance { min: f64::INFINITY },
        planes => elements_beside(planes, [a, b], a_in_b, size, found),
    }
}

/// Adds the same contacts without those elements that lie above the planes, which bound B and A.
fn elements_beside(
    [of_b, of_a]: [Option<SupportPlane>; 2],
    [a, b]: [&Body; 2],
    a_in_b: &Pose,
    size: f64,
    found: &mut Collector,
) -> SampledDistance {
    let b_in_a = a_in_b.inverse();
    let cache_first = NearestCache::new();
    let cache_second = NearestCache::new();
    let first = Query::new([a, b], a_in_b, size, None, &cache_first).beside(of_b);
    let second = Query::new([b, a], &b_in_a, size, Some(a_in_b), &cache_second).beside(of_a);
    first.run(&a.elements, found);
    second.run(&b.elements, found);
    if found.penetration() > DEEP_OVERLAP * size {
        faces([&first, &second], [a, b], found);
    }
    SampledDistance { min: first.min_distance().min(second.min_distance()) }
}

/// Adds the deepest point of the faces of each mesh in the other body, and of a box in a mesh that is
/// not convex.
fn faces(queries: [&Query; 2], bodies: [&Body; 2], found: &mut Collector) {
    for (query, body) in queries.into_iter().zip(bodies) {
        match (&body.elements, body.mesh) {
            (_, Some(mesh)) => query.faces(mesh, found),
            (BodyElements::Box(half), None) if !query.field.is_convex() => query.faces_of_box(half, found),
            _ => {}
        }
    }
}
