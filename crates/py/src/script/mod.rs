//! Scripted events in Python: triggers, actions, callables, templates, and the objects that they name.

pub mod action;
pub mod call;
pub mod handles;
pub mod trigger;
pub mod world;

use crate::errors::{Error, Result};
use crate::objects::bodies::place_of;
use crate::objects::joint::Joint;
use crate::objects::link::Link;
use crate::objects::mimic::Mimic;
use crate::objects::place::Place;
use crate::world::shared::Shared;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyString, PyTuple};
use std::sync::Arc;
use tumble::dynamics::{ObjectId, World as Core};
use tumble::scene::part_by_name;

/// A handle, a name, or ``(articulation, "LINK")``.
pub type Given = Py<PyAny>;

/// Converts an object, or a list of objects, of an argument.
pub fn several(value: Option<&Bound<'_, PyAny>>) -> Result<Vec<Given>> {
    match value {
        None => Ok(Vec::new()),
        Some(list) if list.is_instance_of::<PyList>() => {
            Ok(list.try_iter()?.map(|item| Ok(item?.unbind())).collect::<PyResult<_>>()?)
        }
        Some(one) => Ok(vec![one.clone().unbind()]),
    }
}

/// Returns the object of a world and its part. Handles must be of `shared`; without one, as in a fork that a step calls, an object of the
/// same place and name counts.
pub fn part_of(world: &Core, shared: Option<&Arc<Shared>>, value: &Bound<'_, PyAny>) -> Result<(ObjectId, usize)> {
    if value.is_instance_of::<PyString>() {
        let name: String = value.extract()?;
        return part_by_name(world, &name)
            .ok_or_else(|| Error::Name(format!("the world has no object named '{name}'")));
    }
    if let Ok(link) = value.cast::<Link>() {
        let articulation = link.get().articulation().bind(value.py()).clone().into_any();
        let pair = (articulation, link.get().name()).into_pyobject(value.py())?;
        return part_of(world, shared, pair.as_any());
    }
    if let Ok(pair) = value.cast::<PyTuple>()
        && let Ok((body, link)) = pair.extract::<(Bound<'_, PyAny>, String)>()
    {
        let (id, _) = part_of(world, shared, &body)?;
        let name = format!("{}/{link}", world.name(id).unwrap_or_default());
        return part_by_name(world, &name).ok_or_else(|| Error::Name(format!("the world has no link '{name}'")));
    }
    let place = place(value)?;
    let own = match shared {
        Some(shared) => Arc::ptr_eq(&place.shared, shared),
        None => world.name(place.id).is_none_or(|name| *name == *place.name),
    };
    match own {
        true if world.object(place.id).is_some() => Ok((place.id, 0)),
        true => Err(place.removed()),
        false => Err(Error::value(format!("'{}' belongs to another world", place.name))),
    }
}

/// Returns the place of a handle of any kind.
fn place(value: &Bound<'_, PyAny>) -> Result<Place> {
    if let Ok(joint) = value.cast::<Joint>() {
        return Ok(joint.get().place.clone());
    }
    if let Ok(mimic) = value.cast::<Mimic>() {
        return Ok(mimic.get().place.clone());
    }
    crate::behaviors::handle_place(value).map_or_else(|| place_of(value), Ok)
}
