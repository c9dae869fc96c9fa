//! Meshes with overlapping shells: the contacts of each pair of shells, without those inside
//! another shell.

use super::{part_count, sdf_contact, with_body};
use crate::sdf::shells::is_inside_other_shell;
use crate::{Contact, Pose, Shape, Vec3};
use nalgebra::Point3;

/// Appends all contacts of two shapes of which at least one has several parts.
pub(super) fn contacts_of_parts(
    a: &Shape,
    pose_a: &Pose,
    b: &Shape,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let start = out.len();
    // the deepest contact inside another shell, used only if nothing else overlaps
    let mut fallback: Option<Contact> = None;
    for i in 0..part_count(a) {
        for j in 0..part_count(b) {
            let first = out.len();
            with_body(a, i, &mut |a| {
                with_body(b, j, &mut |b| sdf_contact::contacts(a, pose_a, b, pose_b, margin, out))
            });
            let name = (i << 16 | j) as u64;
            out[first..].iter_mut().for_each(|contact| contact.feature ^= name.wrapping_mul(HASH_MULTIPLIER));
            let is_exposed = |c: &Contact| {
                let half = 0.5 * c.gap * c.normal;
                !is_inside_other_part(a, pose_a, i, c.point + half)
                    && !is_inside_other_part(b, pose_b, j, c.point - half)
            };
            let mut kept = first;
            for n in first..out.len() {
                let contact = out[n];
                if is_exposed(&contact) {
                    out[kept] = contact;
                    kept += 1;
                } else if fallback.is_none_or(|s| contact.gap < s.gap) {
                    fallback = Some(contact);
                }
            }
            out.truncate(kept);
        }
    }
    if let Some(fallback) = fallback.filter(|s| s.gap < 0.0)
        && out[start..].iter().all(|c| c.gap >= 0.0)
    {
        out.push(fallback);
    }
}

/// Multiplier that distributes small numbers over all bits.
const HASH_MULTIPLIER: u64 = 0x9e37_79b9_7f4a_7c15;

/// Returns whether a point on a shape's part, in world axes, lies inside another part.
fn is_inside_other_part(shape: &Shape, pose: &Pose, part: usize, at: Vec3) -> bool {
    let Shape::Mesh(mesh) = shape else { return false };
    mesh.surfaces().len() > 1
        && is_inside_other_shell(mesh.surfaces(), part, &pose.inverse_transform_point(&Point3::from(at)).coords)
}
