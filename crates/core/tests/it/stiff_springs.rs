//! Springs of joints between bodies that turn, soft and far stiffer than the step: they keep their energy with every integrator.

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

/// Least and largest energy of the first three seconds, of the first one.
fn energies(mut world: World, rate: f64) -> [f64; 2] {
    world.step().unwrap(); // velocities that the joint does not allow are lost
    let start = world.energy().total();
    (0..(3.0 * rate) as usize).fold([1.0, 1.0], |[least, largest]: [f64; 2], _| {
        world.step().unwrap();
        let now = world.energy().total() / start;
        [least.min(now), largest.max(now)]
    })
}

/// Joints with springs along all that they leave free.
const JOINTS: [LoopJointKind; 6] = {
    use LoopJointKind::*;
    [Revolute, Prismatic, Spherical, Universal, Cylindrical, Planar]
};

fn all_kinds() -> impl Iterator<Item = (&'static str, LoopJointKind)> {
    let kinds = || JOINTS.into_iter().chain([LoopJointKind::Spring]);
    STEPPERS.into_iter().flat_map(move |stepper| kinds().map(move |kind| (stepper, kind)))
}

#[test]
fn springs_of_any_stiffness_keep_their_energy() {
    for (stepper, kind) in all_kinds() {
        for (rate, stiffness) in [60.0, 240.0].into_iter().flat_map(|r| [1e2, 1e3, 1e4, 1e6, 1e9].map(|k| (r, k))) {
            let all = pair(stepper, Integrator::Verlet, rate, kind, (stiffness, 0.0));
            let [least, largest] = energies(all, rate);
            println!("{stepper} {rate} {kind:?} {stiffness:.0e}: {least:.5} {largest:.5}");
            assert!(least > 0.98 && largest < 1.02, "{stepper} {rate} Hz {kind:?} {stiffness:.0e}: {least} {largest}");
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
                let [_, energy] = energies(all, rate);
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
        for kind in JOINTS {
            let all = [60.0, 120.0]
                .map(|rate| energies(pair("backtracking", integrator, rate, kind, (30.0, 0.0)), rate)[1] - 1.0);
            println!("{integrator:?} {kind:?}: {all:?}");
            assert!(all[0] < 1e-2 && all[1] < 5e-3, "{integrator:?} {kind:?}: {all:?}");
        }
    }
    for (integrator, kind) in
        [Integrator::SymplecticEuler, Integrator::ExplicitEuler].into_iter().flat_map(|i| JOINTS.map(|kind| (i, kind)))
    {
        let [_, energy] = energies(pair("backtracking", integrator, 60.0, kind, (1e5, 0.0)), 60.0);
        assert!(energy < 1.02, "{integrator:?} {kind:?}: {energy}");
    }
}
