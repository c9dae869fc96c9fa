//! Bodies that are not there yet: what an event can spawn.

use super::EventError;
use crate::object::net_sync::{read_state, write_state};
use crate::object::part_state::StateRange;
use crate::object::{FrameState, NetSync, Object, SyncError};
use crate::rigid::RigidBody;
use crate::world::view::{Mode, ObjectId, WorldView};
use crate::world::{World, WorldError};
use crate::{Frame, FrameImpulse};

/// Largest number of bodies of one template.
pub const MAX_SPAWNED: usize = 10_000;

/// State: how often it has spawned, how often none was free, then per body the frame of its last spawn.
pub(super) const HEADER: usize = 2;

/// A store of equal rigid bodies, which are in the world from the start, disabled. An
/// [`Action::Spawn`](super::Action::Spawn) enables the first one that is disabled. Removing a body disables it
/// again.
///
/// They need no time while they are disabled, but a step copies their states.
#[derive(Clone, Debug)]
pub struct Template {
    name: String,
    pub(crate) bodies: Vec<ObjectId>,
    pub(crate) reuse: bool,
}

impl Template {
    /// Adds a template of `count` bodies, 1 to [`MAX_SPAWNED`], to a world. They are named after it: `NAME 1`, `NAME 2` and
    /// so on. With `reuse` the oldest one is spawned again when all are in use; otherwise nothing is spawned then.
    ///
    /// ```
    /// # use tumble_core::{Action, ScriptedEvent, Template, Trigger, prelude::*};
    /// # let mut world = World::default();
    /// let ball = RigidBody::new(Shape::sphere(0.1)?).with_mass(1.0);
    /// let balls = Template::add(&mut world, "ball", &ball, 20, false)?;
    /// let drop = ScriptedEvent::new("drop", Trigger::Every { period: 0.5, first: 0.5 });
    /// world.add(drop.with_action(Action::spawn(balls, Pose::translation(0.0, 0.0, 3.0), Vec3::zeros())))?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`WorldError::Event`] for a count out of its range, or the error of a body that cannot be added. Nothing is added then.
    pub fn add(
        world: &mut World,
        name: &str,
        body: &RigidBody,
        count: usize,
        reuse: bool,
    ) -> Result<ObjectId, WorldError> {
        if !(1..=MAX_SPAWNED).contains(&count) {
            return Err(WorldError::Event { name: name.into(), why: EventError::Count(count) });
        }
        let mut bodies = Vec::with_capacity(count);
        let mut add = |world: &mut World| -> Result<ObjectId, WorldError> {
            for number in 1..=count {
                let id =
                    world.add_boxed(Box::new(body.clone().with_name(format!("{name} {number}"))), Mode::Dynamic)?;
                bodies.push(id);
                world.set_enabled(id, false)?;
            }
            world.add_boxed(Box::new(Template::of(name, bodies.clone(), reuse)), Mode::Dynamic)
        };
        let added = add(world);
        if added.is_err() {
            bodies.iter().for_each(|&id| drop(world.remove(id)));
        }
        added
    }

    pub(crate) fn of(name: impl Into<String>, bodies: Vec<ObjectId>, reuse: bool) -> Template {
        Template { name: name.into(), bodies, reuse }
    }

    /// Returns its bodies, disabled ones too.
    pub fn bodies(&self) -> &[ObjectId] {
        &self.bodies
    }

    /// Returns whether the oldest body is spawned again when all are in use.
    pub fn reuses(&self) -> bool {
        self.reuse
    }

    /// Returns how often a template has spawned a body, and how often it could not because all were in use.
    /// `None` if the id is of another object.
    pub fn counts(world: &World, template: ObjectId) -> Option<[u64; 2]> {
        world.get::<Template>(template)?;
        let x = world.state_of(template)?;
        Some([x[0] as u64, x[1] as u64])
    }
}

impl Object for Template {
    fn name(&self) -> &str {
        &self.name
    }
    fn frame_state(&self) -> Option<&dyn FrameState> {
        Some(self)
    }
    fn net_sync(&self) -> Option<&dyn NetSync> {
        Some(self)
    }
}

impl FrameState for Template {
    fn len(&self) -> usize {
        HEADER + self.bodies.len()
    }
    fn accepts(&self, x: &[f64]) -> bool {
        x.iter().all(|x| x.is_finite() && *x >= 0.0)
    }
    fn advance(&self, _: &StateRange, _: &Frame, _: &mut [f64], _: &mut Vec<FrameImpulse>) {}
}

impl NetSync for Template {
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>) {
        write_state(&view.x[me.x.clone()], out);
    }
    fn read_data(&self, data: &[u8], x: &mut [f64]) -> Result<(), SyncError> {
        read_state(data, x, |x| self.accepts(x))
    }
}
