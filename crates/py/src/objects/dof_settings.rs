//! Settings of a degree of freedom of a loop joint: the properties that `Joint` and `JointDof` have alike.

use crate::errors::{Error, Result};
use crate::objects::place::Place;
use pyo3::prelude::*;
use tumble::dynamics::{DofSettings, LoopJoint, Spring};

/// A degree of freedom of a joint, or the joint itself: its first one, or all three of a spherical joint.
pub struct DofSpot<'a> {
    pub place: &'a Place,
    pub k: Option<usize>,
}

impl DofSpot<'_> {
    /// Reads the settings; those of the first one of the joint itself.
    pub fn get<T>(&self, get: impl FnOnce(&DofSettings) -> T) -> Result<T> {
        self.place.read(|inner| {
            let joint = inner.world.get::<LoopJoint>(self.place.id)?;
            self.k.map_or(Some(joint.dof()), |k| joint.dof_at(k)).map(get)
        })
    }

    /// Changes the settings. An invalid value changes nothing.
    pub fn set(&self, py: Python<'_>, change: impl FnOnce(&mut DofSettings) -> Result<()>) -> Result<()> {
        self.change(py, |joint| {
            let mut dof = self.k.map_or(Some(joint.dof()), |k| joint.dof_at(k)).cloned().unwrap_or_default();
            change(&mut dof)?;
            match self.k {
                Some(k) => joint.set_dof_at(k, dof)?,
                None => joint.set_dof(dof)?,
            }
            Ok(())
        })
    }

    /// Changes its spring; at first it has no stiffness, and rests at 0 or at the length of the joint.
    pub fn set_spring(&self, py: Python<'_>, change: impl FnOnce(&mut Spring)) -> Result<()> {
        let rest = self.place.read(|inner| {
            let joint = inner.world.get::<LoopJoint>(self.place.id)?;
            Some(if joint.kind().has_length() { joint.length() } else { 0.0 })
        })?;
        self.set(py, |dof| {
            let mut spring = dof.spring.unwrap_or(Spring { stiffness: 0.0, rest });
            change(&mut spring);
            dof.spring = Some(spring);
            Ok(())
        })
    }

    pub fn armature(&self) -> Result<f64> {
        self.place.read(|inner| {
            let joint = inner.world.get::<LoopJoint>(self.place.id)?;
            self.k.map_or(Some(joint.armature()), |k| joint.armature_at(k))
        })
    }

    pub fn set_armature(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |joint| match self.k {
            Some(k) => Ok(joint.set_armature_at(k, value)?),
            None => Ok(joint.set_armature(value)?),
        })
    }

    fn change(&self, py: Python<'_>, change: impl FnOnce(&mut LoopJoint) -> Result<()>) -> Result<()> {
        self.place.write(py, |inner| inner.world.change_joint::<Error>(self.place.id, change))
    }
}

/// Gives a class the properties of the settings of a degree of freedom; it has a method `spot`.
macro_rules! dof_properties {
    ($class:ident) => {
        #[pymethods]
        impl $class {
            /// Limits of the position, (lower, upper), rad or m, or None. One of them may be infinite.
            #[getter]
            fn limits(&self) -> Result<Option<(f64, f64)>> {
                self.spot().get(|dof| dof.limits.map(|[lower, upper]| (lower, upper)))
            }

            #[setter]
            fn set_limits(&self, py: Python<'_>, value: Option<&Bound<'_, PyAny>>) -> Result<()> {
                let limits = value.map(crate::objects::builder::pair).transpose()?;
                self.spot().set(py, |dof| {
                    dof.limits = limits;
                    Ok(())
                })
            }

            /// Largest speed of the position, of a ``"spherical"`` joint that about each axis, rad/s or m/s; infinite
            /// for none.
            #[getter]
            fn max_velocity(&self) -> Result<f64> {
                self.spot().get(|dof| dof.max_velocity)
            }

            #[setter]
            fn set_max_velocity(&self, py: Python<'_>, value: f64) -> Result<()> {
                self.spot().set(py, |dof| {
                    dof.max_velocity = value;
                    Ok(())
                })
            }

            /// Viscous damping along the position, of a ``"spherical"`` joint about each axis, N·m·s/rad or N·s/m.
            #[getter]
            fn damping(&self) -> Result<f64> {
                self.spot().get(|dof| dof.damping)
            }

            #[setter]
            fn set_damping(&self, py: Python<'_>, value: f64) -> Result<()> {
                self.spot().set(py, |dof| {
                    dof.damping = value;
                    Ok(())
                })
            }

            /// Dry friction along the position: largest torque or force, N·m or N. Of a ``"spherical"`` joint about each
            /// axis.
            #[getter]
            fn friction(&self) -> Result<f64> {
                self.spot().get(|dof| dof.friction)
            }

            #[setter]
            fn set_friction(&self, py: Python<'_>, value: f64) -> Result<()> {
                self.spot().set(py, |dof| {
                    dof.friction = value;
                    Ok(())
                })
            }

            /// Stiffness of its spring, N·m/rad or N/m; 0 without one.
            #[getter]
            fn stiffness(&self) -> Result<f64> {
                self.spot().get(|dof| dof.spring.map_or(0.0, |spring| spring.stiffness))
            }

            #[setter]
            fn set_stiffness(&self, py: Python<'_>, value: f64) -> Result<()> {
                self.spot().set_spring(py, |spring| spring.stiffness = value)
            }

            /// Position at which its spring is at rest, rad or m; for a ``"spring"`` its ``length``.
            #[getter]
            fn rest(&self) -> Result<f64> {
                self.spot().get(|dof| dof.spring.map_or(0.0, |spring| spring.rest))
            }

            #[setter]
            fn set_rest(&self, py: Python<'_>, value: f64) -> Result<()> {
                self.spot().set_spring(py, |spring| spring.rest = value)
            }

            /// Force of its motor, N·m or N, above 0: the limit of drives that name none. Infinite if it is not known.
            #[getter]
            fn effort(&self) -> Result<f64> {
                self.spot().get(|dof| dof.effort)
            }

            #[setter]
            fn set_effort(&self, py: Python<'_>, value: f64) -> Result<()> {
                self.spot().set(py, |dof| {
                    dof.effort = value;
                    Ok(())
                })
            }

            /// Inertia of its rotor, as the joint meets it, kg·m² or kg: it acts between ``a`` and ``b`` against accelerations of the
            /// position. Kinds with a length have none.
            #[getter]
            fn armature(&self) -> Result<f64> {
                self.spot().armature()
            }

            #[setter]
            fn set_armature(&self, py: Python<'_>, value: f64) -> Result<()> {
                self.spot().set_armature(py, value)
            }
        }
    };
}
pub(crate) use dof_properties;
