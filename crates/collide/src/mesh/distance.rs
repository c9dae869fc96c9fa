//! Signed distance to a closed mesh.
//!
//! A binary tree of boxes finds the closest triangle; the sign comes from the angle-weighted pseudonormal of the
//! closest feature. Source: Baerentzen and Aanaes, *Signed distance computation using the angle weighted
//! pseudonormal* (2005); closest point on a triangle: Ericson, *Real-Time Collision Detection* (2005), §5.1.5. Where
//! shells overlap, a point within the union may count as outside, never the other way round.

use super::TriMesh;
use super::check::edge_groups;
use crate::{Aabb, Vec3};
use nalgebra::ComplexField;

/// Triangles per leaf box.
const LEAF: usize = 4;

/// The closest point of a mesh to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// On the surface.
    pub point: Vec3,
    /// Metres; negative inside.
    pub signed_distance: f64,
    /// Index of a triangle that holds the point.
    pub triangle: usize,
}

/// A mesh made ready for distance queries.
#[derive(Clone, Debug)]
pub struct MeshDistance {
    corners: Vec<[Vec3; 3]>,
    ids: Vec<u32>,
    /// Per triangle: pseudonormals of its face, its edges (k to k+1) and its vertices.
    normals: Vec<[Vec3; 7]>,
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    /// Leaf: range of triangles. Inner: the left child is the next node, the right one is `second`.
    first: u32,
    count: u32,
    second: u32,
}

impl MeshDistance {
    /// Prepares a closed, outward-wound mesh (see [`TriMesh::check_closed`]) of at least one triangle.
    pub fn new(mesh: &TriMesh) -> MeshDistance {
        let normals = pseudonormals(mesh);
        let mut items: Vec<(Vec3, u32)> =
            (0..mesh.triangles.len()).map(|t| (mesh.corners(t).iter().sum::<Vec3>() / 3.0, t as u32)).collect();
        let mut nodes = Vec::new();
        split(mesh, &mut items, 0, &mut nodes);
        let ids: Vec<u32> = items.iter().map(|i| i.1).collect();
        MeshDistance {
            corners: ids.iter().map(|&t| mesh.corners(t as usize)).collect(),
            normals: ids.iter().map(|&t| normals[t as usize]).collect(),
            ids,
            nodes,
        }
    }

    /// The closest surface point and the signed distance.
    pub fn closest(&self, p: &Vec3) -> ClosestPoint {
        let mut best = (f64::INFINITY, Vec3::zeros(), 0, 0);
        self.search(0, p, &mut best);
        let (square, point, n, feature) = best;
        let outward = self.normals[n][feature].dot(&(p - point));
        let sign = if outward < 0.0 { -1.0 } else { 1.0 };
        ClosestPoint { point, signed_distance: sign * square.sqrt(), triangle: self.ids[n] as usize }
    }

    /// Calls `each` with the index of every triangle within `radius` metres of `p`, its closest point and that point's
    /// feature (see [`closest_on_triangle`]).
    pub(crate) fn within(&self, p: &Vec3, radius: f64, each: &mut dyn FnMut(usize, Vec3, usize)) {
        self.search_within(0, p, radius * radius, each);
    }

    fn search_within(&self, node: usize, p: &Vec3, square: f64, each: &mut dyn FnMut(usize, Vec3, usize)) {
        let here = &self.nodes[node];
        // written so that a radius that is not a number finds nothing
        if !(box_distance_squared(&here.bounds, p) <= square) {
            return;
        }
        if here.count == 0 {
            self.search_within(node + 1, p, square, each);
            return self.search_within(here.second as usize, p, square, each);
        }
        for n in here.first as usize..(here.first + here.count) as usize {
            let (q, feature) = closest_on_triangle(p, &self.corners[n]);
            if (p - q).norm_squared() <= square {
                each(self.ids[n] as usize, q, feature);
            }
        }
    }

    fn search(&self, node: usize, p: &Vec3, best: &mut (f64, Vec3, usize, usize)) {
        let here = &self.nodes[node];
        if here.count > 0 {
            for n in here.first as usize..(here.first + here.count) as usize {
                let (q, feature) = closest_on_triangle(p, &self.corners[n]);
                let square = (p - q).norm_squared();
                if square < best.0 {
                    *best = (square, q, n, feature);
                }
            }
            return;
        }
        let mut children =
            [node + 1, here.second as usize].map(|c| (box_distance_squared(&self.nodes[c].bounds, p), c));
        if children[1].0 < children[0].0 {
            children.swap(0, 1);
        }
        for (square, child) in children {
            if square < best.0 {
                self.search(child, p, best);
            }
        }
    }
}

/// Builds the nodes of `items` in pre-order by halving along the longest side. Depth is at most 64 by halving.
fn split(mesh: &TriMesh, items: &mut [(Vec3, u32)], first: usize, nodes: &mut Vec<Node>) {
    let bounds = Aabb::around(items.iter().flat_map(|i| mesh.corners(i.1 as usize)));
    let index = nodes.len();
    nodes.push(Node { bounds, first: first as u32, count: items.len() as u32, second: 0 });
    if items.len() <= LEAF {
        return;
    }
    let axis = (bounds.max - bounds.min).imax();
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let (left, right) = items.split_at_mut(half);
    split(mesh, left, first, nodes);
    nodes[index].count = 0;
    nodes[index].second = nodes.len() as u32;
    split(mesh, right, first + half, nodes);
}

fn box_distance_squared(b: &Aabb, p: &Vec3) -> f64 {
    (p - p.zip_zip_map(&b.min, &b.max, |x, low, high| x.clamp(low, high))).norm_squared()
}

/// Face (0), edges (1–3) and vertices (4–6) of every triangle.
pub(crate) fn pseudonormals(mesh: &TriMesh) -> Vec<[Vec3; 7]> {
    let face: Vec<Vec3> = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
        })
        .collect();
    let mut all: Vec<[Vec3; 7]> = face.iter().map(|n| [*n; 7]).collect();
    for group in edge_groups(mesh) {
        let sum: Vec3 = group.iter().map(|u| face[u.face]).sum();
        for u in &group {
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

/// The closest point of a triangle and its feature: 0 the face, 1–3 the edge from corner k to k+1, 4–6 a corner.
pub(crate) fn closest_on_triangle(p: &Vec3, [a, b, c]: &[Vec3; 3]) -> (Vec3, usize) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, 4);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, 5);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), 1);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, 6);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), 3);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), 2);
    }
    let scale = 1.0 / (va + vb + vc);
    (a + ab * (vb * scale) + ac * (vc * scale), 0)
}
