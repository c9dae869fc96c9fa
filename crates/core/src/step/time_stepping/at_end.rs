//! Corrections at the end of a step: first by its own rows, then of the overlap that these rows do not see.
//!
//! A row has one point and one normal, and a step finds the contacts of free motion. So a part that turns far, the rim of a
//! cylinder that tips between two of its contacts, and a body that others deflect may overlap at the end of a step, although all of its rows hold.
//! Where parts have turned or left their free motion by more than the drift tolerance, the contacts of the end are
//! detected, and overlap beyond that tolerance is projected away there (`correction/overlap.rs`), with the rows of that place:
//!
//! ```text
//! found where     r·|Δθ| > d   or   |x_1 − x_free| > d + h²·|a|           d: drift tolerance,  r: bounding radius
//! goal            gap ≥ min(0, gap_0 + recovery)                          gap_0: deepest gap of the pair at the start
//! contacts        gap ≤ max(10·d, 2·D)                                    D: deepest overlap
//! ```
//!
//! A correction moves bodies by about the overlap that it takes away, so contacts further apart take no part. It ends when the
//! rows say that nothing overlaps, and bodies have turned so little that the rows can be believed.
//!
//! Velocities stay, so the pair touches at the start of the next step, and meets there. The correction may raise bodies. A group
//! that made energy in the step pays for it from its kinetic energy, with one factor for all its velocities:
//!
//! ```text
//! made = ½|u_1|² − ½|u_0|² − f·(h·v̄ + Δ) − Σ λ·½(w_0 + w_1)        of the step, as in lift.rs
//! u_1 ← s·u_1,    ½(1 − s²)·|u_1|² = min(lift, made + lift)          lift = −f·Δ of this correction
//! ```

use super::TimeStepping;
use super::lift::{coordinates, coordinates_of};
use crate::constraint::rows::Block;
use crate::contact::detect::ContactConstraint;
use crate::contact::pair::{PredictionMode, Reach};
use crate::contact::time_of_impact::pose_after_free_motion;
use crate::linearize::Switch;
use crate::object::Level;
use crate::object::part_state::PartState;
use crate::step::Moment;
use crate::step::contacts::{build_rows, detect, push, whiten};
use crate::step::correction::{self, Contacts, Impulses, Limits, Options, Velocities};
use crate::world::{Core, StepError};
use tumble_collide::Shape;

/// Maximum number of corrections of overlap that the rows of the step do not see.
const ROUNDS: u32 = 3;
/// Distance within which a correction looks for contacts at first, in drift tolerances.
const FIRST_REACH: f64 = 10.0;
/// Least such distance in deepest overlaps: two bodies may be pushed towards each other, each as far.
const PUSHED: f64 = 2.0;
/// A budget that does not pay for as many sweeps leaves the overlap to the next step.
const LEAST_SWEEPS: usize = 8;
/// Energy below this fraction of a group's kinetic energy is rounding.
const ROUNDING: f64 = 1e-13;

/// A step as the correction of its end needs it.
#[derive(Default)]
pub(super) struct Taken {
    /// Part states at its start.
    start: Vec<PartState>,
    /// Energy that each coordinate had at the start, with the work of forces on it, J.
    energy: Vec<f64>,
    /// Work of each row of a constraint, J.
    work: Vec<f64>,
}

impl TimeStepping {
    /// Corrects the positions at the end of a step of `h` seconds by its rows.
    pub(super) fn correct(
        &mut self,
        core: &mut Core,
        middle: &mut Moment,
        h: f64,
        (u, du_force): ([&[f64]; 2], &[f64]),
    ) -> Result<(), StepError> {
        let struck: Vec<bool> = self.impact_fraction.iter().map(|s| *s >= 0.0).collect();
        let (work, mean) = (&mut self.work, &self.buffers.mean);
        work.frictionless.du.clear();
        let options = Options {
            h,
            impulses: Some(Impulses {
                velocities: Velocities::Whitened(u),
                du_force: (du_force, h),
                scale: 1.0,
                struck: &struck,
            }),
            level: Level::Velocity { h },
            start: &self.x0,
            contacts: Contacts::Moved { mean },
            limits: Limits::Violated,
            recovery: core.settings.recovery_speed * h,
            tolerance: core.settings.contact_tolerance,
        };
        correction::correct(core, Some(middle), work, &mut self.probe, &options)?;
        self.buffers.moved.clone_from(&self.work.frictionless.du);
        self.buffers.moved.resize(self.buffers.mean.len(), 0.0);
        Ok(())
    }

    /// Keeps what [`separate_at_end`](Self::separate_at_end) needs of a step, before it goes to the end. `u` are the whitened
    /// velocities at both ends.
    pub(super) fn keep(&mut self, core: &Core, [u0, u1]: [&[f64]; 2], du_force: &[f64], lambda: &[f64]) {
        let (taken, work, buffers) = (&mut self.taken, &self.work, &self.buffers);
        core.table.walk.parts.copy(&core.derived.part_states, &mut taken.start);
        taken.energy.clear();
        let path = |i: usize| buffers.mean[i] + buffers.moved[i];
        taken.energy.extend((0..u0.len()).map(|i| 0.5 * u0[i] * u0[i] + du_force[i] * path(i)));
        taken.work.clear();
        taken.work.extend(work.rows.blocks[work.contact_constraints.len()..].iter().map(|block| {
            let velocity = |u: &[f64]| work.rows.row_velocity(block, 0, u);
            lambda[block.row as usize] * 0.5 * (velocity(u0) + velocity(u1))
        }));
    }

    /// Removes overlap that the rows of a step of `h` seconds did not see. The state and the values derived from it
    /// are those of its end.
    pub(super) fn separate_at_end(&mut self, core: &mut Core, h: f64) -> Result<(), StepError> {
        if !core.branches.take(Switch::Overlap, None, self.strays(core, h)) {
            return Ok(());
        }
        let tolerance = core.settings.drift_tolerance;
        let mut reach = FIRST_REACH * tolerance;
        // where contacts cost much, those that the next step starts with are looked at first: mostly nothing overlaps
        let ahead = core.detect_scratch.keeps_contacts().then_some(Reach::in_time(h, PredictionMode::Each));
        for _ in 0..ROUNDS {
            let mut deepest = self.find_at_end(core, h, ahead.unwrap_or(Reach::in_place(reach)));
            if !core.branches.take(Switch::Overlap, None, deepest > tolerance) {
                break;
            }
            if ahead.is_some() {
                deepest = self.find_at_end(core, h, Reach::in_place(reach));
            }
            // also those that the correction may push together
            if PUSHED * deepest > reach {
                reach = PUSHED * deepest;
                self.find_at_end(core, h, Reach::in_place(reach));
            }
            build_rows(core, None, &mut self.end, Level::Velocity { h }, 0.0)?;
            let least = LEAST_SWEEPS * self.end.rows.blocks.len();
            if core.meter.left(1.0).is_some_and(|left| (left as usize) < least) {
                break;
            }
            let options = Options {
                h,
                impulses: None,
                level: Level::Velocity { h },
                start: &[],
                contacts: Contacts::InPlace,
                limits: Limits::Free,
                recovery: f64::INFINITY,
                tolerance: core.settings.contact_tolerance,
            };
            core.table.walk.parts.copy(&core.derived.part_states, &mut self.before);
            self.end.frictionless.du.clear();
            correction::correct(core, None, &mut self.end, &mut self.probe, &options)?;
            if self.end.frictionless.du.iter().all(|du| *du == 0.0) {
                break;
            }
            self.pay_at_end(core);
            core.integration().refresh();
            let done = self.is_separated(core, reach);
            if core.branches.take(Switch::Overlap, None, done) {
                break;
            }
        }
        Ok(())
    }

    /// Returns whether the last correction has left no overlap beyond the tolerance, by its rows: if bodies have moved so little
    /// that the contacts within `reach`, m, are all that matter, and turned so little that their rows give their gaps.
    fn is_separated(&self, core: &Core, reach: f64) -> bool {
        let (end, half) = (&self.end, 0.5 * core.settings.drift_tolerance);
        let is_rigid = |block: &Block| block.sides().iter().all(|side| side.dof == 6);
        let closes = |(constraint, block): (&ContactConstraint, &Block)| {
            constraint.gap_of_row() + end.rows.row_velocity(block, 0, &end.frictionless.du) < -half
        };
        if !end.rows.blocks.iter().all(is_rigid) || end.contact_constraints.iter().zip(&end.rows.blocks).any(closes) {
            return false;
        }
        let far = |part: usize| {
            let (before, after) = (&self.before[part], &core.derived.part_states[part]);
            let way = (after.position() - before.position()).norm();
            let turn = 2.0 * (after.pose.rotation * before.pose.rotation.inverse()).imag().norm();
            let radius = shape_of(core, part as u32).map_or(0.0, Shape::bounding_radius);
            // both bodies of a contact move
            way + turn * radius > 0.5 * reach || turn * turn * radius > half
        };
        !core.table.walk.parts.iter().flatten().any(far)
    }

    /// Finds the contacts at the end of a step of `h` seconds. Returns the deepest overlap that is to be
    /// taken away, m.
    fn find_at_end(&mut self, core: &mut Core, h: f64, within: Reach) -> f64 {
        let report = core.report;
        detect(core, None, within, &mut self.end.contact_constraints);
        core.report = report;
        self.allow_old_overlap(core.settings.recovery_speed * h);
        self.end.contact_constraints.iter().map(|t| -t.contact.gap).fold(0.0, f64::max)
    }

    /// Returns whether a part with contacts has turned, or any part has left its free motion, by so much that the rows of a
    /// step of `h` seconds may not see an overlap.
    fn strays(&self, core: &Core, h: f64) -> bool {
        let least = core.settings.drift_tolerance;
        let (start, end) = (&self.taken.start, &core.derived.part_states);
        let turns = |part: u32| {
            let Some(shape) = shape_of(core, part) else { return false };
            let (before, after) = (&start[part as usize], &end[part as usize]);
            let spin = before.angular_velocity.norm().max(after.angular_velocity.norm());
            !matches!(shape, Shape::Sphere { .. }) && h * spin * shape.bounding_radius() > least
        };
        let leaves = |part: usize| {
            let (before, after) = (&start[part], &end[part]);
            let free = pose_after_free_motion(before, h).translation.vector;
            (after.position() - free).norm() > least + h * h * before.acceleration.norm()
                && (after.position() - before.position()).norm() > least
        };
        self.work.contact_constraints.iter().any(|t| turns(t.a) || turns(t.b))
            || core.table.walk.parts.iter().flatten().any(|part| leaves(part) && shape_of(core, part as u32).is_some())
    }

    /// Raises the gaps of pairs that overlapped at the start of the step to what is to be left of it, m: that is reduced by at
    /// most `recovery`.
    fn allow_old_overlap(&mut self, recovery: f64) {
        let known = &self.work.contact_constraints;
        if !known.iter().any(|t| t.found_at == 0.0 && -t.contact.gap > recovery) {
            return;
        }
        for constraint in &mut self.end.contact_constraints {
            let pair = constraint.key.pair;
            let first = known.partition_point(|t| t.key.pair < pair);
            let of_pair = known[first..].iter().take_while(|t| t.key.pair == pair);
            let depth = |t: &ContactConstraint| if t.found_at == 0.0 { -t.contact.gap } else { 0.0 };
            let deepest = of_pair.map(depth).fold(0.0, f64::max);
            constraint.contact.gap += (deepest - recovery).max(0.0);
        }
    }

    /// Takes the potential energy of the last correction from the kinetic energy of groups that made energy in the step.
    fn pay_at_end(&mut self, core: &mut Core) {
        let (end, taken) = (&mut self.end, &mut self.taken);
        let contacts = end.contact_constraints.len();
        let (mut u, mut force) = (Vec::new(), Vec::new());
        whiten(core.coordinates(None), &self.work.dp, 1.0, &mut u, &mut force);
        let moved = &end.frictionless.du;
        let rows = &end.rows;
        end.islands.build(rows, |b| b >= contacts || coordinates(&rows.blocks[b]).any(|i| moved[i] != 0.0));
        let mut du = vec![0.0; u.len()];
        for blocks in end.islands.iter() {
            let places = coordinates_of(rows, blocks);
            let sum = |of: &dyn Fn(usize) -> f64| places.iter().map(|&i| of(i)).sum::<f64>();
            let lift = -sum(&|i| force[i] * moved[i]);
            let driven = |&b: &u32| {
                let target = (b as usize).checked_sub(contacts).map_or(0.0, |i| end.targets[i].velocity);
                target != 0.0 || rows.blocks[b as usize].range().any(|row| end.bias[row] != 0.0)
            };
            if lift <= 0.0 || blocks.iter().any(driven) {
                continue;
            }
            let of_rows = blocks.iter().filter_map(|&b| (b as usize).checked_sub(contacts));
            let by_rows: f64 = of_rows.filter_map(|i| taken.work.get(i)).sum();
            let kinetic = sum(&|i| 0.5 * u[i] * u[i]);
            let made = kinetic + lift - sum(&|i| taken.energy[i]) - by_rows;
            let paid = lift.min(made).min(kinetic);
            if paid > ROUNDING * kinetic {
                let scale = (1.0 - paid / kinetic).max(0.0).sqrt() - 1.0;
                places.iter().for_each(|&i| du[i] = scale * u[i]);
            }
            // what has been lifted is no work that is left
            places.iter().for_each(|&i| taken.energy[i] += force[i] * moved[i]);
        }
        push(core.coordinates(None), &du, &mut Vec::new());
    }
}

fn shape_of(core: &Core, part: u32) -> Option<&Shape> {
    let owner = core.owners[part as usize];
    let entry = core.objects().at(owner.place as usize);
    entry.object.collidable()?.shape(owner.part as usize)
}
