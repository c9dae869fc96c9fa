//! Sine and cosine without a branch, so that SIMD lanes take the same steps as one `f64`, with the
//! same bits.
//!
//! ```text
//! k = round(2x/π)     y + z = x − k·π/2 in double length      |y| ≤ π/4
//! sin(y + z) = y + (y³·P(y²) + z·(1 − y²/2))                 |error of P| < 2⁻⁵⁸ of sin y
//! cos(y + z) = 1 − y²/2 + (y⁴·Q(y²) − y·z)                   |error of Q| < 2⁻⁶⁴
//! k mod 4:  (s, c), (c, −s), (−s, −c), (−c, s)
//! ```
//!
//! π/2 is three numbers, the first two of 33 bits, so that `k` times them is exact while `|k| <
//! 2²⁰`. `P` and `Q` are minimax (Remez) on `[0, (π/4)²]`. Beyond [`FAR`], and for what is not
//! finite, a lane takes `libm`'s. Within it the error is below one unit in the last place.

use super::scalar::Scalar;

/// Largest angle for the steps above, rad; `libm` computes larger ones.
pub(super) const FAR: f64 = 1e6;

const TWO_OVER_PI: f64 = std::f64::consts::FRAC_2_PI;
/// Bits 1 to 33 of π/2, bits 34 to 66 of it, and the rest.
const HALF_PI: [f64; 3] = [1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21];
/// Adding and subtracting this rounds to a whole number, ties to even, while `|x| < 2⁵¹`.
const ROUND: f64 = 6755399441055744.0;
/// Coefficients of `P`, constant first.
const P: [f64; 6] = [
    -0.16666666666666632,
    0.00833333333332237,
    -0.00019841269829771175,
    2.7557313678668697e-06,
    -2.5050755961839547e-08,
    1.5896666530780505e-10,
];
/// Coefficients of `Q`, constant first.
const Q: [f64; 6] = [
    0.0416666666666666,
    -0.0013888888888874064,
    2.480158728944347e-05,
    -2.7557314340656887e-07,
    2.087572162339473e-09,
    -1.135955931495797e-11,
];

/// Returns `(sin x, cos x)` for `|x| ≤` [`FAR`].
#[inline(always)]
pub(super) fn sin_cos<T: Scalar>(x: T) -> (T, T) {
    let one = x.constant(1.0);
    let k = round(x * TWO_OVER_PI);
    let first = x - k * HALF_PI[0];
    let second = k * HALF_PI[1];
    let near = first - second;
    let third = k * HALF_PI[2] - ((first - near) - second);
    let y = near - third;
    let z = (near - y) - third;

    let t = y * y;
    let half = t * 0.5;
    let sine = y + (y * t * polynomial(t, &P) + z * (one - half));
    let top = one - half;
    let cosine = top + (((one - top) - half) + (t * t * polynomial(t, &Q) - y * z));

    // k = p + 2m; the quarter turns p and the sign of m choose among the four rows by products with
    // 0, 1 and −1, which are exact.
    let p = k - twice(round(k * 0.5 - x.constant(0.25)));
    let m = (k - p) * 0.5;
    let sign = one - twice(m - twice(round(m * 0.5 - x.constant(0.25))));
    let swapped = sign * p;
    let straight = sign - swapped;
    (sine * straight + cosine * swapped, cosine * straight - sine * swapped)
}

#[inline(always)]
fn round<T: Scalar>(x: T) -> T {
    let big = x.constant(ROUND);
    (x + big) - big
}

#[inline(always)]
fn twice<T: Scalar>(x: T) -> T {
    x + x
}

/// Evaluates in pairs, which shortens the chain of dependent operations.
#[inline(always)]
fn polynomial<T: Scalar>(t: T, c: &[f64; 6]) -> T {
    let t2 = t * t;
    (t.constant(c[0]) + t * c[1]) + t2 * ((t.constant(c[2]) + t * c[3]) + t2 * (t.constant(c[4]) + t * c[5]))
}
