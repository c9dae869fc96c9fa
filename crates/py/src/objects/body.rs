//! A rigid body of a world: a handle that reads from the world at each use.

use crate::arrays::convert::{
    Numbers, array, numbers, pose, quaternion, rotation, shown, some, symmetric, vec3, vec3_or, vector,
};
use crate::arrays::whole;
use crate::choices::{MODES, meaning, word};
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::appearance;
use crate::objects::description::alone;
use crate::objects::handle::handle;
use crate::objects::place::Place;
use crate::world::gc::Anchor;
use crate::world::{contacts, query};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use tumble::collide::{Mat3, Pose, Vec3};
use tumble::dynamics::{LockedAxes, Mode, RigidBody as Rigid, Status};

/// A rigid body, or static geometry, of a world. Its frame is that of its shape, for a mesh that of
/// its file. All vectors are in world axes.
///
/// A handle without data of its own. After the body was removed every use raises ``RemovedError``.
#[pyclass(frozen, module = "tumble")]
pub struct RigidBody {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(RigidBody, "RigidBody", |_| Some(String::new()));

impl RigidBody {
    pub(super) fn constant<T>(&self, get: impl FnOnce(&Rigid) -> T) -> Result<T> {
        self.place.read(|inner| inner.world.get::<Rigid>(self.place.id).map(get))
    }

    /// Changes a constant. An invalid value changes nothing.
    pub(super) fn change(&self, py: Python<'_>, set: impl FnOnce(&mut Rigid)) -> Result<()> {
        self.place.write(py, |inner| Ok(inner.world.change_body(self.place.id, set)?))
    }

    /// Returns an error for static geometry.
    fn with_mass(&self) -> Result<()> {
        match self.constant(Rigid::is_fixed)? {
            true => Err(Error::value(format!("'{}' has no mass: it was added as static", self.place.name))),
            false => Ok(()),
        }
    }

    fn set_motion(&self, py: Python<'_>, velocity: Option<Vec3>, angular: Option<Vec3>) -> Result<()> {
        let place = &self.place;
        place.write(py, |inner| {
            let part_state = inner.world.center_state(place.id).ok_or_else(|| place.removed())?;
            Ok(inner.world.set_velocity(
                place.id,
                velocity.unwrap_or(part_state.velocity),
                angular.unwrap_or(part_state.angular_velocity),
            )?)
        })
    }

    fn set_place(&self, py: Python<'_>, change: impl FnOnce(Pose) -> Pose) -> Result<()> {
        let place = &self.place;
        place.write(py, |inner| {
            let now = inner.world.pose(place.id, 0).ok_or_else(|| place.removed())?;
            Ok(inner.world.set_pose(place.id, change(now))?)
        })
    }
}

/// Converts an inertia: a matrix or three moments.
pub fn inertia(value: &Bound<'_, PyAny>) -> Result<Mat3> {
    let Numbers { shape, data } = numbers(value, "inertia")?;
    match shape.as_slice() {
        [3] => Ok(Mat3::from_diagonal(&Vec3::from_column_slice(&data))),
        [3, 3] => Ok(Mat3::from_row_slice(&data)),
        _ => Err(Error::value(format!("inertia: expected shape (3, 3) or (3,), got {}", shown(&shape)))),
    }
}

/// Converts an inertia of a link: a principal moment may be 0, but none is negative or above the sum of the others.
pub fn link_inertia(value: &Bound<'_, PyAny>) -> Result<Mat3> {
    let inertia = inertia(value)?;
    let mut moments: [f64; 3] = (0.5 * (inertia + inertia.transpose())).symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    let ([least, middle, most], slack) = (moments, 1e-6 * inertia.amax());
    if inertia.iter().all(|x| x.is_finite()) && (least < -slack || most > least + middle + slack) {
        return Err(Error::value(format!(
            "inertia has principal moments {moments:?} kg·m²; expected none below 0 or above the sum of the other two"
        )));
    }
    Ok(inertia)
}

/// Converts names of axes, or one name.
pub fn locked(value: &Bound<'_, PyAny>) -> Result<LockedAxes> {
    let names = value.extract::<String>().map(|name| vec![name]).or_else(|_| value.extract::<Vec<String>>());
    let all = || LockedAxes::NAMES.join(", ");
    let names = names.map_err(|_| Error::value(format!("locked: expected names of axes; there are {}", all())))?;
    LockedAxes::of_names(names.iter().map(String::as_str))
        .map_err(|wrong| Error::value(format!("locked: `{wrong}` is not known; there are {}", all())))
}

#[pymethods]
impl RigidBody {
    /// Mass, kg, above 0. Meaningless for static geometry. Setting it keeps the velocity and changes
    /// the inertia by the same factor.
    #[getter]
    fn mass(&self) -> Result<f64> {
        self.constant(Rigid::mass)
    }

    #[setter]
    fn set_mass(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.with_mass()?;
        self.place.write(py, |inner| Ok(inner.world.set_mass(self.place.id, value)?))
    }

    /// Inertia about the center of mass, body axes, shape (3, 3), kg·m². Setting it, also by three
    /// moments, keeps the velocities.
    #[getter]
    fn inertia<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        symmetric(py, &self.constant(|body| *body.inertia())?)
    }

    #[setter]
    fn set_inertia(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.with_mass()?;
        let inertia = inertia(value)?;
        self.place.write(py, |inner| Ok(inner.world.set_inertia(self.place.id, inertia)?))
    }

    /// Position of the origin of its frame, shape (3,), meters: the center of a sphere, box,
    /// capsule or cylinder, the origin of a mesh's file. Setting it keeps the velocity.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.place.pose()?.translation.vector))
    }

    #[setter]
    fn set_position(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let position = vec3(value, "position")?;
        self.set_place(py, |now| Pose::from_parts(position.into(), now.rotation))
    }

    /// The center of mass in the body's frame, shape (3,), meters: zero except for meshes, unless it
    /// is set. Setting it keeps the motion of the body; the inertia is then about the new center.
    #[getter]
    fn center_of_mass<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.constant(Rigid::center_of_mass)?))
    }

    #[setter]
    fn set_center_of_mass(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.with_mass()?;
        let center = vec3(value, "center_of_mass")?;
        self.place.write(py, |inner| Ok(inner.world.set_center_of_mass(self.place.id, center)?))
    }

    /// The center of mass in the world, shape (3,), meters.
    #[getter]
    fn world_center_of_mass<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.place.center_state()?.position()))
    }

    /// Orientation, body to world, unit quaternion (x, y, z, w), shape (4,). Setting it rotates the
    /// body about the origin of its frame and keeps the velocity.
    #[getter]
    fn orientation<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(quaternion(py, &self.place.pose()?.rotation))
    }

    #[setter]
    fn set_orientation(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let rotation = rotation(value, "orientation")?;
        self.set_place(py, |now| Pose::from_parts(now.translation, rotation))
    }

    /// Velocity of the center of mass, shape (3,), m/s. That of a static body is zero, and another one is an error.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.place.center_state()?.velocity))
    }

    #[setter]
    fn set_velocity(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_motion(py, Some(vec3(value, "velocity")?), None)
    }

    /// Angular velocity, world axes, shape (3,), rad/s. That of a static body is zero, and another one is an error.
    #[getter]
    fn angular_velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.place.center_state()?.angular_velocity))
    }

    #[setter]
    fn set_angular_velocity(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_motion(py, None, Some(vec3(value, "angular_velocity")?))
    }

    /// Acceleration of the center of mass at the last force evaluation, shape (3,), m/s².
    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.place.center_state()?.acceleration))
    }

    /// ``"dynamic"``, ``"kinematic"`` (moves at its prescribed velocity and pushes dynamic bodies)
    /// or ``"static"``.
    #[getter]
    fn mode(&self) -> Result<&'static str> {
        Ok(word(self.place.status()?.mode, MODES))
    }

    #[setter]
    fn set_mode(&self, py: Python<'_>, value: &str) -> Result<()> {
        let mode = meaning("mode", value, MODES)?;
        if mode == Mode::Dynamic && self.constant(Rigid::is_fixed)? {
            return Err(Error::value(format!(
                "'{}' has no mass: it was added as static, and cannot be dynamic",
                self.place.name
            )));
        }
        self.place.write(py, |inner| Ok(inner.world.set_mode(self.place.id, mode)?))
    }

    /// Whether it sleeps: the steps leave it out until something touches it
    /// (``World(sleep_after=…)``). Any change wakes it.
    #[getter]
    fn asleep(&self) -> Result<bool> {
        self.place.status()?;
        self.place.shared.read(|inner| Ok(inner.world.asleep(self.place.id)))
    }

    /// Whether it collides.
    #[getter]
    fn collidable(&self) -> Result<bool> {
        Ok(self.place.status()?.collidable)
    }

    #[setter]
    fn set_collidable(&self, py: Python<'_>, value: bool) -> Result<()> {
        self.place.write(py, |inner| Ok(inner.world.set_collidable(self.place.id, value)?))
    }

    /// Collision group, 0 to 63. Two bodies collide if the group of each is in the mask of the other.
    #[getter]
    fn group(&self) -> Result<u32> {
        self.constant(|body| body.group.bit().trailing_zeros())
    }

    #[setter]
    fn set_group(&self, py: Python<'_>, #[pyo3(from_py_with = whole::group)] value: u8) -> Result<()> {
        let group = query::group(value)?;
        self.change(py, |body| body.group = group)
    }

    /// Groups that it collides with, one bit each. May be set to a sequence of groups, or None for
    /// all.
    #[getter]
    fn mask(&self) -> Result<u64> {
        self.constant(|body| body.mask)
    }

    #[setter]
    fn set_mask(&self, py: Python<'_>, value: Option<&Bound<'_, PyAny>>) -> Result<()> {
        let mask = query::mask(value)?;
        self.change(py, |body| body.mask = mask)
    }

    /// Whether it is a sensor: it has no contacts, and ``world.events`` reports the bodies that overlap
    /// it at the end of a step.
    #[getter]
    fn sensor(&self) -> Result<bool> {
        self.constant(|body| body.sensor)
    }

    #[setter]
    fn set_sensor(&self, py: Python<'_>, value: bool) -> Result<()> {
        self.change(py, |body| body.sensor = value)
    }

    /// The bodies in contact with it after the last step, or in it if it is a sensor: a list of
    /// handles in the order of ``world.bodies``.
    #[getter]
    fn touching(&self, py: Python<'_>) -> Result<Vec<Py<PyAny>>> {
        self.place.status()?;
        contacts::touching(&self.place.shared, py, self.place.id)
    }

    /// Coefficient of restitution, 0 to 1.
    #[getter]
    fn restitution(&self) -> Result<f64> {
        self.constant(|body| body.material.restitution)
    }

    #[setter]
    fn set_restitution(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.material.restitution = value)
    }

    /// Coefficient of Coulomb friction, at least 0.
    #[getter]
    fn friction(&self) -> Result<f64> {
        self.constant(|body| body.material.friction)
    }

    #[setter]
    fn set_friction(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.material.friction = value)
    }

    /// Velocity of the surface over the body, frame of the shape, shape (3,), m/s: a conveyor belt. Friction
    /// acts against the velocity of other bodies over the surface. Zero by default.
    #[getter]
    fn surface_velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(array(py, self.constant(|body| body.material.surface_velocity)?.as_slice()))
    }

    #[setter]
    fn set_surface_velocity(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let velocity = some::<3>(value, "surface_velocity")?;
        self.change(py, |body| body.material.surface_velocity = velocity.into())
    }

    /// Coefficient of friction of surfaces at rest on each other, if larger than ``friction``; 0 for none.
    #[getter]
    fn static_friction(&self) -> Result<f64> {
        self.constant(|body| body.material.static_friction)
    }

    #[setter]
    fn set_static_friction(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.material.static_friction = value)
    }

    /// Sliding speed, m/s, at which friction has fallen from ``static_friction`` towards ``friction`` by
    /// 63 %: the coefficient at speed v is ``friction + (static_friction - friction) * exp(-(v / stribeck_speed)**2)``.
    #[getter]
    fn stribeck_speed(&self) -> Result<f64> {
        self.constant(|body| body.material.stribeck_speed)
    }

    #[setter]
    fn set_stribeck_speed(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.material.stribeck_speed = value)
    }

    /// Factors of ``friction`` along the axes of the shape's frame, shape (3,), 1e-3 to 1e3: a surface with
    /// a grain. All 1 by default.
    #[getter]
    fn friction_scale<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(array(py, self.constant(|body| body.material.friction_scale)?.as_slice()))
    }

    #[setter]
    fn set_friction_scale(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let scale = some::<3>(value, "friction_scale")?;
        self.change(py, |body| body.material.friction_scale = scale.into())
    }

    /// Moment of rolling friction per normal force, m, at least 0. The larger of a pair counts.
    #[getter]
    fn rolling_friction(&self) -> Result<f64> {
        self.constant(|body| body.material.rolling_friction)
    }

    #[setter]
    fn set_rolling_friction(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.material.rolling_friction = value)
    }

    /// Moment of torsional friction per normal force, m, at least 0, about the normal of a contact that
    /// does not slide: two thirds of friction times the radius of a patch under uniform pressure. The
    /// larger of a pair counts.
    #[getter]
    fn torsional_friction(&self) -> Result<f64> {
        self.constant(|body| body.material.torsional_friction)
    }

    #[setter]
    fn set_torsional_friction(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.material.torsional_friction = value)
    }

    /// Tangential velocity of the contact point after an impact as a fraction of the reverse of that
    /// before, 0 to 1, as far as friction permits: 1 for a superball. The larger of a pair counts.
    #[getter]
    fn tangential_restitution(&self) -> Result<f64> {
        self.constant(|body| body.material.tangential_restitution)
    }

    #[setter]
    fn set_tangential_restitution(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.material.tangential_restitution = value)
    }

    /// Force with which surfaces in contact attract each other, N, at least 0. The larger of a pair counts.
    #[getter]
    fn adhesion(&self) -> Result<f64> {
        self.constant(|body| body.material.adhesion)
    }

    #[setter]
    fn set_adhesion(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.material.adhesion = value)
    }

    /// Color, sRGB, shape (3,), each 0 to 1. Setting it gives the body that of a ``tumble.Appearance`` without anything else.
    #[getter]
    fn color<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(array(py, &self.constant(appearance::color)?))
    }

    #[setter]
    fn set_color(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let color = some::<3>(value, "color")?;
        if let Some(wrong) = color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
            return Err(Error::value(format!("color: {wrong} is not from 0 to 1")));
        }
        self.change(py, |body| *body = appearance::colored(body.clone(), color))
    }

    /// The look of its surface, a ``tumble.Appearance``. It has no effect on motion.
    #[getter]
    fn appearance<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        appearance::shown(py, &self.constant(appearance::of)?)
    }

    #[setter]
    fn set_appearance(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let look = appearance::given(value)?;
        self.change(py, |body| *body = appearance::described(body.clone(), &look))
    }

    /// Factor of the world's gravity, 1 by default.
    #[getter]
    fn gravity_scale(&self) -> Result<f64> {
        self.constant(|body| body.gravity_scale)
    }

    #[setter]
    fn set_gravity_scale(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.gravity_scale = value)
    }

    /// Direction, shape (3,), frame of the shape, any length above 0, of a body that collides on one side only, such as
    /// open terrain or a one-way platform: with what comes against it. What comes from the other side passes. None for
    /// a body that collides on all sides.
    #[getter]
    fn one_way<'py>(&self, py: Python<'py>) -> Result<Option<Bound<'py, PyArray1<f64>>>> {
        Ok(self.constant(|body| body.one_way)?.map(|direction| array(py, direction.as_slice())))
    }

    #[setter]
    fn set_one_way(&self, py: Python<'_>, value: Option<&Bound<'_, PyAny>>) -> Result<()> {
        let direction = value.map(|value| crate::arrays::convert::direction(value, "one_way")).transpose()?;
        self.change(py, |body| body.one_way = direction)
    }

    /// Locked axes of the world: a tuple of ``"x"``, ``"y"``, ``"z"`` (the center of mass does not move
    /// along them), ``"rotation_x"``, ``"rotation_y"``, ``"rotation_z"`` (the body does not turn about
    /// them). Setting it takes one name or several, and clears the velocity along
    /// these axes.
    #[getter]
    fn locked<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyTuple>> {
        Ok(PyTuple::new(py, self.constant(|body| body.locked.names().collect::<Vec<_>>())?)?)
    }

    #[setter]
    fn set_locked(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let axes = locked(value)?;
        self.change(py, |body| body.locked = axes)
    }

    /// Linear damping, 1/s, at least 0: a force of ``-damping · momentum``. Without other forces the
    /// velocity decays by ``exp(-damping · t)``.
    #[getter]
    fn linear_damping(&self) -> Result<f64> {
        self.constant(|body| body.linear_damping)
    }

    #[setter]
    fn set_linear_damping(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.linear_damping = value)
    }

    /// Angular damping, 1/s, at least 0: a torque of ``-damping · angular momentum``.
    #[getter]
    fn angular_damping(&self) -> Result<f64> {
        self.constant(|body| body.angular_damping)
    }

    #[setter]
    fn set_angular_damping(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.change(py, |body| body.angular_damping = value)
    }

    /// Applies a force during the next step only. force: shape (3,), N, world axes; point: where it
    /// acts in the world, meters (default: the center of mass).
    #[pyo3(signature = (force, point=None, **unknown), text_signature = "($self, force, point=None)")]
    fn apply_force(
        &self,
        py: Python<'_>,
        force: &Bound<'_, PyAny>,
        point: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "RigidBody.apply_force")?;
        let (force, point) = (vec3(force, "force")?, point.map(|p| vec3(p, "point")).transpose()?);
        self.place.write(py, |inner| {
            let at = point
                .unwrap_or(inner.world.center_state(self.place.id).ok_or_else(|| self.place.removed())?.position());
            Ok(inner.world.apply_force(self.place.id, 0, force, &at)?)
        })
    }

    /// Applies a torque during the next step only. torque: shape (3,), N·m, world axes.
    #[pyo3(signature = (torque, **unknown), text_signature = "($self, torque)")]
    fn apply_torque(&self, py: Python<'_>, torque: &Bound<'_, PyAny>, unknown: Option<Unknown<'_, '_>>) -> Result<()> {
        keywords::check(unknown, "RigidBody.apply_torque")?;
        let torque = vec3(torque, "torque")?;
        self.place.write(py, |inner| Ok(inner.world.apply_torque(self.place.id, 0, torque)?))
    }

    /// Applies an impulse at once. impulse: shape (3,), N·s, world axes; point: where it acts in
    /// the world, meters (default: the center of mass).
    #[pyo3(signature = (impulse, point=None, **unknown), text_signature = "($self, impulse, point=None)")]
    fn apply_impulse(
        &self,
        py: Python<'_>,
        impulse: &Bound<'_, PyAny>,
        point: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "RigidBody.apply_impulse")?;
        let (impulse, point) = (vec3(impulse, "impulse")?, point.map(|p| vec3(p, "point")).transpose()?);
        self.place.write(py, |inner| {
            let at = point
                .unwrap_or(inner.world.center_state(self.place.id).ok_or_else(|| self.place.removed())?.position());
            Ok(inner.world.apply_impulse(self.place.id, 0, impulse, &at)?)
        })
    }

    /// Sets the velocity of a kinematic body such that its frame reaches a pose at the end of the
    /// next step. An omitted argument keeps its present value. An error for a dynamic or static body, which
    /// ``position`` and ``orientation`` place.
    #[pyo3(signature = (position=None, orientation=None, **unknown), text_signature = "($self, position=None, orientation=None)")]
    fn move_to(
        &self,
        py: Python<'_>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "RigidBody.move_to")?;
        let target = pose(position, orientation)?;
        let (moves, turns) = (position.is_some(), orientation.is_some());
        let Status { mode, .. } = self.place.status()?;
        if mode != Mode::Kinematic {
            return Err(Error::value(format!(
                "body '{}' is {mode}, and move_to is for kinematic bodies: set `position` and `orientation` to place it, or add it with `kinematic=True`",
                self.place.name
            )));
        }
        self.place.write(py, |inner| {
            let now = inner.world.pose(self.place.id, 0).ok_or_else(|| self.place.removed())?;
            let translation = if moves { target.translation } else { now.translation };
            let rotation = if turns { target.rotation } else { now.rotation };
            Ok(inner.world.move_to(self.place.id, Pose::from_parts(translation, rotation))?)
        })
    }

    /// Returns the position of a point of the body in the world. point: shape (3,), in the body's
    /// frame, meters (default: its origin).
    #[pyo3(signature = (point=None, **unknown), text_signature = "($self, point=None)")]
    fn to_world<'py>(
        &self,
        py: Python<'py>,
        point: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyArray1<f64>>> {
        keywords::check(unknown, "RigidBody.to_world")?;
        let point = vec3_or(point, "point", Vec3::zeros())?;
        Ok(vector(py, &self.place.pose()?.transform_point(&point.into()).coords))
    }

    /// Refuses to pickle a handle by itself.
    fn __reduce__(&self) -> Result<()> {
        Err(alone(&self.place.name))
    }
}
