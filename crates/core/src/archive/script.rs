//! Records of scripted events and of the templates of what they spawn.

use super::records::{ObjectIndices, id};
use crate::Object;
use crate::world::script::{Action, ScriptedEvent, Template, Trigger};
use crate::world::view::ObjectId;
use serde::{Deserialize, Serialize};

/// A scripted event; objects by index, `None` for a removed one.
#[derive(Serialize, Deserialize)]
pub(super) struct EventScript {
    name: String,
    trigger: Trigger<Option<u32>>,
    delay: f64,
    times: u32,
    actions: Vec<Action<Option<u32>>>,
}

impl EventScript {
    pub fn of(event: &ScriptedEvent, indices: &ObjectIndices) -> EventScript {
        let mut index = |id: &ObjectId| indices.of_id(*id);
        EventScript {
            name: event.name().into(),
            trigger: event.trigger().map(&mut index),
            delay: event.delay(),
            times: event.times(),
            actions: event.actions().iter().map(|action| action.map(&mut index)).collect(),
        }
    }

    pub fn event(self, ids: &[ObjectId]) -> ScriptedEvent {
        let mut of = |index: &Option<u32>| id(ids, *index);
        let event =
            ScriptedEvent::new(self.name, self.trigger.map(&mut of)).with_delay(self.delay).with_times(self.times);
        self.actions.iter().fold(event, |event, action| event.with_action(action.map(&mut of)))
    }
}

/// A template; its bodies by index.
#[derive(Serialize, Deserialize)]
pub(super) struct TemplateRecord {
    name: String,
    bodies: Vec<Option<u32>>,
    reuse: bool,
}

impl TemplateRecord {
    pub fn of(template: &Template, indices: &ObjectIndices) -> TemplateRecord {
        let bodies = template.bodies.iter().map(|id| indices.of_id(*id)).collect();
        TemplateRecord { name: template.name().into(), bodies, reuse: template.reuse }
    }

    pub fn template(self, ids: &[ObjectId]) -> Template {
        Template::of(self.name, self.bodies.iter().map(|index| id(ids, *index)).collect(), self.reuse)
    }
}
