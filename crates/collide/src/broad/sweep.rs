//! Sweep and prune that uses coherence: what has not moved much is not looked at again.
//!
//! | list | holds | changes |
//! |---|---|---|
//! | `tight` | the boxes as they were given, and `rounded` the same in short | when they are set |
//! | `fat` | each box with some room around it | when the box has left it |
//! | `cells` | space in cells, each with the fat boxes that reach it ([`Cells`]) | with the fat boxes |
//! | `near` | the pairs of fat boxes that overlap | with the fat boxes |
//!
//! Every pair of boxes that overlap is a pair of fat boxes that do, so the answer is `near`, each pair compared by its tight boxes: linear
//! in the boxes that are set and in what is near. A box that left its fat box is filed anew, and meets what lies in its cells.
//! If many have, all cells are made anew and swept: near O(n) too, as a cell holds a few dozen boxes.
//!
//! Boxes that are not set cost nothing. What is remembered changes the speed alone, never the answer.
//! Sources: Baraff, *Dynamic Simulation of Non-Penetrating Rigid Bodies* (1992), §6, for coherence; fat boxes go back to Verlet's neighbour lists (1967).

use super::cells::{Cells, Entry};
use super::fat::{Fat, Guess, Rounded, pair};
use super::{BroadPhase, NOWHERE, proper};
use crate::Aabb;

/// Room of a fat box in every direction, as a share of the box's smallest extent.
const ROOM: f64 = 0.1;
/// Everything is filed anew when one box in so many has left its fat box.
const CROWD: usize = 4;

/// The default broad phase.
#[derive(Clone, Debug, Default)]
pub struct SweepAndPrune {
    tight: Vec<Aabb>,
    rounded: Vec<Rounded>,
    fat: Vec<Fat>,
    state: Vec<State>,
    /// Boxes to be filed anew.
    changed: Vec<u32>,
    /// Handles that no box has, and how many boxes there are.
    free: Vec<u32>,
    count: usize,
    cells: Cells,
    /// Ascending, as [`pair`] writes them.
    near: Vec<u64>,
    /// Working memory.
    fresh: Vec<u64>,
}

/// What else is known of a handle.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    taken: bool,
    moving: bool,
    /// It is among those changed.
    changed: bool,
}

impl BroadPhase for SweepAndPrune {
    fn insert(&mut self, bounds: &Aabb, moving: bool) -> u32 {
        let handle = self.free.pop().unwrap_or_else(|| {
            self.tight.push(NOWHERE);
            self.rounded.push(Rounded::new(&NOWHERE));
            self.fat.push(Fat::NOWHERE);
            self.state.push(State::default());
            self.tight.len() as u32 - 1
        });
        self.count += 1;
        self.state[handle as usize].taken = true;
        self.set(handle, bounds, moving);
        handle
    }

    fn set(&mut self, handle: u32, bounds: &Aabb, moving: bool) {
        let i = handle as usize;
        let Some(state) = self.state.get_mut(i).filter(|s| s.taken) else { return };
        self.tight[i] = proper(bounds);
        self.rounded[i] = Rounded::new(&self.tight[i]);
        if !state.changed && (state.moving != moving || !self.fat[i].holds(&self.tight[i])) {
            state.changed = true;
            self.changed.push(handle);
        }
        state.moving = moving;
    }

    fn remove(&mut self, handle: u32) {
        let i = handle as usize;
        let Some(state) = self.state.get_mut(i).filter(|s| s.taken) else { return };
        if !state.changed {
            self.changed.push(handle);
        }
        *state = State { taken: false, moving: false, changed: true };
        self.tight[i] = NOWHERE;
        self.rounded[i] = Rounded::new(&NOWHERE);
        self.free.push(handle);
        self.count -= 1;
    }

    fn pairs(&mut self, out: &mut Vec<[u32; 2]>) {
        if CROWD * self.changed.len() > self.count || self.cells.is_worn() {
            self.file_all();
        } else if !self.changed.is_empty() {
            self.file_changed();
        }
        self.compare(out);
    }
}

impl SweepAndPrune {
    /// Fat boxes, cells and near pairs of everything.
    fn file_all(&mut self) {
        self.changed.clear();
        self.state.iter_mut().for_each(|s| s.changed = false);
        for ((fat, tight), state) in self.fat.iter_mut().zip(&self.tight).zip(&self.state) {
            *fat = Fat::around(tight, ROOM, state.moving, fat);
        }
        let entries = self.fat.iter().enumerate().map(|(i, fat)| Entry { fat: *fat, handle: i as u32 });
        self.near.clear();
        self.cells.build(entries, &mut self.near);
        self.near.sort_unstable();
    }

    /// The near pairs that overlap indeed. Every pair is written and only then counted or not: whether they do is anybody's guess.
    fn compare(&self, out: &mut Vec<[u32; 2]>) {
        out.clear();
        out.resize(self.near.len(), [0; 2]);
        let mut count = 0;
        for pair in &self.near {
            let [i, j] = [(pair >> 32) as u32, *pair as u32];
            out[count] = [i, j];
            let (a, b) = (&self.rounded[i as usize], &self.rounded[j as usize]);
            let overlap = match a.overlaps(b) {
                Guess::Perhaps => self.tight[i as usize].overlaps(&self.tight[j as usize]),
                guess => guess == Guess::Yes,
            };
            count += usize::from(overlap);
        }
        out.truncate(count);
    }

    /// The same, where only the changed boxes have to be looked at. A box is told of those that were filed before it.
    fn file_changed(&mut self) {
        let SweepAndPrune { tight, fat, state, changed, cells, near, fresh, .. } = self;
        let mut count = 0;
        for n in 0..near.len() {
            let pair = near[n];
            near[count] = pair;
            count += usize::from(!(state[(pair >> 32) as usize].changed | state[pair as u32 as usize].changed));
        }
        near.truncate(count);
        fresh.clear();
        changed.sort_unstable_by_key(|&handle| (cells.home(handle), handle));
        for &handle in changed.iter() {
            let i = handle as usize;
            let old = fat[i];
            fat[i] = Fat::around(&tight[i], ROOM, state[i].moving, &old);
            state[i].changed = false;
            cells.refile(handle, &old, &fat[i], |other| {
                if !state[other as usize].changed {
                    fresh.push(pair(handle, other));
                }
            });
        }
        changed.clear();
        fresh.sort_unstable();
        merge(near, fresh);
    }
}

/// Works `fresh` into `list`; both ascend.
fn merge(list: &mut Vec<u64>, fresh: &[u64]) {
    let mut from = list.len();
    list.resize(list.len() + fresh.len(), 0);
    let mut to = list.len();
    for &pair in fresh.iter().rev() {
        while from > 0 && list[from - 1] > pair {
            (from, to) = (from - 1, to - 1);
            list[to] = list[from];
        }
        to -= 1;
        list[to] = pair;
    }
}
