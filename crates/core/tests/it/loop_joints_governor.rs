//! Watt's governor: a spherical joint whose loop lies in a plane that turns. Across the plane both of its sides move
//! alike, whatever the joints do; that row must not stop the spindle.

use crate::common::*;
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::*;

const ARM: f64 = 0.16;
const OFFSET: f64 = 0.02;
const BALL: f64 = 0.8;
const STRUT: f64 = 0.1;
const SLEEVE: f64 = 0.5;
const SPEED: f64 = 12.0;

/// An arm with a ball at its end, hung on the spindle; a strut of a point mass at its middle; a sleeve.
fn governor(stepper: &str, rate: f64, angle: f64) -> World {
    let point = |mass: f64, z: f64| LinkMass { mass, center: Vec3::new(0.0, 0.0, z), inertia: Mat3::identity() * 1e-9 };
    let spindle = LinkMass { mass: 2.0, center: Vec3::zeros(), inertia: Mat3::identity() * 0.01 };
    let mut builder = ModelBuilder::new();
    let root = builder.link("spindle", None, Joint::revolute(Vec3::z()), Pose::identity(), spindle);
    let hung = Pose::translation(OFFSET, 0.0, 0.46);
    let arm = builder.link("arm", Some(root), Joint::revolute(-Vec3::y()), hung, point(BALL, -ARM));
    let below = Pose::translation(0.0, 0.0, -ARM);
    let strut = builder.link("strut", Some(arm), Joint::revolute(Vec3::y()), below, point(STRUT, -0.5 * ARM));
    let at_sleeve = Pose::translation(0.0, 0.0, 0.46 - 2.0 * ARM);
    let sleeve = builder.link("sleeve", Some(root), Joint::prismatic(Vec3::z()), at_sleeve, point(SLEEVE, 0.0));
    let lift = 2.0 * ARM * (1.0 - angle.cos());
    let mut body = ArticulatedBody::new("governor", builder.build().unwrap())
        .with_positions(&[0.0, angle, 2.0 * angle, lift])
        .unwrap();
    let drive = Drive::Velocity { target: SPEED, limit: 50.0 };
    body.set_dof(0, DofSettings { drive, ..DofSettings::default() }).unwrap();
    body.set_dof(1, DofSettings { damping: 0.1, ..DofSettings::default() }).unwrap();
    let mut world = world(stepper, 1.0 / rate);
    let id = world.add(body).unwrap();
    let pin = Vec3::new(OFFSET, 0.0, 0.46 - 2.0 * ARM * angle.cos());
    let pin = LoopJoint::spherical_at("pin", &world, Some((id, strut)), Some((id, sleeve)), pin).unwrap();
    world.add(pin).unwrap();
    world
}

/// The angle at which the arm stays at a spindle's speed: `dV/dθ = ½ω²·dI/dθ`.
fn steady() -> f64 {
    let slope = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let radius = |along: f64| OFFSET + along * sin;
        // heights: ball −L·cos, strut −3/2·L·cos, sleeve −2L·cos
        let weight = 9.81 * ARM * sin * (BALL + 1.5 * STRUT + 2.0 * SLEEVE);
        let swing = ARM * cos * (BALL * radius(ARM) + 0.5 * STRUT * radius(0.5 * ARM));
        weight - SPEED * SPEED * swing
    };
    let (mut low, mut high): (f64, f64) = (0.05, 1.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if slope(middle) < 0.0 { low = middle } else { high = middle }
    }
    low
}

#[test]
fn a_governor_turns_and_settles_where_its_speed_holds_it() {
    for stepper in STEPPERS {
        for rate in [60.0, 240.0] {
            let mut world = governor(stepper, rate, 0.4);
            let id = world.ids()[0];
            let (mut unconverged, mut residual) = (0, 0.0f64);
            for _ in 0..(10.0 * rate) as usize {
                world.step().unwrap();
                unconverged += world.report().unconverged;
                residual = residual.max(world.report().residual);
            }
            let x = world.state_of(id).unwrap();
            let (turned, off) = (x[0] / (10.0 * SPEED), x[1] - steady());
            println!("{stepper} at {rate} Hz: turned by {turned}, arm off by {off} rad, residual {residual:e} m/s");
            assert!(unconverged == 0 && residual < 1e-12, "{stepper} at {rate} Hz: {unconverged}, {residual} m/s");
            // drives are of first order in motion
            assert!((turned - 1.0).abs() < 0.15 / rate, "{stepper} at {rate} Hz: turned by {turned}");
            assert!(off.abs() < 0.3 / rate, "{stepper} at {rate} Hz: the arm is off by {off} rad");
        }
    }
}
