//! The forces of contacts and constraints that hold over a sub-step of `backtracking`, and its changes of velocity.

use super::Workspace;
use super::contacts::{impulses, push, recover};
use crate::object::part_state::Wrench;
use crate::world::Core;
use crate::world::view::Entry;

/// Writes the forces that hold over the sub-step to `held`, as generalized forces. Contact forces
/// on an object whose state holds velocities are stored as wrenches on its parts: its coordinates
/// turn with its links, and a generalized force would turn too.
pub(super) fn hold_forces(core: &mut Core, work: &Workspace, held: &mut [f64]) {
    recover(core.coordinates(None), &work.du, held);
    core.held_wrenches.clear();
    let on_links = |e: &Entry| e.moves() && e.object.integratable().is_some_and(|b| b.holds_velocity());
    if work.contact_constraints.is_empty() || !core.objects().iter().any(|e| on_links(&e)) {
        return;
    }
    let mut joined = vec![0.0; core.dof];
    work.rows.blocks[work.contact_constraints.len()..]
        .iter()
        .for_each(|block| work.rows.apply_block(block, &work.lambda, &mut joined));
    let mut generalized = vec![0.0; core.dof];
    recover(core.coordinates(None), &joined, &mut generalized);
    for entry in core.objects().iter().filter(|e| on_links(e)) {
        held[entry.state_range.v.clone()].copy_from_slice(&generalized[entry.state_range.v.clone()]);
    }
    core.held_wrenches.resize(core.derived.part_states.len(), Wrench::default());
    let links = |core: &Core, part: u32| on_links(&core.objects().at(core.owners[part as usize].place as usize));
    for patch in &work.moments {
        let constraint = &work.contact_constraints[patch.contact];
        for (part, moment) in [(constraint.a, patch.moment), (constraint.b, -patch.moment)] {
            if links(core, part) {
                core.held_wrenches[part as usize].torque += moment;
            }
        }
    }
    for (constraint, force) in work.contact_constraints.iter().zip(impulses(work, &work.lambda, 1.0)) {
        for (part_state, force) in [(constraint.a, force), (constraint.b, -force)] {
            if links(core, part_state) {
                let state = &core.derived.part_states[part_state as usize];
                let arm = constraint.point_on(part_state, state) - state.position();
                let wrench = &mut core.held_wrenches[part_state as usize];
                wrench.force += force;
                wrench.torque += arm.cross(&force);
            }
        }
    }
}

/// Changes the whitened velocity from `before` to `after`, and refreshes part states and caches.
pub(super) fn push_to(core: &mut Core, after: &[f64], before: &[f64]) {
    let change: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
    push(core.coordinates(None), &change, &mut Vec::new());
    core.integration().refresh();
}
