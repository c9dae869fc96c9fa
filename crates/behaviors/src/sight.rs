//! Sight of a boid: the weights of its neighbors, several at once.
//!
//! ```text
//! w = clamp((D − d)·p)·clamp((A − θ)·q)          p = 1/(D − D₀), q = 1/(A − A₀); clamp to 0 … 1
//! θ = acos c:   2·asin √(½·(1 − |c|)) if |c| > ½, else ½π − asin |c|;   π − θ if c < 0
//! asin s = s·P(s²), s ≤ ½
//! ```
//!
//! Symbols as in [`super::steering`]; `c` is the cosine of `θ`. `P` is the Chebyshev interpolation of `asin(√z)/√z` for
//! `0 ≤ z ≤ ¼` with 13 coefficients, of an error below 2e-17. All lanes do the same work without a branch, so the compiler
//! makes vector instructions of it; each lane has the bits that it would have alone.

use crate::registers::{LANES, Lanes};
use crate::steering::Steering;
use std::f64::consts::{FRAC_PI_2, PI};
use tumble_collide::Vec3;

/// Slope of an edge without width: 1 just before it.
const SHARP: f64 = 1e300;
/// Smallest distance in the avoidance, m.
pub(crate) const CLOSEST: f64 = 1e-6;
/// Share by which the square of the visibility distance is increased, so that rounding hides nobody.
const MARGIN: f64 = 1e-9;

/// The limits of what boids see.
pub(crate) struct Eye {
    /// Square of a distance from which nothing is seen, m².
    pub unseen: f64,
    /// Distance at which the weight is 0, m, and its slope, 1/m.
    distance: [f64; 2],
    /// Angle at which the weight is 0, rad, and its slope, 1/rad.
    angle: [f64; 2],
}

/// Neighbors as a boid sees them.
pub(crate) struct Sight {
    pub weight: Lanes,
    /// `1/d²`, 1/m²; 1/(1 µm·d) below 1 µm.
    pub nearness: Lanes,
    /// `d`, m.
    pub distance: Lanes,
}

impl Eye {
    pub fn new(steering: &Steering) -> Eye {
        let fade = |inner: f64, outer: f64| [outer, if inner < outer { 1.0 / (outer - inner) } else { SHARP }];
        Eye {
            unseen: steering.visibility_distance.powi(2) * (1.0 + MARGIN),
            distance: fade(steering.inner_visibility_distance, steering.visibility_distance),
            angle: fade(steering.inner_visibility_angle, steering.visibility_angle),
        }
    }

    /// Returns how a boid sees others, `arm` away, m. Those at its own place have no direction and the weight 0.
    #[inline(always)]
    pub fn sight(&self, arm: &[Lanes; 3], forward: &Vec3) -> Sight {
        let mut sight = Sight { weight: [0.0; LANES], nearness: [0.0; LANES], distance: [0.0; LANES] };
        for k in 0..LANES {
            let [x, y, z] = [arm[0][k], arm[1][k], arm[2][k]];
            let distance = (x * x + y * y + z * z).sqrt();
            let apart = distance > 0.0;
            let closeness = 1.0 / if apart { distance } else { 1.0 };
            let angle = acos(closeness * (x * forward.x + y * forward.y + z * forward.z));
            let weight = fade(self.distance, distance) * fade(self.angle, angle);
            sight.weight[k] = if apart { weight } else { 0.0 };
            sight.distance[k] = distance;
            sight.nearness[k] = closeness * least(closeness, 1.0 / CLOSEST);
        }
        sight
    }

    /// Returns the weight of a neighbor at the same place, which is seen fully by angle.
    pub fn at_the_same_place(&self) -> f64 {
        fade(self.distance, 0.0)
    }
}

/// Returns a line that falls to 0 at `end`, between 0 and 1.
#[inline(always)]
fn fade([end, slope]: [f64; 2], s: f64) -> f64 {
    let line = least((end - s) * slope, 1.0);
    if line > 0.0 { line } else { 0.0 }
}

/// Returns the smaller number.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Coefficients of `P`, from that of 1 on.
const ARC_SINE: [f64; 13] = [
    1.0,
    0.166_666_666_666_649_42,
    0.075_000_000_003_852_01,
    0.044_642_856_805_998_936,
    0.030_381_959_697_685_14,
    0.022_371_749_733_164_054,
    0.017_359_779_641_349_98,
    0.013_884_842_826_402_08,
    0.012_170_138_592_391_726,
    0.006_529_302_004_736_569_5,
    0.019_513_468_251_252_167,
    -0.016_187_392_271_599_134,
    0.031_879_621_400_812_84,
];

/// Returns the arc cosine to 1e-15, two units of its last place; that of ±1 beyond.
#[inline(always)]
fn acos(c: f64) -> f64 {
    let size = least(c.abs(), 1.0);
    let wide = size > 0.5;
    let z = if wide { 0.5 * (1.0 - size) } else { size * size };
    let s = if wide { z.sqrt() } else { size };
    // pairs of terms, pairs of those and so on, which do not wait for each other (Estrin)
    let p = {
        let (z2, pair) = (z * z, |k: usize| ARC_SINE[k] + z * ARC_SINE[k + 1]);
        let (z4, four) = (z2 * z2, |k: usize| pair(k) + z2 * pair(k + 2));
        four(0) + z4 * (four(4) + z4 * (four(8) + z4 * ARC_SINE[12]))
    };
    let asin = s * p;
    let angle = if wide { 2.0 * asin } else { FRAC_PI_2 - asin };
    if c < 0.0 { PI - angle } else { angle }
}

#[cfg(test)]
mod tests {
    use super::acos;

    #[test]
    fn the_arc_cosine_is_that_of_libm() {
        for k in -100_000..=100_000 {
            let c = f64::from(k) * 1e-5;
            let exact = nalgebra::ComplexField::acos(c);
            assert!((acos(c) - exact).abs() < 1e-15, "{c}: {} is not {exact}", acos(c));
        }
        for c in [0.5, 0.5f64.next_up(), -0.5f64.next_up(), 1.0f64.next_down(), 1e-300, -0.0] {
            assert!((acos(c) - nalgebra::ComplexField::acos(c)).abs() < 1e-15, "{c}");
        }
        assert_eq!((acos(1.0 + 1e-15), acos(-1.0 - 1e-15)), (0.0, std::f64::consts::PI));
    }
}
