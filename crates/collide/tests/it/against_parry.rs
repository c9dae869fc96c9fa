//! Contacts compared with parry's distances and penetration depths, over thousands of seeded random
//! poses.
//!
//! Tolerances: parry's GJK and EPA end at about 1e-6 of the size. So exact pairs are compared to
//! 1e-5 m on shapes of about 1 m, and normals to 1e-2, since a distance with error ε has a normal
//! with error √ε. Box on box (and a capsule's core inside a box) prefers a face over a pair of
//! edges by `1e-3 · smallest half extent + 5 %`, so there the depth can exceed the minimum by that.

use crate::rng::Rng;
use parry3d_f64::math::{Pose as ParryPose, Rotation, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Capsule, Cuboid, HalfSpace, Segment, Shape as ParryShape};
use tumble_collide::{Contact, Pose, Quat, Shape, Vec3, contacts};

pub fn to_parry(pose: &Pose) -> ParryPose {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    ParryPose::from_parts(vector(&t), Rotation::from_xyzw(q.x, q.y, q.z, q.w))
}

pub fn vector(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// The same primitive in both libraries.
struct Both {
    ours: Shape,
    theirs: Box<dyn ParryShape>,
    least: f64,
}

fn random_primitive(rng: &mut Rng, kind: usize) -> Both {
    let mut size = || rng.between(0.2, 0.8);
    match kind {
        0 => {
            let r = size();
            Both { ours: Shape::sphere(r).unwrap(), theirs: Box::new(Ball::new(r)), least: r }
        }
        1 => {
            let (r, l) = (0.5 * size(), size());
            Both { ours: Shape::capsule(r, 2.0 * l).unwrap(), theirs: Box::new(Capsule::new_z(l, r)), least: r }
        }
        2 => {
            let half = Vec3::new(size(), size(), size());
            Both {
                ours: Shape::cuboid(2.0 * half).unwrap(),
                theirs: Box::new(Cuboid::new(vector(&half))),
                least: half.min(),
            }
        }
        _ => Both { ours: Shape::half_space(), theirs: Box::new(HalfSpace::new(Vector::Z)), least: f64::INFINITY },
    }
}

/// Returns a pose of the second shape: any, nearly aligned or exactly aligned with the axes, as in
/// stacks.
fn related_pose(rng: &mut Rng, case: usize) -> Pose {
    let any = rng.pose(1.2);
    let turn = match case % 3 {
        0 => any.rotation,
        1 => Quat::from_scaled_axis(rng.direction() * 1e-3),
        _ => Quat::from_scaled_axis(Vec3::ith(rng.below(3), std::f64::consts::FRAC_PI_2)),
    };
    Pose::from_parts(any.translation, turn)
}

const MARGIN: f64 = 0.25;

fn find_contacts(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose) -> Vec<Contact> {
    let mut out = Vec::new();
    contacts(a, pa, b, pb, MARGIN, &mut out);
    for c in &out {
        assert!(
            (c.normal.norm() - 1.0).abs() < 1e-9 && c.gap <= MARGIN && c.point.iter().all(|x| x.is_finite()),
            "{c:?}"
        );
    }
    out
}

fn deepest(found: &[Contact]) -> Option<&Contact> {
    found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap))
}

/// Returns signed distance and normal (towards A) by parry: GJK if separated, EPA if not; for a
/// half-space the support point (its `contact` of a sphere with a half-space is wrong if the center
/// is inside).
fn reference(a: &Both, pa: &Pose, b: &Both, pb: &Pose) -> (f64, Option<Vec3>) {
    if matches!(a.ours, Shape::HalfSpace) {
        let (distance, normal) = reference(b, pb, a, pa);
        return (distance, normal.map(|n| -n));
    }
    if matches!(b.ours, Shape::HalfSpace) {
        let normal = pb.rotation * Vec3::z();
        let lowest = a.theirs.as_support_map().unwrap().support_point(&to_parry(pa), vector(&-normal));
        return (normal.dot(&(Vec3::new(lowest.x, lowest.y, lowest.z) - pb.translation.vector)), Some(normal));
    }
    let (pa, pb) = (to_parry(pa), to_parry(pb));
    if let (Shape::Capsule { radius: ra, half_length: la }, Shape::Capsule { radius: rb, half_length: lb }) =
        (&a.ours, &b.ours)
    {
        let core = |l: f64| Segment::new(Vector::Z * -l, Vector::Z * l);
        return (query::distance(&pa, &core(*la), &pb, &core(*lb)).unwrap().distance - ra - rb, None);
    }
    let separate = query::distance(&pa, &*a.theirs, &pb, &*b.theirs).unwrap().distance;
    let contact = query::contact(&pa, &*a.theirs, &pb, &*b.theirs, MARGIN).unwrap();
    match contact {
        Some(c) if separate <= 0.0 => (c.dist, None),
        Some(c) => (separate, Some(-Vec3::new(c.normal1.x, c.normal1.y, c.normal1.z))),
        None => (separate, None),
    }
}

#[test]
fn primitives_agree_with_parry() {
    let mut counts = [[0_u32; 3]; 16];
    for kinds in 0..16 {
        let (ka, kb) = (kinds / 4, kinds % 4);
        if ka == 3 && kb == 3 {
            continue;
        }
        let mut rng = Rng::new(100 + kinds as u64);
        for case in 0..1500 {
            let (a, b) = (random_primitive(&mut rng, ka), random_primitive(&mut rng, kb));
            let (pa, pb) = (related_pose(&mut rng, 2 * (case % 2)), related_pose(&mut rng, case));
            compare(&a, &pa, &b, &pb, ka, kb, case, &mut counts[kinds]);
        }
        let [apart, near, deep] = counts[kinds];
        assert!(near > 50 && deep > 50, "kinds {ka} {kb}: too few cases ({apart}, {near}, {deep})");
    }
}

#[allow(clippy::too_many_arguments)]
fn compare(a: &Both, pa: &Pose, b: &Both, pb: &Pose, ka: usize, kb: usize, case: usize, counts: &mut [u32; 3]) {
    let label = format!("kinds {ka} {kb}, case {case}: {:?} at {pa:?}, {:?} at {pb:?}", a.ours, b.ours);
    let found = find_contacts(&a.ours, pa, &b.ours, pb);
    let (distance, normal) = reference(a, pa, b, pb);
    let Some(contact) = deepest(&found) else {
        assert!(distance > MARGIN - 1e-5, "missed {distance}: {label}");
        counts[0] += 1;
        return;
    };
    let clipped = ka.max(kb) == 2 && ka.min(kb) >= 1;
    let bias = if clipped { 1e-3 * a.least.min(b.least) + 0.05 * distance.abs() } else { 0.0 };
    assert!(
        (contact.gap - distance).abs() < 1e-5 + 1.2 * bias,
        "gap {} but {distance}: {label}\n{found:?}",
        contact.gap
    );
    if distance > 1e-4 {
        counts[1] += 1;
        let exact = normal.filter(|_| !clipped);
        if let Some(normal) = exact {
            assert!((contact.normal - normal).norm() < 1e-2, "normal {:?} but {normal:?}: {label}", contact.normal);
        }
    } else {
        counts[2] += 1;
    }
    // a translation along the normal by the depth separates the shapes: checks normal, sign and
    // depth together
    let moved = |by: f64| Pose::from_parts((pa.translation.vector + contact.normal * by).into(), pa.rotation);
    let apart = reference(a, &moved(0.01 - contact.gap), b, pb).0;
    assert!(apart > 0.009 - bias, "normal {:?} gap {} leaves {apart}: {label}", contact.normal, contact.gap);
}

#[test]
fn exchanging_the_shapes_mirrors_the_contacts() {
    let mut rng = Rng::new(5);
    for case in 0..2000 {
        let (ka, kb) = (rng.below(4), rng.below(4));
        let (a, b) = (random_primitive(&mut rng, ka), random_primitive(&mut rng, kb));
        let (pa, pb) = (rng.pose(1.0), rng.pose(1.0));
        let (ab, ba) = (find_contacts(&a.ours, &pa, &b.ours, &pb), find_contacts(&b.ours, &pb, &a.ours, &pa));
        if let (Some(x), Some(y)) = (deepest(&ab), deepest(&ba)) {
            assert!((x.gap - y.gap).abs() < 1e-3 + 0.05 * x.gap.abs(), "case {case}");
            if ka != kb {
                assert!((x.normal + y.normal).norm() < 1e-12 && (x.point - y.point).norm() < 1e-12, "case {case}");
            }
        }
    }
}

/// Returns the distance from a shape's surface by parry, inside or out.
fn off_surface(shape: &Both, pose: &Pose, point: &Vec3) -> f64 {
    let local = pose.inverse_transform_point(&(*point).into()).coords;
    if matches!(shape.ours, Shape::HalfSpace) {
        return local.z.abs();
    }
    let projection = shape.theirs.project_local_point(vector(&local), false).point;
    (Vec3::new(projection.x, projection.y, projection.z) - local).norm()
}

#[test]
fn points_are_midway_between_the_surfaces() {
    let mut rng = Rng::new(77);
    let mut met = 0;
    for case in 0..15_000 {
        let (ka, kb) = (rng.below(4), rng.below(4));
        let (a, b) = (random_primitive(&mut rng, ka), random_primitive(&mut rng, kb));
        let (pa, pb) = (related_pose(&mut rng, 2 * (case % 2)), related_pose(&mut rng, case));
        // shallow contacts: the far side of a deep one can be beyond the extent of a face
        let found = find_contacts(&a.ours, &pa, &b.ours, &pb);
        let least = deepest(&found).map_or(0.0, |c| c.gap);
        for c in found.iter().filter(|c| c.gap.abs() < 0.05) {
            let (on_a, on_b) = (c.point + c.normal * (0.5 * c.gap), c.point - c.normal * (0.5 * c.gap));
            let (off_a, off_b) = (off_surface(&a, &pa, &on_a), off_surface(&b, &pb, &on_b));
            // one side is exact; the other can be beyond the edge of a face by the slop of the
            // clipping, or in the plane of a face that a slightly tilted edge or end crosses (the
            // end of the part of a tilted capsule over a face is neither)
            let exact = if (ka, kb) == (1, 2) || (ka, kb) == (2, 1) { 2e-3 } else { 1e-6 };
            assert!(off_a.min(off_b) < exact, "kinds {ka} {kb}, case {case}: {off_a} {off_b} {c:?}");
            // a capsule's upper end is a sphere within the cylinder, so only the deepest contact
            // must lie on both surfaces
            assert!(
                c.gap > least || off_a.max(off_b) < 2e-3 + 0.2 * c.gap.abs(),
                "kinds {ka} {kb}, case {case}: {off_a} {off_b} {c:?}"
            );
            let (core_a, core_b) = (on_a + c.normal * c.core_a, on_b - c.normal * c.core_b);
            let axis_of = |shape: &Both, pose: &Pose, p: &Vec3| match shape.ours {
                Shape::Sphere { .. } => (p - pose.translation.vector).norm(),
                Shape::Capsule { half_length, .. } => {
                    let q = pose.inverse_transform_point(&(*p).into()).coords;
                    (q - Vec3::z() * q.z.clamp(-half_length, half_length)).norm()
                }
                _ => 0.0,
            };
            assert!(
                axis_of(&a, &pa, &core_a) < 1e-9 && axis_of(&b, &pb, &core_b) < 1e-9,
                "kinds {ka} {kb}, case {case}: {c:?}"
            );
            met += 1;
        }
    }
    assert!(met > 1000, "{met}");
}

#[test]
fn features_of_a_pair_are_distinct_and_persistent() {
    let mut rng = Rng::new(31);
    let (mut kept, mut total) = (0, 0);
    for case in 0..3000 {
        let (ka, kb) = (rng.below(3), rng.below(4));
        let (a, b) = (random_primitive(&mut rng, ka), random_primitive(&mut rng, kb));
        let (pa, pb) = (related_pose(&mut rng, 2 * (case % 2)), related_pose(&mut rng, case));
        let before = find_contacts(&a.ours, &pa, &b.ours, &pb);
        let mut names: Vec<u64> = before.iter().map(|c| c.feature).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), before.len(), "kinds {ka} {kb}, case {case}: {before:?}");
        // the motion of a resting body in one step: a millionth of a meter and of a radian
        let nudge = Quat::from_scaled_axis(rng.vec(1e-6));
        let nudged = Pose::from_parts((pa.translation.vector + rng.vec(1e-6)).into(), nudge * pa.rotation);
        let after = find_contacts(&a.ours, &nudged, &b.ours, &pb);
        total += before.len();
        kept += after.iter().filter(|c| names.binary_search(&c.feature).is_ok()).count();
    }
    assert!(kept as f64 > 0.99 * total as f64, "{kept} of {total}");
}
