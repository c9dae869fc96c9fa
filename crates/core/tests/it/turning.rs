//! Joints whose forces turn light parts within a step: chains with heavy ends, and the division of frames.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

const LENGTH: f64 = 0.2;
const LOAD: f64 = 0.5;

/// A chain of bars of 1 kg with a cube at its end, straight at an angle to the vertical, and the energy of its fall.
struct Chain {
    world: World,
    parts: Vec<(ObjectId, usize)>,
    joints: Vec<ObjectId>,
    fall: f64,
}

impl Chain {
    fn start(stepper: &str, dt: f64, max_turn: f64) -> World {
        let mut world = world(stepper, dt);
        world.set_settings(world.settings().with_max_turn(max_turn)).unwrap();
        world
    }

    fn fall(count: usize, load: f64, angle: f64) -> f64 {
        let bars = count as f64 * 0.5 * LENGTH * count as f64;
        G * (bars + load * (LENGTH * count as f64 + 0.5 * LOAD)) * (1.0 - angle.cos())
    }

    /// Rigid bodies, joined by spherical loop joints.
    fn of_bodies(mut world: World, count: usize, load: f64, angle: f64) -> Chain {
        let along = Vec3::new(angle.sin(), 0.0, -angle.cos());
        let (mut parts, mut joints) = (Vec::new(), Vec::new());
        for i in 0..=count {
            let (width, length, mass) = if i == count { (LOAD, LOAD, load) } else { (0.04, LENGTH, 1.0) };
            let start = LENGTH * i as f64 * along;
            let pose = Pose::new(start + 0.5 * length * along, Vec3::new(0.0, -angle, 0.0));
            let bar = RigidBody::new(Shape::cuboid(Vec3::new(width, width, length)).unwrap());
            let id = world.add(bar.with_mass(mass).with_pose(pose)).unwrap();
            world.set_collidable(id, false).unwrap();
            let before = parts.last().copied();
            let joint = LoopJoint::spherical_at(format!("pin {i}"), &world, Some((id, 0)), before, start).unwrap();
            joints.push(world.add(joint).unwrap());
            parts.push((id, 0));
        }
        Chain { world, parts, joints, fall: Chain::fall(count, load, angle) }
    }

    /// The same as one articulated body with hinges, or with spherical joints.
    fn of_links(mut world: World, joint: Joint, count: usize, load: f64, angle: f64) -> Chain {
        let mut builder = ArticulationBuilder::new("chain").with_self_collision(false);
        for i in 0..=count {
            let (width, length, mass) = if i == count { (LOAD, LOAD, load) } else { (0.04, LENGTH, 1.0) };
            let shape = Shape::cuboid(Vec3::new(width, width, length)).unwrap();
            let link = LinkBuilder::new(format!("link {i}"), joint);
            let link = link.with_shape(shape, Pose::translation(0.0, 0.0, -0.5 * length)).with_mass(mass);
            builder = builder.link(match i {
                0 => link,
                _ => link.with_parent(format!("link {}", i - 1)).with_pose(Pose::translation(0.0, 0.0, -LENGTH)),
            });
        }
        let body = builder.build().unwrap().with_pose(Pose::new(Vec3::zeros(), Vec3::new(0.0, -angle, 0.0)));
        let id = world.add(body).unwrap();
        world.set_collidable(id, false).unwrap();
        let parts = (0..=count).map(|i| (id, i)).collect();
        Chain { world, parts, joints: Vec::new(), fall: Chain::fall(count, load, angle) }
    }

    /// Swings for some seconds. Returns the largest change of energy as a fraction of that of the fall, the largest
    /// gap of a joint, m, and the number of sub-steps.
    fn swing(&mut self, seconds: f64) -> (f64, f64, u32) {
        let (start, frames) = (self.world.energy().total(), (seconds / self.world.settings().dt).round() as usize);
        let (mut change, mut gap, mut substeps) = (0.0f64, 0.0f64, 0);
        for _ in 0..frames {
            substeps += self.world.step().unwrap().substeps;
            change = change.max((self.world.energy().total() - start).abs() / self.fall);
            for &joint in &self.joints {
                let joint: &LoopJoint = self.world.get(joint).unwrap();
                gap = gap.max(joint.position_error(&self.world.view()).unwrap().distance);
            }
        }
        (change, gap, substeps)
    }
}

/// Checks chains of ten bars with 1000 kg at the end: their energy, and the gaps of their joints.
fn heavy_ends(rates: &[f64], steppers: &[&str], seconds: f64) {
    for stepper in steppers {
        for &rate in rates {
            for angle in [45.0f64, 90.0] {
                let start = || Chain::start(stepper, 1.0 / rate, 1.0);
                let angle_rad = angle.to_radians();
                let hinge = Joint::revolute(Vec3::y());
                for (name, mut chain) in [
                    ("bodies", Chain::of_bodies(start(), 10, 1000.0, angle_rad)),
                    ("hinges", Chain::of_links(start(), hinge, 10, 1000.0, angle_rad)),
                    ("spherical joints", Chain::of_links(start(), Joint::Spherical, 10, 1000.0, angle_rad)),
                ] {
                    let (change, gap, substeps) = chain.swing(seconds);
                    println!(
                        "{name}, {stepper}, {rate} Hz, {angle}°: energy {change:.1e} of the fall, gap {gap:.1e} m, {substeps} sub-steps"
                    );
                    assert!(change < 1e-3, "{name}, {stepper}, {rate} Hz, {angle}°: energy {change:e}");
                    assert!(gap < 1e-8, "{name}, {stepper}, {rate} Hz, {angle}°: gap {gap:e} m");
                }
            }
        }
    }
}

#[test]
fn light_chains_with_heavy_ends_keep_their_energy_full_length() {
    if std::env::var_os("TUMBLE_SLOW").is_some_and(|v| v == "1") {
        heavy_ends(&[60.0, 240.0, 1000.0], &STEPPERS, 5.0);
    } else {
        heavy_ends(&[60.0], &["time_stepping"], 1.0);
        heavy_ends(&[240.0], &["backtracking"], 0.5);
    }
}

#[test]
fn a_chain_with_a_heavy_end_needs_the_division() {
    let start = Chain::start("time_stepping", 1.0 / 60.0, 1e6);
    let (change, _, substeps) = Chain::of_links(start, Joint::Spherical, 10, 1000.0, 0.8).swing(2.0);
    assert_eq!(substeps, 120);
    assert!(change > 0.5, "energy {change:e}");
}

/// A bar that hangs by one joint: the stiffness is `mg·l/2` about two axes, or one.
#[test]
fn the_turn_of_a_hanging_bar_is_that_of_its_weight() {
    let h = 1.0 / 60.0;
    let (bar, hinge) = (1.0 / 12.0 * (LENGTH * LENGTH + 0.04 * 0.04), 4.0 + 2.0 * 3.0f64.sqrt());
    let about_pin = bar + 0.25 * LENGTH * LENGTH;
    let stiffness = 0.5 * G * LENGTH;
    let free = |mut chain: Chain, count: usize| {
        assert_eq!(chain.parts.len(), count);
        chain.world.step().unwrap();
        chain.world.step().unwrap().max_turn
    };
    // a chain without bars is its load alone: a cube
    let cube = (LOAD * LOAD / 6.0, 0.5 * G * LOAD);
    let turn = free(Chain::of_bodies(Chain::start("time_stepping", h, 1.0), 0, 1.0, 0.0), 1);
    assert_relative(turn, h * (2.0f64.sqrt() * cube.1 / cube.0).sqrt());
    let about = cube.0 + 0.25 * LOAD * LOAD;
    let revolute = Joint::revolute(Vec3::y());
    let turn = free(Chain::of_links(Chain::start("time_stepping", h, 1.0), revolute, 0, 1.0, 0.0), 1);
    assert_relative(turn, h * (hinge * cube.1 / about).sqrt());
    // with a bar above a load without weight to speak of, the bar is as if alone
    let turn = free(Chain::of_links(Chain::start("time_stepping", h, 10.0), revolute, 1, 1e-9, 0.0), 2);
    assert_relative(turn, h * (hinge * stiffness / about_pin).sqrt());
}

fn assert_relative(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-6 * expected, "{value} is not {expected}");
}

#[test]
fn a_motor_that_spins_a_disc_about_its_center_is_not_divided() {
    let mut world = world("time_stepping", 1.0 / 60.0);
    let disc = RigidBody::new(Shape::cylinder(0.1, 0.02).unwrap()).with_mass(1.0);
    let disc = world.add(disc.with_angular_velocity(Vec3::new(0.0, 0.0, 1000.0))).unwrap();
    let hinge = LoopJoint::revolute_at("axle", &world, Some((disc, 0)), None, Vec3::zeros(), Vec3::z()).unwrap();
    world.add(hinge).unwrap();
    for _ in 0..60 {
        assert_eq!(world.step().unwrap().substeps, 1);
    }
    assert!((world.part_state(disc, 0).unwrap().angular_velocity.z - 1000.0).abs() < 1e-6);
}

#[test]
fn a_divided_frame_has_the_same_bits_after_a_restore() {
    for stepper in STEPPERS {
        let mut chain = Chain::of_bodies(Chain::start(stepper, 1.0 / 60.0, 1.0), 6, 300.0, 1.2);
        chain.swing(0.5);
        let saved = chain.world.save();
        let (_, _, substeps) = chain.swing(0.2);
        assert!(substeps > 24, "{stepper}: {substeps}");
        let after = chain.world.save();
        chain.world.restore(&saved).unwrap();
        assert_eq!(chain.swing(0.2).2, substeps);
        assert!(chain.world.save() == after, "{stepper}");
    }
}

#[test]
fn what_no_division_can_hold_is_an_error_that_names_the_part() {
    let start = Chain::start("time_stepping", 1.0 / 60.0, 1.0);
    let mut chain = Chain::of_links(start, Joint::revolute(Vec3::y()), 4, 1e7, 0.5);
    let before = chain.world.save();
    let error = chain.world.step().unwrap_err();
    assert!(matches!(&error, StepError::Turn { object, turn, .. } if object == "chain" && *turn > 1.0), "{error}");
    assert!(error.to_string().contains("raise max_turn"), "{error}");
    assert!(chain.world.save() == before);
    let wrong = chain.world.settings().with_max_turn(0.0);
    assert!(chain.world.set_settings(wrong).unwrap_err().to_string().contains("max turn"));
}
