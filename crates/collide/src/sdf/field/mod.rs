//! The signed distance field of a mesh in an [`octree`]: each cell near the surface lists the few
//! triangles that can be closest to a point in it.
//!
//! Distances are exact; nothing is interpolated. A query in a cell without a list uses the tree of
//! boxes ([`MeshDistance`]). Cells and boxes are built by the first query that needs them
//! ([`blocks`]).
//!
//! A cell also lists slightly further triangles that face another side. If an element on a ridge
//! cannot touch the closest face, the next one is used.

mod blocks;
mod builder;
mod cell_view;
mod faces;
mod near_line;
mod octree;
mod triangles;

use super::{DistanceField, Feature, Hit, facing, opposition};
use crate::mesh::{EdgeGroups, closest_on_triangle, shells};
use crate::{Mat3, MeshDistance, TriMesh, Vec3};
use arrayvec::ArrayVec;
pub(crate) use near_line::{Segment, TriangleNearLine};
pub(crate) use octree::FrameMap;
use octree::{CellPoint, Octree};
use std::sync::OnceLock;
use triangles::Triangles;

/// Relative difference of squared distances that is due to rounding.
const SAME_SQUARE: f64 = 1e-11;
/// Difference of opposition that is due to rounding.
const SAME_OPPOSITION: f64 = 1e-9;
/// Maximum number of sides of a convex solid that every bound tests.
const MAX_SIDES: usize = 16;
/// A triangle in the list of a cell.
#[derive(Clone, Copy, Debug)]
struct ListedTriangle {
    triangle: u32,
    /// Lower bound of its distance from the cell's center; ascending along a list.
    nearer: f32,
}

/// The field of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct MeshField {
    /// Faces of the same shell do not cross.
    mesh: TriMesh,
    triangles: Triangles,
    /// Number of triangles around each vertex.
    valence: Vec<u32>,
    tree: Octree,
    /// Bounding sphere of each triangle: center relative to the middle of the bounds, and radius.
    spheres: Vec<[f32; 4]>,
    /// Built on first use.
    boxes: OnceLock<MeshDistance>,
    convex: bool,
    /// For a convex solid with few sides: their outward normals and distances from the origin. They
    /// give better bounds than cells.
    sides: ArrayVec<(Vec3, f64), MAX_SIDES>,
}

/// The closest point of a triangle.
#[derive(Clone, Copy)]
struct Closest {
    square: f64,
    point: Vec3,
    triangle: usize,
    feature: usize,
}

impl MeshField {
    /// Builds the field. `groups` are the edges of the mesh, `searched` the edges of each triangle
    /// that are elements, `convex` the result of [`is_convex`].
    pub fn new(mesh: TriMesh, groups: &EdgeGroups, searched: Vec<[bool; 3]>, convex: bool) -> MeshField {
        let triangles = Triangles::new(&mesh, groups, searched);
        let (center, half, deepest) = triangles.outermost(&mesh.aabb());
        let mut field = MeshField {
            valence: valence(&mesh),
            spheres: triangles.corners.iter().map(|c| sphere_around(c, &center, triangles.diagonal)).collect(),
            mesh,
            triangles,
            tree: Octree::new(center, half, deepest),
            boxes: OnceLock::new(),
            convex,
            sides: ArrayVec::new(),
        };
        field.sides = field.convex_sides();
        field
    }

    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    fn boxes(&self) -> &MeshDistance {
        self.boxes.get_or_init(|| MeshDistance::without_crossings(&self.mesh))
    }

    /// Returns the planes of a convex solid's sides; empty if it is not convex or has too many.
    fn convex_sides(&self) -> ArrayVec<(Vec3, f64), MAX_SIDES> {
        let mut sides = ArrayVec::new();
        for (corners, normals) in self.triangles.corners.iter().zip(&self.triangles.normals) {
            // at the height of its highest corner, so that rounding leaves none outside
            let side = (normals[0], corners.iter().map(|c| normals[0].dot(c)).fold(f64::NEG_INFINITY, f64::max));
            let known =
                |s: &(Vec3, f64)| (s.0 - side.0).norm() < 1e-12 && (s.1 - side.1).abs() < 1e-12 * self.diagonal();
            if !self.convex || !(sides.iter().any(known) || sides.try_push(side).is_ok()) {
                return ArrayVec::new();
            }
        }
        sides
    }

    /// Returns a lower bound of the signed distance at `p`, given the bound of the octree.
    #[inline]
    fn tighten_by_sides(&self, p: &Vec3, bound: f64) -> f64 {
        if self.sides.is_empty() { bound } else { self.distance_above_sides(p).max(bound) }
    }

    /// Returns a lower bound of the height of `p` above the highest side plane.
    #[inline(never)]
    fn distance_above_sides(&self, p: &Vec3) -> f64 {
        let slack = 1e-11 * self.diagonal();
        self.sides.iter().map(|(n, height)| n.dot(p) - height - slack).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns center and radius of a bounding sphere of triangle `t`.
    pub fn sphere(&self, t: usize) -> (Vec3, f64) {
        let [x, y, z, radius] = self.spheres[t].map(f64::from);
        (self.tree.center + Vec3::new(x, y, z), radius)
    }

    /// Returns the closest of a cell's listed triangles. Of those that share the closest point, it
    /// is the one that faces `p` most directly.
    ///
    /// The list is ordered by distance from the center `c`: `dist(p, t) ≥ dist(c, t) − |p − c|`
    /// ends the search.
    fn closest(&self, p: &Vec3, place: &CellPoint) -> Option<Closest> {
        let mut best: Option<Closest> = None;
        let (mut limit, mut reach, mut furthest) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
        let (aside, from_center) = (f64::from(place.offset_length()) + self.tree.rounding(), p - self.tree.center);
        for listed in place.list() {
            if f64::from(listed.nearer) > furthest {
                break;
            }
            let t = listed.triangle as usize;
            let [x, y, z, radius] = self.spheres[t].map(f64::from);
            if (from_center - Vec3::new(x, y, z)).norm_squared() > (reach + radius).powi(2) {
                continue;
            }
            let (point, feature) = closest_on_triangle(p, &self.triangles.corners[t]);
            let square = (p - point).norm_squared();
            if square > limit {
                continue;
            }
            let better = |b: &Closest| {
                square < b.square * (1.0 - SAME_SQUARE)
                    || (square <= b.square * (1.0 + SAME_SQUARE)
                        && self.triangles.above(p, t) > self.triangles.above(p, b.triangle))
            };
            if best.as_ref().is_none_or(better) {
                best = Some(Closest { square, point, triangle: t, feature });
                limit = square * (1.0 + SAME_SQUARE);
                reach = limit.sqrt();
                furthest = reach + aside;
            }
        }
        best
    }

    /// Returns the closest part of the surface, whatever an element faces.
    pub fn nearest(&self, p: &Vec3) -> Hit {
        self.nearest_in(p, self.tree.locate(p, &self.triangles).as_ref())
    }

    /// Returns the closest part if it can be within `limit`; otherwise a lower bound.
    pub fn nearest_within(&self, p: &Vec3, limit: f64) -> Result<Hit, f64> {
        let place = self.tree.locate(p, &self.triangles);
        let bound = place.map_or_else(|| self.tree.bound(p, &self.triangles), |place| self.tree.bound_at(&place));
        let bound = self.tighten_by_sides(p, bound);
        if bound > limit { Err(bound) } else { Ok(self.nearest_in(p, place.as_ref())) }
    }

    fn nearest_in(&self, p: &Vec3, place: Option<&CellPoint>) -> Hit {
        let closest = place.and_then(|place| self.closest(p, place));
        self.triangles.describe(p, &closest.unwrap_or_else(|| self.closest_by_tree(p)))
    }

    /// Returns the diagonal of the mesh, meters.
    pub fn diagonal(&self) -> f64 {
        self.triangles.diagonal
    }

    /// Returns the distance beside a face up to which a place on an edge is treated as above it,
    /// meters.
    pub fn touching(&self) -> f64 {
        self.triangles.touching
    }

    /// Computes [`DistanceField::hit`] from the result of [`MeshField::nearest`].
    pub fn hit_from_nearest(&self, p: &Vec3, hit: Hit, normals: &[Vec3], beside: f64) -> Hit {
        let beside = beside * self.diagonal();
        let faces = facing(normals, &hit.normal);
        let clear = faces && (hit.feature == Feature::Face || hit.distance.abs() > beside);
        if clear || hit.distance > beside {
            return Hit { facing: clear, ..hit };
        }
        let list = self.tree.locate(p, &self.triangles).map_or(&[][..], |place| place.list());
        self.closest_facing(p, normals, list, hit.distance, beside).unwrap_or(Hit { facing: faces, ..hit })
    }

    /// Returns the map for [`MeshField::bound_mapped`]; `None` if the sides of a convex solid give
    /// better bounds.
    pub fn frame_map(&self, rotation: &Mat3, translation: &Vec3, reach: f64) -> Option<FrameMap> {
        self.sides.is_empty().then(|| self.tree.frame_map(rotation, translation, reach))
    }

    /// Returns a lower bound of the signed distance of a point in another frame.
    #[inline]
    pub fn bound_mapped(&self, way: &FrameMap, p: &[f32; 3]) -> f64 {
        self.tree.bound_mapped(way, p, &self.triangles)
    }

    /// Calls `each` with every triangle that can be within `reach` of a segment, until it returns
    /// false. Returns whether all were visited.
    pub fn each_near_line<'a>(
        &'a self,
        segment: &Segment,
        reach: f64,
        each: impl FnMut(TriangleNearLine<'a>) -> bool,
    ) -> bool {
        self.triangles.each_near_line(segment, reach, each)
    }

    /// Returns the closest point by the tree of boxes.
    fn closest_by_tree(&self, p: &Vec3) -> Closest {
        self.triangles.closest_of(p, self.boxes().closest(p).triangle)
    }

    /// Returns the closest listed face that the element can touch, with `p` behind or on it, and
    /// not much further than `nearest`: the far side of the solid is excluded.
    fn closest_facing(
        &self,
        p: &Vec3,
        normals: &[Vec3],
        list: &[ListedTriangle],
        nearest: f64,
        aside: f64,
    ) -> Option<Hit> {
        let mut best: Option<(f64, f64, Hit)> = None;
        for listed in list {
            let t = listed.triangle as usize;
            let normal = self.triangles.normals[t][0];
            let above = normal.dot(&(p - self.triangles.corners[t][0]));
            if above > aside || !facing(normals, &normal) {
                continue;
            }
            let (point, _) = closest_on_triangle(p, &self.triangles.corners[t]);
            let (distance, square) = ((p - point).norm(), opposition(normals, &normal));
            if distance > nearest.abs() + self.triangles.around {
                continue;
            }
            // of two triangles of one side, the one above or below which the point lies
            let squarer = |b: &(f64, f64, Hit)| {
                square < b.1 - SAME_OPPOSITION || (square < b.1 + SAME_OPPOSITION && distance < b.0)
            };
            let nearer = |b: &(f64, f64, Hit)| distance < b.0 - aside || (distance < b.0 + aside && squarer(b));
            if best.as_ref().is_none_or(nearer) {
                // within the tolerance beyond an edge, the point is still above or below the face
                let beside = (p - point - normal * above).norm();
                let distance_signed = if above > 0.0 || beside < aside { above } else { -distance };
                let hit =
                    Hit { distance: distance_signed, nearest, normal, core: 0.0, feature: Feature::Face, facing: true };
                best = Some((distance, square, hit));
            }
        }
        best.map(|b| b.2)
    }

    /// Calls `each`, with a feature id and a hit, for every local minimum of the distance from `p`
    /// (outside the solid) within `radius`: a closest point inside a triangle, or on an edge or
    /// corner if it is the closest point of all triangles there. If very many triangles are within
    /// `radius`, only the nearest ones are tested.
    pub fn minima(&self, p: &Vec3, mut radius: f64, each: &mut dyn FnMut(u64, Hit)) {
        let closest = self.boxes().closest(p);
        let least = closest.signed_distance;
        if least < 0.0 {
            return each(closest.triangle as u64, self.hit_on(p, closest.triangle));
        }
        let mut near = ArrayVec::<(u64, u32), MAX_NEAR_TRIANGLES>::new();
        for _ in 0..8 {
            near.clear();
            let mut all = true;
            self.boxes().within(p, radius, &mut |t, _, feature| {
                all &= near.try_push((self.feature_id(t, feature), t as u32)).is_ok();
            });
            if all {
                break;
            }
            radius = 0.5 * (radius + least);
            near.clear();
        }
        if near.is_empty() && radius >= least {
            return each(closest.triangle as u64, self.hit_on(p, closest.triangle));
        }
        near.sort_unstable();
        let mut found = false;
        for same in near.chunk_by(|a, b| a.0 == b.0) {
            let wanted = match same[0].0 >> 62 {
                0 => 1,
                1 => 2,
                _ => self.valence[(same[0].0 & 0xffff_ffff) as usize] as usize,
            };
            if same.len() >= wanted {
                let hit = self.hit_on(p, same[0].1 as usize);
                if hit.distance >= 0.0 {
                    found = true;
                    each(same[0].0, hit);
                }
            }
        }
        // rounding may assign a point above an edge or corner to different features of its triangles
        if !found && least <= radius {
            each(closest.triangle as u64, self.hit_on(p, closest.triangle));
        }
    }

    fn hit_on(&self, p: &Vec3, triangle: usize) -> Hit {
        self.triangles.describe(p, &self.triangles.closest_of(p, triangle))
    }

    /// Returns an id for a feature of triangle `t`, the same for all triangles that share it.
    fn feature_id(&self, t: usize, feature: usize) -> u64 {
        let v = self.mesh.triangles[t];
        match feature {
            0 => t as u64,
            k @ 1..=3 => {
                let (a, b) = (u64::from(v[k - 1]), u64::from(v[k % 3]));
                1 << 62 | a.min(b) << 31 | a.max(b)
            }
            k => 2 << 62 | u64::from(v[k - 4]),
        }
    }
}

/// Maximum number of triangles near a core point.
const MAX_NEAR_TRIANGLES: usize = 512;

impl DistanceField for MeshField {
    fn bound(&self, p: &Vec3) -> f64 {
        self.tighten_by_sides(p, self.tree.bound(p, &self.triangles))
    }

    fn hit(&self, p: &Vec3, normals: &[Vec3], beside: f64) -> Hit {
        self.hit_from_nearest(p, self.nearest(p), normals, beside)
    }

    fn is_convex(&self) -> bool {
        self.convex
    }
}

/// Returns a bounding sphere of a triangle, relative to `center`; rounded up.
fn sphere_around(corners: &[Vec3; 3], center: &Vec3, diagonal: f64) -> [f32; 4] {
    let longest = (0..3)
        .map(|k| (corners[k], corners[(k + 1) % 3]))
        .max_by(|a, b| (a.1 - a.0).norm().total_cmp(&(b.1 - b.0).norm()));
    let (u, v) = longest.unwrap_or((corners[0], corners[1]));
    // the middle of the longest side suits obtuse triangles, the mean of the corners others
    let middles = [0.5 * (u + v), (corners[0] + corners[1] + corners[2]) / 3.0];
    let radius = |m: &Vec3| corners.iter().map(|c| (c - m).norm()).fold(0.0, f64::max);
    let middle = if radius(&middles[0]) < radius(&middles[1]) { middles[0] } else { middles[1] };
    let c = middle - center;
    [c.x as f32, c.y as f32, c.z as f32, (radius(&middle) + 1e-6 * diagonal) as f32]
}

fn valence(mesh: &TriMesh) -> Vec<u32> {
    let mut count = vec![0; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|&v| count[v as usize] += 1);
    count
}

/// Returns whether every edge is convex or flat and the surface is connected.
pub(super) fn is_convex(mesh: &TriMesh, groups: &EdgeGroups) -> bool {
    let slack = 1e-9 * mesh.diagonal();
    groups.iter().all(|group| {
        let [a, b] = group[..] else { return false };
        let [p, q, r] = mesh.corners(a.face);
        let normal = (q - p).cross(&(r - p)).normalize();
        mesh.corners(b.face).iter().all(|x| normal.dot(&(x - p)) <= slack)
    }) && shells(mesh, groups).1 == 1
}
