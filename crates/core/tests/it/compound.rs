//! Bodies of several shapes, against the same body as one shape and against closed forms.

use crate::common::*;
use tumble_core::collide::{CompoundPart, Pose, Quat, Shape, Vec3};
use tumble_core::*;

fn part(shape: Shape, at: [f64; 3]) -> CompoundPart {
    CompoundPart::new(shape, Pose::translation(at[0], at[1], at[2]))
}

/// Returns a box of 0.4, 0.3 and 0.2 m, whole and as two boxes of different sizes.
fn whole_and_divided() -> [Shape; 2] {
    let size = |x: f64| Shape::cuboid(Vec3::new(x, 0.3, 0.2)).unwrap();
    [size(0.4), Shape::compound(vec![part(size(0.1), [-0.15, 0.0, 0.0]), part(size(0.3), [0.05, 0.0, 0.0])]).unwrap()]
}

#[test]
fn a_divided_box_moves_as_the_whole() {
    for stepper in STEPPERS {
        let run = |shape: Shape| {
            let mut world = world(stepper, 1.0 / 240.0);
            ground(&mut world, 0.0, 0.3);
            let turn = Quat::from_euler_angles(0.0, 0.0, 0.4);
            let body = RigidBody::new(shape).with_pose(Pose::from_parts(Vec3::new(0.0, 0.0, 0.1).into(), turn));
            let id = world.add(body.with_velocity(Vec3::new(2.0, 0.5, 0.0))).unwrap();
            (0..240).for_each(|_| {
                world.step().unwrap();
            });
            let body = world.body(id).unwrap();
            (body.position(), body.orientation())
        };
        let [(p, q), (r, s)] = whole_and_divided().map(run);
        assert!((p - r).norm() < 1e-5 && q.angle_to(&s) < 1e-4, "{stepper}: {p:?} {r:?}");
        // it slid v²/(2 μ g) far, with the geometric mean of both frictions
        let way = 4.25 / (2.0 * (0.3_f64 * 0.5).sqrt() * world(stepper, 0.1).settings().gravity.norm());
        assert!((r.xy().norm() - way).abs() < 0.01 * way, "{stepper}: {r:?}, not {way} m");
    }
}

/// A T of two boxes on a slope edge: it tips over only if its center of mass is beyond the support.
#[test]
fn a_hammer_stands_by_its_center_of_mass() {
    let head = || Shape::cuboid(Vec3::new(0.1, 0.1, 0.1)).unwrap();
    let tumbles = |density: f64| {
        let foot = part(head(), [0.0, 0.0, 0.05]).with_density(1000.0);
        let arm = part(head(), [0.1, 0.0, 0.15]).with_density(density);
        let mut world = world("time_stepping", 1.0 / 240.0);
        ground(&mut world, 0.0, 0.8);
        let id = world.add(RigidBody::new(Shape::compound(vec![foot, arm]).unwrap())).unwrap();
        (0..240).for_each(|_| {
            world.step().unwrap();
        });
        world.body(id).unwrap().orientation().angle() > 0.5
    };
    // the center is at x = 0.1 ρ/(ρ + 1000), and the foot ends at 0.05 m
    assert!(!tumbles(950.0) && tumbles(1050.0));
}

#[test]
fn parts_with_densities_give_the_mass() {
    let ball = |x: f64, density: f64| part(Shape::sphere(0.1).unwrap(), [x, 0.0, 0.0]).with_density(density);
    let bell = Shape::compound(vec![ball(0.0, 1000.0), ball(0.4, 3000.0)]).unwrap();
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    let body = RigidBody::new(bell.clone());
    assert!((body.mass() - 4000.0 * volume).abs() < 1e-9 && (body.center_of_mass().x - 0.3).abs() < 1e-12);
    // a mass, or a density, is that of the whole; the parts keep their ratio
    let heavy = RigidBody::new(bell.clone()).with_mass(8.0);
    let ratio = 8.0 / (4000.0 * volume);
    assert!((heavy.inertia() - body.inertia() * ratio).norm() < 1e-12 * ratio);
    assert!((RigidBody::new(bell).with_density(500.0).mass() - 1000.0 * volume).abs() < 1e-9);
}

#[test]
fn queries_see_the_parts() {
    let ball = |x: f64| part(Shape::sphere(0.1).unwrap(), [x, 0.0, 0.0]);
    let mut world = world("time_stepping", 1.0 / 240.0);
    let bell = Shape::compound(vec![ball(-0.3), ball(0.3)]).unwrap();
    let id = world.add(RigidBody::new(bell).with_pose(Pose::translation(0.0, 0.0, 1.0))).unwrap();
    let filter = QueryFilter::default();
    let down = |x: f64| {
        world.cast_ray(&Ray { origin: Vec3::new(x, 0.0, 3.0), direction: -Vec3::z(), max_distance: 10.0 }, &filter)
    };
    let hit = down(0.3).unwrap();
    assert!((hit.distance - 1.9).abs() < 1e-9 && hit.id == id && (hit.shape, hit.face) == (1, 0));
    assert!(down(0.0).is_none());
    let cast =
        world.cast_shape(&Shape::sphere(0.25).unwrap(), &Pose::translation(0.0, 0.0, 3.0), &-Vec3::z(), 10.0, &filter);
    // the centers are 0.35 m apart when it touches both
    let expected = 2.0 - (0.35_f64.powi(2) - 0.09).sqrt();
    assert!((cast.unwrap().distance - expected).abs() < 1e-6);
}
