//! The half-edges of a mesh, grouped by undirected edge.

use super::TriMesh;

/// The use of an edge by one face.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct HalfEdge {
    pub low: u32,
    pub high: u32,
    pub face: usize,
    /// Whether the face goes from `low` to `high`.
    pub forward: bool,
}

/// All half-edges of a mesh, in ascending order of the undirected edges.
pub(crate) struct EdgeGroups(Vec<HalfEdge>);

impl EdgeGroups {
    /// Returns the half-edges of each undirected edge.
    pub fn iter(&self) -> impl Iterator<Item = &[HalfEdge]> {
        self.0.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high))
    }
}

/// Returns the half-edges of `mesh`, grouped by undirected edge.
pub(crate) fn edge_groups(mesh: &TriMesh) -> EdgeGroups {
    let mut half_edges: Vec<HalfEdge> = Vec::with_capacity(3 * mesh.triangles.len());
    for (face, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (u, v) = (t[k], t[(k + 1) % 3]);
            half_edges.push(HalfEdge { low: u.min(v), high: u.max(v), face, forward: u < v });
        }
    }
    half_edges.sort_unstable();
    EdgeGroups(half_edges)
}

/// Groups whose half-edges in the two directions differ in number: the surface is open or wound
/// inconsistently there.
pub(super) fn unbalanced(groups: &EdgeGroups) -> impl Iterator<Item = &[HalfEdge]> {
    groups.iter().filter(|g| 2 * g.iter().filter(|u| u.forward).count() != g.len())
}
