//! Readings of the measuring sensors of a world.

use super::{Core, StepError, World, WorldError};
use crate::articulated::ArticulatedBody;
use crate::constraint::loop_joint::LoopJoint;
use crate::object::part_state::PartState;
use crate::sensor::measure::Past;
use crate::sensor::{Sensor, SensorPlace};
use crate::world::view::ObjectId;

impl World {
    /// Returns the reading of a sensor at the end of the last frame, with its errors; before the first frame that at its
    /// addition, whose means over a frame are zero. [`SensorKind`](crate::SensorKind) has units and axes. `None` if the sensor or
    /// what it is on was removed, or the object is no sensor.
    ///
    /// The reading of forces and of touch stays as it was while the bodies sleep: it is what holds them. A camera has an
    /// image instead.
    pub fn reading(&self, id: ObjectId) -> Option<&[f64]> {
        let sensor = self.get::<Sensor>(id).filter(|sensor| !sensor.kind().is_camera())?;
        let reference = sensor.reference().and_then(|anchor| Some(anchor.part?.0));
        if sensor.place().object().into_iter().chain(reference).any(|id| self.object(id).is_none()) {
            return None;
        }
        self.state_of(id)?.get(..sensor.kind().numbers())
    }

    /// Returns the ids of all sensors, in the order of their addition.
    pub fn sensors(&self) -> impl Iterator<Item = ObjectId> + use<'_> {
        self.ids().iter().copied().filter(|id| self.get::<Sensor>(*id).is_some())
    }

    /// Starts the noise of a sensor anew from a seed. The present reading and bias stay.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if it was removed, [`WorldError::Sensor`] for another object.
    pub fn seed_sensor(&mut self, id: ObjectId, seed: u64) -> Result<(), WorldError> {
        let entry = self.core.objects().get(id).ok_or(WorldError::Stale)?;
        let any: &dyn std::any::Any = entry.object;
        let why = || WorldError::Sensor { name: entry.name.to_string(), why: "it is no measuring sensor".into() };
        let sensor = any.downcast_ref::<Sensor>().ok_or_else(why)?;
        let (noise, layout) = (crate::SensorNoise { seed, ..*sensor.noise() }, sensor.layout());
        let (serial, range) = (entry.serial, entry.state_range.x.clone());
        noise.start(&layout, serial, &mut self.core.state.x[range]);
        Ok(())
    }

    /// Checks that a sensor that is to be added reads something of this world.
    pub(super) fn check_sensor(&self, sensor: &Sensor) -> Result<(), WorldError> {
        let wrong = |why: String| Err(WorldError::Sensor { name: crate::Object::name(sensor).to_string(), why });
        for id in sensor.place().object().into_iter().chain(sensor.reference().and_then(|anchor| Some(anchor.part?.0)))
        {
            if self.object(id).is_none() {
                return Err(WorldError::Stale);
            }
        }
        let body = |id: ObjectId| self.get::<ArticulatedBody>(id);
        match sensor.place() {
            SensorPlace::Site(anchor) => {
                for (id, part) in [Some(anchor), sensor.reference()].into_iter().flatten().filter_map(|a| a.part) {
                    if self.part_state(id, part).is_none() {
                        let name = self.name(id).unwrap_or_default().to_string();
                        return Err(WorldError::NoPart { name, part });
                    }
                }
                if let Some(link) = anchor.link
                    && anchor.part.and_then(|(id, _)| body(id)?.model().frames().get(link)).is_none()
                {
                    return wrong(format!("it reads the link number {link}, which the body does not have"));
                }
                let link = anchor.part.and_then(|(id, part)| body(id)?.link_of(part));
                if sensor.kind().reads_joint() && link.is_none() {
                    return wrong("the force and torque of a joint are read at a link of an articulated body that a joint moves, or at a loop joint".into());
                }
            }
            SensorPlace::LoopJoint(id) => {
                let Some(joint) = self.get::<LoopJoint>(*id) else {
                    return wrong(format!("'{}' is not a loop joint", self.name(*id).unwrap_or_default()));
                };
                if sensor.kind().reads_dof() && !joint.kind().has_position() {
                    return wrong(format!("loop joints of kind '{}' have no position", joint.kind().name()));
                }
            }
            SensorPlace::Dof(id, dof) => {
                if body(*id).and_then(|body| body.position_of(*dof)).is_none() {
                    let name = self.name(*id).unwrap_or_default();
                    return wrong(format!(
                        "'{name}' has no revolute or prismatic joint with the degree of freedom {dof}"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Takes the first reading of a sensor that was added.
    pub(super) fn start_sensor(&mut self, id: ObjectId) {
        let Some(entry) = self.core.objects().get(id) else { return };
        let any: &dyn std::any::Any = entry.object;
        let Some(sensor) = any.downcast_ref::<Sensor>() else { return };
        let (noise, kind, cutoff) = (*sensor.noise(), sensor.kind(), sensor.cutoff());
        let (serial, range) = (entry.serial, entry.state_range.x.clone());
        let layout = sensor.layout();
        if kind.is_camera() {
            noise.start(&layout, serial, &mut self.core.state.x[range]);
            return self.take_image(id, None);
        }
        let Some(mut reading) = sensor.measure(&self.core, None) else { return };
        let x = &mut self.core.state.x[range];
        noise.start(&layout, serial, x);
        noise.write(kind, None, cutoff, &mut reading, x);
    }
}

impl Core {
    /// Takes the readings of all sensors after a frame that began with the part states `before`.
    pub(super) fn read_sensors(&mut self, before: &[PartState]) -> Result<(), StepError> {
        let dt = self.settings.dt;
        self.cameras.clear();
        for walked in 0..self.table.walk.places.len() {
            let place = self.table.walk.places[walked] as usize;
            let entry = self.objects().at(place);
            let any: &dyn std::any::Any = entry.object;
            let Some(sensor) = any.downcast_ref::<Sensor>().filter(|_| entry.status.enabled) else { continue };
            if sensor.kind().is_camera() {
                if sensor.noise().delay > 0 || sensor.noise().bias_walk > 0.0 {
                    self.cameras.push(self.table.order[place]);
                }
                continue;
            }
            if sensor.kind().needs_loads() && self.sleeps_under(sensor) {
                continue;
            }
            let Some(mut reading) = sensor.measure(self, Some(Past { before, dt })) else { continue };
            if reading.iter().any(|number| !number.is_finite()) {
                let object = entry.name.to_string();
                return Err(StepError::NotFinite { object, what: "its reading", time: self.state.time });
            }
            let (noise, kind, cutoff) = (*sensor.noise(), sensor.kind(), sensor.cutoff());
            let range = entry.state_range.x.clone();
            noise.write(kind, Some(dt), cutoff, &mut reading, &mut self.state.x[range]);
        }
        Ok(())
    }

    /// Returns whether the body of a sensor sleeps, or all bodies of its loop joint.
    fn sleeps_under(&self, sensor: &Sensor) -> bool {
        let asleep = |id: ObjectId| self.objects().get(id).is_some_and(|entry| entry.asleep);
        let Some(id) = sensor.place().object() else { return false };
        let any: Option<&dyn std::any::Any> = self.objects().get(id).map(|entry| entry.object as _);
        match any.and_then(|any| any.downcast_ref::<LoopJoint>()) {
            Some(joint) => joint.sides().iter().filter_map(|side| side.part).any(|(id, _)| asleep(id)),
            None => asleep(id),
        }
    }
}
