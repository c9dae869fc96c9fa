//! Any number of balls from a tree, and balls made to cover a surface.
//!
//! **A cut** is a set of nodes of which every leaf has exactly one above it or in it. Balls hold the balls of their children, so every cut holds
//! what the leaves hold: the surface. From the root on, the ball that reaches furthest outside is opened, as long as its children do not make too many.

use super::SphereTree;
use crate::{TriMesh, Vec3};

/// A piece of a triangle smaller than this part of the mesh's diagonal is not split further.
const TINY: f64 = 1e-5;
/// Splits of a triangle.
const MOST_SPLITS: u32 = 40;

impl SphereTree {
    /// At most `most` balls (1 at least) that hold the surface: indices of nodes, ascending. Balls that reach at most `outward` metres outside are not
    /// opened.
    pub fn cut(&self, most: usize, outward: f64) -> Vec<usize> {
        let mut cut = vec![0];
        loop {
            let room = most.saturating_sub(cut.len()) + 1;
            let opens = |n: &usize| {
                let node = &self.nodes()[*n];
                !node.is_leaf() && node.outward > outward && node.children as usize <= room
            };
            let worst = (0..cut.len()).filter(|k| opens(&cut[*k])).max_by(|a, b| {
                let reach = |k: &usize| self.nodes()[cut[*k]].outward;
                reach(a).total_cmp(&reach(b)).then(b.cmp(a))
            });
            let Some(worst) = worst else { break };
            let node = cut.swap_remove(worst);
            cut.extend(self.nodes()[node].child_range());
        }
        cut.sort_unstable();
        cut
    }
}

/// Grows balls (centre and radius, metres) until they cover the surface of `mesh`, which need not be closed; at least one ball. Each bare piece is
/// taken in by the ball that grows least for it. Returns by how much the ball that grew most did: 0 where all was covered, which makes this a
/// proof of coverage.
pub fn grow_to_cover(balls: &mut [(Vec3, f64)], mesh: &TriMesh) -> f64 {
    let before: Vec<f64> = balls.iter().map(|b| b.1).collect();
    let tiny = TINY * mesh.diagonal();
    let mut last = 0;
    for t in 0..mesh.triangles.len() {
        cover(balls, &mesh.corners(t), tiny, MOST_SPLITS, &mut last);
    }
    balls.iter().zip(before).map(|(ball, before)| ball.1 - before).fold(0.0, f64::max)
}

/// A triangle lies in a ball iff its corners do; else it is split 1:4. `last` is the ball that held the last piece: mostly it holds the next.
fn cover(balls: &mut [(Vec3, f64)], piece: &[Vec3; 3], tiny: f64, splits: u32, last: &mut usize) {
    let reach = |(center, _): &(Vec3, f64)| piece.iter().map(|p| (p - center).norm()).fold(0.0, f64::max);
    let holds = |ball: &(Vec3, f64)| reach(ball) <= ball.1;
    if balls.get(*last).is_some_and(holds) {
        return;
    }
    if let Some(n) = balls.iter().position(holds) {
        *last = n;
        return;
    }
    let [a, b, c] = *piece;
    let size = (a - b).norm().max((b - c).norm()).max((c - a).norm());
    if size < tiny || splits == 0 {
        let growth = |ball: &(Vec3, f64)| reach(ball) - ball.1;
        if let Some(n) = (0..balls.len()).min_by(|m, n| growth(&balls[*m]).total_cmp(&growth(&balls[*n]))) {
            balls[n].1 = reach(&balls[n]);
            *last = n;
        }
        return;
    }
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].iter().for_each(|t| cover(balls, t, tiny, splits - 1, last));
}
