//! Configurations of SGCT (Simple Graphics Cluster Toolkit, version 3 and later) as caves. The format is
//! an open JSON schema.
//!
//! | projection | screen |
//! |---|---|
//! | `ProjectionPlane` | its three corners |
//! | `PlanarProjection` | the rectangle that its angles cut at `distance` (10) from the user |
//! | `EquirectangularProjection` | all directions |
//!
//! Axes there: x right, y up, z back; `(x, y, z)` becomes `(x, -z, y)`. Yaw is positive to the right, pitch
//! upward, roll clockwise. A viewport is a facet of its part of the window, from the lower left corner.
//! Other projections are errors; meshes, masks and nodes on other machines are notes.

use crate::mpcdi::{CalibrationError, Frustum};
use crate::to_cave::{CaveFiles, corners};
use nalgebra::{Point3, Vector3};
use serde_json::Value;
use std::fmt::Write as _;

/// Largest configuration, bytes.
const MAX_BYTES: usize = 4 << 20;
/// Largest number of viewports and of users.
const MAX_PARTS: usize = 256;

/// A value with its place in the configuration.
struct At<'a> {
    value: &'a Value,
    place: String,
}

type Result<T> = std::result::Result<T, CalibrationError>;

impl<'a> At<'a> {
    fn fail(&self, reason: impl Into<String>) -> CalibrationError {
        CalibrationError::new(self.place.clone(), reason)
    }

    fn get(&self, key: &str) -> Option<At<'a>> {
        self.value.get(key).map(|value| At { value, place: format!("{}.{key}", self.place) })
    }

    fn need(&self, key: &str) -> Result<At<'a>> {
        self.get(key).ok_or_else(|| self.fail(format!("has no \"{key}\"")))
    }

    /// Returns the entries of a list; none without the key.
    fn list(&self, key: &str) -> Result<Vec<At<'a>>> {
        let Some(list) = self.get(key) else { return Ok(Vec::new()) };
        let entries = list.value.as_array().ok_or_else(|| list.fail("is no list"))?;
        if entries.len() > MAX_PARTS {
            return Err(list.fail(format!("has {} entries, expected at most {MAX_PARTS}", entries.len())));
        }
        Ok(entries.iter().enumerate().map(|(i, value)| At { value, place: format!("{}[{i}]", list.place) }).collect())
    }

    fn number(&self) -> Result<f64> {
        self.value.as_f64().filter(|x| x.abs() <= 1e6).ok_or_else(|| self.fail("is no number up to 1e6"))
    }

    fn numbers<const N: usize>(&self, keys: [&str; N]) -> Result<[f64; N]> {
        let mut out = [0.0; N];
        for (slot, key) in out.iter_mut().zip(keys) {
            *slot = self.need(key)?.number()?;
        }
        Ok(out)
    }

    fn pair(&self, key: &str, default: [f64; 2]) -> Result<[f64; 2]> {
        self.get(key).map_or(Ok(default), |value| value.numbers(["x", "y"]))
    }

    /// Returns a vector in the axes of a cave.
    fn vector(&self) -> Result<Vector3<f64>> {
        let [x, y, z] = self.numbers(["x", "y", "z"])?;
        Ok(Vector3::new(x, -z, y))
    }

    fn text(&self, key: &str) -> Option<&'a str> {
        self.value.get(key).and_then(Value::as_str)
    }
}

/// Makes a cave of the text of a configuration. Files of meshes and masks are not read.
///
/// # Errors
/// [`CalibrationError`] with line and column of the text, or the path of the value.
pub fn sgct_to_cave(text: &str) -> Result<CaveFiles> {
    if text.len() > MAX_BYTES {
        return Err(CalibrationError::new("the configuration", format!("has more than {MAX_BYTES} bytes")));
    }
    let value: Value = serde_json::from_str(text)
        .map_err(|e| CalibrationError::new(format!("line {}, column {}", e.line(), e.column()), e.to_string()))?;
    let root = At { value: &value, place: "the configuration".into() };
    let mut out = CaveFiles { cave: String::new(), files: Vec::new(), notes: Vec::new() };
    out.cave += "description = \"A configuration of SGCT\"\n\n";
    let users = users(&root, &mut out)?;
    let mut count = 0;
    for (n, node) in root.list("nodes")?.iter().enumerate() {
        let address = node.text("address").unwrap_or("localhost");
        if !["localhost", "127.0.0.1"].contains(&address) {
            out.notes.push(format!("the windows of node {address} are facets of this machine; give them a [[node]]"));
        }
        for (w, window) in node.list("windows")?.iter().enumerate() {
            for (v, viewport) in window.list("viewports")?.iter().enumerate() {
                facet(&format!("{n}_{w}_{v}"), window, viewport, &users, &mut out)?;
                count += 1;
                if count > MAX_PARTS {
                    return Err(viewport.fail(format!("is one of more than {MAX_PARTS} viewports")));
                }
            }
        }
    }
    match count {
        0 => Err(root.fail("has no viewports")),
        _ => Ok(out),
    }
}

/// Name, name in the cave, and eye.
type User<'a> = (&'a str, String, Point3<f64>);

fn users<'a>(root: &At<'a>, out: &mut CaveFiles) -> Result<Vec<User<'a>>> {
    let mut users = Vec::new();
    for (i, user) in root.list("users")?.iter().enumerate() {
        let eye = Point3::from(user.get("pos").map_or(Ok(Vector3::zeros()), |pos| pos.vector())?);
        let apart = user.get("eyeseparation").map_or(Ok(0.06), |value| value.number())?;
        if !(0.0..=0.2).contains(&apart) {
            return Err(user.fail(format!("has an eyeseparation of {apart}, expected 0 to 0.2 m")));
        }
        let name = format!("user_{i}");
        let _ = writeln!(
            out.cave,
            "[[user]]\nname = \"{name}\"\neye_m = [{:?}, {:?}, {:?}]\ninterpupillary_m = {apart:?}\n",
            eye.x, eye.y, eye.z
        );
        users.push((user.text("name").unwrap_or(""), name, eye));
    }
    if users.is_empty() {
        return Err(root.fail("has no users"));
    }
    Ok(users)
}

fn facet(name: &str, window: &At<'_>, viewport: &At<'_>, users: &[User<'_>], out: &mut CaveFiles) -> Result<()> {
    let of = viewport.text("user").unwrap_or("");
    let user = users.iter().find(|(name, ..)| *name == of).or(users.first().filter(|_| of.is_empty()));
    let (_, user, eye) = user.ok_or_else(|| viewport.fail(format!("has the user \"{of}\", which there is not")))?;
    let screen = screen(&viewport.need("projection")?, eye)?;
    let size = window.need("size")?.numbers(["x", "y"])?;
    let (at, share) = (viewport.pair("pos", [0.0; 2])?, viewport.pair("size", [1.0; 2])?);
    let whole: [f64; 2] = std::array::from_fn(|k| (size[k] * share[k]).round());
    let (stereo, eyes) = match window.text("stereo").unwrap_or("none") {
        "none" | "no_stereo" => ("mono", [1.0, 1.0]),
        "side_by_side" => ("side_by_side", [2.0, 1.0]),
        "top_bottom" => ("top_bottom", [1.0, 2.0]),
        "anaglyph_red_cyan" => ("anaglyph", [1.0, 1.0]),
        "checkerboard" | "checkerboard_inverted" => ("checkerboard", [1.0, 1.0]),
        "vertical_interlaced" | "vertical_interlaced_inverted" => ("rows", [1.0, 1.0]),
        other => {
            out.notes.push(format!("{}: stereo \"{other}\" is read as mono", window.place));
            ("mono", [1.0, 1.0])
        }
    };
    let px: [f64; 2] = std::array::from_fn(|k| (whole[k] / eyes[k]).floor());
    if px.iter().any(|side| !(1.0..=16384.0).contains(side)) {
        return Err(viewport.fail(format!("is {} x {} pixels, expected 1 to 16384", px[0], px[1])));
    }
    // its pixels are counted from the lower left corner of the window, and the first one is the left eye's
    let [x, y] = [0, 1].map(|k| (size[k] * at[k]).round() as i64);
    let lower_row = y.saturating_add(px[1] as i64 - 1);
    let inverted = window.text("stereo").is_some_and(|word| word.ends_with("_inverted"));
    let swap_eyes = match stereo {
        "rows" => (lower_row % 2 != 0) != inverted,
        "checkerboard" => ((x % 2 + lower_row % 2) % 2 != 0) != inverted,
        _ => false,
    };
    let corner = window.pair("pos", [0.0; 2])?;
    let position = [corner[0] + size[0] * at[0], corner[1] + size[1] * (1.0 - at[1] - share[1])].map(f64::round);
    let mirrored = |key| window.value.get(key).and_then(Value::as_bool).unwrap_or(false);
    let flip = match (mirrored("mirrorx"), mirrored("mirrory")) {
        (false, false) => "none",
        (true, false) => "horizontal",
        (false, true) => "vertical",
        (true, true) => "both",
    };
    for key in ["mesh", "blendmask", "blacklevelmask", "overlay"] {
        if viewport.get(key).is_some() {
            out.notes.push(format!("{}.{key} is not used", viewport.place));
        }
    }
    let _ = writeln!(out.cave, "[[screen]]\nname = \"{name}\"\n{screen}");
    let _ = writeln!(
        out.cave,
        "[[facet]]\nname = \"{name}\"\nscreen = \"{name}\"\nuser = \"{user}\"\nsize_px = [{}, {}]\nposition_px = [{}, {}]\nstereo = \"{stereo}\"\nswap_eyes = {swap_eyes}\nflip = \"{flip}\"\n",
        px[0], px[1], position[0], position[1]
    );
    Ok(())
}

/// Returns the keys of a screen.
fn screen(projection: &At<'_>, eye: &Point3<f64>) -> Result<String> {
    let corners = match projection.text("type").unwrap_or("") {
        "EquirectangularProjection" => return Ok("shape = \"equirectangular\"\n".into()),
        "ProjectionPlane" => {
            let corner = |key| Ok(Point3::from(projection.need(key)?.vector()?));
            let (lower_left, upper_left, upper_right) =
                (corner("lowerleft")?, corner("upperleft")?, corner("upperright")?);
            [lower_left, upper_right + (lower_left - upper_left), upper_left]
        }
        "PlanarProjection" => {
            let fov = projection.need("fov")?;
            let half = |key: &str| fov.get(key).map(|value| value.number().map(|angle| 0.5 * angle)).transpose();
            let (across, upward) = (half("hfov")?, half("vfov")?);
            let edge = |key: &str, default: Option<f64>| match fov.get(key) {
                Some(value) => value.number(),
                None => default.ok_or_else(|| fov.fail(format!("has no \"{key}\""))),
            };
            let [left, right, down, up] =
                [edge("left", across)?, edge("right", across)?, edge("down", upward)?, edge("up", upward)?];
            if [left + right, down + up].iter().any(|sum| *sum <= 0.0)
                || [left, right, down, up].iter().any(|a| a.abs() >= 89.9)
            {
                return Err(fov.fail("expected angles below 89.9 degrees that enclose a picture"));
            }
            let turned = |at: At<'_>| at.numbers(["yaw", "pitch", "roll"]);
            let frustum = Frustum {
                yaw_pitch_roll_deg: projection.get("orientation").map_or(Ok([0.0; 3]), turned)?,
                edges_deg: [-left, right, -down, up],
            };
            let distance = projection.get("distance").map_or(Ok(10.0), |value| value.number())?;
            if distance <= 0.0 {
                return Err(projection.fail(format!("has a distance of {distance}, expected more than 0")));
            }
            let offset = projection.get("offset").map_or(Ok(Vector3::zeros()), |value| value.vector())?;
            corners(&frustum, *eye, distance).map(|corner| corner + offset)
        }
        other => {
            return Err(projection.fail(format!(
                "is \"{other}\", expected ProjectionPlane, PlanarProjection or EquirectangularProjection"
            )));
        }
    };
    let line = |(key, p): (&str, Point3<f64>)| format!("{key} = [{:?}, {:?}, {:?}]\n", p.x, p.y, p.z);
    Ok(["lower_left_m", "lower_right_m", "upper_left_m"].into_iter().zip(corners).map(line).collect())
}
