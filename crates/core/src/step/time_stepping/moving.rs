//! Contacts that move during a step: rows of lasting contacts are those of the middle of the step,
//! rows of impacts those of their time.

use crate::contact::detect::ContactConstraint;
use crate::object::part_state::PartState;
use crate::step::Workspace;
use crate::world::Core;
use tumble_collide::{Shape, Vec3};

/// Moves the contacts that touch, or that may bounce, to `time` seconds after the start of the step.
pub(super) fn move_contacts(core: &Core, contacts: &mut [ContactConstraint], time: f64) {
    for constraint in contacts {
        let may_bounce = constraint.restitution > 0.0 && constraint.found_at == 0.0;
        if may_bounce || touches(core, constraint) {
            constraint.move_to(time, parts(core, constraint), shapes(core, constraint));
        }
    }
}

/// Returns whether a contact is closed at the start of the step.
pub(super) fn touches(core: &Core, constraint: &ContactConstraint) -> bool {
    constraint.contact.gap <= core.settings.drift_tolerance
}

/// Returns the rate of the row velocities of a contact in free motion, m/s² along its axes. `turning`
/// is that of [`gyroscopic`](crate::step::contacts::gyroscopic).
pub(super) fn row_rates(work: &Workspace, contact: usize, turning: &[f64]) -> Vec3 {
    let (constraint, block) = (&work.contact_constraints[contact], &work.rows.blocks[contact]);
    let rate = constraint.moved.rate;
    if rate == Vec3::zeros() {
        return rate;
    }
    let of = |i: usize| constraint.frame.axes[i].dot(&rate) - work.rows.row_velocity(block, i, turning);
    Vec3::from_fn(|i, _| if i < block.set.rows() { of(i) } else { 0.0 })
}

/// Moves the contacts of objects that have an impact to the time of it, a `fraction` of `h` seconds
/// per coordinate. Velocities change there, so their rates before it do not hold for the rest of the
/// step.
pub(super) fn move_to_impacts(core: &Core, work: &mut Workspace, fraction: &[f64], h: f64) {
    for (constraint, block) in work.contact_constraints.iter_mut().zip(&work.rows.blocks) {
        let s = block.sides().iter().map(|side| fraction[side.u as usize]).fold(-1.0, f64::max);
        if s >= 0.0 {
            constraint.move_to(s * h, parts(core, constraint), shapes(core, constraint));
            constraint.moved.rate = Vec3::zeros();
        }
    }
}

fn parts<'a>(core: &'a Core, constraint: &ContactConstraint) -> [&'a PartState; 2] {
    [constraint.a, constraint.b].map(|part| &core.derived.part_states[part as usize])
}

fn shapes<'a>(core: &'a Core, constraint: &ContactConstraint) -> [Option<&'a Shape>; 2] {
    [constraint.a, constraint.b].map(|part| {
        let owner = core.owners[part as usize];
        core.objects().at(owner.place as usize).object.collidable()?.shape(owner.part as usize)
    })
}
