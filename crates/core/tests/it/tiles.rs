//! Fixed boxes whose tops form one plane: which of them carries a body, whose friction holds, and that the plane
//! ends where the boxes end.

use crate::common::*;
use tumble_core::collide::{Pose, Quat, Shape, Vec3};
use tumble_core::*;

/// Adds a fixed box with its top at z = 0, from `min` to `max` in x and 4 m wide.
fn tile(world: &mut World, [min, max]: [f64; 2], friction: f64) -> ObjectId {
    let shape = Shape::cuboid(Vec3::new(max - min, 4.0, 0.4)).unwrap();
    let material = Material { friction, restitution: 0.0, ..Material::default() };
    let body = RigidBody::fixed(shape).with_name(format!("tile at {min}")).with_material(material);
    world.add_static(body.with_pose(Pose::translation(0.5 * (min + max), 0.0, -0.2))).unwrap()
}

fn mover(shape: Shape, turn: Quat, (x, z): (f64, f64), speed: f64, friction: f64) -> RigidBody {
    let material = Material { friction, restitution: 0.0, ..Material::default() };
    let pose = Pose::from_parts(Vec3::new(x, 0.0, z).into(), turn);
    let body = RigidBody::new(shape).with_mass(1.0).with_material(material).with_pose(pose);
    body.with_velocity(Vec3::x() * speed)
}

fn across() -> Quat {
    Quat::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0)
}

/// The seam is below the puck, at 0.02 m from its middle: the loads follow from the balance of forces and of
/// torques about the seam, with all contacts at their points.
#[test]
fn each_tile_carries_the_contacts_on_it() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let tiles = [tile(&mut world, [-2.0, 0.02], 0.5), tile(&mut world, [0.02, 2.0], 0.5)];
        let puck = Shape::cylinder(0.1, 0.2).unwrap();
        let puck = world.add(mover(puck, Quat::identity(), (0.0, 0.1), 0.0, 0.5)).unwrap();
        (0..10).for_each(|_| {
            world.step().unwrap();
        });
        let (mut force, mut torque) = (0.0, 0.0);
        for contact in world.contacts_of(puck) {
            let (tile, sign) = if contact.a == puck { (contact.b, 1.0) } else { (contact.a, -1.0) };
            let own = if contact.point.x < 0.02 { tiles[0] } else { tiles[1] };
            assert!(
                tile == own || (contact.point.x - 0.02).abs() < 1e-9,
                "{stepper}: a contact at {}",
                contact.point.x
            );
            force += sign * contact.force.z;
            torque += sign * contact.force.z * contact.point.x;
        }
        assert!((force - 9.81).abs() < 1e-6 && torque.abs() < 1e-7, "{stepper}: {force} N, {torque} N m");
    }
}

/// A cylinder slides along its axis from ice to rubber: with both ends on one tile it is slowed by `μ·g` of that
/// tile, also across the seam of two tiles of ice.
#[test]
fn friction_is_that_of_the_tile_below() {
    let (speed, g) = (2.0, 9.81);
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        tile(&mut world, [-2.0, 0.0], 0.0);
        tile(&mut world, [0.0, 0.7], 0.0);
        tile(&mut world, [0.7, 3.0], 0.4);
        let turn = Quat::from_euler_angles(0.0, std::f64::consts::FRAC_PI_2, 0.0);
        let rod = world.add(mover(Shape::cylinder(0.1, 0.2).unwrap(), turn, (-0.5, 0.1), speed, 0.4)).unwrap();
        let (mut before, mut after) = (0, 0);
        for _ in 0..220 {
            let old = velocity(&world, rod).x;
            world.step().unwrap();
            let (x, rate) = (position(&world, rod).x, (velocity(&world, rod).x - old) * 240.0);
            if x < 0.55 {
                assert!(rate.abs() < 1e-9, "{stepper}: slowed by {rate} on ice at {x}");
                before += 1;
            } else if x > 0.85 && old > 0.1 {
                assert!((rate + 0.4 * g).abs() < 1e-6, "{stepper}: {rate} m/s² on rubber at {x}");
                after += 1;
            }
        }
        assert!(before > 20 && after > 20, "{before} steps on ice, {after} on rubber");
    }
}

/// A gap of 60 mm between two tiles is no part of the plane: a ball of 20 mm drops into it, one of 100 mm sinks
/// in to `√(r² − w²/4)` above the edges.
#[test]
fn a_gap_between_tiles_is_open() {
    for stepper in STEPPERS {
        for (radius, rest) in [(0.02, None), (0.1, Some((0.1f64 * 0.1 - 0.03 * 0.03).sqrt()))] {
            let mut world = world(stepper, 1.0 / 240.0);
            for span in [[-2.0, -1.0], [-1.0, 0.0], [0.06, 1.0], [1.0, 2.0]] {
                tile(&mut world, span, 0.0);
            }
            let ball = world.add(mover(sphere(radius), Quat::identity(), (0.03, radius), 0.0, 0.0)).unwrap();
            (0..60).for_each(|_| {
                world.step().unwrap();
            });
            let z = position(&world, ball).z;
            match rest {
                Some(rest) => assert!((z - rest).abs() < 1e-3, "{stepper}: rests at {z}, not at {rest}"),
                None => assert!(z < -0.2, "{stepper}: a small ball stays at {z}"),
            }
        }
    }
}

/// A cylinder that is faster than `√(g·r)` leaves the edge of the last tile at once and falls freely.
#[test]
fn the_plane_ends_with_the_last_tile() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        for span in [[-2.0, -0.25], [-0.25, 0.0], [0.0, 0.25]] {
            tile(&mut world, span, 0.0);
        }
        let rod = world.add(mover(Shape::cylinder(0.1, 0.2).unwrap(), across(), (-0.4, 0.1), 3.0, 0.0)).unwrap();
        let mut left = None;
        for step in 0..120 {
            world.step().unwrap();
            let p = position(&world, rod);
            assert!(p.x > 0.25 || (p.z - 0.1).abs() < 1e-6, "{stepper}: at {p}");
            left = left.or((p.x > 0.25).then_some(step));
        }
        let (time, p) = ((119 - left.unwrap()) as f64 / 240.0, position(&world, rod));
        let fallen = 0.1 - p.z;
        let [least, most] = [time - 1.0 / 240.0, time + 1.0 / 240.0].map(|t| 0.5 * 9.81 * t * t);
        assert!(fallen > least && fallen < most, "{stepper}: fell {fallen} m in {time} s");
    }
}
