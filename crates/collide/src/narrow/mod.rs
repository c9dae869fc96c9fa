//! The narrow phase: contacts between two shapes at given poses, with one file per family of pairs.

mod box_box;
mod box_closest;
mod box_pair;
mod capsule;
mod clip;
mod cylinder;
mod half_space;
mod parts;
mod reduce;
mod sdf_contact;
mod segment;
mod sphere;
mod tree;

use crate::sdf::DistanceField;
use crate::sdf::primitive::{BoxField, CylinderField, HalfSpaceField, RoundField};
use crate::{Contact, ContactMode, Pose, Shape};
use sdf_contact::{Body, BodyElements};

/// Calls [`contacts_in_mode`] with the default mode, `surface`.
pub fn contacts(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    contacts_in_mode(ContactMode::Surface, a, pose_a, b, pose_b, margin, out);
}

/// Appends to `out` all contacts between `a` and `b` whose gap is at most `margin` meters (`margin
/// ≥ 0`).
///
/// **Normals point from B towards A.** Exact among half-space, sphere, box and capsule, and for a
/// cylinder on a half-space. For meshes and other pairs with cylinders the mode applies: see
/// [`ContactMode`]. Manifolds are reduced to the few points that matter. Allocates only for the
/// growth of `out`. A pose that is not finite has no contacts.
#[allow(clippy::too_many_arguments)]
pub fn contacts_in_mode(
    mode: ContactMode,
    a: &Shape,
    pose_a: &Pose,
    b: &Shape,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    if !(is_finite(pose_a) && is_finite(pose_b)) {
        return;
    }
    let start = out.len();
    if rank(a) <= rank(b) {
        dispatch(mode, a, pose_a, b, pose_b, margin, out);
    } else {
        dispatch(mode, b, pose_b, a, pose_a, margin, out);
        out[start..].iter_mut().for_each(|c| *c = c.flipped());
    }
}

/// A sum is finite only if all its terms are.
fn is_finite(pose: &Pose) -> bool {
    (pose.translation.vector.sum() + pose.rotation.coords.sum()).is_finite()
}

/// Pairs are ordered by rank, lower rank first.
fn rank(shape: &Shape) -> u8 {
    match shape {
        Shape::Mesh(_) | Shape::Cylinder(_) => 0,
        Shape::Sphere { .. } => 1,
        Shape::Capsule { .. } => 2,
        Shape::Box { .. } => 3,
        Shape::HalfSpace => 4,
    }
}

fn dispatch(
    mode: ContactMode,
    a: &Shape,
    pose_a: &Pose,
    b: &Shape,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    use Shape::{Box, Capsule, Cylinder, HalfSpace, Sphere};
    match (a, b) {
        (Sphere { radius: ra }, Sphere { radius: rb }) => sphere::sphere_sphere(*ra, pose_a, *rb, pose_b, margin, out),
        (Sphere { radius }, Capsule { radius: rb, half_length }) => {
            sphere::sphere_capsule(*radius, pose_a, (*rb, *half_length), pose_b, margin, out)
        }
        (Sphere { radius }, Box { half_extents }) => {
            sphere::sphere_box(*radius, pose_a, half_extents, pose_b, margin, out)
        }
        (Sphere { radius }, HalfSpace) => half_space::sphere(*radius, pose_a, pose_b, margin, out),
        (Capsule { radius: ra, half_length: la }, Capsule { radius: rb, half_length: lb }) => {
            capsule::capsule_capsule((*ra, *la), pose_a, (*rb, *lb), pose_b, margin, out)
        }
        (Capsule { radius, half_length }, Box { half_extents }) => {
            capsule::capsule_box((*radius, *half_length), pose_a, half_extents, pose_b, margin, out)
        }
        (Capsule { radius, half_length }, HalfSpace) => {
            half_space::capsule((*radius, *half_length), pose_a, pose_b, margin, out)
        }
        (Box { half_extents: ha }, Box { half_extents: hb }) => box_box::box_box(ha, pose_a, hb, pose_b, margin, out),
        (Box { half_extents }, HalfSpace) => half_space::cuboid(half_extents, pose_a, pose_b, margin, out),
        (HalfSpace, HalfSpace) => {}
        (Cylinder(c), HalfSpace) => cylinder::half_space((c.radius(), c.half_length()), pose_a, pose_b, margin, out),
        _ if mode == ContactMode::Surface && part_count(a) == 1 && part_count(b) == 1 => {
            with_body(a, 0, &mut |a| with_body(b, 0, &mut |b| sdf_contact::contacts(a, pose_a, b, pose_b, margin, out)))
        }
        _ if mode == ContactMode::Surface && part_count(a) > 0 && part_count(b) > 0 => {
            parts::contacts_of_parts(a, pose_a, b, pose_b, margin, out)
        }
        _ => match (a.tree(), b.tree()) {
            (Some(tree_a), Some(tree_b)) => tree::tree_tree(tree_a, pose_a, tree_b, pose_b, margin, out),
            (Some(tree_a), None) => tree::tree_primitive(tree_a, pose_a, b, pose_b, margin, out),
            // the ranks exclude all other combinations
            _ => debug_assert!(false, "pair out of order"),
        },
    }
}

/// Returns the number of surfaces of a shape: several for a mesh of overlapping shells, none for
/// other meshes that cross themselves.
fn part_count(shape: &Shape) -> usize {
    if let Shape::Mesh(mesh) = shape { mesh.surfaces().len() } else { 1 }
}

/// Calls `visit` with the data of a shape, or of one part of it, for the `surface` mode.
fn with_body(shape: &Shape, part: usize, visit: &mut dyn FnMut(&Body)) {
    let radius = shape.bounding_radius();
    let mut call =
        |elements: BodyElements, field: &dyn DistanceField| visit(&Body { elements, field, mesh: None, radius });
    match shape {
        Shape::HalfSpace => call(BodyElements::Empty, &HalfSpaceField),
        Shape::Sphere { radius } => call(
            BodyElements::Round { radius: *radius, half_length: 0.0 },
            &RoundField { radius: *radius, half_length: 0.0 },
        ),
        Shape::Capsule { radius, half_length } => {
            let (radius, half_length) = (*radius, *half_length);
            call(BodyElements::Round { radius, half_length }, &RoundField { radius, half_length })
        }
        Shape::Box { half_extents } => call(BodyElements::Box(*half_extents), &BoxField { half: *half_extents }),
        Shape::Cylinder(c) => {
            let (radius, half_length) = (c.radius(), c.half_length());
            call(BodyElements::Cylinder { radius, half_length }, &CylinderField { radius, half_length })
        }
        Shape::Mesh(mesh) => {
            let Some(surface) = mesh.surfaces().get(part) else { return };
            let elements = BodyElements::Mesh(&surface.elements);
            visit(&Body { elements, field: &surface.field, mesh: Some(&surface.field), radius })
        }
    }
}
