//! Fills the octree of a mesh's field.
//!
//! A cell takes over from its parent the triangles that can be closest to a point in it. Those of a cell of centre `c` and half diagonal `r`:
//!
//! ```text
//! d_t(p) ≥ d_t(c) + g_t·(p − c)        the distance from a triangle is convex, its slope at c is g_t
//! d_0(p) ≤ d_0(c) + g_0·(p − c) + e₀   of the closest at c; being convex, it is most above its plane at a corner of the cell
//! t listed     iff  d_t(c) − d_0(c) ≤ e₀ + h·|g_t − g_0|₁
//! outside:     e = max over t of d_0(c) − d_t(c) + h·|g − g_t|₁     so that d(p) ≥ d_c + g·(p − c) − e
//! inside:      −d(p) ≤ d_0(p), so e = e₀ + h·|g + g_0|₁             signs: d_c = −d_0(c)
//! ```
//!
//! A child is told at first all triangles with `d_t(c) ≤ d_0(c) + 2r`, since `|d(p) − d(c)| ≤ |p − c| ≤ r` for each and for all; of those
//! the first line tells which need no look.
//! A cell is divided until its list is short. Far from the surface it may have no list, only the bound.

use super::octree::{Cell, Octree};
use super::{Listed, MeshField};
use crate::Vec3;
use crate::mesh::closest_on_triangle;

/// Lists up to this length are not divided.
const SHORT: usize = 16;
/// At the last level, or far from the surface, lists up to this length are kept.
const LONG: usize = 96;
/// A cell further from the surface than this many half diagonals is not divided, if its list is not too long,
const FAR: f64 = 3.0;
/// or it is further than this, as a part of the diagonal.
const FARTHEST: f64 = 0.06;
/// The outermost cell reaches this far beyond the mesh, as a part of the diagonal.
const RIM: f64 = 0.05;
/// Another way: cosine between the normals below this.
const OTHER_WAY: f64 = 0.5;
/// Cells are divided down to this half diagonal, in mean lengths of an edge.
const FINEST: f64 = 0.6;
/// Divisions at most.
const DEEPEST: f64 = 9.0;
/// Keeps a distance rounded to single precision below it.
const BELOW: f64 = 1.0 - 2e-7;
/// A distance that has a direction in spite of rounding, as a part of the diagonal.
const SOME: f64 = 1e-9;
/// Of single precision in distances and places, and more.
const ROUNDING: f64 = 1e-6;
/// Cells and listed triangles at most; beyond, the tree of boxes answers.
const MOST_CELLS: usize = 1 << 20;
const MOST_LISTED: usize = 1 << 23;

/// A triangle that may count in a cell.
#[derive(Clone, Copy)]
struct Near {
    /// Of the cell's centre.
    distance: f64,
    triangle: u32,
    /// Of the distance at the cell's centre; none on the triangle itself, where the distance is least.
    slope: Vec3,
}

pub(super) struct Builder<'a> {
    field: &'a mut MeshField,
    deepest: u32,
}

/// Fills `field.tree` and `field.lists`.
pub(super) fn build(field: &mut MeshField) {
    let bounds = field.bounds;
    let (center, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min).max() + RIM * field.diagonal);
    field.tree = Octree::new(center, half);
    let lengths: f64 = field.corners.iter().map(|[a, b, _]| (b - a).norm()).sum();
    let mean = lengths / field.corners.len() as f64;
    let deepest = (3.0_f64.sqrt() * half / (FINEST * mean)).log2().ceil().clamp(1.0, DEEPEST) as u32;
    let all: Vec<Near> = (0..field.corners.len() as u32).map(|triangle| Near { distance: 0.0, triangle, slope: Vec3::zeros() }).collect();
    Builder { field, deepest }.cell(0, center, half, &all, &Vec3::zeros(), 0);
    field.tree.finish(deepest);
    field.lists.shrink_to_fit();
}

fn order(a: &Near, b: &Near) -> std::cmp::Ordering {
    a.distance.total_cmp(&b.distance).then(a.triangle.cmp(&b.triangle))
}

/// Offsets of the corners of a cube from its centre.
fn corners(half: f64) -> impl Iterator<Item = Vec3> {
    (0..8).map(move |octant| Vec3::from_fn(|k, _| if octant >> k & 1 == 1 { half } else { -half }))
}

impl Builder<'_> {
    /// `list`: the triangles that count in the parent, with their distances from its centre, from which this one is `moved`.
    fn cell(&mut self, index: usize, center: Vec3, half: f64, list: &[Near], moved: &Vec3, depth: u32) {
        let field = &*self.field;
        let at = |triangle: u32| {
            let from = center - closest_on_triangle(&center, &field.corners[triangle as usize]).0;
            let distance = from.norm();
            let slope = if distance > SOME * field.diagonal { from / distance } else { Vec3::zeros() };
            Near { distance, triangle, slope }
        };
        let reach = 3.0_f64.sqrt() * half;
        // convex: no triangle is closer than its tangent plane in the parent tells
        let below: Vec<f64> = list.iter().map(|n| n.distance + n.slope.dot(moved)).collect();
        let may_be = |most: f64| list.iter().zip(&below).filter(move |(_, below)| **below <= most).map(|(n, _)| n);
        let Some(guess) = (0..list.len()).min_by(|&a, &b| below[a].total_cmp(&below[b])) else { return };
        let most = at(list[guess].triangle).distance + 2.0 * reach;
        let mut near: Vec<Near> = may_be(most).map(|n| at(n.triangle)).collect();
        let Some(&first) = near.iter().min_by(|a, b| order(a, b)) else { return };
        let (least, found) = (first.distance, field.closest_of(&center, first.triangle as usize));
        let distance = field.describe(&center, &found).distance;
        near.retain(|n| n.distance <= least + 2.0 * reach);
        // others are taken where an element is inside, or as good as touches
        let takes_others = distance < reach + field.around;
        let facing_first = field.normals[first.triangle as usize][0];
        let turned = |t: u32| takes_others && field.normals[t as usize][0].dot(&facing_first) < OTHER_WAY;
        let most = least + 2.0 * reach + field.around;
        let others = may_be(if takes_others { most } else { f64::NEG_INFINITY }).filter(|n| turned(n.triangle)).map(|n| at(n.triangle));
        near.extend(others.filter(|n| n.distance > least + 2.0 * reach && n.distance <= most));
        let excess = self.excess(&center, half, &first);
        let slack = excess + ROUNDING * field.diagonal;
        let counts = |n: &Near, turned: bool| {
            let more = if turned { field.around } else { 0.0 };
            n.distance - least <= slack + more + half * (n.slope - first.slope).abs().sum()
        };
        let listed = near.iter().filter(|n| counts(n, turned(n.triangle))).count();
        let full = field.tree.cells.len() > MOST_CELLS || field.lists.len() + near.len() > MOST_LISTED;
        let away = least > FARTHEST * field.diagonal;
        let far = least > FAR * reach && (listed <= LONG || away);
        if listed > SHORT && depth < self.deepest && !far && !full {
            // one that may be another way in a child may not be in this cell
            near.retain(|n| counts(n, takes_others));
            return self.divide(index, center, half, &near, depth);
        }
        near.retain(|n| counts(n, turned(n.triangle)));
        let mut cell = Cell::empty();
        cell.set_distance(distance - ROUNDING * (distance.abs() + field.diagonal));
        if least > reach {
            let slope = cell.set_slope(&(first.slope * distance.signum()));
            cell.set_short(self.short(half, distance, &slope, &near, &first, excess));
        }
        if near.len() <= if away { SHORT } else { LONG } && !full {
            near.sort_unstable_by(order);
            (cell.link, cell.count) = (self.field.lists.len() as u32, near.len() as u8);
            self.field.lists.extend(near.iter().map(|n| Listed { triangle: n.triangle, nearer: (n.distance * BELOW) as f32 }));
        }
        self.field.tree.cells[index] = cell;
    }

    fn divide(&mut self, index: usize, center: Vec3, half: f64, near: &[Near], depth: u32) {
        let children = self.field.tree.cells.len();
        self.field.tree.cells[index].link = children as u32;
        self.field.tree.cells.extend([Cell::empty(); 8]);
        for (octant, offset) in corners(0.5 * half).enumerate() {
            self.cell(children + octant, center + offset, 0.5 * half, near, &offset, depth + 1);
        }
    }

    /// `e₀`: how far the distance of a triangle rises above its tangent plane within the cell, at most, metres.
    fn excess(&self, center: &Vec3, half: f64, n: &Near) -> f64 {
        let (slope, triangle) = (n.slope, &self.field.corners[n.triangle as usize]);
        let of = |offset: Vec3| {
            let corner = center + offset;
            (closest_on_triangle(&corner, triangle).0 - corner).norm() - n.distance - slope.dot(&offset)
        };
        corners(half).map(of).fold(0.0, f64::max)
    }

    /// `e`: how far the distance falls short of the plane through `(c, distance)` with this slope, at most, metres; in a cell that holds
    /// nothing of the surface.
    fn short(&self, half: f64, distance: f64, slope: &Vec3, near: &[Near], first: &Near, excess: f64) -> f64 {
        if distance > 0.0 {
            let of = |n: &Near| distance - n.distance + half * (slope - n.slope).abs().sum();
            return near.iter().map(of).fold(0.0, f64::max);
        }
        excess + half * (slope + first.slope).abs().sum()
    }
}
