//! Rounded shapes: the contacts of their cores, which are farther apart by the radii.
//!
//! At the distance of the radii the cores need exact distances. The formulas of box on box and of
//! capsule on box prefer faces by a few percent of the distance, so such cores collide by surfaces
//! until they overlap.

use super::contacts_in_order;
use crate::shape::rounded::thickened;
use crate::{Contact, ContactMode, Pose, Shape};

/// Appends the contacts of two shapes of which at least one is rounded.
#[allow(clippy::too_many_arguments)]
pub(super) fn contacts_of_rounded(
    mode: ContactMode,
    (a, pose_a): (&Shape, &Pose),
    (b, pose_b): (&Shape, &Pose),
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let ((core_a, radius_a), (core_b, radius_b)) = (a.core(), b.core());
    let start = out.len();
    let formulas = [a, b].iter().any(|shape| matches!(shape, Shape::Sphere { .. } | Shape::HalfSpace));
    let find = |formulas: bool, out: &mut Vec<Contact>| {
        contacts_in_order(mode, (&core_a, pose_a), (&core_b, pose_b), margin + radius_a + radius_b, formulas, out);
    };
    find(formulas, out);
    if !formulas && out[start..].iter().any(|contact| contact.gap < 0.0) {
        out.truncate(start);
        find(true, out);
    }
    out[start..].iter_mut().for_each(|contact| *contact = thickened(*contact, radius_a, radius_b));
}
