//! Flocks of rigid bodies.

use crate::arrays::convert::{some, vector};
use crate::behaviors::flock::{steering, steering_dict};
use crate::behaviors::placed;
use crate::errors::{Error, Result};
use crate::objects::body::RigidBody;
use crate::objects::place::{Place, hash};
use crate::world::add::own_place;
use crate::world::class::World;
use crate::world::gc::{Anchor, anchor};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::behaviors::{BodyFlock, Helm, Steering};
use tumble::collide::Vec3;

/// A flock of rigid bodies of a world: the forces of a flock on their centers of mass, and torques that turn the nose (x) of each along
/// its velocity and bank it into turns.
///
/// A handle without data of its own, made by ``World.add_body_flock``.
#[pyclass(frozen, module = "tumble", name = "BodyFlock")]
pub struct PyBodyFlock {
    pub place: Place,
    anchor: Py<Anchor>,
}

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
    if let Some(up) = given.get_item("up")? {
        of.up = Vec3::from(some::<3>(&up, "up")?);
        given.del_item("up")?;
    }
    of.validate()?;
    Ok(of)
}

impl PyBodyFlock {
    /// Returns a handle.
    pub fn new(py: Python<'_>, place: Place) -> Result<PyBodyFlock> {
        Ok(PyBodyFlock { anchor: anchor(py, &place.shared)?, place })
    }

    fn change<T>(&self, py: Python<'_>, change: impl FnOnce(&mut BodyFlock) -> Result<T>) -> Result<T> {
        self.place.write(py, |inner| {
            change(inner.world.get_mut::<BodyFlock>(self.place.id).ok_or_else(|| self.place.removed())?)
        })
    }
}

#[pymethods]
impl PyBodyFlock {
    /// Name, unique in its world.
    #[getter]
    fn name(&self) -> &str {
        &self.place.name
    }

    /// Whether its world still has it.
    #[getter]
    fn exists(&self) -> Result<bool> {
        self.place.shared.read(|inner| Ok(inner.world.status(self.place.id).is_some()))
    }

    /// Its bodies, in the order in which they were added.
    #[getter]
    fn bodies(&self, py: Python<'_>) -> Result<Vec<RigidBody>> {
        let places: Vec<Place> = self.place.read(|inner| {
            let bodies = inner.world.get::<BodyFlock>(self.place.id)?.bodies().iter();
            let present = bodies.filter(|id| inner.world.status(**id).is_some());
            Some(present.map(|id| placed(&self.place.shared, inner, *id)).collect())
        })?;
        places.into_iter().map(|place| RigidBody::new(py, place)).collect()
    }

    /// Adds a rigid body of the world, given as a handle or by name. Gravity acts beside the flock: a body that its wings carry has
    /// ``gravity_scale=0``.
    fn add(&self, py: Python<'_>, body: &Bound<'_, PyAny>) -> Result<()> {
        let place = own_place(&self.place.shared, body)?;
        let rigid =
            self.place.shared.read(|inner| Ok(inner.world.get::<tumble::dynamics::RigidBody>(place.id).is_some()))?;
        if !rigid {
            return Err(Error::value(format!("'{}' is not a rigid body", place.name)));
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
    fn remove(&self, py: Python<'_>, body: &Bound<'_, PyAny>) -> Result<()> {
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

    fn __repr__(&self) -> String {
        match self.__len__() {
            Ok(count) => format!("<BodyFlock '{}': {count} bodies>", self.place.name),
            Err(_) => format!("<BodyFlock '{}', removed>", self.place.name),
        }
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<PyBodyFlock>().is_ok_and(|other| self.place.same(&other.get().place))
    }

    fn __hash__(&self) -> u64 {
        hash(&self.place)
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> std::result::Result<(), PyTraverseError> {
        visit.call(&self.anchor)
    }
}

#[pymethods]
impl World {
    /// Adds a flock of rigid bodies without bodies and returns its handle; ``BodyFlock.add`` adds bodies of the world.
    ///
    /// Keywords are the constants of the forces, as in ``add_flock``, and of the helm: ``agility``, rate at which the orientation
    /// approaches the wanted one (1/s); ``max_angular_acceleration`` (rad/s²); ``bank_time``, seconds of the rate of turn that are a
    /// quarter turn of bank; ``up``, the direction that is up for a body without bank.
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
