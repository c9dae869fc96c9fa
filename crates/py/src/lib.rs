//! The Python module `tumble._native`: conversion between Python and the crates, and no physics.

mod arrays;
mod batch;
mod behaviors;
mod choices;
mod errors;
mod extension;
mod faults;
mod interrupt;
mod io;
mod keywords;
mod objects;
mod pool;
mod script;
mod world;

use pyo3::prelude::*;

/// The compiled part of the package `tumble`.
#[pymodule]
mod _native {
    use super::*;

    #[pymodule_export]
    use super::batch::class::Batch;
    #[pymodule_export]
    use super::batch::pickling::_unpickle_batch;
    #[pymodule_export]
    use super::batch::policy::Policy;
    #[pymodule_export]
    use super::behaviors::body_flock::PyBodyFlock;
    #[pymodule_export]
    use super::behaviors::field::{Field, Panel};
    #[pymodule_export]
    use super::behaviors::flock::{PyBoid, PyFlock};
    #[pymodule_export]
    use super::behaviors::particles::{Emitter, Particles};
    #[pymodule_export]
    use super::behaviors::soft::Soft;
    #[pymodule_export]
    use super::choices::_choices;
    #[pymodule_export]
    use super::extension::view::View;
    #[pymodule_export]
    use super::faults::_panic;
    #[pymodule_export]
    use super::io::recording::{Recorder, read_recording, show_contacts};
    #[pymodule_export]
    use super::io::sound::Soundtrack;
    #[pymodule_export]
    use super::io::window::{_WindowFeed, _show_window};
    #[pymodule_export]
    use super::objects::articulation::Articulation;
    #[pymodule_export]
    use super::objects::bodies::Bodies;
    #[pymodule_export]
    use super::objects::body::RigidBody;
    #[pymodule_export]
    use super::objects::builder::ArticulationBuilder;
    #[pymodule_export]
    use super::objects::description::{_unpickle_articulation, _unpickle_built_articulation};
    #[pymodule_export]
    use super::objects::joint::Joint;
    #[pymodule_export]
    use super::objects::joint_dof::JointDof;
    #[pymodule_export]
    use super::objects::link::Link;
    #[pymodule_export]
    use super::objects::mimic::Mimic;
    #[pymodule_export]
    use super::objects::sensor::{Sensor, Sensors};
    #[pymodule_export]
    use super::objects::shapes::{Block, Capsule, Compound, Cone, Cylinder, Ellipsoid, HalfSpace, Mesh, Shape, Sphere};
    #[pymodule_export]
    use super::objects::sphere_robot::SphereRobot;
    #[pymodule_export]
    use super::objects::spheretree::{_unpickle_tree, SphereTree};
    #[pymodule_export]
    use super::objects::terrain::{ConvexHull, HeightField, OpenMesh, Sdf, Terrain};
    #[pymodule_export]
    use super::script::action::Action;
    #[pymodule_export]
    use super::script::handles::{ScriptedEvent, Template};
    #[pymodule_export]
    use super::script::trigger::Trigger;
    #[pymodule_export]
    use super::world::class::World;
    #[pymodule_export]
    use super::world::linearize::{_unpickle_linearized_step, LinearizedStep};
    #[pymodule_export]
    use super::world::pickling::{_unpickle_shape, _unpickle_world};
    #[pymodule_export]
    use super::world::report::{_unpickle_step_report, StepReport};
    #[pymodule_export]
    use super::world::simulate::simulate;

    /// Adds everything that is not a class or a function.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        io::slow::listen();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
