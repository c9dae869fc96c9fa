//! Sphere trees: built, measured, written and read. The trees and all their figures are the library's.

use crate::convert::{path, whole_number};
use crate::errors::{Error, Result, caught};
use crate::interrupt::abandonable;
use crate::pool;
use crate::shapes::triangles;
use crate::words::{BUILDERS, meaning, word};
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
use tumble::dynamics::archive::{open, seal};

/// Nested balls around a closed mesh: every ball holds the balls of its children, and the balls of each level cover the surface.
///
/// Made by ``SphereTree.build`` or ``SphereTree.load``. All numbers are in the axes of the mesh as it was given, metres.
#[pyclass(frozen, module = "tumble")]
pub struct SphereTree {
    file: TreeFile,
    levels: Vec<Vec<LevelSphere>>,
    /// What it was built around; a tree that was loaded has no mesh.
    mesh: Option<TriMesh>,
    quality: OnceLock<Vec<LevelQuality>>,
}

/// What a pickled tree begins with.
const PICKLED: &[u8; 8] = b"tumbleT1";

/// What a pickled sphere tree becomes.
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

    /// The figures of the levels, measured when they are first asked for.
    fn measured(&self, py: Python<'_>) -> Result<&[LevelQuality]> {
        if self.quality.get().is_none() {
            let Some(mesh) = &self.mesh else {
                return Err(Error::value(
                    "the file of this tree holds no figures, and without its mesh none can be measured; build it anew",
                ));
            };
            let quality = py.detach(|| pool::run(|| Ok(self.file.tree.quality(mesh, &QualitySettings::default()))))?;
            _ = self.quality.set(quality); // whoever came first measured the same
        }
        Ok(self.quality.get().map_or(&[], Vec::as_slice))
    }

    /// The tree with its figures, as it is written and printed.
    fn whole(&self, py: Python<'_>) -> Result<TreeFile> {
        Ok(TreeFile { quality: self.measured(py)?.to_vec(), ..self.file.clone() })
    }
}

/// The method's usual settings, with what was given instead.
fn settings(method: &str, branch: Option<u32>, depth: Option<u32>, error: Option<f64>) -> Result<TreeSettings> {
    let builder = meaning("method", method, BUILDERS)?;
    let usual = if builder == Builder::Octree {
        TreeSettings::octree()
    } else {
        TreeSettings { builder, ..TreeSettings::default() }
    };
    Ok(TreeSettings {
        branch: branch.unwrap_or(usual.branch),
        depth: depth.unwrap_or(usual.depth),
        error: error.unwrap_or(usual.error),
        ..usual
    })
}

/// What the mesh is called in the tree's file.
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
    /// vertices: shape (n, 3), metres, and faces: shape (m, 3), indices from 0, counter-clockwise seen from outside; or the path of an OBJ, STL or
    /// COLLADA file; or an object with ``vertices`` and ``faces``, such as a trimesh. method: ``"medial"`` (adaptive medial axis, the tightest),
    /// ``"hubbard"``, ``"grid"`` or ``"octree"``; branch: most children of a ball, 2 to 64 (default 8); depth: most levels below the root, 1 to 9
    /// (default 3, of the octree 7); error: no ball that reaches less than this outside is divided, as a part of the mesh's diagonal, 1e-4 to 1
    /// (default 1e-4, of the octree 0.01); cache: keep the tree on disk and take it from there next time.
    ///
    /// A mesh that is open or encloses nothing, and settings out of range, are ``InvalidValueError``. The interpreter is let go meanwhile; Ctrl-C ends the build.
    #[staticmethod]
    #[pyo3(signature = (vertices, faces=None, *, method="medial", branch=None, depth=None, error=None, cache=true))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn build(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
        method: &str,
        #[pyo3(from_py_with = whole_number)] branch: Option<u32>,
        #[pyo3(from_py_with = whole_number)] depth: Option<u32>,
        error: Option<f64>,
        cache: bool,
    ) -> Result<SphereTree> {
        let settings = settings(method, branch, depth, error)?;
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

    /// Reads a tree that ``save`` or ``tumble spheretree --output`` wrote. What is no tree is an ``InvalidValueError`` that says what is wrong.
    #[staticmethod]
    fn load(py: Python<'_>, path: &Bound<'_, PyAny>) -> Result<SphereTree> {
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

    /// Writes the tree and its figures as JSON: the file of ``tumble spheretree --output``.
    fn save(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> Result<()> {
        let (path, file): (PathBuf, TreeFile) = (self::path(path)?, self.whole(py)?);
        py.detach(|| {
            std::fs::write(&path, file.to_json())
                .map_err(|source| Error::File { file: path.display().to_string(), source })
        })
    }

    /// The same as a string.
    fn to_json(&self, py: Python<'_>) -> Result<String> {
        Ok(self.whole(py)?.to_json())
    }

    /// Name of the mesh: that of its file, or ``"mesh"``.
    #[getter]
    fn name(&self) -> &str {
        &self.file.name
    }

    /// How it was built.
    #[getter]
    fn method(&self) -> &'static str {
        word(self.file.settings.builder, BUILDERS)
    }

    /// Most children of a ball that were allowed.
    #[getter]
    fn branch(&self) -> u32 {
        self.file.settings.branch
    }

    /// Most levels below the root that were allowed.
    #[getter]
    fn depth(&self) -> u32 {
        self.file.settings.depth
    }

    /// The levels, the root's first: each a ``SphereLevel`` of ``centers``, shape (n, 3), and ``radii``, shape (n,), metres. Every level stands for the
    /// solid by itself: a leaf above the last level is repeated in the levels below.
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

    /// For each level, of each ball the index of its parent in the level above, shape (n,); -1 for the root.
    #[getter]
    fn parents<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyTuple>> {
        let parents =
            |balls: &Vec<LevelSphere>| PyArray1::from_iter(py, balls.iter().map(|b| b.parent.map_or(-1, |p| p as i64)));
        Ok(PyTuple::new(py, self.levels.iter().map(parents))?)
    }

    /// How far the balls of the last level reach outside the solid at most, metres: a bound that is proved, not sampled.
    #[getter]
    fn outward_error(&self) -> f64 {
        self.file.tree.outward_error()
    }

    /// The figures of the levels, measured by samples: a dict of arrays with a number per level. Lengths are parts of the mesh's diagonal.
    ///
    /// ``level``, ``spheres``; ``coverage``: share of the surface inside the balls; ``protrusion_mean``, ``protrusion_p95``, ``protrusion_max``: how far the
    /// balls' surface is outside the solid; ``gap_mean``, ``gap_max``: how far bare surface is from the balls; ``volume_ratio``: volume of the
    /// balls over that of the solid; ``nesting_broken``: balls that stick out of their parents.
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

    /// The figures as the table that ``tumble spheretree`` prints; verbose: with more columns and what the builder's stages did.
    #[pyo3(signature = (verbose=false))]
    fn report(&self, py: Python<'_>, verbose: bool) -> Result<String> {
        Ok(self.whole(py)?.table(verbose))
    }

    /// For pickle: the tree, the figures that were measured, and the mesh that others are measured with.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let quality = self.quality.get().cloned().unwrap_or_default();
        let json = TreeFile { quality, ..self.file.clone() }.to_json();
        let unpickle = py.import("tumble._native")?.getattr("_unpickle_tree")?;
        Ok((unpickle, (PyBytes::new(py, &seal(PICKLED, &(json, &self.mesh))?),)))
    }

    /// Number of levels.
    fn __len__(&self) -> usize {
        self.levels.len()
    }

    fn __repr__(&self) -> String {
        let counts: Vec<String> = self.levels.iter().map(|level| level.len().to_string()).collect();
        format!("<tumble.SphereTree of {}: {}, {} balls>", self.file.name, self.method(), counts.join(" > "))
    }
}
