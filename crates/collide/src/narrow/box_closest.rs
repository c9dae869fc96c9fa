//! Exact closest points of two separated boxes whose closest features are not a face manifold.
//!
//! The closest pair then includes an edge or corner of B (a corner of A over a face of B belongs to
//! the face case). So the result is the smallest of the twelve exact distances from B's edges to A.

use super::box_pair::BoxPair;
use super::segment::segment_box;
use super::sphere::{clamp, region};
use crate::{Contact, NormalFrom, Vec3};

/// An edge further away than the nearest one by this factor is not compared, whatever the rounding.
const FURTHER: f64 = 1.0 + 1e-6;

/// Returns the contact in A's frame; `None` if the boxes touch or overlap.
pub(super) fn closest(f: &BoxPair) -> Option<Contact> {
    let mut best: Option<Contact> = None;
    for axis in 0..3 {
        for corner in 0..4_u64 {
            if best.is_some_and(|b| least_distance(f, axis, corner) > FURTHER * b.gap) {
                continue;
            }
            let contact = edge_to_box(f, axis, corner)?;
            if best.is_none_or(|b| contact.gap < b.gap - 1e-12 * f.a.max()) {
                best = Some(contact);
            }
        }
    }
    best
}

/// Returns the middle of B's edge along `axis`, and half of it, in A's frame; the bits of `corner` are its signs on the
/// other two axes.
fn edge_of_b(f: &BoxPair, axis: usize, corner: u64) -> (Vec3, Vec3) {
    let (k1, k2) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut middle = Vec3::zeros();
    middle[k1] = if corner & 1 == 1 { f.b[k1] } else { -f.b[k1] };
    middle[k2] = if corner & 2 == 2 { f.b[k2] } else { -f.b[k2] };
    (f.t + f.r * middle, f.r.column(axis) * f.b[axis])
}

/// Returns the distance of an edge's bounding box from A, a lower bound of the edge's distance.
fn least_distance(f: &BoxPair, axis: usize, corner: u64) -> f64 {
    let (c, u) = edge_of_b(f, axis, corner);
    (c.abs() - u.abs() - f.a).map(|d| d.max(0.0)).norm()
}

/// Returns the contact of B's edge along `axis`; the bits of `corner` are its signs on the other
/// two axes.
fn edge_to_box(f: &BoxPair, axis: usize, corner: u64) -> Option<Contact> {
    let (k1, k2) = ((axis + 1) % 3, (axis + 2) % 3);
    let (c, u) = edge_of_b(f, axis, corner);
    let s = segment_box(&c, &u, &f.a);
    let p = c + u * s;
    let q = clamp(&p, &f.a);
    let offset = q - p;
    let gap = offset.norm();
    if gap < 1e-12 * f.a.max() {
        return None;
    }
    let clamped = offset.iter().filter(|d| **d != 0.0).count();
    let normal_from = match clamped {
        1 => NormalFrom::FaceOfA,
        2 if s.abs() < 1.0 => NormalFrom::Edges,
        _ => NormalFrom::CorePoints,
    };
    let feature = (2 << 20) | region(&p, &f.a) << 8 | feature_of_b(axis, k1, k2, corner, s);
    Some(Contact {
        point: 0.5 * (p + q),
        normal: offset / gap,
        gap,
        feature,
        core_a: 0.0,
        core_b: 0.0,
        normal_from,
        shapes: [0; 2],
    })
}

/// Returns the feature: within an edge its axis and corner, at an end the signs of the vertex,
/// independent of the edge.
fn feature_of_b(axis: usize, k1: usize, k2: usize, corner: u64, s: f64) -> u64 {
    if s.abs() < 1.0 {
        return 16 + 4 * axis as u64 + corner;
    }
    (u64::from(s > 0.0) << axis) | ((corner & 1) << k1) | ((corner >> 1 & 1) << k2)
}
