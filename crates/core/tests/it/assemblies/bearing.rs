//! A deep-groove ball bearing: rings as meshes, twelve balls between them, no cage.
//!
//! ```text
//! ω_c/ω = ½·(1 − d/D)        the balls go around at ω_c if they roll on both rings
//! ```
//!
//! `d` diameter of a ball, `D` of the circle of their centers, `ω` angular velocity of the shaft; the outer ring stands.

use super::thread::Parts;
use super::*;

const BALL: f64 = 0.006;
const CIRCLE: f64 = 0.025;
const COUNT: usize = 12;
/// Radial play, m.
const PLAY: f64 = 1e-4;
const WIDTH: f64 = 0.010;
const FACETS: usize = 192;
/// Radial load, N: ten times the weight of the shaft.
const LOAD: f64 = 5.0;

/// Returns radius and height of the points of a groove, upwards; `side` is 1 for the outer ring and −1 for the inner one. A ball
/// rests on the facet in the middle and touches no other.
fn groove(side: f64) -> Vec<(f64, f64)> {
    let radius = 1.08 * BALL;
    let center = CIRCLE + side * (BALL + 0.5 * PLAY - radius);
    let t = |k: i32| (f64::from(k) - 0.5) * 0.11;
    (-4..=5).map(|k| (center + side * radius * t(k).cos(), radius * t(k).sin())).collect()
}

/// Returns a ring of revolution about z with a closed profile, counter-clockwise in radius and height.
fn revolved(profile: &[(f64, f64)]) -> TriMesh {
    let mut out = Parts::default();
    let rings: Vec<u32> = profile.iter().map(|&(r, z)| out.ring(r, FACETS, z, |_| 1.0)).collect();
    for (k, low) in rings.iter().enumerate() {
        out.band(*low, rings[(k + 1) % rings.len()], FACETS);
    }
    out.mesh()
}

/// Returns the shaft and the outer ring.
fn rings() -> [TriMesh; 2] {
    let half = 0.5 * WIDTH;
    let mut inner = groove(-1.0);
    inner.extend([(inner[0].0, half), (0.5 * CIRCLE, half), (0.5 * CIRCLE, -half), (inner[0].0, -half)]);
    let edge = groove(1.0)[0].0;
    let mut outer = vec![(1.5 * CIRCLE, -half), (1.5 * CIRCLE, half), (edge, half)];
    outer.extend(groove(1.0).into_iter().rev());
    outer.push((edge, -half));
    [revolved(&inner), revolved(&outer)]
}

/// A radial load on the shaft is on the balls, a motor turns it: balls go around at the kinematic ratio.
#[test]
fn the_balls_of_a_bearing_go_around_at_their_kinematic_ratio() {
    let seconds = if slow() { 20.0 } else { 2.0 };
    let mut world = no_gravity(world("time_stepping", DT));
    let [inner, outer] = rings();
    let triangles = inner.triangles.len() + outer.triangles.len();
    assert!(triangles <= 20_000);
    world.add_static(steel("outer ring", shape(outer), 0.3)).unwrap();
    let shaft = world.add(steel("shaft", shape(inner), 0.3)).unwrap();
    // another bearing at the end of the shaft: it holds the direction of the axis and the place along it
    let place = JointPlace::on_line(Vec3::zeros(), Vec3::z());
    let held = LoopJoint::joining("end", LoopJointKind::Planar, &world, Some((shaft, 0)), None, place).unwrap();
    world.add(held).unwrap();
    let mut balls = Vec::new();
    for k in 0..COUNT {
        let (sin, cos) = (TAU * (k as f64 + 0.5) / COUNT as f64).sin_cos();
        let ball = steel(&format!("ball {k}"), sphere(BALL), 0.3);
        balls.push(world.add(ball.with_pose(Pose::translation(CIRCLE * cos, CIRCLE * sin, 0.0))).unwrap());
    }
    // neighbors slide on each other
    let slippery = PairMaterial { friction: Some(0.0), ..PairMaterial::default() };
    for (k, a) in balls.iter().enumerate() {
        for b in &balls[..k] {
            world.set_pair_material(PairSide::Object(*a), PairSide::Object(*b), slippery).unwrap();
        }
    }
    let around = |world: &World, ball: ObjectId| {
        let p = position(world, ball);
        p.y.atan2(p.x)
    };
    let inertia = *world.get::<RigidBody>(shaft).unwrap().inertia();
    let motor = |world: &mut World| {
        let spin = world.part_state(shaft, 0).unwrap().angular_velocity.z;
        let torque = (TAU - spin) * inertia[(2, 2)] * 120.0;
        world.apply_torque(shaft, 0, Vec3::z() * torque).unwrap();
        let center = position(world, shaft);
        world.apply_force(shaft, 0, Vec3::y() * -LOAD, &center).unwrap();
    };
    for _ in 0..240 {
        motor(&mut world);
        world.step().unwrap();
    }
    let mut turns = Turns::of_now(&world, shaft);
    let mut last: Vec<f64> = balls.iter().map(|ball| around(&world, *ball)).collect();
    let (mut gone, mut overlap, mut unconverged, mut low) = (vec![0.0; COUNT], 0.0f64, 0, 0.0f64);
    let speed = run(&mut world, seconds, |world| {
        motor(world);
        turns.of(world, shaft);
        for (k, ball) in balls.iter().enumerate() {
            let now = around(world, *ball);
            gone[k] += (now - last[k] + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
            last[k] = now;
        }
        low = low.max(position(world, shaft).norm());
        (overlap, unconverged) =
            (overlap.max(world.report().max_penetration), unconverged + world.report().unconverged);
    });
    let ratio = gone.iter().sum::<f64>() / COUNT as f64 / turns.total;
    let expected = 0.5 * (1.0 - BALL / CIRCLE);
    println!(
        "bearing, {triangles} triangles, {:.2} turns: ratio {ratio:.5}, kinematic {expected:.5}, shaft off by {low:.1e} m, overlap {overlap:.1e} m, {unconverged} unconverged, {speed:.2} of real time",
        turns.total / TAU
    );
    assert!((ratio - expected).abs() < 0.01 * expected, "{ratio}, {expected}");
    // the shaft stays within the play
    assert!(low < PLAY && overlap < 1e-4, "{low} m, {overlap} m");
    let spread = gone.iter().fold(0.0f64, |spread, g| spread.max((g / gone[0] - 1.0).abs()));
    assert!(spread < 0.5, "no ball is left behind: {spread}");
}
