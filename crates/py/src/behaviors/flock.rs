//! Flocks and boids.

use crate::arrays::convert::{quaternion, some, vec3_or, vector};
use crate::behaviors::{appearance, placed};
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::handle::handle;
use crate::objects::place::Place;
use crate::world::gc::Anchor;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::sync::Arc;
use tumble::behaviors::{Boid, Flock, Steering};
use tumble::collide::{Shape, Vec3};
use tumble::dynamics::ObjectId;

/// The constants of a flock by name.
type Constant = (&'static str, fn(&mut Steering) -> &mut f64);
const CONSTANTS: [Constant; 12] = [
    ("avoidance", |s| &mut s.avoidance),
    ("matching", |s| &mut s.matching),
    ("clustering", |s| &mut s.clustering),
    ("max_force", |s| &mut s.max_force),
    ("visibility_distance", |s| &mut s.visibility_distance),
    ("inner_visibility_distance", |s| &mut s.inner_visibility_distance),
    ("visibility_angle", |s| &mut s.visibility_angle),
    ("inner_visibility_angle", |s| &mut s.inner_visibility_angle),
    ("desired_speed", |s| &mut s.desired_speed),
    ("speed_rate", |s| &mut s.speed_rate),
    ("boundary_radius", |s| &mut s.boundary_radius),
    ("boundary_stiffness", |s| &mut s.boundary_stiffness),
];

/// Returns the constants with those that are given by name.
pub fn steering(mut of: Steering, given: Option<&Bound<'_, PyDict>>) -> Result<Steering> {
    for (key, value) in given.into_iter().flatten() {
        let name: String = key.extract()?;
        if name == "boundary_center" {
            of.boundary_center = Vec3::from(some::<3>(&value, "boundary_center")?);
            continue;
        }
        let constant = CONSTANTS.iter().find(|(other, _)| *other == name).ok_or_else(|| {
            let names: Vec<&str> = CONSTANTS.iter().map(|(name, _)| *name).collect();
            Error::Name(format!("a flock has no constant '{name}'; there are boundary_center, {}", names.join(", ")))
        })?;
        *constant.1(&mut of) = value.extract()?;
    }
    of.validate()?;
    Ok(of)
}

/// Returns the constants by name.
pub fn steering_dict(py: Python<'_>, mut of: Steering) -> Result<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    for (name, constant) in CONSTANTS {
        dict.set_item(name, *constant(&mut of))?;
    }
    dict.set_item("boundary_center", vector(py, &of.boundary_center))?;
    Ok(dict)
}

/// A flock of a world: boids that keep together, and the forces on them.
///
/// A handle without data of its own, made by ``World.add_flock``.
#[pyclass(frozen, module = "tumble", name = "Flock")]
pub struct PyFlock {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(PyFlock, "Flock", |flock| flock.__len__().ok().map(|count| format!(": {count} boids")));

impl PyFlock {
    fn boid(&self, value: &Bound<'_, PyAny>) -> Result<ObjectId> {
        if value.is_instance_of::<PyString>() {
            let name: String = value.extract()?;
            let id = self.place.shared.read(|inner| Ok(inner.world.find(&name)))?;
            return id.ok_or_else(|| Error::Name(format!("the world has no boid named '{name}'")));
        }
        let boid = value.cast::<PyBoid>().map_err(PyErr::from)?.get();
        match Arc::ptr_eq(&boid.place.shared, &self.place.shared) {
            true => Ok(boid.place.id),
            false => Err(Error::value(format!("'{}' belongs to another world", boid.place.name))),
        }
    }
}

#[pymethods]
impl PyFlock {
    /// Its boids, in the order in which they were added: a list of ``Boid``.
    #[getter]
    fn boids(&self, py: Python<'_>) -> Result<Vec<PyBoid>> {
        let places: Vec<Place> = self.place.read(|inner| {
            let flock = inner.world.get::<Flock>(self.place.id)?;
            let present = flock.boids().iter().filter(|id| inner.world.status(**id).is_some());
            Some(present.map(|id| placed(&self.place.shared, inner, *id)).collect())
        })?;
        places.into_iter().map(|place| PyBoid::new(py, place)).collect()
    }

    /// The constants of its forces by name, as in ``World.add_flock``. Setting it changes those that are given, from the
    /// next step on.
    #[getter]
    fn steering<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyDict>> {
        let of = self.place.read(|inner| inner.world.get::<Flock>(self.place.id).map(|flock| *flock.steering()))?;
        steering_dict(py, of)
    }

    #[setter]
    fn set_steering(&self, py: Python<'_>, value: &Bound<'_, PyDict>) -> Result<()> {
        self.place.write(py, |inner| {
            let flock = inner.world.get_mut::<Flock>(self.place.id).ok_or_else(|| self.place.removed())?;
            let new = steering(*flock.steering(), Some(value))?;
            Ok(flock.set_steering(new)?)
        })
    }

    /// Adds a boid, also in flight, and returns its handle. name: unique; by default the world makes one. position: m,
    /// velocity: m/s, shape (3,). mass: kg. radius: of the sphere with which it collides, m. bank_time: seconds of its
    /// rate of turn that are a quarter turn of bank; roll_time: time constant of the roll, s. color: sRGB, each 0 to 1.
    #[pyo3(signature = (name="", position=None, velocity=None, *, mass=1.0, radius=0.2, bank_time=1.0, roll_time=0.2, color=None, **unknown), text_signature = "($self, name='', position=None, velocity=None, *, mass=1.0, radius=0.2, bank_time=1.0, roll_time=0.2, color=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add(
        &self,
        py: Python<'_>,
        name: &str,
        position: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        mass: f64,
        radius: f64,
        bank_time: f64,
        roll_time: f64,
        color: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<PyBoid> {
        keywords::check(unknown, "Flock.add")?;
        let boid = Boid::new(Shape::sphere(radius)?, mass)?
            .with_name(name)
            .with_position(vec3_or(position, "position", Vec3::zeros())?)
            .with_velocity(vec3_or(velocity, "velocity", Vec3::zeros())?)
            .with_bank(bank_time, roll_time)?;
        let place = self.place.write(py, |inner| {
            // the color of a flock is that of its place among the objects, so its boids are alike
            let number = inner.world.ids().iter().position(|id| *id == self.place.id).unwrap_or(0);
            let boid = boid.with_visuals(Boid::dart(4.0 * radius, appearance(color, number)?));
            let id = Flock::add(&mut inner.world, self.place.id, boid)?;
            Ok(placed(&self.place.shared, inner, id))
        })?;
        PyBoid::new(py, place)
    }

    /// Removes a boid, given as a handle or by name, from the flock and from the world.
    #[pyo3(signature = (boid, **unknown), text_signature = "($self, boid)")]
    fn remove(&self, py: Python<'_>, boid: &Bound<'_, PyAny>, unknown: Option<Unknown<'_, '_>>) -> Result<()> {
        keywords::check(unknown, "Flock.remove")?;
        let id = self.boid(boid)?;
        self.place.write(py, |inner| Ok(Flock::remove(&mut inner.world, self.place.id, id)?))
    }

    fn __len__(&self) -> Result<usize> {
        self.place.read(|inner| {
            let flock = inner.world.get::<Flock>(self.place.id)?;
            Some(flock.boids().iter().filter(|id| inner.world.status(**id).is_some()).count())
        })
    }
}

/// A boid of a flock: a point mass whose nose points along its velocity, and that banks into turns.
///
/// A handle without data of its own, made by ``Flock.add``. After the boid was removed every use raises
/// ``RemovedError``.
#[pyclass(frozen, module = "tumble", name = "Boid")]
pub struct PyBoid {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(PyBoid, "Boid", |_| Some(String::new()));

#[pymethods]
impl PyBoid {
    /// Mass, kg.
    #[getter]
    fn mass(&self) -> Result<f64> {
        self.place.read(|inner| inner.world.get::<Boid>(self.place.id).map(Boid::mass))
    }

    /// Position, shape (3,), m.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.place.part_state(0)?.position()))
    }

    /// Unit quaternion (x, y, z, w): x forward, y to the left, z up.
    #[getter]
    fn orientation<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(quaternion(py, &self.place.part_state(0)?.pose.rotation))
    }

    /// Velocity, shape (3,), m/s.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.place.part_state(0)?.velocity))
    }

    /// Bank about the nose, rad; negative in turns to the left.
    #[getter]
    fn bank(&self) -> Result<f64> {
        self.place.read(|inner| inner.world.state_of(self.place.id)?.get(3).copied())
    }
}
