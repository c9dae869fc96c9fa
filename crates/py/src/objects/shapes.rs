//! Collision shapes. Sizes are full sizes: edge lengths, and lengths without caps.

use crate::arrays::convert::{direction_or, number, numbers, path, rotation, shown, some, vec3};
use crate::errors::{Error, Result, caught};
use crate::io::slow;
use crate::keywords::{self, Unknown};
use crate::objects::terrain::mesh_of_record;
use crate::pool;
use crate::world::pickling::{ShapeRecord, write_shape};
use nalgebra::Translation3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use tumble::collide::{CompoundPart, Pose, Quat, Shape as Solid, TreeCache, TreeSettings, TriMesh, Vec3};
use tumble::scene::{building_surface, read_solid};

/// A collision shape. The classes ``Sphere``, ``Box``, ``Capsule``, ``Cylinder``, ``Ellipsoid``,
/// ``Cone``, ``HalfSpace``, ``Mesh``, ``ConvexHull``, ``HeightField``, ``Terrain``, ``OpenMesh`` and ``Compound``
/// make one.
#[pyclass(frozen, subclass, module = "tumble")]
pub struct Shape {
    /// In its own frame.
    pub solid: Solid,
    /// Pose of that frame in the body's frame, which the user places.
    pub placement: Pose,
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Its Python expression.
    pub(super) words: String,
}

impl Shape {
    pub(super) fn new(solid: Solid, words: String) -> Shape {
        Shape { solid, placement: Pose::identity(), name: None, words }
    }

    /// Returns the shape of a record, as an object of its class.
    pub fn of_record(py: Python<'_>, record: ShapeRecord) -> Result<Py<PyAny>> {
        let ShapeRecord { solid, placement, name, words } = record;
        let shape = Shape { solid, placement, name, words };
        Ok(match &shape.solid {
            Solid::Sphere { .. } => Py::new(py, shape.into_a(Sphere))?.into_any(),
            Solid::Box { .. } | Solid::RoundedBox { .. } => Py::new(py, shape.into_a(Block))?.into_any(),
            Solid::Capsule { .. } => Py::new(py, shape.into_a(Capsule))?.into_any(),
            Solid::Cylinder(_) | Solid::RoundedCylinder { .. } => Py::new(py, shape.into_a(Cylinder))?.into_any(),
            Solid::Ellipsoid { .. } => Py::new(py, shape.into_a(Ellipsoid))?.into_any(),
            Solid::Cone { .. } => Py::new(py, shape.into_a(Cone))?.into_any(),
            Solid::HalfSpace => Py::new(py, shape.into_a(HalfSpace))?.into_any(),
            Solid::Mesh(_) => mesh_of_record(py, shape)?,
            Solid::Compound(_) => Py::new(py, shape.into_a(Compound))?.into_any(),
        })
    }

    fn record(&self) -> ShapeRecord {
        let (solid, name, words) = (self.solid.clone(), self.name.clone(), self.words.clone());
        ShapeRecord { solid, placement: self.placement, name, words }
    }

    /// Returns the shape as an object of one of its classes.
    pub(super) fn into_a<C: PyClass<BaseType = Shape>>(self, class: C) -> PyClassInitializer<C> {
        PyClassInitializer::from(self).add_subclass(class)
    }
}

#[pymethods]
impl Shape {
    /// Volume, m³; infinite for a half-space.
    #[getter]
    fn volume(&self) -> f64 {
        self.solid.volume()
    }

    /// Radius of the smallest sphere about the shape's origin that contains it, meters; infinite
    /// for a half-space.
    #[getter]
    fn bounding_radius(&self) -> f64 {
        self.solid.bounding_radius()
    }

    /// The name that ``named`` gave it, or None.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Returns the same shape with a name, by which contacts, hits and events report it.
    ///
    /// The shapes of one body, or of one link, must have different names. A ``Compound`` has no name: its parts have.
    #[pyo3(signature = (name, **unknown), text_signature = "($self, name)")]
    fn named(&self, py: Python<'_>, name: &str, unknown: Option<Unknown<'_, '_>>) -> Result<Py<PyAny>> {
        keywords::check(unknown, "Shape.named")?;
        if name.is_empty() || matches!(self.solid, Solid::Compound(_)) {
            let expected = "expected a name that is not empty, of a shape that is no Compound, whose parts have names";
            return Err(Error::value(format!("named('{name}') of {}: {expected}", self.words)));
        }
        Shape::of_record(py, ShapeRecord { name: Some(name.into()), ..self.record() })
    }

    /// Pickles the shape.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Result<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let (py, own) = (slf.py(), slf.get());
        let record = own.record();
        let unpickle = py.import("tumble._native")?.getattr("_unpickle_shape")?;
        Ok((unpickle, (PyBytes::new(py, &write_shape(&record)?),)))
    }

    fn __repr__(&self) -> &str {
        &self.words
    }
}

/// A sphere. radius: meters.
#[pyclass(frozen, extends = Shape, module = "tumble")]
pub struct Sphere;

#[pymethods]
impl Sphere {
    #[new]
    #[pyo3(signature = (radius, **unknown), text_signature = "(radius)")]
    fn new(radius: f64, unknown: Option<Unknown<'_, '_>>) -> Result<PyClassInitializer<Sphere>> {
        keywords::check(unknown, "Sphere")?;
        Ok(Shape::new(Solid::sphere(radius)?, format!("Sphere(radius={radius})")).into_a(Sphere))
    }
}

/// A box about its center. size: full edge lengths along x, y and z, meters, shape (3,); one number is a cube. ``Box(0.4, 0.2, 0.1)``
/// is the same as ``Box((0.4, 0.2, 0.1))``.
/// rounding: radius of edges and corners, meters, below half the shortest edge; the faces stay.
#[pyclass(frozen, extends = Shape, name = "Box", module = "tumble")]
pub struct Block;

#[pymethods]
impl Block {
    #[new]
    #[pyo3(
        signature = (size, y=None, z=None, *, rounding=0.0, **unknown),
        text_signature = "(size, y=None, z=None, *, rounding=0.0)"
    )]
    fn new(
        size: &Bound<'_, PyAny>,
        y: Option<&Bound<'_, PyAny>>,
        z: Option<&Bound<'_, PyAny>>,
        rounding: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<Block>> {
        keywords::check(unknown, "Box")?;
        let size = three_sizes("Box", size, [y, z])?;
        let [x, y, z] = size;
        if let Some(edge) = size.iter().find(|edge| **edge <= 0.0) {
            return Err(Error::value(format!("size: an edge of {edge} m; edges must be above 0 m")));
        }
        let solid = Solid::rounded_cuboid(Vec3::from(size), rounding)?;
        Ok(Shape::new(solid, format!("Box(size=({x}, {y}, {z}){})", rounded(rounding))).into_a(Block))
    }
}

/// A capsule along z about its center. radius: meters; length: of the straight part, without the
/// caps, meters.
#[pyclass(frozen, extends = Shape, module = "tumble")]
pub struct Capsule;

#[pymethods]
impl Capsule {
    #[new]
    #[pyo3(signature = (radius, length, **unknown), text_signature = "(radius, length)")]
    fn new(radius: f64, length: f64, unknown: Option<Unknown<'_, '_>>) -> Result<PyClassInitializer<Capsule>> {
        keywords::check(unknown, "Capsule")?;
        let solid = Solid::capsule(radius, checked_length(length)?)?;
        Ok(Shape::new(solid, format!("Capsule(radius={radius}, length={length})")).into_a(Capsule))
    }
}

/// A cylinder along z about its center. radius, length: meters; rounding: radius of the rims, meters,
/// below the radius and half the length.
#[pyclass(frozen, extends = Shape, module = "tumble")]
pub struct Cylinder;

#[pymethods]
impl Cylinder {
    #[new]
    #[pyo3(signature = (radius, length, *, rounding=0.0, **unknown), text_signature = "(radius, length, *, rounding=0.0)")]
    fn new(
        radius: f64,
        length: f64,
        rounding: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<Cylinder>> {
        keywords::check(unknown, "Cylinder")?;
        let length = checked_length(length)?;
        let solid = caught(|| Ok(Solid::rounded_cylinder(radius, length, rounding)?))?;
        let words = format!("Cylinder(radius={radius}, length={length}{})", rounded(rounding));
        Ok(Shape::new(solid, words).into_a(Cylinder))
    }
}

/// Returns the last argument of a rounded shape's Python expression.
fn rounded(rounding: f64) -> String {
    if rounding == 0.0 { String::new() } else { format!(", rounding={rounding}") }
}

/// An ellipsoid about its center. size: full axes along x, y and z, meters, shape (3,), or three numbers one by one; one number is a
/// sphere.
#[pyclass(frozen, extends = Shape, module = "tumble")]
pub struct Ellipsoid;

#[pymethods]
impl Ellipsoid {
    #[new]
    #[pyo3(signature = (size, y=None, z=None, **unknown), text_signature = "(size, y=None, z=None)")]
    fn new(
        size: &Bound<'_, PyAny>,
        y: Option<&Bound<'_, PyAny>>,
        z: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<Ellipsoid>> {
        keywords::check(unknown, "Ellipsoid")?;
        let size = three_sizes("Ellipsoid", size, [y, z])?;
        let [x, y, z] = size;
        let solid = Solid::ellipsoid(Vec3::from(size))?;
        Ok(Shape::new(solid, format!("Ellipsoid(size=({x}, {y}, {z}))")).into_a(Ellipsoid))
    }
}

/// A cone along z with its tip up, about its center of mass, a quarter of the height above the base.
/// radius: of the base, meters; height: meters.
#[pyclass(frozen, extends = Shape, module = "tumble")]
pub struct Cone;

#[pymethods]
impl Cone {
    #[new]
    #[pyo3(signature = (radius, height, **unknown), text_signature = "(radius, height)")]
    fn new(radius: f64, height: f64, unknown: Option<Unknown<'_, '_>>) -> Result<PyClassInitializer<Cone>> {
        keywords::check(unknown, "Cone")?;
        let solid = Solid::cone(radius, height)?;
        Ok(Shape::new(solid, format!("Cone(radius={radius}, height={height})")).into_a(Cone))
    }
}

/// Converts full sizes along x, y and z: one number for all, shape (3,), or three numbers one by one.
fn three_sizes(class: &str, size: &Bound<'_, PyAny>, more: [Option<&Bound<'_, PyAny>>; 2]) -> Result<[f64; 3]> {
    let edge = |value: &Bound<'_, PyAny>, name: &str| {
        let wrong = || {
            let expected = format!("expected {class}((0.4, 0.2, 0.1)) or {class}(0.4, 0.2, 0.1), full sizes in meters");
            Error::value(format!("{name}: {expected}"))
        };
        number(value.extract::<f64>().map_err(|_| wrong())?, name)
    };
    match (size.extract::<f64>(), more) {
        (_, [Some(y), Some(z)]) => Ok([edge(size, "size")?, edge(y, "y")?, edge(z, "z")?]),
        (Ok(size), [None, None]) => Ok([number(size, "size")?; 3]),
        (Err(_), [None, None]) => some::<3>(size, "size"),
        (_, [y, _]) => Err(Error::value(format!(
            "{}: expected {class}((0.4, 0.2, 0.1)), {class}(0.4, 0.2, 0.1) or one number for all three, full sizes in meters",
            if y.is_none() { "y" } else { "z" }
        ))),
    }
}

fn checked_length(length: f64) -> Result<f64> {
    if length.is_finite() && length > 0.0 {
        Ok(length)
    } else {
        Err(Error::value(format!("length is {length}; it must be finite and above 0 m")))
    }
}

/// All points x with ``normal · x <= offset``. normal: of any length above 0, points out of the
/// solid; offset: meters along the unit normal.
///
/// Only static and kinematic bodies can have it. The frame of such a body has its z axis along the
/// normal and its origin on the plane.
#[pyclass(frozen, extends = Shape, module = "tumble")]
pub struct HalfSpace;

#[pymethods]
impl HalfSpace {
    #[new]
    #[pyo3(signature = (normal=None, offset=0.0, **unknown), text_signature = "(normal=(0.0, 0.0, 1.0), offset=0.0)")]
    fn new(
        normal: Option<&Bound<'_, PyAny>>,
        offset: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<HalfSpace>> {
        keywords::check(unknown, "HalfSpace")?;
        let given = direction_or(normal, "normal", Vec3::z())?;
        let offset = number(offset, "offset")?;
        let largest = given.amax();
        if largest == 0.0 {
            return Err(Error::value("normal: (0, 0, 0) has no direction"));
        }
        let n = (given / largest).normalize();
        // A rotation by 180 degrees about x if the normal points straight down.
        let rotation = Quat::rotation_between(&Vec3::z(), &n)
            .unwrap_or_else(|| Quat::from_quaternion(nalgebra::Quaternion::new(0.0, 1.0, 0.0, 0.0)));
        let placement = Pose::from_parts(Translation3::from(n * offset), rotation);
        let words = format!("HalfSpace(normal=({}, {}, {}), offset={offset})", given.x, given.y, given.z);
        Ok(Shape { placement, ..Shape::new(Solid::half_space(), words) }.into_a(HalfSpace))
    }
}

/// A closed mesh. The frame of its body is that of its vertices, so ``position`` is the position of
/// their origin.
///
/// ``Mesh(vertices, faces)``: shapes (n, 3) in meters and (m, 3) of indices from 0,
/// counter-clockwise seen from outside. ``Mesh(path)``: an OBJ, STL or COLLADA file in meters;
/// ``scale`` multiplies its coordinates. Also takes an object with ``vertices`` and ``faces``, such
/// as a trimesh. A mesh that is open or encloses nothing is a ``ValueError`` that names the place.
#[pyclass(frozen, subclass, extends = Shape, module = "tumble")]
pub struct Mesh;

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (vertices, faces=None, *, scale=1.0, **unknown), text_signature = "(vertices, faces=None, *, scale=1.0)")]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
        scale: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyClassInitializer<Mesh>> {
        keywords::check(unknown, "Mesh")?;
        let mesh = triangles(py, vertices, faces)?.scaled(checked_scale(scale)?);
        let count = mesh.triangles.len();
        let name = vertices.extract::<std::path::PathBuf>().unwrap_or_else(|_| "Mesh".into());
        let solid = built(py, &name.display().to_string(), mesh)?;
        Ok(Shape::new(solid, format!("Mesh({count} triangles)")).into_a(Mesh))
    }

    /// The center of mass in the frame of the vertices, shape (3,), meters.
    #[getter]
    fn center_of_mass<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyArray1<f64>>> {
        let base: PyRef<'py, Shape> = slf.clone().into_any().extract().map_err(PyErr::from)?;
        Ok(crate::arrays::convert::vector(slf.py(), &base.solid.center_of_mass()))
    }

    /// The vertices after repair, equal to the given ones up to rounding, shape (n, 3), meters.
    #[getter]
    fn vertices<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyArray2<f64>>> {
        let base: PyRef<'py, Shape> = slf.clone().into_any().extract().map_err(PyErr::from)?;
        let Solid::Mesh(mesh) = &base.solid else { return Err(Error::value("not a mesh")) };
        let center = mesh.center_of_mass();
        let flat: Vec<f64> = mesh.mesh().vertices.iter().map(|v| v + center).flat_map(|v| [v.x, v.y, v.z]).collect();
        Ok(PyArray1::from_vec(slf.py(), flat).reshape([mesh.mesh().vertices.len(), 3])?)
    }

    /// The triangles, shape (m, 3), indices into ``vertices``.
    #[getter]
    fn faces<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyArray2<u32>>> {
        let base: PyRef<'py, Shape> = slf.clone().into_any().extract().map_err(PyErr::from)?;
        let Solid::Mesh(mesh) = &base.solid else { return Err(Error::value("not a mesh")) };
        let flat: Vec<u32> = mesh.mesh().triangles.iter().flatten().copied().collect();
        Ok(PyArray1::from_vec(slf.py(), flat).reshape([mesh.mesh().triangles.len(), 3])?)
    }
}

pub(super) fn checked_scale(scale: f64) -> Result<f64> {
    if scale.is_finite() && scale > 0.0 {
        Ok(scale)
    } else {
        Err(Error::value(format!("scale is {scale}; it must be finite and above 0")))
    }
}

/// Returns a closed mesh as a solid; `name` is that of the message about slow loading.
pub(super) fn built(py: Python<'_>, name: &str, mesh: TriMesh) -> Result<Solid> {
    let count = mesh.triangles.len();
    let build = || Ok(Solid::mesh_cached(mesh, &TreeSettings::octree(), &TreeCache::of_environment())?);
    let (solid, _) = py.detach(|| pool::run(|| building_surface(name, count, build)))?;
    slow::warn(py)?;
    Ok(solid)
}

/// Several shapes of one body.
///
/// parts: tuples ``(shape, position)``, ``(shape, position, orientation)`` or ``(shape, position,
/// orientation, density)``: position of the shape's origin, meters; orientation: quaternion
/// (x, y, z, w) or None; density: kg/m³, for all parts or for none. A part has the name of its shape: ``shape.named``. A body made without mass and
/// density has these densities. Parts may overlap; mass and volume of an overlap then count for
/// each. The frame of its body is that of the positions.
#[pyclass(frozen, extends = Shape, module = "tumble")]
pub struct Compound;

#[pymethods]
impl Compound {
    #[new]
    #[pyo3(signature = (parts, **unknown), text_signature = "(parts)")]
    fn new(parts: Vec<Bound<'_, PyAny>>, unknown: Option<Unknown<'_, '_>>) -> Result<PyClassInitializer<Compound>> {
        keywords::check(unknown, "Compound")?;
        let count = parts.len();
        let parts = parts.iter().enumerate().map(|(n, part)| compound_part(n, part)).collect::<Result<_>>()?;
        Ok(Shape::new(Solid::compound(parts)?, format!("Compound({count} parts)")).into_a(Compound))
    }

    /// The center of mass in the frame of the parts, shape (3,), meters.
    #[getter]
    fn center_of_mass<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyArray1<f64>>> {
        let base: PyRef<'py, Shape> = slf.clone().into_any().extract().map_err(PyErr::from)?;
        Ok(crate::arrays::convert::vector(slf.py(), &base.solid.center_of_mass()))
    }
}

fn compound_part(n: usize, part: &Bound<'_, PyAny>) -> Result<CompoundPart> {
    let wrong = || {
        let expected =
            "expected (shape, position), (shape, position, orientation) or (shape, position, orientation, density)";
        Error::value(format!("part {} of a compound: {expected}", n + 1))
    };
    let fields: Vec<Bound<'_, PyAny>> = part.extract().map_err(|_| wrong())?;
    let [shape, position, rest @ ..] = fields.as_slice() else { return Err(wrong()) };
    if rest.len() > 2 {
        return Err(wrong());
    }
    let shape: PyRef<'_, Shape> = shape.extract().map_err(|_| wrong())?;
    let given = |k: usize| rest.get(k).filter(|value| !value.is_none());
    let turn = given(0).map_or(Ok(Quat::identity()), |q| rotation(q, "orientation"))?;
    let density =
        given(1).map(|density| number(density.extract::<f64>().map_err(|_| wrong())?, "density")).transpose()?;
    let pose = Pose::from_parts(vec3(position, "position")?.into(), turn);
    Ok(CompoundPart { shape: shape.solid.clone(), pose, density, name: shape.name.clone() })
}

/// Returns triangles from arrays, from an object that has them (trimesh), or from a file.
pub fn triangles(py: Python<'_>, vertices: &Bound<'_, PyAny>, faces: Option<&Bound<'_, PyAny>>) -> Result<TriMesh> {
    if let Some(mesh) = given(vertices, faces)? {
        return Ok(mesh);
    }
    let file = path(vertices)?;
    py.detach(|| {
        let bytes = std::fs::read(&file).map_err(|source| Error::File { file: file.display().to_string(), source })?;
        let (mesh, _) = pool::run(|| {
            read_solid(&file, &bytes, None).map_err(|why| Error::value(format!("{}: {why}", file.display())))
        })?;
        Ok(mesh)
    })
}

/// Returns triangles from arrays or from an object that has them; `None` for a path.
pub(super) fn given(vertices: &Bound<'_, PyAny>, faces: Option<&Bound<'_, PyAny>>) -> Result<Option<TriMesh>> {
    if let Some(faces) = faces {
        return of_arrays(vertices, faces).map(Some);
    }
    match (vertices.getattr("vertices"), vertices.getattr("faces")) {
        (Ok(own), Ok(faces)) => of_arrays(&own, &faces).map(Some),
        _ => Ok(None),
    }
}

fn of_arrays(vertices: &Bound<'_, PyAny>, faces: &Bound<'_, PyAny>) -> Result<TriMesh> {
    let (points, corners) = (numbers(vertices, "vertices")?, numbers(faces, "faces")?);
    for (what, shape) in [("vertices", &points.shape), ("faces", &corners.shape)] {
        if shape.len() != 2 || shape[1] != 3 {
            return Err(Error::value(format!("{what}: expected shape (n, 3), got {}", shown(shape))));
        }
    }
    let count = points.shape[0];
    let index = |&k: &f64| {
        let right = k >= 0.0 && k < count as f64 && k.fract() == 0.0;
        if right { Ok(k as u32) } else { Err(Error::value(format!("faces: {k} is not an index of {count} vertices"))) }
    };
    let flat = corners.data.iter().map(index).collect::<Result<Vec<u32>>>()?;
    Ok(TriMesh {
        vertices: points.data.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect(),
        triangles: flat.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    })
}
