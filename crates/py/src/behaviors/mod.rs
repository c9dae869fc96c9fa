//! Soft bodies, particles, flocks and force fields in Python, and the handles of all objects that are no bodies, joints or sensors.

pub mod body_flock;
pub mod field;
pub mod flock;
pub mod particles;
pub mod soft;
pub mod world;

use crate::errors::{Error, Result};
use crate::objects::appearance::palette;
use crate::objects::place::Place;
use crate::script::handles::{ScriptedEvent, Template};
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyString;
use std::sync::Arc;
use tumble::behaviors::{
    Attractor, BodyFlock, Boid, Buoyancy, Explosion, Flock, Panels, ParticleSystem, SpringMesh, Wind,
};
use tumble::collide::Vec3;
use tumble::dynamics::{
    Appearance, Material, ObjectId, ScriptedEvent as EventObject, Template as TemplateObject, World as Core,
};

/// The kinds of objects that have handles here.
#[derive(Clone, Copy)]
enum Kind {
    Soft,
    Particles,
    Flock,
    Boid,
    BodyFlock,
    Field,
    Event,
    Template,
}

fn kind(world: &Core, id: ObjectId) -> Option<Kind> {
    let has = |yes: bool, kind| yes.then_some(kind);
    has(world.get::<SpringMesh>(id).is_some(), Kind::Soft)
        .or_else(|| has(world.get::<ParticleSystem>(id).is_some(), Kind::Particles))
        .or_else(|| has(world.get::<Flock>(id).is_some(), Kind::Flock))
        .or_else(|| has(world.get::<Boid>(id).is_some(), Kind::Boid))
        .or_else(|| has(world.get::<BodyFlock>(id).is_some(), Kind::BodyFlock))
        .or_else(|| has(world.get::<EventObject>(id).is_some(), Kind::Event))
        .or_else(|| has(world.get::<TemplateObject>(id).is_some(), Kind::Template))
        .or_else(|| {
            let field = world.get::<Wind>(id).is_some()
                || world.get::<Attractor>(id).is_some()
                || world.get::<Explosion>(id).is_some()
                || world.get::<Buoyancy>(id).is_some()
                || world.get::<Panels>(id).is_some();
            has(field, Kind::Field)
        })
}

/// Returns the handle of the behavior of that name; `None` if there is none.
pub fn handle(py: Python<'_>, shared: &Arc<Shared>, name: &str) -> Result<Option<Py<PyAny>>> {
    let found = shared.read(|inner| {
        let Some(id) = inner.world.find(name) else { return Ok(None) };
        Ok(kind(&inner.world, id).map(|kind| (id, kind)))
    })?;
    let Some((id, kind)) = found else { return Ok(None) };
    let place = Place { shared: shared.clone(), id, name: name.into() };
    Ok(Some(match kind {
        Kind::Soft => Py::new(py, soft::Soft::new(py, place)?)?.into_any(),
        Kind::Particles => Py::new(py, particles::Particles::new(py, place)?)?.into_any(),
        Kind::Flock => Py::new(py, flock::PyFlock::new(py, place)?)?.into_any(),
        Kind::Boid => Py::new(py, flock::PyBoid::new(py, place)?)?.into_any(),
        Kind::BodyFlock => Py::new(py, body_flock::PyBodyFlock::new(py, place)?)?.into_any(),
        Kind::Event => Py::new(py, ScriptedEvent::new(py, place)?)?.into_any(),
        Kind::Template => Py::new(py, Template::new(py, place)?)?.into_any(),
        Kind::Field => name.into_pyobject(py).map_err(PyErr::from)?.into_any().unbind(),
    }))
}

/// Returns the place of a behavior of this world, given as a handle or by name; `None` if it is something else.
pub fn own_place(shared: &Arc<Shared>, value: &Bound<'_, PyAny>) -> Result<Option<Place>> {
    if value.is_instance_of::<PyString>() {
        let name: String = value.extract()?;
        return shared.read(|inner| {
            let id = inner.world.find(&name).filter(|id| kind(&inner.world, *id).is_some());
            Ok(id.map(|id| Place { shared: shared.clone(), id, name: name.as_str().into() }))
        });
    }
    let Some(place) = handle_place(value) else { return Ok(None) };
    match Arc::ptr_eq(&place.shared, shared) {
        true => place.status().map(|_| Some(place)),
        false => Err(Error::value(format!("'{}' belongs to another world", place.name))),
    }
}

/// Returns the place of a handle of a behavior, of any world; `None` if it is something else.
pub fn handle_place(value: &Bound<'_, PyAny>) -> Option<Place> {
    let place = value
        .cast::<soft::Soft>()
        .map(|handle| handle.get().place.clone())
        .or_else(|_| value.cast::<particles::Particles>().map(|handle| handle.get().place.clone()))
        .or_else(|_| value.cast::<flock::PyFlock>().map(|handle| handle.get().place.clone()))
        .or_else(|_| value.cast::<flock::PyBoid>().map(|handle| handle.get().place.clone()))
        .or_else(|_| value.cast::<body_flock::PyBodyFlock>().map(|handle| handle.get().place.clone()))
        .or_else(|_| value.cast::<ScriptedEvent>().map(|handle| handle.get().place.clone()))
        .or_else(|_| value.cast::<Template>().map(|handle| handle.get().place.clone()));
    place.ok()
}

/// Returns the place of an object that was just added.
pub fn placed(shared: &Arc<Shared>, inner: &Inner, id: ObjectId) -> Place {
    Place { shared: shared.clone(), id, name: inner.world.name(id).unwrap_or_default().into() }
}

/// Returns an appearance of a color, sRGB, each 0 to 1; without one the color of the `count`th object.
pub fn appearance(color: Option<&Bound<'_, PyAny>>, count: usize) -> Result<Appearance> {
    let color = match color {
        Some(color) => self::color(color, "color")?,
        None => palette(count),
    };
    Ok(Appearance { color, ..Appearance::default() })
}

/// Returns a color, sRGB, each 0 to 1, checked.
pub fn color(value: &Bound<'_, PyAny>, what: &str) -> Result<[f32; 3]> {
    let color = crate::arrays::convert::some::<3>(value, what)?;
    if !color.iter().all(|share| (0.0..=1.0).contains(share)) {
        return Err(Error::value(format!("{what}: {color:?}; expected numbers from 0 to 1")));
    }
    Ok(color.map(|share| share as f32))
}

/// Returns the surface constants, checked.
pub fn material(friction: f64, restitution: f64) -> Result<Material> {
    if !(friction >= 0.0 && friction.is_finite()) {
        return Err(Error::value(format!("friction is {friction}; it must be at least 0")));
    }
    if !(0.0..=1.0).contains(&restitution) {
        return Err(Error::value(format!("restitution is {restitution}; it must be 0 to 1")));
    }
    Ok(Material { friction, restitution, ..Material::default() })
}

/// Returns vectors as an array of shape (n, 3).
pub fn rows<'py>(py: Python<'py>, vectors: impl IntoIterator<Item = Vec3>) -> Result<Bound<'py, PyArray2<f64>>> {
    let numbers: Vec<f64> = vectors.into_iter().flat_map(|v| [v.x, v.y, v.z]).collect();
    let shape = [numbers.len() / 3, 3];
    Ok(PyArray1::from_vec(py, numbers).reshape(shape)?)
}
