//! Smoothed and predicted heads of users.

use super::lead::{DisplayTimes, Lead};
use super::one_euro::{Placed, PoseFilter, Smoothing};
use super::osc::TrackedInput;
use nalgebra::{Quaternion, UnitQuaternion};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use tumble::collide::Pose;
use tumble::net::sync::Input;

/// Largest age of a pose that is predicted on. A head without a newer one stands: it counts as measured there anew.
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
    fn next(&mut self, lead: Lead, display: &DisplayTimes, start: Instant, now: Instant, fresh: bool) -> AppliedInput {
        self.sequence += 1;
        let mut input = Input { sequence: self.sequence, ..self.last.input.clone() };
        let mut lead_s = None;
        if let (Some(head), Some(at)) = (&mut input.head, self.last.head_received) {
            let at = now.checked_sub(MAX_AGE).map_or(at, |oldest| at.max(oldest));
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

#[cfg(test)]
mod tests {
    use super::*;
    use tumble::net::sync::FrameTimes;

    /// A head that goes to and fro by 0.3 m, once in a period, and turns with it.
    fn head(time_s: f64, period_s: f64) -> Pose {
        let sway = (time_s * std::f64::consts::TAU / period_s).sin();
        let rotation = UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), 0.5 * sway);
        Pose::from_parts(nalgebra::Vector3::new(0.3 * sway, 0.0, 1.7).into(), rotation)
    }

    fn millis(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// Returns the rms error of the shown head, m, after the first second. A tracker sends a pose each `tracker_ms`, a
    /// frame is taken each 16 ms and presented 41 ms later, halfway between two facets 6 ms apart; every 40th frame is
    /// late by 300 ms.
    fn error_m(lead: Option<Lead>, tracker_ms: u64, period_s: f64) -> f64 {
        let head = |time_s: f64| head(time_s, period_s);
        let smoothing = Smoothing { rest_hz: None, beta: Smoothing::BETA };
        let mut heads = SmoothedHeads::new(lead.map(|lead| HeadOptions { smoothing, lead }));
        let (start, mut sent, mut shown) = (heads.start, 0, head(0.0));
        let (mut sum, mut count) = (0.0, 0);
        for frame in 0..600 {
            let now = 16 * frame + 7;
            let mut fresh = None;
            while sent <= now {
                let input = Input {
                    sequence: sent,
                    user: 0,
                    head: Some(head(1e-3 * sent as f64)),
                    wand: None,
                    hands: [None; 2],
                    buttons: 0,
                    keys: Vec::new(),
                };
                let received = start + millis(sent);
                fresh = Some(TrackedInput { input, received, head_received: Some(received) });
                sent += tracker_ms;
            }
            let applied = heads.applied(fresh.into_iter().collect(), start + millis(now));
            heads.display.begun(frame, millis(now));
            shown = applied.first().map_or(shown, |applied| applied.input.head.unwrap());
            let display = if frame % 40 == 39 { 341 } else { 41 };
            let error = (shown.translation.vector - head(1e-3 * (now + display) as f64).translation.vector).norm();
            if frame > 60 && display == 41 {
                (sum, count) = (sum + error * error, count + 1);
            }
            let (skew, last) = (millis(6), millis(now + display + 3));
            heads.display.shown(&FrameTimes {
                frame,
                facets: 2,
                skew,
                shown: last,
                error: Duration::ZERO,
                input: None,
            });
        }
        (sum / f64::from(count)).sqrt()
    }

    /// The exact lead is known here if the tracker sends with each frame: 7 ms of age and 41 ms to the picture.
    #[test]
    fn a_measured_lead_is_as_good_as_the_exact_one() {
        let (none, exact, measured) = (
            error_m(None, 16, 1.5),
            error_m(Some(Lead::Stated(0.048)), 16, 1.5),
            error_m(Some(Lead::Measured(0.0)), 16, 1.5),
        );
        // a lag of 48 ms at 0.89 m/s rms is an error of 43 mm
        assert!((none - 0.0426).abs() < 0.001, "{none}");
        assert!(exact < none / 3.0 && (measured / exact - 1.0).abs() < 0.01, "{none} {exact} {measured}");
        // what is stated comes on top: too much lead is worse
        assert!(error_m(Some(Lead::Measured(0.04)), 16, 1.5) > 2.0 * measured);
    }

    /// A tracker of 20 Hz, whose poses are up to 50 ms old, and a head that sways slowly: the best constant leaves steps.
    #[test]
    fn a_slow_tracker_is_predicted_for_each_frame() {
        let measured = error_m(Some(Lead::Measured(0.0)), 50, 4.0);
        let best = (0..=200).step_by(5).map(|ms| error_m(Some(Lead::Stated(1e-3 * f64::from(ms))), 50, 4.0));
        let best = best.fold(f64::INFINITY, f64::min);
        assert!(measured < 0.8 * best, "{measured} {best}");
    }

    /// A head that moves evenly and is then lost, while messages for the user go on: it goes back to its last pose.
    #[test]
    fn a_head_that_is_lost_stands_at_its_last_pose() {
        for lead in [Lead::Stated(0.05), Lead::Measured(0.05)] {
            let smoothing = Smoothing { rest_hz: None, beta: Smoothing::BETA };
            let mut heads = SmoothedHeads::new(Some(HeadOptions { smoothing, lead }));
            let start = heads.start;
            let mut shown = Vec::new();
            for k in 0..120 {
                let (sent, now) = (start + millis(16 * k.min(60)), start + millis(16 * k));
                let x = 0.016 * k.min(60) as f64;
                let head =
                    Some(Pose::from_parts(nalgebra::Vector3::new(x, 0.0, 1.7).into(), UnitQuaternion::identity()));
                let (wand, hands, keys) = (None, [None; 2], Vec::new());
                let input = Input { sequence: k, user: 0, head, wand, hands, buttons: 0, keys };
                let tracked = TrackedInput { input, received: now, head_received: Some(sent) };
                shown.push(heads.applied(vec![tracked], now)[0].input.head.unwrap().translation.x);
            }
            // 1 m/s for 50 ms
            assert!((shown[60] - 0.96 - 0.05).abs() < 1e-3 && (shown[119] - 0.96).abs() < 1e-6, "{shown:?}");
        }
    }

    #[test]
    fn a_lead_is_a_number_or_measured() {
        let lead = |text: &str| text.parse::<Lead>();
        assert_eq!(lead("auto"), Ok(Lead::Measured(0.0)));
        assert_eq!((lead("auto+25"), lead("40")), (Ok(Lead::Measured(0.025)), Ok(Lead::Stated(0.04))));
        for wrong in ["", "automatic", "auto+", "auto25", "auto-5", "auto+201", "201", "-1", "nan"] {
            let expected = "expected auto, auto+MS or MS, with MS from 0 to 200";
            assert_eq!(lead(wrong), Err(expected.to_owned()), "{wrong}");
        }
    }
}
