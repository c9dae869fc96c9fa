//! Advances the states that follow the world ([`FrameState`]) at the end of a frame.

use super::{Core, StepError};
use crate::object::FrameState;
use crate::object::frame_state::{Frame, FrameImpulse};
use crate::object::part_state::{PartPoint, PartState};
use crate::world::view::ObjectId;
use tumble_collide::Vec3;

const AXES: [Vec3; 3] = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];

impl Core {
    /// Copies the part states if an object with a [`FrameState`] will ask for them.
    pub(super) fn keep_part_states(&self, out: &mut Vec<PartState>) {
        out.clear();
        if self.objects().iter().any(|entry| entry.object.frame_state().is_some()) {
            out.extend_from_slice(&self.derived.part_states);
        }
    }

    /// Advances all frame states by the frame that was just stepped, from the time `start` (s) and the part states
    /// `before`; then applies their impulses.
    pub(super) fn advance_frame_states(&mut self, start: f64, before: &[PartState]) -> Result<(), StepError> {
        let (mut impulses, mut x) = (Vec::new(), std::mem::take(&mut self.frame_numbers));
        for walked in 0..self.table.walk.places.len() {
            let place = self.table.walk.places[walked] as usize;
            let entry = self.objects().at(place);
            let Some(follower) = entry.object.frame_state().filter(|_| entry.status.enabled) else { continue };
            let (range, id, body) = (entry.state_range.x.clone(), self.table.order[place], entry.object.integratable());
            x.clear();
            x.extend_from_slice(&self.state.x[range.clone()]);
            let (settings, view, threads) = (&self.settings, self.view(self.state.time), &self.threads);
            let frame = Frame { dt: settings.dt, start, settings, view, before, threads };
            follower.advance(entry.state_range, &frame, &mut x, &mut impulses);
            let fine = impulses.iter().all(|i| i.impulse.iter().chain(i.point.iter()).all(|x| x.is_finite()));
            let accepted = follower.accepts(&x) && body.is_none_or(|body| body.accepts(&x));
            let bad = if !fine { Some("an impulse of it") } else { (!accepted).then_some("its state") };
            if let Some(what) = bad {
                return Err(StepError::NotFinite { object: entry.name.to_string(), what, time: self.state.time });
            }
            let moved = body.is_some() && self.state.x[range.clone()] != x;
            self.state.x[range].copy_from_slice(&x);
            if moved {
                self.integration().refresh_one(id);
            }
        }
        self.frame_numbers = x;
        self.apply_frame_impulses(&impulses)
    }

    /// Applies the impulses of a frame, those on one object together. Sleepers are asked to wake.
    fn apply_frame_impulses(&mut self, impulses: &[FrameImpulse]) -> Result<(), StepError> {
        let place = |impulse: &FrameImpulse| Some((self.objects().get(impulse.id)?.place, *impulse));
        let mut placed: Vec<(usize, FrameImpulse)> = impulses.iter().filter_map(place).collect();
        placed.sort_by_key(|(place, _)| *place); // stable: sums have the order of the impulses
        for group in placed.chunk_by(|a, b| a.0 == b.0) {
            let entry = self.objects().at(group[0].0);
            if entry.asleep {
                let serial = entry.serial;
                self.needs_wake.push(serial); // the frame will be repeated with it awake
                continue;
            }
            let part_states = self.derived.part_states[entry.state_range.parts.clone()].to_vec();
            let kicks = group.iter().filter_map(|(_, impulse)| {
                let FrameImpulse { part, point, impulse, .. } = *impulse;
                Some((PartPoint { part, part_state: part_states.get(part)?, point, axes: &AXES }, impulse))
            });
            let from = entry.state_range.parts.start;
            group.iter().for_each(|(_, i)| self.loads.add(from + i.part, &i.impulse, &i.point));
            if !self.kick_by(group[0].1.id, kicks) {
                let object = self.objects().at(group[0].0).name.to_string();
                return Err(StepError::NotFinite { object, what: "its state after impulses", time: self.state.time });
            }
        }
        Ok(())
    }

    /// Applies impulses at points of parts to the state, if impulses move the object. Returns false, and leaves the
    /// state, if it would not be finite.
    pub(super) fn kick_by<'a>(&mut self, id: ObjectId, impulses: impl Iterator<Item = (PartPoint<'a>, Vec3)>) -> bool {
        let super::Coordinates { objects, x, caches, .. } = self.coordinates(None);
        let Some(entry) = objects.get(id).filter(|entry| entry.moves()) else { return true };
        let Some(body) = entry.object.integratable() else { return true };
        let dof = entry.state_range.v.len();
        let (mut y, mut du, mut dp) = (vec![0.0; 3 * dof], vec![0.0; dof], vec![0.0; dof]);
        let cache = &mut caches[entry.place];
        for (at, impulse) in impulses {
            y.fill(0.0);
            body.test_impulse(cache, &at, 1.0, &mut y);
            for (k, du) in du.iter_mut().enumerate() {
                *du += (0..3).map(|r| impulse[r] * y[r * dof + k]).sum::<f64>();
            }
        }
        body.unwhiten_change(cache, &du, &mut dp);
        let own = &mut x[entry.state_range.x.clone()];
        let mut kicked = own.to_vec();
        body.kick(&mut kicked, &dp, 1.0);
        if !kicked.iter().all(|x| x.is_finite()) {
            return false;
        }
        own.copy_from_slice(&kicked);
        self.integration().refresh_one(id);
        true
    }
}

/// Returns the interface of an object whose state is a frame state alone.
pub(super) fn alone(object: &dyn crate::object::Object) -> Option<&dyn FrameState> {
    object.frame_state().filter(|_| object.integratable().is_none())
}
