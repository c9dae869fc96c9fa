//! Impacts within a step of `time_stepping`: which contacts strike, when, and what follows.
//!
//! A group of touching bodies with an impact has a phase of reflections (`step/impact.rs`) at the
//! time of its first impact. A group with more than [`CROWD`] contacts has none: in a heap every
//! reflection strikes others, and passes would go on through the whole heap in every step. Its
//! contacts are stopped by the solve of all contacts, like those that close later in the step, and
//! rebound at its end, all at once and with no more energy than that solve took from them.
//!
//! A contact without restitution has no reflection. It stops in the solve of all contacts, with the rows of the time at
//! which it closes, so that spin and angular momentum are right.
//!
//! A contact that carried a force in the last sub-step bounces only if it approaches faster than the
//! forces of a step change the speed of either body along its normal: what is below is load that
//! comes and goes, not an impact.

use super::moving::FreeTerms;
use super::{Buffers, TimeStepping, in_the_middle, moving};
use crate::constraint::rows::Side;
use crate::contact::detect::ContactConstraint;
use crate::contact::pair::{PredictionMode, Reach};
use crate::contact::time_of_impact::{moving_pair, time_to_close};
use crate::integrators::context::free_motion;
use crate::object::Level;
use crate::step::Moment;
use crate::step::adhesion::adhere;
use crate::step::budget::{IMPACTS, REBOUND};
use crate::step::contacts::{build_rows, detect, push, row_velocities, whiten, zero};
use crate::step::impact::{self, Candidate};
use crate::world::{Coordinates, Core, StepError};

/// Maximum number of passes of the impact phase.
const IMPACT_PASSES: u32 = 50;
/// Groups of touching bodies with more contacts have no impact phase: their contacts rebound at the
/// end of the step, all at once.
const CROWD: usize = 100;

/// A contact without restitution that has lost more than this share of its approach speed when it closes grazes.
const GRAZING: f64 = 0.5;

/// A gap (m) in free motion, with its rate and the change of the rate, per step.
struct Approach {
    gap: f64,
    rate: f64,
    gain: f64,
}

impl Approach {
    /// Returns the gap at a fraction of the step, m.
    fn gap_at(&self, fraction: f64) -> f64 {
        self.gap + fraction * (self.rate + 0.5 * fraction * self.gain)
    }
}

/// Returns whether a contact may have a time of impact: it bounces, or it is open and not of a link, on which all impulses act
/// in the middle of the step.
fn may_strike(core: &Core, constraint: &ContactConstraint) -> bool {
    let entry = |part: u32| core.objects().at(core.owners[part as usize].place as usize);
    let of_link = || [constraint.a, constraint.b].iter().any(|part| in_the_middle(&entry(*part)));
    constraint.restitution > 0.0 || constraint.gap_of_row() > 0.0 && !of_link()
}

/// Returns whether an open contact without restitution, which approaches at `speed` when it closes, stops at that time.
/// What grazes, or is only brought together by the forces of the step, is left to its gap, and so are concave meshes, whose
/// contacts are not found again at that time.
fn stops(core: &Core, constraint: &ContactConstraint, (v, gain): (f64, f64), speed: f64) -> bool {
    let sides = [constraint.a, constraint.b];
    let pair = || {
        moving_pair(core.part_table(), sides, constraint.plane.as_deref())
            .is_some_and(|pair| pair.shapes.iter().all(|shape| shape.has_convex_parts()))
    };
    speed > (GRAZING * -v).max(-gain) && pair()
}

impl TimeStepping {
    /// Resolves the impacts within the step. `after` becomes the whitened velocity after them,
    /// without forces. If there are any, rows and whitened velocities are computed again at the
    /// places of the impacts.
    pub(super) fn impacts(
        &mut self,
        core: &mut Core,
        middle: &mut Moment,
        h: f64,
        u: &mut Vec<f64>,
        du_force: &mut Vec<f64>,
        after: &mut Vec<f64>,
    ) -> Result<(), StepError> {
        let work = &mut self.work;
        after.clone_from(u);
        self.impact_fraction.clear();
        self.impact_fraction.resize(core.dof, -1.0);
        zero(&mut self.impact, work.rows.len);
        self.candidates.clear();
        if !work.contact_constraints.iter().any(|constraint| may_strike(core, constraint)) {
            return Ok(());
        }
        let (before, gain) = (&mut self.buffers.before, &mut self.buffers.gain);
        let (mut impact_fractions, mut approaches, mut rates) = (Vec::new(), Vec::new(), Vec::new());
        row_velocities(&core.threads, &work.rows, &work.bias, u, before);
        zero(gain, work.rows.len);
        work.rows.add_velocity(du_force, gain);
        let free = FreeTerms::new(middle, core, h);
        for (i, constraint) in work.contact_constraints.iter().enumerate() {
            let block = &work.rows.blocks[i];
            let (row, gap) = (block.row as usize, constraint.gap_of_row());
            let dv = gain[row];
            let (v, rate) = moving::gap_rate(work, i, &free, (before[row], h));
            let pressed = if core.state.warm.carries(&constraint.key) {
                let side = |s: &Side| work.rows.side_velocity(s, 0, du_force).abs();
                block.sides().iter().map(side).fold(0.0, f64::max)
            } else {
                -dv
            };
            let rest_speed = pressed.max(impact::SLOWEST_BOUNCE);
            let gain = dv + h * rate;
            let time = time_to_close(gap / h, v, gain).filter(|s| *s <= 1.0 && may_strike(core, constraint));
            let impact_fraction = time.filter(|s| {
                let speed = -(v + s * gain);
                let bounces = constraint.restitution > 0.0;
                if bounces { speed > rest_speed } else { speed > pressed && stops(core, constraint, (v, gain), speed) }
            });
            impact_fractions.push(impact_fraction);
            rates.push(rate);
            approaches.push(Approach { gap, rate: h * v, gain: h * (dv + h * rate) });
            self.candidates.push(Candidate {
                takes_part: constraint.contact.gap <= core.settings.drift_tolerance,
                stops: false,
                rest_speed,
                restitution: constraint.restitution,
                crowd: false,
            });
        }
        if impact_fractions.iter().any(Option::is_some) {
            self.leave_crowds(&mut impact_fractions);
        }
        if impact_fractions.iter().all(Option::is_none) {
            return Ok(());
        }
        self.first_impacts(&impact_fractions, &approaches, core.settings.contact_tolerance);
        self.go_to_impacts(core, middle, h);
        let work = &mut self.work;
        moving::move_to_impacts(core, work, (&self.impact_fraction, &rates), h);
        build_rows(core, Some(&mut *middle), work, Level::Velocity { h }, 0.5 * h)?;
        whiten(middle.coordinates(core), &work.dp, h, u, du_force);
        adhere(work, core.settings.drift_tolerance, h, du_force);
        let at_impact: Vec<f64> = (0..u.len()).map(|i| u[i] + self.impact_fraction[i].max(0.0) * du_force[i]).collect();
        after.clone_from(&at_impact);
        let budget = core.meter.left(IMPACTS);
        impact::resolve(core, work, &self.candidates, (IMPACT_PASSES, false, budget), after, &mut self.impact);
        (0..u.len()).for_each(|i| after[i] = u[i] + (after[i] - at_impact[i]));
        Ok(())
    }

    /// Moves the objects that have an impact to where it happens.
    fn go_to_impacts(&self, core: &Core, middle: &mut Moment, h: f64) {
        let Coordinates { objects, x, caches, .. } = middle.coordinates(core);
        for entry in objects.iter().filter(|e| !in_the_middle(e)) {
            let impact_fraction = entry.state_range.v.clone().next().map_or(-1.0, |i| self.impact_fraction[i]);
            if impact_fraction >= 0.0 {
                let x = &mut x[entry.state_range.x.clone()];
                x.copy_from_slice(&self.x0[entry.state_range.x.clone()]);
                free_motion(&entry, &mut caches[entry.place], x, h * impact_fraction);
            }
        }
        middle.refresh(core);
    }

    /// Adds the contacts that bodies may reach because of their impacts, and builds the rows again.
    /// These contacts prevent overlap in this step and bounce in the next.
    pub(super) fn look_again(&mut self, core: &mut Core, middle: &mut Moment, h: f64, before: &[f64], after: &[f64]) {
        if self.impact.iter().all(|i| *i == 0.0) {
            return;
        }
        let change: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
        let (mut struck, mut found) = (core.moment(), Vec::new());
        push(struck.coordinates_by(core, &mut middle.derived.caches), &change, &mut Vec::new());
        struck.refresh(core);
        let mut old: Vec<[u32; 4]> = self.work.contact_constraints.iter().map(|t| t.key.pair).collect();
        old.dedup();
        let reach = Reach { known: &old, ..Reach::in_time(h, PredictionMode::Each) };
        detect(core, Some(&struck), reach, &mut found);
        core.moments.push(struck);
        found.retain(|t| old.binary_search(&t.key.pair).is_err());
        if !found.is_empty() {
            self.file(core, middle, found);
        }
        core.report.contacts = self.work.contact_constraints.len() as u32;
    }

    /// Leaves the impacts of large groups of touching bodies to the rebound at the end of the step.
    fn leave_crowds(&mut self, impact_fractions: &mut [Option<f64>]) {
        let work = &mut self.work;
        let candidates = &mut self.candidates;
        work.islands
            .build(&work.rows, |b| b >= candidates.len() || candidates[b].takes_part || impact_fractions[b].is_some());
        for blocks in work.islands.iter().filter(|blocks| blocks.len() > CROWD) {
            let contacts = || blocks.iter().map(|&b| b as usize).filter(|b| *b < impact_fractions.len());
            if contacts().any(|b| impact_fractions[b].is_some() && candidates[b].restitution > impact::ELASTIC) {
                continue;
            }
            for b in contacts().collect::<Vec<_>>() {
                (impact_fractions[b], candidates[b].crowd) = (None, true);
            }
        }
    }

    /// Selects the contacts that take part in the impacts: the first ones among bodies that impacts
    /// of this step connect, those whose gap is within the tolerance (m) then, and those that touch
    /// the same island. Later ones rebound at the end of
    /// the step; islands without an impact take no part.
    fn first_impacts(&mut self, impact_fractions: &[Option<f64>], approaches: &[Approach], tolerance: f64) {
        let work = &mut self.work;
        work.islands.build(&work.rows, |b| impact_fractions.get(b).is_some_and(Option::is_some));
        for blocks in work.islands.iter() {
            let first = blocks.iter().filter_map(|&b| impact_fractions[b as usize]).fold(1.0, f64::min);
            for side in blocks.iter().flat_map(|&b| work.rows.blocks[b as usize].sides()) {
                self.impact_fraction[side.u as usize..(side.u + side.dof) as usize].fill(first);
            }
        }
        let first = |i: usize| {
            let times = work.rows.blocks[i].sides().iter().map(|side| self.impact_fraction[side.u as usize]);
            let stays = self.candidates[i].restitution <= 0.0 && approaches[i].rate < 0.0;
            let closes = impact_fractions[i].or(stays.then_some(f64::INFINITY));
            let now = |s: f64, first: f64| s <= first + 1e-9 || approaches[i].gap_at(first) <= tolerance;
            closes.is_some_and(|s| times.clone().all(|first| first >= 0.0 && now(s, first)))
        };
        let strikes: Vec<bool> = (0..impact_fractions.len()).map(first).collect();
        for (candidate, strikes) in self.candidates.iter_mut().zip(&strikes) {
            candidate.takes_part |= strikes;
            candidate.stops = *strikes && candidate.restitution <= 0.0;
        }
        let (candidates, contact_constraints) = (&mut self.candidates, work.contact_constraints.len());
        work.islands.build(&work.rows, |b| b >= contact_constraints || candidates[b].takes_part);
        for blocks in
            work.islands.iter().filter(|blocks| !blocks.iter().any(|&b| strikes.get(b as usize) == Some(&true)))
        {
            blocks
                .iter()
                .map(|&b| b as usize)
                .filter(|b| *b < contact_constraints)
                .for_each(|b| candidates[b].takes_part = false);
        }
    }

    /// Resolves the rebound of contacts that were not among the first of their bodies: the solve of
    /// all contacts has stopped them at the surface. `late` becomes the change of whitened velocity
    /// at the end of the step.
    pub(super) fn rebound(&mut self, core: &mut Core, u: &[f64], du_force: &[f64]) {
        let (work, Buffers { before, gain, parts, late, change, .. }) = (&mut self.work, &mut self.buffers);
        zero(late, core.dof);
        if parts.iter().all(|part| part.rebound <= 0.0) {
            return;
        }
        row_velocities(&core.threads, &work.rows, &work.bias, u, gain);
        // impulses act at the time of impact or in the middle of the step: forces follow, for the rest of it
        let rest = |(i, du): (usize, &f64)| {
            let impact_fraction = self.impact_fraction[i];
            du * (1.0 - if impact_fraction < 0.0 { 0.5 } else { impact_fraction })
        };
        let follows: Vec<f64> = du_force.iter().enumerate().map(rest).collect();
        zero(change, work.rows.len);
        work.rows.add_velocity(&follows, change);
        let contacts = parts.len();
        let taken = |b: usize| -> f64 {
            let rows = work.rows.blocks[b].range();
            rows.map(|row| work.lambda[row] * (change[row] - 0.5 * (before[row] + gain[row]))).sum()
        };
        for (b, part) in parts.iter_mut().enumerate() {
            part.member = part.rebound > 0.0 && work.lambda[work.rows.blocks[b].row as usize] > 0.0;
            part.rebound = if part.member { part.rebound } else { 0.0 };
            part.energy = if part.member { taken(b).max(0.0) } else { 0.0 };
        }
        // a light body between others has contacts that give some of the energy back which others take
        let acts = |b: usize| work.rows.blocks[b].range().any(|row| work.lambda[row] != 0.0);
        work.islands.build(&work.rows, acts);
        for blocks in work.islands.iter() {
            let of_contacts = || blocks.iter().map(|&b| b as usize).filter(|&b| b < contacts);
            let all: f64 = of_contacts().map(taken).sum();
            let members: f64 = of_contacts().map(|b| parts[b].energy).sum();
            let share = (all / members).clamp(0.0, 1.0);
            of_contacts().filter(|_| members > all).for_each(|b| parts[b].energy *= share);
        }
        if parts.iter().any(|part| part.member) {
            let forces = work.lambda.clone();
            let budget = core.meter.left(REBOUND);
            if !impact::rebound(core, work, parts, u, budget) {
                work.lambda = forces;
                return;
            }
            late.copy_from_slice(&work.du);
            self.impact.iter_mut().zip(&work.lambda).for_each(|(total, late)| *total += late);
            work.lambda = forces;
        }
    }
}
