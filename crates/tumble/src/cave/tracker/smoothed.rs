//! Smoothed and predicted heads of users.

use super::lead::{DisplayTimes, Lead};
use super::one_euro::{Placed, PoseFilter, Smoothing};
use super::osc::TrackedInput;
use nalgebra::{Quaternion, UnitQuaternion};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use tumble::collide::Pose;
use tumble::net::sync::Input;

/// Age of a pose up to which a head without a newer one is predicted on for each frame.
const MAX_AGE: Duration = Duration::from_millis(100);

/// Smoothing and prediction that were asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadOptions {
    pub smoothing: Smoothing,
    pub lead: Lead,
}

/// An input to apply in the next frame.
#[derive(Clone, Debug)]
pub struct AppliedInput {
    pub input: Input,
    /// Time since its receipt; `None` if only the prediction is new.
    pub age: Option<Duration>,
    /// Time by which the head is predicted, s; `None` if it passes as it is.
    pub lead_s: Option<f64>,
}

/// The filters of all users. Hands and wands pass as they are: a filter would delay what they push.
pub struct SmoothedHeads {
    options: Option<HeadOptions>,
    start: Instant,
    users: BTreeMap<u16, SmoothedUser>,
    /// From the begin of frames to their presentation.
    pub display: DisplayTimes,
}

struct SmoothedUser {
    filter: PoseFilter,
    last: TrackedInput,
    /// Number of the last input, which counts repeated ones too.
    sequence: u64,
}

impl SmoothedHeads {
    /// Begins; without options heads pass as they are. No pose is older than this.
    pub fn new(options: Option<HeadOptions>) -> SmoothedHeads {
        SmoothedHeads { options, start: Instant::now(), users: BTreeMap::new(), display: DisplayTimes::default() }
    }

    /// Returns the inputs with the heads that pictures are drawn for. With a measured lead, a head whose tracker is
    /// slower than the frames is predicted again for each frame.
    pub fn applied(&mut self, fresh: Vec<TrackedInput>, now: Instant) -> Vec<AppliedInput> {
        let age = |at: Instant| now.saturating_duration_since(at);
        let Some(options) = self.options else {
            let as_is = |TrackedInput { input, received, .. }: TrackedInput| AppliedInput {
                input,
                age: Some(age(received)),
                lead_s: None,
            };
            return fresh.into_iter().map(as_is).collect();
        };
        let mut applied = Vec::new();
        let given: Vec<u16> = fresh.iter().map(|tracked| tracked.input.user).collect();
        for tracked in fresh {
            let user = self.users.entry(tracked.input.user).or_insert_with(|| SmoothedUser {
                filter: PoseFilter::new(options.smoothing),
                last: tracked.clone(),
                sequence: 0,
            });
            user.last = tracked;
            applied.push(user.next(options.lead, &self.display, self.start, now, true));
        }
        if let Lead::Measured(_) = options.lead {
            let (display, start) = (&self.display, self.start);
            let waiting = self.users.iter_mut().filter(|(number, user)| {
                !given.contains(number) && user.last.head_received.is_some_and(|at| age(at) < MAX_AGE)
            });
            applied.extend(waiting.map(|(_, user)| user.next(options.lead, display, start, now, false)));
        }
        applied
    }
}

impl SmoothedUser {
    /// Returns the user's last input with the head predicted from `now`.
    fn next(
        &mut self,
        lead: Lead,
        display: &DisplayTimes,
        start: Instant,
        now: Instant,
        fresh: bool,
    ) -> AppliedInput {
        self.sequence += 1;
        let mut input = Input { sequence: self.sequence, ..self.last.input.clone() };
        let mut lead_s = None;
        if let (Some(head), Some(at)) = (&mut input.head, self.last.head_received) {
            let ahead = display.lead_s(lead, now.saturating_duration_since(at));
            *head = predicted(&mut self.filter, at.saturating_duration_since(start), head, ahead);
            lead_s = Some(ahead);
        }
        let age = fresh.then(|| now.saturating_duration_since(self.last.received));
        AppliedInput { input, age, lead_s }
    }
}

/// Returns the head `lead_s` after the time at which it was received.
fn predicted(filter: &mut PoseFilter, received: Duration, head: &Pose, lead_s: f64) -> Pose {
    let q = head.rotation.coords;
    let measured = Placed { position: head.translation.vector.into(), rotation: [q.x, q.y, q.z, q.w] };
    let Placed { position, rotation: [x, y, z, w] } = filter.next(received.as_secs_f64(), measured, lead_s);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    Pose::from_parts(nalgebra::Vector3::from(position).into(), rotation)
}
