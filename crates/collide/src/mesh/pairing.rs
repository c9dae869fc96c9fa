//! Which face goes on over which edge: the surface as pieces with rims.
//!
//! Each face uses its three edges in a direction. A use is paired with one of the same edge in the other direction;
//! what stays without is a rim. Where more than two faces meet, two uses of the same sheet (faces connected over plain
//! edges) are paired first, then those of the larger sheets: a fin or an inner wall stays over. The corners of faces
//! that are joined over pairs form fans; around an open fan exactly one rim comes in and one goes out, so rims close
//! to loops without choice.

use super::TriMesh;
use super::edges::{HalfEdge, edge_groups};
use crate::UnionFind;

/// No partner.
pub(super) const BOUNDARY: u32 = u32::MAX;

/// Use `3t + k` is that of edge `k` (corners k to k+1) of triangle `t`.
pub(super) struct Pairing {
    /// The use on the other side, or [`BOUNDARY`].
    pub partner: Vec<u32>,
    /// The piece of each face: faces connected over pairs, counted from 0.
    pub piece: Vec<u32>,
    pub pieces: usize,
    /// Whether a piece has a rim at an edge where other faces go on.
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
        let mut partner = vec![BOUNDARY; 3 * faces];
        let mut join = |a: &HalfEdge, b: &HalfEdge| {
            let (a, b) = (half_edge_index(mesh, a), half_edge_index(mesh, b));
            (partner[a], partner[b]) = (b as u32, a as u32);
        };
        for group in groups.iter() {
            pair_group(group, &sheet, &area, &mut join);
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

    /// Whether each piece has a rim.
    pub fn has_boundary(&self) -> Vec<bool> {
        let mut has_boundary = vec![false; self.pieces];
        for (u, _) in self.partner.iter().enumerate().filter(|(_, p)| **p == BOUNDARY) {
            has_boundary[self.piece[u / 3] as usize] = true;
        }
        has_boundary
    }

    /// The loops of rims, each as uses in the order in which a face that fills the hole goes round, against the uses.
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

    /// The rim that ends where `boundary` starts: round the fan of that corner.
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

/// Pairs the uses of one edge.
fn pair_group(group: &[HalfEdge], sheet: &[u32], area: &[f64], join: &mut impl FnMut(&HalfEdge, &HalfEdge)) {
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

/// Numbers the connected sets of `0..count` by their first members.
fn components(count: usize, edges: impl Iterator<Item = (usize, usize)>) -> (Vec<u32>, usize) {
    let mut sets = UnionFind::new(count);
    edges.for_each(|(a, b)| sets.union(a as u32, b as u32));
    sets.numbered()
}
