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
//! blocks. A tree of boxes finds the triangles close enough to a cell.

use super::ListedTriangle;
use super::builder::{Builder, corner};
use super::cell_view::{CellView, LONG_LIST, NearTriangle};
use super::octree::Cell;
use super::triangles::Triangles;
use crate::Vec3;
use std::sync::OnceLock;

/// Maximum number of levels above a block.
const MAX_UPPER_LEVELS: u32 = 5;
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
    Divided(CellView),
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
            let mut views = Vec::new();
            let (depth, cells, lists) = match self.upper(cube, triangles, &mut views) {
                Some((depth, cell, list)) => (depth, vec![*cell], list.to_vec()),
                None => {
                    let (center, half) = self.cube_bounds(self.level, cube);
                    let mut builder = Builder::new(triangles, self.max_depth);
                    let list = inherited(triangles, &views, center, half).unwrap_or_default();
                    builder.branch(center, half, &list, &Vec3::zeros(), self.level);
                    (self.level, builder.cells, builder.lists)
                }
            };
            let within = self.top - self.level;
            let top = (0..1 << (3 * within)).map(|n| cell_above(&cells, n, depth, within)).collect();
            Block { top, cells: cells.into(), lists: lists.into() }
        })
    }

    /// Appends the views of all cells above a block to `views`, outermost first. Stops at an
    /// undivided cell and returns it with its depth and list.
    fn upper<'a>(
        &'a self,
        cube: [u32; 3],
        triangles: &Triangles,
        views: &mut Vec<&'a CellView>,
    ) -> Option<(u32, &'a Cell, &'a [ListedTriangle])> {
        for depth in 0..self.level {
            let [x, y, z] = cube.map(|digits| digits >> (self.level - depth));
            let number = cells_above_level(depth) + (x | y << depth | z << (2 * depth)) as usize;
            match self.upper[number].get_or_init(|| self.build_upper_cell(depth, [x, y, z], triangles, views)) {
                UpperCell::Divided(cell_view) => views.push(cell_view),
                UpperCell::Undivided(cell, list) => return Some((depth, cell, list)),
            }
        }
        None
    }

    /// Builds a cell above the blocks, given the views of the cells above it.
    fn build_upper_cell(&self, depth: u32, cube: [u32; 3], triangles: &Triangles, views: &[&CellView]) -> UpperCell {
        let (center, half) = self.cube_bounds(depth, cube);
        let passed = |t: u32| views.iter().rev().all(|cell_view| cell_view.passes_on(triangles, t));
        let Some(first) = triangles.closest_near(&center, passed) else {
            return UpperCell::Undivided(Cell::empty(), Box::default());
        };
        let cell_view = CellView::new(triangles, center, half, first);
        let mut listed = 0;
        triangles.each_within(&center, cell_view.furthest(triangles), |t| {
            listed += usize::from(cell_view.lists(triangles, t) && passed(t));
            listed <= LONG_LIST
        });
        if cell_view.is_divided(triangles, listed) {
            return UpperCell::Divided(cell_view);
        }
        let mut builder = Builder::new(triangles, depth);
        let list = inherited(triangles, views, center, half).unwrap_or_default();
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

/// Returns the triangles close enough to be relevant in a cell, of those that the cells above pass
/// on.
fn inherited(triangles: &Triangles, views: &[&CellView], center: Vec3, half: f64) -> Option<Vec<NearTriangle>> {
    let passed = |t: u32| views.iter().rev().all(|cell_view| cell_view.passes_on(triangles, t));
    let cell_view = CellView::new(triangles, center, half, triangles.closest_near(&center, passed)?);
    let mut list = Vec::new();
    triangles.each_within(&center, cell_view.furthest(triangles), |t| {
        if passed(t) {
            list.push(NearTriangle::anywhere(t));
        }
        true
    });
    Some(list)
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
