//! The signed distance of a mesh by an [`octree`]: each cell near the surface lists the few triangles that can be closest to
//! a point in it.
//!
//! So distances are exact: nothing is interpolated. A query where there is no list asks the tree of boxes ([`MeshDistance`]). Cells and boxes are
//! made by the first query that needs them ([`blocks`]).
//!
//! A cell also lists triangles a little further away that face another way: from an element on a ridge the closest face
//! may be one that it cannot meet, and the next one is taken.

mod blocks;
mod builder;
mod cell_view;
mod faces;
mod octree;
mod triangles;

use super::{DistanceField, Feature, Hit, facing, opposition};
use crate::mesh::{EdgeGroups, closest_on_triangle, shells};
use crate::{Mat3, MeshDistance, TriMesh, Vec3};
use arrayvec::ArrayVec;
pub(crate) use octree::FrameMap;
use octree::{CellPoint, Octree};
use std::sync::OnceLock;
use triangles::Triangles;

/// Relative difference of squared distances that is rounding's.
const SAME_SQUARE: f64 = 1e-11;
/// Faces that an element faces as squarely but for rounding.
const SAME_OPPOSITION: f64 = 1e-9;
/// Sides of a convex solid that each bound asks.
const MAX_SIDES: usize = 16;
/// A triangle in the list of a cell.
#[derive(Clone, Copy, Debug)]
struct ListedTriangle {
    triangle: u32,
    /// At most its distance from the cell's center; it rises along a list.
    nearer: f32,
}

/// The field of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct MeshField {
    /// No faces of one shell cross.
    mesh: TriMesh,
    triangles: Triangles,
    /// Triangles around each vertex.
    valence: Vec<u32>,
    tree: Octree,
    /// A sphere around each triangle, about the middle of the bounds, and its radius.
    spheres: Vec<[f32; 4]>,
    /// Made when it is first asked.
    boxes: OnceLock<MeshDistance>,
    convex: bool,
    /// Of a convex solid of few sides: their outward normals and how far they are from the origin. Below these a bound is better than a cell's.
    sides: ArrayVec<(Vec3, f64), MAX_SIDES>,
}

/// A triangle's closest point.
#[derive(Clone, Copy)]
struct Closest {
    square: f64,
    point: Vec3,
    triangle: usize,
    feature: usize,
}

impl MeshField {
    /// `groups`: the edges of the mesh. `searched`: which edges of each triangle are elements. `convex`: [`is_convex`].
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

    /// The planes of a convex solid's sides; none where it is not convex or they are many.
    fn convex_sides(&self) -> ArrayVec<(Vec3, f64), MAX_SIDES> {
        let mut sides = ArrayVec::new();
        for (corners, normals) in self.triangles.corners.iter().zip(&self.triangles.normals) {
            // as high as its highest corner, so that rounding leaves none outside
            let side = (normals[0], corners.iter().map(|c| normals[0].dot(c)).fold(f64::NEG_INFINITY, f64::max));
            let known =
                |s: &(Vec3, f64)| (s.0 - side.0).norm() < 1e-12 && (s.1 - side.1).abs() < 1e-12 * self.diagonal();
            if !self.convex || !(sides.iter().any(known) || sides.try_push(side).is_ok()) {
                return ArrayVec::new();
            }
        }
        sides
    }

    /// At most the signed distance at `p`, told what the octree says.
    #[inline]
    fn tighten_by_sides(&self, p: &Vec3, bound: f64) -> f64 {
        if self.sides.is_empty() { bound } else { self.distance_above_sides(p).max(bound) }
    }

    /// How far `p` is above the highest side, at most: a convex solid is below all.
    #[inline(never)]
    fn distance_above_sides(&self, p: &Vec3) -> f64 {
        let slack = 1e-11 * self.diagonal();
        self.sides.iter().map(|(n, height)| n.dot(p) - height - slack).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Center and radius of a sphere around triangle `t`.
    pub fn sphere(&self, t: usize) -> (Vec3, f64) {
        let [x, y, z, radius] = self.spheres[t].map(f64::from);
        (self.tree.center + Vec3::new(x, y, z), radius)
    }

    /// The closest of a cell's listed triangles; of those that share the closest point, the one that faces `p` most squarely.
    ///
    /// The list is in the order of the distance from the center `c`: `dist(p, t) ≥ dist(c, t) − |p − c|` ends the search.
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

    /// The closest part of the surface, whatever an element faces.
    pub fn nearest(&self, p: &Vec3) -> Hit {
        self.nearest_in(p, self.tree.locate(p, &self.triangles).as_ref())
    }

    /// The same where it may be less than `limit`; else a bound.
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

    /// Of the mesh, meters.
    pub fn diagonal(&self) -> f64 {
        self.triangles.diagonal
    }

    /// How far beside a face a place on an edge still counts as above it, meters.
    pub fn touching(&self) -> f64 {
        self.triangles.touching
    }

    /// [`DistanceField::hit`], told [`MeshField::nearest`].
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

    /// For [`MeshField::bound_mapped`]; `None` where the sides of a convex solid tell more.
    pub fn frame_map(&self, rotation: &Mat3, translation: &Vec3, reach: f64) -> Option<FrameMap> {
        self.sides.is_empty().then(|| self.tree.frame_map(rotation, translation, reach))
    }

    /// At most the signed distance of a point told in another frame.
    #[inline]
    pub fn bound_mapped(&self, way: &FrameMap, p: &[f32; 3]) -> f64 {
        self.tree.bound_mapped(way, p, &self.triangles)
    }

    /// The closest by the tree of boxes.
    fn closest_by_tree(&self, p: &Vec3) -> Closest {
        self.triangles.closest_of(p, self.boxes().closest(p).triangle)
    }

    /// The closest face among those listed that faces the element, has `p` behind it (or on it), and is not much further
    /// than `nearest`: the far side of the solid is not meant.
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
            // of two triangles of one side, the one that has it below
            let squarer = |b: &(f64, f64, Hit)| {
                square < b.1 - SAME_OPPOSITION || (square < b.1 + SAME_OPPOSITION && distance < b.0)
            };
            let nearer = |b: &(f64, f64, Hit)| distance < b.0 - aside || (distance < b.0 + aside && squarer(b));
            if best.as_ref().is_none_or(nearer) {
                // beyond an edge by less than counts, it is still above or below the face
                let beside = (p - point - normal * above).norm();
                let distance_signed = if above > 0.0 || beside < aside { above } else { -distance };
                let hit =
                    Hit { distance: distance_signed, nearest, normal, core: 0.0, feature: Feature::Face, facing: true };
                best = Some((distance, square, hit));
            }
        }
        best.map(|b| b.2)
    }

    /// Calls `each` with a number that names the feature and the hit of every local minimum of the distance from `p` (outside
    /// the solid) within `radius`: a closest point inside a triangle, or on an edge or corner if all triangles there agree
    /// that it is closest. Where very many are in reach, only those nearest.
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
        for same in near.chunk_by(|a, b| a.0 == b.0) {
            let wanted = match same[0].0 >> 62 {
                0 => 1,
                1 => 2,
                _ => self.valence[(same[0].0 & 0xffff_ffff) as usize] as usize,
            };
            if same.len() >= wanted {
                let hit = self.hit_on(p, same[0].1 as usize);
                if hit.distance >= 0.0 {
                    each(same[0].0, hit);
                }
            }
        }
    }

    fn hit_on(&self, p: &Vec3, triangle: usize) -> Hit {
        self.triangles.describe(p, &self.triangles.closest_of(p, triangle))
    }

    /// A number for a feature of triangle `t`, the same from all triangles that share it.
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

/// Triangles near a core point at most.
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

/// A sphere around a triangle, its center told from `center`; rounding is on the safe side.
fn sphere_around(corners: &[Vec3; 3], center: &Vec3, diagonal: f64) -> [f32; 4] {
    let longest = (0..3)
        .map(|k| (corners[k], corners[(k + 1) % 3]))
        .max_by(|a, b| (a.1 - a.0).norm().total_cmp(&(b.1 - b.0).norm()));
    let (u, v) = longest.unwrap_or((corners[0], corners[1]));
    // the middle of the longest side serves the obtuse, the mean of the corners others
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

/// Whether every edge is convex or flat and the surface is one piece.
pub(super) fn is_convex(mesh: &TriMesh, groups: &EdgeGroups) -> bool {
    let slack = 1e-9 * mesh.diagonal();
    groups.iter().all(|group| {
        let [a, b] = group[..] else { return false };
        let [p, q, r] = mesh.corners(a.face);
        let normal = (q - p).cross(&(r - p)).normalize();
        mesh.corners(b.face).iter().all(|x| normal.dot(&(x - p)) <= slack)
    }) && shells(mesh, groups).1 == 1
}
