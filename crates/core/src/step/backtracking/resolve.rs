//! Impacts and resting contacts at the start of a sub-step: `ResolveImpacts` and `ResolveContacts` of the thesis.

use super::{Backtracking, FLOOR, is_soft};
use crate::constraint::rows::{Block, RowSet};
use crate::contact::detect::ContactConstraint;
use crate::contact::motion;
use crate::object::{Level, RowTarget};
use crate::sensor::loads::SubstepForces;
use crate::solver::SolverSettings;
use crate::step::adhesion::adhere;
use crate::step::budget::IMPACTS;
use crate::step::contacts::{build_rows, free_motion_change, gyroscopic, impulses, row_velocities, whiten};
use crate::step::correction;
use crate::step::event_location::{LimitRole, Role, SLOW};
use crate::step::held_forces::{hold_forces, push_to};
use crate::step::impact::{self, Candidate};
use crate::step::patch::solve_patches;
use crate::step::warm_start::{row_starts, warm_start};
use crate::world::{Core, StepError};
use tumble_collide::NormalFrom;

/// Maximum number of passes of the impact phase.
const IMPACT_PASSES: u32 = 200;
/// A closed contact of a pair that lasts is an impact if it approaches faster, m/s. Slower, it is another feature of a contact
/// that rolls, with what the forces of the sub-step before have left of its approach.
const SURE: f64 = 0.05;

/// The outcome of a solve for contact forces.
pub(super) enum Resolved {
    /// The generalized contact forces that hold over the sub-step.
    Forces(Vec<f64>),
    /// A slide ends after this time, s.
    SlideEnds(f64),
}

/// Impacts at the start of a sub-step.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Impacts {
    /// No velocity changed.
    None,
    /// Contacts that last, and limits, lost a slow approach: what the forces of the sub-step before left of it.
    Slow,
    /// Surfaces met, or a limit was reached at speed.
    New,
}

impl Backtracking {
    /// Resolves impacts (thesis `ResolveImpacts`). After any, other contacts may be near.
    pub(super) fn resolve_impacts(&mut self, core: &mut Core) -> Impacts {
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
        // rows of joints and limits are those of the middle of the sub-step: what turns until then is no impact
        let bias = work.bias.clone();
        if let Level::Acceleration { h, .. } = self.level {
            let rows = work.rows.blocks[work.contact_constraints.len()..].iter().zip(&work.targets);
            let turns = |target: &RowTarget| target.set == RowSet::HalfLine || correction::is_joint(target);
            for (block, target) in rows.filter(|(_, target)| turns(target)) {
                work.bias[block.row as usize] -= 0.5 * h * target.bias_acceleration;
            }
        }
        impact::resolve(core, work, &candidates, (IMPACT_PASSES, true, budget), &mut u, &mut total);
        work.bias = bias;
        let mut impacts = Impacts::None;
        if total.iter().any(|l| *l != 0.0) {
            impacts = if self.has_new(core, &total) { Impacts::New } else { Impacts::Slow };
            let work = &mut self.work;
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
        impacts
    }

    /// Returns whether any of the impulses is an impact: of a contact that does not last, or of a limit, whose velocity it changes
    /// by more than [`SLOW`], or of another feature of a pair that lasts, if that is open or approaches at [`SURE`].
    fn has_new(&self, core: &Core, impulses: &[f64]) -> bool {
        let work = &self.work;
        let (contacts, others) = work.rows.blocks.split_at(work.contact_constraints.len());
        let change = |block: &Block| work.rows.own(block, 0, 0) * impulses[block.row as usize].abs();
        let begins = |((block, contact), role): ((&Block, &ContactConstraint), &Role)| {
            let least = if contact.contact.gap > core.settings.contact_tolerance { SLOW } else { SURE };
            change(block) > if role.lasts { least } else { SLOW } && !core.state.warm.has(&contact.key)
        };
        contacts.iter().zip(&work.contact_constraints).zip(&self.watch.roles).any(begins)
            || others
                .iter()
                .zip(&work.targets)
                .any(|(block, target)| target.set == RowSet::HalfLine && change(block) > SLOW)
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
    pub(super) fn resolve_contacts(&mut self, core: &mut Core, left: f64) -> Result<Resolved, StepError> {
        let mut dp = std::mem::take(&mut self.work.dp);
        let time = core.state.time;
        core.integration().evaluate(time, &mut dp);
        self.move_contacts(core, left)?;
        let work = &mut self.work;
        let mut u = Vec::new();
        whiten(core.coordinates(None), &dp, 1.0, &mut u, &mut work.du_force);
        work.dp = dp;
        if correction::holds(work) {
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
            keep[i] = role.touching && (role.lasts || !role.opens);
        }
        let mut adhesion = vec![0.0; core.dof];
        adhere(work, core.settings.drift_tolerance, 1.0, &mut adhesion);
        if adhesion.iter().any(|du| *du != 0.0) {
            work.rows.add_velocity(&adhesion, &mut work.c);
        }
        self.watch_limits(core, (&velocity, left), &mut keep);
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
    /// they are reached, others over the whole sub-step, of `left` seconds. `velocity` has the velocities of the rows, which are
    /// those of its middle, `work.c` their accelerations.
    fn watch_limits(&mut self, core: &Core, (velocity, left): (&[f64], f64), keep: &mut [bool]) {
        let (work, contact_constraints, watch) = (&self.work, self.work.contact_constraints.len(), &mut self.watch);
        watch.limits.clear();
        let mut located = vec![false; work.targets.len()];
        for limit in &work.limits {
            let (mut rate, mut acceleration) = (0.0, 0.0);
            if let Some(i) = limit.target.map(|i| i as usize) {
                let row = work.rows.blocks[contact_constraints + i].row as usize;
                let bias = work.targets[i].bias_acceleration;
                (rate, acceleration) = (velocity[row] - 0.5 * left * bias, work.c[row] + bias);
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
}
