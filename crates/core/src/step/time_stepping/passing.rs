//! Contacts that a step finds late: those of bodies that impacts or contacts deflect.
//!
//! Contacts are predicted for bodies in free motion. Other contacts may deflect fast bodies into what
//! they would have passed. So if fast bodies have left their free motion by more than a small part of
//! their size, contacts are detected again at the end of the step. Pairs that overlap there get the
//! contacts of that place, and positions are corrected again:
//!
//! ```text
//! gap(Δ) = gap_1 + n·(Δ_A − Δ_B) ≥ 0        Δ: displacement after the first correction
//! ```
//!
//! `gap_1` and `n` are those of the end of the step. Velocities stay: the pair touches at the start of
//! the next step, and meets there. A correction may bring other pairs to overlap, so there are a few
//! rounds.

use super::TimeStepping;
use crate::contact::detect::{ContactConstraint, ContactKey, Owner};
use crate::contact::pair::PredictionMode;
use crate::contact::time_of_impact::pose_after_free_motion;
use crate::object::Level;
use crate::object::part_state::PartState;
use crate::step::contacts::{detect, lay_contacts_again, zero};
use crate::step::correction::{self, Contacts, Impulses, Limits, Options, Velocities};
use crate::step::impact::{self, Candidate};
use crate::step::{Moment, Workspace};
use crate::world::{Core, StepError};
use smallvec::SmallVec;

/// Maximum number of corrections for pairs that are deflected into each other.
const ROUNDS: u32 = 2;
/// Parts that have left their free motion by less than this fraction of their bounding radius are not
/// looked at again.
const DEFLECTED: f64 = 0.02;

/// A contact with its numbers in the step.
struct Filed {
    constraint: ContactConstraint,
    candidate: Option<Candidate>,
    /// Impulses of the impacts and of the solve.
    impact: SmallVec<[f64; 3]>,
    lambda: SmallVec<[f64; 3]>,
    keep: bool,
}

impl TimeStepping {
    /// Corrects the positions at the end of a step of `h` seconds, first for the contacts of the step,
    /// then also for pairs of which others have deflected one into the other.
    pub(super) fn correct(
        &mut self,
        core: &mut Core,
        middle: &mut Moment,
        h: f64,
        (u, du_force): ([&[f64]; 2], &[f64]),
    ) -> Result<(), StepError> {
        let struck: Vec<bool> = self.impact_fraction.iter().map(|s| *s >= 0.0).collect();
        let mut moved = std::mem::take(&mut self.buffers.moved);
        moved.clear();
        for round in 0..=ROUNDS {
            let spent = core.meter.left(1.0).is_some_and(|left| (left as usize) < self.work.rows.blocks.len());
            let deflected = if round > 0 && !spent { self.add_deflected(core, middle, h) } else { Vec::new() };
            if round > 0 && deflected.is_empty() {
                break;
            }
            let (work, mean) = (&mut self.work, &mut self.buffers.mean);
            mean.iter_mut().zip(&work.frictionless.du).for_each(|(v, du)| *v += du);
            end_at(work, &deflected, (mean, h));
            moved.resize(mean.len(), 0.0);
            work.frictionless.du.clear();
            let options = Options {
                h,
                impulses: (round == 0).then_some(Impulses {
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
            correction::correct(core, Some(&mut *middle), work, &mut self.probe, &options)?;
            moved.iter_mut().zip(&work.frictionless.du).for_each(|(sum, du)| *sum += du);
        }
        self.buffers.moved = moved;
        Ok(())
    }

    /// Adds the contacts of pairs that overlap at the present state, the end of a step of `h` seconds, and had
    /// none in the step. Returns their keys and their gaps there, m.
    fn add_deflected(&mut self, core: &mut Core, middle: &mut Moment, h: f64) -> Vec<(ContactKey, f64)> {
        if self.buffers.predicted.is_empty() {
            return Vec::new();
        }
        let mut end = core.moment();
        end.refresh(core);
        let (mut found, mut gaps) = (Vec::new(), Vec::new());
        if has_deflected(core, &end.derived.part_states, h) {
            let report = core.report;
            detect(core, Some(&end), (0.0, PredictionMode::Each), &mut found);
            core.report = report;
            let known = &self.work.contact_constraints;
            let is_new = |t: &ContactConstraint| known.binary_search_by_key(&t.key, |known| known.key).is_err();
            found.retain(|t| t.contact.gap < -core.settings.contact_tolerance && is_new(t));
            for constraint in &mut found {
                let parts = [constraint.a, constraint.b].map(|part| part as usize);
                let state = |part: usize| end.derived.part_states[part].position();
                let ways = parts.map(|part| state(part) - core.derived.part_states[part].position());
                gaps.push((constraint.key, constraint.contact.gap));
                constraint.place_at(&constraint.contact.clone(), ways, h);
            }
        }
        core.moments.push(end);
        if !found.is_empty() {
            self.file(core, middle, found);
        }
        gaps
    }

    /// Adds contacts, which take no part in the impacts of this step, and builds the rows of contacts
    /// again. Impulses stay with their contacts.
    pub(super) fn file(&mut self, core: &mut Core, middle: &mut Moment, found: Vec<ContactConstraint>) {
        let work = &mut self.work;
        let old = work.contact_constraints.len();
        let of_contacts = work.rows.blocks.get(old).map_or(work.rows.len, |block| block.row as usize);
        let of_constraints = [&self.impact, &work.lambda].map(|numbers| numbers[of_contacts..].to_vec());
        let mut filed: Vec<Filed> = Vec::with_capacity(old + found.len());
        for (i, (constraint, block)) in work.contact_constraints.drain(..).zip(&work.rows.blocks).enumerate() {
            filed.push(Filed {
                constraint,
                candidate: self.candidates.get(i).copied(),
                impact: self.impact[block.range()].into(),
                lambda: work.lambda[block.range()].into(),
                keep: self.buffers.keep.get(i).copied().unwrap_or(true),
            });
        }
        filed.extend(found.into_iter().map(|constraint| Filed {
            candidate: (self.candidates.len() == old).then_some(Candidate {
                takes_part: false,
                rest_speed: impact::SLOWEST_BOUNCE,
                restitution: constraint.restitution,
                crowd: false,
            }),
            constraint,
            impact: SmallVec::new(),
            lambda: SmallVec::new(),
            keep: false,
        }));
        filed.sort_by_key(|filed| filed.constraint.key);
        self.candidates = filed.iter().filter_map(|filed| filed.candidate).collect();
        let keep = filed.iter().map(|filed| filed.keep);
        self.buffers.keep = keep.chain(self.buffers.keep.iter().skip(old).copied()).collect();
        let numbers: Vec<_> = filed
            .into_iter()
            .map(|Filed { constraint, impact, lambda, .. }| {
                work.contact_constraints.push(constraint);
                (impact, lambda)
            })
            .collect();
        lay_contacts_again(core, middle, work, old);
        zero(&mut self.impact, work.rows.len);
        for ((impact, lambda), block) in numbers.iter().zip(&work.rows.blocks).filter(|((i, _), _)| !i.is_empty()) {
            self.impact[block.range()].copy_from_slice(impact);
            work.lambda[block.range()].copy_from_slice(lambda);
        }
        for (numbers, of_constraints) in [&mut self.impact, &mut work.lambda].into_iter().zip(&of_constraints) {
            let first = numbers.len() - of_constraints.len();
            numbers[first..].copy_from_slice(of_constraints);
        }
    }
}

/// Sets the gaps of contacts at the start of a step of `h` seconds so that their rows have the given gaps (m)
/// at its end, at the mean velocity `mean`.
fn end_at(work: &mut Workspace, ends: &[(ContactKey, f64)], (mean, h): (&[f64], f64)) {
    for (key, end) in ends {
        let Ok(i) = work.contact_constraints.binary_search_by_key(key, |t| t.key) else { continue };
        let block = &work.rows.blocks[i];
        let rate = work.bias[block.row as usize] + work.rows.row_velocity(block, 0, mean);
        let constraint = &mut work.contact_constraints[i];
        constraint.moved.turned = end - h * rate - constraint.contact.gap;
    }
}

/// Returns whether a part is at another place after `h` seconds than free motion would have brought it to.
fn has_deflected(core: &Core, end: &[PartState], h: f64) -> bool {
    let moved = |(index, owner): (usize, &Owner)| {
        let entry = core.objects().at(owner.place as usize);
        let Some(shape) = entry.object.collidable().and_then(|c| c.shape(owner.part as usize)) else { return false };
        let free = pose_after_free_motion(&core.derived.part_states[index], h).translation.vector;
        entry.moves() && (end[index].position() - free).norm() > DEFLECTED * shape.bounding_radius()
    };
    core.owners.iter().enumerate().any(moved)
}
