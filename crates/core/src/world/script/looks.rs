//! Changes of the picture by events.

use super::action::{Action, CameraChange, LightChange};
use super::event::STAMP;
use super::template::HEADER;
use super::{ScriptedEvent, Template};
use crate::world::World;
use crate::world::view::ObjectId;
use std::collections::BTreeMap;

/// Colors, lights and camera as events have left them. Everything else is drawn as the scene has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Looks {
    /// Color of all visuals of an object, sRGB.
    pub colors: BTreeMap<ObjectId, [f32; 3]>,
    /// Changes of lights, by the index of the light.
    pub lights: BTreeMap<usize, LightChange>,
    /// The camera to look from.
    pub camera: Option<CameraChange>,
}

impl World {
    /// Returns what scripted events have changed of the picture: of several changes the latest, and of those of one
    /// frame the last. A body that is spawned has its first color again.
    pub fn looks(&self) -> Looks {
        let mut spawned: BTreeMap<ObjectId, f64> = BTreeMap::new();
        for (template, x) in self.of_type::<Template>() {
            spawned.extend(template.bodies.iter().copied().zip(x[HEADER..].iter().copied()));
        }
        let (mut looks, mut seen) = (Looks::default(), 0.0);
        let (mut colored, mut lit) = (BTreeMap::<ObjectId, f64>::new(), BTreeMap::<usize, f64>::new());
        for (x, event) in self.core.fired() {
            for (action, memory) in event.with_memory() {
                match action {
                    Action::Recolor { body, color } => {
                        let stamps = event.colored(body).iter().zip(&x[memory..]);
                        for (id, &stamp) in stamps.filter(|(_, stamp)| **stamp > 0.0) {
                            let after = spawned.get(id).is_none_or(|spawn| stamp >= *spawn);
                            if after && colored.get(id).is_none_or(|old| stamp >= *old) {
                                colored.insert(*id, stamp);
                                looks.colors.insert(*id, *color);
                            }
                        }
                    }
                    Action::Light(change) if lit.get(&change.light).is_none_or(|old| x[STAMP] >= *old) => {
                        lit.insert(change.light, x[STAMP]);
                        looks.lights.insert(change.light, *change);
                    }
                    Action::Camera(change) if x[STAMP] >= seen => {
                        (seen, looks.camera) = (x[STAMP], Some(change.clone()));
                    }
                    _ => {}
                }
            }
        }
        looks
    }

    fn of_type<T: crate::object::Object>(&self) -> impl Iterator<Item = (&T, &[f64])> {
        self.ids().iter().filter_map(|id| Some((self.get::<T>(*id)?, self.state_of(*id)?)))
    }
}

impl ScriptedEvent {
    /// Returns the place of a body in the memory of an action that colors it.
    pub(super) fn colored_place(&self, action: &Action, body: ObjectId) -> Option<usize> {
        let Action::Recolor { body: who, .. } = action else { return None };
        self.colored(who).iter().position(|id| *id == body)
    }
}
