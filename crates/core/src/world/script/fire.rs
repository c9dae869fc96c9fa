//! The end of a frame: which events fire.

use super::ScriptedEvent;
use super::event::{DUE, FIRED, KEY, OTHER, STAMP, TIME};
use super::trigger::Trigger;
use crate::world::view::ObjectId;
use crate::world::{Core, Event, EventKind, StepError, World};

/// An event that fires: its id, and the serial number of the other body plus 1.
type Firing = (ObjectId, u32);

impl World {
    /// Notes that a user pressed a key for the events that wait for it. They fire at the end of the next frame. Returns
    /// whether there are any.
    pub fn press(&mut self, key: &str) -> bool {
        let core = &mut self.core;
        let waits = |event: &ScriptedEvent| matches!(event.trigger(), Trigger::Key { key: own } if own == key);
        let places: Vec<usize> = core.scripted().filter(|(_, event)| waits(event)).map(|(place, _)| place).collect();
        for &place in &places {
            let start = core.table.placed[place].state_range.x.start;
            core.state.x[start + KEY] = 1.0;
        }
        !places.is_empty()
    }

    /// Lets the events of the frame that has just ended fire.
    pub(crate) fn fire_events(&mut self) -> Result<(), StepError> {
        if self.core.scripted().next().is_none() {
            return Ok(());
        }
        self.core.finish_paths();
        for (event, other) in self.core.firings() {
            self.perform(event, other)?;
        }
        self.call_back()
    }
}

impl Core {
    /// Walks the enabled scripted events, each with its place.
    pub(super) fn scripted(&self) -> impl Iterator<Item = (usize, &ScriptedEvent)> {
        self.objects().iter().filter(|entry| entry.status.enabled).filter_map(|entry| {
            let any: &dyn std::any::Any = entry.object;
            Some((entry.place, any.downcast_ref::<ScriptedEvent>()?))
        })
    }

    /// Looks at all triggers, notes what fires in the state and in the list of events, and returns it in order.
    fn firings(&mut self) -> Vec<Firing> {
        let (now, dt, stamp) = (self.state.time, self.settings.dt, self.state.frame as f64);
        let places: Vec<usize> = self.scripted().map(|(place, _)| place).collect();
        let mut all: Vec<Firing> = Vec::new();
        for place in places {
            let (range, id) = (self.table.placed[place].state_range.x.clone(), self.table.order[place]);
            let any: &dyn std::any::Any = self.table.placed[place].object.as_ref();
            let Some(event) = any.downcast_ref::<ScriptedEvent>() else { continue };
            let met = self.met(event, &all);
            let x = &mut self.state.x[range];
            for other in event.decide(now, dt, &met, x) {
                (x[FIRED], x[STAMP], x[TIME], x[DUE], x[OTHER]) = (x[FIRED] + 1.0, stamp, now, 0.0, f64::from(other));
                all.push((id, other));
            }
        }
        for &(a, other) in &all {
            let b = self.other(other);
            self.events.push(Event::of(EventKind::Fired, a, b));
        }
        all
    }

    /// Returns the other bodies for which the trigger of an event was met in the frame.
    fn met(&self, event: &ScriptedEvent, fired: &[Firing]) -> Vec<u32> {
        let coded = |id: ObjectId| self.table.place(id).map_or(0, |place| self.state.objects[place].serial + 1);
        match event.trigger() {
            Trigger::Time { .. } | Trigger::Every { .. } | Trigger::Key { .. } => Vec::new(),
            Trigger::Fired { event } => fired.iter().filter(|(id, _)| id == event).map(|(_, other)| *other).collect(),
            trigger => {
                let met = self.events.iter().filter_map(|happened| trigger.met(happened));
                let mut met: Vec<u32> = met.map(|other| other.map_or(0, coded)).collect();
                met.dedup(); // several parts of one pair
                met
            }
        }
    }

    /// Returns the body of a serial number plus 1.
    pub(super) fn other(&self, coded: u32) -> Option<ObjectId> {
        Some(self.table.order[self.by_serial(coded.checked_sub(1)?)?])
    }
}
