//! Wavefront OBJ, the geometry only: `v` and `f` lines. Everything else is passed over.
//!
//! Faces may be written `v`, `v/vt`, `v//vn` or `v/vt/vn`; a negative index counts back from the last vertex read;
//! a polygon is cut into triangles ([`PolygonTriangulator`]).

use super::TriMesh;
use super::polygon::PolygonTriangulator;
use super::text::obj_lines;
use crate::{MeshError, Vec3};

impl TriMesh {
    /// Reads the text of an OBJ file. Errors name the line (from 1), and the vertex or face (from 1).
    ///
    /// # Errors
    /// [`MeshError`] names the line of text that cannot be read.
    pub fn from_obj(text: &str) -> Result<TriMesh, MeshError> {
        Ok(TriMesh::from_obj_with_lines(text)?.0)
    }

    /// The same, with the line (from 1) of each triangle, for [`MeshError::at_line`]. A polygon of `n` corners is `n − 2`
    /// triangles.
    ///
    /// # Errors
    /// [`MeshError`] names the line of text that cannot be read.
    pub fn from_obj_with_lines(text: &str) -> Result<(TriMesh, Vec<usize>), MeshError> {
        let mut mesh = TriMesh::default();
        let mut faces = Vec::new();
        for (number, line) in obj_lines(text) {
            let mut words = line.split_whitespace();
            match words.next() {
                Some("v") => {
                    let vertex = vertex(words, number, mesh.vertices.len() + 1)?;
                    mesh.vertices.push(vertex);
                }
                Some("f") => faces.push((number, face(words, number, mesh.vertices.len())?)),
                _ => {}
            }
        }
        let mut lines = Vec::new();
        let mut triangulator = PolygonTriangulator::default();
        for (number, (line, corners)) in faces.iter().enumerate() {
            mesh.push_face(corners, number + 1, &mut triangulator)
                .map_err(|error| MeshError::At { line: *line, error: Box::new(error) })?;
            lines.resize(mesh.triangles.len(), *line);
        }
        if mesh.triangles.is_empty() { Err(MeshError::Empty) } else { Ok((mesh, lines)) }
    }

    /// Adds the triangles of a face; corners are numbers of vertices from 1, as is `face`, the number that errors name.
    pub(super) fn push_face(
        &mut self,
        corners: &[i64],
        face: usize,
        triangulator: &mut PolygonTriangulator,
    ) -> Result<(), MeshError> {
        let count = self.vertices.len();
        if let Some(&index) = corners.iter().find(|&&c| c < 1 || c > count as i64 || c > i64::from(u32::MAX)) {
            return Err(MeshError::IndexOutOfRange { face, index, count });
        }
        let points: Vec<Vec3> = corners.iter().map(|c| self.vertices[*c as usize - 1]).collect();
        let triangles = triangulator.triangulate(&points)?;
        self.triangles.extend(triangles.iter().map(|t| t.map(|k| (corners[k] - 1) as u32)));
        Ok(())
    }
}

fn vertex<'a>(mut words: impl Iterator<Item = &'a str>, line: usize, vertex: usize) -> Result<Vec3, MeshError> {
    let mut v = Vec3::zeros();
    for k in 0..3 {
        let word = words.next().ok_or(MeshError::Syntax { line, what: "a vertex of fewer than 3 numbers".into() })?;
        v[k] = word
            .parse()
            .map_err(|_| MeshError::Syntax { line, what: format!("`{word}` where a coordinate should be") })?;
    }
    if v.iter().all(|x| x.is_finite()) {
        return Ok(v);
    }
    Err(MeshError::At { line, error: Box::new(MeshError::NotFinite { vertex, x: v.x, y: v.y, z: v.z }) })
}

/// Corner indices as 1-based numbers; range is checked once all vertices are known.
fn face<'a>(words: impl Iterator<Item = &'a str>, line: usize, so_far: usize) -> Result<Vec<i64>, MeshError> {
    let mut corners = Vec::new();
    for word in words {
        if word.starts_with('#') {
            break;
        }
        let first = word.split('/').next().unwrap_or(word);
        let index: i64 = first
            .parse()
            .map_err(|_| MeshError::Syntax { line, what: format!("`{word}` where a vertex number should be") })?;
        corners.push(if index < 0 { index.saturating_add(so_far as i64 + 1) } else { index });
    }
    if corners.len() < 3 {
        return Err(MeshError::Syntax {
            line,
            what: format!("a face of {} corners, but it needs at least 3", corners.len()),
        });
    }
    Ok(corners)
}
