//! The server's side of a session: a state machine without clock and link. Times and messages go
//! in, messages and events come out.
//!
//! ```text
//!                 JOIN               first READY / PRESENTED
//!  facet:  absent ─────► following ───────────────────────────► in step
//!                           ▲        late, or not presented        │
//!                           └──────────────────────────────────────┘     drop_timeout, LEAVE, closed: absent
//!
//!  frame:  idle ──publish──► ready? ──all in step, or ready_timeout──► presented? ──all in step, or ready_timeout──► idle
//! ```
//!
//! A *following* facet gets all messages, and no frame waits for it. So a facet that freezes stalls
//! the others once, for `ready_timeout`. A facet that joined before the first frame is awaited from
//! that frame on, for `first_frame_timeout`.

mod computing;
mod duplicate_facets;
mod frame_times;
mod frames;
mod receiving;
mod sending;

pub use frame_times::FrameTimes;

use super::input::Input;
use super::messages::{Content, FacetCounts, FrameAck};
use super::publisher::Publisher;
use super::transport::{Closed, Delivery, FacetNumber, LinkEvent, MAX_FACETS};
use super::wire::{Hash, MessageKind};
use computing::InputStream;
use duplicate_facets::DuplicateFacets;
pub(crate) use duplicate_facets::process_of;
use frame_times::{ClockOffset, FrameTimer, RequestTime};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;
use tumble_core::World;

/// When facets show a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SyncMode {
    /// When every critical facet has drawn it.
    Lockstep,
    /// Each facet as soon as it has drawn it.
    Latest,
}

/// A facet that may join.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FacetSlot {
    /// Name in the cave file.
    pub name: String,
    /// Whether the other facets wait for it.
    pub critical: bool,
}

/// Options of a server's session, named as in `[sync]` of a cave file.
#[derive(Clone, Debug, PartialEq)]
pub struct ServerOptions {
    /// Number of this run, different at each start.
    pub run: u64,
    /// BLAKE3 hash of the scene.
    pub scene: [u8; 32],
    /// The facets, by number. At most [`MAX_FACETS`]; further ones cannot join.
    pub slots: Vec<FacetSlot>,
    /// `mode`.
    pub mode: SyncMode,
    /// `ready_timeout_ms`: how long ready facets wait for the others.
    pub ready_timeout: Duration,
    /// Timeout of the first frame for facets that joined before it.
    pub first_frame_timeout: Duration,
    /// `drop_timeout_ms`.
    pub drop_timeout: Duration,
    /// `history_frames`: number of frames whose hashes are kept.
    pub history: usize,
    /// Resend interval for links that may lose messages. `None` if the link is reliable.
    pub resend_interval: Option<Duration>,
    /// Number of the first frame.
    pub first_frame: u64,
    /// Largest number of contacts that are sent with a frame ([`Publisher::with_contacts`]); 0 by
    /// default.
    pub contacts: usize,
    /// Largest number of events that are sent with a frame ([`Publisher::with_events`]); 0 by default. The readings of sensors of
    /// the scene file are sent always.
    pub events: usize,
    /// BLAKE3 hash of the scene with all constants and settings, for facets that step the world by
    /// themselves ([`Content::Inputs`]). `None` by default: such facets are refused.
    pub compute: Option<[u8; 32]>,
}

impl ServerOptions {
    /// Returns the options with the defaults of a cave file.
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
            contacts: 0,
            events: 0,
            compute: None,
        }
    }
}

/// Membership of a facet in the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Membership {
    /// Not joined.
    Absent,
    /// Joined, and not awaited.
    Following,
    /// Joined, and awaited by every frame.
    InStep,
}

/// Counts of the server about one facet. They wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct SlotCounts {
    /// Number of joins.
    pub joined: u64,
    /// Times that it was dropped: by timeout, or because its link closed.
    pub dropped: u64,
    /// Frames that it has shown.
    pub presented: u64,
    /// Frames that continued without it because it was not ready in time.
    pub late: u64,
    /// Frames whose presentation it did not acknowledge in time.
    pub missing: u64,
    /// Messages received more than once.
    pub duplicate: u64,
    /// Messages of an earlier run, join, or long past frame.
    pub stale: u64,
    /// Messages with a wrong hash.
    pub torn: u64,
    /// Messages refused for any other reason.
    pub refused: u64,
    /// Frames for which its hash differs from the server's.
    pub mismatched: u64,
}

/// Event of a session.
#[allow(clippy::large_enum_variant)] // inputs are rare, and a box would be part of the API
#[derive(Clone, Debug, PartialEq)]
pub enum ServerEvent {
    /// A facet joined.
    Joined(FacetNumber),
    /// A facet's join was refused, with the reason.
    Refused(FacetNumber, String),
    /// A facet is gone: timed out, closed, or left by itself (`true`).
    Gone(FacetNumber, bool),
    /// A facet has drawn a frame; the flag says whether its hash is right.
    Ready(FacetNumber, u64, FrameAck, bool),
    /// A facet has shown a frame; the flag says whether its hash is right.
    Presented(FacetNumber, u64, FrameAck, bool),
    /// A frame continued without a facet.
    Late(FacetNumber, u64),
    /// Presentation times of a frame. In lockstep it precedes `Finished`, in `latest` it follows
    /// some frames later.
    Shown(FrameTimes),
    /// All awaited facets have shown a frame.
    Finished(u64),
    /// Input of a user.
    Input(FacetNumber, Input),
    /// A facet that steps by itself had another state after a frame. The text names the first object
    /// that differs.
    Differs(FacetNumber, u64, String),
}

/// A message to send.
#[derive(Clone, Debug, PartialEq)]
pub struct ToFacets {
    /// Receivers.
    pub to: Vec<FacetNumber>,
    /// Delivery guarantee.
    pub delivery: Delivery,
    /// The encoded message.
    pub message: Arc<Vec<u8>>,
}

/// Maximum number of events kept between two calls of [`ServerSession::events`].
const MAX_EVENTS: usize = 1 << 16;
/// Number of former joins of a facet that are remembered.
const MAX_FORMER_JOINS: usize = 8;

struct FacetState {
    slot: FacetSlot,
    membership: Membership,
    join: u64,
    former_joins: VecDeque<u64>,
    duplicate_facets: DuplicateFacets,
    content: Content,
    /// For a facet that steps by itself: whether it needs a whole world.
    needs_world: bool,
    /// Frame of a world that was sent to it and not answered yet.
    world_under_way: Option<u64>,
    last_received: Duration,
    sent: Duration,
    /// Whether the facet has answered the snapshot with a frame.
    synced: bool,
    ready: Option<u64>,
    presented: Option<u64>,
    /// While following: its last ready frame, and the time of that message.
    answered: Option<(u64, Duration)>,
    /// Whether it draws in time again. It is then awaited from the next frame on, and the flag
    /// holds until it is ready for that frame.
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

/// Frames of one kind: for drawing facets, or for replicas.
struct Stream {
    publisher: Publisher,
    snapshot: Arc<Vec<u8>>,
    /// Frame with which the object table was sent.
    listed: Option<u64>,
    state: Arc<Vec<u8>>,
    hashes: VecDeque<(u64, Hash)>,
}

/// The server's session.
pub struct ServerSession {
    options: ServerOptions,
    facets: Vec<FacetState>,
    /// Poses, then exact messages.
    streams: [Stream; 2],
    inputs: InputStream,
    /// The last published frame.
    frame: Option<u64>,
    next: u64,
    time_s: f64,
    stage: FrameStage,
    /// When the first awaited facet was ready for the frame.
    first_ready_at: Option<Duration>,
    out: Vec<ToFacets>,
    events: VecDeque<ServerEvent>,
    close: Vec<FacetNumber>,
    ended: bool,
    frame_times: FrameTimer,
}

impl ServerSession {
    /// Creates the session. `base` is the world as the scene file makes it, before the first step.
    pub fn new(mut options: ServerOptions, base: &World) -> ServerSession {
        options.slots.truncate(MAX_FACETS);
        options.history = options.history.clamp(1, 1024);
        let facet_state = |slot: &FacetSlot| FacetState {
            slot: slot.clone(),
            membership: Membership::Absent,
            join: 0,
            former_joins: VecDeque::new(),
            duplicate_facets: DuplicateFacets::default(),
            content: Content::Poses,
            needs_world: false,
            world_under_way: None,
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
        let (contacts, events) = (options.contacts, options.events);
        let stream = |exact| Stream {
            publisher: Publisher::new(base, exact, 0).with_contacts(contacts).with_events(events),
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
            inputs: InputStream::default(),
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

    /// Returns the membership of a facet.
    pub fn membership(&self, facet: FacetNumber) -> Membership {
        self.facets.get(facet as usize).map_or(Membership::Absent, |p| p.membership)
    }

    /// Returns the server's counts about a facet, and the facet's own counts of its last heartbeat.
    pub fn counts(&self, facet: FacetNumber) -> (SlotCounts, FacetCounts) {
        self.facets.get(facet as usize).map_or_else(Default::default, |p| (p.counts, p.reported))
    }

    /// Returns whether any facet has joined.
    pub fn has_facets(&self) -> bool {
        self.joined().next().is_some()
    }

    /// Returns whether every critical facet has joined.
    pub fn all_critical_joined(&self) -> bool {
        self.facets.iter().all(|p| !p.slot.critical || p.membership != Membership::Absent)
    }

    /// Returns the names of the critical facets that have not joined.
    pub fn missing_facets(&self) -> Vec<&str> {
        self.facets
            .iter()
            .filter(|p| p.slot.critical && p.membership == Membership::Absent)
            .map(|p| p.slot.name.as_str())
            .collect()
    }

    /// Returns whether the next frame may be published: no facet is awaited any more.
    pub fn is_idle(&self) -> bool {
        self.stage == FrameStage::Idle
    }

    /// Returns the number of the last published frame.
    pub fn frame(&self) -> Option<u64> {
        self.frame
    }

    /// Returns the events since the last call, at most the newest 65536.
    pub fn events(&mut self) -> Vec<ServerEvent> {
        self.events.drain(..).collect()
    }

    /// Returns the messages to send, and forgets them.
    pub fn outgoing(&mut self) -> Vec<ToFacets> {
        std::mem::take(&mut self.out)
    }

    /// Returns the facets whose connection must be closed, and forgets them.
    pub fn closing(&mut self) -> Vec<FacetNumber> {
        std::mem::take(&mut self.close)
    }

    /// Sends END to all facets.
    pub fn end(&mut self) {
        // addressed by join number, because a facet without a frame does not know the run number
        let to: Vec<(FacetNumber, u64)> = self.joined().map(|(k, facet_state)| (k, facet_state.join)).collect();
        let frame = self.frame.unwrap_or(0);
        to.into_iter().for_each(|(facet, join)| self.send_to(facet, MessageKind::End, join, frame, |_| {}));
        (self.ended, self.stage) = (true, FrameStage::Idle);
    }

    /// Processes an event of the link; `bytes` is the message, if it is one.
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

    /// Drops a facet whose process has ended, so that no frame waits for it.
    pub fn facet_exited(&mut self, now: Duration, facet: FacetNumber) {
        if self.membership(facet) != Membership::Absent {
            self.mark_absent(facet, false);
            self.close.push(facet);
        }
        self.advance(now);
    }

    /// Does the work that is due; must be called after each return of `recv`.
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

/// Returns the bytes in lower-case hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
