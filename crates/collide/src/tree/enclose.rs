//! The smallest ball around balls, exactly.
//!
//! The smallest ball is that of at most four of the balls, its basis, which touch it from within: `|c − cᵢ| = R − rᵢ`.
//! With `x = c − c₁` and `dᵢ = cᵢ − c₁`, taking the first equation from the others leaves
//!
//! ```text
//! dᵢ · x = (|dᵢ|² + r₁² − rᵢ²)/2 + R (rᵢ − r₁)      x = u + R v in the span of the dᵢ
//! (v·v − 1) R² + 2 (u·v + r₁) R + u·u − r₁² = 0
//! ```
//!
//! The basis is found as in a simplex method: while a ball sticks out, the farthest joins the basis, and of the subsets of
//! those five the smallest ball that holds all five is the next. Its radius grows each time, so that no basis comes
//! back. Source for balls in place of points: Fischer and Gärtner, *The smallest enclosing ball of balls:
//! combinatorial structure and algorithms* (2003).

use super::ball::Ball;
use crate::Vec3;

/// Bounds the changes of basis; a dozen are usual.
const CHANGES: usize = 200;
/// A ball sticks out if by more than this part of the radius.
const OUT: f64 = 1e-12;

/// The smallest ball around the balls; of radius zero for none.
pub(super) fn smallest_around(balls: &[Ball]) -> Ball {
    let Some(&first) = balls.iter().max_by(|a, b| a.radius.total_cmp(&b.radius)) else {
        return Ball { center: Vec3::zeros(), radius: 0.0 };
    };
    let (mut ball, mut basis) = (first, vec![first]);
    for _ in 0..CHANGES {
        let farthest = balls.iter().max_by(|a, b| reach(&ball.center, a).total_cmp(&reach(&ball.center, b)));
        let Some(far) = farthest.filter(|far| reach(&ball.center, far) > ball.radius * (1.0 + OUT)) else { break };
        basis.push(*far);
        let Some((next, its_basis)) = of_few(&basis).filter(|(next, _)| next.radius > ball.radius) else { break };
        (ball, basis) = (next, its_basis);
    }
    // what rounding left, and a rounding's worth more
    let radius = balls.iter().map(|b| reach(&ball.center, b)).fold(0.0, f64::max) * (1.0 + 1e-12);
    Ball { radius, ..ball }
}

/// How far a ball reaches from a point.
fn reach(c: &Vec3, ball: &Ball) -> f64 {
    (ball.center - c).norm() + ball.radius
}

/// The smallest ball around at most five balls, and those that it touches.
fn of_few(balls: &[Ball]) -> Option<(Ball, Vec<Ball>)> {
    let mut best: Option<(Ball, Vec<Ball>)> = None;
    for set in 1..1_u32 << balls.len() {
        if set.count_ones() > 4 {
            continue;
        }
        let touched: Vec<Ball> = (0..balls.len()).filter(|n| set >> n & 1 == 1).map(|n| balls[n]).collect();
        let Some(ball) = touching(&touched) else { continue };
        let holds = balls.iter().all(|b| reach(&ball.center, b) <= ball.radius * (1.0 + 1e-9));
        if holds && best.as_ref().is_none_or(|b| ball.radius < b.0.radius) {
            best = Some((ball, touched));
        }
    }
    best
}

/// The smallest ball that all of one to four balls touch from within, its centre in the span of theirs.
fn touching(balls: &[Ball]) -> Option<Ball> {
    let first = balls[0];
    // orthonormal axes of the span, and along them u and v
    let mut axes: Vec<Vec3> = Vec::new();
    let (mut u, mut v) = (Vec3::zeros(), Vec3::zeros());
    for b in &balls[1..] {
        let d = b.center - first.center;
        let across = axes.iter().fold(d, |d, e| d - e * e.dot(&d));
        let length = across.norm();
        if length <= 1e-10 * d.norm() {
            return None;
        }
        let e = across / length;
        let fixed = 0.5 * (d.norm_squared() + first.radius * first.radius - b.radius * b.radius);
        u += e * ((fixed - d.dot(&u)) / length);
        v += e * ((b.radius - first.radius - d.dot(&v)) / length);
        axes.push(e);
    }
    let least = balls.iter().map(|b| b.radius).fold(0.0, f64::max);
    let (a, half_b, c) = (v.dot(&v) - 1.0, u.dot(&v) + first.radius, u.dot(&u) - first.radius * first.radius);
    let radius = roots(a, half_b, c).into_iter().filter(|r| *r >= least * (1.0 - 1e-9)).fold(f64::INFINITY, f64::min);
    radius.is_finite().then(|| Ball { center: first.center + u + v * radius, radius })
}

/// Of `a x² + 2 h x + c = 0`; not numbers where there are none.
fn roots(a: f64, h: f64, c: f64) -> [f64; 2] {
    let root = (h * h - a * c).max(0.0).sqrt();
    // the sum that does not cancel
    let q = -(h + if h < 0.0 { -root } else { root });
    [q / a, c / q]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [0, 1), the same each time.
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    /// The radius is a convex function of the centre, so that it is least where no direction lowers it: on any way,
    /// some ball that is touched gets farther (or, to a rounding, no nearer).
    fn no_way_out(ball: &Ball, balls: &[Ball], next: &mut impl FnMut() -> f64) -> bool {
        let touched: Vec<Vec3> = balls
            .iter()
            .filter(|b| reach(&ball.center, b) > ball.radius * (1.0 - 1e-9))
            .map(|b| (b.center - ball.center).try_normalize(1e-9).unwrap_or_default())
            .collect();
        (0..500).all(|_| {
            let way = Vec3::from_fn(|_, _| 2.0 * next() - 1.0).normalize();
            touched.iter().any(|to| to.dot(&way) <= 1e-6)
        })
    }

    #[test]
    fn no_smaller_ball_holds_the_balls() {
        for seed in 1..60 {
            let mut next = numbers(seed);
            let count = 1 + (seed as usize % 12);
            let flat = seed % 5 == 0;
            let balls: Vec<Ball> = (0..count)
                .map(|_| {
                    let center = Vec3::new(next(), next(), if flat { 0.5 } else { next() });
                    Ball { center, radius: 0.5 * next() * next() }
                })
                .collect();
            let ball = smallest_around(&balls);
            assert!(balls.iter().all(|b| reach(&ball.center, b) <= ball.radius), "{seed}");
            assert!(no_way_out(&ball, &balls, &mut next), "{seed}");
            // nor do a thousand centres tried anywhere
            let any = (0..1000).map(|_| {
                let c = Vec3::from_fn(|_, _| next());
                balls.iter().map(|b| reach(&c, b)).fold(0.0, f64::max)
            });
            assert!(any.fold(f64::INFINITY, f64::min) >= ball.radius * (1.0 - 1e-9), "{seed}");
        }
    }

    #[test]
    fn equal_balls_and_balls_within_balls_are_one() {
        let ball = |x: f64, radius: f64| Ball { center: Vec3::new(x, 0.0, 0.0), radius };
        let within = smallest_around(&[ball(0.0, 2.0), ball(0.5, 1.0), ball(0.0, 2.0), ball(-1.0, 1.0)]);
        assert!(within.center.norm() < 1e-12 && (within.radius - 2.0).abs() < 1e-9, "{within:?}");
        // two of radius 1, three apart: from -1 to 4
        let two = smallest_around(&[ball(0.0, 1.0), ball(3.0, 1.0), ball(0.0, 1.0), ball(1.5, 0.5)]);
        assert!((two.center.x - 1.5).abs() < 1e-9 && (two.radius - 2.5).abs() < 1e-9, "{two:?}");
    }
}
