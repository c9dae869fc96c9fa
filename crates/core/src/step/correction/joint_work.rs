//! The work of joints in a step: none.
//!
//! Joints are workless, but the impulses of their rows act on the mean velocity of a step, which has a part
//! along the rows: positions that are closed at both ends and velocities that are, too, do not fit the mean of
//! two velocities,
//!
//! ```text
//! x₁ − x₀ = ½h·(v₀ + v₁) − (h³/12)·v″ + …             the correction moves bodies by the part of the second term along the rows
//! ```
//!
//! So the impulses of the rows, and all forces along the correction, do work of the order `h³` per step. Over a cycle of a
//! mechanism it adds up to zero; within one the energy is off by the order `h²`. Two things are therefore done
//! for every group of joined objects. They move by the part of the second term along their velocity, which is known
//! without `v″`: as joints are workless, `v·M·a = F·v` and `v·M·v″ = F·a − a·M·a`, with `h·(M·a − F) = Jᵀλ`. After the correction
//! the work is returned to their motion:
//!
//! ```text
//! δ  = (h/12)·(Σ λ·(w₁ − w₀) / ½(|v₀|² + |v₁|²))·½(v₀ + v₁)                   then  g(x₁) = 0,  J₁v₁ = 0
//! W  = Σ λ·½(w₀ + w₁)  +  T(x₁, p₁) − T(x*, p*)  −  F·(δ + correction)  +  V(x₁) − V(x₀)          sum over the rows
//! v₁ ← s·v₁,      ½(1 − s²)·|v₁|² = W
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `λ`, `w₀`, `w₁` | multipliers of the step, velocities of rows before and after |
//! | `x*`, `p*`; `x₁`, `p₁` | state before, after the correction |
//! | `T`, `F` | kinetic energy, forces. Bodies that resist turning have an inertia `ΔI` more in this step (`step/resistance.rs`): `½(ω₀ + ω₁)·ΔI·(ω₁ − ω₀)` is taken from `W` |
//! | `V` | energy of the springs in the group, which are stiff for the step: what they released was `Σ λ·½(w₀ + w₁)` |
//! | `v`, `|v|²` | velocity, twice its energy. In a group that nothing joins to the ground both are those relative to the rigid motion that has its momenta, which stay as they are |
//!
//! One factor for all velocities keeps joints closed in velocity, and so does one for those that the rows reach: the spin of a ball on
//! a joint at its center is not among them. In a mechanism of one degree of freedom it is the only
//! such change: its speed is exact wherever it is, and its time of higher order. In others the energy is exact, and the
//! motion of second order.
//!
//! Groups with links of articulated bodies stay as they are: their free motion has errors of the same order.
//! A joint does work if a motor or a kinematic body drives it, if it closes (in position or velocity), or where something
//! strikes or pushes: there nothing is returned.

use super::super::{Moment, Workspace};
use super::group::{Group, by_start, entry_at};
use super::is_joint;
use crate::constraint::rows::{Block, RowSet};
use crate::object::{RowTarget, SpringRow};
use crate::rigid::RigidBody;
use crate::step::contacts::{push, shift, unwhiten_onto};
use crate::world::Core;
use crate::world::view::Entry;
use std::ops::Range;
use tumble_collide::{Mat3, Vec3};

/// A joint with a larger velocity error at the start of a step closes in it, m/s or rad/s.
const CLOSING: f64 = 1e-6;
/// A row has no part in a coordinate of which its response is below this fraction of its largest.
const UNREACHED: f64 = 1e-9;
/// Largest share of the energy of motion that is returned at once: at the turn of a swing there is none.
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

/// Velocities of all objects before and after the impulses.
#[derive(Clone, Copy)]
pub(in super::super) enum Velocities<'a> {
    Whitened([&'a [f64]; 2]),
    Generalized([&'a [f64]; 2]),
}

/// A group whose joints do no work in the step.
pub(super) struct Workless {
    rows: Vec<u32>,
    places: Vec<usize>,
    to_ground: bool,
    /// Whether it has dampers: they take energy, and so do springs beside them.
    takes_only: bool,
    /// Work of the rows less the kinetic energy before the correction, J.
    done: f64,
}

/// Finds the workless groups of a step of `h` seconds, and moves them along their velocity. Adds the displacements to
/// `moved`. `work` has the rows of the step, which respond at the moment `acting`; `pushed` states where contacts push.
pub(super) fn advance(
    core: &Core,
    (end, acting): (&mut Moment, &mut Moment),
    work: &Workspace,
    (impulses, pushed, h): (Impulses, &[bool], f64),
    groups: &[Group],
    moved: &mut [f64],
) -> Vec<Workless> {
    let contacts = work.contact_constraints.len();
    let entries = by_start(core.objects());
    let mut ways = vec![0.0; core.dof];
    let [mut before, mut after] = [ways.clone(), ways.clone()];
    let tolerance = core.settings.contact_tolerance;
    let mut found = Vec::new();
    for group in groups {
        let rows = || group.rows.iter().map(|&i| (i as usize, &work.rows.blocks[contacts + i as usize]));
        let is_workless = |(i, block): (usize, &Block)| {
            let (target, row) = (&work.targets[i], block.row as usize);
            if is_soft(target) {
                return true;
            }
            is_joint(target)
                && block.compliance == 0.0
                && target.velocity == 0.0
                && work.bias[row] == 0.0
                && target.error.abs() <= tolerance
                && work.closing.get(i).is_some_and(|v| v.abs() <= CLOSING)
        };
        let ranges = || group.ranges.iter().map(|(_, v)| v.clone());
        if !ranges().all(|v| !pushed[v.start] && !impulses.struck[v.start]) || !rows().all(is_workless) {
            continue;
        }
        let objects = || ranges().filter_map(|v| entry_at(&entries, v.start as u32));
        if objects().any(|entry| entry.object.integratable().is_none_or(|body| body.holds_velocity())) {
            continue; // free motion of links has errors of the same order
        }
        let mut kinetic = 0.0;
        for entry in objects() {
            let Some(body) = entry.object.integratable() else { continue };
            let (v, cache) = (entry.state_range.v.clone(), &mut acting.derived.caches[entry.place]);
            for (u, k) in [(&mut before, 0), (&mut after, 1)] {
                match impulses.velocities {
                    Velocities::Whitened(all) => u[v.clone()].copy_from_slice(&all[k][v.clone()]),
                    Velocities::Generalized(all) => body.mul_l(cache, &all[k][v.clone()], &mut u[v.clone()]),
                }
            }
            kinetic += body.energy(&end.x[entry.state_range.x.clone()], &Vec3::zeros()).kinetic;
            if let Some(added) = core.resisting.added(entry.place) {
                // the kinetic energy of the state is that without it
                let turned = acting.derived.part_states[entry.state_range.parts.start].pose.rotation;
                let [first, last] = [&before, &after].map(|u| {
                    let mut velocity = [0.0; 6];
                    body.solve_l(cache, &u[v.clone()], &mut velocity);
                    Vec3::from_column_slice(&velocity[..3])
                });
                let [sum, change] = [first + last, last - first].map(|omega| turned.inverse() * omega);
                kinetic += 0.5 * sum.dot(&(added * change));
            }
        }
        let (mut done, mut turned) = (0.0, 0.0);
        for (i, block) in rows() {
            let [first, last] = [&before, &after].map(|u| work.rows.row_velocity(block, 0, u));
            let (target, impulse) = (&work.targets[i], impulses.scale * work.lambda[block.row as usize]);
            match target.spring {
                Some(spring) => done += 0.5 * impulse * (first + last) - energy_of(&spring),
                None if is_joint(target) => {
                    done += 0.5 * impulse * (first + last);
                    turned += impulse * (last - first);
                }
                None => {} // a damper or a drive
            }
        }
        let to_ground = rows().any(|(_, block)| block.sides().len() < 2);
        if !to_ground && ![&mut before, &mut after].into_iter().all(|u| make_relative(objects(), acting, u)) {
            continue;
        }
        let of = |u: &[f64]| ranges().flatten().map(|i| u[i] * u[i]).sum::<f64>();
        let squares = 0.5 * (of(&before) + of(&after));
        if turned.abs() <= MOST * squares && squares > 0.0 {
            let share = h / 12.0 * turned / squares;
            ranges().flatten().for_each(|i| ways[i] = 0.5 * share * (before[i] + after[i]));
        }
        let places = objects().map(|entry| entry.place).collect();
        let damped = |(i, _): (usize, &Block)| {
            let target = &work.targets[i];
            is_soft(target) && target.spring.is_none_or(|spring| spring.damping > 0.0)
        };
        let takes_only = rows().any(damped);
        found.push(Workless { rows: group.rows.clone(), places, to_ground, takes_only, done: done - kinetic });
    }
    if ways.iter().any(|way| *way != 0.0) {
        unwhiten_onto(acting.coordinates(core), &ways, moved);
        shift(end.coordinates_by(core, &mut acting.derived.caches), &ways, 1.0);
    }
    found
}

/// Returns the work in a step of `h` seconds to the motion of the groups that are closed now, at the corrected moment `end`,
/// whose rows are those of `corrected`.
pub(super) fn give_back(
    core: &Core,
    (end, acting): (&mut Moment, &mut Moment),
    (workless, groups): (&[Workless], &[Group]),
    (impulses, moved): (Impulses, &[f64]),
    (work, corrected, h): (&Workspace, &Workspace, f64),
) {
    let mut du = vec![0.0; core.dof];
    let energy_at_end = |&i: &u32| corrected.targets[i as usize].spring.as_ref().map_or(0.0, energy_of);
    let (mut whitened, mut relative) = (du.clone(), du.clone());
    let mut reached = vec![false; core.dof]; // groups share no coordinate
    for found in workless {
        if !groups.iter().any(|group| group.rows == found.rows && group.closed()) {
            continue; // a limit takes part, or joints are open
        }
        let objects = || found.places.iter().map(|&place| core.objects().at(place));
        // joints are closed to a tolerance: what their forces do along the rest is no error
        let slack = |&i: &u32| {
            let (i, row) = (i as usize, work.rows.blocks[work.contact_constraints.len() + i as usize].row);
            if !is_joint(&work.targets[i]) {
                return 0.0;
            }
            work.lambda[row as usize] * (corrected.targets[i].error - work.targets[i].error)
        };
        let mut done = found.done - impulses.scale / h * found.rows.iter().map(slack).sum::<f64>();
        done += found.rows.iter().map(energy_at_end).sum::<f64>();
        let mut kinetic = 0.0;
        for entry in objects() {
            let Some(body) = entry.object.integratable() else { continue };
            let (x, v): (&[f64], Range<usize>) = (&end.x[entry.state_range.x.clone()], entry.state_range.v.clone());
            body.mul_l(&mut acting.derived.caches[entry.place], &moved[v.clone()], &mut whitened[v.clone()]);
            let along: f64 = v.clone().map(|i| whitened[i] * impulses.du_force.0[i]).sum();
            let energy = body.energy(x, &Vec3::zeros()).kinetic;
            done += energy - along / impulses.du_force.1;
            body.whitened_velocity(&mut end.derived.caches[entry.place], x, &mut relative[v.clone()]);
        }
        if !found.to_ground && !make_relative(objects(), end, &mut relative) {
            continue;
        }
        mark_reached(work, &found.rows, &mut reached);
        // without the ground, the rest of the group takes what a spin would leave of the momenta
        let takes_part = |&i: &usize| !found.to_ground || reached[i];
        let ranges = || objects().flat_map(|entry| entry.state_range.v.clone()).filter(takes_part);
        kinetic += ranges().map(|i| 0.5 * relative[i] * relative[i]).sum::<f64>();
        if done != 0.0 && done.abs() <= MOST * kinetic && !(found.takes_only && done < 0.0) {
            let factor = (1.0 - done / kinetic).sqrt() - 1.0;
            ranges().for_each(|i| du[i] = factor * relative[i]);
        }
    }
    if du.iter().any(|du| *du != 0.0) {
        push(end.coordinates(core), &du, &mut Vec::new());
    }
}

/// Marks the coordinates that one of the rows reaches: a joint at the center of a ball, or about the axis of a wheel, has no part in
/// its spin.
fn mark_reached(work: &Workspace, rows: &[u32], reached: &mut [bool]) {
    for &i in rows {
        let block = &work.rows.blocks[work.contact_constraints.len() + i as usize];
        let sides = || block.sides().iter().map(|side| (side.u as usize, work.rows.response(side, 0)));
        let largest = sides().flat_map(|(_, y)| y).fold(0.0, |a: f64, y| a.max(y.abs()));
        for (start, y) in sides() {
            y.iter().enumerate().for_each(|(k, y)| reached[start + k] |= y.abs() > UNREACHED * largest);
        }
    }
}

/// Returns whether a row is a spring, a damper or a drive of finite gain.
fn is_soft(target: &RowTarget) -> bool {
    target.set == RowSet::Equality && target.compliance > 0.0 && !target.inertial
}

/// Returns the energy of a spring, J.
fn energy_of(spring: &SpringRow) -> f64 {
    0.5 * spring.stiffness * spring.extension * spring.extension
}

/// Subtracts from the whitened velocities of bodies the rigid motion that has their momenta. Returns false if other
/// objects are among them, or bodies with locked axes.
fn make_relative<'a>(objects: impl Iterator<Item = Entry<'a>> + Clone, at: &mut Moment, u: &mut [f64]) -> bool {
    let (mut mass, mut moment, mut inertia) = (0.0, Vec3::zeros(), Mat3::zeros());
    let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
    let mut bodies = Vec::new();
    for entry in objects {
        let any: &dyn std::any::Any = entry.object;
        let (Some(body), Some(moves)) = (any.downcast_ref::<RigidBody>(), entry.object.integratable()) else {
            return false;
        };
        let x = &at.x[entry.state_range.x.clone()];
        let Some(own) = body.free_inertia(x) else { return false };
        let (mut v, place) = ([0.0; 6], Vec3::new(x[0], x[1], x[2]));
        moves.solve_l(&mut at.derived.caches[entry.place], &u[entry.state_range.v.clone()], &mut v);
        let [turning, moving] = [Vec3::new(v[0], v[1], v[2]), body.mass() * Vec3::new(v[3], v[4], v[5])];
        mass += body.mass();
        moment += body.mass() * place;
        inertia += own + body.mass() * about(&place);
        linear += moving;
        angular += own * turning + place.cross(&moving);
        bodies.push((entry, place, v));
    }
    let center = moment / mass;
    inertia -= mass * about(&center);
    let Some(inverse) = inertia.try_inverse() else { return false };
    let turning = inverse * (angular - center.cross(&linear));
    for (entry, place, mut v) in bodies {
        let moving = linear / mass + turning.cross(&(place - center));
        (0..3).for_each(|k| (v[k], v[k + 3]) = (v[k] - turning[k], v[k + 3] - moving[k]));
        if let Some(body) = entry.object.integratable() {
            body.mul_l(&mut at.derived.caches[entry.place], &v, &mut u[entry.state_range.v.clone()]);
        }
    }
    true
}

/// Returns the inertia of a unit mass at a place about the origin, m².
fn about(place: &Vec3) -> Mat3 {
    Mat3::from_diagonal_element(place.norm_squared()) - place * place.transpose()
}
