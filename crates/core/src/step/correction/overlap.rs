//! The first round of a correction, in which contacts take part: positions move by the displacement
//! of least kinetic norm after which nothing overlaps. Velocities stay, and so does the kinetic
//! energy.
//!
//! ```text
//! find Δ = M⁻¹Jᵀλ of least kinetic norm with   gap + h·n·(v̄ + Δ) ≥ 0 ⟂ λ ≥ 0   and, for joints,   error + h·J(v̄ + Δ) = 0
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `v̄` | displacement velocity of the step, less the motion that kinematic bodies and motors prescribe; 0 in place, where `h = 1` |
//!
//! The gap of a contact is known to first order only: to measure it again takes another detection,
//! which costs as much as the step. So contacts take part in one round. Joints next to them are
//! predicted in the same way here, and measured in the rounds that follow. Limits are measured from
//! the start, because a joint between two links that swing does not move by the mean of its two
//! velocities. An island without a contact or limit is left to the following rounds.
//!
//! Errors from before the step are reduced by a bounded amount. Friction takes no part.
//!
//! **Contacts that contradict each other.** A nut that jams between the flanks of a thread, or a body in a gap
//! that is too narrow, can only get out to first order: along the line where two nearly opposite planes
//! meet, which can be any distance away, and where the surfaces end long before. So bodies of an island move
//! against each other by at most [`REACH`] times its largest violation. Where the rows ask for more, they yield,
//! `gap + h·n·(v̄ + Δ) + h·R·λ ≥ 0` with `R = ε·n·M⁻¹·n`, and share the overlap:
//!
//! ```text
//! |Δ|² = Σ kᵢ·bᵢ²/(kᵢ + ε)² ≤ |b|²/(4·ε)        kᵢ: eigenvalues of the rows' response over its diagonal, b: violations
//! ```

use super::super::Moment;
use super::super::budget::shared;
use super::super::contacts::{Limit, Workspace, displace};
use super::super::islands::each_island;
use super::{Contacts, Options, is_joint};
use crate::constraint::rows::{Block, RowSet, Rows};
use crate::linearize::Switch;
use crate::object::RowTarget;
use crate::solver::SolverSettings;
use crate::world::Core;
use smallvec::SmallVec;

/// Share of the work that is left in a correction before a sub-step of `backtracking`.
const IN_PLACE: f64 = 0.25;

/// Largest displacement of two bodies against each other at a contact, in violations of their island.
const REACH: f64 = 20.0;
/// `ε`.
const YIELDING: f64 = 1e-2;

/// Moves the objects of islands with a violation above the tolerance. `gaps` are those of the
/// limits at the present numbers. Returns whether anything moved.
pub(super) fn separate(
    core: &mut Core,
    acting: Option<&mut Moment>,
    work: &mut Workspace,
    gaps: &[Limit],
    options: &Options,
) -> bool {
    let (in_place, h) = match options.contacts {
        Contacts::Ignored => return false,
        Contacts::InPlace => (true, 1.0),
        Contacts::Moved { .. } => (false, options.h),
    };
    predict(work, gaps, options.contacts, h);
    let (recovery, least) = (options.recovery, options.tolerance);
    // joints stay as they are in place: their errors are corrected at the end of the sub-step
    let (contacts, hold) = (work.contact_constraints.len(), core.settings.stabilize_positions && !in_place);
    let violation = |b: usize, c: &[f64]| -> f64 {
        let v = c[work.rows.blocks[b].row as usize];
        match (work.contact_constraints.get(b), b.checked_sub(contacts).map(|i| work.targets[i])) {
            (Some(constraint), _) => -(allowed(constraint.gap_of_row(), recovery) + h * v),
            (None, Some(t)) if t.compliance > 0.0 => 0.0,
            (None, Some(t)) if t.set == RowSet::Equality && hold => (t.error.clamp(-recovery, recovery) + h * v).abs(),
            (None, Some(t)) if t.set == RowSet::HalfLine => -(allowed(t.error, recovery) + h * v),
            _ => 0.0,
        }
    };
    let worst = (0..work.rows.blocks.len()).map(|b| violation(b, &work.c)).fold(0.0, f64::max);
    if core.branches.take(Switch::Overlap, None, worst <= least) {
        return false;
    }
    let mut p = std::mem::take(&mut work.frictionless);
    p.fill(work, h, recovery, hold);
    let targets = &work.targets;
    // a motor holds no position, and a spring may have any
    let rigid = |t: &RowTarget| t.compliance == 0.0 && !matches!(t.set, RowSet::Interval { .. });
    work.islands.build(&work.rows, |b| b < contacts || rigid(&targets[b - contacts]));
    let waits = |t: &RowTarget| is_joint(t) && t.velocity == 0.0;
    let later = |&b: &u32| !in_place && (b as usize) >= contacts && waits(&targets[b as usize - contacts]);
    let mut solved = Vec::new();
    let Frictionless { rows, c, lambda, du } = &mut p;
    let left_alone = |blocks: &[u32]| {
        let within = || blocks.iter().all(|&b| violation(b as usize, &work.c) <= least);
        blocks.iter().all(later) || core.branches.take(Switch::Overlap, None, within())
    };
    let budget = core.meter.left(if in_place { IN_PLACE } else { 1.0 });
    let all = budget.map_or(0, |_| work.islands.iter().filter(|blocks| !left_alone(blocks)).map(<[u32]>::len).sum());
    let solve = |rows: &Rows, blocks: &[u32], lambda: &mut [f64], du: &mut [f64]| {
        if left_alone(blocks) {
            return false;
        }
        // limits and contacts of a body depend on each other through all its links; those of a pile
        // do not
        let jointed = blocks.iter().any(|&b| b as usize >= contacts);
        let min_sweeps = if jointed { core.settings.solver_settings.max_sweeps } else { 0 };
        let solver_settings = SolverSettings {
            max_sweeps: core.settings.projection_sweeps.max(min_sweeps),
            max_relaxations: u32::MAX,
            tolerance: 0.1 * least / h,
            budget: None,
        };
        let solver_settings = shared(solver_settings, budget, blocks.len(), all);
        core.meter.count(core.solver.solve(rows, blocks, c, lambda, du, solver_settings).relaxations);
        true
    };
    let first = |blocks: &[u32], lambda: &mut [f64], du: &mut [f64]| solve(rows, blocks, lambda, du);
    each_island(&core.threads, rows, work.islands.iter(), (lambda, du), first, |moved| solved.push(moved));
    let is_far = |blocks: &[u32]| {
        let worst = blocks.iter().map(|&b| violation(b as usize, &work.c)).fold(0.0, f64::max);
        let of_contacts = blocks.iter().filter(|&&b| (b as usize) < contacts);
        let way =
            of_contacts.map(|&b| h * relative_speed(&work.rows, &work.rows.blocks[b as usize], du)).fold(0.0, f64::max);
        core.branches.take(Switch::Overlap, None, way > REACH * worst)
    };
    let moved = solved.contains(&true);
    let islands = work.islands.iter().zip(solved);
    let far: Vec<&[u32]> =
        islands.filter(|(blocks, solved)| *solved && is_far(blocks)).map(|(blocks, _)| blocks).collect();
    if !far.is_empty() {
        far.iter().copied().flatten().for_each(|&b| {
            let response = response(rows, &rows.blocks[b as usize]);
            let block = &mut rows.blocks[b as usize];
            block.compliance += if block.set == RowSet::HalfLine { YIELDING * response } else { 0.0 };
            lambda[block.range()].fill(0.0);
            block.sides().iter().for_each(|side| du[side.u as usize..(side.u + side.dof) as usize].fill(0.0));
        });
        let again = |blocks: &[u32], lambda: &mut [f64], du: &mut [f64]| solve(rows, blocks, lambda, du);
        each_island(&core.threads, rows, far.iter().copied(), (lambda, du), again, |_| ());
    }
    displace(core.coordinates(acting), &p.du, h);
    work.frictionless = p;
    moved
}

/// Writes the rate of every row's error in the step to `work.c`: to first order, or the mean rate
/// of the measured gaps. It is 0 for soft rows, which have no part in this.
fn predict(work: &mut Workspace, gaps: &[Limit], contacts: Contacts, h: f64) {
    let first = work.contact_constraints.len();
    let measured = work.limits.iter().zip(gaps).filter(|(limit, end)| limit.key == end.key);
    let measured = measured.filter_map(|(limit, end)| Some((limit.target? as usize, end.gap)));
    let mut known = SmallVec::<[bool; 128]>::from_elem(false, work.targets.len());
    measured.clone().for_each(|(target, _)| known[target] = true);
    for (b, block) in work.rows.blocks.iter().enumerate() {
        let target = b.checked_sub(first).map(|i| (&work.targets[i], known[i]));
        let rate = |mean: &[f64]| work.bias[block.row as usize] + work.rows.row_velocity(block, 0, mean);
        work.c[block.row as usize] = match (contacts, target) {
            (Contacts::InPlace | Contacts::Ignored, _) | (_, Some((_, true))) => 0.0,
            (_, Some((target, _))) if target.compliance > 0.0 => 0.0,
            (Contacts::Moved { mean }, target) => rate(mean) - target.map_or(0.0, |(target, _)| target.velocity),
        };
    }
    for (target, gap) in measured {
        work.c[work.rows.blocks[first + target].row as usize] = (gap - work.targets[target].error) / h;
    }
}

/// Returns `n·M⁻¹·n` of a block's first row.
fn response(rows: &Rows, block: &Block) -> f64 {
    block.sides().iter().flat_map(|side| rows.response(side, 0)).map(|y| y * y).sum()
}

/// Returns the speed of the bodies of a contact against each other, m/s. Without friction the rows do not say how
/// they slide: then it is the speed of the mass that the contact feels, of a body against a fixed one.
fn relative_speed(rows: &Rows, block: &Block, du: &[f64]) -> f64 {
    match block.sides() {
        [side] if block.range().len() == 1 => {
            let squares = du[side.u as usize..(side.u + side.dof) as usize].iter().map(|u| u * u);
            (response(rows, block) * squares.sum::<f64>()).sqrt()
        }
        _ => (0..block.range().len()).map(|k| rows.row_velocity(block, k, du).powi(2)).sum::<f64>().sqrt(),
    }
}

fn allowed(gap: f64, recovery: f64) -> f64 {
    gap.max(-recovery)
}

/// The rows without friction, and the right-hand side.
#[derive(Default)]
pub(crate) struct Frictionless {
    rows: Rows,
    c: Vec<f64>,
    lambda: Vec<f64>,
    /// Displacement per second of the step, whitened.
    pub du: Vec<f64>,
}

impl Frictionless {
    /// Copies the normal rows of contacts and all rows of constraints. Equalities keep their error
    /// unless `hold`.
    fn fill(&mut self, work: &Workspace, h: f64, recovery: f64, hold: bool) {
        self.rows.clear(work.rows.dof);
        self.c.clear();
        for (b, block) in work.rows.blocks.iter().enumerate() {
            let (set, error) = match work.contact_constraints.get(b) {
                Some(constraint) => (RowSet::HalfLine, allowed(constraint.gap_of_row(), recovery)),
                None => match work.targets[b - work.contact_constraints.len()] {
                    t if t.set == RowSet::HalfLine => (t.set, allowed(t.error, recovery)),
                    t => (t.set, t.error.clamp(-recovery, recovery)),
                },
            };
            self.rows.push_soft(set, block.compliance); // unreachable joints yield here too
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
