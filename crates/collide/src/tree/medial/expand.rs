//! Expand and select: grows every candidate to an offset `e` beyond the surface, draws a greedy set
//! cover of the points from them, and finds the smallest `e` that needs at most `most` spheres by
//! bisection.
//!
//! Source: Bradshaw and O'Sullivan, *Adaptive medial-axis approximation for sphere-tree
//! construction* (2004), §5. A candidate grown to `e` contains `p` iff `need(c, p) ≤ e`, so all
//! needs are computed once.

use super::site::Site;
use crate::Vec3;

/// Number of bisection steps.
const HALVINGS: usize = 12;

/// Returns at most `most` of the candidates, with a small greatest need of the points.
pub(super) fn expand(candidates: &[Site], points: &[Vec3], most: usize) -> Vec<Site> {
    let needs: Vec<f64> = candidates.iter().flat_map(|s| points.iter().map(|p| s.need(p))).collect();
    let rows: Vec<&[f64]> = needs.chunks(points.len().max(1)).collect();
    // the candidate that alone covers all points with the smallest need
    let single = |row: &&[f64]| row.iter().copied().fold(0.0, f64::max);
    let Some(alone) = (0..rows.len()).min_by(|&a, &b| single(&rows[a]).total_cmp(&single(&rows[b]))) else {
        return Vec::new();
    };
    let mut chosen = vec![alone];
    let (mut low, mut high) = (0.0, single(&rows[alone]));
    for _ in 0..HALVINGS {
        let e = 0.5 * (low + high);
        match greedy(&rows, points.len(), e, most) {
            Some(found) => (chosen, high) = (found, e),
            None => low = e,
        }
    }
    chosen.into_iter().map(|k| candidates[k]).collect()
}

/// Returns rows that together have an entry of at most `e` in each column, most new columns first;
/// `None` if `most` rows do not suffice.
fn greedy(rows: &[&[f64]], columns: usize, e: f64, most: usize) -> Option<Vec<usize>> {
    let words = columns.div_ceil(64);
    let held: Vec<u64> = rows.iter().flat_map(|row| row.chunks(64).map(|c| bits(c, e))).collect();
    let mut left: Vec<u64> = (0..words).map(|w| u64::MAX >> (64 - (columns - 64 * w).min(64))).collect();
    let mut chosen = Vec::new();
    while left.iter().any(|w| *w != 0) {
        if chosen.len() == most {
            return None;
        }
        let gain = |row: &[u64]| row.iter().zip(&left).map(|(a, b)| (a & b).count_ones()).sum::<u32>();
        let (best, gained) = held
            .chunks(words)
            .map(gain)
            .enumerate()
            .fold((0, 0), |best, (k, gained)| if gained > best.1 { (k, gained) } else { best });
        if gained == 0 {
            return None;
        }
        chosen.push(best);
        left.iter_mut().zip(&held[best * words..]).for_each(|(l, h)| *l &= !h);
    }
    Some(chosen)
}

fn bits(needs: &[f64], e: f64) -> u64 {
    needs.iter().enumerate().fold(0, |word, (n, need)| word | u64::from(*need <= e) << n)
}
