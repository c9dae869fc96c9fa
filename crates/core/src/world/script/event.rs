//! The object of a scripted event: its constants and its numbers of the state.

use super::action::{Action, Subject};
use super::call::Calls;
use super::trigger::Trigger;
use crate::object::net_sync::{read_state, write_state};
use crate::object::part_state::StateRange;
use crate::object::{FrameState, NetSync, Object, SyncError};
use crate::world::World;
use crate::world::view::{ObjectId, WorldView};
use crate::{Frame, FrameImpulse};
use std::sync::Arc;
use tumble_collide::{Pose, Vec3};

/// How often it fired.
pub(super) const FIRED: usize = 0;
/// Number of the frame at whose end it fired last; 0 before.
pub(super) const STAMP: usize = 1;
/// Time of the last firing, s.
pub(super) const TIME: usize = 2;
/// Time at which it fires after its delay, s; 0 if it is not waiting.
pub(super) const DUE: usize = 3;
/// 1 if its key was pressed since the last frame.
pub(super) const KEY: usize = 4;
/// Serial number of the other body, plus 1; 0 for none.
pub(super) const OTHER: usize = 5;
/// How many times its period has passed, or its time.
pub(super) const TICKS: usize = 6;
/// Length of the part of the state that every event has. The memory of actions follows.
pub(super) const HEADER: usize = 7;

/// A [`Trigger`] and what is done when it is met. Add it to a world like any object; the objects that it names are
/// there already. A disabled one does not fire and has no effect.
///
/// ```
/// use tumble_core::{Action, ScriptedEvent, Trigger, prelude::*};
/// let mut world = World::default();
/// let ball = RigidBody::new(Shape::sphere(0.1)?).with_mass(2.0);
/// let ball = world.add(ball.with_gravity_scale(0.0))?;
/// let kick = ScriptedEvent::new("kick", Trigger::Time { at: 0.5 });
/// world.add(kick.with_action(Action::push(ball, Vec3::new(4.0, 0.0, 0.0))))?;
/// while world.time() < 0.5 {
///     world.step()?;
/// }
/// assert_eq!(world.body(ball)?.velocity().x, 2.0); // J/m
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ScriptedEvent {
    name: String,
    trigger: Trigger,
    delay: f64,
    times: u32,
    actions: Arc<Vec<Action>>,
    pub(super) calls: Calls,
}

impl ScriptedEvent {
    /// Makes an event that does nothing yet, fires as often as its trigger is met, and at once.
    pub fn new(name: impl Into<String>, trigger: Trigger) -> ScriptedEvent {
        ScriptedEvent {
            name: name.into(),
            trigger,
            delay: 0.0,
            times: u32::MAX,
            actions: Arc::default(),
            calls: Calls::default(),
        }
    }

    /// Adds an action. Actions run in the order in which they were added.
    #[must_use]
    pub fn with_action(mut self, action: Action) -> Self {
        Arc::make_mut(&mut self.actions).push(action);
        self
    }

    /// Lets it fire some time after its trigger was met, s, at least 0. Until then it does not look at its trigger.
    #[must_use]
    pub fn with_delay(mut self, delay: f64) -> Self {
        self.delay = delay;
        self
    }

    /// Sets how often it fires at most, at least 1.
    #[must_use]
    pub fn with_times(mut self, times: u32) -> Self {
        self.times = times;
        self
    }

    /// Returns the trigger.
    pub fn trigger(&self) -> &Trigger {
        &self.trigger
    }

    /// Returns the actions.
    pub fn actions(&self) -> &Arc<Vec<Action>> {
        &self.actions
    }

    /// Returns the delay, s.
    pub fn delay(&self) -> f64 {
        self.delay
    }

    /// Returns how often it fires at most.
    pub fn times(&self) -> u32 {
        self.times
    }

    /// Returns how often an event has fired; `None` if the id is of another object.
    pub fn fired(world: &World, event: ObjectId) -> Option<u64> {
        world.get::<ScriptedEvent>(event)?;
        Some(world.state_of(event)?[FIRED] as u64)
    }

    /// Returns the actions for a change before the event is in a world.
    pub(super) fn actions_mut(&mut self) -> &mut Vec<Action> {
        Arc::make_mut(&mut self.actions)
    }

    /// Returns the bodies whose color an action can change.
    pub(super) fn colored<'a>(&'a self, body: &'a Subject) -> &'a [ObjectId] {
        match body {
            Subject::Part(id, _) => std::slice::from_ref(id),
            Subject::Other => self.trigger.others(),
        }
    }

    /// Returns the length of the memory of an action: the frame of the last change per body that it colors, or the
    /// frame of a joint.
    pub(super) fn memory(&self, action: &Action) -> usize {
        match action {
            Action::Recolor { body, .. } => self.colored(body).len(),
            Action::Attach { here: true, .. } => 7,
            _ => 0,
        }
    }

    /// Walks the actions, each with the start of its memory in the state.
    pub(super) fn with_memory(&self) -> impl Iterator<Item = (&Action, usize)> {
        let mut at = HEADER;
        self.actions.iter().map(move |action| {
            let start = at;
            at += self.memory(action);
            (action, start)
        })
    }

    /// Decides whether the event fires in this frame, and for which other bodies: their serial numbers plus 1. `met` are
    /// those for which the trigger was met in the frame.
    pub(super) fn decide(&self, now: f64, dt: f64, met: &[u32], x: &mut [f64]) -> Vec<u32> {
        let slack = 1e-6 * dt; // times are sums of steps
        let left = |x: &[f64]| f64::from(self.times) - x[FIRED];
        if x[DUE] > 0.0 {
            let due = x[DUE] <= now + slack;
            return if due { vec![x[OTHER] as u32] } else { Vec::new() };
        }
        let met: Vec<u32> = match &self.trigger {
            Trigger::Time { at } if x[TICKS] == 0.0 && now + slack >= *at => {
                x[TICKS] = 1.0;
                vec![0]
            }
            Trigger::Every { period, first } if now + slack >= first + x[TICKS] * period => {
                x[TICKS] = ((now + slack - first) / period).floor() + 1.0;
                vec![0]
            }
            Trigger::Time { .. } | Trigger::Every { .. } => Vec::new(),
            Trigger::Key { .. } => {
                if std::mem::take(&mut x[KEY]) > 0.0 {
                    vec![0]
                } else {
                    Vec::new()
                }
            }
            _ => met.to_vec(),
        };
        let met: Vec<u32> = met.into_iter().take(left(x).max(0.0) as usize).collect();
        if self.delay > 0.0
            && let Some(&other) = met.first()
        {
            (x[DUE], x[OTHER]) = (now + self.delay, f64::from(other));
            return Vec::new();
        }
        met
    }
}

impl Action {
    /// Spawns a body of a template at a pose of the world, with a velocity.
    pub fn spawn(template: ObjectId, pose: Pose, velocity: Vec3) -> Action {
        Action::Spawn { template, pose, velocity, angular_velocity: Vec3::zeros(), from: None }
    }

    /// Pushes a rigid body at its center of mass, N·s.
    pub fn push(body: ObjectId, impulse: Vec3) -> Action {
        Action::Push { body: Subject::Part(body, 0), impulse, point: None }
    }

    /// Recolors a body, sRGB.
    pub fn recolor(body: ObjectId, color: [f32; 3]) -> Action {
        Action::Recolor { body: Subject::Part(body, 0), color }
    }

    /// Sets the target of a drive.
    pub fn drive(body: ObjectId, dof: usize, target: f64) -> Action {
        Action::Drive { body, dof, target, original: None }
    }
}

impl Object for ScriptedEvent {
    fn name(&self) -> &str {
        &self.name
    }
    fn frame_state(&self) -> Option<&dyn FrameState> {
        Some(self)
    }
    /// Events that change a picture besides poses are sent to the facets that draw it.
    fn net_sync(&self) -> Option<&dyn NetSync> {
        self.actions.iter().any(Action::is_look).then_some(self as &dyn NetSync)
    }
}

impl FrameState for ScriptedEvent {
    fn len(&self) -> usize {
        HEADER + self.actions.iter().map(|action| self.memory(action)).sum::<usize>()
    }
    fn write_initial(&self, x: &mut [f64]) {
        x.fill(0.0);
        for (action, start) in self.with_memory() {
            if self.memory(action) == 7 && matches!(action, Action::Attach { .. }) {
                x[start + 6] = 1.0; // the identity
            }
        }
    }
    fn accepts(&self, x: &[f64]) -> bool {
        let poses = self.with_memory().filter(|(action, _)| matches!(action, Action::Attach { here: true, .. }));
        let unit = |at: usize| ((3..7).map(|k| x[at + k] * x[at + k]).sum::<f64>() - 1.0).abs() < 1e-6;
        let fine = x[..HEADER].iter().all(|x| *x >= 0.0) && x[OTHER] < 4e9;
        fine && x.iter().all(|x| x.is_finite()) && poses.into_iter().all(|(_, at)| unit(at))
    }
    fn advance(&self, _: &StateRange, _: &Frame, _: &mut [f64], _: &mut Vec<FrameImpulse>) {}
}

impl NetSync for ScriptedEvent {
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>) {
        write_state(&view.x[me.x.clone()], out);
    }
    fn read_data(&self, data: &[u8], x: &mut [f64]) -> Result<(), SyncError> {
        read_state(data, x, |x| self.accepts(x))
    }
}
