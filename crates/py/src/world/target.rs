//! Objects and links that arguments name.

use crate::errors::{Error, Result};
use crate::objects::link::Link;
use crate::objects::place::by_name;
use crate::world::add::own_place;
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::dynamics::{ArticulatedBody, ObjectId};

/// An object of a world, and the name of a link of it, which may be a fixed one.
pub struct Target {
    pub id: ObjectId,
    pub link: Option<String>,
}

impl Target {
    /// Returns the articulated body and the link; `None` for an object that has no links.
    ///
    /// # Errors
    /// An articulation without a link, a link that it does not have, and a link of another object.
    pub fn link<'a>(&'a self, inner: &'a Inner) -> Result<Option<(&'a ArticulatedBody, &'a str)>> {
        let name = inner.world.name(self.id).unwrap_or_default();
        match (inner.world.get::<ArticulatedBody>(self.id), &self.link) {
            (None, None) => Ok(None),
            (Some(body), Some(link)) if body.model().frame(link).is_some() => Ok(Some((body, link.as_str()))),
            (_, Some(link)) => Err(Error::Name(format!("'{name}' has no link named '{link}'"))),
            (Some(_), None) => Err(Error::value(format!(
                "'{name}' is an articulation; name a link of it: \"{name}/LINK\", or articulation.link(\"LINK\")"
            ))),
        }
    }

    /// Returns the parts that are the shapes of the link; `None` for all of an object.
    pub fn parts(&self, inner: &Inner) -> Result<Option<Vec<usize>>> {
        let Some(link) = &self.link else { return Ok(None) };
        let parts = inner.world.get::<ArticulatedBody>(self.id).and_then(|body| body.parts_of_link(link).ok());
        let name = inner.world.name(self.id).unwrap_or_default();
        parts.map(Some).ok_or_else(|| Error::Name(format!("'{name}' has no link named '{link}'")))
    }
}

/// Converts a handle of an object or a link, a name, ``"ARTICULATION/LINK"``, or a tuple of an articulation and the name of
/// a link.
pub fn target(shared: &Arc<Shared>, value: &Bound<'_, PyAny>) -> Result<Target> {
    if let Ok(link) = value.cast::<Link>() {
        let articulation = link.get().articulation().bind(value.py());
        return Ok(Target { id: own_place(shared, articulation.as_any())?.id, link: Some(link.get().name().into()) });
    }
    if let Ok((body, link)) = value.extract::<(Bound<'_, PyAny>, String)>() {
        return Ok(Target { id: own_place(shared, &body)?.id, link: Some(link) });
    }
    if let Ok(name) = value.extract::<String>()
        && let Some((object, link)) = name.split_once('/')
        && shared.read(|inner| Ok(inner.world.find(&name).is_none()))?
    {
        let found = shared.read(|inner| by_name(inner, object))?;
        return Ok(Target { id: found.id, link: Some(link.into()) });
    }
    Ok(Target { id: own_place(shared, value)?.id, link: None })
}
