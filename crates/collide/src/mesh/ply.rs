//! PLY, text and binary in either byte order: positions, faces and triangle strips. Other
//! properties and elements are ignored.
//!
//! ```text
//! ply
//! format ascii 1.0                          or binary_little_endian, binary_big_endian
//! element vertex 8
//! property float x                          and y, z
//! element face 6
//! property list uchar int vertex_indices    or vertex_index
//! element tristrips 1                       beside or instead of `face`
//! property list int int vertex_indices      strips, each ended by -1
//! end_header
//! ```
//!
//! The elements follow in the order of the header, each with its properties in order; a list starts
//! with its length. Counts in the header are not trusted: memory grows with the content of the
//! file.

use super::TriMesh;
use super::polygon::PolygonTriangulator;
use super::strip::strip_triangles;
use crate::{MeshError, Vec3};

/// Maximum number of lines of a header.
const MAX_LINES: usize = 10_000;

impl TriMesh {
    /// Reads the bytes of a PLY file. Faces of more than three corners are triangulated
    /// ([`PolygonTriangulator`](crate::PolygonTriangulator)). In triangle strips every second
    /// triangle is reversed, -1 starts a new strip, and triangles that repeat a vertex are skipped.
    ///
    /// # Errors
    /// [`MeshError`] names the line of the header, or the vertex, face or strip (from 1).
    pub fn from_ply(bytes: &[u8]) -> Result<TriMesh, MeshError> {
        let (header, body) = Header::read(bytes)?;
        let mut mesh = TriMesh::default();
        let (mut faces, mut strips) = (Vec::new(), Vec::new());
        let mut values = ValueReader { encoding: header.encoding, rest: body };
        for element in header.elements.iter().filter(|e| e.count > 0) {
            let kind = element.kind()?;
            for number in 1..=element.count {
                let place = || format!("{} {number}", element.name);
                match kind {
                    ElementKind::Vertex(at) => mesh
                        .vertices
                        .push(read_vertex(element, at, &mut values).map_err(|why| ply_error(&place(), &why))?),
                    ElementKind::Face(at) => {
                        faces.push(read_face(element, at, &mut values).map_err(|why| ply_error(&place(), &why))?)
                    }
                    ElementKind::Strips(at) => {
                        strips.push(read_indices(element, at, &mut values).map_err(|why| ply_error(&place(), &why))?)
                    }
                    ElementKind::Other => element
                        .properties
                        .iter()
                        .try_for_each(|p| values.property(p, |_| {}))
                        .map_err(|why| ply_error(&place(), &why))?,
                }
            }
        }
        let mut triangulator = PolygonTriangulator::default();
        for (n, corners) in faces.iter().enumerate() {
            mesh.push_face(corners, n + 1, &mut triangulator)?;
        }
        for (n, strip) in strips.iter().enumerate() {
            let triangles = strip_triangles(strip, mesh.vertices.len());
            mesh.triangles.extend(triangles.map_err(|why| ply_error(&format!("tristrips {}", n + 1), &why))?);
        }
        if mesh.triangles.is_empty() {
            return Err(header.no_triangles_error());
        }
        mesh.check_data()?;
        Ok(mesh)
    }
}

fn ply_error(place: &str, what: &str) -> MeshError {
    MeshError::Ply { what: format!("{place}: {what}") }
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy)]
enum ScalarType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl ScalarType {
    fn from_name(word: &str) -> Option<ScalarType> {
        Some(match word {
            "char" | "int8" => ScalarType::I8,
            "uchar" | "uint8" => ScalarType::U8,
            "short" | "int16" => ScalarType::I16,
            "ushort" | "uint16" => ScalarType::U16,
            "int" | "int32" => ScalarType::I32,
            "uint" | "uint32" => ScalarType::U32,
            "float" | "float32" => ScalarType::F32,
            "double" | "float64" => ScalarType::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            ScalarType::I8 | ScalarType::U8 => 1,
            ScalarType::I16 | ScalarType::U16 => 2,
            ScalarType::I32 | ScalarType::U32 | ScalarType::F32 => 4,
            ScalarType::F64 => 8,
        }
    }

    /// Decodes bytes, lowest first; unused bytes are 0.
    fn value(self, b: [u8; 8]) -> f64 {
        let (two, four) = ([b[0], b[1]], [b[0], b[1], b[2], b[3]]);
        match self {
            ScalarType::I8 => f64::from(b[0].cast_signed()),
            ScalarType::U8 => f64::from(b[0]),
            ScalarType::I16 => f64::from(i16::from_le_bytes(two)),
            ScalarType::U16 => f64::from(u16::from_le_bytes(two)),
            ScalarType::I32 => f64::from(i32::from_le_bytes(four)),
            ScalarType::U32 => f64::from(u32::from_le_bytes(four)),
            ScalarType::F32 => f64::from(f32::from_le_bytes(four)),
            ScalarType::F64 => f64::from_le_bytes(b),
        }
    }
}

struct Property {
    name: String,
    number: ScalarType,
    /// Type of the length of a list.
    length: Option<ScalarType>,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

/// The kind of an element, with the indices of its properties.
#[derive(Clone, Copy)]
enum ElementKind {
    Vertex([usize; 3]),
    Face(usize),
    Strips(usize),
    Other,
}

impl Element {
    fn kind(&self) -> Result<ElementKind, MeshError> {
        let at =
            |name: &str, list: bool| self.properties.iter().position(|p| p.name == name && p.length.is_some() == list);
        match self.name.as_str() {
            "vertex" => match ["x", "y", "z"].map(|name| at(name, false)) {
                [Some(x), Some(y), Some(z)] => Ok(ElementKind::Vertex([x, y, z])),
                _ => Err(ply_error("the element `vertex`", "expected properties x, y and z")),
            },
            name @ ("face" | "tristrips") => match at("vertex_indices", true).or_else(|| at("vertex_index", true)) {
                Some(list) if name == "face" => Ok(ElementKind::Face(list)),
                Some(list) => Ok(ElementKind::Strips(list)),
                None => Err(ply_error(&format!("the element `{name}`"), "expected `property list … vertex_indices`")),
            },
            _ => Ok(ElementKind::Other),
        }
    }
}

struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
}

impl Header {
    /// Reads the header and returns it with the remaining bytes.
    fn read(bytes: &[u8]) -> Result<(Header, &[u8]), MeshError> {
        let (mut encoding, mut elements) = (None, Vec::<Element>::new());
        let mut rest = bytes;
        for number in 1..=MAX_LINES {
            let (line, after) = first_line(rest)
                .ok_or_else(|| ply_error(&format!("line {number}"), "the file ends before `end_header`"))?;
            rest = after;
            let wrong = |what: String| ply_error(&format!("line {number}"), &what);
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words.as_slice() {
                _ if number == 1 && words != ["ply"] => return Err(wrong("expected `ply`".into())),
                ["format", word, "1.0"] => {
                    encoding = Some(match *word {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::LittleEndian,
                        "binary_big_endian" => Encoding::BigEndian,
                        other => {
                            return Err(wrong(format!(
                                "the format `{other}`; expected ascii, binary_little_endian or binary_big_endian"
                            )));
                        }
                    });
                }
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| wrong(format!("`{count}` where a count should be")))?;
                    elements.push(Element { name: (*name).into(), count, properties: Vec::new() });
                }
                ["property", "list", length, kind, name] => {
                    add_property(&mut elements, name, kind, Some(length)).map_err(wrong)?
                }
                ["property", kind, name] => add_property(&mut elements, name, kind, None).map_err(wrong)?,
                ["end_header"] => {
                    let encoding = encoding.ok_or_else(|| wrong("the header has no line `format`".into()))?;
                    // an element without properties has no data, whatever its count
                    elements.retain(|e| !e.properties.is_empty());
                    return Ok((Header { encoding, elements }, rest));
                }
                ["ply" | "comment" | "obj_info", ..] | [] => {}
                [other, ..] => {
                    return Err(wrong(format!(
                        "`{other}` where format, element, property, comment or end_header should be"
                    )));
                }
            }
        }
        Err(ply_error(&format!("line {MAX_LINES}"), "the header has no end"))
    }

    /// Returns the error of a file without triangles, such as a point cloud.
    fn no_triangles_error(&self) -> MeshError {
        let names: Vec<String> = self.elements.iter().take(10).map(|e| format!("{} {}", e.count, e.name)).collect();
        ply_error(
            "the file has no triangles",
            &format!("expected elements `face` or `tristrips`; found: {}", names.join(", ")),
        )
    }
}

fn add_property(elements: &mut [Element], name: &str, kind: &str, length: Option<&str>) -> Result<(), String> {
    let number = |word: &str| {
        ScalarType::from_name(word).ok_or_else(|| {
            format!("`{word}` is not a number type; expected char, uchar, short, ushort, int, uint, float or double")
        })
    };
    let property = Property { name: name.into(), number: number(kind)?, length: length.map(number).transpose()? };
    elements.last_mut().ok_or("a property before any element")?.properties.push(property);
    Ok(())
}

/// Returns the first line, as far as it is valid text, and the bytes after its end, which is `\n`,
/// `\r\n` or `\r`.
fn first_line(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let end = bytes.iter().position(|b| matches!(b, b'\n' | b'\r'))?;
    let long = if bytes[end..].starts_with(b"\r\n") { 2 } else { 1 };
    let line = &bytes[..end];
    // comments can have any encoding
    let text =
        std::str::from_utf8(line).unwrap_or_else(|e| std::str::from_utf8(&line[..e.valid_up_to()]).unwrap_or(""));
    Some((text, &bytes[end + long..]))
}

/// Reads the numbers after the header.
struct ValueReader<'a> {
    encoding: Encoding,
    rest: &'a [u8],
}

impl ValueReader<'_> {
    /// Reads a property and calls `each` for its numbers, without the length of a list.
    fn property(&mut self, property: &Property, mut each: impl FnMut(f64)) -> Result<(), String> {
        let Some(length) = property.length else {
            each(self.next(property.number)?);
            return Ok(());
        };
        let length = self.next(length)?;
        if !(0.0..=1e9).contains(&length) || length.fract() != 0.0 {
            return Err(format!("a list of {length} numbers"));
        }
        for _ in 0..length as usize {
            each(self.next(property.number)?);
        }
        Ok(())
    }

    fn next(&mut self, number: ScalarType) -> Result<f64, String> {
        if self.encoding == Encoding::Ascii { self.next_word() } else { self.next_bytes(number) }
    }

    fn next_bytes(&mut self, number: ScalarType) -> Result<f64, String> {
        let (own, rest) = self.rest.split_at_checked(number.bytes()).ok_or("the file ends before it")?;
        self.rest = rest;
        let mut bytes = [0; 8];
        bytes[..own.len()].copy_from_slice(own);
        if self.encoding == Encoding::BigEndian {
            bytes[..own.len()].reverse();
        }
        Ok(number.value(bytes))
    }

    fn next_word(&mut self) -> Result<f64, String> {
        let start = self.rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or("the file ends before it")?;
        let rest = &self.rest[start..];
        let (word, rest) = rest.split_at(rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len()));
        self.rest = rest;
        let word = String::from_utf8_lossy(word);
        word.parse().map_err(|_| format!("`{}` where a number should be", word.chars().take(40).collect::<String>()))
    }
}

fn read_vertex(element: &Element, at: [usize; 3], values: &mut ValueReader<'_>) -> Result<Vec3, String> {
    let mut vertex = Vec3::zeros();
    for (n, property) in element.properties.iter().enumerate() {
        let axis = at.iter().position(|k| *k == n);
        values.property(property, |value| axis.into_iter().for_each(|k| vertex[k] = value))?;
    }
    Ok(vertex)
}

/// Returns the corners as numbers from 1.
fn read_face(element: &Element, at: usize, values: &mut ValueReader<'_>) -> Result<Vec<i64>, String> {
    let mut corners = read_indices(element, at, values)?;
    if corners.len() < 3 {
        return Err(format!("{} corners, but it needs at least 3", corners.len()));
    }
    corners.iter_mut().for_each(|corner| *corner = corner.saturating_add(1));
    Ok(corners)
}

/// Returns the list at index `at` of an element's properties: vertex indices from 0, as in the
/// file.
fn read_indices(element: &Element, at: usize, values: &mut ValueReader<'_>) -> Result<Vec<i64>, String> {
    let mut indices = Vec::new();
    let mut odd = None;
    for (n, property) in element.properties.iter().enumerate() {
        values.property(property, |value| {
            if n == at {
                indices.push(value as i64);
                odd = odd.or((value.fract() != 0.0).then_some(value));
            }
        })?;
    }
    match odd {
        Some(value) => Err(format!("{value} where the number of a vertex should be")),
        None => Ok(indices),
    }
}
