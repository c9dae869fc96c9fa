//! Fills the octree of a mesh's field.
//!
//! A cell takes over from its parent the triangles that can be closest to a point in it. Those of a cell of centre `c` and half diagonal `r`:
//!
//! ```text
//! t listed     iff  dist(c, t) ≤ |d_c| + 2r                    (|d(p) − d(c)| ≤ |p − c| ≤ r, for each triangle and for all)
//! d_t(p) ≥ d_t(c) + g_t·(p − c)                                 the distance from a triangle is convex, its slope at c is g_t
//! outside:     e = max over t of d_c − d_t(c) + h·|g − g_t|₁    so that d(p) ≥ d_c + g·(p − c) − e
//! inside:      −d(p) ≤ d_t(p) for any t; of the closest, which is convex, the corners of the cell tell the most
//! ```
//!
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
/// Of single precision, and more.
const ROUNDING: f64 = 1e-7;
/// Cells and listed triangles at most; beyond, the tree of boxes answers.
const MOST_CELLS: usize = 1 << 20;
const MOST_LISTED: usize = 1 << 23;

/// A triangle that may count in a cell: its distance from the centre, or less, and its number.
type Near = (f64, u32);

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
    let all: Vec<Near> = (0..field.corners.len() as u32).map(|t| (0.0, t)).collect();
    Builder { field, deepest }.cell(0, center, half, &all, f64::INFINITY, 0);
    field.tree.finish();
    field.lists.shrink_to_fit();
}

fn order(a: &Near, b: &Near) -> std::cmp::Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
}

impl Builder<'_> {
    /// `list`: the triangles that count in the parent, with their distances from its centre, which is `moved` from this one.
    fn cell(&mut self, index: usize, center: Vec3, half: f64, list: &[Near], moved: f64, depth: u32) {
        let from_center = |t: u32| (closest_on_triangle(&center, &self.field.corners[t as usize]).0 - center).norm();
        let reach = 3.0_f64.sqrt() * half;
        let Some(guess) = list.iter().min_by(|a, b| order(a, b)) else { return };
        // no more than this counts, and no triangle came closer than it was moved
        let most = from_center(guess.1) + 2.0 * reach + self.field.around;
        let away = |t: u32| self.field.ball_away(&center, t as usize);
        let mut near: Vec<Near> = list.iter().filter(|n| n.0 - moved <= most && away(n.1) <= most).map(|n| (from_center(n.1), n.1)).collect();
        let Some(&(least, first)) = near.iter().min_by(|a, b| order(a, b)) else { return };
        let found = self.field.closest_of(&center, first as usize);
        let distance = self.field.describe(&center, &found).distance;
        let facing_first = self.field.normals[first as usize][0];
        let turned = |t: u32| self.field.normals[t as usize][0].dot(&facing_first) < OTHER_WAY;
        near.retain(|&(d, t)| d <= least + 2.0 * reach || (d <= least + 2.0 * reach + self.field.around && turned(t)));
        let full = self.field.tree.cells.len() > MOST_CELLS || self.field.lists.len() + near.len() > MOST_LISTED;
        let far = least > FAR * reach && (near.len() <= LONG || least > FARTHEST * self.field.diagonal);
        if near.len() > SHORT && depth < self.deepest && !far && !full {
            return self.divide(index, center, half, &near, depth);
        }
        let mut cell = Cell::empty();
        cell.set_distance(distance - ROUNDING * (distance.abs() + self.field.diagonal));
        if least > reach {
            let slope = cell.set_slope(&((center - found.point) / distance));
            cell.set_short(self.short(&center, half, distance, &slope, &near, first), half);
        }
        if near.len() <= LONG && !full {
            near.sort_unstable_by(order);
            (cell.link, cell.count) = (self.field.lists.len() as u32, near.len() as u8);
            self.field.lists.extend(near.iter().map(|n| Listed { triangle: n.1, nearer: (n.0 * BELOW) as f32 }));
        }
        self.field.tree.cells[index] = cell;
    }

    fn divide(&mut self, index: usize, center: Vec3, half: f64, near: &[Near], depth: u32) {
        let children = self.field.tree.cells.len();
        self.field.tree.cells[index].link = children as u32;
        self.field.tree.cells.extend([Cell::empty(); 8]);
        for octant in 0..8 {
            let side = Vec3::from_fn(|k, _| if octant >> k & 1 == 1 { 0.5 } else { -0.5 });
            self.cell(children + octant, center + side * half, 0.5 * half, near, 0.5 * 3.0_f64.sqrt() * half, depth + 1);
        }
    }

    /// How far the distance falls short of the plane through `(c, distance)` with this slope, at most, metres; in a cell that holds nothing of
    /// the surface.
    fn short(&self, center: &Vec3, half: f64, distance: f64, slope: &Vec3, near: &[Near], first: u32) -> f64 {
        let corners = &self.field.corners;
        if distance > 0.0 {
            let of = |&(d, t): &Near| {
                let along = (center - closest_on_triangle(center, &corners[t as usize]).0) / d;
                distance - d + half * (slope - along).abs().sum()
            };
            return near.iter().map(of).fold(0.0, f64::max);
        }
        let of = |octant: usize| {
            let offset = Vec3::from_fn(|k, _| if octant >> k & 1 == 1 { half } else { -half });
            let corner = center + offset;
            let depth = (closest_on_triangle(&corner, &corners[first as usize]).0 - corner).norm();
            distance + slope.dot(&offset) + depth
        };
        (0..8).map(of).fold(0.0, f64::max)
    }
}
