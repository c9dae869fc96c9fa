//! Method of multipliers with a lagged shift: for islands on which Newton's method on the whole of
//! Coulomb's law goes in circles.
//!
//! With De Saxcé's shift `s` held, the problem of the cones is convex, and semismooth Newton with a line
//! search solves it from any start. The shift follows the solution:
//!
//! ```text
//! u:  u = Y·Π(λ − ρ·(c + Yᵀu + s))        λ ← Π(…)        s ← μ·|w_t(λ)|·n
//! ```
//!
//! The outer iteration is Cadoux's (Acary and Brogliato, ch. 13). Its error falls by a third or so in each
//! pass, where it falls, and it may go round too. Every other pass is therefore followed by a few steps of
//! semismooth Newton with the shift in motion (`proximal.rs`), which finishes as soon as the choice of open,
//! sticking and sliding contacts is right. Either alone solves fewer islands.

use super::proximal::{self, Proximal};
use super::{System, Tolerance};

/// Maximum number of passes.
const PASSES: u32 = 60;
/// Number of passes between two attempts to finish by Newton's method, and factorizations of one.
const FINISH: (u32, u32) = (2, 20);
/// The inner iteration ends at this fraction of the last error, but not below this many goals.
const INNER: (f64, f64) = (0.02, 0.1);
/// A pass that leaves more than this fraction of the error raises the penalty.
const SLOW: f64 = 0.1;

/// Improves `lambda`, whose error is `error`, with at most `factors` factorizations. Returns the error
/// of the best multipliers found, which it leaves in `lambda`, and the number of factorizations.
pub(super) fn solve(
    system: &mut System,
    lambda: &mut [f64],
    mut error: f64,
    tolerance: Tolerance,
    factors: u32,
) -> (f64, u32) {
    let mut p = Proximal::new(system, lambda);
    let (mut taken, mut last) = (0, error);
    for pass in 1..=PASSES {
        if error <= tolerance.solved || taken >= factors {
            break;
        }
        p.hold_shift();
        taken += p.inner((INNER.0 * last).max(INNER.1 * tolerance.goal), factors - taken, true);
        let reached = p.accept();
        if reached.is_nan() {
            break;
        }
        if reached < error {
            error = reached;
            lambda.copy_from_slice(&p.center);
        }
        if reached > SLOW * last {
            p.raise_penalty();
        }
        last = reached;
        if pass % FINISH.0 == 0 && error > tolerance.solved {
            let most = FINISH.1.min(factors - taken);
            let (finished, steps) = proximal::solve(p.system, lambda, error, tolerance, (most, true));
            taken += steps;
            if finished < last {
                (error, last) = (finished, finished);
                p.restart(lambda);
            }
        }
    }
    (error, taken)
}
