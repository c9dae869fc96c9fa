//! The time-stepping stepper: fixed cost, one detection and one solve per sub-step (Moreau's
//! midpoint rule with impacts timed inside the step).
//!
//! ```text
//! x_½  = x_0 after free motion of h/2;   a = forces at x_½              (a body without contacts takes a Verlet step: symplectic, second order)
//! detect at x_0 within reach of the step; again with the velocities after the impacts, if there are any
//! u_f  = u_0 + Δu_impact + h·a                                            impacts by reflection, of contacts that free motion closes within the step
//! find λ:  w = Yᵀ(u_f + Yλ),   w_n + gap/h ≥ 0 ⟂ λ_n ≥ 0,   friction       (u_1 = u_f + Yλ)
//! x_1  = x_0 after free motion of t_i with u_0, then of h − t_i with u_1    t_i = time of the body's first impact, else h/2
//! u_1 += Δu_rebound,  without the displacement by it                       contacts that closed after t_i
//! correct: gap_1 ≥ 0, joints, limits
//! ```
//!
//! With `t_i = h/2` the displacement is the mean of the old and the new velocity: second order on
//! lasting contacts too (a box slides to its stop with the right deceleration). With an impact the
//! two free motions and the term `(t_i − h/2)·h·a` add up to the parabola before and the parabola
//! after. Forces of contacts that hold a body after an impact act in the mean of the rest of the step
//! (`time_stepping/sustained.rs`).
//!
//! Impulses act where the body is at that time: mass matrix, rows and the velocity before the
//! impulse are those of `x_½`, or of `x_0` after free motion of `t_i` if there is an impact. Free
//! motion keeps kinetic energy, contact impulses dissipate some, and displacements keep it, so no
//! stage adds energy. Impulses on objects whose state holds velocities (articulated bodies) always
//! act at `x_½`, so that their caches are computed once. These objects take free motions of h/2 and
//! h/2, and are displaced by the rest, (t_i − h/2)·(v_0 − v_1), at the end.
//!
//! A contact bounces only if it approaches faster than its own pressing acceleration gives in a
//! step, or, if it carried a force before, faster than the forces of the step move either body. Large
//! groups of touching bodies have no impact phase (`time_stepping/impacts.rs`). Bodies that impacts of one step connect share the time `t_i` of the first of them. The
//! contacts that close later in the step have speculative rows, with the gap at `t_i` over the time
//! that is left, so they arrive at the surface at the end of the step and do not overlap. Their
//! restitution follows there: `Δu_rebound` gives them the separation speed `e·v` of the speed `v`
//! that the rows have stopped, as far as their energy before allows. A shock thus passes one such
//! gap per step. Elastic contacts keep the energy exactly: they have no row in this step, their
//! overlap is corrected at its end, and they strike at the start of the next.

mod at_end;
mod impacts;
mod lift;
mod moving;
mod passing;
mod sustained;

use super::adhesion::adhere;
use super::contacts::{build_rows, detect, displace, impulses, push, shift, whiten};
use super::impact::{self, Candidate, Part};
use super::patch::solve_patches;
use super::warm_start::{row_starts, warm_start};
use super::{Moment, StepContext, Stepper, Workspace};
use crate::constraint::rows::{Block, RowSet};
use crate::contact::detect::ContactConstraint;
use crate::contact::pair::{PredictionMode, Reach};
use crate::contact::time_of_impact::time_contacts;
use crate::each_object::{Numbers, each_object};
use crate::integrators::context::free_motion;
use crate::linearize::{ROUNDING, Switch};
use crate::object::part_state::PartState;
use crate::object::{Level, RowTarget};
use crate::sensor::loads::SubstepForces;
use crate::settings::Settings;
use crate::solver::SolverSettings;
use crate::world::view::Entry;
use crate::world::{Coordinates, Core, StepError};
use at_end::Taken;
use moving::FreeTerms;

/// The default stepper, `time_stepping`.
#[derive(Default)]
pub struct TimeStepping {
    work: Workspace,
    probe: Workspace,
    /// Contacts at the end of the step.
    end: Workspace,
    taken: Taken,
    /// Part states before the last correction of overlap at the end.
    before: Vec<PartState>,
    x0: Vec<f64>,
    /// Fraction of the step before the first impact, per coordinate; negative without an impact.
    impact_fraction: Vec<f64>,
    candidates: Vec<Candidate>,
    /// Impact impulse per row.
    impact: Vec<f64>,
    buffers: Buffers,
}

/// Working memory of a step: whitened velocities and sums of them.
#[derive(Default)]
struct Buffers {
    /// Contacts at the start of the step, before fast pairs are followed.
    predicted: Vec<ContactConstraint>,
    /// Velocity after the impacts, then at the end.
    after: Vec<f64>,
    /// Row velocities before the impacts, and their change due to forces.
    before: Vec<f64>,
    gain: Vec<f64>,
    change: Vec<f64>,
    dp: Vec<f64>,
    parabola: Vec<f64>,
    rest: Vec<f64>,
    mean: Vec<f64>,
    /// Velocity at the end of the step.
    end: Vec<f64>,
    /// Displacement by the correction of overlap, per second.
    moved: Vec<f64>,
    /// Multipliers of impacts and contacts.
    total: Vec<f64>,
    /// Whether each block is solved.
    keep: Vec<bool>,
    /// Limits that are left out of the solve until they would be passed.
    far: Vec<usize>,
    /// Parts of the contacts in the rebound.
    parts: Vec<Part>,
    /// Change of velocity by the rebound.
    late: Vec<f64>,
    /// Change of velocity by what holds bodies after an impact.
    sustained: Vec<f64>,
}

impl Stepper for TimeStepping {
    fn name(&self) -> &'static str {
        "time_stepping"
    }

    fn step(&mut self, frame: StepContext) -> Result<(), StepError> {
        let core = frame.core;
        let substeps = core.settings.substeps * core.division;
        let h = core.settings.dt / substeps as f64;
        (0..substeps).try_for_each(|_| self.substep(core, h))
    }

    fn undivided_step(&self, settings: &Settings) -> Option<f64> {
        Some(settings.dt / f64::from(settings.substeps))
    }

    fn resists_turning(&self) -> bool {
        true
    }

    fn fork(&self) -> Box<dyn Stepper> {
        Box::<TimeStepping>::default()
    }
}

impl TimeStepping {
    /// Takes one sub-step of `h` seconds.
    pub(crate) fn substep(&mut self, core: &mut Core, h: f64) -> Result<(), StepError> {
        (core.implicit, core.by_impulses) = (true, true);
        core.meter.start_substep(core.state.time, h);
        let mut middle = core.moment();
        core.resist_turning(&mut middle, h);
        self.advance(core, &mut middle, h)?;
        core.stop_resisting(&mut middle);
        core.moments.push(middle);
        core.finish_substep(h)?;
        self.separate_at_end(core, h)
    }

    /// Writes the state at the end of the sub-step. `middle` becomes the moment at which impulses
    /// act.
    fn advance(&mut self, core: &mut Core, middle: &mut Moment, h: f64) -> Result<(), StepError> {
        self.smooth_forces(core, middle, h)?;
        detect(core, None, Reach::in_time(h, PredictionMode::Each), &mut self.work.contact_constraints);
        let (found, predicted) = (&mut self.work.contact_constraints, &mut self.buffers.predicted);
        time_contacts(core.part_table(), (&core.settings, &core.threads), h, found, predicted);
        moving::move_contacts(core, found, 0.5 * h);
        build_rows(core, Some(&mut *middle), &mut self.work, Level::Velocity { h }, 0.5 * h)?;
        let mut u = std::mem::take(&mut self.work.u);
        let mut du_force = std::mem::take(&mut self.work.du_force);
        whiten(middle.coordinates(core), &self.work.dp, h, &mut u, &mut du_force);
        adhere(&mut self.work, core.settings.drift_tolerance, h, &mut du_force);
        let mut after = std::mem::take(&mut self.buffers.after);
        self.impacts(core, middle, h, &mut u, &mut du_force, &mut after)?;
        self.look_again(core, middle, h, &u, &after);
        self.contacts(core, middle, h, &u, &mut after, &du_force)?;
        self.rebound(core, &after, &du_force);
        self.commit(core, middle, h, &u, &after, &du_force)?;
        (self.work.u, self.work.du_force, self.buffers.after) = (u, du_force, after);
        Ok(())
    }

    /// Writes the rate of momentum at the midpoint to `work.dp`, and the midpoint to `middle`. The
    /// present part states receive its accelerations.
    fn smooth_forces(&mut self, core: &mut Core, middle: &mut Moment, h: f64) -> Result<(), StepError> {
        core.table.walk.x.copy(&core.state.x, &mut self.x0);
        self.work.dp.resize(core.dof, 0.0);
        let time = core.state.time;
        // by the caches of the present, which is where the motion begins
        let Coordinates { objects, caches, threads, .. } = core.coordinates(None);
        let numbers = Numbers { caches, x: &mut middle.x, ..Numbers::default() };
        each_object(threads, objects, numbers, |entry, own| free_motion(entry, own.cache, own.x, 0.5 * h));
        let mut motion = core.integration_of(Some(&mut *middle));
        motion.evaluate(time + 0.5 * h, &mut self.work.dp);
        motion.split_rates(&mut self.work.dp, h);
        core.check_finite(&self.work.dp, Some(&mut *middle))?;
        for parts in core.table.walk.parts.iter() {
            let middle = &middle.derived.part_states[parts.clone()];
            for (now, middle) in core.derived.part_states[parts].iter_mut().zip(middle) {
                (now.acceleration, now.angular_acceleration) = (middle.acceleration, middle.angular_acceleration);
            }
        }
        Ok(())
    }

    /// Adds the forces and solves all contacts and constraints of the step: `u` becomes the
    /// velocity at its end. Limits that free motion does not bring half way to their stops are left out,
    /// unless the solution would pass one.
    fn contacts(
        &mut self,
        core: &mut Core,
        middle: &mut Moment,
        h: f64,
        u0: &[f64],
        u: &mut [f64],
        du_force: &[f64],
    ) -> Result<(), StepError> {
        let work = &mut self.work;
        let Buffers { before, gain: first, parts, keep, far, .. } = &mut self.buffers;
        let moves = work.contact_constraints.iter().any(|t| t.moved.changes());
        let free =
            if work.targets.is_empty() && !moves { FreeTerms::default() } else { FreeTerms::new(middle, core, h) };
        let (threads, contacts, blocks) = (&core.threads, work.contact_constraints.len(), work.rows.blocks.len());
        first.clone_from(&work.bias);
        work.rows.add_velocity_on(threads, 0..contacts, u0, first);
        u.iter_mut().zip(du_force).for_each(|(u, du)| *u += du);
        work.c.clone_from(&work.bias);
        work.rows.add_velocity_on(threads, 0..contacts, u, &mut work.c);
        before.clone_from(&work.c);
        // rows of constraints hold after the half of free motion that is left
        let ends: Option<Vec<f64>> =
            free.change.as_ref().map(|change| u.iter().zip(change).map(|(u, c)| u + c).collect());
        work.rows.add_velocity_on(threads, contacts..blocks, ends.as_deref().unwrap_or(u), &mut work.c);
        let rounding = ROUNDING / h;
        parts.clear();
        parts.resize(work.contact_constraints.len(), Part::default());
        keep.clear();
        keep.resize(work.rows.blocks.len(), true);
        for (i, constraint) in work.contact_constraints.iter().enumerate() {
            let block = &work.rows.blocks[i];
            let (row, candidate) = (block.row as usize, self.candidates.get(i));
            let struck = self.impact[row] > 0.0 || candidate.is_some_and(|candidate| candidate.stops);
            let s = block.sides().iter().map(|side| self.impact_fraction[side.u as usize]).fold(0.0, f64::max);
            let (rate, turning) = moving::gap_rate(work, i, &free, (first[row], h));
            let closed = h * s * 0.5 * (first[row] + rate);
            let (gap, left) = (constraint.gap_of_row() + closed, h * (1.0 - s).max(1e-9));
            let rest_speed = candidate.map_or(f64::INFINITY, |candidate| candidate.rest_speed);
            let crowd = candidate.is_some_and(|candidate| candidate.crowd);
            let apart = !struck && (crowd || constraint.contact.gap > core.settings.drift_tolerance);
            if apart && work.c[row] < -2.0 * rest_speed && gap + left * work.c[row] < 0.0 {
                keep[i] = constraint.restitution <= impact::ELASTIC;
                parts[i].rebound = if keep[i] { -constraint.restitution * work.c[row] } else { 0.0 };
            }
            // nothing presses an elastic contact, so it has no force but that of its impact
            let unpressed = constraint.restitution > impact::ELASTIC && rest_speed <= impact::SLOWEST_BOUNCE;
            keep[i] &= struck || !unpressed;
            // without an impact the impulse acts in the middle of the step: what forces bring back in it gets to
            // the surface with the mean of both velocities
            let pressed = first[row] - before[row];
            // a gap that opens along surfaces that curve away opens faster than that of the planes of its row
            let curves = rate > 0.0 && !moving::touches(core, constraint, 0.5 * h);
            let mean = 2.0 * gap / h + rate + if curves { h * turning.max(0.0) } else { 0.0 };
            let all = core.branches.above(Switch::Gap, Some(i), mean - pressed, rounding);
            let by_mean = if s > 0.0 { 0.0 } else { [mean, pressed][usize::from(all)] };
            let later = core.branches.above(Switch::Gap, Some(i), by_mean - gap / left, rounding);
            let reach = if later { by_mean } else { gap / left };
            let open = core.branches.above(Switch::Gap, Some(i), if struck { 0.0 } else { reach }, rounding);
            work.c[row] += if open { reach } else { 0.0 };
        }
        for i in 0..work.contact_constraints.len() {
            let constraint = &work.contact_constraints[i];
            let stops = self.candidates.get(i).is_some_and(|candidate| candidate.stops);
            if !stops && constraint.moved.changes() && moving::touches(core, constraint, 0.5 * h) {
                let block = &work.rows.blocks[i];
                let comes = before[block.row as usize] - work.rows.row_velocity(block, 0, du_force);
                moving::add_motion(work, i, &free, (comes, h));
            }
        }
        far.clear();
        let constraints = (work.contact_constraints.len()..).zip(&work.targets);
        for ((b, target), block) in constraints.zip(&work.rows.blocks[work.contact_constraints.len()..]) {
            if target.inertial {
                let (change, turning) = free.of_row(&work.rows, block, 0);
                // from the velocity after impacts to that at the end of the step
                let forced = work.rows.row_velocity(block, 0, du_force);
                work.c[block.row as usize] = forced + 2.0 * change - h * turning + h * target.bias_acceleration;
                continue;
            }
            work.c[block.row as usize] -= 0.5 * h * free.turning_of_row(&work.rows, block, 0);
            let open = target.set == RowSet::HalfLine && core.branches.above(Switch::Gap, None, target.error, ROUNDING);
            let reach = if open { target.error / h } else { 0.0 };
            if reach > 0.0 && work.c[block.row as usize] > -0.5 * reach && target.compliance == 0.0 {
                far.push(b);
            }
            // rows are those of the middle of the step, and go on turning for the other half
            let turns = target.set != RowSet::HalfLine || open_in_the_middle(work, block, target, u0, h) <= 0.0;
            let turning = if turns { 0.5 * h * target.bias_acceleration } else { 0.0 };
            work.c[block.row as usize] += reach + turning - target.velocity;
        }
        warm_start(core, work, h);
        let settings =
            SolverSettings { budget: core.meter.for_solve(work.rows.blocks.len()), ..core.settings.solver_settings };
        far.retain(|&b| work.lambda[work.rows.blocks[b].row as usize] == 0.0);
        far.iter().for_each(|&b| keep[b] = false);
        solve_patches(core, Some(&mut *middle), work, (settings, 1.0), keep, u)?;
        far.iter().for_each(|&b| keep[b] = true);
        let passed = |&b: &usize| {
            let block = &work.rows.blocks[b];
            work.c[block.row as usize] + work.rows.row_velocity(block, 0, &work.du) < 0.0
        };
        if far.iter().any(passed) {
            solve_patches(core, Some(middle), work, (settings, 1.0), keep, u)?;
        }
        keep.iter().zip(&work.rows.blocks).filter(|(k, _)| !**k).for_each(|(_, b)| work.lambda[b.range()].fill(0.0));
        self.find_sustained(core, settings, du_force);
        u.iter_mut().zip(&self.work.du).for_each(|(u, du)| *u += du);
        Ok(())
    }

    /// Writes the state at the end of the step.
    fn commit(
        &mut self,
        core: &mut Core,
        middle: &mut Moment,
        h: f64,
        u0: &[f64],
        u1: &[f64],
        du_force: &[f64],
    ) -> Result<(), StepError> {
        let impact_fraction = |i: usize| if self.impact_fraction[i] < 0.0 { 0.5 } else { self.impact_fraction[i] };
        let Buffers { change, dp, parabola, rest, mean, late, end, sustained, .. } = &mut self.buffers;
        let n = u0.len();
        write(change, n, |i| u1[i] - u0[i]);
        let before =
            |e: &Entry| e.state_range.v.clone().next().filter(|_| !in_the_middle(e)).map_or(0.5, impact_fraction);
        let move_freely = |Coordinates { objects, x, caches, threads }: Coordinates,
                           share: &(dyn Fn(&Entry) -> f64 + Sync)| {
            let numbers = Numbers { caches, x, ..Numbers::default() };
            each_object(threads, objects, numbers, |entry, own| free_motion(entry, own.cache, own.x, h * share(entry)));
        };
        for entry in core.table.with(&core.state.objects).iter().filter(|e| in_the_middle(e)) {
            core.state.x[entry.state_range.x.clone()].copy_from_slice(&middle.x[entry.state_range.x.clone()]);
        }
        let to_impact = |entry: &Entry| if in_the_middle(entry) { 0.0 } else { before(entry) };
        move_freely(core.coordinates(Some(&mut *middle)), &to_impact);
        write(rest, n, |i| change[i] + late[i]);
        write(end, n, |i| u0[i] + rest[i]);
        push(core.coordinates(Some(&mut *middle)), rest, dp);
        move_freely(core.coordinates(Some(&mut *middle)), &|entry| 1.0 - before(entry));
        let Coordinates { objects, caches, threads, .. } = core.coordinates(Some(&mut *middle));
        let numbers = Numbers { caches, v: late, ..Numbers::default() };
        each_object(threads, objects, numbers, |entry, own| {
            own.v.iter_mut().for_each(|du| *du *= before(entry) - 1.0);
        });
        displace(core.coordinates(Some(&mut *middle)), late, h);
        write(parabola, n, |i| {
            (impact_fraction(i) - 0.5) * du_force[i] - 0.5 * (1.0 - impact_fraction(i)) * sustained[i]
        });
        rest.clone_from(parabola);
        for i in core.objects().iter().filter(|e| in_the_middle(e)).flat_map(|e| e.state_range.v.clone()) {
            rest[i] -= (impact_fraction(i) - 0.5) * change[i];
        }
        shift(core.coordinates(Some(&mut *middle)), rest, h);
        write(mean, n, |i| impact_fraction(i) * u0[i] + (1.0 - impact_fraction(i)) * u1[i] + parabola[i]);
        rest.clone_from(mean);
        self.correct(core, middle, h, ([u0, u1], du_force))?;
        let lambda: Vec<f64> = self.work.lambda.iter().zip(&self.impact).map(|(a, b)| a + b).collect();
        self.keep(core, [u0, u1], du_force, &lambda);
        let Buffers { dp, total, keep, moved, rest: mean, end, .. } = &mut self.buffers;
        total.clear();
        total.extend(self.work.lambda.iter().zip(&self.impact).map(|(a, b)| a + b));
        let step = lift::Step { u: [u0, end], du_force, mean, moved, lambda: total, impact: &self.impact, keep };
        lift::pay_for_lift(core.coordinates(Some(&mut *middle)), &mut self.work, &step);
        if core.has_breakable_joints() {
            core.break_joints(&row_starts(&self.work, total, 1.0 / h));
        }
        if core.collects_loads() {
            core.load_substep(&SubstepForces {
                constraints: &self.work.contact_constraints,
                forces: impulses(&self.work, total, h).map(|i| i / h).collect(),
                moments: &self.work.moments,
                scale: 1.0 / h,
                rows: row_starts(&self.work, total, 1.0 / h),
            });
        }
        core.publish(
            &self.work.contact_constraints,
            impulses(&self.work, total, h),
            impulses(&self.work, &self.work.lambda, h).map(|i| i / h),
            row_starts(&self.work, &self.work.lambda, 1.0 / h),
        );
        core.check_finite(dp, Some(&mut *middle))
    }
}

/// Returns the gap of a limit after free motion of half a step of `h` seconds with the velocity `u`, m or rad.
fn open_in_the_middle(work: &Workspace, block: &Block, target: &RowTarget, u: &[f64], h: f64) -> f64 {
    let rate = work.rows.row_velocity(block, 0, u) - target.velocity;
    // the row is that of the middle, and so is its rate: the mean one is that of a quarter
    target.error + 0.5 * h * (rate - 0.25 * h * target.bias_acceleration)
}

/// Writes `n` numbers to `out`.
fn write(out: &mut Vec<f64>, n: usize, of: impl Fn(usize) -> f64) {
    out.clear();
    out.extend((0..n).map(of));
}

/// Returns whether all impulses on an object act in the middle of the step, impacts too: links,
/// whose caches are expensive.
fn in_the_middle(entry: &Entry) -> bool {
    entry.moves() && entry.object.integratable().is_some_and(|b| b.holds_velocity())
}
