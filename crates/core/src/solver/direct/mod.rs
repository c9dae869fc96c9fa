//! Direct solution of a whole island: sparse factorizations over the graph of its objects.
//!
//! Sweeps carry load from one body to the next, so a tower of a hundred boxes needs tens of thousands
//! of them. Here all rows of an island are solved at once, and the number of factorizations does not
//! grow with the island:
//!
//! 0. a small island first by Newton's method on the function of Alart and Curnier (`newton.rs`), in the midst
//!    of its sweeps, alternating with the method of multipliers (`multipliers.rs`);
//! 1. from multipliers that are near, a few steps of semismooth Newton with a proximal term (`proximal.rs`);
//! 2. else the interior point method from the beginning (`interior_point.rs`);
//! 3. and semismooth Newton for the digits that it leaves;
//! 4. if that is not enough, the method of multipliers with a lagged shift (`lagged.rs`);
//! 5. then, of an island at rest, the interior point method without the shift, and the last digits again.
//!
//! A small island that is still not solved is solved from friction pyramids (`pyramids.rs`).
//!
//! All of them factor matrices `1 + Σ Y·G·Yᵀ` with a 3×3 matrix `G` per contact (`lu.rs`), with one block
//! row per object (`structure.rs`): linear cost in a chain or a tower, more where contacts form
//! loops. Islands whose factorization costs more than [`MAX_WORK`] or [`MAX_COST`] are left to the
//! sweeps, and so are islands of more than [`SMALL`] degrees of freedom in motion.

mod choice;
mod cone;
mod dense;
mod interior_point;
mod island;
mod lagged;
mod lu;
mod multipliers;
mod newton;
mod proximal;
mod sliding;
mod structure;

use crate::constraint::rows::{RowSet, Rows};
use island::{Island, fastest_row};
use lu::Factor;
pub(super) use newton::{SmallIsland, is_wide};
use structure::Structure;

/// Maximum number of multiplications of one factorization, and if nothing slides: a wall at rest is
/// solved once, and later steps start from its multipliers.
const MAX_WORK: (f64, f64) = (5e7, 3e9);
/// Maximum cost of a factorization in sweeps, and if nothing slides. In heaps, where contacts form
/// loops in all directions, sweeps are the better use of the time.
const MAX_COST: (f64, f64) = (150.0, 1000.0);
/// A factorization of a lower cost, in sweeps, is cheap. Others must gain much.
const CHEAP: f64 = 15.0;
/// Maximum number of blocks of a solve that need not be exact, and of an island in motion: more belong
/// to more than [`SMALL`] degrees of freedom, as a rule.
const MANY: (usize, usize) = (500, 250);
/// A large island is at rest if fewer contacts than this share slide. A contact slides if its
/// tangential speed is above this fraction of the fastest row.
const SLIDING: (f64, f64) = (0.02, 0.002);
/// Error, relative to the fastest row, below which multipliers are near: at rest, and in motion.
const NEAR: (f64, f64) = (1e-2, 1e-5);
/// Maximum number of factorizations from multipliers that are near, and of the last phase for a
/// small and a large island.
const FACTORS: (u32, u32, u32) = (8, 30, 8);
/// Maximum number of factorizations with a lagged shift, for a small and a large island.
const LAGGED: (u32, u32) = (150, 20);
/// Error, relative to the fastest row, of an island in motion of more than this number of degrees of freedom below which little
/// is left to gain.
const NEARLY: (f64, usize) = (1e-7, 36);
/// Maximum number of factorizations with a lagged shift of such an island.
const LAST_DIGITS: u32 = 110;
/// Degrees of freedom of a small island, on which no effort is spared.
const SMALL: usize = 120;
/// Error, relative to the fastest row, that ends the interior point method of a large island early.
const ENOUGH: f64 = 1e-5;

/// The errors to reach, m/s.
#[derive(Clone, Copy)]
struct Tolerance {
    /// Below this nothing is left to do.
    goal: f64,
    /// Below this, ten times the tolerance of a sweep, the island is solved, and only steps that
    /// gain a digit are worth their cost.
    solved: f64,
}

/// Matrix and rows of an island.
struct System<'a> {
    island: Island<'a>,
    structure: Structure,
    factor: Factor,
}

/// Result of a direct solve.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct Direct {
    pub factorizations: u32,
    /// Whether the error is within ten times the tolerance.
    pub converged: bool,
}

/// A direct solve of an island that is not too large for it.
pub(super) struct Plan<'a> {
    system: System<'a>,
    /// Share of the contacts that slide.
    sliding: f64,
}

impl<'a> Plan<'a> {
    /// Returns `None` if a factorization of the island is too expensive: for a solve that need not be
    /// exact (`coarse`), for a large island that is not at rest, or at all.
    pub fn new(rows: &'a Rows, blocks: &[u32], c: &[f64], coarse: bool) -> Option<Plan<'a>> {
        let sliding = sliding(rows, blocks, c);
        let at_rest = sliding <= SLIDING.0;
        if coarse && blocks.len() > MANY.0 || !at_rest && blocks.len() > MANY.1 {
            return None;
        }
        let island = Island::new(rows, blocks, c);
        if island.dof > SMALL && !at_rest {
            return None;
        }
        let (max_work, max_cost) = match sliding {
            _ if coarse => (MAX_WORK.0, CHEAP),
            0.0 => (MAX_WORK.1, MAX_COST.1),
            _ => (MAX_WORK.0, MAX_COST.0),
        };
        let dof: Vec<usize> = island.objects.iter().map(|o| o.dof).collect();
        let (assembly, sweep) = work_of_blocks(&island);
        let structure = Structure::new(&dof, &island.couplings(), max_work.min(max_cost * sweep - assembly))?;
        let factor = Factor::new(&structure);
        Some(Plan { system: System { island, structure, factor }, sliding })
    }

    /// Returns the cost of a factorization in sweeps.
    pub fn cost(&self) -> f64 {
        let (assembly, sweep) = work_of_blocks(&self.system.island);
        (self.system.structure.work + assembly) / sweep
    }

    /// Solves from the multipliers in `lambda`, which it replaces if it finds better ones, by at most
    /// `most` factorizations.
    pub fn solve(mut self, lambda: &mut [f64], tolerance: f64, most: u32) -> Direct {
        let fastest = self.system.island.fastest;
        let at_rest = self.sliding <= SLIDING.0;
        let cheap = self.system.island.dof <= SMALL || self.cost() < CHEAP;
        let near = if at_rest { NEAR.0 } else { NEAR.1 };
        let tolerance = self.system.island.tolerance(tolerance);
        let system = &mut self.system;
        let small = system.island.dof <= SMALL;
        let (enough, last) = if small { (0.0, FACTORS.1) } else { (ENOUGH * fastest, FACTORS.2) };
        let mut own = system.island.read(lambda);
        let start = system.island.error_of(&own);
        if start <= tolerance.solved && !cheap {
            return Direct { factorizations: 0, converged: true };
        }
        let (mut error, mut taken) = (start, 0);
        if error > tolerance.goal && error.is_finite() && (at_rest && cheap || error <= near * fastest) {
            (error, taken) = proximal::solve(system, &mut own, error, tolerance, (FACTORS.0.min(most), cheap));
        }
        if error.is_nan() || error > tolerance.solved {
            let mut interior = own.clone();
            let tolerances = (tolerance.solved, enough);
            let (reached, factors) = interior_point::solve(system, &mut interior, tolerances, cheap, most - taken);
            taken += factors;
            if reached < error || error.is_nan() {
                (error, own) = (reached, interior);
            }
        }
        if error > tolerance.goal && error.is_finite() && (cheap || error <= NEAR.0 * fastest) {
            let (reached, factors) =
                proximal::solve(system, &mut own, error, tolerance, (last.min(most - taken), cheap));
            (error, taken) = (reached, taken + factors);
        }
        let nearly = !at_rest && system.island.dof > NEARLY.1 && error <= NEARLY.0 * fastest;
        if error > tolerance.solved && error.is_finite() && cheap {
            let limit = if small { LAGGED.0 } else { LAGGED.1 };
            let limit = if nearly { limit.min(LAST_DIGITS) } else { limit };
            let (reached, factors) = lagged::solve(system, &mut own, error, tolerance, limit.min(most - taken));
            (error, taken) = (reached, taken + factors);
        }
        if error > tolerance.solved && (self.sliding == 0.0 || at_rest && cheap && !small) {
            let mut convex = own.clone();
            let (reached, factors) = interior_point::solve_convex(system, &mut convex, tolerance.solved, most - taken);
            taken += factors;
            let left = FACTORS.2.min(most - taken);
            let (reached, factors) = proximal::solve(system, &mut convex, reached, tolerance, (left, cheap));
            taken += factors;
            if reached < error || error.is_nan() {
                (error, own) = (reached, convex);
            }
        }
        if error < start || start.is_nan() {
            system.island.write(&own, lambda);
        }
        Direct { factorizations: taken, converged: error <= tolerance.solved }
    }
}

/// Returns the share of contacts with friction that slide before the solve: their tangential speed in
/// `c` is above a fraction of the fastest row.
fn sliding(rows: &Rows, blocks: &[u32], c: &[f64]) -> f64 {
    let island = || blocks.iter().map(|&b| &rows.blocks[b as usize]);
    let fastest = island().map(|b| fastest_row(b, c)).fold(0.0, f64::max);
    let square = (SLIDING.1 * fastest) * (SLIDING.1 * fastest);
    let cones = || island().filter(|b| matches!(b.set, RowSet::Cone { .. })).map(|b| &c[b.range()]);
    let slides = |c: &&[f64]| c[1] * c[1] + c[2] * c[2] > square;
    cones().filter(slides).count() as f64 / cones().count().max(1) as f64
}

/// Returns the multiplications that the blocks take in the assembly of a factorization, and in a
/// sweep.
fn work_of_blocks(island: &Island) -> (f64, f64) {
    let (mut assembly, mut sweep) = (0.0, 1.0);
    for block in &island.blocks {
        let dof: usize = block.sides().iter().map(|s| s.dof).sum();
        assembly += (block.rows * dof * dof) as f64;
        sweep += (2 * block.rows * dof) as f64;
    }
    (assembly, sweep)
}
