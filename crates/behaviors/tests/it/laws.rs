//! The laws of `Integratable` for a boid.

use tumble_behaviors::Boid;
use tumble_core::prelude::*;
use tumble_core::{ForceSlice, Integratable, PartPoint, PartState, Wrench};

const STATE: [f64; 8] = [0.1, -0.4, 0.3, 0.7, 3.0, 2.0, -0.5, 0.2];

fn boid() -> Boid {
    Boid::new(Shape::sphere(0.2).unwrap(), 2.5).unwrap()
}

fn state_of_part(x: &[f64]) -> [PartState; 1] {
    let mut part_states = [PartState::default()];
    boid().refresh(x, &mut boid().new_cache(), &mut part_states);
    part_states
}

fn near(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
}

#[test]
fn the_root_of_the_mass_matrix() {
    let (boid, mut cache) = (boid(), boid().new_cache());
    let (v, mut u, mut back) = (&STATE[4..], [0.0; 4], [0.0; 4]);
    boid.mul_l(&mut cache, v, &mut u);
    assert!(near(&u[..3], &[0, 1, 2].map(|k| 2.5f64.sqrt() * v[k])), "√m·v");
    boid.solve_l(&mut cache, &u, &mut back);
    assert!(near(&back, v), "L⁻¹·L = 1");
    assert!((boid.energy(&STATE, &Vec3::z()).kinetic - 0.5 * u.iter().map(|u| u * u).sum::<f64>()).abs() < 1e-12);
    // L is diagonal: Lᵀ = L
    let (mut j, mut y) = ([0.0; 4], [0.0; 4]);
    boid.mul_lt(&mut cache, v, &mut j);
    boid.solve_lt(&mut cache, &j, &mut y);
    assert!(near(&j, &u) && near(&y, v));
}

#[test]
fn rows_of_contacts_are_those_of_a_point_mass() {
    let (boid, mut cache) = (boid(), boid().new_cache());
    let [part_state] = state_of_part(&STATE);
    let point = part_state.position() + Vec3::new(0.2, -0.1, 0.3);
    let at = PartPoint { part: 0, part_state: &part_state, point, axes: &[Vec3::new(0.0, 0.6, 0.8)] };
    let (mut j, mut y) = ([0.0; 4], [0.0; 4]);
    boid.jacobian(&mut cache, &at, &mut j);
    boid.test_impulse(&mut cache, &at, 1.0, &mut y);
    let along: f64 = j.iter().zip(&STATE[4..]).map(|(j, v)| j * v).sum();
    assert!((along - at.axes[0].dot(&part_state.velocity_at(&point))).abs() < 1e-12, "J·v");
    assert!((y.iter().map(|y| y * y).sum::<f64>() - 1.0 / 2.5).abs() < 1e-12, "J·M⁻¹·Jᵀ = 1/m");
}

#[test]
fn accelerations_are_the_rates_of_velocities() {
    let (boid, mut cache) = (boid(), boid().new_cache());
    let mut part_states = state_of_part(&STATE);
    let (force, generalized) = (Vec3::new(0.3, -0.2, 0.5), [0.2, 0.1, -0.4, 0.0]);
    let wrenches = [Wrench { force, torque: Vec3::new(0.1, 0.4, -0.3) }];
    let mut dp = [0.0; 4];
    let before = part_states;
    let slice = ForceSlice { part_states: &before, wrenches: &wrenches, generalized: &generalized };
    boid.derivative(&mut cache, &STATE, &slice, &mut dp);
    boid.accelerations(&mut cache, &STATE, &dp, &mut part_states);
    let sum = force + Vec3::from_column_slice(&generalized[..3]);
    assert!((part_states[0].acceleration - sum / 2.5).norm() < 1e-12);
    // φ̈ = (φ* − φ)/T² − 2·φ̇/T with T = 0.2 s
    let bank = boid.wanted_bank(&Vec3::new(3.0, 2.0, -0.5), &sum);
    assert!((dp[3] - ((bank - 0.7) * 25.0 - 2.0 * 0.2 * 5.0)).abs() < 1e-12);
}
