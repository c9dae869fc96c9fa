//! Blocks of the factor of a spring mesh, 3 × 3, and three right-hand sides at one node, in whole registers.
//!
//! ```text
//! (A·B)_ij = (A_i1·B_1j + A_i2·B_2j) + A_i3·B_3j          x = G⁻¹·b:   x_i = (b_i − Σ_{j<i} G_ij·x_j)/G_ii
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `A`, `B` | blocks, by columns |
//! | `G` | lower triangular block |
//! | `b`, `x` | a vector, or three of them |

use nalgebra::Cholesky;
use tumble_collide::{Mat3, Vec3};

/// Numbers of a register; the fourth is 0.
type Lanes = [f64; 4];

/// A 3 × 3 matrix by columns.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Block([Lanes; 3]);

/// Up to three vectors at one node: the numbers of all vectors along `x`, then `y` and `z`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Columns(pub [Lanes; 3]);

/// Returns `to − a·x`, of each number on its own.
#[inline(always)]
fn minus(mut to: Lanes, a: &Lanes, x: f64) -> Lanes {
    for k in 0..4 {
        to[k] -= a[k] * x;
    }
    to
}

/// Returns `(a₀·x₀ + a₁·x₁) + a₂·x₂`.
#[inline(always)]
fn combined(a: &[Lanes; 3], x: [f64; 3]) -> Lanes {
    let mut sum = [0.0; 4];
    for k in 0..4 {
        sum[k] = a[0][k] * x[0] + a[1][k] * x[1] + a[2][k] * x[2];
    }
    sum
}

impl Block {
    /// Adds a matrix.
    #[inline(always)]
    pub fn add(&mut self, matrix: &Mat3) {
        for (column, from) in self.0.iter_mut().zip(matrix.column_iter()) {
            for k in 0..3 {
                column[k] += from[k];
            }
        }
    }

    /// Returns the matrix.
    pub fn matrix(&self) -> Mat3 {
        Mat3::from_fn(|i, j| self.0[j][i])
    }

    #[inline(always)]
    pub fn transposed(&self) -> Block {
        let [a, b, c] = &self.0;
        Block([[a[0], b[0], c[0], 0.0], [a[1], b[1], c[1], 0.0], [a[2], b[2], c[2], 0.0]])
    }

    /// Returns `A·B`.
    #[inline(always)]
    pub fn times(&self, other: &Block) -> Block {
        let [a, b, c] = &other.0;
        let column = |x: &Lanes| combined(&self.0, [x[0], x[1], x[2]]);
        Block([column(a), column(b), column(c)])
    }

    #[inline(always)]
    pub fn subtract(&mut self, other: &Block) {
        for (to, from) in self.0.iter_mut().zip(&other.0) {
            for k in 0..4 {
                to[k] -= from[k];
            }
        }
    }

    /// Returns `A·x`.
    #[inline(always)]
    pub fn of(&self, x: &Vec3) -> Vec3 {
        let [x, y, z, _] = combined(&self.0, [x.x, x.y, x.z]);
        Vec3::new(x, y, z)
    }

    /// Returns the Cholesky factor, 1 for a matrix that has none.
    pub fn cholesky(&self) -> Block {
        let root = Cholesky::new(self.matrix()).map_or_else(Mat3::identity, |root| root.l());
        let mut block = Block::default();
        block.add(&root);
        block
    }

    /// Returns the inverse of a lower triangular block.
    #[inline(always)]
    pub fn inverse_lower(&self) -> Block {
        let [l1, l2, l3] = &self.0;
        let (a, b, c) = (1.0 / l1[0], 1.0 / l2[1], 1.0 / l3[2]);
        let d = -l1[1] * a * b;
        let f = -l2[2] * b * c;
        let e = -(l1[2] * a + l2[2] * d) * c;
        Block([[a, d, e, 0.0], [0.0, b, f, 0.0], [0.0, 0.0, c, 0.0]])
    }

    /// Returns `G⁻¹·b`.
    #[inline(always)]
    pub fn solve_lower(&self, b: &Vec3) -> Vec3 {
        let [l1, l2, l3] = &self.0;
        let x = b.x / l1[0];
        let y = (b.y - l1[1] * x) / l2[1];
        Vec3::new(x, y, (b.z - l1[2] * x - l2[2] * y) / l3[2])
    }
}

impl Columns {
    /// Makes the first register a vector.
    #[inline(always)]
    pub fn of_vector(b: &Vec3) -> Columns {
        Columns([[b.x, 0.0, 0.0, 0.0], [0.0, b.y, 0.0, 0.0], [0.0, 0.0, b.z, 0.0]])
    }

    /// Subtracts from each register the products of a column of `A` with `x`: their sums are `b − Aᵀ·x`.
    #[inline(always)]
    pub fn subtract_products(&mut self, block: &Block, x: &Vec3) {
        let x = [x.x, x.y, x.z, 0.0];
        for (sum, column) in self.0.iter_mut().zip(&block.0) {
            for k in 0..4 {
                sum[k] -= column[k] * x[k];
            }
        }
    }

    /// Returns the sum of each register.
    #[inline(always)]
    pub fn sums(&self) -> Vec3 {
        let [x, y, z] = &self.0;
        Vec3::new(x[0] + x[1] + x[2], y[0] + y[1] + y[2], z[0] + z[1] + z[2])
    }

    /// Returns `G⁻¹·b` of all vectors.
    #[inline(always)]
    pub fn solved_lower(&self, g: &Block) -> Columns {
        let ([l1, l2, l3], [mut x, mut y, mut z]) = (&g.0, self.0);
        for x in &mut x {
            *x /= l1[0];
        }
        y = minus(y, &x, l1[1]);
        for y in &mut y {
            *y /= l2[1];
        }
        z = minus(minus(z, &x, l1[2]), &y, l2[2]);
        for z in &mut z {
            *z /= l3[2];
        }
        Columns([x, y, z])
    }

    /// Subtracts `A·x` of all vectors.
    #[inline(always)]
    pub fn subtract_product(&mut self, block: &Block, x: &Columns) {
        let [l1, l2, l3] = &block.0;
        for (i, to) in self.0.iter_mut().enumerate() {
            let change = combined(&x.0, [l1[i], l2[i], l3[i]]);
            for k in 0..4 {
                to[k] -= change[k];
            }
        }
    }
}
