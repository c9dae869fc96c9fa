//! Contacts that a step finds late: those of bodies that impacts deflect.

use super::TimeStepping;
use crate::contact::detect::ContactConstraint;
use crate::step::Moment;
use crate::step::contacts::{lay_contacts_again, zero};
use crate::step::impact::{self, Candidate};
use crate::world::Core;
use smallvec::SmallVec;

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
                stops: false,
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
