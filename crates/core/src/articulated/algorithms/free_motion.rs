//! Free motion of an articulated body: no forces, no gravity, only its inertia.
//!
//! ```text
//! q̈ = −M⁻¹·C(q, q̇)          the geodesics of the kinetic energy T = ½ q̇ᵀM(q)q̇
//! ```
//!
//! One step of the classical Runge–Kutta method on `q̇` and of its commutator-free form on
//! positions (see `integrators/context.rs`). Then `q̇` is scaled so that `T` is conserved. A
//! geodesic traversed at another speed is the same geodesic, so the scaling does not reduce the
//! order. Free motion then never gains energy, however long the step.

use crate::articulated::algorithms::dynamics::{Dynamics, Scratch};
use crate::articulated::body::BodyCache;
use crate::articulated::model::Model;
use crate::articulated::model::coordinates::{integrate, read_vector};
use crate::articulated::model::joint::Joint;

/// Advances `x = [q, v]` by `h` seconds of free motion.
pub(in crate::articulated) fn free_motion(model: &Model, cache: &mut BodyCache, x: &mut [f64], h: f64) {
    let n = model.positions();
    if h == 0.0 || x[n..].iter().all(|v| *v == 0.0) {
        return;
    }
    let BodyCache { scratch, elsewhere, zeros, .. } = cache;
    let start = x.to_vec();
    let (mut k, mut stage): (Vec<Vec<f64>>, Vec<f64>) = (Vec::with_capacity(4), start.clone());
    let mut rates: Vec<Vec<f64>> = Vec::with_capacity(4);
    let mut energy = 0.0;
    let mut second = Vec::new();
    for s in 0..4 {
        let (q, v) = stage.split_at(n);
        elsewhere.refresh(q, v);
        let mut rate = vec![0.0; v.len()];
        elsewhere.accelerate(scratch, zeros, &[], &mut rate);
        if s == 0 {
            energy = energy_of(elsewhere, scratch, v);
        }
        k.push(v.to_vec());
        rates.push(rate);
        match s {
            0 | 1 => {
                stage.copy_from_slice(&start);
                step(model, &mut stage, &k[s], &rates[s], 0.5 * h);
                if s == 0 {
                    second = stage.clone();
                }
            }
            2 => {
                // positions go on from stage 2, velocities from the start
                stage.copy_from_slice(&second);
                integrate(model, &mut stage[..n], &combine(&k, [-0.5, 0.0, 1.0, 0.0]), h);
                stage[n..].iter_mut().zip(&start[n..]).zip(&rates[2]).for_each(|((v, v0), a)| *v = v0 + h * a);
            }
            _ => {}
        }
    }
    x.copy_from_slice(&start);
    let (sixth, twelfth) = (1.0 / 6.0, 1.0 / 12.0);
    x[n..].iter_mut().zip(combine(&rates, [sixth, 2.0 * sixth, 2.0 * sixth, sixth])).for_each(|(v, a)| *v += h * a);
    integrate(model, &mut x[..n], &combine(&k, [3.0 * twelfth, 2.0 * twelfth, 2.0 * twelfth, -twelfth]), h);
    integrate(model, &mut x[..n], &combine(&k, [-twelfth, 2.0 * twelfth, 2.0 * twelfth, 3.0 * twelfth]), h);
    let (q, v) = x.split_at_mut(n);
    elsewhere.refresh(q, v);
    let after = energy_of(elsewhere, scratch, v);
    let scale = (energy / after).sqrt();
    if scale.is_finite() {
        v.iter_mut().for_each(|v| *v *= scale);
    }
}

/// Moves the positions of `x = [q, v]` by `h·d` and transports `v` in parallel in the metric `M`
/// (Levi-Civita):
///
/// ```text
/// v̇ = −Γ(d, v) = ¼(a(v + d) − a(v − d)) − ½[d, v]        a(v) = q̈ of free motion, quadratic in v;   [d, v] = ±d×v of spherical joints and floating roots
/// ```
///
/// Kinetic energy is conserved, by a final scaling to rounding. So is linear momentum, which is the
/// product of `v` with a parallel field.
pub(in crate::articulated) fn transport(model: &Model, cache: &mut BodyCache, x: &mut [f64], d: &[f64], h: f64) {
    let n = model.positions();
    let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let stretch = size(&x[n..]) / size(d);
    if !(stretch.is_finite() && stretch > 0.0) {
        integrate(model, &mut x[..n], d, h);
        return;
    }
    let BodyCache { scratch, elsewhere, zeros, .. } = cache;
    elsewhere.refresh(&x[..n], &x[n..]);
    let before = energy_of(elsewhere, scratch, &x[n..]);
    let mut rate = |q: &[f64], v: &[f64]| {
        let [more, less] = [stretch, -stretch].map(|s| {
            let v: Vec<f64> = v.iter().zip(d).map(|(v, d)| v + s * d).collect();
            let mut a = vec![0.0; v.len()];
            elsewhere.refresh(q, &v);
            elsewhere.accelerate(scratch, zeros, &[], &mut a);
            a
        });
        let mut rate: Vec<f64> = more.iter().zip(less).map(|(more, less)| (more - less) / (4.0 * stretch)).collect();
        for link in model.links() {
            let sign = match link.joint {
                Joint::Spherical => -0.5,
                Joint::Floating => 0.5,
                _ => continue,
            };
            let turn = sign * read_vector(&d[link.v..]).cross(&read_vector(&v[link.v..]));
            rate[link.v..link.v + 3].iter_mut().zip(turn.iter()).for_each(|(rate, turn)| *rate += turn);
        }
        rate
    };
    let mut middle = x.to_vec();
    let first = rate(&x[..n], &x[n..]);
    step(model, &mut middle, d, &first, 0.5 * h);
    let second = rate(&middle[..n], &middle[n..]);
    step(model, x, d, &second, h);
    let (q, v) = x.split_at_mut(n);
    elsewhere.refresh(q, v);
    let scale = (before / energy_of(elsewhere, scratch, v)).sqrt();
    if scale.is_finite() {
        v.iter_mut().for_each(|v| *v *= scale);
    }
}

/// Returns `½|L·v|²`.
fn energy_of(dynamics: &Dynamics, scratch: &mut Scratch, v: &[f64]) -> f64 {
    let mut u = vec![0.0; v.len()];
    dynamics.mul_l(scratch, v, &mut u);
    0.5 * u.iter().map(|u| u * u).sum::<f64>()
}

fn step(model: &Model, x: &mut [f64], v: &[f64], rate: &[f64], h: f64) {
    let n = model.positions();
    integrate(model, &mut x[..n], v, h);
    x[n..].iter_mut().zip(rate).for_each(|(v, a)| *v += h * a);
}

fn combine(k: &[Vec<f64>], weight: [f64; 4]) -> Vec<f64> {
    (0..k[0].len()).map(|i| k.iter().zip(weight).map(|(k, w)| w * k[i]).sum()).collect()
}
