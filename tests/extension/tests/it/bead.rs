//! The bead on the cycloid: one freedom, an inertia that changes, a stop.

use crate::common::*;
use std::f64::consts::PI;
use tumble_extension::Bead;

const R: f64 = 0.25;

/// Huygens: the period is 4π√(R/g) at every amplitude.
#[test]
fn the_cycloid_is_isochronous_and_keeps_energy() {
    let period = 4.0 * PI * (R / G).sqrt();
    for stepper in STEPPERS {
        for angle in [0.2, 1.5, 2.5] {
            let mut world = world(stepper, true);
            let id = world.add(Bead::new("bead", 0.7, R, sphere(0.02)).at(angle, 0.0)).unwrap();
            let start = world.energy().total();
            let (measured, drift) = swing(&mut world, id, 20.0);
            // the leapfrog of a harmonic oscillator is fast by (ωh)²/24 = 7.1e-6
            assert!(
                (measured / period - 1.0).abs() < 1e-5,
                "{stepper} from {angle} rad: {measured} s, by hand {period} s"
            );
            assert!(drift < 1e-4 * start, "{stepper} from {angle} rad: energy is off by {:e}", drift / start);
        }
    }
}

/// The bead comes to its stop, loses what it had (a stop has no restitution), and swings back from
/// rest: its energy is then that of the stop's height.
#[test]
fn a_stop_on_the_wire_holds_the_bead_and_lets_it_go() {
    for stepper in STEPPERS {
        let mut world = world(stepper, true);
        let id = world.add(Bead::new("bead", 0.7, R, sphere(0.02)).at(-1.5, 0.0).stopped_at(0.5)).unwrap();
        let (mut furthest, mut lowest) = (f64::MIN, 0.0f64);
        for frame in 0..480 {
            step(&mut world, 1);
            let angle = world.state_of(id).unwrap()[0];
            furthest = furthest.max(angle);
            if frame > 240 {
                lowest = lowest.min(angle);
            }
        }
        // ℓ = 4R·sin(φ/2): it swings between the stop and the same height on the other side
        assert!((0.499..0.5001).contains(&furthest), "{stepper}: it came to {furthest} rad");
        assert!((lowest + 0.5).abs() < 5e-3, "{stepper}: it swings back to {lowest} rad");
        let height = R * (1.0 - 0.5f64.cos());
        let energy = world.energy().total();
        assert!(
            (energy / (0.7 * G * height) - 1.0).abs() < 0.02,
            "{stepper}: {energy} J are left, by hand {}",
            0.7 * G * height
        );
    }
}
