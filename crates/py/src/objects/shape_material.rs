//! Surface constants of single shapes of bodies and links.

use crate::arrays::convert::{array, some};
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown, refusal};
use crate::objects::articulation::Articulation;
use crate::objects::body::RigidBody;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::dynamics::{ArticulatedBody, Material};

/// Names of the numbers among the constants of a surface.
const NUMBERS: [&str; 8] = [
    "friction",
    "restitution",
    "static_friction",
    "stribeck_speed",
    "rolling_friction",
    "torsional_friction",
    "tangential_restitution",
    "adhesion",
];

/// Returns the places of these numbers.
fn places(m: &mut Material) -> [&mut f64; NUMBERS.len()] {
    [
        &mut m.friction,
        &mut m.restitution,
        &mut m.static_friction,
        &mut m.stribeck_speed,
        &mut m.rolling_friction,
        &mut m.torsional_friction,
        &mut m.tangential_restitution,
        &mut m.adhesion,
    ]
}

/// Returns constants as a dict.
fn as_dict<'py>(py: Python<'py>, m: &Material) -> Result<Bound<'py, PyDict>> {
    let constants = PyDict::new(py);
    let mut own = *m;
    let numbers = NUMBERS.iter().zip(places(&mut own));
    numbers.into_iter().try_for_each(|(name, value)| constants.set_item(name, *value))?;
    constants.set_item("friction_scale", array(py, m.friction_scale.as_slice()))?;
    constants.set_item("surface_velocity", array(py, m.surface_velocity.as_slice()))?;
    Ok(constants)
}

/// Constants that a call sets, by the names of ``as_dict``.
#[derive(Default)]
pub struct Given {
    numbers: [Option<f64>; NUMBERS.len()],
    scale: Option<[f64; 3]>,
    velocity: Option<[f64; 3]>,
}

impl Given {
    /// Reads the keyword arguments of surfaces of `function`: all that it has no arguments of its own for. None is as not given.
    pub fn of_words(function: &str, words: Option<&Bound<'_, PyDict>>) -> Result<Given> {
        let mut given = Given::default();
        for (word, value) in words.into_iter().flat_map(|words| words.iter()) {
            let word: String = word.extract()?;
            let number = NUMBERS.iter().position(|name| *name == word);
            match (word.as_str(), number) {
                ("friction_scale" | "surface_velocity", _) | (_, Some(_)) if value.is_none() => {}
                ("friction_scale", _) => given.scale = Some(some::<3>(&value, &word)?),
                ("surface_velocity", _) => given.velocity = Some(some::<3>(&value, &word)?),
                (_, Some(k)) => {
                    let wrong = |e| PyTypeError::new_err(format!("{word}: {e}"));
                    given.numbers[k] =
                        Some(value.extract::<f64>().map_err(|e| wrong(e.value(value.py()).to_string()))?);
                }
                _ => {
                    let more = [NUMBERS.as_slice(), &["friction_scale", "surface_velocity"]].concat();
                    return Err(refusal(value.py(), function, &word, &more)?.into());
                }
            }
        }
        Ok(given)
    }

    /// Returns the constants with those that are given; `None` if none is.
    pub fn over(&self, mut m: Material) -> Option<Material> {
        let mut given = self.scale.is_some() || self.velocity.is_some();
        for (place, number) in places(&mut m).into_iter().zip(self.numbers) {
            given |= number.is_some();
            number.iter().for_each(|number| *place = *number);
        }
        self.scale.iter().for_each(|scale| m.friction_scale = (*scale).into());
        self.velocity.iter().for_each(|velocity| m.surface_velocity = (*velocity).into());
        given.then_some(m)
    }
}

/// A shape that a user names or numbers.
pub enum Which {
    Number(usize),
    Name(String),
}

impl<'py> FromPyObject<'_, 'py> for Which {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Which> {
        if let Ok(name) = value.extract() {
            return Ok(Which::Name(name));
        }
        let wrong = || {
            let written: String =
                value.repr().map_or_else(|_| "it".into(), |s| s.to_string()).chars().take(40).collect();
            PyErr::from(Error::value(format!("shape: expected a name or a number from 0, got {written}")))
        };
        value.extract().map(Which::Number).map_err(|_| wrong())
    }
}

#[pymethods]
impl RigidBody {
    /// Returns the surface constants of one shape: a dict by the names of ``set_shape_material``.
    ///
    /// shape: name, or index of the part of a ``Compound``, as ``shapes`` of contacts has it.
    #[pyo3(signature = (shape, **unknown), text_signature = "($self, shape)")]
    fn shape_material<'py>(
        &self,
        py: Python<'py>,
        shape: Which,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyDict>> {
        keywords::check(unknown, "RigidBody.shape_material")?;
        let shape = self.numbered(shape)?;
        as_dict(py, &self.constant(|body| body.shape_material(shape))?)
    }
}

/// Gives a class the method `set_shape_material`, whose first arguments say which shape; `$set` sets the constants that are given.
macro_rules! set_shape_material {
    ($class:ident, ($($place:ident: $kind:ty),+), $shown:literal, $set:expr, $(#[$doc:meta])+) => {
        #[pymethods]
        impl $class {
            $(#[$doc])+
            #[pyo3(signature = ($($place),+, **surface))]
            #[pyo3(text_signature = $shown)]
            fn set_shape_material(
                &self,
                py: Python<'_>,
                $($place: $kind),+,
                surface: Option<&Bound<'_, PyDict>>,
            ) -> Result<()> {
                let given = Given::of_words(concat!(stringify!($class), ".set_shape_material"), surface)?;
                let set: fn(&$class, Python<'_>, Given, $($kind),+) -> Result<()> = $set;
                set(self, py, given, $($place),+)
            }
        }
    };
}

set_shape_material!(
    RigidBody,
    (shape: Which),
    "($self, shape, *, friction=None, restitution=None, static_friction=None, stribeck_speed=None, friction_scale=None, \
     rolling_friction=None, torsional_friction=None, tangential_restitution=None, adhesion=None, surface_velocity=None)",
    |body, py, given, shape| {
        let shape = body.numbered(shape)?;
        body.change(py, |body| body.set_shape_material(shape, given.over(body.shape_material(shape))))
    },
    /// Sets surface constants of one shape, the part of a ``Compound``, by the names of the properties of the body.
    ///
    /// shape: name or index of the part. Constants that are not given stay as they are, for a shape without its own those of
    /// the body at this time. Without any, the shape has those of the body again.
);

set_shape_material!(
    Articulation,
    (link: &str, shape: Which),
    "($self, link, shape, *, friction=None, restitution=None, static_friction=None, stribeck_speed=None, friction_scale=None, \
     rolling_friction=None, torsional_friction=None, tangential_restitution=None, adhesion=None, surface_velocity=None)",
    |articulation, py, given, link, shape| {
        let (place, (part, shape)) = (articulation.in_world()?, articulation.of_link(link, shape)?);
        place.write(py, |inner| {
            let body = inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            let material = body.shape_material(part, shape).and_then(|own| given.over(own));
            Ok(body.set_shape_material(part, shape, material)?)
        })
    },
    /// Sets surface constants of one shape of a link of a body in a world, by the names of ``RigidBody.set_shape_material``.
    ///
    /// shape: name, or number as ``shapes`` of contacts has it. Constants that are not given stay as they are. Without any,
    /// a part of a ``Compound`` has those of the compound again.
);

impl RigidBody {
    pub fn numbered(&self, shape: Which) -> Result<usize> {
        match shape {
            Which::Number(number) => Ok(number),
            Which::Name(name) => self.shape_number(&name),
        }
    }
}

#[pymethods]
impl Articulation {
    /// Returns the surface constants of one shape of a link: a dict by the names of ``set_shape_material``.
    ///
    /// shape: name, or number as ``shapes`` of contacts has it.
    #[pyo3(signature = (link, shape, **unknown), text_signature = "($self, link, shape)")]
    fn shape_material<'py>(
        &self,
        py: Python<'py>,
        link: &str,
        shape: Which,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyDict>> {
        keywords::check(unknown, "Articulation.shape_material")?;
        let (part, shape) = self.of_link(link, shape)?;
        let found = self.of_body(|body| body.shape_material(part, shape))?;
        as_dict(py, &found.unwrap_or_default())
    }
}

impl Articulation {
    /// Returns the part and the index there of a shape of a link.
    pub(super) fn of_link(&self, link: &str, shape: Which) -> Result<(usize, usize)> {
        let number = match shape {
            Which::Number(number) => number,
            Which::Name(name) => self.shape_number(link, &name)?,
        };
        self.robot.frame(link)?;
        let (found, count) = self.of_body(|body| {
            let frame = body.model().frame_index(link);
            let of_link = || frame.into_iter().flat_map(|frame| body.shapes_of(frame)).map(|(part, n, _)| (part, n));
            (of_link().nth(number), of_link().count())
        })?;
        found.ok_or_else(|| Error::value(format!("link '{link}' has no shape {number}; it has {count} that collide")))
    }
}
