//! Contacts against parry's distances and penetration depths, over thousands of seeded random poses.
//!
//! Tolerances. Parry's GJK and EPA end at about 1e-6 of the size, so exact pairs are compared to 1e-5 m on shapes of about 1 m,
//! and normals to 1e-2, since a distance that is good to ε has a normal that is good to √ε. Box on
//! box (and a capsule's core inside a box) prefers a face over a pair of edges by `1e-3 · least half extent + 5 %`, so there the
//! depth may be that much greater than the least one.

use crate::rng::Rng;
use parry3d_f64::math::{Pose as ParryPose, Rotation, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Capsule, Cuboid, HalfSpace, Shape as ParryShape};
use tumble_collide::{Contact, Pose, Shape, Vec3, contacts};

pub fn to_parry(pose: &Pose) -> ParryPose {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    ParryPose::from_parts(vector(&t), Rotation::from_xyzw(q.x, q.y, q.z, q.w))
}

pub fn vector(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// The same primitive here and there.
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
            Both { ours: Shape::capsule(r, l).unwrap(), theirs: Box::new(Capsule::new_z(l, r)), least: r }
        }
        2 => {
            let half = Vec3::new(size(), size(), size());
            Both { ours: Shape::cuboid(half).unwrap(), theirs: Box::new(Cuboid::new(vector(&half))), least: half.min() }
        }
        _ => Both { ours: Shape::half_space(), theirs: Box::new(HalfSpace::new(Vector::Z)), least: f64::INFINITY },
    }
}

/// A pose of the second shape: any, nearly aligned or exactly aligned with the axes, the cases that stacks are made of.
fn related_pose(rng: &mut Rng, case: usize) -> Pose {
    let any = rng.pose(1.2);
    let turn = match case % 3 {
        0 => any.rotation,
        1 => tumble_collide::Quat::from_scaled_axis(rng.direction() * 1e-3),
        _ => tumble_collide::Quat::from_scaled_axis(Vec3::ith(rng.below(3), std::f64::consts::FRAC_PI_2)),
    };
    Pose::from_parts(any.translation, turn)
}

const MARGIN: f64 = 0.25;

fn ask(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose) -> Vec<Contact> {
    let mut out = Vec::new();
    contacts(a, pa, b, pb, MARGIN, &mut out);
    for c in &out {
        assert!((c.normal.norm() - 1.0).abs() < 1e-9 && c.gap <= MARGIN && c.point.iter().all(|x| x.is_finite()), "{c:?}");
    }
    out
}

fn deepest(found: &[Contact]) -> Option<&Contact> {
    found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap))
}

/// Signed distance and normal (towards A) by parry: GJK where separate, EPA where not; for a half-space the support point (its
/// `contact` of a ball with a half-space is wrong once the centre is inside).
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
    let found = ask(&a.ours, pa, &b.ours, pb);
    let (distance, normal) = reference(a, pa, b, pb);
    let Some(contact) = deepest(&found) else {
        assert!(distance > MARGIN - 1e-5, "missed {distance}: {label}");
        counts[0] += 1;
        return;
    };
    let clipped = ka.max(kb) == 2 && ka.min(kb) >= 1;
    let bias = if clipped { 1e-3 * a.least.min(b.least) + 0.05 * distance.abs() } else { 0.0 };
    assert!((contact.gap - distance).abs() < 1e-5 + 1.2 * bias, "gap {} but {distance}: {label}\n{found:?}", contact.gap);
    if distance > 1e-4 {
        counts[1] += 1;
        let exact = normal.filter(|_| !clipped);
        if let Some(normal) = exact {
            assert!((contact.normal - normal).norm() < 1e-2, "normal {:?} but {normal:?}: {label}", contact.normal);
        }
    } else {
        counts[2] += 1;
    }
    // moved along the normal by what the contact says, the shapes come apart: normal, sign and depth in one
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
        let (ab, ba) = (ask(&a.ours, &pa, &b.ours, &pb), ask(&b.ours, &pb, &a.ours, &pa));
        if let (Some(x), Some(y)) = (deepest(&ab), deepest(&ba)) {
            assert!((x.gap - y.gap).abs() < 1e-3 + 0.05 * x.gap.abs(), "case {case}");
            if ka != kb {
                assert!((x.normal + y.normal).norm() < 1e-12 && (x.point - y.point).norm() < 1e-12, "case {case}");
            }
        }
    }
}
