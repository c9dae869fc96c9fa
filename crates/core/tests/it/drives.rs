//! Position drives of any gain, in both steppers.

use crate::articulated_world::{hinged, rod, world};
use tumble_core::collide::Vec3;
use tumble_core::{ArticulatedBody, DofSettings, Drive, Integrator, LoopJoint, RigidBody, World};

/// Moment of inertia of the rod about its hinge, kg·m².
const INERTIA: f64 = 0.12;
const STEPPERS: [(&str, Integrator); 4] = [
    ("time_stepping", Integrator::Verlet),
    ("backtracking", Integrator::Verlet),
    ("backtracking", Integrator::Rk4),
    ("backtracking", Integrator::DormandPrince),
];

/// A rod on a hinge without gravity, driven to 1 rad.
fn driven(rate: f64, (stepper, integrator): (&str, Integrator), [stiffness, damping]: [f64; 2]) -> World {
    let mut world = world(1.0 / rate, stepper, integrator);
    world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
    let mut body = ArticulatedBody::new("arm", hinged(1, 0.6, rod(1.0, 0.6)));
    let drive = Drive::Position { stiffness, damping, target: 1.0, velocity: 0.0, limit: f64::INFINITY };
    body.set_dof(0, DofSettings { drive, ..DofSettings::default() }).unwrap();
    world.add(body).unwrap();
    world
}

fn angle(world: &World) -> f64 {
    world.state_of(world.ids()[0]).unwrap()[0]
}

#[test]
fn a_drive_of_any_gain_reaches_its_target() {
    for rate in [60.0, 240.0] {
        for stepper in STEPPERS {
            for gain in [1e2, 1e3, 1e4, 1e6, 1e9] {
                // from light damping to none of the oscillation
                for ratio in [0.3, 1.0, 10.0] {
                    let damping = 2.0 * ratio * f64::sqrt(gain * INERTIA);
                    let mut world = driven(rate, stepper, [gain, damping]);
                    let (mut most, mut unconverged): (f64, u32) = (0.0, 0);
                    for _ in 0..(8.0 * rate) as usize {
                        world.step().unwrap();
                        most = most.max(angle(&world));
                        unconverged += world.report().unconverged;
                    }
                    let place = format!("{stepper:?} at {rate} Hz, gain {gain:e}, damping ratio {ratio}");
                    assert!((angle(&world) - 1.0).abs() < 1e-3, "{place}: ends at {}", angle(&world));
                    assert!(most < 2.0, "{place}: swings to {most}");
                    assert_eq!(unconverged, 0, "{place}");
                }
            }
        }
    }
}

/// The path of the damped oscillator from rest at an angle of −1 to its target.
fn oscillator(stiffness: f64, damping: f64, t: f64) -> f64 {
    let decay = 0.5 * damping / INERTIA;
    let frequency = (stiffness / INERTIA - decay * decay).sqrt();
    1.0 - (-decay * t).exp() * ((frequency * t).cos() + decay / frequency * (frequency * t).sin())
}

#[test]
fn a_drive_that_the_step_resolves_follows_the_damped_oscillator() {
    let (stiffness, damping) = (20.0, 1.0);
    for stepper in &STEPPERS[1..] {
        let errors = [120.0, 240.0, 480.0].map(|rate| {
            let mut world = driven(rate, *stepper, [stiffness, damping]);
            let steps = (1..=(0.5 * rate) as usize).map(|k| {
                world.step().unwrap();
                (angle(&world) - oscillator(stiffness, damping, k as f64 / rate)).abs()
            });
            steps.fold(0.0, f64::max)
        });
        println!("{stepper:?}: {errors:?}");
        assert!(errors[1] < 1e-3, "{stepper:?}: {errors:?}");
        assert!(errors[1] < errors[0] / 3.5 || errors[0] < 1e-9, "{stepper:?}: {errors:?}");
    }
}

/// Two hinges, each with a drive of its own: both reach their targets. A wrong list changes nothing.
#[test]
fn all_drives_are_set_at_once_or_none() {
    let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
    world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
    let mut body = ArticulatedBody::new("arm", hinged(2, 0.6, rod(1.0, 0.6)));
    let to = |target: f64, damping: f64| {
        let (stiffness, velocity, limit) = (100.0, 0.0, f64::INFINITY);
        Drive::Position { stiffness, damping, target, velocity, limit }
    };
    body.set_drives(&[to(0.4, 20.0), to(-0.7, 20.0)]).unwrap();
    let before = body.dofs().to_vec();
    let short = body.set_drives(&[Drive::None]).unwrap_err().to_string();
    assert_eq!(short, "articulated body 'arm': 1 drives; there must be 2, one for each degree of freedom");
    assert!(body.set_drives(&[Drive::None, to(0.0, -1.0)]).unwrap_err().to_string().contains("damping is -1"));
    assert_eq!(body.dofs(), before);
    let id = world.add(body).unwrap();
    for _ in 0..2400 {
        world.step().unwrap();
    }
    let x = world.state_of(id).unwrap();
    assert!((x[0] - 0.4).abs() < 1e-6 && (x[1] + 0.7).abs() < 1e-6, "{x:?}");
}

/// The hinge of a loop joint between a fixed and a free body, I = 0.01 kg·m².
#[test]
fn a_stiff_drive_of_a_loop_joint_holds_in_backtracking() {
    for rate in [60.0, 240.0] {
        for gain in [1e3, 1e6, 1e9] {
            let mut world = world(1.0 / rate, "backtracking", Integrator::Verlet);
            world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
            let shape = tumble_core::collide::Shape::sphere(0.05).unwrap();
            let inertia = tumble_core::collide::Mat3::identity() * 0.01;
            let body = RigidBody::new(shape).with_mass(1.0).with_inertia(inertia);
            let body = world.add(body).unwrap();
            let damping = 0.44 * f64::sqrt(gain / 100.0);
            let drive = Drive::Position { stiffness: gain, damping, target: 0.5, velocity: 0.0, limit: f64::INFINITY };
            let mut joint =
                LoopJoint::revolute_at("hinge", &world, Some((body, 0)), None, Vec3::zeros(), Vec3::z()).unwrap();
            joint.set_dof(DofSettings { drive, ..DofSettings::default() }).unwrap();
            world.add(joint).unwrap();
            for _ in 0..(2.0 * rate) as usize {
                world.step().unwrap();
            }
            let turned = world.part_state(body, 0).unwrap().pose.rotation.angle();
            assert!((turned - 0.5).abs() < 1e-3, "gain {gain:e} at {rate} Hz: {turned}");
        }
    }
}
