//! Sweep and prune along one axis, with temporal coherence.
//!
//! Boxes are kept sorted by their least coordinate on one axis. Between two steps the order barely changes,
//! so an insertion sort of the old order is near O(n). A sweep in that order meets each box's successors
//! until one begins beyond its end. Source: Baraff, *Dynamic Simulation of Non-Penetrating Rigid Bodies* (1992), §6;
//! Cohen et al., *I-COLLIDE* (1995). Departures: one axis only; unbounded boxes are kept aside, since
//! they would overlap everything on the axis.

use super::BroadPhase;
use crate::Aabb;

/// Sorted-axis broad phase. What it remembers changes its speed only, never its answer.
#[derive(Clone, Debug, Default)]
pub struct SweepAndPrune {
    /// Bounded boxes, ascending by `min[axis]` at the last call.
    order: Vec<u32>,
    /// Boxes with an infinite side.
    unbounded: Vec<u32>,
    axis: usize,
    calls: u32,
}

/// The axis is chosen anew once in so many calls.
const AXIS_PERIOD: u32 = 64;

impl BroadPhase for SweepAndPrune {
    fn pairs(&mut self, boxes: &[Aabb], moving: &[bool], out: &mut Vec<[u32; 2]>) {
        out.clear();
        self.update_members(boxes);
        self.update_axis(boxes);
        self.sort(boxes);
        self.sweep(boxes, moving, out);
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

    /// Insertion sort: linear when the order is nearly right.
    fn sort(&mut self, boxes: &[Aabb]) {
        let axis = self.axis;
        let key = |i: u32| boxes[i as usize].min[axis];
        for n in 1..self.order.len() {
            let (item, mut hole) = (self.order[n], n);
            while hole > 0 && key(self.order[hole - 1]) > key(item) {
                self.order[hole] = self.order[hole - 1];
                hole -= 1;
            }
            self.order[hole] = item;
        }
    }

    fn sweep(&self, boxes: &[Aabb], moving: &[bool], out: &mut Vec<[u32; 2]>) {
        for (n, &i) in self.order.iter().enumerate() {
            let end = boxes[i as usize].max[self.axis];
            for &j in &self.order[n + 1..] {
                if boxes[j as usize].min[self.axis] > end {
                    break;
                }
                push_if_overlapping(boxes, moving, i, j, out);
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
    let mean = centers().sum::<crate::Vec3>() / n;
    let variance = centers().map(|c| (c - mean).component_mul(&(c - mean))).sum::<crate::Vec3>();
    (0..3).fold(0, |best, k| if variance[k] > variance[best] { k } else { best })
}
