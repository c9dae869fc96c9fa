//! The triangles of a closed mesh, with the data for distances and normals.

use super::Closest;
use super::cell_view::{NearTriangle, order};
use crate::mesh::{AabbTree, EdgeGroups, box_distance_squared, closest_on_triangle, pseudonormals};
use crate::sdf::{Feature, Hit, TOUCHING};
use crate::{TriMesh, Vec3};
use std::sync::OnceLock;

/// Maximum distance beyond the closest triangle up to which triangles that face another side are
/// listed, as a fraction of the diagonal.
const FACE_CHOICE_RANGE: f64 = 0.01;
/// Fraction of the squared distance along a face's normal from which a point is directly above the
/// face.
const STRAIGHT_ABOVE: f64 = 1.0 - 1e-6;
/// Factor for rounding in comparisons of squared distances from boxes.
const SQUARE_ROUNDING: f64 = 1.0 + 1e-9;

#[derive(Clone, Debug)]
pub(super) struct Triangles {
    pub corners: Vec<[Vec3; 3]>,
    /// Unit pseudonormals of the face, its edges and its corners: [`pseudonormals`].
    pub normals: Vec<[Vec3; 7]>,
    /// Built by the first query.
    boxes: OnceLock<AabbTree>,
    /// Whether the edges of each triangle (k to k+1) are elements.
    searched: Vec<[bool; 3]>,
    /// Distance beside a face up to which a place on an edge is treated as above it, meters.
    pub touching: f64,
    /// Diagonal of the mesh, meters.
    pub diagonal: f64,
    /// Mean length of the edges, meters.
    pub mean_edge: f64,
    /// Maximum distance beyond the closest face up to which another face can be selected, meters.
    pub around: f64,
}

impl Triangles {
    pub fn new(mesh: &TriMesh, groups: &EdgeGroups, searched: Vec<[bool; 3]>) -> Triangles {
        let diagonal = mesh.diagonal();
        let unit = |n: [Vec3; 7]| n.map(|v| v.try_normalize(0.0).unwrap_or_default());
        let corners: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let lengths: f64 = corners.iter().map(|[a, b, _]| (b - a).norm()).sum();
        Triangles {
            mean_edge: lengths / corners.len() as f64,
            corners,
            normals: pseudonormals(mesh, groups).into_iter().map(unit).collect(),
            boxes: OnceLock::new(),
            searched,
            touching: TOUCHING * diagonal,
            diagonal,
            around: FACE_CHOICE_RANGE * diagonal,
        }
    }

    pub fn closest_of(&self, p: &Vec3, triangle: usize) -> Closest {
        let (point, feature) = closest_on_triangle(p, &self.corners[triangle]);
        Closest { square: (p - point).norm_squared(), point, triangle, feature }
    }

    /// Returns the squared distance from a triangle's plane.
    pub fn above(&self, p: &Vec3, triangle: usize) -> f64 {
        self.normals[triangle][0].dot(&(p - self.corners[triangle][0])).powi(2)
    }

    /// Returns the hit of `p` for the closest point of a triangle.
    pub fn describe(&self, p: &Vec3, found: &Closest) -> Hit {
        let (face, normal) = (self.normals[found.triangle][0], self.normals[found.triangle][found.feature]);
        let (offset, length) = (p - found.point, found.square.sqrt());
        let sign = if normal.dot(&offset) < 0.0 { -1.0 } else { 1.0 };
        let flat = found.feature == 0
            || normal.dot(&face) > 1.0 - 1e-9
            || (length > self.touching && self.above(p, found.triangle) > STRAIGHT_ABOVE * found.square);
        let normal = match flat {
            true => face,
            false if length > self.touching => offset * (sign / length),
            false => normal,
        };
        let feature = match found.feature {
            _ if flat => Feature::Face,
            k @ 1..=3 => {
                let c = &self.corners[found.triangle];
                let along = (c[k % 3] - c[k - 1]).normalize();
                if self.searched[found.triangle][k - 1] { Feature::Edge(along) } else { Feature::Line(along) }
            }
            _ => Feature::Point,
        };
        let distance = sign * length;
        Hit { distance, nearest: distance, normal, core: 0.0, feature, facing: true }
    }

    pub fn boxes(&self) -> &AabbTree {
        self.boxes.get_or_init(|| AabbTree::new(&self.corners))
    }

    /// Returns the triangle closest to `p` among those that `passed` accepts, the first of equals.
    pub fn closest_near(&self, p: &Vec3, passed: impl Fn(u32) -> bool) -> Option<NearTriangle> {
        let tree = self.boxes();
        let square = |n: usize| box_distance_squared(&tree.nodes[n].bounds, p);
        let mut best: Option<NearTriangle> = None;
        let mut open = vec![(square(0), 0)];
        while let Some((nearest, n)) = open.pop() {
            if best.is_some_and(|best| nearest > best.distance.powi(2) * SQUARE_ROUNDING) {
                continue;
            }
            let node = &tree.nodes[n];
            for k in node.range() {
                let near = self.near(p, tree.ids[k]);
                if best.is_none_or(|best| order(&near, &best).is_lt()) && passed(near.triangle) {
                    best = Some(near);
                }
            }
            if node.count == 0 {
                let mut children = [n + 1, node.second as usize].map(|child| (square(child), child));
                // the nearer one is visited first
                children.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
                open.extend(children);
            }
        }
        best
    }

    /// Calls `each` with the triangles whose boxes are within `radius` of `p`, until it returns
    /// false.
    pub fn each_within(&self, p: &Vec3, radius: f64, mut each: impl FnMut(u32) -> bool) {
        let tree = self.boxes();
        let mut open = vec![0];
        while let Some(n) = open.pop() {
            let node = &tree.nodes[n];
            if box_distance_squared(&node.bounds, p) > radius * radius * SQUARE_ROUNDING {
                continue;
            }
            if node.count == 0 {
                open.extend([node.second as usize, n + 1]);
            }
            if !node.range().all(|k| each(tree.ids[k])) {
                return;
            }
        }
    }
}
