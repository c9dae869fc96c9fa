//! Warping: a grid that maps each place of the projected picture to a place of the drawn picture.
//!
//! - OBJ: `v x y [z]` is a place of the target, `vt u v` the place of the drawn picture shown
//!   there. Both go from 0 to 1, with the origin at the lower left. `f a/b …` are its triangles or
//!   convex polygons (`v/vt` or `v/vt/vn`; a bare `v` takes the texture corner of that number).
//! - PFM (`PF`, three floats): a grid of places, the first row at the bottom, spread evenly over
//!   the target from edge to edge. Red and green are `u` and `v`, blue is not used. A place that is
//!   not finite or lies outside −0.5 to 1.5 stays black, with the cells around it.
//!
//! Projectors throw past their screens, so their grids go beyond 0 to 1. Places of the target are
//! cut off there; for places of the drawn picture its edge is repeated. Places farther than half a
//! picture outside are refused, because they are numbers in pixels.
//!
//! Work: `Σ area of each triangle's upright box within the target ≤ 100 targets`. Grids of adjacent
//! triangles have about 2.
//!
//! Each pixel's center is located by barycentric coordinates, and the picture is sampled bilinearly
//! in linear light. Outside the grid the result is black.

use super::blend::encoded;
use crate::material::linear;
use crate::{Image, RenderError};
use std::path::Path;

/// Largest warp file, bytes.
const MAX_BYTES: u64 = 64 << 20;
/// Largest number of triangles of a grid.
const MAX_TRIANGLES: usize = 1 << 21;

/// Range of places; the picture itself is 0 to 1.
const PLACES: std::ops::RangeInclusive<f64> = -0.5..=1.5;
/// Largest sum of the areas of the triangles' upright boxes, in targets.
const MAX_COVERS: f64 = 100.0;

/// A corner: place in the target, place in the drawn picture; both 0 to 1, y up.
type Corner = ([f64; 2], [f64; 2]);

/// A grid that warps pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Warp {
    triangles: Vec<[Corner; 3]>,
}

impl Warp {
    /// Reads an OBJ or PFM file.
    ///
    /// # Errors
    /// [`RenderError::File`] with the path and, for OBJ, the line.
    pub fn load(path: &Path) -> Result<Warp, RenderError> {
        let fail = |reason: String| RenderError::File { path: path.display().to_string(), reason };
        let length = std::fs::metadata(path).map_err(|e| fail(format!("the warp grid cannot be read: {e}")))?.len();
        if length > MAX_BYTES {
            return Err(fail(format!("the warp grid has {length} bytes, and at most {MAX_BYTES} are read")));
        }
        let bytes = tumble_scene::read_file(path).map_err(|e| fail(format!("the warp grid cannot be read: {e}")))?;
        let warp = if bytes.starts_with(b"PF") { Warp::from_pfm(&bytes) } else { Warp::from_obj(&bytes) };
        warp.map_err(fail)
    }

    /// Parses the text of an OBJ file.
    ///
    /// # Errors
    /// The fault with its line.
    pub fn from_obj(bytes: &[u8]) -> Result<Warp, String> {
        let text = std::str::from_utf8(bytes)
            .map_err(|e| format!("the warp grid is not PFM and not text (byte {})", e.valid_up_to()))?;
        let (mut places, mut sources, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for (number, line) in text.lines().enumerate() {
            let at = |what: String| format!("line {}: {what}", number + 1);
            let mut words = line.split('#').next().unwrap_or("").split_whitespace();
            match words.next() {
                Some("v") => places.push(pair(words).ok_or_else(|| at(expected("v x y")))?),
                Some("vt") => sources.push(pair(words).ok_or_else(|| at(expected("vt u v")))?),
                Some("f") => {
                    let corners = words
                        .map(|word| corner(word, &places, &sources))
                        .collect::<Result<Vec<Corner>, String>>()
                        .map_err(at)?;
                    if corners.len() < 3 {
                        return Err(at(format!("a face of {} corners, expected at least 3", corners.len())));
                    }
                    triangles.extend((1..corners.len() - 1).map(|i| [corners[0], corners[i], corners[i + 1]]));
                    if triangles.len() > MAX_TRIANGLES {
                        return Err(at(format!("more than {MAX_TRIANGLES} triangles")));
                    }
                }
                _ => {}
            }
        }
        if triangles.is_empty() {
            return Err("the warp grid has no faces; expected lines `v x y`, `vt u v` and `f v/vt v/vt v/vt`".into());
        }
        Warp::of(triangles)
    }

    /// Parses the bytes of a PFM file.
    ///
    /// # Errors
    /// The fault.
    pub fn from_pfm(bytes: &[u8]) -> Result<Warp, String> {
        let (header, data) = pfm_header(bytes)?;
        let ([w, h], little) = header;
        let float = |at: usize| {
            let four: [u8; 4] = std::array::from_fn(|k| data[at + k]);
            f64::from(if little { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) })
        };
        let node = |x: usize, y: usize| -> Option<Corner> {
            let at = 12 * (y * w + x);
            let source = [float(at), float(at + 4)];
            let place = [x as f64 / (w - 1) as f64, y as f64 / (h - 1) as f64];
            source.iter().all(|s| PLACES.contains(s)).then_some((place, source))
        };
        let mut triangles = Vec::new();
        for y in 0..h - 1 {
            for x in 0..w - 1 {
                if let (Some(a), Some(b), Some(c), Some(d)) =
                    (node(x, y), node(x + 1, y), node(x + 1, y + 1), node(x, y + 1))
                {
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        if triangles.is_empty() {
            return Err("no cell of the warp grid has all its places from 0 to 1 (at most -0.5 to 1.5)".into());
        }
        Warp::of(triangles)
    }

    /// Builds a warp from triangles that are adjacent, at least approximately.
    fn of(triangles: Vec<[Corner; 3]>) -> Result<Warp, String> {
        let side = |t: &[Corner; 3], k: usize| {
            let along = t.map(|(place, _)| place[k].clamp(0.0, 1.0));
            along.iter().copied().fold(0.0, f64::max) - along.iter().copied().fold(1.0, f64::min)
        };
        let covers: f64 = triangles.iter().map(|t| side(t, 0) * side(t, 1)).sum();
        if covers > MAX_COVERS {
            return Err(format!(
                "the triangles of the warp grid cover the picture {covers:.0} times; expected adjacent triangles, and at most {MAX_COVERS} times"
            ));
        }
        Ok(Warp { triangles })
    }

    /// Returns the warped picture, of the same size.
    pub fn apply(&self, image: &Image) -> Image {
        let mut out = super::compose::blank(image.width, image.height, [0, 0, 0, 255]);
        for (pixel, from) in out.rgba.chunks_exact_mut(4).zip(self.sources([image.width, image.height])) {
            if let Some([x, y]) = from {
                pixel.copy_from_slice(&sample(image, x, y));
            }
        }
        out
    }

    /// For each pixel of a picture of this size, by rows from the top, the place that appears
    /// there, in pixels; centers are at whole numbers.
    pub(crate) fn sources(&self, [width, height]: [u32; 2]) -> Vec<Option<[f64; 2]>> {
        let (w, h) = (width as usize, height as usize);
        let mut out = vec![None; w * h];
        for triangle in &self.triangles {
            // corners in pixels of the target, y down
            let p = triangle.map(|(place, _)| [place[0] * w as f64, (1.0 - place[1]) * h as f64]);
            let area = cross(p[0], p[1], p[2]);
            if area.abs() < 1e-12 {
                continue;
            }
            let span = |k: usize, most: usize| {
                let (low, high) =
                    (p.iter().map(|c| c[k]).fold(f64::MAX, f64::min), p.iter().map(|c| c[k]).fold(f64::MIN, f64::max));
                (
                    (low - 0.5).ceil().clamp(0.0, most as f64) as usize,
                    ((high - 0.5).floor() + 1.0).clamp(0.0, most as f64) as usize,
                )
            };
            let ((x0, x1), (y0, y1)) = (span(0, w), span(1, h));
            for y in y0..y1 {
                for x in x0..x1 {
                    let middle = [x as f64 + 0.5, y as f64 + 0.5];
                    let share = [
                        cross(middle, p[1], p[2]) / area,
                        cross(p[0], middle, p[2]) / area,
                        cross(p[0], p[1], middle) / area,
                    ];
                    if share.iter().all(|s| *s >= -1e-9) {
                        let source: [f64; 2] =
                            std::array::from_fn(|k| (0..3).map(|i| share[i] * triangle[i].1[k]).sum());
                        out[y * w + x] = Some([source[0] * w as f64 - 0.5, (1.0 - source[1]) * h as f64 - 0.5]);
                    }
                }
            }
        }
        out
    }
}

/// Twice the signed area of a triangle.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Samples the picture bilinearly; pixel centers are at whole numbers, and the edge is repeated
/// outside.
fn sample(image: &Image, x: f64, y: f64) -> [u8; 4] {
    let (fx, fy) = ((x - x.round()).abs(), (y - y.round()).abs());
    let clamped = |v: f64, most: u32| v.clamp(0.0, f64::from(most - 1)) as usize;
    let at = |x: f64, y: f64| 4 * (clamped(y, image.height) * image.width as usize + clamped(x, image.width));
    if fx < 1e-6 && fy < 1e-6 {
        let i = at(x.round(), y.round());
        return std::array::from_fn(|k| image.rgba[i + k]);
    }
    let (x0, y0) = (x.floor(), y.floor());
    let (sx, sy) = ((x - x0) as f32, (y - y0) as f32);
    let taps = [
        (at(x0, y0), (1.0 - sx) * (1.0 - sy)),
        (at(x0 + 1.0, y0), sx * (1.0 - sy)),
        (at(x0, y0 + 1.0), (1.0 - sx) * sy),
        (at(x0 + 1.0, y0 + 1.0), sx * sy),
    ];
    let light =
        |k: usize| taps.iter().map(|(i, weight)| weight * linear(f32::from(image.rgba[i + k]) / 255.0)).sum::<f32>();
    [encoded(light(0)), encoded(light(1)), encoded(light(2)), 255]
}

fn expected(line: &str) -> String {
    format!("expected `{line}` with numbers from 0 to 1 (fractions of the picture, not pixels; at most -0.5 to 1.5)")
}

fn pair<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<[f64; 2]> {
    let mut number = || words.next()?.parse::<f64>().ok().filter(|x| PLACES.contains(x));
    Some([number()?, number()?])
}

/// Parses `v/vt`, `v/vt/vn` or `v`; indices start at 1, negative ones count from the end.
fn corner(word: &str, places: &[[f64; 2]], sources: &[[f64; 2]]) -> Result<Corner, String> {
    let mut parts = word.split('/');
    let place = parts.next().unwrap_or("");
    let source = parts.next().filter(|s| !s.is_empty()).unwrap_or(place);
    let pick = |digits: &str, of: &[[f64; 2]], what: &str| {
        let index = digits
            .parse::<i64>()
            .ok()
            .and_then(|i| usize::try_from(if i < 0 { of.len() as i64 + i } else { i - 1 }).ok());
        index
            .and_then(|i| of.get(i).copied())
            .ok_or_else(|| format!("the corner `{word}` names no `{what}` above it, of which there are {}", of.len()))
    };
    Ok((pick(place, places, "v")?, pick(source, sources, "vt")?))
}

/// Size, and whether the floats are little-endian.
type PfmHeader = ([usize; 2], bool);

/// Returns the header and the floats.
fn pfm_header(bytes: &[u8]) -> Result<(PfmHeader, &[u8]), String> {
    let mut words = Vec::new();
    let mut at = 0;
    while words.len() < 4 {
        let start = at
            + bytes[at..]
                .iter()
                .take(64)
                .position(|b| !b.is_ascii_whitespace())
                .ok_or("the header of the PFM file is cut off")?;
        let length = bytes[start..]
            .iter()
            .take(64)
            .position(u8::is_ascii_whitespace)
            .ok_or("the header of the PFM file is cut off")?;
        words.push(
            std::str::from_utf8(&bytes[start..start + length]).map_err(|_| "the header of the PFM file is no text")?,
        );
        at = start + length;
    }
    if words[0] != "PF" {
        return Err(format!("the PFM file is of kind {}, expected PF (three floats)", words[0]));
    }
    let side = |word: &str| {
        word.parse::<usize>()
            .ok()
            .filter(|n| (2..=1024).contains(n))
            .ok_or_else(|| format!("the PFM grid has the side {word}, expected 2 to 1024"))
    };
    let size = [side(words[1])?, side(words[2])?];
    let scale: f64 = words[3]
        .parse()
        .ok()
        .filter(|s: &f64| s.is_finite() && *s != 0.0)
        .ok_or_else(|| format!("the PFM scale is {}, expected a number", words[3]))?;
    let data = &bytes[at + 1..];
    let wanted = 12 * size[0] * size[1];
    if data.len() < wanted {
        return Err(format!("the PFM grid has {} bytes of floats, expected {wanted}", data.len()));
    }
    Ok(((size, scale < 0.0), data))
}
