//! The branches that a step takes, recorded in one run and taken again in others.

use std::sync::{Mutex, PoisonError};

/// Gap within which a contact is at a kink when branches are recorded, m.
pub(crate) const ROUNDING: f64 = 1e-9;

/// A branch at which the map of a step has a kink.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Switch {
    /// The gap of a contact or a limit: closed or open at the start of the step.
    Gap,
    /// Overlap or a violated limit: corrected, or left because it is within the tolerance.
    Overlap,
    /// A contact or a limit presses or separates.
    Force,
    /// A contact sticks or slides; a motor or dry friction reaches its bound.
    Friction,
}

/// Records branches, or repeats recorded ones. Without either it returns each branch as it is.
#[derive(Debug, Default)]
pub(crate) struct Branches {
    active: bool,
    log: Mutex<Log>,
}

#[derive(Debug, Default)]
struct Log {
    repeats: bool,
    taken: Vec<bool>,
    next: usize,
    /// Branches of this run that differ from the recorded ones, with the contact or limit.
    differ: Vec<(Switch, Option<usize>)>,
}

impl Branches {
    /// Starts to record.
    pub fn record(&mut self) {
        (self.active, self.log) = (true, Mutex::default());
    }

    /// Whether branches are recorded or repeated: the step is that of a linearization.
    pub fn are_recorded(&self) -> bool {
        self.active
    }

    /// Starts to repeat what was recorded, from its begin.
    pub fn repeat(&mut self) {
        let log = self.log.get_mut().unwrap_or_else(PoisonError::into_inner);
        (log.repeats, log.next) = (true, 0);
        log.differ.clear();
    }

    /// Returns the branches of this run that differ from the recorded ones; `None` if their number does.
    pub fn differing(&mut self) -> Option<&[(Switch, Option<usize>)]> {
        let log = self.log.get_mut().unwrap_or_else(PoisonError::into_inner);
        (log.next == log.taken.len()).then_some(&log.differ[..])
    }

    /// Returns the branch to take where the sign of a number decides, above 0 or not. While branches are recorded, it counts as
    /// above 0 if it exceeds `rounding`: contacts that rest together are on one side then, whatever the last digits say.
    pub fn above(&self, switch: Switch, place: Option<usize>, value: f64, rounding: f64) -> bool {
        let records = self.active && !self.log.lock().unwrap_or_else(PoisonError::into_inner).repeats;
        self.take(switch, place, value > if records { rounding } else { 0.0 })
    }

    /// Returns the branch to take where the numbers say `branch`. `place`: index of the contact, if any.
    pub fn take(&self, switch: Switch, place: Option<usize>, branch: bool) -> bool {
        if !self.active {
            return branch;
        }
        let mut log = self.log.lock().unwrap_or_else(PoisonError::into_inner);
        log.next += 1;
        if !log.repeats {
            log.taken.push(branch);
            return branch;
        }
        let Some(&taken) = log.taken.get(log.next - 1) else { return branch };
        if taken != branch {
            log.differ.push((switch, place));
        }
        taken
    }
}
