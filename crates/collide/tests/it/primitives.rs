//! Narrow phase and mass of primitives against closed forms.

use tumble_collide::{Contact, NormalFrom, Pose, Shape, ShapeError, Vec3, contacts};

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

fn turned(x: f64, y: f64, z: f64, axis_angle: Vec3) -> Pose {
    Pose::new(Vec3::new(x, y, z), axis_angle)
}

fn query(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose, margin: f64) -> Vec<Contact> {
    let mut out = Vec::new();
    contacts(a, pa, b, pb, margin, &mut out);
    out
}

#[test]
fn sphere_on_half_space() {
    let found = query(&Shape::sphere(0.5).unwrap(), &at(1.0, 2.0, 0.49), &Shape::half_space(), &at(0.0, 0.0, 0.0), 0.0);
    assert_eq!(found.len(), 1);
    let c = found[0];
    assert!((c.gap + 0.01).abs() < 1e-15 && (c.normal - Vec3::z()).norm() < 1e-15);
    assert!((c.point - Vec3::new(1.0, 2.0, -0.005)).norm() < 1e-15);
    assert_eq!((c.core_a, c.core_b, c.normal_from), (0.5, 0.0, NormalFrom::FaceOfB));
    let swapped =
        query(&Shape::half_space(), &at(0.0, 0.0, 0.0), &Shape::sphere(0.5).unwrap(), &at(1.0, 2.0, 0.49), 0.0);
    assert_eq!((swapped[0].normal, swapped[0].core_b, swapped[0].normal_from), (-c.normal, 0.5, NormalFrom::FaceOfA));
}

#[test]
fn box_rests_on_box_on_four_corners_with_persistent_features() {
    let shape = Shape::cuboid(Vec3::new(1.0, 1.0, 1.0)).unwrap();
    let mut names = None;
    for step in 0..20 {
        let wobble = 1e-4 * f64::from(step % 5 - 2);
        let upper = turned(wobble, -wobble, 0.999, Vec3::new(wobble, 0.5 * wobble, -wobble));
        let found = query(&shape, &upper, &shape, &at(0.0, 0.0, 0.0), 0.01);
        assert_eq!(found.len(), 4, "step {step}: {found:?}");
        for c in &found {
            assert!((c.gap + 0.001).abs() < 3e-4 && (c.normal - Vec3::z()).norm() < 1e-3);
            assert!((c.point.x.abs() - 0.5).abs() < 2e-3 && (c.point.y.abs() - 0.5).abs() < 2e-3);
        }
        let mut features: Vec<u64> = found.iter().map(|c| c.feature).collect();
        features.sort_unstable();
        assert_eq!(*names.get_or_insert_with(|| features.clone()), features, "step {step}");
    }
}

#[test]
fn crossed_edges_give_one_contact() {
    // both rotated by 45° so that an edge along x crosses an edge along y at height 0
    let shape = Shape::cuboid(Vec3::new(2.0, 2.0, 2.0)).unwrap();
    let quarter = std::f64::consts::FRAC_PI_4;
    for (gap, margin) in [(-0.02, 0.0), (0.02, 0.05)] {
        let height = 2.0 * 2.0_f64.sqrt() + gap;
        let found = query(
            &shape,
            &turned(0.0, 0.0, height, Vec3::x() * quarter),
            &shape,
            &turned(0.0, 0.0, 0.0, Vec3::y() * quarter),
            margin,
        );
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].gap - gap).abs() < 1e-12 && (found[0].normal - Vec3::z()).norm() < 1e-12);
        assert!((found[0].point - Vec3::z() * (2.0_f64.sqrt() + 0.5 * gap)).norm() < 1e-12);
        assert_eq!(found[0].normal_from, NormalFrom::Edges);
    }
}

#[test]
fn separated_corners_give_the_line_between_them() {
    let shape = Shape::cuboid(Vec3::new(2.0, 2.0, 2.0)).unwrap();
    let found = query(&shape, &at(2.01, 2.02, 2.02), &shape, &at(0.0, 0.0, 0.0), 0.05);
    assert_eq!(found.len(), 1);
    assert!((found[0].gap - 0.03).abs() < 1e-12);
    assert!((found[0].normal - Vec3::new(1.0, 2.0, 2.0) / 3.0).norm() < 1e-9);
    assert_eq!(found[0].normal_from, NormalFrom::CorePoints);
}

#[test]
fn capsules_lying_down_rest_on_two_points() {
    let capsule = Shape::capsule(0.2, 1.0).unwrap();
    let lying = turned(0.0, 0.0, 0.699, Vec3::y() * std::f64::consts::FRAC_PI_2);
    let on_box = query(&capsule, &lying, &Shape::cuboid(Vec3::new(4.0, 4.0, 1.0)).unwrap(), &at(0.0, 0.0, 0.0), 0.0);
    assert_eq!(on_box.len(), 2);
    let on_capsule =
        query(&capsule, &lying, &capsule, &turned(0.25, 0.0, 0.3, Vec3::y() * std::f64::consts::FRAC_PI_2), 0.0);
    assert_eq!(on_capsule.len(), 2);
    for c in on_box.iter().chain(&on_capsule) {
        assert!((c.gap + 0.001).abs() < 1e-12 && (c.normal - Vec3::z()).norm() < 1e-9, "{c:?}");
    }
    let mut x: Vec<f64> = on_capsule.iter().map(|c| c.point.x).collect();
    x.sort_by(f64::total_cmp);
    assert!((x[0] + 0.25).abs() < 1e-9 && (x[1] - 0.5).abs() < 1e-9);
}

#[test]
fn coincident_centers_give_a_finite_normal() {
    let shapes = [
        Shape::sphere(0.5).unwrap(),
        Shape::cuboid(Vec3::new(1.0, 1.0, 1.0)).unwrap(),
        Shape::capsule(0.3, 0.8).unwrap(),
        Shape::half_space(),
    ];
    for a in &shapes {
        for b in &shapes {
            let found = query(a, &at(0.0, 0.0, 0.0), b, &at(0.0, 0.0, 0.0), 0.01);
            if !matches!((a, b), (Shape::HalfSpace, Shape::HalfSpace)) {
                assert!(!found.is_empty(), "{a:?} {b:?}");
            }
            for c in found {
                assert!(
                    c.gap < 0.011 && (c.normal.norm() - 1.0).abs() < 1e-12 && c.point.norm() < 2.0,
                    "{a:?} {b:?} {c:?}"
                );
            }
        }
    }
}

#[test]
fn mass_of_a_capsule_is_a_tube_and_a_sphere() {
    // r = 1, l = 1, ρ = 3/π: tube 6, sphere 4; Izz = 6/2 + 8/5; Ixx = 6(1/4 + 1/3) + 4(2/5 + 1 +
    // 3/4)
    let mass = Shape::capsule(1.0, 2.0).unwrap().mass_properties(3.0 / std::f64::consts::PI).unwrap();
    assert!((mass.mass - 10.0).abs() < 1e-12);
    assert!((mass.inertia[(2, 2)] - 4.6).abs() < 1e-12);
    assert!((mass.inertia[(0, 0)] - 12.1).abs() < 1e-12);
    assert!((mass.inertia_about(&Vec3::new(0.0, 0.0, 2.0))[(0, 0)] - 52.1).abs() < 1e-12);
}

#[test]
fn bad_numbers_are_refused() {
    assert!(matches!(Shape::sphere(-1.0), Err(ShapeError::Length { .. })));
    assert!(matches!(
        Shape::cuboid(Vec3::new(2.0, f64::NAN, 2.0)),
        Err(ShapeError::Length { what: "size y of a box", .. })
    ));
    assert!(matches!(Shape::capsule(1.0, f64::INFINITY), Err(ShapeError::Length { .. })));
    assert_eq!(Shape::half_space().mass_properties(1.0), Err(ShapeError::Unbounded));
    assert_eq!(Shape::sphere(1.0).unwrap().mass_properties(0.0), Err(ShapeError::Density(0.0)));
}

#[test]
fn half_space_boxes_are_bounded_only_along_an_axis() {
    let down = turned(0.0, 0.0, 3.0, Vec3::x() * std::f64::consts::PI);
    let b = Shape::half_space().aabb(&down);
    assert!((b.min.z - 3.0).abs() < 1e-12 && b.max.z == f64::INFINITY && b.max.x == f64::INFINITY);
    let tilted = Shape::half_space().aabb(&turned(0.0, 0.0, 3.0, Vec3::x() * 0.3));
    assert_eq!((tilted.min.z, tilted.max.z), (f64::NEG_INFINITY, f64::INFINITY));
}

/// Regression test: the clipped face was beyond the margin while an edge was within it, and no
/// contact was found.
#[test]
fn an_edge_just_within_the_margin_is_not_missed() {
    let a = Shape::cuboid(Vec3::new(1.4168727883051754, 0.6233772015994125, 1.2295017198575758)).unwrap();
    let b = Shape::cuboid(Vec3::new(1.1174804145274588, 0.5326487252044723, 0.8885734821960298)).unwrap();
    let pose = |t: [f64; 3], q: [f64; 4]| {
        let turn = tumble_collide::Quat::from_quaternion(nalgebra::Quaternion::new(q[3], q[0], q[1], q[2]));
        Pose::from_parts(Vec3::from(t).into(), turn)
    };
    let half = 0.5_f64.sqrt();
    let pa = pose([-0.28506705895931617, -0.8226228327209517, 0.8337004198232256], [0.0, half, 0.0, half]);
    let pb = pose(
        [1.1246411521982, -0.858834330925359, 0.5933296584661905],
        [-0.15076780093591483, 0.7528104013401922, -0.07687487866034155, 0.6361099141389992],
    );
    let found = query(&a, &pa, &b, &pb, 0.25);
    // parry: 0.24936547
    assert!(found.len() == 1 && (found[0].gap - 0.24936547).abs() < 1e-6, "{found:?}");
}

/// A box that is tilted by an angle about two axes meets a face with one corner. The other corners
/// of its lower side are contacts too if they are within the margin, with their distances from the
/// face.
#[test]
fn corners_of_a_tilted_box_follow_the_one_that_touches() {
    let (base, cube) = (Shape::cuboid(Vec3::new(2.0, 2.0, 1.0)).unwrap(), Shape::cuboid(Vec3::repeat(0.2)).unwrap());
    for angle in [1e-4, 1e-3, 0.01, 0.1, 0.3] {
        for gap in [-1e-4, 1e-5, 0.01] {
            let tilt = Vec3::new(angle, -0.7 * angle, 0.0);
            let corners = |pose: &Pose| {
                [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]]
                    .map(|[x, y]| pose * nalgebra::Point3::new(0.1 * x, 0.1 * y, -0.1))
            };
            let lowest = corners(&turned(0.0, 0.0, 0.0, tilt)).iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
            let pose = turned(0.3, 0.2, 0.5 - lowest + gap, tilt);
            let found = query(&cube, &pose, &base, &at(0.0, 0.0, 0.0), 0.2);
            assert_eq!(found.len(), 4, "angle {angle}, gap {gap}: {found:?}");
            for corner in corners(&pose) {
                let near = found.iter().find(|c| (c.point.xy() - corner.xy().coords).norm() < 1e-3 + 0.5 * angle * 0.2);
                let contact =
                    near.unwrap_or_else(|| panic!("angle {angle}, gap {gap}: no contact at {corner}: {found:?}"));
                assert!((contact.gap - (corner.z - 0.5)).abs() < 1e-3 * angle, "{contact:?} at {corner}");
            }
        }
    }
}
