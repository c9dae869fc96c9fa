//! Contacts and constraints to rows, and multipliers to momentum: shared by both steppers.

use super::Moment;
use super::budget::{Allotment, Open};
use super::contact_rows::lay_contact_rows;
use super::correction::{self, Frictionless};
use super::islands::each_island;
use super::patch::PatchMoment;
use super::solves::Solves;
use super::springs;
use crate::constraint::builder::{RowBuilder, RowKind, constraints};
use crate::constraint::rows::{RowSet, Rows};
use crate::contact::detect::{ContactConstraint, Detector, Owner, PartTable};
use crate::contact::laws::ContactLaws;
use crate::contact::pair::Reach;
use crate::derived::{Cache, Derived};
use crate::each_object::{Numbers, Own, each_object};
use crate::integrators::context::free_motion;
use crate::object::part_state::PartState;
use crate::object::{Integratable, Level, RowTarget};
use crate::solver::{Islands, LargestResidual, SolveReport, SolverSettings, largest_residual_on};
use crate::threads::Threads;
use crate::world::view::{ObjectId, WorldView};
use crate::world::{Coordinates, Core, StepError};
use smallvec::SmallVec;
use tumble_collide::Vec3;

/// Buffers of a step. Rows of contacts come first, in the order of `contact_constraints`, then
/// those of constraints.
#[derive(Default)]
pub(crate) struct Workspace {
    pub contact_constraints: Vec<ContactConstraint>,
    pub rows: Rows,
    pub islands: Islands,
    /// Row velocities due to kinematic and static sides.
    pub bias: Vec<f64>,
    /// Targets of the constraints' rows.
    pub targets: Vec<RowTarget>,
    /// Kind of each target.
    pub kinds: Vec<RowKind>,
    /// Limits with a reported gap, at the present state.
    pub limits: Vec<Limit>,
    /// First target of each constraint, and the end.
    pub first: Vec<usize>,
    /// Serial of the object that has each constraint.
    pub owners: Vec<u32>,
    /// Velocity of each constraint row at the present, less its target, m/s or rad/s; none without joints.
    pub closing: Vec<f64>,
    /// Right-hand side of a solve.
    pub c: Vec<f64>,
    pub lambda: Vec<f64>,
    /// `Y·λ` of the last solve.
    pub du: Vec<f64>,
    /// Whitened velocity at the start, and its change in a step due to forces.
    pub u: Vec<f64>,
    pub du_force: Vec<f64>,
    pub dp: Vec<f64>,
    /// Moments of patches in the last solve.
    pub moments: Vec<PatchMoment>,
    /// The rows of the first round of the correction.
    pub frictionless: Frictionless,
}

/// A half-line row of a constraint that reports its gap at any state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit {
    /// Place of the constraint in the order of constraints, and of the row among its half-lines.
    pub key: [u32; 2],
    /// Gap, m or rad; negative if violated.
    pub gap: f64,
    /// Its target; `None` if the numbers of rows and gaps differ.
    pub target: Option<u32>,
}

/// Writes the gaps that constraints report in a view, sorted by key.
pub(crate) fn limits(view: &WorldView, out: &mut Vec<Limit>) -> Result<(), StepError> {
    out.clear();
    let mut gaps = Vec::new();
    for (place, (_, entry, constraint)) in constraints(view.objects).enumerate() {
        gaps.clear();
        constraint.gaps(entry.state_range, view, &mut gaps);
        if gaps.iter().any(|gap| !gap.is_finite()) {
            return Err(StepError::Row {
                object: entry.name.to_string(),
                why: "a gap that it reports is not finite".into(),
            });
        }
        out.extend(gaps.iter().enumerate().map(|(row, gap)| Limit {
            key: [place as u32, row as u32],
            gap: *gap,
            target: None,
        }));
    }
    Ok(())
}

/// Finds the contacts within reach at `moment`, or else at the present.
pub(crate) fn detect(core: &mut Core, moment: Option<&Moment>, reach: Reach, out: &mut Vec<ContactConstraint>) {
    let mut detector = Detector {
        table: PartTable {
            objects: core.table.with(&core.state.objects),
            owners: &core.owners,
            part_states: &moment.map_or(&core.derived, |moment| &moment.derived).part_states,
            pair_materials: &core.pair_materials,
        },
        settings: &core.settings,
        broad: core.broad.as_mut(),
        scratch: &mut core.detect_scratch,
        threads: &core.threads,
        needs_wake: &mut core.needs_wake,
    };
    detector.detect(reach, out);
    let deepest = out.iter().map(|t| -t.contact.gap).fold(0.0, f64::max);
    core.report.max_penetration = core.report.max_penetration.max(deepest);
    core.report.contacts = out.len() as u32;
}

/// Returns the state in `ahead` seconds if no momentum changes (or no velocity, of objects whose
/// state holds velocities), as constraints see it.
fn look_ahead(core: &mut Core, ahead: f64) -> Moment {
    let mut moment = core.moment();
    let Coordinates { objects, x, caches, .. } = moment.coordinates(core);
    for entry in objects.iter() {
        let x = &mut x[entry.state_range.x.clone()];
        match entry.object.integratable().filter(|b| b.holds_velocity() && entry.moves()) {
            Some(body) => {
                let mut v = SmallVec::<[f64; 32]>::from_elem(0.0, entry.state_range.v.len());
                body.velocity(x, &mut v);
                body.integrate_positions(x, &v, ahead);
            }
            None => free_motion(&entry, &mut caches[entry.place], x, ahead),
        }
    }
    moment.refresh_for_constraints(core);
    moment
}

/// The states from which rows are made.
pub(crate) struct Basis<'a> {
    pub owners: &'a [Owner],
    /// State and part states of the detection.
    pub found: (&'a [f64], &'a [PartState]),
    /// Part states at which contacts act on dynamic objects, if other than `found`.
    pub acting: Option<&'a [PartState]>,
    /// The caches that compute the responses.
    pub caches: &'a mut [Cache],
    pub threads: &'a Threads,
    /// The view of constraints.
    pub view: WorldView<'a>,
}

impl Core {
    /// Returns the basis of rows of contacts at the present and of constraints at a time (s) and a
    /// moment, or else the present. Rows respond at the moment `acting`, or else at the present.
    pub(super) fn basis<'a>(
        &'a mut self,
        acting: Option<&'a mut Moment>,
        time: f64,
        seen: Option<&'a Moment>,
    ) -> Basis<'a> {
        let Core { table, state, derived: Derived { part_states, caches }, owners, threads, .. } = self;
        let (gravity, implicit) = (self.settings.gravity, self.implicit);
        let found = (&state.x[..], &part_states[..]);
        let (x, part_states) = seen.map_or(found, |moment| (&moment.x, &moment.derived.part_states));
        let view = WorldView { time, gravity, implicit, x, part_states, objects: table.with(&state.objects), threads };
        let (acting, caches) = match acting {
            Some(Moment { derived: Derived { part_states, caches }, .. }) => (Some(&part_states[..]), caches),
            None => (None, caches),
        };
        Basis { owners, found, acting, caches, threads, view }
    }
}

/// Builds the rows of all contacts and constraints: the thesis's test impulses. Rows respond at the
/// moment `acting`, or else at the present.
///
/// Contacts are those of the detection. Constraints see the state after free motion of `ahead`
/// seconds, half the step to come: a direction that turns is then accurate to second order, and
/// rows of the start would feed energy to every pendulum (`g·h/2ℓ` of it a second). Joints are
/// closed at that state first. Errors are nevertheless those of the present state.
pub(crate) fn build_rows(
    core: &mut Core,
    mut acting: Option<&mut Moment>,
    work: &mut Workspace,
    level: Level,
    ahead: f64,
) -> Result<(), StepError> {
    let time = core.state.time;
    if ahead <= 0.0 || constraints(core.objects()).next().is_none() {
        lay_rows(core.basis(acting, time, None), work, level)?;
        return locate_limits(core, work, time);
    }
    let middle = look_ahead(core, ahead);
    lay_rows(core.basis(acting.as_deref_mut(), time + ahead, Some(&middle)), work, level)?;
    core.moments.push(middle);
    let mut present = Vec::new();
    if work.targets.iter().any(correction::is_joint) {
        let (targets, made) = correction::middle(core, acting.as_deref_mut(), level, ahead)?;
        adopt(core.basis(acting.as_deref_mut(), time, None), work, made);
        present = targets;
    } else if springs::any_stiff(work) {
        let mut layout = Workspace::default();
        lay_rows(core.basis(None, time, None), &mut layout, level)?;
        present = layout.targets;
    }
    if present.len() == work.targets.len() {
        for (target, present) in work.targets.iter_mut().zip(present) {
            (target.error, target.spring) = (present.error, present.spring);
        }
        springs::make_implicit(work, level);
    } else {
        present_errors(core.coordinates(acting), work, ahead);
    }
    locate_limits(core, work, time)
}

/// Builds the rows of the contacts and of the constraints; errors are those of the view.
pub(crate) fn lay_rows(mut basis: Basis, work: &mut Workspace, level: Level) -> Result<(), StepError> {
    lay_contact_rows(&mut basis, work);
    let mut problem = None;
    let Basis { view, .. } = basis;
    let mut builder = RowBuilder {
        rows: &mut work.rows,
        bias: &mut work.bias,
        targets: &mut work.targets,
        kinds: &mut work.kinds,
        objects: view.objects,
        x: basis.found.0,
        caches: basis.caches,
        part_states: view.part_states,
        problem: &mut problem,
        owner: ObjectId::default(),
    };
    let mut first = std::mem::take(&mut work.first);
    first.clear();
    work.owners.clear();
    for (id, entry, constraint) in constraints(view.objects) {
        first.push(builder.targets.len());
        work.owners.push(entry.serial);
        builder.owner = id;
        constraint.rows(entry.state_range, &view, level, &mut builder);
        if let Some(why) = builder.problem.take() {
            return Err(StepError::Row { object: entry.name.to_string(), why });
        }
    }
    first.push(work.targets.len());
    work.first = first;
    make_room(work);
    Ok(())
}

fn make_room(work: &mut Workspace) {
    let n = work.rows.len;
    work.c.resize(n, 0.0);
    zero(&mut work.lambda, n);
}

/// Builds the rows of the contacts, and appends the constraints' rows of another workspace.
fn adopt(mut basis: Basis, work: &mut Workspace, made: Workspace) {
    lay_contact_rows(&mut basis, work);
    for block in &made.rows.blocks {
        work.rows.push_soft(block.set, block.compliance);
        for side in block.sides() {
            if let Some(y) = work.rows.side(side.u as usize, side.dof as usize) {
                y.copy_from_slice(made.rows.response(side, 0));
            }
        }
    }
    work.bias.extend(made.bias);
    (work.targets, work.kinds, work.first, work.owners) = (made.targets, made.kinds, made.first, made.owners);
    work.closing = made.closing;
    make_room(work);
}

/// Builds the rows of the contacts again, which were `old` in number, and keeps those of the
/// constraints. Rows respond at the moment `acting`.
pub(crate) fn lay_contacts_again(core: &mut Core, acting: &mut Moment, work: &mut Workspace, old: usize) {
    let mut rows = std::mem::take(&mut work.rows);
    let constraints = rows.blocks.split_off(old);
    let first = constraints.first().map_or(rows.len, |block| block.row as usize);
    rows.blocks = constraints;
    let made = Workspace {
        rows,
        bias: work.bias[first..].to_vec(),
        targets: std::mem::take(&mut work.targets),
        kinds: std::mem::take(&mut work.kinds),
        first: std::mem::take(&mut work.first),
        owners: std::mem::take(&mut work.owners),
        closing: std::mem::take(&mut work.closing),
        ..Workspace::default()
    };
    let time = core.state.time;
    adopt(core.basis(Some(acting), time, None), work, made);
}

/// Sets the errors of half-lines to the gaps that their constraints report at the present state and
/// a time (s).
pub(super) fn locate_limits(core: &Core, work: &mut Workspace, time: f64) -> Result<(), StepError> {
    limits(&core.view(time), &mut work.limits)?;
    let first = &work.first;
    for of_one in work.limits.chunk_by_mut(|a, b| a.key[0] == b.key[0]) {
        let place = of_one[0].key[0] as usize;
        let one_sided = (first[place]..first[place + 1]).filter(|&i| work.targets[i].set == RowSet::HalfLine);
        let rows: SmallVec<[usize; 64]> = one_sided.collect();
        if rows.len() == of_one.len() {
            for (limit, &row) in of_one.iter_mut().zip(&rows) {
                limit.target = Some(row as u32);
                work.targets[row].error = limit.gap;
            }
        }
    }
    Ok(())
}

/// Subtracts from the errors of the constraints their change by free motion of `ahead` seconds, to
/// second order.
fn present_errors(Coordinates { objects, x, caches, .. }: Coordinates, work: &mut Workspace, ahead: f64) {
    let mut u = SmallVec::<[f64; 64]>::from_elem(0.0, objects.table.dof());
    for entry in objects.iter().filter(|e| e.moves()) {
        if let Some(body) = entry.object.integratable() {
            body.whitened_velocity(
                &mut caches[entry.place],
                &x[entry.state_range.x.clone()],
                &mut u[entry.state_range.v.clone()],
            );
        }
    }
    let rows = work.rows.blocks[work.contact_constraints.len()..].iter().zip(&mut work.targets);
    // springs have no error to correct
    for (block, target) in rows.filter(|(_, target)| target.compliance == 0.0 || target.set == RowSet::HalfLine) {
        let velocity = work.bias[block.row as usize] + work.rows.row_velocity(block, 0, &u);
        target.error += ahead * (0.5 * ahead * target.bias_acceleration - (velocity - target.velocity));
    }
}

/// Writes the whitened velocities of all dynamic objects, and their change in `h` seconds by the
/// rate of momentum `dp`.
pub(crate) fn whiten(
    Coordinates { objects, x, caches, threads }: Coordinates,
    dp: &[f64],
    h: f64,
    u: &mut Vec<f64>,
    du: &mut Vec<f64>,
) {
    zero(u, dp.len());
    zero(du, dp.len());
    let numbers = Numbers { caches, v: u, w: du, ..Numbers::default() };
    each_object(threads, objects, numbers, |entry, Own { cache, v: u, w: du, .. }| {
        let Some(body) = entry.object.integratable().filter(|_| entry.moves()) else { return };
        body.whitened_velocity(cache, &x[entry.state_range.x.clone()], u);
        body.whiten_change(cache, &dp[entry.state_range.v.clone()], du);
        du.iter_mut().for_each(|x| *x *= h);
    });
}

/// Returns the change of whitened velocity by `h` seconds of free motion, of objects whose state
/// holds velocities. Rows of joints hold at the end of the step and take it into account. The point
/// of a contact does not turn with the part, so its rows do not.
pub(crate) fn free_motion_change(Coordinates { objects, x, caches, .. }: Coordinates, h: f64) -> Vec<f64> {
    let mut out = vec![0.0; objects.table.dof()];
    for entry in objects.iter().filter(|e| e.moves()) {
        let Some(body) = entry.object.integratable().filter(|b| b.holds_velocity()) else { continue };
        let v = entry.state_range.v.clone();
        let mut rate = SmallVec::<[f64; 32]>::from_elem(0.0, v.len());
        let cache = &mut caches[entry.place];
        body.free_motion_rate(cache, &x[entry.state_range.x.clone()], &mut rate);
        rate.iter_mut().for_each(|r| *r *= h);
        body.whiten_change(cache, &rate, &mut out[v]);
    }
    out
}

/// Returns the part of the whitened rate of momentum that is no acceleration, `L⁻ᵀ(ṗ − M·v̇)`. Rows
/// of constraints exclude it. `None` if it is 0.
pub(crate) fn gyroscopic(Coordinates { objects, x, caches, .. }: Coordinates) -> Option<Vec<f64>> {
    let (mut out, dof) = (None, objects.table.dof());
    let mut turning = SmallVec::<[f64; 32]>::new();
    for entry in objects.iter().filter(|e| e.moves()) {
        let (Some(body), v) = (entry.object.integratable(), entry.state_range.v.clone()) else { continue };
        turning.clear();
        turning.resize(v.len(), 0.0);
        body.gyroscopic(&x[entry.state_range.x.clone()], &mut turning);
        if turning.iter().any(|t| *t != 0.0) {
            let out = out.get_or_insert_with(|| vec![0.0; dof]);
            body.whiten_change(&mut caches[entry.place], &turning, &mut out[v]);
        }
    }
    out
}

/// Makes `v` a vector of `n` zeros, keeping its memory.
pub(crate) fn zero(v: &mut Vec<f64>, n: usize) {
    v.clear();
    v.resize(n, 0.0);
}

/// Writes the generalized impulse (or force) of a change `du` of whitened velocity (or
/// acceleration).
pub(crate) fn recover(Coordinates { objects, caches, .. }: Coordinates, du: &[f64], j: &mut [f64]) {
    j.fill(0.0);
    for entry in objects.iter().filter(|e| e.moves()) {
        if let Some(body) = entry.object.integratable() {
            body.mul_lt(
                &mut caches[entry.place],
                &du[entry.state_range.v.clone()],
                &mut j[entry.state_range.v.clone()],
            );
        }
    }
}

/// Changes the whitened velocity of the state by `du`. `dp` becomes the change of momentum (or
/// velocity).
pub(crate) fn push(Coordinates { objects, x, caches, threads }: Coordinates, du: &[f64], dp: &mut Vec<f64>) {
    zero(dp, du.len());
    let numbers = Numbers { caches, x, v: dp, ..Numbers::default() };
    each_object(threads, objects, numbers, |entry, Own { cache, x, v: dp, .. }| {
        let Some(body) = entry.object.integratable().filter(|_| entry.moves()) else { return };
        body.unwhiten_change(cache, &du[entry.state_range.v.clone()], dp);
        body.kick(x, dp, 1.0);
    });
}

/// Moves positions by `h·L⁻¹u` and keeps the kinetic energy: for overlap.
pub(crate) fn displace(at: Coordinates, u: &[f64], h: f64) {
    each_displaced(at, u, |body, cache, x, v| body.displace(cache, x, v, h));
}

/// Moves positions by `h·L⁻¹u` and keeps momenta: for joints. The change of energy is returned
/// (`correction/joint_work.rs`) or reversed in the next step.
pub(crate) fn shift(at: Coordinates, u: &[f64], h: f64) {
    each_displaced(at, u, |body, cache, x, v| {
        if body.holds_velocity() { body.displace(cache, x, v, h) } else { body.integrate_positions(x, v, h) }
    });
}

/// Adds `L⁻¹·u` to `v`.
pub(crate) fn unwhiten_onto(Coordinates { objects, caches, .. }: Coordinates, u: &[f64], v: &mut [f64]) {
    let mut velocity = Vec::new();
    for entry in objects.iter().filter(|e| e.moves()) {
        let (Some(body), range) = (entry.object.integratable(), entry.state_range.v.clone()) else { continue };
        zero(&mut velocity, range.len());
        body.solve_l(&mut caches[entry.place], &u[range.clone()], &mut velocity);
        v[range].iter_mut().zip(&velocity).for_each(|(v, more)| *v += more);
    }
}

fn each_displaced(
    Coordinates { objects, x, caches, threads }: Coordinates,
    u: &[f64],
    go: impl Fn(&dyn Integratable, &mut Cache, &mut [f64], &[f64]) + Sync,
) {
    if u.iter().all(|u| *u == 0.0) {
        return;
    }
    let numbers = Numbers { caches, x, ..Numbers::default() };
    each_object(threads, objects, numbers, |entry, Own { cache, x, .. }| {
        let Some(body) = entry.object.integratable().filter(|_| entry.moves()) else { return };
        let u = &u[entry.state_range.v.clone()];
        if u.iter().any(|u| *u != 0.0) {
            let mut velocity = SmallVec::<[f64; 6]>::from_elem(0.0, u.len());
            body.solve_l(cache, u, &mut velocity);
            go(body, cache, x, &velocity);
        }
    });
}

/// Computes `c = Yᵀu + bias`.
pub(crate) fn row_velocities(threads: &Threads, rows: &Rows, bias: &[f64], u: &[f64], c: &mut Vec<f64>) {
    c.clear();
    c.extend_from_slice(bias);
    rows.add_velocity_on(threads, 0..rows.blocks.len(), u, c);
}

/// Islands of more blocks share the relaxations of the settings; smaller ones have as many each.
pub(super) const OWN_BUDGET: usize = 40;

/// Solves the blocks that satisfy `keep`, island by island, from `work.c` and the warm start in
/// `work.lambda`; `work.du` receives `Y·λ`. `unit` converts `c` to m/s for the report: 1, or the
/// length of the step if `c` holds accelerations. Returns whether any solve ended on a ray. With a
/// budget in the settings this solve costs no more, or one sweep.
pub(crate) fn solve(
    core: &mut Core,
    work: &mut Workspace,
    solver_settings: SolverSettings,
    unit: f64,
    keep: impl Fn(usize) -> bool,
) -> bool {
    zero(&mut work.du, core.dof);
    work.islands.build(&work.rows, keep);
    let mut ray = false;
    let Workspace { rows, islands, c, lambda, du, .. } = work;
    let shared = islands.iter().map(<[u32]>::len).filter(|n| *n > OWN_BUDGET).sum();
    let (solver, threads, mut solves) = (
        &core.solver,
        &core.threads,
        Solves::new(&mut core.report, core.solver.as_ref(), unit * solver_settings.tolerance),
    );
    let settings_of = |blocks: usize| {
        if blocks > OWN_BUDGET { solver_settings.shared_by(blocks, shared) } else { solver_settings }
    };
    let solve = |blocks: &[u32], lambda: &mut [f64], du: &mut [f64], settings: SolverSettings| {
        let outcome = solver.solve(rows, blocks, c, lambda, du, settings);
        core.meter.count(outcome.relaxations);
        (outcome, largest_residual_on(threads, rows, blocks, (c, lambda, du)))
    };
    let add = |(outcome, mut largest): Solved| {
        largest.residual *= unit;
        solves.add(Some((outcome, largest)));
        ray |= outcome.ray;
    };
    match solver_settings.budget {
        None => {
            let solve = |blocks: &[u32], lambda: &mut [f64], du: &mut [f64]| {
                solve(blocks, lambda, du, settings_of(blocks.len()))
            };
            each_island(threads, rows, islands.iter(), (lambda, du), solve, add);
        }
        Some(budget) => {
            let keep_warm = |blocks: &[u32], lambda: &mut [f64], du: &mut [f64]| {
                blocks.iter().for_each(|&b| rows.apply_block(&rows.blocks[b as usize], lambda, du));
                largest_residual_on(threads, rows, blocks, (c, lambda, du))
            };
            let mut solved: Vec<Solved> = Vec::with_capacity(islands.len());
            each_island(threads, rows, islands.iter(), (&mut *lambda, &mut *du), keep_warm, |largest| {
                let converged = largest.residual <= solver_settings.tolerance;
                solved.push((SolveReport { iterations: 0, converged, ray: false, relaxations: 0 }, largest));
            });
            let mut left = budget;
            for round in 0..ROUNDS {
                let open = |(island, (outcome, largest)): (usize, &Solved)| {
                    let goes_on = !outcome.converged && !outcome.ray && (round == 0 || outcome.relaxations > 0);
                    let blocks = islands.get(island).len();
                    goes_on.then_some(Open { island, blocks, residual: largest.residual })
                };
                let open: Vec<Open> = solved.iter().enumerate().filter_map(open).collect();
                if open.is_empty() {
                    break;
                }
                let allotted = Allotment::new(open, left, round == 0, solver_settings.max_sweeps).islands;
                let first_blocks: Vec<u32> = allotted.iter().map(|(island, _)| islands.get(*island)[0]).collect();
                let solve = |blocks: &[u32], lambda: &mut [f64], du: &mut [f64]| {
                    for side in blocks.iter().flat_map(|&b| rows.blocks[b as usize].sides()) {
                        du[side.u as usize..(side.u + side.dof) as usize].fill(0.0);
                    }
                    let budget = first_blocks.binary_search(&blocks[0]).map_or(0, |i| allotted[i].1);
                    solve(blocks, lambda, du, SolverSettings { budget: Some(budget), ..settings_of(blocks.len()) })
                };
                let mut next = allotted.iter();
                let some = allotted.iter().map(|(island, _)| islands.get(*island));
                each_island(threads, rows, some, (&mut *lambda, &mut *du), solve, |(outcome, largest)| {
                    left = left.saturating_sub(outcome.relaxations);
                    if let Some((island, _)) = next.next() {
                        solved[*island] = (outcome, largest);
                    }
                });
            }
            solved.into_iter().for_each(add);
        }
    }
    solves.finish(core.table.with(&core.state.objects), rows, islands);
    ray
}

/// Result of a solve, with its largest residual.
type Solved = (SolveReport, LargestResidual);

/// Number of rounds in which islands that do not converge get what others leave of a budget.
const ROUNDS: u32 = 8;

/// Returns the impulse on A of each contact, world axes, for given multipliers, with that of its adhesion
/// in `h` seconds.
pub(crate) fn impulses<'a>(work: &'a Workspace, lambda: &'a [f64], h: f64) -> impl Iterator<Item = Vec3> + 'a {
    work.contact_constraints.iter().zip(&work.rows.blocks).map(move |(constraint, block)| {
        let pull = h * ContactLaws::pull(&constraint.laws) * constraint.frame.axes[0];
        block.range().zip(&constraint.frame.axes).map(|(row, axis)| lambda[row] * axis).sum::<Vec3>() - pull
    })
}
