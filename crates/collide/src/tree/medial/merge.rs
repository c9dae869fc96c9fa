//! Merge: repeatedly merges the two spheres whose common sphere has the smallest need.
//!
//! Source: Bradshaw and O'Sullivan, *Adaptive medial-axis approximation for sphere-tree
//! construction* (2004), §5. The center of a merged pair is the candidate with the smallest need of
//! the points of both; the paper tries the two old centers and the sphere around both. With `N(c,
//! A)` the need of a part `A` at candidate `c`,
//!
//! ```text
//! N(c, A ∪ B) = max(N(c, A), N(c, B))    cost(A, B) = min over c of N(c, A ∪ B)
//! ```
//!
//! so merging works on a table of needs.

use super::refit::Fit;
use super::site::Site;
use crate::Vec3;

/// Merges the parts of `fit` until at most `most` are left. Returns their candidates.
pub(super) fn merge(candidates: &[Site], points: &[Vec3], fit: &Fit, most: usize) -> Vec<Site> {
    let need = |c: &Site, part: &Vec<u32>| part.iter().map(|&i| c.need(&points[i as usize])).fold(0.0, f64::max);
    // per part, its need at each candidate
    let mut needs: Vec<Vec<f64>> =
        fit.parts.iter().map(|part| candidates.iter().map(|c| need(c, part)).collect()).collect();
    let mut costs: Vec<Vec<f64>> =
        (0..needs.len()).map(|a| (0..a).map(|b| joint(&needs[a], &needs[b])).collect()).collect();
    while needs.len() > most.max(1) {
        let pairs = (1..needs.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let Some((a, b)) = pairs.min_by(|p, q| costs[p.0][p.1].total_cmp(&costs[q.0][q.1])) else { break };
        // b absorbs a, the last part takes the place of a
        let gone = needs.swap_remove(a);
        needs[b].iter_mut().zip(gone).for_each(|(n, other)| *n = n.max(other));
        let last = needs.len();
        for k in (0..a).chain(a + 1..last) {
            let moved = costs[last][k];
            if k < a { costs[a][k] = moved } else { costs[k][a] = moved }
        }
        costs.pop();
        for k in (0..last).filter(|k| *k != b) {
            costs[k.max(b)][k.min(b)] = joint(&needs[k], &needs[b]);
        }
    }
    let least = |row: &Vec<f64>| (0..row.len()).min_by(|&a, &b| row[a].total_cmp(&row[b]));
    needs.iter().filter_map(least).map(|c| candidates[c]).collect()
}

/// Returns the smallest need of two parts together.
fn joint(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x.max(*y)).fold(f64::INFINITY, f64::min)
}
