//! Pairing of half-edges: the surface as pieces with boundary loops.
//!
//! Each half-edge is paired with one of the same edge in the opposite direction. A half-edge
//! without partner is a boundary edge. If more than two faces meet at an edge, half-edges of the
//! same sheet (faces connected across edges with two faces) are paired first, then those of the
//! larger sheets ([`Pairing::of`]), so the half-edges of fins and inner walls stay unpaired; or those whose
//! faces are most nearly in one plane ([`Pairing::flattest`]). The corners of faces
//! that are connected by pairs form fans. At an open fan exactly one boundary edge enters and one
//! leaves, so the boundary edges form unique loops.

use super::edges::{EdgeGroups, HalfEdge, edge_groups};
use super::{TriMesh, face_normals};
use crate::{UnionFind, Vec3};

/// Marks a half-edge without partner.
pub(super) const BOUNDARY: u32 = u32::MAX;
/// Faces whose normals have a smaller cosine are folded onto each other.
const FOLDED: f64 = -0.999;
/// Further faces at one edge stay unpaired, since all pairs are compared.
const MAX_AT_AN_EDGE: usize = 256;

/// Receives two half-edges that are paired.
type Join<'a> = dyn FnMut(&HalfEdge, &HalfEdge) + 'a;

/// The pairing. Half-edge `3t + k` belongs to edge `k` (corners k to k+1) of triangle `t`.
pub(super) struct Pairing {
    /// The opposite half-edge, or [`BOUNDARY`].
    pub partner: Vec<u32>,
    /// The piece of each face: faces connected by pairs, counted from 0.
    pub piece: Vec<u32>,
    pub pieces: usize,
    /// Whether a piece has a boundary at an edge that other faces share.
    pub dangling: Vec<bool>,
}

impl Pairing {
    pub fn of(mesh: &TriMesh) -> Pairing {
        let groups = edge_groups(mesh);
        let faces = mesh.triangles.len();
        let (sheet, sheets) = components(faces, groups.iter().filter(|g| opposite(g)).map(|g| (g[0].face, g[1].face)));
        let mut area = vec![0.0; sheets];
        for t in 0..faces {
            let [a, b, c] = mesh.corners(t);
            area[sheet[t] as usize] += (b - a).cross(&(c - a)).norm();
        }
        let pair = |group: &[HalfEdge], join: &mut Join<'_>| pair_group(group, &sheet, &area, join);
        Pairing::by(mesh, &groups, pair)
    }

    /// Pairs the half-edges of an edge whose faces continue each other most straight. Faces that are folded
    /// onto each other are not paired.
    pub fn flattest(mesh: &TriMesh) -> Pairing {
        let normals = face_normals(mesh);
        Pairing::by(mesh, &edge_groups(mesh), |group, join| pair_flattest(group, &normals, join))
    }

    fn by(mesh: &TriMesh, groups: &EdgeGroups, pair: impl Fn(&[HalfEdge], &mut Join<'_>)) -> Pairing {
        let faces = mesh.triangles.len();
        let mut partner = vec![BOUNDARY; 3 * faces];
        let mut join = |a: &HalfEdge, b: &HalfEdge| {
            let (a, b) = (half_edge_index(mesh, a), half_edge_index(mesh, b));
            (partner[a], partner[b]) = (b as u32, a as u32);
        };
        for group in groups.iter() {
            pair(group, &mut join);
        }
        let over_pairs = (0..3 * faces).filter(|&u| partner[u] != BOUNDARY).map(|u| (u / 3, partner[u] as usize / 3));
        let (piece, pieces) = components(faces, over_pairs);
        let mut dangling = vec![false; pieces];
        for group in groups.iter().filter(|g| g.len() > 1) {
            for lone in group.iter().filter(|u| partner[half_edge_index(mesh, u)] == BOUNDARY) {
                dangling[piece[lone.face] as usize] = true;
            }
        }
        Pairing { partner, piece, pieces, dangling }
    }

    /// Returns the fan of each corner `3t + k`, and the number of fans: corners at one vertex whose faces
    /// are connected by pairs.
    pub fn fans(&self) -> (Vec<u32>, usize) {
        let next_of = |u: usize| u / 3 * 3 + (u % 3 + 1) % 3;
        // the end of a half-edge is the start of its partner
        let meet = |u: usize, v: usize| [(u, next_of(v)), (next_of(u), v)];
        let pairs = (0..self.partner.len()).filter(|&u| self.partner[u] != BOUNDARY);
        components(self.partner.len(), pairs.flat_map(|u| meet(u, self.partner[u] as usize)))
    }

    /// Returns whether each piece has a boundary.
    pub fn has_boundary(&self) -> Vec<bool> {
        let mut has_boundary = vec![false; self.pieces];
        for (u, _) in self.partner.iter().enumerate().filter(|(_, p)| **p == BOUNDARY) {
            has_boundary[self.piece[u / 3] as usize] = true;
        }
        has_boundary
    }

    /// Returns the boundary loops as half-edges, in the order of a face that fills the hole,
    /// opposite to the half-edges.
    pub fn loops(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.partner.len()];
        let mut loops = Vec::new();
        for start in 0..self.partner.len() as u32 {
            if self.partner[start as usize] != BOUNDARY || seen[start as usize] {
                continue;
            }
            let (mut boundary, mut at) = (Vec::new(), start);
            while !seen[at as usize] {
                seen[at as usize] = true;
                boundary.push(at);
                at = self.previous_boundary_edge(at);
            }
            loops.push(boundary);
        }
        loops
    }

    /// Returns the boundary edge that ends where `boundary` starts, by walking around the fan of
    /// that corner.
    fn previous_boundary_edge(&self, boundary: u32) -> u32 {
        let before = |u: u32| u / 3 * 3 + (u % 3 + 2) % 3;
        let mut at = before(boundary);
        for _ in 0..self.partner.len() {
            match self.partner[at as usize] {
                BOUNDARY => return at,
                other => at = before(other),
            }
        }
        at
    }
}

fn half_edge_index(mesh: &TriMesh, u: &HalfEdge) -> usize {
    let (from, to) = if u.forward { (u.low, u.high) } else { (u.high, u.low) };
    let t = mesh.triangles[u.face];
    3 * u.face + (0..3).find(|&k| t[k] == from && t[(k + 1) % 3] == to).unwrap_or(0)
}

fn opposite(group: &[HalfEdge]) -> bool {
    group.len() == 2 && group[0].forward != group[1].forward
}

/// Pairs the half-edges of one edge.
fn pair_group(group: &[HalfEdge], sheet: &[u32], area: &[f64], join: &mut Join<'_>) {
    let mut left: Vec<&HalfEdge> = group.iter().collect();
    let size = |u: &HalfEdge| area[sheet[u.face] as usize];
    left.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.face.cmp(&b.face)));
    for same_sheet in [true, false] {
        let mut n = 0;
        while n < left.len() {
            let fits =
                |u: &&HalfEdge| u.forward != left[n].forward && (!same_sheet || sheet[u.face] == sheet[left[n].face]);
            match left[n + 1..].iter().position(fits) {
                Some(m) => {
                    join(left[n], left[n + 1 + m]);
                    left.remove(n + 1 + m);
                    left.remove(n);
                }
                None => n += 1,
            }
        }
    }
}

/// Pairs the half-edges of one edge, the flattest pairs first.
fn pair_flattest(group: &[HalfEdge], normals: &[Vec3], join: &mut Join<'_>) {
    let (forward, backward): (Vec<&HalfEdge>, Vec<&HalfEdge>) =
        group.iter().take(MAX_AT_AN_EDGE).partition(|u| u.forward);
    let cosine = |a: &HalfEdge, b: &HalfEdge| normals[a.face].dot(&normals[b.face]);
    let mut pairs: Vec<(&HalfEdge, &HalfEdge)> =
        forward.iter().flat_map(|a| backward.iter().map(|b| (*a, *b))).filter(|(a, b)| cosine(a, b) > FOLDED).collect();
    pairs.sort_by(|p, q| cosine(q.0, q.1).total_cmp(&cosine(p.0, p.1)).then((p.0, p.1).cmp(&(q.0, q.1))));
    while let Some(&(a, b)) = pairs.first() {
        join(a, b);
        pairs.retain(|(c, d)| *c != a && *d != b);
    }
}

/// Numbers the connected sets of `0..count` by their first members.
fn components(count: usize, edges: impl Iterator<Item = (usize, usize)>) -> (Vec<u32>, usize) {
    let mut sets = UnionFind::new(count);
    edges.for_each(|(a, b)| sets.union(a as u32, b as u32));
    sets.numbered()
}
