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

mod advance;
mod resolve;

use super::contacts::{Limit, build_rows, detect};
use super::correction::{self, ActiveLimit, Contacts, Limits, Options};
use super::event_location::{Role, SLOW, Watch};
use super::slide_end::SlideEnds;
use super::{StepContext, Stepper, TimeStepping, Workspace, extrapolation};
use crate::constraint::rows::{Block, RowSet};
use crate::contact::detect::ContactConstraint;
use crate::contact::pair::{PredictionMode, Reach};
use crate::integrators::Adaptive;
use crate::object::{Level, RowTarget};
use crate::settings::{Integrator, Settings};
use crate::world::{Core, StepError};
use nalgebra::ComplexField;
use resolve::{Impacts, Resolved};

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

/// Number of tries in a frame after which the rest of it is one time-stepping sub-step.
const TRIES: u32 = 200;
/// Soft forces are implicit rows if any of them changes its own velocity by more than this fraction of
/// it in the sub-step: explicit integration loses its accuracy there and, at about 2, its stability.
const STIFF: f64 = 0.5;
/// A contact that does not last and opens faster has no force, m/s.
const STILL: f64 = 1e-7;
/// Least sub-step, as a fraction of the frame.
const FLOOR: f64 = 1.0 / (1 << 28) as f64;
/// Shortest sub-step to which the error of contacts that move leads, as a fraction of the frame.
const SHORTEST: f64 = 1.0 / 64.0;
/// Maximum number of steps in a frame that an object is made for.
const MOST_MADE_STEPS: f64 = 10_000.0;

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

    /// Computes contacts and rows for a sub-step of `h` seconds, and resolves impacts. Returns whether any was new.
    fn meet(&mut self, core: &mut Core, h: f64) -> Result<bool, StepError> {
        core.by_impulses = false;
        self.gather(core, h)?;
        self.roles(core);
        let impacts = self.resolve_impacts(core);
        if impacts != Impacts::None {
            self.gather(core, h)?;
            self.roles(core);
        }
        Ok(impacts == Impacts::New)
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
            let struck = self.meet(core, 0.5 * whole)?;
            let went = self.motion(core, 0.5 * whole)?;
            if went < 0.499_999 * whole {
                return Ok((half * whole + went, 0.0));
            }
            same &= !struck && carrying(core) == keys;
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
            // forces of joints hold over the sub-step: a spring that changes in it would leave them behind, and make energy
            Integrator::Rk4 | Integrator::DormandPrince if self.work.targets.iter().any(correction::is_joint) => {
                Some(0.5 * left)
            }
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

    /// Writes the role of every contact in the sub-step. Those of limits follow in the solve for contact forces.
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
            let allowed = allowed.max(-constraint.contact.gap + s.contact_tolerance);
            Role { lasts, touching, opens: speed >= STILL, allowed }
        };
        self.watch.limits.clear();
        self.watch.guesses.clear();
        self.watch.roles.clear();
        self.watch.roles.extend(self.work.contact_constraints.iter().map(role));
    }
}

/// Returns whether a row is a spring, a damper or a drive of finite gain.
fn is_soft(target: &RowTarget) -> bool {
    target.compliance > 0.0 && !target.inertial
}
