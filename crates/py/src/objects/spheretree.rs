//! Sphere trees: built, measured, written and read. The library computes the trees and all their
//! metrics.

use crate::arrays::convert::path;
use crate::arrays::whole;
use crate::choices::{BUILDERS, meaning, word};
use crate::errors::{Error, Result, caught};
use crate::interrupt::abandonable;
use crate::keywords::{self, Unknown};
use crate::objects::shapes::triangles;
use crate::pool;
use crate::world::pickling::pickled;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use std::path::PathBuf;
use std::sync::OnceLock;
use tumble::collide::{
    Builder, CachedTree, LevelQuality, LevelSphere, MeshId, QualitySettings, SphereTree as Tree, TreeCache, TreeFile,
    TreeSettings, TriMesh,
};
use tumble::dynamics::archive::open;

/// Nested spheres around a closed mesh. Every sphere contains those of its children, and the
/// spheres of each level cover the surface.
///
/// Made by ``SphereTree.build`` or ``SphereTree.load``. All numbers are in the axes of the given
/// mesh, meters.
#[pyclass(frozen, module = "tumble")]
pub struct SphereTree {
    file: TreeFile,
    levels: Vec<Vec<LevelSphere>>,
    /// The mesh that it was built around; none for a loaded tree.
    mesh: Option<TriMesh>,
    quality: OnceLock<Vec<LevelQuality>>,
}

/// Start of a pickled tree.
const PICKLED: &[u8; 8] = b"tumbleT1";

/// Unpickles a sphere tree.
#[pyfunction]
pub fn _unpickle_tree(py: Python<'_>, data: PyBackedBytes) -> Result<SphereTree> {
    py.detach(|| {
        let (json, mesh): (String, Option<TriMesh>) = open(PICKLED, &data)?;
        let file = caught(|| TreeFile::from_json(&json).map_err(|why| Error::value(why.to_string())))?;
        Ok(SphereTree::of(file, mesh))
    })
}

impl SphereTree {
    fn of(file: TreeFile, mesh: Option<TriMesh>) -> SphereTree {
        let quality = OnceLock::new();
        if !file.quality.is_empty() {
            _ = quality.set(file.quality.clone());
        }
        SphereTree { levels: file.tree.level_lists(), file, mesh, quality }
    }

    /// Returns the metrics of the levels, measured on first use.
    fn measured(&self, py: Python<'_>) -> Result<&[LevelQuality]> {
        if self.quality.get().is_none() {
            let Some(mesh) = &self.mesh else {
                return Err(Error::value(
                    "the file of this tree has no metrics, and without the mesh they cannot be measured; build the tree again",
                ));
            };
            let quality = py.detach(|| pool::run(|| Ok(self.file.tree.quality(mesh, &QualitySettings::default()))))?;
            _ = self.quality.set(quality); // concurrent callers measure the same values
        }
        Ok(self.quality.get().map_or(&[], Vec::as_slice))
    }

    /// Returns the tree with its metrics, as it is written and printed.
    fn whole(&self, py: Python<'_>) -> Result<TreeFile> {
        Ok(TreeFile { quality: self.measured(py)?.to_vec(), ..self.file.clone() })
    }
}

/// Returns the default settings of the method with the given overrides.
pub fn settings(builder: Builder, branching: Option<u32>, depth: Option<u32>, max_error: Option<f64>) -> TreeSettings {
    let usual = if builder == Builder::Octree {
        TreeSettings::octree()
    } else {
        TreeSettings { builder, ..TreeSettings::default() }
    };
    TreeSettings {
        branch: branching.unwrap_or(usual.branch),
        depth: depth.unwrap_or(usual.depth),
        error: max_error.unwrap_or(usual.error),
        ..usual
    }
}

/// Returns the name of the mesh in the tree's file.
fn name_of(vertices: &Bound<'_, PyAny>, faces: Option<&Bound<'_, PyAny>>) -> String {
    let file = faces.is_none().then(|| path(vertices).ok()).flatten();
    file.as_deref()
        .and_then(|file| file.file_name())
        .map_or_else(|| "mesh".into(), |name| name.to_string_lossy().into_owned())
}

#[pymethods]
impl SphereTree {
    /// Builds a tree around a closed mesh, and checks that it covers the surface and is nested.
    ///
    /// vertices: shape (n, 3), meters, and faces: shape (m, 3), indices from 0, counter-clockwise
    /// seen from outside; or the path of an OBJ, STL or COLLADA file; or an object with
    /// ``vertices`` and ``faces``, such as a trimesh. method: ``"medial"`` (adaptive medial axis,
    /// the tightest), ``"hubbard"``, ``"grid"`` or ``"octree"``. branching: largest number of
    /// children of a sphere, 2 to 64 (default 8). depth: largest number of levels below the root, 1
    /// to 9 (default 3, for the octree 7). max_error: spheres that reach less than this outside are
    /// not divided, as a fraction of the mesh's diagonal, 1e-4 to 1 (default 1e-4, for the octree
    /// 0.01). cache: whether to keep the tree on disk and read it from there next time.
    ///
    /// A mesh that is open or encloses nothing, and settings out of range, raise
    /// ``InvalidValueError``. The interpreter is released meanwhile; Ctrl-C ends the build.
    #[staticmethod]
    #[pyo3(signature = (vertices, faces=None, *, method="medial", branching=None, depth=None, max_error=None, cache=true, **unknown), text_signature = "(vertices, faces=None, *, method='medial', branching=None, depth=None, max_error=None, cache=True)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn build(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
        method: &str,
        #[pyo3(from_py_with = whole::branching)] branching: Option<u32>,
        #[pyo3(from_py_with = whole::depth)] depth: Option<u32>,
        max_error: Option<f64>,
        cache: bool,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<SphereTree> {
        keywords::check(unknown, "SphereTree.build")?;
        let settings = settings(meaning("method", method, BUILDERS)?, branching, depth, max_error);
        let (name, mut mesh) = (name_of(vertices, faces), triangles(py, vertices, faces)?);
        let cache = if cache { TreeCache::of_environment() } else { TreeCache::off() };
        abandonable(py, move |stop| {
            pool::run(|| {
                mesh.check_closed()?;
                let CachedTree { tree, stages, .. } = Tree::build_cached_with_progress(&mesh, &settings, &cache, stop)?;
                let file = TreeFile { name, mesh: MeshId::of(&mesh), settings, stages, quality: Vec::new(), tree };
                Ok(SphereTree::of(file, Some(mesh)))
            })
        })
    }

    /// Reads a tree that ``save`` or ``tumble spheretree --output`` wrote. Any other file raises
    /// ``InvalidValueError`` with the reason.
    #[staticmethod]
    #[pyo3(signature = (path, **unknown), text_signature = "(path)")]
    fn load(py: Python<'_>, path: &Bound<'_, PyAny>, unknown: Option<Unknown<'_, '_>>) -> Result<SphereTree> {
        keywords::check(unknown, "SphereTree.load")?;
        let path = self::path(path)?;
        py.detach(|| {
            let text = std::fs::read_to_string(&path)
                .map_err(|source| Error::File { file: path.display().to_string(), source })?;
            let file = caught(|| {
                TreeFile::from_json(&text).map_err(|why| Error::value(format!("{}: {why}", path.display())))
            })?;
            Ok(SphereTree::of(file, None))
        })
    }

    /// Writes the tree and its metrics as JSON: the file of ``tumble spheretree --output``.
    #[pyo3(signature = (path, **unknown), text_signature = "($self, path)")]
    fn save(&self, py: Python<'_>, path: &Bound<'_, PyAny>, unknown: Option<Unknown<'_, '_>>) -> Result<()> {
        keywords::check(unknown, "SphereTree.save")?;
        let (path, file): (PathBuf, TreeFile) = (self::path(path)?, self.whole(py)?);
        py.detach(|| {
            std::fs::write(&path, file.to_json())
                .map_err(|source| Error::File { file: path.display().to_string(), source })
        })
    }

    /// Returns the JSON text that ``save`` writes.
    fn to_json(&self, py: Python<'_>) -> Result<String> {
        Ok(self.whole(py)?.to_json())
    }

    /// Name of the mesh: that of its file, or ``"mesh"``.
    #[getter]
    fn name(&self) -> &str {
        &self.file.name
    }

    /// The method that built it.
    #[getter]
    fn method(&self) -> &'static str {
        word(self.file.settings.builder, BUILDERS)
    }

    /// Largest allowed number of children of a sphere.
    #[getter]
    fn branching(&self) -> u32 {
        self.file.settings.branch
    }

    /// Largest allowed number of levels below the root.
    #[getter]
    fn depth(&self) -> u32 {
        self.file.settings.depth
    }

    /// The levels, the root's first: each a ``SphereLevel`` of ``centers``, shape (n, 3), and
    /// ``radii``, shape (n,), meters. Every level covers the solid by itself: a leaf above the last
    /// level is repeated in the levels below.
    #[getter]
    fn levels<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyTuple>> {
        let class = py.import("tumble._values")?.getattr("SphereLevel")?;
        let level = |balls: &Vec<LevelSphere>| -> Result<Bound<'py, PyAny>> {
            let centers: Vec<f64> = balls.iter().flat_map(|b| [b.center.x, b.center.y, b.center.z]).collect();
            let centers: Bound<'py, PyArray2<f64>> = PyArray1::from_vec(py, centers).reshape([balls.len(), 3])?;
            let radii = PyArray1::from_iter(py, balls.iter().map(|b| b.radius));
            Ok(class.call1((centers, radii))?)
        };
        Ok(PyTuple::new(py, self.levels.iter().map(level).collect::<Result<Vec<_>>>()?)?)
    }

    /// For each level, the index of each sphere's parent in the level above, shape (n,); -1 for the
    /// root.
    #[getter]
    fn parents<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyTuple>> {
        let parents =
            |balls: &Vec<LevelSphere>| PyArray1::from_iter(py, balls.iter().map(|b| b.parent.map_or(-1, |p| p as i64)));
        Ok(PyTuple::new(py, self.levels.iter().map(parents))?)
    }

    /// Upper bound of the distance by which the spheres of the last level reach outside the solid,
    /// meters. Proved, not sampled.
    #[getter]
    fn outward_error(&self) -> f64 {
        self.file.tree.outward_error()
    }

    /// The metrics of the levels, measured by samples: a dict of arrays with one number per level.
    /// Lengths are fractions of the mesh's diagonal.
    ///
    /// ``level``, ``spheres``; ``coverage``: fraction of the surface inside the spheres;
    /// ``protrusion_mean``, ``protrusion_p95``, ``protrusion_max``: distance of the spheres'
    /// surface outside the solid; ``gap_mean``, ``gap_max``: distance of uncovered surface from the
    /// spheres; ``volume_ratio``: volume of the spheres over that of the solid; ``nesting_broken``:
    /// spheres that extend beyond their parents.
    #[getter]
    fn quality<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyDict>> {
        type Figure = (&'static str, fn(&LevelQuality) -> f64);
        const FIGURES: [Figure; 7] = [
            ("coverage", |q| q.coverage),
            ("protrusion_mean", |q| q.protrusion_mean),
            ("protrusion_p95", |q| q.protrusion_p95),
            ("protrusion_max", |q| q.protrusion_max),
            ("gap_mean", |q| q.gap_mean),
            ("gap_max", |q| q.gap_max),
            ("volume_ratio", |q| q.volume_ratio),
        ];
        let (levels, dict) = (self.measured(py)?, PyDict::new(py));
        dict.set_item("level", PyArray1::from_iter(py, levels.iter().map(|q| i64::from(q.level))))?;
        dict.set_item("spheres", PyArray1::from_iter(py, levels.iter().map(|q| q.spheres as i64)))?;
        for (name, figure) in FIGURES {
            dict.set_item(name, PyArray1::from_iter(py, levels.iter().map(figure)))?;
        }
        dict.set_item("nesting_broken", PyArray1::from_iter(py, levels.iter().map(|q| q.nesting_broken as i64)))?;
        Ok(dict)
    }

    /// Returns the metrics as the table that ``tumble spheretree`` prints. verbose: with more
    /// columns and the work of the builder's stages.
    #[pyo3(signature = (verbose=false, **unknown), text_signature = "($self, verbose=False)")]
    fn report(&self, py: Python<'_>, verbose: bool, unknown: Option<Unknown<'_, '_>>) -> Result<String> {
        keywords::check(unknown, "SphereTree.report")?;
        Ok(self.whole(py)?.table(verbose))
    }

    /// Pickles the tree, the measured metrics, and the mesh for measuring others.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let quality = self.quality.get().cloned().unwrap_or_default();
        let json = TreeFile { quality, ..self.file.clone() }.to_json();
        pickled(py, "_unpickle_tree", PICKLED, &(json, &self.mesh))
    }

    /// Number of levels.
    fn __len__(&self) -> usize {
        self.levels.len()
    }

    fn __repr__(&self) -> String {
        let counts: Vec<String> = self.levels.iter().map(|level| level.len().to_string()).collect();
        format!("<tumble.SphereTree of {}: {}, {} spheres>", self.file.name, self.method(), counts.join(" > "))
    }
}
