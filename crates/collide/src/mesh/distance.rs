//! Signed distance to the solid of a closed mesh.
//!
//! A binary tree of boxes finds the closest piece of the solid's boundary. The sign comes from the
//! angle-weighted pseudonormal of the closest feature (Baerentzen and Aanaes, *Signed distance
//! computation using the angle weighted pseudonormal*, 2005). At features next to crossing faces,
//! or where the surface is pinched, it comes from the winding number.
//!
//! If shells overlap or the surface crosses itself, the solid is the space that the surface
//! encloses at least once: the union. Surface inside the union is not boundary and is skipped.
//! Faces that cross too many others to be cut are kept whole: next to them, the depth of an inside
//! point can be too small, never too large.

use super::TriMesh;
use super::aabb_tree::AabbTree;
use super::crossing::Crossings;
use super::edges::{EdgeGroups, edge_groups};
use super::triangle::closest_on_triangle;
use super::union::{Boundary, Trust};
use super::winding::WindingNumber;
use crate::{Aabb, Vec3};
use nalgebra::ComplexField;

/// The closest point of a mesh to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// A point of the surface.
    pub point: Vec3,
    /// Meters; negative inside.
    pub signed_distance: f64,
    /// Index of a triangle that contains the point.
    pub triangle: usize,
}

/// A closest point whose side is not known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    square: f64,
    point: Vec3,
    /// The piece in leaf order, and the feature of the point.
    n: usize,
    feature: usize,
}

impl Nearest {
    /// Returns the distance, meters.
    pub fn distance(&self) -> f64 {
        self.square.sqrt()
    }
}

/// A mesh prepared for distance queries.
#[derive(Clone, Debug)]
pub struct MeshDistance {
    corners: Vec<[Vec3; 3]>,
    ids: Vec<u32>,
    /// Per piece: pseudonormals of its face, its edges (k to k+1) and its vertices; zero if they do
    /// not determine the side.
    normals: Vec<[Vec3; 7]>,
    tree: AabbTree,
    /// Present if the surface crosses itself, is pinched, or has more than one shell.
    winding: Option<WindingNumber>,
}

impl MeshDistance {
    /// Prepares a closed, outward-wound mesh (see [`TriMesh::check_closed`]) of at least one
    /// triangle.
    pub fn new(mesh: &TriMesh) -> MeshDistance {
        MeshDistance::from_boundary(mesh, Boundary::of(mesh))
    }

    /// Prepares a mesh that is known not to cross itself. Skips the search for crossings, which
    /// takes most of the time.
    pub(crate) fn without_crossings(mesh: &TriMesh) -> MeshDistance {
        MeshDistance::from_boundary(mesh, Boundary::from_crossings(mesh, &Crossings::default()))
    }

    fn from_boundary(mesh: &TriMesh, (boundary, winding): (Boundary, Option<WindingNumber>)) -> MeshDistance {
        let normals = pseudonormals(mesh, &edge_groups(mesh));
        let tree = AabbTree::new(&boundary.pieces.iter().map(|p| p.corners).collect::<Vec<_>>());
        let sorted: Vec<_> = tree.ids.iter().map(|&n| &boundary.pieces[n as usize]).collect();
        MeshDistance {
            corners: sorted.iter().map(|p| p.corners).collect(),
            normals: sorted.iter().map(|p| trusted_normals(&normals[p.face as usize], p.trust)).collect(),
            ids: sorted.iter().map(|p| p.face).collect(),
            tree,
            winding,
        }
    }

    /// Returns the closest point of the solid's boundary and the signed distance.
    pub fn closest(&self, p: &Vec3) -> ClosestPoint {
        self.closest_approximate(p, usize::MAX)
    }

    /// Returns the closest point found among at most about `max_triangles` triangles, near ones
    /// first. Almost always that is the exact result. From the middle of a sphere all triangles are
    /// about equally far, and the result has about that distance.
    pub(crate) fn closest_approximate(&self, p: &Vec3, max_triangles: usize) -> ClosestPoint {
        let nearest = self.nearest_among(p, max_triangles);
        let signed_distance = self.signed(p, &nearest);
        ClosestPoint { point: nearest.point, signed_distance, triangle: self.ids[nearest.n] as usize }
    }

    /// Returns the closest point without its side, which [`MeshDistance::signed`] finds: that takes most of the time
    /// where a surface crosses itself.
    pub(crate) fn nearest(&self, p: &Vec3) -> Nearest {
        self.nearest_among(p, usize::MAX)
    }

    /// Returns the signed distance of a point whose nearest point is known, meters.
    pub(crate) fn signed(&self, p: &Vec3, nearest: &Nearest) -> f64 {
        let Nearest { square, point, n, feature } = *nearest;
        let sign = if self.inside(p, &point, &self.normals[n][feature]) { -1.0 } else { 1.0 };
        sign * square.sqrt()
    }

    fn nearest_among(&self, p: &Vec3, max_triangles: usize) -> Nearest {
        let mut best = (f64::INFINITY, Vec3::zeros(), 0, 0);
        let mut left = max_triangles;
        self.search(0, p, &mut best, &mut left);
        let (square, point, n, feature) = best;
        Nearest { square, point, n, feature }
    }

    /// Returns the tree of boxes around the pieces of the boundary.
    pub(crate) fn tree(&self) -> &AabbTree {
        &self.tree
    }

    /// Returns the corners of a piece of the boundary, by its number in the leaves.
    pub(crate) fn piece(&self, n: usize) -> [Vec3; 3] {
        self.corners[n]
    }

    /// Calls `each` for every triangle within `radius` meters of `p`, with its index, its closest
    /// point and the feature of that point (see [`closest_on_triangle`]).
    pub(crate) fn within(&self, p: &Vec3, radius: f64, each: &mut dyn FnMut(usize, Vec3, usize)) {
        self.search_within(0, p, radius * radius, each);
    }

    /// Searches the tree of boxes, the child with the larger bound first.
    pub(crate) fn descend(&self, to: &mut impl BestFirstSearch) {
        self.search_node(0, to);
    }

    fn search_node(&self, node: usize, to: &mut impl BestFirstSearch) {
        let here = &self.tree.nodes[node];
        if here.count > 0 {
            return here.range().for_each(|n| to.visit_triangle(self.ids[n] as usize));
        }
        let mut children = [node + 1, here.second as usize].map(|c| (to.upper_bound(&self.tree.nodes[c].bounds), c));
        if children[1].0 > children[0].0 {
            children.swap(0, 1);
        }
        for (upper_bound, child) in children {
            if upper_bound > to.threshold() {
                self.search_node(child, to);
            }
        }
    }

    fn search_within(&self, node: usize, p: &Vec3, square: f64, each: &mut dyn FnMut(usize, Vec3, usize)) {
        let here = &self.tree.nodes[node];
        let near = box_distance_squared(&here.bounds, p) <= square;
        if !near {
            return;
        }
        if here.count == 0 {
            self.search_within(node + 1, p, square, each);
            return self.search_within(here.second as usize, p, square, each);
        }
        for n in here.range() {
            let (q, feature) = closest_on_triangle(p, &self.corners[n]);
            if (p - q).norm_squared() <= square {
                each(self.ids[n] as usize, q, feature);
            }
        }
    }

    fn inside(&self, p: &Vec3, closest: &Vec3, pseudonormal: &Vec3) -> bool {
        match &self.winding {
            Some(winding) if *pseudonormal == Vec3::zeros() => winding.contains(p),
            _ => pseudonormal.dot(&(p - closest)) < 0.0,
        }
    }

    fn search(&self, node: usize, p: &Vec3, best: &mut (f64, Vec3, usize, usize), left: &mut usize) {
        let here = &self.tree.nodes[node];
        if here.count > 0 {
            for n in here.range() {
                let (q, feature) = closest_on_triangle(p, &self.corners[n]);
                let square = (p - q).norm_squared();
                if square < best.0 {
                    *best = (square, q, n, feature);
                }
            }
            *left = left.saturating_sub(here.count as usize);
            return;
        }
        let mut children =
            [node + 1, here.second as usize].map(|c| (box_distance_squared(&self.tree.nodes[c].bounds, p), c));
        if children[1].0 < children[0].0 {
            children.swap(0, 1);
        }
        for (square, child) in children {
            if square < best.0 && *left > 0 {
                self.search(child, p, best, left);
            }
        }
    }
}

/// A branch-and-bound search for a maximum over the triangles of a mesh.
pub(crate) trait BestFirstSearch {
    /// Returns an upper bound of the value of all triangles in a box.
    fn upper_bound(&self, bounds: &Aabb) -> f64;
    /// Returns the value that a box must exceed to be searched.
    fn threshold(&self) -> f64;
    /// Evaluates a triangle.
    fn visit_triangle(&mut self, t: usize);
}

/// Returns the normals, with those that do not determine the side set to zero.
fn trusted_normals(normals: &[Vec3; 7], trust: Trust) -> [Vec3; 7] {
    match trust {
        Trust::All => *normals,
        Trust::Face => std::array::from_fn(|k| if k == 0 { normals[0] } else { Vec3::zeros() }),
        Trust::None => [Vec3::zeros(); 7],
    }
}

pub(crate) fn box_distance_squared(b: &Aabb, p: &Vec3) -> f64 {
    (p - p.zip_zip_map(&b.min, &b.max, |x, low, high| x.clamp(low, high))).norm_squared()
}

/// Returns the outward unit normals of the triangles; zero for triangles without area.
pub(crate) fn face_normals(mesh: &TriMesh) -> Vec<Vec3> {
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
    (0..mesh.triangles.len()).map(|t| normal(mesh.corners(t))).collect()
}

/// Returns the pseudonormals of the face (0), edges (1–3) and vertices (4–6) of every triangle.
/// `groups` are the edges of the mesh.
pub(crate) fn pseudonormals(mesh: &TriMesh, groups: &EdgeGroups) -> Vec<[Vec3; 7]> {
    let face = face_normals(mesh);
    let mut all: Vec<[Vec3; 7]> = face.iter().map(|n| [*n; 7]).collect();
    for group in groups.iter() {
        let sum: Vec3 = group.iter().map(|u| face[u.face]).sum();
        for u in group {
            let t = mesh.triangles[u.face];
            let from = if u.forward { u.low } else { u.high };
            let k = (0..3).find(|&k| t[k] == from).unwrap_or(0);
            all[u.face][1 + k] = sum;
        }
    }
    let mut vertex = vec![Vec3::zeros(); mesh.vertices.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let p = mesh.corners(t);
        for k in 0..3 {
            let [u, v] = [p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]];
            let cos = (u.dot(&v) / (u.norm() * v.norm())).clamp(-1.0, 1.0);
            let angle = if cos.is_nan() { 0.0 } else { ComplexField::acos(cos) };
            vertex[triangle[k] as usize] += face[t] * angle;
        }
    }
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            all[t][4 + k] = vertex[triangle[k] as usize];
        }
    }
    all
}
