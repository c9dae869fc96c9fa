//! Callables of events: Python decides what is done when one fires.
//!
//! A callable is called once for each firing, when the frame has ended and all actions of events are done. It gets a
//! [`View`](crate::extension::view::View) and the firing, and returns actions, which are done at once. If it raises, the step raises, and the
//! world is as it was before the frame. So it may be a pure function of its arguments, and forks, replays and batches do the same.

use crate::arrays::convert::vector;
use crate::errors::{Error, Result};
use crate::script::action::Action;
use crate::world::inner::Inner;
use pyo3::prelude::*;
use tumble::collide::Vec3;
use tumble::dynamics::{Action as Deed, Event, EventKind, Firing as Cause, Subject, World as Core};

/// The cause of a firing, for the callables of the event.
struct Firing {
    event: String,
    other: Option<String>,
    time: f64,
    /// On the other body, N·s.
    impulse: Vec3,
    point: Vec3,
}

impl Firing {
    fn of(world: &Core, fired: &Event) -> Firing {
        let name = |id| world.name(id).unwrap_or_default().to_string();
        let Cause { event, other, impulse, point, .. } = Cause::of(world, fired);
        Firing { event: name(event), other: other.map(name), time: world.time(), impulse, point }
    }

    fn object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let class = py.import("tumble._values")?.getattr("Firing")?;
        class.call1((&self.event, &self.other, self.time, vector(py, &self.impulse), vector(py, &self.point)))
    }
}

impl Inner {
    /// Calls the callables of the events that fired in the frame, and does what they return.
    pub fn call_back(&mut self) -> Result<()> {
        let fired: Vec<Event> =
            self.world.events().iter().filter(|event| event.kind == EventKind::Fired).copied().collect();
        for event in fired {
            for k in self.calls_of(event.a) {
                let firing = Firing::of(&self.world, &event);
                for deed in self.deeds(k, &firing, event)? {
                    self.world.perform_action(&deed)?;
                }
            }
        }
        Ok(())
    }

    fn deeds(&self, call: usize, firing: &Firing, event: Event) -> Result<Vec<Deed>> {
        let code = self.call(call);
        let resolve = |returned: Bound<'_, PyAny>| -> Result<Vec<Deed>> {
            if returned.is_none() {
                return Ok(Vec::new());
            }
            let py = returned.py();
            let wrong = || Error::value(format!("'{}': a callable returns None or a list of actions", firing.event));
            let mut deeds = Vec::new();
            for action in returned.try_iter().map_err(|_| wrong())? {
                let action = action?.cast_into::<Action>().map_err(|_| wrong())?;
                let mut deed = action.get().resolved(py, &self.world, None)?;
                if let (Some(to @ Subject::Other), Some(other)) = (deed.subject_mut(), event.b) {
                    *to = Subject::Part(other, 0);
                }
                deeds.push(deed);
            }
            Ok(deeds)
        };
        code.viewed(
            &self.world.view(),
            |py, view| resolve(code.object(py).call1((view, firing.object(py)?))?),
            |_, wrench| match wrench == Default::default() {
                true => Ok(()),
                false => Err(Error::value(format!(
                    "'{}': a callable of an event adds no forces; return tumble.Action.push",
                    firing.event
                ))),
            },
        )
    }
}
