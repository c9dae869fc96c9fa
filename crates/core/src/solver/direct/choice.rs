//! The choices of a block, open or closed, sticking or sliding, and the function of Alart and Curnier, which is
//! smooth as long as they stay.
//!
//! ```text
//! x = λ − ρ·w,  ρ = 1/d
//! scalar      x ≤ lo: low      x ≥ hi: high      else free                 (half-line: lo = 0, hi = ∞)
//! contact     x_n ≤ 0: open    |x_t| ≤ μ·x_n: free, it sticks             else slide
//!
//! open        f = λ/ρ
//! low, high   f = (λ − lo)/ρ,  (λ − hi)/ρ
//! free        f = w
//! slide       f_n = w_n,   f_t = (λ_t − μ·x_n·x_t/|x_t|)/ρ
//! ```
//!
//! `λ` solves a block if `f = 0` with the choice that `λ` and `w` ask for. Source: Alart and Curnier, *A mixed formulation
//! for frictional contact problems prone to Newton like solution methods*, 1991.

use super::cone::{M3, V3, length};
use super::island::{Kind, LocalBlock};

/// State of a block: open or closed, at a bound, sticking or sliding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Choice {
    /// A contact without a force.
    Open,
    /// The multiplier of a scalar row is at its lower or its upper bound.
    Low,
    High,
    /// The row velocities are 0.
    Free,
    /// A contact without normal velocity, with all of its friction.
    Slide,
}

impl Choice {
    /// Returns whether the row velocities are in `f`.
    pub fn is_coupled(self) -> bool {
        matches!(self, Choice::Free | Choice::Slide)
    }
}

/// A block at an iterate: multipliers and row velocities.
#[derive(Clone, Copy, Default)]
pub(super) struct Point {
    pub lambda: V3,
    pub w: V3,
    /// Bound of a multiplier that follows normal forces.
    pub bound: f64,
}

impl Point {
    /// Returns the choice that the point asks for.
    #[inline(always)]
    pub fn choice(&self, block: &LocalBlock) -> Choice {
        let x = self.moved(block);
        let Some((lo, hi)) = self.bounds(block) else {
            return match block.kind {
                Kind::Cone { .. } if x[0] <= 0.0 => Choice::Open,
                Kind::Cone { mu } if length(x[1], x[2]) > mu * x[0] => Choice::Slide,
                Kind::Held => Choice::Low,
                _ => Choice::Free,
            };
        };
        match x[0] {
            x if x <= lo => Choice::Low,
            x if x >= hi => Choice::High,
            _ => Choice::Free,
        }
    }

    /// Appends the other choices of a block, each with its distance: the velocity by which the point would have to
    /// change to ask for it.
    pub fn others(&self, block: &LocalBlock, mut add: impl FnMut(f64, Choice)) {
        let (x, d) = (self.moved(block), block.diagonal);
        let now = self.choice(block);
        if let Kind::Cone { mu } = block.kind {
            let (opening, friction) = (d * x[0].abs(), d * (length(x[1], x[2]) - mu * x[0]).abs());
            for choice in [Choice::Open, Choice::Free, Choice::Slide].into_iter().filter(|c| *c != now) {
                let opens = choice == Choice::Open || now == Choice::Open;
                add(if opens { opening } else { friction }, choice);
            }
        }
        let Some((lo, hi)) = self.bounds(block) else { return };
        for (choice, bound) in [(Choice::Low, lo), (Choice::High, hi)].into_iter().filter(|(_, b)| b.is_finite()) {
            match now {
                Choice::Free => add(d * (x[0] - bound).abs(), choice),
                _ if now == choice => add(d * (x[0] - bound).abs(), Choice::Free),
                _ => {}
            }
        }
    }

    /// Returns the bounds of the multiplier of a scalar row that has any.
    #[inline(always)]
    fn bounds(&self, block: &LocalBlock) -> Option<(f64, f64)> {
        match block.bound {
            Some(_) => Some((-self.bound, self.bound)),
            None => block.kind.bounds(),
        }
    }

    /// Returns the multipliers that a choice asks for.
    #[inline(always)]
    pub fn target(&self, block: &LocalBlock, choice: Choice) -> V3 {
        let x = self.moved(block);
        match (choice, block.kind) {
            (_, Kind::Held | Kind::Equality) => self.lambda,
            (Choice::Open, _) => [0.0; 3],
            (Choice::Slide, Kind::Cone { mu }) => {
                let share = mu * x[0] / length(x[1], x[2]);
                [x[0], share * x[1], share * x[2]]
            }
            (Choice::Low, _) => [self.bounds(block).map_or(x[0], |(lo, _)| lo), 0.0, 0.0],
            (Choice::High, _) => [self.bounds(block).map_or(x[0], |(_, hi)| hi), 0.0, 0.0],
            (_, Kind::Cone { .. }) => x,
            _ => [x[0], 0.0, 0.0],
        }
    }

    /// Returns `f` for a choice.
    #[inline(always)]
    pub fn function(&self, block: &LocalBlock, choice: Choice) -> V3 {
        if choice == Choice::Free {
            return self.w;
        }
        let (d, onto) = (block.diagonal, self.target(block, choice));
        let mut f = [0, 1, 2].map(|k| d * (self.lambda[k] - onto[k]));
        if choice == Choice::Slide {
            f[0] = self.w[0];
        }
        f
    }

    /// Returns `λ − ρ·w`.
    #[inline(always)]
    pub fn moved(&self, block: &LocalBlock) -> V3 {
        [0, 1, 2].map(|k| self.lambda[k] - self.w[k] / block.diagonal)
    }
}

/// Derivatives of `f` of a coupled block, by its own `λ` and its own `w`.
pub(super) struct Derivative {
    pub by_lambda: M3,
    pub by_w: M3,
}

impl Derivative {
    #[inline(always)]
    pub fn new(block: &LocalBlock, point: &Point, choice: Choice) -> Derivative {
        let mut all = Derivative { by_lambda: [[0.0; 3]; 3], by_w: [[0.0; 3]; 3] };
        let (Choice::Slide, Kind::Cone { mu }) = (choice, block.kind) else {
            (0..3).for_each(|k| all.by_w[k][k] = 1.0);
            return all;
        };
        let (x, d) = (point.moved(block), block.diagonal);
        let size = length(x[1], x[2]);
        let (t, share) = ([x[1] / size, x[2] / size], mu * x[0] / size);
        all.by_w[0][0] = 1.0;
        for i in 0..2 {
            all.by_lambda[1 + i][0] = -d * mu * t[i];
            all.by_w[1 + i][0] = mu * t[i];
            for j in 0..2 {
                let same = f64::from(u8::from(i == j));
                let turn = share * (same - t[i] * t[j]);
                all.by_lambda[1 + i][1 + j] = d * (same - turn);
                all.by_w[1 + i][1 + j] = turn;
            }
        }
        all
    }
}
