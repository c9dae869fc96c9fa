//! Drives of all worlds of a batch at once.

use crate::arrays::convert::numbers;
use crate::batch::fields::{Layout, Rows};
use crate::batch::member::change;
use crate::errors::{Error, Result};
use crate::objects::joints::drive;
use crate::world::inner::Inner;
use pyo3::prelude::*;
use tumble::dynamics::{ArticulatedBody, Joint};

/// A setting of the drives of each degree of freedom in each world.
pub enum Setting {
    None,
    /// That of all joints.
    All(f64),
    Each(Rows),
}

impl Setting {
    /// Converts one number for all joints, a row for all worlds or a row for each. None stays None.
    pub fn new(name: &str, given: Option<&Bound<'_, PyAny>>, worlds: usize, dof: usize) -> Result<Setting> {
        let Some(given) = given else { return Ok(Setting::None) };
        let given = numbers(given, name)?;
        match given.shape.is_empty() {
            true => Ok(Setting::All(given.data[0])),
            false => Ok(Setting::Each(Rows::new(name, given, worlds, dof)?)),
        }
    }

    /// Returns the number of a degree of freedom; what is for all joints is not for a floating root.
    fn of(&self, world: usize, dof: usize, floating: bool) -> Option<f64> {
        match self {
            Setting::None => None,
            Setting::All(number) => Some(*number).filter(|_| !floating),
            Setting::Each(rows) => Some(rows.of(world)[dof]),
        }
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
        let (mut dof, floating) = (0, floating(layout, inner));
        change(layout, inner, |settings| {
            let of = |setting: &Setting| setting.of(world, dof, floating[dof]);
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

/// Returns whether each degree of freedom of the driven bodies is one of a floating root.
fn floating(layout: &Layout, inner: &Inner) -> Vec<bool> {
    let mut all = Vec::with_capacity(layout.dof());
    for driven in &layout.driven {
        let body = inner.world.get::<ArticulatedBody>(driven.id);
        let links = body.map_or(&[][..], |body| body.model().links());
        for link in links {
            all.resize(all.len() + link.joint.dof(), link.joint == Joint::Floating);
        }
    }
    all.resize(layout.dof(), false);
    all
}
