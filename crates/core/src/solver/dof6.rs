//! Arithmetic of blocks whose sides have six degrees of freedom each, as rigid bodies have. The
//! sums are those of any other side, arranged for registers of two numbers.

use crate::constraint::rows::{Block, Rows, dot6};

/// Positions of the numbers of a block with one or two sides of six degrees of freedom.
#[derive(Clone, Copy)]
pub(super) struct Dof6 {
    /// First index of each side's range of `du`; a single side is entered twice.
    u: [u32; 2],
    /// First index of each side's responses; a single side is entered twice.
    y: [u32; 2],
    alone: bool,
}

/// The responses of `K` rows, and the range of `du` that they multiply.
type SideData<'a, const K: usize> = (&'a [[f64; 6]; K], &'a [f64; 6]);

/// Both sides of a block of `K` rows; the second may be absent.
pub(super) struct Sides<'a, const K: usize> {
    first: SideData<'a, K>,
    second: Option<SideData<'a, K>>,
}

impl<const K: usize> Sides<'_, K> {
    /// Returns `(Yᵀu)` of row `k`.
    #[inline(always)]
    pub fn velocity(&self, k: usize) -> f64 {
        let first = dot6(&self.first.0[k], self.first.1);
        self.second.map_or(first, |(y, u)| first + dot6(&y[k], u))
    }
}

impl Dof6 {
    /// Returns `None` if a side has another number of degrees of freedom.
    pub fn of(block: &Block) -> Option<Dof6> {
        match block.sides() {
            [a, b] if a.dof == 6 && b.dof == 6 => Some(Dof6 { u: [a.u, b.u], y: [a.y, b.y], alone: false }),
            [a] if a.dof == 6 => Some(Dof6 { u: [a.u; 2], y: [a.y; 2], alone: true }),
            _ => None,
        }
    }

    /// Returns the numbers of a block of `K` rows; never `None` for a block made by `of`.
    #[inline(always)]
    pub fn sides<'a, const K: usize>(&self, rows: &'a Rows, du: &'a [f64]) -> Option<Sides<'a, K>> {
        let side = |s: usize| Some((responses(rows, self.y[s])?, du.get(self.u[s] as usize..)?.first_chunk()?));
        let second = if self.alone { None } else { Some(side(1)?) };
        Some(Sides { first: side(0)?, second })
    }

    /// Adds `Y·δ` to `u`.
    #[inline(always)]
    pub fn push<const K: usize>(&self, rows: &Rows, delta: [f64; K], du: &mut [f64]) {
        self.push_side(0, rows, delta, du);
        if !self.alone {
            self.push_side(1, rows, delta, du);
        }
    }

    #[inline(always)]
    fn push_side<const K: usize>(&self, side: usize, rows: &Rows, delta: [f64; K], du: &mut [f64]) {
        let u = du.get_mut(self.u[side] as usize..).and_then(|u| u.first_chunk_mut::<6>());
        if let (Some(y), Some(u)) = (responses::<K>(rows, self.y[side]), u) {
            let mut next = *u;
            for i in 0..6 {
                let mut sum = y[0][i] * delta[0];
                (1..K).for_each(|k| sum += y[k][i] * delta[k]);
                next[i] += sum;
            }
            *u = next;
        }
    }
}

#[inline(always)]
fn responses<const K: usize>(rows: &Rows, start: u32) -> Option<&[[f64; 6]; K]> {
    rows.y.get(start as usize..)?.as_chunks::<6>().0.first_chunk()
}
