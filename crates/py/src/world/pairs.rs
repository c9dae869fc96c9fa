//! Restitution and friction of pairs: the combination rules by name, and constants of single pairs.

use crate::errors::{Error, Result};
use crate::objects::place::by_name;
use crate::world::add::own_place;
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::dynamics::{ArticulatedBody, Combine, ObjectId, PairMaterial, PairSide};
use tumble::scene::combine_by_name;

/// Returns a combination rule by its name.
pub fn combine(word: &str, what: &str) -> Result<Combine> {
    combine_by_name(word).map_err(|e| Error::value(format!("{what}: {e}")))
}

/// An object, or some parts of it.
struct Side {
    id: ObjectId,
    parts: Option<Vec<usize>>,
}

impl Side {
    fn keys(&self) -> Vec<PairSide> {
        match &self.parts {
            None => vec![PairSide::Object(self.id)],
            Some(parts) => parts.iter().map(|&part| PairSide::Part(self.id, part)).collect(),
        }
    }

    /// Returns a part of it that can collide.
    fn part(&self, inner: &Inner) -> usize {
        let body = inner.world.get::<ArticulatedBody>(self.id);
        let links = body.map_or(0, |body| body.model().links().len() + 1);
        self.parts.as_ref().map_or(Some(links), |parts| parts.first().copied()).unwrap_or(0)
    }
}

/// Converts a handle, a name, or ``"ARTICULATION/LINK"``.
fn side(shared: &Arc<Shared>, value: &Bound<'_, PyAny>) -> Result<Side> {
    if let Ok(name) = value.extract::<String>()
        && let Some((object, link)) = name.split_once('/')
        && shared.read(|inner| Ok(inner.world.find(&name).is_none()))?
    {
        return shared.read(|inner| link_side(inner, object, link));
    }
    Ok(Side { id: own_place(shared, value)?.id, parts: None })
}

fn link_side(inner: &Inner, object: &str, link: &str) -> Result<Side> {
    let id = by_name(inner, object)?.id;
    let body = inner.world.get::<ArticulatedBody>(id);
    let Some(parts) = body.and_then(|body| body.parts_of_link(link).ok()) else {
        return Err(Error::Name(format!("'{object}' has no link named '{link}'")));
    };
    match parts.is_empty() {
        true => Err(Error::value(format!("link '{link}' of '{object}' has no shape that collides"))),
        false => Ok(Side { id, parts: Some(parts) }),
    }
}

/// Sets the constants of a pair.
pub fn set(shared: &Arc<Shared>, py: Python<'_>, pair: [&Bound<'_, PyAny>; 2], material: PairMaterial) -> Result<()> {
    let (a, b) = (side(shared, pair[0])?, side(shared, pair[1])?);
    shared.write(py, |inner| {
        for a in a.keys() {
            for b in b.keys() {
                inner.world.set_pair_material(a, b, material)?;
            }
        }
        Ok(())
    })
}

/// Returns restitution and friction of a pair.
pub fn get(shared: &Arc<Shared>, pair: [&Bound<'_, PyAny>; 2]) -> Result<(f64, f64)> {
    let (a, b) = (side(shared, pair[0])?, side(shared, pair[1])?);
    shared.read(|inner| {
        let found = inner.world.pair_material((a.id, a.part(inner)), (b.id, b.part(inner)))?;
        Ok((found.restitution, found.friction))
    })
}
