//! Free motion of an articulated body: no forces, no gravity, only its inertia.
//!
//! ```text
//! q̈ = −M⁻¹·C(q, q̇)          the geodesics of the kinetic energy T = ½ q̇ᵀM(q)q̇
//! ```
//!
//! One step of Nyström's method of fourth order, with `a(q, v) = q̈`:
//!
//! ```text
//! a₁ = a(q, v)                                     a₂ = a(q ⊕ (½h·v + ⅛h²·a₁), v + ½h·a₁)
//! a₃ = a(q ⊕ (½h·v + ⅛h²·a₁), v + ½h·a₂)           a₄ = a(q ⊕ (h·v + ½h²·a₃), v + h·a₃)
//! q' = q ⊕ (h·v + ⅙h²·(a₁ + a₂ + a₃))              v' = v + ⅙h·(a₁ + 2a₂ + 2a₃ + a₄)
//! ```
//!
//! It has four stages at three places, and the first is where the body is: of the four evaluations two need new poses and
//! inertias. A rotation vector `θ` of a spherical joint or a floating root also has the first term of Magnus's series, `θ̇ = ω ∓ ½·θ×ω`, which is
//! `∓¹⁄₁₂·h³·ω×ω̇` of a stage, and `∓¹⁄₁₂·h²·ω×ω'` of the step: the next one is of the fifth order.
//!
//! Then `q̇` is scaled so that `T` is conserved. A
//! geodesic traversed at another speed is the same geodesic, so the scaling does not reduce the
//! order. Free motion then never gains energy, however long the step.

use crate::articulated::algorithms::dynamics::Dynamics;
use crate::articulated::algorithms::same_place::LinkRates;
use crate::articulated::model::Model;
use crate::articulated::model::coordinates::{integrate, read_vector};
use crate::articulated::model::joint::Joint;

/// Free motion of one model, with its working memory: the dynamics at the stages of a step, which
/// leave those at the refreshed state as they are, and the numbers of the stages. No call allocates
/// memory.
#[derive(Clone, Debug)]
pub(in crate::articulated) struct FreeMotion {
    dynamics: Dynamics,
    links: Vec<LinkRates>,
    /// A state at a stage.
    stage: Vec<f64>,
    /// Accelerations of the four stages.
    a: [Vec<f64>; 4],
    /// A displacement, or a sum of rates.
    sum: Vec<f64>,
}

impl FreeMotion {
    /// Prepares a model, whose dynamics are `dynamics` at any state.
    pub fn new(dynamics: &Dynamics) -> FreeMotion {
        let dof = vec![0.0; dynamics.dof()];
        FreeMotion {
            dynamics: dynamics.clone(),
            links: dynamics.link_rates(),
            stage: vec![0.0; dynamics.positions() + dynamics.dof()],
            a: std::array::from_fn(|_| dof.clone()),
            sum: dof,
        }
    }

    /// Advances `x = [q, v]` by `h` seconds of free motion. `known` spares the dynamics at `q` if they are those.
    pub fn advance(&mut self, model: &Model, known: &Dynamics, x: &mut [f64], h: f64) {
        self.dynamics.set_inertias(model); // they may have changed since the last call
        let n = model.positions();
        if h == 0.0 || x[n..].iter().all(|v| *v == 0.0) {
            return;
        }
        let FreeMotion { dynamics, links, stage, a: [first, second, third, fourth], sum } = self;
        let (q, v) = x.split_at_mut(n);
        let energy = if known.is_at(q) {
            known.free_acceleration_again::<true>(links, v, first)
        } else {
            dynamics.refresh(q, v);
            dynamics.free_acceleration_again::<true>(links, v, first)
        };
        let (place, speed) = stage.split_at_mut(n);
        displacement(model, (v, first), 0.5 * h, sum);
        reach(model, q, sum, place);
        add(v, first, 0.5 * h, speed);
        dynamics.free_acceleration(place, speed, second);
        add(v, second, 0.5 * h, speed);
        dynamics.free_acceleration_again::<false>(links, speed, third);
        displacement(model, (v, third), h, sum);
        reach(model, q, sum, place);
        add(v, third, h, speed);
        dynamics.free_acceleration(place, speed, fourth);
        for (i, sum) in sum.iter_mut().enumerate() {
            *sum = h * v[i] + h * h / 6.0 * (first[i] + second[i] + third[i]);
            speed[i] = v[i] + h / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + fourth[i]);
        }
        add_turning(model, (v, speed), h * h / 12.0, sum);
        integrate(model, q, sum, 1.0);
        v.copy_from_slice(speed);
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
        let [more, less, ..] = &mut self.a;
        add(v, d, stretch, &mut self.sum);
        self.dynamics.free_acceleration(q, &self.sum, more);
        add(v, d, -stretch, &mut self.sum);
        self.dynamics.free_acceleration_again::<false>(&mut self.links, &self.sum, less);
        let difference = more.iter().zip(&*less).map(|(more, less)| (more - less) / (4.0 * stretch));
        self.sum.iter_mut().zip(difference).for_each(|(sum, rate)| *sum = rate);
        add_turning(model, (d, v), -0.5, &mut self.sum);
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

/// Writes `a + h·b`.
fn add(a: &[f64], b: &[f64], h: f64, out: &mut [f64]) {
    out.iter_mut().zip(a).zip(b).for_each(|((out, a), b)| *out = a + h * b);
}

/// Writes where the positions `q` are after a displacement.
fn reach(model: &Model, q: &[f64], displacement: &[f64], out: &mut [f64]) {
    out.copy_from_slice(q);
    integrate(model, out, displacement, 1.0);
}

/// Writes the displacement in `h` seconds with a constant acceleration, to the third order of rotations.
fn displacement(model: &Model, (v, a): (&[f64], &[f64]), h: f64, out: &mut [f64]) {
    out.iter_mut().zip(v).zip(a).for_each(|((out, v), a)| *out = h * v + 0.5 * h * h * a);
    add_turning(model, (v, a), h * h * h / 12.0, out);
}

/// Adds to `out` the bracket of two velocities times `h`: `b×a` of the world's axes, of a floating root, `a×b` of a link's own, of a
/// spherical joint.
fn add_turning(model: &Model, (a, b): (&[f64], &[f64]), h: f64, out: &mut [f64]) {
    for link in model.links() {
        let h = match link.joint {
            Joint::Spherical => h,
            Joint::Floating => -h,
            _ => continue,
        };
        let turn = h * read_vector(&a[link.v..]).cross(&read_vector(&b[link.v..]));
        out[link.v..link.v + 3].iter_mut().zip(turn.iter()).for_each(|(out, turn)| *out += turn);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::articulated::model::{LinkMass, ModelBuilder};
    use crate::articulated::{difference, forward_dynamics};
    use tumble_collide::{Mat3, Pose, Vec3};

    /// A floating root with a spherical, a revolute and a prismatic joint, none of them symmetric.
    fn tree() -> Model {
        let mass = |m: f64, center: Vec3| LinkMass {
            mass: m,
            center,
            inertia: Mat3::from_diagonal(&Vec3::new(0.03 * m, 0.05 * m, 0.04 * m)),
        };
        let mut builder = ModelBuilder::new();
        let root = builder.link("root", None, Joint::Floating, Pose::identity(), mass(2.0, Vec3::new(0.1, 0.0, 0.05)));
        let ball = Pose::translation(0.3, 0.1, 0.0);
        let arm = builder.link("arm", Some(root), Joint::Spherical, ball, mass(1.0, Vec3::new(0.2, 0.0, -0.3)));
        let hinge = Pose::translation(0.4, 0.0, 0.0);
        let hand =
            builder.link("hand", Some(arm), Joint::revolute(Vec3::y()), hinge, mass(0.5, Vec3::new(0.2, 0.1, 0.0)));
        let slide = Joint::prismatic(Vec3::x());
        builder.link("finger", Some(hand), slide, Pose::translation(0.1, 0.0, 0.0), mass(0.3, Vec3::zeros()));
        builder.build().expect("a sound tree")
    }

    fn start(model: &Model) -> Vec<f64> {
        let mut x = vec![0.0; model.positions() + model.dof()];
        (x[6], x[10]) = (1.0, 1.0); // quaternions of no turn
        let v = [2.0, -1.0, 1.5, 0.3, 0.1, -0.2, -2.0, 1.0, 1.5, 3.0, 0.2];
        x[model.positions()..].copy_from_slice(&v);
        x
    }

    /// Half a second in `steps` steps of free motion; `known` has the dynamics of each start at hand.
    fn end(model: &Model, steps: usize, known: bool) -> Vec<f64> {
        let mut dynamics = Dynamics::new(model);
        let (mut motion, mut x) = (FreeMotion::new(&dynamics), start(model));
        for _ in 0..steps {
            if known {
                let (q, v) = x.split_at(model.positions());
                dynamics.refresh(q, v);
            }
            motion.advance(model, &dynamics, &mut x, 0.5 / steps as f64);
        }
        x
    }

    /// The explicit midpoint rule.
    fn reference(model: &Model, steps: usize) -> Vec<f64> {
        let (n, h) = (model.positions(), 0.5 / steps as f64);
        let (mut dynamics, mut x) = (Dynamics::new(model), start(model));
        let (mut a, zeros) = (vec![0.0; model.dof()], vec![0.0; model.dof()]);
        for _ in 0..steps {
            let mut middle = x.clone();
            for (from, h) in [(x.clone(), 0.5 * h), (Vec::new(), h)] {
                let at = if from.is_empty() { middle.clone() } else { from };
                forward_dynamics(&mut dynamics, &Vec3::zeros(), &at[..n], &at[n..], &zeros, &mut a).unwrap();
                middle.copy_from_slice(&x);
                step(model, &mut middle, &at[n..], &a, h);
            }
            x = middle;
        }
        x
    }

    fn apart(model: &Model, a: &[f64], b: &[f64]) -> f64 {
        let (n, mut way) = (model.positions(), vec![0.0; model.dof()]);
        difference(model, &a[..n], &b[..n], &mut way);
        way.iter().copied().chain(a[n..].iter().zip(&b[n..]).map(|(a, b)| a - b)).map(f64::abs).fold(0.0, f64::max)
    }

    #[test]
    fn free_motion_is_of_fourth_order_and_that_of_forward_dynamics() {
        let model = tree();
        let fine = end(&model, 2560, false);
        let [coarse, half] = [80, 160].map(|steps| apart(&model, &end(&model, steps, false), &fine));
        assert!((3.7..4.3).contains(&(coarse / half).log2()), "{coarse:e} {half:e}");
        // the errors of the midpoint rule are of second order: one extrapolation to none
        let [far, near] = [10_000, 20_000].map(|steps| apart(&model, &reference(&model, steps), &fine));
        assert!(near < 1e-6 && (3.9..4.1).contains(&(far / near)), "{far:e} {near:e}");
    }

    #[test]
    fn dynamics_at_hand_change_no_bit() {
        let model = tree();
        assert_eq!(end(&model, 20, true), end(&model, 20, false));
    }
}
