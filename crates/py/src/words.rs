//! Closed sets of words: what keyword arguments choose from. `tumble.typing` has each as a `Literal`, and a test compares the two.

use crate::errors::{Error, Result};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use tumble::collide::{Builder, ContactMode};
use tumble::dynamics::{Combine, Mode};
use tumble::scene::urdf::{CollisionMeshes, MissingMeshes};
use tumble::scene::{Integrator, Solver, Stepper};

/// Words with what they mean.
pub type Words<T> = &'static [(&'static str, T)];

/// How a body takes part.
pub const MODES: Words<Mode> = &[("dynamic", Mode::Dynamic), ("kinematic", Mode::Kinematic), ("static", Mode::Static)];
/// What is done about collision meshes that are not there.
pub const MISSING_MESHES: Words<MissingMeshes> = &[("error", MissingMeshes::Error), ("skip", MissingMeshes::Skip)];
/// What collision meshes collide as.
pub const COLLISION_MESHES: Words<CollisionMeshes> =
    &[("exact", CollisionMeshes::Exact), ("hull", CollisionMeshes::Hull)];
/// How sphere trees are built.
pub const BUILDERS: Words<Builder> =
    &[("medial", Builder::Medial), ("hubbard", Builder::Hubbard), ("grid", Builder::Grid), ("octree", Builder::Octree)];

/// The meaning of a word; `what` names the argument in the error.
pub fn meaning<T: Copy>(what: &str, word: &str, words: &[(&str, T)]) -> Result<T> {
    words.iter().find(|(name, _)| *name == word).map(|(_, meaning)| *meaning).ok_or_else(|| {
        let names: Vec<&str> = words.iter().map(|(name, _)| *name).collect();
        Error::value(format!("{what}: `{word}` is not known; there are {}", names.join(", ")))
    })
}

/// The word for a meaning.
pub fn word<T: PartialEq>(meaning: T, words: Words<T>) -> &'static str {
    words.iter().find(|(_, other)| *other == meaning).map_or("", |(name, _)| *name)
}

/// Every set of words by the name of its type in ``tumble.typing``, in the library's order.
#[pyfunction]
pub fn _words() -> BTreeMap<&'static str, Vec<&'static str>> {
    fn names<T>(words: &[(&'static str, T)]) -> Vec<&'static str> {
        words.iter().map(|(name, _)| *name).collect()
    }
    BTreeMap::from([
        ("Stepper", names(Stepper::NAMES)),
        ("Integrator", names(Integrator::NAMES)),
        ("Solver", names(Solver::NAMES)),
        ("Combine", names(Combine::NAMES)),
        ("Contacts", names(ContactMode::NAMES)),
        ("Mode", names(MODES)),
        ("MissingMeshes", names(MISSING_MESHES)),
        ("CollisionMeshes", names(COLLISION_MESHES)),
        ("TreeMethod", names(BUILDERS)),
    ])
}
