//! Contact patches: rolling and torsional friction, and friction that depends on the sliding speed.
//!
//! Contacts of a pair with one normal and the same constants are a *patch*. The patch has angular rows, which exist during one
//! solve: one along the normal, two along the tangents. Their bounds are multiples of the normal forces of
//! the solution, so the rows are solved again until they no longer change. How friction is divided, between
//! sliding and spinning and among the directions of rolling, is found from the velocities with the
//! multipliers of the last step, then once more from those of the first solve. In small islands of robots the bounds follow
//! the normal forces within a solve (`solver/coupled.rs`): one round for each division, and more only if friction depends on the speed.
//!
//! ```text
//! rolling      |τ_t| ≤ ρ·N                  τ_t = −ρ·N·ω_t/|ω_t| where the pair rolls
//! sliding and  |(f/μ, τ_n/σ)| ≤ λ_n         of greatest dissipation: (f/μ, τ_n/σ) = −λ_n·(μ·w, σ·ω_n)/|(μ·w, σ·ω_n)|
//! spinning     per contact, which has the share λ_n/N of τ_n
//! division     p = f/μ − r·μ·w,  q = τ_n/σ·λ_n/N − r·σ·ω_n,  m = |(p, q)|,  r = 1/(μ²·K_t + σ²·K_n)
//!              m > λ_n:  |f| ≤ μ·λ_n·|p|/m,                |τ_n| ≤ Σ σ·λ_n·|q|/m
//!              else:     |f| ≤ μ·√(λ_n² − q²),             |τ_n| ≤ Σ σ·√(λ_n² − |p|²)
//! a round      λ_n of the solution, the same factors of it
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `λ_n`, `f` | normal and friction force of a contact, N (or impulse, N·s) |
//! | `N` | `Σ λ_n` of the patch |
//! | `τ_n`, `τ_t` | moment of the patch about its normal and across it, N·m |
//! | `w`, `ω_n`, `ω_t` | sliding velocity of a contact, relative angular velocity along the normal and across it |
//! | `μ`, `σ`, `ρ` | coefficients of friction (1), torsional friction (m), rolling friction (m) |
//! | `K_t`, `K_n` | diagonal entries of the contact's matrix along a tangent and of the angular row |
//!
//! The law of sliding and spinning is the ellipse that Contensou's law of a disc comes close to (Leine
//! and Glocker, *A set-valued force law for spatial Coulomb–Contensou friction*, 2003). It is that of
//! `condim` 4 and 6 in MuJoCo; there rolling shares the same ellipse.

use super::contacts::{Workspace, solve};
use super::solves::Solves;
use super::{Moment, contacts};
use crate::constraint::builder::RowBuilder;
use crate::constraint::rows::{Block, RowSet, Rows};
use crate::contact::detect::ContactConstraint;
use crate::contact::laws::ContactLaws;
use crate::object::RowTarget;
use crate::object::collidable::ContactFrame;
use crate::solver::{CoupledIsland, Folding, SolveReport, SolverSettings, largest_residual};
use crate::world::view::ObjectId;
use crate::world::{Core, StepError};
use std::ops::Range;
use tumble_collide::Vec3;

/// Maximum number of rounds.
const ROUNDS: usize = 20;
/// After this number of rounds a round goes half the way: bounds that alternate converge.
const HALF: usize = 8;
/// Least factor by which spinning reduces the friction against sliding: no cone has no friction.
const LEAST: f64 = 1e-3;

/// Angular rows of the contacts of a pair with one normal.
struct Patch {
    contacts: Range<usize>,
    /// Normal and tangents, unit.
    axes: [Vec3; 3],
    /// Blocks of the two rows across the normal.
    rolling: Option<[usize; 2]>,
    /// Block of the row along the normal.
    torsional: Option<usize>,
    /// Factor of the friction of each contact, and its moment about the normal per normal force, m.
    divisions: Vec<(f64, f64)>,
    /// Share of rolling friction along each tangent.
    directions: [f64; 2],
}

/// Moment of a patch on part A of its contacts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatchMoment {
    pub contact: usize,
    /// N·m at the acceleration level, else N·m·s, world axes.
    pub moment: Vec3,
}

/// Solves all blocks that `keep` selects, as [`solve`] does, for contacts with laws of their own. `u` is
/// the whitened velocity at the end without the multipliers; rows respond at the moment `acting`. The
/// moments of patches go to `work.moments`.
pub(super) fn solve_patches(
    core: &mut Core,
    acting: Option<&mut Moment>,
    work: &mut Workspace,
    (settings, unit): (SolverSettings, f64),
    keep: &[bool],
    u: &[f64],
) -> Result<bool, StepError> {
    work.moments.clear();
    let laws = |c: &ContactConstraint| c.laws.as_ref().is_some_and(|laws| laws.depends_on_solution(c.friction));
    if !work.contact_constraints.iter().any(laws) {
        return Ok(solve(core, work, settings, unit, |b| keep[b]));
    }
    let (blocks, len, y) = (work.rows.blocks.len(), work.rows.len, work.rows.y.len());
    let mut patches = lay_patches(core, acting, work, keep)?;
    work.lambda.resize(work.rows.len, 0.0);
    for row in len..work.rows.len {
        work.c.push(work.bias[row] / unit);
    }
    for block in &work.rows.blocks[blocks..] {
        work.c[block.row as usize] += work.rows.row_velocity(block, 0, u) / unit;
    }
    contacts::zero(&mut work.du, core.dof);
    for block in &work.rows.blocks {
        work.rows.apply_block(block, &work.lambda, &mut work.du);
    }
    let tolerance = super::solves::SOLVED * settings.tolerance;
    let mut ray = false;
    let coupled = solve_coupled(core, work, &mut patches, (settings, unit), (keep, blocks));
    for round in (0..=ROUNDS).take_while(|_| !coupled) {
        let mut change: f64 = 0.0;
        if round < 2 {
            patches.iter_mut().for_each(|patch| divide_friction(work, patch));
        }
        for patch in &patches {
            let relax = if round > HALF { 0.5 } else { 1.0 };
            change = change.max(update(work, patch, unit, relax));
        }
        if round > 0 && change <= tolerance {
            break;
        }
        if round == ROUNDS {
            core.report.missed(unit * change);
            break;
        }
        ray = solve(core, work, settings, unit, |b| keep.get(b).copied().unwrap_or(true));
    }
    for patch in &patches {
        let rows = patch.torsional.map(|b| (b, 0)).into_iter();
        let rows = rows.chain(patch.rolling.into_iter().flatten().zip(1..));
        let moment = rows.map(|(b, k)| patch.axes[k] * work.lambda[work.rows.blocks[b].row as usize]).sum();
        work.moments.push(PatchMoment { contact: patch.contacts.start, moment });
    }
    work.rows.blocks.truncate(blocks);
    work.rows.y.truncate(y);
    work.rows.len = len;
    [&mut work.bias, &mut work.c, &mut work.lambda].into_iter().for_each(|numbers| numbers.truncate(len));
    Ok(ray)
}

/// Solves all blocks with bounds that follow the normal forces, if all islands with patches are small ones of robots. Blocks
/// from `first_row` on are rows of patches. Returns whether it did; if not, `work` is as before except for the sets of rows.
fn solve_coupled(
    core: &mut Core,
    work: &mut Workspace,
    patches: &mut [Patch],
    (settings, unit): (SolverSettings, f64),
    (keep, first_row): (&[bool], usize),
) -> bool {
    let all_kept = patches.iter().all(|patch| patch.contacts.clone().all(|i| keep[i]));
    // the others are solved once, so friction that depends on the speed must not be among them
    let all_rows = patches.iter().all(|patch| patch.torsional.is_some() || patch.rolling.is_some());
    if !core.solver.follows_forces() || settings.budget.is_some() || !all_kept || !all_rows {
        return false;
    }
    work.islands.build(&work.rows, |b| keep.get(b).copied().unwrap_or(true));
    let islands = std::mem::take(&mut work.islands);
    let (has_patch, of_patch) = (|b: &u32| *b as usize >= first_row, |blocks: &&[u32]| !blocks.is_empty());
    let with_patch = || islands.iter().filter(of_patch).filter(|blocks| blocks.iter().any(has_patch));
    let folded: Option<Vec<Folding>> =
        with_patch().map(|blocks| Folding::new(&work.rows, blocks, &work.c, &work.lambda)).collect();
    let small = folded.as_ref().and_then(|folded| folded.iter().map(CoupledIsland::new).collect::<Option<Vec<_>>>());
    let others: Vec<&[u32]> = islands.iter().filter(of_patch).filter(|blocks| !blocks.iter().any(has_patch)).collect();
    let start = (work.lambda.clone(), work.du.clone());
    let solved = match small {
        Some(mut small) if others.iter().all(|blocks| blocks.len() <= contacts::OWN_BUDGET) => {
            let with_patch: Vec<&[u32]> = with_patch().collect();
            coupled_rounds(core, work, patches, (settings, unit), (&with_patch, &mut small), &others)
        }
        _ => None,
    };
    match &solved {
        Some(outcomes) => {
            let mut solves = Solves::new(&mut core.report, core.solver.as_ref(), unit * settings.tolerance);
            let mut outcomes = outcomes.iter();
            for blocks in islands.iter() {
                let outcome = outcomes.next().filter(|_| !blocks.is_empty());
                let mut largest = largest_residual(&work.rows, blocks, &work.c, &work.lambda, &work.du);
                largest.residual *= unit;
                solves.add(outcome.map(|outcome| (*outcome, largest)));
            }
            solves.finish(core.table.with(&core.state.objects), &work.rows, &islands);
        }
        None => (work.lambda, work.du) = start,
    }
    drop(folded);
    work.islands = islands;
    solved.is_some()
}

/// Solves the islands with patches until the bounds are those of the solution, and the others once. Returns the outcomes of
/// all islands in their order, or `None` if solves fail.
fn coupled_rounds(
    core: &mut Core,
    work: &mut Workspace,
    patches: &mut [Patch],
    (settings, unit): (SolverSettings, f64),
    (with_patch, small): (&[&[u32]], &mut [CoupledIsland]),
    others: &[&[u32]],
) -> Option<Vec<SolveReport>> {
    let tolerance = super::solves::SOLVED * settings.tolerance;
    let (mut outcomes, mut failures) = (Vec::<(u32, SolveReport)>::new(), 0);
    for round in 0..ROUNDS {
        if round < 2 {
            patches.iter_mut().for_each(|patch| divide_friction(work, patch));
        }
        let change = patches.iter().map(|patch| update(work, patch, unit, 1.0)).fold(0.0, f64::max);
        let holds = |blocks: &&[u32]| {
            largest_residual(&work.rows, blocks, &work.c, &work.lambda, &work.du).residual <= settings.tolerance
        };
        if round > 0 && (change <= tolerance || with_patch.iter().all(holds)) {
            outcomes.sort_by_key(|(first, _)| *first);
            return Some(outcomes.into_iter().map(|(_, outcome)| outcome).collect());
        }
        let bounds = bounds_of(work, patches);
        contacts::zero(&mut work.du, core.dof);
        let Workspace { rows, c, lambda, du, .. } = &mut *work;
        for (i, (blocks, island)) in with_patch.iter().zip(&mut *small).enumerate() {
            island.follow(rows, &bounds);
            let mut outcome = match island.solve((rows, c), settings.tolerance, lambda, du) {
                Some(outcome) => outcome,
                None if failures < with_patch.len() => {
                    // with the bounds held, which is easier; the next round begins there
                    failures += 1;
                    let outcome = core.solver.solve(rows, blocks, c, lambda, du, settings);
                    island.restart(rows, lambda);
                    outcome
                }
                None => return None,
            };
            core.meter.count(outcome.relaxations);
            match outcomes.get_mut(i) {
                Some((_, last)) => {
                    outcome.iterations += last.iterations;
                    *last = outcome;
                }
                None => outcomes.push((blocks[0], outcome)),
            }
        }
        for blocks in others {
            if round == 0 {
                let outcome = core.solver.solve(rows, blocks, c, lambda, du, settings);
                core.meter.count(outcome.relaxations);
                outcomes.push((blocks[0], outcome));
            } else {
                blocks.iter().for_each(|&b| rows.apply_block(&rows.blocks[b as usize], lambda, du));
            }
        }
    }
    None
}

/// Returns the block of each row of the patches, with the contacts whose normal forces its bound follows.
fn bounds_of(work: &Workspace, patches: &[Patch]) -> Vec<(usize, Vec<(usize, f64)>)> {
    let mut bounds = Vec::new();
    for patch in patches {
        let Some(laws) = &work.contact_constraints[patch.contacts.start].laws else { continue };
        for (b, share) in patch.rolling.into_iter().flatten().zip(patch.directions) {
            bounds.push((b, patch.contacts.clone().map(|i| (i, share * laws.rolling)).collect()));
        }
        let moments = || patch.contacts.clone().zip(patch.divisions.iter().map(|(_, moment)| *moment));
        bounds.extend(patch.torsional.map(|b| (b, moments().collect())));
    }
    bounds
}

/// Adds the angular rows of all patches, with bounds 0.
fn lay_patches(
    core: &mut Core,
    acting: Option<&mut Moment>,
    work: &mut Workspace,
    keep: &[bool],
) -> Result<Vec<Patch>, StepError> {
    let mut patches: Vec<Patch> = Vec::new();
    let mut first = 0;
    let same = |a: &ContactConstraint, b: &ContactConstraint| {
        a.key.pair == b.key.pair
            && a.frame.axes[0] == b.frame.axes[0]
            && a.friction == b.friction
            && ContactLaws::are_same(&a.laws, &b.laws)
    };
    for contacts in work.contact_constraints.chunk_by(same) {
        let range = first..first + contacts.len();
        first = range.end;
        let laws = contacts[0].laws.as_ref().filter(|laws| laws.depends_on_solution(contacts[0].friction));
        if laws.is_some() && range.clone().any(|i| keep[i]) {
            let axes = ContactFrame::new(contacts[0].frame.point, contacts[0].frame.axes[0]).axes;
            let (divisions, directions) = (Vec::new(), [1.0; 2]);
            patches.push(Patch { contacts: range, axes, rolling: None, torsional: None, divisions, directions });
        }
    }
    let time = core.state.time;
    let owners = core.owners.clone();
    let basis = core.basis(acting, time, None);
    let (mut targets, mut kinds, mut problem) = (Vec::new(), Vec::new(), None);
    let mut builder = RowBuilder {
        rows: &mut work.rows,
        bias: &mut work.bias,
        targets: &mut targets,
        kinds: &mut kinds,
        objects: basis.view.objects,
        x: basis.found.0,
        caches: basis.caches,
        part_states: basis.view.part_states,
        problem: &mut problem,
        owner: ObjectId::default(),
    };
    for patch in &mut patches {
        let constraint = &work.contact_constraints[patch.contacts.start];
        let Some(laws) = &constraint.laws else { continue };
        let [normal, t, b] = patch.axes;
        let [side_a, side_b] = [constraint.a, constraint.b].map(|part| owners[part as usize]);
        let mut row = |axis: Vec3| {
            let block = builder.rows.blocks.len();
            builder
                .row(RowTarget::new(RowSet::Interval { lo: 0.0, hi: 0.0 }, 0.0))
                .on_rotation(side_a.id, side_a.part as usize, &axis, 1.0)
                .on_rotation(side_b.id, side_b.part as usize, &axis, -1.0);
            block
        };
        patch.rolling = (laws.rolling > 0.0).then(|| [row(t), row(b)]);
        patch.torsional = (laws.torsional > 0.0).then(|| row(normal));
    }
    match problem {
        Some(why) => Err(StepError::Row { object: "a contact".into(), why }),
        None => Ok(patches),
    }
}

/// The present solution of one row: its multiplier, its velocity, and its diagonal entry.
struct RowState {
    lambda: f64,
    w: f64,
    own: f64,
}

fn row_state(work: &Workspace, block: &Block, k: usize) -> RowState {
    let row = block.row as usize + k;
    let w = work.c[row] + work.rows.row_velocity(block, k, &work.du);
    RowState { lambda: work.lambda[row], w, own: work.rows.own(block, k, k) }
}

/// Finds how the friction of a patch is divided, from the present solution.
fn divide_friction(work: &Workspace, patch: &mut Patch) {
    let ContactConstraint { laws, friction, .. } = &work.contact_constraints[patch.contacts.start];
    let Some(laws) = laws else { return };
    let load_of = |i: usize| work.lambda[work.rows.blocks[i].row as usize].max(0.0);
    let total: f64 = patch.contacts.clone().map(load_of).sum();
    let spin = patch.torsional.map(|b| row_state(work, &work.rows.blocks[b], 0));
    patch.divisions.clear();
    for i in patch.contacts.clone() {
        let (load, block) = (load_of(i), &work.rows.blocks[i]);
        let division = match (&spin, block.set) {
            (Some(spin), RowSet::Cone { .. }) => {
                let tangents = [1, 2].map(|k| row_state(work, block, k));
                let share = if total > 0.0 { load / total } else { 1.0 / patch.contacts.len() as f64 };
                divide(laws, friction.max(LEAST), &tangents, (spin, share), load)
            }
            _ => (1.0, laws.torsional),
        };
        patch.divisions.push(division);
    }
    if let Some(rows) = patch.rolling {
        let rolls = rows.map(|b| row_state(work, &work.rows.blocks[b], 0));
        let most = laws.rolling * total;
        let r = 1.0 / rolls[0].own.max(rolls[1].own).max(f64::MIN_POSITIVE);
        let wanted = [0, 1].map(|k| rolls[k].lambda - r * rolls[k].w);
        let size = hypot(wanted[0], wanted[1]);
        patch.directions = [0, 1].map(|k| {
            let other = wanted[1 - k] / most.max(f64::MIN_POSITIVE);
            if size > most { wanted[k].abs() / size } else { (1.0 - other * other).max(0.0).sqrt() }
        });
    }
}

/// Sets the bounds of a patch and the friction of its contacts from the normal forces of the present
/// solution. Returns the largest change in terms of a row velocity.
fn update(work: &mut Workspace, patch: &Patch, unit: f64, relax: f64) -> f64 {
    let ContactConstraint { laws, friction, .. } = &work.contact_constraints[patch.contacts.start];
    let (Some(laws), friction) = (laws.clone(), *friction) else { return 0.0 };
    let (mut change, mut total, mut torsion) = (0.0f64, 0.0, 0.0);
    for (i, (factor, moment)) in patch.contacts.clone().zip(&patch.divisions) {
        let block = work.rows.blocks[i];
        let load = work.lambda[block.row as usize].max(0.0);
        total += load;
        torsion += moment * load;
        let RowSet::Cone { mu: before } = block.set else { continue };
        let tangents = [1, 2].map(|k| row_state(work, &block, k));
        let axes = &work.contact_constraints[i].frame.axes;
        let speed = unit * hypot(tangents[0].w / axes[1].norm(), tangents[1].w / axes[2].norm());
        let mu = laws.friction_at(speed, friction) * factor.max(LEAST);
        let mu = before + relax * (mu - before);
        change = change.max((mu - before).abs() * load * tangents[0].own.max(tangents[1].own));
        work.rows.blocks[i].set = RowSet::Cone { mu };
    }
    let rolling = patch.rolling.into_iter().flatten().zip(patch.directions.map(|share| share * laws.rolling * total));
    for (b, most) in rolling.chain(patch.torsional.map(|b| (b, torsion))) {
        let own = work.rows.own(&work.rows.blocks[b], 0, 0);
        change = change.max(bound(&mut work.rows, b, most, relax) * own);
    }
    change
}

/// Divides the friction of a contact between sliding and spinning. Returns the factor of its
/// coefficient, and the moment about the normal per normal force, m.
fn divide(
    laws: &ContactLaws,
    mu: f64,
    tangents: &[RowState; 2],
    (spin, share): (&RowState, f64),
    load: f64,
) -> (f64, f64) {
    let sigma = laws.torsional;
    let own = mu * mu * tangents[0].own.max(tangents[1].own) + sigma * sigma * spin.own;
    let r = if own > 0.0 { 1.0 / own } else { 0.0 };
    let p = tangents[0].lambda / mu - r * mu * tangents[0].w;
    let p = hypot(p, tangents[1].lambda / mu - r * mu * tangents[1].w);
    let q = (share * spin.lambda / sigma - r * sigma * spin.w).abs();
    let size = hypot(p, q);
    if size > load {
        (p / size, sigma * q / size)
    } else if load > 0.0 {
        let rest = |x: f64| (1.0 - (x / load).powi(2)).max(0.0).sqrt();
        (rest(q), sigma * rest(p))
    } else {
        (1.0, sigma)
    }
}

/// Sets the bounds of a row to ± `most`, `relax` of the way. Returns the change.
fn bound(rows: &mut Rows, block: usize, most: f64, relax: f64) -> f64 {
    let RowSet::Interval { hi: before, .. } = rows.blocks[block].set else { return 0.0 };
    let hi = before + relax * (most - before);
    rows.blocks[block].set = RowSet::Interval { lo: -hi, hi };
    (hi - before).abs()
}

/// Returns `√(a² + b²)`, with the same bits on every platform.
fn hypot(a: f64, b: f64) -> f64 {
    nalgebra::ComplexField::hypot(a, b)
}
