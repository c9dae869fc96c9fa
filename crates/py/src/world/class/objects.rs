//! The objects of a world: handles by name, constants of pairs, forces and behaviors of Python, removal.

use crate::behaviors;
use crate::errors::Result;
use crate::keywords::{self, Unknown};
use crate::objects::articulation::Articulation;
use crate::objects::bodies;
use crate::objects::bodies::{Bodies, handle, place_of};
use crate::objects::body::RigidBody;
use crate::objects::joint::Joint;
use crate::objects::mimic::Mimic;
use crate::objects::place::by_name;
use crate::objects::sensor::Sensors;
use crate::world::add::own_place;
use crate::world::class::World;
use crate::world::joints;
use crate::world::mimics;
use crate::world::pairs::{self};
use crate::world::sensors;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use tumble::dynamics::PairMaterial;

#[pymethods]
impl World {
    /// Sets restitution and the frictions of the contacts of two bodies from the next step on,
    /// overriding the combination rules, and whether they collide at all.
    ///
    /// a, b: handles or names in any order; ``"ARTICULATION/LINK"`` is a link of an articulation
    /// with the links fixed to it. rolling_friction, torsional_friction: m, at least 0. None keeps the rule; without all the pair has no constants of
    /// its own any more. collides: False ignores the pair; True does not override groups and masks. Forks have the same pairs. ``save`` does not include them, as it does not
    /// include materials.
    #[pyo3(signature = (a, b, *, restitution=None, friction=None, rolling_friction=None, torsional_friction=None, collides=None, **unknown), text_signature = "($self, a, b, *, restitution=None, friction=None, rolling_friction=None, torsional_friction=None, collides=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn set_pair_material(
        &self,
        py: Python<'_>,
        a: &Bound<'_, PyAny>,
        b: &Bound<'_, PyAny>,
        restitution: Option<f64>,
        friction: Option<f64>,
        rolling_friction: Option<f64>,
        torsional_friction: Option<f64>,
        collides: Option<bool>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "World.set_pair_material")?;
        pairs::set(
            &self.shared,
            py,
            [a, b],
            PairMaterial { restitution, friction, rolling_friction, torsional_friction, collides },
        )
    }

    /// Returns restitution and friction of the contacts of two bodies: the pair's own constants if
    /// set, else those of the combination rules.
    ///
    /// a, b: as in ``set_pair_material``. An articulation is represented by its first shape.
    #[pyo3(signature = (a, b, **unknown), text_signature = "($self, a, b)")]
    fn pair_material(
        &self,
        a: &Bound<'_, PyAny>,
        b: &Bound<'_, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<(f64, f64)> {
        keywords::check(unknown, "World.pair_material")?;
        pairs::get(&self.shared, [a, b])
    }

    /// All bodies in the order in which they were added, by number or by name.
    #[getter]
    fn bodies(&self, py: Python<'_>) -> Result<Bodies> {
        Bodies::new(py, self.shared.clone())
    }

    /// Returns the rigid body, or static geometry, of that name. An articulation or an unknown name
    /// raises ``UnknownNameError``.
    #[pyo3(signature = (name, **unknown), text_signature = "($self, name)")]
    fn body(&self, py: Python<'_>, name: &str, unknown: Option<Unknown<'_, '_>>) -> Result<RigidBody> {
        keywords::check(unknown, "World.body")?;
        bodies::rigid_body(py, &self.shared, name)
    }

    /// Returns the articulated body of that name. A rigid body or an unknown name raises
    /// ``UnknownNameError``.
    #[pyo3(signature = (name, **unknown), text_signature = "($self, name)")]
    fn articulation(&self, py: Python<'_>, name: &str, unknown: Option<Unknown<'_, '_>>) -> Result<Articulation> {
        keywords::check(unknown, "World.articulation")?;
        bodies::articulation(py, &self.shared, name)
    }

    /// All joints made by ``add_joint`` or ``[[loop_joint]]``, in the order in which they were added.
    #[getter]
    fn joints(&self, py: Python<'_>) -> Result<Vec<Joint>> {
        joints::all(&self.shared, py)
    }

    /// All couplings of joints made by ``add_mimic`` or ``[[mimic]]``, in the order in which they were added.
    #[getter]
    fn mimics(&self, py: Python<'_>) -> Result<Vec<Mimic>> {
        mimics::all(&self.shared, py)
    }

    /// Returns the joint of that name, made by ``add_joint`` or ``[[loop_joint]]``.
    #[pyo3(signature = (name, **unknown), text_signature = "($self, name)")]
    fn joint(&self, py: Python<'_>, name: &str, unknown: Option<Unknown<'_, '_>>) -> Result<Joint> {
        keywords::check(unknown, "World.joint")?;
        Joint::new(py, joints::place_by_name(&self.shared, name)?)
    }

    /// ``world[name]``: the body of that name, a ``RigidBody``, an ``Articulation``, a ``SpringMesh`` or a ``Boid``, the
    /// ``ParticleSystem`` or the ``Flock``; of a field its name.
    fn __getitem__(&self, py: Python<'_>, name: &str) -> Result<Py<PyAny>> {
        if let Some(handle) = behaviors::handle(py, &self.shared, name)? {
            return Ok(handle);
        }
        handle(py, &self.shared, self.shared.read(|inner| by_name(inner, name))?)
    }

    /// The readings of all measuring sensors by name, after the last step.
    #[getter]
    fn sensors(&self, py: Python<'_>) -> Result<Sensors> {
        Sensors::new(py, &self.shared)
    }

    /// Removes an object, given as a handle or by name, or a force, a field or a behavior by name. Handles
    /// of a removed object raise ``RemovedError``. Joints and measuring sensors of a removed body are removed with it, and
    /// so are couplings and sensors of a removed joint.
    #[pyo3(signature = (body, **unknown), text_signature = "($self, body)")]
    fn remove(&self, py: Python<'_>, body: &Bound<'_, PyAny>, unknown: Option<Unknown<'_, '_>>) -> Result<()> {
        keywords::check(unknown, "World.remove")?;
        if let Ok(name) = body.extract::<String>()
            && self.shared.extend(py, |inner| inner.remove_extension(&name))?
        {
            return Ok(());
        }
        let found = joints::place_of(&self.shared, body)?;
        let found = found.map_or_else(|| mimics::place_of(&self.shared, body), |place| Ok(Some(place)))?;
        let place = match found.map_or_else(|| sensors::place_of(&self.shared, body), |place| Ok(Some(place)))? {
            Some(place) => place,
            None => match behaviors::own_place(&self.shared, body)? {
                Some(place) => place,
                None => own_place(&self.shared, body)?,
            },
        };
        place.status()?;
        self.shared.extend(py, |inner| {
            inner.world.remove(place.id)?;
            inner.forget(place.id);
            Ok(())
        })
    }

    /// Adds a custom force: an object of a subclass of ``tumble.Force``. Its name must be unique
    /// among bodies, forces and behaviors.
    #[pyo3(signature = (name, force, **unknown), text_signature = "($self, name, force)")]
    fn add_force(
        &self,
        py: Python<'_>,
        name: &str,
        force: &Bound<'_, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "World.add_force")?;
        py.import("tumble._extension")?.call_method1("check_force", (force,))?;
        self.shared.extend(py, |inner| inner.add_force(name, force))
    }

    /// Adds a custom behavior, an object of a subclass of ``tumble.Behavior``, to bodies given by
    /// name or as handles.
    #[pyo3(signature = (name, behavior, bodies, **unknown), text_signature = "($self, name, behavior, bodies)")]
    fn add_behavior(
        &self,
        py: Python<'_>,
        name: &str,
        behavior: &Bound<'_, PyAny>,
        bodies: &Bound<'_, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "World.add_behavior")?;
        py.import("tumble._extension")?.call_method1("check_behavior", (behavior,))?;
        let given: Vec<Bound<'_, PyAny>> =
            match bodies.is_instance_of::<pyo3::types::PyString>() || place_of(bodies).is_ok() {
                true => vec![bodies.clone()],
                false => bodies.try_iter()?.collect::<PyResult<_>>()?,
            };
        let places = given.iter().map(|body| own_place(&self.shared, body)).collect::<Result<Vec<_>>>()?;
        self.shared
            .extend(py, |inner| inner.add_behavior(name, behavior, places.iter().map(|place| place.id).collect()))
    }

    /// Custom forces by name: a new dict.
    #[getter]
    fn forces(&self, py: Python<'_>) -> Result<BTreeMap<String, Py<PyAny>>> {
        self.shared.read(|inner| Ok(inner.extensions(py)[0].drain(..).collect()))
    }

    /// Custom behaviors by name: a new dict.
    #[getter]
    fn behaviors(&self, py: Python<'_>) -> Result<BTreeMap<String, Py<PyAny>>> {
        self.shared.read(|inner| Ok(inner.extensions(py)[1].drain(..).collect()))
    }
}
