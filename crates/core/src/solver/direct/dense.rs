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
const PANEL: usize = 8;

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
        let mut panel = vec![0.0; PANEL * n];
        for first in (0..n).step_by(PANEL) {
            let end = (first + PANEL).min(n);
            let height = n - first;
            let columns = &mut panel[..(end - first) * height];
            for (row, a) in a[first * n..].chunks_exact(n).enumerate() {
                for (column, x) in a[first..end].iter().enumerate() {
                    columns[column * height + row] = *x;
                }
            }
            for j in 0..end - first {
                if !eliminate(columns, height, j, (&mut a[first * n..], end), &mut b[first..]) {
                    return false;
                }
            }
            // the rows of the panel by those above them, then all rows below, in the order of the columns
            let (above, below) = a[first * n..].split_at_mut((end - first) * n);
            for j in 0..end - first {
                let (done, own) = above.split_at_mut(j * n);
                for (k, from) in done.chunks_exact(n).enumerate() {
                    subtract(&mut own[end..n], columns[k * height + j], &from[end..]);
                }
                for k in j..end - first {
                    own[first + k] = columns[k * height + j];
                }
            }
            // a panel of fewer columns is the last: nothing is right of it
            if end - first == PANEL {
                let from: [&[f64]; PANEL] = std::array::from_fn(|k| &above[k * n + end..(k + 1) * n]);
                for (i, row) in below.chunks_exact_mut(n).enumerate() {
                    let mut factors = [0.0; PANEL];
                    for k in 0..PANEL {
                        factors[k] = columns[k * height + PANEL + i];
                    }
                    subtract_all(&mut row[end..], factors, from);
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
                for k in start..start + 8 {
                    row[k] -= factor * own[k];
                }
            }
        }
    }
    for j in (0..n).rev() {
        let known: f64 = m[j][j + 1..n].iter().zip(&b[j + 1..]).map(|(a, x)| a * x).sum();
        b[j] = (m[j][n] - known) / m[j][j];
    }
    true
}

/// Brings the largest number of column `j` of a panel, whose columns have `height` numbers each, to its diagonal,
/// divides the numbers below by it and eliminates the column from the later ones and from `b`. `rows` are the rows of the matrix, of
/// which the columns from `right` on follow the exchange. Returns `false` if there is no pivot.
#[inline(always)]
fn eliminate(columns: &mut [f64], height: usize, j: usize, (rows, right): (&mut [f64], usize), b: &mut [f64]) -> bool {
    let (mut pivot, mut size) = (j, columns[j * height + j].abs());
    for (i, x) in columns[j * height..(j + 1) * height].iter().enumerate().skip(j + 1) {
        if x.abs() > size {
            (pivot, size) = (i, x.abs());
        }
    }
    if !(size > f64::MIN_POSITIVE && size.is_finite()) {
        return false;
    }
    if pivot != j {
        columns.chunks_exact_mut(height).for_each(|column| column.swap(j, pivot));
        let n = rows.len() / height;
        let (above, below) = rows.split_at_mut(pivot * n);
        above[j * n + right..(j + 1) * n].swap_with_slice(&mut below[right..n]);
        b.swap(j, pivot);
    }
    let (own, later) = columns[j * height..].split_at_mut(height);
    let inverse = 1.0 / own[j];
    let factors = &mut own[j + 1..];
    for factor in &mut *factors {
        *factor *= inverse;
    }
    for column in later.chunks_exact_mut(height) {
        let from = column[j];
        subtract(&mut column[j + 1..], from, factors);
    }
    let from = b[j];
    subtract(&mut b[j + 1..], from, factors);
    true
}

/// `to −= factor·from`, eight numbers at a time. The loops are written out: a function that is passed to an iterator may be compiled
/// on its own, without the registers of its caller.
#[inline(always)]
fn subtract(to: &mut [f64], factor: f64, from: &[f64]) {
    let ((to, to_rest), (from, from_rest)) = (to.as_chunks_mut::<8>(), from.as_chunks::<8>());
    for (to, from) in to.iter_mut().zip(from) {
        for k in 0..8 {
            to[k] -= factor * from[k];
        }
    }
    for (to, from) in to_rest.iter_mut().zip(from_rest) {
        *to -= factor * from;
    }
}

/// As [`subtract`], of one row after the other.
#[inline(always)]
fn subtract_all(to: &mut [f64], factors: [f64; PANEL], from: [&[f64]; PANEL]) {
    let len = to.len();
    let from = from.map(|from| &from[..len]);
    let (to, rest) = to.as_chunks_mut::<8>();
    let whole = 8 * to.len();
    for (i, to) in to.iter_mut().enumerate() {
        let mut sum = *to;
        for (factor, from) in factors.iter().zip(from) {
            let from = &from[8 * i..8 * i + 8];
            for k in 0..8 {
                sum[k] -= factor * from[k];
            }
        }
        *to = sum;
    }
    for (k, to) in rest.iter_mut().enumerate() {
        for (factor, from) in factors.iter().zip(from) {
            *to -= factor * from[whole + k];
        }
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
        for n in (1..40).chain([61, 128, 291]) {
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
