//! A tree of boxes (BVH) that finds the boxes along a ray, near ones first.
//!
//! Nodes have up to four children, whose boxes are tested together. The build splits by the surface
//! area heuristic in bins (Wald, *On fast construction of SAH-based bounding volume hierarchies*,
//! 2007). The test is that of slabs (Kay and Kajiya, 1986).
//!
//! Boxes are stored in single precision about the center of the tree, each grown by `GROWTH` of the
//! tree's half size `R`. A ray is cut off at the tree's own box in double precision first, so all
//! its coordinates there are at most `R` and all distances at most `4 R`. Rounding of the plane,
//! the origin, their difference and the product changes an entry along one axis by less than `8 R
//! 2⁻²⁴/|d|`. The growth moves it by `32 R 2⁻²⁴/|d|`. Therefore no box that a ray meets is skipped.

use crate::{Aabb, Vec3};

/// Maximum number of boxes of a leaf.
const LEAF: usize = 4;
/// Number of bins of a split.
const BINS: usize = 12;
/// Growth of a box, as a fraction of the half size of the tree: 32 units of rounding.
const GROWTH: f64 = 32.0 / (1u64 << 24) as f64;
/// Smallest component of a direction; smaller ones have no effect within the tree.
const LEAST: f64 = 1e-18;
/// Marks a child that is a leaf.
const IS_LEAF: u32 = 1 << 31;
/// Marks a child that is missing.
const NONE: u32 = u32::MAX;
/// Number of bits of the first slot of a leaf.
const SLOT_BITS: u32 = 28;
/// Size of the stack of a search: three siblings on each of at most 64 levels.
const STACK: usize = 3 * MAX_DEPTH + 1;
/// Maximum number of levels by the heuristic; deeper nodes are halved by count.
const MAX_DEPTH: usize = 64;

/// Boxes in a tree. Finite boxes only; at most 2²⁸.
#[derive(Clone, Debug, Default)]
pub struct BoxTree {
    /// Box around all, meters, grown.
    bounds: Option<Aabb>,
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// Four children.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Planes of the children's boxes about the center of the tree: least and greatest x, y, z.
    planes: [[f32; 4]; 6],
    /// Index of a node, or a leaf: the first slot and the number of further ones.
    children: [u32; 4],
}

/// A range of the items of a build, with the box around it.
#[derive(Clone, Copy)]
struct Span {
    first: usize,
    len: usize,
    bounds: Aabb,
}

struct Builder<'a> {
    boxes: &'a [Aabb],
    centers: Vec<Vec3>,
    order: Vec<u32>,
    nodes: Vec<Node>,
    middle: Vec3,
    growth: f64,
}

impl BoxTree {
    /// Builds the tree of finite boxes.
    pub fn new(boxes: &[Aabb]) -> BoxTree {
        let Some(bounds) = boxes.iter().copied().reduce(|a, b| union(&a, &b)) else { return BoxTree::default() };
        let growth = GROWTH * (0.5 * (bounds.max - bounds.min)).amax().max(f64::MIN_POSITIVE);
        let mut builder = Builder {
            boxes,
            centers: boxes.iter().map(|b| 0.5 * (b.min + b.max)).collect(),
            order: (0..boxes.len() as u32).collect(),
            nodes: Vec::with_capacity(boxes.len() / 4 + 1),
            middle: 0.5 * (bounds.min + bounds.max),
            growth,
        };
        builder.node(Span { first: 0, len: boxes.len(), bounds }, 0);
        BoxTree { bounds: Some(bounds.grown(2.0 * growth)), nodes: builder.nodes, order: builder.order }
    }

    /// Returns the boxes' indices in the order of the slots: boxes that are near each other have
    /// near slots.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Returns a box around all boxes, slightly larger; `None` for an empty tree.
    pub fn bounds(&self) -> Option<&Aabb> {
        self.bounds.as_ref()
    }

    /// Calls `visit` with the slot of every box that a ray from `origin` along the unit vector
    /// `direction` meets within `max` meters, near ones first up to the order within a node.
    /// `visit` receives the present limit and may shorten it.
    pub fn visit_along(&self, origin: &Vec3, direction: &Vec3, max: &mut f64, mut visit: impl FnMut(usize, &mut f64)) {
        let Some(bounds) = &self.bounds else { return };
        let d = direction.map(|x| if x.abs() < LEAST { LEAST.copysign(x) } else { x });
        let inverse = d.map(|x| 1.0 / x);
        let Some(enter) = entry(bounds, origin, &inverse, *max) else { return };
        let middle = 0.5 * (bounds.min + bounds.max);
        let start = (origin - middle) + d * enter;
        let (o, inv) = (start.map(|x| x as f32), inverse.map(|x| x as f32));
        let near: [usize; 3] = std::array::from_fn(|k| 2 * k + usize::from(d[k] < 0.0));
        let limit_of = |max: f64| (max - enter) as f32 * (1.0 + 1e-6);
        let mut limit = limit_of(*max);
        let mut stack = [(0.0f32, 0u32); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (at, child) = stack[top];
            if at > limit {
                continue;
            }
            if child & IS_LEAF != 0 {
                let first = (child & ((1 << SLOT_BITS) - 1)) as usize;
                let count = ((child & !IS_LEAF) >> SLOT_BITS) as usize + 1;
                for slot in first..first + count {
                    visit(slot, max);
                }
                limit = limit_of(*max);
                continue;
            }
            let node = &self.nodes[child as usize];
            let (enters, met) = node.test(&o, &inv, &near, limit);
            let pushed = top;
            for k in 0..4 {
                if met[k] {
                    // insertion by descending distance: the nearest child is on top
                    let mut place = top;
                    while place > pushed && stack[place - 1].0 < enters[k] {
                        stack[place] = stack[place - 1];
                        place -= 1;
                    }
                    stack[place] = (enters[k], node.children[k]);
                    top += 1;
                }
            }
        }
    }
}

/// Returns the distance at which a ray enters a box, at least 0; `None` if it misses it within
/// `max`.
fn entry(b: &Aabb, origin: &Vec3, inverse: &Vec3, max: f64) -> Option<f64> {
    let (mut enter, mut leave) = (0.0f64, max);
    for k in 0..3 {
        let (s, t) = ((b.min[k] - origin[k]) * inverse[k], (b.max[k] - origin[k]) * inverse[k]);
        enter = enter.max(s.min(t));
        leave = leave.min(s.max(t));
    }
    (enter <= leave * (1.0 + 1e-12)).then_some(enter)
}

impl Node {
    /// Returns where the ray enters each child's box, and whether it does so within `limit`.
    #[inline]
    fn test(
        &self,
        o: &nalgebra::Vector3<f32>,
        inverse: &nalgebra::Vector3<f32>,
        near: &[usize; 3],
        limit: f32,
    ) -> ([f32; 4], [bool; 4]) {
        let (mut enter, mut leave) = ([0.0f32; 4], [limit; 4]);
        for axis in 0..3 {
            let (low, high) = (&self.planes[near[axis]], &self.planes[near[axis] ^ 1]);
            let (o, inverse) = (o[axis], inverse[axis]);
            for k in 0..4 {
                let (s, t) = ((low[k] - o) * inverse, (high[k] - o) * inverse);
                enter[k] = if s > enter[k] { s } else { enter[k] };
                leave[k] = if t < leave[k] { t } else { leave[k] };
            }
        }
        (enter, std::array::from_fn(|k| enter[k] <= leave[k]))
    }
}

impl Builder<'_> {
    /// Makes the node of a span and those below it. Returns its index.
    fn node(&mut self, span: Span, depth: usize) -> u32 {
        let mut spans = arrayvec::ArrayVec::<Span, 4>::new();
        spans.push(span);
        while spans.len() < 4 {
            // the largest one that is no leaf is split
            let weight = |s: &Span| if s.len > LEAF { area(&s.bounds) } else { -1.0 };
            let Some(k) = (0..spans.len()).max_by(|&i, &j| weight(&spans[i]).total_cmp(&weight(&spans[j]))) else {
                break;
            };
            if spans[k].len <= LEAF {
                break;
            }
            let [left, right] = self.split(&spans[k], depth);
            spans[k] = left;
            spans.push(right);
        }
        let index = self.nodes.len();
        self.nodes.push(Node { planes: [[f32::MAX; 4]; 6], children: [NONE; 4] });
        for (k, child) in spans.iter().enumerate() {
            let b = child.bounds.grown(self.growth);
            let (low, high) = (b.min - self.middle, b.max - self.middle);
            for axis in 0..3 {
                self.nodes[index].planes[2 * axis][k] = low[axis] as f32;
                self.nodes[index].planes[2 * axis + 1][k] = high[axis] as f32;
            }
            let reference = match child.len <= LEAF {
                true => IS_LEAF | ((child.len as u32 - 1) << SLOT_BITS) | child.first as u32,
                false => self.node(*child, depth + 1),
            };
            self.nodes[index].children[k] = reference;
        }
        for k in spans.len()..4 {
            // an empty box: the near planes lie behind the far ones in any direction
            for axis in 0..3 {
                self.nodes[index].planes[2 * axis][k] = f32::MAX;
                self.nodes[index].planes[2 * axis + 1][k] = f32::MIN;
            }
        }
        index as u32
    }

    /// Divides a span of more than one item: at the cheapest plane between bins, or by count.
    fn split(&mut self, span: &Span, depth: usize) -> [Span; 2] {
        let items = span.first..span.first + span.len;
        let around = Aabb::around(self.order[items.clone()].iter().map(|&i| self.centers[i as usize]));
        let extent = around.max - around.min;
        let axis = extent.imax();
        let mut cut = None;
        if extent[axis] > 0.0 && depth < MAX_DEPTH / 2 {
            let scale = BINS as f64 / extent[axis];
            let bin = |c: &Vec3| (((c[axis] - around.min[axis]) * scale) as usize).min(BINS - 1);
            let empty = Aabb::around([]);
            let mut bins = [(empty, 0usize); BINS];
            for &i in &self.order[items.clone()] {
                let entry = &mut bins[bin(&self.centers[i as usize])];
                *entry = (union(&entry.0, &self.boxes[i as usize]), entry.1 + 1);
            }
            let mut right = [(empty, 0usize); BINS];
            let mut sum = (empty, 0);
            for k in (1..BINS).rev() {
                sum = (union(&sum.0, &bins[k].0), sum.1 + bins[k].1);
                right[k] = sum;
            }
            let (mut left, mut best) = ((empty, 0), f64::INFINITY);
            for k in 1..BINS {
                left = (union(&left.0, &bins[k - 1].0), left.1 + bins[k - 1].1);
                if left.1 == 0 || right[k].1 == 0 {
                    continue;
                }
                let cost = area(&left.0) * left.1 as f64 + area(&right[k].0) * right[k].1 as f64;
                if cost < best {
                    best = cost;
                    cut = Some((k, left.1));
                }
            }
            if let Some((k, count)) = cut {
                // a stable partition, so that the order depends on the input alone
                let (before, after): (Vec<u32>, Vec<u32>) =
                    self.order[items.clone()].iter().partition(|&&i| bin(&self.centers[i as usize]) < k);
                debug_assert_eq!(before.len(), count);
                self.order[items.clone()].copy_from_slice(&[before, after].concat());
            }
        }
        let left = cut.map_or_else(
            || {
                let centers = &self.centers;
                let key = |&i: &u32| centers[i as usize][axis];
                self.order[items.clone()].sort_by(|a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
                span.len / 2
            },
            |(_, count)| count,
        );
        [(span.first, left), (span.first + left, span.len - left)].map(|(first, len)| {
            let boxes = self.order[first..first + len].iter().map(|&i| self.boxes[i as usize]);
            Span { first, len, bounds: boxes.reduce(|a, b| union(&a, &b)).unwrap_or(span.bounds) }
        })
    }
}

fn union(a: &Aabb, b: &Aabb) -> Aabb {
    Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) }
}

/// Returns half the surface of a box.
fn area(b: &Aabb) -> f64 {
    let e = b.max - b.min;
    e.x * e.y + e.y * e.z + e.z * e.x
}
