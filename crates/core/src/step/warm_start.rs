//! Warm start of the rows of a step from the forces of the last one.

use super::Workspace;
use crate::contact::detect::ContactConstraint;
use crate::contact::laws::ContactLaws;
use crate::contact::warm_starts::RowStart;
use crate::contact::wrench::Wrench;
use crate::world::Core;
use tumble_collide::Vec3;

/// Contacts of a pair are at the same place within this fraction of the distance over which its contacts extend: further
/// than bodies at rest move, and less than others do. Of contacts in motion, those that are gone act better together.
const SAME_PLACE: f64 = 1e-5;

/// Sets multipliers of contacts to the forces of the last sub-step, in the present contact frames, times
/// `scale`. Contacts that are gone leave their force to a new one at their place, else force and torque to those of
/// their pair that touch. The solver projects the multipliers onto the cone.
pub(crate) fn warm_start(core: &Core, work: &mut Workspace, scale: f64) {
    let (mut place, mut first) = (0, 0);
    let (mut forces, mut known, mut lost, mut points) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for contacts in work.contact_constraints.chunk_by(|a, b| a.key.pair == b.key.pair) {
        let blocks = &work.rows.blocks[first..first + contacts.len()];
        first += contacts.len();
        let pose = &core.derived.part_states[contacts[0].a as usize].pose;
        forces.clear();
        forces.resize(contacts.len(), Vec3::zeros());
        known.clear();
        known.resize(contacts.len(), false);
        lost.clear();
        for warm in core.state.warm.of_pair(contacts[0].key.pair, &mut place) {
            match contacts.iter().position(|t| t.key == warm.key) {
                Some(i) => (forces[i], known[i]) = (Vec3::from(warm.force), true),
                None => lost.push((pose.transform_point(&warm.point.into()).coords, Vec3::from(warm.force))),
            }
        }
        let mut gone = Wrench::default();
        if !lost.is_empty() {
            points.clear();
            points.extend(contacts.iter().map(|t| t.contact.point));
            hand_over(&points, &mut known, &mut lost, &mut forces);
            lost.iter().for_each(|(point, force)| gone.add(point, force));
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

/// Gives forces of contacts that are gone to new ones at the same place, and keeps the others in `lost`, each with its
/// place: an edge that ends where the face beneath it ends is cut there or ends by itself, as rounding decides.
fn hand_over(points: &[Vec3], known: &mut [bool], lost: &mut Vec<(Vec3, Vec3)>, forces: &mut [Vec3]) {
    let apart = |a: &Vec3, b: &Vec3| (a - b).norm_squared();
    let extent = points.iter().map(|point| apart(point, &points[0])).fold(0.0, f64::max);
    lost.retain(|(place, force)| {
        let new = points.iter().enumerate().filter(|(i, _)| !known[*i]);
        let nearest = new.map(|(i, point)| (i, apart(point, place))).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((i, _)) = nearest.filter(|(_, square)| *square <= SAME_PLACE * SAME_PLACE * extent) else {
            return true;
        };
        (forces[i], known[i]) = (*force, true);
        false
    });
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners of a face: one is known, one is found again a little off, and one is gone for good.
    #[test]
    fn forces_go_to_new_contacts_at_the_same_place_only() {
        let points = [(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
        let force = |z: f64| Vec3::new(0.0, 0.0, z);
        let mut known = [true, false, false, false];
        let mut forces = [force(1.0), force(0.0), force(0.0), force(0.0)];
        let near_known = (Vec3::new(1e-5, 0.0, 0.0), force(9.0));
        let far = (Vec3::new(0.5, 1.0, 0.0), force(5.0));
        let mut lost = vec![(Vec3::new(1.0, 2.00001, 0.0), force(3.0)), near_known, far];
        hand_over(&points, &mut known, &mut lost, &mut forces);
        assert_eq!(lost, [near_known, far]);
        assert_eq!(forces, [force(1.0), force(0.0), force(3.0), force(0.0)]);
        assert_eq!(known, [true, false, true, false]);
        // a contact takes the force of one other at most
        let again = (Vec3::new(1.0, 1.99999, 0.0), force(4.0));
        lost = vec![again];
        hand_over(&points, &mut known, &mut lost, &mut forces);
        assert_eq!(lost, [again]);
    }
}
