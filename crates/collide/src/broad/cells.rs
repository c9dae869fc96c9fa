//! Space in cells of a few dozen boxes, each swept by itself.
//!
//! A tree of planes across the axes cuts space where boxes are many, so that cells suit boxes of any size and any crowd; a box is filed
//! in every cell that it reaches. Two boxes are a pair of one cell alone, the one that holds the least corner of what they share:
//!
//! ```text
//! corner_k = max(min_k of a, min_k of b)        low side of a cut if corner < at, else high side
//! ```
//!
//! A box that reaches all of space lies in every cell, about one entry per twenty of the boxes that it overlaps: what is found costs more.
//! Source of the sweep: Baraff, *Dynamic Simulation of Non-Penetrating Rigid Bodies* (1992), §6. Departure: sweeps within cells, because along
//! one axis of a cube n boxes begin within each other n^(5/3) times.

use super::fat::{FatBox, pair};

/// A cell is cut when it holds more.
const CELL_CAPACITY: usize = 72;
/// A cut must leave either side with at most this share of the boxes, in percent.
const MAX_SIDE_PERCENT: usize = 80;
/// Centers that are looked at to place a cut.
const MAX_SAMPLES: usize = 32;
/// A tree is not cut deeper.
const MAX_DEPTH: u32 = 40;

/// A place in the tree.
#[derive(Clone, Copy, Debug)]
enum Node {
    /// The low side is node `low`, the high side the one after it.
    Split { axis: u8, at: f32, low: u32 },
    /// Index of a cell.
    Cell(u32),
}

/// A box and whose it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub fat: FatBox,
    pub handle: u32,
}

/// Boxes that reach one region, and their handles, in no order.
#[derive(Clone, Debug)]
struct Cell {
    region: FatBox,
    boxes: Vec<FatBox>,
    handles: Vec<u32>,
    /// It is cut when it holds more: more than [`CELL_CAPACITY`] where that was tried in vain.
    limit: usize,
    depth: u32,
}

/// The tree and its cells.
#[derive(Clone, Debug, Default)]
pub(super) struct Cells {
    nodes: Vec<Node>,
    cells: Vec<Cell>,
    /// Cells when it was built; those cut since.
    built: usize,
    splits: usize,
    /// A cell of each box, by handle; a hint.
    cell_hints: Vec<u32>,
    /// Working memory.
    buffer: Vec<Entry>,
    places: Vec<(u32, bool, bool)>,
}

impl Cells {
    /// Files all boxes anew, and adds all pairs of them.
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

    /// A cell where a box was last seen: boxes that are refiled in this order meet cells that others have just met.
    pub fn cell_hint(&self, handle: u32) -> u32 {
        self.cell_hints.get(handle as usize).copied().unwrap_or(0)
    }

    /// Whether so many cells were cut one by one that the tree may lean.
    pub fn needs_rebuild(&self) -> bool {
        self.splits > self.built / 2 + 8
    }

    /// Files one box anew, that was `old`, and tells every other that it meets.
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

    /// Cuts a cell that has grown too full, where it stands.
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

    /// Makes of a node whatever suits the boxes of `buffer` from `from` on, what lies before is not touched; and shows every new cell.
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
    /// Forgets a box that `was_here` here, tells whom the new one meets here, and takes that in.
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

    /// All pairs of a cell of these boxes, which are sorted for it.
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

/// Whether the least corner of what two boxes share lies in a region (its high sides do not count, but where they are infinite).
fn owns_pair(region: &FatBox, a: &FatBox, b: &FatBox) -> bool {
    (0..3).all(|k| {
        let corner = a.min(k).max(b.min(k));
        corner >= region.min(k) && (corner < region.max(k) || region.max(k) == f32::INFINITY)
    })
}

/// An axis and a place on it that part the boxes well: the median of a sample of their centers, on the widest axis where that is worth it.
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

/// How far apart the centers are, and on which axis; the widest first.
fn axes(entries: &[Entry]) -> [(f32, usize); 3] {
    let mut widths = [0, 1, 2].map(|axis| {
        let bounds = |(low, high): (f32, f32), x: f32| (low.min(x), high.max(x));
        let (low, high) = sample(entries, axis).fold((f32::INFINITY, f32::NEG_INFINITY), bounds);
        (high - low, axis)
    });
    widths.sort_by(|a, b| b.0.total_cmp(&a.0));
    widths
}

/// Centers of up to [`MAX_SAMPLES`] boxes, evenly from the list; without those of unbounded ones.
fn sample(entries: &[Entry], axis: usize) -> impl Iterator<Item = f32> {
    let every = entries.len().div_ceil(MAX_SAMPLES).max(1);
    entries.iter().step_by(every).map(move |e| 0.5 * e.fat.min(axis) + 0.5 * e.fat.max(axis)).filter(|x| x.is_finite())
}
