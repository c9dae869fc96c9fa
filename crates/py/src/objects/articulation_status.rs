//! The status of an articulated body of a world, as of a rigid one: mode, switches, sleep, collision filter and contacts.

use crate::arrays::whole;
use crate::choices::{MODES, meaning, word};
use crate::errors::Result;
use crate::objects::articulation::Articulation;
use crate::objects::link::groups_of;
use crate::world::{contacts, query};
use pyo3::prelude::*;
use tumble::dynamics::{ArticulatedBody, CollisionGroup};

impl Articulation {
    /// Returns group and mask of all its shapes, where they are the same.
    fn groups(&self) -> Result<[Option<u64>; 2]> {
        self.of_body(|body| groups_of(body, |_| true))
    }

    fn set_groups(&self, py: Python<'_>, group: Option<CollisionGroup>, mask: Option<u64>) -> Result<()> {
        let place = self.in_world()?;
        place.write(py, |inner| {
            let body = inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            body.change_groups(|own, all| (group.unwrap_or(own), mask.unwrap_or(all)));
            Ok(())
        })
    }
}

#[pymethods]
impl Articulation {
    /// ``"dynamic"``, ``"kinematic"`` (its joints move at their velocities, whatever it collides with) or ``"static"``, of a
    /// body in a world.
    #[getter]
    fn mode(&self) -> Result<&'static str> {
        Ok(word(self.in_world()?.status()?.mode, MODES))
    }

    #[setter]
    fn set_mode(&self, py: Python<'_>, value: &str) -> Result<()> {
        let (place, mode) = (self.in_world()?, meaning("mode", value, MODES)?);
        place.write(py, |inner| Ok(inner.world.set_mode(place.id, mode)?))
    }

    /// Whether it takes part in the simulation of its world. A disabled body keeps its state.
    #[getter]
    fn enabled(&self) -> Result<bool> {
        Ok(self.in_world()?.status()?.enabled)
    }

    #[setter]
    fn set_enabled(&self, py: Python<'_>, value: bool) -> Result<()> {
        let place = self.in_world()?;
        place.write(py, |inner| Ok(inner.world.set_enabled(place.id, value)?))
    }

    /// Whether it sleeps in its world: the steps leave it out until something touches it (``World(sleep_after=…)``). Any
    /// change wakes it.
    #[getter]
    fn asleep(&self) -> Result<bool> {
        let place = self.in_world()?;
        place.status()?;
        place.shared.read(|inner| Ok(inner.world.asleep(place.id)))
    }

    /// Whether it collides in its world.
    #[getter]
    fn collidable(&self) -> Result<bool> {
        Ok(self.in_world()?.status()?.collidable)
    }

    #[setter]
    fn set_collidable(&self, py: Python<'_>, value: bool) -> Result<()> {
        let place = self.in_world()?;
        place.write(py, |inner| Ok(inner.world.set_collidable(place.id, value)?))
    }

    /// Collision group of its shapes, 0 to 63; None if it has no shape or they differ. Two bodies collide if the group of
    /// each is in the mask of the other. Settable for a body in a world; ``Link.group`` is that of one link.
    #[getter]
    fn group(&self) -> Result<Option<u64>> {
        Ok(self.groups()?[0])
    }

    #[setter]
    fn set_group(&self, py: Python<'_>, #[pyo3(from_py_with = whole::group)] value: u8) -> Result<()> {
        self.set_groups(py, Some(query::group(value)?), None)
    }

    /// Groups that its shapes collide with, one bit each; None if it has no shape or they differ. May be set, for a body in a
    /// world, to a sequence of groups, or None for all.
    #[getter]
    fn mask(&self) -> Result<Option<u64>> {
        Ok(self.groups()?[1])
    }

    #[setter]
    fn set_mask(&self, py: Python<'_>, value: Option<&Bound<'_, PyAny>>) -> Result<()> {
        self.set_groups(py, None, Some(query::mask(value)?))
    }

    /// The bodies in contact with it after the last step, or in a sensor of it: a list of handles in the order of
    /// ``world.bodies``.
    #[getter]
    fn touching(&self, py: Python<'_>) -> Result<Vec<Py<PyAny>>> {
        let place = self.in_world()?;
        place.status()?;
        contacts::touching(&place.shared, py, place.id)
    }
}
