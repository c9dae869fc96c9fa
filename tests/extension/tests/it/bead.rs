//! The bead on the cycloid.
use crate::common::*;
use std::f64::consts::PI;
use tumble_core::collide::Vec3;
use tumble_extension::Bead;

const R: f64 = 0.25;

#[test]
fn the_cycloid_is_isochronous_and_keeps_energy() {
    // Huygens: 4π√(R/g) at every amplitude
    let period = 4.0 * PI * (R / G).sqrt();
    for stepper in STEPPERS {
        for angle in [0.2, 1.5, 2.5] {
            let mut world = world(stepper, true);
            let id = world.add(Bead::new("bead", 0.7, R, sphere(0.02)).at(angle, 0.0)).unwrap();
            let swing_energy = world.energy().total();
            let (measured, drift) = swing(&mut world, id, 20.0);
            eprintln!("{stepper} {angle}: period off {:e}, energy off {:e}", measured / period - 1.0, drift / swing_energy);
        }
    }
}

#[test]
fn a_stop_on_the_wire_holds_the_bead_and_lets_it_go() {
    for stepper in STEPPERS {
        let mut world = world(stepper, true);
        let id = world.add(Bead::new("bead", 0.7, R, sphere(0.02)).at(-1.5, 0.0).stopped_at(0.5)).unwrap();
        let mut furthest = f64::MIN;
        for _ in 0..480 {
            step(&mut world, 1);
            furthest = furthest.max(world.state_of(id).unwrap()[0]);
        }
        eprintln!("{stepper}: reached {furthest}, now {:?}, energy {:?}", world.state_of(id).unwrap(), world.energy());
    }
    let _ = Vec3::zeros();
}
