//! Which objects a step walks: all but the settled ones.
//!
//! | state | meaning |
//! |---|---|
//! | [`Rest::Active`] | moves, may move, acts on others, or was changed |
//! | [`Rest::Resting`] | a rigid body that was static, disabled or asleep at the end of the last frame |
//! | [`Rest::Settled`] | rested through a whole frame: to walk it again would write the numbers that are there |
//!
//! A settled body keeps its numbers, part states, forces and bounds from frame to frame, so a step
//! costs what moves. Every change of an object makes it active ([`Walk::unsettle`]). This list is
//! derived data: a walk of all objects gives the same bits.
//!
//! During a frame the degrees of freedom are numbered among the walked objects alone
//! (`Table::number_walked`), so the arrays of a step have the length of what moves. Their order
//! stays, and results do not depend on the numbers.

use std::ops::Range;

/// State of rest of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Rest {
    #[default]
    Active,
    Resting,
    Settled {
        asleep: bool,
    },
}

/// Consecutive ranges of a table, merged.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spans(Vec<Range<usize>>);

impl Spans {
    /// Adds a range behind the others.
    fn push(&mut self, range: Range<usize>) {
        match self.0.last_mut() {
            _ if range.is_empty() => {}
            Some(last) if last.end == range.start => last.end = range.end,
            _ => self.0.push(range),
        }
    }

    /// Iterates over the ranges, ascending.
    pub fn iter(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.0.iter().cloned()
    }

    /// Copies these ranges of an array; the whole array if the lengths differ.
    pub fn copy<T: Clone>(&self, from: &[T], to: &mut Vec<T>) {
        if to.len() != from.len() {
            return from.clone_into(to);
        }
        self.iter().for_each(|range| to[range.clone()].clone_from_slice(&from[range]));
    }
}

/// The objects that a step walks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Walk {
    rest: Vec<Rest>,
    /// Places of all objects that are not settled, ascending, at the last [`gather`](Self::gather).
    pub places: Vec<u32>,
    /// Places that are not settled any more since then.
    fresh: Vec<u32>,
    /// Number of settled objects that sleep.
    pub asleep: usize,
    /// Changes with every change of this list.
    pub changes: u64,
    /// Changes when an object settles: copies of the state lack its last numbers.
    pub settlings: u64,
    /// Changes when an object is added or removed.
    pub layout: u64,
    /// Value of `changes` plus 1 at which the spans below were measured.
    spans_of: u64,
    /// Ranges of the walked objects in `X`, and in the part table.
    pub x: Spans,
    pub parts: Spans,
    /// Starts of the walked ranges of degrees of freedom outside a frame; empty there.
    pub(super) kept: Vec<usize>,
    /// Degrees of freedom of the walked objects, in a frame.
    pub(super) dof: Option<usize>,
}

impl Walk {
    /// Adds an object behind all others.
    pub fn push(&mut self) {
        self.places.push(self.rest.len() as u32);
        self.rest.push(Rest::Active);
        (self.changes, self.layout) = (self.changes + 1, self.layout + 1);
    }

    /// Removes an object; those behind it move up.
    pub fn remove(&mut self, place: usize) {
        self.unsettle(place);
        self.gather();
        self.rest.remove(place);
        self.places.retain(|walked| *walked as usize != place);
        self.places.iter_mut().for_each(|walked| *walked -= u32::from(*walked as usize > place));
        (self.changes, self.layout) = (self.changes + 1, self.layout + 1);
    }

    /// Notes that an object has more or fewer numbers than before, and makes all objects active.
    pub fn relayout(&mut self) {
        self.unsettle_all();
        self.layout += 1;
    }

    /// Returns the starts of the ranges of degrees of freedom of the walked objects outside a frame, if they
    /// are numbered otherwise now.
    pub fn kept(&self) -> Option<&[usize]> {
        self.dof.map(|_| &self.kept[..])
    }

    /// Returns whether a step leaves out the object at a place.
    pub fn is_settled(&self, place: usize) -> bool {
        matches!(self.rest[place], Rest::Settled { .. })
    }

    /// Returns whether a step walks every object.
    pub fn is_whole(&self) -> bool {
        self.places.len() == self.rest.len()
    }

    /// Makes the object at a place active: something of it changes.
    pub fn unsettle(&mut self, place: usize) {
        if let Rest::Settled { asleep } = std::mem::take(&mut self.rest[place]) {
            self.fresh.push(place as u32);
            self.asleep -= usize::from(asleep);
            self.changes += 1;
        }
    }

    /// Makes all objects active.
    pub fn unsettle_all(&mut self) {
        (0..self.rest.len()).for_each(|place| self.unsettle(place));
        self.changes += 1;
        self.gather();
    }

    /// Brings `places` up to date.
    pub fn gather(&mut self) {
        if !self.fresh.is_empty() {
            self.places.append(&mut self.fresh);
            self.places.sort_unstable();
        }
    }

    /// Brings the spans up to date, from the ranges of an object in `X` and in the part table.
    pub fn measure(&mut self, ranges: impl Fn(usize) -> [Range<usize>; 2]) {
        if self.spans_of == self.changes + 1 {
            return;
        }
        self.spans_of = self.changes + 1;
        self.x.0.clear();
        self.parts.0.clear();
        for &place in &self.places {
            let [x, parts] = ranges(place as usize);
            self.x.push(x);
            self.parts.push(parts);
        }
    }

    /// Ends a frame: walked objects for which `rests` returns whether they sleep are resting, and those that were
    /// resting before the frame are settled. Copies of the whole state follow, so few objects wait for more.
    pub fn settle(&mut self, rests: impl Fn(usize) -> Option<bool>) {
        let resting = |rest: &[Rest], place: u32| rest[place as usize] == Rest::Resting;
        let rested = self.places.iter().filter(|&&place| resting(&self.rest, place));
        let ready = rested.filter(|&&place| rests(place as usize).is_some()).count();
        let settles = ready > 0 && ready * SHARE >= self.rest.len();
        let (all, asleep) = (&mut self.rest, &mut self.asleep);
        self.places.retain(|&place| {
            let rest = &mut all[place as usize];
            let now = rests(place as usize);
            *rest = match (*rest, now) {
                (_, None) => Rest::Active,
                (Rest::Resting, Some(asleep)) if settles => Rest::Settled { asleep },
                (_, Some(_)) => Rest::Resting,
            };
            *asleep += usize::from(*rest == Rest::Settled { asleep: true });
            !matches!(rest, Rest::Settled { .. })
        });
        if !settles {
            return;
        }
        (self.changes, self.settlings) = (self.changes + 1, self.settlings + 1);
    }
}

/// Objects settle when they are at least one in this number: copies of the whole state then cost less
/// than the walks that they save.
const SHARE: usize = 256;

#[cfg(test)]
mod tests;
