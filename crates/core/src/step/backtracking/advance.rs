//! A sub-step with forces that hold: integrates to the next event, and corrects joints and limits there.

use super::{Backtracking, FLOOR, TRIES};
use crate::contact::pair::{PredictionMode, Reach};
use crate::settings::Integrator;
use crate::step::contacts::{detect, limits};
use crate::step::correction::{self, Contacts, Impulses, Limits, Options, Velocities};
use crate::step::event_location::Bracket;
use crate::world::{Coordinates, Core, StepError};

/// Maximum number of corrections of a time found by dense output, before the dense state is taken.
const CORRECTIONS: u32 = 2;

/// Returns the integrator of the sub-step. Soft rows are made for the path of constant forces, which both first-order
/// integrators leave: with a stiff spring they would explode.
fn integrator_of(core: &Core) -> Integrator {
    match core.settings.integrator {
        Integrator::SymplecticEuler | Integrator::ExplicitEuler if core.implicit => Integrator::Verlet,
        integrator => integrator,
    }
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

impl Backtracking {
    /// Integrates to the next event, at most for `left` seconds. Returns the length of the
    /// sub-step, s.
    pub(super) fn advance(&mut self, core: &mut Core, held: &[f64], left: f64) -> Result<f64, StepError> {
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
        let joined = correction::holds(&self.work);
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
        let (time, integrator) = (core.state.time, integrator_of(core));
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
