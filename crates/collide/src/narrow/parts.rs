//! Meshes whose shells overlap: the contacts of each pair of shells, without those at places that are buried in another shell.

use super::{parts_of, surface, with_body};
use crate::surface::parts::is_buried;
use crate::{Contact, Pose, Shape, Vec3};
use nalgebra::Point3;

/// All contacts of two shapes of which one has several parts.
pub(super) fn parts(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    let start = out.len();
    // the deepest overlap of what is buried: all that is left where nothing else overlaps
    let mut spare: Option<Contact> = None;
    for i in 0..parts_of(a) {
        for j in 0..parts_of(b) {
            let first = out.len();
            with_body(a, i, &mut |a| with_body(b, j, &mut |b| surface::surface(a, pose_a, b, pose_b, margin, out)));
            let name = (i << 16 | j) as u64;
            out[first..].iter_mut().for_each(|contact| contact.feature ^= name.wrapping_mul(SPREAD));
            let counts = |c: &Contact| {
                let half = 0.5 * c.gap * c.normal;
                !buried(a, pose_a, i, c.point + half) && !buried(b, pose_b, j, c.point - half)
            };
            let mut kept = first;
            for n in first..out.len() {
                let contact = out[n];
                if counts(&contact) {
                    out[kept] = contact;
                    kept += 1;
                } else if spare.is_none_or(|s| contact.gap < s.gap) {
                    spare = Some(contact);
                }
            }
            out.truncate(kept);
        }
    }
    if let Some(spare) = spare.filter(|s| s.gap < 0.0)
        && out[start..].iter().all(|c| c.gap >= 0.0)
    {
        out.push(spare);
    }
}

/// Spreads small numbers over all bits.
const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;

/// Whether a place on a shape's part, in world axes, lies inside another part.
fn buried(shape: &Shape, pose: &Pose, part: usize, at: Vec3) -> bool {
    let Shape::Mesh(mesh) = shape else { return false };
    mesh.surfaces().len() > 1
        && is_buried(mesh.surfaces(), part, &pose.inverse_transform_point(&Point3::from(at)).coords)
}
