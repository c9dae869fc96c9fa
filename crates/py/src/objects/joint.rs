//! A loop joint of a world: a handle that reads from the world at each use.

use crate::arrays::convert::{Numbers, numbers, shown, vector};
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::bodies::handle;
use crate::objects::builder::pair;
use crate::objects::dof_settings::{DofSpot, dof_properties};
use crate::objects::handle::handle;
use crate::objects::joint_dof::JointDof;
use crate::objects::joints::drive;
use crate::objects::place::{Place, found};
use crate::world::gc::Anchor;
use numpy::PyArray1;
use pyo3::prelude::*;
use tumble::dynamics::{DofSettings, JointForce, LoopJoint, LoopJointKind, Transmission};

/// A joint between two bodies, or a body and the world, made by ``World.add_joint``.
///
/// Its position is an angle (rad), a displacement (m) or a length (m), the first of its ``dofs``; ``"fixed"``, ``"gear"`` and
/// ``"rack"`` joints have none. Everything can change between steps. All vectors
/// are in world axes.
#[pyclass(frozen, module = "tumble")]
pub struct Joint {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(Joint, "Joint", |joint| joint.kind().ok().map(|kind| format!(", {kind}")));

impl Joint {
    fn constant<T>(&self, get: impl FnOnce(&LoopJoint) -> T) -> Result<T> {
        self.place.read(|inner| inner.world.get::<LoopJoint>(self.place.id).map(get))
    }

    /// Changes constants. An invalid value changes nothing.
    fn change(&self, py: Python<'_>, change: impl FnOnce(&mut LoopJoint) -> Result<()>) -> Result<()> {
        self.place.write(py, |inner| inner.world.change_joint(self.place.id, change))
    }

    fn spot(&self) -> DofSpot<'_> {
        DofSpot { place: &self.place, k: None }
    }

    fn transmission<T>(&self, kind: LoopJointKind, get: impl FnOnce(&Transmission) -> T) -> Result<T> {
        self.constant(|joint| {
            is_of(joint, kind)?;
            Ok(get(joint.transmission()))
        })?
    }

    fn change_transmission(
        &self,
        py: Python<'_>,
        kind: LoopJointKind,
        change: impl FnOnce(&mut Transmission),
    ) -> Result<()> {
        self.change(py, |joint| {
            is_of(joint, kind)?;
            let mut constants = *joint.transmission();
            change(&mut constants);
            Ok(joint.set_transmission(constants)?)
        })
    }

    fn carried(&self) -> Result<JointForce> {
        self.place.read(|inner| inner.world.joint_force(self.place.id))
    }

    fn motion(&self) -> Result<[f64; 2]> {
        self.place.read(|inner| {
            let joint = inner.world.get::<LoopJoint>(self.place.id)?;
            Some(match joint.kind().has_position() {
                // it has none while a body is gone or disabled
                true => Ok(joint.position(&inner.world.view()).unwrap_or([f64::NAN; 2])),
                false => Err(Error::value(format!(
                    "'{}' is a {} joint, which has no position",
                    self.place.name,
                    joint.kind().name()
                ))),
            })
        })?
    }

    fn side(&self, py: Python<'_>, side: usize) -> Result<Option<Py<PyAny>>> {
        let found = self.place.read(|inner| {
            let anchor = inner.world.get::<LoopJoint>(self.place.id)?.sides()[side];
            Some(anchor.part.and_then(|(id, _)| found(inner, id)))
        })?;
        found.map(|found| handle(py, &self.place.shared, found)).transpose()
    }
}

dof_properties!(Joint);

#[pymethods]
impl Joint {
    /// Kind of the joint.
    #[getter]
    fn kind(&self) -> Result<&'static str> {
        self.constant(|joint| joint.kind().name())
    }

    /// The body on its first side.
    #[getter]
    fn a(&self, py: Python<'_>) -> Result<Option<Py<PyAny>>> {
        self.side(py, 0)
    }

    /// The body on its second side; None for the world.
    #[getter]
    fn b(&self, py: Python<'_>) -> Result<Option<Py<PyAny>>> {
        self.side(py, 1)
    }

    /// Its degrees of freedom: (angle) of ``"revolute"``, (displacement) of ``"prismatic"`` and ``"screw"``, (displacement,
    /// angle) of ``"cylindrical"``, angles about the axis and the second axis of ``"universal"``, displacements along
    /// x and y of b's frame and the angle of ``"planar"``, the rotation vector in b's frame of ``"spherical"``, (length) of kinds with a length.
    /// The settings of the joint itself are those of the first one, of a ``"spherical"`` joint of all three.
    #[getter]
    fn dofs(&self, py: Python<'_>) -> Result<Vec<JointDof>> {
        let count = self.constant(|joint| joint.kind().dofs())?;
        (0..count).map(|k| JointDof::new(py, self.place.clone(), k)).collect()
    }

    /// Position, rad or m: the angle of ``a`` about the axis, its displacement along the axis, the length, or
    /// the angle between both axes of a ``"spherical"`` joint. Zero where the joint was made, except for a length. An angle is in (-π, π], or within π
    /// of the middle of its limits.
    #[getter]
    fn position(&self) -> Result<f64> {
        Ok(self.motion()?[0])
    }

    /// Rate of the position, rad/s or m/s.
    #[getter]
    fn velocity(&self) -> Result<f64> {
        Ok(self.motion()?[1])
    }

    /// Largest swing of a ``"spherical"`` joint, rad, or None: its axis on ``a`` stays in this cone about that on ``b``.
    #[getter]
    fn cone(&self) -> Result<Option<f64>> {
        self.constant(LoopJoint::cone)
    }

    #[setter]
    fn set_cone(&self, py: Python<'_>, value: Option<f64>) -> Result<()> {
        self.change(py, |joint| {
            is_of(joint, LoopJointKind::Spherical)?;
            Ok(joint.set_cone(value)?)
        })
    }

    /// Limits of the twist of a ``"spherical"`` joint, (lower, upper), rad, or None: of its rotation about its axis on ``a`` after the shortest
    /// turn of that on ``b`` to it.
    #[getter]
    fn twist_limits(&self) -> Result<Option<(f64, f64)>> {
        self.constant(|joint| joint.twist_limits().map(|[lower, upper]| (lower, upper)))
    }

    #[setter]
    fn set_twist_limits(&self, py: Python<'_>, value: Option<&Bound<'_, PyAny>>) -> Result<()> {
        let limits = value.map(pair).transpose()?;
        self.change(py, |joint| Ok(joint.set_twist_limits(limits)?))
    }

    /// Length of a ``"distance"``, largest length of a ``"rope"``, length of a ``"spring"`` at rest,
    /// largest length of the rope of a ``"pulley"``, m.
    #[getter]
    fn length(&self) -> Result<f64> {
        self.constant(|joint| match joint.kind().has_length() {
            true => Ok(joint.length()),
            false => Err(Error::value(format!("a {} joint has no length", joint.kind().name()))),
        })?
    }

    #[setter]
    fn set_length(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |joint| Ok(joint.set_length(value)?))
    }

    /// Teeth of the gears ``a`` and ``b``, not 0; negative for inner teeth.
    #[getter]
    fn teeth(&self) -> Result<(i32, i32)> {
        self.transmission(LoopJointKind::Gear, |t| t.teeth.into())
    }

    #[setter]
    fn set_teeth(&self, py: Python<'_>, value: [i32; 2]) -> Result<()> {
        self.change_transmission(py, LoopJointKind::Gear, |t| t.teeth = value)
    }

    /// Displacement of a ``"rack"`` per radian of its pinion ``a``, m, not 0.
    #[getter]
    fn radius(&self) -> Result<f64> {
        self.transmission(LoopJointKind::Rack, |t| t.radius)
    }

    #[setter]
    fn set_radius(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change_transmission(py, LoopJointKind::Rack, |t| t.radius = value)
    }

    /// Displacement of a ``"screw"`` per turn, m, not 0; positive for a right-handed one.
    #[getter]
    fn pitch(&self) -> Result<f64> {
        self.transmission(LoopJointKind::Screw, |t| t.pitch)
    }

    #[setter]
    fn set_pitch(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change_transmission(py, LoopJointKind::Screw, |t| t.pitch = value)
    }

    /// Weight of the side of ``b`` in the length of a ``"pulley"``, above 0.
    #[getter]
    fn ratio(&self) -> Result<f64> {
        self.transmission(LoopJointKind::Pulley, |t| t.ratio)
    }

    #[setter]
    fn set_ratio(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change_transmission(py, LoopJointKind::Pulley, |t| t.ratio = value)
    }

    /// Force above which it breaks, N; infinite if it does not.
    #[getter]
    fn breaking_force(&self) -> Result<f64> {
        self.constant(|joint| joint.breaking()[0])
    }

    #[setter]
    fn set_breaking_force(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |joint| Ok(joint.set_breaking(value, joint.breaking()[1])?))
    }

    /// Torque about its point above which it breaks, N·m; infinite if it does not.
    #[getter]
    fn breaking_torque(&self) -> Result<f64> {
        self.constant(|joint| joint.breaking()[1])
    }

    #[setter]
    fn set_breaking_torque(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |joint| Ok(joint.set_breaking(joint.breaking()[0], value)?))
    }

    /// Sets its drive; the arguments are those of ``Articulation.set_drive``. A drive to an angle goes
    /// the shorter way if the joint has no limits. max_force: None: its ``effort``. target and velocity may be sequences with
    /// a number for each of its ``dofs``, which all get a drive then; a number is that of the first one, of a ``"spherical"`` joint of all three.
    #[pyo3(signature = (*, target=None, velocity=None, stiffness=0.0, damping=0.0, max_force=None, **unknown), text_signature = "($self, *, target=None, velocity=None, stiffness=0.0, damping=0.0, max_force=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn set_drive(
        &self,
        py: Python<'_>,
        target: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        stiffness: f64,
        damping: f64,
        max_force: Option<f64>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Joint.set_drive")?;
        let target = target.map(|value| numbers(value, "target")).transpose()?;
        let velocity = velocity.map(|value| numbers(value, "velocity")).transpose()?;
        self.change(py, |joint| {
            let count = joint.kind().dofs();
            let of_each = [&target, &velocity].into_iter().flatten().any(|numbers| !numbers.shape.is_empty());
            for k in 0..if of_each { count } else { 1 } {
                let settings = joint.dof_at(k).unwrap_or(joint.dof()).clone();
                let max_force = max_force.unwrap_or(settings.effort);
                let (target, velocity) =
                    (number_at("target", &target, k, count)?, number_at("velocity", &velocity, k, count)?);
                let drive = drive(target, velocity, stiffness, damping, max_force)?;
                let dof = DofSettings { drive, ..settings };
                if of_each { joint.set_dof_at(k, dof)? } else { joint.set_dof(dof)? }
            }
            Ok(())
        })
    }

    /// Force on ``a`` in the last sub-step, shape (3,), N; the opposite acts on ``b``. It includes those
    /// of limits, spring, damping, friction and drive. Zero while the joint is not enabled; while its
    /// bodies sleep it is that with which they fell asleep.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.carried()?.force))
    }

    /// Torque on ``a`` about its point of the joint, shape (3,), N·m; otherwise as ``force``.
    #[getter]
    fn torque<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.carried()?.torque))
    }

    /// Force or torque of the drive of its first degree of freedom, N or N·m.
    #[getter]
    fn drive_force(&self) -> Result<f64> {
        Ok(self.carried()?.drives[0])
    }

    /// How far it is open: distance, m, and angle, rad, without the motion that it leaves free.
    #[getter]
    fn error(&self) -> Result<(f64, f64)> {
        self.place.read(|inner| {
            let joint = inner.world.get::<LoopJoint>(self.place.id)?;
            let error = joint.position_error(&inner.world.view()).unwrap_or_default();
            Some((error.distance, error.angle))
        })
    }
}

/// Returns the number for degree of freedom `k` of an argument with one number, or one for each of `count`.
fn number_at(name: &str, given: &Option<Numbers>, k: usize, count: usize) -> Result<Option<f64>> {
    let Some(Numbers { shape, data }) = given else { return Ok(None) };
    match shape.as_slice() {
        [] => Ok(data.first().copied()),
        [n] if *n == count => Ok(data.get(k).copied()),
        _ => Err(Error::value(format!(
            "{name}: expected a number, or shape ({count},) with one for each degree of freedom, got {}",
            shown(shape)
        ))),
    }
}

/// Returns an error for a joint of another kind.
fn is_of(joint: &LoopJoint, kind: LoopJointKind) -> Result<()> {
    match joint.kind() == kind {
        true => Ok(()),
        false => Err(Error::value(format!("it is a {} joint, and not a {}", joint.kind().name(), kind.name()))),
    }
}
