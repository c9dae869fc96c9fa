//! Damping, dry friction, armature and springs of the joints of an articulation, settable while it runs.

use crate::arrays::convert::{bounds, shown};
use crate::errors::{Error, Result};
use crate::objects::articulation::Articulation;
use crate::objects::binding::Binding;
use crate::objects::robot::Robot;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::dynamics::{ArticulatedBody, DofSettings, Joint, Spring};

impl Articulation {
    /// Returns the robot with the masses and armatures that a body in a world has now.
    pub(super) fn present(&self) -> Result<Arc<Robot>> {
        let Binding::Placed(place) = &self.spot else { return Ok(self.robot.clone()) };
        let changed = place.read(|inner| {
            let model = inner.world.get::<ArticulatedBody>(place.id)?.model();
            Some((*model != self.robot.model).then(|| model.clone()))
        })?;
        Ok(match changed {
            Some(model) => Arc::new(Robot { model, ..Robot::clone(&self.robot) }),
            None => self.robot.clone(),
        })
    }

    /// Returns one number of each degree of freedom.
    fn of_dofs<'py>(&self, py: Python<'py>, get: impl Fn(&DofSettings) -> f64) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.spot.dofs()?.iter().map(get).collect()))
    }

    /// Sets lower and upper limits of all degrees of freedom of a body in a world.
    pub(super) fn change_limits(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.change_bounds(py, ("limits", value), |dof, limits| dof.limits = limits)
    }

    fn change_bounds(
        &self,
        py: Python<'_>,
        (name, value): (&str, &Bound<'_, PyAny>),
        set: impl Fn(&mut DofSettings, Option<[f64; 2]>),
    ) -> Result<()> {
        let (place, dof, limits) = (self.in_world()?, self.robot.dof(), bounds(value, name)?);
        if limits.shape != [dof, 2] {
            let shape = shown(&limits.shape);
            return Err(Error::value(format!("{name}: expected shape ({dof}, 2), got {shape}")));
        }
        place.write(py, |inner| {
            let body = inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            let mut changed = body.clone();
            for (index, pair) in limits.data.chunks_exact(2).enumerate() {
                let mut settings = changed.dofs()[index].clone();
                set(&mut settings, limits_of(pair));
                changed.set_dof(index, settings)?;
            }
            *body = changed;
            Ok(())
        })
    }
}

/// Returns limits; none if both are infinite.
fn limits_of(pair: &[f64]) -> Option<[f64; 2]> {
    (pair[0].is_finite() || pair[1].is_finite()).then_some([pair[0], pair[1]])
}

/// Returns the spring with another constant; none without stiffness and rest.
fn spring(dof: &DofSettings, change: impl FnOnce(&mut Spring)) -> Option<Spring> {
    let mut spring = dof.spring.unwrap_or(Spring { stiffness: 0.0, rest: 0.0 });
    change(&mut spring);
    (spring.stiffness != 0.0 || spring.rest != 0.0).then_some(spring)
}

#[pymethods]
impl Articulation {
    /// Viscous damping of each degree of freedom, shape (dof,), N·m·s/rad or N·s/m. Settable for a body in a world: a
    /// number for all, or shape (dof,).
    #[getter]
    fn joint_damping<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        self.of_dofs(py, |dof| dof.damping)
    }

    #[setter]
    fn set_joint_damping(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.change_dofs(py, ("joint_damping", value), |dof, damping| DofSettings { damping, ..dof })
    }

    /// Dry friction of each degree of freedom, shape (dof,), N·m or N. Settable like ``joint_damping``.
    #[getter]
    fn joint_friction<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        self.of_dofs(py, |dof| dof.friction)
    }

    #[setter]
    fn set_joint_friction(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.change_dofs(py, ("joint_friction", value), |dof, friction| DofSettings { friction, ..dof })
    }

    /// Armature of each degree of freedom, shape (dof,), kg·m² or kg: the inertia of the rotor of its joint, as the joint meets
    /// it; 0 for floating roots. Settable like ``joint_damping``: velocities stay. A number is for all joints that have
    /// one; those of a spherical joint are the same.
    #[getter]
    fn armature<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        let robot = self.present()?;
        let links = robot.model.links().iter();
        let each = links.flat_map(|link| std::iter::repeat_n(link.armature, link.joint.dof()));
        Ok(PyArray1::from_vec(py, each.collect()))
    }

    #[setter]
    fn set_armature(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let (place, each) = (self.in_world()?, self.of_each_dof(("armature", value))?);
        let one = value.extract::<f64>().is_ok();
        let links = self.robot.model.links().iter();
        let rotors = links.filter(|link| !(one && link.joint == Joint::Floating)).map(|link| {
            let own = &each[link.v..link.v + link.joint.dof()];
            match own.iter().all(|armature| *armature == own[0]) {
                true => Ok((link.name.as_str(), own[0])),
                false => Err(Error::value(format!(
                    "armature: the joint of link '{}' has one of {own:?}; expected the same for its degrees of freedom",
                    link.name
                ))),
            }
        });
        let rotors = rotors.collect::<Result<Vec<_>>>()?;
        place.write(py, |inner| {
            let body = inner.world.get::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            // checked as a whole, so that an invalid value changes nothing
            rotors.iter().try_fold(body.clone(), |body, (link, armature)| body.with_armature(link, *armature))?;
            for (link, armature) in &rotors {
                inner.world.set_armature(place.id, link, *armature)?;
            }
            Ok(())
        })
    }

    /// Stiffness of the spring of each degree of freedom, shape (dof,), N·m/rad or N/m; 0 without one. Settable like
    /// ``joint_damping``; that of a drive is an argument of ``set_drive``.
    #[getter]
    fn stiffness<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        self.of_dofs(py, |dof| dof.spring.map_or(0.0, |spring| spring.stiffness))
    }

    #[setter]
    fn set_stiffness(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.change_dofs(py, ("stiffness", value), |dof, stiffness| {
            let spring = spring(&dof, |spring| spring.stiffness = stiffness);
            DofSettings { spring, ..dof }
        })
    }

    /// Limits of the twist about each axis of a spherical joint, shape (dof, 2), rad; infinite without any, and for all other joints. Settable
    /// like ``limits``, whose rows for such a joint are 0 and the largest angle of its cone about that axis.
    #[getter]
    fn twist_limits<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        let none = [f64::NEG_INFINITY, f64::INFINITY];
        let rows: Vec<Vec<f64>> =
            self.spot.dofs()?.iter().map(|dof| dof.twist_limits.unwrap_or(none).to_vec()).collect();
        match rows.is_empty() {
            true => Ok(PyArray2::<f64>::zeros(py, [0, 2], false).into_any()),
            false => Ok(PyArray2::from_vec2(py, &rows).map_err(|e| Error::value(e.to_string()))?.into_any()),
        }
    }

    #[setter]
    fn set_twist_limits(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.change_bounds(py, ("twist_limits", value), |dof, limits| dof.twist_limits = limits)
    }

    /// Rest position of the spring of each degree of freedom, shape (dof,), rad or m, of a spherical joint a rotation vector. Settable like ``joint_damping``.
    #[getter]
    fn rest<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        self.of_dofs(py, |dof| dof.spring.map_or(0.0, |spring| spring.rest))
    }

    #[setter]
    fn set_rest(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.change_dofs(py, ("rest", value), |dof, rest| {
            let spring = spring(&dof, |spring| spring.rest = rest);
            DofSettings { spring, ..dof }
        })
    }
}
