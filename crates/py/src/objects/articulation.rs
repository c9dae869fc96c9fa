//! Articulated bodies: a description from a file, or a handle of a body in a world. Both have the
//! same methods.

use crate::arrays::convert::{array, vec3, vector};
use crate::choices::{COLLISION_MESHES, MISSING_MESHES, meaning, word};
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::all_drives::AllDrives;
use crate::objects::binding::{Binding, Now, Source, Which, locked, start};
use crate::objects::description::alone;
use crate::objects::joints::{component, drive, result};
use crate::objects::place::{Place, hash};
use crate::objects::robot::Robot;
use crate::pool;
use crate::world::gc::{Anchor, anchor};
use crate::world::pickling::write_body;
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::{ArticulatedBody, DofSettings, Object};
use tumble::scene::mjcf::{self, MjcfOptions};
use tumble::scene::sdformat;
use tumble::scene::urdf::{self, UrdfOptions};

/// A tree of links: a robot, a chain, a skeleton.
///
/// ``Articulation.from_urdf`` returns a description, whose dynamics functions work at once.
/// ``World.add_articulation`` adds it to a world and returns a handle of the body there. ``q`` has
/// ``nq`` numbers: one per revolute joint (rad) or prismatic joint (m), a quaternion (x, y, z, w)
/// per spherical joint, position and quaternion of a floating root. ``qd`` and ``tau`` have ``dof``
/// numbers: rad/s or m/s and N·m or N; those of a floating root are angular, then linear, world
/// axes.
///
/// All functions of ``q``, ``qd``, ``tau`` take one state or a batch of states with a leading axis.
/// An argument without that axis applies to the whole batch. These functions ignore limits,
/// damping, drives and contacts.
#[pyclass(frozen, module = "tumble")]
pub struct Articulation {
    pub name: Arc<str>,
    pub robot: Arc<Robot>,
    pub spot: Binding,
    anchor: Option<Py<Anchor>>,
}

impl Articulation {
    /// Returns a handle of a body in a world.
    pub fn placed(py: Python<'_>, place: Place, robot: Arc<Robot>) -> Result<Articulation> {
        Ok(Articulation {
            name: place.name.clone(),
            robot,
            anchor: Some(anchor(py, &place.shared)?),
            spot: Binding::Placed(place),
        })
    }

    /// Returns the description of a body made by a program. Its joints have the names of their links.
    pub fn described(body: ArticulatedBody) -> Articulation {
        let joints = body.model().links().iter().map(|link| link.name.clone()).collect();
        Articulation::of_source(Source::Built(Box::new(body.clone())), &body, joints)
    }

    /// Returns the description of a body, in its initial state.
    fn of_source(source: Source, body: &ArticulatedBody, joints: Vec<String>) -> Articulation {
        let start = start(body);
        let (q, qd) = start.split_at(body.model().positions());
        let now = Now { gravity: Vec3::new(0.0, 0.0, -9.81), q: q.to_vec(), qd: qd.to_vec(), tau: vec![0.0; qd.len()] };
        let robot = Robot { model: body.model().clone(), base: Pose::identity(), joints };
        Articulation {
            name: body.name().into(),
            robot: Arc::new(robot),
            spot: Binding::Free { source, now: Mutex::new(now) },
            anchor: None,
        }
    }

    /// Returns the place of the body, if it is in a world.
    pub fn place(&self) -> Option<&Place> {
        match &self.spot {
            Binding::Placed(place) => Some(place),
            Binding::Free { .. } => None,
        }
    }
}

pub(super) type Array<'py> = Bound<'py, PyArrayDyn<f64>>;
pub(super) type Given<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

#[pymethods]
impl Articulation {
    /// Reads a URDF. The tree is read at once, collision shapes when it is added to a world, and
    /// visual meshes when they are first drawn.
    ///
    /// floating: whether the root floats; otherwise it is fixed to the base. packages: folders by
    /// name, for ``package://NAME/…``. missing_meshes: ``"error"`` or ``"skip"``, for missing
    /// collision meshes. collision_meshes: ``"exact"`` or ``"hull"``. velocity_limits: whether the largest
    /// velocities of joints are enforced, as ``max_velocity``, against any force; False: they are read and have no effect.
    #[staticmethod]
    #[pyo3(signature = (path, *, floating=false, packages=None, missing_meshes="error", collision_meshes="exact", velocity_limits=false, **unknown), text_signature = "(path, *, floating=False, packages=None, missing_meshes='error', collision_meshes='exact', velocity_limits=False)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    pub fn from_urdf(
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        floating: bool,
        packages: Option<BTreeMap<String, PathBuf>>,
        missing_meshes: &str,
        collision_meshes: &str,
        velocity_limits: bool,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Articulation> {
        keywords::check(unknown, "Articulation.from_urdf")?;
        let file = crate::arrays::convert::path(path)?;
        let options = UrdfOptions {
            velocity_limits,
            floating,
            packages: packages.unwrap_or_default(),
            missing_meshes: meaning("missing_meshes", missing_meshes, MISSING_MESHES)?,
            collision_meshes: meaning("collision_meshes", collision_meshes, COLLISION_MESHES)?,
            ..UrdfOptions::default()
        };
        let read = py.detach(|| pool::run(|| Ok(urdf::model(&file, &options)?)))?;
        let body = ArticulatedBody::new(read.name, read.model);
        let source = Source::File { file, options, dofs: read.dofs };
        Ok(Articulation::of_source(source, &body, read.joints))
    }

    /// Reads the only articulated body of a model of MuJoCo, at the place that it has there.
    /// ``World.load`` reads a whole model: bodies, floors, gravity and time step.
    ///
    /// keyframe: name or number of the keyframe that it starts in. missing_meshes: ``"error"`` or
    /// ``"skip"``, for missing collision meshes. collision_meshes: ``"exact"`` or ``"hull"``.
    #[staticmethod]
    #[pyo3(signature = (path, *, keyframe=None, missing_meshes="error", collision_meshes="hull", **unknown), text_signature = "(path, *, keyframe=None, missing_meshes='error', collision_meshes='hull')")]
    pub fn from_mjcf(
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        keyframe: Option<String>,
        missing_meshes: &str,
        collision_meshes: &str,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Articulation> {
        keywords::check(unknown, "Articulation.from_mjcf")?;
        let file = crate::arrays::convert::path(path)?;
        let options = MjcfOptions {
            keyframe,
            missing_meshes: meaning("missing_meshes", missing_meshes, MISSING_MESHES)?,
            collision_meshes: meaning("collision_meshes", collision_meshes, COLLISION_MESHES)?,
        };
        let (body, joints, _) = py.detach(|| pool::run(|| Ok(mjcf::articulation(&file, &options)?)))?;
        Ok(Articulation::of_source(Source::Built(Box::new(body.clone())), &body, joints))
    }

    /// Reads the only body of joined links of an SDF file (of Gazebo), at the place that it has there.
    /// ``World.load`` reads a whole file: models, planes, lights, gravity and time step.
    ///
    /// packages: folders by name, for ``model://NAME/…``. missing_meshes: ``"error"`` or ``"skip"``, for
    /// missing collision meshes. collision_meshes: ``"exact"`` or ``"hull"``.
    #[staticmethod]
    #[pyo3(signature = (path, *, packages=None, missing_meshes="error", collision_meshes="exact", **unknown), text_signature = "(path, *, packages=None, missing_meshes='error', collision_meshes='exact')")]
    pub fn from_sdformat(
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        packages: Option<BTreeMap<String, PathBuf>>,
        missing_meshes: &str,
        collision_meshes: &str,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Articulation> {
        keywords::check(unknown, "Articulation.from_sdformat")?;
        let file = crate::arrays::convert::path(path)?;
        let options = UrdfOptions {
            packages: packages.unwrap_or_default(),
            missing_meshes: meaning("missing_meshes", missing_meshes, MISSING_MESHES)?,
            collision_meshes: meaning("collision_meshes", collision_meshes, COLLISION_MESHES)?,
            ..UrdfOptions::default()
        };
        let (body, joints, _) = py.detach(|| pool::run(|| Ok(sdformat::articulation(&file, &options)?)))?;
        Ok(Articulation::of_source(Source::Built(Box::new(body.clone())), &body, joints))
    }

    /// Name of the robot in its file, or of the body in its world.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Whether it is in a world.
    #[getter]
    fn placed_in_world(&self) -> bool {
        self.place().is_some()
    }

    /// Whether its world still has it; True for a description.
    #[getter]
    fn exists(&self) -> Result<bool> {
        self.place().map_or(Ok(true), Place::exists)
    }

    /// Names of all joints that are not fixed, in the order of the coordinates.
    #[getter]
    fn joint_names(&self) -> Vec<String> {
        self.robot.joints.clone()
    }

    /// Names of all links, including fixed ones, in the order of ``link_poses``.
    #[getter]
    fn link_names(&self) -> Vec<String> {
        self.robot.model.frames().iter().map(|frame| frame.name.clone()).collect()
    }

    /// Number of degrees of freedom: the length of ``qd`` and ``tau``.
    #[getter]
    fn dof(&self) -> usize {
        self.robot.dof()
    }

    /// Length of ``q``.
    #[getter]
    fn nq(&self) -> usize {
        self.robot.positions()
    }

    /// Mass of all links that can move, kg.
    #[getter]
    fn mass(&self) -> Result<f64> {
        Ok(self.present()?.model.mass())
    }

    /// Positions, shape (nq,), rad and m.
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(array(py, &self.spot.get(Which::Q, &self.robot)?))
    }

    #[setter]
    fn set_q(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.spot.set(py, Which::Q, &self.robot, value)
    }

    /// Velocities, shape (dof,), rad/s and m/s.
    #[getter]
    fn qd<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(array(py, &self.spot.get(Which::Qd, &self.robot)?))
    }

    #[setter]
    fn set_qd(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.spot.set(py, Which::Qd, &self.robot, value)
    }

    /// Generalized forces, shape (dof,), N·m and N. They act in every step until they are changed,
    /// in addition to drives and damping. ``save`` and forks include them; ``World.state`` does
    /// not.
    #[getter]
    fn tau<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(array(py, &self.spot.get(Which::Tau, &self.robot)?))
    }

    #[setter]
    fn set_tau(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.spot.set(py, Which::Tau, &self.robot, value)
    }

    /// Gravity used by its functions, shape (3,), m/s². In a world it is the world's gravity and
    /// can only be set there.
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.spot.gravity()?))
    }

    #[setter]
    pub fn set_gravity(&self, value: &Bound<'_, PyAny>) -> Result<()> {
        let gravity = vec3(value, "gravity")?;
        match &self.spot {
            Binding::Free { now, .. } => locked(now).gravity = gravity,
            Binding::Placed(_) => return Err(Error::value("gravity is a setting of the world; set it there")),
        }
        Ok(())
    }

    /// Lower and upper position limit of each degree of freedom, shape (dof, 2), rad or m; infinite
    /// without a limit. Settable for a body in a world.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        let dofs = self.spot.dofs()?;
        let flat = dofs.iter().flat_map(|f| f.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY])).collect();
        Ok(PyArray1::from_vec(py, flat).reshape([dofs.len(), 2])?)
    }

    #[setter]
    fn set_limits(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.change_limits(py, value)
    }

    /// Largest speed of each degree of freedom, shape (dof,), rad/s or m/s; infinite for none. Settable for a
    /// body in a world.
    #[getter]
    fn max_velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.spot.dofs()?.iter().map(|dof| dof.max_velocity).collect()))
    }

    #[setter]
    fn set_max_velocity(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.change_dofs(py, ("max_velocity", value), |dof, max_velocity| DofSettings { max_velocity, ..dof })
    }

    /// Force of the motor of each degree of freedom, shape (dof,), N·m or N, the limit of drives that name none;
    /// infinite if it is not known. A URDF states it. Settable for a body in a world.
    #[getter]
    fn effort<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.spot.dofs()?.iter().map(|dof| dof.effort).collect()))
    }

    #[setter]
    fn set_effort(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.change_dofs(py, ("effort", value), |dof, effort| DofSettings { effort, ..dof })
    }

    /// Returns the accelerations ``qdd`` that generalized forces ``tau`` cause, shape (dof,) or
    /// (batch, dof).
    ///
    /// q: (nq,), qd, tau: (dof,), each optionally batched (batch, …). Omitted arguments have their
    /// current values. A singular mass matrix raises ``InvalidValueError`` with the name of the link whose joint
    /// moves no inertia.
    #[pyo3(signature = (q=None, qd=None, tau=None, **unknown), text_signature = "($self, q=None, qd=None, tau=None)")]
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        qd: Given<'_, 'py>,
        tau: Given<'_, 'py>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Array<'py>> {
        keywords::check(unknown, "Articulation.forward_dynamics")?;
        let mut rows = self.rows(&[(Which::Q, "q", q), (Which::Qd, "qd", qd), (Which::Tau, "tau", tau)])?;
        let gravity = self.spot.gravity()?;
        let robot = self.present()?;
        let out = py.detach(|| robot.forward_dynamics(&gravity, &mut rows))?;
        result(py, &rows, out, &[self.robot.dof()])
    }

    /// Returns the generalized forces that accelerations ``qdd`` require, including gravity, shape
    /// (dof,) or (batch, dof).
    ///
    /// q: (nq,), qd, qdd: (dof,), each optionally batched. Without ``qdd`` the accelerations are
    /// zero.
    #[pyo3(signature = (q=None, qd=None, qdd=None, **unknown), text_signature = "($self, q=None, qd=None, qdd=None)")]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        qd: Given<'_, 'py>,
        qdd: Given<'_, 'py>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Array<'py>> {
        keywords::check(unknown, "Articulation.inverse_dynamics")?;
        let still = array(py, &vec![0.0; self.robot.dof()]).into_any();
        let mut rows =
            self.rows(&[(Which::Q, "q", q), (Which::Qd, "qd", qd), (Which::Tau, "qdd", Some(qdd.unwrap_or(&still)))])?;
        let gravity = self.spot.gravity()?;
        let robot = self.present()?;
        let out = py.detach(|| robot.inverse_dynamics(&gravity, &mut rows))?;
        result(py, &rows, out, &[self.robot.dof()])
    }

    /// Returns the mass matrix, symmetric, shape (dof, dof) or (batch, dof, dof).
    #[pyo3(signature = (q=None, **unknown), text_signature = "($self, q=None)")]
    fn mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Array<'py>> {
        keywords::check(unknown, "Articulation.mass_matrix")?;
        let mut rows = self.rows(&[(Which::Q, "q", q)])?;
        let robot = self.present()?;
        let out = py.detach(|| robot.mass_matrix(&mut rows))?;
        result(py, &rows, out, &[self.robot.dof(); 2])
    }

    /// Returns the Jacobian of a link, shape (6, dof) or (batch, 6, dof). ``J @ qd`` is the angular
    /// velocity (first three rows) and the velocity of the origin of the link's frame (last three),
    /// world axes.
    #[pyo3(signature = (link, q=None, **unknown), text_signature = "($self, link, q=None)")]
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        link: &str,
        q: Given<'_, 'py>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Array<'py>> {
        keywords::check(unknown, "Articulation.jacobian")?;
        let frame = self.robot.frame(link)?;
        let mut rows = self.rows(&[(Which::Q, "q", q)])?;
        let out = py.detach(|| self.robot.jacobian(frame, &mut rows))?;
        result(py, &rows, out, &[6, self.robot.dof()])
    }

    /// Returns the poses of all links in the world, in the order of ``link_names``: position, m,
    /// and quaternion (x, y, z, w). Shape (links, 7) or (batch, links, 7).
    #[pyo3(signature = (q=None, **unknown), text_signature = "($self, q=None)")]
    fn link_poses<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Array<'py>> {
        keywords::check(unknown, "Articulation.link_poses")?;
        let mut rows = self.rows(&[(Which::Q, "q", q)])?;
        let out = py.detach(|| self.robot.link_poses(&mut rows))?;
        result(py, &rows, out, &[self.robot.model.frames().len(), 7])
    }

    /// Returns the pose of one link in the world, shape (7,) or (batch, 7), as in ``link_poses``.
    #[pyo3(signature = (link, q=None, **unknown), text_signature = "($self, link, q=None)")]
    fn link_pose<'py>(
        &self,
        py: Python<'py>,
        link: &str,
        q: Given<'_, 'py>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Array<'py>> {
        keywords::check(unknown, "Articulation.link_pose")?;
        self.robot.frame(link)?;
        let number = self.robot.model.frames().iter().position(|frame| frame.name == link).unwrap_or(0);
        let mut rows = self.rows(&[(Which::Q, "q", q)])?;
        let out = py.detach(|| self.robot.link_poses(&mut rows))?;
        let all = 7 * self.robot.model.frames().len();
        let own = out.chunks_exact(all).flat_map(|poses| &poses[7 * number..7 * number + 7]).copied().collect();
        result(py, &rows, own, &[7])
    }

    /// Returns the center of mass in the world, shape (3,) or (batch, 3), meters.
    #[pyo3(signature = (q=None, **unknown), text_signature = "($self, q=None)")]
    fn center_of_mass<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Array<'py>> {
        keywords::check(unknown, "Articulation.center_of_mass")?;
        let mut rows = self.rows(&[(Which::Q, "q", q)])?;
        let robot = self.present()?;
        let out = py.detach(|| robot.center_of_mass(&mut rows))?;
        result(py, &rows, out, &[3])
    }

    /// Sets the drive of a revolute, prismatic or spherical joint of a body in a world, by the name of the
    /// joint. Target and velocity of a spherical joint are a rotation vector in the frame of the joint and an angular velocity in the
    /// axes of the link, shape (3,); a number is for each component.
    ///
    /// With ``stiffness`` or ``damping`` it drives to position ``target`` (rad or m) and
    /// ``velocity``. With neither it holds ``velocity``. Without arguments the drive is removed.
    /// max_force: largest torque or force, N·m or N; None: the ``effort`` of the joint. ``save`` includes it.
    #[pyo3(signature = (joint, *, target=None, velocity=None, stiffness=0.0, damping=0.0, max_force=None, **unknown), text_signature = "($self, joint, *, target=None, velocity=None, stiffness=0.0, damping=0.0, max_force=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn set_drive(
        &self,
        py: Python<'_>,
        joint: &str,
        target: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        stiffness: f64,
        damping: f64,
        max_force: Option<f64>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Articulation.set_drive")?;
        let (place, (first, count)) = (self.in_world()?, self.dofs_of(joint)?);
        let each = |name: &str, value: Option<&Bound<'_, PyAny>>| match value {
            Some(value) => (0..count).map(|k| component(name, value, k, count).map(Some)).collect::<Result<Vec<_>>>(),
            None => Ok(vec![None; count]),
        };
        let (targets, velocities) = (each("target", target)?, each("velocity", velocity)?);
        place.write(py, |inner| {
            let body = inner.world.get::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            let mut body = body.clone();
            for k in 0..count {
                let before = body.dofs()[first + k].clone();
                let most = max_force.unwrap_or(before.effort);
                let drive = drive(targets[k], velocities[k], stiffness, damping, most)?;
                body.set_dof(first + k, DofSettings { drive, ..before })?;
            }
            *inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())? = body;
            Ok(())
        })
    }

    /// Sets the drives of all degrees of freedom of a body in a world at once, in the order of ``qd``.
    ///
    /// Arguments as in ``set_drive``: a number for all that can have a drive, or shape (dof,). Degrees of freedom whose numbers are
    /// all 0 or None have no drive then. A ``target`` without
    /// ``stiffness`` and ``damping`` is that of the drives that are there, which keep their gains. ``save`` includes them.
    #[pyo3(
        signature = (*, target=None, velocity=None, stiffness=None, damping=None, max_force=None, **unknown),
        text_signature = "($self, *, target=None, velocity=None, stiffness=None, damping=None, max_force=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn set_drives(
        &self,
        py: Python<'_>,
        target: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        stiffness: Option<&Bound<'_, PyAny>>,
        damping: Option<&Bound<'_, PyAny>>,
        max_force: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Articulation.set_drives")?;
        let place = self.in_world()?;
        let each = |name, value: Option<&Bound<'_, PyAny>>| value.map(|v| self.of_each_dof((name, v))).transpose();
        let given = AllDrives {
            target: each("target", target)?,
            velocity: each("velocity", velocity)?,
            stiffness: each("stiffness", stiffness)?,
            damping: each("damping", damping)?,
            max_force: each("max_force", max_force)?,
        };
        place.write(py, |inner| {
            let body = inner.world.get::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            let mut body = body.clone();
            body.set_drives(&given.drives(&body)?)?;
            *inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())? = body;
            Ok(())
        })
    }

    /// Applies a force to a link of a body in a world during the next step only. force: shape (3,),
    /// N; point: where it acts, meters (default: the origin of the link's frame). World axes.
    #[pyo3(signature = (link, force, point=None, **unknown), text_signature = "($self, link, force, point=None)")]
    fn apply_force(
        &self,
        py: Python<'_>,
        link: &str,
        force: &Bound<'_, PyAny>,
        point: Given<'_, '_>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Articulation.apply_force")?;
        let force = vec3(force, "force")?;
        self.push(py, link, point, |inner, place, part, at| Ok(inner.world.apply_force(place.id, part, force, &at)?))
    }

    /// Applies a torque to a link during the next step only. torque: shape (3,), N·m, world axes.
    #[pyo3(signature = (link, torque, **unknown), text_signature = "($self, link, torque)")]
    fn apply_torque(
        &self,
        py: Python<'_>,
        link: &str,
        torque: &Bound<'_, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Articulation.apply_torque")?;
        let torque = vec3(torque, "torque")?;
        self.push(py, link, None, |inner, place, part, _| Ok(inner.world.apply_torque(place.id, part, torque)?))
    }

    /// Applies an impulse to a link at once. impulse: shape (3,), N·s; point: as in
    /// ``apply_force``.
    #[pyo3(signature = (link, impulse, point=None, **unknown), text_signature = "($self, link, impulse, point=None)")]
    fn apply_impulse(
        &self,
        py: Python<'_>,
        link: &str,
        impulse: &Bound<'_, PyAny>,
        point: Given<'_, '_>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Articulation.apply_impulse")?;
        let impulse = vec3(impulse, "impulse")?;
        self.push(py, link, point, |inner, place, part, at| {
            Ok(inner.world.apply_impulse(place.id, part, impulse, &at)?)
        })
    }

    fn __repr__(&self) -> String {
        let place = if !self.exists().unwrap_or(true) {
            ", removed"
        } else if self.place().is_some() {
            ""
        } else {
            ", a description"
        };
        format!("<tumble.Articulation '{}', {} dof{place}>", self.name, self.robot.dof())
    }

    fn __eq__(slf: &Bound<'_, Self>, other: &Bound<'_, PyAny>) -> bool {
        let Ok(other) = other.cast::<Articulation>() else { return false };
        match (slf.get().place(), other.get().place()) {
            (Some(a), Some(b)) => a.same(b),
            _ => slf.is(other),
        }
    }

    /// Pickles the file of a description, or the body made by a program, and its numbers. A handle of a
    /// body in a world cannot be pickled.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let Binding::Free { source, now } = &self.spot else {
            return Err(alone(&self.name));
        };
        let Now { gravity, q, qd, tau } = locked(now).clone();
        let numbers = [gravity.as_slice().to_vec(), q, qd, tau];
        let native = py.import("tumble._native")?;
        Ok(match source {
            Source::File { file, options, .. } => {
                let file = std::path::absolute(file).unwrap_or_else(|_| file.clone());
                let UrdfOptions { floating, packages, missing_meshes, collision_meshes, velocity_limits, .. } =
                    options.clone();
                let words = [word(missing_meshes, MISSING_MESHES), word(collision_meshes, COLLISION_MESHES)];
                let arguments = (file, floating, packages, words, velocity_limits, numbers).into_pyobject(py)?;
                (native.getattr("_unpickle_articulation")?, arguments.into_any())
            }
            Source::Built(body) => {
                let arguments = (PyBytes::new(py, &write_body(body)?), numbers).into_pyobject(py)?;
                (native.getattr("_unpickle_built_articulation")?, arguments.into_any())
            }
        })
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.anchor)
    }

    fn __hash__(slf: &Bound<'_, Self>) -> u64 {
        slf.get().place().map_or(slf.as_ptr() as u64 >> 4, hash)
    }
}
