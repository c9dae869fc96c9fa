//! Springs of revolute and prismatic joints against the damped oscillator, soft and far stiffer than the step.

use tumble_core::articulated::{DofSettings, Drive, LinkMass, ModelBuilder, Spring};
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::prelude::*;
use tumble_core::{ArticulatedBody, Integrator, Joint, ObjectId, stepper_by_name};

const STEPPERS: [&str; 2] = ["time_stepping", "backtracking"];
/// Inertia about the axis, kg·m², and mass, kg.
const MASS: f64 = 2.0;
const START: f64 = 0.3;
const REST: f64 = 0.1;

/// One link on a joint, free of gravity, with its center of mass on the axis.
fn oscillator(joint: Joint, stepper: &str, dt: f64, dof: DofSettings) -> (World, ObjectId) {
    let mut world = World::new(Settings::default().with_dt(dt).with_gravity(Vec3::zeros())).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    let mass = LinkMass { mass: MASS, center: Vec3::zeros(), inertia: MASS * Mat3::identity() };
    let mut builder = ModelBuilder::new();
    builder.link("weight", None, joint, Pose::identity(), mass);
    let body = ArticulatedBody::new("oscillator", builder.build().unwrap());
    let mut body = body.with_positions(&[START]).unwrap();
    body.set_dof(0, dof).unwrap();
    let id = world.add(body).unwrap();
    (world, id)
}

fn joints() -> [Joint; 2] {
    [Joint::Revolute { axis: Vec3::z() }, Joint::Prismatic { axis: Vec3::x() }]
}

fn sprung(stiffness: f64, damping: f64) -> DofSettings {
    DofSettings { spring: Some(Spring { stiffness, rest: REST }), damping, ..DofSettings::default() }
}

/// Position of `m·ẍ = −k(x − x₀) − c·ẋ` after `t` seconds from rest, with less than critical damping.
fn closed_form(stiffness: f64, damping: f64, t: f64) -> f64 {
    let decay = 0.5 * damping / MASS;
    let w = (stiffness / MASS - decay * decay).sqrt();
    let (a, e) = (START - REST, (-decay * t).exp());
    let (sin, cos) = (w * t).sin_cos();
    REST + a * e * (cos + decay / w * sin)
}

/// Largest distance from the closed form over a second, rad or m.
fn error(joint: Joint, stepper: &str, frames: u32, damping: f64) -> f64 {
    let (dt, stiffness) = (1.0 / f64::from(frames), 80.0);
    let (mut world, id) = oscillator(joint, stepper, dt, sprung(stiffness, damping));
    (1..=frames).fold(0.0, |worst: f64, i| {
        world.step().unwrap();
        let x = world.state_of(id).unwrap()[0];
        worst.max((x - closed_form(stiffness, damping, f64::from(i) * dt)).abs())
    })
}

/// Undamped springs converge with the square of the step in both steppers; with damping, which acts at the end of a step
/// of `time_stepping`, with the step there.
#[test]
fn a_spring_of_a_joint_converges_to_the_damped_oscillator() {
    for stepper in STEPPERS {
        for (joint, damping, order) in joints().into_iter().flat_map(|joint| {
            let damped = if stepper == "time_stepping" { 1.0 } else { 2.0 };
            [(joint, 0.0, 2.0), (joint, 3.0, damped)]
        }) {
            let [coarse, fine] = [240, 960].map(|frames| error(joint, stepper, frames, damping));
            let rate = (coarse / fine).log(4.0);
            println!("{stepper} {joint:?} c = {damping}: {coarse:.1e}, {fine:.1e}: order {rate:.2}");
            assert!(coarse < 2e-3, "{stepper} {joint:?} {damping}: {coarse:.1e}");
            assert!((rate - order).abs() < 0.15, "{stepper} {joint:?} {damping}: order {rate:.2}, not {order}");
        }
    }
}

/// The implicit midpoint rule turns a point `(ω·x, v)` by `2·atan(½ω·h)` a step, whatever the stiffness.
#[test]
fn a_spring_of_any_stiffness_swings_by_the_midpoint_rule_and_keeps_its_energy() {
    let h = 1.0 / 240.0;
    for stepper in STEPPERS {
        for (joint, stiffness) in joints().into_iter().flat_map(|joint| [1e6, 1e9].map(|k| (joint, k))) {
            let (mut world, id) = oscillator(joint, stepper, h, sprung(stiffness, 0.0));
            let (start, a) = (world.energy().total(), START - REST);
            let turn = 2.0 * (0.5 * h * (stiffness / MASS).sqrt()).atan();
            for i in 1..=1000 {
                world.step().unwrap();
                if stepper == "time_stepping" {
                    let (x, wanted) = (world.state_of(id).unwrap()[0], REST + a * (f64::from(i) * turn).cos());
                    assert!((x - wanted).abs() < 1e-8, "{joint:?} {stiffness:.0e}: {x} instead of {wanted}");
                }
            }
            let end = world.energy().total();
            println!("{stepper} {joint:?} {stiffness:.0e}: {:.1e} of the energy", end / start);
            match stepper {
                "time_stepping" => assert!((end / start - 1.0).abs() < 1e-8, "{joint:?} {stiffness:.0e}: {end}"),
                _ => assert!(end < start * (1.0 + 1e-8), "{stepper} {joint:?} {stiffness:.0e}: {end} J of {start} J"),
            }
        }
    }
}

/// Damping brings a spring of any stiffness to its rest position, with every integrator, beside a drive too.
#[test]
fn damped_springs_of_any_stiffness_come_to_rest() {
    let integrators = [Integrator::Verlet, Integrator::DormandPrince, Integrator::ExplicitEuler];
    for (stepper, integrator) in STEPPERS.into_iter().flat_map(|s| integrators.map(|i| (s, i))) {
        for (joint, stiffness) in joints().into_iter().flat_map(|joint| [1e2, 1e4, 1e6, 1e9].map(|k| (joint, k))) {
            // at the step's own scale, where the midpoint rule alone would never come to rest
            let dof = sprung(stiffness, 2.0 * (stiffness * MASS).sqrt() + stiffness / 240.0);
            let (mut world, id) = oscillator(joint, stepper, 1.0 / 240.0, dof.clone());
            world.set_settings(world.settings().with_integrator(integrator)).unwrap();
            for _ in 0..2400 {
                world.step().unwrap();
            }
            let [x, v] = *world.state_of(id).unwrap() else { panic!() };
            assert!(
                (x - REST).abs() < 1e-5 && v.abs() < 1e-5,
                "{stepper} {integrator:?} {stiffness:.0e}: {x} m, {v} m/s"
            );
            let target = REST + 0.3;
            let drive = Drive::Position { stiffness, damping: 0.0, target, velocity: 0.0, limit: f64::INFINITY };
            let body = world.get_mut::<ArticulatedBody>(id).unwrap();
            body.set_dof(0, DofSettings { drive, ..dof }).unwrap();
            for _ in 0..2400 {
                world.step().unwrap();
            }
            let x = world.state_of(id).unwrap()[0];
            assert!(
                (x - REST - 0.15).abs() < 1e-5,
                "{stepper} {integrator:?} {stiffness:.0e}: {x} between spring and drive"
            );
        }
    }
}

/// A chain of ten links whose joints have springs of 1e9 N·m/rad hangs as a rigid bar does, and stays so.
#[test]
fn a_chain_of_stiff_joints_hangs_like_a_bar() {
    for stepper in STEPPERS {
        let mut world = World::new(Settings::default().with_dt(1.0 / 240.0)).unwrap();
        world.set_stepper(stepper_by_name(stepper).unwrap());
        let mass = LinkMass { mass: 1.0, center: Vec3::new(0.05, 0.0, 0.0), inertia: 1e-3 * Mat3::identity() };
        let mut builder = ModelBuilder::new();
        let mut last = None;
        for i in 0..10 {
            let pose = Pose::translation(if i == 0 { 0.0 } else { 0.1 }, 0.0, 0.0);
            last = Some(builder.link(format!("link{i}"), last, Joint::Revolute { axis: Vec3::y() }, pose, mass));
        }
        let mut body = ArticulatedBody::new("bar", builder.build().unwrap());
        for dof in 0..10 {
            let spring = Some(Spring { stiffness: 1e9, rest: 0.0 });
            body.set_dof(dof, DofSettings { spring, damping: 1e7, ..DofSettings::default() }).unwrap();
        }
        let id = world.add(body).unwrap();
        let mut most: f64 = 0.0;
        for _ in 0..480 {
            world.step().unwrap();
            most = world.state_of(id).unwrap()[..10].iter().fold(most, |m, x| m.max(x.abs()));
        }
        // the torque at the root, 10 kg · g · 0.5 m, over the stiffness
        let (root, wanted) = (world.state_of(id).unwrap()[0], 10.0 * 9.81 * 0.5 / 1e9);
        assert!(most < 2.0 * wanted, "{stepper}: {most:.1e}");
        assert!((root - wanted).abs() < 1e-3 * wanted, "{stepper}: {root:.4e} rad instead of {wanted:.4e}");
    }
}

/// Least and largest energy, of the first one, of two links on a spherical joint with springs, which tumble in free space.
fn tumbling(stepper: &str, rate: f64, stiffness: f64, damping: f64) -> [f64; 2] {
    let mut world = World::new(Settings::default().with_dt(1.0 / rate).with_gravity(Vec3::zeros())).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    let inertia = Mat3::from_diagonal(&Vec3::new(4e-3, 5e-3, 6e-3));
    let mass = LinkMass { mass: 1.0, center: Vec3::new(0.2, 0.0, 0.0), inertia };
    let mut builder = ModelBuilder::new();
    let one = builder.link("one", None, Joint::Floating, Pose::identity(), mass);
    builder.link("other", Some(one), Joint::Spherical, Pose::translation(0.4, 0.0, 0.0), mass);
    let mut body = ArticulatedBody::new("pair", builder.build().unwrap());
    for k in 6..9 {
        body.set_dof(
            k,
            DofSettings { spring: Some(Spring { stiffness, rest: 0.0 }), damping, ..DofSettings::default() },
        )
        .unwrap();
    }
    let id = world.add(body).unwrap();
    let mut x = world.state_of(id).unwrap().to_vec();
    let n = x.len();
    x[n - 9..].copy_from_slice(&[0.5, 1.0, -0.7, 0.1, 0.2, 0.0, 2.0, -1.0, 1.5]);
    world.write_state_of(id, &x).unwrap();
    let start = world.energy().total();
    (0..rate as usize).fold([1.0, 1.0], |[least, largest]: [f64; 2], _| {
        world.step().unwrap();
        let now = world.energy().total() / start;
        [least.min(now), largest.max(now)]
    })
}

#[test]
fn springs_of_a_spherical_joint_of_any_stiffness_keep_their_energy() {
    for (stepper, rate) in STEPPERS.into_iter().flat_map(|s| [60.0, 240.0].map(|rate| (s, rate))) {
        for stiffness in [3e2, 1e3, 1e4, 1e5, 1e6, 1e8] {
            let [least, largest] = tumbling(stepper, rate, stiffness, 0.0);
            println!("{stepper} {rate} {stiffness:.0e}: {least:.5} {largest:.5}");
            assert!(least > 0.99 && largest < 1.01, "{stepper} {rate} Hz {stiffness:.0e}: {least} {largest}");
            let [_, largest] = tumbling(stepper, rate, stiffness, 0.1 * f64::sqrt(stiffness * 4e-3));
            assert!(largest < 1.01, "{stepper} {rate} Hz {stiffness:.0e}, damped: {largest}");
        }
    }
}

/// A stiff spring reverses its velocity in each step. Damping takes energy all the same, and as much as in reality.
#[test]
fn damped_stiff_springs_decay_as_in_reality() {
    for (stepper, joint) in STEPPERS.into_iter().flat_map(|s| joints().map(|joint| (s, joint))) {
        for (stiffness, damping) in [(1e4, 1.0), (1e5, 1.0), (1e6, 10.0), (1e6, 1e3), (1e9, 1e4)] {
            let spring = Some(Spring { stiffness, rest: START });
            let (mut world, id) =
                oscillator(joint, stepper, 1.0 / 60.0, DofSettings { spring, damping, ..DofSettings::default() });
            world.write_state_of(id, &[START, 1.0]).unwrap();
            let start = world.energy().total();
            for _ in 0..120 {
                world.step().unwrap();
                let now = world.energy().total();
                assert!(now <= start * (1.0 + 1e-9), "{stepper} {joint:?} {stiffness:.0e} {damping}: {now} J");
            }
            let decay = -(world.energy().total() / start).ln() * MASS / (2.0 * damping);
            println!("{stepper} {joint:?} {stiffness:.0e} {damping}: {decay:.3} of the rate");
            let wanted = if damping <= 10.0 { 0.7..1.3 } else { 0.0..f64::INFINITY };
            assert!(wanted.contains(&decay), "{stepper} {joint:?} {stiffness:.0e} {damping}: {decay}");
        }
    }
}
