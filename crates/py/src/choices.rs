//! Choices of keyword arguments. `tumble.typing` has each as a `Literal`, and a test compares the
//! two.

use crate::errors::{Error, Result};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use tumble::collide::{Builder, ContactMode};
use tumble::dynamics::{Combine, EventKind, LockedAxes, LoopJointKind, Mode, SensorKind};
use tumble::scene::urdf::{CollisionMeshes, MissingMeshes};
use tumble::scene::{Integrator, Solver, Stepper};

/// Names with their values.
pub type Choices<T> = &'static [(&'static str, T)];

/// Modes of a body.
pub const MODES: Choices<Mode> =
    &[("dynamic", Mode::Dynamic), ("kinematic", Mode::Kinematic), ("static", Mode::Static)];
/// Treatment of missing collision meshes.
pub const MISSING_MESHES: Choices<MissingMeshes> = &[("error", MissingMeshes::Error), ("skip", MissingMeshes::Skip)];
/// Shapes that collision meshes collide as.
pub const COLLISION_MESHES: Choices<CollisionMeshes> =
    &[("exact", CollisionMeshes::Exact), ("hull", CollisionMeshes::Hull)];
/// Builders of sphere trees.
pub const BUILDERS: Choices<Builder> =
    &[("medial", Builder::Medial), ("hubbard", Builder::Hubbard), ("grid", Builder::Grid), ("octree", Builder::Octree)];

/// Kinds of joints of articulated bodies.
#[derive(Clone, Copy, PartialEq)]
pub enum JointType {
    Revolute,
    Prismatic,
    Spherical,
    Fixed,
    Floating,
}

/// Joints of articulated bodies.
pub const JOINT_TYPES: Choices<JointType> = &[
    ("revolute", JointType::Revolute),
    ("prismatic", JointType::Prismatic),
    ("spherical", JointType::Spherical),
    ("fixed", JointType::Fixed),
    ("floating", JointType::Floating),
];

/// Returns the value of a name; `what` names the argument in the error.
pub fn meaning<T: Copy>(what: &str, word: &str, words: &[(&str, T)]) -> Result<T> {
    words.iter().find(|(name, _)| *name == word).map(|(_, meaning)| *meaning).ok_or_else(|| {
        let names: Vec<&str> = words.iter().map(|(name, _)| *name).collect();
        Error::value(format!("{what}: `{word}` is not known; there are {}", names.join(", ")))
    })
}

/// Returns the name of a value.
pub fn word<T: PartialEq>(meaning: T, words: Choices<T>) -> &'static str {
    words.iter().find(|(_, other)| *other == meaning).map_or("", |(name, _)| *name)
}

/// Returns the names of every choice by the name of its type in ``tumble.typing``, in the library's
/// order.
#[pyfunction]
pub fn _choices() -> BTreeMap<&'static str, Vec<&'static str>> {
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
        ("EventKind", names(EventKind::NAMES)),
        ("LockedAxis", LockedAxes::NAMES.to_vec()),
        ("JointKind", names(LoopJointKind::NAMES)),
        ("SensorKind", SensorKind::NAMES.to_vec()),
        ("JointType", names(JOINT_TYPES)),
        ("MissingMeshes", names(MISSING_MESHES)),
        ("CollisionMeshes", names(COLLISION_MESHES)),
        ("TreeMethod", names(BUILDERS)),
    ])
}
