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
use super::pfm::Pfm;
use super::raster::{MAX_TRIANGLES, Patches};
use crate::material::linear;
use crate::{Image, RenderError};
use std::path::Path;

/// Largest warp file, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Range of places; the picture itself is 0 to 1.
const PLACES: std::ops::RangeInclusive<f64> = -0.5..=1.5;
/// A corner: place in the target, place in the drawn picture; both 0 to 1, y up.
type Corner = super::raster::Corner<2>;

/// A grid that warps pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Warp {
    patches: Patches<2>,
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
        Ok(Warp { patches: Patches::triangles(triangles)? })
    }

    /// Parses the bytes of a PFM file.
    ///
    /// # Errors
    /// The fault.
    pub fn from_pfm(bytes: &[u8]) -> Result<Warp, String> {
        let pfm = Pfm::parse(bytes)?;
        let inside = |uv: &[f32; 2]| uv.iter().all(|s| PLACES.contains(&f64::from(*s)));
        let nodes = pfm.values.iter().map(|[u, v, _]| Some([*u, *v]).filter(inside)).collect();
        let patches = Patches::grid(pfm.size, nodes)
            .ok_or("no cell of the warp grid has all its places from 0 to 1 (at most -0.5 to 1.5)")?;
        Ok(Warp { patches })
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
        let (w, h) = (f64::from(width), f64::from(height));
        let place = |[u, v]: [f64; 2]| [u * w - 0.5, (1.0 - v) * h - 0.5];
        self.patches.rasterized([width, height]).into_iter().map(|source| source.map(place)).collect()
    }
}

/// Samples the picture bilinearly; pixel centers are at whole numbers, and the edge is repeated
/// outside.
pub(super) fn sample(image: &Image, x: f64, y: f64) -> [u8; 4] {
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
    let (place, source) = index(word, places.len(), sources.len())?;
    Ok((places[place], sources[source]))
}

/// Parses a corner of a face as the indices, from 0, of its `v` and its `vt`, of which there are as
/// many; a bare `v` has the `vt` of its number.
pub(super) fn index(word: &str, v: usize, vt: usize) -> Result<(usize, usize), String> {
    let mut parts = word.split('/');
    let place = parts.next().unwrap_or("");
    let source = parts.next().filter(|s| !s.is_empty()).unwrap_or(place);
    let pick = |digits: &str, count: usize, what: &str| {
        digits
            .parse::<i64>()
            .ok()
            .and_then(|i| usize::try_from(if i < 0 { count as i64 + i } else { i - 1 }).ok())
            .filter(|i| *i < count)
            .ok_or_else(|| format!("the corner `{word}` names no `{what}` above it, of which there are {count}"))
    };
    Ok((pick(place, v, "v")?, pick(source, vt, "vt")?))
}
