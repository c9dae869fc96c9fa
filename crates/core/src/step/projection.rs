//! Position projection: what still overlaps is moved apart, with no effect on velocity and so none on kinetic energy.
//!
//! ```text
//! find Δ = M⁻¹Jᵀλ of least kinetic norm with   gap + h·n·(v̄ + Δ) ≥ 0 ⟂ λ ≥ 0   and, for equalities,   error + h·J(v̄ + Δ) = 0
//! ```
//!
//! `v̄` is the displacement velocity of the step, less what led bodies and motors are meant to move (0 for a projection in place, with
//! `h = 1`). What was wrong before is recovered at a bounded speed. Where nothing but joints moves an island, `closing.rs` does it at the end of the step.
//! Limits that tell their gap at any state (of joints, of rods) are asked for it at the end of the step, instead of `gap + h·J·v̄`: as links swing
//! about each other a joint does not move by the mean of its two velocities.

use super::contacts::{Workspace, displace, limits};
use super::{Moment, joint_correction};
use crate::constraint::rows::{RowSet, Rows};
use crate::object::RowTarget;
use crate::solver::{GaussSeidel, RowSolver, SolverSettings};
use crate::world::{Core, StepError};

/// What is to be projected.
pub(crate) enum Displacement<'a> {
    /// The displacement `h·mean` (whitened) of a step that ends here; led bodies and motors move with their own velocities.
    Step { mean: &'a [f64], h: f64 },
    /// None: bodies are moved apart where they are.
    InPlace,
}

/// Corrects positions so that the displacement ends without overlap. `recovery` bounds how much of the error that was there before is undone,
/// meters; an island that is wrong by no more than `least` meters is left alone.
pub(crate) fn project(
    core: &mut Core,
    acting: Option<&mut Moment>,
    work: &mut Workspace,
    displacement: Displacement,
    recovery: f64,
    least: f64,
) -> Result<(), StepError> {
    let in_place = matches!(displacement, Displacement::InPlace);
    let h = if let Displacement::Step { h, .. } = displacement { h } else { 1.0 };
    for (b, block) in work.rows.blocks.iter().enumerate() {
        let target = b.checked_sub(work.contact_constraints.len()).map_or(0.0, |i| work.targets[i].velocity);
        work.c[block.row as usize] = match displacement {
            Displacement::Step { mean, .. } => {
                work.bias[block.row as usize] + work.rows.row_velocity(block, 0, mean) - target
            }
            Displacement::InPlace => 0.0,
        };
    }
    if let Displacement::Step { h, .. } = displacement {
        ask_limits(core, work, h)?;
    }
    // in place, joints stay as they are: what is open of them is closed at the end of the sub-step
    let (contact_constraints, hold) = (work.contact_constraints.len(), core.settings.stabilize_positions && !in_place);
    let violation = |b: usize, c: &[f64]| -> f64 {
        let v = c[work.rows.blocks[b].row as usize];
        match (work.contact_constraints.get(b), b.checked_sub(contact_constraints).map(|i| work.targets[i])) {
            (Some(constraint), _) => -(allowed(constraint.contact.gap, recovery) + h * v),
            (None, Some(t)) if t.compliance > 0.0 => 0.0,
            (None, Some(t)) if t.set == RowSet::Equality && hold => (t.error.clamp(-recovery, recovery) + h * v).abs(),
            (None, Some(t)) if t.set == RowSet::HalfLine => -(allowed(t.error, recovery) + h * v),
            _ => 0.0,
        }
    };
    let worst = (0..work.rows.blocks.len()).map(|b| violation(b, &work.c)).fold(0.0, f64::max);
    if worst <= least {
        return Ok(());
    }
    let mut p = std::mem::take(&mut work.projection);
    p.fill(work, h, recovery, hold);
    let targets = &work.targets;
    // a motor has no place to hold, and a spring may be anywhere
    let rigid = |t: &RowTarget| t.compliance == 0.0 && !matches!(t.set, RowSet::Interval { .. });
    work.islands.build(&work.rows, |b| b < contact_constraints || rigid(&targets[b - contact_constraints]));
    let waits = |t: &RowTarget| joint_correction::is_joint(t) && t.velocity == 0.0;
    let closed_later = |&b: &u32| {
        !in_place && (b as usize) >= contact_constraints && waits(&targets[b as usize - contact_constraints])
    };
    for blocks in work.islands.iter() {
        if blocks.iter().all(closed_later) {
            continue;
        }
        let worst = blocks.iter().map(|&b| violation(b as usize, &work.c)).fold(0.0, f64::max);
        if worst > least {
            // the rows of a body's limits and contacts lean on each other through all its links, and a pile's do not
            let jointed = blocks.iter().any(|&b| b as usize >= contact_constraints);
            let most = if jointed { core.settings.solver_settings.max_sweeps } else { 0 };
            let solver_settings = SolverSettings {
                max_sweeps: core.settings.projection_sweeps.max(most),
                max_relaxations: u32::MAX,
                tolerance: 0.1 * least / h,
            };
            GaussSeidel.solve(&p.rows, blocks, &p.c, &mut p.lambda, &mut p.du, solver_settings);
        }
    }
    displace(core.coordinates(acting), &p.du, h);
    work.projection = p;
    Ok(())
}

/// Makes `h·c` of the limits what the step did to their gaps, if one is near enough to be passed.
fn ask_limits(core: &mut Core, work: &mut Workspace, h: f64) -> Result<(), StepError> {
    let contact_constraints = work.contact_constraints.len();
    let row = |target: u32| work.rows.blocks[contact_constraints + target as usize].row as usize;
    let near = |target: u32| {
        work.targets[target as usize].error <= core.settings.drift_tolerance + 2.0 * h * work.c[row(target)].abs()
    };
    if !work.limits.iter().any(|limit| limit.target.is_some_and(near)) {
        return Ok(());
    }
    let (mut end, mut ends) = (core.moment(), Vec::new());
    end.refresh(core.objects());
    limits(&end.view(core, core.state.time + h), &mut ends)?;
    core.moments.push(end);
    for (limit, end) in work.limits.iter().zip(ends).filter(|(limit, end)| limit.key == end.key) {
        if let Some(target) = limit.target {
            work.c[row(target)] = (end.gap - work.targets[target as usize].error) / h;
        }
    }
    Ok(())
}

fn allowed(gap: f64, recovery: f64) -> f64 {
    gap.max(-recovery)
}

/// The same blocks without friction, and the right-hand side that asks for no overlap.
#[derive(Default)]
pub(crate) struct Projection {
    rows: Rows,
    c: Vec<f64>,
    lambda: Vec<f64>,
    du: Vec<f64>,
}

impl Projection {
    /// Equalities that are not to be held in place are not to be moved either.
    fn fill(&mut self, work: &Workspace, h: f64, recovery: f64, hold: bool) {
        self.rows.clear(work.rows.dof);
        self.c.clear();
        for (b, block) in work.rows.blocks.iter().enumerate() {
            let (set, error) = match work.contact_constraints.get(b) {
                Some(constraint) => (RowSet::HalfLine, allowed(constraint.contact.gap, recovery)),
                None => match work.targets[b - work.contact_constraints.len()] {
                    t if t.set == RowSet::HalfLine => (t.set, allowed(t.error, recovery)),
                    t => (t.set, t.error.clamp(-recovery, recovery)),
                },
            };
            self.rows.push_soft(set, block.compliance); // joints out of reach give way here too
            for side in block.sides() {
                let response = work.rows.response(side, 0);
                if let Some(y) = self.rows.side(side.u as usize, side.dof as usize) {
                    y.copy_from_slice(response);
                }
            }
            self.c.push(if set == RowSet::Equality && !hold { 0.0 } else { work.c[block.row as usize] + error / h });
        }
        self.lambda.clear();
        self.lambda.resize(self.rows.len, 0.0);
        self.du.clear();
        self.du.resize(work.rows.dof, 0.0);
    }
}
