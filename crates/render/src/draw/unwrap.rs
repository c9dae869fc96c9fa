//! Texture coordinates of OBJ files (`vt`). The meshes of a world do not keep them, so the renderer
//! reads them from the file again.
//!
//! A file belongs to a mesh if both have the same triangles, corner by corner. A repaired mesh
//! therefore has no file, and its texture is projected by position.

use std::path::Path;
use tumble_collide::{PolygonTriangulator, Vec3, decode_text, obj_lines};

/// Largest file that is read.
const MAX_BYTES: u64 = 256 << 20;

/// The triangles of a file and the texture coordinates of their corners.
pub(super) struct Unwrapped {
    triangles: Vec<[u32; 3]>,
    places: Vec<[[f32; 2]; 3]>,
}

impl Unwrapped {
    /// Reads an OBJ file. Returns `None` for other files, and if a corner has no texture
    /// coordinates.
    pub fn load(path: &Path) -> Option<Unwrapped> {
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) || path.metadata().ok()?.len() > MAX_BYTES {
            return None;
        }
        Unwrapped::parse(&decode_text(&tumble_scene::read_file(path).ok()?).ok()?)
    }

    /// Parses the text; polygons are triangulated as in [`tumble_collide::TriMesh::from_obj`].
    fn parse(text: &str) -> Option<Unwrapped> {
        let (mut vertices, mut known, mut faces) = (Vec::new(), Vec::new(), Vec::new());
        for (_, line) in obj_lines(text) {
            let mut words = line.split_whitespace();
            match words.next() {
                Some("v") => {
                    let mut number = || words.next()?.parse::<f64>().ok();
                    vertices.push(Vec3::new(number()?, number()?, number()?));
                }
                Some("vt") => {
                    let mut number = || words.next()?.parse::<f32>().ok().filter(|x| x.is_finite());
                    known.push([number()?, number().unwrap_or(0.0)]);
                }
                Some("f") => {
                    let corners = words
                        .take_while(|w| !w.starts_with('#'))
                        .map(|word| corner(word, vertices.len() as i64, &known));
                    faces.push(corners.collect::<Option<Vec<(u32, [f32; 2])>>>()?);
                }
                _ => {}
            }
        }
        let (mut out, mut triangulator) =
            (Unwrapped { triangles: Vec::new(), places: Vec::new() }, PolygonTriangulator::default());
        for corners in faces {
            let points: Vec<Vec3> =
                corners.iter().map(|c| vertices.get(c.0 as usize).copied()).collect::<Option<_>>()?;
            for triangle in triangulator.triangulate(&points).ok()? {
                out.triangles.push(triangle.map(|k| corners[k].0));
                out.places.push(triangle.map(|k| corners[k].1));
            }
        }
        (!out.triangles.is_empty()).then_some(out)
    }

    /// Returns the coordinates for these triangles, if they are those of the file.
    pub fn places_of(&self, triangles: &[[u32; 3]]) -> Option<&[[[f32; 2]; 3]]> {
        (self.triangles == triangles).then_some(&self.places)
    }
}

/// Parses `v/vt` or `v/vt/vn`: the vertex index from 0 and its texture coordinates.
fn corner(word: &str, vertices: i64, known: &[[f32; 2]]) -> Option<(u32, [f32; 2])> {
    let mut numbers = word.split('/');
    let mut index = |count: i64| {
        let n: i64 = numbers.next()?.parse().ok()?;
        Some(if n < 0 { n.checked_add(count)? } else { n - 1 })
    };
    let vertex = u32::try_from(index(vertices)?).ok()?;
    let place = *known.get(usize::try_from(index(known.len() as i64)?).ok()?)?;
    Some((vertex, place))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

    #[test]
    fn corners_find_their_places() {
        for face in ["f 1/1 2/2 3/3 4/4", "f 1/1/9 2/2/9 3/3/9 4/4/9 # a square", "f -4/-4 -3/-3 -2/-2 -1/-1"] {
            let read = Unwrapped::parse(&format!("{SQUARE}{face}\n")).unwrap();
            let places = read.places_of(&[[0, 1, 2], [0, 2, 3]]).unwrap();
            assert_eq!(places, [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]]);
            assert!(read.places_of(&[[0, 1, 2], [0, 3, 2]]).is_none());
        }
        for face in ["f 1 2 3", "f 1//1 2//1 3//1", "f 1/1 2/2 3/5", "f 1/1 2/2 3/0", "f 1/1 2/2 0/3", ""] {
            assert!(Unwrapped::parse(&format!("{SQUARE}{face}\n")).is_none(), "{face}");
        }
    }
}
