//! Forces from Rust closures.

use crate::object::part_state::{Forces, PartState, StateRange};
use crate::object::{ForceGenerator, Object};
use crate::world::view::{ObjectId, WorldView};
use crate::world::{World, WorldError};
use std::sync::Arc;
use tumble_collide::Vec3;

type Function = dyn Fn(&WorldView, &mut Forces) + Send + Sync;

/// An object that is a force: a function of the view.
#[derive(Clone)]
struct ForceFunction {
    name: String,
    function: Arc<Function>,
}

impl Object for ForceFunction {
    fn name(&self) -> &str {
        &self.name
    }

    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for ForceFunction {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        (self.function)(view, out);
    }
}

impl World {
    /// Adds a force from a function, which the integrator calls at each stage with the state and
    /// time of that stage. Forks share the function, so it must depend on the view alone. Archives
    /// do not contain it: add it again after opening one.
    ///
    /// ```
    /// use tumble_core::prelude::*;
    /// let mut world = World::default();
    /// let balloon = world.add(RigidBody::new(Shape::sphere(0.2)?).with_name("balloon").with_mass(0.1))?;
    /// let wind = Vec3::new(3.0, 0.0, 0.0);
    /// world.add_force("wind", move |view, out| out.act_on(view, balloon, |state| 0.5 * (wind - state.velocity)))?;
    /// world.step()?;
    /// assert!(world.body(balloon)?.velocity().x > 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`WorldError::DuplicateName`] if an object has that name.
    pub fn add_force(
        &mut self,
        name: impl Into<String>,
        function: impl Fn(&WorldView, &mut Forces) + Send + Sync + 'static,
    ) -> Result<ObjectId, WorldError> {
        self.add(ForceFunction { name: name.into(), function: Arc::new(function) })
    }
}

impl Forces {
    /// Adds a force (N, world axes) at the origin of an object's part 0, which is the center of
    /// mass of a rigid body. `force` computes it from the state of that part. Does nothing if the
    /// object was removed or has no part.
    pub fn act_on(&mut self, view: &WorldView, id: ObjectId, force: impl FnOnce(&PartState) -> Vec3) {
        let part_state =
            view.state_range(id).and_then(|state_range| Some((state_range.parts.start, view.part_state(id, 0)?)));
        if let Some((index, part_state)) = part_state {
            self.wrenches[index].force += force(part_state);
        }
    }
}
