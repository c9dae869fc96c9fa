//! The Python module `tumble._native`: conversion between Python and the crates, and no physics.

mod adding;
mod arrays;
mod articulation;
mod bodies;
mod body;
mod building;
mod collect;
mod contacts;
mod convert;
mod description;
mod errors;
mod extension;
mod faults;
mod inner;
mod interrupt;
mod joints;
mod layout;
mod looks;
mod pairs;
mod pickling;
mod picture;
mod pool;
mod recording;
mod report;
mod robot;
mod rollout;
mod saved;
mod shapes;
mod shared;
mod slow;
mod spheretree;
mod spot;
mod state;
mod view;
mod words;
mod world;

use pyo3::prelude::*;

/// The compiled part of the package `tumble`.
#[pymodule]
mod _native {
    use super::*;

    #[pymodule_export]
    use super::articulation::Articulation;
    #[pymodule_export]
    use super::bodies::Bodies;
    #[pymodule_export]
    use super::body::RigidBody;
    #[pymodule_export]
    use super::description::_unpickle_articulation;
    #[pymodule_export]
    use super::faults::_panic;
    #[pymodule_export]
    use super::pickling::{_unpickle_shape, _unpickle_world};
    #[pymodule_export]
    use super::recording::{Recorder, read_recording};
    #[pymodule_export]
    use super::report::StepReport;
    #[pymodule_export]
    use super::shapes::{Block, Capsule, Cylinder, HalfSpace, Mesh, Shape, Sphere};
    #[pymodule_export]
    use super::spheretree::{_unpickle_tree, SphereTree};
    #[pymodule_export]
    use super::view::View;
    #[pymodule_export]
    use super::words::_choices;
    #[pymodule_export]
    use super::world::World;

    /// Adds everything that is not a class or a function.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        slow::listen();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
