//! Provided methods of [`Integratable`], from the Jacobian and the maps.
//!
//! ```text
//! Q = τ + Σ JᵀF          ṗ = Q    or    v̇ = M⁻¹·Q + free motion
//! a = J·v̇ + J̇·v          v̇ = M⁻¹·(ṗ − gyroscopic)
//! y = L⁻ᵀ·Jᵀ             T = ½|L·v|²
//! ```
//!
//! A Jacobian gives velocities of points. Angular velocity along `e_k` is that of two points:
//! `(v(p + e_i) − v(p))·e_j` with `e_i × e_j = e_k`.

use super::part_state::{ForceSlice, PartPoint, PartState};
use super::{Energy, Integratable, Momentum, MomentumKind};
use crate::derived::Cache;
use tumble_collide::Vec3;

const AXES: [Vec3; 3] = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];

/// Returns the Jacobian of the velocity of a part's origin, 3 rows.
fn linear<B: Integratable + ?Sized>(
    body: &B,
    cache: &mut Cache,
    part: usize,
    part_state: &PartState,
    dof: usize,
) -> Vec<f64> {
    let mut j = vec![0.0; 3 * dof];
    body.jacobian(cache, &PartPoint { part, part_state, point: part_state.position(), axes: &AXES }, &mut j);
    j
}

/// Returns the Jacobian of the angular velocity of a part, 3 rows.
fn angular<B: Integratable + ?Sized>(
    body: &B,
    cache: &mut Cache,
    part: usize,
    part_state: &PartState,
    dof: usize,
) -> Vec<f64> {
    let origin = part_state.position();
    let (mut j, mut still) = (vec![0.0; 3 * dof], vec![0.0; dof]);
    for (k, row) in j.chunks_exact_mut(dof.max(1)).enumerate() {
        let (arm, axes) = (AXES[(k + 1) % 3], &[AXES[(k + 2) % 3]]);
        still.fill(0.0);
        body.jacobian(cache, &PartPoint { part, part_state, point: origin + arm, axes }, row);
        body.jacobian(cache, &PartPoint { part, part_state, point: origin, axes }, &mut still);
        row.iter_mut().zip(&still).for_each(|(row, still)| *row -= still);
    }
    j
}

/// `j += Jᵀ·f`.
fn add_transposed(jacobian: &[f64], f: &Vec3, j: &mut [f64]) {
    for (row, f) in jacobian.chunks_exact(j.len().max(1)).zip(f.iter()) {
        j.iter_mut().zip(row).for_each(|(j, row)| *j += f * row);
    }
}

/// Returns `J·v`.
fn times(jacobian: &[f64], v: &[f64]) -> Vec3 {
    Vec3::from_fn(|k, _| jacobian[k * v.len()..][..v.len()].iter().zip(v).map(|(j, v)| j * v).sum())
}

/// Returns `M⁻¹·j`.
fn solve_m<B: Integratable + ?Sized>(body: &B, cache: &mut Cache, j: &[f64]) -> Vec<f64> {
    let (mut u, mut v) = (vec![0.0; j.len()], vec![0.0; j.len()]);
    body.solve_lt(cache, j, &mut u);
    body.solve_l(cache, &u, &mut v);
    v
}

pub(super) fn derivative<B: Integratable + ?Sized>(
    body: &B,
    cache: &mut Cache,
    x: &[f64],
    f: &ForceSlice,
    dp: &mut [f64],
) {
    let dof = dp.len();
    let mut force = f.generalized.to_vec();
    for (part, (wrench, part_state)) in f.wrenches.iter().zip(f.part_states).enumerate() {
        if wrench.force != Vec3::zeros() {
            add_transposed(&linear(body, cache, part, part_state, dof), &wrench.force, &mut force);
        }
        if wrench.torque != Vec3::zeros() {
            add_transposed(&angular(body, cache, part, part_state, dof), &wrench.torque, &mut force);
        }
    }
    match body.momentum_kind() {
        MomentumKind::Conjugate => dp.copy_from_slice(&force),
        MomentumKind::Velocity => {
            body.free_motion_rate(cache, x, dp);
            dp.iter_mut().zip(solve_m(body, cache, &force)).for_each(|(dp, v)| *dp += v);
        }
    }
}

pub(super) fn accelerations<B: Integratable + ?Sized>(
    body: &B,
    cache: &mut Cache,
    x: &[f64],
    dp: &[f64],
    part_states: &mut [PartState],
) {
    let mut rate = dp.to_vec();
    if body.momentum_kind() == MomentumKind::Conjugate {
        let mut turning = vec![0.0; dp.len()];
        body.gyroscopic(x, &mut turning);
        rate.iter_mut().zip(&turning).for_each(|(rate, turning)| *rate -= turning);
        rate = solve_m(body, cache, &rate);
    }
    for (part, part_state) in part_states.iter_mut().enumerate() {
        let [linear, angular] =
            [linear::<B>, angular::<B>].map(|of| times(&of(body, cache, part, part_state, dp.len()), &rate));
        part_state.acceleration = linear + part_state.bias_acceleration;
        part_state.angular_acceleration = angular + part_state.bias_angular_acceleration;
    }
}

pub(super) fn test_impulse<B: Integratable + ?Sized>(
    body: &B,
    cache: &mut Cache,
    at: &PartPoint,
    sign: f64,
    y: &mut [f64],
) {
    let dof = (y.len() / at.axes.len()).max(1);
    let (mut j, mut response) = (vec![0.0; y.len()], vec![0.0; dof]);
    body.jacobian(cache, at, &mut j);
    for (j, y) in j.chunks_exact(dof).zip(y.chunks_exact_mut(dof)) {
        body.solve_lt(cache, j, &mut response);
        y.iter_mut().zip(&response).for_each(|(y, response)| *y += sign * response);
    }
}

/// Returns the cache and the part states at a state.
fn derived<B: Integratable + ?Sized>(body: &B, x: &[f64]) -> (Cache, Vec<PartState>) {
    let (mut cache, mut part_states) = (body.new_cache(), vec![PartState::default(); body.state_sizes().parts]);
    body.refresh(x, &mut cache, &mut part_states);
    (cache, part_states)
}

pub(super) fn energy<B: Integratable + ?Sized>(body: &B, x: &[f64], gravity: &Vec3) -> Energy {
    let (mut cache, part_states) = derived(body, x);
    let mut u = vec![0.0; body.state_sizes().dof];
    body.whitened_velocity(&mut cache, x, &mut u);
    let weights = part_states.iter().enumerate().map(|(part, s)| -body.part_mass(part) * gravity.dot(&s.position()));
    Energy { kinetic: 0.5 * u.iter().map(|u| u * u).sum::<f64>(), potential: weights.sum() }
}

pub(super) fn momentum<B: Integratable + ?Sized>(body: &B, x: &[f64]) -> Momentum {
    let (_, part_states) = derived(body, x);
    part_states.iter().enumerate().fold(Momentum::default(), |sum, (part, s)| {
        let linear = body.part_mass(part) * s.velocity;
        Momentum { linear: sum.linear + linear, angular: sum.angular + s.position().cross(&linear) }
    })
}
