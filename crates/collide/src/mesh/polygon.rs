//! Faces of more than three corners, cut into triangles.
//!
//! A face becomes a fan around its first corner where that covers it once: each triangle turns as the face does, and together they go less than once round
//! that corner. All others, the concave ones, are clipped ear by ear ([`super::ear_clipping`]): a fan would lie on itself, and reach over the notches.

use super::ear_clipping::clip_ears;
use crate::{MeshError, Vec3};
use nalgebra::RealField;
use std::f64::consts::PI;

/// Corners of a concave face, at most.
const MAX_CORNERS: usize = 5000;
/// Comparisons of points with ears, over all faces of a mesh: a hostile file is kept from taking long.
const MAX_WORK: u64 = 2_000_000_000;

/// Cuts the faces of one mesh.
#[derive(Clone, Debug)]
pub struct PolygonTriangulator {
    /// Comparisons that are left.
    work: u64,
}

impl Default for PolygonTriangulator {
    fn default() -> PolygonTriangulator {
        PolygonTriangulator { work: MAX_WORK }
    }
}

impl PolygonTriangulator {
    /// Triangles of indices into `corners`, which go round as the corners do: two fewer than those, none for fewer than three. Corners need not lie in one plane; a face that
    /// crosses itself is cut somehow.
    ///
    /// # Errors
    /// [`MeshError::Concave`]: concave faces with too many corners, one or all together.
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
