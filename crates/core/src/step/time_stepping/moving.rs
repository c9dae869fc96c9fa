//! Contacts that move during a step: rows of lasting contacts are those of the middle of the step,
//! rows of impacts those of their time.

use crate::constraint::rows::{Block, Rows};
use crate::contact::detect::ContactConstraint;
use crate::contact::motion::Moved;
use crate::object::part_state::PartState;
use crate::step::contacts::{free_motion_change, gyroscopic};
use crate::step::{Moment, Workspace};
use crate::world::Core;
use tumble_collide::{Shape, Vec3};

/// Parts that are slower, m/s and rad/s, keep their contacts where they are.
const STILL: f64 = 1e-6;

/// Moves the contacts that touch to `time` seconds after the start of the step. Others stay, so that
/// what passes them keeps its distance; those that may bounce get their rates.
pub(super) fn move_contacts(core: &Core, contacts: &mut [ContactConstraint], time: f64) {
    for constraint in contacts {
        let parts = parts(core, constraint);
        let touches = touches(core, constraint);
        let may_bounce = constraint.restitution > 0.0 && constraint.found_at == 0.0;
        if (touches || may_bounce) && !parts.into_iter().all(is_still) {
            let before = constraint.frame;
            constraint.move_to(time, parts, |part| shape(core, part));
            if !touches {
                constraint.frame = before;
                constraint.moved = Moved { rate: constraint.moved.rate, ..Moved::default() };
            }
        }
    }
}

fn is_still(part: &PartState) -> bool {
    part.velocity.norm_squared().max(part.angular_velocity.norm_squared()) < STILL * STILL
}

/// Returns whether a contact is closed at the start of the step.
pub(super) fn touches(core: &Core, constraint: &ContactConstraint) -> bool {
    constraint.contact.gap <= core.settings.drift_tolerance
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
        let turning = some(gyroscopic(middle.coordinates(core)));
        FreeTerms { turning, change: some(free_motion_change(middle.coordinates(core), 0.5 * h)) }
    }

    /// Returns the change of a row's velocity by half a step of free motion, and the rate of it that
    /// is no acceleration.
    pub fn of_row(&self, rows: &Rows, block: &Block, row: usize) -> (f64, f64) {
        let of = |v: &Option<Vec<f64>>| v.as_ref().map_or(0.0, |v| rows.row_velocity(block, row, v));
        (of(&self.change), of(&self.turning))
    }
}

/// Returns the rate of the normal velocity of a contact in free motion, m/s².
pub(super) fn normal_rate(work: &Workspace, contact: usize, free: &FreeTerms) -> f64 {
    let constraint = &work.contact_constraints[contact];
    if constraint.moved.rate == Vec3::zeros() {
        return 0.0;
    }
    let (_, turning) = free.of_row(&work.rows, &work.rows.blocks[contact], 0);
    constraint.frame.axes[0].dot(&constraint.moved.rate) - turning
}

/// Adds to the right-hand side of a contact that touches what its rows still change until the end
/// of the step.
pub(super) fn add_motion(work: &mut Workspace, contact: usize, free: &FreeTerms, h: f64) {
    let (constraint, block) = (&work.contact_constraints[contact], &work.rows.blocks[contact]);
    for (k, (row, axis)) in block.range().zip(&constraint.frame.axes).enumerate() {
        let (change, turning) = free.of_row(&work.rows, block, k);
        work.c[row] += change + (h - constraint.moved.time) * (axis.dot(&constraint.moved.rate) - turning);
    }
}

/// Moves the contacts of objects that have an impact to the time of it, a `fraction` of `h` seconds
/// per coordinate. Velocities change there, so their rates before it do not hold for the rest of the
/// step.
pub(super) fn move_to_impacts(core: &Core, work: &mut Workspace, fraction: &[f64], h: f64) {
    for (constraint, block) in work.contact_constraints.iter_mut().zip(&work.rows.blocks) {
        let s = block.sides().iter().map(|side| fraction[side.u as usize]).fold(-1.0, f64::max);
        if s >= 0.0 {
            constraint.move_to(s * h, parts(core, constraint), |part| shape(core, part));
            constraint.moved.rate = Vec3::zeros();
        }
    }
}

fn parts<'a>(core: &'a Core, constraint: &ContactConstraint) -> [&'a PartState; 2] {
    [constraint.a, constraint.b].map(|part| &core.derived.part_states[part as usize])
}

fn shape(core: &Core, part: u32) -> Option<&Shape> {
    let owner = core.owners[part as usize];
    core.objects().at(owner.place as usize).object.collidable()?.shape(owner.part as usize)
}
