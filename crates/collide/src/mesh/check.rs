//! Validation of closed meshes. Harmless defects are repaired and reported; other defects are
//! errors that name their place.
//!
//! A surface is closed and consistently wound iff every directed edge `u→v` occurs as often as
//! `v→u`. If each occurs more than once, the edge is non-manifold but the volume is well defined.
//! Such edges are accepted and reported.

use super::TriMesh;
use super::edges::{EdgeGroups, HalfEdge, edge_groups, unbalanced};
use super::shells::shells;
use super::union::Boundary;
use crate::{MeshError, UnionFind, Vec3};

/// The result of [`TriMesh::check_closed`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClosedReport {
    /// Vertices merged with another at exactly the same position.
    pub welded_vertices: usize,
    /// Zero-area faces removed.
    pub degenerate_faces: usize,
    /// Removed faces that repeat an earlier face (coincident shells).
    pub duplicate_faces: usize,
    /// Faces reversed to agree with their neighbors.
    pub flipped_faces: usize,
    /// Whether the whole mesh was inside out.
    pub turned: bool,
    /// Edges with four or more faces.
    pub nonmanifold_edges: usize,
    /// Number of connected pieces of the surface.
    pub shells: usize,
    /// Number of shells that lay outside all others, were inside out and were reversed
    /// individually.
    pub inverted_shells: usize,
    /// Faces that cross or touch others that are not neighbors; a lower bound if `crossing_capped`.
    pub crossing_faces: usize,
    /// Whether the search for those faces ended early because there are too many.
    pub crossing_capped: bool,
    /// Volume of the solid that the surface encloses at least once, m³.
    pub volume: f64,
    /// Fraction of the surface's area that could not be classified as boundary of the solid or not,
    /// 0 to 1. It is treated as boundary, so volume and mass are not exact.
    pub doubtful: f64,
}

impl ClosedReport {
    /// Returns one sentence per defect that a user should know; empty for a mesh without defects.
    pub fn notes(&self) -> Vec<String> {
        let counted = [
            (self.welded_vertices, "vertices at the same position were welded"),
            (self.degenerate_faces, "faces of zero area were dropped"),
            (self.duplicate_faces, "duplicate faces were dropped"),
            (self.flipped_faces, "faces were reversed to agree with their neighbors"),
            (self.nonmanifold_edges, "edges have four or more faces (accepted: the volume is well defined)"),
        ];
        let mut notes: Vec<String> =
            counted.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
        if self.turned {
            notes.push("the mesh was inside out and was reversed".into());
        }
        if self.inverted_shells > 0 {
            notes.push(format!("{} shells were inside out and were reversed", self.inverted_shells));
        }
        if self.crossing_faces > 0 {
            let least = if self.crossing_capped { "at least " } else { "" };
            notes.push(format!(
                "{least}{} faces cross or touch others (accepted by winding number: the solid is the volume that the surface encloses at \
                 least once)",
                self.crossing_faces
            ));
        }
        if self.shells > 1 {
            notes.push(format!("the surface has {} separate shells; the solid is their union", self.shells));
        }
        if self.doubtful > 0.0 {
            notes.push(format!(
                "{:.2} % of the surface crosses too many faces to be cut; volume, mass and depths there are not exact",
                100.0 * self.doubtful
            ));
        }
        notes
    }
}

impl TriMesh {
    /// Verifies that the mesh is a closed, outward-wound solid. Welds equal vertices, drops
    /// zero-area and duplicate faces, makes the winding consistent and reverses an inside-out mesh,
    /// all in place and listed in the report.
    ///
    /// # Errors
    /// [`MeshError`] for invalid data, an open or dangling surface, and a surface without volume.
    /// The mesh is then unchanged. Errors number vertices and faces as in this mesh, from 1.
    pub fn check_closed(&mut self) -> Result<ClosedReport, MeshError> {
        self.check_data()?;
        // zero-area faces are dropped first; if that opens a seam that they close, they stay
        let (mesh, report) = self.cleaned(true).or_else(|error| self.cleaned(false).map_err(|_| error))?;
        *self = mesh;
        Ok(report)
    }

    fn cleaned(&self, drop_collinear: bool) -> Result<(TriMesh, ClosedReport), MeshError> {
        let (mut mesh, welded_vertices) = self.with_shared_vertices();
        let mut report = ClosedReport { welded_vertices, ..ClosedReport::default() };
        // the index in `self` of each face of `mesh`
        let mut face_of: Vec<usize> = (0..self.triangles.len()).collect();
        report.degenerate_faces = mesh.drop_degenerate(drop_collinear, &mut face_of);
        report.duplicate_faces = mesh.drop_duplicates(&mut face_of);
        if mesh.triangles.is_empty() {
            return Err(MeshError::Flat { faces: self.triangles.len() });
        }
        if unbalanced(&edge_groups(&mesh)).next().is_some() {
            report.flipped_faces = mesh.unify_winding();
        }
        let groups = edge_groups(&mesh);
        check_balanced(&groups, &face_of)?;
        report.nonmanifold_edges = groups.iter().filter(|g| g.len() > 2).count();
        let (shell, count) = shells(&mesh, &groups);
        report.shells = count;
        mesh = mesh.compacted();
        mesh.check_size()?; // without unused vertices
        report.turned = mesh.signed_volume() < 0.0;
        if report.turned {
            mesh.flip_winding();
        }
        report.inverted_shells = mesh.orient_shells(&shell, count);
        let (boundary, _) = Boundary::of(&mesh);
        report.crossing_faces = boundary.crossing_faces;
        report.crossing_capped = boundary.capped;
        report.doubtful = boundary.doubtful_area / mesh.area();
        report.volume = boundary.moments(&mesh.middle()).volume;
        if report.volume <= 1e-12 * mesh.diagonal().powi(3) {
            return Err(MeshError::NoVolume { volume: report.volume });
        }
        Ok((mesh, report))
    }

    /// Merges vertices at exactly the same position (`-0` equals `0`) and drops unused ones.
    /// Indices must be in range ([`TriMesh::check_data`]).
    pub fn welded(&self) -> TriMesh {
        self.with_shared_vertices().0.compacted()
    }

    /// Replaces every vertex index by the first used vertex at the same position. Also returns the
    /// number of merged vertices. The vertices stay.
    pub(super) fn with_shared_vertices(&self) -> (TriMesh, usize) {
        let mut order: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        order.sort_unstable();
        order.dedup();
        let key = |v: u32| self.vertices[v as usize].map(|x| x + 0.0);
        let compare = |a: &Vec3, b: &Vec3| {
            (0..3).map(|k| a[k].total_cmp(&b[k])).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        };
        order.sort_by(|&u, &v| compare(&key(u), &key(v)).then(u.cmp(&v)));
        let mut stands_for: Vec<u32> = (0..self.vertices.len() as u32).collect();
        let mut merged = 0;
        for pair in order.windows(2) {
            if key(pair[0]) == key(pair[1]) {
                stands_for[pair[1] as usize] = stands_for[pair[0] as usize];
                merged += 1;
            }
        }
        let triangles = self.triangles.iter().map(|t| t.map(|v| stands_for[v as usize])).collect();
        (TriMesh { vertices: self.vertices.clone(), triangles }, merged)
    }

    /// Drops the vertices that no triangle uses; the others keep their order.
    pub(crate) fn compacted(&self) -> TriMesh {
        let mut kept: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        kept.sort_unstable();
        kept.dedup();
        let index = |v: u32| kept.partition_point(|&k| k < v) as u32;
        let triangles = self.triangles.iter().map(|t| t.map(index)).collect();
        TriMesh { vertices: kept.iter().map(|&v| self.vertices[v as usize]).collect(), triangles }
    }

    /// Keeps the triangles for which `keep` is true, and their entries of `face_of`. Returns the
    /// number of removed triangles.
    pub(super) fn retain_faces(&mut self, face_of: &mut Vec<usize>, keep: impl Fn(usize) -> bool) -> usize {
        let before = self.triangles.len();
        let kept: Vec<usize> = (0..before).filter(|&t| keep(t)).collect();
        self.triangles = kept.iter().map(|&t| self.triangles[t]).collect();
        *face_of = kept.iter().map(|&t| face_of[t]).collect();
        before - kept.len()
    }

    pub(super) fn drop_degenerate(&mut self, collinear_too: bool, face_of: &mut Vec<usize>) -> usize {
        let before = self.clone();
        self.retain_faces(face_of, |t| {
            let ([i, j, k], [a, b, c]) = (before.triangles[t], before.corners(t));
            let repeated = i == j || j == k || k == i;
            let (u, v) = (b - a, c - a);
            let collinear = u.cross(&v).norm() <= 1e-14 * u.norm_squared().max(v.norm_squared());
            !(repeated || (collinear_too && collinear))
        })
    }

    /// Drops each face that has the same corners in the same orientation as an earlier one.
    pub(super) fn drop_duplicates(&mut self, face_of: &mut Vec<usize>) -> usize {
        let smallest_first = |t: [u32; 3]| {
            let k = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
            [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]
        };
        let mut order: Vec<([u32; 3], usize)> =
            self.triangles.iter().enumerate().map(|(n, t)| (smallest_first(*t), n)).collect();
        order.sort_unstable();
        let mut repeats = vec![false; order.len()];
        order.windows(2).filter(|w| w[0].0 == w[1].0).for_each(|w| repeats[w[1].1] = true);
        self.retain_faces(face_of, |t| !repeats[t])
    }

    /// Propagates the winding of each shell's first face across edges with two faces, then reverses
    /// each changed shell that has negative volume. Returns the number of reversed faces.
    pub(super) fn unify_winding(&mut self) -> usize {
        let groups = edge_groups(self);
        let mut neighbors: Vec<Vec<(usize, bool)>> = vec![Vec::new(); self.triangles.len()];
        for group in groups.iter().filter(|g| g.len() == 2) {
            let (a, b) = (group[0], group[1]);
            neighbors[a.face].push((b.face, a.forward == b.forward));
            neighbors[b.face].push((a.face, a.forward == b.forward));
        }
        let original = self.triangles.clone();
        let mut seen = vec![false; original.len()];
        for seed in 0..original.len() {
            if !seen[seed] {
                self.unify_shell(seed, &neighbors, &mut seen);
            }
        }
        (0..original.len()).filter(|&t| original[t] != self.triangles[t]).count()
    }

    fn unify_shell(&mut self, seed: usize, neighbors: &[Vec<(usize, bool)>], seen: &mut [bool]) {
        let mut shell = vec![(seed, false)];
        seen[seed] = true;
        let mut next = 0;
        while next < shell.len() {
            let (face, flip) = shell[next];
            for &(other, disagree) in &neighbors[face] {
                if !seen[other] {
                    seen[other] = true;
                    shell.push((other, flip ^ disagree));
                }
            }
            next += 1;
        }
        if shell.iter().all(|(_, flip)| !flip) {
            return;
        }
        let origin = self.corners(seed)[0];
        let volume: f64 = shell
            .iter()
            .map(|&(t, flip)| {
                let [a, b, c] = self.corners(t).map(|p| p - origin);
                let d = a.dot(&b.cross(&c));
                if flip { -d } else { d }
            })
            .sum();
        for (t, flip) in shell {
            if flip ^ (volume < 0.0) {
                self.triangles[t].swap(1, 2);
            }
        }
    }
}

/// Returns an error if the half-edges of some edge do not pair up. `face_of` is the user's
/// numbering of the faces.
fn check_balanced(groups: &EdgeGroups, face_of: &[usize]) -> Result<(), MeshError> {
    let bad: Vec<&[HalfEdge]> = unbalanced(groups).collect();
    if bad.is_empty() {
        return Ok(());
    }
    let open: Vec<HalfEdge> = bad.iter().filter(|g| g.len() == 1).map(|g| g[0]).collect();
    if let Some(shared) = bad.iter().find(|g| g.len() > 1) {
        // the dangling face is the one at this edge that also has an open edge
        let fin = shared.iter().find(|u| open.iter().any(|o| o.face == u.face)).unwrap_or(&shared[0]);
        return Err(MeshError::NonManifold {
            edges: bad.len() - open.len(),
            open: open.len(),
            faces: shared.len(),
            from: shared[0].low + 1,
            to: shared[0].high + 1,
            face: face_of[fin.face] + 1,
        });
    }
    let loops = connected_groups(open.len(), |a, b| share_vertex(&open[a], &open[b]));
    let first = (0..open.len()).min_by_key(|&n| face_of[open[n].face]).unwrap_or(0);
    Err(MeshError::Open {
        edges: open.len(),
        holes: loops.iter().enumerate().filter(|(n, l)| n == *l).count(),
        first_hole: loops.iter().filter(|l| **l == loops[first]).count(),
        from: open[first].low + 1,
        to: open[first].high + 1,
        face: face_of[open[first].face] + 1,
    })
}

fn share_vertex(a: &HalfEdge, b: &HalfEdge) -> bool {
    [a.low, a.high].iter().any(|v| *v == b.low || *v == b.high)
}

/// Groups `0..count` by a relation and returns the smallest member of each item's group. Quadratic,
/// but open edges are few. Beyond 2000 all items count as one group, as the exact message does not
/// matter then.
fn connected_groups(count: usize, related: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    if count > 2000 {
        return vec![0; count];
    }
    let mut sets = UnionFind::new(count);
    for a in 0..count {
        for b in 0..a {
            if related(a, b) {
                sets.union(a as u32, b as u32);
            }
        }
    }
    (0..count).map(|n| sets.find(n as u32) as usize).collect()
}
