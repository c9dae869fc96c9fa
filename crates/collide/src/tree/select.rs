//! Any number of spheres from a tree, and spheres made to cover a surface.
//!
//! **A cut** is a set of nodes of which every leaf has exactly one above it or in it. Spheres hold the spheres of their children, so every cut holds
//! what the leaves hold: the surface. From the root on, the sphere that reaches furthest outside is opened, as long as its children do not make too many.

use super::SphereTree;
use crate::{TriMesh, Vec3};

/// A piece of a triangle smaller than this part of the mesh's diagonal is not split further.
const MIN_PIECE: f64 = 1e-5;
/// Splits of a triangle.
const MAX_SPLITS: u32 = 40;

impl SphereTree {
    /// At most `most` spheres (1 at least) that hold the surface: indices of nodes, ascending. Spheres that reach at most `outward` meters outside are not
    /// opened.
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

/// Grows spheres (center and radius, meters) until they cover the surface of `mesh`, which need not be closed; at least one sphere. Each bare piece is
/// taken in by the sphere that grows least for it. Returns by how much the sphere that grew most did: 0 where all was covered, which makes this a
/// proof of coverage.
pub fn grow_to_cover(spheres: &mut [(Vec3, f64)], mesh: &TriMesh) -> f64 {
    let before: Vec<f64> = spheres.iter().map(|b| b.1).collect();
    let tiny = MIN_PIECE * mesh.diagonal();
    let mut last = 0;
    for t in 0..mesh.triangles.len() {
        cover(spheres, &mesh.corners(t), tiny, MAX_SPLITS, &mut last);
    }
    spheres.iter().zip(before).map(|(sphere, before)| sphere.1 - before).fold(0.0, f64::max)
}

/// A triangle lies in a sphere iff its corners do; else it is split 1:4. `last` is the sphere that held the last piece: mostly it holds the next.
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
