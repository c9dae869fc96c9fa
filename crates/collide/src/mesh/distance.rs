//! Signed distance to the solid of a closed mesh.
//!
//! A binary tree of boxes finds the closest piece of the solid's boundary. The sign comes from the angle-weighted
//! pseudonormal of the closest feature (Baerentzen and Aanaes, *Signed distance computation using the angle weighted
//! pseudonormal*, 2005); at features next to faces that cross others, or where the surface is pinched, from the
//! winding number. Closest point on a triangle: Ericson, *Real-Time Collision Detection* (2005), §5.1.5.
//!
//! Where shells overlap or the surface crosses itself, the solid is what it goes around at least once: the union.
//! What of the surface is buried in it is no boundary and is passed over. Faces that cross too many others to be cut
//! are kept whole: next to those, a point inside may be told less than its depth, never more.

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
    /// On the surface.
    pub point: Vec3,
    /// Meters; negative inside.
    pub signed_distance: f64,
    /// Index of a triangle that holds the point.
    pub triangle: usize,
}

/// A mesh made ready for distance queries.
#[derive(Clone, Debug)]
pub struct MeshDistance {
    corners: Vec<[Vec3; 3]>,
    ids: Vec<u32>,
    /// Per piece: pseudonormals of its face, its edges (k to k+1) and its vertices; those in doubt are zero.
    normals: Vec<[Vec3; 7]>,
    tree: AabbTree,
    /// Where the surface crosses itself, is pinched, or has more than one shell.
    winding: Option<WindingNumber>,
}

impl MeshDistance {
    /// Prepares a closed, outward-wound mesh (see [`TriMesh::check_closed`]) of at least one triangle.
    pub fn new(mesh: &TriMesh) -> MeshDistance {
        MeshDistance::from_boundary(mesh, Boundary::of(mesh))
    }

    /// The same of a mesh that is known not to cross itself: that is not looked for, which takes longer than all else.
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

    /// The closest point of the solid's boundary and the signed distance.
    pub fn closest(&self, p: &Vec3) -> ClosestPoint {
        self.closest_approximate(p, usize::MAX)
    }

    /// The closest point found when at most about `upper_bound` triangles are looked at, near ones first. That is all but always the
    /// closest there is; from the middle of a sphere, all triangles are about as far, and what is found is about that.
    pub(crate) fn closest_approximate(&self, p: &Vec3, max_triangles: usize) -> ClosestPoint {
        let mut best = (f64::INFINITY, Vec3::zeros(), 0, 0);
        let mut left = max_triangles;
        self.search(0, p, &mut best, &mut left);
        let (square, point, n, feature) = best;
        let sign = if self.inside(p, &point, &self.normals[n][feature]) { -1.0 } else { 1.0 };
        ClosestPoint { point, signed_distance: sign * square.sqrt(), triangle: self.ids[n] as usize }
    }

    /// Calls `each` with the index of every triangle within `radius` meters of `p`, its closest point and that point's
    /// feature (see [`closest_on_triangle`]).
    pub(crate) fn within(&self, p: &Vec3, radius: f64, each: &mut dyn FnMut(usize, Vec3, usize)) {
        self.search_within(0, p, radius * radius, each);
    }

    /// Goes down the tree of boxes where `to` hopes to find something, where most of it first.
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

/// A search for the most of something among the triangles of a mesh.
pub(crate) trait BestFirstSearch {
    /// No less than what any triangle in a box has.
    fn upper_bound(&self, bounds: &Aabb) -> f64;
    /// What has no more than this is passed over.
    fn threshold(&self) -> f64;
    /// A triangle that may have more.
    fn visit_triangle(&mut self, t: usize);
}

/// Normals that tell no side are zero.
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

/// Outward unit normals of the triangles; zero where there is no area.
pub(crate) fn face_normals(mesh: &TriMesh) -> Vec<Vec3> {
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
    (0..mesh.triangles.len()).map(|t| normal(mesh.corners(t))).collect()
}

/// Face (0), edges (1–3) and vertices (4–6) of every triangle. `groups`: the edges of the mesh.
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
