//! STL, text and binary. The format has no shared vertices, so equal positions are welded (exact comparison).

use super::TriMesh;
use super::text::numbered_lines;
use crate::{MeshError, Vec3};

/// 80 bytes of title, then the count.
const HEADER: usize = 84;
/// Normal, three corners, two bytes of attributes.
const RECORD: usize = 50;

impl TriMesh {
    /// Reads the bytes of an STL file, text or binary. Nothing is allocated on the word of a header: the count must
    /// agree with the file's size.
    ///
    /// # Errors
    /// [`MeshError`]: bytes that end too early, text that is not STL, or a coordinate that is not finite.
    pub fn from_stl(bytes: &[u8]) -> Result<TriMesh, MeshError> {
        let soup = match binary_count(bytes) {
            Some(count) if bytes.len() == HEADER + RECORD * count => read_binary(bytes),
            _ if looks_like_text(bytes) => read_text(&String::from_utf8_lossy(bytes))?,
            Some(count) if bytes.len() > HEADER + RECORD * count && count > 0 => {
                read_binary(&bytes[..HEADER + RECORD * count])
            }
            Some(count) => {
                return Err(MeshError::StlSize { count, needed: HEADER + RECORD * count, size: bytes.len() });
            }
            None => return Err(MeshError::StlShort { size: bytes.len() }),
        };
        let mesh = TriMesh {
            triangles: (0..soup.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            vertices: soup,
        };
        if let Err(MeshError::NotFinite { vertex, x, y, z }) = mesh.check_data() {
            return Err(MeshError::NotFiniteInFace { face: (vertex - 1) / 3 + 1, x, y, z });
        }
        mesh.check_data()?;
        Ok(mesh.welded())
    }
}

/// The count that a binary file announces (at most u32, so `HEADER + RECORD·count` fits in 64 bits).
fn binary_count(bytes: &[u8]) -> Option<usize> {
    let word = bytes.get(80..HEADER)?;
    Some(u32::from_le_bytes([word[0], word[1], word[2], word[3]]) as usize)
}

fn looks_like_text(bytes: &[u8]) -> bool {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(1024)]);
    let head = head.trim_start_matches('\u{feff}').trim_start().to_ascii_lowercase();
    head.starts_with("solid") && (head.contains("facet") || head.contains("endsolid"))
}

fn read_binary(bytes: &[u8]) -> Vec<Vec3> {
    let number = |at: &[u8]| f64::from(f32::from_le_bytes([at[0], at[1], at[2], at[3]]));
    let corner = |at: &[u8]| Vec3::new(number(at), number(&at[4..]), number(&at[8..]));
    bytes[HEADER..].chunks_exact(RECORD).flat_map(|r| [corner(&r[12..]), corner(&r[24..]), corner(&r[36..])]).collect()
}

fn read_text(text: &str) -> Result<Vec<Vec3>, MeshError> {
    let mut soup = Vec::new();
    let mut last = 1;
    for (line, words) in numbered_lines(text) {
        let mut words = words.split_whitespace();
        match words.next() {
            Some(word) if word.eq_ignore_ascii_case("vertex") => soup.push(text_vertex(words, line)?),
            Some(word) if word.eq_ignore_ascii_case("endfacet") && soup.len() % 3 != 0 => {
                return Err(MeshError::Syntax { line, what: "a facet that does not have 3 vertices".into() });
            }
            Some(_) => last = line,
            None => {}
        }
    }
    if soup.len() % 3 != 0 {
        let line = last;
        return Err(MeshError::Syntax { line, what: "the file ends within a facet".into() });
    }
    Ok(soup)
}

fn text_vertex<'a>(mut words: impl Iterator<Item = &'a str>, line: usize) -> Result<Vec3, MeshError> {
    let mut v = Vec3::zeros();
    for k in 0..3 {
        let word = words.next().ok_or(MeshError::Syntax { line, what: "a vertex of fewer than 3 numbers".into() })?;
        v[k] = word
            .parse()
            .map_err(|_| MeshError::Syntax { line, what: format!("`{word}` where a coordinate should be") })?;
    }
    Ok(v)
}
