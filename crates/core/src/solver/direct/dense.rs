//! Dense linear equations, by elimination with row exchanges, in the widest registers of the processor and without
//! fused operations: the same bits on all.

/// Solves `A·x = b` for the row-major `a`, which it destroys; `b` becomes `x`. Returns whether `A` is regular.
pub(super) fn solve(a: &mut [f64], b: &mut [f64]) -> bool {
    pulp::Arch::new().dispatch(Elimination { a, b })
}

struct Elimination<'a> {
    a: &'a mut [f64],
    b: &'a mut [f64],
}

/// Number of columns that are eliminated before the others follow, which then are read and written once for all of them.
const PANEL: usize = 4;

impl pulp::NullaryFnOnce for Elimination<'_> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        let Elimination { a, b } = self;
        let n = b.len();
        match n {
            0..8 => return solve_small::<8>(a, b),
            8..16 => return solve_small::<16>(a, b),
            16..24 => return solve_small::<24>(a, b),
            _ => {}
        }
        for first in (0..n).step_by(PANEL) {
            let end = (first + PANEL).min(n);
            for j in first..end {
                if !eliminate(a, b, j, end) {
                    return false;
                }
            }
            // the rows of the panel by those above them, then all rows below, in the order of the columns
            let (panel, below) = a[first * n..].split_at_mut((end - first) * n);
            for j in 1..end - first {
                let (above, own) = panel.split_at_mut(j * n);
                for (k, from) in above.chunks_exact(n).enumerate() {
                    let factor = own[first + k];
                    subtract(&mut own[end..n], factor, &from[end..]);
                }
            }
            // a panel of fewer columns is the last: nothing is right of it
            if end - first == PANEL {
                let from: [&[f64]; PANEL] = std::array::from_fn(|k| &panel[k * n + end..(k + 1) * n]);
                for row in below.chunks_exact_mut(n) {
                    let (factors, row) = row.split_at_mut(end);
                    subtract_all(row, std::array::from_fn(|k| factors[first + k]), from);
                }
            }
        }
        for j in (0..n).rev() {
            let known: f64 = a[j * n + j + 1..][..n - j - 1].iter().zip(&b[j + 1..]).map(|(a, x)| a * x).sum();
            b[j] = (b[j] - known) / a[j * n + j];
        }
        true
    }
}

/// The same for fewer than `W` equations, with the right-hand side as one more column of a matrix whose rows fill whole
/// registers: the same operations on each number, in the same order.
#[inline(always)]
fn solve_small<const W: usize>(a: &[f64], b: &mut [f64]) -> bool {
    let n = b.len();
    let mut m = [[0.0; W]; W];
    for (i, row) in m[..n].iter_mut().enumerate() {
        row[..n].copy_from_slice(&a[i * n..(i + 1) * n]);
        row[n] = b[i];
    }
    for j in 0..n {
        let (mut pivot, mut size) = (j, m[j][j].abs());
        for (i, row) in m[..n].iter().enumerate().skip(j + 1) {
            if row[j].abs() > size {
                (pivot, size) = (i, row[j].abs());
            }
        }
        let largest = m[pivot][j];
        if !(largest.abs() > f64::MIN_POSITIVE && largest.is_finite()) {
            return false;
        }
        m.swap(pivot, j);
        let (own, inverse) = (m[j], 1.0 / largest);
        // numbers left of the column are no longer read
        let first = (j + 1) / 8 * 8;
        for row in &mut m[j + 1..n] {
            let factor = row[j] * inverse;
            for start in (first..W).step_by(8) {
                (start..start + 8).for_each(|k| row[k] -= factor * own[k]);
            }
        }
    }
    for j in (0..n).rev() {
        let known: f64 = m[j][j + 1..n].iter().zip(&b[j + 1..]).map(|(a, x)| a * x).sum();
        b[j] = (m[j][n] - known) / m[j][j];
    }
    true
}

/// Brings the largest number of column `j` to the diagonal, writes the factors of the rows below in its place, and
/// eliminates the column from the columns before `end` and from `b`. Returns `false` if there is no pivot.
#[inline(always)]
fn eliminate(a: &mut [f64], b: &mut [f64], j: usize, end: usize) -> bool {
    let n = b.len();
    let mut pivot = j;
    for i in j + 1..n {
        if a[i * n + j].abs() > a[pivot * n + j].abs() {
            pivot = i;
        }
    }
    let largest = a[pivot * n + j];
    if !(largest.abs() > f64::MIN_POSITIVE && largest.is_finite()) {
        return false;
    }
    let (above, below) = a.split_at_mut((j + 1) * n);
    let own = &mut above[j * n..];
    if pivot != j {
        own.swap_with_slice(&mut below[(pivot - j - 1) * n..][..n]);
        b.swap(j, pivot);
    }
    let inverse = 1.0 / own[j];
    for (i, row) in below.chunks_exact_mut(n).enumerate() {
        let factor = row[j] * inverse;
        row[j] = factor;
        (j + 1..end).for_each(|k| row[k] -= factor * own[k]);
        b[j + 1 + i] -= factor * b[j];
    }
    true
}

/// `to −= factor·from`, four numbers at a time.
#[inline(always)]
fn subtract(to: &mut [f64], factor: f64, from: &[f64]) {
    let ((to, to_rest), (from, from_rest)) = (to.as_chunks_mut::<4>(), from.as_chunks::<4>());
    for (to, from) in to.iter_mut().zip(from) {
        *to = [0, 1, 2, 3].map(|k| to[k] - factor * from[k]);
    }
    for (to, from) in to_rest.iter_mut().zip(from_rest) {
        *to -= factor * from;
    }
}

/// As [`subtract`], of one row after the other.
#[inline(always)]
fn subtract_all(to: &mut [f64], factors: [f64; PANEL], from: [&[f64]; PANEL]) {
    const WIDTH: usize = 8;
    let len = to.len();
    let from = from.map(|from| &from[..len]);
    let whole = len / WIDTH * WIDTH;
    for start in (0..whole).step_by(WIDTH) {
        let mut sum = [0.0; WIDTH];
        sum.copy_from_slice(&to[start..start + WIDTH]);
        for (factor, from) in factors.iter().zip(from) {
            let from = &from[start..start + WIDTH];
            (0..WIDTH).for_each(|k| sum[k] -= factor * from[k]);
        }
        to[start..start + WIDTH].copy_from_slice(&sum);
    }
    for k in whole..len {
        to[k] = factors.iter().zip(from).fold(to[k], |to, (factor, from)| to - factor * from[k]);
    }
}

#[cfg(test)]
mod tests {
    use super::solve;

    #[test]
    fn the_solution_solves() {
        let mut seed = 7u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for n in (1..20).chain([61, 128]) {
            let (a, x): (Vec<f64>, Vec<f64>) =
                ((0..n * n).map(|_| random()).collect(), (0..n).map(|_| random()).collect());
            let mut b: Vec<f64> = a.chunks_exact(n).map(|row| row.iter().zip(&x).map(|(a, x)| a * x).sum()).collect();
            assert!(solve(&mut a.clone(), &mut b));
            let error = b.iter().zip(&x).map(|(b, x)| (b - x).abs()).fold(0.0, f64::max);
            assert!(error < 1e-10, "{n}: {error}");
        }
    }

    #[test]
    fn a_singular_matrix_is_told() {
        assert!(!solve(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0]));
        assert!(!solve(&mut [f64::NAN], &mut [1.0]));
    }
}
