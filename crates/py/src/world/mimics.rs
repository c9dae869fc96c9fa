//! Couplings of two joints of a world: how they are added and found.

use crate::errors::{Error, Result};
use crate::objects::mimic::Mimic;
use crate::objects::place::Place;
use crate::world::inner::Inner;
use crate::world::joints;
use crate::world::sensors;
use crate::world::shared::Shared;
use crate::world::target::{Target, target};
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::dynamics::{JointRef, Mimic as Core, ObjectId};

/// A joint that a call names.
enum Named {
    LoopJoint(ObjectId),
    Link(Target),
}

impl Named {
    /// Converts a joint, or the link of an articulation that a joint moves.
    fn of(shared: &Arc<Shared>, value: &Bound<'_, PyAny>, argument: &str) -> Result<Named> {
        if let Some(place) = joints::place_of(shared, value)? {
            return Ok(Named::LoopJoint(place.id));
        }
        match value.extract::<String>() {
            Ok(name) if !name.contains('/') => shared.read(|inner| match inner.world.find(&name) {
                Some(_) => Ok(()),
                None => {
                    Err(Error::Name(format!("{argument}: the world has no joint named '{name}'; {}", known(inner))))
                }
            })?,
            _ => {}
        }
        target(shared, value).map(Named::Link)
    }

    fn joint(&self, inner: &Inner, argument: &str) -> Result<JointRef> {
        match self {
            Named::LoopJoint(id) => Ok(JointRef::LoopJoint(*id)),
            Named::Link(target) => sensors::dof_of(inner, target, argument).map(|(body, dof)| JointRef::Dof(body, dof)),
        }
    }
}

/// Returns the words about the joints that can be coupled.
fn known(inner: &Inner) -> String {
    let names = joints::names(inner);
    let links = "a joint of an articulation is named by its link, \"ARTICULATION/LINK\"";
    match names.is_empty() {
        true => format!("it has none that add_joint made; {links}"),
        false => format!("there are {}; {links}", names.join(", ")),
    }
}

/// Couples two joints and returns the handle.
pub fn add(
    shared: &Arc<Shared>,
    py: Python<'_>,
    [joint, of]: [&Bound<'_, PyAny>; 2],
    [multiplier, offset]: [f64; 2],
    name: &str,
) -> Result<Mimic> {
    let (joint, of) = (Named::of(shared, joint, "joint")?, Named::of(shared, of, "of")?);
    let place = shared.write(py, |inner| {
        let joints = [joint.joint(inner, "joint")?, of.joint(inner, "of")?];
        let mimic = Core::between(name, &inner.world, joints, multiplier, offset)?;
        let id = inner.world.add(mimic)?;
        let name = inner.world.name(id).unwrap_or_default().into();
        Ok(Place { shared: shared.clone(), id, name })
    })?;
    Mimic::new(py, place)
}

/// Returns the handles of all couplings of a world, in the order of their addition.
pub fn all(shared: &Arc<Shared>, py: Python<'_>) -> Result<Vec<Mimic>> {
    let places = shared.read(|inner| {
        let ids = inner.world.ids().iter().filter(|id| inner.world.get::<Core>(**id).is_some());
        Ok(ids.map(|id| (*id, inner.world.name(*id).unwrap_or_default().into())).collect::<Vec<(ObjectId, Arc<str>)>>())
    })?;
    places.into_iter().map(|(id, name)| Mimic::new(py, Place { shared: shared.clone(), id, name })).collect()
}

/// Returns the place of a coupling of this world, given as a handle or by name; `None` for anything else.
pub fn place_of(shared: &Arc<Shared>, value: &Bound<'_, PyAny>) -> Result<Option<Place>> {
    if let Ok(mimic) = value.cast::<Mimic>() {
        let place = mimic.get().place.clone();
        return match Arc::ptr_eq(&place.shared, shared) {
            true => place.status().map(|_| Some(place)),
            false => Err(Error::value(format!("'{}' belongs to another world", place.name))),
        };
    }
    let Ok(name) = value.extract::<String>() else { return Ok(None) };
    shared.read(|inner| {
        let id = inner.world.find(&name).filter(|id| inner.world.get::<Core>(*id).is_some());
        Ok(id.map(|id| Place { shared: shared.clone(), id, name: name.as_str().into() }))
    })
}
