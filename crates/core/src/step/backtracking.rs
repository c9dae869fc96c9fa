//! The backtracking stepper: Algorithm 4 of the thesis (§IV.B.4), with event location and a bound
//! on its tries.
//!
//! ```text
//! while the frame has time left:
//!     correct        overlap beyond the contact tolerance
//!     impacts        at the touching contacts that approach                       (reflections)
//!     resting        forces f at the acceleration level:  a + v/h + K f ≥ 0 ⟂ f ≥ 0, friction; they hold over the sub-step,
//!                    which is made shorter and solved again if a slide ends in it
//!     try h          integrate; go back while a new contact is deeper than the contact tolerance; land when it just touches
//!     correct        joints, and limits that had a force
//! ```
//!
//! The thesis halves the sub-step; here the time of contact is bracketed. The first guess is the
//! time at which the first parabola of a gap closes. False position follows, guarded by bisection.
//! With `dormand_prince` a sub-step is integrated once and the tries are read from its dense
//! output; the committed state is then integrated to the located time. Limits with a reported gap
//! ([`Constraint::gaps`](crate::Constraint::gaps)) are located like contacts. These rules make a
//! frame end:
//!
//! - a contact that *lasts* (its pair carried a resting force in the sub-step before) may drift by
//!   the drift tolerance; its overlap is corrected afterwards and never ends the sub-step, and
//!   neither does depth from before the sub-step;
//! - a rebound that would be lower than the contact tolerance rests: the cut-off `√(2·a·tol)/e`,
//!   with `a` the contact's own pressing acceleration, depends on the tolerance and not on the
//!   frame (but is at most the speed that `a` gives in a frame);
//! - the sub-step has a floor, and a frame has a cap on tries; beyond it the rest of the frame is
//!   one time-stepping sub-step. Both are counted as floor hits.
//!
//! While an object moves that is made for steps of one length
//! ([`Integratable::made_for_step`](crate::Integratable::made_for_step)), such as cloth, the whole frame is time-stepping
//! sub-steps of that length: it has no motion within one in which an event could be located.

use super::adhesion::adhere;
use super::budget::IMPACTS;
use super::contacts::{
    Limit, build_rows, detect, free_motion_change, gyroscopic, impulses, limits, row_velocities, whiten,
};
use super::correction::{self, ActiveLimit, Contacts, Impulses, Limits, Options, Velocities};
use super::event_location::{Bracket, LimitRole, Role, SLOW, Watch};
use super::held_forces::{hold_forces, push_to};
use super::impact::{self, Candidate};
use super::patch::solve_patches;
use super::slide_end::SlideEnds;
use super::warm_start::{row_starts, warm_start};
use super::{StepContext, Stepper, TimeStepping, Workspace, extrapolation};
use crate::constraint::rows::{Block, RowSet};
use crate::contact::detect::ContactConstraint;
use crate::contact::motion;
use crate::contact::pair::{PredictionMode, Reach};
use crate::integrators::Adaptive;
use crate::object::{Level, RowTarget};
use crate::sensor::loads::SubstepForces;
use crate::settings::{Integrator, Settings};
use crate::solver::SolverSettings;
use crate::world::{Coordinates, Core, StepError};
use nalgebra::ComplexField;
use tumble_collide::NormalFrom;

/// The stepper of the thesis, `backtracking`.
#[derive(Default)]
pub struct Backtracking {
    work: Workspace,
    /// Level of the rows of the sub-step.
    level: Level,
    /// Contacts and limits of the tried state.
    after: Vec<ContactConstraint>,
    limits_after: Vec<Limit>,
    watch: Watch,
    slides: SlideEnds,
    /// Limits with a force in this sub-step, and the rows at its end.
    held: Vec<ActiveLimit>,
    probe: Workspace,
    adaptive: Adaptive,
    fallback: TimeStepping,
    /// Whitened forces at the start of the sub-step, without those of contacts and constraints.
    forces: Vec<f64>,
}

/// The outcome of a solve for contact forces.
enum Resolved {
    /// The generalized contact forces that hold over the sub-step.
    Forces(Vec<f64>),
    /// A slide ends after this time, s.
    SlideEnds(f64),
}

/// Number of tries in a frame after which the rest of it is one time-stepping sub-step.
const TRIES: u32 = 200;
/// Soft forces are implicit rows if any of them changes its own velocity by more than this fraction of
/// it in the sub-step: explicit integration loses its accuracy there and, at about 2, its stability.
const STIFF: f64 = 0.5;
/// Least sub-step, as a fraction of the frame.
const FLOOR: f64 = 1.0 / (1 << 28) as f64;
/// Shortest sub-step to which the error of contacts that move leads, as a fraction of the frame.
const SHORTEST: f64 = 1.0 / 64.0;
/// Maximum number of steps in a frame that an object is made for.
const MOST_MADE_STEPS: f64 = 10_000.0;
/// Maximum number of passes of the impact phase.
const IMPACT_PASSES: u32 = 200;
/// Maximum number of corrections of a time found by dense output, before the dense state is taken.
const CORRECTIONS: u32 = 2;

/// Returns the length of the sub-step after one of `h` seconds that covered `went` (0: it is to be taken again) with an error.
fn next_length(core: &Core, (h, went): (f64, f64), error: f64) -> f64 {
    if core.settings.integrator != Integrator::DormandPrince {
        return core.settings.dt;
    }
    // the error of a sub-step is of third order
    let goal = 0.5 * extrapolation::SAFETY * core.settings.integrator_tolerance;
    let factor = ComplexField::cbrt(goal / error.max(f64::MIN_POSITIVE));
    h * if went == 0.0 { factor.clamp(0.1, 0.5) } else { factor.clamp(0.5, 2.0) }
}

/// Returns the shortest length of a step that a moving object is made for, s.
fn steps_made_for(core: &Core) -> Result<Option<f64>, StepError> {
    let least = core.settings.dt / MOST_MADE_STEPS;
    let mut shortest = None;
    for entry in core.objects().iter().filter(|entry| entry.moves()) {
        let Some(step) = entry.object.integratable().and_then(|body| body.made_for_step()) else { continue };
        if !(step.is_finite() && step >= least) {
            let object = core.table.placed[entry.place].name.to_string();
            return Err(StepError::MadeForStep { object, step, least });
        }
        shortest = Some(shortest.map_or(step, |other: f64| other.min(step)));
    }
    Ok(shortest)
}

/// Returns whether a row is a spring, a damper or a drive of finite gain.
fn is_soft(target: &RowTarget) -> bool {
    target.compliance > 0.0 && !target.inertial
}

/// Returns the generalized velocities `h` seconds of free motion after a state. Those of objects whose state holds
/// velocities are those of the state.
fn velocities_after(core: &mut Core, x: &[f64], h: f64) -> Vec<f64> {
    let mut out = vec![0.0; core.dof];
    let Coordinates { objects, caches, .. } = core.coordinates(None);
    for entry in objects.iter().filter(|e| e.moves()) {
        let Some(body) = entry.object.integratable() else { continue };
        let mut x = x[entry.state_range.x.clone()].to_vec();
        if !body.holds_velocity() {
            body.free_motion(&mut caches[entry.place], &mut x, h);
        }
        body.velocity(&x, &mut out[entry.state_range.v.clone()]);
    }
    out
}

impl Stepper for Backtracking {
    fn name(&self) -> &'static str {
        "backtracking"
    }

    fn step(&mut self, frame: StepContext) -> Result<(), StepError> {
        let core = frame.core;
        let (start, pieces) = (core.state.time, core.division);
        (1..=pieces).try_for_each(|piece| {
            let share = f64::from(piece) / f64::from(pieces);
            self.piece(core, start + share * core.settings.dt)
        })
    }

    fn undivided_step(&self, settings: &Settings) -> Option<f64> {
        Some(settings.dt)
    }

    fn fork(&self) -> Box<dyn Stepper> {
        Box::<Backtracking>::default()
    }
}

impl Backtracking {
    /// Advances to the time `end`, s, by a piece of the frame.
    fn piece(&mut self, core: &mut Core, end: f64) -> Result<(), StepError> {
        let (dt, most) = (core.settings.dt, TRIES * core.division);
        let mut left = if core.division == 1 { dt } else { end - core.state.time };
        if let Some(step) = steps_made_for(core)? {
            let count = (left / step).round().max(1.0);
            (0..count as u32).try_for_each(|_| self.fallback.substep(core, left / count))?;
            core.state.time = end;
            return Ok(());
        }
        let floor = dt * SHORTEST;
        self.slides.solves = 0;
        let mut longest = left;
        while left > 1e-12 * dt {
            if core.report.tries >= most || !core.meter.start_try(core.settings.solver_settings.budget) {
                core.report.floor_hits += 1;
                self.fallback.substep(core, left)?;
                break;
            }
            let h = longest.min(left);
            self.meet(core, h)?;
            if !extrapolation::is_needed(core, &self.work, &self.watch.roles, h) {
                left -= self.motion(core, h)?;
                continue;
            }
            let (went, error) = self.extrapolated(core, h, floor)?;
            left -= went;
            longest = next_length(core, (h, went), error).max(floor);
        }
        core.state.time = end; // whatever the sub-steps add up to
        Ok(())
    }

    /// Computes contacts and rows for a sub-step of `h` seconds, and resolves impacts.
    fn meet(&mut self, core: &mut Core, h: f64) -> Result<(), StepError> {
        core.by_impulses = false;
        self.gather(core, h)?;
        self.roles(core);
        if self.resolve_impacts(core) {
            self.gather(core, h)?;
            self.roles(core);
        }
        Ok(())
    }

    /// Advances by a sub-step of `h` seconds whose contacts move, extrapolated (`extrapolation.rs`). Returns its length, s, and its
    /// error; 0 for both if it has to be taken again with a shorter one.
    fn extrapolated(&mut self, core: &mut Core, h: f64, floor: f64) -> Result<(f64, f64), StepError> {
        let before = extrapolation::Before::of(core);
        let whole = self.motion(core, h)?;
        if core.report.tries >= TRIES * core.division {
            return Ok((whole, 0.0));
        }
        let coarse = core.state.x.to_vec();
        let carrying = |core: &Core| core.state.warm.keys().copied().collect::<Vec<_>>();
        let (keys, mut same) = (carrying(core), true);
        before.restore(core);
        for half in [0.0, 0.5] {
            self.meet(core, 0.5 * whole)?;
            let went = self.motion(core, 0.5 * whole)?;
            if went < 0.499_999 * whole {
                return Ok((half * whole + went, 0.0));
            }
            same &= carrying(core) == keys;
        }
        if !same && (core.settings.integrator != Integrator::DormandPrince || whole <= floor) {
            return Ok((whole, 0.0));
        }
        let error = extrapolation::combine(core, &coarse);
        let exact = core.settings.integrator == Integrator::DormandPrince;
        if exact && error > extrapolation::SAFETY * core.settings.integrator_tolerance && whole > floor {
            before.restore(core);
            return Ok((0.0, error));
        }
        Ok((whole, error))
    }

    /// Advances to the next event, at most for `left` seconds. Returns the length of the sub-step, s.
    fn motion(&mut self, core: &mut Core, left: f64) -> Result<f64, StepError> {
        let mut h = left;
        self.slides.start();
        loop {
            match self.resolve_contacts(core, h)? {
                Resolved::Forces(held) => return self.advance(core, &held, h),
                Resolved::SlideEnds(end) => {
                    h = end;
                    self.gather(core, h)?;
                    self.roles(core);
                }
            }
        }
    }

    /// Corrects overlap beyond the contact tolerance, then computes contacts, rows and smooth
    /// accelerations at the present state.
    fn gather(&mut self, core: &mut Core, left: f64) -> Result<(), StepError> {
        detect(core, None, Reach::in_time(left, PredictionMode::Relative), &mut self.work.contact_constraints);
        let soft = Some(left);
        build_rows(core, None, &mut self.work, Level::Acceleration { h: left, soft }, 0.0)?;
        let soft = match core.settings.integrator {
            _ if self.is_stiff() => soft,
            // a rotor divides soft forces with the bodies, so they are rows too
            _ if self.work.targets.iter().any(|t| t.inertial) => Some(0.5 * left),
            Integrator::Verlet => Some(0.5 * left),
            _ => None,
        };
        core.implicit = soft.is_some();
        self.level = Level::Acceleration { h: left, soft };
        let off = |e: f64| e < -core.settings.contact_tolerance;
        let drifted = |t: &RowTarget| t.set == RowSet::HalfLine && off(t.error);
        if self.work.targets.iter().any(drifted) || self.work.contact_constraints.iter().any(|t| off(t.contact.gap)) {
            let options = Options {
                h: left,
                impulses: None,
                level: self.level,
                start: &[],
                contacts: Contacts::InPlace,
                limits: Limits::Free,
                recovery: core.settings.recovery_speed * left,
                tolerance: 1e-2 * core.settings.contact_tolerance,
            };
            correction::correct(core, None, &mut self.work, &mut self.probe, &options)?;
            core.integration().refresh();
            detect(core, None, Reach::in_time(left, PredictionMode::Relative), &mut self.work.contact_constraints);
        }
        self.work.dp.resize(core.dof, 0.0);
        let time = core.state.time;
        core.integration().evaluate(time, &mut self.work.dp);
        core.check_finite(&self.work.dp, None)?;
        build_rows(core, None, &mut self.work, self.level, 0.5 * left)
    }

    /// Returns whether a soft row is too stiff to be a force over the sub-step.
    fn is_stiff(&self) -> bool {
        let work = &self.work;
        let blocks = &work.rows.blocks[work.contact_constraints.len()..];
        let stiff = |(block, t): (&Block, &RowTarget)| is_soft(t) && work.rows.own(block, 0, 0) > STIFF * t.compliance;
        blocks.iter().zip(&work.targets).any(stiff)
    }

    /// Writes the role of every contact in the sub-step.
    fn roles(&mut self, core: &Core) {
        let s = &core.settings;
        let role = |constraint: &ContactConstraint| {
            let lasts = core.state.warm.carries(&constraint.key) && constraint.contact.gap <= s.drift_tolerance;
            let touching = lasts || constraint.contact.gap <= s.contact_tolerance;
            let speed = constraint
                .velocity(
                    &core.derived.part_states[constraint.a as usize],
                    &core.derived.part_states[constraint.b as usize],
                )
                .dot(&constraint.contact.normal);
            let allowed =
                if lasts || (touching && speed.abs() < SLOW) { s.drift_tolerance } else { s.contact_tolerance };
            Role { lasts, touching, allowed: allowed.max(-constraint.contact.gap + s.contact_tolerance) }
        };
        self.watch.roles.clear();
        self.watch.roles.extend(self.work.contact_constraints.iter().map(role));
    }

    /// Resolves impacts (thesis `ResolveImpacts`). Returns whether any velocity changed, so that
    /// other contacts may be near now.
    fn resolve_impacts(&mut self, core: &mut Core) -> bool {
        let work = &mut self.work;
        let s = core.settings;
        let candidates: Vec<Candidate> = work
            .contact_constraints
            .iter()
            .zip(&self.watch.roles)
            .map(|(constraint, role)| {
                let pressing = (-constraint
                    .acceleration(
                        &core.derived.part_states[constraint.a as usize],
                        &core.derived.part_states[constraint.b as usize],
                    )
                    .x)
                    .max(0.0);
                let rebound =
                    (2.0 * pressing * if role.lasts { s.drift_tolerance } else { s.contact_tolerance }).sqrt();
                let rest_speed =
                    (rebound / constraint.restitution.max(1e-3)).min(pressing * s.dt).max(impact::SLOWEST_BOUNCE);
                Candidate {
                    takes_part: role.touching,
                    stops: false,
                    rest_speed,
                    restitution: constraint.restitution,
                    crowd: false,
                }
            })
            .collect();
        let (mut u, mut total) = (Vec::new(), vec![0.0; work.rows.len]);
        whiten(core.coordinates(None), &work.dp, 0.0, &mut u, &mut work.du_force);
        let before = u.clone();
        let budget = core.meter.left(IMPACTS);
        impact::resolve(core, work, &candidates, (IMPACT_PASSES, true, budget), &mut u, &mut total);
        let struck = total.iter().any(|l| *l != 0.0);
        if struck {
            core.touch_impacts(&work.contact_constraints, impulses(work, &total, 0.0));
            if core.has_breakable_joints() {
                core.break_joints(&row_starts(work, &total, 1.0 / core.settings.dt));
            }
            if core.collects_loads() {
                let (forces, rows) = (impulses(work, &total, 0.0).collect(), row_starts(work, &total, 1.0));
                core.load_impact(&SubstepForces {
                    constraints: &work.contact_constraints,
                    forces,
                    moments: &[],
                    scale: 1.0,
                    rows,
                });
            }
            push_to(core, &u, &before);
        }
        struck
    }

    /// Moves the contacts that touch to the middle of the rest of the frame, so that their forces act
    /// where they do in the mean. They stay if an event is to end the sub-step before, or if two edges
    /// touch, whose contact cannot be moved with the others.
    fn move_contacts(&mut self, core: &mut Core, left: f64) -> Result<(), StepError> {
        let (contacts, roles) = (&mut self.work.contact_constraints, &self.watch.roles);
        let held = contacts.iter().zip(roles).any(|(c, r)| r.touching && c.contact.normal_from == NormalFrom::Edges);
        if held || self.watch.first_guess(contacts, &core.derived.part_states, left) < left {
            return Ok(());
        }
        let mut moves = false;
        for (constraint, _) in contacts.iter_mut().zip(roles).filter(|(_, role)| role.touching) {
            moves |= motion::move_in_step(core, constraint, 0.5 * left);
        }
        if moves { build_rows(core, None, &mut self.work, self.level, 0.5 * left) } else { Ok(()) }
    }

    /// Resolves contacts (thesis `ResolveContacts`) for a sub-step of `left` seconds.
    fn resolve_contacts(&mut self, core: &mut Core, left: f64) -> Result<Resolved, StepError> {
        let mut dp = std::mem::take(&mut self.work.dp);
        let time = core.state.time;
        core.integration().evaluate(time, &mut dp);
        self.move_contacts(core, left)?;
        let work = &mut self.work;
        let mut u = Vec::new();
        whiten(core.coordinates(None), &dp, 1.0, &mut u, &mut work.du_force);
        work.dp = dp;
        if work.targets.iter().any(correction::is_joint) {
            self.forces.clone_from(&work.du_force);
            let free = free_motion_change(core.coordinates(None), 1.0);
            self.forces.iter_mut().zip(&free).for_each(|(force, free)| *force -= free);
        }
        let mut velocity = Vec::new();
        row_velocities(&core.threads, &work.rows, &work.bias, &u, &mut velocity);
        let mut acceleration = work.du_force.clone();
        if let Some(turning) = gyroscopic(core.coordinates(None)) {
            acceleration.iter_mut().zip(&turning).for_each(|(rate, g)| *rate -= g);
        }
        row_velocities(&core.threads, &work.rows, &vec![0.0; work.rows.len], &acceleration, &mut work.c);
        let mut keep = vec![true; work.rows.blocks.len()];
        for (i, (constraint, role)) in work.contact_constraints.iter().zip(&self.watch.roles).enumerate() {
            let range = work.rows.blocks[i].range();
            let acceleration = constraint.acceleration(
                &core.derived.part_states[constraint.a as usize],
                &core.derived.part_states[constraint.b as usize],
            );
            for (k, row) in range.clone().enumerate() {
                let moved = &constraint.moved;
                let rate = if moved.time > 0.0 {
                    // the contact is that of the middle of the sub-step, links are at its start
                    work.c[row] + constraint.frame.axes[k].dot(&(0.5 * moved.rate + moved.of_links + moved.of_driven))
                } else {
                    acceleration[k]
                };
                work.c[row] = rate + velocity[row] / left;
            }
            work.c[range.start] += constraint.contact.gap.max(0.0) / (left * left);
            keep[i] = role.touching && (role.lasts || velocity[range.start] < 1e-7);
        }
        let mut adhesion = vec![0.0; core.dof];
        adhere(work, core.settings.drift_tolerance, 1.0, &mut adhesion);
        if adhesion.iter().any(|du| *du != 0.0) {
            work.rows.add_velocity(&adhesion, &mut work.c);
        }
        self.watch_limits(core, &velocity, &mut keep);
        let work = &mut self.work;
        let contact_constraints = work.contact_constraints.len();
        for (i, target) in work.targets.iter().enumerate() {
            let row = work.rows.blocks[contact_constraints + i].row as usize;
            if target.inertial {
                work.c[row] += target.bias_acceleration;
                continue;
            }
            // rows are those of the middle of the step, and turn further in its second half
            let over = if is_soft(target) { target.share * left } else { left };
            work.c[row] += 0.5 * target.bias_acceleration + (velocity[row] - target.velocity) / over;
            if target.set == RowSet::HalfLine {
                work.c[row] += target.error.max(0.0) / (left * left);
            }
        }
        warm_start(core, work, 1.0);
        keep.iter().zip(&work.rows.blocks).filter(|(k, _)| !**k).for_each(|(_, b)| work.lambda[b.range()].fill(0.0));
        let s = core.settings.solver_settings;
        let solver_settings = SolverSettings {
            max_sweeps: s.max_sweeps.max(2000),
            max_relaxations: s.max_relaxations.max(1_000_000),
            tolerance: s.tolerance / left,
            budget: core.meter.for_solve(work.rows.blocks.len()),
        };
        let rate = |i: usize| acceleration[i] + adhesion[i];
        let free: Vec<f64> = (0..u.len()).map(|i| u[i] + left * rate(i)).collect();
        let ray = solve_patches(core, None, work, (solver_settings, left), &keep, &free)?;
        let floor = core.settings.dt * FLOOR;
        if let Some(end) = self.slides.before(core, work, &velocity, left)
            && end > floor
        {
            return Ok(Resolved::SlideEnds(end));
        }
        work.du.iter_mut().zip(&adhesion).for_each(|(du, pull)| *du += pull);
        self.held = correction::limits_with_force(work);
        let mut held = vec![0.0; core.dof];
        if ray {
            // no force at the acceleration level keeps the contacts closed; an impulse without
            // collision does
            let after: Vec<f64> = u.iter().zip(&work.du).map(|(u, du)| u + left * du).collect();
            push_to(core, &after, &u);
        } else {
            hold_forces(core, work, &mut held);
        }
        if core.has_breakable_joints() {
            core.break_joints(&row_starts(work, &work.lambda, 1.0));
        }
        if core.collects_loads() {
            let (forces, rows) = (impulses(work, &work.lambda, 1.0).collect(), row_starts(work, &work.lambda, 1.0));
            let (constraints, moments) = (&work.contact_constraints[..], &work.moments[..]);
            core.load_substep(&SubstepForces { constraints, forces, moments, scale: 1.0, rows });
        }
        core.publish(
            &work.contact_constraints,
            impulses(work, &work.lambda, 1.0).map(|f| f * left),
            impulses(work, &work.lambda, 1.0),
            row_starts(work, &work.lambda, 1.0),
        );
        Ok(Resolved::Forces(held))
    }

    /// Assigns the roles of limits: those with a reported gap are active from the time at which
    /// they are reached, others over the whole sub-step. `velocity` has the velocities of the rows,
    /// `work.c` their accelerations.
    fn watch_limits(&mut self, core: &Core, velocity: &[f64], keep: &mut [bool]) {
        let (work, contact_constraints, watch) = (&self.work, self.work.contact_constraints.len(), &mut self.watch);
        watch.limits.clear();
        let mut located = vec![false; work.targets.len()];
        for limit in &work.limits {
            let (mut rate, mut acceleration) = (0.0, 0.0);
            if let Some(i) = limit.target.map(|i| i as usize) {
                let row = work.rows.blocks[contact_constraints + i].row as usize;
                (rate, acceleration) = (velocity[row], work.c[row] + work.targets[i].bias_acceleration);
            }
            let role = LimitRole::new(limit, rate, acceleration, &core.settings);
            if let Some(i) = limit.target.map(|i| i as usize) {
                (located[i], keep[contact_constraints + i]) = (true, role.acts());
            }
            watch.limits.push(role);
        }
        watch.guesses.clear();
        for (target, block) in work
            .targets
            .iter()
            .zip(&work.rows.blocks[contact_constraints..])
            .zip(&located)
            .filter_map(|(t, located)| (!located).then_some(t))
        {
            let rate = velocity[block.row as usize];
            if target.set == RowSet::HalfLine && target.error > 0.0 && rate < 0.0 {
                watch.guesses.push(-target.error / rate);
            }
        }
    }

    /// Integrates to the next event, at most for `left` seconds. Returns the length of the
    /// sub-step, s.
    fn advance(&mut self, core: &mut Core, held: &[f64], left: f64) -> Result<f64, StepError> {
        core.held.copy_from_slice(held);
        self.adaptive.path.clear();
        let start = core.state.x.to_vec();
        let floor = core.settings.dt * FLOOR;
        let tolerance = core.settings.contact_tolerance;
        let mut bracket = Bracket::new(self.watch.nearest(&self.work.contact_constraints, tolerance));
        let mut h = self
            .watch
            .first_guess(&self.work.contact_constraints, &core.derived.part_states, left)
            .clamp(floor.min(left), left);
        loop {
            h = self.go_to(core, &start, h)?;
            let deepest = core.report.max_penetration;
            let f = self.margin(core, h)?;
            let landed = f >= -tolerance && (f <= tolerance || !bracket.crossed());
            let floored = f < -tolerance && h <= floor;
            let stuck = core.report.tries >= TRIES * core.division;
            if landed || floored || (stuck && f >= -tolerance) {
                core.report.floor_hits += floored as u32;
                if self.adaptive.path.extends_beyond(h) {
                    h = self.settle(core, h, &bracket, if landed { f } else { f64::NAN })?;
                }
                core.clear_contact_forces();
                self.correct(core, &start, (h, left))?;
                core.finish_substep(h)?;
                return Ok(h);
            }
            core.report.max_penetration = deepest;
            if stuck {
                core.state.x.copy_from_slice(&start);
                core.clear_contact_forces();
                core.integration().refresh();
                return Ok(0.0);
            }
            h = bracket.narrow(h, f, f < -tolerance).max(floor.min(left));
        }
    }

    /// Corrects joints, and limits that had a force, at the end of a sub-step of `h` seconds;
    /// `left` is the time until the end of the frame.
    fn correct(&mut self, core: &mut Core, start: &[f64], (h, left): (f64, f64)) -> Result<(), StepError> {
        let joined = self.work.targets.iter().any(correction::is_joint);
        let (mut before, mut after, struck) = (Vec::new(), Vec::new(), vec![false; core.dof]);
        if joined {
            let end = core.state.x.to_vec();
            (before, after) = (velocities_after(core, start, 0.5 * h), velocities_after(core, &end, -0.5 * h));
        }
        let options = Options {
            h,
            impulses: joined.then_some(Impulses {
                velocities: Velocities::Generalized([&before, &after]),
                du_force: (&self.forces, 1.0),
                scale: h,
                struck: &struck,
            }),
            level: self.level,
            start,
            contacts: Contacts::Ignored,
            limits: Limits::Listed { limits: &self.held, reach: core.settings.drift_tolerance },
            recovery: core.settings.recovery_speed * left,
            tolerance: core.settings.contact_tolerance,
        };
        correction::correct(core, None, &mut self.work, &mut self.probe, &options)
    }

    /// Computes the state `h` after `start`: from the dense output if this sub-step has been
    /// integrated that far, else by the integrator. Returns the time that it covers, s.
    fn go_to(&mut self, core: &mut Core, start: &[f64], h: f64) -> Result<f64, StepError> {
        if self.adaptive.path.reaches(h) {
            self.adaptive.path.write(&mut core.integration(), h);
            return Ok(h);
        }
        core.state.x.copy_from_slice(start);
        core.integration().refresh();
        let (time, integrator) = (core.state.time, core.settings.integrator);
        self.adaptive.set(&core.settings, core.state.inner_step, core.report.inner_steps);
        let came = core.integration().integrate(integrator, time, h, &mut self.work.dp, &mut self.adaptive)?;
        if integrator == Integrator::DormandPrince {
            core.state.inner_step = self.adaptive.step;
            core.report.inner_steps = self.adaptive.steps;
        }
        core.check_finite(&self.work.dp, None)?;
        Ok(came)
    }

    /// Replaces the state of the dense output at `h`, whose margin is `f`, by one that is
    /// integrated from the start of the inner step: it has the full order, and forces and
    /// accelerations of its own. If it has not landed, because the two differ by more than the
    /// contact tolerance, the time is corrected; if that does not help (or `f` is NaN), the dense
    /// state stays. Returns the length of the sub-step, s.
    fn settle(&mut self, core: &mut Core, h: f64, bracket: &Bracket, f: f64) -> Result<f64, StepError> {
        let (dense, tolerance, time) = (core.state.x.to_vec(), core.settings.contact_tolerance, core.state.time);
        let deepest = core.report.max_penetration;
        let slope = bracket.slope(h, f);
        let (from, length) = (self.adaptive.path.before(h).0, self.adaptive.path.length(h));
        let mut at = h;
        for _ in 0..=CORRECTIONS {
            if !(at > from && at <= from + length && f.is_finite()) {
                break;
            }
            core.state.x.copy_from_slice(self.adaptive.path.before(h).1);
            self.adaptive.set(&core.settings, length, core.report.inner_steps);
            self.adaptive.integrate(&mut core.integration(), time + from, at - from, &mut self.work.dp, false)?;
            core.report.inner_steps = self.adaptive.steps;
            core.check_finite(&self.work.dp, None)?;
            let off = self.margin(core, at)?;
            if off.abs() <= tolerance {
                return Ok(at);
            }
            core.report.max_penetration = deepest;
            at -= off / slope;
        }
        core.state.x.copy_from_slice(&dense);
        core.integration().evaluate(time + h, &mut self.work.dp);
        core.check_finite(&self.work.dp, None)?;
        Ok(h)
    }

    /// Returns the margin of the present state, `h` after the start of the sub-step, m. It counts
    /// as a try.
    fn margin(&mut self, core: &mut Core, h: f64) -> Result<f64, StepError> {
        core.report.tries += 1;
        detect(core, None, Reach::in_time(0.0, PredictionMode::Relative), &mut self.after);
        limits(&core.view(core.state.time + h), &mut self.limits_after)?;
        Ok(self.watch.margin(
            &self.work.contact_constraints,
            &self.after,
            &self.limits_after,
            core.settings.contact_tolerance,
        ))
    }
}
