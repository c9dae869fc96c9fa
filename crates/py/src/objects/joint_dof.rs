//! One degree of freedom of a loop joint: a handle that reads from the world at each use.

use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::builder::pair;
use crate::objects::dof_settings::{DofSpot, dof_properties};
use crate::objects::joints::{drive, drive_of};
use crate::objects::place::Place;
use crate::world::gc::Anchor;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::dynamics::{Drive, LoopJoint, Spring};

/// One degree of freedom that a joint leaves free: a member of ``Joint.dofs``. Its settings are those of the joint,
/// and can change between steps.
#[pyclass(frozen, module = "tumble")]
pub struct JointDof {
    place: Place,
    k: usize,
    anchor: Py<Anchor>,
}

impl JointDof {
    /// Returns a handle.
    pub fn new(py: Python<'_>, place: Place, k: usize) -> Result<JointDof> {
        let anchor = crate::world::gc::anchor(py, &place.shared)?;
        Ok(JointDof { place, k, anchor })
    }

    fn spot(&self) -> DofSpot<'_> {
        DofSpot { place: &self.place, k: Some(self.k) }
    }

    fn motion(&self) -> Result<[f64; 2]> {
        self.place.read(|inner| {
            let joint = inner.world.get::<LoopJoint>(self.place.id)?;
            // it has none while a body is gone or disabled
            Some(joint.position_at(self.k, &inner.world.view()).unwrap_or([f64::NAN; 2]))
        })
    }
}

dof_properties!(JointDof);

#[pymethods]
impl JointDof {
    /// Position, rad or m; 0 where the joint was made, except for a length.
    #[getter]
    fn position(&self) -> Result<f64> {
        Ok(self.motion()?[0])
    }

    /// Rate of the position, rad/s or m/s; of a ``"spherical"`` joint the angular velocity about the axis.
    #[getter]
    fn velocity(&self) -> Result<f64> {
        Ok(self.motion()?[1])
    }

    /// Sets its drive; the arguments are those of ``Joint.set_drive``.
    #[pyo3(signature = (*, target=None, velocity=None, stiffness=0.0, damping=0.0, max_force=None, **unknown), text_signature = "($self, *, target=None, velocity=None, stiffness=0.0, damping=0.0, max_force=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn set_drive(
        &self,
        py: Python<'_>,
        target: Option<f64>,
        velocity: Option<f64>,
        stiffness: f64,
        damping: f64,
        max_force: Option<f64>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "JointDof.set_drive")?;
        self.spot().set(py, |dof| {
            dof.drive = drive(target, velocity, stiffness, damping, max_force.unwrap_or(dof.effort))?;
            Ok(())
        })
    }

    /// Force or torque of the drive, N or N·m.
    #[getter]
    fn drive_force(&self) -> Result<f64> {
        self.place.read(|inner| Some(inner.world.joint_force(self.place.id)?.drives[self.k]))
    }

    fn __repr__(&self) -> String {
        format!("<tumble.JointDof {} of '{}'>", self.k, self.place.name)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<JointDof>().is_ok_and(|other| {
            let other = other.get();
            self.k == other.k && self.place.same(&other.place)
        })
    }

    fn __hash__(&self) -> u64 {
        crate::objects::place::hash(&self.place).wrapping_add(self.k as u64)
    }

    fn __traverse__(&self, visit: pyo3::gc::PyVisit<'_>) -> std::result::Result<(), pyo3::gc::PyTraverseError> {
        visit.call(&self.anchor)
    }
}

/// Sets a degree of freedom of a joint by a dict with the names of ``JointDof``'s settings.
pub fn set(joint: &mut LoopJoint, k: usize, given: &Bound<'_, PyDict>) -> Result<()> {
    const KEYS: [&str; 9] =
        ["limits", "damping", "friction", "stiffness", "rest", "max_velocity", "effort", "armature", "drive"];
    let mut dof = joint.dof_at(k).cloned().unwrap_or_default();
    let (mut motor, mut armature) = (None, joint.armature_at(k).unwrap_or(0.0));
    let mut spring = dof.spring.unwrap_or(Spring { stiffness: 0.0, rest: 0.0 });
    for (key, value) in given {
        let key: String = key.extract()?;
        match key.as_str() {
            "limits" => dof.limits = if value.is_none() { None } else { Some(pair(&value)?) },
            "damping" => dof.damping = value.extract()?,
            "friction" => dof.friction = value.extract()?,
            "stiffness" => spring.stiffness = value.extract()?,
            "rest" => spring.rest = value.extract()?,
            "max_velocity" => dof.max_velocity = value.extract()?,
            "effort" => dof.effort = value.extract()?,
            "armature" => armature = value.extract()?,
            "drive" => motor = Some(value.cast_into::<PyDict>().map_err(|_| Error::value("drive: expected a dict"))?),
            _ => {
                return Err(Error::value(format!("dofs: `{key}` is not known; there are {}", KEYS.join(", "))));
            }
        }
    }
    dof.spring = (spring.stiffness != 0.0 || spring.rest != 0.0 || dof.spring.is_some()).then_some(spring);
    dof.drive = motor.map_or(Ok::<Drive, Error>(dof.drive), |motor| drive_of(&motor, dof.effort))?;
    joint.set_dof_at(k, dof)?;
    Ok(joint.set_armature_at(k, armature)?)
}
