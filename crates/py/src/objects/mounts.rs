//! Cameras and lights that bodies and links carry.

use crate::arrays::convert::{array, direction_or, some, vec3_or, vector};
use crate::errors::{Error, Result};
use crate::objects::body::RigidBody;
use crate::objects::link::Link;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::collide::{Pose, Quat, Vec3};
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
    let ahead = direction_or(directions[0], "forward", Vec3::x())?;
    let up = direction_or(directions[1], "up", Vec3::z())?;
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
    let ahead = direction_or(places[1], "direction", Vec3::x())?;
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

/// Returns the arguments of a camera.
fn camera_words<'py>(py: Python<'py>, mount: &CameraMount) -> Result<Bound<'py, PyDict>> {
    let CameraMount { name: _, part: _, pose, vertical_fov, near, far } = mount;
    let words = PyDict::new(py);
    words.set_item("position", vector(py, &pose.translation.vector))?;
    words.set_item("forward", vector(py, &(pose.rotation * Vec3::x())))?;
    words.set_item("up", vector(py, &(pose.rotation * Vec3::z())))?;
    [("fov_deg", vertical_fov.to_degrees()), ("near", *near), ("far", *far)]
        .iter()
        .try_for_each(|(word, number)| words.set_item(word, number))?;
    Ok(words)
}

/// Returns the arguments of a light.
fn light_words<'py>(py: Python<'py>, mount: &LightMount) -> Result<Bound<'py, PyDict>> {
    let LightMount { part: _, pose, spread, color, intensity, casts_shadow } = mount;
    let words = PyDict::new(py);
    match spread {
        Spread::Point { radius } => {
            words.set_item("kind", "point")?;
            words.set_item("position", vector(py, &pose.translation.vector))?;
            words.set_item("radius", radius)?;
        }
        Spread::Directional => {
            words.set_item("kind", "directional")?;
            words.set_item("direction", vector(py, &(pose.rotation * Vec3::x())))?;
        }
    }
    words.set_item("color", array(py, color))?;
    words.set_item("intensity", intensity)?;
    words.set_item("casts_shadow", casts_shadow)?;
    Ok(words)
}

/// Arguments by name.
struct Words<'a, 'py>(&'static str, &'a Bound<'py, PyDict>);

impl<'py> Words<'_, 'py> {
    /// Refuses a name that is not known.
    fn only(&self, known: &[&str]) -> Result<()> {
        for word in self.1.keys() {
            let word = word.str()?.to_string();
            if !known.contains(&word.as_str()) {
                let Words(what, _) = self;
                return Err(Error::value(format!("{what}: unknown argument '{word}'; expected {}", known.join(", "))));
            }
        }
        Ok(())
    }

    fn get(&self, word: &str) -> Result<Option<Bound<'py, PyAny>>> {
        Ok(self.1.get_item(word)?.filter(|value| !value.is_none()))
    }

    fn number(&self, word: &str, usual: f64) -> Result<f64> {
        let wrong = |_| Error::value(format!("{}: {word}: expected a number", self.0));
        self.get(word)?.map_or(Ok(usual), |value| value.extract::<f64>().map_err(wrong))
    }
}

/// Reads a camera from its arguments.
fn camera_of(words: &Bound<'_, PyDict>) -> Result<CameraMount> {
    let words = Words("camera", words);
    words.only(&["position", "forward", "up", "fov_deg", "near", "far"])?;
    let [position, forward, up] = [words.get("position")?, words.get("forward")?, words.get("up")?];
    let usual = CameraMount::new("", 0, Pose::identity());
    let depths = [words.number("near", usual.near)?, words.number("far", usual.far)?];
    camera(position.as_ref(), [forward.as_ref(), up.as_ref()], words.number("fov_deg", 40.0)?, depths)
}

/// Reads a light from its arguments.
fn light_of(words: &Bound<'_, PyDict>) -> Result<LightMount> {
    let words = Words("light", words);
    words.only(&["kind", "position", "direction", "color", "intensity", "radius", "casts_shadow"])?;
    let wrong = |what: &str| Error::value(format!("light: {what}"));
    let kind = words.get("kind")?.map_or(Ok("point".to_owned()), |kind| kind.extract::<String>());
    let kind = kind.map_err(|_| wrong("kind: expected 'point' or 'directional'"))?;
    let shadow = words.get("casts_shadow")?.map(|casts| casts.extract::<bool>()).transpose();
    let shadow = shadow.map_err(|_| wrong("casts_shadow: expected True or False"))?;
    let [position, direction, color] = [words.get("position")?, words.get("direction")?, words.get("color")?];
    let numbers = [words.number("intensity", 1.0)?, words.number("radius", 0.1)?];
    light(&kind, [position.as_ref(), direction.as_ref()], color.as_ref(), numbers, shadow)
}

/// Gives a class the methods that attach a camera and a light, and properties that read, replace and remove them, by its own `carried` and
/// `carry`.
macro_rules! attachments {
    ($class:ident) => {
        #[pymethods]
        impl $class {
            /// Attaches a camera, at most one, that moves with the body or link and that scenes keep. position: shape (3,), m; forward,
            /// up: directions, shape (3,), not parallel; all in the frame of the shape of a body, or of the link. fov_deg: vertical
            /// field of view, degrees, 1 to 170. near, far: depths between which it sees, m.
            #[pyo3(signature = (position=None, forward=None, up=None, *, fov_deg=40.0, near=0.05, far=500.0, **unknown))]
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
                unknown: Option<crate::keywords::Unknown<'_, '_>>,
            ) -> Result<()> {
                crate::keywords::check(unknown, concat!(stringify!($class), ".attach_camera"))?;
                let camera = camera(position, [forward, up], fov_deg, [near, far])?;
                if self.carried()?.0.is_some() {
                    return Err(self.full("camera"));
                }
                self.carry(py, Mount::Camera(Some(camera)))
            }

            /// Attaches a light, at most one, which scenes keep. kind: ``"point"``, with position, shape (3,), m, and radius, m, or
            /// ``"directional"``, along direction, shape (3,); both in the frame of the shape of a body, or of the link. color: sRGB,
            /// shape (3,). intensity: at least 0; a directional light of 1 makes a white wall that faces it white, a point light at
            /// 1 m. casts_shadow: by default of directional lights.
            #[pyo3(signature = (kind="point", *, position=None, direction=None, color=None, intensity=1.0, radius=0.1, casts_shadow=None, **unknown))]
            #[pyo3(
                text_signature = "($self, kind='point', *, position=None, direction=None, color=None, intensity=1.0, radius=0.1, casts_shadow=None)"
            )]
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
                unknown: Option<crate::keywords::Unknown<'_, '_>>,
            ) -> Result<()> {
                crate::keywords::check(unknown, concat!(stringify!($class), ".attach_light"))?;
                let light = light(kind, [position, direction], color, [intensity, radius], casts_shadow)?;
                if self.carried()?.1.is_some() {
                    return Err(self.full("light"));
                }
                self.carry(py, Mount::Light(Some(light)))
            }

            /// The camera that it carries, as a dict of the arguments of ``attach_camera``, or None. Setting a dict replaces it, or attaches
            /// one; arguments that the dict lacks have their defaults. Setting None removes it. A link and the links fixed to it
            /// have one between them.
            #[getter]
            fn camera<'py>(&self, py: Python<'py>) -> Result<Option<Bound<'py, PyDict>>> {
                self.carried()?.0.map(|camera| camera_words(py, &camera)).transpose()
            }

            #[setter]
            fn set_camera(&self, py: Python<'_>, value: Option<&Bound<'_, PyDict>>) -> Result<()> {
                self.carry(py, Mount::Camera(value.map(camera_of).transpose()?))
            }

            /// The light that it carries, as a dict of the arguments of ``attach_light``, or None. Setting a dict replaces it, or attaches
            /// one; arguments that the dict lacks have their defaults. Setting None removes it. A link and the links fixed to it
            /// have one between them.
            #[getter]
            fn light<'py>(&self, py: Python<'py>) -> Result<Option<Bound<'py, PyDict>>> {
                self.carried()?.1.map(|light| light_words(py, &light)).transpose()
            }

            #[setter]
            fn set_light(&self, py: Python<'_>, value: Option<&Bound<'_, PyDict>>) -> Result<()> {
                self.carry(py, Mount::Light(value.map(light_of).transpose()?))
            }
        }
    };
}

attachments!(RigidBody);
attachments!(Link);

/// The camera or the light that something carries from now on; `None` for none.
enum Mount {
    Camera(Option<CameraMount>),
    Light(Option<LightMount>),
}

/// The first camera and the first light, in the frame of the shape of a body, or of the link.
type Carried = (Option<CameraMount>, Option<LightMount>);

fn carried_in(cameras: &[CameraMount], lights: &[LightMount], part: usize, to_frame: Pose) -> Carried {
    let camera = cameras.iter().find(|camera| camera.part == part).cloned();
    let light = lights.iter().find(|light| light.part == part).cloned();
    (
        camera.map(|camera| CameraMount { pose: to_frame * camera.pose, ..camera }),
        light.map(|light| LightMount { pose: to_frame * light.pose, ..light }),
    )
}

impl RigidBody {
    fn full(&self, what: &str) -> Error {
        Error::value(format!("'{}' has a {what} already, and carries at most one", self.place.name))
    }

    fn carried(&self) -> Result<Carried> {
        self.constant(|body| {
            let to_frame = Pose::from_parts(body.shape().center_of_mass().into(), Quat::identity());
            carried_in(body.cameras(), body.lights(), 0, to_frame)
        })
    }

    fn carry(&self, py: Python<'_>, mount: Mount) -> Result<()> {
        self.change(py, |body| match mount {
            Mount::Camera(camera) => body.set_cameras(camera),
            Mount::Light(light) => body.set_lights(light),
        })
    }
}

impl Link {
    fn full(&self, what: &str) -> Error {
        let most = "with the links fixed to it it carries at most one";
        Error::value(format!("'{}' has a {what} already; {most}", self.name()))
    }

    fn carried(&self) -> Result<Carried> {
        let name = self.name();
        self.articulation()
            .get()
            .of_body(|body| {
                let frame = body.model().frame(name)?;
                let part = frame.link.unwrap_or(body.model().links().len());
                Some(carried_in(body.cameras(), body.lights(), part, frame.pose.inverse()))
            })?
            .ok_or_else(|| Error::value(format!("there is no link '{name}'")))
    }

    fn carry(&self, py: Python<'_>, mount: Mount) -> Result<()> {
        let place = self.articulation().get().in_world()?;
        place.write(py, |inner| {
            let body = inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            match mount {
                Mount::Camera(camera) => {
                    let named = camera.map(|camera| CameraMount { name: self.name().to_owned(), ..camera });
                    body.set_cameras(self.name(), named)?;
                }
                Mount::Light(light) => body.set_lights(self.name(), light)?,
            }
            Ok(())
        })
    }
}
