//! The derivative of a step where contacts are redundant or alike: boxes on four corners, rolling friction across the motion.

use crate::common::{ground, sphere};
use crate::linearize::displaced;
use tumble_core::collide::{Pose, Quat, Shape, Vec3};
use tumble_core::{Material, RigidBody, Settings, World};

const FRICTION: f64 = 0.5;

fn world() -> World {
    let mut world = World::new(Settings::default().with_dt(0.005)).unwrap();
    ground(&mut world, 0.0, FRICTION);
    world
}

fn slab(size: [f64; 3], yaw: f64, overlap: f64, velocity: Vec3) -> World {
    let mut world = world();
    let shape = Shape::cuboid(Vec3::from(size)).unwrap();
    let turn = Quat::from_scaled_axis(Vec3::z() * yaw);
    let pose = Pose::from_parts(Vec3::new(0.0, 0.0, 0.5 * size[2] - overlap).into(), turn);
    let material = Material { friction: FRICTION, ..Material::default() };
    world
        .add(RigidBody::new(shape).with_mass(1.0).with_material(material).with_pose(pose).with_velocity(velocity))
        .unwrap();
    world
}

/// One-sided differences of two lengths agree on both sides if the map of a step is smooth, and the derivative is
/// theirs. The solver's tolerance hid which of four corners press, so that it was that of a box on two corners.
#[test]
fn a_box_on_four_corners_has_the_derivative_of_all_of_them() {
    let (mut compared, mut wrong) = (0, Vec::new());
    for size in [[0.2, 0.2, 0.2], [0.2, 0.3, 0.1], [0.3, 0.3, 0.1], [0.1, 0.1, 0.2], [0.4, 0.2, 0.1]] {
        for yaw in [0.0, 0.4] {
            for overlap in [1e-4, 1e-3, 5e-3] {
                for velocity in [Vec3::new(2.0, 0.0, 0.0), Vec3::new(1.3, 0.7, 0.0), Vec3::zeros()] {
                    let world = slab(size, yaw, overlap, velocity);
                    let of = world.linearize().unwrap();
                    let mut end = world.fork();
                    end.step().unwrap();
                    for column in [5, 10, 11] {
                        let slope = |h: f64| displaced(&world, &of, &end, column, h) / h;
                        let sides = [1e-5, -1e-5, 1e-6, -1e-6].map(slope);
                        let largest = sides[0].amax().max(1.0);
                        if sides[1..].iter().any(|side| (side - &sides[0]).amax() > 2e-3 * largest) {
                            continue;
                        }
                        compared += 1;
                        let off = (of.a.column(column) - &sides[0]).amax();
                        if off > 4e-3 * largest {
                            wrong.push(format!("{size:?} {yaw} {overlap} {velocity:?} {column}: {off}"));
                        }
                    }
                }
            }
        }
    }
    println!("{compared} columns");
    assert!(compared > 100 && wrong.is_empty(), "{} of {compared}: {}", wrong.len(), wrong.join("\n"));
}

/// Across its motion a rolling ball has a friction of 0, which grows with the velocity there.
#[test]
fn rolling_friction_across_the_motion_is_that_of_the_direction() {
    for across in [0.0, 0.3] {
        let mut world = world();
        let material = Material { friction: FRICTION, rolling_friction: 0.01, ..Material::default() };
        let ball = RigidBody::new(sphere(0.1)).with_mass(1.0).with_material(material);
        let ball = ball.with_pose(Pose::translation(0.0, 0.0, 0.0999)).with_velocity(Vec3::new(1.0, across, 0.0));
        world.add(ball.with_angular_velocity(Vec3::new(-10.0 * across, 10.0, 0.0))).unwrap();
        let of = world.linearize().unwrap();
        let mut end = world.fork();
        end.step().unwrap();
        // the velocity across by itself, by the spin along the motion, and by a force across
        for (column, h) in [(10, 1e-4), (6, 1e-3), (16, 1e-2)] {
            let difference =
                (displaced(&world, &of, &end, column, h) - displaced(&world, &of, &end, column, -h)) / (2.0 * h);
            let own = if column < 12 { of.a.column(column) } else { of.b.column(column - 12) };
            let off = (own - &difference).amax();
            assert!(off < 1e-5 * difference.amax(), "{across} {column}: {off} of {}", difference.amax());
        }
    }
}

/// At rest some corners are a rounding above the ground and others below: all of them are on one side.
#[test]
fn a_box_at_rest_does_not_tilt_when_it_is_lifted() {
    let mut world = slab([0.2, 0.2, 0.2], 0.0, 0.0, Vec3::zeros());
    world.step().unwrap();
    let step = world.linearize().unwrap();
    // displacements of the height move the height alone
    for row in (0..12).filter(|row| ![5, 11].contains(row)) {
        assert!(step.a[(row, 5)].abs() < 1e-6, "{row}: {}", step.a[(row, 5)]);
    }
    assert!((step.a[(5, 5)] - 1.0).abs() < 1e-6 && step.a[(11, 5)].abs() < 1e-6);
}
