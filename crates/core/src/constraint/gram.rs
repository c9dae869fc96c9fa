//! The matrix of rows that act on one object with many degrees of freedom, such as a cloth.
//!
//! ```text
//! K_ij += Σ_q y_iq·y_jq            by chunks of q: the rows of one chunk are columns, and rows i without numbers in it are left out
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `y_i` | response of row `i` to the whitened velocities `q` of the object |
//! | `K` | matrix of the rows, lower half |
//!
//! A contact of a soft body moves the nodes that are eliminated after its own: three of four numbers are 0.

/// Numbers of a response that are taken at once.
const CHUNK: usize = 8;

/// A row and its response.
pub(super) type Response<'a> = (usize, &'a [f64]);

/// Adds `y_i·y_j` for all pairs of `responses`, ascending by row, to the lower half of the row-major `k`, `n × n`: the
/// same bits in all registers.
pub(super) fn add_gram(k: &mut [f64], n: usize, responses: &[Response]) {
    pulp::Arch::new().dispatch(Gram { k, n, responses });
}

struct Gram<'a, 'r> {
    k: &'a mut [f64],
    n: usize,
    responses: &'a [Response<'r>],
}

impl pulp::NullaryFnOnce for Gram<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Gram { k, n, responses } = self;
        let (dof, count) = (responses.first().map_or(0, |(_, y)| y.len()), responses.len());
        let mut columns = vec![[0.0; CHUNK]; count];
        // by number of the chunk, then by row: long runs for the registers
        let mut by_number = vec![0.0; CHUNK * count];
        let mut sums = vec![0.0; count];
        for first in (0..dof).step_by(CHUNK) {
            let len = CHUNK.min(dof - first);
            for (i, (_, y)) in responses.iter().enumerate() {
                columns[i] = [0.0; CHUNK];
                columns[i][..len].copy_from_slice(&y[first..first + len]);
                (0..CHUNK).for_each(|q| by_number[q * count + i] = columns[i][q]);
            }
            for (i, own) in columns.iter().enumerate().filter(|(_, own)| **own != [0.0; CHUNK]) {
                add_products(&by_number, count, own, &mut sums[..=i]);
                let row = &mut k[responses[i].0 * n..][..n];
                sums[..=i].iter().zip(responses).for_each(|(sum, (j, _))| row[*j] += sum);
            }
        }
    }
}

/// Writes `Σ_q own_q·y_jq` for the first rows `j`.
#[inline(always)]
fn add_products(by_number: &[f64], count: usize, own: &[f64; CHUNK], sums: &mut [f64]) {
    let len = sums.len();
    let numbers: [&[f64]; CHUNK] = std::array::from_fn(|q| &by_number[q * count..][..len]);
    for j in 0..len {
        let pair = |q: usize| own[q] * numbers[q][j] + own[q + 1] * numbers[q + 1][j];
        sums[j] = (pair(0) + pair(2)) + (pair(4) + pair(6));
    }
}

#[cfg(test)]
mod tests {
    use super::add_gram;

    #[test]
    fn the_matrix_is_that_of_the_products() {
        for (count, dof) in [(1, 1), (3, 8), (5, 13), (40, 300)] {
            let y: Vec<Vec<f64>> = (0..count)
                .map(|i| {
                    (0..dof).map(|q| if (i + q / 16) % 3 == 0 { ((i * dof + q) as f64).sin() } else { 0.0 }).collect()
                })
                .collect();
            // every second row of the matrix is of another object
            let n = 2 * count;
            let mut k = vec![0.0; n * n];
            let responses: Vec<(usize, &[f64])> = y.iter().enumerate().map(|(i, y)| (2 * i, &y[..])).collect();
            add_gram(&mut k, n, &responses);
            for (i, a) in y.iter().enumerate() {
                for (j, b) in y.iter().enumerate() {
                    let exact = if j <= i { a.iter().zip(b).map(|(a, b)| a * b).sum() } else { 0.0 };
                    assert!((k[2 * i * n + 2 * j] - exact).abs() < 1e-12, "{count} {dof} {i} {j}");
                }
            }
        }
    }
}
