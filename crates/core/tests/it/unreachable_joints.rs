//! Loop joints whose kinematic side moves out of reach: the attached bodies lag behind, stay
//! finite, and the joint closes again.

use crate::articulated_world::{hinged, rod, world};
use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

/// A chain of links of 0.2 m from the origin, whose end is attached to a kinematic hand.
struct ReachMechanism {
    world: World,
    chain: ObjectId,
    hand: ObjectId,
    loop_joint: ObjectId,
    links: usize,
    /// The last report of this joint.
    reported: Option<UnreachableJoint>,
}

const LENGTH: f64 = 0.2;

impl ReachMechanism {
    /// Hangs up the chain in a zigzag of `angle` from −z, and attaches its end to the hand.
    fn new(stepper: &str, links: usize, angle: f64) -> ReachMechanism {
        let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
        let q: Vec<f64> = (0..links)
            .map(|i| {
                if i == 0 {
                    angle
                } else if i % 2 == 1 {
                    -2.0 * angle
                } else {
                    2.0 * angle
                }
            })
            .collect();
        let chain = ArticulatedBody::new("chain", hinged(links, LENGTH, rod(1.0, LENGTH))).with_positions(&q).unwrap();
        let chain = world.add(chain).unwrap();
        let last = world.part_state(chain, links - 1).unwrap().pose;
        let end = last.translation.vector - LENGTH * (last.rotation * Vec3::z());
        let mut hand =
            RigidBody::fixed(sphere(0.01)).with_name("hand").with_pose(Pose::translation(end.x, end.y, end.z));
        hand.mask = 0;
        let hand = world.add_boxed(Box::new(hand), Mode::Kinematic).unwrap();
        let pin = LoopJoint::spherical_at("pin", &world, Some((chain, links - 1)), Some((hand, 0)), end).unwrap();
        let loop_joint = world.add(pin).unwrap();
        ReachMechanism { world, chain, hand, loop_joint, links, reported: None }
    }

    fn position_error(&self) -> f64 {
        self.world.get::<LoopJoint>(self.loop_joint).unwrap().position_error(&self.world.view()).unwrap().distance
    }

    /// Returns the speed of the fastest joint, rad/s.
    fn fastest(&self) -> f64 {
        self.world.state_of(self.chain).unwrap()[self.links..].iter().fold(0.0, |a: f64, v| a.max(v.abs()))
    }

    /// Moves the hand for the given time. Returns the highest joint speed, over the root of the number of
    /// sub-steps of its frame if frames are divided, and the largest position error.
    fn lead(&mut self, velocity: Vec3, seconds: f64) -> (f64, f64) {
        let (mut fastest, mut position_error): (f64, f64) = (0.0, 0.0);
        for _ in 0..(seconds * 240.0).round() as usize {
            self.world.set_velocity(self.hand, velocity, Vec3::zeros()).unwrap();
            let report = *self.world.step().unwrap();
            self.reported = report.unreachable_joint.or(self.reported);
            let divided = self.world.settings().max_turn < 1e6;
            let steps = if divided { f64::from(report.substeps) } else { 1.0 };
            fastest = fastest.max(self.fastest() / steps.sqrt());
            position_error = position_error.max(self.position_error());
        }
        (fastest, position_error)
    }
}

/// Returns the distance of a hand from the reach of the chain, which turns in the plane y = 0.
fn lag(hand: &Vec3, reach: f64) -> f64 {
    hand.y.hypot((hand.x.hypot(hand.z) - reach).max(0.0))
}

#[test]
fn a_chain_whose_hand_goes_out_of_reach_follows_it_straight_and_closes_again() {
    // before the fix, the chain turned at 1e10 rad/s, stayed folded, and nothing was reported
    let speed = 0.5;
    // the last bend of two links of length ℓ, ℓ·θ²/4 = v·h, disappears in one step; with more
    // links, proportionally faster
    let crossing = |links: usize| links as f64 * (4.0 * speed * 240.0 / LENGTH).sqrt();
    // as divided frames have shorter steps, their speeds are compared per root of the number of sub-steps
    for (stepper, max_turn) in
        [("time_stepping", 1e6), ("backtracking", 1e6), ("time_stepping", 1.0), ("backtracking", 1.0)]
    {
        for links in [2, 5] {
            let reach = links as f64 * LENGTH;
            for along in [Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.6, 0.0, -0.8), Vec3::new(0.0, 0.6, -0.8)] {
                let name = format!("{stepper}, max_turn {max_turn}, {links} links, along {along:?}");
                let mut mechanism = ReachMechanism::new(stepper, links, 0.5);
                let settings = mechanism.world.settings().with_max_turn(max_turn);
                mechanism.world.set_settings(settings).unwrap();
                let (across, _) = mechanism.lead(speed * along, 1.0);
                let (out, _) = mechanism.lead(speed * along, 1.0);
                let hand = position(&mechanism.world, mechanism.hand);
                let (position_error, expected, reported) =
                    (mechanism.position_error(), lag(&hand, reach), mechanism.reported.unwrap());
                let end = mechanism.world.part_state(mechanism.chain, links - 1).unwrap().pose;
                let bent = (end.rotation * -Vec3::z()).angle(&Vec3::new(hand.x, 0.0, hand.z));
                let (back, _) = mechanism.lead(-speed * along, 2.0);
                let (rest, _) = mechanism.lead(Vec3::zeros(), 0.5);
                println!(
                    "{name}: {across:.1} rad/s across, {out:.2} out, {back:.1} back; lags {position_error:.6} m, {:.1e} off, {bent:.1e} rad; closed to {:.1e} m, {rest:.1e} rad/s",
                    position_error - expected,
                    mechanism.position_error()
                );
                // across the plane the hand is out of reach from the start: the chain is still
                // straightening
                let straight = if along.y == 0.0 { 4.0 * speed / LENGTH } else { crossing(links) };
                assert!(
                    across < crossing(links) && back < crossing(links) && out < straight,
                    "{name}: {across}, {out}, {back} rad/s"
                );
                assert!(
                    (position_error - expected).abs() < 1e-3 && bent < 3e-2,
                    "{name}: {position_error} m for {expected} m, bent by {bent} rad"
                );
                assert!(
                    reported.loop_joint == mechanism.loop_joint && reported.distance == position_error,
                    "{name}: {reported:?}"
                );
                assert!(mechanism.position_error() < 2e-9, "{name}: open by {:e} m", mechanism.position_error());
            }
        }
    }
}

#[test]
fn rigid_bars_pinned_in_a_row_share_what_is_out_of_reach() {
    for stepper in STEPPERS {
        let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
        let bar = |i: usize| {
            let mut body = RigidBody::new(Shape::cuboid(Vec3::new(0.2, 0.02, 0.02)).unwrap())
                .with_name(format!("bar {i}"))
                .with_mass(1.0);
            body.mask = 0;
            body.with_pose(Pose::translation(0.1 + 0.2 * i as f64, 0.0, 0.0))
        };
        let bars: Vec<ObjectId> = (0..3).map(|i| world.add(bar(i)).unwrap()).collect();
        let mut hand = RigidBody::fixed(sphere(0.01)).with_name("hand").with_pose(Pose::translation(0.6, 0.0, 0.0));
        hand.mask = 0;
        let hand = world.add_boxed(Box::new(hand), Mode::Kinematic).unwrap();
        let parts = [None, Some((bars[0], 0)), Some((bars[1], 0)), Some((bars[2], 0)), Some((hand, 0))];
        let pins: Vec<ObjectId> = (0..4)
            .map(|i| {
                let pin = LoopJoint::spherical_at(
                    format!("pin {i}"),
                    &world,
                    parts[i],
                    parts[i + 1],
                    Vec3::new(0.2 * i as f64, 0.0, 0.0),
                )
                .unwrap();
                world.add(pin).unwrap()
            })
            .collect();
        let (mut fastest, mut said): (f64, f64) = (0.0, 0.0);
        for velocity in [0.5, -0.5, 0.0] {
            for _ in 0..240 {
                world.set_velocity(hand, Vec3::new(velocity, 0.0, 0.0), Vec3::zeros()).unwrap();
                said = said.max(world.step().unwrap().unreachable_joint.map_or(0.0, |o| o.distance));
                fastest = bars
                    .iter()
                    .map(|id| world.part_state(*id, 0).unwrap().angular_velocity.norm())
                    .fold(fastest, f64::max);
            }
        }
        let open = pins
            .iter()
            .map(|id| world.get::<LoopJoint>(*id).unwrap().position_error(&world.view()).unwrap().distance)
            .fold(0.0, f64::max);
        assert!(fastest < 2.0 * (4.0 * 0.5 * 240.0 / 0.2f64).sqrt(), "{stepper}: {fastest} rad/s");
        assert!(said > 0.5 / 4.0 - 1e-3 && said < 0.5, "{stepper}: {said} m is said, of 0.5 m shared by four pins");
        assert!(open < 1e-7, "{stepper}: {open:e} m are open");
        println!("{stepper}: {fastest:.2} rad/s at most, {said:.3} m out of reach, {open:.1e} m open at the end");
    }
}
