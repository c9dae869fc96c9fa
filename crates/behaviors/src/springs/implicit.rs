//! The implicit step of a spring mesh: Newton's method on the incremental potential.
//!
//! ```text
//! Φ(Δv) = ½·ΔvᵀMΔv + h·Δvᵀ(D·(v₀ + ¼·Δv) − f_ext) + (2/θ)·V(q(Δv))          ∇Φ = 0
//! ```
//!
//! Symbols as in [`super`].

use super::SpringMesh;
use super::factor::Factor;
use super::object::MeshCache;
use std::collections::VecDeque;
use tumble_collide::{Mat3, Vec3};

/// Most iterations, number of those with one factor, and most halvings of one.
const ITERATIONS: usize = 48;
const WITH_ONE_FACTOR: usize = 12;
const HALVINGS: usize = 8;
/// Number of iterations that a quasi-Newton step remembers.
const REMEMBERED: usize = 6;
/// Rounding of the potential, relative to the sum of the sizes of its terms: a step of so little gain is as good as it looks.
const ROUNDING: f64 = 1e-15;
/// Change of velocity at which the iteration ends, m/s.
const CONVERGED: f64 = 1e-11;

/// The equation of one step.
struct Equation<'a> {
    mesh: &'a SpringMesh,
    /// Positions where free motion brings the forces, `x_½ + ½·h·(2·θ − 1)·v₀`, m.
    ahead: Vec<Vec3>,
    /// Direction of each spring at `x_½`; zero of one without length.
    directions: Vec<Vec3>,
    /// Velocity before the step, m/s.
    velocity: Vec<Vec3>,
    /// Forces of all else, N.
    external: &'a [Vec3],
}

impl SpringMesh {
    /// Returns the change of velocity of all nodes in a step without contacts, m/s. `x` is the state in the middle of
    /// free motion. Leaves the factor of the last iteration in the cache.
    pub(super) fn solve_step(&self, cache: &mut MeshCache, x: &[f64], external: &[Vec3]) -> Vec<Vec3> {
        let vectors = |x: &[f64]| x.chunks_exact(3).map(Vec3::from_column_slice).collect::<Vec<_>>();
        let (positions, velocities) = x.split_at(3 * self.nodes.len());
        let (middle, velocity) = (vectors(positions), vectors(velocities));
        let lead = 0.5 * self.step * (2.0 * self.implicitness - 1.0);
        let ahead = middle.iter().zip(&velocity).map(|(x, v)| x + lead * v).collect();
        let direction = |nodes: [usize; 2]| (middle[nodes[1]] - middle[nodes[0]]).try_normalize(0.0);
        let directions =
            self.springs.iter().map(|spring| direction(spring.nodes).unwrap_or_else(Vec3::zeros)).collect();
        let equation = Equation { mesh: self, ahead, directions, velocity, external };
        let mut change = vec![Vec3::zeros(); self.nodes.len()];
        let mut factor = cache.factor.take().unwrap_or_else(|| std::mem::take(&mut cache.spare));
        let (mut value, mut gradient) = (equation.value(&change), equation.gradient(&change));
        let (mut past, mut left) = (Past::default(), 0);

        for _ in 0..ITERATIONS {
            let fresh = left == 0;
            if fresh {
                let flat: Vec<f64> = equation.places(&change).iter().flat_map(|q| q.iter().copied()).collect();
                self.write_factor(&flat, positions, &mut factor);
                past.0.clear();
                left = WITH_ONE_FACTOR;
            }
            let step = past.step(&gradient, |gradient| self.newton_step(&factor, gradient));
            let size = step.iter().map(Vec3::amax).fold(0.0, f64::max);
            let tried = |share: f64| change.iter().zip(&step).map(|(v, s)| v - share * s).collect::<Vec<_>>();
            let shares = (0..HALVINGS).map(|k| 0.5f64.powi(k as i32));
            let better = shares.map(|share| (tried(share), share)).find_map(|(next, share)| {
                let next_value = equation.value(&next);
                let falls = next_value.0 <= value.0 + ROUNDING * value.1;
                (falls || size * share < CONVERGED).then_some((next, next_value))
            });
            let Some((next, next_value)) = better else {
                if fresh {
                    break;
                }
                left = 0;
                continue;
            };
            let next_gradient = equation.gradient(&next);
            past.remember(difference(&next, &change), difference(&next_gradient, &gradient));
            (change, value, gradient) = (next, next_value, next_gradient);
            if size < CONVERGED {
                break;
            }
            left -= 1;
        }
        (cache.factor, cache.made_for) = (Some(factor), [self.step, self.implicitness]);
        change
    }

    /// Returns `A⁻¹·∇Φ`.
    fn newton_step(&self, factor: &Factor, gradient: &[Vec3]) -> Vec<Vec3> {
        let mut b = vec![Vec3::zeros(); gradient.len()];
        self.pattern.place.iter().zip(gradient).for_each(|(place, g)| b[*place] = *g);
        self.pattern.solve(factor, &mut b);
        self.pattern.solve_transposed(factor, &mut b);
        self.pattern.place.iter().map(|place| b[*place]).collect()
    }

    /// Writes the factor of `A` with the stiffness at positions `q` and the damping at `x`.
    pub(super) fn write_factor(&self, q: &[f64], x: &[f64], factor: &mut Factor) {
        let h = self.step;
        self.pattern.clear(factor);
        for (node, mass) in self.masses.iter().enumerate() {
            self.pattern.add(factor, node, &(Mat3::identity() * *mass));
        }
        let mut add = |spring: usize, block: &Mat3| {
            let [a, b] = self.springs[spring].nodes;
            for node in [a, b].into_iter().filter(|node| !self.pinned[*node]) {
                self.pattern.add(factor, node, block);
            }
            if !(self.pinned[a] || self.pinned[b]) {
                self.pattern.add_joined(factor, spring, &-block);
            }
        };
        self.each_spring(q, |index, spring, u, length| {
            let weight = 0.5 * h * h * self.implicitness * spring.stiffness;
            let across = weight * (1.0 - spring.length / length).max(0.0);
            add(index, &(u * u.transpose() * (weight - across) + Mat3::identity() * across));
        });
        self.each_spring(x, |index, spring, u, _| {
            if spring.damping > 0.0 {
                add(index, &(u * u.transpose() * (0.5 * h * spring.damping)));
            }
        });
        self.pattern.factor(factor);
    }
}

/// Changes of velocity and of the gradient in the last iterations, and the inverse of their product.
#[derive(Default)]
struct Past(VecDeque<(Vec<Vec3>, Vec<Vec3>, f64)>);

impl Past {
    /// Returns the quasi-Newton step for a gradient: `inverse` multiplies by the inverse of the factored matrix, and the
    /// iterations since correct it (the two loops of L-BFGS).
    fn step(&self, gradient: &[Vec3], inverse: impl Fn(&[Vec3]) -> Vec<Vec3>) -> Vec<Vec3> {
        let mut rest = gradient.to_vec();
        let mut shares = Vec::with_capacity(self.0.len());
        for (moved, turned, scale) in self.0.iter().rev() {
            let share = scale * product(moved, &rest);
            rest.iter_mut().zip(turned).for_each(|(rest, turned)| *rest -= share * turned);
            shares.push(share);
        }
        let mut step = inverse(&rest);
        for ((moved, turned, scale), share) in self.0.iter().zip(shares.iter().rev()) {
            let share = share - scale * product(turned, &step);
            step.iter_mut().zip(moved).for_each(|(step, moved)| *step += share * moved);
        }
        step
    }

    /// Remembers an iteration, unless the potential has no curvature along it.
    fn remember(&mut self, moved: Vec<Vec3>, turned: Vec<Vec3>) {
        let curvature = product(&moved, &turned);
        if curvature > 1e-12 * product(&moved, &moved).sqrt() * product(&turned, &turned).sqrt() {
            if self.0.len() == REMEMBERED {
                self.0.pop_front();
            }
            self.0.push_back((moved, turned, 1.0 / curvature));
        }
    }
}

fn product(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn difference(a: &[Vec3], b: &[Vec3]) -> Vec<Vec3> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

impl Equation<'_> {
    /// Returns the positions `q` at which the springs act, m.
    fn places(&self, change: &[Vec3]) -> Vec<Vec3> {
        let lead = 0.5 * self.mesh.step * self.mesh.implicitness;
        self.ahead.iter().zip(change).map(|(x, dv)| x + lead * dv).collect()
    }

    /// Returns `Φ` and the sum of the sizes of its terms.
    fn value(&self, change: &[Vec3]) -> (f64, f64) {
        let (mesh, h, q) = (self.mesh, self.mesh.step, self.places(change));
        let nodes = mesh.masses.iter().zip(change).zip(self.external);
        let moved = nodes.map(|((mass, dv), f)| 0.5 * mass * dv.norm_squared() - h * dv.dot(f));
        let springs = mesh.springs.iter().zip(&self.directions).map(|(spring, u)| {
            let [a, b] = spring.nodes;
            let stretch = (q[b] - q[a]).norm() - spring.length;
            let (dv, v) = (u.dot(&(change[b] - change[a])), u.dot(&(self.velocity[b] - self.velocity[a])));
            spring.stiffness / mesh.implicitness * stretch * stretch + h * spring.damping * dv * (v + 0.25 * dv)
        });
        moved.chain(springs).fold((0.0, 0.0), |(sum, size), term| (sum + term, size + term.abs()))
    }

    /// Returns `∇Φ`; zero of pinned nodes.
    fn gradient(&self, change: &[Vec3]) -> Vec<Vec3> {
        let (mesh, h, q) = (self.mesh, self.mesh.step, self.places(change));
        let nodes = mesh.masses.iter().zip(change).zip(self.external);
        let mut gradient: Vec<Vec3> = nodes.map(|((mass, dv), f)| *mass * dv - h * f).collect();
        for (spring, u) in mesh.springs.iter().zip(&self.directions) {
            let [a, b] = spring.nodes;
            let arm = q[b] - q[a];
            let length = arm.norm();
            let mean = |node: usize| self.velocity[node] + 0.5 * change[node];
            let mut pull = spring.damping * u.dot(&(mean(b) - mean(a))) * u;
            if length > 0.0 {
                pull += spring.stiffness * (1.0 - spring.length / length) * arm;
            }
            gradient[a] -= h * pull;
            gradient[b] += h * pull;
        }
        gradient.iter_mut().zip(&mesh.pinned).filter(|(_, pinned)| **pinned).for_each(|(g, _)| g.fill(0.0));
        gradient
    }
}
