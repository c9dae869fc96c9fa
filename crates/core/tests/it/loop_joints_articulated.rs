//! Loop joints between links of articulated bodies, and between links and rigid bodies: the same
//! linkage opened at different pins.

use crate::common::*;
use crate::loop_joints::{AXIS, FourBar, GROUND, LENGTHS, bar, hinge, pins};
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

const RATE: f64 = 240.0;
const CRANK: f64 = 1.9;

fn turn(v: Vec3) -> f64 {
    v.z.atan2(v.x)
}

/// Returns a chain of the named bars, each attached to the end of the previous one, in the
/// linkage's initial configuration.
fn chain(name: &str, bars: &[usize]) -> ArticulatedBody {
    let (a, b) = pins(CRANK);
    let angles = [turn(a), turn(b - a), turn(GROUND - b)];
    let mut builder = ModelBuilder::new();
    let (mut parent, mut reach, mut last, mut q) = (None, Vec3::zeros(), 0.0, Vec::new());
    for &k in bars {
        let like = bar("like", Vec3::zeros(), LENGTHS[k] * Vec3::x());
        let mass = LinkMass { mass: like.mass(), center: 0.5 * LENGTHS[k] * Vec3::x(), inertia: *like.inertia() };
        parent = Some(builder.link(format!("bar {k}"), parent, Joint::revolute(AXIS), Pose::from(reach), mass));
        (reach, last) = (LENGTHS[k] * Vec3::x(), {
            q.push(angles[k] - last);
            angles[k]
        });
    }
    ArticulatedBody::new(name, builder.build().unwrap()).with_positions(&q).unwrap()
}

struct Opened {
    world: World,
    crank: (ObjectId, usize),
    rocker: (ObjectId, usize),
    loop_joints: Vec<ObjectId>,
}

/// Returns all three bars as one chain, closed by a revolute joint at the ground.
fn one_chain(stepper: &str) -> Opened {
    let mut world = world(stepper, 1.0 / RATE);
    let chain = world.add(chain("chain", &[0, 1, 2])).unwrap();
    let foot = LoopJoint::revolute_at("foot", &world, Some((chain, 2)), None, GROUND, AXIS).unwrap();
    let loop_joints = vec![world.add(foot).unwrap()];
    Opened { world, crank: (chain, 0), rocker: (chain, 2), loop_joints }
}

/// Returns crank and coupler as a chain, with the rocker as a rigid body.
fn chain_and_body(stepper: &str) -> Opened {
    let mut world = world(stepper, 1.0 / RATE);
    let (_, b) = pins(CRANK);
    let chain = world.add(chain("chain", &[0, 1])).unwrap();
    let rocker = world.add(bar("rocker", b, GROUND)).unwrap();
    let pin = LoopJoint::revolute_at("pin", &world, Some((rocker, 0)), Some((chain, 1)), b, AXIS).unwrap();
    let loop_joints = vec![world.add(pin).unwrap(), hinge(&mut world, "foot", rocker, None, GROUND, AXIS)];
    Opened { world, crank: (chain, 0), rocker: (rocker, 0), loop_joints }
}

#[test]
fn a_linkage_cut_open_anywhere_moves_the_same() {
    for stepper in STEPPERS {
        for (name, make) in [("one chain", one_chain as fn(&str) -> Opened), ("chain and body", chain_and_body)] {
            let mut open = make(stepper);
            let start = open.world.energy().total();
            let (mut gap, mut off, mut energy, mut kinetic, mut lost) = (0.0f64, 0.0f64, 0.0f64, 0.0f64, 0.0);
            for _ in 0..(20.0 * RATE) as usize {
                open.world.step().unwrap();
                for id in &open.loop_joints {
                    gap = gap.max(
                        open.world.get::<LoopJoint>(*id).unwrap().position_error(&open.world.view()).unwrap().distance,
                    );
                }
                let x = open.world.part_state(open.crank.0, open.crank.1).unwrap().pose.rotation * Vec3::x();
                let (_, b) = pins(turn(x));
                let rocker = open.world.part_state(open.rocker.0, open.rocker.1).unwrap().pose.rotation * Vec3::x();
                off = off.max((rocker - (GROUND - b) / LENGTHS[2]).norm());
                lost = open.world.energy().total() - start;
                energy = energy.max(lost.abs());
                kinetic = kinetic.max(open.world.energy().kinetic);
            }
            println!(
                "{stepper}, {name}: gap {gap:.1e} m, rocker off by {off:.1e} rad, energy by {energy:.1e} J ({lost:.1e} at the end) of {kinetic:.3} J"
            );
            assert!(gap < 2e-9, "{stepper}, {name}: {gap:e} m");
            assert!(off < 1e-6, "{stepper}, {name}: the rocker is {off:e} rad off the closed form");
            assert!(energy < 5e-3 * kinetic, "{stepper}, {name}: energy is off by {energy:e} J of {kinetic} J");
        }
    }
}

#[test]
fn a_chain_closed_at_its_end_and_three_joined_bars_are_the_same_machine() {
    // both are of second order: their difference is a quarter at half the step
    for stepper in STEPPERS {
        let apart = |rate: f64| {
            let (mut bars, mut chain) = (FourBar::new(stepper, 1.0 / rate), one_chain(stepper));
            let settings = chain.world.settings().with_dt(1.0 / rate);
            chain.world.set_settings(settings).unwrap();
            let mut worst = 0.0f64;
            for _ in 0..(0.5 * rate) as usize {
                bars.world.step().unwrap();
                chain.world.step().unwrap();
                let rotations = [(&bars.world, bars.bars[0], 0), (&chain.world, chain.crank.0, 0)]
                    .map(|(w, id, part)| w.part_state(id, part).unwrap().pose.rotation);
                worst = worst.max(rotations[0].angle_to(&rotations[1]));
            }
            worst
        };
        let [coarse, fine] = [240.0, 480.0].map(apart);
        println!("{stepper}: cranks apart by {coarse:.2e} rad at 240 Hz, {fine:.2e} at 480 Hz");
        assert!(coarse < 1e-3 && fine < 0.3 * coarse, "{stepper}: {coarse:e}, {fine:e}");
    }
}
