//! Newton's method from solutions on friction pyramids: for small islands in which all other methods choose wrongly which
//! contacts open, stick and slide.
//!
//! ```text
//! repeat   d₁ = −w_t/|w_t| of a contact that slides, λ_t/|λ_t| of one that sticks
//!          λ ← solution on the pyramids with the edges ±d₁, ±d₂      Lemke's method (`lcp.rs`), of the rows that are near
//!          λ ← Newton's method on the cones, from λ                   (`direct/newton.rs`), of all rows
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `d₁`, `d₂` | tangents of a contact, `d₂ ⟂ d₁` |
//! | `λ_t`, `w_t` | friction and sliding velocity |
//!
//! Contacts that are far from closing are left out of pivoting, which costs the cube of the number of rows. Newton's method
//! and the next round have them again.
//!
//! Pivoting needs no start and does not go in circles. A pyramid touches the cone along its edges, so a solution of
//! Coulomb's law is one on pyramids whose edges have its directions of friction, and the directions follow from the
//! solution before. Newton's method ends the search as soon as the choices are right.

use super::direct::{Direct, SmallIsland};
use super::lcp::on_pyramids;
use crate::constraint::rows::Rows;

/// Maximum number of pyramids, and of steps of Newton's method from each.
const ROUNDS: u32 = 4;
const STEPS: u32 = 20;
/// Maximum number of unknowns on the pyramids: with more, pivoting costs more than what was tried before.
const MAX_UNKNOWNS: usize = 256;
/// A contact is far if it opens by more than this fraction of the fastest row.
const FAR: f64 = 0.01;

/// Solves an island, and replaces the multipliers in `lambda` if it finds better ones.
pub(super) fn solve(
    (rows, blocks, c): (&Rows, &[u32], &[f64]),
    island: &mut SmallIsland,
    lambda: &mut [f64],
    tolerance: f64,
) -> Direct {
    let mut result = Direct { factorizations: 0, converged: false };
    let mut own = island.read(lambda);
    for _ in 0..ROUNDS {
        let near = island.near(&own, FAR);
        let directions = island.directions(&own);
        let of_near: Vec<u32> = near.iter().map(|(block, _)| blocks[*block]).collect();
        let along = near.iter().flat_map(|(_, rows)| directions[rows.clone()].iter().copied()).collect();
        let Some(found) = on_pyramids(rows, &of_near, c, along, MAX_UNKNOWNS) else { break };
        own.fill(0.0);
        near.iter().flat_map(|(_, rows)| rows.clone()).zip(found).for_each(|(row, force)| own[row] = force);
        let solved = island.solve_from(&own, STEPS, lambda, tolerance);
        result.factorizations += solved.factorizations;
        if solved.converged {
            result.converged = true;
            break;
        }
    }
    result
}
