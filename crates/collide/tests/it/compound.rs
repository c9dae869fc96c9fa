//! Compounds: mass properties by closed forms, a divided box against the whole one, parry's compounds.

use crate::against_parry::{to_parry, vector};
use crate::rng::Rng;
use parry3d_f64::query::{self, Ray, RayCast};
use parry3d_f64::shape::{Compound, SharedShape};
use tumble_collide::{
    CompoundPart, Contact, ContactMode, Mat3, Pose, Quat, Shape, ShapeError, TreeSettings, TriMesh, Vec3,
    closest_points, contacts, contacts_in_mode,
};

fn part(shape: Shape, at: [f64; 3]) -> CompoundPart {
    CompoundPart::new(shape, Pose::translation(at[0], at[1], at[2]))
}

/// Returns a box of 0.6, 0.8 and 1 m, and the same one as eight boxes of different sizes, some of
/// them turned by 90°.
fn whole_and_divided() -> [Shape; 2] {
    let (size, cut) = (Vec3::new(0.6, 0.8, 1.0), Vec3::new(0.2, 0.5, 0.3));
    let mut parts = Vec::new();
    for corner in 0..8 {
        let upper = Vec3::from_fn(|k, _| f64::from(corner >> k & 1));
        let low = upper.component_mul(&cut) - 0.5 * size;
        let own = upper.zip_map(&Vec3::from_fn(|k, _| k as f64), |u, k| {
            if u > 0.0 { size[k as usize] - cut[k as usize] } else { cut[k as usize] }
        });
        let turn = if corner % 2 == 0 {
            Quat::identity()
        } else {
            Quat::from_euler_angles(0.0, 0.0, 0.5 * std::f64::consts::PI)
        };
        let turned = (turn.inverse() * own).abs();
        let pose = Pose::from_parts((low + 0.5 * own).into(), turn);
        parts.push(CompoundPart::new(Shape::cuboid(turned).unwrap(), pose));
    }
    [Shape::cuboid(size).unwrap(), Shape::compound(parts).unwrap()]
}

fn least(found: &[Contact]) -> Option<f64> {
    found.iter().map(|c| c.gap).min_by(f64::total_cmp)
}

#[test]
fn a_divided_box_has_the_mass_of_the_whole() {
    let [whole, divided] = whole_and_divided().map(|shape| shape.mass_properties(700.0).unwrap());
    assert!((whole.mass - divided.mass).abs() < 1e-10 && divided.center_of_mass.norm() == 0.0);
    assert!((whole.inertia - divided.inertia).norm() < 1e-10 * whole.inertia.norm(), "{divided:?}");
    let [whole, divided] = whole_and_divided();
    assert!((whole.volume() - divided.volume()).abs() < 1e-14 && divided.center_of_mass().norm() < 1e-14);
    assert!((whole.bounding_radius() - divided.bounding_radius()).abs() < 1e-14);
}

#[test]
fn a_dumbbell_has_the_inertia_of_its_balls() {
    // 1 kg and 3 kg at a distance of 0.8 m: the center of mass is 0.6 m from the lighter one
    let volume = |r: f64| 4.0 / 3.0 * std::f64::consts::PI * r.powi(3);
    let ball =
        |r: f64, mass: f64, z: f64| part(Shape::sphere(r).unwrap(), [0.1, 0.2, z]).with_density(mass / volume(r));
    let shape = Shape::compound(vec![ball(0.1, 1.0, 0.0), ball(0.2, 3.0, 0.8)]).unwrap();
    assert!((shape.center_of_mass() - Vec3::new(0.1, 0.2, 0.6)).norm() < 1e-14);
    let density = shape.own_density().unwrap();
    assert!((density - 4.0 / (volume(0.1) + volume(0.2))).abs() < 1e-9);
    let mass = shape.mass_properties(density).unwrap();
    let spin = 0.4 * (1.0 * 0.01 + 3.0 * 0.04);
    let across = spin + 1.0 * 0.36 + 3.0 * 0.04;
    assert!((mass.mass - 4.0).abs() < 1e-12);
    assert!((mass.inertia - Mat3::from_diagonal(&Vec3::new(across, across, spin))).norm() < 1e-12, "{mass:?}");
    assert!((shape.bounding_radius() - 0.7).abs() < 1e-14);
    // as a part of another compound it keeps its masses
    let outer = Shape::compound(vec![CompoundPart::new(shape, Pose::identity())]).unwrap();
    let again = outer.mass_properties(outer.own_density().unwrap()).unwrap();
    assert!((again.inertia - mass.inertia).norm() < 1e-12 && (again.mass - 4.0).abs() < 1e-12);
}

#[test]
fn a_mesh_is_placed_by_its_own_origin() {
    let corner = TriMesh::cuboid(Vec3::repeat(0.2)).translated(&Vec3::repeat(0.1));
    let mesh = Shape::mesh(corner, &TreeSettings::octree()).unwrap();
    let turn = Quat::from_euler_angles(0.0, 0.0, 0.5 * std::f64::consts::PI);
    let shape = Shape::compound(vec![CompoundPart::new(mesh, Pose::from_parts(Vec3::x().into(), turn))]).unwrap();
    assert!((shape.center_of_mass() - Vec3::new(0.9, 0.1, 0.1)).norm() < 1e-12);
}

#[test]
fn a_divided_box_is_as_far_away_as_the_whole() {
    let [whole, divided] = whole_and_divided();
    let others = [
        Shape::half_space(),
        Shape::sphere(0.3).unwrap(),
        Shape::capsule(0.2, 0.5).unwrap(),
        Shape::cuboid(Vec3::new(0.3, 0.7, 0.4)).unwrap(),
        Shape::cylinder(0.3, 0.5).unwrap(),
        Shape::mesh(TriMesh::cylinder(0.3, 0.6, 7), &TreeSettings::octree()).unwrap(),
        divided.clone(),
    ];
    let (mut rng, mut near) = (Rng::new(5), 0);
    for other in &others {
        // box on box prefers faces over edges by a thousandth of a half extent
        let error = if matches!(other, Shape::Box { .. } | Shape::Compound(_)) { 2e-4 } else { 1e-6 };
        for _ in 0..300 {
            let (at, below) = (rng.pose(0.8), rng.pose(0.2));
            let below =
                if matches!(other, Shape::HalfSpace) { below * Pose::translation(0.0, 0.0, -0.6) } else { below };
            let gap = |shape: &Shape| {
                let mut found = Vec::new();
                contacts(shape, &at, other, &below, 0.1, &mut found);
                least(&found)
            };
            let Some(expected) = gap(&whole).filter(|gap| *gap > 0.0) else { continue };
            near += 1;
            let found = gap(&divided).unwrap_or_else(|| panic!("no contact with {other:?}"));
            assert!((found - expected).abs() < error, "{other:?}: {found}, not {expected}");
        }
    }
    assert!(near > 200, "{near}");
}

/// Contacts inside another part do not count: a box that is pressed into the seam of two boxes has the
/// depth below their common top.
#[test]
fn a_box_over_a_seam_has_the_depth_below_the_top() {
    let block = || Shape::cuboid(Vec3::repeat(1.0)).unwrap();
    let floor = Shape::compound(vec![part(block(), [-0.5, 0.0, -0.5]), part(block(), [0.5, 0.0, -0.5])]).unwrap();
    let center = Pose::from_parts(floor.center_of_mass().into(), Quat::identity());
    for depth in [1e-4, 0.01, 0.1] {
        for x in [-0.3, 0.0, 0.1] {
            let above = Pose::translation(x, 0.0, 0.2 - depth);
            let mut found = Vec::new();
            contacts(&Shape::cuboid(Vec3::repeat(0.4)).unwrap(), &above, &floor, &center, 0.01, &mut found);
            assert!(!found.is_empty());
            for c in &found {
                assert!((c.gap + depth).abs() < 1e-9 && (c.normal - Vec3::z()).norm() < 1e-9, "{x} {depth}: {c:?}");
            }
            let mut features: Vec<u64> = found.iter().map(|c| c.feature).collect();
            features.sort_unstable();
            features.dedup();
            assert_eq!(features.len(), found.len());
        }
    }
}

#[test]
fn rays_points_and_distances_on_a_divided_box_are_those_of_the_whole() {
    let [whole, divided] = whole_and_divided();
    let (mut rng, mut hits) = (Rng::new(6), 0);
    let block = Shape::cuboid(Vec3::repeat(0.2)).unwrap();
    for n in 0..10_000 {
        let (pose, from) = (rng.pose(0.3), rng.vec(2.0));
        let direction = pose.translation.vector + rng.vec(0.6) - from;
        let outside = whole.closest_point(&pose, &from).distance > 1e-6;
        let [a, b] = [&whole, &divided].map(|shape| shape.cast_ray(&pose, &from, &direction, 5.0));
        if outside {
            assert_eq!(a.is_some(), b.is_some(), "{pose:?} {from:?} {direction:?}");
        }
        if let (Some(a), Some(b)) = (a, b) {
            hits += 1;
            assert!((a.distance - b.distance).abs() < 1e-9 && (a.normal - b.normal).norm() < 1e-9);
        }
        let [a, b] = [&whole, &divided].map(|shape| shape.closest_point(&pose, &from));
        if outside {
            assert!((a.distance - b.distance).abs() < 1e-12 && (a.point - b.point).norm() < 1e-9);
        } else {
            assert!(b.distance <= 1e-12);
        }
        if outside && n % 10 == 0 {
            let at = Pose::from_parts(from.into(), rng.pose(1.0).rotation);
            let [a, b] = [&whole, &divided].map(|shape| closest_points(shape, &pose, &block, &at).unwrap().distance);
            assert!(a < 0.0 && b <= 1e-9 || (a - b).abs() < 1e-7, "{a} {b}");
        }
    }
    assert!(hits > 2000, "{hits}");
}

/// A body of a box, a capsule and a ball, overlapping and apart, in both libraries.
fn with_parry() -> (Shape, Compound) {
    let turn = |x: f64, y: f64| Quat::from_euler_angles(x, y, 0.4);
    let poses = [
        Pose::identity(),
        Pose::from_parts(Vec3::new(0.5, 0.1, 0.2).into(), turn(0.5, 1.1)),
        Pose::from_parts(Vec3::new(-0.9, 0.4, 0.3).into(), turn(0.0, 0.3)),
    ];
    let shapes = [
        Shape::cuboid(Vec3::new(0.8, 0.5, 0.3)).unwrap(),
        Shape::capsule(0.15, 0.8).unwrap(),
        Shape::sphere(0.25).unwrap(),
    ];
    let ours = Shape::compound(poses.iter().zip(shapes).map(|(pose, shape)| CompoundPart::new(shape, *pose)).collect())
        .unwrap();
    let center = ours.center_of_mass();
    let own = poses.map(|pose| to_parry(&(nalgebra::Translation3::from(-center) * pose)));
    let theirs = vec![
        (own[0], SharedShape::cuboid(0.4, 0.25, 0.15)),
        (own[1], SharedShape::capsule_z(0.4, 0.15)),
        (own[2], SharedShape::ball(0.25)),
    ];
    (ours, Compound::new(theirs))
}

#[test]
fn compounds_agree_with_parry() {
    let (ours, theirs) = with_parry();
    let ball = Shape::sphere(0.3).unwrap();
    let their_ball = parry3d_f64::shape::Ball::new(0.3);
    let (mut rng, mut apart, mut hits) = (Rng::new(8), 0, 0);
    for _ in 0..4000 {
        let (pose, other) = (rng.pose(0.4), rng.pose(1.5));
        let expected = query::distance(&to_parry(&pose), &theirs, &to_parry(&other), &their_ball).unwrap().distance;
        if expected > 1e-4 {
            apart += 1;
            let mut found = Vec::new();
            contacts(&ours, &pose, &ball, &other, expected + 0.01, &mut found);
            let gap = least(&found).unwrap();
            assert!((gap - expected).abs() < 1e-5, "{gap}, not {expected}");
            let distance = closest_points(&ours, &pose, &ball, &other).unwrap().distance;
            assert!((distance - expected).abs() < 1e-5, "{distance}, not {expected}");
        }
        let from = rng.vec(2.5);
        let direction = (pose.translation.vector + rng.vec(1.0) - from).normalize();
        if ours.closest_point(&pose, &from).distance > 0.0 {
            let ray = Ray::new(vector(&from), vector(&direction));
            let expected = theirs.cast_ray(&to_parry(&pose), &ray, 6.0, true);
            let found = ours.cast_ray(&pose, &from, &direction, 6.0).map(|hit| hit.distance);
            assert_eq!(expected.is_some(), found.is_some(), "{pose:?} {from:?} {direction:?}");
            if let (Some(expected), Some(found)) = (expected, found) {
                hits += 1;
                assert!((expected - found).abs() < 1e-6, "{found}, not {expected}");
            }
        }
    }
    assert!(apart > 1000 && hits > 200, "{apart} {hits}");
}

#[test]
fn boxes_contain_every_part() {
    let (ours, _) = with_parry();
    let many = |n: usize| {
        let ball = |k: usize| part(Shape::sphere(0.1).unwrap(), [k as f64 * 0.15, (k % 3) as f64, 0.0]);
        Shape::compound((0..n).map(ball).collect()).unwrap()
    };
    let mut rng = Rng::new(9);
    for shape in [ours, many(5), many(40)] {
        let Shape::Compound(compound) = &shape else { panic!("a compound") };
        for _ in 0..200 {
            let pose = rng.pose(1.0);
            let bounds = shape.aabb(&pose);
            for (part, own) in compound.placed() {
                let inner = part.aabb(&(pose * own));
                let slack = Vec3::repeat(1e-12);
                assert!(
                    bounds.min.inf(&(inner.min + slack)) == bounds.min
                        && bounds.max.sup(&(inner.max - slack)) == bounds.max
                );
                let reach = (0..8).map(|k| {
                    let pick = |i: usize| if k >> i & 1 == 0 { inner.min[i] } else { inner.max[i] };
                    (Vec3::new(pick(0), pick(1), pick(2)) - pose.translation.vector).norm()
                });
                assert!(compound.bounding_radius() <= reach.fold(0.0, f64::max) + shape.bounding_radius());
            }
        }
    }
}

#[test]
fn both_contact_modes_reach_the_parts() {
    let tube = || Shape::cylinder(0.1, 1.0).unwrap();
    let turn = Quat::from_euler_angles(0.5 * std::f64::consts::PI, 0.0, 0.0);
    let cross = Shape::compound(vec![
        part(tube(), [0.0; 3]),
        CompoundPart::new(tube(), Pose::from_parts(Vec3::zeros().into(), turn)),
    ])
    .unwrap();
    for (mode, error) in [(ContactMode::Surface, 1e-9), (ContactMode::Spheres, 0.02)] {
        let mut found = Vec::new();
        contacts_in_mode(
            mode,
            &cross,
            &Pose::translation(0.0, 0.0, 0.49),
            &Shape::half_space(),
            &Pose::identity(),
            0.05,
            &mut found,
        );
        let gap = least(&found).unwrap();
        assert!((gap + 0.01).abs() < error, "{mode:?}: {gap}");
    }
}

#[test]
fn wrong_parts_are_refused() {
    let ball = || Shape::sphere(0.1).unwrap();
    let error = |parts: Vec<CompoundPart>| Shape::compound(parts).unwrap_err().to_string();
    assert_eq!(error(vec![]), "a compound of 0 parts; it must have 1 to 4096");
    assert_eq!(
        error(vec![part(ball(), [0.0; 3]), part(Shape::half_space(), [0.0; 3])]),
        "part 2 of a compound is a half-space, which is unbounded; make it a static body"
    );
    assert_eq!(error(vec![part(ball(), [f64::NAN, 0.0, 0.0])]), "part 1 of a compound has a pose that is not finite");
    assert_eq!(
        error(vec![part(ball(), [0.0; 3]), part(ball(), [0.0; 3]).with_density(1.0)]),
        "part 2 of a compound has a density, unlike part 1; give all parts one or none"
    );
    let none = part(ball(), [0.0; 3]).with_density(-1.0);
    assert_eq!(Shape::compound(vec![none]).unwrap_err(), ShapeError::Density(-1.0));
    let many = (0..4097).map(|_| part(ball(), [0.0; 3])).collect();
    assert_eq!(error(many), "a compound of 4097 parts; it must have 1 to 4096");
}
