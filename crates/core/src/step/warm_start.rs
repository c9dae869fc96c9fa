//! Warm start of the rows of a step from the forces of the last one.

use super::Workspace;
use crate::contact::detect::ContactConstraint;
use crate::contact::laws::ContactLaws;
use crate::contact::warm_starts::RowStart;
use crate::contact::wrench::Wrench;
use crate::world::Core;
use tumble_collide::Vec3;

/// Sets multipliers of contacts to the forces of the last sub-step, in the present contact frames, times
/// `scale`. Contacts that are gone leave their force and torque to those of their pair that touch.
/// The solver projects the multipliers onto the cone.
pub(crate) fn warm_start(core: &Core, work: &mut Workspace, scale: f64) {
    let (mut place, mut first) = (0, 0);
    let mut forces = Vec::new();
    for contacts in work.contact_constraints.chunk_by(|a, b| a.key.pair == b.key.pair) {
        let blocks = &work.rows.blocks[first..first + contacts.len()];
        first += contacts.len();
        let pose = &core.derived.part_states[contacts[0].a as usize].pose;
        forces.clear();
        forces.resize(contacts.len(), Vec3::zeros());
        let mut gone = Wrench::default();
        for warm in core.state.warm.of_pair(contacts[0].key.pair, &mut place) {
            match contacts.iter().position(|t| t.key == warm.key) {
                Some(i) => forces[i] = Vec3::from(warm.force),
                None => gone.add(&pose.transform_point(&warm.point.into()).coords, &Vec3::from(warm.force)),
            }
        }
        if gone.force != Vec3::zeros() {
            let touches = |t: &ContactConstraint| t.contact.gap <= core.settings.drift_tolerance;
            gone.spread(|i| contacts[i].contact.point, |i| touches(&contacts[i]), &mut forces);
        }
        for ((constraint, block), force) in contacts.iter().zip(blocks).zip(&forces) {
            for (row, axis) in block.range().zip(&constraint.frame.axes) {
                let size = if constraint.laws.is_some() { axis.norm_squared() } else { 1.0 };
                work.lambda[row] = scale * axis.dot(force) / size;
            }
            let pull = scale * ContactLaws::pull(&constraint.laws);
            work.lambda[block.row as usize] = (work.lambda[block.row as usize] + pull).max(0.0);
        }
    }
    let contacts = work.contact_constraints.len();
    for (owner, ends) in work.owners.iter().zip(work.first.windows(2)) {
        let (blocks, forces) = (&work.rows.blocks[contacts..][ends[0]..ends[1]], core.state.warm.of_owner(*owner));
        // a constraint with another number of rows than in the last step starts from nothing
        for (block, start) in blocks.iter().zip(forces).filter(|_| blocks.len() == forces.len()) {
            work.lambda[block.row as usize] = scale * start.force;
        }
    }
}

/// Returns the forces of the constraints' rows: multipliers `lambda` times `scale`.
pub(super) fn row_starts(work: &Workspace, lambda: &[f64], scale: f64) -> Vec<RowStart> {
    let blocks = &work.rows.blocks[work.contact_constraints.len()..];
    let mut starts = Vec::with_capacity(blocks.len());
    for (owner, ends) in work.owners.iter().zip(work.first.windows(2)) {
        let forces = blocks[ends[0]..ends[1]].iter().map(|block| scale * lambda[block.row as usize]);
        starts.extend(forces.map(|force| RowStart { owner: *owner, force }));
    }
    starts
}
