//! Adds bodies to a world.

use crate::arrays::convert::base_pose;
use crate::errors::{Error, Result};
use crate::io::slow;
use crate::objects::appearance;
use crate::objects::articulation::Articulation;
use crate::objects::bodies::place_of;
use crate::objects::body::RigidBody;
use crate::objects::description::described;
use crate::objects::place::{Place, by_name};
use crate::objects::shapes::Shape;
use crate::world::shared::Shared;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyString;
use std::sync::Arc;
use tumble::collide::Pose;
use tumble::dynamics::{Mode, RigidBody as Rigid};

/// Returns the place of a body of this world, given as a handle or by name.
pub fn own_place(shared: &Arc<Shared>, body: &Bound<'_, PyAny>) -> Result<Place> {
    let place = match body.extract::<String>() {
        Ok(name) => {
            let found = shared.read(|inner| by_name(inner, &name))?;
            Place { shared: shared.clone(), id: found.id, name: name.into() }
        }
        Err(_) => place_of(body)?,
    };
    match Arc::ptr_eq(&place.shared, shared) {
        true => place.status().map(|_| place),
        false => Err(Error::value(format!("'{}' belongs to another world", place.name))),
    }
}

/// Returns the name, empty if there is none, and the shape of a body. The shape may take the place of the name.
pub fn named_shape<'py>(
    name: Option<&Bound<'py, PyAny>>,
    shape: Option<&Bound<'py, PyAny>>,
) -> PyResult<(String, PyRef<'py, Shape>)> {
    let (name, shape) = match (name, shape) {
        (Some(first), None) if !first.is_instance_of::<PyString>() => (None, Some(first)),
        given => given,
    };
    let name = name.map_or(Ok(String::new()), |name| name.extract())?;
    let shape = shape
        .ok_or_else(|| PyTypeError::new_err("a shape is missing: add_rigid(\"name\", shape) or add_rigid(shape)"))?;
    Ok((name, shape.extract()?))
}

/// Returns a fixed body of a shape, with the name of the shape.
pub fn solid(shape: &Shape) -> Rigid {
    shape.name.iter().fold(Rigid::fixed(shape.solid.clone()), Rigid::with_shape_name)
}

/// Returns a body with a mass or a density; without both it has the densities of the parts of a compound, the default density, or no mass if it is kinematic.
pub fn rigid(name: &str, shape: &Shape, mass: Option<f64>, density: Option<f64>, kinematic: bool) -> Result<Rigid> {
    let body = solid(shape).with_name(name);
    match (mass, density) {
        (Some(mass), None) => Ok(body.with_mass(mass)),
        (None, density) if !kinematic => {
            let own = || shape.solid.own_density().unwrap_or(Rigid::DEFAULT_DENSITY);
            Ok(body.with_density(density.unwrap_or_else(own)))
        }
        (None, Some(density)) => Ok(body.with_density(density)),
        (None, None) => Ok(body),
        (Some(_), Some(_)) => {
            let body = if name.is_empty() { "the new body".into() } else { format!("body '{name}'") };
            Err(Error::value(format!("{body}: expected a mass or a density, not both")))
        }
    }
}

/// Adds a body, with its intersection test if it has one, and returns its handle.
pub fn add(
    shared: &Arc<Shared>,
    py: Python<'_>,
    body: Rigid,
    mode: Mode,
    collidable: bool,
    intersect: Option<&Bound<'_, PyAny>>,
    look: Option<&Bound<'_, PyAny>>,
) -> Result<RigidBody> {
    let look = look.map(appearance::given).transpose()?;
    if let Some(test) = intersect {
        py.import("tumble._extension")?.call_method1("check_intersect", (test,))?;
    }
    let place = shared.write(py, |inner| {
        let body = match &look {
            Some(look) => appearance::described(body, look),
            None => appearance::usual(body, inner.world.ids().len()),
        };
        let id = inner.world.add_boxed(Box::new(body), mode)?;
        inner.world.set_collidable(id, collidable)?;
        let name = inner.world.name(id).unwrap_or_default().into();
        Ok(Place { shared: shared.clone(), id, name })
    })?;
    if let Some(test) = intersect {
        shared.extend(py, |inner| inner.set_test(place.id, None, Some(test)))?;
    }
    RigidBody::new(py, place)
}

/// Adds an articulated body, a description or the path of one, and returns its handle.
pub fn articulated(
    shared: &Arc<Shared>,
    py: Python<'_>,
    description: &Bound<'_, PyAny>,
    base: Option<&Bound<'_, PyAny>>,
    name: Option<&str>,
) -> Result<Articulation> {
    let description = described(description)?;
    let description = description.get();
    let (body, robot, notes) = description.body(py, base.map_or(Ok(Pose::identity()), base_pose)?, name)?;
    slow::warn(py)?;
    let (robot, efforts) = (Arc::new(robot), description.spot.efforts());
    let place = shared.write(py, |inner| {
        let id = inner.world.add(body)?;
        inner.robots.insert(id, robot.clone());
        efforts.map(|tau| inner.efforts.insert(id, tau));
        let name: Arc<str> = inner.world.name(id).unwrap_or_default().into();
        inner.notes.extend(notes.iter().map(|note| format!("articulated \"{name}\": {note}")));
        Ok(Place { shared: shared.clone(), id, name })
    })?;
    Articulation::placed(py, place, robot)
}
