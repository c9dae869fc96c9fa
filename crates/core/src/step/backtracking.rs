//! The backtracking stepper: Algorithm 4 of the thesis (§IV.B.4), made to end and to land on the moment of contact.
//!
//! ```text
//! while the frame has time left:
//!     impacts        at the touching contacts that approach                       (reflections)
//!     resting        forces f at the acceleration level:  a + v/h + K f ≥ 0 ⟂ f ≥ 0, friction; they hold over the sub-step
//!     try h          integrate; go back while a new contact is deeper than the contact tolerance; land where it just touches
//!     commit
//! ```
//!
//! Where the thesis halves, the time of contact is bracketed: the first guess is where the parabola of each nearing contact closes, then false
//! position with bisection as its guard. The rules that make a frame end:
//!
//! - a contact that *lasts* (its pair carried a resting force in the sub-step before) may drift by the drift tolerance; it is projected out
//!   afterwards and never makes the step go back; depth that was there before is no reason either;
//! - a rebound that would be lower than the contact tolerance rests: the cut-off `√(2·a·tol)/e`, with `a` the contact's own pressing
//!   acceleration, is tied to the tolerance and not to the frame (but never above what `a` gives in a frame);
//! - the sub-step has a floor, and a frame has a cap on tries; beyond it the rest of the frame is one time-stepping sub-step. Both are
//!   counted as floor hits.

use super::contacts::{build_rows, detect, gyroscopic, impulses, push, recover, row_velocities, solve, warm_start, whiten};
use super::impact::{self, Candidate};
use super::{Frame, Stepper, TimeStepping, Workspace, projection};
use crate::detect::Touch;
use crate::object::Level;
use crate::rows::RowSet;
use crate::solver::Accuracy;
use crate::world::{Core, StepError};

/// The stepper of the thesis, `backtracking`.
#[derive(Default)]
pub struct Backtracking {
    work: Workspace,
    after: Vec<Touch>,
    /// Gap and its rate of every one-sided row of a constraint.
    limits: Vec<(f64, f64)>,
    fallback: TimeStepping,
}

/// Tries in a frame after which the rest of it is one time-stepping sub-step.
const TRIES: u32 = 200;
/// Least sub-step, as a share of the frame.
const FLOOR: f64 = 1.0 / (1 << 28) as f64;
/// A margin of at least this is not measured, metres.
const FAR: f64 = 1e-4;
/// Passes of the impact phase at most.
const IMPACT_PASSES: u32 = 200;
/// A touching contact slower than this may drift like one that lasts, m/s.
const SLOW: f64 = 1e-3;

/// A touch's part in the sub-step that begins.
#[derive(Clone, Copy)]
struct Role {
    lasts: bool,
    touches: bool,
    /// Depth that does not make the step go back, metres.
    allowed: f64,
}

impl Stepper for Backtracking {
    fn name(&self) -> &'static str {
        "backtracking"
    }

    fn step(&mut self, frame: Frame) -> Result<(), StepError> {
        let core = frame.core;
        let dt = core.settings.dt;
        let mut left = dt;
        while left > 1e-12 * dt {
            if core.report.tries >= TRIES {
                core.report.floor_hits += 1;
                return self.fallback.substep(core, left);
            }
            core.implicit = false;
            self.gather(core, left)?;
            let roles = self.roles(core);
            let roles = if self.resolve_impacts(core, &roles) { self.gather(core, left).map(|_| self.roles(core))? } else { roles };
            let held = self.resolve_contacts(core, &roles, left)?;
            left -= self.advance(core, &roles, &held, left)?;
        }
        Ok(())
    }

    fn fork(&self) -> Box<dyn Stepper> {
        Box::<Backtracking>::default()
    }
}

impl Backtracking {
    /// Contacts, rows and smooth accelerations at the present state; overlap beyond the contact tolerance is projected out first.
    fn gather(&mut self, core: &mut Core, left: f64) -> Result<(), StepError> {
        detect(core, left, &mut self.work.touches);
        build_rows(core, &mut self.work, Level::Acceleration, 0.0)?;
        let off = |e: f64| e < -core.settings.contact_tolerance;
        let drifted = self.work.targets.iter().any(|t| off(t.error) || (t.set == RowSet::Equality && off(-t.error)));
        if drifted || self.work.touches.iter().any(|t| off(t.contact.gap)) {
            projection::project(core, &mut self.work, projection::Displacement::InPlace, core.settings.recovery_speed * left, 1e-2 * core.settings.contact_tolerance);
            core.motion().refresh();
            detect(core, left, &mut self.work.touches);
        }
        self.work.dp.resize(core.dof, 0.0);
        let time = core.time;
        core.motion().evaluate(time, &mut self.work.dp);
        core.check_finite(&self.work.dp)?;
        build_rows(core, &mut self.work, Level::Acceleration, 0.5 * left)
    }

    fn roles(&self, core: &Core) -> Vec<Role> {
        let s = &core.settings;
        let role = |touch: &Touch| {
            let lasts = core.warm.carries(&touch.key) && touch.contact.gap <= s.drift_tolerance;
            let touches = lasts || touch.contact.gap <= s.contact_tolerance;
            let speed = touch.velocity(&core.sites[touch.a as usize], &core.sites[touch.b as usize]).dot(&touch.contact.normal);
            let allowed = if lasts || (touches && speed.abs() < SLOW) { s.drift_tolerance } else { s.contact_tolerance };
            Role { lasts, touches, allowed: allowed.max(-touch.contact.gap + s.contact_tolerance) }
        };
        self.work.touches.iter().map(role).collect()
    }

    /// Thesis `ResolveImpacts`; whether anything was struck, so that other contacts may be near now.
    fn resolve_impacts(&mut self, core: &mut Core, roles: &[Role]) -> bool {
        let work = &mut self.work;
        let s = core.settings;
        let candidates: Vec<Candidate> = work.touches.iter().zip(roles).map(|(touch, role)| {
            let pressing = (-touch.acceleration(&core.sites[touch.a as usize], &core.sites[touch.b as usize]).x).max(0.0);
            let rebound = (2.0 * pressing * if role.lasts { s.drift_tolerance } else { s.contact_tolerance }).sqrt();
            let rest_speed = (rebound / touch.restitution.max(1e-3)).min(pressing * s.dt).max(impact::SLOWEST_BOUNCE);
            Candidate { takes_part: role.touches, rest_speed, restitution: touch.restitution }
        }).collect();
        let (mut u, mut total) = (Vec::new(), vec![0.0; work.rows.len]);
        whiten(core, &work.dp, 0.0, &mut u, &mut work.du_force);
        let before = u.clone();
        impact::resolve(core, work, &candidates, IMPACT_PASSES, &mut u, &mut total);
        let struck = total.iter().any(|l| *l != 0.0);
        if struck {
            push_to(core, &u, &before);
        }
        struck
    }

    /// Thesis `ResolveContacts`: the generalized contact forces that hold over the sub-step.
    fn resolve_contacts(&mut self, core: &mut Core, roles: &[Role], left: f64) -> Result<Vec<f64>, StepError> {
        let mut dp = std::mem::take(&mut self.work.dp);
        let time = core.time;
        core.motion().evaluate(time, &mut dp);
        let work = &mut self.work;
        let mut u = Vec::new();
        whiten(core, &dp, 1.0, &mut u, &mut work.du_force);
        work.dp = dp;
        let mut velocity = Vec::new();
        row_velocities(&work.rows, &work.bias, &u, &mut velocity);
        let acceleration: Vec<f64> = gyroscopic(core).iter().zip(&work.du_force).map(|(g, rate)| rate - g).collect();
        row_velocities(&work.rows, &vec![0.0; work.rows.len], &acceleration, &mut work.c);
        let mut keep = vec![true; work.rows.blocks.len()];
        for (i, (touch, role)) in work.touches.iter().zip(roles).enumerate() {
            let range = work.rows.blocks[i].range();
            let acceleration = touch.acceleration(&core.sites[touch.a as usize], &core.sites[touch.b as usize]);
            for (k, row) in range.clone().enumerate() {
                work.c[row] = acceleration[k] + velocity[row] / left;
            }
            work.c[range.start] += touch.contact.gap.max(0.0) / (left * left);
            keep[i] = role.touches && (role.lasts || velocity[range.start] < 1e-7);
        }
        let touches = work.touches.len();
        self.limits.clear();
        for (i, target) in work.targets.iter().enumerate() {
            let row = work.rows.blocks[touches + i].row as usize;
            // rows are those of the middle of the step, and go on turning for the other half
            work.c[row] += 0.5 * target.bias_acceleration + (velocity[row] - target.velocity) / left;
            if target.set == RowSet::HalfLine {
                self.limits.push((target.error, velocity[row]));
                work.c[row] += target.error.max(0.0) / (left * left);
            }
        }
        warm_start(core, work, 1.0);
        keep.iter().zip(&work.rows.blocks).filter(|(k, _)| !**k).for_each(|(_, b)| work.lambda[b.range()].fill(0.0));
        let s = core.settings.accuracy;
        let accuracy = Accuracy { sweeps: s.sweeps.max(2000), relaxations: s.relaxations.max(1_000_000), tolerance: s.tolerance / left };
        let ray = solve(core, work, accuracy, left, |b| keep[b]);
        let mut held = vec![0.0; core.dof];
        if ray {
            // no force at the acceleration level keeps the contacts: an impulse without collision does
            let after: Vec<f64> = u.iter().zip(&work.du).map(|(u, du)| u + left * du).collect();
            push_to(core, &after, &u);
        } else {
            recover(core, &work.du, &mut held);
        }
        core.publish(&work.touches, impulses(work, &work.lambda).map(|f| f * left).collect(), impulses(work, &work.lambda));
        Ok(held)
    }

    /// Integrates as far as nothing new crosses, `left` at most; the time taken.
    fn advance(&mut self, core: &mut Core, roles: &[Role], held: &[f64], left: f64) -> Result<f64, StepError> {
        core.held.copy_from_slice(held);
        let start = core.x.clone();
        let floor = core.settings.dt * FLOOR;
        let tolerance = core.settings.contact_tolerance;
        let mut bracket = Bracket { low: (0.0, self.nearest(roles, tolerance)), high: None, same_side: 0 };
        let mut h = self.first_guess(core, roles, left).clamp(floor.min(left), left);
        loop {
            core.x.copy_from_slice(&start);
            self.integrate(core, h)?;
            core.report.tries += 1;
            let deepest = std::mem::take(&mut core.report.max_penetration);
            detect(core, 0.0, &mut self.after);
            let f = self.margin(roles, tolerance);
            let landed = f >= -tolerance && (f <= tolerance || bracket.high.is_none());
            let floored = f < -tolerance && h <= floor;
            let stuck = core.report.tries >= TRIES;
            if landed || floored || (stuck && f >= -tolerance) {
                core.report.floor_hits += floored as u32;
                core.report.max_penetration = core.report.max_penetration.max(deepest);
                core.held.fill(0.0);
                core.finish_substep(h)?;
                return Ok(h);
            }
            core.report.max_penetration = deepest;
            if stuck {
                core.x.copy_from_slice(&start);
                core.held.fill(0.0);
                core.motion().refresh();
                return Ok(0.0);
            }
            h = bracket.narrow(h, f, f < -tolerance).max(floor.min(left));
        }
    }

    fn integrate(&mut self, core: &mut Core, h: f64) -> Result<(), StepError> {
        let (time, integrator) = (core.time, core.settings.integrator);
        core.motion().refresh();
        core.motion().integrate(integrator, time, h, &mut self.work.dp);
        core.check_finite(&self.work.dp)
    }

    /// Where the parabola of the first nearing contact closes, or the first limit is reached, s.
    fn first_guess(&self, core: &Core, roles: &[Role], left: f64) -> f64 {
        let closing = |(touch, role): (&Touch, &Role)| -> Option<f64> {
            if role.touches {
                return None;
            }
            let (a, b) = (&core.sites[touch.a as usize], &core.sites[touch.b as usize]);
            let (v, g) = (touch.velocity(a, b).dot(&touch.contact.normal), touch.contact.gap);
            let a = touch.acceleration(a, b).x;
            let root = v * v - 2.0 * a * g;
            let t = 2.0 * g / (-v + root.max(0.0).sqrt());
            (root >= 0.0 && t > 0.0 && t < left).then_some(t)
        };
        let limits = self.limits.iter().filter(|(gap, rate)| *gap > 0.0 && *rate < 0.0).map(|(gap, rate)| -gap / rate);
        self.work.touches.iter().zip(roles).filter_map(closing).chain(limits).fold(left, f64::min)
    }

    /// Least gap of what does not touch yet, at the start of the sub-step.
    fn nearest(&self, roles: &[Role], tolerance: f64) -> f64 {
        let gaps = self.work.touches.iter().zip(roles).filter(|(_, r)| !r.touches).map(|(t, _)| t.contact.gap);
        gaps.fold(FAR, f64::min).max(tolerance)
    }

    /// How far the tried state is from the first crossing: gap, less the depth that its pair is allowed.
    fn margin(&self, roles: &[Role], tolerance: f64) -> f64 {
        let before = &self.work.touches;
        let value = |touch: &Touch| {
            let pair = before.partition_point(|t| t.key.pair < touch.key.pair);
            let same = before[pair..].iter().zip(&roles[pair..]).take_while(|(t, _)| t.key.pair == touch.key.pair);
            let allowed = same.map(|(_, r)| r.allowed).fold(tolerance, f64::max);
            touch.contact.gap + allowed - tolerance
        };
        self.after.iter().map(value).fold(FAR, f64::min)
    }
}

/// The moment of a crossing, between a sub-step that ended before it and one that ended after: (length, margin) each.
struct Bracket {
    low: (f64, f64),
    high: Option<(f64, f64)>,
    /// How often in a row the low end moved (positive) or the high end (negative).
    same_side: i32,
}

impl Bracket {
    /// Takes a try in that did not land, and gives the next one. False position by the Illinois rule (an end that stays twice
    /// counts half), bisection every fourth time and wherever the margin before the crossing is only known to be large.
    fn narrow(&mut self, h: f64, f: f64, crossed: bool) -> f64 {
        if crossed {
            self.same_side = self.same_side.min(0) - 1;
            self.high = Some((h, f));
        } else {
            self.same_side = self.same_side.max(0) + 1;
            self.low = (h, f);
        }
        let high = self.high.get_or_insert((h, f));
        match self.same_side {
            2.. => high.1 *= 0.5,
            ..=-2 => self.low.1 *= 0.5,
            _ => {}
        }
        let (width, share) = (high.0 - self.low.0, self.low.1 / (self.low.1 - high.1));
        let bisect = self.low.1 >= FAR || self.same_side.abs() % 4 == 3 || !share.is_finite();
        self.low.0 + width * if bisect { 0.5 } else { share.clamp(1e-3, 1.0 - 1e-3) }
    }
}

/// Makes the whitened velocity `after` where it was `before`, and refreshes what readers see.
fn push_to(core: &mut Core, after: &[f64], before: &[f64]) {
    let change: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
    push(core, &change);
    core.motion().refresh();
}
