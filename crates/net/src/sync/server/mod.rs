//! The server's side of a session: a state machine. It has no clock and no link; `now` and messages go in, messages and events come out.
//!
//! ```text
//!                 JOIN               first READY / PRESENTED
//!  facet:  absent ─────► following ───────────────────────────► in step
//!                           ▲        late, or not presented        │
//!                           └──────────────────────────────────────┘     silent for drop_after, LEAVE, closed: absent
//!
//!  frame:  idle ──publish──► ready? ──all in step are, or ready_after──► presented? ──all in step have, or ready_after──► idle
//! ```
//!
//! A facet that is *following* gets all messages and nobody waits for it: a wall stands still once, for `ready_timeout`, when a facet freezes. A facet that
//! joined before the first frame is waited for from that frame on, for `first_frame_timeout`.

mod duplicate_facets;
mod frame_times;
mod frames;
mod receiving;
mod sending;

pub use frame_times::FrameTimes;

use super::input::Input;
use super::messages::{FacetCounts, FrameAck};
use super::publisher::Publisher;
use super::transport::{Closed, Delivery, FacetNumber, LinkEvent, MAX_FACETS};
use super::wire::{Hash, MessageKind};
use duplicate_facets::DuplicateFacets;
pub(crate) use duplicate_facets::process_of;
use frame_times::{ClockOffset, FrameTimer, RequestTime};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;
use tumble_core::World;

/// When a frame is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SyncMode {
    /// When every critical facet has drawn it.
    Lockstep,
    /// By each facet as soon as it has drawn it.
    Latest,
}

/// A facet that may join.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FacetSlot {
    /// Its name in the cave file.
    pub name: String,
    /// Whether the others wait for it.
    pub critical: bool,
}

/// What a server is told at the start; names as in `[sync]` of a cave file.
#[derive(Clone, Debug, PartialEq)]
pub struct ServerOptions {
    /// Number of this run, another one at each start.
    pub run: u64,
    /// BLAKE3 of the scene.
    pub scene: [u8; 32],
    /// The facets, by number; at most [`MAX_FACETS`], the rest cannot join.
    pub slots: Vec<FacetSlot>,
    /// `mode`.
    pub mode: SyncMode,
    /// `ready_timeout_ms`: how long those who are ready wait for the others.
    pub ready_timeout: Duration,
    /// How long the first frame of who joined before it may take.
    pub first_frame_timeout: Duration,
    /// `drop_timeout_ms`.
    pub drop_timeout: Duration,
    /// `history_frames`: frames whose hashes are remembered.
    pub history: usize,
    /// For links that may lose messages, how long to wait before one is sent again; `None` where the link sees to that.
    pub resend_interval: Option<Duration>,
    /// Number of the first frame.
    pub first_frame: u64,
}

impl ServerOptions {
    /// The defaults of a cave file.
    pub fn new(run: u64, scene: [u8; 32], slots: Vec<FacetSlot>) -> ServerOptions {
        let ms = Duration::from_millis;
        ServerOptions {
            run,
            scene,
            slots,
            mode: SyncMode::Lockstep,
            ready_timeout: ms(100),
            first_frame_timeout: ms(10_000),
            drop_timeout: ms(2000),
            history: 8,
            resend_interval: None,
            first_frame: 0,
        }
    }
}

/// How a facet stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Membership {
    /// Not there.
    Absent,
    /// There; nobody waits for it.
    Following,
    /// There, and waited for.
    InStep,
}

/// What the server counted about one facet. Counts wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct SlotCounts {
    /// Times it joined.
    pub joined: u64,
    /// Times it was dropped: silent, or its link closed.
    pub dropped: u64,
    /// Frames it has shown.
    pub presented: u64,
    /// Frames that others did not wait for any longer.
    pub late: u64,
    /// Frames that it did not tell to have shown in time.
    pub missing: u64,
    /// Messages that came again.
    pub duplicate: u64,
    /// Messages of an earlier run, joining, or of a frame long past.
    pub stale: u64,
    /// Messages whose hash did not fit.
    pub torn: u64,
    /// Messages refused for any other reason.
    pub refused: u64,
    /// Frames of which it drew something else than was sent.
    pub mismatched: u64,
}

/// Something that happened.
#[allow(clippy::large_enum_variant)] // inputs are few, and a box would show to all who take them
#[derive(Clone, Debug, PartialEq)]
pub enum ServerEvent {
    /// A facet is there.
    Joined(FacetNumber),
    /// A facet was told why it is not let in.
    Refused(FacetNumber, String),
    /// A facet is gone: silent, closed, or by its own word (`true`).
    Gone(FacetNumber, bool),
    /// A facet has drawn a frame; whether it is what was sent.
    Ready(FacetNumber, u64, FrameAck, bool),
    /// A facet has shown a frame; whether it is what was sent.
    Presented(FacetNumber, u64, FrameAck, bool),
    /// A frame went on without a facet.
    Late(FacetNumber, u64),
    /// When a frame was shown, of those who showed it. In lockstep just before `Finished`, in `latest` some frames later.
    Shown(FrameTimes),
    /// A frame has been shown by all who were waited for.
    Finished(u64),
    /// What a user did.
    Input(FacetNumber, Input),
}

/// A message to be sent.
#[derive(Clone, Debug, PartialEq)]
pub struct ToFacets {
    /// To whom.
    pub to: Vec<FacetNumber>,
    /// How.
    pub delivery: Delivery,
    /// What.
    pub message: Arc<Vec<u8>>,
}

/// Events kept for who does not ask for them.
const MAX_EVENTS: usize = 1 << 16;
/// Earlier joinings of a facet that are remembered as such.
const MAX_FORMER_JOINS: usize = 8;

struct FacetState {
    slot: FacetSlot,
    membership: Membership,
    join: u64,
    former_joins: VecDeque<u64>,
    duplicate_facets: DuplicateFacets,
    exact: bool,
    last_received: Duration,
    sent: Duration,
    /// It has answered the snapshot with a frame.
    synced: bool,
    ready: Option<u64>,
    presented: Option<u64>,
    /// While it follows: the frame that it was ready for last, and when it said so.
    answered: Option<(u64, Duration)>,
    /// It is drawing in time again, and is waited for from the next frame on; until it is ready for that one.
    caught_up: bool,
    counts: SlotCounts,
    reported: FacetCounts,
    inputs: std::collections::BTreeMap<u16, u64>,
    clock: ClockOffset,
    state_requested: RequestTime,
    present_requested: RequestTime,
}

#[derive(Clone, Copy, PartialEq)]
enum FrameStage {
    Idle,
    Ready(Duration),
    Presented(Duration),
}

/// One stream of frames: for those that draw, or for replicas.
struct Stream {
    publisher: Publisher,
    snapshot: Arc<Vec<u8>>,
    /// Frame that brought the list of objects.
    listed: Option<u64>,
    state: Arc<Vec<u8>>,
    hashes: VecDeque<(u64, Hash)>,
}

/// The server's session.
pub struct ServerSession {
    options: ServerOptions,
    facets: Vec<FacetState>,
    /// Poses, exact.
    streams: [Stream; 2],
    /// The frame published last.
    frame: Option<u64>,
    next: u64,
    time_s: f64,
    stage: FrameStage,
    /// When the first of those who are waited for was ready for the frame.
    first_ready_at: Option<Duration>,
    out: Vec<ToFacets>,
    events: VecDeque<ServerEvent>,
    close: Vec<FacetNumber>,
    ended: bool,
    frame_times: FrameTimer,
}

impl ServerSession {
    /// `base`: the world as the scene file makes it, before the first step.
    pub fn new(mut options: ServerOptions, base: &World) -> ServerSession {
        options.slots.truncate(MAX_FACETS);
        options.history = options.history.clamp(1, 1024);
        let facet_state = |slot: &FacetSlot| FacetState {
            slot: slot.clone(),
            membership: Membership::Absent,
            join: 0,
            former_joins: VecDeque::new(),
            duplicate_facets: DuplicateFacets::default(),
            exact: false,
            last_received: Duration::ZERO,
            sent: Duration::ZERO,
            synced: false,
            ready: None,
            presented: None,
            answered: None,
            caught_up: false,
            counts: SlotCounts::default(),
            reported: FacetCounts::default(),
            inputs: Default::default(),
            clock: ClockOffset::default(),
            state_requested: None,
            present_requested: None,
        };
        let facets = options.slots.iter().map(facet_state).collect();
        let stream = |exact| Stream {
            publisher: Publisher::new(base, exact, 0),
            snapshot: Arc::default(),
            listed: None,
            state: Arc::default(),
            hashes: VecDeque::new(),
        };
        let next = options.first_frame;
        ServerSession {
            options,
            facets,
            streams: [stream(false), stream(true)],
            frame: None,
            next,
            time_s: 0.0,
            stage: FrameStage::Idle,
            first_ready_at: None,
            out: Vec::new(),
            events: VecDeque::new(),
            close: Vec::new(),
            ended: false,
            frame_times: FrameTimer::default(),
        }
    }

    /// How a facet stands.
    pub fn membership(&self, facet: FacetNumber) -> Membership {
        self.facets.get(facet as usize).map_or(Membership::Absent, |p| p.membership)
    }

    /// What was counted here about a facet, and what it counted itself by its last beat.
    pub fn counts(&self, facet: FacetNumber) -> (SlotCounts, FacetCounts) {
        self.facets.get(facet as usize).map_or_else(Default::default, |p| (p.counts, p.reported))
    }

    /// Whether any facet is there.
    pub fn has_facets(&self) -> bool {
        self.joined().next().is_some()
    }

    /// Whether every critical facet is there.
    pub fn all_critical_joined(&self) -> bool {
        self.facets.iter().all(|p| !p.slot.critical || p.membership != Membership::Absent)
    }

    /// Names of the critical facets that are not there.
    pub fn missing_facets(&self) -> Vec<&str> {
        self.facets
            .iter()
            .filter(|p| p.slot.critical && p.membership == Membership::Absent)
            .map(|p| p.slot.name.as_str())
            .collect()
    }

    /// Whether the next frame may be published: the last one has been shown, or nobody waits for it any more.
    pub fn is_idle(&self) -> bool {
        self.stage == FrameStage::Idle
    }

    /// The frame published last.
    pub fn frame(&self) -> Option<u64> {
        self.frame
    }

    /// What happened since the last call; the oldest of more than 65536 are forgotten.
    pub fn events(&mut self) -> Vec<ServerEvent> {
        self.events.drain(..).collect()
    }

    /// What is to be sent.
    pub fn outgoing(&mut self) -> Vec<ToFacets> {
        std::mem::take(&mut self.out)
    }

    /// Facets whose connection is to be closed.
    pub fn closing(&mut self) -> Vec<FacetNumber> {
        std::mem::take(&mut self.close)
    }

    /// Tells all facets that the run is over.
    pub fn end(&mut self) {
        // by the number of its joining: who has no frame yet knows no number of the run
        let to: Vec<(FacetNumber, u64)> = self.joined().map(|(k, facet_state)| (k, facet_state.join)).collect();
        let frame = self.frame.unwrap_or(0);
        to.into_iter().for_each(|(facet, join)| self.send_to(facet, MessageKind::End, join, frame, |_| {}));
        (self.ended, self.stage) = (true, FrameStage::Idle);
    }

    /// Takes what a link reports; `bytes` is the message, if it is one.
    pub fn on_event(&mut self, now: Duration, facet: FacetNumber, event: LinkEvent, bytes: &[u8]) {
        self.facets
            .get_mut(facet as usize)
            .into_iter()
            .for_each(|facet_state| facet_state.duplicate_facets.link(event));
        match event {
            LinkEvent::Opened => {}
            LinkEvent::Message => self.on_message(now, facet, bytes),
            LinkEvent::Closed(why) => self.mark_absent(facet, why == Closed::ByPeer),
        }
        self.advance(now);
    }

    /// A facet's process has ended: it is dropped at once, and nobody waits for it.
    pub fn facet_exited(&mut self, now: Duration, facet: FacetNumber) {
        if self.membership(facet) != Membership::Absent {
            self.mark_absent(facet, false);
            self.close.push(facet);
        }
        self.advance(now);
    }

    /// Does what is due by now: call it whenever `recv` returns.
    pub fn advance(&mut self, now: Duration) {
        self.drop_timed_out(now);
        if let Some(after) = self.options.resend_interval {
            self.resend(now, after);
        }
        self.send_heartbeats(now);
        loop {
            let before = self.stage;
            self.advance_frame(now);
            if self.stage == before {
                return;
            }
        }
    }

    fn report(&mut self, event: ServerEvent) {
        if self.events.len() == MAX_EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }
}

/// Lower-case hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
