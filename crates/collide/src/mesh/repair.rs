//! Mesh repair: makes a solid of a surface with defects and reports all changes.
//!
//! In order: close vertices are welded; zero-area and duplicate faces are dropped; the winding is
//! made consistent; pieces that dangle from an edge of other faces (fins, inner walls) and small
//! open pieces are dropped; holes are filled. The result passes [`TriMesh::check_closed`].

use super::TriMesh;
use super::check::ClosedReport;
use super::edges::{edge_groups, unbalanced};
use super::holes;
use super::pairing::Pairing;
use crate::{MeshError, Vec3};

/// Settings of [`TriMesh::repair`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepairSettings {
    /// Distance up to which vertices are welded, meters: 0 (the default) for vertices at the same
    /// position, else 1e-12 to 0.01 of the diagonal.
    pub weld: f64,
    /// Maximum number of edges of a hole, 3 to 5000 (default 2000); longer holes are an error.
    pub hole_edges: usize,
    /// Open pieces are dropped if their bounding box has at most this fraction of the mesh's
    /// diagonal, 0 to 1 (default 0.05).
    pub debris: f64,
}

impl Default for RepairSettings {
    fn default() -> RepairSettings {
        RepairSettings { weld: 0.0, hole_edges: 2000, debris: 0.05 }
    }
}

/// The result of [`TriMesh::repair`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RepairReport {
    /// Vertices merged with another within the tolerance.
    pub welded_vertices: usize,
    /// Zero-area faces removed.
    pub degenerate_faces: usize,
    /// Removed faces that repeat an earlier face.
    pub duplicate_faces: usize,
    /// Faces reversed to agree with their neighbors.
    pub flipped_faces: usize,
    /// Dropped pieces that dangled from an edge of other faces.
    pub dangling_pieces: usize,
    /// Faces of the dangling pieces.
    pub dangling_faces: usize,
    /// Dropped small open pieces.
    pub debris_pieces: usize,
    /// Faces of the small open pieces.
    pub debris_faces: usize,
    /// Filled holes.
    pub filled_holes: usize,
    /// Number of edges of the longest hole.
    pub longest_hole: usize,
    /// Triangles that fill the holes.
    pub filled_faces: usize,
    /// The check of the repaired mesh.
    pub closed: ClosedReport,
}

impl RepairReport {
    /// Returns one sentence per change that a user should know; empty for a mesh without defects.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let mut say = |count: usize, what: String| {
            if count > 0 {
                notes.push(what);
            }
        };
        say(
            self.welded_vertices,
            format!("{} vertices at or close to the position of another were welded", self.welded_vertices),
        );
        say(self.degenerate_faces, format!("{} faces of zero area were dropped", self.degenerate_faces));
        say(self.duplicate_faces, format!("{} duplicate faces were dropped", self.duplicate_faces));
        say(self.flipped_faces, format!("{} faces were reversed to agree with their neighbors", self.flipped_faces));
        say(
            self.dangling_pieces,
            format!("{} dangling piece(s) of {} face(s) were dropped", self.dangling_pieces, self.dangling_faces),
        );
        say(
            self.debris_pieces,
            format!("{} small open piece(s) of {} face(s) were dropped", self.debris_pieces, self.debris_faces),
        );
        say(
            self.filled_holes,
            format!(
                "{} hole(s) were filled with {} faces; the longest has {} edges",
                self.filled_holes, self.filled_faces, self.longest_hole
            ),
        );
        notes.extend(self.closed.notes());
        notes
    }
}

impl TriMesh {
    /// Makes a closed, outward-wound solid of a surface with holes, fins, inner walls and debris,
    /// in place. A mesh that [`TriMesh::check_closed`] accepts gets the same result as there.
    ///
    /// # Errors
    /// Errors leave the mesh unchanged: invalid data ([`TriMesh::check_data`]), settings out of
    /// range, and surfaces that cannot be repaired. The last name the first face of the original
    /// mesh that prevents a solid, from 1.
    ///
    /// ```
    /// use tumble_collide::{RepairSettings, TriMesh, Vec3};
    ///
    /// let mut mesh = TriMesh::cuboid(Vec3::repeat(1.0));
    /// mesh.triangles.truncate(10); // a side is missing
    /// let report = mesh.repair(&RepairSettings::default())?;
    /// assert_eq!(report.notes(), ["1 hole(s) were filled with 2 faces; the longest has 4 edges"]);
    /// assert!((report.closed.volume - 1.0).abs() < 1e-12);
    /// # Ok::<(), tumble_collide::MeshError>(())
    /// ```
    pub fn repair(&mut self, settings: &RepairSettings) -> Result<RepairReport, MeshError> {
        self.check_data()?;
        settings.check(self.diagonal())?;
        let mut report = RepairReport::default();
        let mut mesh = self.clone();
        if settings.weld > 0.0 {
            report.welded_vertices = mesh.weld_within(settings.weld);
        }
        let refused = match mesh.check_closed() {
            Ok(closed) => {
                *self = mesh;
                return Ok(RepairReport { closed, ..report });
            }
            // these defects cannot be repaired by adding or dropping faces
            Err(refused @ (MeshError::Empty | MeshError::Flat { .. } | MeshError::NoVolume { .. })) => {
                return Err(refused);
            }
            Err(refused) => refused,
        };
        match mesh.close_surface(settings, &mut report) {
            Ok(()) => {
                *self = mesh;
                Ok(report)
            }
            Err(why) => {
                // the face in the user's numbering, which welding can change
                let first = self.clone().check_closed().err().unwrap_or(refused);
                Err(MeshError::BeyondRepair { why, error: Box::new(first) })
            }
        }
    }

    fn close_surface(&mut self, settings: &RepairSettings, report: &mut RepairReport) -> Result<(), String> {
        let (mut mesh, welded) = self.with_shared_vertices();
        report.welded_vertices += welded;
        let mut face_of: Vec<usize> = (0..mesh.triangles.len()).collect();
        report.degenerate_faces = mesh.drop_degenerate(true, &mut face_of);
        report.duplicate_faces = mesh.drop_duplicates(&mut face_of);
        if unbalanced(&edge_groups(&mesh)).next().is_some() {
            report.flipped_faces = mesh.unify_winding();
        }
        mesh.drop_loose_pieces(settings.debris, report);
        if mesh.triangles.is_empty() {
            return Err("nothing remains after zero-area faces and loose pieces are dropped".into());
        }
        mesh.fill_holes(settings.hole_edges, report)?;
        report.closed = mesh.check_closed().map_err(|e| format!("after repair {e}"))?;
        *self = mesh;
        Ok(())
    }

    /// Drops dangling and small open pieces, but never the only or the largest piece.
    fn drop_loose_pieces(&mut self, debris: f64, report: &mut RepairReport) {
        let pairing = Pairing::of(self);
        let mut faces: Vec<Vec<usize>> = vec![Vec::new(); pairing.pieces];
        pairing.piece.iter().enumerate().for_each(|(face, &piece)| faces[piece as usize].push(face));
        let area = |faces: &Vec<usize>| -> f64 { faces.iter().map(|&f| self.face_area(f)).sum() };
        let areas: Vec<f64> = faces.iter().map(area).collect();
        let Some(largest) = (0..areas.len()).max_by(|&a, &b| areas[a].total_cmp(&areas[b]).then(b.cmp(&a))) else {
            return;
        };
        let limit = debris * self.diagonal();
        let open = pairing.has_boundary();
        let mut keep = vec![true; self.triangles.len()];
        for piece in (0..pairing.pieces).filter(|&p| open[p] && p != largest) {
            let bounds = crate::Aabb::around(faces[piece].iter().flat_map(|&f| self.corners(f)));
            if pairing.dangling[piece] {
                report.dangling_pieces += 1;
                report.dangling_faces += faces[piece].len();
            } else if (bounds.max - bounds.min).norm() <= limit {
                report.debris_pieces += 1;
                report.debris_faces += faces[piece].len();
            } else {
                continue;
            }
            faces[piece].iter().for_each(|&f| keep[f] = false);
        }
        let mut face_of: Vec<usize> = (0..keep.len()).collect();
        self.retain_faces(&mut face_of, |t| keep[t]);
    }

    fn face_area(&self, face: usize) -> f64 {
        let [a, b, c] = self.corners(face);
        0.5 * (b - a).cross(&(c - a)).norm()
    }

    fn fill_holes(&mut self, most_edges: usize, report: &mut RepairReport) -> Result<(), String> {
        let pairing = Pairing::of(self);
        if pairing.dangling.contains(&true) {
            return Err("the faces at some edge cannot be paired uniquely".into());
        }
        let loops = pairing.loops();
        let longest = loops.iter().map(Vec::len).max().unwrap_or(0);
        if longest > most_edges {
            return Err(format!("its longest hole has {longest} edges; at most {most_edges} are filled"));
        }
        let unit = |t: usize| {
            let [a, b, c] = self.corners(t);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
        };
        let max_dp_edges = holes::max_dp_edges_for(loops.iter().map(Vec::len).sum());
        let mut added = Vec::new();
        for boundary in &loops {
            // the triangles run opposite to the surrounding half-edges: from the end of each to its
            // start
            let end = |u: u32| self.triangles[u as usize / 3][(u as usize % 3 + 1) % 3];
            let vertices: Vec<u32> = boundary.iter().map(|&u| end(u)).collect();
            let points: Vec<Vec3> = vertices.iter().map(|&v| self.vertices[v as usize]).collect();
            let normals: Vec<Vec3> = boundary.iter().map(|&u| unit(u as usize / 3)).collect();
            if boundary.len() >= 3 {
                added.extend(holes::fill(&points, &normals, max_dp_edges).iter().map(|t| t.map(|k| vertices[k])));
            }
        }
        report.filled_holes = loops.len();
        report.longest_hole = longest;
        report.filled_faces = added.len();
        self.triangles.extend(added);
        Ok(())
    }

    /// Merges each vertex with an earlier one within `tolerance`. Returns the number of merged
    /// vertices, including those at the same position.
    fn weld_within(&mut self, tolerance: f64) -> usize {
        let mut used: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let low = self.aabb().min;
        let cell = |v: u32| (self.vertices[v as usize] - low).map(|x| (x / tolerance).floor() as i64);
        let mut grid: std::collections::BTreeMap<[i64; 3], Vec<u32>> = std::collections::BTreeMap::new();
        let mut stands_for: Vec<u32> = (0..self.vertices.len() as u32).collect();
        let mut merged = 0;
        for v in used {
            let home = cell(v);
            let around = (0..27).map(|n| [home.x + n % 3 - 1, home.y + n / 3 % 3 - 1, home.z + n / 9 - 1]);
            let near = around.flat_map(|c| grid.get(&c).into_iter().flatten().copied());
            let p = self.vertices[v as usize];
            match near.filter(|&w| (self.vertices[w as usize] - p).norm() <= tolerance).min() {
                Some(first) => {
                    stands_for[v as usize] = first;
                    merged += 1;
                }
                None => grid.entry([home.x, home.y, home.z]).or_default().push(v),
            }
        }
        self.triangles.iter_mut().flatten().for_each(|v| *v = stands_for[*v as usize]);
        merged
    }
}

impl RepairSettings {
    fn check(&self, diagonal: f64) -> Result<(), MeshError> {
        let refuse = |what, value, allowed| Err(MeshError::Settings { what, value, allowed });
        if self.weld != 0.0 && !(1e-12 * diagonal..=0.01 * diagonal).contains(&self.weld) {
            return refuse(
                "the welding distance of a repair",
                self.weld,
                "0, or 1e-12 to 0.01 of the mesh's diagonal, meters",
            );
        }
        if !(3..=5000).contains(&self.hole_edges) {
            return refuse("the longest hole of a repair", self.hole_edges as f64, "3 to 5000 edges");
        }
        if !(0.0..=1.0).contains(&self.debris) {
            return refuse("the debris size of a repair", self.debris, "0 to 1");
        }
        Ok(())
    }
}
