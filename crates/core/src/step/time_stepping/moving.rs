//! Contacts that move during a step: rows of lasting contacts are those of the middle of the step,
//! rows of impacts those of their time.

use crate::constraint::rows::{Block, Rows};
use crate::contact::detect::ContactConstraint;
use crate::contact::motion::{Moved, move_in_step};
use crate::contact::time_of_impact::moving_pair;
use crate::step::contacts::{free_motion_change, gyroscopic};
use crate::step::{Moment, Workspace};
use crate::world::Core;
use std::sync::Arc;
use tumble_collide::{Contact, Shape, Vec3};

/// Moves the contacts that touch to `time` seconds after the start of the step. Others stay, so that
/// what passes them keeps its distance; those that may bounce get their rates.
pub(super) fn move_contacts(core: &Core, contacts: &mut [ContactConstraint], time: f64) {
    for constraint in contacts {
        let touches = touches(core, constraint, time);
        let may_bounce = constraint.found_at == 0.0;
        if touches || may_bounce {
            let before = constraint.frame;
            move_in_step(core, constraint, time);
            if !touches {
                constraint.frame = before;
                constraint.moved = Moved { time: 0.0, way: Vec3::zeros(), ..constraint.moved };
            }
        }
    }
}

/// Returns whether a contact is closed at the start of the step and still is `time` seconds later: one that opens does
/// not last, and with its motion it might push.
pub(super) fn touches(core: &Core, constraint: &ContactConstraint, time: f64) -> bool {
    let [a, b] = [constraint.a, constraint.b].map(|part| &core.derived.part_states[part as usize]);
    let opening = time * constraint.velocity(a, b).dot(&constraint.contact.normal);
    constraint.contact.gap + opening.max(0.0) <= core.settings.drift_tolerance
}

/// Terms of the whitened velocities that change the velocities of rows in free motion; `None` if all
/// are zero.
#[derive(Default)]
pub(super) struct FreeTerms {
    /// See [`gyroscopic`].
    pub turning: Option<Vec<f64>>,
    /// See [`free_motion_change`], for half a step.
    pub change: Option<Vec<f64>>,
}

impl FreeTerms {
    pub fn new(middle: &mut Moment, core: &Core, h: f64) -> FreeTerms {
        let some = |v: Vec<f64>| v.iter().any(|x| *x != 0.0).then_some(v);
        let turning = gyroscopic(middle.coordinates(core)).and_then(some);
        FreeTerms { turning, change: some(free_motion_change(middle.coordinates(core), 0.5 * h)) }
    }

    /// Returns the change of a row's velocity by half a step of free motion, and the rate of it that
    /// is no acceleration.
    pub fn of_row(&self, rows: &Rows, block: &Block, row: usize) -> (f64, f64) {
        let change = self.change.as_ref().map_or(0.0, |v| rows.row_velocity(block, row, v));
        (change, self.turning_of_row(rows, block, row))
    }

    /// Returns the rate of a row's velocity in free motion that is no acceleration.
    pub fn turning_of_row(&self, rows: &Rows, block: &Block, row: usize) -> f64 {
        self.turning.as_ref().map_or(0.0, |v| rows.row_velocity(block, row, v))
    }
}

/// Returns the velocity (m/s) of the gap of a contact at the start of a step of `h` seconds, from that
/// of its row, and the rate of it in free motion, m/s².
pub(super) fn gap_rate(work: &Workspace, contact: usize, free: &FreeTerms, (row, h): (f64, f64)) -> (f64, f64) {
    let ContactConstraint { moved, frame, .. } = &work.contact_constraints[contact];
    if !moved.changes() {
        return (row, 0.0);
    }
    let (_, turning) = free.of_row(&work.rows, &work.rows.blocks[contact], 0);
    let [rate, links, driven] = [moved.rate, moved.of_links, moved.of_driven].map(|rate| frame.axes[0].dot(&rate));
    let rate = rate - turning;
    (row - moved.time * rate - 0.5 * h * links, rate + links + driven)
}

/// The largest ratio of the velocities with which a contact that moves leaves and comes, without forces. Along the row of the
/// middle of the step a contact that lasts comes as fast as it leaves, except for terms of higher order.
const REFLECTED: f64 = 1.5;

/// Adds to the right-hand side of a contact that touches what its rows still change until the end
/// of the step. Rows of links are those of the middle of the step, velocities of driven parts those of
/// its start. `comes` is the velocity of the normal row before the contact acts, without forces, m/s: a contact that
/// hardly comes does not last, whatever its motion, and an impulse `λ` that made it leave at `w₁` would do the work
/// `λ·½(comes + w₁)`.
pub(super) fn add_motion(work: &mut Workspace, contact: usize, free: &FreeTerms, (comes, h): (f64, f64)) {
    let (constraint, block) = (&work.contact_constraints[contact], &work.rows.blocks[contact]);
    let moved = &constraint.moved;
    let left = (h - moved.time) * moved.rate + 0.5 * h * moved.of_links + h * moved.of_driven;
    for (k, (row, axis)) in block.range().zip(&constraint.frame.axes).enumerate() {
        let (change, turning) = free.of_row(&work.rows, block, k);
        let motion = change + axis.dot(&left) - (h - moved.time) * turning;
        work.c[row] += if k == 0 { motion.max(REFLECTED * comes.min(0.0)) } else { motion };
    }
}

/// Moves the contacts of objects that have an impact to the time of it, a `fraction` of `h` seconds
/// per coordinate. Velocities change there, so their rates before it do not hold for the rest of the
/// step. Contacts of convex shapes are found again in their places of that time: a row that is exact
/// at any place on the way never allows overlap.
pub(super) fn move_to_impacts(core: &Core, work: &mut Workspace, (fraction, rates): (&[f64], &[f64]), h: f64) {
    let mut found = Vec::new();
    let mut first = 0;
    for contacts in work.contact_constraints.chunk_by_mut(same_query) {
        let end = first + contacts.len();
        let sides = work.rows.blocks[first].sides();
        let s = sides.iter().map(|side| fraction[side.u as usize]).fold(-1.0, f64::max);
        if s >= 0.0 && !find_at_impact(core, contacts, s * h, &mut found) {
            for (constraint, rate) in contacts.iter_mut().zip(&rates[first..end]) {
                move_in_step(core, constraint, s * h);
                let Moved { time, way, .. } = constraint.moved;
                let turned = if time == s * h { -0.5 * time * time * rate } else { 0.0 };
                constraint.moved = Moved { time, way, turned, ..Moved::default() };
            }
        }
        first = end;
    }
}

/// Returns whether two contacts are of the same parts, with the same plane if there is one.
fn same_query(x: &ContactConstraint, y: &ContactConstraint) -> bool {
    let planes = [x, y].map(|constraint| constraint.plane.as_ref().map(Arc::as_ptr));
    x.key.pair == y.key.pair && planes[0] == planes[1]
}

/// Finds the contacts of two surfaces again at the time `t` of an impact, s, by one query. Returns false for shapes that are not
/// convex. `found` is working memory.
fn find_at_impact(core: &Core, contacts: &mut [ContactConstraint], t: f64, found: &mut Vec<Contact>) -> bool {
    let (sides, plane) = ([contacts[0].a, contacts[0].b], contacts[0].plane.clone());
    let pair = moving_pair(core.part_table(), sides, plane.as_deref());
    let stops = contacts.iter().all(|constraint| constraint.restitution <= 0.0);
    let convex = |shape: &Shape| matches!(shape, Shape::Mesh(_)) && shape.has_convex_parts();
    let again = |shape: &&Shape| !shape.has_tree() || stops && convex(shape);
    let Some(pair) = pair.filter(|pair| pair.shapes.iter().all(again)) else { return false };
    let margin = |c: &ContactConstraint| c.contact.gap.abs() + pair.reach(&c.contact.point, t);
    let widest = contacts.iter().map(margin).fold(0.0, f64::max);
    pair.contacts_after(t, widest + core.settings.drift_tolerance, found);
    for constraint in contacts {
        constraint.stay();
        if let Some(contact) = found.iter().find(|contact| contact.feature == constraint.key.feature) {
            constraint.find_again(contact, pair.part_states, t, true);
        }
    }
    true
}
