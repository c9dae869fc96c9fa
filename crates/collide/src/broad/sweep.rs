//! Sweep and prune along one axis, with temporal coherence.
//!
//! Boxes are kept sorted by their least coordinate on one axis. Between two steps the order barely changes,
//! so an insertion sort of the old order is near O(n). A sweep in that order meets each box's successors
//! until one begins beyond its end. Source: Baraff, *Dynamic Simulation of Non-Penetrating Rigid Bodies* (1992), §6;
//! Cohen et al., *I-COLLIDE* (1995). Departures: one axis only; unbounded boxes are kept aside, since
//! they would overlap everything on the axis.

use super::BroadPhase;
use crate::{Aabb, Vec3};

/// Sorted-axis broad phase. What it remembers changes its speed only, never its answer.
#[derive(Clone, Debug, Default)]
pub struct SweepAndPrune {
    /// Bounded boxes, ascending by `min[axis]` at the last call.
    order: Vec<u32>,
    /// Boxes with an infinite side.
    unbounded: Vec<u32>,
    axis: usize,
    calls: u32,
    /// This call's bounded boxes in that order, side by side in memory: the sweep reads nothing else.
    sorted: Vec<Entry>,
}

/// A bounded box, the sweep's axis first, and whose it is.
#[derive(Clone, Copy, Debug)]
struct Entry {
    min: [f64; 3],
    max: [f64; 3],
    index: u32,
    moving: bool,
}

impl Entry {
    fn new(bounds: &Aabb, axis: usize, index: u32, moving: bool) -> Entry {
        let turned = |v: &Vec3| [v[axis], v[(axis + 1) % 3], v[(axis + 2) % 3]];
        Entry { min: turned(&bounds.min), max: turned(&bounds.max), index, moving }
    }

    /// On the two axes that are not swept; `&`, not `&&`: four comparisons cost less than one branch that is guessed
    /// wrong.
    fn overlaps_across(&self, other: &Entry) -> bool {
        (self.min[1] <= other.max[1])
            & (other.min[1] <= self.max[1])
            & (self.min[2] <= other.max[2])
            & (other.min[2] <= self.max[2])
    }
}

/// The axis is chosen anew once in so many calls.
const AXIS_PERIOD: u32 = 64;

impl BroadPhase for SweepAndPrune {
    fn pairs(&mut self, boxes: &[Aabb], moving: &[bool], out: &mut Vec<[u32; 2]>) {
        out.clear();
        self.update_members(boxes);
        self.update_axis(boxes);
        self.sort(boxes, moving);
        self.sweep(out);
        self.meet_unbounded(boxes, moving, out);
        out.sort_unstable();
    }
}

impl SweepAndPrune {
    /// Drops boxes that are gone or became unbounded, appends those that are new.
    fn update_members(&mut self, boxes: &[Aabb]) {
        let bounded = |i: u32| boxes.get(i as usize).is_some_and(is_bounded);
        self.order.retain(|&i| bounded(i));
        self.unbounded.clear();
        self.unbounded.extend((0..boxes.len() as u32).filter(|&i| !bounded(i)));
        if self.order.len() + self.unbounded.len() != boxes.len() {
            self.order.clear();
            self.order.extend((0..boxes.len() as u32).filter(|&i| bounded(i)));
            self.calls = 0;
        }
    }

    /// Sweeps along the axis on which the centres are spread most.
    fn update_axis(&mut self, boxes: &[Aabb]) {
        if self.calls.is_multiple_of(AXIS_PERIOD) {
            let best = widest_axis(boxes, &self.order);
            if best != self.axis || self.calls == 0 {
                self.axis = best;
                self.order.sort_by(|&i, &j| boxes[i as usize].min[best].total_cmp(&boxes[j as usize].min[best]));
            }
        }
        self.calls = self.calls % AXIS_PERIOD + 1;
    }

    /// Insertion sort of the old order: linear when it is nearly right.
    fn sort(&mut self, boxes: &[Aabb], moving: &[bool]) {
        let (axis, sorted) = (self.axis, &mut self.sorted);
        sorted.clear();
        sorted.extend(self.order.iter().map(|&i| Entry::new(&boxes[i as usize], axis, i, moving[i as usize])));
        for n in 1..sorted.len() {
            let (item, mut hole) = (sorted[n], n);
            while hole > 0 && sorted[hole - 1].min[0] > item.min[0] {
                sorted[hole] = sorted[hole - 1];
                hole -= 1;
            }
            sorted[hole] = item;
        }
        self.order.iter_mut().zip(sorted).for_each(|(i, entry)| *i = entry.index);
    }

    fn sweep(&self, out: &mut Vec<[u32; 2]>) {
        for (n, a) in self.sorted.iter().enumerate() {
            for b in self.sorted[n + 1..].iter().take_while(|b| b.min[0] <= a.max[0]) {
                if a.overlaps_across(b) & (a.moving | b.moving) {
                    out.push([a.index.min(b.index), a.index.max(b.index)]);
                }
            }
        }
    }

    fn meet_unbounded(&self, boxes: &[Aabb], moving: &[bool], out: &mut Vec<[u32; 2]>) {
        for (n, &i) in self.unbounded.iter().enumerate() {
            self.order.iter().for_each(|&j| push_if_overlapping(boxes, moving, i, j, out));
            self.unbounded[n + 1..].iter().for_each(|&j| push_if_overlapping(boxes, moving, i, j, out));
        }
    }
}

fn is_bounded(b: &Aabb) -> bool {
    (0..3).all(|k| b.min[k].is_finite() && b.max[k].is_finite())
}

fn push_if_overlapping(boxes: &[Aabb], moving: &[bool], i: u32, j: u32, out: &mut Vec<[u32; 2]>) {
    let (a, b) = (i as usize, j as usize);
    if (moving[a] || moving[b]) && boxes[a].overlaps(&boxes[b]) {
        out.push([i.min(j), i.max(j)]);
    }
}

/// The axis with the greatest variance of the boxes' centres (twice the centre, the factor does not matter).
fn widest_axis(boxes: &[Aabb], order: &[u32]) -> usize {
    let n = order.len().max(1) as f64;
    let centers = || order.iter().map(|&i| boxes[i as usize].min + boxes[i as usize].max);
    let mean = centers().sum::<Vec3>() / n;
    let variance = centers().map(|c| (c - mean).component_mul(&(c - mean))).sum::<Vec3>();
    (0..3).fold(0, |best, k| if variance[k] > variance[best] { k } else { best })
}
