//! Sweep and prune with temporal coherence: boxes that moved little are not processed again.
//!
//! | list | content | updated |
//! |---|---|---|
//! | `tight` | the boxes as given, and `rounded` in single precision | on every `set` |
//! | `fat` | each box with a margin | if the box left it |
//! | `cells` | space in cells, each with the fat boxes that intersect it ([`Cells`]) | with the fat boxes |
//! | `candidates` | the overlapping pairs of fat boxes | with the fat boxes |
//!
//! If two boxes overlap, their fat boxes do. So the result is the candidates whose tight boxes
//! overlap: linear in the number of set boxes and of candidates. A box that left its fat box is
//! stored again and compared with the boxes of its cells. If many have, all cells are rebuilt and
//! swept: nearly O(n), as a cell holds a few dozen boxes.
//!
//! Boxes that are not set cost nothing. The stored state affects the speed only, never the result.
//! Sources: Baraff, *Dynamic Simulation of Non-Penetrating Rigid Bodies* (1992), §6, for coherence;
//! fat boxes go back to Verlet's neighbor lists (1967).

use super::cells::{Cells, Entry};
use super::fat::{FatBox, Rounded, RoundedOverlap, pair};
use super::{BroadPhase, EMPTY, sanitized};
use crate::Aabb;

/// Least and largest margin of a fat box in every direction, as fractions of the box's smallest extent.
const MARGINS: [f64; 2] = [0.1, 1.0];
/// Number of displacements, as that between the last two boxes, that a margin takes.
const DISPLACEMENTS: f64 = 3.0;
/// All boxes are processed again if more than one in this number left its fat box.
const REBUILD_DIVISOR: usize = 4;

/// The default broad phase.
#[derive(Clone, Debug, Default)]
pub struct SweepAndPrune {
    tight: Vec<Aabb>,
    rounded: Vec<Rounded>,
    fat: Vec<FatBox>,
    /// Largest displacement of the center along an axis in the last `set`, m.
    displaced: Vec<f64>,
    state: Vec<State>,
    /// Boxes to store again.
    changed: Vec<u32>,
    /// Unused handles, and the number of boxes.
    free: Vec<u32>,
    count: usize,
    cells: Cells,
    /// Ascending, encoded by [`pair`].
    candidates: Vec<u64>,
    /// Scratch memory.
    new_pairs: Vec<u64>,
}

/// State of a handle.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    in_use: bool,
    moving: bool,
    /// Whether the box is in `changed`.
    changed: bool,
}

impl BroadPhase for SweepAndPrune {
    fn insert(&mut self, bounds: &Aabb, moving: bool) -> u32 {
        let handle = self.free.pop().unwrap_or_else(|| {
            self.tight.push(EMPTY);
            self.rounded.push(Rounded::new(&EMPTY));
            self.fat.push(FatBox::EMPTY);
            self.displaced.push(0.0);
            self.state.push(State::default());
            self.tight.len() as u32 - 1
        });
        self.count += 1;
        self.state[handle as usize].in_use = true;
        self.set(handle, bounds, moving);
        handle
    }

    fn set(&mut self, handle: u32, bounds: &Aabb, moving: bool) {
        let i = handle as usize;
        let Some(state) = self.state.get_mut(i).filter(|s| s.in_use) else { return };
        let before = std::mem::replace(&mut self.tight[i], sanitized(bounds));
        self.displaced[i] = displacement(&before, &self.tight[i]);
        self.rounded[i] = Rounded::new(&self.tight[i]);
        if !state.changed && (state.moving != moving || !self.fat[i].contains(&self.tight[i])) {
            state.changed = true;
            self.changed.push(handle);
        }
        state.moving = moving;
    }

    fn remove(&mut self, handle: u32) {
        let i = handle as usize;
        let Some(state) = self.state.get_mut(i).filter(|s| s.in_use) else { return };
        if !state.changed {
            self.changed.push(handle);
        }
        *state = State { in_use: false, moving: false, changed: true };
        self.tight[i] = EMPTY;
        self.rounded[i] = Rounded::new(&EMPTY);
        self.free.push(handle);
        self.count -= 1;
    }

    fn pairs(&mut self, out: &mut Vec<[u32; 2]>) {
        if REBUILD_DIVISOR * self.changed.len() > self.count || self.cells.needs_rebuild() {
            self.rebuild();
        } else if !self.changed.is_empty() {
            self.update_changed();
        }
        self.compare(out);
    }
}

impl SweepAndPrune {
    /// Rebuilds fat boxes, cells and candidates.
    fn rebuild(&mut self) {
        self.changed.clear();
        self.state.iter_mut().for_each(|s| s.changed = false);
        let boxes = self.fat.iter_mut().zip(&self.tight).zip(&self.displaced).zip(&self.state);
        for (((fat, tight), displaced), state) in boxes {
            *fat = FatBox::around(tight, margin(tight, *displaced), state.moving, fat);
        }
        let entries = self.fat.iter().enumerate().map(|(i, fat)| Entry { fat: *fat, handle: i as u32 });
        self.candidates.clear();
        self.cells.build(entries, &mut self.candidates);
        self.candidates.sort_unstable();
    }

    /// Writes the candidates whose boxes overlap. Every pair is written and counted only if it
    /// overlaps, as the outcome is unpredictable for a branch.
    fn compare(&self, out: &mut Vec<[u32; 2]>) {
        out.clear();
        out.resize(self.candidates.len(), [0; 2]);
        let mut count = 0;
        for pair in &self.candidates {
            let [i, j] = [(pair >> 32) as u32, *pair as u32];
            out[count] = [i, j];
            let (a, b) = (&self.rounded[i as usize], &self.rounded[j as usize]);
            let overlap = match a.overlaps(b) {
                RoundedOverlap::Uncertain => self.tight[i as usize].overlaps(&self.tight[j as usize]),
                overlap => overlap == RoundedOverlap::Yes,
            };
            count += usize::from(overlap);
        }
        out.truncate(count);
    }

    /// Updates the candidates of the changed boxes only. A box is compared with those stored before
    /// it.
    fn update_changed(&mut self) {
        let SweepAndPrune { tight, fat, displaced, state, changed, cells, candidates, new_pairs, .. } = self;
        let mut count = 0;
        for n in 0..candidates.len() {
            let pair = candidates[n];
            candidates[count] = pair;
            count += usize::from(!(state[(pair >> 32) as usize].changed | state[pair as u32 as usize].changed));
        }
        candidates.truncate(count);
        new_pairs.clear();
        changed.sort_unstable_by_key(|&handle| (cells.cell_hint(handle), handle));
        for &handle in changed.iter() {
            let i = handle as usize;
            let old = fat[i];
            fat[i] = FatBox::around(&tight[i], margin(&tight[i], displaced[i]), state[i].moving, &old);
            state[i].changed = false;
            cells.update(handle, &old, &fat[i], |other| {
                if !state[other as usize].changed {
                    new_pairs.push(pair(handle, other));
                }
            });
        }
        changed.clear();
        new_pairs.sort_unstable();
        merge(candidates, new_pairs);
    }
}

/// Returns the margin of a box whose center moves by `displaced` from step to step, m: fast boxes stay in their fat
/// boxes for some steps too.
fn margin(tight: &Aabb, displaced: f64) -> f64 {
    let extent = tight.max - tight.min;
    let smallest = extent.x.min(extent.y).min(extent.z);
    let [least, most] = MARGINS.map(|share| share * smallest);
    if smallest.is_finite() { (DISPLACEMENTS * displaced).min(most).max(least) } else { 0.0 }
}

/// Returns the largest displacement of the center along an axis, m; 0 if there is none.
fn displacement(before: &Aabb, now: &Aabb) -> f64 {
    let twice = (before.min + before.max) - (now.min + now.max);
    let largest = 0.5 * twice.amax();
    if largest.is_finite() { largest } else { 0.0 }
}

/// Merges `new_pairs` into `list`; both are ascending.
fn merge(list: &mut Vec<u64>, new_pairs: &[u64]) {
    let mut from = list.len();
    list.resize(list.len() + new_pairs.len(), 0);
    let mut to = list.len();
    for &pair in new_pairs.iter().rev() {
        while from > 0 && list[from - 1] > pair {
            (from, to) = (from - 1, to - 1);
            list[to] = list[from];
        }
        to -= 1;
        list[to] = pair;
    }
}
