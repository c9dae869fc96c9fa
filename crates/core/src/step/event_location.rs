//! Event location for sub-steps of `backtracking`: when the next gap should close, and how far a
//! tried state is from the first crossing.
//!
//! A *margin* is a gap plus the depth that its pair (or limit) is allowed, less the contact
//! tolerance. It is 0 at the crossing. A state whose margin is within the tolerance on either side
//! has landed.

use super::contacts::Limit;
use crate::contact::detect::ContactConstraint;
use crate::contact::time_of_impact::time_to_close;
use crate::object::part_state::PartState;
use crate::settings::Settings;

/// A larger margin is not measured, m.
const FAR: f64 = 1e-4;
/// A contact or limit that touches and is slower than this may drift like a lasting one, m/s or
/// rad/s.
pub(super) const SLOW: f64 = 1e-3;

/// The role of a contact in the sub-step that begins.
#[derive(Clone, Copy)]
pub(super) struct Role {
    pub lasts: bool,
    pub touching: bool,
    /// Whether the gap opens, at the place and with the normal that the contact has now.
    pub opens: bool,
    /// Depth that does not end the sub-step, m.
    pub allowed: f64,
}

/// The role of a limit with a reported gap.
#[derive(Clone, Copy)]
pub(super) struct LimitRole {
    key: [u32; 2],
    gap: f64,
    rate: f64,
    acceleration: f64,
    touching: bool,
    allowed: f64,
}

impl LimitRole {
    /// Makes the role for a rate and an acceleration of the gap, those without a force of the
    /// limit.
    pub fn new(limit: &Limit, rate: f64, acceleration: f64, s: &Settings) -> LimitRole {
        let slow = rate.abs() < SLOW;
        let touching = limit.gap <= s.contact_tolerance || (slow && limit.gap <= s.drift_tolerance);
        let allowed = match (touching, slow) {
            (true, _) if limit.target.is_none() => f64::INFINITY, // it has no row
            (true, true) => s.drift_tolerance,
            _ => s.contact_tolerance,
        };
        LimitRole {
            key: limit.key,
            gap: limit.gap,
            rate,
            acceleration,
            touching,
            allowed: allowed.max(s.contact_tolerance - limit.gap),
        }
    }

    /// Returns whether the limit is active in the sub-step that begins: its gap is closed and does
    /// not open.
    pub fn acts(&self) -> bool {
        self.touching && self.rate < SLOW
    }
}

/// Contacts and limits that can end a sub-step, as they are at its start.
#[derive(Default)]
pub(super) struct Watch {
    pub roles: Vec<Role>,
    pub limits: Vec<LimitRole>,
    /// Predicted times until limits without a reported gap are reached, s.
    pub guesses: Vec<f64>,
}

impl Watch {
    /// Returns the time at which the first parabola of a contact or limit closes, s; at most
    /// `left`.
    pub fn first_guess(&self, contact_constraints: &[ContactConstraint], part_states: &[PartState], left: f64) -> f64 {
        let contacts = contact_constraints.iter().zip(&self.roles).filter(|(_, role)| !role.touching).filter_map(
            |(constraint, _)| {
                let (a, b) = (&part_states[constraint.a as usize], &part_states[constraint.b as usize]);
                time_to_close(
                    constraint.contact.gap,
                    constraint.velocity(a, b).dot(&constraint.contact.normal),
                    constraint.acceleration(a, b).x,
                )
            },
        );
        let limits =
            self.limits.iter().filter(|l| !l.touching).filter_map(|l| time_to_close(l.gap, l.rate, l.acceleration));
        contacts.chain(limits).chain(self.guesses.iter().copied()).fold(left, f64::min)
    }

    /// Returns the least gap of contacts and limits that do not touch.
    pub fn nearest(&self, contact_constraints: &[ContactConstraint], tolerance: f64) -> f64 {
        let contacts =
            contact_constraints.iter().zip(&self.roles).filter(|(_, r)| !r.touching).map(|(t, _)| t.contact.gap);
        let limits = self.limits.iter().filter(|l| !l.touching).map(|l| l.gap);
        contacts.chain(limits).fold(FAR, f64::min).max(tolerance)
    }

    /// Returns the least margin of a tried state, m, from its contacts `after` and its limits.
    /// `before` are the contacts of the start.
    pub fn margin(
        &self,
        before: &[ContactConstraint],
        after: &[ContactConstraint],
        limits: &[Limit],
        tolerance: f64,
    ) -> f64 {
        let contact = |constraint: &ContactConstraint| {
            let pair = before.partition_point(|t| t.key.pair < constraint.key.pair);
            let same =
                before[pair..].iter().zip(&self.roles[pair..]).take_while(|(t, _)| t.key.pair == constraint.key.pair);
            constraint.contact.gap + same.map(|(_, r)| r.allowed).fold(tolerance, f64::max) - tolerance
        };
        let limit = |limit: &Limit| {
            let role = self.limits.binary_search_by_key(&limit.key, |l| l.key).ok();
            limit.gap + role.map_or(tolerance, |i| self.limits[i].allowed) - tolerance
        };
        after.iter().map(contact).chain(limits.iter().map(limit)).fold(FAR, f64::min)
    }
}

/// The time of a crossing, between a sub-step that ended before it and one that ended after:
/// (length, margin) each.
pub(super) struct Bracket {
    low: (f64, f64),
    high: Option<(f64, f64)>,
    /// Number of consecutive moves of the low end (positive) or of the high end (negative).
    same_side: i32,
    /// The last two tries.
    tries: [(f64, f64); 2],
}

impl Bracket {
    /// Makes a bracket for the margin at the start of the sub-step.
    pub fn new(margin: f64) -> Bracket {
        Bracket { low: (0.0, margin), high: None, same_side: 0, tries: [(0.0, margin); 2] }
    }

    /// Returns whether any try was beyond the crossing.
    pub fn crossed(&self) -> bool {
        self.high.is_some()
    }

    /// Records a try that did not land and returns the next one: false position by the Illinois
    /// rule (an end that stays twice counts half), or bisection every fourth time and while the
    /// margin before the crossing is only known to be large.
    pub fn narrow(&mut self, h: f64, f: f64, crossed: bool) -> f64 {
        self.tries = [self.tries[1], (h, f)];
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

    /// Returns the rate of the margin between the last try and a landing at `h` with margin `f`,
    /// m/s.
    pub fn slope(&self, h: f64, f: f64) -> f64 {
        let (h0, f0) = self.tries[1];
        (f - f0) / (h - h0)
    }
}
