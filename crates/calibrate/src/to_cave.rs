//! An archive as a cave file with its warps and masks.
//!
//! | profile | screen of a region | eye |
//! |---|---|---|
//! | `2d` | its part of a rectangle 2 m high, 2 m ahead of the user | the user's |
//! | `3d` | its frustum, cut 2 m from the eye | the user's, which the archive was made for |
//! | `a3` | a mesh of its points | the user's, anywhere |
//! | `sl` | its frustum, cut 2 m from the projector | the projector's: light falls where it belongs |
//!
//! An archive has its nodes in the middle of cells, a warp here from edge to edge. So nodes are
//! interpolated linearly, and at the edges continued by half a cell.

use crate::mpcdi::{CalibrationError, Frustum, Map, Mpcdi, Profile, Region};
use nalgebra::{Point3, Vector3};
use std::fmt::Write as _;
use std::io::Cursor;
use tumble_render::{Blend, Pfm};

/// Distance at which frusta are cut, and height of the screen of profile `2d`, m.
const AHEAD_M: f64 = 2.0;
/// Largest floor of black in a cave.
const MAX_FLOOR: f32 = 0.5;

/// A cave file and the files that it names.
#[derive(Clone, Debug, PartialEq)]
pub struct CaveFiles {
    /// The text of the cave file.
    pub cave: String,
    /// Names, for the folder of the cave file, and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// Remarks for the user.
    pub notes: Vec<String>,
}

/// Makes a cave of an archive, with the eye of its user, m; x right, y ahead, z up.
///
/// # Errors
/// [`CalibrationError`] for regions without what their profile needs, and for masks that cannot be read or have
/// another size.
pub fn mpcdi_to_cave(mpcdi: &Mpcdi, eye_m: [f64; 3]) -> Result<CaveFiles, CalibrationError> {
    let mut out = CaveFiles { cave: String::new(), files: Vec::new(), notes: mpcdi.notes.clone() };
    let _ = writeln!(out.cave, "description = \"Projectors of an MPCDI archive, profile {}\"\n", mpcdi.profile.name());
    let lamps = mpcdi.profile == Profile::ShaderLamps;
    if !lamps {
        out.cave += &user("viewer", eye_m.into());
    }
    if mpcdi.profile == Profile::TwoD {
        out.notes.push("the archive has a flat picture and no room: the screen is 2 m high and 2 m ahead; set its corners as measured".into());
    }
    for (i, region) in mpcdi.regions.iter().enumerate() {
        let name = name(&region.id, i);
        let fail = |reason: &str| CalibrationError::new(format!("region \"{}\"", region.id), reason);
        let eye = if lamps { Point3::from(turned(region, region.position)) } else { eye_m.into() };
        if lamps {
            out.cave += &user(&name, eye);
        }
        let _ = writeln!(out.cave, "[[screen]]\nname = \"{name}\"");
        if mpcdi.profile == Profile::Advanced3D {
            let warp = region.warp.as_ref().ok_or_else(|| fail("has no geometryWarpFile, which profile a3 needs"))?;
            let _ = writeln!(out.cave, "shape = \"mesh\"\nmesh_file = \"region{i}_points.pfm\"\n");
            let points = Pfm { size: warp.size, values: warp.values.iter().map(|p| point(region, *p)).collect() };
            out.files.push((format!("region{i}_points.pfm"), to_edges(&points).to_bytes()));
        } else {
            let corners = match (mpcdi.profile, &region.frustum) {
                (Profile::TwoD, _) => part(region, eye),
                (_, Some(frustum)) => corners(frustum, eye, AHEAD_M),
                _ => return Err(fail("has no frustum, which profiles 3d and sl need")),
            };
            for (key, corner) in ["lower_left_m", "lower_right_m", "upper_left_m"].iter().zip(corners) {
                let _ = writeln!(out.cave, "{key} = [{:?}, {:?}, {:?}]", corner.x, corner.y, corner.z);
            }
            out.cave.push('\n');
        }
        let [w, h] = region.size_px;
        let _ = writeln!(out.cave, "[[facet]]\nname = \"{name}\"\nscreen = \"{name}\"\nsize_px = [{w}, {h}]");
        if lamps {
            let _ = writeln!(out.cave, "user = \"{name}\"");
        }
        if let Some(warp) = region.warp.as_ref().filter(|_| mpcdi.profile != Profile::Advanced3D) {
            let upward = |[u, v, _]: [f32; 3]| [u, 1.0 - v, 0.0];
            let warp = Pfm { size: warp.size, values: warp.values.iter().map(|uv| upward(*uv)).collect() };
            out.files.push((format!("region{i}_warp.pfm"), to_edges(&warp).to_bytes()));
            let _ = writeln!(out.cave, "warp_file = \"region{i}_warp.pfm\"");
        }
        masks(region, i, &mut out)?;
        out.cave.push('\n');
    }
    Ok(out)
}

/// Writes the masks of a region as shares of linear light.
fn masks(region: &Region, i: usize, out: &mut CaveFiles) -> Result<(), CalibrationError> {
    let linear = |map: &Map, what: &str| -> Result<Vec<[f32; 3]>, CalibrationError> {
        let fail = |reason: String| CalibrationError::new(format!("the {what} of region \"{}\"", region.id), reason);
        let mask = Blend::read(Cursor::new(&map.png), region.size_px).map_err(fail)?;
        Ok(mask.shares().iter().map(|shares| shares.map(|s| s.powf(map.gamma as f32))).collect())
    };
    let mut put = |name: String, shares: &[[f32; 3]]| -> Result<(), CalibrationError> {
        let png = Blend::png(shares, region.size_px).map_err(|e| CalibrationError::new(name.clone(), e.to_string()))?;
        out.files.push((name, png));
        Ok(())
    };
    if let Some(alpha) = &region.alpha {
        put(format!("region{i}_blend.png"), &linear(alpha, "alphaMap")?)?;
        let _ = writeln!(out.cave, "blend_file = \"region{i}_blend.png\"");
    }
    if let Some(beta) = &region.beta {
        let light = linear(beta, "betaMap")?;
        let floor: f32 = light.iter().flatten().copied().fold(0.0, f32::max);
        if floor > MAX_FLOOR {
            out.notes.push(format!(
                "the betaMap of region \"{}\" adds {floor} of full light to black; more than {MAX_FLOOR} is not used",
                region.id
            ));
        } else if floor > 0.0 {
            let shares: Vec<[f32; 3]> = light.iter().map(|light| [light[0] / floor; 3]).collect();
            put(format!("region{i}_black.png"), &shares)?;
            let _ = writeln!(
                out.cave,
                "black_file = \"region{i}_black.png\"\ncolor = {{ floor = [{floor:?}, {floor:?}, {floor:?}] }}"
            );
        }
    }
    Ok(())
}

fn user(name: &str, eye: Point3<f64>) -> String {
    format!("[[user]]\nname = \"{name}\"\neye_m = [{:?}, {:?}, {:?}]\n\n", eye.x, eye.y, eye.z)
}

/// Returns a name that cave files allow, unique by its number.
fn name(id: &str, i: usize) -> String {
    let allowed: String = id.chars().filter(|c| c.is_alphanumeric() || "_-".contains(*c)).take(48).collect();
    format!("{i}_{allowed}").trim_end_matches('_').to_owned()
}

/// Returns a point of the file's axes in those of the cave: right, ahead, up.
fn turned(region: &Region, p: [f64; 3]) -> [f64; 3] {
    region.axes.map(|axis| (0..3).map(|k| axis[k] * p[k]).sum())
}

fn point(region: &Region, p: [f32; 3]) -> [f32; 3] {
    turned(region, p.map(f64::from)).map(|x| (x * region.unit_m) as f32)
}

/// Returns the corners of a region's part of a flat picture: lower left, lower right, upper left.
fn part(region: &Region, eye: Point3<f64>) -> [Point3<f64>; 3] {
    let [x, y, wide, high] = region.part;
    let width = AHEAD_M * region.buffer_aspect.unwrap_or(f64::from(region.size_px[0]) / f64::from(region.size_px[1]));
    let at = |u: f64, v: f64| eye + Vector3::new((u - 0.5) * width, AHEAD_M, (0.5 - v) * AHEAD_M);
    [at(x, y + high), at(x + wide, y + high), at(x, y)]
}

/// Returns the corners of a frustum at a distance from the eye.
pub(crate) fn corners(frustum: &Frustum, eye: Point3<f64>, distance_m: f64) -> [Point3<f64>; 3] {
    let [yaw, pitch, roll] = frustum.yaw_pitch_roll_deg.map(f64::to_radians);
    let [left, right, down, up] = frustum.edges_deg.map(|angle| angle.to_radians().tan());
    let ahead = Vector3::new(yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), pitch.sin());
    let level = Vector3::new(yaw.cos(), -yaw.sin(), 0.0);
    let over = level.cross(&ahead);
    // the right wing goes down
    let (r, u) = (level * roll.cos() - over * roll.sin(), over * roll.cos() + level * roll.sin());
    [(left, down), (right, down), (left, up)].map(|(a, b)| eye + (ahead + r * a + u * b) * distance_m)
}

/// Moves nodes from the middle of their cells to a grid from edge to edge.
pub(crate) fn to_edges(pfm: &Pfm) -> Pfm {
    resampled(pfm, |i, n| i / (n - 1.0) * n - 0.5)
}

/// Moves nodes from a grid from edge to edge to the middle of their cells.
#[cfg(test)]
pub(crate) fn to_middles(pfm: &Pfm) -> Pfm {
    resampled(pfm, |i, n| (i + 0.5) / n * (n - 1.0))
}

/// Interpolates a grid linearly; `from(i, n)` is the place of node `i` of `n` in the given grid.
fn resampled(pfm: &Pfm, from: impl Fn(f64, f64) -> f64) -> Pfm {
    let [w, h] = pfm.size;
    let along = |i: usize, n: usize| {
        let at = from(i as f64, n as f64);
        let cell = (at.floor().max(0.0) as usize).min(n - 2);
        (cell, (at - cell as f64) as f32)
    };
    let values = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| {
        let ((i, f), (j, g)) = (along(x, w), along(y, h));
        let node = |i: usize, j: usize| pfm.values[j * w + i];
        let (a, b, c, d) = (node(i, j), node(i + 1, j), node(i, j + 1), node(i + 1, j + 1));
        std::array::from_fn(|k| (1.0 - g) * ((1.0 - f) * a[k] + f * b[k]) + g * ((1.0 - f) * c[k] + f * d[k]))
    });
    Pfm { size: pfm.size, values: values.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear functions stay what they are, at the edges too.
    #[test]
    fn grids_move_by_half_a_cell() {
        let (w, h) = (7, 5);
        let f = |x: f64, y: f64| [(2.0 * x - y) as f32, (0.5 + x + 3.0 * y) as f32, 1.0];
        let grid = |place: &dyn Fn(f64, f64) -> f64| Pfm {
            size: [w, h],
            values: (0..w * h).map(|i| f(place((i % w) as f64, w as f64), place((i / w) as f64, h as f64))).collect(),
        };
        let (middles, edges) = (grid(&|i, n| (i + 0.5) / n), grid(&|i, n| i / (n - 1.0)));
        let same =
            |a: &Pfm, b: &Pfm| a.values.iter().zip(&b.values).all(|(a, b)| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-5));
        assert!(same(&to_edges(&middles), &edges) && same(&to_middles(&edges), &middles));
    }
}
