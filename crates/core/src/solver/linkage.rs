//! Direct solution of equality rows within the sweeps: loops of links and chains of joints converge
//! badly one row at a time.
//!
//! Objects that equality rows join, directly or through others, form a *linkage*. Its rows E are
//! factored once per solve (`equality.rs`). Any other row that acts on one of its objects then
//! moves all of them, with the joints held:
//!
//! ```text
//! w_E = c_E + Y_Eᵀu + R_E·λ_E = 0  before and after      A = K_EE + R_E
//! δλ_E = −A⁻¹·K_Ei·δλ_i
//! δu   = Y_i·δλ_i + Y_E·δλ_E = Ỹ_i·δλ_i                  Ỹ_i = Y_i − Y_E·A⁻¹·K_Ei   response of the linkage to row i
//! K̃_ij = Y_iᵀ·Ỹ_j                                        diagonal block in the sweeps
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `E`, `i` | equality rows of a linkage; a row of any other block |
//! | `Y`, `K`, `R`, `c` | as in `rows.rs` |
//! | `Ỹ` | whitened velocities of the whole linkage due to a unit of `λ_i` |
//!
//! A sweep reads a row's velocity from its own two objects and writes to the linkages that they
//! belong to. The equality rows hold in every iterate, and `λ_E` is found at the end. The cost is
//! `e³/3` for the factor and `e²` for every other row that acts on the linkage. If that exceeds
//! [`MAX_WORK`], or `e` exceeds [`MAX_DIRECT_ROWS`], the linkage's rows are relaxed one by one.
//!
//! Dependent rows get no multiplier. [`RANK`] is coarser here than rounding requires: two pins of
//! one joint that have drifted apart by a fraction `ε` of the size of their bodies leave `ε²` of a
//! diagonal, and a multiplier for that would lock the joint.
//!
//! Intervals without bounds are equalities. A motor with limits is not: its row would have to join
//! E inside its limits and leave E at them. That would be an active set: bordering the factor by
//! one row (`e²`) when one joins, the inverse operation when one leaves, and a sweep in between.

use super::equality::{Equalities, Numbers, VANISHED, add_multiple};
use super::one_contact::Symmetric3;
use crate::constraint::rows::{Block, RowSet, Rows, Side, dot};
use tumble_collide::UnionFind;

/// Maximum number of equality rows of a linkage that are solved directly.
pub const MAX_DIRECT_ROWS: usize = 200;
/// Maximum number of multiplications for a linkage before the first sweep, about 20 ms.
const MAX_WORK: usize = 40_000_000;
/// A row depends on others if its pivot is below this fraction of its diagonal: two pins of one
/// joint that are 0.1 mm apart in a meter.
const RANK: f64 = 1e-8;
/// A remaining velocity along an equality row counts as zero below this fraction of the largest
/// initial one.
const SOLVED: f64 = 1e-9;

/// The linkages of an island that are solved directly.
#[derive(Default)]
pub(super) struct Linkages {
    linkages: Vec<Linkage>,
    /// All their objects, sorted: the start of the object's `u`, and its linkage.
    objects: Vec<(u32, usize)>,
    /// Sides of all side ranges, and their responses.
    sides: Vec<Side>,
    y: Vec<f64>,
}

struct Linkage {
    /// Its equality rows, as indices into `Rows::blocks`.
    rows: Vec<u32>,
    factor: Equalities,
    /// Its objects, sorted: start of `u`, degrees of freedom.
    objects: Vec<(u32, u32)>,
}

/// The sides that a block of other rows moves if it acts on a linkage: a range in [`Linkages`].
#[derive(Clone, Copy, Default)]
pub(super) struct SideRange {
    first: u32,
    end: u32,
}

impl SideRange {
    /// Returns whether the block acts on no linkage and moves only its own sides.
    #[inline(always)]
    pub fn is_own(self) -> bool {
        self.first == self.end
    }
}

impl Linkages {
    /// Finds the linkages among `blocks` and factors their rows.
    pub fn new(rows: &Rows, blocks: &[u32]) -> Linkages {
        let mut joints: Vec<u32> = Vec::with_capacity(blocks.len());
        joints.extend(blocks.iter().copied().filter(|&b| is_joint(rows, &rows.blocks[b as usize])));
        let mut all = Linkages::default();
        for joined in groups(rows, &joints) {
            let objects = objects_of(rows, &joined);
            let couples = |block: &&Block| block.sides().iter().any(|s| objects.binary_search(&(s.u, s.dof)).is_ok());
            let met: usize = if joined.len() > MAX_DIRECT_ROWS {
                0
            } else {
                island(rows, blocks).filter(couples).map(|b| b.set.rows()).sum()
            };
            if joined.len() <= MAX_DIRECT_ROWS && joined.len().pow(2) * met <= MAX_WORK {
                let dof: usize = objects.iter().map(|(_, dof)| *dof as usize).sum();
                all.y.reserve(met * dof);
                all.objects.extend(objects.iter().map(|(u, _)| (*u, all.linkages.len())));
                all.linkages.push(Linkage::new(rows, joined, objects));
            }
        }
        all.objects.sort_unstable();
        all
    }

    /// Returns whether there is no linkage.
    pub fn is_empty(&self) -> bool {
        self.linkages.is_empty()
    }

    /// Returns whether the block is one of the equality rows solved here.
    pub fn contains_row(&self, rows: &Rows, block: &Block) -> bool {
        !self.is_empty() && is_joint(rows, block) && block.sides().iter().any(|s| self.linkage_of(s).is_some())
    }

    /// Returns the equality rows of each linkage, with their factor.
    pub fn each(&self) -> impl Iterator<Item = (&[u32], &Equalities)> {
        self.linkages.iter().map(|l| (&l.rows[..], &l.factor))
    }

    /// Returns start and end of every range of `du` that the linkages move.
    pub fn stretches(&self) -> impl Iterator<Item = (u32, u32)> {
        self.linkages.iter().flat_map(|l| l.objects.iter().map(|(u, dof)| (*u, u + dof)))
    }

    /// Computes `Ỹ` of a block of other rows.
    pub fn extend_sides(&mut self, rows: &Rows, block: &Block) -> SideRange {
        if self.is_empty() {
            return SideRange::default();
        }
        let met: Vec<Option<usize>> = block.sides().iter().map(|s| self.linkage_of(s)).collect();
        if met.iter().all(Option::is_none) {
            return SideRange::default();
        }
        let (first, count) = (self.sides.len(), block.set.rows());
        for (side, _) in block.sides().iter().zip(&met).filter(|(_, met)| met.is_none()) {
            self.push_side(side.u, side.dof, count);
        }
        for (i, linkage) in met.iter().enumerate().filter_map(|(i, l)| Some((i, (*l)?))) {
            // two sides in one linkage share one range
            if i == 0 || met[0] != Some(linkage) {
                let objects = std::mem::take(&mut self.linkages[linkage].objects);
                objects.iter().for_each(|(u, dof)| self.push_side(*u, *dof, count));
                self.linkages[linkage].objects = objects;
                self.subtract_joint_responses(rows, block, linkage, first);
            }
        }
        for side in block.sides() {
            let Linkages { sides, y, .. } = self;
            (0..count).for_each(|k| add(&sides[first..], y, (side, k), 1.0, rows.response(side, k)));
        }
        let side_range = SideRange { first: first as u32, end: self.sides.len() as u32 };
        for k in 0..count {
            if self.own(rows, block, side_range, k, k) <= VANISHED * rows.own(block, k, k) {
                self.clear(side_range, k);
            }
        }
        side_range
    }

    /// Subtracts `Y_E·A⁻¹·K_Ei` of one linkage from `Ỹ`, for every row of a block.
    fn subtract_joint_responses(&mut self, rows: &Rows, block: &Block, linkage: usize, first: usize) {
        let Linkages { linkages, sides, y, .. } = self;
        let Linkage { rows: joints, factor, .. } = &linkages[linkage];
        for k in 0..block.set.rows() {
            let coupling: Numbers = island(rows, joints).map(|joint| rows.coupling(joint, 0, block, k)).collect();
            for (joint, held) in island(rows, joints).zip(factor.solve(&coupling)).filter(|(_, held)| *held != 0.0) {
                joint.sides().iter().for_each(|s| add(&sides[first..], y, (s, k), -held, rows.response(s, 0)));
            }
        }
    }

    fn linkage_of(&self, side: &Side) -> Option<usize> {
        let place = self.objects.binary_search_by_key(&side.u, |(u, _)| *u).ok()?;
        Some(self.objects[place].1)
    }

    fn push_side(&mut self, u: u32, dof: u32, count: usize) {
        self.sides.push(Side { u, dof, y: self.y.len() as u32 });
        self.y.resize(self.y.len() + count * dof as usize, 0.0);
    }

    fn clear(&mut self, side_range: SideRange, k: usize) {
        for side in &self.sides[side_range.first as usize..side_range.end as usize] {
            let (start, dof) = (side.y as usize + k * side.dof as usize, side.dof as usize);
            self.y[start..start + dof].fill(0.0);
        }
    }

    /// Returns the sides that a block moves, and the array of their responses.
    #[inline(always)]
    pub fn moved<'a>(&'a self, rows: &'a Rows, block: &'a Block, side_range: SideRange) -> (&'a [Side], &'a [f64]) {
        if side_range.is_own() {
            (block.sides(), &rows.y)
        } else {
            (&self.sides[side_range.first as usize..side_range.end as usize], &self.y)
        }
    }

    /// Returns `K̃_ij = Y_iᵀ·Ỹ_j` of a block's own rows.
    pub fn own(&self, rows: &Rows, block: &Block, side_range: SideRange, i: usize, j: usize) -> f64 {
        if side_range.is_own() {
            return rows.own(block, i, j);
        }
        let (sides, y) = self.moved(rows, block, side_range);
        let part = |side: &Side| {
            let to = sides.iter().find(|s| s.u == side.u)?;
            let start = to.y as usize + j * to.dof as usize;
            Some(dot(rows.response(side, i), &y[start..start + to.dof as usize]))
        };
        block.sides().iter().filter_map(part).sum()
    }

    /// Returns the `K̃` of a contact.
    pub fn own_contact(&self, rows: &Rows, block: &Block, side_range: SideRange) -> Symmetric3 {
        let k = |i, j| self.own(rows, block, side_range, i, j);
        Symmetric3 { m00: k(0, 0), m10: k(1, 0), m20: k(2, 0), m11: k(1, 1), m21: k(2, 1), m22: k(2, 2) }
    }

    /// Solves all `λ_E` for the `du` of the other rows and adds their effect. Returns the largest
    /// velocity that is left, m/s; 0 if that is rounding.
    pub fn solve_equalities(&self, rows: &Rows, c: &[f64], lambda: &mut [f64], du: &mut [f64]) -> f64 {
        self.linkages.iter().map(|l| l.solve_equalities(rows, c, lambda, du)).fold(0.0, f64::max)
    }
}

impl Linkage {
    fn new(rows: &Rows, joints: Vec<u32>, objects: Vec<(u32, u32)>) -> Linkage {
        let factor = Equalities::new(&rows.dense(&joints), joints.len(), RANK);
        Linkage { rows: joints, factor, objects }
    }

    fn solve_equalities(&self, rows: &Rows, c: &[f64], lambda: &mut [f64], du: &mut [f64]) -> f64 {
        island(rows, &self.rows).for_each(|joint| lambda[joint.row as usize] = 0.0);
        let velocities = |lambda: &[f64], du: &[f64]| -> Numbers {
            let w = |joint: &Block| {
                c[joint.row as usize] + rows.row_velocity(joint, 0, du) + joint.compliance * lambda[joint.row as usize]
            };
            island(rows, &self.rows).map(w).collect()
        };
        let largest = |w: &[f64]| w.iter().fold(0.0, |a: f64, w| a.max(w.abs()));
        let mut w = velocities(lambda, du);
        let before = largest(&w);
        // The second pass is iterative refinement.
        for _ in 0..2 {
            for (joint, change) in island(rows, &self.rows).zip(self.factor.solve(&w)) {
                lambda[joint.row as usize] -= change;
                for s in joint.sides() {
                    add_multiple(rows.response(s, 0), -change, &mut du[s.u as usize..(s.u + s.dof) as usize]);
                }
            }
            w = velocities(lambda, du);
        }
        let left = largest(&w);
        if left <= SOLVED * before { 0.0 } else { left }
    }
}

/// Adds `scale·y` to `Ỹ_k`, in `all`, on the object of `side` among `sides`.
fn add(sides: &[Side], all: &mut [f64], (side, k): (&Side, usize), scale: f64, y: &[f64]) {
    if let Some(to) = sides.iter().find(|s| s.u == side.u) {
        let start = to.y as usize + k * y.len();
        add_multiple(y, scale, &mut all[start..start + y.len()]);
    }
}

/// Returns whether a block is one free multiplier with a response.
fn is_joint(rows: &Rows, block: &Block) -> bool {
    let free = match block.set {
        RowSet::Equality => true,
        RowSet::Interval { lo, hi } => lo == f64::NEG_INFINITY && hi == f64::INFINITY,
        RowSet::HalfLine | RowSet::Cone { .. } => false,
    };
    free && rows.own(block, 0, 0) > f64::MIN_POSITIVE
}

fn island<'a>(rows: &'a Rows, blocks: &'a [u32]) -> impl Iterator<Item = &'a Block> {
    blocks.iter().map(|&b| &rows.blocks[b as usize])
}

/// Returns the objects of the blocks, sorted: start of `u`, degrees of freedom.
fn objects_of(rows: &Rows, blocks: &[u32]) -> Vec<(u32, u32)> {
    let mut objects: Vec<(u32, u32)> = Vec::new();
    for object in island(rows, blocks).flat_map(|b| b.sides().iter().map(|s| (s.u, s.dof))) {
        // the rows of one robot are consecutive
        if objects.last() != Some(&object) {
            objects.push(object);
        }
    }
    objects.sort_unstable();
    objects.dedup();
    objects
}

/// Returns the joints grouped by connected objects, in the order of each group's first joint.
fn groups(rows: &Rows, joints: &[u32]) -> Vec<Vec<u32>> {
    let objects = objects_of(rows, joints);
    if objects.len() == 1 {
        return vec![joints.to_vec()];
    }
    let place = |s: &Side| objects.binary_search(&(s.u, s.dof)).unwrap_or(0) as u32;
    let mut sets = UnionFind::new(objects.len());
    for joint in island(rows, joints) {
        if let [first, second] = joint.sides() {
            sets.union(place(first), place(second));
        }
    }
    let mut group_of = vec![usize::MAX; objects.len()];
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for (&b, joint) in joints.iter().zip(island(rows, joints)) {
        // a joint has a response and therefore a side
        let root = joint.sides().first().map_or(0, |s| sets.find(place(s)) as usize);
        if group_of[root] == usize::MAX {
            group_of[root] = groups.len();
            groups.push(Vec::new());
        }
        groups[group_of[root]].push(b);
    }
    groups
}
