//! Advances the states that follow the world ([`FrameState`]) at the end of a frame.

use super::{Core, StepError};
use crate::object::FrameState;
use crate::object::frame_state::Frame;
use crate::object::part_state::{PartPoint, PartState};
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
        let (mut impulses, mut x) = (Vec::new(), Vec::new());
        for place in 0..self.table.placed.len() {
            let entry = self.objects().at(place);
            let Some(follower) = entry.object.frame_state().filter(|_| entry.status.enabled) else { continue };
            let range = entry.state_range.x.clone();
            x.clear();
            x.extend_from_slice(&self.state.x[range.clone()]);
            let (settings, view, threads) = (&self.settings, self.view(self.state.time), &self.threads);
            let frame = Frame { dt: settings.dt, start, settings, view, before, threads };
            follower.advance(entry.state_range, &frame, &mut x, &mut impulses);
            let fine = impulses.iter().all(|i| i.impulse.iter().chain(i.point.iter()).all(|x| x.is_finite()));
            let bad = if !fine { Some("an impulse of it") } else { (!follower.accepts(&x)).then_some("its state") };
            if let Some(what) = bad {
                return Err(StepError::NotFinite { object: entry.name.to_string(), what, time: self.state.time });
            }
            self.state.x[range].copy_from_slice(&x);
        }
        for impulse in impulses {
            let Some(entry) = self.objects().get(impulse.id) else { continue };
            if entry.asleep {
                self.needs_wake.push(entry.serial); // the frame will be repeated with it awake
                continue;
            }
            let row = entry.state_range.parts.start + impulse.part;
            if impulse.part < entry.state_range.parts.len() {
                let part_state = self.derived.part_states[row];
                let at = PartPoint { part: impulse.part, part_state: &part_state, point: impulse.point, axes: &AXES };
                self.kick_at(impulse.id, &at, &impulse.impulse);
            }
        }
        Ok(())
    }

    /// Applies an impulse at a point of a part to the state, if impulses move the object.
    pub(super) fn kick_at(&mut self, id: crate::world::view::ObjectId, at: &PartPoint, impulse: &Vec3) {
        let super::Coordinates { objects, x, caches, .. } = self.coordinates(None);
        let Some(entry) = objects.get(id).filter(|entry| entry.moves()) else { return };
        let Some(body) = entry.object.integratable() else { return };
        let dof = entry.state_range.v.len();
        let (mut y, mut dp) = (vec![0.0; 3 * dof], vec![0.0; dof]);
        let cache = &mut caches[entry.place];
        body.test_impulse(cache, at, 1.0, &mut y);
        let du: Vec<f64> = (0..dof).map(|k| (0..3).map(|r| impulse[r] * y[r * dof + k]).sum()).collect();
        body.unwhiten_change(cache, &du, &mut dp);
        body.kick(&mut x[entry.state_range.x.clone()], &dp, 1.0);
        self.integration().refresh_one(id);
    }
}

/// Returns the interface of an object whose state is a frame state alone.
pub(super) fn alone(object: &dyn crate::object::Object) -> Option<&dyn FrameState> {
    object.frame_state().filter(|_| object.integratable().is_none())
}
