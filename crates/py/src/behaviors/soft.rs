//! The handle of a cloth or a jelly.

use crate::behaviors::{appearance, material, placed, rows};
use crate::errors::{Error, Result};
use crate::objects::handle::handle;
use crate::objects::place::Place;
use crate::world::gc::Anchor;
use crate::world::shared::Shared;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyString;
use std::sync::Arc;
use tumble::behaviors::{Cloth, Jelly, SpringMesh};
use tumble::collide::{Pose, Vec3};

/// A cloth or a jelly of a world: point masses, the nodes, joined by springs. Node ``i + nx·(j + ny·k)`` is
/// number ``i`` along x, ``j`` along y and ``k`` along z.
///
/// A handle without data of its own, made by ``World.add_cloth`` and ``World.add_jelly``.
#[pyclass(frozen, module = "tumble", name = "SpringMesh")]
pub struct Soft {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(Soft, "SpringMesh", |_| Some(String::new()));

/// The grid of a new mesh.
pub enum Grid {
    Cloth(Cloth),
    Jelly(Jelly),
}

/// The constants that a cloth and a jelly have in common.
pub struct Common<'a, 'py> {
    pub name: &'a str,
    pub pose: Pose,
    pub velocity: Vec3,
    pub node_radius: Option<f64>,
    pub pins: Option<&'a Bound<'py, PyAny>>,
    pub implicitness: f64,
    pub friction: f64,
    pub restitution: f64,
    pub color: Option<&'a Bound<'py, PyAny>>,
}

impl Grid {
    fn side(&self, name: &str) -> Option<Vec<usize>> {
        match self {
            Grid::Cloth(cloth) => cloth.side(name),
            Grid::Jelly(jelly) => jelly.side(name),
        }
    }

    /// Converts names of sides and numbers of nodes.
    fn pins(&self, pins: Option<&Bound<'_, PyAny>>) -> Result<Vec<usize>> {
        let Some(pins) = pins else { return Ok(Vec::new()) };
        let wrong = |what: String| {
            Error::value(format!(
                "pins: {what}; expected names of sides, such as \"x_min\", \"y_max\" or \"corners\", and numbers of nodes"
            ))
        };
        let mut all = Vec::new();
        for pin in pins.try_iter()? {
            let pin = pin?;
            if pin.is_instance_of::<PyString>() {
                let name: String = pin.extract()?;
                all.extend(self.side(&name).ok_or_else(|| wrong(format!("there is no side '{name}'")))?);
            } else {
                all.push(pin.extract::<usize>().map_err(|_| wrong(format!("got {pin}")))?);
            }
        }
        Ok(all)
    }
}

/// Adds a mesh and returns its handle.
pub fn add(shared: &Arc<Shared>, py: Python<'_>, grid: &Grid, given: &Common<'_, '_>) -> Result<Soft> {
    let mesh = match grid {
        Grid::Cloth(cloth) => cloth.mesh()?,
        Grid::Jelly(jelly) => jelly.mesh()?,
    };
    let mut mesh = mesh
        .with_name(given.name)
        .with_pose(given.pose)
        .with_velocity(given.velocity)
        .with_pinned_nodes(&grid.pins(given.pins)?)?
        .with_implicitness(given.implicitness)?
        .with_material(material(given.friction, given.restitution)?);
    if let Some(radius) = given.node_radius {
        mesh = mesh.with_radius(radius)?;
    }
    let place = shared.write(py, |inner| {
        let mesh = mesh.with_appearance(appearance(given.color, inner.world.ids().len())?);
        let id = SpringMesh::add(&mut inner.world, mesh)?;
        Ok(placed(shared, inner, id))
    })?;
    Soft::new(py, place)
}

impl Soft {
    fn constant<T>(&self, get: impl FnOnce(&SpringMesh) -> T) -> Result<T> {
        self.place.read(|inner| inner.world.get::<SpringMesh>(self.place.id).map(get))
    }

    /// Returns the positions, or the velocities, of all nodes.
    fn half(&self, second: bool) -> Result<Vec<Vec3>> {
        self.place.read(|inner| {
            let x = inner.world.state_of(self.place.id)?;
            let half = if second { &x[x.len() / 2..] } else { &x[..x.len() / 2] };
            Some(half.chunks_exact(3).map(Vec3::from_column_slice).collect())
        })
    }
}

#[pymethods]
impl Soft {
    /// Positions of the nodes, shape (n, 3), m.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        rows(py, self.half(false)?)
    }

    /// Velocities of the nodes, shape (n, 3), m/s.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        rows(py, self.half(true)?)
    }

    /// Masses of the nodes, shape (n,), kg.
    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.constant(|mesh| mesh.masses().to_vec())?))
    }

    /// Which nodes are pinned, shape (n,).
    #[getter]
    fn pinned<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<bool>>> {
        Ok(PyArray1::from_vec(py, self.constant(|mesh| mesh.pinned().to_vec())?))
    }

    /// Triangles of its surface, shape (m, 3): numbers of nodes.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<u32>>> {
        let triangles: Vec<u32> = self.constant(|mesh| {
            mesh.surface().map_or_else(Vec::new, |surface| surface.triangles.iter().flatten().copied().collect())
        })?;
        let shape = [triangles.len() / 3, 3];
        Ok(PyArray1::from_vec(py, triangles).reshape(shape)?)
    }
}
