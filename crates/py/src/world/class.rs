//! The class `World`.

use crate::arrays::convert::{Numbers, numbers, path, pose, vec3, vec3_or, vector, whole_number};
use crate::batch::crew;
use crate::behaviors;
use crate::choices::meaning;
use crate::errors::{Error, Result};
use crate::extension::callbacks::{Extensions, Reduced};
use crate::interrupt::interruptible;
use crate::io::picture::Shot;
use crate::io::slow;
use crate::objects::articulation::Articulation;
use crate::objects::bodies;
use crate::objects::bodies::{Bodies, handle, place_of};
use crate::objects::body::{self, RigidBody};
use crate::objects::joint::Joint;
use crate::objects::place::{body_ids, by_name};
use crate::objects::sensor::{Sensor, Sensors};
use crate::objects::shapes::Shape;
use crate::pool;
use crate::world::add::{add, articulated, named_shape, own_place, rigid};
use crate::world::bulk::{self, Bulk};
use crate::world::gc::{Anchor, anchor};
use crate::world::inner::Inner;
use crate::world::joints;
use crate::world::load::{Choices, build};
use crate::world::pairs::{self, combine};
use crate::world::query::{self, Selection};
use crate::world::report::StepReport;
use crate::world::rollout::Plan;
use crate::world::shared::Shared;
use crate::world::{contacts, pickling, save_scene, sensors, snapshot};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;
use tumble::collide::{ContactMode, Vec3};
use tumble::dynamics::{Material, Mode, PairMaterial, RigidBody as Rigid, SensorNoise, Settings};
use tumble::scene::mjcf::MjcfOptions;
use tumble::scene::{FileKind, LoadOptions, SceneFile, resolve_scene};

/// A world of bodies that moves in steps of ``dt`` seconds. SI units, radians, z up; quaternions
/// are (x, y, z, w).
///
/// gravity: shape (3,), m/s². dt: length of a step, s. stepper: ``"time_stepping"`` or
/// ``"backtracking"``. integrator: ``"verlet"``, ``"symplectic_euler"``, ``"explicit_euler"``,
/// ``"rk4"`` or ``"dormand_prince"``; used by ``"backtracking"``, since ``"time_stepping"`` has its
/// own midpoint rule. solver: ``"gauss_seidel"``, ``"lcp_pyramid"`` or ``"lcp_sliding"``. substeps:
/// sub-steps of each step. iterations: largest number of solver sweeps. contact_tolerance: meters.
/// integrator_tolerance: for ``dormand_prince``. sleep_after: seconds after which islands that
/// moved by less than sleep_within (meters) sleep until something touches them; None: never.
/// combine_restitution, combine_friction: rule for the coefficients of a pair, ``"min"``,
/// ``"max"``, ``"average"``, ``"product"`` or ``"geometric_mean"``. threads: threads of a step, 0 for
/// as many as cores; no number changes the result. budget: largest work of a step in block
/// relaxations, None for no bound. event_impulse: N·s, see ``events``. max_turn: largest angle, rad, by
/// which forces of joints may turn a part back and forth in a sub-step; frames are divided so that they do not.
/// Names and defaults are those of scene files.
///
/// One thread at a time: while one thread steps a world, calls on it from another raise
/// ``BusyError``. The interpreter is released while a world steps.
#[pyclass(frozen, weakref, module = "tumble")]
pub struct World {
    pub shared: Arc<Shared>,
    anchor: Py<Anchor>,
}

impl World {
    /// Wraps a world.
    pub fn of(py: Python<'_>, inner: Inner) -> Result<World> {
        slow::warn(py)?;
        let shared = Shared::new(inner);
        Ok(World { anchor: anchor(py, &shared)?, shared })
    }

    fn settings<T>(&self, get: impl FnOnce(&Settings) -> T) -> Result<T> {
        self.shared.read(|inner| Ok(get(inner.world.settings())))
    }

    fn set(&self, py: Python<'_>, change: impl FnOnce(&mut Settings)) -> Result<()> {
        self.shared.write(py, |inner| {
            let mut settings = *inner.world.settings();
            change(&mut settings);
            Ok(inner.world.set_settings(settings)?)
        })
    }
}

impl World {
    fn bulk<'py>(&self, py: Python<'py>, bulk: Bulk) -> Result<Bound<'py, PyArray2<f64>>> {
        bulk::array(py, bulk, self.shared.read(|inner| bulk::get(inner, bulk))?)
    }

    fn set_bulk(&self, py: Python<'_>, bulk: Bulk, value: &Bound<'_, PyAny>) -> Result<()> {
        let rows = bulk::rows(bulk, value)?;
        self.shared.write(py, |inner| bulk::set(inner, bulk, rows))
    }
}

#[pymethods]
impl World {
    #[new]
    #[pyo3(
        text_signature = "(gravity=(0.0, 0.0, -9.81), dt=0.004166666666666667, stepper='time_stepping', integrator='verlet', \
        solver='gauss_seidel', *, substeps=1, iterations=200, contact_tolerance=1e-7, integrator_tolerance=1e-10, sleep_after=None, sleep_within=1e-5, \
        combine_restitution='max', combine_friction='geometric_mean', threads=1, budget=None, event_impulse=0.0, max_turn=1.0)"
    )]
    #[pyo3(signature = (gravity=None, dt=0.004166666666666667, stepper="time_stepping", integrator="verlet", solver="gauss_seidel", *, substeps=1, iterations=200,
        contact_tolerance=1e-7, integrator_tolerance=1e-10, sleep_after=None, sleep_within=1e-5, combine_restitution="max", combine_friction="geometric_mean", threads=1, budget=None, event_impulse=0.0, max_turn=1.0))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn new(
        py: Python<'_>,
        gravity: Option<&Bound<'_, PyAny>>,
        dt: f64,
        stepper: &str,
        integrator: &str,
        solver: &str,
        #[pyo3(from_py_with = whole_number)] substeps: u32,
        #[pyo3(from_py_with = whole_number)] iterations: u32,
        contact_tolerance: f64,
        integrator_tolerance: f64,
        sleep_after: Option<f64>,
        sleep_within: f64,
        combine_restitution: &str,
        combine_friction: &str,
        #[pyo3(from_py_with = whole_number)] threads: u32,
        budget: Option<u32>,
        event_impulse: f64,
        max_turn: f64,
    ) -> Result<World> {
        let mut scene = SceneFile::parse("", "World")?;
        let world = &mut scene.world;
        world.gravity_m_per_s2 = vec3_or(gravity, "gravity", Vec3::from(world.gravity_m_per_s2))?.into();
        let (stepper, integrator, solver) = (Some(stepper), Some(integrator), Some(solver));
        Choices { stepper, integrator, solver, dt: Some(dt), threads: Some(threads), budget }.apply(world)?;
        (world.substeps, world.iterations) = (substeps, iterations);
        (world.contact_tolerance_m, world.integrator_tolerance) = (contact_tolerance, integrator_tolerance);
        (world.sleep_after_s, world.sleep_within_m) = (sleep_after, sleep_within);
        (world.event_impulse_n_s, world.max_turn_rad) = (event_impulse, max_turn);
        world.combine_restitution = combine(combine_restitution, "combine_restitution")?;
        world.combine_friction = combine(combine_friction, "combine_friction")?;
        World::of(py, build(scene)?)
    }

    /// Loads the world of a scene: the path of a ``scene.toml`` or of its folder, the name of a
    /// shipped scene, or the path of a robot (``.urdf``), a model of MuJoCo (``.xml``) or a mesh.
    ///
    /// keyframe: name or number of the keyframe that a model of MuJoCo starts in. The other arguments
    /// override the settings of the file. A missing file or an unknown name raises
    /// ``MissingFileError`` (a ``FileNotFoundError``); a file with problems raises ``SceneError``
    /// (a ``ValueError``), which lists all of them with line and column.
    #[staticmethod]
    #[pyo3(signature = (path_or_name, *, dt=None, stepper=None, integrator=None, solver=None, threads=None, budget=None, keyframe=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn load(
        py: Python<'_>,
        path_or_name: &Bound<'_, PyAny>,
        dt: Option<f64>,
        stepper: Option<&str>,
        integrator: Option<&str>,
        solver: Option<&str>,
        threads: Option<u32>,
        budget: Option<u32>,
        keyframe: Option<String>,
    ) -> Result<World> {
        let asked = path(path_or_name)?;
        if keyframe.is_some() && !matches!(FileKind::of(&asked), Ok(FileKind::Mjcf)) {
            return Err(Error::value("keyframe: only a model of MuJoCo (.xml) has keyframes"));
        }
        let built = py.detach(|| {
            pool::run(|| {
                let mjcf = MjcfOptions { keyframe, ..MjcfOptions::default() };
                let options = LoadOptions { mjcf, ..LoadOptions::default() };
                let mut scene = resolve_scene(&asked.to_string_lossy(), &[])?.load_with(&options)?;
                Choices { stepper, integrator, solver, dt, threads, budget }.apply(&mut scene.world)?;
                build(scene)
            })
        })?;
        World::of(py, built)
    }

    /// Builds the world of a scene from the text of its file.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str) -> Result<World> {
        World::of(py, py.detach(|| pool::run(|| build(SceneFile::parse(text, "scene.toml")?)))?)
    }

    /// Notes about the world: a list of sentences.
    ///
    /// They are about the files of a scene and of added articulations, such as repairs of a mesh or
    /// a convex hull instead of an open mesh; about visual meshes that could not be read, once
    /// something has drawn them; and about bodies that overlap at the start, the deepest eight by
    /// name. Overlaps are searched for if this is read before the first step.
    #[getter]
    fn notes(&self, py: Python<'_>) -> Result<Vec<String>> {
        self.shared.write(py, |inner| Ok(inner.all_notes()))
    }

    /// Advances by ``n`` steps of ``dt``. The interpreter is released meanwhile; Ctrl-C stops
    /// between two steps.
    ///
    /// After a ``StepError`` the world is as before the step that failed; earlier steps are kept.
    #[pyo3(signature = (n=1))]
    fn step(&self, py: Python<'_>, #[pyo3(from_py_with = whole_number)] n: i64) -> Result<()> {
        let Ok(mut left) = u64::try_from(n) else {
            return Err(Error::value(format!("n is {n}; it must be at least 0")));
        };
        self.shared.work_in_parts(py, |inner, turn| {
            let begun = (left > 1).then(Instant::now);
            while left > 0 {
                inner.step()?;
                left -= 1;
                if begun.is_some_and(|begun| begun.elapsed() > turn) {
                    break;
                }
            }
            Ok(left == 0)
        })
    }

    /// Simulated time, s.
    #[getter]
    fn time(&self) -> Result<f64> {
        self.shared.read(|inner| Ok(inner.world.time()))
    }

    /// Steps taken since the world was made.
    #[getter]
    fn frame(&self) -> Result<u64> {
        self.shared.read(|inner| Ok(inner.world.frame()))
    }

    /// Length of a step, s.
    #[getter]
    fn dt(&self) -> Result<f64> {
        self.settings(|s| s.dt)
    }

    #[setter]
    fn set_dt(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.dt = value)
    }

    /// Gravity, shape (3,), m/s².
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.settings(|s| s.gravity)?))
    }

    #[setter]
    fn set_gravity(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let gravity = vec3(value, "gravity")?;
        self.set(py, |s| s.gravity = gravity)
    }

    /// Threads of a step, 0 for as many as cores. No number changes the result. Forks have the same
    /// number; an unpickled world has 1.
    #[getter]
    fn threads(&self) -> Result<u32> {
        self.settings(|s| s.threads)
    }

    #[setter]
    fn set_threads(&self, py: Python<'_>, #[pyo3(from_py_with = whole_number)] value: u32) -> Result<()> {
        self.set(py, |s| s.threads = value)
    }

    /// Largest work of a step in block relaxations (``report.relaxations`` is the work of the last
    /// one), None for no bound. A step that needs more is less accurate, and ``report.residual`` says by
    /// how much. The same budget gives the same result on every machine. It may change between any two
    /// steps, and wakes nothing.
    #[getter]
    fn budget(&self) -> Result<Option<u32>> {
        self.settings(|s| s.solver_settings.budget)
    }

    #[setter]
    fn set_budget(&self, py: Python<'_>, value: Option<u32>) -> Result<()> {
        self.set(py, |s| s.solver_settings.budget = value)
    }

    /// Combination rule for restitution: ``"min"``, ``"max"``, ``"average"``, ``"product"`` or
    /// ``"geometric_mean"``.
    #[getter]
    fn combine_restitution(&self) -> Result<&'static str> {
        self.settings(|s| s.combine_restitution.name())
    }

    #[setter]
    fn set_combine_restitution(&self, py: Python<'_>, value: &str) -> Result<()> {
        let rule = combine(value, "combine_restitution")?;
        self.set(py, |s| s.combine_restitution = rule)
    }

    /// Combination rule for friction.
    #[getter]
    fn combine_friction(&self) -> Result<&'static str> {
        self.settings(|s| s.combine_friction.name())
    }

    #[setter]
    fn set_combine_friction(&self, py: Python<'_>, value: &str) -> Result<()> {
        let rule = combine(value, "combine_friction")?;
        self.set(py, |s| s.combine_friction = rule)
    }

    /// Sets restitution and friction of the contacts of two bodies from the next step on,
    /// overriding the combination rules, and whether they collide at all.
    ///
    /// a, b: handles or names in any order; ``"ARTICULATION/LINK"`` is a link of an articulation
    /// with the links fixed to it. None keeps the rule; without all the pair has no constants of
    /// its own any more. collides: False ignores the pair; True does not override groups and masks. Forks have the same pairs. ``save`` does not include them, as it does not
    /// include materials.
    #[pyo3(signature = (a, b, *, restitution=None, friction=None, collides=None))]
    fn set_pair_material(
        &self,
        py: Python<'_>,
        a: &Bound<'_, PyAny>,
        b: &Bound<'_, PyAny>,
        restitution: Option<f64>,
        friction: Option<f64>,
        collides: Option<bool>,
    ) -> Result<()> {
        pairs::set(&self.shared, py, [a, b], PairMaterial { restitution, friction, collides })
    }

    /// Returns restitution and friction of the contacts of two bodies: the pair's own constants if
    /// set, else those of the combination rules.
    ///
    /// a, b: as in ``set_pair_material``. An articulation is represented by its first shape.
    fn pair_material(&self, a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>) -> Result<(f64, f64)> {
        pairs::get(&self.shared, [a, b])
    }

    /// Name of the stepper.
    #[getter]
    fn stepper(&self) -> Result<&'static str> {
        self.shared.read(|inner| Ok(inner.world.stepper_name()))
    }

    /// Name of the contact solver.
    #[getter]
    fn solver(&self) -> Result<&'static str> {
        self.shared.read(|inner| Ok(inner.world.solver_name()))
    }

    /// Name of the integrator.
    #[getter]
    fn integrator(&self) -> Result<String> {
        self.shared.read(|inner| Ok(inner.scene.world.integrator.to_string()))
    }

    /// All bodies in the order in which they were added, by number or by name.
    #[getter]
    fn bodies(&self, py: Python<'_>) -> Result<Bodies> {
        Bodies::new(py, self.shared.clone())
    }

    /// Returns the rigid body, or static geometry, of that name. An articulation or an unknown name
    /// raises ``UnknownNameError``.
    fn body(&self, py: Python<'_>, name: &str) -> Result<RigidBody> {
        bodies::rigid_body(py, &self.shared, name)
    }

    /// Returns the articulated body of that name. A rigid body or an unknown name raises
    /// ``UnknownNameError``.
    fn articulation(&self, py: Python<'_>, name: &str) -> Result<Articulation> {
        bodies::articulation(py, &self.shared, name)
    }

    /// All joints made by ``add_joint`` or ``[[loop_joint]]``, in the order in which they were added.
    #[getter]
    fn joints(&self, py: Python<'_>) -> Result<Vec<Joint>> {
        joints::all(&self.shared, py)
    }

    /// Returns the joint of that name, made by ``add_joint`` or ``[[loop_joint]]``.
    fn joint(&self, py: Python<'_>, name: &str) -> Result<Joint> {
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

    /// The contacts of the last step: a structured array with one row each.
    ///
    /// Fields: ``bodies`` (2,), indices in ``world.bodies``, -1 for other objects; ``parts`` (2,),
    /// for articulated bodies the indices of the links in their ``link_names``; ``point`` (3,), m;
    /// ``normal`` (3,), unit, from the second body to the first; ``depth``, m, negative while
    /// apart; ``velocity`` (3,) of the first relative to the second before the contact was solved,
    /// m/s; ``impulse`` (3,) on the first over the last sub-step, N·s; ``force`` (3,), N, without
    /// impacts. World axes.
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        contacts::array(py, self.shared.read(|inner| Ok(contacts::bytes(inner)))?)
    }

    /// Positions of all bodies, as ``body.position``, in the order of ``bodies``: a copy of shape
    /// (n, 3), m; for an articulation that of its first link. Setting it moves the rigid bodies whose
    /// rows change and keeps their velocities; rows of articulations must stay as they are.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        self.bulk(py, Bulk::Positions)
    }

    #[setter]
    fn set_positions(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_bulk(py, Bulk::Positions, value)
    }

    /// Orientations of all bodies, quaternions (x, y, z, w), shape (n, 4); otherwise as ``positions``.
    #[getter]
    fn orientations<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        self.bulk(py, Bulk::Orientations)
    }

    #[setter]
    fn set_orientations(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_bulk(py, Bulk::Orientations, value)
    }

    /// Velocities of the centers of mass of all bodies, for an articulation of the origin of its first
    /// link, shape (n, 3), m/s; otherwise as ``positions``.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        self.bulk(py, Bulk::Velocities)
    }

    #[setter]
    fn set_velocities(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_bulk(py, Bulk::Velocities, value)
    }

    /// Angular velocities of all bodies, world axes, shape (n, 3), rad/s; otherwise as ``positions``.
    #[getter]
    fn angular_velocities<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        self.bulk(py, Bulk::AngularVelocities)
    }

    #[setter]
    fn set_angular_velocities(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_bulk(py, Bulk::AngularVelocities, value)
    }

    /// The events of the last step, a list of ``Event`` tuples: ``kind``, ``a``, ``b``, ``parts``,
    /// ``impulse``, ``point``.
    ///
    /// kind: ``"contact_begin"``, ``"contact_persist"`` (in contact in the step before too),
    /// ``"contact_end"``, ``"sensor_begin"``, ``"sensor_end"``, ``"asleep"``, ``"awake"``, ``"joint_broken"``. a, b: handles
    /// of the bodies, the sensor first, or the joint; b is None for sleep and joints. parts: the touched links, as in
    /// ``contacts``. impulse: on ``a`` over the step, shape (3,), N·s; point: where the largest one
    /// acts, shape (3,), m; both zero for all but contacts that begin or persist. World axes.
    ///
    /// Two bodies are in contact in a step if their surfaces touch or an impulse acts between them, of
    /// at least ``event_impulse`` of the world. Of ``step(n)`` the last step counts. Pairs in contact
    /// are part of ``save``; a restored world has no events before its next step.
    #[getter]
    fn events(&self, py: Python<'_>) -> Result<Vec<Py<PyAny>>> {
        contacts::events(&self.shared, py)
    }

    /// Smallest impulse of a pair in a step with which it counts as in contact, N·s, at least 0:
    /// weaker contacts make no ``events``.
    #[getter]
    fn event_impulse(&self) -> Result<f64> {
        self.settings(|s| s.event_impulse)
    }

    #[setter]
    fn set_event_impulse(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.event_impulse = value)
    }

    /// Largest angle, rad, 0.01 to 1e6, by which forces of joints may turn a part back and forth in a
    /// sub-step. A frame in which a part turns further is taken in sub-steps that are short enough;
    /// chains of light links with a heavy end need it. 1 by default.
    #[getter]
    fn max_turn(&self) -> Result<f64> {
        self.settings(|s| s.max_turn)
    }

    #[setter]
    fn set_max_turn(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.max_turn = value)
    }

    /// Returns where rays enter bodies: a structured array with one row per ray.
    ///
    /// origins, directions: shape (3,) or (n, 3), m; directions of any length above 0. One of either
    /// serves all. max_distance: length of the rays, m, a number or shape (n,); None: unlimited.
    ///
    /// Fields: ``distance``, m, infinite for a miss; ``body``, its number in ``world.bodies``, -1 for
    /// a miss; ``part``, for an articulation the index of the link in its ``link_names``; ``face``,
    /// the index of a mesh's triangle, 0 to 5 for -x, +x, -y, +y, -z and +z of a box, 0 to 2 for side,
    /// -z end and +z end of a cylinder, else 0; ``normal`` (3,), unit, outward, world axes.
    ///
    /// A ray that starts inside a convex shape does not meet that shape; a mesh is hit on its outside
    /// only. group, mask, ignore: the query has a collision group (0 to 63) and a mask (the
    /// groups that it finds, as bits of an integer or a sequence; None for all) like a body, and does not find the ignored bodies (a handle, a name or a
    /// list of them). Sensors are not found. Runs on ``threads`` threads, which change no bit.
    #[pyo3(signature = (origins, directions, max_distance=None, *, group=0, mask=None, ignore=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn cast_rays<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        max_distance: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole_number)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
    ) -> Result<Bound<'py, PyAny>> {
        query::cast_rays(&self.shared, py, origins, directions, max_distance, &Selection { group, mask, ignore })
    }

    /// Returns the first body that a shape touches if it moves along a direction without rotation, or
    /// None.
    ///
    /// direction: shape (3,), of any length above 0, world axes. max_distance: how far it moves, m,
    /// finite. position, orientation: where it starts. Fields: ``distance``, m, 0 if it overlaps at
    /// the start; ``body``, ``part`` and the filter as in ``cast_rays``; ``point`` (3,), m;
    /// ``normal`` (3,), unit, from the body towards the shape.
    #[pyo3(signature = (shape, direction, max_distance, position=None, orientation=None, *, group=0, mask=None, ignore=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn cast_shape<'py>(
        &self,
        py: Python<'py>,
        shape: PyRef<'_, Shape>,
        direction: &Bound<'_, PyAny>,
        max_distance: f64,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole_number)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
    ) -> Result<Option<Bound<'py, PyAny>>> {
        let (at, selection) = ((position, orientation), Selection { group, mask, ignore });
        query::cast_shape(&self.shared, py, &shape, direction, max_distance, at, &selection)
    }

    /// Returns the bodies that overlap a shape at a pose: a structured array with the fields ``body``
    /// and ``part``, as in ``cast_rays``, and ``depth``, that of the deepest contact, m.
    ///
    /// position, orientation: as in ``add_rigid``. group, mask, ignore: as in ``cast_rays``.
    #[pyo3(signature = (shape, position=None, orientation=None, *, group=0, mask=None, ignore=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn overlaps<'py>(
        &self,
        py: Python<'py>,
        shape: PyRef<'_, Shape>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole_number)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
    ) -> Result<Bound<'py, PyAny>> {
        query::overlaps(&self.shared, py, &shape, (position, orientation), &Selection { group, mask, ignore })
    }

    /// Returns the closest points of two bodies, or of a shape at a pose and a body, the nearest one
    /// if ``b`` is None. None if a body has no shape or is disabled.
    ///
    /// a: a handle, a name or a shape. position, orientation: of a shape. Fields: ``distance``, m, the
    /// negative depth if they overlap; ``bodies`` (2,) and ``parts`` (2,) as in ``contacts``, -1 for a
    /// shape; ``points`` (2, 3), on the surfaces, world, m; ``normal`` (3,), unit, from the second to
    /// the first. group, mask, ignore: of a shape, as in ``cast_rays``.
    #[pyo3(signature = (a, b=None, *, position=None, orientation=None, group=0, mask=None, ignore=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn closest_points<'py>(
        &self,
        py: Python<'py>,
        a: &Bound<'_, PyAny>,
        b: Option<&Bound<'_, PyAny>>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole_number)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
    ) -> Result<Option<Bound<'py, PyAny>>> {
        query::closest_points(&self.shared, py, a, b, (position, orientation), &Selection { group, mask, ignore })
    }

    /// Returns the numbers in ``world.bodies`` of the bodies that contain a point: shape (k,).
    ///
    /// point: shape (3,), m. The surface belongs to a body. group, mask, ignore: as in ``cast_rays``.
    #[pyo3(signature = (point, *, group=0, mask=None, ignore=None))]
    fn contains<'py>(
        &self,
        py: Python<'py>,
        point: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = whole_number)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
    ) -> Result<Bound<'py, PyArray1<i64>>> {
        query::contains(&self.shared, py, point, &Selection { group, mask, ignore })
    }

    /// Returns how deep points lie in the bodies: one row for a point of shape (3,), a structured
    /// array for points of shape (n, 3), m.
    ///
    /// Fields: ``depth``, m, below the surface of the body in which the point is deepest, and for a
    /// point outside of all bodies minus the distance from the nearest one, minus infinity if there
    /// is none; ``body``, ``part`` and the filter as in ``cast_rays``; ``point`` (3,), the closest
    /// point of the surface, m; ``normal`` (3,), unit, outward.
    #[pyo3(signature = (points, *, group=0, mask=None, ignore=None))]
    fn point_depth<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = whole_number)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        ignore: Option<&Bound<'_, PyAny>>,
    ) -> Result<Bound<'py, PyAny>> {
        query::point_depth(&self.shared, py, points, &Selection { group, mask, ignore })
    }

    /// Returns the mechanical energy of everything that moves: ``kinetic``, ``potential`` (zero at
    /// the world's origin) and ``total``, J.
    fn energy(&self, py: Python<'_>) -> Result<Py<PyAny>> {
        let e = self.shared.read(|inner| Ok(inner.world.energy()))?;
        Ok(py.import("tumble._values")?.call_method1("Energy", (e.kinetic, e.potential, e.total()))?.unbind())
    }

    /// Returns the momentum of everything that moves: ``linear`` (3,), N·s, and ``angular`` (3,)
    /// about the world's origin, N·m·s. World axes.
    fn momentum(&self, py: Python<'_>) -> Result<Py<PyAny>> {
        let m = self.shared.read(|inner| Ok(inner.world.momentum()))?;
        Ok(py
            .import("tumble._values")?
            .call_method1("Momentum", (vector(py, &m.linear), vector(py, &m.angular)))?
            .unbind())
    }

    /// Statistics of the last step.
    #[getter]
    fn report(&self) -> Result<StepReport> {
        self.shared.read(|inner| Ok(StepReport::of(&inner.world)))
    }

    /// Writes the world as it stands to a scene file (``.toml``), with a folder ``NAME_files`` beside it for
    /// meshes and the exact state: ``World.load`` of the file goes on with the same bits. Once its text is
    /// edited, the text counts.
    ///
    /// Returns notes about things that are not in it, such as generalized forces and visuals that scenes do
    /// not have. Forces and behaviors written in Python, and all else that a scene cannot say, raise
    /// ``ValueError`` with their names, and nothing is written.
    fn save_scene(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> Result<Vec<String>> {
        let path = self::path(path)?;
        self.shared.work(py, |inner| save_scene::write(inner, &path))
    }

    /// Returns everything that the next step reads as bytes, for ``restore`` in a world of the same
    /// bodies. Shapes, masses, settings and drives are not included.
    fn save<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        let bytes = self.shared.read(|inner| Ok(snapshot::write(inner)))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Restores the bytes of ``save``. Invalid bytes, or those of another world, raise
    /// ``SnapshotError`` and change nothing.
    fn restore(&self, py: Python<'_>, snapshot: PyBackedBytes) -> Result<()> {
        self.shared.write(py, |inner| snapshot::read(inner, &snapshot))
    }

    /// Returns the world as bytes for ``simulate``: shapes, masses, settings, drives and its present
    /// state. Forces and behaviors in Python are no part of them: such a world raises
    /// ``InvalidValueError`` and is pickled instead.
    fn model<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.shared.read(pickling::model)?))
    }

    /// Returns an independent copy with the same state and the same future.
    ///
    /// Forces and behaviors are copied by their own ``fork``.
    fn fork(&self, py: Python<'_>) -> Result<World> {
        let inner = self.shared.read(|inner| Ok(inner.fork()))?;
        inner.take_raised()?;
        World::of(py, inner)
    }

    fn __copy__(&self, py: Python<'_>) -> Result<World> {
        self.fork(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> Result<World> {
        self.fork(py)
    }

    /// Pickles the whole world, with its forces and behaviors.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<Reduced<'py>> {
        let (bytes, state) = self.shared.read(|inner| Ok((pickling::write(inner)?, inner.pickled_extensions(py))))?;
        let unpickle = py.import("tumble._native")?.getattr("_unpickle_world")?;
        Ok((unpickle, (PyBytes::new(py, &bytes),), state))
    }

    /// Sets the forces and behaviors of an unpickled world.
    fn __setstate__(&self, py: Python<'_>, state: Extensions) -> Result<()> {
        self.shared.extend(py, |inner| inner.unpickle_extensions(py, state))
    }

    /// Runs many forks, each with its own controls, on all cores with the interpreter released.
    /// This world does not change.
    ///
    /// controls: shape (forks, steps, n): generalized forces of each step, N·m and N, for all
    /// ``articulations`` one after the other (by default all of the world, in order; without any, n
    /// is 0). states: initial states of the forks, shape (len(state),) or (forks, len(state)), by
    /// default the state of the world. every: interval in steps at which the state is kept.
    /// threads: largest number of threads (default: all cores). Returns the states, shape (forks,
    /// steps // every, len(state)): the same bits on any number of threads. A fork that fails
    /// raises ``StepError`` with its number; Ctrl-C stops all of them between two steps.
    #[pyo3(signature = (controls, *, articulations=None, states=None, every=1, threads=None))]
    fn rollout<'py>(
        &self,
        py: Python<'py>,
        controls: &Bound<'py, PyAny>,
        articulations: Option<Vec<Bound<'py, PyAny>>>,
        states: Option<&Bound<'py, PyAny>>,
        #[pyo3(from_py_with = whole_number)] every: usize,
        #[pyo3(from_py_with = whole_number)] threads: Option<usize>,
    ) -> Result<Bound<'py, PyArray3<f64>>> {
        let threads = crew::checked(threads)?;
        let asked = articulations
            .map(|all| all.iter().map(|one| Ok(own_place(&self.shared, one)?.id)).collect::<Result<Vec<_>>>())
            .transpose()?;
        let (controls, states) = (numbers(controls, "controls")?, states.map(|s| numbers(s, "states")).transpose()?);
        let (plan, fork) =
            self.shared.read(|inner| Ok((Plan::new(inner, asked, controls, states, every)?, inner.fork())))?;
        let shape = [plan.count, plan.frames / plan.every, fork.world.state().len()];
        let out = interruptible(py, |stop| plan.run(fork, threads, stop))?;
        Ok(PyArray1::from_vec(py, out).reshape(shape)?)
    }

    /// The flat state, shape (n,): a read-only view of the world's own memory until bodies are
    /// added or removed; then it keeps its last numbers.
    ///
    /// A rigid body has 13 numbers: position of the center of mass (``body.world_center_of_mass``),
    /// quaternion (x, y, z, w), linear and angular momentum. An articulated body has its ``q`` and
    /// ``qd``. Nothing is copied, here or by steps. While a view exists, a step keeps the
    /// interpreter, except for turns of other threads between two frames. Setting it writes every
    /// body's numbers.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.shared.write(py, |inner| {
            let Inner { world, shown, .. } = inner;
            Ok(shown.view(py, world)?)
        })
    }

    #[setter]
    fn set_state(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let Numbers { shape, data } = numbers(value, "state")?;
        self.shared.write(py, |inner| inner.write_state(&shape, &data))
    }

    /// Adds a body that moves.
    ///
    /// name: unique, of any length; without one, as in ``add_rigid(Sphere(0.1), mass=1)``, the world
    /// makes one from the number of objects added before, such as ``"body 3"``.
    /// mass: kg, or density: kg/m³; without both the density is 1000 kg/m³. position: of the shape's frame, for a mesh the
    /// file's, meters. orientation: unit quaternion (x, y, z, w). velocity, m/s, and
    /// angular_velocity, rad/s: world axes. restitution: 0 to 1. friction: at least 0. kinematic:
    /// moves at its prescribed velocity. contacts: contact mode, ``"surface"``, or ``"spheres"``
    /// for the spheres of its tree as in the thesis; a pair uses spheres if either body does. group, mask:
    /// collision group, 0 to 63, and the groups that it collides with, as bits of an integer or a
    /// sequence, None for all; two bodies collide if the group of each is in the mask of the other.
    /// sensor: no contacts; ``events`` reports the bodies that overlap it. inertia: about the center of
    /// mass, shape (3, 3) or (3,), kg·m², by default that of a uniform body; center_of_mass: in the
    /// frame of the shape, shape (3,), m; gravity_scale, locked: as the properties of a body. non_spinning: locks all
    /// rotations, so that forces and impulses act on the center of mass alone. intersect: an object of a subclass of
    /// ``tumble.Intersect``, the body's own intersection test; the shape then surrounds the true surface.
    #[pyo3(signature = (name=None, shape=None, mass=None, density=None, position=None, orientation=None, velocity=None, angular_velocity=None, restitution=0.0,
        friction=0.5, *, linear_damping=0.0, angular_damping=0.0, kinematic=false, collidable=true, contacts="surface", group=0, mask=None, sensor=false, inertia=None, center_of_mass=None, gravity_scale=1.0, locked=None, non_spinning=false, intersect=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_rigid(
        &self,
        py: Python<'_>,
        name: Option<&Bound<'_, PyAny>>,
        shape: Option<&Bound<'_, PyAny>>,
        mass: Option<f64>,
        density: Option<f64>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        angular_velocity: Option<&Bound<'_, PyAny>>,
        restitution: f64,
        friction: f64,
        linear_damping: f64,
        angular_damping: f64,
        kinematic: bool,
        collidable: bool,
        contacts: &str,
        #[pyo3(from_py_with = whole_number)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        sensor: bool,
        inertia: Option<&Bound<'_, PyAny>>,
        center_of_mass: Option<&Bound<'_, PyAny>>,
        gravity_scale: f64,
        locked: Option<Vec<String>>,
        non_spinning: bool,
        intersect: Option<&Bound<'_, PyAny>>,
    ) -> Result<RigidBody> {
        let (name, shape) = named_shape(name, shape)?;
        let mode = if kinematic { Mode::Kinematic } else { Mode::Dynamic };
        let motion = [
            vec3_or(velocity, "velocity", Vec3::zeros())?,
            vec3_or(angular_velocity, "angular_velocity", Vec3::zeros())?,
        ];
        let mut body = rigid(&name, &shape, mass, density, kinematic)?
            .with_pose(pose(position, orientation)? * shape.placement)
            .with_material(Material { restitution, friction, ..Material::default() });
        (body.linear_damping, body.angular_damping, body.contact_mode) =
            (linear_damping, angular_damping, meaning("contacts", contacts, ContactMode::NAMES)?);
        let mut body = body
            .with_groups(query::group(group)?, query::mask(mask)?)
            .with_sensor(sensor)
            .with_gravity_scale(gravity_scale)
            .with_locked(body::locked(&locked.unwrap_or_default())?);
        if non_spinning {
            body = tumble::behaviors::non_spinning(body);
        }
        if let Some(inertia) = inertia {
            if body.is_fixed() {
                return Err(Error::value("inertia: expected a mass or a density with it"));
            }
            body = body.with_inertia(body::inertia(inertia)?);
        }
        if let Some(center) = center_of_mass {
            body = body.with_center_of_mass(vec3(center, "center_of_mass")?);
        }
        let body = body.with_velocity(motion[0]).with_angular_velocity(motion[1]);
        add(&self.shared, py, body, mode, collidable, intersect)
    }

    /// Adds geometry that never moves. name, position, orientation, restitution, friction, contacts,
    /// group, mask, sensor, intersect: as in ``add_rigid``.
    #[pyo3(signature = (name=None, shape=None, position=None, orientation=None, restitution=0.0, friction=0.5, *, collidable=true, contacts="surface", group=0, mask=None, sensor=false, intersect=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_static(
        &self,
        py: Python<'_>,
        name: Option<&Bound<'_, PyAny>>,
        shape: Option<&Bound<'_, PyAny>>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        restitution: f64,
        friction: f64,
        collidable: bool,
        contacts: &str,
        #[pyo3(from_py_with = whole_number)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        sensor: bool,
        intersect: Option<&Bound<'_, PyAny>>,
    ) -> Result<RigidBody> {
        let (name, shape) = named_shape(name, shape)?;
        let pose = pose(position, orientation)? * shape.placement;
        let body = Rigid::fixed(shape.solid.clone())
            .with_name(name)
            .with_pose(pose)
            .with_material(Material { restitution, friction, ..Material::default() })
            .with_contact_mode(meaning("contacts", contacts, ContactMode::NAMES)?)
            .with_groups(query::group(group)?, query::mask(mask)?)
            .with_sensor(sensor);
        add(&self.shared, py, body, Mode::Static, collidable, intersect)
    }

    /// Adds an articulated body and returns its handle.
    ///
    /// articulation: a description, a builder, or the path of a URDF or a model of MuJoCo. base: pose
    /// of its base: a position (3,), or position and quaternion (7,), meters and (x, y, z, w). name: by default the
    /// description's. It starts with the ``q``, ``qd`` and ``tau`` of the description; the pose of
    /// a floating root is relative to the base.
    #[pyo3(signature = (articulation, base=None, *, name=None))]
    fn add_articulation(
        &self,
        py: Python<'_>,
        articulation: &Bound<'_, PyAny>,
        base: Option<&Bound<'_, PyAny>>,
        name: Option<&str>,
    ) -> Result<Articulation> {
        articulated(&self.shared, py, articulation, base, name)
    }

    /// Joins two bodies, or a body and the world, in their present poses, and returns the joint.
    ///
    /// kind: ``"fixed"``, ``"revolute"`` (turns about the axis), ``"prismatic"`` (slides along it),
    /// ``"spherical"``, ``"cylindrical"`` (both turns and slides), ``"universal"`` (turns about the axis,
    /// which is fixed to a, and second_axis, fixed to b), ``"planar"`` (slides across the axis and turns
    /// about it), ``"distance"``, ``"rope"`` (at most a length), ``"spring"``, ``"gear"``, ``"rack"``, ``"screw"`` or ``"pulley"``. a, b: handles or names;
    /// a link is ``"ARTICULATION/LINK"`` or ``(articulation, "LINK")``; None is the world.
    ///
    /// point: shape (3,), m, by default the center of mass of a, or the origin of a link; second_point:
    /// the end on b of a distance, rope or spring, by default likewise of b. axis: shape (3,), any length
    /// above 0. length: of a distance, rope or spring, m, by default the present one.
    ///
    /// teeth: of the gears a and b, negative for inner teeth; they turn about axis and second_axis, which
    /// do not move in the world. radius, m: a rack b moves along second_axis by it per radian of a
    /// about axis. pitch, m: displacement of a screw per turn. ground: the points of the world over which the rope of
    /// a pulley runs, shape (2, 3), m; ratio: the weight of b's side in its length.
    ///
    /// limits: (lower, upper) of the position, rad or m. drive: a dict with the arguments of
    /// ``Joint.set_drive``. stiffness, rest: a spring along the position, N·m/rad or N/m, and rad or m.
    /// cone: largest angle of a spherical joint between its axis on a and that on b, rad. max_velocity: largest speed
    /// of the position, rad/s or m/s. damping: N·m·s/rad or N·s/m. friction: N·m or N. breaking_force, N, and breaking_torque about the
    /// point, N·m: above one of them the joint breaks; ``events`` has a ``"joint_broken"`` then. The
    /// bodies still collide with each other: ``set_pair_material(a, b, collides=False)``. Points and axes
    /// are in the world.
    #[pyo3(signature = (kind, a, b=None, point=None, axis=None, limits=None, drive=None, breaking_force=None, *, name="", second_point=None,
        second_axis=None, length=None, stiffness=0.0, rest=None, damping=0.0, friction=0.0, breaking_torque=None, teeth=None, radius=None, pitch=None, ratio=1.0, ground=None,
        cone=None, max_velocity=None))]
    #[pyo3(
        text_signature = "($self, kind, a, b=None, point=None, axis=(0.0, 0.0, 1.0), limits=None, drive=None, breaking_force=None, *, name='', \
        second_point=None, second_axis=None, length=None, stiffness=0.0, rest=None, damping=0.0, friction=0.0, breaking_torque=None, teeth=None, radius=None, \
        pitch=None, ratio=1.0, ground=None, cone=None, max_velocity=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_joint(
        &self,
        py: Python<'_>,
        kind: &str,
        a: Option<&Bound<'_, PyAny>>,
        b: Option<&Bound<'_, PyAny>>,
        point: Option<&Bound<'_, PyAny>>,
        axis: Option<&Bound<'_, PyAny>>,
        limits: Option<&Bound<'_, PyAny>>,
        drive: Option<&Bound<'_, PyDict>>,
        breaking_force: Option<f64>,
        name: &str,
        second_point: Option<&Bound<'_, PyAny>>,
        second_axis: Option<&Bound<'_, PyAny>>,
        length: Option<f64>,
        stiffness: f64,
        rest: Option<f64>,
        damping: f64,
        friction: f64,
        breaking_torque: Option<f64>,
        teeth: Option<[i32; 2]>,
        radius: Option<f64>,
        pitch: Option<f64>,
        ratio: f64,
        ground: Option<&Bound<'_, PyAny>>,
        cone: Option<f64>,
        max_velocity: Option<f64>,
    ) -> Result<Joint> {
        let given = joints::Arguments {
            kind,
            sides: [a, b],
            points: [point, second_point],
            axes: [axis, second_axis],
            limits,
            drive,
            breaking: [breaking_force, breaking_torque],
            name,
            length,
            stiffness,
            rest,
            damping,
            friction,
            teeth,
            radius,
            pitch,
            ratio,
            ground,
            cone,
            max_velocity,
        };
        joints::add(&self.shared, py, &given)
    }

    /// Adds a measuring sensor, read after every step: ``world.sensors[name]``.
    ///
    /// kind: ``"accelerometer"``, ``"gyroscope"``, ``"velocimeter"`` (in the axes of the site), ``"force"`` and ``"torque"`` (of the joint
    /// that moves the link, on the link; of a loop joint, on its side a), ``"touch"`` (normal force on the link or body), ``"range_finder"``
    /// (along z of the site; -1 if nothing is there), ``"position"``, ``"orientation"``, ``"linear_velocity"``, ``"angular_velocity"``,
    /// ``"linear_acceleration"``, ``"angular_acceleration"``, ``"joint_position"``, ``"joint_velocity"`` or ``"drive_force"``. Accelerations
    /// and forces are means over the step.
    ///
    /// on: a body, a link (``"ARTICULATION/LINK"`` or ``(articulation, "LINK")``) or a joint, as handle or name; None is the world.
    /// position: shape (3,), m, and orientation, (x, y, z, w): the site in the frame of the body or link. relative_to: a body or link
    /// against whose frame positions, orientations and velocities are read. volume: a shape at the site; touch outside does not
    /// count. cutoff: largest absolute value of a reading.
    ///
    /// deviation: standard deviation of white noise. bias_walk: that of the change of a bias in a second. quantization: distance
    /// of the values that a reading can have. delay: steps by which it is late. seed: start of the noise.
    ///
    /// ``"depth"`` and ``"segmentation"`` are cameras that look along z of the site, with x to the right and y down in the image.
    /// resolution: pixels in a row and rows, by default (64, 48). vertical_fov: rad, by default π/4. Their readings are made when
    /// they are read: distances along z, m, shape (rows, columns), -1 where nothing is; and what a pixel shows, shape (rows,
    /// columns, 2): the index in ``world.bodies`` and that of the link in its ``link_names``, -1 for nothing and other objects.
    #[pyo3(signature = (kind, on=None, *, name="", position=None, orientation=None, relative_to=None, volume=None, cutoff=None, deviation=0.0,
        bias_walk=0.0, quantization=0.0, delay=0, seed=0, resolution=None, vertical_fov=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_sensor(
        &self,
        py: Python<'_>,
        kind: &str,
        on: Option<&Bound<'_, PyAny>>,
        name: &str,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        relative_to: Option<&Bound<'_, PyAny>>,
        volume: Option<&Bound<'_, Shape>>,
        cutoff: Option<f64>,
        deviation: f64,
        bias_walk: f64,
        quantization: f64,
        delay: u32,
        seed: u64,
        resolution: Option<[u32; 2]>,
        vertical_fov: Option<f64>,
    ) -> Result<Sensor> {
        let noise = SensorNoise { deviation, bias_walk, quantization, delay, seed };
        let given = sensors::Arguments {
            kind,
            on,
            name,
            position,
            orientation,
            relative_to,
            volume,
            cutoff,
            noise,
            resolution,
            vertical_fov,
        };
        sensors::add(&self.shared, py, &given)
    }

    /// The readings of all measuring sensors by name, after the last step.
    #[getter]
    fn sensors(&self, py: Python<'_>) -> Result<Sensors> {
        Sensors::new(py, &self.shared)
    }

    /// Removes an object, given as a handle or by name, or a force, a field or a behavior by name. Handles
    /// of a removed object raise ``RemovedError``. Joints of a removed body stay, without effect.
    fn remove(&self, py: Python<'_>, body: &Bound<'_, PyAny>) -> Result<()> {
        if let Ok(name) = body.extract::<String>()
            && self.shared.extend(py, |inner| inner.remove_extension(&name))?
        {
            return Ok(());
        }
        let found = joints::place_of(&self.shared, body)?;
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
    fn add_force(&self, py: Python<'_>, name: &str, force: &Bound<'_, PyAny>) -> Result<()> {
        py.import("tumble._extension")?.call_method1("check_force", (force,))?;
        self.shared.extend(py, |inner| inner.add_force(name, force))
    }

    /// Adds a custom behavior, an object of a subclass of ``tumble.Behavior``, to bodies given by
    /// name or as handles.
    fn add_behavior(
        &self,
        py: Python<'_>,
        name: &str,
        behavior: &Bound<'_, PyAny>,
        bodies: &Bound<'_, PyAny>,
    ) -> Result<()> {
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

    /// Renders the world: sRGB and alpha, shape (height, width, 4), uint8, rows from the top. No
    /// window is needed.
    ///
    /// width, height: pixels, by default 640 x 480. The view is one of: camera, ``tumble.Camera``
    /// or ``(eye, target)`` in meters; facet, ``"cube4:front"``: a facet of a cave, given by path
    /// or name, at the size in the cave file; cave: all its facets unfolded into at most width x
    /// height; else the scene's camera, or one that shows everything. overlays: names of ``tumble
    /// run --debug-draw``, such as ``"contacts,forces"``. Without a graphics adapter it raises
    /// ``PictureError``.
    #[pyo3(signature = (width=None, height=None, *, camera=None, facet=None, cave=None, overlays=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn render<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = whole_number)] width: Option<u32>,
        #[pyo3(from_py_with = whole_number)] height: Option<u32>,
        camera: Option<&Bound<'py, PyAny>>,
        facet: Option<&str>,
        cave: Option<&str>,
        overlays: Option<&str>,
    ) -> Result<Bound<'py, PyArray3<u8>>> {
        Shot::new([width, height], camera, facet, cave, overlays)?.take(py, &self.shared)
    }

    /// Opens a window on the world and returns it: ``tumble.Window``. A process of its own draws the world as
    /// it stands, 60 times a second, while the program steps and changes it. The window closes with the
    /// program.
    ///
    /// block: step the world in real time until the window is closed. title, width, height (pixels): of the
    /// window. Without a desktop or a graphics adapter, ``block=True`` and later calls of ``is_open`` raise
    /// ``PictureError``.
    #[pyo3(signature = (*, block=false, title=None, width=1280, height=720))]
    fn view(
        slf: &Bound<'_, Self>,
        block: bool,
        title: Option<&str>,
        #[pyo3(from_py_with = whole_number)] width: u32,
        #[pyo3(from_py_with = whole_number)] height: u32,
    ) -> Result<Py<PyAny>> {
        let options = PyDict::new(slf.py());
        options.set_item("block", block)?;
        options.set_item("title", title)?;
        options.set_item("width", width)?;
        options.set_item("height", height)?;
        Ok(slf.py().import("tumble._window")?.call_method("view", (slf,), Some(&options))?.unbind())
    }

    /// Returns a PNG for notebooks, or None without a graphics adapter.
    fn _repr_png_(slf: &Bound<'_, Self>) -> Result<Py<PyAny>> {
        Ok(slf.py().import("tumble._pictures")?.call_method1("repr_png", (slf,))?.unbind())
    }

    /// Steps a fork for ``duration`` seconds and plots its energy over time. The world does not
    /// change. Requires matplotlib, the extra ``plot``.
    ///
    /// ax: the axes to plot on, by default new ones. Returns the axes.
    #[pyo3(signature = (duration=5.0, *, ax=None))]
    fn plot_energy(slf: &Bound<'_, Self>, duration: f64, ax: Option<&Bound<'_, PyAny>>) -> Result<Py<PyAny>> {
        Ok(slf.py().import("tumble._plots")?.call_method1("energy", (slf, duration, ax))?.unbind())
    }

    /// Steps a fork for ``duration`` seconds and plots the paths of bodies (default: all dynamic
    /// bodies) as seen along an axis, ``"x"``, ``"y"`` or ``"z"``.
    ///
    /// Otherwise as ``plot_energy``.
    #[pyo3(signature = (duration=5.0, *, bodies=None, along="y", ax=None))]
    fn plot_paths(
        slf: &Bound<'_, Self>,
        duration: f64,
        bodies: Option<&Bound<'_, PyAny>>,
        along: &str,
        ax: Option<&Bound<'_, PyAny>>,
    ) -> Result<Py<PyAny>> {
        Ok(slf.py().import("tumble._plots")?.call_method1("paths", (slf, duration, bodies, along, ax))?.unbind())
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.anchor)
    }

    fn __repr__(&self) -> Result<String> {
        self.shared.read(|inner| {
            let (stepper, solver) = (inner.world.stepper_name(), inner.world.solver_name());
            Ok(format!(
                "<tumble.World {} bodies, t = {} s, {stepper}, {solver}>",
                body_ids(&inner.world).len(),
                inner.world.time()
            ))
        })
    }
}
