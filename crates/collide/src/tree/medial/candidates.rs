//! Candidate centers: the spheres inside the solid that touch the surface at a cover point and are as large as can be.
//!
//! Source: Ma, Bae and Choi, *3D medial axis point approximation using nearest neighbors and the normal field*
//! (2012), with the mesh's own closest point in place of the nearest sample. From a sphere that touches at `p` with
//! inward normal `−n`, the closest surface point `q` of its center, if it lies within the sphere, gives the next
//! smaller one through `p` and `q`: `r ← |p − q|² / 2 n·(p − q)`. The centers lie on the medial axis, next to the
//! Voronoi centers that sampling gives, and none is missed for want of samples.

use super::site::Site;
use super::types::CoverPoints;
use crate::tree::sphere::SEARCH_TRIANGLES;
use crate::{MeshDistance, Vec3};

/// Bounds the shrinking; five steps are usual.
const STEPS: usize = 12;

/// The largest inner sphere that touches at cover point `i`; `largest` is the first radius tried.
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
