//! Under-relaxation of sweeps that stagnate.
//!
//! With friction the problem is not convex: exact solves of one contact after the other can cycle
//! through the same multipliers. A step of a fraction `s < 1`, `λ ← λ + s (λ* − λ)`, has the same
//! fixed points and ends most such cycles. The fraction changes if the least change in a window of
//! sweeps is about that of the window before.

/// Number of sweeps in a window.
const WINDOW: u32 = 50;
/// A window stagnates if its least change exceeds this fraction of the previous window's.
const STAGNATION: f64 = 0.99;
/// Fractions in the order in which they are tried.
const FACTORS: [f64; 3] = [1.0, 0.5, 0.7];

/// The relaxation factor of the sweeps.
pub(super) struct Relaxation {
    /// Fraction of the step to its own solution that each block takes.
    pub factor: f64,
    /// Number of initial sweeps that are not judged.
    first: u32,
    /// Least change of a row velocity in a sweep of this window, and of the one before.
    least: f64,
    before: f64,
    /// Index of the present factor.
    turn: usize,
}

impl Relaxation {
    /// Starts with full steps; the `first` sweeps are not judged.
    pub fn new(first: u32) -> Relaxation {
        Relaxation { factor: FACTORS[0], first, least: f64::INFINITY, before: f64::INFINITY, turn: 0 }
    }

    /// Records the change of a sweep and adapts the factor at the end of a window.
    pub fn record(&mut self, sweep: u32, change: f64) {
        if change < self.least {
            self.least = change;
        }
        if sweep <= self.first || !sweep.is_multiple_of(WINDOW) {
            return;
        }
        if self.least > STAGNATION * self.before {
            self.turn = if self.turn + 1 < FACTORS.len() { self.turn + 1 } else { 1 };
            self.factor = FACTORS[self.turn];
        }
        (self.before, self.least) = (self.least, f64::INFINITY);
    }
}
