//! Contacts that hold a body after an impact in the same step.
//!
//! The solve of a step has one impulse for what stops a body at the time `s` of an impact and for what holds
//! it in the rest of the step. The first acts at that time. The second is a force: it acts in the mean of the rest, and moves the
//! body half as far. If both acted at the time of the impact, a body that lands would rise by up to `½g·h²`.
//!
//! ```text
//! stopped     w = c − (1 − s)·Yᵀh·a + K·λ_s ≥ 0 ⟂ λ_s ≥ 0,  friction         without the forces of the rest of the step
//! sustained   λ − λ_s                                                      x₁ −= ½(1 − s)·h·Y(λ − λ_s)
//! ```

use super::{Buffers, TimeStepping};
use crate::constraint::rows::Block;
use crate::solver::SolverSettings;
use crate::step::contacts::{solve, zero};
use crate::world::Core;

/// Largest residual of a frame, m/s, with which the difference of two solves means something.
const MEANINGFUL: f64 = 1e-6;

impl TimeStepping {
    /// Writes the change of whitened velocity by what holds bodies after an impact to `buffers.sustained`, after the
    /// solve of the step. `du_force` is the change by forces. A step with a budget has one solve, and a frame in which a
    /// solve ended far from its solution takes no further one, whose difference would mean little: then all is zero.
    pub(super) fn find_sustained(&mut self, core: &mut Core, settings: SolverSettings, du_force: &[f64]) {
        let (work, fraction) = (&mut self.work, &self.impact_fraction);
        let Buffers { keep, sustained, .. } = &mut self.buffers;
        zero(sustained, du_force.len());
        let struck: Vec<bool> = work
            .rows
            .blocks
            .iter()
            .zip(keep.iter())
            .map(|(block, keep)| *keep && block.sides().iter().any(|side| fraction[side.u as usize] >= 0.0))
            .collect();
        let holds = |(block, struck): (&Block, &bool)| *struck && work.lambda[block.row as usize] != 0.0;
        let single = settings.budget.is_some() || core.report.residual > MEANINGFUL;
        if single || !work.rows.blocks.iter().zip(&struck).any(holds) {
            return;
        }
        let rest = |i: usize| if fraction[i] >= 0.0 { (1.0 - fraction[i]) * du_force[i] } else { 0.0 };
        let rest: Vec<f64> = (0..du_force.len()).map(rest).collect();
        let mut change = vec![0.0; work.rows.len];
        work.rows.add_velocity(&rest, &mut change);
        let (lambda, du, c) = (work.lambda.clone(), work.du.clone(), work.c.clone());
        work.c.iter_mut().zip(&change).for_each(|(c, change)| *c -= change);
        solve(core, work, settings, 1.0, |b| struck[b]);
        for i in (0..du.len()).filter(|&i| fraction[i] >= 0.0) {
            sustained[i] = du[i] - work.du[i];
        }
        (work.lambda, work.du, work.c) = (lambda, du, c);
    }
}
