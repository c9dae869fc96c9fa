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
//! A facet that is *following* gets all messages and nobody waits for it: a wall stands still once, for `ready_after`, when a facet freezes. A facet that
//! joined before the first frame is waited for from that frame on, for `first_after`.

mod answers;
mod frames;
mod rivals;
mod sending;
mod times;

pub use times::FrameTimes;

use super::input::Input;
use super::messages::{Done, FacetCounts};
use super::publisher::Publisher;
use super::transport::{Closed, Delivery, FacetNumber, LinkEvent, MAX_FACETS};
use super::wire::{Hash, Kind};
use rivals::Rivals;
pub(crate) use rivals::process_of;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;
use times::{Asked, Clock, Times};
use tumble_core::World;

/// When a frame is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// When every critical facet has drawn it.
    Lockstep,
    /// By each facet as soon as it has drawn it.
    Latest,
}

/// A facet that may join.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seat {
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
    pub seats: Vec<Seat>,
    /// `mode`.
    pub pace: Pace,
    /// `ready_timeout_ms`: how long those who are ready wait for the others.
    pub ready_after: Duration,
    /// How long the first frame of who joined before it may take.
    pub first_after: Duration,
    /// `drop_timeout_ms`.
    pub drop_after: Duration,
    /// `history_frames`: frames whose hashes are remembered.
    pub history: usize,
    /// For links that may lose messages, how long to wait before one is sent again; `None` where the link sees to that.
    pub resend_after: Option<Duration>,
    /// Number of the first frame.
    pub first_frame: u64,
}

impl ServerOptions {
    /// The defaults of a cave file.
    pub fn new(run: u64, scene: [u8; 32], seats: Vec<Seat>) -> ServerOptions {
        let ms = Duration::from_millis;
        ServerOptions {
            run,
            scene,
            seats,
            pace: Pace::Lockstep,
            ready_after: ms(100),
            first_after: ms(10_000),
            drop_after: ms(2000),
            history: 8,
            resend_after: None,
            first_frame: 0,
        }
    }
}

/// How a facet stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Not there.
    Absent,
    /// There; nobody waits for it.
    Following,
    /// There, and waited for.
    InStep,
}

/// What the server counted about one facet. Counts wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct SeatCounts {
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
    Ready(FacetNumber, u64, Done, bool),
    /// A facet has shown a frame; whether it is what was sent.
    Presented(FacetNumber, u64, Done, bool),
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
const MAX_RETIRED: usize = 8;

struct Place {
    seat: Seat,
    standing: Standing,
    join: u64,
    retired: VecDeque<u64>,
    rivals: Rivals,
    exact: bool,
    heard: Duration,
    sent: Duration,
    /// It has answered the snapshot with a frame.
    synced: bool,
    ready: Option<u64>,
    presented: Option<u64>,
    /// While it follows: the frame that it was ready for last, and when it said so.
    answered: Option<(u64, Duration)>,
    /// It is drawing in time again, and is waited for from the next frame on; until it is ready for that one.
    keeps_up: bool,
    counts: SeatCounts,
    told: FacetCounts,
    inputs: std::collections::BTreeMap<u16, u64>,
    clock: Clock,
    asked_state: Asked,
    asked_present: Asked,
}

#[derive(Clone, Copy, PartialEq)]
enum Stage {
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
    places: Vec<Place>,
    /// Poses, exact.
    streams: [Stream; 2],
    /// The frame published last.
    frame: Option<u64>,
    next: u64,
    time_s: f64,
    stage: Stage,
    /// When the first of those who are waited for was ready for the frame.
    first_ready: Option<Duration>,
    out: Vec<ToFacets>,
    events: VecDeque<ServerEvent>,
    close: Vec<FacetNumber>,
    ended: bool,
    times: Times,
}

impl ServerSession {
    /// `base`: the world as the scene file makes it, before the first step.
    pub fn new(mut options: ServerOptions, base: &World) -> ServerSession {
        options.seats.truncate(MAX_FACETS);
        options.history = options.history.clamp(1, 1024);
        let place = |seat: &Seat| Place {
            seat: seat.clone(),
            standing: Standing::Absent,
            join: 0,
            retired: VecDeque::new(),
            rivals: Rivals::default(),
            exact: false,
            heard: Duration::ZERO,
            sent: Duration::ZERO,
            synced: false,
            ready: None,
            presented: None,
            answered: None,
            keeps_up: false,
            counts: SeatCounts::default(),
            told: FacetCounts::default(),
            inputs: Default::default(),
            clock: Clock::default(),
            asked_state: None,
            asked_present: None,
        };
        let places = options.seats.iter().map(place).collect();
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
            places,
            streams: [stream(false), stream(true)],
            frame: None,
            next,
            time_s: 0.0,
            stage: Stage::Idle,
            first_ready: None,
            out: Vec::new(),
            events: VecDeque::new(),
            close: Vec::new(),
            ended: false,
            times: Times::default(),
        }
    }

    /// How a facet stands.
    pub fn standing(&self, facet: FacetNumber) -> Standing {
        self.places.get(facet as usize).map_or(Standing::Absent, |p| p.standing)
    }

    /// What was counted here about a facet, and what it counted itself by its last beat.
    pub fn counts(&self, facet: FacetNumber) -> (SeatCounts, FacetCounts) {
        self.places.get(facet as usize).map_or_else(Default::default, |p| (p.counts, p.told))
    }

    /// Whether any facet is there.
    pub fn is_anyone_there(&self) -> bool {
        self.there().next().is_some()
    }

    /// Whether every critical facet is there.
    pub fn complete(&self) -> bool {
        self.places.iter().all(|p| !p.seat.critical || p.standing != Standing::Absent)
    }

    /// Names of the critical facets that are not there.
    pub fn absent(&self) -> Vec<&str> {
        self.places
            .iter()
            .filter(|p| p.seat.critical && p.standing == Standing::Absent)
            .map(|p| p.seat.name.as_str())
            .collect()
    }

    /// Whether the next frame may be published: the last one has been shown, or nobody waits for it any more.
    pub fn idle(&self) -> bool {
        self.stage == Stage::Idle
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
        let to: Vec<(FacetNumber, u64)> = self.there().map(|(k, place)| (k, place.join)).collect();
        let frame = self.frame.unwrap_or(0);
        to.into_iter().for_each(|(facet, join)| self.send_to(facet, Kind::End, join, frame, |_| {}));
        (self.ended, self.stage) = (true, Stage::Idle);
    }

    /// Takes what a link reports; `bytes` is the message, if it is one.
    pub fn on_event(&mut self, now: Duration, facet: FacetNumber, event: LinkEvent, bytes: &[u8]) {
        self.places.get_mut(facet as usize).into_iter().for_each(|place| place.rivals.link(event));
        match event {
            LinkEvent::Opened => {}
            LinkEvent::Message => self.on_message(now, facet, bytes),
            LinkEvent::Closed(why) => self.gone(facet, why == Closed::ByPeer),
        }
        self.advance(now);
    }

    /// A facet's process has ended: it is dropped at once, and nobody waits for it.
    pub fn lose(&mut self, now: Duration, facet: FacetNumber) {
        if self.standing(facet) != Standing::Absent {
            self.gone(facet, false);
            self.close.push(facet);
        }
        self.advance(now);
    }

    /// Does what is due by now: call it whenever `recv` returns.
    pub fn advance(&mut self, now: Duration) {
        self.drop_the_silent(now);
        if let Some(after) = self.options.resend_after {
            self.resend(now, after);
        }
        self.beat(now);
        loop {
            let before = self.stage;
            self.turn(now);
            if self.stage == before {
                return;
            }
        }
    }

    fn tell(&mut self, event: ServerEvent) {
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
