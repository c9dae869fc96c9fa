//! A world with its Python-side data. One call at a time works on it.

use crate::arrays::convert::shown;
use crate::arrays::state::Shown;
use crate::errors::{Error, Result};
use crate::extension::callbacks::Extension;
use crate::objects::robot::Robot;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use tumble::dynamics::{ObjectId, World, WorldState};
use tumble::scene::{SceneFile, overlap_notes, visual_notes};

/// A world with its Python-side data.
pub struct Inner {
    /// The world itself.
    pub world: World,
    /// The scene that it was built from: its camera, lights and names.
    pub scene: Arc<SceneFile>,
    /// The models of articulated bodies.
    pub robots: BTreeMap<ObjectId, Arc<Robot>>,
    /// Generalized forces that act on articulated bodies in every frame.
    pub efforts: BTreeMap<ObjectId, Vec<f64>>,
    /// The callbacks of Python in the world: forces, behaviors, callables and intersection tests.
    pub extension: Extension,
    /// The array through which Python sees the state.
    pub shown: Shown,
    /// Notes about the files that it was built from.
    pub notes: Vec<String>,
    /// Notes about overlapping bodies, as found before the first step.
    pub overlaps: Vec<String>,
    /// The state before a frame with callbacks. Its memory is reused.
    before: WorldState,
    /// Generalized forces that were applied before those of `efforts`. Its memory is reused.
    applied: Vec<f64>,
    /// Whether a panic left it in an inconsistent state.
    pub broken: bool,
}

impl Inner {
    /// Returns the world of a scene.
    pub fn new(world: World, scene: Arc<SceneFile>) -> Inner {
        Inner {
            world,
            scene,
            robots: BTreeMap::new(),
            efforts: BTreeMap::new(),
            extension: Extension::default(),
            shown: Shown::default(),
            notes: Vec::new(),
            overlaps: Vec::new(),
            before: WorldState::default(),
            applied: Vec::new(),
            broken: false,
        }
    }

    /// Returns an independent copy without arrays.
    pub fn fork(&self) -> Inner {
        let mut world = self.world.fork();
        let extension = self.extension.fork(&mut world);
        Inner {
            world,
            scene: self.scene.clone(),
            robots: self.robots.clone(),
            efforts: self.efforts.clone(),
            extension,
            shown: Shown::default(),
            notes: self.notes.clone(),
            overlaps: self.overlaps.clone(),
            before: WorldState::default(),
            applied: Vec::new(),
            broken: false,
        }
    }

    /// Returns whether a Python array refers to the memory that the next frame changes.
    pub fn looked_into(&self, py: Python<'_>) -> bool {
        self.extension.is_empty() && self.shown.alive(py)
    }

    /// Sets the generalized forces on articulated bodies: `row` has those of one after the other.
    pub fn set_efforts(&mut self, driven: impl IntoIterator<Item = (ObjectId, usize)>, mut row: &[f64]) {
        for (id, dof) in driven {
            let (own, rest) = row.split_at(dof);
            let efforts = self.efforts.entry(id).or_default();
            efforts.clear();
            efforts.extend_from_slice(own);
            row = rest;
        }
    }

    /// Steps by one frame. On an error the world is as it was before, and has none of the frame's forces.
    pub fn step(&mut self) -> Result<()> {
        self.take_raised()?; // by a `fork`
        if self.extension.is_empty() {
            return self.plain_frame();
        }
        self.world.checkpoint(&mut self.before);
        let outcome = self.extended_frame();
        if outcome.is_err() {
            self.world.roll_back(&self.before);
        }
        outcome
    }

    /// Steps by one frame without callbacks. The world itself goes back on an error, except for the forces applied for the
    /// frame.
    fn plain_frame(&mut self) -> Result<()> {
        self.applied.clear();
        for (&id, effort) in &self.efforts {
            let end = self.applied.len() + effort.len();
            self.applied.extend_from_slice(self.world.applied_generalized(id).unwrap_or_default());
            self.applied.resize(end, 0.0);
        }
        let outcome = self.frame();
        if outcome.is_err() {
            let mut rest = &self.applied[..];
            for (&id, effort) in &self.efforts {
                let (own, after) = rest.split_at(effort.len());
                if self.world.applied_generalized(id).is_some() {
                    self.world.set_applied_generalized(id, own)?;
                }
                rest = after;
            }
        }
        outcome
    }

    /// Steps the world alone by one frame, under the generalized forces on articulated bodies.
    pub fn frame(&mut self) -> Result<()> {
        for (&id, effort) in &self.efforts {
            self.world.apply_generalized(id, effort)?;
        }
        self.world.step()?;
        Ok(())
    }

    /// Returns notes about files, visual meshes that could not be drawn, and bodies that overlap at
    /// the start. Overlaps are searched for now if no step was taken yet; later calls return those
    /// found then.
    pub fn all_notes(&mut self) -> Vec<String> {
        if self.world.frame() == 0 {
            self.overlaps = overlap_notes(&self.world);
        }
        let found = visual_notes(self.world.visuals()).into_iter().chain(self.overlaps.iter().cloned());
        self.notes.iter().cloned().chain(found).collect()
    }

    /// Drops the data about a removed object.
    pub fn forget(&mut self, id: ObjectId) {
        self.robots.remove(&id);
        self.efforts.remove(&id);
        self.extension.forget(id);
    }

    /// Writes the whole state, or nothing on an error.
    pub fn write_state(&mut self, shape: &[usize], x: &[f64]) -> Result<()> {
        let wanted = self.world.state().len();
        if shape != [wanted] {
            return Err(Error::value(format!("state: expected shape ({wanted},), got {}", shown(shape))));
        }
        let before = self.world.state().to_vec();
        let mut write = |from: &[f64]| -> Result<()> {
            let ids = self.world.ids().to_vec();
            for id in ids {
                let Some(span) = self.world.view().state_range(id).map(|span| span.x.clone()).filter(|x| !x.is_empty())
                else {
                    continue;
                };
                self.world.write_state_of(id, &from[span])?;
            }
            Ok(())
        };
        let outcome = write(x);
        if outcome.is_err() {
            write(&before)?;
        }
        outcome
    }
}
