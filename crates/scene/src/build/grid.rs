//! Grids of signed distances from NumPy files (`.npy`), for `type = "sdf"`.
//!
//! | bytes | content |
//! |---|---|
//! | 6, 2 | `\x93NUMPY`, version 1.0, 2.0 or 3.0 |
//! | 2 or 4 | length of the header, little-endian; 4 from version 2.0 on |
//! | that many | a Python dictionary: `descr`, `fortran_order`, `shape` |
//! | the rest | the numbers |

/// Maximum number of values of a grid.
const MAX_VALUES: usize = 20_000_000;
/// Maximum length of a header, bytes.
const MAX_HEADER: usize = 4096;

/// Values on a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct ValueGrid {
    /// Values, those along x next to each other, then y, then z.
    pub values: Vec<f64>,
    /// Number of grid points along x, y and z.
    pub counts: [usize; 3],
}

impl ValueGrid {
    /// Makes a grid of values in C order, as numpy stores `values[i, j, k]` of x, y and z.
    ///
    /// # Errors
    /// A message, if there are more or fewer values than grid points.
    pub fn of_c_order(values: &[f64], counts: [usize; 3]) -> Result<ValueGrid, String> {
        let [nx, ny, nz] = counts;
        if size_of(counts) != Some(values.len()) {
            return Err(format!("{} values for {counts:?} grid points", values.len()));
        }
        let points = (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (i * ny + j) * nz + k)));
        Ok(ValueGrid { values: points.map(|at| values[at]).collect(), counts })
    }
}

fn size_of(counts: [usize; 3]) -> Option<usize> {
    counts.iter().try_fold(1_usize, |n, m| n.checked_mul(*m))
}

/// Reads a grid of three axes from the bytes of a NumPy file: 32 or 64-bit floats, little-endian.
///
/// # Errors
/// A message for a file of another kind, of another shape, that is cut off, or with more than 20 million values.
pub fn read_grid(bytes: &[u8]) -> Result<ValueGrid, String> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or("it is no NumPy file: it does not begin with \\x93NUMPY")?;
    let cut = || "the NumPy file is cut off".to_string();
    let (version, rest) = rest.split_first_chunk::<2>().ok_or_else(cut)?;
    let (length, rest) = match version[0] {
        1 => rest.split_first_chunk().map(|(n, rest)| (u16::from_le_bytes(*n) as usize, rest)),
        2 | 3 => rest.split_first_chunk().map(|(n, rest)| (u32::from_le_bytes(*n) as usize, rest)),
        other => return Err(format!("the NumPy file has version {other}; known are 1 to 3")),
    }
    .ok_or_else(cut)?;
    if length > MAX_HEADER {
        return Err(format!("the header of the NumPy file has {length} bytes; the limit is {MAX_HEADER}"));
    }
    let (header, data) = rest.split_at_checked(length).ok_or_else(cut)?;
    let header = std::str::from_utf8(header).map_err(|_| "the header of the NumPy file is no text")?;
    let width = match entry(header, "descr") {
        Some(kind) if kind.starts_with("'<f8'") => 8,
        Some(kind) if kind.starts_with("'<f4'") => 4,
        Some(kind) => {
            let kind: String = kind.chars().take(16).collect();
            return Err(format!("its numbers are {kind}; expected '<f8' or '<f4': values.astype(\"<f8\")"));
        }
        None => return Err("the header of the NumPy file has no `descr`".into()),
    };
    let fortran = entry(header, "fortran_order").is_some_and(|order| order.starts_with("True"));
    let counts = entry(header, "shape").and_then(shape_of);
    let counts = counts.ok_or("the array must have three axes: values[i, j, k] along x, y and z")?;
    let count = size_of(counts).filter(|n| *n <= MAX_VALUES);
    let count = count.ok_or_else(|| format!("{counts:?} values; there may be at most {MAX_VALUES} in all"))?;
    if data.len() != count * width {
        let expected = count * width;
        return Err(format!("it has {} bytes of numbers; {counts:?} need {expected}", data.len()));
    }
    let number = |chunk: &[u8]| match chunk.as_array::<8>() {
        Some(wide) => f64::from_le_bytes(*wide),
        None => chunk.as_array::<4>().map_or(f64::NAN, |narrow| f64::from(f32::from_le_bytes(*narrow))),
    };
    let values: Vec<f64> = data.chunks_exact(width).map(number).collect();
    if fortran { Ok(ValueGrid { values, counts }) } else { ValueGrid::of_c_order(&values, counts) }
}

/// Returns the text after a key of the header.
fn entry<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let at = header.find(&format!("'{key}'"))?;
    Some(header[at + key.len() + 2..].trim_start().strip_prefix(':')?.trim_start())
}

/// Returns the numbers of a tuple of three.
fn shape_of(text: &str) -> Option<[usize; 3]> {
    let inner = text.strip_prefix('(')?.split_once(')')?.0;
    let numbers: Vec<usize> = inner.split(',').map(|n| n.trim().parse().ok()).collect::<Option<_>>()?;
    <[usize; 3]>::try_from(numbers).ok()
}
