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
const CHUNK: usize = 16;

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
        let dof = responses.first().map_or(0, |(_, y)| y.len());
        let (mut places, mut columns) = (Vec::with_capacity(responses.len()), Vec::with_capacity(responses.len()));
        // by number of the chunk, then by row: long runs for the registers
        let mut by_number = Vec::with_capacity(CHUNK * responses.len());
        let mut sums = vec![0.0; 2 * responses.len()];
        for first in (0..dof).step_by(CHUNK) {
            let len = CHUNK.min(dof - first);
            places.clear();
            columns.clear();
            for (row, y) in responses {
                let mut own = [0.0; CHUNK];
                own[..len].copy_from_slice(&y[first..first + len]);
                if own != [0.0; CHUNK] {
                    places.push(*row);
                    columns.push(own);
                }
            }
            let count = columns.len();
            by_number.clear();
            for q in 0..CHUNK {
                for own in &columns {
                    by_number.push(own[q]);
                }
            }
            for (pair, own) in columns.chunks(2).enumerate() {
                let first = 2 * pair;
                let last = own.len() - 1;
                let (a, b) = sums.split_at_mut(responses.len());
                // of a pair of rows both get the products of the second one
                add_products(
                    &by_number,
                    count,
                    [&own[0], &own[last]],
                    [&mut a[..=first + last], &mut b[..=first + last]],
                );
                for (i, sums) in (first..).zip([a, b]).take(own.len()) {
                    let row = &mut k[places[i] * n..][..n];
                    for (sum, place) in sums[..=i].iter().zip(&places) {
                        row[*place] += sum;
                    }
                }
            }
        }
    }
}

/// Writes `Σ_q own_q·y_jq` of two rows for the first rows `j`. Numbers of `j` that are read are read once for both.
#[inline(always)]
fn add_products(by_number: &[f64], count: usize, own: [&[f64; CHUNK]; 2], sums: [&mut [f64]; 2]) {
    let len = sums[0].len();
    let numbers: [&[f64]; CHUNK] = std::array::from_fn(|q| &by_number[q * count..][..len]);
    let [first, second] = sums;
    for j in 0..len {
        let (mut even, mut odd) = ([0.0; 2], [0.0; 2]);
        for q in 0..CHUNK / 2 {
            let (a, b) = (numbers[2 * q][j], numbers[2 * q + 1][j]);
            for row in 0..2 {
                even[row] += own[row][2 * q] * a;
                odd[row] += own[row][2 * q + 1] * b;
            }
        }
        first[j] = even[0] + odd[0];
        second[j] = even[1] + odd[1];
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
