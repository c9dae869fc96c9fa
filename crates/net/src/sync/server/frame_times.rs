//! Presentation times of frames by the server's clock: the skew between facets, and the latency
//! from an input to the picture that shows it.
//!
//! Each facet has its own clock. An exchange with four time stamps gives its offset (RFC 5905, §8):
//!
//! ```text
//! server   t1 sends ────┐                    ┌─► t4 receives
//! facet                 └─► T2 receives ─ T3 done
//!
//! offset = ((T2 − t1) + (T3 − t4)) / 2         error at most delay / 2,  delay = (t4 − t1) − (T3 − T2)
//! shown  = T3 − offset
//! skew   = last shown − first shown            latency = last shown − input
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | t1, T2 | STATE or PRESENT is sent and received |
//! | T3, t4 | the frame is drawn or shown, and READY or PRESENTED is received |
//! | delay | travel time of both messages; of the last exchanges the one with the smallest delay counts, because its error bound is the smallest |
//! | input | time of the oldest input that this frame is the first to show: by the clock of the facet that sent it, otherwise its arrival at the server's machine |

use super::super::messages::FrameAck;
use super::super::viewer::Viewer;
use super::ServerSession;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Number of exchanges after which the best one expires, because clocks drift.
const EXCHANGES_PER_WINDOW: u32 = 64;
/// Maximum number of frames measured at once: in `latest`, some facets show one frame while others
/// have the next.
const MAX_OPEN_FRAMES: usize = 4;
/// Maximum number of users whose inputs are timed.
const MAX_TIMED_USERS: usize = super::super::viewer::MAX_USERS;

/// Presentation of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameTimes {
    /// Number of the frame.
    pub frame: u64,
    /// Number of facets that showed it in time.
    pub facets: usize,
    /// Time from the first to the last facet that showed it.
    pub skew: Duration,
    /// Time of the last facet that showed it, by the server's clock.
    pub shown: Duration,
    /// Error bound of the skew: the sum of the bounds of the two clock offsets.
    pub error: Duration,
    /// Time from the input to the last facet that showed it. Only for the first frame that shows an
    /// input.
    pub input: Option<Duration>,
}

/// Offset of a facet's clock from the server's.
#[derive(Clone, Copy, Default)]
pub(super) struct ClockOffset {
    /// Smallest delay and its offset, µs, of the current and of the previous window of exchanges.
    best: [Option<(i64, i64)>; 2],
    exchanges: u32,
}

impl ClockOffset {
    /// Adds an exchange. A facet's times are not trusted: impossible ones are ignored.
    fn exchange(&mut self, asked: Duration, done: &FrameAck, now: Duration) {
        let Some(received) = done.received_us.and_then(|us| i64::try_from(us).ok()) else { return };
        let Ok(at) = i64::try_from(done.completed_us) else { return };
        let (asked, now) = (micros(asked), micros(now));
        let (Some(joined), Some(first), Some(second)) =
            (at.checked_sub(received), received.checked_sub(asked), at.checked_sub(now))
        else {
            return;
        };
        let wait = (now - asked).saturating_sub(joined);
        if joined < 0 || wait < 0 {
            return;
        }
        self.exchanges += 1;
        if self.exchanges > EXCHANGES_PER_WINDOW {
            (self.best, self.exchanges) = ([None, self.best[0]], 1);
        }
        let sample = (wait, first / 2 + second / 2);
        self.best[0] = Some(self.best[0].map_or(sample, |best| if best.0 <= wait { best } else { sample }));
    }

    /// Converts a time of the facet's clock to the server's. Returns it with its error bound, µs.
    fn here(&self, completed_us: u64) -> Option<(i64, i64)> {
        let (wait, ahead) = self.best.into_iter().flatten().min()?;
        Some((i64::try_from(completed_us).ok()?.checked_sub(ahead)?, wait / 2))
    }
}

/// A frame that is being presented.
struct OpenFrame {
    frame: u64,
    /// By the server's clock, µs.
    input: Option<i64>,
    first: (i64, i64),
    last: (i64, i64),
    facets: usize,
}

/// Frames that are being presented, and inputs that are not shown yet.
#[derive(Default)]
pub(super) struct FrameTimer {
    open_frames: VecDeque<OpenFrame>,
    /// Newest input and its arrival, by user.
    arrivals: BTreeMap<u16, (u64, Duration)>,
    /// Number of the input that the last frame shows, by user.
    shown: Vec<u64>,
}

impl FrameTimer {
    /// Notes the arrival of an input.
    pub(super) fn input(&mut self, now: Duration, user: u16, sequence: u64) {
        if (user as usize) < MAX_TIMED_USERS {
            self.arrivals.insert(user, (sequence, now));
        }
    }

    /// Adds a frame. Returns the times of an older frame that it displaces.
    pub(super) fn publish(&mut self, frame: u64, viewer: Option<&Viewer>) -> Option<FrameTimes> {
        let mut input = None;
        if let Some(viewer) = viewer {
            self.shown.resize(viewer.users.len(), 0);
            for (k, user) in viewer.users.iter().enumerate().filter(|(k, user)| self.shown[*k] != user.input) {
                let arrivals = self
                    .arrivals
                    .get(&(k as u16))
                    .filter(|(sequence, _)| *sequence == user.input)
                    .map(|(_, at)| micros(*at));
                input = earlier(input, arrivals);
            }
            self.shown.clear();
            self.shown.extend(viewer.users.iter().map(|user| user.input));
        }
        self.open_frames.push_back(OpenFrame { frame, input, first: (i64::MAX, 0), last: (i64::MIN, 0), facets: 0 });
        (self.open_frames.len() > MAX_OPEN_FRAMES)
            .then(|| self.open_frames.pop_front().and_then(OpenFrame::frame_times))
            .flatten()
    }

    /// Adds the presentation of a frame by a facet.
    fn presented(&mut self, frame: u64, at: (i64, i64), input_us: Option<u32>) {
        let Some(open_frames) = self.open_frames.iter_mut().find(|s| s.frame == frame) else { return };
        open_frames.facets += 1;
        open_frames.first = open_frames.first.min(at);
        open_frames.last = open_frames.last.max(at);
        open_frames.input = earlier(open_frames.input, input_us.map(|us| at.0.saturating_sub(us.into())));
    }

    /// Closes a frame: no facet is awaited any more.
    pub(super) fn finish(&mut self, frame: u64) -> Option<FrameTimes> {
        let k = self.open_frames.iter().position(|s| s.frame == frame)?;
        self.open_frames.drain(..=k).next_back()?.frame_times()
    }
}

impl OpenFrame {
    fn frame_times(self) -> Option<FrameTimes> {
        let between = |from: i64, to: i64| Duration::from_micros(u64::try_from(to.saturating_sub(from)).unwrap_or(0));
        let OpenFrame { frame, input, first, last, facets } = self;
        let error = if facets > 1 { between(0, first.1 + last.1) } else { Duration::ZERO };
        (facets > 0).then(|| FrameTimes {
            frame,
            facets,
            skew: between(first.0, last.0),
            shown: between(0, last.0),
            error,
            input: input.map(|input| between(input, last.0)),
        })
    }
}

fn earlier(a: Option<i64>, b: Option<i64>) -> Option<i64> {
    a.into_iter().chain(b).min()
}

fn micros(at: Duration) -> i64 {
    i64::try_from(at.as_micros()).unwrap_or(i64::MAX)
}

/// Frame of the last message to a facet, and the time of sending. There is no time if the message
/// was sent more than once, because the acknowledged copy is unknown.
pub(super) type RequestTime = Option<(u64, Option<Duration>)>;

/// Notes the sending of a message for a frame.
pub(super) fn note_request(asked: &mut RequestTime, frame: u64, now: Duration) {
    let again = asked.is_some_and(|(before, _)| before == frame);
    *asked = Some((frame, (!again).then_some(now)));
}

impl ServerSession {
    /// Notes the arrival of an input that no facet sent: from a tracker or a recording. Inputs of
    /// facets are noted automatically. A frame whose viewer carries this number for this user is
    /// then timed ([`FrameTimes::input`]).
    pub fn note_input(&mut self, now: Duration, user: u16, sequence: u64) {
        self.frame_times.input(now, user, sequence);
    }

    /// Processes the times of a READY message.
    pub(super) fn time_ready(&mut self, now: Duration, facet: usize, frame: u64, done: &FrameAck) {
        let facet_state = &mut self.facets[facet];
        if let Some((_, Some(asked))) = facet_state.state_requested.filter(|(of, _)| *of == frame) {
            facet_state.clock.exchange(asked, done, now);
        }
    }

    /// Processes the times of a PRESENTED message.
    pub(super) fn time_presented(&mut self, now: Duration, facet: usize, frame: u64, done: &FrameAck) {
        let facet_state = &mut self.facets[facet];
        let asked = if self.options.mode == super::SyncMode::Lockstep {
            facet_state.present_requested
        } else {
            facet_state.state_requested
        };
        if let Some((_, Some(asked))) = asked.filter(|(of, _)| *of == frame) {
            facet_state.clock.exchange(asked, done, now);
        }
        if let Some(at) = facet_state.clock.here(done.completed_us) {
            self.frame_times.presented(frame, at, done.input_us);
        }
    }
}
