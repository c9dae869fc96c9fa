//! Systems of particles and their sources.

#![allow(clippy::approx_constant, reason = "defaults that Python shows as numbers")]

use crate::arrays::convert::{pose, vec3, vec3_or};
use crate::arrays::whole;
use crate::behaviors::{appearance, material, placed, rows};
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::handle::handle;
use crate::objects::place::Place;
use crate::world::add::own_place;
use crate::world::gc::Anchor;
use crate::world::query;
use crate::world::shared::Shared;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::behaviors::{Emitter as Source, Particle, ParticleLook, ParticleSettings, ParticleSystem};
use tumble::collide::Vec3;

/// A source of particles: a burst at its start, and a stream from then on.
///
/// position: shape (3,), m. orientation: unit quaternion (x, y, z, w) that turns z to the axis of its cone. body: the
/// handle or name of the body that carries it, whose frame position and orientation are in; None for the world. part:
/// of that body. radius: of a sphere around the position in which particles begin, m. speed, m/s, and lifetime, s: one
/// number, or the least and the greatest. half_angle: half the angle of the cone, rad, π for all directions. burst:
/// particles at the start. rate: particles per second. start, end: of the stream, s; end None for never.
#[pyclass(frozen, module = "tumble")]
pub struct Emitter {
    source: Source,
    body: Option<Py<PyAny>>,
    part: usize,
}

#[pymethods]
impl Emitter {
    #[new]
    #[pyo3(signature = (position=None, *, orientation=None, body=None, part=0, radius=0.0, speed=None, half_angle=3.141592653589793, lifetime=None, burst=0, rate=0.0, start=0.0, end=None, **unknown), text_signature = "(position=None, *, orientation=None, body=None, part=0, radius=0.0, speed=None, half_angle=3.141592653589793, lifetime=None, burst=0, rate=0.0, start=0.0, end=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn new(
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        body: Option<Py<PyAny>>,
        #[pyo3(from_py_with = whole::part)] part: usize,
        radius: f64,
        speed: Option<&Bound<'_, PyAny>>,
        half_angle: f64,
        lifetime: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole::burst)] burst: u32,
        rate: f64,
        start: f64,
        end: Option<f64>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Emitter> {
        keywords::check(unknown, "Emitter")?;
        let source = Source {
            pose: pose(position, orientation)?,
            mount: None,
            radius,
            speed: range(speed, "speed")?,
            half_angle,
            lifetime: range(lifetime, "lifetime")?,
            burst,
            rate,
            start,
            end: end.unwrap_or(f64::INFINITY),
        };
        // a system checks the numbers, so that a mistake is reported where it is made
        ParticleSystem::new("", ParticleSettings::default())?.with_emitter(source.clone())?;
        Ok(Emitter { source, body, part })
    }

    fn __repr__(&self) -> String {
        format!("<tumble.Emitter: burst of {}, {} per second>", self.source.burst, self.source.rate)
    }
}

/// Converts one number, or two: the least and the greatest, or those at birth and at the end; 1 for None.
fn range(value: Option<&Bound<'_, PyAny>>, what: &str) -> Result<[f64; 2]> {
    let Some(value) = value else { return Ok([1.0; 2]) };
    match value.extract::<f64>() {
        Ok(number) => Ok([number; 2]),
        Err(_) => crate::arrays::convert::some::<2>(value, what),
    }
}

/// A new system.
pub struct Given<'a, 'py> {
    pub name: &'a str,
    pub settings: ParticleSettings,
    pub surface: [f64; 2],
    pub wind: Option<&'a Bound<'py, PyAny>>,
    pub group: u8,
    pub mask: Option<&'a Bound<'py, PyAny>>,
    pub emitters: Vec<PyRef<'py, Emitter>>,
    pub color: Option<&'a Bound<'py, PyAny>>,
    pub drawn_radius: Option<f64>,
    pub fade: f64,
    pub opacity: Option<&'a Bound<'py, PyAny>>,
    pub scale: Option<&'a Bound<'py, PyAny>>,
    pub end_color: Option<&'a Bound<'py, PyAny>>,
    pub glow: bool,
}

/// Adds a system and returns its handle.
pub fn add(shared: &Arc<Shared>, py: Python<'_>, given: Given<'_, '_>) -> Result<Particles> {
    let [friction, restitution] = given.surface;
    let settings = ParticleSettings {
        material: material(friction, restitution)?,
        wind: vec3_or(given.wind, "wind", Vec3::zeros())?,
        group: query::group(given.group)?,
        mask: query::mask(given.mask)?,
        ..given.settings
    };
    let mut system = ParticleSystem::new(given.name, settings)?;
    for emitter in &given.emitters {
        let mount = match &emitter.body {
            Some(body) => Some((own_place(shared, body.bind(py))?.id, emitter.part)),
            None => None,
        };
        system = system.with_emitter(Source { mount, ..emitter.source.clone() })?;
    }
    let place = shared.write(py, |inner| {
        let mut appearance = appearance(given.color, inner.world.ids().len())?;
        appearance.properties.extend(given.glow.then(|| ("glow".to_owned(), 1.0)));
        let look = ParticleLook {
            appearance,
            radius: given.drawn_radius,
            fade: given.fade,
            opacity: given.opacity.map(|opacity| range(Some(opacity), "opacity")).transpose()?,
            scale: range(given.scale, "scale")?,
            end_color: given.end_color.map(|color| crate::behaviors::color(color, "end_color")).transpose()?,
        };
        let id = inner.world.add(system.with_look(look)?)?;
        Ok(placed(shared, inner, id))
    })?;
    Particles::new(py, place)
}

/// A system of particles of a world: points that fly, collide with bodies one way or two ways, and end.
///
/// A handle without data of its own, made by ``World.add_particles``. The arrays have one row for each particle that
/// lives, in the order of their places.
#[pyclass(frozen, module = "tumble", name = "ParticleSystem")]
pub struct Particles {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(Particles, "ParticleSystem", |_| Some(String::new()));

impl Particles {
    fn each<T>(&self, get: impl Fn(Particle) -> T) -> Result<Vec<T>> {
        self.place.read(|inner| Some(ParticleSystem::particles(&inner.world, self.place.id)?.map(get).collect()))
    }
}

#[pymethods]
impl Particles {
    /// Most particles that live at once.
    #[getter]
    fn capacity(&self) -> Result<usize> {
        self.place
            .read(|inner| inner.world.get::<ParticleSystem>(self.place.id).map(|system| system.settings().capacity))
    }

    /// Positions, shape (n, 3), m.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        rows(py, self.each(|particle| particle.position)?)
    }

    /// Velocities, shape (n, 3), m/s.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        rows(py, self.each(|particle| particle.velocity)?)
    }

    /// Times that are left, shape (n,), s.
    #[getter]
    fn lives<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.each(|particle| particle.life)?))
    }

    /// Times from birth to end, shape (n,), s.
    #[getter]
    fn lifetimes<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.each(|particle| particle.lifetime)?))
    }

    /// Numbers in the order of birth, shape (n,).
    #[getter]
    fn serials<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<u64>>> {
        Ok(PyArray1::from_vec(py, self.each(|particle| particle.serial)?))
    }

    /// Adds a particle between two steps. position: m, velocity: m/s, shape (3,); life: s, above 0. Returns its number;
    /// None if all places are taken.
    #[pyo3(signature = (position, velocity=None, life=1.0, **unknown), text_signature = "($self, position, velocity=None, life=1.0)")]
    fn spawn(
        &self,
        py: Python<'_>,
        position: &Bound<'_, PyAny>,
        velocity: Option<&Bound<'_, PyAny>>,
        life: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Option<u64>> {
        keywords::check(unknown, "ParticleSystem.spawn")?;
        let (position, velocity) = (vec3(position, "position")?, vec3_or(velocity, "velocity", Vec3::zeros())?);
        if !(life > 0.0 && life.is_finite()) {
            return Err(Error::value(format!("life is {life}; it must be above 0")));
        }
        self.place
            .write(py, |inner| Ok(ParticleSystem::spawn(&mut inner.world, self.place.id, position, velocity, life)?))
    }

    fn __len__(&self) -> Result<usize> {
        Ok(self.each(|_| ())?.len())
    }
}
