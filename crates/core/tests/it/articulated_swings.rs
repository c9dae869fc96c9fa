//! Swings against closed forms, and the energy of undamped chains.

use crate::articulated_world::{adaptive, chain, hinged, rod, run, world};
use std::f64::consts::{FRAC_PI_2, PI};
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{ArticulatedBody, Integrator, Joint, LinkMass, ModelBuilder, World};

const G: f64 = 9.81;

/// Period of a pendulum of angular frequency `w` (small swings) at `amplitude`: `4K(sin(θ/2))/w`,
/// the elliptic integral by the arithmetic–geometric mean.
fn period(w: f64, amplitude: f64) -> f64 {
    let (mut a, mut g) = (1.0_f64, (0.5 * amplitude).cos());
    for _ in 0..10 {
        (a, g) = (0.5 * (a + g), (a * g).sqrt());
    }
    2.0 * PI / (w * a)
}

/// Returns the times at which the first position rises through zero, within `seconds`: on the cubic
/// through both ends of the frame.
fn rises(world: &mut World, seconds: f64) -> Vec<f64> {
    let id = world.ids()[0];
    let n = world.get::<ArticulatedBody>(id).unwrap().model().positions();
    let dt = world.settings().dt;
    let mut found = Vec::new();
    let appearance = |world: &World| (world.state_of(id).unwrap()[0], world.state_of(id).unwrap()[n]);
    let mut before = appearance(world);
    while world.time() < seconds {
        run(world, dt);
        let after = appearance(world);
        if before.0 < 0.0 && after.0 >= 0.0 {
            let at = |s: f64| {
                let (m0, m1, d) = (dt * before.1, dt * after.1, after.0 - before.0);
                before.0 + s * (m0 + s * (3.0 * d - 2.0 * m0 - m1 + s * (m0 + m1 - 2.0 * d)))
            };
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if at(middle) < 0.0 { low = middle } else { high = middle }
            }
            found.push(world.time() - dt + low * dt);
        }
        before = after;
    }
    found
}

fn mean_period(world: &mut World, seconds: f64) -> f64 {
    let found = rises(world, seconds);
    assert!(found.len() >= 3);
    (found[found.len() - 1] - found[0]) / (found.len() - 1) as f64
}

#[test]
fn a_point_and_a_rod_swing_with_their_periods_at_any_amplitude() {
    let length: f64 = 0.7;
    let bob = LinkMass::point(2.0, Vec3::new(0.0, 0.0, -length));
    for (mass, w) in [(bob, (G / length).sqrt()), (rod(2.0, length), (1.5 * G / length).sqrt())] {
        for amplitude in [0.005, 1.0, FRAC_PI_2, 3.0] {
            let mut world = adaptive(1.0 / 240.0, 1e-9);
            world
                .add(ArticulatedBody::new("swing", hinged(1, length, mass)).with_positions(&[amplitude]).unwrap())
                .unwrap();
            let (got, want) = (mean_period(&mut world, 12.0), period(w, amplitude));
            assert!((got / want - 1.0).abs() < 1e-6, "amplitude {amplitude}: {got} s, wanted {want} s");
        }
    }
}

#[test]
fn a_double_pendulum_has_its_two_modes() {
    // absolute angles: M = m·l²·[4/3 1/2; 1/2 1/3], K = m·g·l·diag(3/2, 1/2); with x = ω²l/g:  (3/2
    // − 4x/3)(1/2 − x/3) = x²/4
    let (length, root) = (0.2, (7.0_f64 / 6.0).powi(2) - 4.0 * (7.0 / 36.0) * 0.75);
    for sign in [-1.0, 1.0] {
        let x = (7.0 / 6.0 + sign * root.sqrt()) / (2.0 * 7.0 / 36.0);
        let second = (1.5 - 4.0 * x / 3.0) / (0.5 * x);
        let mut world = adaptive(1.0 / 240.0, 1e-12);
        let small = 5e-4;
        world
            .add(
                ArticulatedBody::new("two", hinged(2, length, rod(1.0, length)))
                    .with_positions(&[small, small * (second - 1.0)])
                    .unwrap(),
            )
            .unwrap();
        let (got, want) = (mean_period(&mut world, 8.0), 2.0 * PI / (x * G / length).sqrt());
        assert!((got / want - 1.0).abs() < 1e-6, "mode {sign}: {got} s, wanted {want} s");
    }
}

#[test]
fn a_cone_is_swung_at_its_own_pace() {
    // a bob on a spherical joint goes round at a constant angle with Ω² = g/(l·cos θ)
    let (length, angle) = (0.5, 0.8_f64);
    let mut builder = ModelBuilder::new();
    builder.link(
        "bob",
        None,
        Joint::Spherical,
        Pose::identity(),
        LinkMass {
            inertia: 1e-9 * nalgebra::Matrix3::identity(),
            ..LinkMass::point(1.0, Vec3::new(0.0, 0.0, -length))
        },
    );
    let pace = (G / (length * angle.cos())).sqrt();
    let turn = Vec3::new(-0.5 * angle, 0.0, 0.0);
    let q = nalgebra::UnitQuaternion::from_scaled_axis(2.0 * turn);
    let spin = q.inverse_transform_vector(&Vec3::new(0.0, 0.0, pace));
    let body = ArticulatedBody::new("bob", builder.build().unwrap()).with_positions(q.coords.as_slice()).unwrap();
    let mut world = adaptive(1.0 / 60.0, 1e-10);
    let id = world.add(body.with_velocities(spin.as_slice()).unwrap()).unwrap();
    run(&mut world, 10.0);
    let part_state = world.part_state(id, 0).unwrap();
    let down = part_state.pose.rotation * Vec3::new(0.0, 0.0, -1.0);
    let start = q * Vec3::new(0.0, 0.0, -1.0);
    let want = nalgebra::UnitQuaternion::from_scaled_axis(Vec3::new(0.0, 0.0, pace * 10.0)) * start;
    assert!((down - want).norm() < 1e-6, "{down:?} {want:?}");
}

/// Returns the greatest change of energy within `seconds`, as a fraction of the drop from
/// horizontal to hanging.
fn drift(world: &mut World, links: usize, seconds: f64) -> f64 {
    world.add(chain(links, FRAC_PI_2)).unwrap();
    let (start, drop) = (world.energy().total(), G * 0.2 * (links * links) as f64 / 2.0);
    let mut worst: f64 = 0.0;
    while world.time() < seconds {
        run(world, world.settings().dt);
        worst = worst.max((world.energy().total() - start).abs());
    }
    worst / drop
}

#[test]
fn undamped_chains_keep_their_energy_at_full_length() {
    let slow = std::env::var_os("TUMBLE_SLOW").is_some();
    let seconds = if slow { 60.0 } else { 5.0 };
    for (links, bound) in [(5, 1e-4), (10, 1e-4), (50, 1e-3)] {
        let worst = drift(&mut adaptive(1.0 / 60.0, 1e-6), links, seconds);
        println!("{links} links, {seconds} s, adaptive: energy drifts by {worst:.1e} of the drop");
        assert!(worst < bound, "{links} links: {worst}");
    }
}

#[test]
fn the_default_stepper_keeps_the_energy_of_a_chain_to_a_thousandth() {
    for links in [1, 2, 5] {
        let worst = drift(&mut world(1.0 / 240.0, "time_stepping", Integrator::Verlet), links, 10.0);
        println!("{links} links, time_stepping: energy drifts by {worst:.1e} of the drop");
        assert!(worst < 1e-3, "{links} links: {worst}");
    }
}
