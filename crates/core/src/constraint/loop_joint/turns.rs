//! The angle of a revolute joint with wide limits, followed from frame to frame.
//!
//! Frames that have turned by `θ` and by `θ − 2π` are equal. An angle within π of the middle of its limits is the right one
//! while the joint passes a stop by less than half of what the limits leave of a turn. A free motion of half a step passes it by
//! `½·h·θ̇`, so limits near ±π need a memory: the angle at the end of the last frame, which is a number of the state.
//!
//! A limit on one side leaves any number of turns on the other, which the same number counts.
//!
//! ```text
//! θ = θ_raw + 2π·k   with   |θ − θ_frame| ≤ π
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `θ_raw` | angle of the frames in (−π, π] |
//! | `θ_frame` | angle at the start of the frame |

use super::{LoopJoint, LoopJointKind, near};
use crate::object::FrameState;
use crate::object::frame_state::{Frame, FrameImpulse};
use crate::object::part_state::StateRange;
use crate::world::view::{ObjectId, WorldView};
use std::f64::consts::TAU;

/// Distance of two limits above which the angle is followed, rad.
pub(crate) const WIDE: f64 = 0.75 * TAU;

impl LoopJointKind {
    /// Returns whether a joint of this kind with these limits, rad, counts its turns: a revolute one whose limits are more than 3π/2
    /// apart, or on one side.
    pub fn counts_turns(self, limits: Option<[f64; 2]>) -> bool {
        let followed = |[lo, hi]: [f64; 2]| hi - lo > WIDE && (lo.is_finite() || hi.is_finite());
        self == LoopJointKind::Revolute && limits.is_some_and(followed)
    }
}

impl LoopJoint {
    /// Returns whether its angle is a number of the state.
    pub(crate) fn counts_turns(&self) -> bool {
        self.kind.counts_turns(self.dofs[0].settings.limits)
    }

    /// Sets which object of a world it is.
    pub(crate) fn set_own(&mut self, id: ObjectId) {
        self.own = Some(id);
    }

    /// Returns its angle within π of the middle of its limits, rad; the middle while it makes no rows.
    pub(crate) fn first_angle(&self, view: &WorldView) -> f64 {
        let middle = self.middle_of_limits(0);
        self.position(view).map_or(middle, |[angle, _]| near(angle, middle))
    }

    /// Returns the middle of the limits of degree of freedom `k`; 0 without limits, and the angle nearest to 0 that a limit on one
    /// side leaves.
    pub(super) fn middle_of_limits(&self, k: usize) -> f64 {
        let middle = |[lo, hi]: [f64; 2]| {
            if lo.is_finite() && hi.is_finite() { 0.5 * (lo + hi) } else { 0.0f64.max(lo).min(hi) }
        };
        self.dofs[k].settings.limits.map_or(0.0, middle)
    }

    /// Returns the angle within π of which that of a revolute joint is.
    pub(super) fn middle(&self, view: &WorldView) -> f64 {
        let middle = self.middle_of_limits(0);
        if !self.counts_turns() {
            return middle;
        }
        let own = self.own.filter(|id| view.get::<LoopJoint>(*id).is_some_and(|known| std::ptr::eq(known, self)));
        let range = own.and_then(|id| view.state_range(id));
        range.and_then(|range| view.x.get(range.x.clone())?.first().copied()).unwrap_or(middle)
    }
}

impl FrameState for LoopJoint {
    fn len(&self) -> usize {
        usize::from(self.counts_turns())
    }

    fn write_initial(&self, x: &mut [f64]) {
        x.fill(self.middle_of_limits(0));
    }

    fn advance(&self, _me: &StateRange, frame: &Frame, x: &mut [f64], _out: &mut Vec<FrameImpulse>) {
        if let (Some([angle, _]), Some(x)) = (self.position(&frame.view), x.first_mut()) {
            *x = angle;
        }
    }
}
