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
//! Bodies are rigid. With more than three balls the load on each is statically indeterminate: facets take it off some of them,
//! which then slip.

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
    let rings: Vec<u32> =
        section.iter().map(|&(r, z)| out.ring(r / (0.5 * TAU / facets as f64).cos(), facets, z, |_| 1.0)).collect();
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

/// Turns the inner race by a turn in a second. Returns the mean of the balls' velocity about the axis over that of the race,
/// and the spread among the balls.
fn ratio(count: usize, facets: usize, dt: f64) -> (f64, f64) {
    let mut world = no_gravity(world("time_stepping", dt));
    let [outer, inner] = races(facets);
    let triangles = outer.triangles.len() + inner.triangles.len();
    world.add_static(steel("outer race", shape(outer), 0.2)).unwrap();
    let race = steel("inner race", shape(inner), 0.2).with_angular_velocity(Vec3::z() * TAU);
    let race = world.add(race).unwrap();
    let ((sin, cos), contact) = (ALPHA.sin_cos(), PITCH - BALL * ALPHA.cos());
    let balls: Vec<ObjectId> = (0..count)
        .map(|k| {
            // above the middle of a facet, rolling
            let angle = TAU * ((k * facets / count) as f64 + 0.5) / facets as f64;
            let out = Vec3::new(angle.cos(), angle.sin(), 0.0);
            let spin = (Vec3::z() * cos - out * sin) * (-0.5 * TAU * contact / BALL);
            let ball = steel(&format!("ball {k}"), Shape::sphere(BALL).unwrap(), 0.2)
                .with_pose(Pose::from(nalgebra::Translation3::from(out * PITCH)))
                .with_velocity(Vec3::z().cross(&out) * (0.5 * TAU * contact))
                .with_angular_velocity(spin);
            world.add(ball).unwrap()
        })
        .collect();
    let around = |world: &World, id: ObjectId| {
        let at = position(world, id);
        at.y.atan2(at.x)
    };
    let mut turns = Turns::of_now(&world, race);
    let mut last: Vec<f64> = balls.iter().map(|id| around(&world, *id)).collect();
    let mut total = vec![0.0; count];
    let (mut overlap, mut unconverged) = (0.0f64, 0);
    let speed = run(&mut world, 1.0, |world| {
        turns.of(world, race);
        for k in 0..count {
            let now = around(world, balls[k]);
            total[k] += (now - last[k] + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
            last[k] = now;
        }
        overlap = overlap.max(world.report().max_penetration);
        unconverged += world.report().unconverged;
        // the axial load, and a motor that holds the velocity
        let center = position(world, race);
        world.apply_force(race, 0, Vec3::z() * 30.0, &center).unwrap();
        let slow = TAU - world.part_state(race, 0).unwrap().angular_velocity.z;
        world.apply_torque(race, 0, Vec3::z() * (0.02 * slow)).unwrap();
    });
    let ratios: Vec<f64> = total.iter().map(|angle| angle / turns.total).collect();
    let mean = ratios.iter().sum::<f64>() / count as f64;
    let spread = ratios.iter().map(|ratio| (ratio - mean).abs()).fold(0.0, f64::max);
    println!(
        "bearing of {count} balls, {triangles} triangles, {:.0} Hz: {:.3} turns, the balls go around at {mean:.5} ± {spread:.0e} of that, overlap {overlap:.0e} m, {unconverged} unconverged, real-time factor {speed:.2}",
        1.0 / dt,
        turns.total / TAU
    );
    (mean, spread)
}

/// The balls go around at the velocity of rolling. In each step they move along their tangents, which takes them along the
/// cones by a way that falls with the step.
#[test]
fn balls_of_a_bearing_go_around_at_the_velocity_of_rolling_full_length() {
    let exact = 0.5 * (1.0 - BALL / PITCH * ALPHA.cos());
    let errors = [1.0, 2.0, 4.0, 8.0].map(|parts| {
        let (mean, spread) = ratio(3, 192, DT / parts);
        assert!(spread < 1e-3, "{spread}");
        (mean / exact - 1.0).abs()
    });
    println!("errors of the velocity {errors:?}, by theory {exact:.5}");
    assert!(errors[0] < 2e-3 && errors[3] < 3e-4, "{errors:?}");
    assert!(errors[1..].windows(2).all(|pair| pair[1] < 0.7 * pair[0]), "{errors:?}");
}

/// Eight balls share the load in a way that rigid bodies leave open, and some slip: each goes around at the velocity of rolling
/// to 1 %, and their mean to 0.5 %.
#[test]
fn eight_balls_of_a_bearing_go_around_nearly_at_the_velocity_of_rolling() {
    let exact = 0.5 * (1.0 - BALL / PITCH * ALPHA.cos());
    let (mean, spread) = ratio(8, 192, DT / 4.0);
    assert!((mean / exact - 1.0).abs() < 5e-3 && spread < 1e-2 * exact, "{mean} ± {spread} instead of {exact}");
}
