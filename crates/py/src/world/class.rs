//! The class `World`: how one is made, and its steps. The other methods are in a module for each topic.

mod adding;
mod arrays;
mod objects;
mod pictures;
mod queries;
mod saving;
mod settings;

use crate::arrays::convert::{path, vec3_or};
use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::io::slow;
use crate::keywords::{self, Unknown};
use crate::objects::place::body_ids;
use crate::pool;
use crate::world::gc::{Anchor, anchor};
use crate::world::inner::Inner;
use crate::world::load::{Choices, build};
use crate::world::pairs::combine;
use crate::world::shared::Shared;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use std::sync::Arc;
use std::time::Instant;
use tumble::collide::Vec3;
use tumble::dynamics::Settings;
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
/// drift_tolerance: meters, None: 1e-4, or contact_tolerance if that is larger. recovery_speed: at which overlap is
/// corrected, m/s. projection_sweeps: largest number of sweeps of that correction. stabilize_positions: whether
/// positions of joints are corrected. solver_tolerance: a sweep that changes no velocity by more than this ends a
/// solve, m/s. max_relaxations: largest number of block relaxations of a step in sweeps beyond the first 25.
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

#[pymethods]
impl World {
    #[new]
    #[pyo3(
        text_signature = "(gravity=(0.0, 0.0, -9.81), dt=0.004166666666666667, stepper='time_stepping', integrator='verlet', \
        solver='gauss_seidel', *, substeps=1, iterations=200, contact_tolerance=1e-7, integrator_tolerance=1e-10, sleep_after=None, sleep_within=1e-5, \
        combine_restitution='max', combine_friction='geometric_mean', threads=1, budget=None, event_impulse=0.0, max_turn=1.0, \
        drift_tolerance=None, recovery_speed=3.0, projection_sweeps=15, stabilize_positions=True, solver_tolerance=1e-9, max_relaxations=20000)"
    )]
    #[pyo3(signature = (gravity=None, dt=0.004166666666666667, stepper="time_stepping", integrator="verlet", solver="gauss_seidel", *, substeps=1, iterations=200,
        contact_tolerance=1e-7, integrator_tolerance=1e-10, sleep_after=None, sleep_within=1e-5, combine_restitution="max", combine_friction="geometric_mean", threads=1, budget=None, event_impulse=0.0, max_turn=1.0,
        drift_tolerance=None, recovery_speed=3.0, projection_sweeps=15, stabilize_positions=true, solver_tolerance=1e-9, max_relaxations=20000, **unknown))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn new(
        py: Python<'_>,
        gravity: Option<&Bound<'_, PyAny>>,
        dt: f64,
        stepper: &str,
        integrator: &str,
        solver: &str,
        #[pyo3(from_py_with = whole::substeps)] substeps: u32,
        #[pyo3(from_py_with = whole::iterations)] iterations: u32,
        contact_tolerance: f64,
        integrator_tolerance: f64,
        sleep_after: Option<f64>,
        sleep_within: f64,
        combine_restitution: &str,
        combine_friction: &str,
        #[pyo3(from_py_with = whole::threads)] threads: u32,
        #[pyo3(from_py_with = whole::budget)] budget: Option<u32>,
        event_impulse: f64,
        max_turn: f64,
        drift_tolerance: Option<f64>,
        recovery_speed: f64,
        #[pyo3(from_py_with = whole::projection_sweeps)] projection_sweeps: u32,
        stabilize_positions: bool,
        solver_tolerance: f64,
        #[pyo3(from_py_with = whole::max_relaxations)] max_relaxations: u32,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<World> {
        keywords::check(unknown, "World")?;
        let mut scene = SceneFile::parse("", "World")?;
        let world = &mut scene.world;
        world.gravity_m_per_s2 = vec3_or(gravity, "gravity", Vec3::from(world.gravity_m_per_s2))?.into();
        let (stepper, integrator, solver) = (Some(stepper), Some(integrator), Some(solver));
        Choices { stepper, integrator, solver, dt: Some(dt), threads: Some(threads), budget }.apply(world)?;
        (world.substeps, world.iterations) = (substeps, iterations);
        (world.contact_tolerance_m, world.integrator_tolerance) = (contact_tolerance, integrator_tolerance);
        (world.sleep_after_s, world.sleep_within_m) = (sleep_after, sleep_within);
        (world.event_impulse_n_s, world.max_turn_rad) = (event_impulse, max_turn);
        (world.drift_tolerance_m, world.recovery_speed_m_per_s) = (drift_tolerance, recovery_speed);
        (world.projection_sweeps, world.stabilize_positions) = (projection_sweeps, stabilize_positions);
        (world.solver_tolerance_m_per_s, world.max_relaxations) = (solver_tolerance, max_relaxations);
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
    #[pyo3(signature = (path_or_name, *, dt=None, stepper=None, integrator=None, solver=None, threads=None, budget=None, keyframe=None, **unknown), text_signature = "(path_or_name, *, dt=None, stepper=None, integrator=None, solver=None, threads=None, budget=None, keyframe=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn load(
        py: Python<'_>,
        path_or_name: &Bound<'_, PyAny>,
        dt: Option<f64>,
        stepper: Option<&str>,
        integrator: Option<&str>,
        solver: Option<&str>,
        #[pyo3(from_py_with = whole::threads)] threads: Option<u32>,
        #[pyo3(from_py_with = whole::budget)] budget: Option<u32>,
        keyframe: Option<String>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<World> {
        keywords::check(unknown, "World.load")?;
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
    #[pyo3(signature = (text, **unknown), text_signature = "(text)")]
    fn parse(py: Python<'_>, text: &str, unknown: Option<Unknown<'_, '_>>) -> Result<World> {
        keywords::check(unknown, "World.parse")?;
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
    #[pyo3(signature = (n=1, **unknown), text_signature = "($self, n=1)")]
    fn step(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = whole::n)] n: i64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "World.step")?;
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
