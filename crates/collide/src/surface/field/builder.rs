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
use rayon::prelude::*;

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
/// Cells and listed triangles of a branch at most; beyond, the tree of boxes answers.
const MOST_CELLS: usize = 1 << 16;
const MOST_LISTED: usize = 1 << 19;
/// Cells above this depth have their children made by several threads, each a branch of its own.
const BRANCHES: u32 = 2;

/// A triangle that may count in a cell.
#[derive(Clone, Copy)]
struct Near {
    /// Of the cell's centre.
    distance: f64,
    triangle: u32,
    /// Of the distance at the cell's centre; none on the triangle itself, where the distance is least.
    slope: Vec3,
}

/// A cell and all below it: the first of `cells`, whose links are indices in here.
struct Branch {
    cells: Vec<Cell>,
    lists: Vec<Listed>,
}

/// Makes a branch.
struct Builder<'a> {
    field: &'a MeshField,
    deepest: u32,
    branch: Branch,
    /// Working memory.
    below: Vec<f64>,
    spare: Vec<Vec<Near>>,
}

/// Fills `field.tree` and `field.lists`.
pub(super) fn build(field: &mut MeshField) {
    let bounds = field.bounds;
    let (center, half) =
        (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min).max() + RIM * field.diagonal);
    field.tree = Octree::new(center, half);
    let lengths: f64 = field.corners.iter().map(|[a, b, _]| (b - a).norm()).sum();
    let mean = lengths / field.corners.len() as f64;
    let deepest = (3.0_f64.sqrt() * half / (FINEST * mean)).log2().ceil().clamp(1.0, DEEPEST) as u32;
    let all: Vec<Near> = (0..field.corners.len() as u32)
        .map(|triangle| Near { distance: 0.0, triangle, slope: Vec3::zeros() })
        .collect();
    let branch = Builder::branch(field, deepest, center, half, &all, &Vec3::zeros(), 0);
    (field.tree.cells, field.lists) = (branch.cells, branch.lists);
    field.tree.finish(deepest);
    field.lists.shrink_to_fit();
}

impl Branch {
    /// Puts a branch in the place of a cell.
    fn graft(&mut self, place: usize, mut branch: Branch) {
        let (cells, lists) = (self.cells.len() as u32 - 1, self.lists.len() as u32);
        branch.cells.iter_mut().for_each(|cell| cell.shift(cells, lists));
        self.cells[place] = branch.cells[0];
        self.cells.extend_from_slice(&branch.cells[1..]);
        self.lists.append(&mut branch.lists);
    }
}

fn order(a: &Near, b: &Near) -> std::cmp::Ordering {
    a.distance.total_cmp(&b.distance).then(a.triangle.cmp(&b.triangle))
}

/// Offset of a corner of a cube from its centre.
fn corner(octant: usize, half: f64) -> Vec3 {
    Vec3::from_fn(|k, _| if octant >> k & 1 == 1 { half } else { -half })
}

impl<'a> Builder<'a> {
    /// The branch of a cell. `list`: the triangles that count in the parent, with their distances from its centre, from which this one is `moved`.
    fn branch(
        field: &'a MeshField,
        deepest: u32,
        center: Vec3,
        half: f64,
        list: &[Near],
        moved: &Vec3,
        depth: u32,
    ) -> Branch {
        let branch = Branch { cells: vec![Cell::empty()], lists: Vec::new() };
        let mut builder = Builder { field, deepest, branch, below: Vec::new(), spare: Vec::new() };
        builder.cell(0, center, half, list, moved, depth);
        builder.branch
    }

    /// Fills a cell of the branch.
    fn cell(&mut self, index: usize, center: Vec3, half: f64, list: &[Near], moved: &Vec3, depth: u32) {
        let field = self.field;
        let at = |triangle: u32| {
            let from = center - closest_on_triangle(&center, &field.corners[triangle as usize]).0;
            let distance = from.norm();
            let slope = if distance > SOME * field.diagonal { from / distance } else { Vec3::zeros() };
            Near { distance, triangle, slope }
        };
        let reach = 3.0_f64.sqrt() * half;
        // convex: no triangle is closer than its tangent plane in the parent tells
        self.below.clear();
        self.below.extend(list.iter().map(|n| n.distance + n.slope.dot(moved)));
        let below = &self.below;
        let may_be = |most: f64| list.iter().zip(below).filter(move |(_, below)| **below <= most).map(|(n, _)| n);
        let Some(guess) = (0..list.len()).min_by(|&a, &b| below[a].total_cmp(&below[b])) else { return };
        let most = at(list[guess].triangle).distance + 2.0 * reach;
        let mut near = self.spare.pop().unwrap_or_default();
        may_be(most).for_each(|n| near.push(at(n.triangle)));
        let Some(&first) = near.iter().min_by(|a, b| order(a, b)) else { return };
        let (least, found) = (first.distance, field.closest_of(&center, first.triangle as usize));
        let distance = field.describe(&center, &found).distance;
        near.retain(|n| n.distance <= least + 2.0 * reach);
        // others are taken where an element is inside, or as good as touches
        let takes_others = distance < reach + field.around;
        let facing_first = field.normals[first.triangle as usize][0];
        let turned = |t: u32| takes_others && field.normals[t as usize][0].dot(&facing_first) < OTHER_WAY;
        let most = least + 2.0 * reach + field.around;
        let others = may_be(if takes_others { most } else { f64::NEG_INFINITY })
            .filter(|n| turned(n.triangle))
            .map(|n| at(n.triangle));
        near.extend(others.filter(|n| n.distance > least + 2.0 * reach && n.distance <= most));
        let excess = self.excess(&center, half, &first);
        let slack = excess + ROUNDING * field.diagonal;
        let counts = |n: &Near, turned: bool| {
            let more = if turned { field.around } else { 0.0 };
            n.distance - least <= slack + more + half * (n.slope - first.slope).abs().sum()
        };
        let listed = near.iter().filter(|n| counts(n, turned(n.triangle))).count();
        let full = self.branch.cells.len() > MOST_CELLS || self.branch.lists.len() + near.len() > MOST_LISTED;
        let away = least > FARTHEST * field.diagonal;
        let far = least > FAR * reach && (listed <= LONG || away);
        if listed > SHORT && depth < self.deepest && !far && !full {
            // one that may be another way in a child may not be in this cell
            near.retain(|n| counts(n, takes_others));
            self.divide(index, center, half, &near, depth);
        } else {
            near.retain(|n| counts(n, turned(n.triangle)));
            let mut cell = Cell::empty();
            cell.set_distance(distance - ROUNDING * (distance.abs() + field.diagonal));
            if least > reach {
                let slope = cell.set_slope(&(first.slope * distance.signum()));
                cell.set_short(self.short(half, distance, &slope, &near, &first, excess));
            }
            if near.len() <= if away { SHORT } else { LONG } && !full {
                near.sort_unstable_by(order);
                (cell.link, cell.count) = (self.branch.lists.len() as u32, near.len() as u8);
                self.branch
                    .lists
                    .extend(near.iter().map(|n| Listed { triangle: n.triangle, nearer: (n.distance * BELOW) as f32 }));
            }
            self.branch.cells[index] = cell;
        }
        near.clear();
        self.spare.push(near);
    }

    fn divide(&mut self, index: usize, center: Vec3, half: f64, near: &[Near], depth: u32) {
        let children = self.branch.cells.len();
        self.branch.cells[index].link = children as u32;
        self.branch.cells.extend([Cell::empty(); 8]);
        let half = 0.5 * half;
        let offsets: [Vec3; 8] = std::array::from_fn(|octant| corner(octant, half));
        if depth < BRANCHES {
            let (field, deepest) = (self.field, self.deepest);
            let branches: Vec<Branch> = offsets
                .par_iter()
                .map(|offset| Builder::branch(field, deepest, center + offset, half, near, offset, depth + 1))
                .collect();
            branches.into_iter().enumerate().for_each(|(octant, branch)| self.branch.graft(children + octant, branch));
        } else {
            for (octant, offset) in offsets.iter().enumerate() {
                self.cell(children + octant, center + offset, half, near, offset, depth + 1);
            }
        }
    }

    /// `e₀`: how far the distance of a triangle rises above its tangent plane within the cell, at most, metres.
    fn excess(&self, center: &Vec3, half: f64, n: &Near) -> f64 {
        let (slope, triangle) = (n.slope, &self.field.corners[n.triangle as usize]);
        let of = |offset: Vec3| {
            let corner = center + offset;
            (closest_on_triangle(&corner, triangle).0 - corner).norm() - n.distance - slope.dot(&offset)
        };
        (0..8).map(|octant| of(corner(octant, half))).fold(0.0, f64::max)
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

#[cfg(test)]
mod tests {
    use crate::surface::Field;
    use crate::surface::field::MeshField;
    use crate::{TriMesh, Vec3};

    /// Cells and lists, bit by bit.
    fn bits(threads: usize) -> String {
        let mesh = TriMesh::torus(1.0, 0.3, 32, 16);
        let searched = vec![[true; 3]; mesh.triangles.len()];
        let field = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| MeshField::new(&mesh, searched));
        format!("{:?} {:?}", field.tree.cells, field.lists)
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        assert_eq!(bits(1), bits(5));
    }

    /// The links of cells that several threads made lead where they should: distances are those of a look at every triangle.
    #[test]
    fn grafted_branches_tell_the_distance() {
        let mesh = TriMesh::torus(1.0, 0.3, 32, 16);
        let field = MeshField::new(&mesh, vec![[true; 3]; mesh.triangles.len()]);
        assert!(
            field.tree.cells.len() > 500 && field.lists.len() > 1000,
            "{} {}",
            field.tree.cells.len(),
            field.lists.len()
        );
        for n in 0..2000_u32 {
            let place = |step: u32, span: f64| span * (f64::from(n * step % 1999) / 999.5 - 1.0);
            let p = Vec3::new(place(1, 1.3), place(611, 1.3), place(1301, 0.35));
            let square = |t: usize| (crate::mesh::closest_on_triangle(&p, &mesh.corners(t)).0 - p).norm_squared();
            let brute = (0..mesh.triangles.len()).map(square).fold(f64::INFINITY, f64::min).sqrt();
            let found = field.nearest(&p).distance;
            assert!((found.abs() - brute).abs() < 1e-12, "{p:?}: {found} instead of {brute}");
            assert!(field.tree.bound(&p) <= found, "{p:?}: bound above {found}");
        }
    }

    /// Bounds of places told in another frame, in single precision, in and around the mesh and far away: never above the distance, and as good as the others.
    #[test]
    fn bounds_from_another_frame() {
        let mesh = TriMesh::torus(1.0, 0.3, 32, 16);
        let field = MeshField::new(&mesh, vec![[true; 3]; mesh.triangles.len()]);
        for n in 0..4000_u32 {
            let place = |step: u32, span: f64| span * (f64::from(n * step % 3989) / 1994.5 - 1.0);
            let rotation = crate::Quat::from_euler_angles(place(7, 3.0), place(31, 1.5), place(57, 3.0))
                .to_rotation_matrix()
                .into_inner();
            let far = if n % 3 == 0 { 1e3 } else { 1.5 };
            let offset = Vec3::new(place(11, far), place(13, far), place(17, far));
            let single = [place(1, 1.0) as f32, place(611, 1.0) as f32, place(1301, 1.0) as f32];
            let p = rotation * Vec3::from(single.map(f64::from)) + offset;
            let way = field.way_from(&rotation, &offset, 1.8).unwrap();
            let (bound, usual, truth) =
                (field.bound_on(&way, &single), field.tree.bound(&p), field.nearest(&p).distance);
            assert!(bound <= truth, "{p:?}: bound {bound} above {truth}");
            assert!(bound >= usual - 4.0 * way.rounding(), "{p:?}: bound {bound} below {usual}");
        }
    }

    /// Above, below and beside a large slab of twelve triangles the bound is the distance itself; past its edges no more.
    #[test]
    fn the_bound_of_a_slab_is_its_distance() {
        let half = Vec3::new(1.5, 1.5, 0.1);
        let field = MeshField::new(&TriMesh::box_(half), vec![[true; 3]; 12]);
        for n in 0..2000_u32 {
            let place = |step: u32, span: f64| span * (f64::from(n * step % 1999) / 999.5 - 1.0);
            let p = Vec3::new(place(1, 1.9), place(611, 1.9), place(1301, 0.5));
            let out = p.abs() - half;
            let truth = out.sup(&Vec3::zeros()).norm() + out.max().min(0.0);
            let bound = Field::bound(&field, &p);
            assert!(bound <= truth, "{p:?}: bound {bound} above {truth}");
            let straight = out.iter().filter(|x| **x > 0.0).count() < 2;
            assert!(!straight || bound > truth - 1e-9, "{p:?}: bound {bound} below {truth}");
        }
    }
}
