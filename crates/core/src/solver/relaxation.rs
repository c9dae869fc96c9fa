//! Sweeps that get nowhere.
//!
//! With friction the problem is not convex, and exact solves of one contact after the other can go round through the same multipliers for ever. Going a
//! share `s < 1` of the way each time, `λ ← λ + s (λ* − λ)`, has the same fixed points and ends most such circles. So where the least change in a
//! window of sweeps is about that in the window before, the share changes.

/// Sweeps of a window.
const WINDOW: u32 = 50;
/// A window whose least change is more than this share of the one's before got nowhere.
const STAGNATION: f64 = 0.99;
/// Shares, one after the other.
const FACTORS: [f64; 3] = [1.0, 0.5, 0.7];

/// How far each block goes.
pub(super) struct Relaxation {
    /// Of the way to its own solution that each block goes.
    pub factor: f64,
    /// Sweeps that are not judged.
    first: u32,
    /// Least change of a row velocity in a sweep of this window and of the one before.
    least: f64,
    before: f64,
    /// Which share it is.
    turn: usize,
}

impl Relaxation {
    /// The first sweeps, so many, are not judged.
    pub fn new(first: u32) -> Relaxation {
        Relaxation { factor: FACTORS[0], first, least: f64::INFINITY, before: f64::INFINITY, turn: 0 }
    }

    /// Takes note of the change of a sweep.
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
