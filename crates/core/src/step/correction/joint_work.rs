//! The work of joints in a step: none.
//!
//! Joints are workless, and the impulses of their rows act on the mean velocity of a step, which has a part
//! along the rows: positions that are closed at both ends and velocities that are, too, do not fit a mean of
//! two velocities,
//!
//! ```text
//! x₁ − x₀ = ½h·(v₀ + v₁) − h³/12·x‴ + …           the correction moves bodies by the second term
//! ```
//!
//! So the impulses of the rows, and all forces along the correction, do work of the order `h³` per step. Over a cycle of a
//! mechanism it adds up to zero; within one the energy is off by the order `h²`. For every group of joined objects
//! this work is measured and returned to their motion:
//!
//! ```text
//! W  = Σ λ·½(w₀ + w₁)  +  T(x₁, p₁) − T(x*, p*)  −  F·δ                         the sum over the rows of joints
//! v₁ ← v_rigid + s·(v₁ − v_rigid),      ½(1 − s²)·|v₁ − v_rigid|² = W
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `λ`, `w₀`, `w₁` | multipliers of the step, velocities of rows before and after |
//! | `x*`, `p*`; `x₁`, `p₁` | state before the correction, after it |
//! | `F`, `δ` | forces, displacement by the correction |
//! | `v_rigid` | 0 if the group is joined to the ground. Else the rigid motion that has its momenta, which stay as they are |
//!
//! One factor for all velocities keeps joints closed in velocity. In a mechanism of one degree of freedom it is the only
//! change of velocity that does, so its speed is exact wherever it is. A joint does work if a motor or a kinematic body
//! drives it, if it closes (in position or velocity), and where something strikes: there nothing is returned.

use super::super::{Moment, Workspace};
use super::group::{Group, by_start, entry_at};
use super::is_joint;
use crate::constraint::rows::Block;
use crate::rigid::RigidBody;
use crate::step::contacts::push;
use crate::world::Core;
use crate::world::view::Entry;
use tumble_collide::{Mat3, Vec3};

/// A joint with a larger velocity error at the start of a step closes in it, m/s or rad/s.
const CLOSING: f64 = 1e-6;
/// Most of the energy of motion that is taken at once: at the turn of a swing there is none.
const MOST: f64 = 0.5;

/// The impulses of a step.
#[derive(Clone, Copy)]
pub(in super::super) struct Impulses<'a> {
    /// Velocities before and after, without the correction.
    pub velocities: Velocities<'a>,
    /// Whitened change of velocity by forces in a time, s.
    pub du_force: (&'a [f64], f64),
    /// Impulse of a multiplier 1: 1 s, or the length of the step for forces, s.
    pub scale: f64,
    /// Per coordinate, whether something strikes the object.
    pub struck: &'a [bool],
}

/// Velocities of all objects at the time of an impulse.
#[derive(Clone, Copy)]
pub(in super::super) enum Velocities<'a> {
    Whitened([&'a [f64]; 2]),
    Generalized([&'a [f64]; 2]),
}

/// The step before its correction.
pub(super) struct Before<'a> {
    pub impulses: Impulses<'a>,
    /// Rows of the step, and the moment at which they respond.
    pub work: &'a Workspace,
    pub acting: &'a mut Moment,
    /// State before the correction, and generalized displacement by it.
    pub arrived: &'a [f64],
    pub moved: &'a [f64],
    /// Per coordinate, whether a contact pushes in the island.
    pub pushed: &'a [bool],
}

/// Returns the work of the joints of the groups to their motion, at the corrected moment `end`.
pub(super) fn balance(core: &Core, end: &mut Moment, before: Before, groups: &[Group]) {
    let Before { impulses, work, acting, arrived, moved, pushed } = before;
    let contacts = work.contact_constraints.len();
    let entries = by_start(core.objects());
    let mut du = vec![0.0; core.dof];
    let tolerance = core.settings.contact_tolerance;
    let (mut before, mut after) = (vec![0.0; core.dof], vec![0.0; core.dof]);
    for group in groups {
        let rows = || group.rows.iter().map(|&i| (i as usize, &work.rows.blocks[contacts + i as usize]));
        let is_ideal = |(i, block): (usize, &Block)| {
            let (target, row) = (&work.targets[i], block.row as usize);
            is_joint(target)
                && block.compliance == 0.0
                && target.velocity == 0.0
                && work.bias[row] == 0.0
                && target.error.abs() <= tolerance
                && work.closing.get(i).is_some_and(|v| v.abs() <= CLOSING)
        };
        let free = |u: usize| !pushed[u] && !impulses.struck[u];
        let objects = || group.ranges.iter().filter_map(|(_, v)| entry_at(&entries, v.start as u32));
        if !group.closed() || !group.ranges.iter().all(|(_, v)| free(v.start)) || !rows().all(is_ideal) {
            continue;
        }
        for entry in objects() {
            let Some(body) = entry.object.integratable() else { continue };
            let (v, cache) = (entry.state_range.v.clone(), &mut acting.derived.caches[entry.place]);
            for (u, k) in [(&mut before, 0), (&mut after, 1)] {
                match impulses.velocities {
                    Velocities::Whitened(all) => u[v.clone()].copy_from_slice(&all[k][v.clone()]),
                    Velocities::Generalized(all) => body.mul_l(cache, &all[k][v.clone()], &mut u[v.clone()]),
                }
            }
        }
        let of_row = |(_, block): (usize, &Block)| {
            let mean = 0.5 * (work.rows.row_velocity(block, 0, &before) + work.rows.row_velocity(block, 0, &after));
            impulses.scale * work.lambda[block.row as usize] * mean
        };
        let mut done: f64 = rows().map(of_row).sum();
        let (mut kinetic, mut force) = (0.0, Vec::new());
        for entry in objects() {
            let Some(body) = entry.object.integratable() else { continue };
            let (x, v) = (entry.state_range.x.clone(), entry.state_range.v.clone());
            let [was, is] = [arrived, &end.x].map(|at| body.energy(&at[x.clone()], &Vec3::zeros()).kinetic);
            kinetic += is;
            force.clear();
            force.resize(v.len(), 0.0);
            body.mul_l(&mut acting.derived.caches[entry.place], &moved[v.clone()], &mut force);
            let along: f64 = force.iter().zip(&impulses.du_force.0[v]).map(|(a, b)| a * b).sum();
            done += is - was - along / impulses.du_force.1;
        }
        let joined_to_ground = rows().any(|(_, block)| block.sides().len() < 2);
        let rigid = if joined_to_ground { Some(Rigid::default()) } else { Rigid::of(objects(), &end.x) };
        let Some(rigid) = rigid else { continue };
        let relative = kinetic - rigid.energy;
        if done.abs() > MOST * relative {
            continue;
        }
        let factor = (1.0 - done / relative).sqrt() - 1.0;
        for entry in objects() {
            let Some(body) = entry.object.integratable() else { continue };
            let v = entry.state_range.v.clone();
            let (x, cache) = (&end.x[entry.state_range.x.clone()], &mut end.derived.caches[entry.place]);
            let mut u = vec![0.0; v.len()];
            if joined_to_ground {
                body.whitened_velocity(cache, x, &mut u);
            } else {
                let mut relative = vec![0.0; v.len()];
                body.velocity(x, &mut relative);
                rigid.subtract(&Vec3::new(x[0], x[1], x[2]), &mut relative);
                body.mul_l(cache, &relative, &mut u);
            }
            du[v].iter_mut().zip(&u).for_each(|(du, u)| *du = factor * u);
        }
    }
    if du.iter().any(|du| *du != 0.0) {
        push(end.coordinates(core), &du, &mut Vec::new());
    }
}

/// A rigid motion.
#[derive(Default)]
struct Rigid {
    velocity: Vec3,
    angular_velocity: Vec3,
    center: Vec3,
    /// J.
    energy: f64,
}

impl Rigid {
    /// Returns the rigid motion that has the momenta of the bodies in a state; `None` if other objects are among them.
    fn of<'a>(objects: impl Iterator<Item = Entry<'a>> + Clone, x: &[f64]) -> Option<Rigid> {
        let (mut mass, mut moment) = (0.0, Vec3::zeros());
        let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
        let mut inertia = Mat3::zeros();
        for entry in objects {
            let any: &dyn std::any::Any = entry.object;
            let body = any.downcast_ref::<RigidBody>()?;
            let x = &x[entry.state_range.x.clone()];
            let (at, of_body) = (Vec3::new(x[0], x[1], x[2]), body.free_inertia(x)?);
            let momentum = entry.object.integratable()?.momentum(x);
            mass += body.mass();
            moment += body.mass() * at;
            inertia += of_body + body.mass() * (Mat3::from_diagonal_element(at.norm_squared()) - at * at.transpose());
            linear += momentum.linear;
            angular += momentum.angular;
        }
        let center = moment / mass;
        inertia -= mass * (Mat3::from_diagonal_element(center.norm_squared()) - center * center.transpose());
        angular -= center.cross(&linear);
        let angular_velocity = inertia.try_inverse()? * angular;
        let velocity = linear / mass;
        let energy = 0.5 * (linear.dot(&velocity) + angular.dot(&angular_velocity));
        Some(Rigid { velocity, angular_velocity, center, energy })
    }

    /// Subtracts its velocity at a point from that of a body there: angular, then linear.
    fn subtract(&self, at: &Vec3, v: &mut [f64]) {
        let linear = self.velocity + self.angular_velocity.cross(&(at - self.center));
        for k in 0..3 {
            v[k] -= self.angular_velocity[k];
            v[k + 3] -= linear[k];
        }
    }
}
