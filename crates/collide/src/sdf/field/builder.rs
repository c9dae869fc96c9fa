//! Construction of the octree of a mesh's field.
//!
//! A cell inherits from its parent the triangles that can be closest to a point in it. For a cell
//! of center `c`, half side `h` and half diagonal `r`:
//!
//! ```text
//! d_t(p) ≥ d_t(c) + g_t·(p − c)        the distance from a triangle is convex, its slope at c is g_t
//! d_0(p) ≤ d_0(c) + g_0·(p − c) + e₀   of the closest at c; being convex, it is most above its plane at a corner of the cell
//! t listed     iff  d_t(c) − d_0(c) ≤ e₀ + h·|g_t − g_0|₁
//! outside:     e = max over t of d_0(c) − d_t(c) + h·|g − g_t|₁     so that d(p) ≥ d_c + g·(p − c) − e
//! inside:      −d(p) ≤ d_0(p), so e = e₀ + h·|g + g_0|₁             signs: d_c = −d_0(c)
//! ```
//!
//! A child first receives all triangles with `d_t(c) ≤ d_0(c) + 2r`, since `|d(p) − d(c)| ≤ |p − c|
//! ≤ r` for each triangle and for the whole surface. The first line then excludes triangles without
//! computing their distance. A cell is divided until its list is short. Far from the surface it can
//! have no list, only the bound.

use super::ListedTriangle;
use super::cell_view::{CellView, LONG_LIST, NearTriangle, ROUNDING, SHORT_LIST, order};
use super::octree::Cell;
use super::triangles::Triangles;
use crate::{Aabb, Vec3};

/// Distance of the outermost cell beyond the mesh, as a fraction of the diagonal.
const MARGIN: f64 = 0.05;
/// Smallest half diagonal of a cell, in mean lengths of an edge.
const MIN_CELL: f64 = 0.15;
/// Maximum depth.
const MAX_DEPTH: f64 = 9.0;
/// Factor that keeps a distance below its exact value when rounded to single precision.
const ROUND_DOWN: f64 = 1.0 - 2e-7;
/// Maximum number of cells and of listed triangles of a block; beyond, the tree of boxes is used.
const MAX_CELLS: usize = 1 << 16;
const MAX_LISTED: usize = 1 << 19;

impl Triangles {
    /// Returns center and half side of the outermost cell, and its maximum depth.
    pub fn outermost(&self, bounds: &Aabb) -> (Vec3, f64, u32) {
        let (center, half) =
            (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min).max() + MARGIN * self.diagonal);
        let levels = nalgebra::ComplexField::log2(3.0_f64.sqrt() * half / (MIN_CELL * self.mean_edge)).ceil();
        (center, half, levels.clamp(1.0, MAX_DEPTH) as u32)
    }
}

/// Builds a cell and all its descendants.
pub(super) struct Builder<'a> {
    triangles: &'a Triangles,
    max_depth: u32,
    /// The first is the requested cell; links are indices into this and into `lists`.
    pub cells: Vec<Cell>,
    pub lists: Vec<ListedTriangle>,
    /// Scratch memory.
    below: Vec<f64>,
    buffers: Vec<Vec<NearTriangle>>,
}

/// Returns the offset of a corner of a cube from its center.
pub(super) fn corner(octant: usize, half: f64) -> Vec3 {
    Vec3::from_fn(|k, _| if octant >> k & 1 == 1 { half } else { -half })
}

impl<'a> Builder<'a> {
    pub fn new(triangles: &'a Triangles, max_depth: u32) -> Builder<'a> {
        Builder { triangles, max_depth, cells: Vec::new(), lists: Vec::new(), below: Vec::new(), buffers: Vec::new() }
    }

    /// Builds a cell and all its descendants. `list` are the relevant triangles of the parent,
    /// relative to its center, from which this cell's center is offset by `moved`.
    pub fn branch(&mut self, center: Vec3, half: f64, list: &[NearTriangle], moved: &Vec3, depth: u32) {
        self.cells.push(Cell::empty());
        self.cell(0, center, half, list, moved, depth);
    }

    fn cell(&mut self, index: usize, center: Vec3, half: f64, list: &[NearTriangle], moved: &Vec3, depth: u32) {
        let mut near = self.buffers.pop().unwrap_or_default();
        match self.build_cell(center, half, list, moved, depth, &mut near) {
            Some(cell) => self.cells[index] = cell,
            None => self.divide(index, center, half, &near, depth),
        }
        near.clear();
        self.buffers.push(near);
    }

    fn divide(&mut self, index: usize, center: Vec3, half: f64, near: &[NearTriangle], depth: u32) {
        let children = self.cells.len();
        self.cells[index].link = children as u32;
        self.cells.extend([Cell::empty(); 8]);
        for octant in 0..8 {
            let offset = corner(octant, 0.5 * half);
            self.cell(children + octant, center + offset, 0.5 * half, near, &offset, depth + 1);
        }
    }

    /// Returns the cell with its list, or `None` if it must be divided; then `near` contains its
    /// relevant triangles.
    pub fn build_cell(
        &mut self,
        center: Vec3,
        half: f64,
        list: &[NearTriangle],
        moved: &Vec3,
        depth: u32,
        near: &mut Vec<NearTriangle>,
    ) -> Option<Cell> {
        let triangles = self.triangles;
        let at = |triangle: u32| triangles.near(&center, triangle);
        // convexity: no triangle is closer than its tangent plane in the parent
        self.below.clear();
        self.below.extend(list.iter().map(|n| n.distance + n.slope.dot(moved)));
        let below = &self.below;
        let may_be = |most: f64| list.iter().zip(below).filter(move |(_, below)| **below <= most).map(|(n, _)| n);
        let Some(guess) = (0..list.len()).min_by(|&a, &b| below[a].total_cmp(&below[b])) else {
            return Some(Cell::empty());
        };
        let most = at(list[guess].triangle).distance + 2.0 * 3.0_f64.sqrt() * half;
        near.extend(may_be(most).map(|n| at(n.triangle)));
        let Some(&first) = near.iter().min_by(|a, b| order(a, b)) else { return Some(Cell::empty()) };
        let cell_view = CellView::new(triangles, center, half, first);
        let straight = first.distance + 2.0 * cell_view.reach;
        near.retain(|n| n.distance <= straight);
        if cell_view.takes_others {
            let others = may_be(cell_view.furthest(triangles)).filter(|n| cell_view.is_turned(triangles, n.triangle));
            let beyond = |n: &NearTriangle| n.distance > straight && n.distance <= cell_view.furthest(triangles);
            near.extend(others.map(|n| at(n.triangle)).filter(beyond));
        }
        let listed = near.iter().filter(|n| cell_view.is_listed(triangles, n)).count();
        let full = self.cells.len() > MAX_CELLS || self.lists.len() + near.len() > MAX_LISTED;
        if depth < self.max_depth && !full && cell_view.is_divided(triangles, listed) {
            near.retain(|n| cell_view.counts(triangles, n, cell_view.takes_others));
            return None;
        }
        near.retain(|n| cell_view.is_listed(triangles, n));
        Some(self.finish(&cell_view, near, full))
    }

    /// Returns the cell of a view with the list of relevant triangles, unless there are too many.
    fn finish(&mut self, cell_view: &CellView, near: &mut [NearTriangle], full: bool) -> Cell {
        let (triangles, distance) = (self.triangles, cell_view.distance);
        let mut cell = Cell::empty();
        cell.set_distance(distance - ROUNDING * (distance.abs() + triangles.diagonal));
        if cell_view.first.distance > cell_view.reach {
            let slope = cell.set_slope(&(cell_view.first.slope * distance.signum()));
            cell.set_shortfall(shortfall(cell_view, &slope, near));
        }
        if near.len() <= if cell_view.is_away(triangles) { SHORT_LIST } else { LONG_LIST } && !full {
            near.sort_unstable_by(order);
            (cell.link, cell.count) = (self.lists.len() as u32, near.len() as u8);
            let listed =
                |n: &NearTriangle| ListedTriangle { triangle: n.triangle, nearer: (n.distance * ROUND_DOWN) as f32 };
            self.lists.extend(near.iter().map(listed));
        }
        cell
    }
}

/// Returns `e`: an upper bound of how far the distance falls below the plane through `(c,
/// distance)` with this slope, meters, for a cell without surface.
fn shortfall(cell_view: &CellView, slope: &Vec3, near: &[NearTriangle]) -> f64 {
    if cell_view.distance > 0.0 {
        let of = |n: &NearTriangle| cell_view.distance - n.distance + cell_view.half * (slope - n.slope).abs().sum();
        return near.iter().map(of).fold(0.0, f64::max);
    }
    cell_view.excess + cell_view.half * (slope + cell_view.first.slope).abs().sum()
}

#[cfg(test)]
mod tests {
    use crate::mesh::edge_groups;
    use crate::sdf::DistanceField;
    use crate::sdf::field::{MeshField, is_convex};
    use crate::{TriMesh, Vec3};

    fn field(mesh: TriMesh) -> MeshField {
        let groups = edge_groups(&mesh);
        let (searched, convex) = (vec![[true; 3]; mesh.triangles.len()], is_convex(&mesh, &groups));
        MeshField::new(mesh, &groups, searched, convex)
    }

    fn torus() -> MeshField {
        field(TriMesh::torus(1.0, 0.3, 32, 16))
    }

    fn place(n: u32) -> Vec3 {
        let place = |step: u32, span: f64| span * (f64::from(n * step % 1999) / 999.5 - 1.0);
        Vec3::new(place(1, 1.3), place(611, 1.3), place(1301, 0.35))
    }

    /// Returns the bits of cells and lists as text.
    fn bits(field: &MeshField) -> String {
        field.tree.blocks.built().map(|block| format!("{block:?}\n")).collect()
    }

    /// Blocks have the same bits if built one by one, backwards, by five threads at once, or by
    /// scattered queries.
    #[test]
    fn order_and_threads_change_no_bit() {
        let fields = [torus(), torus(), torus()];
        fields[0].tree.blocks.build_all(1, &fields[0].triangles);
        fields[1].tree.blocks.build_all(4095, &fields[1].triangles);
        std::thread::scope(|scope| {
            let field = &fields[2];
            let each = |step| move || field.tree.blocks.build_all(step, &field.triangles);
            for step in [1, 3, 5, 7, 4095] {
                scope.spawn(each(step));
            }
        });
        let all = bits(&fields[0]);
        assert!(all == bits(&fields[1]) && all == bits(&fields[2]));
        let lazy = torus();
        for n in 0..2000 {
            let (built, asked) = (fields[0].nearest(&place(n)), lazy.nearest(&place(n)));
            assert_eq!(format!("{built:?}"), format!("{asked:?}"));
            assert_eq!(
                DistanceField::bound(&fields[0], &place(n)).to_bits(),
                DistanceField::bound(&lazy, &place(n)).to_bits()
            );
        }
        assert!(bits(&lazy).lines().all(|block| all.contains(block)));
    }

    /// A query builds the block around it, and no other.
    #[test]
    fn only_queried_blocks_are_built() {
        let field = torus();
        assert_eq!(field.tree.blocks.built().count(), 0);
        field.nearest(&Vec3::new(1.3, 0.0, 0.0));
        field.nearest(&Vec3::new(1.3, 0.0, 1e-9));
        assert!((1..=2).contains(&field.tree.blocks.built().count()));
    }

    /// Distances equal those of a brute-force search.
    #[test]
    fn blocks_give_the_exact_distance() {
        let mesh = TriMesh::torus(1.0, 0.3, 32, 16);
        let field = torus();
        for n in 0..2000_u32 {
            let p = place(n);
            let square = |t: usize| (crate::mesh::closest_on_triangle(&p, &mesh.corners(t)).0 - p).norm_squared();
            let brute = (0..mesh.triangles.len()).map(square).fold(f64::INFINITY, f64::min).sqrt();
            let found = field.nearest(&p).distance;
            assert!((found.abs() - brute).abs() < 1e-12, "{p:?}: {found} instead of {brute}");
            assert!(field.tree.bound(&p, &field.triangles) <= found, "{p:?}: bound above {found}");
        }
    }

    /// Bounds in another frame, in single precision, near the mesh and far away: never above the
    /// distance, and as good as in the mesh's frame.
    #[test]
    fn bounds_from_another_frame() {
        let field = torus();
        for n in 0..4000_u32 {
            let place = |step: u32, span: f64| span * (f64::from(n * step % 3989) / 1994.5 - 1.0);
            let rotation = crate::Quat::from_euler_angles(place(7, 3.0), place(31, 1.5), place(57, 3.0))
                .to_rotation_matrix()
                .into_inner();
            let far = if n % 3 == 0 { 1e3 } else { 1.5 };
            let offset = Vec3::new(place(11, far), place(13, far), place(17, far));
            let single = [place(1, 1.0) as f32, place(611, 1.0) as f32, place(1301, 1.0) as f32];
            let p = rotation * Vec3::from(single.map(f64::from)) + offset;
            let way = field.frame_map(&rotation, &offset, 1.8).unwrap();
            let (bound, usual, truth) =
                (field.bound_mapped(&way, &single), field.tree.bound(&p, &field.triangles), field.nearest(&p).distance);
            assert!(bound <= truth, "{p:?}: bound {bound} above {truth}");
            assert!(bound >= usual - 4.0 * way.rounding(), "{p:?}: bound {bound} below {usual}");
        }
    }

    /// Above, below and beside a large slab of twelve triangles the bound is the exact distance;
    /// beyond its edges it is at most the distance.
    #[test]
    fn the_bound_of_a_slab_is_its_distance() {
        let half = Vec3::new(1.5, 1.5, 0.1);
        let field = field(TriMesh::cuboid(2.0 * half));
        for n in 0..2000_u32 {
            let place = |step: u32, span: f64| span * (f64::from(n * step % 1999) / 999.5 - 1.0);
            let p = Vec3::new(place(1, 1.9), place(611, 1.9), place(1301, 0.5));
            let out = p.abs() - half;
            let truth = out.sup(&Vec3::zeros()).norm() + out.max().min(0.0);
            let bound = DistanceField::bound(&field, &p);
            assert!(bound <= truth, "{p:?}: bound {bound} above {truth}");
            let straight = out.iter().filter(|x| **x > 0.0).count() < 2;
            assert!(!straight || bound > truth - 1e-9, "{p:?}: bound {bound} below {truth}");
        }
    }
}
