//! Robots whose links are covered by spheres, for motion planners.

use crate::arrays::convert::path;
use crate::arrays::whole;
use crate::choices::{BUILDERS, MISSING_MESHES, meaning};
use crate::errors::{Error, Result};
use crate::interrupt::abandonable;
use crate::keywords::{self, Unknown};
use crate::objects::spheretree::settings;
use crate::pool;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::PathBuf;
use tumble::collide::{TreeCache, TreeSettings};
use tumble::scene::urdf::{
    JointPositions, LinkSpheres, PerLink, SphereOptions, SphereRobot as Robot, UrdfOptions, spherize,
};

/// Default number of spheres of a link, at most: without and with `max_error`.
const SPHERES: [u32; 2] = [32, 10_000];
/// Default of `max_error`.
const MAX_ERROR: f64 = 1e-3;

/// A robot whose links are covered by spheres, as motion planners use them: that of
/// ``tumble spheretree --urdf``.
///
/// Made by ``SphereRobot.from_urdf``.
#[pyclass(frozen, module = "tumble")]
pub struct SphereRobot {
    robot: Robot,
}

impl SphereRobot {
    fn name_of(&self, link: usize) -> &str {
        &self.robot.links[link].name
    }
}

/// Returns values by link; `common` are those of the others.
fn per_link<T>(common: T, links: Option<BTreeMap<String, T>>) -> PerLink<T> {
    PerLink { common, links: links.unwrap_or_default() }
}

/// Returns the values of an option that may be left out.
fn some(links: BTreeMap<String, f64>) -> BTreeMap<String, Option<f64>> {
    links.into_iter().map(|(link, value)| (link, Some(value))).collect()
}

#[pymethods]
impl SphereRobot {
    /// Reads a URDF and covers the outer surface of the collision shapes of each link by spheres.
    ///
    /// spheres: largest number of spheres of a link, 1 to 10,000 (default 32, with max_error 10,000);
    /// spheres_of: that of links by name. coverage: share of the outer surface of a link, by area, that is
    /// covered at least, above 0 and at most 1 (default 1, with weight no bound); coverage_of: that of links by
    /// name. weight: 0 (nothing outside) to 1 (full coverage): minimizes ``weight`` times the share of the surface
    /// that is not covered plus ``1 - weight`` times the volume outside over that of the link (default: the set that
    /// reaches the least far outside); weight_of: that of links by name. max_error: spheres that
    /// reach at most this far outside are not divided, as a fraction of the link's diagonal (default 0.001).
    /// packages: folders by name, for ``package://NAME/…``. missing_meshes: ``"error"`` or ``"skip"``. method:
    /// the sphere trees that are tried, as in ``SphereTree.build``. cache: whether trees are kept on disk.
    ///
    /// Names of links that do not exist, numbers out of range, and files that cannot be read raise
    /// ``InvalidValueError``, ``UnreadableFileError`` or ``SceneError`` with the reason. The interpreter is released meanwhile;
    /// Ctrl-C ends the work.
    #[staticmethod]
    #[pyo3(signature = (path, *, spheres=None, spheres_of=None, coverage=None, coverage_of=None, weight=None, weight_of=None, max_error=None, packages=None, missing_meshes="error", method="medial", cache=true, **unknown), text_signature = "(path, *, spheres=None, spheres_of=None, coverage=None, coverage_of=None, weight=None, weight_of=None, max_error=None, packages=None, missing_meshes='error', method='medial', cache=True)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn from_urdf(
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = whole::spheres)] spheres: Option<u32>,
        #[pyo3(from_py_with = whole::spheres_of)] spheres_of: Option<BTreeMap<String, usize>>,
        coverage: Option<f64>,
        coverage_of: Option<BTreeMap<String, f64>>,
        weight: Option<f64>,
        weight_of: Option<BTreeMap<String, f64>>,
        max_error: Option<f64>,
        packages: Option<BTreeMap<String, PathBuf>>,
        missing_meshes: &str,
        method: &str,
        cache: bool,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<SphereRobot> {
        keywords::check(unknown, "SphereRobot.from_urdf")?;
        let file = self::path(path)?;
        let most = spheres.unwrap_or(SPHERES[usize::from(max_error.is_some())]) as usize;
        let error = max_error.unwrap_or(MAX_ERROR);
        if !(error > 0.0 && error <= 1.0) {
            return Err(Error::value(format!("max_error is {error}; expected a fraction above 0 and at most 1")));
        }
        let tree = settings(meaning("method", method, BUILDERS)?, None, None, None);
        let options = SphereOptions {
            most: per_link(most, spheres_of),
            coverage: per_link(coverage, coverage_of.map(some)),
            weight: per_link(weight, weight_of.map(some)),
            error,
            tree: TreeSettings { error: tree.error.min(error), even: false, ..tree },
            cache: if cache { TreeCache::of_environment() } else { TreeCache::off() },
            urdf: UrdfOptions {
                packages: packages.unwrap_or_default(),
                missing_meshes: meaning("missing_meshes", missing_meshes, MISSING_MESHES)?,
                ..UrdfOptions::default()
            },
        };
        abandonable(py, move |stop| pool::run(|| Ok(SphereRobot { robot: spherize(&file, &options, stop)? })))
    }

    /// Name of the robot.
    #[getter]
    fn name(&self) -> &str {
        &self.robot.name
    }

    /// The URDF with spheres as collision geometry, a text. All else in it is that of the file.
    #[getter]
    fn urdf(&self) -> &str {
        &self.robot.text
    }

    /// Notes about the file and its meshes.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.robot.notes.clone()
    }

    /// The spheres by the name of the link, in the order of the file: each a ``LinkSpheres``.
    #[getter]
    fn links<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyDict>> {
        let class = py.import("tumble._values")?.getattr("LinkSpheres")?;
        let links = PyDict::new(py);
        for link in &self.robot.links {
            let LinkSpheres { name, shapes, spheres, outward, coverage, .. } = link;
            let sampled = (link.mean_outward, link.volume, link.volume_outside);
            let centers: Vec<f64> = spheres.iter().flat_map(|(c, _)| [c.x, c.y, c.z]).collect();
            let centers: Bound<'py, PyArray2<f64>> = PyArray1::from_vec(py, centers).reshape([spheres.len(), 3])?;
            let radii = PyArray1::from_iter(py, spheres.iter().map(|(_, radius)| *radius));
            let outward = PyArray1::from_slice(py, outward);
            links.set_item(
                name,
                class.call1((centers, radii, outward, *coverage, *shapes, sampled.0, sampled.1, sampled.2))?,
            )?;
        }
        Ok(links)
    }

    /// Returns the pairs of links whose spheres overlap: two names, the depth in meters, and whether the
    /// links are adjacent.
    ///
    /// positions: positions of joints by name, rad or m; others are at 0, or at the limit next to it. A name
    /// that is no joint with one degree of freedom raises ``InvalidValueError``.
    #[pyo3(signature = (positions=None, **unknown), text_signature = "($self, positions=None)")]
    fn overlaps(
        &self,
        py: Python<'_>,
        positions: Option<JointPositions>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Vec<(String, String, f64, bool)>> {
        keywords::check(unknown, "SphereRobot.overlaps")?;
        let found = py.detach(|| self.robot.overlaps(&positions.unwrap_or_default())).map_err(Error::value)?;
        let name = |link: usize| self.name_of(link).to_owned();
        Ok(found.iter().map(|o| (name(o.links[0]), name(o.links[1]), o.depth, o.adjacent)).collect())
    }

    /// Returns the pairs of links that a planner need not compare: adjacent ones, those that overlap at one
    /// of ``poses``, which are taken to be free (without any at the zero pose), and those that overlap at all
    /// of ``sample_poses`` poses, which are evenly distributed within the limits.
    ///
    /// poses: dicts as in ``overlaps``, at most 1,000,000 with the samples.
    #[pyo3(signature = (poses=None, sample_poses=0, **unknown), text_signature = "($self, poses=None, sample_poses=0)")]
    fn ignored_pairs(
        &self,
        py: Python<'_>,
        poses: Option<Vec<JointPositions>>,
        #[pyo3(from_py_with = whole::sample_poses)] sample_poses: usize,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Vec<(String, String)>> {
        keywords::check(unknown, "SphereRobot.ignored_pairs")?;
        let free = poses.unwrap_or_default();
        let found = py.detach(|| self.robot.ignored_pairs(&free, &self.robot.sample_poses(sample_poses, 0)));
        let name = |link: usize| self.name_of(link).to_owned();
        Ok(found.map_err(Error::value)?.iter().map(|[a, b]| (name(*a), name(*b))).collect())
    }

    fn __repr__(&self) -> String {
        let count: usize = self.robot.links.iter().map(|link| link.spheres.len()).sum();
        format!("<tumble.SphereRobot of {}: {} links, {count} spheres>", self.robot.name, self.robot.links.len())
    }
}
