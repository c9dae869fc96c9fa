//! The rows of contacts, on several threads.
//!
//! The blocks and their sides are laid out first, in order. Then each piece of consecutive contacts
//! writes the responses of its own sides. Objects whose responses need a cache of their own
//! ([`Integratable::test_impulse_shared`] returns false) follow on the calling thread.

use super::contacts::{Basis, Workspace};
use crate::constraint::rows::{Block, RowSet, Rows};
use crate::contact::detect::ContactConstraint;
use crate::derived::Cache;
use crate::object::Integratable;
use crate::object::part_state::{PartPoint, PartState};
use crate::world::view::Entry;
use std::ops::Range;
use tumble_collide::Vec3;

/// Minimum number of contacts of a piece, about 10 µs.
const CONTACTS: usize = 64;

/// One side of a contact.
struct ContactSide<'a> {
    entry: Entry<'a>,
    part: usize,
    part_state: &'a PartState,
    point: Vec3,
    sign: f64,
}

/// Consecutive contacts, and where their numbers begin.
struct Piece<'a> {
    contacts: Range<usize>,
    y: &'a mut [f64],
    bias: &'a mut [f64],
    /// Contacts and sides that are left.
    left: Vec<(usize, usize)>,
}

/// Builds the rows of the contacts alone.
pub(super) fn lay_contact_rows(basis: &mut Basis, work: &mut Workspace) {
    let Workspace { contact_constraints, rows, bias, targets, kinds, .. } = work;
    rows.clear(basis.view.objects.table.dof());
    bias.clear();
    targets.clear();
    kinds.clear();
    let pieces = basis.threads.pieces(contact_constraints.len(), CONTACTS);
    if pieces.len() == 1 {
        return contact_constraints.iter().for_each(|constraint| add_contact(basis, constraint, rows, bias));
    }
    let mut starts = Vec::with_capacity(pieces.len() + 1);
    for contacts in &pieces {
        starts.push((rows.y.len(), rows.len));
        for constraint in &contact_constraints[contacts.clone()] {
            rows.push_block(set_of(constraint));
            for side in sides(basis, constraint) {
                if moving(&side.entry).is_some() {
                    rows.side(side.entry.state_range.v.start, side.entry.state_range.v.len());
                }
            }
        }
    }
    starts.push((rows.y.len(), rows.len));
    bias.resize(rows.len, 0.0);
    let (mut y_left, mut bias_left) = (&mut rows.y[..], &mut bias[..]);
    let pieces = pieces.into_iter().zip(starts.windows(2)).map(|(contacts, ends)| {
        let (y, rest) = std::mem::take(&mut y_left).split_at_mut(ends[1].0 - ends[0].0);
        let (bias, bias_rest) = std::mem::take(&mut bias_left).split_at_mut(ends[1].1 - ends[0].1);
        (y_left, bias_left) = (rest, bias_rest);
        Piece { contacts, y, bias, left: Vec::new() }
    });
    let mut pieces: Vec<(Piece, (usize, usize))> = pieces.zip(starts.iter().copied()).collect();
    let (shared, blocks) = (&*basis, &rows.blocks);
    basis.threads.each(pieces.iter_mut(), |(piece, start)| {
        for i in piece.contacts.clone() {
            fill(shared, (&contact_constraints[i], &blocks[i]), i, piece, *start);
        }
    });
    let left: Vec<(usize, usize)> = pieces.into_iter().flat_map(|(piece, _)| piece.left).collect();
    for (i, k) in left {
        let side = &sides(basis, &contact_constraints[i])[k];
        let Some((body, range)) = moving(&side.entry).zip(y_range(&rows.blocks[i], &side.entry)) else { continue };
        let axes = &contact_constraints[i].frame.axes[..rows.blocks[i].set.rows()];
        let at = PartPoint { part: side.part, part_state: side.part_state, point: side.point, axes };
        let place = side.entry.place;
        body.test_impulse(&mut basis.caches[place], &at, side.sign, &mut rows.y[range]);
    }
}

/// Adds the rows of one contact.
fn add_contact(basis: &mut Basis, constraint: &ContactConstraint, rows: &mut Rows, bias: &mut Vec<f64>) {
    rows.push_block(set_of(constraint));
    let first = bias.len();
    bias.resize(rows.len, 0.0);
    let axes = &constraint.frame.axes[..rows.len - first];
    add_surface_velocity(constraint, axes, &mut bias[first..]);
    for ContactSide { entry, part, part_state, point, sign } in sides(basis, constraint) {
        if !entry.moves() {
            add_velocity(part_state, &point, (axes, sign), &mut bias[first..]);
        } else if let Some(body) = entry.object.integratable()
            && let Some(y) = rows.side(entry.state_range.v.start, entry.state_range.v.len())
        {
            body.test_impulse(&mut basis.caches[entry.place], &PartPoint { part, part_state, point, axes }, sign, y);
        }
    }
}

/// Adds the velocity of a side without degrees of freedom.
fn add_velocity(part_state: &PartState, point: &Vec3, (axes, sign): (&[Vec3], f64), bias: &mut [f64]) {
    let velocity = part_state.velocity_at(point);
    for (bias, axis) in bias.iter_mut().zip(axes) {
        *bias += sign * velocity.dot(axis);
    }
}

/// Adds the velocity of the surfaces over their bodies, along the tangents.
fn add_surface_velocity(constraint: &ContactConstraint, axes: &[Vec3], bias: &mut [f64]) {
    for (bias, axis) in bias.iter_mut().zip(axes).skip(1) {
        *bias += constraint.surface_velocity.dot(axis);
    }
}

fn set_of(constraint: &ContactConstraint) -> RowSet {
    let mu = constraint.laws.as_ref().map_or(0.0, |laws| laws.static_friction).max(constraint.friction);
    if mu > 0.0 { RowSet::Cone { mu } } else { RowSet::HalfLine }
}

/// Returns the object's interface if impulses move it.
fn moving<'a>(entry: &Entry<'a>) -> Option<&'a dyn Integratable> {
    entry.object.integratable().filter(|_| entry.moves())
}

/// Returns both sides of a contact.
fn sides<'a>(basis: &Basis<'a>, constraint: &ContactConstraint) -> [ContactSide<'a>; 2] {
    [(constraint.a, 1.0), (constraint.b, -1.0)].map(|(part_state, sign)| {
        let (owner, index) = (basis.owners[part_state as usize], part_state as usize);
        let (entry, (_, found)) = (basis.view.objects.at(owner.place as usize), basis.found);
        let acting = basis.acting.filter(|_| entry.moves()).map(|part_states| &part_states[index]);
        let point = acting_point(constraint, part_state, &found[index], acting, &entry);
        ContactSide { entry, part: owner.part as usize, part_state: acting.unwrap_or(&found[index]), point, sign }
    })
}

/// Returns the point of a contact on a part, for the state at which the part acts: `found` if `acting`
/// is `None`.
fn acting_point(
    constraint: &ContactConstraint,
    part: u32,
    found: &PartState,
    acting: Option<&PartState>,
    entry: &Entry,
) -> Vec3 {
    match acting {
        // a rigid body acts where the contact has moved to, with its own pose of that time
        Some(_) if constraint.moved.time > 0.0 && entry.object.integratable().is_some_and(|b| !b.holds_velocity()) => {
            constraint.contact.point + constraint.moved.way
        }
        // the lever arm stays that of the contact: the lowest point of a spinning sphere does not turn
        // with it
        Some(acting) => constraint.point_on(part, found) + acting.position() - found.position(),
        None => {
            let from_origin = found.angular_velocity.cross(&entry.center_from_origin(found));
            constraint.point_on(part, found) - constraint.moved.time * from_origin
        }
    }
}

/// Returns the range of the responses of an object in a block.
fn y_range(block: &Block, entry: &Entry) -> Option<Range<usize>> {
    let side = block.sides().iter().find(|side| side.u as usize == entry.state_range.v.start)?;
    Some(side.y as usize..side.y as usize + block.set.rows() * side.dof as usize)
}

/// Adds both sides of a contact: a test impulse for a moving object, a velocity for any other.
fn fill(
    basis: &Basis,
    (constraint, block): (&ContactConstraint, &Block),
    i: usize,
    piece: &mut Piece,
    (y_start, bias_start): (usize, usize),
) {
    let axes = &constraint.frame.axes[..block.set.rows()];
    add_surface_velocity(constraint, axes, &mut piece.bias[block.row as usize - bias_start..]);
    for (k, ContactSide { entry, part, part_state, point, sign }) in sides(basis, constraint).into_iter().enumerate() {
        if entry.moves() {
            let Some((body, range)) = moving(&entry).zip(y_range(block, &entry)) else { continue };
            let y = &mut piece.y[range.start - y_start..range.end - y_start];
            let at = PartPoint { part, part_state, point, axes };
            let caches: &[Cache] = basis.caches;
            if !body.test_impulse_shared(&caches[entry.place], &at, sign, y) {
                piece.left.push((i, k));
            }
        } else {
            add_velocity(part_state, &point, (axes, sign), &mut piece.bias[block.row as usize - bias_start..]);
        }
    }
}
