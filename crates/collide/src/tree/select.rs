//! Selection of a given number of spheres from a tree.
//!
//! **A cut** is a set of nodes such that every leaf has exactly one node of the set above it or is
//! in the set. Spheres contain the spheres of their children, so every cut contains what the leaves
//! contain: the surface. Starting at the root, the sphere that extends furthest outside is replaced
//! by its children as long as the limit allows.

use super::SphereTree;
use crate::{TriMesh, Vec3};

/// Smallest piece of a triangle that is split further, as a fraction of the mesh's diagonal.
const MIN_PIECE: f64 = 1e-5;
/// Maximum number of splits of a triangle.
const MAX_SPLITS: u32 = 40;

impl SphereTree {
    /// Returns at most `most` spheres (at least 1) that contain the surface, as ascending node
    /// indices. Spheres that extend at most `outward` meters outside are not replaced by their
    /// children.
    pub fn select(&self, most: usize, outward: f64) -> Vec<usize> {
        let mut selected = vec![0];
        loop {
            let room = most.saturating_sub(selected.len()) + 1;
            let opens = |n: &usize| {
                let node = &self.nodes()[*n];
                !node.is_leaf() && node.outward > outward && node.children as usize <= room
            };
            let worst = (0..selected.len()).filter(|k| opens(&selected[*k])).max_by(|a, b| {
                let reach = |k: &usize| self.nodes()[selected[*k]].outward;
                reach(a).total_cmp(&reach(b)).then(b.cmp(a))
            });
            let Some(worst) = worst else { break };
            let node = selected.swap_remove(worst);
            selected.extend(self.nodes()[node].child_range());
        }
        selected.sort_unstable();
        selected
    }
}

/// Grows spheres (center and radius, meters) until they cover the surface of `mesh`, which need not
/// be closed. Needs at least one sphere. Each uncovered piece is assigned to the sphere that grows
/// least for it. Returns the largest growth: 0 if the spheres covered the surface before, which
/// proves coverage.
pub fn grow_to_cover(spheres: &mut [(Vec3, f64)], mesh: &TriMesh) -> f64 {
    let before: Vec<f64> = spheres.iter().map(|b| b.1).collect();
    let tiny = MIN_PIECE * mesh.diagonal();
    let mut last = 0;
    for t in 0..mesh.triangles.len() {
        cover(spheres, &mesh.corners(t), tiny, MAX_SPLITS, &mut last);
    }
    spheres.iter().zip(before).map(|(sphere, before)| sphere.1 - before).fold(0.0, f64::max)
}

/// Covers a piece: it lies in a sphere iff its corners do; otherwise it is split 1:4. `last` is the
/// sphere that contained the last piece and usually contains the next.
fn cover(spheres: &mut [(Vec3, f64)], piece: &[Vec3; 3], tiny: f64, splits: u32, last: &mut usize) {
    let reach = |(center, _): &(Vec3, f64)| piece.iter().map(|p| (p - center).norm()).fold(0.0, f64::max);
    let holds = |sphere: &(Vec3, f64)| reach(sphere) <= sphere.1;
    if spheres.get(*last).is_some_and(holds) {
        return;
    }
    if let Some(n) = spheres.iter().position(holds) {
        *last = n;
        return;
    }
    let [a, b, c] = *piece;
    let size = (a - b).norm().max((b - c).norm()).max((c - a).norm());
    if size < tiny || splits == 0 {
        let growth = |sphere: &(Vec3, f64)| reach(sphere) - sphere.1;
        if let Some(n) = (0..spheres.len()).min_by(|m, n| growth(&spheres[*m]).total_cmp(&growth(&spheres[*n]))) {
            spheres[n].1 = reach(&spheres[n]);
            *last = n;
        }
        return;
    }
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        .iter()
        .for_each(|t| cover(spheres, t, tiny, splits - 1, last));
}
