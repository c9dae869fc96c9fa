//! Springs of joints between bodies that turn, soft and far stiffer than the step: they keep their energy with every integrator,
//! and are the joint in the limit.

use crate::common::*;
use crate::loop_joints::{AXIS, bar};
use tumble_core::articulated::{DofSettings, Spring};
use tumble_core::collide::Vec3;
use tumble_core::*;

const PIN: Vec3 = Vec3::new(0.5, 0.0, 0.0);

/// Two bars in free motion, the second flung about the end of the first, where a joint with springs along its degrees of freedom
/// joins them.
fn pair(
    stepper: &str,
    integrator: Integrator,
    rate: f64,
    kind: LoopJointKind,
    (stiffness, damping): (f64, f64),
) -> World {
    let mut world = no_gravity(world(stepper, 1.0 / rate));
    world.set_settings(world.settings().with_integrator(integrator)).unwrap();
    let one = world.add(bar("one", Vec3::zeros(), PIN)).unwrap();
    let planar = matches!(kind, LoopJointKind::Revolute | LoopJointKind::Prismatic);
    let turn = if planar { -3.0 * AXIS } else { Vec3::new(1.0, 3.0, 0.5) };
    let (arm, at_pin) = (Vec3::new(0.0, 0.0, 0.15), if planar { Vec3::zeros() } else { -0.2 * AXIS });
    let flung = bar("other", PIN, PIN + 2.0 * arm).with_angular_velocity(turn);
    let other = world.add(flung.with_velocity(turn.cross(&arm) + at_pin)).unwrap();
    let place = match kind {
        LoopJointKind::Spring => JointPlace::between(PIN, PIN + Vec3::new(0.0, 0.2, 0.3)),
        LoopJointKind::Universal => JointPlace::on_line(PIN, AXIS).with_second_axis(Vec3::z()),
        _ => JointPlace::on_line(PIN, AXIS),
    };
    let mut joint = LoopJoint::joining("joint", kind, &world, Some((one, 0)), Some((other, 0)), place).unwrap();
    for k in 0..3 {
        let Some(dof) = joint.dof_at(k).cloned() else { break };
        let rest = if kind == LoopJointKind::Spring { 0.13f64.sqrt() } else { 0.0 };
        joint.set_dof_at(k, DofSettings { spring: Some(Spring { stiffness, rest }), damping, ..dof }).unwrap();
    }
    world.add(joint).unwrap();
    world
}

/// Largest energy of the first three seconds, of the first one.
fn largest_energy(mut world: World, rate: f64) -> f64 {
    world.step().unwrap(); // velocities that the joint does not allow are lost
    let start = world.energy().total();
    (0..(3.0 * rate) as usize).fold(0.0, |worst: f64, _| {
        world.step().unwrap();
        worst.max(world.energy().total() / start)
    })
}

/// Kinds with springs along all that they leave free.
const KINDS: [LoopJointKind; 6] = {
    use LoopJointKind::*;
    [Revolute, Prismatic, Spherical, Universal, Cylindrical, Planar]
};

/// Steppers with the kinds whose springs keep their energy at any stiffness. The force of a spring between two points turns a slender body
/// within a sub-step of `backtracking`, which holds it.
fn all_kinds() -> impl Iterator<Item = (&'static str, LoopJointKind)> {
    let all = STEPPERS.into_iter().flat_map(|stepper| KINDS.map(|kind| (stepper, kind)));
    all.chain([("time_stepping", LoopJointKind::Spring)])
}

#[test]
fn springs_of_any_stiffness_keep_their_energy() {
    for (stepper, kind) in all_kinds() {
        for (rate, stiffness) in [60.0, 240.0].into_iter().flat_map(|r| [1e2, 1e3, 1e4, 1e6, 1e9].map(|k| (r, k))) {
            let all = pair(stepper, Integrator::Verlet, rate, kind, (stiffness, 0.0));
            let energy = largest_energy(all, rate);
            println!("{stepper} {rate} {kind:?} {stiffness:.0e}: {energy:.5}");
            assert!(energy < 1.02, "{stepper} {rate} Hz {kind:?} {stiffness:.0e}: {energy}");
        }
    }
}

#[test]
fn damped_springs_of_any_stiffness_lose_energy() {
    for (stepper, kind) in all_kinds() {
        for (rate, stiffness) in [60.0, 240.0].into_iter().flat_map(|r| [1e2, 1e4, 1e6, 1e9].map(|k| (r, k))) {
            for share in [0.001, 0.1] {
                let damping: f64 = share * f64::sqrt(stiffness * 0.2);
                let all = pair(stepper, Integrator::Verlet, rate, kind, (stiffness, damping));
                let energy = largest_energy(all, rate);
                println!("{stepper} {rate} {kind:?} {stiffness:.0e} {share}: {energy:.5}");
                assert!(energy < 1.02, "{stepper} {rate} Hz {kind:?} {stiffness:.0e}, {share}: {energy}");
            }
        }
    }
}

/// The force of a joint is constant in a sub-step of `backtracking`, so springs beside it are rows, whatever the integrator.
#[test]
fn springs_keep_their_energy_with_every_integrator() {
    for integrator in [Integrator::Verlet, Integrator::Rk4, Integrator::DormandPrince] {
        for kind in KINDS {
            let all = [60.0, 120.0]
                .map(|rate| largest_energy(pair("backtracking", integrator, rate, kind, (30.0, 0.0)), rate) - 1.0);
            println!("{integrator:?} {kind:?}: {all:?}");
            assert!(all[0] < 1e-2 && all[1] < 5e-3, "{integrator:?} {kind:?}: {all:?}");
        }
    }
    for (integrator, kind) in
        [Integrator::SymplecticEuler, Integrator::ExplicitEuler].into_iter().flat_map(|i| KINDS.map(|kind| (i, kind)))
    {
        let energy = largest_energy(pair("backtracking", integrator, 60.0, kind, (1e5, 0.0)), 60.0);
        assert!(energy < 1.02, "{integrator:?} {kind:?}: {energy}");
    }
}
