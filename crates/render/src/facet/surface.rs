//! Curved screens: the point or direction that each pixel of a facet shows.
//!
//! A mesh is a file.
//! - OBJ: `v x y z` is a point of the screen, m, in the cave's axes; `vt u v` the place of the picture
//!   that shines there, 0 to 1 from the lower left. `f a/b …` are its triangles or convex polygons.
//! - PFM (`PF`, three floats): a grid of points `x y z`, the first row at the bottom, spread evenly over
//!   the picture from edge to edge. Nodes that are not finite leave the cells around them black.
//!
//! Points between the corners of a triangle are interpolated linearly in the picture.

use super::pfm::Pfm;
use super::raster::{Corner, MAX_TRIANGLES, Patches};
use super::warp::{Warp, index};
use crate::RenderError;
use nalgebra::Point3;
use std::path::Path;
use tumble_scene::cave::{Place, Screen, Surface};

/// Largest mesh file, bytes.
const MAX_BYTES: u64 = 64 << 20;
/// Marks a pixel that shows nothing.
pub(crate) const NOTHING: [f32; 4] = [0.0, 0.0, 0.0, -1.0];

/// The triangles of a screen.
#[derive(Clone, Debug, PartialEq)]
pub struct ScreenMesh {
    patches: Patches<3>,
}

impl ScreenMesh {
    /// Reads an OBJ or PFM file.
    ///
    /// # Errors
    /// [`RenderError::File`] with the path and, for OBJ, the line.
    pub fn load(path: &Path) -> Result<ScreenMesh, RenderError> {
        let fail = |reason: String| RenderError::File { path: path.display().to_string(), reason };
        let length = std::fs::metadata(path).map_err(|e| fail(format!("the mesh cannot be read: {e}")))?.len();
        if length > MAX_BYTES {
            return Err(fail(format!("the mesh has {length} bytes, and at most {MAX_BYTES} are read")));
        }
        let bytes = tumble_scene::read_file(path).map_err(|e| fail(format!("the mesh cannot be read: {e}")))?;
        let mesh = if bytes.starts_with(b"PF") { ScreenMesh::from_pfm(&bytes) } else { ScreenMesh::from_obj(&bytes) };
        mesh.map_err(fail)
    }

    /// Parses the text of an OBJ file.
    ///
    /// # Errors
    /// The fault with its line.
    pub fn from_obj(bytes: &[u8]) -> Result<ScreenMesh, String> {
        let text = std::str::from_utf8(bytes)
            .map_err(|e| format!("the mesh is not PFM and not text (byte {})", e.valid_up_to()))?;
        let (mut points, mut places, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for (number, line) in text.lines().enumerate() {
            let at = |what: String| format!("line {}: {what}", number + 1);
            let mut words = line.split('#').next().unwrap_or("").split_whitespace();
            match words.next() {
                Some("v") => points.push(
                    numbers::<3>(words, -1e6..=1e6)
                        .ok_or_else(|| at("expected `v x y z` with three numbers, m".into()))?,
                ),
                Some("vt") => places.push(numbers::<2>(words, -0.5..=1.5).ok_or_else(|| {
                    at("expected `vt u v` with numbers from 0 to 1 (fractions of the picture; at most -0.5 to 1.5)"
                        .into())
                })?),
                Some("f") => {
                    let corner = |word: &str| -> Result<Corner<3>, String> {
                        let (point, place) = index(word, points.len(), places.len())?;
                        Ok((places[place], points[point]))
                    };
                    let corners: Vec<Corner<3>> = words.map(corner).collect::<Result<_, _>>().map_err(at)?;
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
            return Err("the mesh has no faces; expected lines `v x y z`, `vt u v` and `f v/vt v/vt v/vt`".into());
        }
        Ok(ScreenMesh { patches: Patches::triangles(triangles)? })
    }

    /// Parses the bytes of a PFM file.
    ///
    /// # Errors
    /// The fault.
    pub fn from_pfm(bytes: &[u8]) -> Result<ScreenMesh, String> {
        let pfm = Pfm::parse(bytes)?;
        let usable = |point: &[f32; 3]| point.iter().all(|c| c.is_finite() && c.abs() <= 1e6);
        let nodes = pfm.values.iter().map(|point| Some(*point).filter(usable)).collect();
        let patches =
            Patches::grid(pfm.size, nodes).ok_or("no cell of the grid has four points with finite coordinates")?;
        Ok(ScreenMesh { patches })
    }
}

/// Returns what each pixel of a picture of this size shows, by rows from the top, in the cave's
/// axes: `x y z 1` for a point in m, `x y z 0` for a direction, and `w = -1` for nothing. A warp
/// moves places of the picture before. `None` for flat screens.
pub(crate) fn shown(
    screen: &Screen,
    mesh: Option<&ScreenMesh>,
    warp: Option<&Warp>,
    size: [u32; 2],
) -> Option<Vec<[f32; 4]>> {
    let four = |[x, y, z]: [f64; 3], w: f32| [x as f32, y as f32, z as f32, w];
    match &screen.surface {
        Surface::Flat => None,
        Surface::Mesh { .. } => {
            let points = mesh?.patches.rasterized(size);
            Some(points.into_iter().map(|point| point.map_or(NOTHING, |p| four(p, 1.0))).collect())
        }
        surface => {
            let [w, h] = size.map(f64::from);
            let at = |[x, y]: [f64; 2]| match surface.at([(x + 0.5) / w, 1.0 - (y + 0.5) / h]) {
                Some(Place::Point(p)) => four(p.coords.into(), 1.0),
                Some(Place::Direction(d)) => four(d.into(), 0.0),
                None => NOTHING,
            };
            Some(match warp {
                Some(warp) => warp.sources(size).into_iter().map(|from| from.map_or(NOTHING, at)).collect(),
                None => {
                    (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [f64::from(x), f64::from(y)])).map(at).collect()
                }
            })
        }
    }
}

/// Returns the direction from an eye to what a pixel shows, cave axes; `None` if it shows nothing.
pub(crate) fn direction(shown: [f32; 4], eye: &Point3<f64>) -> Option<[f64; 3]> {
    let [x, y, z, w] = shown.map(f64::from);
    (w >= 0.0).then(|| [x - w * eye.x, y - w * eye.y, z - w * eye.z])
}

fn numbers<'a, const N: usize>(
    mut words: impl Iterator<Item = &'a str>,
    range: std::ops::RangeInclusive<f64>,
) -> Option<[f64; N]> {
    let mut out = [0.0; N];
    for slot in &mut out {
        *slot = words.next()?.parse::<f64>().ok().filter(|x| range.contains(x))?;
    }
    Some(out)
}
