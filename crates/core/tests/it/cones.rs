//! Cones of spherical joints of articulated bodies against closed forms and against loop joints.

use crate::common::*;
use std::f64::consts::{PI, TAU};
use tumble_core::articulated::{Joint, LinkMass, ModelBuilder};
use tumble_core::collide::{Mat3, Pose, Quat, Vec3};
use tumble_core::*;

const CONE: f64 = 0.5;

/// A pendulum of 2 kg, 0.3 m below its spherical joint along axis `k` of the joint, which points down in the world.
fn pendulum(k: usize, start: Quat, omega: Vec3) -> ArticulatedBody {
    let down = Vec3::ith(k, 1.0);
    let mut builder = ModelBuilder::new();
    let mass = LinkMass { mass: 2.0, center: down * 0.3, inertia: Mat3::identity() * 0.02 };
    let placement = Pose::from_parts(
        Vec3::zeros().into(),
        Quat::rotation_between(&down, &-Vec3::z()).unwrap_or(Quat::from_scaled_axis(Vec3::x() * PI)),
    );
    builder.link("lamp", None, Joint::Spherical, placement, mass);
    let mut body = ArticulatedBody::new("lamp", builder.build().unwrap());
    let rotation = placement.rotation.inverse() * start * placement.rotation;
    body = body.with_positions(rotation.coords.as_slice()).unwrap();
    let omega = rotation.inverse() * placement.rotation.inverse() * omega;
    body = body.with_velocities(omega.as_slice()).unwrap();
    body.set_dof(k, DofSettings { limits: Some([0.0, CONE]), ..DofSettings::default() }).unwrap();
    body
}

/// Returns the direction in which the lamp hangs, world axes.
fn hangs(world: &World, id: ObjectId, k: usize) -> Vec3 {
    world.part_state(id, 0).unwrap().pose.rotation * Vec3::ith(k, 1.0)
}

/// Thrown around faster than the rate at which it would keep the angle by itself, it is pressed on the cone and circles at
/// a constant rate, `Ω² > m·g·l·…`: angle and azimuth follow the closed form at several steps, about each axis.
#[test]
fn a_lamp_circles_on_its_cone_at_a_constant_rate() {
    for stepper in STEPPERS {
        for k in 0..3 {
            for (rate, most, inwards) in [(60.0, 4e-2, 4e-5), (240.0, 2.5e-3, 2.5e-6)] {
                let mut world = world(stepper, 1.0 / rate);
                let id = world.add(pendulum(k, Quat::from_scaled_axis(Vec3::y() * CONE), Vec3::z() * 9.0)).unwrap();
                let (mut least, mut worst) = (CONE, 0.0f64);
                for n in 1..=(2.0 * rate) as usize {
                    world.step().unwrap();
                    let u = hangs(&world, id, k);
                    let swing = (-u.z).acos();
                    assert!(swing < CONE + 1e-6, "{stepper}, {rate} Hz, axis {k}, step {n}: {swing}");
                    let expected = PI + 9.0 * n as f64 / rate;
                    let off = (u.y.atan2(u.x) - expected + 101.0 * PI).rem_euclid(TAU) - PI;
                    (least, worst) = (least.min(swing), worst.max(off.abs()));
                }
                println!(
                    "{stepper}, {rate} Hz, axis {k}: {:.1e} rad inwards, azimuth off by {worst:.1e} rad",
                    CONE - least
                );
                assert!(worst < most && CONE - least < inwards);
            }
        }
    }
}

/// A lamp that is thrown against its cone never passes it, and gains no energy.
#[test]
fn a_thrown_lamp_stays_in_its_cone() {
    for stepper in STEPPERS {
        for rate in [60.0, 120.0, 240.0] {
            let mut world = world(stepper, 1.0 / rate);
            let id = world.add(pendulum(2, Quat::identity(), Vec3::new(7.0, 3.0, 4.0))).unwrap();
            let (start, mut farthest) = (world.energy().total(), 0.0f64);
            for _ in 0..(3.0 * rate) as usize {
                world.step().unwrap();
                farthest = farthest.max((-hangs(&world, id, 2).z).acos());
                assert!(world.energy().total() < start + 1e-3 * start.abs(), "{stepper}, {rate} Hz");
            }
            // `backtracking` bounces between two frames, so that none need be at the cone
            assert!((CONE - 1e-3..CONE + 1e-6).contains(&farthest), "{stepper}, {rate} Hz: {farthest}");
        }
    }
}

/// The same lamp as a rigid body on a spherical loop joint with a cone moves alike.
#[test]
fn a_loop_joint_and_a_joint_of_a_robot_have_the_same_cone() {
    let mut far = Vec::new();
    for rate in [240.0, 960.0] {
        let mut world = world("time_stepping", 1.0 / rate);
        let lamp = world.add(pendulum(2, Quat::identity(), Vec3::new(3.0, 1.0, 0.0))).unwrap();
        let body = RigidBody::new(sphere(0.05)).with_mass_and_inertia(2.0, Mat3::identity() * 0.02);
        let body = body.with_pose(Pose::translation(0.0, 0.0, -0.3));
        let body = world.add(body).unwrap();
        world.set_collidable(body, false).unwrap();
        let place = JointPlace::on_line(Vec3::zeros(), -Vec3::z());
        let joint = LoopJoint::joining("", LoopJointKind::Spherical, &world, Some((body, 0)), None, place).unwrap();
        world.add(joint.with_cone(CONE).unwrap()).unwrap();
        let omega = Vec3::new(3.0, 1.0, 0.0);
        world.set_velocity(body, omega.cross(&Vec3::new(0.0, 0.0, -0.3)), omega).unwrap();
        let mut worst = 0.0f64;
        for _ in 0..rate as usize {
            world.step().unwrap();
            let other = position(&world, body).normalize();
            worst = worst.max((hangs(&world, lamp, 2) - other).norm());
        }
        far.push(worst);
    }
    println!("apart by {far:?}");
    assert!(far[0] < 0.02 && far[1] < far[0] / 3.0, "{far:?}");
}

#[test]
fn invalid_cones_are_refused() {
    let mut body = pendulum(2, Quat::identity(), Vec3::zeros());
    let mut refused = |limits| {
        body.set_dof(1, DofSettings { limits: Some(limits), ..DofSettings::default() }).unwrap_err().to_string()
    };
    assert!(refused([-0.1, 0.5]).contains("lower limit of the cone"));
    assert!(refused([0.0, -0.5]).contains("the cone"));
    assert!(refused([0.0, f64::NAN]).contains("the cone"));
    let link =
        LinkBuilder::new("arm", Joint::revolute(Vec3::z())).with_mass(1.0).with_shape(sphere(0.1), Pose::identity());
    let why = ArticulationBuilder::new("robot").link(link.with_cone(2, 0.5)).build().map(drop).unwrap_err().to_string();
    assert!(why.contains("cone"), "{why}");
    let link = LinkBuilder::new("arm", Joint::Spherical).with_mass(1.0).with_shape(sphere(0.1), Pose::identity());
    let link = link.with_limits([0.0, 1.0]);
    let why = ArticulationBuilder::new("robot").link(link).build().map(drop).unwrap_err().to_string();
    assert!(why.contains("a spherical joint has a cone"), "{why}");
}
