//! The state of a world as one value.

use super::state_memory::StateVector;
use crate::clone_by_field::clone_by_field;
use crate::contact::warm_starts::WarmStarts;
use crate::object::part_state::{PartState, StateRange, Wrench};
use crate::step::HeldDivision;
use crate::world::events::Touching;
use crate::world::sleep::{RestTimer, SleepGroup};
use crate::world::view::{Status, Table};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use tumble_collide::Vec3;

/// Maximum number of objects ever added to a world; frames are limited by its square.
const MAX_OBJECTS: u32 = 1 << 31;

/// All data that the next step of a world reads besides its objects' constants and its settings.
///
/// A fork clones it, [`World::checkpoint`](super::World::checkpoint) clones it into existing
/// memory, and [`World::save`](super::World::save) serializes it. All tables are in the order in
/// which the objects were added.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct WorldState {
    /// Simulated time, s.
    pub(crate) time: f64,
    /// Frames stepped.
    pub(crate) frame: u64,
    /// The serial number of the next object.
    pub(crate) next_serial: u32,
    pub(crate) objects: Vec<ObjectState>,
    /// The flat state `X`.
    pub(crate) x: StateVector,
    /// Angular (rad/s²), then linear acceleration (m/s²) of every part at the last evaluation of
    /// forces. Objects and the detector read them before forces are evaluated again.
    pub(crate) accelerations: Vec<[Vec3; 2]>,
    /// Wrench that users apply to every part during the next frame.
    pub(crate) applied: Vec<Wrench>,
    /// Force that users apply to every degree of freedom during the next frame.
    pub(crate) applied_generalized: Vec<f64>,
    pub(crate) warm: WarmStarts,
    /// The division of sub-steps that joints needed last.
    pub(crate) held_division: HeldDivision,
    /// Inner step with which the adaptive integrator continues, s; 0 before the first.
    pub(crate) inner_step: f64,
    /// The sleeping islands.
    pub(crate) groups: Vec<SleepGroup>,
    /// Pairs of parts that touch, and of sensors with parts that overlap them; sorted.
    pub(crate) touching: Vec<Touching>,
}

clone_by_field!(WorldState {
    time,
    frame,
    next_serial,
    objects,
    x,
    accelerations,
    applied,
    applied_generalized,
    warm,
    held_division,
    inner_step,
    groups,
    touching,
});

/// State of an object besides its numbers in `X`.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct ObjectState {
    /// Serial number, used once in a world: the key of warm starts and sleeping objects.
    pub serial: u32,
    pub status: Status,
    /// Whether it sleeps: it is left out of the steps until it is woken.
    pub asleep: bool,
    pub rest: RestTimer,
}

clone_by_field!(ObjectState { serial, status, asleep, rest });

impl WorldState {
    /// Returns the lengths of the tables by object, of `X`, by part and by degree of freedom.
    pub(crate) fn sizes(&self) -> [usize; 5] {
        [self.objects.len(), self.x.len(), self.accelerations.len(), self.applied.len(), self.applied_generalized.len()]
    }

    /// Adds an object with the given ranges at the end; its numbers are already in `X`.
    pub(crate) fn add(&mut self, status: Status, state_range: &StateRange) {
        self.objects.push(ObjectState { serial: self.next_serial, status, asleep: false, rest: RestTimer::default() });
        self.next_serial += 1;
        self.accelerations.resize(state_range.parts.end, [Vec3::zeros(); 2]);
        self.applied.resize(state_range.parts.end, Wrench::default());
        self.applied_generalized.resize(state_range.v.end, 0.0);
    }

    /// Removes the object at `place`.
    pub(crate) fn remove(&mut self, place: usize, state_range: &StateRange) {
        let gone = self.objects.remove(place);
        self.x.cut(state_range.x.clone());
        self.accelerations.drain(state_range.parts.clone());
        self.applied.drain(state_range.parts.clone());
        self.applied_generalized.drain(state_range.v.clone());
        self.warm.forget(gone.serial);
        self.touching.retain(|touching| !touching.names(gone.serial));
    }

    /// Returns whether both are states of the same objects.
    pub(crate) fn fits(&self, other: &WorldState) -> bool {
        let serials = other.objects.iter().map(|o| o.serial);
        self.sizes() == other.sizes() && self.objects.iter().map(|o| o.serial).eq(serials)
    }

    /// Copies a state of the same objects, up to the sleeping groups: of the objects only the walked ones, as the
    /// others are equal.
    pub(crate) fn copy_walked(&mut self, from: &WorldState, table: &Table) {
        let WorldState { time, frame, next_serial, warm, held_division, inner_step, touching, .. } = from;
        (self.time, self.frame, self.next_serial, self.inner_step) = (*time, *frame, *next_serial, *inner_step);
        self.held_division = *held_division;
        self.warm.clone_from(warm);
        self.touching.clone_from(touching);
        let walk = &table.walk;
        for &place in &walk.places {
            self.objects[place as usize].clone_from(&from.objects[place as usize]);
            let v = table.outside(place as usize);
            self.applied_generalized[v.clone()].copy_from_slice(&from.applied_generalized[v]);
        }
        walk.x.iter().for_each(|range| self.x[range.clone()].copy_from_slice(&from.x[range]));
        for range in walk.parts.iter() {
            self.accelerations[range.clone()].copy_from_slice(&from.accelerations[range.clone()]);
            self.applied[range.clone()].copy_from_slice(&from.applied[range]);
        }
    }

    /// Removes the forces applied to the walked objects. Those applied to others are zero.
    pub(crate) fn clear_walked(&mut self, table: &Table) {
        table.walk.parts.iter().for_each(|range| self.applied[range].fill(Wrench::default()));
        let walked = table.walk.places.iter();
        walked.for_each(|place| self.applied_generalized[table.outside(*place as usize)].fill(0.0));
    }

    /// Removes all applied forces.
    pub(crate) fn clear_applied(&mut self) {
        self.applied.fill(Wrench::default());
        self.applied_generalized.fill(0.0);
    }

    /// Copies the accelerations of a range of the part table.
    pub(crate) fn keep_accelerations(&mut self, range: Range<usize>, part_states: &[PartState]) {
        for (kept, s) in self.accelerations[range.clone()].iter_mut().zip(&part_states[range]) {
            *kept = [s.angular_acceleration, s.acceleration];
        }
    }

    /// Writes the accelerations into a range of the part table.
    pub(crate) fn write_accelerations(&self, range: Range<usize>, part_states: &mut [PartState]) {
        for (part_state, [angular, linear]) in part_states[range.clone()].iter_mut().zip(&self.accelerations[range]) {
            (part_state.angular_acceleration, part_state.acceleration) = (*angular, *linear);
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        let vectors =
            self.accelerations.iter().flatten().chain(self.applied.iter().flat_map(|w| [&w.torque, &w.force]));
        let mut numbers = self.x.iter().chain(&self.applied_generalized).chain(vectors.flat_map(|v| v.iter()));
        let steps = self.time.is_finite()
            && self.held_division.is_sound()
            && self.inner_step.is_finite()
            && self.inner_step >= 0.0;
        steps && numbers.all(|x| x.is_finite()) && self.warm.finite()
    }

    /// Returns whether the sleeping objects are those of the sleep groups, and all their numbers
    /// are finite.
    pub(crate) fn sleepers_are_sound(&self) -> bool {
        let mut members: Vec<u32> = self.groups.iter().flat_map(|g| &g.members).copied().collect();
        members.sort_unstable();
        let asleep = self.objects.iter().filter(|o| o.asleep).map(|o| o.serial);
        let timers = self.objects.iter().all(|o| o.rest.is_finite());
        timers && self.groups.iter().all(SleepGroup::sound) && asleep.eq(members)
    }

    /// Returns whether serial numbers ascend, counters are within their limits, and warm starts are
    /// sorted.
    pub(crate) fn counters_are_sound(&self) -> bool {
        let serials = self.objects.is_sorted_by(|a, b| a.serial < b.serial)
            && self.objects.iter().all(|o| o.serial < self.next_serial);
        let most_frames = MAX_OBJECTS as u64 * MAX_OBJECTS as u64;
        let touching = self.touching.is_sorted_by(|a, b| a < b);
        serials && self.next_serial < MAX_OBJECTS && self.frame < most_frames && self.warm.in_order() && touching
    }
}
