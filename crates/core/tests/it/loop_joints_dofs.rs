//! Every degree of freedom of loop joints against closed forms: armature, limits, friction, drives and springs.

use crate::common::*;
use std::f64::consts::TAU;
use tumble_core::articulated::Spring;
use tumble_core::collide::{Mat3, Pose, Quat, Vec3};
use tumble_core::*;

const DT: f64 = 1.0 / 240.0;

/// A ball of 2 kg that does not collide, with moments of inertia of 0.5 kg·m².
fn ball(world: &mut World, at: Vec3, velocity: Vec3, spin: Vec3) -> ObjectId {
    let body = RigidBody::new(sphere(0.1)).with_mass_and_inertia(2.0, Mat3::identity() * 0.5);
    let pose = Pose::from_parts(at.into(), Quat::identity());
    let id = world.add(body.with_pose(pose).with_velocity(velocity).with_angular_velocity(spin)).unwrap();
    world.set_collidable(id, false).unwrap();
    id
}

fn join(world: &World, kind: LoopJointKind, a: ObjectId, b: Option<ObjectId>, place: JointPlace) -> LoopJoint {
    LoopJoint::joining("joint", kind, world, Some((a, 0)), b.map(|b| (b, 0)), place).unwrap()
}

fn run(world: &mut World, seconds: f64) {
    (0..(seconds / world.settings().dt).round() as usize).for_each(|_| _ = world.step().unwrap());
}

fn at(world: &World, joint: ObjectId, k: usize) -> [f64; 2] {
    world.get::<LoopJoint>(joint).unwrap().position_at(k, &world.view()).unwrap()
}

fn total(world: &World) -> f64 {
    let energy = world.energy();
    energy.kinetic + energy.potential
}

fn spring(stiffness: f64) -> DofSettings {
    DofSettings { spring: Some(Spring { stiffness, rest: 0.0 }), ..DofSettings::default() }
}

fn held_at(target: f64, stiffness: f64, damping: f64) -> DofSettings {
    let drive = Drive::Position { stiffness, damping, target, velocity: 0.0, limit: f64::INFINITY };
    DofSettings { drive, ..DofSettings::default() }
}

/// `θ = θ₀·cos(ωt)`, `ω = √(k/(I + a))`, to second order in the step.
#[test]
fn a_torsional_pendulum_swings_with_its_rotor() {
    for stepper in STEPPERS {
        let error = |dt: f64| {
            let mut world = no_gravity(world(stepper, dt));
            let id = ball(&mut world, Vec3::zeros(), Vec3::zeros(), Vec3::new(0.0, 0.0, 0.4));
            let joint = join(&world, LoopJointKind::Revolute, id, None, JointPlace::at(Vec3::zeros()));
            let joint = world.add(joint.with_dof(spring(8.0)).unwrap().with_armature(1.5).unwrap()).unwrap();
            let (energy, mut worst) = (total(&world), 0.0f64);
            assert!((energy - 0.5 * 2.0 * 0.4 * 0.4).abs() < 1e-12);
            for frame in 1..=(6.0 / dt).round() as usize {
                world.step().unwrap();
                let t = frame as f64 * dt;
                worst = worst.max((at(&world, joint, 0)[0] - 0.2 * (2.0 * t).sin()).abs());
                assert!((total(&world) - energy).abs() < 1e-2 * energy, "{stepper}: {}", total(&world) / energy);
            }
            worst
        };
        let [coarse, fine] = [1.0 / 60.0, 1.0 / 120.0].map(error);
        assert!(fine < 2e-4 && coarse / fine > 3.5, "{stepper}: {coarse:e} {fine:e}");
    }
}

/// `θ̈ = −m·g·l·sin θ/(m·l² + a)` of a point on a hinge, by Runge and Kutta.
#[test]
fn a_pendulum_swings_with_its_rotor() {
    let expected = |a: f64, mut y: [f64; 2], end: f64| {
        let rate = |[q, v]: [f64; 2]| [v, -2.0 * 9.81 * q.sin() / (2.0 + 0.5 + a)];
        let steps = 20_000;
        let h = end / f64::from(steps);
        for _ in 0..steps {
            let plus = |k: [f64; 2], s: f64| [y[0] + s * k[0], y[1] + s * k[1]];
            let k1 = rate(y);
            let k2 = rate(plus(k1, 0.5 * h));
            let k3 = rate(plus(k2, 0.5 * h));
            let k4 = rate(plus(k3, h));
            y = [0, 1].map(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        y
    };
    for (stepper, a) in STEPPERS.into_iter().flat_map(|s| [0.0, 0.1, 3.0].map(|a| (s, a))) {
        let error = |dt: f64| {
            let mut world = world(stepper, dt);
            let id = ball(&mut world, Vec3::new(1.0, 0.0, 0.0), Vec3::zeros(), Vec3::zeros());
            let joint = join(&world, LoopJointKind::Revolute, id, None, JointPlace::on_line(Vec3::zeros(), Vec3::y()));
            let joint = world.add(joint.with_armature(a).unwrap()).unwrap();
            run(&mut world, 3.0);
            // it starts level: a quarter of a turn above the rest
            let [q, v] = expected(a, [-TAU / 4.0, 0.0], 3.0);
            let [position, rate] = at(&world, joint, 0);
            (position - (q + TAU / 4.0)).abs().max((rate - v).abs())
        };
        let [coarse, fine] = [1.0 / 60.0, 1.0 / 120.0].map(error);
        assert!(fine < 1e-3 && coarse / fine > 3.8, "{stepper} {a}: {coarse:e} {fine:e}");
    }
}

/// `I·α_A = τ − a(α_A − α_B)`, `I·α_B = a(α_A − α_B)`: the rotor takes both along, and their momentum is that of the torque.
#[test]
fn a_rotor_acts_between_two_free_bodies() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, DT));
        let [a, b] = [0.0, 0.0].map(|x| ball(&mut world, Vec3::new(x, 0.0, 0.0), Vec3::zeros(), Vec3::zeros()));
        let joint = join(&world, LoopJointKind::Revolute, a, Some(b), JointPlace::at(Vec3::zeros()));
        world.add(joint.with_armature(2.0).unwrap()).unwrap();
        for _ in 0..120 {
            world.apply_torque(a, 0, Vec3::new(0.0, 0.0, 1.0)).unwrap();
            world.step().unwrap();
        }
        let spin = |id| world.part_state(id, 0).unwrap().angular_velocity.z;
        // α_A − α_B = τ/(I + 2a), α_A + α_B = τ/I
        let (difference, sum) = (0.5 / 4.5, 0.5 / 0.5);
        assert!((spin(a) - spin(b) - difference).abs() < 1e-9, "{stepper}: {}", spin(a) - spin(b));
        assert!((spin(a) + spin(b) - sum).abs() < 1e-9, "{stepper}: {}", spin(a) + spin(b));
    }
}

/// The energy of bodies and rotors stays while a free joint turns in all of its degrees of freedom: bodies on a spinning base, so the axes turn too.
#[test]
fn rotors_keep_energy_in_every_kind_of_joint() {
    let kinds = [
        (LoopJointKind::Revolute, JointPlace::on_line(Vec3::zeros(), Vec3::new(0.6, 0.0, 0.8))),
        (LoopJointKind::Cylindrical, JointPlace::on_line(Vec3::zeros(), Vec3::new(0.6, 0.0, 0.8))),
        (LoopJointKind::Universal, JointPlace::at(Vec3::zeros()).with_second_axis(Vec3::x())),
        (LoopJointKind::Planar, JointPlace::at(Vec3::zeros())),
        (LoopJointKind::Spherical, JointPlace::at(Vec3::zeros())),
    ];
    for stepper in STEPPERS {
        for (kind, place) in kinds {
            let drift = |dt: f64| {
                let mut world = no_gravity(world(stepper, dt));
                let a = ball(&mut world, Vec3::zeros(), Vec3::new(0.3, 0.1, 0.0), Vec3::new(0.5, 0.3, 1.0));
                let b = ball(&mut world, Vec3::new(0.3, 0.2, 0.1), Vec3::zeros(), Vec3::new(0.2, -0.6, 0.4));
                let mut joint = join(&world, kind, a, Some(b), place);
                (0..kind.dofs()).for_each(|k| joint.set_armature_at(k, 0.8).unwrap());
                world.add(joint).unwrap();
                // the velocities that the joint holds are lost in the first step
                world.step().unwrap();
                let energy = total(&world);
                run(&mut world, 2.0);
                (total(&world) - energy).abs() / energy
            };
            let [coarse, fine] = [1.0 / 60.0, 1.0 / 240.0].map(drift);
            assert!(fine < 2e-3 && (fine < 1e-9 || coarse / fine > 3.0), "{stepper} {kind:?}: {coarse:e} {fine:e}");
        }
    }
}

/// A ball meets a slider of 2 kg with a rotor of 6 kg as it would meet 8 kg: `v' = e·v` apart, momentum with the rotor.
#[test]
fn an_impact_meets_the_rotor_too() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, DT));
        let body = |x: f64, v: f64| {
            let body = RigidBody::new(sphere(0.1)).with_mass(2.0).with_velocity(Vec3::new(v, 0.0, 0.0));
            body.with_material(Material { restitution: 0.5, ..Material::default() })
                .with_pose(Pose::translation(x, 0.0, 0.0))
        };
        let slider = world.add(body(0.0, 0.0)).unwrap();
        let striker = world.add(body(-0.5, 3.0)).unwrap();
        let rail = join(&world, LoopJointKind::Prismatic, slider, None, JointPlace::on_line(Vec3::zeros(), Vec3::x()));
        world.add(rail.with_armature(6.0).unwrap()).unwrap();
        run(&mut world, 0.5);
        let [hit, strike] = [slider, striker].map(|id| world.part_state(id, 0).unwrap().velocity.x);
        assert!((hit - 2.0 * 3.0 * 1.5 / 10.0).abs() < 1e-6, "{stepper}: {hit}");
        assert!((strike - (hit - 1.5)).abs() < 1e-6, "{stepper}: {strike}");
    }
}

/// A drive that is held by its effort: `α = (τ − τ_max)/(I + a)` under a torque above it, none under a torque below.
#[test]
fn a_drive_stalls_at_its_effort() {
    for stepper in STEPPERS {
        for (kind, k) in [
            (LoopJointKind::Revolute, 0),
            (LoopJointKind::Cylindrical, 1),
            (LoopJointKind::Planar, 2),
            (LoopJointKind::Spherical, 2),
        ] {
            let turned = |torque: f64| {
                let mut world = no_gravity(world(stepper, DT));
                let id = ball(&mut world, Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
                let mut joint = join(&world, kind, id, None, JointPlace::at(Vec3::zeros()));
                let drive = Drive::Velocity { target: 0.0, limit: 3.0 };
                joint.set_dof_at(k, DofSettings { drive, ..DofSettings::default() }).unwrap();
                joint.set_armature_at(k, 0.5).unwrap();
                let joint = world.add(joint).unwrap();
                for _ in 0..120 {
                    world.apply_torque(id, 0, Vec3::new(0.0, 0.0, torque)).unwrap();
                    world.step().unwrap();
                }
                (at(&world, joint, k)[1], world.joint_force(joint).unwrap().drives[k])
            };
            let (rate, force) = turned(4.0);
            assert!(
                (rate - 0.5 * 1.0 / 1.0).abs() < 1e-9 && (force + 3.0).abs() < 1e-9,
                "{stepper} {kind:?}: {rate} {force}"
            );
            let (rate, force) = turned(2.5);
            assert!(rate.abs() < 1e-9 && (force + 2.5).abs() < 1e-9, "{stepper} {kind:?}: {rate} {force}");
        }
    }
}

/// `x = m·v²/(2F)` along the plane, `θ = I·ω²/(2τ)` about its normal.
#[test]
fn friction_stops_a_planar_joint() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, DT));
        let id = ball(&mut world, Vec3::zeros(), Vec3::new(1.5, -1.0, 0.0), Vec3::new(0.0, 0.0, 2.0));
        let mut joint = join(&world, LoopJointKind::Planar, id, None, JointPlace::at(Vec3::zeros()));
        for (k, friction) in [4.0, 2.0, 1.0].into_iter().enumerate() {
            joint.set_dof_at(k, DofSettings { friction, ..DofSettings::default() }).unwrap();
        }
        let joint = world.add(joint).unwrap();
        run(&mut world, 2.0);
        let expected = [2.0 * 1.5 * 1.5 / 8.0, -2.0 / 4.0, 0.5 * 4.0 / 2.0];
        for (k, expected) in expected.into_iter().enumerate() {
            let [position, rate] = at(&world, joint, k);
            // the last step may stop within the step
            assert!((position - expected).abs() < 5e-3 && rate.abs() < 1e-9, "{stepper} {k}: {position} {expected}");
        }
    }
}

/// A ball on a universal joint falls to the limit of one axis, and rests on it; the other one is a spring whose rest angle is closed.
#[test]
fn limits_of_a_universal_joint_hold() {
    for stepper in STEPPERS {
        let mut world = world(stepper, DT);
        let id = ball(&mut world, Vec3::new(0.0, 0.0, 0.5), Vec3::zeros(), Vec3::new(0.1, 0.0, 0.0));
        let place = JointPlace::on_line(Vec3::zeros(), Vec3::y()).with_second_axis(Vec3::x());
        let mut joint = join(&world, LoopJointKind::Universal, id, None, place);
        let limited = DofSettings { limits: Some([-0.3, 0.4]), damping: 1.0, ..DofSettings::default() };
        joint.set_dof_at(1, limited).unwrap();
        joint.set_dof_at(0, held_at(0.2, 100.0, 20.0)).unwrap();
        let joint = world.add(joint).unwrap();
        run(&mut world, 8.0);
        let [first, second] = [0, 1].map(|k| at(&world, joint, k));
        assert!((second[0] - 0.4).abs() < 1e-6 && second[1].abs() < 1e-6, "{stepper}: {second:?}");
        // k·(q* − q) = −m·g·l·sin(q)·cos(0.4) about the axis that leans
        let balance = 100.0 * (0.2 - first[0]) + 2.0 * 9.81 * 0.5 * first[0].sin() * 0.4f64.cos();
        assert!(balance.abs() < 1e-5, "{stepper}: {first:?} {balance}");
    }
}

/// The drive of a spherical joint turns about the axis of the rotation that is left: `θ = θ₀·cos(ωt)`, `ω = √(k/I)`; with
/// damping it ends at its target.
#[test]
fn a_drive_of_a_spherical_joint_turns_to_its_target() {
    let target = Vec3::new(0.8, -0.5, 1.1);
    for stepper in STEPPERS {
        let driven = |dt: f64, damping: f64, seconds: f64| {
            let mut world = no_gravity(world(stepper, dt));
            let id = ball(&mut world, Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
            let mut joint = join(&world, LoopJointKind::Spherical, id, None, JointPlace::at(Vec3::zeros()));
            (0..3).for_each(|k| joint.set_dof_at(k, held_at(target[k], 2.0, damping)).unwrap());
            let joint = world.add(joint).unwrap();
            run(&mut world, seconds);
            Vec3::from_fn(|k, _| at(&world, joint, k)[0])
        };
        let left = (driven(DT, 2.0, 10.0) - target).norm();
        assert!(left < 1e-6, "{stepper}: {left}");
        // half a period later it has turned as far beyond
        let error = |dt: f64| (driven(dt, 0.0, 0.75) - target * (1.0 - (2.0 * 0.75f64).cos())).norm();
        let [coarse, fine] = [1.0 / 240.0, 1.0 / 480.0].map(error);
        // drives are implicit in time_stepping: first order
        assert!(fine < 1e-2 && coarse / fine > 1.9, "{stepper}: {coarse:e} {fine:e}");
    }
}

/// Springs of a spherical joint that rest at an orientation are a torsional spring: energy stays, `ω = √(k/I)`.
#[test]
fn springs_of_a_spherical_joint_keep_their_energy() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, DT));
        let id = ball(&mut world, Vec3::zeros(), Vec3::zeros(), Vec3::new(0.3, -0.2, 0.4));
        let mut joint = join(&world, LoopJointKind::Spherical, id, None, JointPlace::at(Vec3::zeros()));
        let rest = Vec3::new(0.4, 0.9, -0.6);
        for k in 0..3 {
            let spring = Spring { stiffness: 2.0, rest: rest[k] };
            joint.set_dof_at(k, DofSettings { spring: Some(spring), ..DofSettings::default() }).unwrap();
        }
        world.add(joint).unwrap();
        let energy = total(&world);
        assert!((energy - (rest.norm_squared() + 0.25 * 0.29)).abs() < 1e-12);
        let mut worst = 0.0f64;
        for _ in 0..1200 {
            world.step().unwrap();
            worst = worst.max((total(&world) - energy).abs() / energy);
        }
        assert!(worst < 1e-3, "{stepper}: {worst:e}");
    }
}

/// A body that spins about its axis stops at the limit of its twist, swung or not.
#[test]
fn the_twist_of_a_spherical_joint_stops_at_its_limits() {
    for stepper in STEPPERS {
        for spin in [Vec3::new(0.0, 0.0, 3.0), Vec3::new(0.6, 0.5, -3.0)] {
            let mut world = no_gravity(world(stepper, DT));
            let id = ball(&mut world, Vec3::zeros(), Vec3::zeros(), spin);
            let joint = join(&world, LoopJointKind::Spherical, id, None, JointPlace::at(Vec3::zeros()));
            let joint = joint.with_cone(1.2).unwrap().with_twist_limits([-0.7, 0.5]).unwrap();
            let joint = world.add(joint).unwrap();
            let mut furthest = [0.0f64; 2];
            for _ in 0..360 {
                world.step().unwrap();
                let turned = Quat::from_scaled_axis(Vec3::from_fn(|k, _| at(&world, joint, k)[0]));
                let twist = 2.0 * (turned.k / turned.w).atan();
                furthest = [furthest[0].min(twist), furthest[1].max(twist)];
            }
            let reached = if spin.z > 0.0 { furthest[1] - 0.5 } else { -0.7 - furthest[0] };
            assert!(reached.abs() < 1e-6, "{stepper} {spin:?}: {furthest:?}");
            assert!(furthest[0] > -0.7 - 1e-6 && furthest[1] < 0.5 + 1e-6, "{stepper}: {furthest:?}");
        }
    }
}

/// Both degrees of freedom of a cylindrical joint at once: `x = ½·(F/m)·t²` to its stop, and a steady spin.
#[test]
fn a_cylindrical_joint_slides_to_its_stop_and_turns_at_its_drive() {
    for stepper in STEPPERS {
        let mut world = world(stepper, DT);
        let id = ball(&mut world, Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
        let mut joint = join(&world, LoopJointKind::Cylindrical, id, None, JointPlace::at(Vec3::zeros()));
        joint.set_dof(DofSettings { limits: Some([-0.25, 1.0]), ..DofSettings::default() }).unwrap();
        let drive = Drive::Velocity { target: 2.0, limit: 0.5 };
        joint.set_dof_at(1, DofSettings { drive, max_velocity: 1.5, ..DofSettings::default() }).unwrap();
        let joint = world.add(joint).unwrap();
        run(&mut world, 0.2);
        assert!((at(&world, joint, 0)[0] + 0.5 * 9.81 * 0.04).abs() < 1e-9, "{stepper}");
        assert!((at(&world, joint, 1)[1] - 0.2).abs() < 1e-9, "{stepper}");
        run(&mut world, 2.0);
        let [[x, _], [_, rate]] = [0, 1].map(|k| at(&world, joint, k));
        assert!((x + 0.25).abs() < 1e-6 && (rate - 1.5).abs() < 1e-9, "{stepper}: {x} {rate}");
    }
}

/// `δω' = δω + dt·τ/(I + a)` in the derivative of a step.
#[test]
fn the_derivative_of_a_step_has_the_rotor() {
    let mut world = no_gravity(world("time_stepping", DT));
    let id = ball(&mut world, Vec3::zeros(), Vec3::zeros(), Vec3::new(0.0, 0.0, 0.7));
    let joint = join(&world, LoopJointKind::Revolute, id, None, JointPlace::at(Vec3::zeros()));
    world.add(joint.with_armature(1.5).unwrap()).unwrap();
    let step = world.linearize().unwrap();
    let (turn, rate) = (2, 8);
    assert!((step.b[(rate, turn)] - DT / 2.0).abs() < 1e-9 * DT, "{:e}", step.b[(rate, turn)]);
    assert!((step.a[(rate, rate)] - 1.0).abs() < 1e-8, "{}", step.a[(rate, rate)]);
}
