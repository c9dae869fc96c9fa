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

/// Two light bars between a pin and a load: their common pin moves to the side with `ω² = T·l/I`, `I` about an end,, and in steps of `h` with
/// `tan(½ω'h) = ½ωh`, as the implicit midpoint rule has it.
#[test]
fn a_taut_bar_turns_as_the_implicit_midpoint_rule_says() {
    let (mass, load, h) = (0.04, 1000.0, 1.0 / 960.0);
    let mut world = Chain::start("time_stepping", 4.0 * h, 1.0);
    let tilt = 1e-5f64;
    let bar = |world: &mut World, from: Vec3, to: Vec3, before: Option<(ObjectId, usize)>| {
        let turn = (from - to).x.atan2((from - to).z);
        let body = RigidBody::new(Shape::cuboid(Vec3::new(0.02, 0.02, LENGTH)).unwrap()).with_mass(mass);
        let id = world.add(body.with_pose(Pose::new(0.5 * (from + to), Vec3::new(0.0, turn, 0.0)))).unwrap();
        world.set_collidable(id, false).unwrap();
        let name = format!("pin of {id:?}");
        world.add(LoopJoint::revolute_at(name, world, Some((id, 0)), before, from, Vec3::y()).unwrap()).unwrap();
        id
    };
    let middle = LENGTH * Vec3::new(tilt.sin(), 0.0, -tilt.cos());
    let end = Vec3::new(0.0, 0.0, 2.0 * middle.z);
    let first = bar(&mut world, Vec3::zeros(), middle, None);
    let second = bar(&mut world, middle, end, Some((first, 0)));
    let cube = RigidBody::new(Shape::cuboid(Vec3::repeat(LOAD)).unwrap()).with_mass(load);
    let cube = world.add(cube.with_pose(Pose::new(end, Vec3::zeros()))).unwrap();
    world.set_collidable(cube, false).unwrap();
    let pin = LoopJoint::revolute_at("load", &world, Some((cube, 0)), Some((second, 0)), end, Vec3::y()).unwrap();
    world.add(pin).unwrap();
    let angle = |world: &World| world.body(first).unwrap().position().x / (0.5 * LENGTH);
    // the first frames know no forces of joints and are divided, for a second
    (0..300).for_each(|_| world.step().map(|_| ()).unwrap());
    let mut angles = vec![angle(&world)];
    for _ in 0..2000 {
        assert_eq!(world.step().unwrap().substeps, 4, "frame {}", angles.len());
        angles.push(angle(&world));
    }
    let about_end = mass * (LENGTH * LENGTH / 3.0 + 0.02 * 0.02 / 12.0);
    let omega = ((load + mass) * G * LENGTH / about_end).sqrt();
    assert!(omega * h > 1.9, "{}", omega * h);
    let in_frame = 4.0 * 2.0 * (0.5 * omega * h).atan();
    for (k, of) in angles.windows(3).enumerate() {
        let expected = 2.0 * in_frame.cos() * of[1] - of[0];
        assert!((of[2] - expected).abs() < 2e-3 * tilt, "frame {k}: {} for {expected}", of[2]);
    }
    // joints are closed to 1e-9 m, by which the load does as much work as that of 1 % of the oscillation
    let largest = |part: &[f64]| part.iter().fold(0.0f64, |most, angle| most.max(angle.abs()));
    let [before, after] = [largest(&angles[..500]), largest(&angles[1500..])];
    println!("{before} rad, then {after} rad");
    assert!((after / before - 1.0).abs() < 0.05, "{before} then {after}");
}

/// The load swings by a meter as with steps that resolve its chain, to 1e-7 m.
#[test]
fn a_load_on_a_taut_chain_moves_as_if_the_chain_were_resolved() {
    let end = |rate: f64| {
        let mut chain = Chain::of_bodies(Chain::start("time_stepping", 1.0 / rate, 1.0), 3, 1e4, 0.6);
        let (change, gap, substeps) = chain.swing(1.0);
        assert!(gap < 1e-8 && change < 1e-6, "{rate} Hz: {gap} m, {change}");
        (chain.world.part_state(chain.parts[3].0, 0).unwrap().pose.translation.vector, substeps)
    };
    let (resolved, substeps) = end(7680.0);
    assert_eq!(substeps, 7680);
    for (rate, most) in [(60.0, 1e-7), (120.0, 4e-8), (240.0, 1e-8)] {
        let (place, substeps) = end(rate);
        assert!(f64::from(substeps) <= 4.0 * rate, "{rate} Hz: {substeps}");
        let error = (place - resolved).norm();
        println!("{rate} Hz: {error:.1e} m, {substeps} sub-steps");
        assert!(error < most, "{rate} Hz: {error:e} m");
    }
}

/// A rope of 20 links with 1800 times their mass at its end.
fn rope(dt: f64, level: bool) -> Chain {
    let world = Chain::start("time_stepping", dt, 1.0);
    let mut chain = Chain::of_bodies(world, 20, 1800.0, if level { 0.5 * std::f64::consts::PI } else { 0.0 });
    chain.fall = 1800.0 * G * LENGTH * 20.0;
    chain
}

#[test]
fn a_rope_with_a_heavy_end_hangs_at_the_cost_of_four_sub_steps() {
    let mut chain = rope(1.0 / 60.0, false);
    let before = chain.world.part_state(chain.parts[20].0, 0).unwrap().pose.translation.vector;
    let (change, gap, substeps) = chain.swing(2.0);
    let after = chain.world.part_state(chain.parts[20].0, 0).unwrap().pose.translation.vector;
    assert!((after - before).norm() < 1e-9 && change < 1e-12 && gap < 1e-10, "{after}, {change}, {gap}");
    assert_eq!(substeps, 480);
}

/// The responses along a straight rope differ by more than a thousand, but a tree of free bodies can always be closed.
#[test]
fn a_rope_that_a_load_pulls_straight_is_not_out_of_reach() {
    let mut chain = rope(1.0 / 960.0, true);
    for _ in 0..480 {
        let report = chain.world.step().unwrap();
        assert_eq!(report.unreachable_joint, None);
    }
    let (change, gap, _) = chain.swing(0.25);
    assert!(change < 1e-6 && gap < 1e-8, "{change}, {gap}");
}
