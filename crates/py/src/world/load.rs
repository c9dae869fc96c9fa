//! Worlds of scene files, and arguments that override the file.

use crate::errors::{Error, Result, caught};
use crate::objects::robot::Robot;
use crate::world::inner::Inner;
use std::sync::Arc;
use tumble::dynamics::{ArticulatedBody, Joint};
use tumble::scene::{SceneFile, WorldSettings};

/// Settings given to a constructor.
pub struct Choices<'a> {
    pub stepper: Option<&'a str>,
    pub integrator: Option<&'a str>,
    pub solver: Option<&'a str>,
    pub dt: Option<f64>,
    pub threads: Option<u32>,
    pub budget: Option<u32>,
}

impl Choices<'_> {
    /// Writes them into a scene's settings.
    pub fn apply(&self, world: &mut WorldSettings) -> Result<()> {
        world.dt_s = self.dt.unwrap_or(world.dt_s);
        world.threads = self.threads.unwrap_or(world.threads);
        world.budget = self.budget.or(world.budget);
        let invalid = |what: &str| {
            let what = what.to_string();
            move |e: tumble::scene::UnknownName| Error::value(format!("{what}: {e}"))
        };
        world.stepper = self.stepper.map_or(Ok(world.stepper), |s| s.parse().map_err(invalid("stepper")))?;
        world.integrator =
            self.integrator.map_or(Ok(world.integrator), |s| s.parse().map_err(invalid("integrator")))?;
        world.solver = self.solver.map_or(Ok(world.solver), |s| s.parse().map_err(invalid("solver")))?;
        Ok(())
    }
}

/// Builds the world of a scene.
pub fn build(scene: SceneFile) -> Result<Inner> {
    let (world, notes) = caught(|| Ok(scene.build()?))?;
    let mut inner = Inner::new(world, Arc::new(scene));
    inner.notes = notes;
    let scene = inner.scene.clone();
    for spec in &scene.articulated {
        let Some((id, body)) =
            inner.world.find(&spec.name).and_then(|id| Some((id, inner.world.get::<ArticulatedBody>(id)?)))
        else {
            continue;
        };
        let joints = spec
            .links
            .iter()
            .filter(|link| link.joint.kind != Joint::Fixed)
            .map(|link| link.joint.name.clone())
            .collect();
        let robot = Robot { model: body.model().clone(), base: *body.base(), joints };
        inner.robots.insert(id, Arc::new(robot));
    }
    Ok(inner)
}
