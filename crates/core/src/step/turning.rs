//! How far the forces of joints turn bodies within a sub-step, and the division of a frame by it.
//!
//! Rows hold in the pose in which they were made. A pin that carries a force `F` at an arm `r` turns its
//! body back as a pendulum's weight does, and this geometric stiffness is explicit in both steppers, except
//! for rigid bodies that resist it (`step/resistance.rs`). Its
//! oscillation must be resolved: a chain of light links with a heavy end otherwise gains energy and comes
//! apart, though every solve is exact.
//!
//! ```text
//! τ(δθ) = (δθ × r) × F                K = Σ (r·F)·1 − r Fᵀ                        restoring torque −K·δθ
//! rigid body        ω² = √tr((I⁻¹K)²)     about the center of mass, F of loop joints
//! joint of a link   ω² = (4 + 2√3)·|sᵀK s|/D    about the joint's origin, F of the weight, the inertia and the links beyond it
//! turn = ω·h                              above `Settings::max_turn` the frame is taken again in more sub-steps
//! ```
//!
//! The factor of links: a long chain of equal rods of mass `m` and length `l` under a tension `T` has
//! `D = (1/3 + 1/√12)·ml²` with the links before the joint held, and `K = T·l`; neighbors that turn against
//! each other oscillate with `ω² = 12·T/(ml)`. Explicit motion is stable up to a turn of
//! 2. A body that a motor spins about its center carries no such force and is not divided, however fast it
//! is. A rigid body on an eccentric pin is: its centripetal force gives `ω` about the speed of its rotation.
//! The forces that a link's own rotation needs are left out of its `K`: they turn with it.
//!
//! `K` is not symmetric while the forces have a moment about the point. The symmetric part alone would give
//! an axis of little inertia, as the length of a bar, a stiffness that it does not have.
//!
//! | symbol | meaning |
//! |---|---|
//! | `I`, `D` | inertia of the body; inertia along the joint with all links beyond it (`abm.rs`) |
//! | `s` | axis of the joint; for spherical joints all three, with `√tr((D⁻¹K)²)` |
//! | `F` | a force of the last sub-step without impacts; N, world axes |

use super::Stepper;
use super::resistance::STEADY;
use crate::constraint::loop_joint::LoopJoint;
use crate::object::part_state::PointLoad;
use crate::world::{Core, StepError};
use serde::{Deserialize, Serialize};
use tumble_collide::{Mat3, Vec3};

/// Maximum number of parts that a sub-step of the settings is divided into.
const MAX_DIVISION: u32 = 128;
/// A division that is found again is exceeded by at most this factor: forces differ a little from those
/// of the coarser steps that it was computed from.
pub(super) const MARGIN: f64 = 1.5;
/// Time for which a division is held, s.
const HOLD: f64 = 1.0;
/// Forces are those of a jerk if a division raises the turn in the undivided sub-step by more than this.
const JERK: f64 = 2.0;

/// Number of parts that a sub-step is divided into at most for bodies that can resist turning: those that then still
/// turn too far do (`step/resistance.rs`).
const RESISTING_DIVISION: u32 = 4;

/// The largest turn of a frame that is not implicit, and that of bodies that can resist.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LargestTurn {
    /// rad.
    turn: f64,
    place: usize,
    part: usize,
    /// Turn of what cannot be implicit, rad.
    inherent: f64,
    /// Turn of bodies that can resist by all forces of joints, rad.
    resistible: f64,
    /// Turn of bodies that resisted by what their stiffness has grown, rad.
    missed: f64,
}

impl LargestTurn {
    fn raise(&mut self, turn: f64, place: usize, part: usize) {
        if turn > self.turn {
            (self.turn, self.place, self.part) = (turn, place, part);
        }
    }

    /// Returns the turn for which a frame of `division` parts is divided, rad, if bodies resist as they can.
    fn with_resistance(&self, division: u32, most: f64) -> f64 {
        self.inherent.max(self.resistible.min(most * f64::from(RESISTING_DIVISION) / f64::from(division)))
    }
}

/// How often a frame was taken, with the turn in an undivided sub-step before, rad.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) enum Attempt {
    /// Once.
    #[default]
    First,
    /// Again in shorter sub-steps.
    Finer(f64),
    /// Again without a division, after the finest one.
    Undivided(f64),
}

/// Adds the stiffness of a force `f` at an arm `r` to `k`.
pub(crate) fn add_stiffness(k: &mut Mat3, r: &Vec3, f: &Vec3) {
    *k += Mat3::from_diagonal_element(r.dot(f)) - r * f.transpose();
}

/// Returns `√tr(A²)` of `A = I⁻¹K`: the root of the sum of the squares of its eigenvalues.
pub(crate) fn rate_squared(a: &Mat3) -> f64 {
    (a * a).trace().abs().sqrt()
}

impl Core {
    /// Measures the turns in a sub-step of `h` seconds that is finished, or, `ahead`, in the first one of a frame.
    pub(crate) fn measure_turns(&mut self, h: f64, ahead: bool) {
        let loads = self.joint_loads();
        let (gravity, table, states) = (self.settings.gravity, &self.table, &self.state.objects);
        let (derived, largest) = (&mut self.derived, &mut self.largest_turn);
        let (resisting, division, most) = (&mut self.resisting, self.division, self.settings.max_turn);
        resisting.start_measuring();
        let mut rest = &loads[..];
        for entry in table.with(states).iter() {
            rest = &rest[rest.partition_point(|(place, _)| *place < entry.place)..];
            let count = rest.iter().take_while(|(place, _)| *place == entry.place).count();
            let (own, after) = rest.split_at(count);
            rest = after;
            let Some(body) = entry.object.integratable().filter(|_| entry.moves()) else { continue };
            let parts = &derived.part_states[entry.state_range.parts.clone()];
            let mut own = own.iter().map(|(_, load)| *load);
            let turns =
                parts.first().and_then(|state| resisting.measure(&entry, state, &mut own, (h, division, most, ahead)));
            if let Some(turns) = turns {
                largest.resistible = largest.resistible.max(turns.whole);
                largest.inherent = largest.inherent.max(turns.inherent);
                largest.missed = largest.missed.max(turns.missed);
                largest.raise(turns.explicit, entry.place, 0);
                continue;
            }
            let (part, rate) = body.turning_rate(&mut derived.caches[entry.place], parts, &gravity, &mut own);
            largest.inherent = largest.inherent.max(h * rate);
            largest.raise(h * rate, entry.place, part);
        }
        self.report.max_turn = largest.turn;
    }

    /// Returns the forces of all loop joints on the objects that they join, by the place of the object.
    fn joint_loads(&self) -> Vec<(usize, PointLoad)> {
        let (view, mut loads) = (self.view(self.state.time), Vec::new());
        for rows in self.state.warm.rows_by_owner() {
            let Some(entry) = self.by_serial(rows[0].owner).map(|place| self.objects().at(place)) else { continue };
            let any: &dyn std::any::Any = entry.object;
            let Some(joint) = any.downcast_ref::<LoopJoint>() else { continue };
            for (id, load) in joint.loads(&view, rows).into_iter().flatten() {
                loads.extend(self.table.place(id).map(|place| (place, load)));
            }
        }
        loads.sort_by_key(|(place, _)| *place);
        loads
    }

    /// Divides the sub-steps of a frame that begins, by the forces of the last sub-step and the division that
    /// is held.
    pub(crate) fn divide_ahead(&mut self, stepper: &dyn Stepper) {
        (self.division, self.attempt, self.largest_turn) = (1, Attempt::First, LargestTurn::default());
        self.resisting.start_frame(stepper.resists_turning());
        if let Some(h) = stepper.undivided_step(&self.settings) {
            self.measure_turns(h, true);
            self.resisting.keep_first();
            self.divide_to(self.largest_turn.with_resistance(1, self.settings.max_turn));
            self.division = self.division.max(self.state.held_division.at(self.state.time));
        }
    }

    /// Divides the sub-steps further if a part turned too far in the frame, which then has to be taken
    /// again from the time `time`, s. Returns whether it does. Forces that grow as steps get shorter are
    /// those of a jerk, as of a chain that gets taut: no division bounds their turn, and none is needed.
    ///
    /// # Errors
    /// [`StepError::Turn`] if no admissible division is fine enough, unless a joint is out of reach, which the
    /// report says.
    pub(crate) fn divide_again(&mut self, stepper: &dyn Stepper, time: f64) -> Result<bool, StepError> {
        let (largest, most) = (self.largest_turn, self.settings.max_turn);
        let LargestTurn { turn, place, part, .. } = largest;
        let resisted = largest.with_resistance(self.division, most);
        if largest.missed > STEADY || (turn > resisted.max(MARGIN * most) && self.resisting.could_help()) {
            let undivided = f64::from(self.division) * turn.max(largest.resistible);
            let resist = self.resisting.try_again();
            self.divide_to(if resist { f64::from(self.division) * resisted } else { undivided });
            self.attempt = Attempt::Finer(undivided);
            self.resisting.start_again();
            return Ok(true);
        }
        let undivided = f64::from(self.division) * turn.max(resisted);
        let admissible = most * f64::from(MAX_DIVISION);
        let jerk = match self.attempt {
            Attempt::First => false,
            Attempt::Finer(coarse) => coarse <= admissible && undivided > JERK * coarse,
            Attempt::Undivided(fine) => undivided <= admissible && fine > JERK * undivided,
        };
        if stepper.undivided_step(&self.settings).is_none() || jerk {
            return Ok(false);
        }
        if turn.max(resisted) <= if self.division > 1 { MARGIN * most } else { most } {
            let needed = if self.resisting.is_steady() { resisted } else { turn.max(resisted) };
            self.state.held_division.hold((f64::from(self.division) * needed / most).ceil() as u32, time);
            return Ok(false);
        }
        match self.attempt {
            Attempt::First if self.division == MAX_DIVISION => {
                (self.division, self.attempt) = (1, Attempt::Undivided(undivided));
            }
            Attempt::First | Attempt::Finer(_) if self.division < MAX_DIVISION => {
                self.divide_to(undivided);
                self.attempt = Attempt::Finer(undivided);
            }
            _ if self.report.unreachable_joint.is_some() => return Ok(false),
            _ => {
                let object = self.objects().at(place).name.to_string();
                return Err(StepError::Turn { object, part, turn, most, time });
            }
        }
        self.resisting.start_again();
        Ok(true)
    }

    /// Divides the sub-steps so that a turn in the undivided one, rad, is admissible in each part.
    fn divide_to(&mut self, undivided: f64) {
        let parts = (undivided / self.settings.max_turn).ceil();
        self.division = self.division.max(parts.clamp(1.0, f64::from(MAX_DIVISION)) as u32);
    }
}

/// A division that goes on for a time after it was needed. A mechanism that needs it in a part of its cycle thus
/// keeps the length of its steps: steps that change with the phase would pump energy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct HeldDivision {
    parts: u32,
    /// Time at which it ends, s.
    until: f64,
}

impl HeldDivision {
    /// Returns the division at a time, s.
    fn at(&self, time: f64) -> u32 {
        if time < self.until { self.parts } else { 1 }
    }

    /// Holds a division that was needed until a time, s; one that is more than twice as fine goes on as it is.
    fn hold(&mut self, needed: u32, time: f64) {
        if needed > 1 && 2 * needed > self.at(time) {
            *self = HeldDivision { parts: needed.max(self.at(time)).min(MAX_DIVISION), until: time + HOLD };
        }
    }

    pub(crate) fn is_sound(&self) -> bool {
        self.parts <= MAX_DIVISION && self.until.is_finite()
    }
}
