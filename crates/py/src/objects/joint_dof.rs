//! One degree of freedom of a loop joint: a handle that reads from the world at each use.

use crate::errors::{Error, Result};
use crate::objects::builder::pair;
use crate::objects::joints::{drive, drive_of};
use crate::objects::place::Place;
use crate::world::gc::Anchor;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::dynamics::{DofSettings, Drive, LoopJoint, Spring};

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

    fn constant<T>(&self, get: impl FnOnce(&DofSettings) -> T) -> Result<T> {
        self.place.read(|inner| inner.world.get::<LoopJoint>(self.place.id)?.dof_at(self.k).map(get))
    }

    fn change(&self, py: Python<'_>, change: impl FnOnce(&mut DofSettings) -> Result<()>) -> Result<()> {
        self.place.write(py, |inner| {
            inner.world.change_joint(self.place.id, |joint| {
                let mut dof = joint.dof_at(self.k).cloned().unwrap_or_default();
                change(&mut dof)?;
                Ok::<(), Error>(joint.set_dof_at(self.k, dof)?)
            })
        })
    }

    fn motion(&self) -> Result<[f64; 2]> {
        self.place.read(|inner| {
            let joint = inner.world.get::<LoopJoint>(self.place.id)?;
            // it has none while a body is gone or disabled
            Some(joint.position_at(self.k, &inner.world.view()).unwrap_or([f64::NAN; 2]))
        })
    }
}

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

    /// Limits of the position, (lower, upper), rad or m, or None.
    #[getter]
    fn limits(&self) -> Result<Option<(f64, f64)>> {
        self.constant(|dof| dof.limits.map(|[lower, upper]| (lower, upper)))
    }

    #[setter]
    fn set_limits(&self, py: Python<'_>, value: Option<&Bound<'_, PyAny>>) -> Result<()> {
        let limits = value.map(pair).transpose()?;
        self.change(py, |dof| {
            dof.limits = limits;
            Ok(())
        })
    }

    /// Largest speed of the position, rad/s or m/s; infinite for none.
    #[getter]
    fn max_velocity(&self) -> Result<f64> {
        self.constant(|dof| dof.max_velocity)
    }

    #[setter]
    fn set_max_velocity(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |dof| {
            dof.max_velocity = value;
            Ok(())
        })
    }

    /// Viscous damping, N·m·s/rad or N·s/m.
    #[getter]
    fn damping(&self) -> Result<f64> {
        self.constant(|dof| dof.damping)
    }

    #[setter]
    fn set_damping(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |dof| {
            dof.damping = value;
            Ok(())
        })
    }

    /// Dry friction: largest torque or force, N·m or N.
    #[getter]
    fn friction(&self) -> Result<f64> {
        self.constant(|dof| dof.friction)
    }

    #[setter]
    fn set_friction(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |dof| {
            dof.friction = value;
            Ok(())
        })
    }

    /// Stiffness of its spring, N·m/rad or N/m; 0 without one.
    #[getter]
    fn stiffness(&self) -> Result<f64> {
        self.constant(|dof| dof.spring.map_or(0.0, |spring| spring.stiffness))
    }

    #[setter]
    fn set_stiffness(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |dof| {
            let rest = dof.spring.map_or(0.0, |spring| spring.rest);
            dof.spring = Some(Spring { stiffness: value, rest });
            Ok(())
        })
    }

    /// Position at which its spring is at rest, rad or m.
    #[getter]
    fn rest(&self) -> Result<f64> {
        self.constant(|dof| dof.spring.map_or(0.0, |spring| spring.rest))
    }

    #[setter]
    fn set_rest(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |dof| {
            let stiffness = dof.spring.map_or(0.0, |spring| spring.stiffness);
            dof.spring = Some(Spring { stiffness, rest: value });
            Ok(())
        })
    }

    /// Force of its motor, N·m or N, above 0: the limit of drives that name none. Infinite if it is not known.
    #[getter]
    fn effort(&self) -> Result<f64> {
        self.constant(|dof| dof.effort)
    }

    #[setter]
    fn set_effort(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |dof| {
            dof.effort = value;
            Ok(())
        })
    }

    /// Inertia of its rotor, as the joint meets it, kg·m² or kg.
    #[getter]
    fn armature(&self) -> Result<f64> {
        self.place.read(|inner| inner.world.get::<LoopJoint>(self.place.id)?.armature_at(self.k))
    }

    #[setter]
    fn set_armature(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.place.write(py, |inner| {
            let change = |joint: &mut LoopJoint| Ok::<(), Error>(joint.set_armature_at(self.k, value)?);
            inner.world.change_joint(self.place.id, change)
        })
    }

    /// Sets its drive; the arguments are those of ``Joint.set_drive``.
    #[pyo3(signature = (*, target=None, velocity=None, stiffness=0.0, damping=0.0, max_force=None))]
    fn set_drive(
        &self,
        py: Python<'_>,
        target: Option<f64>,
        velocity: Option<f64>,
        stiffness: f64,
        damping: f64,
        max_force: Option<f64>,
    ) -> Result<()> {
        self.place.write(py, |inner| {
            inner.note_drives(self.place.id);
            Ok(())
        })?;
        self.change(py, |dof| {
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
