//! A ball bearing with angular contact: cones of facets as races, three balls, and an axial load that presses all of them.
//!
//! ```text
//! r_i = ½(D − d·cos α)        v = ½·Ω·r_i        ω_c = Ω/2·(1 − (d/D)·cos α)
//! ```
//!
//! `D` pitch diameter, `d` diameter of a ball, `α` contact angle, `Ω` velocity of the inner race, the outer one is held;
//! `r_i` radius of a contact with the inner race, `v` velocity of a ball: the mean of those of its two contacts, which are
//! opposite to each other if the ball rolls; `ω_c` its velocity about the axis.
//!
//! Bodies are rigid. More than three balls would be statically indeterminate: facets take the load off some of them, which then
//! slip.

use super::thread::Parts;
use super::*;

/// Radius of the pitch circle and of a ball, m.
const PITCH: f64 = 0.04;
const BALL: f64 = 0.006;
/// Contact angle, rad.
const ALPHA: f64 = TAU / 8.0;

/// Returns the solid of revolution of a section (radius and height, counter-clockwise), circumscribed by planes.
fn ring(section: &[(f64, f64)], facets: usize) -> TriMesh {
    let mut out = Parts::default();
    let rings: Vec<u32> = section
        .iter()
        .map(|&(r, z)| out.ring(r / (0.5 * TAU / facets as f64).cos(), facets, z, |_| 1.0))
        .collect();
    let next = rings.iter().cycle().skip(1);
    rings.iter().zip(next).for_each(|(a, b)| out.band(*a, *b, facets));
    out.mesh()
}

/// Returns the outer and the inner race: a cone across the line of contact, and steeper ones beside it that keep the ball
/// there.
fn races(facets: usize) -> [TriMesh; 2] {
    let (sin, cos) = ALPHA.sin_cos();
    let ((bend, along), wide) = (0.4_f64.sin_cos(), 0.45);
    // at the outer (1) or inner (-1) contact: a place along the race, and towards the ball, in radii of it
    let at = |side: f64, x: f64, y: f64| {
        let out = side * (1.0 - y);
        (PITCH + BALL * (out * cos - x * sin), BALL * (out * sin + x * cos))
    };
    let [outer, inner] = [1.0, -1.0].map(|side| {
        let end = wide + 0.2 * along;
        [at(side, -end, 0.2 * bend), at(side, -wide, 0.0), at(side, wide, 0.0), at(side, end, 0.2 * bend)]
    });
    let [[a, b, c, d], [e, f, g, h]] = [outer, inner];
    let outer = ring(&[a, (0.055, a.1), (0.055, d.1), d, c, b], facets);
    let inner = ring(&[(0.025, e.1), e, f, g, h, (0.025, h.1)], facets);
    [outer, inner]
}

/// Turns the inner race by `turns` at a turn per second. Returns the ratio of the balls' velocity about the axis to that
/// of the race, for each ball, and the real-time factor.
fn ratios(facets: usize, dt: f64, turns: f64) -> ([f64; 3], f64) {
    let mut world = no_gravity(world("time_stepping", dt));
    let [outer, inner] = races(facets).map(shape);
    world.add_static(steel("outer race", outer, 0.2)).unwrap();
    let race = world.add(steel("inner race", inner, 0.2).with_angular_velocity(Vec3::z() * TAU)).unwrap();
    let balls = [0, 1, 2].map(|k| {
        let angle = (k * facets / 3) as f64 * TAU / facets as f64 + 0.5 * TAU / facets as f64;
        let out = Vec3::new(angle.cos(), angle.sin(), 0.0);
        // it begins as it rolls: about the tangent of both cones, so that its center has half the velocity of the inner contact
        let inner = PITCH - BALL * ALPHA.cos();
        let axis = Vec3::new(-ALPHA.sin() * angle.cos(), -ALPHA.sin() * angle.sin(), ALPHA.cos());
        let ball = steel(&format!("ball {k}"), Shape::sphere(BALL).unwrap(), 0.2)
            .with_pose(Pose::translation(PITCH * out.x, PITCH * out.y, 0.0))
            .with_velocity(Vec3::z().cross(&out) * (0.5 * TAU * inner))
            .with_angular_velocity(axis * (-0.5 * TAU * inner / BALL));
        world.add(ball).unwrap()
    });
    let mut count = Turns::of_now(&world, race);
    let around = |world: &World, id: ObjectId| {
        let at = position(world, id);
        at.y.atan2(at.x)
    };
    let mut last = balls.map(|id| around(&world, id));
    let mut total = [0.0; 3];
    let mut unconverged = 0;
    let speed = run(&mut world, turns, |world| {
        count.of(world, race);
        for k in 0..3 {
            let now = around(world, balls[k]);
            total[k] += (now - last[k] + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
            last[k] = now;
        }
        unconverged += world.report().unconverged;
        // an axial load, and a motor that holds the velocity
        let center = position(world, race);
        world.apply_force(race, 0, Vec3::z() * 30.0, &center).unwrap();
        let slow = TAU - world.part_state(race, 0).unwrap().angular_velocity.z;
        world.apply_torque(race, 0, Vec3::z() * (0.02 * slow)).unwrap();
    });
    println!("{facets} facets, {:.0} Hz: the race turned by {:.3} turns, at {:?}, balls {:?}, {unconverged} unconverged", 1.0 / dt, count.total / TAU, position(&world, race), balls.map(|id| position(&world, id).z));
    (total.map(|angle| angle / count.total), speed)
}

#[test]
fn balls_of_a_bearing_go_around_at_the_velocity_of_rolling() {
    let exact = 0.5 * (1.0 - BALL / PITCH * ALPHA.cos());
    for (facets, dt) in [(96, 0.5 * DT), (96, 0.25 * DT), (192, 0.25 * DT), (96, 0.125 * DT), (192, 0.125 * DT)] {
        let (found, speed) = ratios(facets, dt, 2.0);
        println!("ratios {found:?}, by theory {exact:.5}, real-time factor {speed:.2}");
    }
}
