//! Ranges that numbers of a scene must lie in, with the words for them.

/// The largest magnitude of any number of a scene: squares and products of a few stay finite.
const LARGEST: f64 = 1e12;
/// The smallest number that counts as greater than zero: its inverse stays usable.
const SMALLEST: f64 = 1e-9;

/// A closed range, and what a message says is right.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bound {
    min: f64,
    max: f64,
    wanted: &'static str,
}

impl Bound {
    /// Any finite number up to 1e12 in magnitude.
    pub(crate) const ANY: Bound = Bound { min: -LARGEST, max: LARGEST, wanted: "a finite number from -1e12 to 1e12" };
    /// Lengths, masses, times: from 1e-9 to 1e12.
    pub(crate) const POSITIVE: Bound =
        Bound { min: SMALLEST, max: LARGEST, wanted: "a number greater than 0 (from 1e-9 to 1e12)" };
    /// From 0 to 1e12.
    pub(crate) const NOT_NEGATIVE: Bound = Bound { min: 0.0, max: LARGEST, wanted: "a number of at least 0" };
    /// From 0 to 1.
    pub(crate) const UNIT: Bound = Bound { min: 0.0, max: 1.0, wanted: "a number from 0 to 1" };

    /// From `min` to `max`; `wanted` says so in words.
    pub(crate) const fn new(min: f64, max: f64, wanted: &'static str) -> Bound {
        Bound { min, max, wanted }
    }

    /// Whether `x` lies in the range; never for one that is not finite.
    pub(crate) fn holds(&self, x: f64) -> bool {
        self.min <= x && x <= self.max
    }

    /// The range in words.
    pub(crate) fn wanted(&self) -> &'static str {
        self.wanted
    }
}
