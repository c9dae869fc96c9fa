//! A flock: the list of its boids and the forces on them (thesis §V.B.5, appendix A).
//!
//! A flock has no state. It is a force: at each stage of a step it reads the positions, velocities
//! and noses of its boids, and adds the force that [`Steering`] computes to each. Boids are added and
//! removed between steps; ids of boids that were removed from the world are ignored.

use crate::boid::Boid;
use crate::error::BehaviorError;
use crate::kept::Kept;
use crate::record;
use crate::steering::{Flyer, Search, Sorted, Steering};
use tumble_collide::Vec3;
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::{ForceGenerator, Forces, Object, ObjectId, StateRange, World, WorldView};

/// Least number of boids on a thread.
const PIECE: usize = 64;

/// A flock of [`Boid`]s in one world.
#[derive(Clone, Debug)]
pub struct Flock {
    name: String,
    steering: Steering,
    pub(crate) search: Search,
    pub(crate) boids: Vec<ObjectId>,
    memory: Kept<Memory>,
}

#[derive(Default)]
struct Memory {
    /// Row of the part table and state of each boid that takes part.
    found: Vec<Option<(usize, Flyer)>>,
    rows: Vec<usize>,
    flyers: Vec<Flyer>,
    sorted: Sorted,
}

impl Flock {
    /// Makes a flock without boids.
    ///
    /// # Errors
    /// As [`Steering::validate`].
    pub fn new(name: impl Into<String>, steering: Steering) -> Result<Flock, BehaviorError> {
        steering.validate()?;
        Ok(Flock { name: name.into(), steering, search: Search::Grid, boids: Vec::new(), memory: Kept::default() })
    }
    /// Sets how neighbors are found; the forces have the same bits.
    pub fn with_search(self, search: Search) -> Flock {
        Flock { search, ..self }
    }
    /// Returns the constants.
    pub fn steering(&self) -> &Steering {
        &self.steering
    }
    /// Changes the constants from the next step on.
    ///
    /// # Errors
    /// As [`Steering::validate`]. The constants then stay as they are.
    pub fn set_steering(&mut self, steering: Steering) -> Result<(), BehaviorError> {
        steering.validate()?;
        self.steering = steering;
        Ok(())
    }
    /// Returns the ids of the boids, in the order in which they were added. Boids that were removed
    /// by [`World::remove`] stay in the list until the next change of it.
    pub fn boids(&self) -> &[ObjectId] {
        &self.boids
    }

    /// Adds a boid to the world and to a flock of it, and returns its id.
    ///
    /// # Errors
    /// [`BehaviorError::NoFlock`], or [`BehaviorError::World`] as of [`World::add`]. Nothing is added then.
    pub fn add(world: &mut World, flock: ObjectId, boid: Boid) -> Result<ObjectId, BehaviorError> {
        world.get::<Flock>(flock).ok_or(BehaviorError::NoFlock)?;
        let id = world.add(boid)?;
        world.get_mut::<Flock>(flock).ok_or(BehaviorError::NoFlock)?.boids.push(id);
        Ok(id)
    }

    /// Removes a boid from a flock and from the world.
    ///
    /// # Errors
    /// [`BehaviorError::NoFlock`]; [`BehaviorError::NoBoid`] if the object is not in the flock or was
    /// removed from the world before.
    pub fn remove(world: &mut World, flock: ObjectId, boid: ObjectId) -> Result<(), BehaviorError> {
        let boids = &mut world.get_mut::<Flock>(flock).ok_or(BehaviorError::NoFlock)?.boids;
        let place = boids.iter().position(|id| *id == boid).ok_or(BehaviorError::NoBoid)?;
        boids.remove(place);
        world.remove(boid).map(drop).map_err(|_| BehaviorError::NoBoid)
    }
}

impl Object for Flock {
    fn record(&self, indices: &ObjectIndices) -> Option<ObjectRecord> {
        record::flock(self, indices)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Flock {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        self.memory.lend(|Memory { found, rows, flyers, sorted }| {
            found.resize(self.boids.len(), None);
            view.each_piece(found, PIECE, |first, found| {
                found.iter_mut().zip(&self.boids[first..]).for_each(|(found, id)| *found = flyer(view, *id));
            });
            rows.clear();
            rows.extend(found.iter().flatten().map(|(row, _)| *row));
            flyers.clear();
            flyers.extend(found.iter().flatten().map(|(_, flyer)| *flyer));
            self.steering.forces_by(self.search, flyers, sorted, |forces, work| {
                view.each_piece(forces, PIECE, work);
            });
            for (row, force) in rows.iter().zip(&sorted.forces) {
                out.wrenches[*row].force += force;
            }
        });
    }
}

/// Returns the row of the part table and the state of a boid that is in the world and enabled.
fn flyer(view: &WorldView, id: ObjectId) -> Option<(usize, Flyer)> {
    view.status(id).filter(|status| status.enabled)?;
    let (boid, row) = (view.get::<Boid>(id)?, view.state_range(id)?.parts.start);
    let state = &view.part_states[row];
    let (position, velocity) = (state.position(), state.velocity);
    Some((row, Flyer { position, velocity, forward: state.pose.rotation * Vec3::x(), mass: boid.mass() }))
}
