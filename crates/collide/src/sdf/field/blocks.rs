//! Lazy construction of the octree's cells.
//!
//! The outermost cell is divided into `8^level` cubes. The cells in a cube form a *block*, which
//! the first query in the cube builds. A block is a pure function of the mesh and the cube: its
//! bits do not depend on the order of the queries or on the thread. Only the blocks near other
//! bodies are ever built.
//!
//! A cell inherits the relevant triangles of its parent ([`super::builder`]), so the cells above a
//! block are examined first. They are stored too: a divided cell as its [`CellView`], which decides
//! for each triangle whether it is relevant, an undivided one as the cell that covers all of its
//! blocks. A divided cell also stores the triangles that it passes on, unless they are many; then a
//! tree of boxes finds the triangles close enough to the cells below.

use super::ListedTriangle;
use super::builder::{Builder, corner};
use super::cell_view::{CellView, LONG_LIST, NearTriangle, order};
use super::octree::Cell;
use super::triangles::Triangles;
use crate::Vec3;
use std::sync::OnceLock;

/// Maximum number of levels above a block.
const MAX_UPPER_LEVELS: u32 = 5;
/// Maximum number of triangles that a cell above the blocks stores.
const MAX_STORED: usize = 4096;
/// Maximum number of levels within a block that [`Block::top`] skips.
const MAX_SKIPPED_LEVELS: u32 = 2;

/// The cells in a cube.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// For each of the skipped cubes, the cell at or above it, times 16, plus its depth.
    pub top: Box<[u32]>,
    pub cells: Box<[Cell]>,
    pub lists: Box<[ListedTriangle]>,
}

/// A cell above the blocks.
#[derive(Clone, Debug)]
enum UpperCell {
    Undivided(Cell, Box<[ListedTriangle]>),
    Divided(Divided),
}

/// A divided cell above the blocks.
#[derive(Clone, Debug)]
struct Divided {
    cell_view: CellView,
    /// The triangles that it and all cells above it pass on, unless they are many.
    passed_on: Option<Box<[u32]>>,
}

/// The triangles that can be relevant in a cell, among those that the cells above it pass on.
struct Inherited<'a> {
    /// The triangles that one of these cells stores; `None` if none does.
    stored: Option<&'a [u32]>,
    /// The cells below that one, outermost first.
    above: &'a [&'a Divided],
    triangles: &'a Triangles,
}

impl<'a> Inherited<'a> {
    /// `above` are all cells above a cell, outermost first.
    fn new(triangles: &'a Triangles, above: &'a [&'a Divided]) -> Inherited<'a> {
        let last = above.iter().rposition(|divided| divided.passed_on.is_some());
        let stored = last.and_then(|last| above[last].passed_on.as_deref());
        Inherited { stored, above: &above[last.map_or(0, |last| last + 1)..], triangles }
    }

    fn passes(&self, t: u32) -> bool {
        self.above.iter().rev().all(|divided| divided.cell_view.passes_on(self.triangles, t))
    }

    /// Returns the view of a cell; `None` if no triangle is relevant there.
    fn cell_view(&self, center: Vec3, half: f64) -> Option<CellView> {
        let first = match self.stored {
            Some(stored) => {
                let passed = stored.iter().filter(|t| self.passes(**t));
                passed.map(|t| self.triangles.near(&center, *t)).min_by(order)?
            }
            None => self.triangles.closest_near(&center, |t| self.passes(t))?,
        };
        Some(CellView::new(self.triangles, center, half, first))
    }

    /// Calls `each` with the triangles that can be relevant in the cell of a view, until it returns false.
    fn each(&self, cell_view: &CellView, mut each: impl FnMut(u32) -> bool) {
        let mut each_passed = |t: u32| !self.passes(t) || each(t);
        match self.stored {
            Some(stored) => _ = stored.iter().all(|t| each_passed(*t)),
            None => self.triangles.each_within(&cell_view.center, cell_view.furthest(self.triangles), each_passed),
        }
    }

    /// Returns the triangles that can be relevant in a cell.
    fn list(&self, center: Vec3, half: f64) -> Vec<NearTriangle> {
        if let Some(stored) = self.stored {
            return stored.iter().filter(|t| self.passes(**t)).map(|t| NearTriangle::anywhere(*t)).collect();
        }
        let mut list = Vec::new();
        if let Some(cell_view) = self.cell_view(center, half) {
            self.each(&cell_view, |t| {
                list.push(NearTriangle::anywhere(t));
                true
            });
        }
        list
    }
}

/// All blocks of an octree.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    center: Vec3,
    half: f64,
    /// Depth of the smallest cells.
    max_depth: u32,
    /// Number of levels above a block, and down to the cubes of [`Block::top`].
    level: u32,
    top: u32,
    upper: Box<[OnceLock<UpperCell>]>,
    blocks: Box<[OnceLock<Block>]>,
}

impl Blocks {
    /// Returns the blocks, not yet built, of the cube with this center and half side, divided at
    /// most `max_depth` times.
    pub fn new(center: Vec3, half: f64, max_depth: u32) -> Blocks {
        let top = max_depth.min(MAX_UPPER_LEVELS + MAX_SKIPPED_LEVELS);
        let level = top.saturating_sub(MAX_SKIPPED_LEVELS);
        let upper = (0..cells_above_level(level)).map(|_| OnceLock::new()).collect();
        let blocks = (0..1 << (3 * level)).map(|_| OnceLock::new()).collect();
        Blocks { center, half, max_depth, level, top, upper, blocks }
    }

    /// Returns the number of levels from the outermost cell to the cubes of [`Block::top`].
    pub fn top(&self) -> u32 {
        self.top
    }

    /// Returns the block of a cube of the top level, and the index of that cube in [`Block::top`].
    #[inline(always)]
    pub fn at(&self, cube: &[u32; 4], triangles: &Triangles) -> (&Block, usize) {
        let within = self.top - self.level;
        let [x, y, z] = [cube[0] >> within, cube[1] >> within, cube[2] >> within];
        let number = (x | y << self.level | z << (2 * self.level)) as usize;
        let low = (1 << within) - 1;
        let place = (cube[0] & low) | (cube[1] & low) << within | (cube[2] & low) << (2 * within);
        let block = match self.blocks[number].get() {
            Some(block) => block,
            None => self.build_block(number, [x, y, z], triangles),
        };
        (block, place as usize)
    }

    #[cold]
    #[inline(never)]
    fn build_block(&self, number: usize, cube: [u32; 3], triangles: &Triangles) -> &Block {
        self.blocks[number].get_or_init(|| {
            let mut above = Vec::new();
            let (depth, cells, lists) = match self.upper(cube, triangles, &mut above) {
                Some((depth, cell, list)) => (depth, vec![*cell], list.to_vec()),
                None => {
                    let (center, half) = self.cube_bounds(self.level, cube);
                    let mut builder = Builder::new(triangles, self.max_depth);
                    let list = Inherited::new(triangles, &above).list(center, half);
                    builder.branch(center, half, &list, &Vec3::zeros(), self.level);
                    (self.level, builder.cells, builder.lists)
                }
            };
            let within = self.top - self.level;
            let top = (0..1 << (3 * within)).map(|n| cell_above(&cells, n, depth, within)).collect();
            Block { top, cells: cells.into(), lists: lists.into() }
        })
    }

    /// Appends all divided cells above a block to `above`, outermost first. Stops at an
    /// undivided cell and returns it with its depth and list.
    fn upper<'a>(
        &'a self,
        cube: [u32; 3],
        triangles: &Triangles,
        above: &mut Vec<&'a Divided>,
    ) -> Option<(u32, &'a Cell, &'a [ListedTriangle])> {
        for depth in 0..self.level {
            let [x, y, z] = cube.map(|digits| digits >> (self.level - depth));
            let number = cells_above_level(depth) + (x | y << depth | z << (2 * depth)) as usize;
            match self.upper[number].get_or_init(|| self.build_upper_cell(depth, [x, y, z], triangles, above)) {
                UpperCell::Divided(divided) => above.push(divided),
                UpperCell::Undivided(cell, list) => return Some((depth, cell, list)),
            }
        }
        None
    }

    /// Builds a cell above the blocks, given the cells above it.
    fn build_upper_cell(&self, depth: u32, cube: [u32; 3], triangles: &Triangles, above: &[&Divided]) -> UpperCell {
        let (center, half) = self.cube_bounds(depth, cube);
        let inherited = Inherited::new(triangles, above);
        let Some(cell_view) = inherited.cell_view(center, half) else {
            return UpperCell::Undivided(Cell::empty(), Box::default());
        };
        let mut listed = 0;
        inherited.each(&cell_view, |t| {
            listed += usize::from(cell_view.lists(triangles, t));
            listed <= LONG_LIST
        });
        if cell_view.is_divided(triangles, listed) {
            let mut passed_on = Vec::new();
            inherited.each(&cell_view, |t| {
                passed_on.extend(Some(t).filter(|t| cell_view.passes_on(triangles, *t)));
                passed_on.len() <= MAX_STORED
            });
            let passed_on = (passed_on.len() <= MAX_STORED).then(|| passed_on.into_boxed_slice());
            return UpperCell::Divided(Divided { cell_view, passed_on });
        }
        let mut builder = Builder::new(triangles, depth);
        let list = inherited.list(center, half);
        let cell = builder.build_cell(center, half, &list, &Vec3::zeros(), depth, &mut Vec::new());
        UpperCell::Undivided(cell.unwrap_or_else(Cell::empty), builder.lists.into())
    }

    /// Returns the center and half side of a cell.
    fn cube_bounds(&self, depth: u32, cube: [u32; 3]) -> (Vec3, f64) {
        let (mut center, mut half) = (self.center, self.half);
        for digit in (0..depth).rev() {
            let octant = (0..3).map(|k| ((cube[k] >> digit & 1) as usize) << k).sum();
            half *= 0.5;
            center += corner(octant, half);
        }
        (center, half)
    }
}

/// Returns the number of cells of all depths above this one.
fn cells_above_level(depth: u32) -> usize {
    (0..depth).map(|d| 1 << (3 * d)).sum()
}

/// Returns the cell of a block at or above a cube `within` levels further down, times 16, plus its
/// depth. The root of the block has the depth `depth`.
fn cell_above(cells: &[Cell], cube: u32, depth: u32, within: u32) -> u32 {
    let (mut cell, mut passed) = (0, 0);
    while passed < within && cells[cell].children() > 0 {
        passed += 1;
        let octant: u32 = (0..3).map(|k| (cube >> (k * within + within - passed) & 1) << k).sum();
        cell = cells[cell].children() + octant as usize;
    }
    (cell as u32) << 4 | (depth + passed)
}

#[cfg(test)]
impl Blocks {
    /// Builds all blocks, in an order given by `step`, an odd number.
    pub fn build_all(&self, step: usize, triangles: &Triangles) {
        for n in 0..self.blocks.len() {
            let (number, level) = (n * step % self.blocks.len(), self.level);
            let digits = |k: u32| (number >> (k * level)) as u32 & ((1 << level) - 1);
            self.build_block(number, [digits(0), digits(1), digits(2)], triangles);
        }
    }

    /// Returns the blocks built so far.
    pub fn built(&self) -> impl Iterator<Item = &Block> {
        self.blocks.iter().filter_map(OnceLock::get)
    }
}
