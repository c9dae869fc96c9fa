//! A spatial tree whose cells hold a few dozen boxes, each swept by itself.
//!
//! Axis-aligned planes divide space where boxes are dense, so cells suit boxes of any size and
//! density. A box is stored in every cell that it intersects. A pair of boxes is reported by one
//! cell only, the one that contains the lowest corner of their intersection:
//!
//! ```text
//! corner_k = max(min_k of a, min_k of b)        low side of a split if corner < at, else high side
//! ```
//!
//! A box that covers all of space is stored in every cell: about one entry per twenty boxes that it
//! overlaps, fewer than the pairs. Source of the sweep: Baraff, *Dynamic Simulation of
//! Non-Penetrating Rigid Bodies* (1992), §6. Departure: the sweep runs within cells, because n
//! boxes in a cube overlap n^(5/3) times along one axis.

use super::fat::{FatBox, pair};

/// Number of boxes above which a cell is split.
const CELL_CAPACITY: usize = 72;
/// Maximum percentage of the boxes on either side of a split.
const MAX_SIDE_PERCENT: usize = 80;
/// Maximum number of box centers that place a split.
const MAX_SAMPLES: usize = 32;
/// Maximum depth of the tree.
const MAX_DEPTH: u32 = 40;

/// A node of the tree.
#[derive(Clone, Copy, Debug)]
enum Node {
    /// The low side is node `low`, the high side the next node.
    Split { axis: u8, at: f32, low: u32 },
    /// Index of a cell.
    Cell(u32),
}

/// A box and its handle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub fat: FatBox,
    pub handle: u32,
}

/// Boxes that intersect one region, and their handles, unordered.
#[derive(Clone, Debug)]
struct Cell {
    region: FatBox,
    boxes: Vec<FatBox>,
    handles: Vec<u32>,
    /// Number of boxes above which the cell is split; above [`CELL_CAPACITY`] after a failed
    /// attempt.
    limit: usize,
    depth: u32,
}

/// The tree and its cells.
#[derive(Clone, Debug, Default)]
pub(super) struct Cells {
    nodes: Vec<Node>,
    cells: Vec<Cell>,
    /// Number of cells when the tree was built, and of splits since.
    built: usize,
    splits: usize,
    /// A cell of each box, by handle; a hint.
    cell_hints: Vec<u32>,
    /// Scratch memory.
    buffer: Vec<Entry>,
    places: Vec<(u32, bool, bool)>,
}

impl Cells {
    /// Stores all boxes and appends all their pairs.
    pub fn build(&mut self, entries: impl Iterator<Item = Entry>, pairs: &mut Vec<u64>) {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        buffer.extend(entries.filter(|e| e.fat.is_valid()));
        self.nodes.clear();
        self.cells.clear();
        self.nodes.push(Node::Cell(0));
        let mut cell_hints = std::mem::take(&mut self.cell_hints);
        cell_hints.clear();
        cell_hints.resize(buffer.iter().map(|e| e.handle as usize + 1).max().unwrap_or(0), 0);
        let mut cell = 0;
        self.subdivide(0, 0, FatBox::UNBOUNDED, &mut buffer, 0, &mut |region, entries| {
            Cell::sweep(region, entries, pairs);
            entries.iter().for_each(|e| cell_hints[e.handle as usize] = cell);
            cell += 1;
        });
        self.cell_hints = cell_hints;
        (self.built, self.splits, self.buffer) = (self.cells.len(), 0, buffer);
    }

    /// Returns a cell in which the box was stored last. Updates in the order of these cells access
    /// memory coherently.
    pub fn cell_hint(&self, handle: u32) -> u32 {
        self.cell_hints.get(handle as usize).copied().unwrap_or(0)
    }

    /// Returns whether enough cells were split one by one that the tree may be unbalanced.
    pub fn needs_rebuild(&self) -> bool {
        self.splits > self.built / 2 + 8
    }

    /// Moves one box from `old` to `new` and calls `met` for every box that it overlaps.
    pub fn update(&mut self, handle: u32, old: &FatBox, new: &FatBox, mut met: impl FnMut(u32)) {
        self.cell_hints.resize(self.cell_hints.len().max(handle as usize + 1), 0);
        let mut places = std::mem::take(&mut self.places);
        places.push((0, true, true));
        while let Some((node, was_here, is_here)) = places.pop() {
            match self.nodes.get(node as usize) {
                None => {}
                Some(Node::Split { axis, at, low }) => {
                    let k = *axis as usize;
                    let sides = [
                        (was_here && old.min(k) < *at, is_here && new.min(k) < *at),
                        (was_here && old.max(k) >= *at, is_here && new.max(k) >= *at),
                    ];
                    let reached =
                        sides.iter().zip([*low, low + 1]).filter(|((was_here, is_here), _)| *was_here || *is_here);
                    places.extend(reached.map(|((was_here, is_here), node)| (node, *was_here, *is_here)));
                }
                Some(&Node::Cell(index)) => {
                    let cell = &mut self.cells[index as usize];
                    cell.update(handle, was_here, is_here.then_some(new), &mut met);
                    self.cell_hints[handle as usize] = index;
                    if cell.boxes.len() > cell.limit {
                        self.split_cell(node, index);
                    }
                }
            }
        }
        self.places = places;
    }

    /// Splits a cell with too many boxes.
    fn split_cell(&mut self, node: u32, index: u32) {
        let cell = &mut self.cells[index as usize];
        let (boxes, handles, region, depth) =
            (std::mem::take(&mut cell.boxes), std::mem::take(&mut cell.handles), cell.region, cell.depth);
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        buffer.extend(boxes.into_iter().zip(handles).map(|(fat, handle)| Entry { fat, handle }));
        let before = self.nodes.len();
        self.subdivide(node as usize, depth, region, &mut buffer, 0, &mut |_, _| {});
        self.splits += usize::from(self.nodes.len() > before);
        self.buffer = buffer;
    }

    /// Replaces a node by the subtree of the boxes in `buffer[from..]` and calls `visit` for every
    /// new cell. Entries before `from` are not touched.
    fn subdivide(
        &mut self,
        node: usize,
        depth: u32,
        region: FatBox,
        buffer: &mut Vec<Entry>,
        from: usize,
        visit: &mut impl FnMut(&FatBox, &mut [Entry]),
    ) {
        let found =
            if buffer.len() - from > CELL_CAPACITY && depth < MAX_DEPTH { find_split(&buffer[from..]) } else { None };
        let Some((axis, at)) = found else {
            let entries = &mut buffer[from..];
            visit(&region, entries);
            self.nodes[node] = Node::Cell(self.cells.len() as u32);
            let (boxes, handles) = entries.iter().map(|e| (e.fat, e.handle)).unzip();
            self.cells.push(Cell { region, limit: 2 * entries.len().max(CELL_CAPACITY), boxes, handles, depth });
            return;
        };
        let low = self.nodes.len();
        self.nodes[node] = Node::Split { axis: axis as u8, at, low: low as u32 };
        self.nodes.extend([Node::Cell(0); 2]);
        let end = buffer.len();
        for (side, part) in region.split(axis, at).into_iter().enumerate() {
            for i in from..end {
                let fat = &buffer[i].fat;
                if if side == 0 { fat.min(axis) < at } else { fat.max(axis) >= at } {
                    buffer.push(buffer[i]);
                }
            }
            self.subdivide(low + side, depth + 1, part, buffer, end, visit);
            buffer.truncate(end);
        }
    }
}

impl Cell {
    /// Removes a box if it `was_here`, calls `met` for the boxes that the new one overlaps here,
    /// and stores it.
    fn update(&mut self, handle: u32, was_here: bool, new: Option<&FatBox>, met: &mut impl FnMut(u32)) {
        let place = if was_here { self.handles.iter().position(|h| *h == handle) } else { None };
        if let Some(place) = place {
            self.boxes.swap_remove(place);
            self.handles.swap_remove(place);
        }
        if let Some(new) = new {
            let overlap_query = new.overlap_query();
            for (other, fat) in self.handles.iter().zip(&self.boxes) {
                if fat.overlaps(&overlap_query) && owns_pair(&self.region, fat, new) {
                    met(*other);
                }
            }
            self.boxes.push(*new);
            self.handles.push(handle);
        }
    }

    /// Appends all pairs of the boxes of a cell, which are sorted for it.
    fn sweep(region: &FatBox, entries: &mut [Entry], pairs: &mut Vec<u64>) {
        let axis = axes(entries)[0].1;
        entries.sort_unstable_by(|a, b| a.fat.min(axis).total_cmp(&b.fat.min(axis)));
        for (n, a) in entries.iter().enumerate() {
            let (overlap_query, end) = (a.fat.overlap_query(), a.fat.max(axis));
            for b in entries[n + 1..].iter().take_while(|b| b.fat.min(axis) <= end) {
                if b.fat.overlaps(&overlap_query) && owns_pair(region, &a.fat, &b.fat) {
                    pairs.push(pair(a.handle, b.handle));
                }
            }
        }
    }
}

/// Returns whether the lowest corner of the intersection of two boxes lies in a region. The high
/// sides of the region are excluded unless infinite.
fn owns_pair(region: &FatBox, a: &FatBox, b: &FatBox) -> bool {
    (0..3).all(|k| {
        let corner = a.min(k).max(b.min(k));
        corner >= region.min(k) && (corner < region.max(k) || region.max(k) == f32::INFINITY)
    })
}

/// Returns an axis and a coordinate that split the boxes well: the median of a sample of their
/// centers, on the widest axis on which that is worthwhile.
fn find_split(entries: &[Entry]) -> Option<(usize, f32)> {
    let most = entries.len() * MAX_SIDE_PERCENT / 100;
    axes(entries).into_iter().find_map(|(_, axis)| {
        let mut centers = [0.0; MAX_SAMPLES];
        let mut count = 0;
        for center in sample(entries, axis) {
            centers[count] = center;
            count += 1;
        }
        let centers = &mut centers[..count];
        centers.sort_unstable_by(f32::total_cmp);
        let at = *centers.get(count / 2)?;
        let low = entries.iter().filter(|e| e.fat.min(axis) < at).count();
        let high = entries.iter().filter(|e| e.fat.max(axis) >= at).count();
        (low <= most && high <= most).then_some((axis, at))
    })
}

/// Returns the extent of the centers on each axis, widest first.
fn axes(entries: &[Entry]) -> [(f32, usize); 3] {
    let mut widths = [0, 1, 2].map(|axis| {
        let bounds = |(low, high): (f32, f32), x: f32| (low.min(x), high.max(x));
        let (low, high) = sample(entries, axis).fold((f32::INFINITY, f32::NEG_INFINITY), bounds);
        (high - low, axis)
    });
    widths.sort_by(|a, b| b.0.total_cmp(&a.0));
    widths
}

/// Returns the centers of up to [`MAX_SAMPLES`] boxes, evenly spaced in the list, without those of
/// unbounded boxes.
fn sample(entries: &[Entry], axis: usize) -> impl Iterator<Item = f32> {
    let every = entries.len().div_ceil(MAX_SAMPLES).max(1);
    entries.iter().step_by(every).map(move |e| 0.5 * e.fat.min(axis) + 0.5 * e.fat.max(axis)).filter(|x| x.is_finite())
}
