//! What a force or a behaviour written in Python sees of the world, and where it puts what it does.
//!
//! The site table is copied into one numpy array for each call: the world's own memory changes while it is stepped, and an array that a callback
//! kept would look into it. 19 numbers per row are copied, which takes less than the call itself. After the call the view
//! refuses to be asked, and what was added to its arrays is read once and then no more.

use crate::convert::{numbers, some, vec3};
use crate::errors::{Error, Result};
use crate::world::place_of;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PySlice;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble::collide::Vec3;
use tumble::core::{ArticulatedBody, ObjectId, RigidBody as Rigid, Site, WorldView, Wrench};

/// Numbers of a row: position, quaternion, velocity, angular velocity, acceleration, angular acceleration.
const WIDTH: usize = 19;

/// Which rows belong to whom: made once and kept until objects come or go.
pub struct Layout {
    ids: Vec<ObjectId>,
    /// Objects with rows: their id, name and rows.
    objects: Vec<(ObjectId, Arc<str>, Range<usize>)>,
    /// By row, kg.
    masses: Vec<f64>,
}

impl Layout {
    /// Of the world as it is.
    pub fn of(view: &WorldView) -> Layout {
        let mut layout = Layout { ids: view.ids().to_vec(), objects: Vec::new(), masses: vec![0.0; view.sites.len()] };
        for &id in view.ids() {
            let (Some(span), Some(object)) = (view.span(id), view.object(id)) else { continue };
            if span.site.is_empty() {
                continue;
            }
            layout.objects.push((id, object.name().into(), span.site.clone()));
            for (part, row) in span.site.clone().enumerate() {
                layout.masses[row] = mass(view, id, part);
            }
        }
        layout
    }

    /// Whether it still holds.
    pub fn fits(&self, view: &WorldView) -> bool {
        self.ids == view.ids() && self.masses.len() == view.sites.len()
    }

    /// Rows of an object.
    pub fn rows(&self, id: ObjectId) -> Option<Range<usize>> {
        Some(self.objects.iter().find(|(other, ..)| *other == id)?.2.clone())
    }

    /// Whose row it is, and which part of it.
    pub fn owner(&self, row: usize) -> Option<(ObjectId, usize, &Arc<str>)> {
        let (id, name, rows) = self.objects.iter().find(|(.., rows)| rows.contains(&row))?;
        Some((*id, row - rows.start, name))
    }
}

fn mass(view: &WorldView, id: ObjectId, part: usize) -> f64 {
    if let Some(body) = view.get::<Rigid>(id) {
        return if body.is_fixture() { 0.0 } else { body.mass() };
    }
    let of_link = |body: &ArticulatedBody| Some(body.model().links().get(body.link_of(part)?)?.mass.mass);
    view.get::<ArticulatedBody>(id).and_then(of_link).unwrap_or(0.0)
}

/// The world as a force or a behaviour sees it while it is called: a row for every rigid body and every link, in world axes.
///
/// The arrays are copies of that moment and read-only, but ``force`` and ``torque``, which begin at zero and take what the callback adds. After the
/// callback has returned the view raises ``RemovedError``.
#[pyclass(frozen, module = "tumble")]
pub struct View {
    table: Py<PyArray2<f64>>,
    wrenches: Py<PyArray2<f64>>,
    layout: Arc<Layout>,
    moves: Vec<bool>,
    time: f64,
    gravity: Vec3,
    over: AtomicBool,
}

impl View {
    /// A copy of what a callback may see.
    pub fn new(py: Python<'_>, view: &WorldView, layout: &Arc<Layout>) -> Result<View> {
        let mut flat = Vec::with_capacity(WIDTH * view.sites.len());
        for site in view.sites {
            push(&mut flat, site);
        }
        let table = PyArray1::from_vec(py, flat).reshape([view.sites.len(), WIDTH])?;
        table.call_method1("setflags", (false,))?;
        let mut moves = vec![false; view.sites.len()];
        for (id, _, rows) in &layout.objects {
            moves[rows.clone()].fill(view.status(*id).is_some_and(|status| status.moves()));
        }
        let wrenches = PyArray2::zeros(py, [view.sites.len(), 6], false).unbind();
        Ok(View { table: table.unbind(), wrenches, layout: layout.clone(), moves, time: view.time, gravity: view.gravity, over: AtomicBool::new(false) })
    }

    /// The callback has returned: what it did, by row.
    pub fn end(&self, py: Python<'_>, whose: &str) -> Result<Vec<Wrench>> {
        self.over.store(true, Ordering::Relaxed);
        let flat = self.wrenches.bind(py).to_vec().unwrap_or_default();
        if let Some(k) = flat.iter().position(|x| !x.is_finite()) {
            let name = self.layout.owner(k / 6).map_or("nothing", |(_, _, name)| name);
            let what = if k % 6 < 3 { "force" } else { "torque" };
            return Err(Error::value(format!("'{whose}': its {what} on '{name}' is {}; it must be finite", flat[k])));
        }
        let three = |w: &[f64]| Vec3::new(w[0], w[1], w[2]);
        Ok(flat.chunks_exact(6).map(|w| Wrench { force: three(w), torque: three(&w[3..]) }).collect())
    }

    fn open(&self) -> Result<()> {
        match self.over.load(Ordering::Relaxed) {
            true => Err(Error::Removed("this view belonged to a call that has returned; copy what is needed later while the call lasts".into())),
            false => Ok(()),
        }
    }

    fn columns<'py>(&self, py: Python<'py>, of: &Py<PyArray2<f64>>, columns: Range<isize>) -> Result<Bound<'py, PyAny>> {
        self.open()?;
        let columns = PySlice::new(py, columns.start, columns.end, 1);
        Ok(of.bind(py).get_item((PySlice::full(py), columns))?)
    }

    fn set(&self, py: Python<'_>, columns: Range<isize>, value: &Bound<'_, PyAny>) -> Result<()> {
        Ok(self.columns(py, &self.wrenches, columns)?.set_item(py.Ellipsis(), value)?)
    }

    fn row_of(&self, body: &Bound<'_, PyAny>) -> Result<Range<usize>> {
        self.open()?;
        let unknown = |name: &str| {
            let names: Vec<&str> = self.layout.objects.iter().take(8).map(|(_, name, _)| &**name).collect();
            Error::Name(format!("the world has no body named '{name}'; there are {}", names.join(", ")))
        };
        if let Ok(name) = body.extract::<String>() {
            let found = self.layout.objects.iter().find(|(_, other, _)| **other == *name);
            return found.map(|(.., rows)| rows.clone()).ok_or_else(|| unknown(&name));
        }
        let place = place_of(body)?;
        let found = self.layout.objects.iter().find(|(id, name, _)| *id == place.id && *name == place.name);
        found.map(|(.., rows)| rows.clone()).ok_or_else(|| unknown(&place.name))
    }
}

fn push(flat: &mut Vec<f64>, site: &Site) {
    flat.extend(site.position().iter());
    flat.extend(site.pose.rotation.coords.iter());
    for v in [site.velocity, site.angular_velocity, site.acceleration, site.angular_acceleration] {
        flat.extend(v.iter());
    }
}

#[pymethods]
impl View {
    /// Simulated time of this evaluation, s: within a step it may lie anywhere in it.
    #[getter]
    fn time(&self) -> Result<f64> {
        self.open().map(|()| self.time)
    }

    /// Gravity, shape (3,), m/s².
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        self.open()?;
        Ok(crate::convert::vector(py, &self.gravity))
    }

    /// Positions, shape (n, 3), m: of rigid bodies the centre of mass, of links the origin of their frame.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.columns(py, &self.table, 0..3)
    }

    /// Orientations, body to world, unit quaternions (x, y, z, w), shape (n, 4).
    #[getter]
    fn orientation<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.columns(py, &self.table, 3..7)
    }

    /// Velocities of the same points, shape (n, 3), m/s.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.columns(py, &self.table, 7..10)
    }

    /// Angular velocities, shape (n, 3), rad/s.
    #[getter]
    fn angular_velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.columns(py, &self.table, 10..13)
    }

    /// Accelerations of the same points when forces were last evaluated, shape (n, 3), m/s².
    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.columns(py, &self.table, 13..16)
    }

    /// Angular accelerations at the same time, shape (n, 3), rad/s².
    #[getter]
    fn angular_acceleration<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.columns(py, &self.table, 16..19)
    }

    /// Masses, shape (n,), kg; 0 of static geometry.
    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        self.open()?;
        Ok(crate::convert::array(py, &self.layout.masses))
    }

    /// Whether forces move it: neither static nor kinematic, and alive. Shape (n,), bool.
    #[getter]
    fn moves<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<bool>>> {
        self.open()?;
        Ok(PyArray1::from_slice(py, &self.moves))
    }

    /// Of each row the name of its body.
    #[getter]
    fn names(&self) -> Result<Vec<String>> {
        self.open()?;
        Ok(self.layout.objects.iter().flat_map(|(_, name, rows)| rows.clone().map(|_| name.to_string())).collect())
    }

    /// Forces at the points that ``position`` tells, shape (n, 3), N, world axes: add to it.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.columns(py, &self.wrenches, 0..3)
    }

    #[setter]
    fn set_force(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set(py, 0..3, value)
    }

    /// Torques, shape (n, 3), N·m, world axes: add to it.
    #[getter]
    fn torque<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.columns(py, &self.wrenches, 3..6)
    }

    #[setter]
    fn set_torque(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set(py, 3..6, value)
    }

    /// The row of a rigid body, given by name or as a handle; of an articulated body that of its part number ``part``.
    #[pyo3(signature = (body, part=0))]
    fn row(&self, body: &Bound<'_, PyAny>, part: usize) -> Result<usize> {
        let rows = self.row_of(body)?;
        match part < rows.len() {
            true => Ok(rows.start + part),
            false => Err(Error::value(format!("part is {part}; the body has {} parts", rows.len()))),
        }
    }

    /// The rows of a body as a slice: one of a rigid body, one per link of an articulated body.
    fn rows<'py>(&self, py: Python<'py>, body: &Bound<'py, PyAny>) -> Result<Bound<'py, PySlice>> {
        let rows = self.row_of(body)?;
        Ok(PySlice::new(py, rows.start as isize, rows.end as isize, 1))
    }

    /// Adds a force, shape (3,), N, that acts on a row at a point of the world, shape (3,), m: with the torque ``(point - position) × force``.
    fn push(&self, py: Python<'_>, row: usize, force: &Bound<'_, PyAny>, point: &Bound<'_, PyAny>) -> Result<()> {
        self.open()?;
        let (force, point) = (vec3(force, "force")?, vec3(point, "point")?);
        if row >= self.moves.len() {
            return Err(Error::value(format!("row is {row}; there are {}", self.moves.len())));
        }
        let origin = Vec3::from(some::<19>(&self.table.bind(py).get_item(row)?, "row").map(|site| [site[0], site[1], site[2]])?);
        let own = self.wrenches.bind(py).get_item(row)?;
        let now = numbers(&own, "force")?.data;
        let torque = (point - origin).cross(&force);
        let sum: Vec<f64> = now.iter().zip(force.iter().chain(torque.iter())).map(|(a, b)| a + b).collect();
        Ok(own.set_item(py.Ellipsis(), sum)?)
    }

    /// Number of rows.
    fn __len__(&self) -> Result<usize> {
        self.open().map(|()| self.moves.len())
    }
}
