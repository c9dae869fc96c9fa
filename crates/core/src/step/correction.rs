//! Correction of positions, and of velocities along joints: Newton's method on the rows with an
//! active set, for every group of connected objects.
//!
//! ```text
//! repeat   rows J and errors g at x
//!          K·μ = −g,      x += M⁻¹Jᵀμ            active rows:  g = 0;  contacts in the first round:  g + K·μ ≥ 0 ⟂ μ ≥ 0
//!          K·ν = −J·v,    v += M⁻¹Jᵀν            joints, and limits that had a force
//! ```
//!
//! | row | in the equations | error |
//! |---|---|---|
//! | joint (rigid equality) | always | measured at `x` |
//! | limit (half-line) | while active: violated, or with a force in the step | measured at `x` |
//! | contact (half-line) | in the first round (`overlap.rs`) | to first order |
//! | inertia (soft) | always: it is part of `M` | none |
//! | stiff spring (soft) | always: it is part of `M` | extension, less that by its rule |
//!
//! All callers use this one routine: the middle of a step ([`middle`]), its end in both steppers,
//! and overlap of bodies in place ([`correct`]). All linear problems go to the solver of the world.
//! A group has equalities only; every solver factors those directly, by `solver/equality.rs`.
//!
//! Only the error that the step made is corrected in full. An error from before the step is reduced
//! by a bounded amount, [`Options::recovery`].
//!
//! **The rows of the step.** Joints use the rows at the middle of the step as long as these
//! converge (`correction/group.rs`). They look the same from both ends, so the step is reversible:
//! energy oscillates with the motion and is not lost in the joints. This requires a middle *on* the
//! joints, and so do redundant joints: two hinges of a door agree about its axis in closed
//! configurations only, and rows beside one would lock the door.
//!
//! **Stiff springs** have the extension of their rule at the end of a step (`springs.rs`).
//!
//! **Limits in `backtracking`.** The force of a limit is that of the start of the sub-step and
//! holds over it. The force that is required changes with the motion of the other links, so at the
//! end the gap is off by `⅙·ȧ·h³` and its rate by `½·ȧ·h²`. Without correction the limit would open
//! and strike again, many times. One round is enough, unless joints are connected to it: what it
//! leaves is of second order. A limit that would have opened within the sub-step is held to its end.
//!
//! **Unreachable joints** are the fallback: see `unreachable_joints.rs`.

mod errors;
mod group;
mod joint_work;
mod overlap;

use super::budget::shared;
use super::contacts::{Limit, lay_rows, limits, push, row_velocities, shift, unwhiten_onto, whiten, zero};
use super::islands::each_island;
use super::{Moment, Workspace, springs, unreachable_joints};
use crate::constraint::builder::constraints;
use crate::constraint::rows::{RowSet, Rows};
use crate::derived::Cache;
use crate::object::{Integratable, Level, RowTarget};
use crate::solver::SolverSettings;
use crate::world::{Coordinates, Core, StepError};
use errors::{Errors, Goal};
use group::{Group, Round, by_start, entry_at};

pub(super) use errors::{ActiveLimit, Limits, limits_with_force};
pub(super) use joint_work::{Impulses, Velocities};
pub(crate) use overlap::Frictionless;

/// Number of sweeps per round in a group that is too large for a direct solve.
const SWEEPS: u32 = 25;
/// Share of the work that is left in one half of a round.
const ROUND: f64 = 0.25;
/// Maximum number of active sets.
const MAX_ACTIVE_SETS: usize = 4;

/// Which contacts are corrected.
#[derive(Clone, Copy)]
pub(super) enum Contacts<'a> {
    /// None.
    Ignored,
    /// Overlap as it was found; joints keep their errors.
    InPlace,
    /// Overlap after a step with the mean whitened velocity `mean`.
    Moved { mean: &'a [f64] },
}

/// Extent and tolerances of a correction.
#[derive(Clone, Copy)]
pub(super) struct Options<'a> {
    /// Length of the step whose end is corrected, s.
    pub h: f64,
    /// Its impulses, if joints are to do no work in it.
    pub impulses: Option<Impulses<'a>>,
    /// Level of the rows.
    pub level: Level,
    /// State at the start of the step.
    pub start: &'a [f64],
    pub contacts: Contacts<'a>,
    pub limits: Limits<'a>,
    /// Maximum reduction of an error from before the step, m or rad.
    pub recovery: f64,
    /// An island whose contacts and limits are violated by no more than this is left alone, m or
    /// rad.
    pub tolerance: f64,
}

/// Returns whether a row is a joint, whose position is kept.
pub(super) fn is_joint(t: &RowTarget) -> bool {
    t.set == RowSet::Equality && t.compliance == 0.0
}

/// Returns whether there are joints or stiff springs, whose ends of a step are corrected.
pub(super) fn holds(work: &Workspace) -> bool {
    work.targets.iter().any(is_joint) || springs::any_stiff(work)
}

/// Corrects the present numbers at the end of a step (or in place). `work` has the rows of the
/// step, which respond at the moment `acting`, or else at the start of the step.
pub(super) fn correct(
    core: &mut Core,
    mut acting: Option<&mut Moment>,
    work: &mut Workspace,
    probe: &mut Workspace,
    options: &Options,
) -> Result<(), StepError> {
    let time = core.state.time + options.h;
    let joints = !matches!(options.contacts, Contacts::InPlace) && holds(work);
    let mut gaps = measure_gaps(core, work, options, time)?;
    if overlap::separate(core, acting.as_deref_mut(), work, &gaps, options) && !gaps.is_empty() {
        gaps = measure_gaps(core, work, options, time)?;
    }
    let corrects_limits = match options.limits {
        Limits::Free => false,
        Limits::Violated => gaps.iter().any(|limit| limit.gap < -core.settings.contact_tolerance),
        Limits::Listed { limits, .. } => !limits.is_empty(),
    };
    if !joints && !corrects_limits {
        return Ok(());
    }
    let mut at_start = None;
    let acting = match acting {
        None if joints => {
            let moment = at_start.insert(core.moment());
            core.table.walk.x.iter().for_each(|x| moment.x[x.clone()].copy_from_slice(&options.start[x]));
            moment.refresh(core);
            Some(moment)
        }
        acting => acting.filter(|_| joints),
    };
    let mut end = core.moment();
    correct_at(core, &mut end, acting, work, probe, options)?;
    for range in core.table.walk.x.iter() {
        core.state.x[range.clone()].copy_from_slice(&end.x[range]);
    }
    core.moments.extend([Some(end), at_start].into_iter().flatten());
    Ok(())
}

/// Returns the gaps of the limits at the present numbers, if violated ones are to be corrected.
fn measure_gaps(core: &mut Core, work: &Workspace, options: &Options, time: f64) -> Result<Vec<Limit>, StepError> {
    let mut gaps = Vec::new();
    if !work.limits.is_empty() && matches!(options.limits, Limits::Violated) {
        if !constraints(core.objects()).any(|(_, _, constraint)| constraint.reads_part_states()) {
            limits(&core.view(time), &mut gaps)?;
            return Ok(gaps);
        }
        let mut end = core.moment();
        end.refresh_for_constraints(core);
        limits(&end.view(core, time), &mut gaps)?;
        core.moments.push(end);
    }
    Ok(gaps)
}

/// Corrects joints, springs and limits at the moment `end`. `acting` is absent if there are only limits.
fn correct_at(
    core: &mut Core,
    end: &mut Moment,
    mut acting: Option<&mut Moment>,
    work: &mut Workspace,
    probe: &mut Workspace,
    options: &Options,
) -> Result<(), StepError> {
    let kept = unreachable_joints::left(work, |i| work.targets[i].error, options.recovery);
    let pushed = if acting.is_some() { pushed(work) } else { vec![false; core.dof] };
    let extensions = if acting.is_some() { springs::extensions_at_end(work, options.level) } else { Vec::new() };
    let goal = Goal {
        time: core.state.time + options.h,
        level: options.level,
        kept: &kept,
        extensions: &extensions,
        joints: core.settings.stabilize_positions,
        limits: options.limits,
        velocities: Some(&pushed),
    };
    let (arrived, mut moved) = (end.x.clone(), vec![0.0; core.dof]);
    let mut errors = Errors::new(core, work, probe, goal);
    let mut workless = Vec::new();
    if let Some((acting, impulses)) = acting.as_deref_mut().zip(options.impulses) {
        let groups = Group::all(core, work, &errors, true);
        let step = (impulses, &pushed[..], options.h);
        workless = joint_work::advance(core, (end, acting), work, step, &groups, &mut moved);
    }
    errors.measure(core, end)?;
    errors.activate(core);
    let mut groups = Vec::new();
    for _ in 0..MAX_ACTIVE_SETS {
        groups = Group::all(core, work, &errors, true);
        let step = acting.as_deref_mut().map(|acting| (&*work, acting));
        newton(core, end, &mut groups, &mut errors, step, &mut moved)?;
        if !errors.activate(core) {
            break;
        }
    }
    if let Some((acting, impulses)) = acting.zip(options.impulses) {
        let rows = (&*work, &*errors.probe, options.h);
        joint_work::give_back(core, (end, acting), (&workless, &groups), (impulses, &moved), rows);
    }
    let open: Vec<&Group> = groups.iter().filter(|group| group.is_open(core)).collect();
    for group in open {
        let states = [options.start, &arrived];
        unreachable_joints::go_as_moved(end.coordinates(core), &group.ranges, states, &moved, options.h);
        unreachable_joints::report(core, errors.probe, &group.rows);
    }
    Ok(())
}

/// Corrects the groups at the moment `at`, whose errors were just measured, until all are done. The
/// chord method uses the rows of a step, which respond at the moment beside them. Adds all
/// displacements to `moved`: generalized velocities times seconds.
fn newton(
    core: &Core,
    at: &mut Moment,
    groups: &mut [Group],
    errors: &mut Errors,
    mut step: Option<(&Workspace, &mut Moment)>,
    moved: &mut [f64],
) -> Result<(), StepError> {
    groups.iter_mut().for_each(|group| group.left = errors.of(group));
    loop {
        groups.iter_mut().for_each(Group::check_done);
        if groups.iter().all(|group| group.done) {
            return Ok(());
        }
        let (before, moved_before, yielded) = (at.x.clone(), moved.to_vec(), errors.yielded.clone());
        round_at_state(core, at, groups, errors, moved);
        if let Some((work, acting)) = &mut step {
            round_of_step(core, at, (work, acting), groups, errors, moved);
        }
        groups.iter_mut().for_each(|group| group.done |= group.single_round);
        if groups.iter().all(|group| group.done) {
            return Ok(());
        }
        errors.measure(core, at)?;
        let mut undone = false;
        for group in groups.iter_mut().filter(|group| !group.done) {
            if group.judge(errors.of(group)) {
                group.restore((&before, &mut at.x), (&moved_before, moved));
                group.rows.iter().for_each(|&i| errors.yielded[i as usize] = yielded[i as usize]);
                undone = true;
            }
        }
        if undone {
            errors.measure(core, at)?;
        }
    }
}

/// Takes a round with the rows at the state.
fn round_at_state(core: &Core, at: &mut Moment, groups: &[Group], errors: &mut Errors, moved: &mut [f64]) {
    let taken: Vec<&Group> = groups.iter().filter(|group| !group.done && !group.chord).collect();
    for group in &taken {
        group.damp(errors.probe, group.largest(&errors.position));
    }
    let parts: Vec<Round> = taken.iter().map(|group| group.round(&group.rows)).collect();
    let rows = std::mem::take(&mut errors.probe.rows);
    apply(core, at.coordinates(core), (&rows, 0), errors, &parts, moved);
    errors.probe.rows = rows;
}

/// Takes a round with the rows of the step.
fn round_of_step(
    core: &Core,
    at: &mut Moment,
    (work, acting): (&Workspace, &mut Moment),
    groups: &[Group],
    errors: &mut Errors,
    moved: &mut [f64],
) {
    let taken = groups.iter().filter(|group| !group.done && group.chord);
    let parts: Vec<Round> = taken.map(|group| group.round(&group.blocks)).collect();
    let at = at.coordinates_by(core, &mut acting.derived.caches);
    apply(core, at, (&work.rows, work.contact_constraints.len()), errors, &parts, moved);
}

/// Solves for the blocks of all `parts` in `rows`, whose constraints begin at block `first`, and moves the
/// objects.
fn apply(
    core: &Core,
    Coordinates { objects, x, caches, threads }: Coordinates,
    (rows, first): (&Rows, usize),
    errors: &mut Errors,
    parts: &[Round],
    moved: &mut [f64],
) {
    if parts.is_empty() {
        return;
    }
    let (mut dx, mut dv) = (vec![0.0; moved.len()], vec![0.0; moved.len()]);
    let (mut position, mut velocity) = (vec![0.0; rows.len], vec![0.0; rows.len]);
    for (i, block) in rows.blocks[first..].iter().enumerate() {
        (position[block.row as usize], velocity[block.row as usize]) = (errors.position[i], errors.velocity[i]);
    }
    let mut lambda = Vec::new();
    for (c, du, tolerance, positions) in
        [(&position, &mut dx, errors.tolerance.0, true), (&velocity, &mut dv, errors.tolerance.1, false)]
    {
        let violated = |part: &&Round| {
            let least = if part.always { 0.0 } else { tolerance };
            let above = |&b: &u32| c[rows.blocks[b as usize].row as usize].abs() > least;
            (positions || !part.positions_only) && part.blocks.iter().any(above)
        };
        let settings =
            SolverSettings { max_sweeps: SWEEPS, max_relaxations: u32::MAX, tolerance: 0.1 * tolerance, budget: None };
        let (solver, meter) = (core.solver.as_ref(), &core.meter);
        let budget = meter.left(ROUND);
        let islands = parts.iter().filter(violated).map(|part| part.blocks);
        let all = islands.clone().map(<[u32]>::len).sum();
        let solve = |blocks: &[u32], lambda: &mut [f64], du: &mut [f64]| {
            let settings = shared(settings, budget, blocks.len(), all);
            meter.count(solver.solve(rows, blocks, c, lambda, du, settings).relaxations);
        };
        zero(&mut lambda, rows.len);
        each_island(&core.threads, rows, islands, (&mut lambda, du), solve, |()| ());
        if positions {
            errors.yield_to(&rows.blocks[first..], &lambda);
        }
    }
    unwhiten_onto(Coordinates { objects, x: &mut *x, caches: &mut *caches, threads }, &dx, moved);
    shift(Coordinates { objects, x: &mut *x, caches: &mut *caches, threads }, &dx, 1.0);
    push(Coordinates { objects, x, caches, threads }, &dv, &mut Vec::new());
}

/// Returns which coordinates belong to objects of an island in which a contact has a force.
fn pushed(work: &mut Workspace) -> Vec<bool> {
    let mut pushed = vec![false; work.rows.dof];
    if work.contact_constraints.is_empty() {
        return pushed;
    }
    work.islands.build(&work.rows, |_| true);
    for blocks in work.islands.iter() {
        let pushes = |&b: &u32| {
            (b as usize) < work.contact_constraints.len()
                && work.lambda[work.rows.blocks[b as usize].row as usize] != 0.0
        };
        if blocks.iter().any(pushes) {
            let sides = blocks.iter().flat_map(|&b| work.rows.blocks[b as usize].sides());
            sides.for_each(|s| pushed[s.u as usize] = true);
        }
    }
    pushed
}

/// Returns the targets of all constraint rows at the present, and the rows at the middle of the
/// step: free motion of `ahead` seconds, corrected onto the joints. Their Jacobians are those of
/// the middle, their responses those of the moment `acting` (or else of the present), like all rows
/// of a step.
pub(super) fn middle(
    core: &mut Core,
    acting: Option<&mut Moment>,
    level: Level,
    ahead: f64,
) -> Result<(Vec<RowTarget>, Workspace), StepError> {
    let (mut layout, mut rows) = (Workspace::default(), Workspace::default());
    let (start, time) = (core.state.time, core.state.time + ahead);
    lay_rows(core.basis(None, start, None), &mut layout, level)?;
    let present = layout.targets.clone();
    let closing = present_velocities(core, &layout);
    let mut at = core.moment();
    advance(core, &mut at, ahead);
    // open joints aim half-way closer: this shows whether they are unreachable
    let closer = if core.settings.stabilize_positions { core.settings.recovery_speed * ahead } else { 0.0 };
    let kept = |closer: f64| unreachable_joints::left(&layout, |i| present[i].error, closer);
    let aims = [kept(closer), kept(2.0 * closer)];
    let groups = onto_joints(core, &mut at, (&mut layout, &mut rows), (level, time), &aims[0])?;
    let mut far = unreachable(core, &groups);
    if far.is_empty() && groups.iter().any(|g| g.direct() && !g.is_tree && unreachable_joints::weak(&rows, &g.rows)) {
        let (mut end_rows, mut end) = (Workspace::default(), core.moment());
        end.x.copy_from_slice(&at.x);
        advance(core, &mut end, ahead);
        let groups = onto_joints(core, &mut end, (&mut layout, &mut end_rows), (level, time + ahead), &aims[1])?;
        far = unreachable(core, &groups);
        core.moments.push(end);
    }
    map_sides(at.coordinates(core), &mut rows, |body, cache, y, j| body.mul_lt(cache, y, j)); // Jᵀ = Lᵀ·Y
    core.moments.push(at);
    map_sides(core.coordinates(acting), &mut rows, |body, cache, j, y| body.solve_lt(cache, j, y));
    unreachable_joints::soften(&mut rows, &far, unreachable_joints::GIVING);
    rows.closing = closing;
    Ok((present, rows))
}

/// Returns the velocities of the rows of constraints at the present, less their targets.
fn present_velocities(core: &mut Core, layout: &Workspace) -> Vec<f64> {
    let (mut u, mut du, mut c) = (Vec::new(), Vec::new(), Vec::new());
    let rest = vec![0.0; core.dof];
    whiten(core.coordinates(None), &rest, 0.0, &mut u, &mut du);
    row_velocities(&core.threads, &layout.rows, &layout.bias, &u, &mut c);
    layout.rows.blocks.iter().zip(&layout.targets).map(|(block, t)| c[block.row as usize] - t.velocity).collect()
}

/// Advances a moment by `h` seconds of free motion.
fn advance(core: &mut Core, moment: &mut Moment, h: f64) {
    let mut motion = core.integration_of(Some(moment));
    motion.free_motion(h);
    motion.refresh();
}

/// Moves a moment to where joints have the errors `kept`, if they can. `layout` has the same rows
/// at any state; `rows` gets those at the moment.
fn onto_joints(
    core: &Core,
    at: &mut Moment,
    (layout, rows): (&mut Workspace, &mut Workspace),
    (level, time): (Level, f64),
    kept: &[f64],
) -> Result<Vec<Group>, StepError> {
    let goal = Goal { time, level, kept, extensions: &[], joints: true, limits: Limits::Free, velocities: None };
    let mut errors = Errors::new(core, layout, rows, goal);
    errors.measure(core, at)?;
    let mut groups = Group::all(core, layout, &errors, false);
    newton(core, at, &mut groups, &mut errors, None, &mut vec![0.0; core.dof])?;
    Ok(groups)
}

/// Returns the rows of the joints that cannot be closed, sorted.
fn unreachable(core: &Core, groups: &[Group]) -> Vec<u32> {
    let mut rows: Vec<u32> =
        groups.iter().filter(|group| group.is_open(core)).flat_map(|group| group.rows.clone()).collect();
    rows.sort_unstable();
    rows
}

/// Replaces the numbers of every side of every row.
fn map_sides(
    Coordinates { objects, caches, .. }: Coordinates,
    work: &mut Workspace,
    map: impl Fn(&dyn Integratable, &mut Cache, &[f64], &mut [f64]),
) {
    let entries = by_start(objects);
    let Rows { blocks, y, .. } = &mut work.rows;
    for side in blocks.iter().flat_map(|b| b.sides()) {
        let entry = entry_at(&entries, side.u);
        if let Some((entry, body)) = entry.and_then(|e| Some((e, e.object.integratable()?))) {
            let numbers = &mut y[side.y as usize..(side.y + side.dof) as usize];
            let before = numbers.to_vec();
            map(body, &mut caches[entry.place], &before, numbers);
        }
    }
}
