//! Callbacks of scripted events: functions of the program that are called when an event fires.

use super::action::{Action, Subject};
use super::event::ScriptedEvent;
use crate::world::view::ObjectId;
use crate::world::{Event, EventKind, StepError, World};
use std::fmt;
use std::sync::Arc;
use tumble_collide::Vec3;

/// A firing of a scripted event, with its cause.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Firing {
    /// The event that fired.
    pub event: ObjectId,
    /// The body that made it fire: the other one of a contact, the visitor of a sensor, the body that fell asleep or woke.
    pub other: Option<ObjectId>,
    /// Impulse of a contact on `other` over the frame, N·s, world axes; zero for all but contacts that begin or persist.
    pub impulse: Vec3,
    /// The contact point with the largest impulse, m, world axes; zero like the impulse.
    pub point: Vec3,
}

impl Firing {
    /// Returns the firing behind an event of kind [`EventKind::Fired`] of the world's last frame. Of several contacts
    /// that made it fire it has the one with the largest impulse.
    pub fn of(world: &World, fired: &Event) -> Firing {
        let trigger = world.get::<ScriptedEvent>(fired.a).map(ScriptedEvent::trigger);
        let met = |e: &&Event| fired.b.is_some() && trigger.is_some_and(|trigger| trigger.met(e) == Some(fired.b));
        let cause = world.events().iter().filter(met).max_by(|a, b| a.impulse.norm().total_cmp(&b.impulse.norm()));
        let on_other = |e: &Event| if e.b == fired.b { -e.impulse } else { e.impulse };
        Firing {
            event: fired.a,
            other: fired.b,
            impulse: cause.map_or_else(Vec3::zeros, on_other),
            point: cause.map_or_else(Vec3::zeros, |e| e.point),
        }
    }
}

/// A function that is called when an event fires.
type Call = dyn Fn(&World, &Firing) -> Result<Vec<Action>, String> + Send + Sync;

/// The callbacks of an event.
#[derive(Clone, Default)]
pub(super) struct Calls(Vec<Arc<Call>>);

impl fmt::Debug for Calls {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} callbacks", self.0.len())
    }
}

impl Calls {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl ScriptedEvent {
    /// Adds a function that is called once for each firing, at the end of the step, when the actions of all events are done. It
    /// sees the world as it is then, and returns actions, which are done at once; [`Subject::Other`] in them is
    /// [`Firing::other`]. They are those that [`World::perform_action`] does. On an error the step fails with
    /// [`StepError::Callback`], and the world is as it was before.
    ///
    /// Forks share the function, so one that depends on its arguments alone gives them, replays and any number of threads the
    /// same bits. A snapshot has no functions and fits the world that has them; an archive or a scene of a world with
    /// callbacks is refused.
    ///
    /// ```
    /// use std::sync::{Arc, atomic::{AtomicU32, Ordering}};
    /// use tumble_core::{Action, Material, ScriptedEvent, Trigger, prelude::*};
    /// let mut world = World::default();
    /// let ground = world.add(RigidBody::fixed(Shape::half_space()))?;
    /// let elastic = Material { restitution: 0.5, ..Material::default() };
    /// let ball = RigidBody::new(Shape::sphere(0.1)?).with_mass(2.0).with_material(elastic);
    /// let ball = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.5)))?;
    /// let hits = Arc::new(AtomicU32::new(0));
    /// let count = hits.clone();
    /// let hit = ScriptedEvent::new("hit", Trigger::Contact { a: vec![ground], b: vec![ball], impulse: 0.0 });
    /// world.add(hit.with_call(move |_, firing| {
    ///     count.fetch_add(1, Ordering::Relaxed);
    ///     // the ground gave 1.5·m·v; another 0.5·m·v sends the ball up as fast as it came
    ///     Ok(vec![Action::push(firing.other.unwrap(), firing.impulse / 3.0)])
    /// }))?;
    /// while world.time() < 0.6 {
    ///     world.step()?;
    /// }
    /// assert_eq!(hits.load(Ordering::Relaxed), 1);
    /// let top = 0.5 - 0.5 * 9.81 * (0.6 - 2.0 * (2.0_f64 * 0.4 / 9.81).sqrt()).powi(2);
    /// assert!((world.body(ball)?.position().z - top).abs() < 0.04); // 1/240 s at 2.8 m/s, thrice
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn with_call(
        mut self,
        call: impl Fn(&World, &Firing) -> Result<Vec<Action>, String> + Send + Sync + 'static,
    ) -> Self {
        self.calls.0.push(Arc::new(call));
        self
    }

    /// Returns whether it has [callbacks](Self::with_call).
    pub fn has_calls(&self) -> bool {
        !self.calls.is_empty()
    }
}

impl World {
    /// Calls the callbacks of the events that fired in the frame, in their order, and does what they return.
    pub(super) fn call_back(&mut self) -> Result<(), StepError> {
        let calls = |e: &Event| {
            let event = (e.kind == EventKind::Fired).then(|| self.get::<ScriptedEvent>(e.a)).flatten()?;
            event.has_calls().then(|| (*e, event.calls.clone()))
        };
        let called: Vec<(Event, Calls)> = self.core.events.iter().filter_map(calls).collect();
        for (fired, calls) in called {
            for call in &calls.0 {
                let firing = Firing::of(self, &fired);
                let event = || self.name(fired.a).unwrap_or_default().to_string();
                let actions = call(self, &firing).map_err(|why| StepError::Callback { event: event(), why })?;
                for mut action in actions {
                    if let (Some(to @ Subject::Other), Some(other)) = (action.subject_mut(), fired.b) {
                        *to = Subject::Part(other, 0);
                    }
                    let done = self.perform_action(&action);
                    done.map_err(|why| StepError::Event { event: self.name(fired.a).unwrap_or_default().into(), why })?;
                }
            }
        }
        Ok(())
    }
}
