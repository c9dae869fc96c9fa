//! Rigid bodies that resist turning: the stiffness of joint forces that is implicit in a step.
//!
//! The forces of joints that turn a light body back and forth (`step/turning.rs`) act, in `time_stepping`, with
//! the arms of the pose after half a step of the old velocity. With the arms of the middle of the step,
//! which needs the new velocity, the motion is that of the implicit midpoint rule:
//!
//! ```text
//! x_m = x₀ + ¼h·(ω₀ + ω₁) = x₀ + ½h·ω₀ + ¼h·(ω₁ − ω₀)
//! I·(ω₁ − ω₀) = h·τ(x_m) = h·τ(x₀ + ½h·ω₀) − ¼h²·K·(ω₁ − ω₀)          so    (I + ¼h²·K⁺)·(ω₁ − ω₀) = h·τ(x₀ + ½h·ω₀)
//! ```
//!
//! So bodies respond to the impulses of the step with the inertia `I + ¼h²·K⁺`, and joints are closed as always. The rule is stable for
//! any constant `K⁺ ≥ 0`, keeps the energy of an oscillation, and is of second order with any `K⁺`, as `ω₁ − ω₀` is of the order `h`. Bodies
//! that turn no further than `Settings::max_turn` respond with `I` alone. `K` is that of the last sub-step. If it changes by more than
//! [`STEADY`] allows, the frame is taken again, at last without resistance and in more sub-steps.
//!
//! | symbol | meaning |
//! |---|---|
//! | `K` | stiffness by the joint forces, N·m/rad |
//! | `K⁺` | its symmetric part without negative eigenvalues |
//! | `ω₀`, `ω₁` | angular velocity at the ends of the step |

use super::Moment;
use super::turning::MARGIN;
use crate::object::part_state::{PartState, PointLoad};
use crate::rigid::{RigidBody, resisting};
use crate::world::Core;
use crate::world::view::Entry;
use tumble_collide::Mat3;

/// Maximum number of attempts at a frame with other resistances alone.
const MAX_ATTEMPTS: u32 = 3;
/// Turn by a change of stiffness above which bodies do not resist, rad: an oscillation that changes the forces of its joints so much is
/// resolved instead, as it would gain energy from stiffnesses that come late.
pub(super) const STEADY: f64 = 0.8;
/// Share of `h²·K⁺` that is added to the inertia.
const SHARE: f64 = 0.25;

/// A body that can resist.
#[derive(Clone, Copy)]
struct Resisting {
    place: usize,
    /// `K⁺`, body axes, N·m/rad.
    stiffness: Mat3,
    /// Angular frequency by all forces of joints, rad/s.
    rate: f64,
}

/// The bodies that resist turning, by place.
#[derive(Default)]
pub(crate) struct ResistingBodies {
    /// Whether the stepper of the frame lets them resist.
    allowed: bool,
    /// By the forces of the last sub-step.
    now: Vec<Resisting>,
    /// By those of the last frame.
    first: Vec<Resisting>,
    /// By the largest forces of this attempt at the frame, and of the one before.
    largest: Vec<Resisting>,
    carried: Vec<Resisting>,
    /// Number of attempts at the frame with other resistances alone.
    attempts: u32,
    /// Turn in an undivided sub-step by the change of stiffness since the frame began, rad.
    change: f64,
    /// The part of the inertia that was added in the last sub-step, kg·m², body axes, and its length, s.
    added: Vec<(usize, Mat3)>,
    length: f64,
}

/// The turns of a body in a sub-step, rad.
#[derive(Clone, Copy, Default)]
pub(super) struct BodyTurn {
    /// By all forces of joints.
    pub whole: f64,
    /// By those that were not implicit.
    pub explicit: f64,
    /// By those that cannot be implicit.
    pub inherent: f64,
    /// By what the forces have grown since the stiffness was found, of a body that resisted.
    pub missed: f64,
}

impl ResistingBodies {
    /// Forgets all bodies, at the start of a frame.
    pub(super) fn start_frame(&mut self, allowed: bool) {
        (self.allowed, self.attempts) = (allowed, 0);
        [&mut self.now, &mut self.first, &mut self.largest, &mut self.carried].into_iter().for_each(Vec::clear);
        self.added.clear();
    }

    /// Begins another attempt at the frame: bodies resist the largest forces of the last one.
    pub(super) fn start_again(&mut self) {
        std::mem::swap(&mut self.carried, &mut self.largest);
        self.largest.clear();
        self.now.clear();
        self.added.clear();
    }

    /// Counts an attempt with other resistances alone. Bodies resist no more in the frame after the last of them; returns
    /// whether they still do.
    pub(super) fn try_again(&mut self) -> bool {
        self.attempts += 1;
        self.allowed &= self.attempts <= MAX_ATTEMPTS;
        self.allowed
    }

    /// Returns whether bodies that turned too far may resist in another attempt.
    pub(super) fn could_help(&self) -> bool {
        self.allowed && !self.largest.is_empty()
    }

    /// Returns whether stiffnesses are nearly those at the start of the frame.
    pub(super) fn is_steady(&self) -> bool {
        self.allowed && self.change <= STEADY
    }

    /// Keeps what was measured ahead as the start of the frame.
    pub(super) fn keep_first(&mut self) {
        self.first.clone_from(&self.now);
    }

    pub(super) fn start_measuring(&mut self) {
        self.now.clear();
        self.change = 0.0;
    }

    /// Measures the turns of a body in a sub-step of `h` seconds that is finished, or, `ahead`, in one that will be.
    /// Bodies are measured by ascending place. Returns `None` for what cannot resist.
    pub(super) fn measure(
        &mut self,
        entry: &Entry,
        state: &PartState,
        loads: &mut dyn Iterator<Item = PointLoad>,
        (h, division, most, ahead): (f64, u32, f64, bool),
    ) -> Option<BodyTurn> {
        let any: &dyn std::any::Any = entry.object;
        let body = any.downcast_ref::<RigidBody>().filter(|body| self.allowed && body.can_resist())?;
        let Some(stiffness) = body.stiffness(&state.pose, loads) else { return Some(BodyTurn::default()) };
        let axes = state.pose.rotation.to_rotation_matrix();
        let stiffness = axes.matrix().tr_mul(&(stiffness * axes.matrix()));
        let turn = |stiffness: &Mat3, added: &Mat3| h * body.turning_rate_of(stiffness, added);
        let whole = turn(&stiffness, &Mat3::zeros());
        if whole * f64::from(division) <= most {
            return Some(BodyTurn { whole, explicit: whole, ..BodyTurn::default() });
        }
        let own = Resisting { place: entry.place, stiffness: resisting(&stiffness), rate: whole / h };
        self.now.push(own);
        insert(&mut self.largest, own);
        if !ahead {
            let undivided = h * f64::from(division);
            let first = self.first.binary_search_by_key(&own.place, |first| first.place).ok();
            let first = first.map_or(Mat3::zeros(), |k| self.first[k].stiffness);
            let change =
                body.turning_rate_of(&resisting(&(own.stiffness - first)), &(first * (SHARE * undivided * undivided)));
            self.change = self.change.max(undivided * change);
        }
        if whole <= most {
            return Some(BodyTurn { whole, explicit: whole, ..BodyTurn::default() });
        }
        let inherent = turn(&(stiffness - own.stiffness), &(own.stiffness * (SHARE * h * h)));
        let (explicit, missed) = match self.added(entry.place) {
            _ if ahead => (inherent, 0.0),
            Some(added) => {
                let missed = resisting(&(own.stiffness - added / (SHARE * self.length * self.length)));
                (turn(&(stiffness - own.stiffness), added), turn(&missed, added))
            }
            None => (whole, 0.0),
        };
        Some(BodyTurn { whole, explicit, inherent, missed })
    }

    /// Returns what was added to the inertia of a body in the last sub-step, kg·m², body axes.
    pub(crate) fn added(&self, place: usize) -> Option<&Mat3> {
        self.added.binary_search_by_key(&place, |(place, _)| *place).ok().map(|k| &self.added[k].1)
    }

    /// Returns the bodies that resist in a sub-step of `h` seconds, with what is added to their inertia, kg·m².
    fn next(&self, h: f64, most: f64) -> Vec<(usize, Mat3)> {
        let mut all = self.carried.clone();
        self.now.iter().for_each(|own| insert(&mut all, *own));
        let far = all.iter().filter(|own| h * own.rate > MARGIN * most);
        far.map(|own| (own.place, own.stiffness * (SHARE * h * h))).collect()
    }
}

/// Inserts a body by its place; of two with the same place the faster one stays.
fn insert(all: &mut Vec<Resisting>, own: Resisting) {
    match all.binary_search_by_key(&own.place, |other| other.place) {
        Ok(k) if all[k].rate < own.rate => all[k] = own,
        Ok(_) => {}
        Err(k) => all.insert(k, own),
    }
}

impl Core {
    /// Lets bodies resist in a sub-step of `h` seconds, at the moment at which its impulses act, before its refresh.
    pub(super) fn resist_turning(&mut self, middle: &mut Moment, h: f64) {
        self.resisting.added = self.resisting.next(h, self.settings.max_turn);
        self.resisting.length = h;
        self.set_resistance(middle, |added| Some(*added));
    }

    /// Ends the resistance, before the moment is used for another purpose.
    pub(super) fn stop_resisting(&self, middle: &mut Moment) {
        self.set_resistance(middle, |_| None);
    }

    fn set_resistance(&self, middle: &mut Moment, of: impl Fn(&Mat3) -> Option<Mat3>) {
        for (place, added) in &self.resisting.added {
            let any: &dyn std::any::Any = self.objects().at(*place).object;
            if let Some(body) = any.downcast_ref::<RigidBody>() {
                body.resist(&mut middle.derived.caches[*place], of(added));
            }
        }
    }
}
