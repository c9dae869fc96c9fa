//! Cameras and lights that bodies and links carry.

use crate::arrays::convert::{some, vec3_or};
use crate::errors::{Error, Result};
use crate::objects::body::RigidBody;
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

/// Gives a class the methods that attach a camera and a light, by its own `attach`.
macro_rules! attachments {
    ($class:ident) => {
        #[pymethods]
        impl $class {
            /// Attaches a camera, at most one, that moves with the body or link and that scenes keep. position: shape (3,), m; forward,
            /// up: directions, shape (3,), not parallel; all in the frame of the shape of a body, or of the link. fov_deg: vertical
            /// field of view, degrees, 1 to 170. near, far: depths between which it sees, m.
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
                self.attach(py, Mount::Camera(camera(position, [forward, up], fov_deg, [near, far])?))
            }

            /// Attaches a light, at most one, which scenes keep. kind: ``"point"``, with position, shape (3,), m, and radius, m, or
            /// ``"directional"``, along direction, shape (3,); both in the frame of the shape of a body, or of the link. color: sRGB,
            /// shape (3,). intensity: at least 0; a directional light of 1 makes a white wall that faces it white, a point light at
            /// 1 m. casts_shadow: by default of directional lights.
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
                self.attach(py, Mount::Light(light(kind, [position, direction], color, [intensity, radius], casts_shadow)?))
            }
        }
    };
}

attachments!(RigidBody);
attachments!(Link);

/// A camera or a light that is attached.
enum Mount {
    Camera(CameraMount),
    Light(LightMount),
}

impl Mount {
    fn name(&self) -> &'static str {
        if let Mount::Camera(_) = self { "camera" } else { "light" }
    }
}

impl RigidBody {
    fn attach(&self, py: Python<'_>, mount: Mount) -> Result<()> {
        let carries = self.constant(|body| match mount {
            Mount::Camera(_) => !body.cameras().is_empty(),
            Mount::Light(_) => !body.lights().is_empty(),
        })?;
        if carries {
            let (name, what) = (&self.place.name, mount.name());
            return Err(Error::value(format!("'{name}' has a {what} already, and carries at most one")));
        }
        self.change(py, |body| {
            *body = match mount {
                Mount::Camera(camera) => body.clone().with_camera(camera),
                Mount::Light(light) => body.clone().with_light(light),
            }
        })
    }
}

impl Link {
    /// Attaches a camera or a light, of which a link and the links fixed to it carry at most one.
    fn attach(&self, py: Python<'_>, mount: Mount) -> Result<()> {
        let place = self.articulation().get().in_world()?;
        place.write(py, |inner| {
            let body = inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            let part = body.model().frame(self.name()).map(|frame| frame.link.unwrap_or(body.model().links().len()));
            let carries = |part: usize| match mount {
                Mount::Camera(_) => body.cameras().iter().any(|camera| camera.part == part),
                Mount::Light(_) => body.lights().iter().any(|light| light.part == part),
            };
            if part.is_some_and(carries) {
                let (name, what) = (self.name(), mount.name());
                let most = "with the links fixed to it it carries at most one";
                return Err(Error::value(format!("'{name}' has a {what} already; {most}")));
            }
            match mount {
                Mount::Camera(camera) => {
                    body.add_camera(self.name(), CameraMount { name: self.name().to_owned(), ..camera })?;
                }
                Mount::Light(light) => body.add_light(self.name(), light)?,
            }
            Ok(())
        })
    }
}
