//! Compounds: the contacts of each part, without those inside another part.

use super::contacts_in_mode;
use crate::{CompoundShape, Contact, ContactMode, Pose, Shape, Vec3};

/// Multiplier that distributes small numbers over all bits.
const HASH_MULTIPLIER: u64 = 0x9e37_79b9_7f4a_7c15;

/// The compound of a pair.
pub(super) enum Side<'a> {
    A(&'a CompoundShape),
    B(&'a CompoundShape),
}

impl Side<'_> {
    /// Returns the compound of a pair, the first one of two.
    pub fn of<'a>(a: &'a Shape, b: &'a Shape) -> Option<Side<'a>> {
        match (a, b) {
            (Shape::Compound(compound), _) => Some(Side::A(compound)),
            (_, Shape::Compound(compound)) => Some(Side::B(compound)),
            _ => None,
        }
    }
}

/// Appends the contacts of each part of the compound, which is on `side`, with the other shape.
#[allow(clippy::too_many_arguments)]
pub(super) fn contacts_of_compound(
    side: Side,
    mode: ContactMode,
    (a, pose_a): (&Shape, &Pose),
    (b, pose_b): (&Shape, &Pose),
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let (compound, pose, other, pose_other, sign, own_side) = match side {
        Side::A(compound) => (compound, pose_a, b, pose_b, 0.5, 0),
        Side::B(compound) => (compound, pose_b, a, pose_a, -0.5, 1),
    };
    let near = other.aabb(&pose.inv_mul(pose_other)).grown(margin);
    let start = out.len();
    // the deepest contact inside another part, used only if nothing else overlaps
    let mut fallback: Option<Contact> = None;
    for (n, shape, own) in compound.active_parts() {
        let bounds = &compound.boxes()[n];
        if !(0..3).all(|k| bounds.min[k] <= near.max[k] && near.min[k] <= bounds.max[k]) {
            continue;
        }
        let (first, part) = (out.len(), pose * own);
        match side {
            Side::A(_) => contacts_in_mode(mode, shape, &part, b, pose_b, margin, out),
            Side::B(_) => contacts_in_mode(mode, a, pose_a, shape, &part, margin, out),
        }
        let name = (n as u64 + 1).wrapping_mul(HASH_MULTIPLIER);
        let is_buried = |c: &Contact| {
            let at: Vec3 = c.point + sign * c.gap * c.normal;
            let outward = pose.rotation.inverse() * (-2.0 * sign * c.normal);
            compound.has_no_contact(n, &pose.inverse_transform_point(&at.into()).coords, &outward)
        };
        let mut kept = first;
        for k in first..out.len() {
            // rotated, so that the numbers of parts of two compounds do not cancel
            let mut contact = Contact { feature: out[k].feature.rotate_left(1) ^ name, ..out[k] };
            contact.shapes[own_side] = n as u32;
            if !is_buried(&contact) {
                out[kept] = contact;
                kept += 1;
            } else if fallback.is_none_or(|deepest| contact.gap < deepest.gap) {
                fallback = Some(contact);
            }
        }
        out.truncate(kept);
    }
    if let Some(fallback) = fallback.filter(|deepest| deepest.gap < 0.0)
        && out[start..].iter().all(|c| c.gap >= 0.0)
    {
        out.push(fallback);
    }
}
