//! Interior point method with a held shift: for structures that stand by friction.
//!
//! ```text
//! s_0 = 0;   u_k, λ_k:  w = c + Yᵀu,  u = Yλ,  cone ∋ λ ⟂ w + s_k·n ∈ dual cone;   s_{k+1} = μ·|w_t(u_k)|
//! ```
//!
//! With De Saxcé's shift `s` held the problem is convex, and the interior point method solves it from any start. If nothing
//! slides in the solution, as in a house of cards, its shift is 0, so the first pass has solved Coulomb's law too: a solution
//! without sliding is a solution of the convex problem with `s = 0`, and that has only one `u`. Else the shift follows, as in
//! Cadoux's iteration (Acary and Brogliato, ch. 13). Semismooth Newton finishes each pass (`proximal.rs`). Of islands in
//! motion it solves few: from `s = 0` the shift gets near only by half in each pass.

use super::cone::length;
use super::island::{Island, Kind};
use super::{FACTORS, System, Tolerance, interior_point, proximal};

/// Maximum number of passes where factorizations are cheap; else there is one.
const PASSES: u32 = 3;

/// Improves `lambda`, whose error is `error`, with at most `factors` factorizations. Returns the error of the best
/// multipliers found, which it leaves in `lambda`, and the number of factorizations.
pub(super) fn solve(
    system: &mut System,
    lambda: &mut [f64],
    mut error: f64,
    tolerance: Tolerance,
    (factors, cheap): (u32, bool),
) -> (f64, u32) {
    let (mut taken, mut shift) = (0, vec![0.0; system.island.blocks.len()]);
    let mut own = lambda.to_vec();
    for _ in 0..if cheap { PASSES } else { 1 } {
        let (reached, steps) =
            interior_point::solve_convex(system, &mut own, &shift, tolerance.solved, factors - taken);
        taken += steps;
        let most = FACTORS.2.min(factors - taken);
        let (reached, steps) = proximal::solve(system, &mut own, reached, tolerance, (most, cheap));
        taken += steps;
        if reached < error || error.is_nan() {
            error = reached;
            lambda.copy_from_slice(&own);
        }
        if error <= tolerance.solved || taken >= factors || reached.is_nan() {
            break;
        }
        follow(&system.island, &own, &mut shift);
    }
    (error, taken)
}

/// Writes the sliding speeds that multipliers give.
fn follow(island: &Island, lambda: &[f64], shift: &mut [f64]) {
    let mut u = Vec::new();
    island.apply(lambda, &mut u);
    for (shift, b) in shift.iter_mut().zip(&island.blocks).filter(|(_, b)| matches!(b.kind, Kind::Cone { .. })) {
        let w = island.row_velocity(b, &u, lambda);
        *shift = length(w[1], w[2]);
    }
}
