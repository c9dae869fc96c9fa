//! Constants of a rigid body in all worlds of a batch.

use crate::arrays::convert::{numbers, shown};
use crate::errors::{Error, Result};
use crate::world::inner::Inner;
use pyo3::prelude::*;

/// One number for all worlds, or one for each; none at all.
struct Each(Option<Vec<f64>>);

impl Each {
    fn new(name: &str, given: Option<&Bound<'_, PyAny>>, worlds: usize) -> Result<Each> {
        let Some(given) = given else { return Ok(Each(None)) };
        let given = numbers(given, name)?;
        if given.shape.is_empty() {
            return Ok(Each(Some(vec![given.data[0]; worlds])));
        }
        if given.shape != [worlds] {
            let got = shown(&given.shape);
            return Err(Error::value(format!("{name}: expected a number or shape ({worlds},), got {got}")));
        }
        Ok(Each(Some(given.data)))
    }

    fn of(&self, world: usize) -> Option<f64> {
        self.0.as_ref().map(|numbers| numbers[world])
    }
}

/// The constants of a body in all worlds.
pub struct Constants {
    mass: Each,
    friction: Each,
    restitution: Each,
}

impl Constants {
    /// Converts the arguments.
    pub fn new(
        worlds: usize,
        mass: Option<&Bound<'_, PyAny>>,
        friction: Option<&Bound<'_, PyAny>>,
        restitution: Option<&Bound<'_, PyAny>>,
    ) -> Result<Constants> {
        let each = |name, given| Each::new(name, given, worlds);
        Ok(Constants {
            mass: each("mass", mass)?,
            friction: each("friction", friction)?,
            restitution: each("restitution", restitution)?,
        })
    }

    /// Sets those of one world.
    pub fn set(&self, inner: &mut Inner, name: &str, world: usize) -> Result<()> {
        let Some(id) = inner.world.find(name) else {
            return Err(Error::Name(format!("unknown body '{name}'; Batch.world(0).bodies.names() lists them")));
        };
        let named = |error: tumble::dynamics::WorldError| Error::value(format!("world {world}: {error}"));
        if let Some(mass) = self.mass.of(world) {
            inner.world.set_mass(id, mass).map_err(named)?;
        }
        let (friction, restitution) = (self.friction.of(world), self.restitution.of(world));
        let change = |body: &mut tumble::dynamics::RigidBody| {
            body.material.friction = friction.unwrap_or(body.material.friction);
            body.material.restitution = restitution.unwrap_or(body.material.restitution);
        };
        inner.world.change_body(id, change).map_err(named)
    }
}
