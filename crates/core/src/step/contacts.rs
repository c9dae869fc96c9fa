//! From touches to rows, and from multipliers back to momentum: what both steppers share.

use super::joint_correction;
use super::projection::Projection;
use crate::constraint::builder::{RowBuilder, RowKind, constraints};
use crate::constraint::rows::{RowSet, Rows};
use crate::contact::detect::{ContactConstraint, Detector};
use crate::contact::pair::PredictionMode;
use crate::integrators::context::free_motion;
use crate::object::part_state::PartState;
use crate::object::{Integratable, Level, RowTarget};
use crate::solver::{Islands, SolverSettings, residual};
use crate::world::view::{ObjectId, WorldView};
use crate::world::{Core, StepError};
use tumble_collide::Vec3;

/// Buffers of a step, kept from one to the next. Rows of touches come first, in the order of `contact_constraints`, then those of constraints.
#[derive(Default)]
pub(crate) struct Workspace {
    pub contact_constraints: Vec<ContactConstraint>,
    pub rows: Rows,
    pub islands: Islands,
    /// Row velocities that come from led and static sides.
    pub bias: Vec<f64>,
    /// Targets of the constraints' rows, after those of the touches.
    pub targets: Vec<RowTarget>,
    /// What each target is of.
    pub kinds: Vec<RowKind>,
    /// One-sided rows that their constraints locate, at the present state.
    pub limits: Vec<Limit>,
    /// First target of each constraint, and the end.
    pub first: Vec<usize>,
    /// Right-hand side of a solve.
    pub c: Vec<f64>,
    pub lambda: Vec<f64>,
    /// `Y·λ` of the last solve.
    pub du: Vec<f64>,
    /// Whitened velocity at the start, and what the forces add in a step.
    pub u: Vec<f64>,
    pub du_force: Vec<f64>,
    pub dp: Vec<f64>,
    /// What the projection solves.
    pub projection: Projection,
}

/// A one-sided row of a constraint, whose gap is told at any state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit {
    /// Place of the constraint in the order of constraints, and of the row among its one-sided ones.
    pub key: [u32; 2],
    /// Metres or radians; negative where violated.
    pub gap: f64,
    /// Its target, where the rows made match the gaps told.
    pub target: Option<u32>,
}

/// The one-sided rows that constraints locate, at the present state and sites and at a given time; sorted by key.
pub(crate) fn limits(core: &Core, time: f64, out: &mut Vec<Limit>) -> Result<(), StepError> {
    out.clear();
    let view = WorldView {
        time,
        gravity: core.settings.gravity,
        implicit: core.implicit,
        x: &core.state.x,
        part_states: &core.part_states,
        objects: core.objects(),
    };
    let mut gaps = Vec::new();
    for (place, (_, entry, constraint)) in constraints(core.objects()).enumerate() {
        gaps.clear();
        constraint.gaps(entry.state_range, &view, &mut gaps);
        if gaps.iter().any(|gap| !gap.is_finite()) {
            return Err(StepError::Row {
                object: entry.object.name().to_string(),
                why: "a gap that it tells is not finite".into(),
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

/// Finds the contacts within reach of the next `horizon` seconds.
pub(crate) fn detect(core: &mut Core, horizon: f64, prediction: PredictionMode, out: &mut Vec<ContactConstraint>) {
    let mut detector = Detector {
        objects: core.table.with(&core.state.objects),
        owners: &core.owners,
        part_states: &core.part_states,
        settings: &core.settings,
        pair_materials: &core.pair_materials,
        broad: core.broad.as_mut(),
        scratch: &mut core.detect_scratch,
        needs_wake: &mut core.needs_wake,
    };
    detector.detect(horizon, prediction, out);
    let deepest = out.iter().map(|t| -t.contact.gap).fold(0.0, f64::max);
    core.report.max_penetration = core.report.max_penetration.max(deepest);
    core.report.contacts = out.len() as u32;
}

/// State and sites at another moment of the step.
pub(crate) struct Moment {
    pub x: Vec<f64>,
    pub part_states: Vec<PartState>,
    /// Seconds from the present.
    pub ahead: f64,
}

/// State and sites in `ahead` seconds if no momentum changes (or no velocity, of objects whose state holds velocities); caches stay at the present.
fn look_ahead(core: &mut Core, ahead: f64) -> Moment {
    let start = core.state.x.to_vec();
    let (objects, x) = core.objects_and_x();
    for entry in objects.iter() {
        let x = &mut x[entry.state_range.x.clone()];
        match entry.object.integratable().filter(|b| b.holds_velocity() && entry.moves()) {
            Some(body) => {
                let mut v = vec![0.0; entry.state_range.v.len()];
                body.velocity(x, &mut v);
                body.integrate_positions(x, &v, ahead);
            }
            None => free_motion(&entry, x, ahead),
        }
    }
    core.integration().refresh();
    let moment = Moment { x: core.state.x.to_vec(), part_states: core.part_states.clone(), ahead };
    core.state.x.copy_from_slice(&start);
    core.integration().refresh();
    moment
}

/// Makes the rows of all touches and constraints: the thesis's test impulses. Touches are as they were found; constraints are asked about the
/// state that free motion makes in `ahead` seconds, half the step to come: a direction that turns is then right to second order, where one
/// taken at the start feeds energy to every pendulum (`g·h/2ℓ` of it a second). Where there are joints that state is brought back onto them first. The
/// errors are told for the present state all the same.
pub(crate) fn build_rows(core: &mut Core, work: &mut Workspace, level: Level, ahead: f64) -> Result<(), StepError> {
    if ahead <= 0.0 || constraints(core.objects()).next().is_none() {
        lay_rows(core, work, level, None)?;
        return locate_limits(core, work);
    }
    let middle = look_ahead(core, ahead);
    lay_rows(core, work, level, Some(&middle))?;
    let mut present = Vec::new();
    if work.targets.iter().any(joint_correction::is_joint) {
        let (errors, made) = joint_correction::middle(core, level, ahead)?;
        adopt(core, work, made);
        present = errors;
    }
    if present.len() == work.targets.len() {
        work.targets.iter_mut().zip(present).for_each(|(target, error)| target.error = error);
    } else {
        present_errors(core, work, ahead);
    }
    locate_limits(core, work)
}

/// Rows of the touches at the present and of the constraints at the `moment` given, else at the present too; errors are of that moment.
pub(crate) fn lay_rows(
    core: &Core,
    work: &mut Workspace,
    level: Level,
    moment: Option<&Moment>,
) -> Result<(), StepError> {
    lay_contact_rows(core, work);
    let mut problem = None;
    let mut builder = RowBuilder {
        rows: &mut work.rows,
        bias: &mut work.bias,
        targets: &mut work.targets,
        kinds: &mut work.kinds,
        objects: core.objects(),
        x: &core.state.x,
        part_states: &core.part_states,
        problem: &mut problem,
        owner: ObjectId::default(),
    };
    let (x, part_states, ahead) =
        moment.map_or((&core.state.x[..], &core.part_states, 0.0), |m| (&m.x[..], &m.part_states, m.ahead));
    builder.part_states = part_states;
    let view = WorldView {
        time: core.state.time + ahead,
        gravity: core.settings.gravity,
        implicit: core.implicit,
        x,
        part_states,
        objects: core.objects(),
    };
    let mut first = std::mem::take(&mut work.first);
    first.clear();
    for (id, entry, constraint) in constraints(core.objects()) {
        first.push(builder.targets.len());
        builder.owner = id;
        constraint.rows(entry.state_range, &view, level, &mut builder);
        if let Some(why) = builder.problem.take() {
            return Err(StepError::Row { object: entry.object.name().to_string(), why });
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

/// The rows of the touches, and no others.
fn lay_contact_rows(core: &Core, work: &mut Workspace) {
    work.rows.clear(core.dof);
    work.bias.clear();
    work.targets.clear();
    work.kinds.clear();
    let mut builder = RowBuilder {
        rows: &mut work.rows,
        bias: &mut work.bias,
        targets: &mut work.targets,
        kinds: &mut work.kinds,
        objects: core.objects(),
        x: &core.state.x,
        part_states: &core.part_states,
        problem: &mut None,
        owner: ObjectId::default(),
    };
    for constraint in &work.contact_constraints {
        let set = if constraint.friction > 0.0 { RowSet::Cone { mu: constraint.friction } } else { RowSet::HalfLine };
        builder.rows.push_block(set);
        builder.bias.resize(builder.bias.len() + set.rows(), 0.0);
        let axes = &constraint.frame.axes[..set.rows()];
        for (part_state, point, sign) in
            [(constraint.a, constraint.contact.point, 1.0), (constraint.b, constraint.point_b(), -1.0)]
        {
            let (owner, index) = (core.owners[part_state as usize], part_state as usize);
            let entry = core.objects().at(owner.place as usize);
            let pinned = core.pinned_part_states().filter(|_| entry.moves());
            // the arm stays as it was found: the lowest point of a ball that spins does not turn with it
            let point = pinned.map_or(point, |part_states| {
                point + part_states[index].position() - core.part_states[index].position()
            });
            builder.part_states = pinned.unwrap_or(&core.part_states);
            builder.point_side(&entry, owner.part as usize, &point, axes, sign);
        }
    }
}

/// The touches' rows, and after them the constraints' rows of another workspace.
fn adopt(core: &Core, work: &mut Workspace, made: Workspace) {
    lay_contact_rows(core, work);
    for block in &made.rows.blocks {
        work.rows.push_soft(block.set, block.compliance);
        for side in block.sides() {
            if let Some(y) = work.rows.side(side.u as usize, side.dof as usize) {
                y.copy_from_slice(made.rows.response(side, 0));
            }
        }
    }
    work.bias.extend(made.bias);
    (work.targets, work.kinds, work.first) = (made.targets, made.kinds, made.first);
    make_room(work);
}

/// Gives one-sided rows the gap that their constraint tells for the present state.
fn locate_limits(core: &Core, work: &mut Workspace) -> Result<(), StepError> {
    limits(core, core.state.time, &mut work.limits)?;
    let first = &work.first;
    for of_one in work.limits.chunk_by_mut(|a, b| a.key[0] == b.key[0]) {
        let place = of_one[0].key[0] as usize;
        let one_sided = (first[place]..first[place + 1]).filter(|&i| work.targets[i].set == RowSet::HalfLine);
        let rows: Vec<usize> = one_sided.collect();
        if rows.len() == of_one.len() {
            for (limit, &row) in of_one.iter_mut().zip(&rows) {
                limit.target = Some(row as u32);
                work.targets[row].error = limit.gap;
            }
        }
    }
    Ok(())
}

/// Takes back from the errors of the constraints what free motion does to them in `ahead` seconds, to second order.
fn present_errors(core: &Core, work: &mut Workspace, ahead: f64) {
    let mut u = vec![0.0; core.dof];
    for entry in core.objects().iter().filter(|e| e.moves()) {
        if let Some(body) = entry.object.integratable() {
            body.whiten(&core.state.x[entry.state_range.x.clone()], &mut u[entry.state_range.v.clone()]);
        }
    }
    for (block, target) in work.rows.blocks[work.contact_constraints.len()..].iter().zip(&mut work.targets) {
        let velocity = work.bias[block.row as usize] + work.rows.row_velocity(block, 0, &u);
        target.error += ahead * (0.5 * ahead * target.bias_acceleration - (velocity - target.velocity));
    }
}

/// Writes the whitened velocities and what `dp` (rate of momentum) adds to them in `h`, of everything that moves.
pub(crate) fn whiten(core: &Core, dp: &[f64], h: f64, u: &mut Vec<f64>, du: &mut Vec<f64>) {
    zero(u, core.dof);
    zero(du, core.dof);
    for entry in core.objects().iter().filter(|e| e.moves()) {
        let (Some(body), v) = (entry.object.integratable(), entry.state_range.v.clone()) else { continue };
        let x = core.pinned().unwrap_or(&core.state.x);
        body.whiten(&x[entry.state_range.x.clone()], &mut u[v.clone()]);
        body.whiten_rate(&dp[v.clone()], &mut du[v.clone()]);
        du[v].iter_mut().for_each(|x| *x *= h);
    }
}

/// What `h` seconds of coasting add to the whitened velocity of objects whose state holds velocities, from where they are pinned. Rows of joints
/// are to hold at the end of the step, and aim ahead by it; a contact's point does not go with the part as it turns, and does not.
pub(crate) fn free_motion_change(core: &Core, h: f64) -> Vec<f64> {
    let mut out = vec![0.0; core.dof];
    let Some(middle) = core.pinned() else { return out };
    for entry in core.objects().iter().filter(|e| e.moves()) {
        let Some(body) = entry.object.integratable().filter(|b| b.holds_velocity()) else { continue };
        let (v, mut rate) = (entry.state_range.v.clone(), vec![0.0; entry.state_range.v.len()]);
        body.free_motion_rate(&middle[entry.state_range.x.clone()], &mut rate);
        rate.iter_mut().for_each(|r| *r *= h);
        body.whiten_rate(&rate, &mut out[v]);
    }
    out
}

/// What of the whitened rate of momentum turns velocities and is no acceleration of theirs: `L⁻ᵀ(ṗ − M·v̇)`. Rows of constraints need it taken off.
pub(crate) fn gyroscopic(core: &Core) -> Vec<f64> {
    let (mut out, x) = (vec![0.0; core.dof], core.pinned().unwrap_or(&core.state.x));
    for entry in core.objects().iter().filter(|e| e.moves()) {
        let (Some(body), v) = (entry.object.integratable(), entry.state_range.v.clone()) else { continue };
        let mut turning = vec![0.0; v.len()];
        body.gyroscopic(&x[entry.state_range.x.clone()], &mut turning);
        body.whiten_rate(&turning, &mut out[v]);
    }
    out
}

/// Makes `v` a vector of `n` zeros, keeping its memory.
pub(crate) fn zero(v: &mut Vec<f64>, n: usize) {
    v.clear();
    v.resize(n, 0.0);
}

/// The generalized impulse (or force) that a change `du` of whitened velocity (or acceleration) means.
pub(crate) fn recover(core: &Core, du: &[f64], j: &mut [f64]) {
    j.fill(0.0);
    for entry in core.objects().iter().filter(|e| e.moves()) {
        if let Some(body) = entry.object.integratable() {
            body.recover(&du[entry.state_range.v.clone()], &mut j[entry.state_range.v.clone()]);
        }
    }
}

/// Changes the whitened velocity of the state by `du`; `dp` is the momentum (or velocity) that this is.
pub(crate) fn push(core: &mut Core, du: &[f64], dp: &mut Vec<f64>) {
    zero(dp, core.dof);
    let (objects, x) = core.objects_and_x();
    for entry in objects.iter().filter(|e| e.moves()) {
        let (Some(body), v) = (entry.object.integratable(), entry.state_range.v.clone()) else { continue };
        body.unwhiten_rate(&du[v.clone()], &mut dp[v.clone()]);
        body.kick(&mut x[entry.state_range.x.clone()], &dp[v], 1.0);
    }
}

/// Moves positions by `h·L⁻¹u`, with no effect on kinetic energy: what overlaps goes apart and takes nothing from it.
pub(crate) fn displace(core: &mut Core, u: &[f64], h: f64) {
    each_displaced(core, u, |body, x, v| body.displace(x, v, h));
}

/// The same along the rows of a step, which is how joints are closed: momenta stay, and what that does to the energy the next step undoes.
pub(crate) fn shift(core: &mut Core, u: &[f64], h: f64) {
    each_displaced(core, u, |body, x, v| {
        if body.holds_velocity() { body.displace(x, v, h) } else { body.integrate_positions(x, v, h) }
    });
}

/// `v += L⁻¹·u`.
pub(crate) fn unwhiten_onto(core: &Core, u: &[f64], v: &mut [f64]) {
    let mut velocity = Vec::new();
    for entry in core.objects().iter().filter(|e| e.moves()) {
        let (Some(body), range) = (entry.object.integratable(), entry.state_range.v.clone()) else { continue };
        zero(&mut velocity, range.len());
        body.unwhiten(&u[range.clone()], &mut velocity);
        v[range].iter_mut().zip(&velocity).for_each(|(v, more)| *v += more);
    }
}

fn each_displaced(core: &mut Core, u: &[f64], go: impl Fn(&dyn Integratable, &mut [f64], &[f64])) {
    let mut velocity = Vec::new();
    let (objects, x) = core.objects_and_x();
    for entry in objects.iter().filter(|e| e.moves()) {
        let (Some(body), u) = (entry.object.integratable(), &u[entry.state_range.v.clone()]) else { continue };
        if u.iter().any(|u| *u != 0.0) {
            zero(&mut velocity, u.len());
            body.unwhiten(u, &mut velocity);
            go(body, &mut x[entry.state_range.x.clone()], &velocity);
        }
    }
}

/// `c = Yᵀu + bias`.
pub(crate) fn row_velocities(rows: &Rows, bias: &[f64], u: &[f64], c: &mut Vec<f64>) {
    c.clear();
    c.extend_from_slice(bias);
    rows.add_velocity(u, c);
}

/// Solves the blocks that `keep` names, island by island, from `work.c` and the warm start in `work.lambda`, into `work.du`. `unit` is what
/// one unit of `c` is in m/s, for the report: 1, or the step's length where `c` holds accelerations. Whether any solve ended on a ray.
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
    for blocks in work.islands.iter() {
        let outcome = core.solver.solve(&work.rows, blocks, &work.c, &mut work.lambda, &mut work.du, solver_settings);
        core.report.solved(outcome, unit * residual(&work.rows, blocks, &work.c, &work.lambda, &work.du));
        ray |= outcome.ray;
    }
    ray
}

/// Multipliers from last time, turned into the present contact frames and scaled; what is no longer allowed by the cone is left to the solver.
pub(crate) fn warm_start(core: &Core, work: &mut Workspace, scale: f64) {
    let mut place = 0;
    for (constraint, block) in work.contact_constraints.iter().zip(&work.rows.blocks) {
        if let Some(impulse) = core.state.warm.get(&constraint.key, &mut place) {
            for (row, axis) in block.range().zip(&constraint.frame.axes) {
                work.lambda[row] = scale * axis.dot(&impulse);
            }
            work.lambda[block.row as usize] = work.lambda[block.row as usize].max(0.0);
        }
    }
}

/// The impulse on A of each touch, world axes, for given multipliers.
pub(crate) fn impulses<'a>(work: &'a Workspace, lambda: &'a [f64]) -> impl Iterator<Item = Vec3> + 'a {
    work.contact_constraints.iter().zip(&work.rows.blocks).map(|(constraint, block)| {
        block.range().zip(&constraint.frame.axes).map(|(row, axis)| lambda[row] * axis).sum()
    })
}
