//! Cameras and lights that bodies carry.

use crate::arrays::convert::{some, vec3_or};
use crate::errors::{Error, Result};
use pyo3::prelude::*;
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::{CameraMount, LightMount, Spread};
use tumble::scene::facing;

/// Largest and smallest field of view, degrees.
const FOV: [f64; 2] = [1.0, 170.0];

/// Returns a camera. `directions` are ahead and up.
pub fn camera(
    position: Option<&Bound<'_, PyAny>>,
    directions: [Option<&Bound<'_, PyAny>>; 2],
    fov_deg: f64,
    [near, far]: [f64; 2],
) -> Result<CameraMount> {
    let position = vec3_or(position, "position", Vec3::zeros())?;
    let ahead = vec3_or(directions[0], "forward", Vec3::x())?;
    let up = vec3_or(directions[1], "up", Vec3::z())?;
    let wrong = "forward and up: expected two directions, any length above 0, that are not parallel";
    let pose = facing(position.into(), ahead.into(), up.into()).ok_or_else(|| Error::value(wrong.to_owned()))?;
    if !(FOV[0]..=FOV[1]).contains(&fov_deg) {
        return Err(Error::value(format!("fov_deg is {fov_deg}; expected 1 to 170 degrees")));
    }
    if !(near > 0.0 && far > near && far.is_finite()) {
        return Err(Error::value(format!("near is {near} and far is {far}; expected 0 < near < far, m")));
    }
    Ok(CameraMount { vertical_fov: fov_deg.to_radians(), near, far, ..CameraMount::new("", 0, pose) })
}

/// Returns a light. `places` are its position and the direction of a directional one, `numbers` its intensity and radius.
pub fn light(
    kind: &str,
    places: [Option<&Bound<'_, PyAny>>; 2],
    color: Option<&Bound<'_, PyAny>>,
    [intensity, radius]: [f64; 2],
    casts_shadow: Option<bool>,
) -> Result<LightMount> {
    let position = vec3_or(places[0], "position", Vec3::zeros())?;
    let spread = match kind {
        "point" if radius > 0.0 && radius.is_finite() => Spread::Point { radius },
        "point" => return Err(Error::value(format!("radius is {radius}; expected a length above 0, m"))),
        "directional" => Spread::Directional,
        other => return Err(Error::value(format!("kind is '{other}'; expected 'point' or 'directional'"))),
    };
    if spread == Spread::Directional && places[1].is_none() {
        return Err(Error::value("direction: a directional light needs one".to_owned()));
    }
    let ahead = vec3_or(places[1], "direction", Vec3::x())?;
    let up = if ahead.normalize().z.abs() > 0.9 { Vec3::x() } else { Vec3::z() };
    let pose: Pose = facing(position.into(), ahead.into(), up.into())
        .ok_or_else(|| Error::value("direction: expected any length above 0".to_owned()))?;
    let color = color.map(|color| some::<3>(color, "color")).transpose()?.unwrap_or([1.0; 3]);
    if let Some(wrong) = color.iter().find(|share| !(0.0..=1.0).contains(*share)) {
        return Err(Error::value(format!("color: {wrong} is not from 0 to 1")));
    }
    if !(intensity >= 0.0 && intensity.is_finite()) {
        return Err(Error::value(format!("intensity is {intensity}; expected at least 0")));
    }
    let casts_shadow = casts_shadow.unwrap_or(spread == Spread::Directional);
    Ok(LightMount { part: 0, pose, spread, color, intensity, casts_shadow })
}
