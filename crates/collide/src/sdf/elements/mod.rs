//! Features of a mesh (vertices, edges) that are tested against the other body's signed distance
//! field, grouped in a hierarchy of bounding spheres ([`groups`]).
//!
//! An edge is stored with one of its ends, and every vertex stores the lengths of its edges. So one
//! field query skips all features beyond the margin.
//!
//! **Selection of edges.** An edge of length `L` with the angle `θ` between its faces' normals is
//! left out if `θ·L/4 ≤ ε`. If two edges cross at distance `g`, at least one end of the first is at
//! distance `g + L₁·θ₂/4` or less from the other body (its slopes to the two sides differ by at
//! most `θ₂`), and vice versa. If both edges are left out, the smaller of these errors is at most
//! `√(θ₁L₁·θ₂L₂)/4 ≤ ε`. So a finely triangulated smooth surface needs only its vertices, and the
//! gap is too large by at most `ε` (to first order in θ).
//!
//! This assumes flat faces on both sides. A cylinder of radius `R` falls away from the middle of an
//! edge by `L²/8R`, independent of the edge's angle. So the edges left out ([`Edge::fine`]) are
//! tested against cylinders only, for which a search is cheap.
//!
//! A short edge with a small angle has an [`Edge::end_tolerance`]: it makes no contact of its own
//! if one of its ends is on a face and at most `ε` further from the other body. The gap then has
//! the same error `ε`.
//!
//! **Selection of vertices.** A vertex without a convex edge, inside a flat part or in a valley, is
//! no element: another body is as close or closer to one of its faces. Any other vertex is closest
//! to another body only if no edge leads closer from it, so it stores the directions of all its
//! edges. Without that test the vertices ahead of a body would stop its motion over a flat part.

mod groups;
mod rows;
mod support;

use crate::bytes::{Reader, Write};
use crate::mesh::{EdgeGroups, face_normals};
use crate::{SphereTree, TriMesh, Vec3};
use nalgebra::ComplexField;
pub(crate) use rows::Row;

/// `ε`: largest error of the gap of two crossing edges, as a fraction of the diagonal.
pub(crate) const EDGE_ERROR: f64 = 2e-4;
/// Largest angle, radians, and largest length, as a fraction of the diagonal, of an edge of a
/// smooth surface.
const SMOOTH_ANGLE: f64 = 0.5;
const SMOOTH_LENGTH: f64 = 0.03;
/// Turn of an edge, radians, from which the vertices at its ends make contacts above any face.
const SHARP_TURN: f64 = 0.25;
/// Its cosine, rounded down.
const SHARP_COSINE: f64 = 0.9689;
/// At smaller turns a vertex makes a contact above a face that is inclined to its own normals by at
/// most this many turns, and by at least the sine below: the body may rock onto it.
const TURNS_BEYOND: f64 = 4.0;
const MIN_FLAT_SLOPE: f64 = 1e-3;
/// Difference from 1 of the cosine between edges along one line.
const STRAIGHT: f64 = 1e-9;
/// Normals of a vertex within this cosine of another one are left out.
const SAME_NORMAL_COSINE: f64 = 0.98;
/// Maximum number of normals per vertex.
const MAX_NORMALS: usize = 12;

/// A vertex of the surface, with the normals around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    pub at: Vec3,
    /// Identifier of the vertex.
    pub index: u32,
    /// Range of its outward normals in [`Elements::normals`].
    pub first: u32,
    pub count: u32,
    /// Range of the directions of the searched edges that start here, in
    /// [`Elements::edge_directions`].
    pub first_direction: u32,
    pub edge_directions: u32,
    /// Range of the directions of its other edges in [`Elements::ring`].
    pub first_ring: u32,
    pub ring: u32,
    /// Largest slope towards the other body, along any of its edges, with which it makes a contact
    /// above or below a face: infinite at sharp edges.
    pub max_slope: f32,
    /// Start of its edges in [`Elements::edges`], number of those that are always tested, number of
    /// fine ones.
    pub first_edge: u32,
    pub edges: [u32; 2],
    /// Largest length of the edges that are always tested, and of all its edges, meters.
    pub longest: [f64; 2],
}

/// A straight edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    pub ends: [Vec3; 2],
    /// Meters.
    pub length: f64,
    /// Identifiers of its end points.
    pub points: [u32; 2],
    /// The edge needs no contact if an end is no further away by this, meters: `ε` on a smooth
    /// surface, else 0.
    pub end_tolerance: f64,
    /// Whether its angle is so small that it is tested against cylinders only.
    pub fine: bool,
    /// Outward normals of its faces.
    pub normals: [Vec3; 2],
    /// Identifier of the edge.
    pub index: u32,
    /// Its row in [`Elements::rows`], or [`rows::NO_ROW`], and the distances of its ends from the
    /// start of the row, meters.
    pub row: u32,
    pub places: [f64; 2],
}

/// All features of a mesh, grouped by the nodes of the sphere tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct Elements {
    pub points: Vec<Point>,
    pub edges: Vec<Edge>,
    pub rows: Vec<Row>,
    pub normals: Vec<Vec3>,
    pub edge_directions: Vec<Vec3>,
    /// Unit directions of the edges that are not searched, in single precision.
    pub ring: Vec<[f32; 3]>,
    /// Number of vertices at which convex edges of different directions meet.
    pub corners: usize,
    /// Nodes and groups. The first contains all; the children of each are adjacent.
    pub groups: Vec<Group>,
}

/// The content of a tree node or of a part of a leaf. Thirty-two bytes, since memory access
/// dominates when poses change.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct Group {
    center: [f32; 3],
    /// Distance from the center of all its content, without and with the fine edges, meters;
    /// rounded up.
    reach: [f32; 2],
    /// Start of its children in [`Elements::groups`], or of its vertices in [`Elements::points`].
    first: u32,
    count: u32,
    /// Whether it has children.
    has_children: bool,
}

impl Group {
    pub fn center(&self) -> Vec3 {
        Vec3::from(self.center.map(f64::from))
    }

    pub fn center_single(&self) -> &[f32; 3] {
        &self.center
    }

    /// Returns the radius about the center, with or without the fine edges, meters.
    pub fn reach(&self, fine: bool) -> f64 {
        f64::from(self.reach[usize::from(fine)])
    }

    pub fn write(&self, to: &mut Vec<u8>) {
        self.center.iter().chain(&self.reach).for_each(|x| to.single(*x));
        to.u32(self.first);
        to.u32(self.count);
        to.flag(self.has_children);
    }

    pub fn read(from: &mut Reader) -> Option<Group> {
        let center = [from.single()?, from.single()?, from.single()?];
        let reach = [from.single()?, from.single()?];
        Some(Group { center, reach, first: from.u32()?, count: from.u32()?, has_children: from.flag()? })
    }
}

/// Number of children that are tested together; more only if a tree node has more.
pub(crate) const MAX_CHILDREN: usize = 8;
/// Maximum depth of groups that are read.
const MAX_GROUP_DEPTH: u32 = 100;
impl Elements {
    /// Returns the vertices, in the order of the mesh, and the edges, without groups. Also returns
    /// for each triangle which of its edges (k to k+1) are elements.
    fn without_groups(mesh: &TriMesh, groups: &EdgeGroups) -> (Elements, Vec<[bool; 3]>) {
        let face = face_normals(mesh);
        let mut all = Elements::default();
        let (mut edges, searched) = gather_edges(mesh, groups, &face);
        all.gather_points(mesh, &face, &searched, &edges);
        edges.sort_by_key(|e| (e.points[0], e.fine, e.index));
        all.rows = rows::rows(&mut edges, mesh.vertices.len());
        for point in &mut all.points {
            let of = |fine: bool| {
                (
                    edges.partition_point(|e| (e.points[0], e.fine) < (point.index, fine)),
                    edges.partition_point(|e| (e.points[0], e.fine) <= (point.index, fine)),
                )
            };
            let ((a, b), (_, c)) = (of(false), of(true));
            let longest = |end: usize| edges[a..end].iter().map(|e| e.length).fold(0.0, f64::max);
            (point.first_edge, point.edges, point.longest) =
                (a as u32, [(b - a) as u32, (c - b) as u32], [longest(b), longest(c)]);
        }
        all.edges = edges;
        (all, searched)
    }

    /// Builds the elements. `groups` are the edges of the mesh. Also returns for each triangle
    /// which of its edges (k to k+1) are elements.
    pub fn new(mesh: &TriMesh, groups: &EdgeGroups, tree: &SphereTree) -> (Elements, Vec<[bool; 3]>) {
        let (mut all, searched) = Elements::without_groups(mesh, groups);
        all.build_groups(tree);
        (all, searched)
    }

    /// Builds the elements with stored groups of the same mesh and tree; `order` lists the vertices
    /// in their order. Returns `None` if they do not fit the mesh.
    pub fn from_groups(
        mesh: &TriMesh,
        edges: &EdgeGroups,
        order: &[u32],
        groups: Vec<Group>,
    ) -> Option<(Elements, Vec<[bool; 3]>)> {
        let (mut all, searched) = Elements::without_groups(mesh, edges);
        let mut left: Vec<Option<Point>> = vec![None; mesh.vertices.len()];
        let count = all.points.len();
        all.points.drain(..).for_each(|p| left[p.index as usize] = Some(p));
        all.points = order.iter().map(|&v| left.get_mut(v as usize)?.take()).collect::<Option<_>>()?;
        all.groups = groups;
        (all.points.len() == count && all.has_valid_groups()).then_some((all, searched))
    }

    /// Returns whether each group except the first is a child of an earlier one, each vertex is in
    /// one group, and the depth is within the limit.
    fn has_valid_groups(&self) -> bool {
        let mut depth = vec![None; self.groups.len()];
        let mut held = vec![false; self.points.len()];
        if let Some(first) = depth.first_mut() {
            *first = Some(0);
        }
        for (n, group) in self.groups.iter().enumerate() {
            let Some(own) = depth[n].filter(|own| *own < MAX_GROUP_DEPTH) else { return false };
            let range = group.first as usize..group.first as usize + group.count as usize;
            let taken = match group.has_children {
                true => depth
                    .get_mut(range)
                    .is_some_and(|children| children.iter_mut().all(|child| child.replace(own + 1).is_none())),
                false => held
                    .get_mut(range)
                    .is_some_and(|points| points.iter_mut().all(|point| !std::mem::replace(point, true))),
            };
            if !taken {
                return false;
            }
        }
        held.iter().all(|held| *held)
    }

    /// Returns the vertices of a group; empty if it has children.
    pub fn points_of(&self, group: &Group) -> &[Point] {
        if group.has_children { &[] } else { &self.points[group.first as usize..][..group.count as usize] }
    }

    pub fn children_of(&self, group: &Group) -> &[Group] {
        if group.has_children { &self.groups[group.first as usize..][..group.count as usize] } else { &[] }
    }

    /// Returns the edges stored with a vertex, with or without the fine ones.
    pub fn edges_of(&self, point: &Point, fine: bool) -> &[Edge] {
        let count = point.edges[0] + if fine { point.edges[1] } else { 0 };
        &self.edges[point.first_edge as usize..(point.first_edge + count) as usize]
    }

    pub fn normals_of(&self, point: &Point) -> &[Vec3] {
        &self.normals[point.first as usize..(point.first + point.count) as usize]
    }

    pub fn edge_directions_of(&self, point: &Point) -> &[Vec3] {
        &self.edge_directions[point.first_direction as usize..(point.first_direction + point.edge_directions) as usize]
    }

    /// Returns the unit directions of the edges of a vertex that are not searched.
    pub fn ring_of(&self, point: &Point) -> impl Iterator<Item = Vec3> {
        let ring = &self.ring[point.first_ring as usize..(point.first_ring + point.ring) as usize];
        ring.iter().map(|direction| Vec3::from(direction.map(f64::from)))
    }

    /// Returns whether an edge at a vertex leads closer to a face with the normal `up`, steeper than the body may roll,
    /// and goes on almost straight on the other side of the vertex: the rim of a prism. Its next vertex then meets the
    /// face first.
    pub fn smooth_edge_leads(&self, point: &Point, up: &Vec3) -> bool {
        self.edge_directions_of(point).iter().enumerate().any(|(k, edge)| {
            let slope = -up.dot(edge);
            if slope <= MIN_FLAT_SLOPE {
                return false;
            }
            let others = self.edge_directions_of(point).iter().enumerate().filter(|(other, _)| *other != k);
            let straight = others.map(|(_, other)| -edge.dot(other)).fold(-1.0, f64::max);
            straight > SHARP_COSINE && slope > f64::from(max_slope(ComplexField::acos(straight.min(1.0))))
        })
    }

    /// Collects the vertices of the convex edges.
    fn gather_points(&mut self, mesh: &TriMesh, face: &[Vec3], searched: &[[bool; 3]], edges: &[Edge]) {
        let mut edge_directions: Vec<Vec<Vec3>> = vec![Vec::new(); mesh.vertices.len()];
        let mut ring: Vec<Vec<[f32; 3]>> = vec![Vec::new(); mesh.vertices.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let (from, to) = (triangle[k] as usize, triangle[(k + 1) % 3] as usize);
                // the neighboring triangle has the same edge in the opposite direction
                let direction = (mesh.vertices[to] - mesh.vertices[from]).normalize();
                match searched[t][k] {
                    true => edge_directions[from].push(direction),
                    false => ring[from].push([direction.x, direction.y, direction.z].map(|x| x as f32)),
                }
            }
        }
        // the largest turn of the convex edges at each vertex, below 0 without any; one of their
        // directions, zero at corners
        let mut turns = vec![-1.0_f64; mesh.vertices.len()];
        let mut directions = vec![Vec3::zeros(); mesh.vertices.len()];
        for (edge, v) in edges.iter().flat_map(|edge| edge.points.map(|v| (edge, v as usize))) {
            let direction = (edge.ends[1] - edge.ends[0]) / edge.length;
            let bends = turns[v] >= 0.0 && directions[v].dot(&direction).abs() < 1.0 - STRAIGHT;
            directions[v] = if turns[v] < 0.0 { direction } else { directions[v] * f64::from(u8::from(!bends)) };
            turns[v] = turns[v].max(edge.turn());
        }
        self.corners = (0..turns.len()).filter(|&v| turns[v] >= 0.0 && directions[v] == Vec3::zeros()).count();
        let mut around: Vec<Vec<Vec3>> = vec![Vec::new(); mesh.vertices.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for &v in triangle {
                let normals = &mut around[v as usize];
                if normals.len() < MAX_NORMALS && normals.iter().all(|n| n.dot(&face[t]) < SAME_NORMAL_COSINE) {
                    normals.push(face[t]);
                }
            }
        }
        for (v, normals) in around.iter().enumerate() {
            if normals.is_empty() || turns[v] < 0.0 {
                continue;
            }
            let at = mesh.vertices[v];
            let point = Point {
                at,
                index: v as u32,
                first: self.normals.len() as u32,
                count: normals.len() as u32,
                first_direction: self.edge_directions.len() as u32,
                edge_directions: edge_directions[v].len() as u32,
                first_ring: self.ring.len() as u32,
                ring: ring[v].len() as u32,
                max_slope: max_slope(turns[v]),
                first_edge: 0,
                edges: [0; 2],
                longest: [0.0; 2],
            };
            self.normals.extend(normals);
            self.edge_directions.extend(&edge_directions[v]);
            self.ring.extend(&ring[v]);
            self.points.push(point);
        }
    }
}

impl Edge {
    /// Returns the angle between the normals of its faces, radians.
    fn turn(&self) -> f64 {
        ComplexField::acos(self.normals[0].dot(&self.normals[1]).clamp(-1.0, 1.0))
    }
}

/// Returns [`Point::max_slope`] for the largest turn of the convex edges at a vertex, radians.
pub(crate) fn max_slope(turn: f64) -> f32 {
    if turn < SHARP_TURN { (TURNS_BEYOND * turn).max(MIN_FLAT_SLOPE) as f32 } else { f32::INFINITY }
}

/// Returns the convex edges.
fn gather_edges(mesh: &TriMesh, groups: &EdgeGroups, face: &[Vec3]) -> (Vec<Edge>, Vec<[bool; 3]>) {
    let mut searched = vec![[false; 3]; mesh.triangles.len()];
    let mut edges = Vec::new();
    let diagonal = mesh.diagonal();
    let error = EDGE_ERROR * diagonal;
    for (index, group) in groups.iter().enumerate() {
        let ends = [group[0].low, group[0].high].map(|v| mesh.vertices[v as usize]);
        let normals = [face[group[0].face], face[group[group.len() - 1].face]];
        let apart = mesh.corners(group[group.len() - 1].face);
        // more than two faces, or a convex edge: the other face is below the plane of the first
        let reach = apart.iter().map(|c| normals[0].dot(&(c - ends[0]))).fold(0.0, f64::min);
        let length = (ends[1] - ends[0]).norm();
        let convex = reach < -1e-9 * length;
        if group.len() == 2 && !convex {
            continue;
        }
        let mut edge = Edge {
            ends,
            length,
            points: [group[0].low, group[0].high],
            end_tolerance: 0.0,
            fine: false,
            normals,
            index: index as u32,
            row: rows::NO_ROW,
            places: [0.0; 2],
        };
        let turn = edge.turn();
        let smooth = group.len() == 2 && turn < SMOOTH_ANGLE && length < SMOOTH_LENGTH * diagonal;
        edge.fine = group.len() == 2 && 0.25 * turn * length <= error;
        edge.end_tolerance = if smooth { error } else { 0.0 };
        for u in group.iter().filter(|_| !edge.fine) {
            let t = mesh.triangles[u.face];
            let from = if u.forward { u.low } else { u.high };
            if let Some(k) = (0..3).find(|&k| t[k] == from && t[(k + 1) % 3] == u.low + u.high - from) {
                searched[u.face][k] = true;
            }
        }
        edges.push(edge);
    }
    (edges, searched)
}
