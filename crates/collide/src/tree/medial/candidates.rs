//! Candidate centers: the largest spheres inside the solid that touch the surface at a cover point.
//!
//! Source: Ma, Bae and Choi, *3D medial axis point approximation using nearest neighbors and the
//! normal field* (2012), with the closest point of the mesh instead of the nearest sample. Given a
//! sphere that touches at `p` with inward normal `−n`, let `q` be the closest surface point of its
//! center. If `q` lies within the sphere, the next smaller sphere passes through `p` and `q`: `r ←
//! |p − q|² / 2 n·(p − q)`. The centers lie on the medial axis, next to the Voronoi centers of the
//! samples, and do not depend on the sample density.

use super::site::Site;
use super::types::CoverPoints;
use crate::tree::sphere::SEARCH_TRIANGLES;
use crate::{MeshDistance, Vec3};

/// Maximum number of shrinking steps; five are typical.
const STEPS: usize = 12;

/// Returns the largest inner sphere that touches at cover point `i`; `largest` is the initial
/// radius.
pub(super) fn touching(cover: &CoverPoints, i: u32, distance: &MeshDistance, largest: f64) -> Site {
    let (p, n) = (cover.points[i as usize], cover.normals[i as usize]);
    let mut radius = largest;
    let mut site = Site { center: p, depth: 0.0, parent_bound: None };
    for _ in 0..STEPS {
        let center: Vec3 = p - n * radius;
        let closest = distance.closest_approximate(&center, SEARCH_TRIANGLES);
        site = Site { center, depth: -closest.signed_distance, parent_bound: None };
        let reach = p - closest.point;
        let along = 2.0 * n.dot(&reach);
        if site.depth >= radius * (1.0 - 1e-3) || along <= 0.0 {
            break;
        }
        let next = reach.norm_squared() / along;
        if next >= radius * (1.0 - 1e-3) {
            break;
        }
        radius = next;
    }
    site
}
