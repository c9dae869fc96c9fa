//! Minimization without derivatives.
//!
//! Source: Nelder and Mead, *A simplex method for function minimization* (1965).

use crate::Vec3;

/// Runs Nelder–Mead in three dimensions from a corner simplex of side `step`. The function `f`
/// records the best point.
pub(super) fn nelder_mead(start: Vec3, step: f64, evaluations: usize, mut f: impl FnMut(&Vec3) -> f64) {
    let mut at = [start; 4];
    for k in 0..3 {
        at[k + 1][k] += step;
    }
    let mut corners = at.map(|c| (f(&c), c));
    let mut used = 4;
    while used < evaluations {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let middle = (corners[0].1 + corners[1].1 + corners[2].1) / 3.0;
        let away = middle - corners[3].1;
        let mut tried = |t: f64| {
            let c = middle + away * t;
            (f(&c), c)
        };
        let reflected = tried(1.0);
        used += 1;
        let next = if reflected.0 < corners[0].0 {
            used += 1;
            let expanded = tried(2.0);
            if expanded.0 < reflected.0 { expanded } else { reflected }
        } else if reflected.0 < corners[2].0 {
            reflected
        } else {
            used += 1;
            if reflected.0 < corners[3].0 { tried(0.5) } else { tried(-0.5) }
        };
        if next.0 < corners[3].0 {
            corners[3] = next;
        } else {
            for n in 1..4 {
                let c = 0.5 * (corners[n].1 + corners[0].1);
                corners[n] = (f(&c), c);
            }
            used += 3;
        }
    }
}
