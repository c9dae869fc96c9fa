//! Triangulation of polygonal faces.
//!
//! A face becomes a fan around its first corner if the fan is simple: every triangle has the
//! orientation of the face, and their angles at that corner sum to less than a full turn. All other
//! (concave) faces are ear-clipped ([`super::ear_clipping`]), because a fan would overlap itself
//! and cover the notches.

use super::ear_clipping::clip_ears;
use crate::{MeshError, Vec3};
use nalgebra::RealField;
use std::f64::consts::PI;

/// Maximum number of corners of a concave face.
const MAX_CORNERS: usize = 5000;
/// Maximum number of point comparisons over all faces of a mesh; limits the time for hostile files.
const MAX_WORK: u64 = 2_000_000_000;

/// Triangulates the faces of one mesh.
#[derive(Clone, Debug)]
pub struct PolygonTriangulator {
    /// Remaining comparisons.
    work: u64,
}

impl Default for PolygonTriangulator {
    fn default() -> PolygonTriangulator {
        PolygonTriangulator { work: MAX_WORK }
    }
}

impl PolygonTriangulator {
    /// Returns triangles of indices into `corners`, in the orientation of the face: two fewer than
    /// corners, none for fewer than three corners. Corners need not be coplanar. A face that
    /// crosses itself is triangulated in some way.
    ///
    /// # Errors
    /// [`MeshError::Concave`] if one concave face, or all together, have too many corners.
    pub fn triangulate(&mut self, corners: &[Vec3]) -> Result<Vec<[usize; 3]>, MeshError> {
        let count = corners.len();
        let fan = || (2..count).map(|k| [0, k - 1, k]).collect();
        if count <= 3 || is_simple_fan(corners) {
            return Ok(fan());
        }
        if count > MAX_CORNERS {
            return Err(MeshError::Concave { corners: count, most: MAX_CORNERS });
        }
        let cut = clip_ears(corners, count, &mut self.work);
        if self.work == 0 {
            return Err(MeshError::Concave { corners: count, most: MAX_CORNERS });
        }
        Ok(cut)
    }
}

fn is_simple_fan(corners: &[Vec3]) -> bool {
    let spokes: Vec<Vec3> = corners[1..].iter().map(|p| p - corners[0]).collect();
    let area: Vec3 = spokes.windows(2).map(|w| w[0].cross(&w[1])).sum();
    let Some(normal) = area.try_normalize(0.0) else { return true };
    let mut angle = 0.0;
    for pair in spokes.windows(2) {
        let turn = pair[0].cross(&pair[1]).dot(&normal);
        if turn < -1e-12 * area.norm() {
            return false;
        }
        angle += RealField::atan2(turn.max(0.0), pair[0].dot(&pair[1]));
    }
    angle < 2.0 * PI - 1e-9
}
