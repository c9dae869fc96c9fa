//! Bodies whose shape is a convex hull: a hull of a box moves as the box, a tetrahedron slides by
//! Coulomb's law.

use crate::common::*;
use tumble_core::collide::{Pose, Quat, Shape, TriMesh, Vec3};
use tumble_core::*;

const SIZE: [f64; 3] = [0.4, 0.3, 0.2];

/// Drops a body that slides and spins, and returns its poses over two seconds.
fn run(stepper: &str, shape: Shape, tilt: f64, friction: f64) -> Vec<(Vec3, Quat)> {
    let mut world = world(stepper, 1.0 / 240.0);
    let material = Material { friction, restitution: 0.0, ..Material::default() };
    world.add_static(RigidBody::fixed(Shape::half_space()).with_name("floor").with_material(material)).unwrap();
    let turn = Quat::from_euler_angles(tilt, 0.5 * tilt, 0.3);
    let body = RigidBody::new(shape)
        .with_material(material)
        .with_pose(Pose::from_parts(Vec3::new(0.0, 0.0, 0.1 + 0.3 * tilt).into(), turn))
        .with_velocity(Vec3::new(2.0, 0.5, 0.0));
    let id = world.add(body).unwrap();
    (0..480)
        .map(|_| {
            world.step().unwrap();
            let pose = world.body(id).unwrap().pose();
            (pose.translation.vector, pose.rotation)
        })
        .collect()
}

#[test]
fn a_hull_of_a_box_moves_as_the_box() {
    let size = Vec3::from(SIZE);
    let mut points = TriMesh::cuboid(size).vertices;
    points.extend([Vec3::zeros(), Vec3::new(0.0, 0.15, 0.0), 0.3 * size]);
    for stepper in STEPPERS {
        // flat, it slides; tilted, it falls over, which magnifies rounding
        for (tilt, friction) in [(0.0, 0.0), (0.0, 0.4), (0.2, 0.4)] {
            let hull = run(stepper, Shape::convex_hull(&points).unwrap(), tilt, friction);
            let cuboid = run(stepper, Shape::cuboid(size).unwrap(), tilt, friction);
            for ((p, q), (x, r)) in hull.into_iter().zip(cuboid) {
                let difference = (p - x).norm().max(q.angle_to(&r));
                let bound = if tilt == 0.0 { 1e-9 } else { 1e-6 };
                assert!(difference < bound, "{stepper}, tilt {tilt}, friction {friction}: {difference:e}");
            }
        }
    }
}

/// `s = g (sin α − μ cos α) t²/2`.
#[test]
fn a_hull_slides_down_a_slope_by_coulombs_law() {
    for stepper in STEPPERS {
        let (slope, friction) = (0.5_f64, 0.3);
        let mut world = world(stepper, 1.0 / 240.0);
        let material = Material { friction, restitution: 0.0, ..Material::default() };
        let tilt = Quat::from_euler_angles(0.0, slope, 0.0);
        let plane = RigidBody::fixed(Shape::plane()).with_name("slope").with_material(material);
        world.add_static(plane.with_pose(Pose::from_parts(Vec3::zeros().into(), tilt))).unwrap();
        let corners = [[0.3, 0.0, 0.0], [-0.2, 0.25, 0.0], [-0.2, -0.25, 0.0], [0.0, 0.0, 0.3]].map(Vec3::from);
        let shape = Shape::convex_hull(&corners).unwrap();
        let pose = Pose::from_parts(Vec3::zeros().into(), tilt);
        let id = world.add(RigidBody::new(shape).with_material(material).with_pose(pose)).unwrap();
        let start = position(&world, id);
        (0..240).for_each(|_| {
            world.step().unwrap();
        });
        let expected = 0.5 * G * (slope.sin() - friction * slope.cos());
        let moved = position(&world, id) - start;
        let along = moved.dot(&(tilt * Vec3::x()));
        assert!((along - expected).abs() < 1e-3 * expected, "{stepper}: {along} {expected}");
        assert!(moved.dot(&(tilt * Vec3::z())).abs() < 1e-6, "{stepper}: it stays on the slope");
    }
}
