//! The narrow phase: contacts between two shapes at given poses, with one file per family of pairs.

mod box_box;
mod box_closest;
mod box_pair;
mod capsule;
mod clip;
mod compound;
mod curved;
mod cylinder;
mod half_space;
mod parts;
mod push_out;
mod reduce;
mod rounded;
mod sdf_contact;
mod segment;
mod sphere;
mod tree;

use crate::sdf::DistanceField;
use crate::sdf::curved::{ConeField, EllipsoidField};
use crate::sdf::primitive::{BoxField, CylinderField, HalfSpaceField, RoundField};
use crate::shape::Cone;
use crate::{Contact, ContactMode, Pose, Shape, SurfacePoint, Vec3};
use push_out::Place;
use sdf_contact::{Body, BodyElements};

/// Calls [`contacts_in_mode`] with the default mode, `surface`.
pub fn contacts(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    contacts_in_mode(ContactMode::Surface, a, pose_a, b, pose_b, margin, out);
}

/// Appends to `out` all contacts between `a` and `b` whose gap is at most `margin` meters (`margin
/// ≥ 0`).
///
/// **Normals point from B towards A.** Exact among half-space, sphere, box and capsule, and for a
/// cylinder, an ellipsoid and a cone on a half-space. For meshes and other pairs with cylinders the
/// mode applies: see [`ContactMode`]. All other pairs collide by their surfaces, and rounded shapes by
/// their cores. Manifolds are reduced to the few points that matter. Allocates only for the
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
    if let Some(side) = compound::Side::of(a, b) {
        return compound::contacts_of_compound(side, mode, (a, pose_a), (b, pose_b), margin, out);
    }
    let first = out.len();
    let push_out = |place: Place, out: &mut Vec<Contact>| {
        mode == ContactMode::Surface && push_out::push_out(place, (a, pose_a), (b, pose_b), margin, out)
    };
    if push_out(Place::Center, out) {
        return;
    }
    contacts_without_push(mode, (a, pose_a), (b, pose_b), margin, out);
    if out.len() == first {
        push_out(Place::Axis, out);
    }
}

/// Appends the contacts of two shapes, both without parts, by their elements and surfaces alone.
fn contacts_without_push(
    mode: ContactMode,
    (a, pose_a): (&Shape, &Pose),
    (b, pose_b): (&Shape, &Pose),
    margin: f64,
    out: &mut Vec<Contact>,
) {
    if a.is_rounded() || b.is_rounded() {
        return rounded::contacts_of_rounded(mode, (a, pose_a), (b, pose_b), margin, out);
    }
    contacts_in_order(mode, (a, pose_a), (b, pose_b), margin, true, out);
}

/// Appends the contacts of two shapes, both without parts and rounding; by the formula of the pair only if
/// `formulas`.
fn contacts_in_order(
    mode: ContactMode,
    (a, pose_a): (&Shape, &Pose),
    (b, pose_b): (&Shape, &Pose),
    margin: f64,
    formulas: bool,
    out: &mut Vec<Contact>,
) {
    let start = out.len();
    let ordered = rank(a) <= rank(b);
    let [(first, pose_first), (second, pose_second)] =
        if ordered { [(a, pose_a), (b, pose_b)] } else { [(b, pose_b), (a, pose_a)] };
    if !(formulas && exact(first, pose_first, second, pose_second, margin, out)) {
        general(mode, first, pose_first, second, pose_second, margin, out);
    }
    if !ordered {
        out[start..].iter_mut().for_each(|c| *c = c.flipped());
    }
}

/// Returns the closest point of a shape's surface, like [`Shape::closest_point`], if it is at most
/// `limit` meters away; by the fields of the `surface` mode, which are built where contacts are.
/// Inside several overlapping shells of a mesh it is a point of one of them. `None` for a mesh that
/// collides by its spheres.
pub fn closest_point_within(shape: &Shape, pose: &Pose, point: &Vec3, limit: f64) -> Option<SurfacePoint> {
    if let Shape::Compound(compound) = shape {
        let parts = compound
            .active_parts()
            .filter_map(|(_, part, own)| closest_point_within(part, &(pose * own), point, limit));
        return parts.min_by(|x, y| x.distance.total_cmp(&y.distance));
    }
    if shape.is_rounded() {
        let (core, radius) = shape.core();
        let found = closest_point_within(&core, pose, point, limit + radius)?;
        let distance = found.distance - radius;
        return Some(SurfacePoint { point: point - found.normal * distance, distance, normal: found.normal, shape: 0 });
    }
    let local = pose.inverse_transform_point(&(*point).into()).coords;
    let mut least: Option<(f64, Vec3)> = None;
    for part in 0..part_count(shape) {
        with_body(shape, part, &mut |body| {
            let nearest = least.map_or(limit, |least| least.0);
            if body.field.bound(&local) <= nearest {
                let hit = body.field.hit(&local, &[], 0.0);
                if hit.nearest <= nearest {
                    least = Some((hit.nearest, hit.normal));
                }
            }
        });
    }
    least.map(|(distance, normal)| {
        let normal = pose.rotation * normal;
        SurfacePoint { point: point - normal * distance, distance, normal, shape: 0 }
    })
}

/// A sum is finite only if all its terms are.
fn is_finite(pose: &Pose) -> bool {
    (pose.translation.vector.sum() + pose.rotation.coords.sum()).is_finite()
}

/// Returns the place of a shape in a pair: the shape of lower rank is A in [`exact`] and
/// [`general`], which know each pair in that order only. Shapes with a sphere tree have rank 0, so
/// in a pair with one tree the tree is A's. All others have a rank of their own, above 0.
fn rank(shape: &Shape) -> u8 {
    match shape {
        Shape::Mesh(_) | Shape::Cylinder(_) => 0,
        Shape::Sphere { .. } => 1,
        Shape::Capsule { .. } => 2,
        Shape::Box { .. } => 3,
        Shape::Ellipsoid { .. } => 4,
        Shape::Cone { .. } => 5,
        Shape::HalfSpace => 6,
        // by their parts and cores
        Shape::Compound(_) | Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => 7,
    }
}

/// Appends the contacts of a pair with a formula of its own, which all modes share. Returns false
/// for other pairs.
fn exact(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) -> bool {
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
        (Shape::Ellipsoid { half_axes }, HalfSpace) => {
            curved::ellipsoid_half_space(half_axes, pose_a, pose_b, margin, out)
        }
        (Shape::Cone { radius, height }, HalfSpace) => {
            let cone = Cone { radius: *radius, height: *height };
            curved::cone_half_space(&cone, pose_a, pose_b, margin, out)
        }
        (Cylinder(c), HalfSpace) => cylinder::half_space((c.radius(), c.half_length()), pose_a, pose_b, margin, out),
        _ => return false,
    }
    true
}

/// Appends the contacts of any pair: by sphere trees in the mode `spheres`, and for a mesh without
/// surfaces; by surfaces otherwise. A pair without trees has surfaces, and collides by them in
/// every mode.
fn general(mode: ContactMode, a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    let has_surfaces = part_count(a) > 0 && part_count(b) > 0;
    let trees = if mode == ContactMode::Surface && has_surfaces { (None, None) } else { (a.tree(), b.tree()) };
    match trees {
        (Some(tree_a), Some(tree_b)) => tree::tree_tree(tree_a, pose_a, tree_b, pose_b, margin, out),
        (Some(tree_a), None) => tree::tree_primitive(tree_a, pose_a, b, pose_b, margin, out),
        (None, _) => by_surfaces(a, pose_a, b, pose_b, margin, out),
    }
}

/// Appends the contacts of the surfaces of two shapes.
fn by_surfaces(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    if part_count(a) == 1 && part_count(b) == 1 {
        with_body(a, 0, &mut |a| with_body(b, 0, &mut |b| sdf_contact::contacts(a, pose_a, b, pose_b, margin, out)));
    } else {
        parts::contacts_of_parts(a, pose_a, b, pose_b, margin, out);
    }
}

/// Returns the number of surfaces of a shape: several for a mesh of overlapping shells, none for
/// other meshes that cross themselves, for compounds and rounded shapes.
fn part_count(shape: &Shape) -> usize {
    match shape {
        Shape::Mesh(mesh) => mesh.surfaces().len(),
        Shape::Compound(_) | Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => 0,
        _ => 1,
    }
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
        Shape::Ellipsoid { half_axes } => {
            call(BodyElements::Ellipsoid(*half_axes), &EllipsoidField { half: *half_axes })
        }
        Shape::Cone { radius, height } => {
            let cone = Cone { radius: *radius, height: *height };
            call(BodyElements::Cone(cone), &ConeField { cone })
        }
        // by their parts and cores
        Shape::Compound(_) | Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ContactMode::{Spheres, Surface};
    use crate::Quat;

    /// The formulas of [`exact`] are the reference: a new shape without a tree has the contacts of
    /// [`general`] beside every primitive.
    #[test]
    fn pairs_without_trees_have_their_contacts_by_surfaces_in_every_mode() {
        let shapes = [
            (Shape::sphere(0.5).unwrap(), 0.5),
            (Shape::capsule(0.3, 0.6).unwrap(), 0.6),
            (Shape::cuboid(Vec3::repeat(1.0)).unwrap(), 0.5),
            (Shape::half_space(), 0.0),
        ];
        let below = Pose::from_parts(Vec3::new(0.3, -0.7, 0.2).into(), Quat::from_euler_angles(0.4, -0.9, 1.3));
        for (i, (a, half_a)) in shapes[..3].iter().enumerate() {
            for (b, half_b) in &shapes[i..] {
                for (mode, gap) in [(Surface, -0.02), (Surface, 0.02), (Spheres, -0.02), (Spheres, 0.02)] {
                    let above = below * Pose::translation(0.0, 0.0, half_a + half_b + gap);
                    let [mut reference, mut found] = [Vec::new(), Vec::new()];
                    assert!(exact(a, &above, b, &below, 0.1, &mut reference));
                    general(mode, a, &above, b, &below, 0.1, &mut found);
                    for contacts in [reference, found] {
                        let least = contacts.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
                        assert!((least - gap).abs() < 1e-12, "{a:?} on {b:?}, {mode:?}, {gap}: {contacts:?}");
                    }
                }
            }
        }
    }
}
