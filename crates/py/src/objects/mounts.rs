//! Cameras and lights that bodies and links carry.

use crate::arrays::convert::{some, vec3_or};
use crate::errors::{Error, Result};
use crate::objects::link::Link;
use pyo3::prelude::*;
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::{ArticulatedBody, CameraCarrier, CameraMount, LightCarrier, LightMount, Spread};
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
    match (spread, places) {
        (Spread::Directional, [_, None]) => {
            return Err(Error::value("direction: a directional light needs one".to_owned()));
        }
        (Spread::Directional, [Some(_), _]) => {
            return Err(Error::value("position: a directional light has none".to_owned()));
        }
        (Spread::Point { .. }, [_, Some(_)]) => {
            return Err(Error::value("direction: a point light has none".to_owned()));
        }
        _ => {}
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

#[pymethods]
impl Link {
    /// Attaches a camera, at most one, that moves with the link and that scenes keep, as ``RigidBody.attach_camera`` does; in the
    /// frame of the link.
    #[pyo3(signature = (position=None, forward=None, up=None, *, fov_deg=40.0, near=0.05, far=500.0))]
    #[pyo3(
        text_signature = "($self, position=(0.0, 0.0, 0.0), forward=(1.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), *, fov_deg=40.0, near=0.05, far=500.0)"
    )]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn attach_camera(
        &self,
        py: Python<'_>,
        position: Option<&Bound<'_, PyAny>>,
        forward: Option<&Bound<'_, PyAny>>,
        up: Option<&Bound<'_, PyAny>>,
        fov_deg: f64,
        near: f64,
        far: f64,
    ) -> Result<()> {
        let camera = camera(position, [forward, up], fov_deg, [near, far])?;
        let parts = |body: &ArticulatedBody| body.cameras().iter().map(|camera| camera.part).collect();
        let add = |body: &mut ArticulatedBody, link: &str| {
            Ok(body.add_camera(link, CameraMount { name: link.to_owned(), ..camera })?)
        };
        self.attach(py, "camera", parts, add)
    }

    /// Attaches a light, at most one, which scenes keep, as ``RigidBody.attach_light`` does; in the frame of the link.
    #[pyo3(signature = (kind="point", *, position=None, direction=None, color=None, intensity=1.0, radius=0.1, casts_shadow=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn attach_light(
        &self,
        py: Python<'_>,
        kind: &str,
        position: Option<&Bound<'_, PyAny>>,
        direction: Option<&Bound<'_, PyAny>>,
        color: Option<&Bound<'_, PyAny>>,
        intensity: f64,
        radius: f64,
        casts_shadow: Option<bool>,
    ) -> Result<()> {
        let light = light(kind, [position, direction], color, [intensity, radius], casts_shadow)?;
        let parts = |body: &ArticulatedBody| body.lights().iter().map(|light| light.part).collect();
        self.attach(py, "light", parts, |body, link| Ok(body.add_light(link, light)?))
    }
}

impl Link {
    /// Attaches a camera or a light, of which a link and the links fixed to it carry at most one. `parts` are those that carry one.
    fn attach(
        &self,
        py: Python<'_>,
        what: &str,
        parts: impl FnOnce(&ArticulatedBody) -> Vec<usize>,
        add: impl FnOnce(&mut ArticulatedBody, &str) -> Result<()>,
    ) -> Result<()> {
        let place = self.articulation().get().in_world()?;
        place.write(py, |inner| {
            let body = inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            let part = body.model().frame(self.name()).map(|frame| frame.link.unwrap_or(body.model().links().len()));
            if part.is_some_and(|part| parts(body).contains(&part)) {
                let carries = "with the links fixed to it it carries at most one";
                return Err(Error::value(format!("'{}' has a {what} already; {carries}", self.name())));
            }
            add(body, self.name())
        })
    }
}
