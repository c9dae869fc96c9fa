//! Surface constants of single shapes of a part.

use super::Material;
use serde::{Deserialize, Serialize};

/// Surface constants of those parts of a compound that have their own, by the index of the part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ShapeMaterials(Vec<(usize, Material)>);

impl ShapeMaterials {
    /// Sets the constants of one shape, or removes them.
    pub fn set(&mut self, shape: usize, material: Option<Material>) {
        let found = self.0.binary_search_by_key(&shape, |(own, _)| *own);
        match (found, material) {
            (Ok(at), Some(material)) => self.0[at].1 = material,
            (Ok(at), None) => drop(self.0.remove(at)),
            (Err(at), Some(material)) => self.0.insert(at, (shape, material)),
            (Err(_), None) => {}
        }
    }

    /// Returns the constants of a shape that has its own.
    pub fn get(&self, shape: usize) -> Option<Material> {
        let found = self.0.binary_search_by_key(&shape, |(own, _)| *own);
        found.ok().map(|at| self.0[at].1)
    }

    /// Returns all, ascending by the index of the shape.
    pub fn as_slice(&self) -> &[(usize, Material)] {
        &self.0
    }
}
