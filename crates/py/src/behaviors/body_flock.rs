//! Flocks of rigid and articulated bodies.

use crate::arrays::convert::vector;
use crate::behaviors::flock::{steering, steering_dict};
use crate::behaviors::placed;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::bodies::handle as handle_of;
use crate::objects::handle::handle;
use crate::objects::place::{Found, Place, found};
use crate::world::add::own_place;
use crate::world::class::World;
use crate::world::gc::Anchor;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::behaviors::{BodyFlock, Helm, Steering};

/// A flock of rigid and articulated bodies of a world: the forces of a flock on their centers of mass, and torques that turn the nose (x)
/// of each, or of its first link, along its velocity and bank it into turns.
///
/// A handle without data of its own, made by ``World.add_body_flock``.
#[pyclass(frozen, module = "tumble", name = "BodyFlock")]
pub struct PyBodyFlock {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(PyBodyFlock, "BodyFlock", |flock| flock.__len__().ok().map(|count| format!(": {count} bodies")));

/// Returns the constants of a helm with those that are given by name, which are taken out of `given`.
fn helm(mut of: Helm, given: &Bound<'_, PyDict>) -> Result<Helm> {
    let numbers: [(&str, &mut f64); 3] = [
        ("agility", &mut of.agility),
        ("max_angular_acceleration", &mut of.max_angular_acceleration),
        ("bank_time", &mut of.bank_time),
    ];
    for (name, number) in numbers {
        if let Some(value) = given.get_item(name)? {
            *number = value.extract()?;
            given.del_item(name)?;
        }
    }
    for (name, vector) in [("up", &mut of.up), ("wind", &mut of.wind)] {
        if let Some(value) = given.get_item(name)? {
            *vector = crate::arrays::convert::direction(&value, name)?;
            given.del_item(name)?;
        }
    }
    of.validate()?;
    Ok(of)
}

impl PyBodyFlock {
    fn change<T>(&self, py: Python<'_>, change: impl FnOnce(&mut BodyFlock) -> Result<T>) -> Result<T> {
        self.place.write(py, |inner| {
            change(inner.world.get_mut::<BodyFlock>(self.place.id).ok_or_else(|| self.place.removed())?)
        })
    }
}

#[pymethods]
impl PyBodyFlock {
    /// Its bodies, in the order in which they were added.
    #[getter]
    fn bodies(&self, py: Python<'_>) -> Result<Vec<Py<PyAny>>> {
        let present: Vec<Found> = self.place.read(|inner| {
            let bodies = inner.world.get::<BodyFlock>(self.place.id)?.bodies().iter();
            Some(bodies.filter_map(|id| found(inner, *id)).collect())
        })?;
        present.into_iter().map(|body| handle_of(py, &self.place.shared, body)).collect()
    }

    /// Adds a rigid body of the world, or an articulation whose first link floats, given as a handle or by name. Gravity acts beside
    /// the flock: a rigid body that no wings carry has ``gravity_scale=0``.
    #[pyo3(signature = (body, **unknown), text_signature = "($self, body)")]
    fn add(&self, py: Python<'_>, body: &Bound<'_, PyAny>, unknown: Option<Unknown<'_, '_>>) -> Result<()> {
        keywords::check(unknown, "BodyFlock.add")?;
        let place = own_place(&self.place.shared, body)?;
        let steered =
            self.place.shared.read(|inner| Ok(inner.world.object(place.id).is_some_and(BodyFlock::steers)))?;
        if !steered {
            return Err(Error::value(format!(
                "'{}': expected a rigid body, or an articulation whose first link floats",
                place.name
            )));
        }
        self.change(py, |flock| match flock.bodies().contains(&place.id) {
            true => Err(Error::value(format!("'{}' is in the flock", place.name))),
            false => {
                flock.push(place.id);
                Ok(())
            }
        })
    }

    /// Removes a body, given as a handle or by name, from the flock. It stays in the world.
    #[pyo3(signature = (body, **unknown), text_signature = "($self, body)")]
    fn remove(&self, py: Python<'_>, body: &Bound<'_, PyAny>, unknown: Option<Unknown<'_, '_>>) -> Result<()> {
        keywords::check(unknown, "BodyFlock.remove")?;
        let place = own_place(&self.place.shared, body)?;
        self.change(py, |flock| match flock.release(place.id) {
            true => Ok(()),
            false => Err(Error::Name(format!("'{}' is not in the flock", place.name))),
        })
    }

    /// The constants of its forces and of its helm by name, as in ``World.add_body_flock``. Setting it changes those that are given, from
    /// the next step on.
    #[getter]
    fn steering<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyDict>> {
        let (of, helm) = self.place.read(|inner| {
            inner.world.get::<BodyFlock>(self.place.id).map(|flock| (*flock.steering(), *flock.helm()))
        })?;
        let dict = steering_dict(py, of)?;
        dict.set_item("agility", helm.agility)?;
        dict.set_item("max_angular_acceleration", helm.max_angular_acceleration)?;
        dict.set_item("bank_time", helm.bank_time)?;
        dict.set_item("up", vector(py, &helm.up))?;
        dict.set_item("wind", vector(py, &helm.wind))?;
        Ok(dict)
    }

    #[setter]
    fn set_steering(&self, py: Python<'_>, value: &Bound<'_, PyDict>) -> Result<()> {
        let value = value.copy()?;
        self.change(py, |flock| {
            let helm = helm(*flock.helm(), &value)?;
            let steering = steering(*flock.steering(), Some(&value))?;
            Ok(flock.set_constants(steering, helm)?)
        })
    }

    fn __len__(&self) -> Result<usize> {
        self.place.read(|inner| {
            let bodies = inner.world.get::<BodyFlock>(self.place.id)?.bodies();
            Some(bodies.iter().filter(|id| inner.world.status(**id).is_some()).count())
        })
    }
}

#[pymethods]
impl World {
    /// Adds a flock of rigid and articulated bodies, empty, and returns its handle; ``BodyFlock.add`` adds bodies of the world.
    ///
    /// Keywords are the constants of the forces, as in ``add_flock``, and of the helm: ``agility``, rate at which the orientation
    /// approaches the wanted one (1/s); ``max_angular_acceleration`` (rad/s²); ``bank_time``, seconds of the rate of turn that are a
    /// quarter turn of bank; ``up``, the direction that is up for a body without bank; ``wind``, velocity of the air in which bodies
    /// fly (m/s).
    #[pyo3(signature = (name="", **steering))]
    fn add_body_flock(&self, py: Python<'_>, name: &str, steering: Option<&Bound<'_, PyDict>>) -> Result<PyBodyFlock> {
        let given = steering.map_or_else(|| Ok(PyDict::new(py)), |given| given.copy())?;
        let helm = helm(Helm::default(), &given)?;
        let flock = BodyFlock::new(name, self::steering(Steering::default(), Some(&given))?, helm)?;
        let place = self.shared.write(py, |inner| {
            let id = inner.world.add(flock)?;
            Ok(placed(&self.shared, inner, id))
        })?;
        PyBodyFlock::new(py, place)
    }
}
