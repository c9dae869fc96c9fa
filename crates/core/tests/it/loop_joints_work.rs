//! Joints do no work: mechanisms keep their energy at any step, and follow their motion to a higher order than the steps.

use crate::common::*;
use crate::loop_joints::{AXIS, FourBar, bar, hinge};
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

/// Returns the angle of the crank of the four-bar linkage after half a second, rad.
fn crank(stepper: &str, rate: f64) -> f64 {
    let mut linkage = FourBar::new(stepper, 1.0 / rate);
    linkage.world.set_settings(linkage.world.settings().with_max_turn(1e6)).unwrap();
    (0..(0.5 * rate) as usize).for_each(|_| {
        linkage.world.step().unwrap();
    });
    let x = linkage.world.part_state(linkage.bars[0], 0).unwrap().pose.rotation * Vec3::x();
    x.z.atan2(x.x)
}

#[test]
fn a_four_bar_linkage_moves_to_the_third_order_of_the_step() {
    let exact = crank("time_stepping", 7680.0);
    for stepper in STEPPERS {
        let errors = [60.0, 120.0, 240.0, 480.0].map(|rate| (crank(stepper, rate) - exact).abs());
        println!("{stepper}: crank off by {errors:?} rad");
        assert!(errors[0] < 1e-3 && errors[3] < 2e-6, "{stepper}: {errors:?}");
        assert!(errors.windows(2).all(|pair| pair[0] > 6.0 * pair[1]), "{stepper}: {errors:?}");
    }
}

#[test]
fn a_four_bar_linkage_keeps_its_energy_at_60_hz_for_a_minute() {
    for stepper in STEPPERS {
        let mut linkage = FourBar::new(stepper, 1.0 / 60.0);
        let start = linkage.world.energy().total();
        let (mut worst, mut swing) = (0.0f64, 0.0f64);
        for _ in 0..3600 {
            linkage.world.step().unwrap();
            let energy = linkage.world.energy();
            (worst, swing) = (worst.max((energy.total() - start).abs()), swing.max(energy.kinetic));
        }
        println!("{stepper}: {worst:.1e} J of {swing} J");
        assert!(worst < 1e-6 * swing, "{stepper}: {worst:e} J of {swing} J");
    }
}

/// Largest change of energy (of the first kinetic energy) and of momentum, kg·m/s, and the last angle between the bars, of two
/// hinged bars that nothing holds.
fn free_pair(stepper: &str, rate: f64) -> [f64; 3] {
    let mut world = no_gravity(world(stepper, 1.0 / rate));
    let pin = Vec3::new(0.5, 0.0, 0.0);
    let one = world.add(bar("one", Vec3::zeros(), pin).with_angular_velocity(4.0 * AXIS)).unwrap();
    let flung = bar("other", pin, pin + Vec3::new(0.0, 0.0, 0.3));
    let (turn, arm) = (-3.0 * AXIS, Vec3::new(0.0, 0.0, 0.15));
    let at_pin = (4.0 * AXIS).cross(&Vec3::new(0.25, 0.0, 0.0));
    let other = world.add(flung.with_angular_velocity(turn).with_velocity(at_pin + turn.cross(&arm))).unwrap();
    hinge(&mut world, "hinge", one, Some(other), pin, AXIS);
    let (start, before) = (world.energy().kinetic, world.momentum().linear);
    let mut worst = [0.0f64; 3];
    for _ in 0..(1.5 * rate) as usize {
        world.step().unwrap();
        worst[0] = worst[0].max((world.energy().kinetic / start - 1.0).abs());
        worst[1] = worst[1].max((world.momentum().linear - before).norm());
    }
    let rotations = [one, other].map(|id| world.part_state(id, 0).unwrap().pose.rotation);
    worst[2] = rotations[0].angle_to(&rotations[1]);
    worst
}

#[test]
fn two_hinged_bars_in_free_motion_keep_energy_and_momentum() {
    for stepper in STEPPERS {
        let exact = free_pair(stepper, 3840.0)[2];
        let all = [60.0, 120.0, 240.0].map(|rate| free_pair(stepper, rate));
        let off = all.map(|[.., angle]| (angle - exact).abs());
        println!("{stepper}: energy, momentum, angle {all:?}; off by {off:?}");
        assert!(all.iter().all(|[energy, momentum, _]| *energy < 1e-6 && *momentum < 1e-12), "{stepper}: {all:?}");
        assert!(off.windows(2).all(|pair| pair[0] > 3.5 * pair[1]), "{stepper}: {off:?}");
    }
}

/// Largest change of energy, of the drop, of a chain of three bars on spherical joints that whirls about the vertical.
fn whirl(stepper: &str, rate: f64) -> f64 {
    let mut world = world(stepper, 1.0 / rate);
    let mut last: Option<ObjectId> = None;
    for k in 0..3 {
        let ends = [0, 1].map(|i| Vec3::new(0.3 * (k + i) as f64, 0.0, 0.0));
        let middle = 0.5 * (ends[0] + ends[1]);
        let spin = Vec3::new(0.0, 0.0, 3.0);
        let body =
            bar(&format!("bar {k}"), ends[0], ends[1]).with_angular_velocity(spin).with_velocity(spin.cross(&middle));
        let id = world.add(body).unwrap();
        let sides = (Some((id, 0)), last.map(|last| (last, 0)));
        world.add(LoopJoint::spherical_at(format!("joint {k}"), &world, sides.0, sides.1, ends[0]).unwrap()).unwrap();
        last = Some(id);
    }
    let start = world.energy().total();
    let (mut worst, mut most) = (0.0f64, 0.0f64);
    for _ in 0..(10.0 * rate) as usize {
        world.step().unwrap();
        let energy = world.energy();
        (worst, most) = (worst.max((energy.total() - start).abs()), most.max(energy.kinetic));
    }
    worst / most
}

#[test]
fn a_chain_in_space_keeps_its_energy() {
    for stepper in STEPPERS {
        let errors = [60.0, 120.0, 240.0].map(|rate| whirl(stepper, rate));
        println!("{stepper}: {errors:?}");
        assert!(errors.iter().all(|e| *e < 1e-6), "{stepper}: {errors:?}");
    }
}

/// A ball circles on a rod that ends at its center. No force of the rod turns the ball.
#[test]
fn a_joint_at_the_center_of_a_ball_leaves_its_spin() {
    for stepper in STEPPERS {
        for rate in [60.0, 240.0] {
            let mut world = world(stepper, 1.0 / rate);
            world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
            let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(1.0);
            let ball = ball.with_pose(Pose::translation(0.5, 0.0, 0.0)).with_velocity(3.0 * Vec3::y());
            let ball = world.add(ball.with_angular_velocity(2.0 * Vec3::z())).unwrap();
            let place = JointPlace::between(Vec3::x() * 0.5, Vec3::zeros());
            let rod = LoopJoint::joining("rod", LoopJointKind::Distance, &world, Some((ball, 0)), None, place).unwrap();
            world.add(rod).unwrap();
            let before = world.energy().total();
            (0..(20.0 * rate) as usize).for_each(|_| {
                world.step().unwrap();
            });
            let spin = world.part_state(ball, 0).unwrap().angular_velocity.z;
            let energy = world.energy().total() / before - 1.0;
            println!("{stepper} {rate} Hz: spin {spin}, energy {energy:.1e}");
            assert!((spin - 2.0).abs() < 1e-9 && energy.abs() < 1e-4, "{stepper} {rate}: {spin} {energy}");
        }
    }
}
