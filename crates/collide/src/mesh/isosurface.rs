//! The surface on which sampled distances are zero, as a closed mesh: marching tetrahedra.
//!
//! Source: Doi and Koide, *An efficient method of triangulating equi-valued surfaces by using
//! tetrahedral cells* (1991). Each cell of the grid is divided into six tetrahedra along its diagonal
//! (Kuhn), which match between neighbors. A tetrahedron with corners inside and outside has a triangle
//! or two. The corners of the triangles are points of the grid's edges, shared by all tetrahedra
//! around an edge, so the surface is closed and crosses itself nowhere.
//!
//! ```text
//! place on an edge   t = d₀/(d₀ − d₁)            linear, kept a thousandth of the edge away from its ends
//! error              at most h²·κ/2 and h/1000       h length of a cell's diagonal, κ curvature of the surface
//! ```

use super::TriMesh;
use crate::{MeshError, Vec3};
use std::collections::BTreeMap;

/// Maximum number of grid points.
const MAX_POINTS: usize = 20_000_000;
/// Smallest distance of a vertex from a grid point, in lengths of the edge, so that no triangle is
/// degenerate.
const OFF_CORNER: f64 = 1e-3;
/// The tetrahedra of a cell: orders in which its axes are walked. Every other one is mirrored.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 2, 0], [1, 0, 2], [2, 0, 1], [2, 1, 0]];

impl TriMesh {
    /// Returns the closed surface on which `distance` is zero, negative inside, within the box from `low`
    /// to `high` (m), sampled at `cells` cells along its longest side. Any function that is negative
    /// inside and positive outside will do; vertices lie on its zeros to 1e-6 of a cell.
    ///
    /// ```
    /// use tumble_collide::{TriMesh, Vec3};
    /// let ring = |p: &Vec3| Vec3::new(p.xy().norm() - 0.3, p.z, 0.0).norm() - 0.1;
    /// let mesh = TriMesh::isosurface(ring, Vec3::repeat(-0.5), Vec3::repeat(0.5), 40)?;
    /// let volume = 2.0 * std::f64::consts::PI.powi(2) * 0.3 * 0.1_f64.powi(2);
    /// assert!((mesh.signed_volume() / volume - 1.0).abs() < 0.02);
    /// # Ok::<(), tumble_collide::MeshError>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::Isosurface`]: an empty box, less than 2 cells, more than 20 million grid points, a
    /// value that is not finite, no point inside, or a point inside at the border of the box.
    pub fn isosurface(
        distance: impl Fn(&Vec3) -> f64,
        low: Vec3,
        high: Vec3,
        cells: usize,
    ) -> Result<TriMesh, MeshError> {
        let size = high - low;
        if !(size.min() > 0.0 && (low.norm() + high.norm()).is_finite()) {
            return fault(format!("the box from {low:?} to {high:?} is empty"));
        }
        if !(2..=MAX_POINTS).contains(&cells) {
            return fault(format!("{cells} cells along the longest side; it must be 2 to {MAX_POINTS}"));
        }
        let step = size.max() / cells as f64;
        let counts: [usize; 3] = std::array::from_fn(|k| ((size[k] / step) - 1e-9).ceil().max(1.0) as usize + 1);
        let step = Vec3::from_fn(|k, _| size[k] / (counts[k] - 1) as f64);
        let place = |p: [usize; 3]| low + step.component_mul(&Vec3::from(p.map(|n| n as f64)));
        if counts.iter().try_fold(1_usize, |n, m| n.checked_mul(*m)).is_none_or(|n| n > MAX_POINTS) {
            return fault(format!("{counts:?} grid points; there may be at most {MAX_POINTS} in all"));
        }
        let mut values = Vec::with_capacity(counts.iter().product());
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                values.extend((0..counts[0]).map(|x| distance(&place([x, y, z]))));
            }
        }
        let zero = |a: Vec3, b: Vec3, da: f64, db: f64| root(&distance, a, b, da, db);
        surface(&values, counts, low, step, zero)
    }

    /// Returns the closed surface on which distances on a grid are zero, negative inside: `counts` points
    /// along x, y and z, x fastest, the first at `low` and the others `step` apart (m). Between them the
    /// distance is linear along edges.
    ///
    /// # Errors
    /// [`MeshError::Isosurface`]: a wrong number of values, or a fault as of [`TriMesh::isosurface`].
    pub fn isosurface_of_grid(values: &[f64], counts: [usize; 3], low: Vec3, step: Vec3) -> Result<TriMesh, MeshError> {
        let count = counts.iter().try_fold(1_usize, |n, m| n.checked_mul(*m));
        if count != Some(values.len()) || values.len() > MAX_POINTS || counts.iter().any(|n| *n < 2) {
            let expected = format!("expected 2 or more along each axis and at most {MAX_POINTS} in all");
            return fault(format!("{} values for {counts:?} grid points; {expected}", values.len()));
        }
        if !(step.min() > 0.0 && (step.norm() + low.norm()).is_finite()) {
            return fault(format!("cells of {step:?} m; they must be above 0"));
        }
        surface(values, counts, low, step, |_, _, a, b| a / (a - b))
    }
}

impl TriMesh {
    /// Returns [`isosurface_of_grid`](TriMesh::isosurface_of_grid) of a grid whose first point is `low` and whose last
    /// one is `high` (m).
    ///
    /// # Errors
    /// As [`isosurface_of_grid`](TriMesh::isosurface_of_grid).
    pub fn isosurface_within(values: &[f64], counts: [usize; 3], low: Vec3, high: Vec3) -> Result<TriMesh, MeshError> {
        let step = Vec3::from_fn(|k, _| (high[k] - low[k]) / counts[k].saturating_sub(1).max(1) as f64);
        TriMesh::isosurface_of_grid(values, counts, low, step)
    }
}

fn fault<T>(what: String) -> Result<T, MeshError> {
    Err(MeshError::Isosurface { what })
}

/// Returns the place between two points with values of opposite sign where a function is zero, by regula
/// falsi (Illinois).
fn root(f: &impl Fn(&Vec3) -> f64, a: Vec3, b: Vec3, mut fa: f64, mut fb: f64) -> f64 {
    let (mut s, mut t) = (0.0, 1.0);
    let mut middle = 0.5;
    for _ in 0..40 {
        middle = s + (t - s) * fa / (fa - fb);
        let value = f(&(a + (b - a) * middle));
        if t - s < 1e-6 || value == 0.0 || !value.is_finite() {
            break;
        }
        if (value < 0.0) == (fb < 0.0) {
            (t, fb, fa) = (middle, value, 0.5 * fa);
        } else {
            (s, fa, fb) = (middle, value, 0.5 * fb);
        }
    }
    middle
}

fn surface(
    values: &[f64],
    counts: [usize; 3],
    low: Vec3,
    step: Vec3,
    zero: impl Fn(Vec3, Vec3, f64, f64) -> f64,
) -> Result<TriMesh, MeshError> {
    let index = |p: [usize; 3]| (p[2] * counts[1] + p[1]) * counts[0] + p[0];
    let place = |p: [usize; 3]| low + step.component_mul(&Vec3::from(p.map(|n| n as f64)));
    let at_border = |p: [usize; 3]| (0..3).any(|k| p[k] == 0 || p[k] + 1 == counts[k]);
    let mut inside = 0;
    for z in 0..counts[2] {
        for y in 0..counts[1] {
            for x in 0..counts[0] {
                let (p, value) = ([x, y, z], values[index([x, y, z])]);
                if !value.is_finite() {
                    return fault(format!("the distance at {:?} is {value}", place(p)));
                }
                if value < 0.0 && at_border(p) {
                    return fault(format!(
                        "{:?}, at the border of the grid, is inside; the grid must surround the solid",
                        place(p)
                    ));
                }
                inside += usize::from(value < 0.0);
            }
        }
    }
    if inside == 0 {
        return fault("no grid point is inside; use more cells, or values that are negative inside".into());
    }
    let mut mesh = TriMesh::default();
    let mut known = BTreeMap::new();
    for z in 0..counts[2] - 1 {
        for y in 0..counts[1] - 1 {
            for x in 0..counts[0] - 1 {
                let corner = |mask: usize| [x + (mask & 1), y + (mask >> 1 & 1), z + (mask >> 2)];
                let below: [bool; 8] = std::array::from_fn(|mask| values[index(corner(mask))] < 0.0);
                if below.iter().all(|b| *b == below[0]) {
                    continue;
                }
                let mut cross = |a: usize, b: usize| -> u32 {
                    let (first, last) = (a.min(b), a.max(b));
                    *known.entry((index(corner(first)), last ^ first)).or_insert_with(|| {
                        let (p, q) = (place(corner(first)), place(corner(last)));
                        let t = zero(p, q, values[index(corner(first))], values[index(corner(last))]);
                        mesh.vertices.push(p + (q - p) * t.clamp(OFF_CORNER, 1.0 - OFF_CORNER));
                        mesh.vertices.len() as u32 - 1
                    })
                };
                for (n, order) in ORDERS.iter().enumerate() {
                    let second = 1 << order[0];
                    let mut corners = [0, second, second | 1 << order[1], 7];
                    if n % 2 == 1 {
                        corners.swap(1, 2);
                    }
                    mesh.triangles.extend(of_tetrahedron(&corners, &below, &mut cross));
                }
            }
        }
    }
    Ok(mesh)
}

/// Returns the triangles of a tetrahedron of positive volume; `cross` returns the vertex of an edge.
fn of_tetrahedron(
    corners: &[usize; 4],
    below: &[bool; 8],
    cross: &mut impl FnMut(usize, usize) -> u32,
) -> Vec<[u32; 3]> {
    // even permutations that put the corners of one side first
    const FIRST: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
    const PAIRS: [[usize; 4]; 6] = [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];
    let inside = corners.map(|c| below[c]);
    let count = inside.iter().filter(|b| **b).count();
    match count {
        1 | 3 => {
            let lone = (0..4).find(|k| inside[*k] == (count == 1)).unwrap_or(0);
            let [i, j, k, l] = FIRST[lone].map(|n| corners[n]);
            let triangle = [cross(i, j), cross(i, k), cross(i, l)];
            vec![if count == 1 { triangle } else { [triangle[0], triangle[2], triangle[1]] }]
        }
        2 => {
            let pair = PAIRS.iter().find(|pair| inside[pair[0]] && inside[pair[1]]).unwrap_or(&PAIRS[0]);
            let [i, j, k, l] = pair.map(|n| corners[n]);
            let quad = [cross(i, k), cross(i, l), cross(j, l), cross(j, k)];
            vec![[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
        }
        _ => Vec::new(),
    }
}
