//! Restitution and friction of pairs: the combination rules by name, and constants of single pairs.

use crate::errors::{Error, Result};
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use crate::world::target::target;
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

/// Converts what names an object or a link with shapes.
fn side(shared: &Arc<Shared>, value: &Bound<'_, PyAny>) -> Result<Side> {
    let target = target(shared, value)?;
    let parts = shared.read(|inner| target.parts(inner))?;
    if parts.as_ref().is_some_and(Vec::is_empty) {
        let link = target.link.unwrap_or_default();
        return Err(Error::value(format!("link '{link}' has no shape that collides")));
    }
    Ok(Side { id: target.id, parts })
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
