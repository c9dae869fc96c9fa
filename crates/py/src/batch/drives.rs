//! Drives of all worlds of a batch at once.

use crate::arrays::convert::{Numbers, numbers};
use crate::batch::fields::{Layout, Rows};
use crate::batch::member::change;
use crate::errors::{Error, Result};
use crate::objects::joints::drive;
use crate::world::inner::Inner;
use pyo3::prelude::*;

/// A setting of the drives of each degree of freedom in each world.
pub struct Setting(Option<Rows>);

impl Setting {
    /// Converts one number for all, a row for all worlds or a row for each. None stays None.
    pub fn new(name: &str, given: Option<&Bound<'_, PyAny>>, worlds: usize, dof: usize) -> Result<Setting> {
        let Some(given) = given else { return Ok(Setting(None)) };
        let mut given = numbers(given, name)?;
        if given.shape.is_empty() {
            given = Numbers { shape: vec![dof], data: vec![given.data[0]; dof] };
        }
        Ok(Setting(Some(Rows::new(name, given, worlds, dof)?)))
    }

    fn of(&self, world: usize, dof: usize) -> Option<f64> {
        self.0.as_ref().map(|rows| rows.of(world)[dof])
    }
}

/// The drives of all worlds.
pub struct Drives {
    pub target: Setting,
    pub velocity: Setting,
    pub stiffness: Setting,
    pub damping: Setting,
    pub max_force: Setting,
}

impl Drives {
    /// Sets the drives of one world. A degree of freedom whose numbers are all 0 or None has none.
    pub fn set(&self, layout: &Layout, inner: &mut Inner, world: usize) -> Result<()> {
        let mut dof = 0;
        change(layout, inner, |settings| {
            let of = |setting: &Setting| setting.of(world, dof);
            let (stiffness, damping) = (of(&self.stiffness).unwrap_or(0.0), of(&self.damping).unwrap_or(0.0));
            let driven = stiffness != 0.0 || damping != 0.0;
            let target = of(&self.target).filter(|_| driven);
            let velocity = of(&self.velocity).filter(|v| driven || *v != 0.0);
            let limit = of(&self.max_force).unwrap_or(settings.effort);
            settings.drive = drive(target, velocity, stiffness, damping, limit)?;
            dof += 1;
            Ok(())
        })
        .map_err(|source| match source {
            Error::Python(error) => Error::Python(error),
            source => Error::value(format!("world {world}: {source}")),
        })
    }
}
