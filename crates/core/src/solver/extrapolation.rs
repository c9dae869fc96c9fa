//! Nesterov's extrapolation of the iterate between sweeps.

use super::linkage::Linkages;
use super::local::{INLINE_BLOCKS, Local, apply, extrapolate_value};
use crate::constraint::rows::{Rows, Side};
use smallvec::SmallVec;

/// The extrapolation between sweeps, on the ranges of `du` that the island acts on. Multipliers are
/// extrapolated when their block is relaxed.
pub(super) struct Extrapolation {
    theta: f64,
    /// `β` of the next sweep.
    pub beta: f64,
    /// Start and end of each range of `du`, in ascending order; adjacent ranges are merged.
    stretches: SmallVec<[(u32, u32); 2 * INLINE_BLOCKS]>,
    /// `du` of the previous sweep, all ranges in a row.
    last: SmallVec<[f64; 32]>,
}

impl Extrapolation {
    pub fn new(locals: &[Local], linkages: &Linkages, rows: &Rows, du: &[f64]) -> Extrapolation {
        let mut stretches: SmallVec<[(u32, u32); 2 * INLINE_BLOCKS]> = linkages.stretches().collect();
        let mut before: &[Side] = &[];
        for local in locals {
            let sides = local.block(rows).sides();
            // contacts of a pair are consecutive: one of them is enough
            if !sides.iter().map(|s| s.u).eq(before.iter().map(|s| s.u)) {
                stretches.extend(sides.iter().map(|s| (s.u, s.u + s.dof)));
            }
            before = sides;
        }
        stretches.sort_unstable();
        stretches.dedup_by(|next, before| {
            let joins = next.0 <= before.1;
            if joins {
                before.1 = before.1.max(next.1);
            }
            joins
        });
        let last = stretches.iter().flat_map(|&(start, end)| &du[start as usize..end as usize]).copied().collect();
        Extrapolation { theta: 1.0, beta: 0.0, stretches, last }
    }

    pub fn extrapolate(&mut self, restart: bool, du: &mut [f64]) {
        let next = 0.5 * (1.0 + (1.0 + 4.0 * self.theta * self.theta).sqrt());
        self.beta = if restart { 0.0 } else { (self.theta - 1.0) / next };
        self.theta = if restart { 1.0 } else { next };
        let beta = self.beta;
        let mut rest = &mut self.last[..];
        for &(start, end) in &self.stretches {
            let (last, try_step) = rest.split_at_mut((end - start) as usize);
            du[start as usize..end as usize]
                .iter_mut()
                .zip(last)
                .for_each(|(du, last)| extrapolate_value(du, last, beta));
            rest = try_step;
        }
    }

    /// Computes `du` anew from the multipliers, which must not be extrapolated, and restarts.
    pub fn rebuild(
        &mut self,
        locals: &[Local],
        linkages: &Linkages,
        rows: &Rows,
        c: &[f64],
        lambda: &mut [f64],
        du: &mut [f64],
    ) {
        self.clear(du);
        apply(locals, linkages, rows, c, lambda, du);
        self.extrapolate(true, du);
    }

    /// Returns the square of `du` on all ranges of the island.
    pub fn square(&self, du: &[f64]) -> f64 {
        let ranges = self.stretches.iter().map(|&(start, end)| &du[start as usize..end as usize]);
        ranges.flatten().map(|u| u * u).sum()
    }

    /// Sets `du` to zero on all ranges of the island.
    pub fn clear(&self, du: &mut [f64]) {
        self.stretches.iter().for_each(|&(start, end)| du[start as usize..end as usize].fill(0.0));
    }
}
