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
use crate::articulated::model::Model;
use crate::articulated::model::coordinates::{integrate, read_vector};
use crate::articulated::model::joint::Joint;

/// Free motion of one model, with its working memory: the dynamics at the stages of a step, which
/// leave those at the refreshed state as they are, and the numbers of the stages. No call allocates
/// memory.
#[derive(Clone, Debug)]
pub(in crate::articulated) struct FreeMotion {
    dynamics: Dynamics,
    scratch: Scratch,
    /// States at the start, at a stage, and at stage 2.
    start: Vec<f64>,
    stage: Vec<f64>,
    second: Vec<f64>,
    /// Velocities and accelerations of the four stages.
    v: [Vec<f64>; 4],
    a: [Vec<f64>; 4],
    /// A combination of stages, or a whitened velocity.
    sum: Vec<f64>,
    zeros: Vec<f64>,
}

impl FreeMotion {
    /// Prepares a model, whose dynamics are `dynamics` at any state.
    pub fn new(dynamics: &Dynamics) -> FreeMotion {
        let (state, dof) = (vec![0.0; dynamics.positions() + dynamics.dof()], vec![0.0; dynamics.dof()]);
        FreeMotion {
            dynamics: dynamics.clone(),
            scratch: dynamics.scratch(),
            start: state.clone(),
            stage: state.clone(),
            second: state,
            v: std::array::from_fn(|_| dof.clone()),
            a: std::array::from_fn(|_| dof.clone()),
            sum: dof.clone(),
            zeros: dof,
        }
    }

    /// Advances `x = [q, v]` by `h` seconds of free motion.
    pub fn advance(&mut self, model: &Model, x: &mut [f64], h: f64) {
        self.dynamics.set_inertias(model); // they may have changed since the last call
        let n = model.positions();
        if h == 0.0 || x[n..].iter().all(|v| *v == 0.0) {
            return;
        }
        self.start.copy_from_slice(x);
        self.stage.copy_from_slice(x);
        let mut energy = 0.0;
        for s in 0..4 {
            let (q, v) = self.stage.split_at(n);
            if s == 0 {
                energy = self.dynamics.free_acceleration_and_energy(q, v, &mut self.a[s]);
            } else {
                self.dynamics.free_acceleration(q, v, &mut self.a[s]);
            }
            self.v[s].copy_from_slice(v);
            match s {
                0 | 1 => {
                    self.stage.copy_from_slice(&self.start);
                    step(model, &mut self.stage, &self.v[s], &self.a[s], 0.5 * h);
                    if s == 0 {
                        self.second.copy_from_slice(&self.stage);
                    }
                }
                2 => {
                    // positions go on from stage 2, velocities from the start
                    self.stage.copy_from_slice(&self.second);
                    combine(&self.v, [-0.5, 0.0, 1.0, 0.0], &mut self.sum);
                    integrate(model, &mut self.stage[..n], &self.sum, h);
                    let accelerated = self.start[n..].iter().zip(&self.a[2]).map(|(v, a)| v + h * a);
                    self.stage[n..].iter_mut().zip(accelerated).for_each(|(v, end)| *v = end);
                }
                _ => {}
            }
        }
        let (sixth, twelfth) = (1.0 / 6.0, 1.0 / 12.0);
        combine(&self.a, [sixth, 2.0 * sixth, 2.0 * sixth, sixth], &mut self.sum);
        x[n..].iter_mut().zip(&self.sum).for_each(|(v, a)| *v += h * a);
        combine(&self.v, [3.0 * twelfth, 2.0 * twelfth, 2.0 * twelfth, -twelfth], &mut self.sum);
        integrate(model, &mut x[..n], &self.sum, h);
        combine(&self.v, [-twelfth, 2.0 * twelfth, 2.0 * twelfth, 3.0 * twelfth], &mut self.sum);
        integrate(model, &mut x[..n], &self.sum, h);
        self.scale_to(energy, n, x);
    }

    /// Moves the positions of `x = [q, v]` by `h·d` and transports `v` in parallel in the metric
    /// `M` (Levi-Civita):
    ///
    /// ```text
    /// v̇ = −Γ(d, v) = ¼(a(v + d) − a(v − d)) − ½[d, v]        a(v) = q̈ of free motion, quadratic in v;   [d, v] = ±d×v of spherical joints and floating roots
    /// ```
    ///
    /// Kinetic energy is conserved, by a final scaling to rounding. So is linear momentum, which is
    /// the product of `v` with a parallel field.
    pub fn transport(&mut self, model: &Model, x: &mut [f64], d: &[f64], h: f64) {
        self.dynamics.set_inertias(model);
        let n = model.positions();
        let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let stretch = size(&x[n..]) / size(d);
        if !(stretch.is_finite() && stretch > 0.0) {
            integrate(model, &mut x[..n], d, h);
            return;
        }
        let energy = self.dynamics.kinetic_energy(&x[..n], &x[n..]);
        self.stage.copy_from_slice(x);
        for end in [0.5 * h, h] {
            self.transport_rate(model, d, stretch);
            self.stage.copy_from_slice(x);
            step(model, &mut self.stage, d, &self.sum, end);
        }
        x.copy_from_slice(&self.stage);
        self.scale_to(energy, n, x);
    }

    /// Writes `−Γ(d, v)` at the stage to `sum`.
    fn transport_rate(&mut self, model: &Model, d: &[f64], stretch: f64) {
        let (q, v) = self.stage.split_at(model.positions());
        for (k, s) in [stretch, -stretch].into_iter().enumerate() {
            self.sum.iter_mut().zip(v).zip(d).for_each(|((sum, v), d)| *sum = v + s * d);
            self.dynamics.refresh(q, &self.sum);
            self.dynamics.accelerate(&mut self.scratch, &self.zeros, &[], &mut self.a[k]);
        }
        let [more, less, ..] = &self.a;
        let difference = more.iter().zip(less).map(|(more, less)| (more - less) / (4.0 * stretch));
        self.sum.iter_mut().zip(difference).for_each(|(sum, rate)| *sum = rate);
        for link in model.links() {
            let sign = match link.joint {
                Joint::Spherical => -0.5,
                Joint::Floating => 0.5,
                _ => continue,
            };
            let turn = sign * read_vector(&d[link.v..]).cross(&read_vector(&v[link.v..]));
            self.sum[link.v..link.v + 3].iter_mut().zip(turn.iter()).for_each(|(rate, turn)| *rate += turn);
        }
    }

    /// Scales the velocities of `x` to a kinetic energy, if that is finite.
    fn scale_to(&mut self, energy: f64, n: usize, x: &mut [f64]) {
        let scale = (energy / self.dynamics.kinetic_energy(&x[..n], &x[n..])).sqrt();
        if scale.is_finite() {
            x[n..].iter_mut().for_each(|v| *v *= scale);
        }
    }
}

fn step(model: &Model, x: &mut [f64], v: &[f64], rate: &[f64], h: f64) {
    let n = model.positions();
    integrate(model, &mut x[..n], v, h);
    x[n..].iter_mut().zip(rate).for_each(|(v, a)| *v += h * a);
}

/// Writes `Σ weight·k`. A stage of weight 0 is not read: it may be one of an earlier step, which
/// failed with numbers that are not finite.
fn combine(k: &[Vec<f64>; 4], weight: [f64; 4], sum: &mut [f64]) {
    for (i, sum) in sum.iter_mut().enumerate() {
        *sum = k.iter().zip(weight).filter(|(_, w)| *w != 0.0).map(|(k, w)| w * k[i]).sum();
    }
}
