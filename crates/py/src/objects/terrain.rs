//! Shapes that are meshes made from something else: convex hulls, height fields, terrain, signed distances.

use crate::arrays::convert::{number, numbers, path, shown, some};
use crate::errors::{Error, Result, caught};
use crate::keywords::{self, Unknown};
use crate::objects::shapes::{Mesh, Shape, built, checked_scale, given};
use crate::pool;
use pyo3::PyClass;
use pyo3::prelude::*;
use std::path::Path;
use tumble::collide::{TriMesh, Vec3};
use tumble::scene::{ValueGrid, read_grid, read_heights, read_mesh_bytes, read_triangles};

impl Shape {
    /// Returns the shape as an object of a subclass of `Mesh`.
    fn into_mesh<C: PyClass<BaseType = Mesh>>(self, class: C) -> PyClassInitializer<C> {
        self.into_a(Mesh).add_subclass(class)
    }
}

/// Returns a mesh as an object of the class that its expression names.
pub(super) fn mesh_of_record(py: Python<'_>, shape: Shape) -> Result<Py<PyAny>> {
    let class = shape.words.split('(').next().unwrap_or_default().to_owned();
    Ok(match class.as_str() {
        "ConvexHull" => Py::new(py, shape.into_mesh(ConvexHull))?.into_any(),
        "HeightField" => Py::new(py, shape.into_mesh(HeightField))?.into_any(),
        "Terrain" => Py::new(py, shape.into_mesh(Terrain))?.into_any(),
        "OpenMesh" => Py::new(py, shape.into_mesh(OpenMesh))?.into_any(),
        "Sdf" => Py::new(py, shape.into_mesh(Sdf))?.into_any(),
        _ => Py::new(py, shape.into_a(Mesh))?.into_any(),
    })
}

/// The convex hull of points, a ``Mesh``. points: shape (n, 3), meters; an object with ``vertices``
/// and ``faces``; or the path of an OBJ, STL, PLY or COLLADA file, which need not be closed.
/// ``scale`` multiplies the coordinates. The frame of its body is that of the points.
///
/// At least 4 points, not all in one plane. A point is outside by at most half a millionth of the
/// longest side.
#[pyclass(frozen, extends = Mesh, module = "tumble")]
pub struct ConvexHull;

#[pymethods]
impl ConvexHull {
    #[new]
    #[pyo3(signature = (points, *, scale=1.0, **unknown), text_signature = "(points, *, scale=1.0)")]
    fn new(
        py: Python<'_>,
        points: &Bound<'_, PyAny>,
        scale: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<ConvexHull>> {
        keywords::check(unknown, "ConvexHull")?;
        let scale = checked_scale(scale)?;
        let hull = match points.extract::<std::path::PathBuf>() {
            Ok(file) => {
                let mesh = read_open(py, &file)?.scaled(scale);
                let named = |e| Error::value(format!("{}: {e}", file.display()));
                py.detach(|| pool::run(|| mesh.convex_hull().map_err(named)))?
            }
            Err(_) => {
                let points = match given(points, None)? {
                    Some(mesh) => mesh.vertices,
                    None => of_array(points)?,
                };
                let points: Vec<Vec3> = points.into_iter().map(|p| p * scale).collect();
                py.detach(|| caught(|| TriMesh::hull_of(&points).map_err(|e| Error::value(e.to_string()))))?
            }
        };
        let words = format!("ConvexHull({} vertices)", hull.vertices.len());
        Ok(Shape::new(built(py, "ConvexHull", hull)?, words).into_mesh(ConvexHull))
    }
}

fn of_array(points: &Bound<'_, PyAny>) -> Result<Vec<Vec3>> {
    let array = numbers(points, "points")?;
    if array.shape.len() != 2 || array.shape[1] != 3 {
        return Err(Error::value(format!("points: expected shape (n, 3), got {}", shown(&array.shape))));
    }
    Ok(array.data.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect())
}

/// Reads a mesh file that need not be closed.
fn read_open(py: Python<'_>, file: &Path) -> Result<TriMesh> {
    let named = |why| Error::value(format!("{}: {why}", file.display()));
    let read = || read_mesh_bytes(file).and_then(|bytes| read_triangles(file, &bytes)).map_err(named);
    py.detach(|| pool::run(read))
}

/// The solid under a grid of heights, a ``Mesh``; for static bodies. heights: shape (rows, columns),
/// meters, with rows along x, from the smallest y to the largest; or the path of a gray PNG, whose
/// upper edge has the largest y, or of a text with a row in each line. size: of the grid along x and
/// y, meters; its center is the origin of the body. thickness: distance of the bottom from the
/// lowest height, meters; None: a tenth of the longer side. height_range: heights of black and white
/// in a PNG, meters, by default (0, 1); an error for other heights.
#[pyclass(frozen, extends = Mesh, module = "tumble")]
pub struct HeightField;

#[pymethods]
impl HeightField {
    #[new]
    #[pyo3(
        signature = (heights, size, thickness=None, *, height_range=None, **unknown),
        text_signature = "(heights, size, thickness=None, *, height_range=(0.0, 1.0))"
    )]
    fn new(
        py: Python<'_>,
        heights: &Bound<'_, PyAny>,
        size: &Bound<'_, PyAny>,
        thickness: Option<f64>,
        height_range: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<HeightField>> {
        keywords::check(unknown, "HeightField")?;
        let size = some::<2>(size, "size")?;
        let thickness = thickness.map(|thickness| number(thickness, "thickness")).transpose()?;
        let range = height_range.map_or(Ok([0.0, 1.0]), |range| some::<2>(range, "height_range"))?;
        let file = heights.extract::<std::path::PathBuf>().ok();
        let is_image = file.as_ref().and_then(|file| file.extension()).is_some_and(|e| e.eq_ignore_ascii_case("png"));
        if height_range.is_some() && !is_image {
            let given = file.map_or("an array".into(), |file| file.display().to_string());
            return Err(Error::value(format!(
                "height_range: expected heights of a PNG, got {given}, which has heights in meters"
            )));
        }
        let (values, columns) = match &file {
            Some(file) => {
                let read = || read_heights(file, &read_mesh_bytes(file)?, range);
                let grid = py.detach(read).map_err(|why| Error::value(format!("{}: {why}", file.display())))?;
                (grid.heights_m, grid.columns)
            }
            None => {
                let array = numbers(heights, "heights")?;
                let [_, columns] = array.shape[..] else {
                    let expected = "heights: expected shape (rows, columns)";
                    return Err(Error::value(format!("{expected}, got {}", shown(&array.shape))));
                };
                (array.data, columns)
            }
        };
        let place = file.map_or(String::new(), |file| format!("{}: ", file.display()));
        let mesh = TriMesh::height_field(&values, columns, size, thickness)
            .map_err(|e| Error::value(format!("{place}{e}")))?;
        let words = format!("HeightField({} x {columns} heights)", values.len() / columns);
        Ok(Shape::new(built(py, "HeightField", mesh)?, words).into_mesh(HeightField))
    }
}

/// The solid below an open surface, a ``Mesh``; for static bodies. Takes what ``Mesh`` takes; all
/// faces must look up, or all down. thickness: distance that the solid reaches straight down,
/// meters; None: a tenth of the longer horizontal side. It is below the surface whichever way the faces look; the
/// solid of an ``OpenMesh`` is behind them, and its thickness is measured across them.
#[pyclass(frozen, extends = Mesh, module = "tumble")]
pub struct Terrain;

#[pymethods]
impl Terrain {
    #[new]
    #[pyo3(signature = (vertices, faces=None, thickness=None, *, scale=1.0, **unknown), text_signature = "(vertices, faces=None, thickness=None, *, scale=1.0)")]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
        thickness: Option<f64>,
        scale: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<Terrain>> {
        keywords::check(unknown, "Terrain")?;
        let (mesh, place) = open_surface(py, vertices, faces, scale)?;
        let count = mesh.triangles.len();
        let solid = mesh.terrain(thickness).map_err(|e| Error::value(format!("{place}{e}")))?;
        Ok(Shape::new(built(py, "Terrain", solid)?, format!("Terrain({count} triangles)")).into_mesh(Terrain))
    }
}

/// The solid behind an open surface of any form, a ``Mesh``; for static bodies: rooms, walls, tunnels. Takes what
/// ``Mesh`` takes; faces look to the free side, counter-clockwise seen from there. thickness: distance that the
/// solid reaches behind them, meters; None: a hundredth of the diagonal. centered: whether it reaches half as far
/// to both sides instead. ``Terrain`` reaches straight down instead, whichever way the faces look.
#[pyclass(frozen, extends = Mesh, module = "tumble")]
pub struct OpenMesh;

#[pymethods]
impl OpenMesh {
    #[new]
    #[pyo3(signature = (vertices, faces=None, thickness=None, *, centered=false, scale=1.0, **unknown), text_signature = "(vertices, faces=None, thickness=None, *, centered=False, scale=1.0)")]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
        thickness: Option<f64>,
        centered: bool,
        scale: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<OpenMesh>> {
        keywords::check(unknown, "OpenMesh")?;
        let (mesh, place) = open_surface(py, vertices, faces, scale)?;
        let count = mesh.triangles.len();
        let solid = mesh.thickened(thickness, centered).map_err(|e| Error::value(format!("{place}{e}")))?;
        Ok(Shape::new(built(py, "OpenMesh", solid)?, format!("OpenMesh({count} triangles)")).into_mesh(OpenMesh))
    }
}

/// Returns a surface that need not be closed, and what errors begin with.
fn open_surface(
    py: Python<'_>,
    vertices: &Bound<'_, PyAny>,
    faces: Option<&Bound<'_, PyAny>>,
    scale: f64,
) -> Result<(TriMesh, String)> {
    let scale = checked_scale(scale)?;
    let (mesh, place) = match given(vertices, faces)? {
        Some(mesh) => (mesh, String::new()),
        None => {
            let file = path(vertices)?;
            (read_open(py, &file)?, format!("{}: ", file.display()))
        }
    };
    Ok((mesh.scaled(scale), place))
}

/// The solid in which signed distances on a grid are negative, a ``Mesh`` of the surface by marching tetrahedra.
/// values: shape (nx, ny, nz), ``values[i, j, k]`` at x, y and z, as ``numpy.meshgrid(indexing="ij")`` makes them;
/// or the path of a NumPy file (.npy). low, high: the first and the last grid point, shape (3,), meters, in the
/// frame of the body. The grid must surround the solid.
#[pyclass(frozen, extends = Mesh, module = "tumble")]
pub struct Sdf;

#[pymethods]
impl Sdf {
    #[new]
    #[pyo3(signature = (values, low, high, **unknown), text_signature = "(values, low, high)")]
    fn new(
        py: Python<'_>,
        values: &Bound<'_, PyAny>,
        low: &Bound<'_, PyAny>,
        high: &Bound<'_, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<Sdf>> {
        keywords::check(unknown, "Sdf")?;
        let corners = [some::<3>(low, "low")?, some::<3>(high, "high")?].map(Vec3::from);
        let (grid, place) = match values.extract::<std::path::PathBuf>() {
            Ok(file) => {
                let named = |why| Error::value(format!("{}: {why}", file.display()));
                let read = || read_mesh_bytes(&file).and_then(|bytes| read_grid(&bytes)).map_err(named);
                (py.detach(read)?, format!("{}: ", file.display()))
            }
            Err(_) => {
                let array = numbers(values, "values")?;
                let Ok(counts) = <[usize; 3]>::try_from(array.shape.as_slice()) else {
                    let expected = "values: expected shape (nx, ny, nz)";
                    return Err(Error::value(format!("{expected}, got {}", shown(&array.shape))));
                };
                (ValueGrid::of_c_order(&array.data, counts).map_err(Error::value)?, String::new())
            }
        };
        let [low, high] = corners;
        let mesh = py
            .detach(|| {
                caught(|| {
                    TriMesh::isosurface_within(&grid.values, grid.counts, low, high)
                        .map_err(|e| Error::value(e.to_string()))
                })
            })
            .map_err(|e| if place.is_empty() { e } else { Error::value(format!("{place}{e}")) })?;
        let [nx, ny, nz] = grid.counts;
        Ok(Shape::new(built(py, "Sdf", mesh)?, format!("Sdf({nx} x {ny} x {nz} values)")).into_mesh(Sdf))
    }
}
