//! Ranges of numbers in scene files, with the text that error messages use for them.

/// Largest magnitude of any number of a scene. Squares and products of a few such numbers are
/// finite.
const MAX_MAGNITUDE: f64 = 1e12;
/// Smallest number that counts as greater than zero. Its inverse is usable.
const MIN_POSITIVE: f64 = 1e-9;

/// A closed range and its description in messages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bound {
    min: f64,
    max: f64,
    expected: &'static str,
}

impl Bound {
    /// Any finite number up to 1e12 in magnitude.
    pub(crate) const ANY: Bound =
        Bound { min: -MAX_MAGNITUDE, max: MAX_MAGNITUDE, expected: "a finite number from -1e12 to 1e12" };
    /// Lengths, masses, times: from 1e-9 to 1e12.
    pub(crate) const POSITIVE: Bound =
        Bound { min: MIN_POSITIVE, max: MAX_MAGNITUDE, expected: "a number greater than 0 (from 1e-9 to 1e12)" };
    /// From 0 to 1e12.
    pub(crate) const NOT_NEGATIVE: Bound = Bound { min: 0.0, max: MAX_MAGNITUDE, expected: "a number of at least 0" };
    /// A limit of a position, infinite for none on its side.
    pub(crate) const LIMIT: Bound = Bound {
        min: f64::NEG_INFINITY,
        max: f64::INFINITY,
        expected: "a number from -1e12 to 1e12, or inf or -inf for no limit on that side",
    };
    /// From 0 to 1.
    pub(crate) const UNIT: Bound = Bound { min: 0.0, max: 1.0, expected: "a number from 0 to 1" };

    /// Returns the range from `min` to `max`; `expected` describes it in messages.
    pub(crate) const fn new(min: f64, max: f64, expected: &'static str) -> Bound {
        Bound { min, max, expected }
    }

    /// Returns whether `x` lies in the range. False for numbers that are not finite.
    pub(crate) fn holds(&self, x: f64) -> bool {
        self.min <= x && x <= self.max
    }

    /// Returns the description for messages.
    pub(crate) fn expected(&self) -> &'static str {
        self.expected
    }
}
