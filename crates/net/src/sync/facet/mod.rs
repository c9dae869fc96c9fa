//! A facet's side of a session: a state machine without clock and link. Times and messages go in,
//! messages and tasks come out.
//!
//! ```text
//!  joining ──SNAPSHOT, STATE──► live: draw ──► READY ──PRESENT──► show ──► PRESENTED, and again
//!     ▲                          │
//!     └── drop_timeout, REJOIN, link closed          REFUSED, END: ended
//!         (each time with a new join number)
//! ```
//!
//! The state of a later frame implies the PRESENT of the drawn one: the server would not have sent
//! it before.

mod computing;
mod following;
mod receiving;

use super::input::Input;
use super::messages::{FacetCounts, FrameAck, Join, increment};
use super::mirror::Mirror;
use super::server::SyncMode;
use super::transport::{Delivery, LinkEvent, Message};
use super::viewer::Viewer;
use super::wire::{HEADER_BYTES, Hash, MessageHeader, MessageKind, is_later, message};
use computing::Shown;
pub use following::AppliedFrame;
use std::collections::VecDeque;
use std::time::Duration;
use tumble_core::World;

/// Maximum number of inputs that wait for the frame that shows them.
const MAX_PENDING_INPUTS: usize = 256;

/// Bits of a join number that identify the process.
const PROCESS_MASK: u64 = !0 << 32;

/// Options of a facet's session.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetOptions {
    /// Name of the facet in the cave file.
    pub name: String,
    /// BLAKE3 hash of the scene.
    pub scene: [u8; 32],
    /// Whether the facet wants exact messages (a replica) instead of poses.
    pub exact: bool,
    /// When frames are shown; must equal the server's mode.
    pub mode: SyncMode,
    /// `drop_timeout_ms`: the server is lost if nothing arrives for this time.
    pub drop_timeout: Duration,
    /// Interval between two JOIN messages.
    pub join_interval: Duration,
    /// Seed of the join numbers, different at each start of the process. The upper half of all
    /// numbers from one seed identifies the process.
    pub seed: u64,
}

impl FacetOptions {
    /// Returns the options with the defaults of a cave file.
    pub fn new(name: &str, scene: [u8; 32], seed: u64) -> FacetOptions {
        let ms = Duration::from_millis;
        FacetOptions {
            name: name.to_owned(),
            scene,
            exact: false,
            mode: SyncMode::Lockstep,
            drop_timeout: ms(2000),
            join_interval: ms(250),
            seed,
        }
    }
}

/// Next task of a facet.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Wait for a message.
    Wait(WaitReason),
    /// Call [`begin`](FacetSession::begin), draw [`world`](FacetSession::world), then call
    /// [`drawn`](FacetSession::drawn).
    Draw,
    /// Show the drawn picture, then call [`presented`](FacetSession::presented).
    Present(u64),
    /// The session has ended.
    Ended(EndReason),
}

/// The event that a facet waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaitReason {
    /// A server, for the first time.
    Server,
    /// A server again: the connection is lost and the last picture is old.
    Lost,
    /// The next frame.
    Frame,
    /// The other facets: this one has drawn the frame.
    Others(u64),
}

/// Reason for the end of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EndReason {
    /// The server ended the run.
    Ended,
    /// The server refused the join, with the reason.
    Refused(String),
    /// The facet left.
    Left,
}

#[derive(Clone, Debug, PartialEq)]
enum Phase {
    Joining,
    Live,
    Ended(EndReason),
}

/// A state that waits to be drawn.
struct PendingState {
    header: MessageHeader,
    message: Message,
    arrived: Duration,
}

/// A facet's session.
pub struct FacetSession {
    options: FacetOptions,
    content: Shown,
    phase: Phase,
    lost: bool,
    run: u64,
    join: u64,
    /// Upper half of the join numbers.
    process: u64,
    asked: Option<Duration>,
    last_received: Duration,
    last_heartbeat: Duration,
    resynced: Option<Duration>,
    /// Frame of the newest snapshot.
    listed: Option<u64>,
    /// The newest frame received.
    newest: Option<u64>,
    pending: Option<PendingState>,
    /// A state received before its object table, or before the answer to JOIN.
    early: Option<PendingState>,
    /// An object table received while a frame is being drawn. It waits because that frame belongs
    /// to the old table.
    list: Option<PendingState>,
    /// The frame that is applied and being drawn, and its arrival.
    drawing: Option<(u64, Duration)>,
    /// The drawn frame, its READY message, and the time at which it was drawn.
    drawn_frame: Option<(u64, FrameAck, Duration)>,
    show: bool,
    /// Arrival of PRESENT for the drawn frame.
    present_received: Option<Duration>,
    /// Inputs that no picture has shown yet: user, number, time of sending.
    inputs: VecDeque<(u16, u64, Duration)>,
    shown: Option<(u64, FrameAck)>,
    counts: FacetCounts,
    out: Vec<(Delivery, Vec<u8>)>,
    close: bool,
}

impl FacetSession {
    /// Creates the session. `base` is the world as the scene file makes it.
    pub fn new(options: FacetOptions, base: World) -> FacetSession {
        FacetSession::with(options, Shown::Mirrored(Mirror::new(base)))
    }

    fn with(options: FacetOptions, content: Shown) -> FacetSession {
        let mut session = FacetSession {
            process: splitmix64(options.seed) & PROCESS_MASK,
            options,
            content,
            phase: Phase::Joining,
            lost: false,
            run: 0,
            join: 0,
            asked: None,
            last_received: Duration::ZERO,
            last_heartbeat: Duration::ZERO,
            resynced: None,
            listed: None,
            newest: None,
            pending: None,
            early: None,
            list: None,
            drawing: None,
            drawn_frame: None,
            show: false,
            present_received: None,
            inputs: VecDeque::new(),
            shown: None,
            counts: FacetCounts::default(),
            out: Vec::new(),
            close: false,
        };
        session.restart_join();
        session
    }

    /// Returns the world to draw after [`begin`](Self::begin).
    pub fn world(&self) -> &World {
        self.content.world()
    }

    /// Returns the simulated time of the last applied frame, s.
    pub fn time_s(&self) -> f64 {
        self.content.time_s()
    }

    /// Returns the users' heads and the cave's place in the scene.
    pub fn viewer(&self) -> &Viewer {
        self.content.viewer()
    }

    /// Returns the counts.
    pub fn counts(&self) -> FacetCounts {
        self.counts
    }

    /// Returns the last frame shown since the last join, and its PRESENTED message.
    pub fn shown(&self) -> Option<(u64, FrameAck)> {
        self.shown
    }

    /// Returns the messages to send, and forgets them.
    pub fn outgoing(&mut self) -> Vec<(Delivery, Vec<u8>)> {
        std::mem::take(&mut self.out)
    }

    /// Returns once whether the link must be closed, so that it looks for a server again.
    pub fn closing(&mut self) -> bool {
        std::mem::take(&mut self.close)
    }

    /// Returns the next task.
    pub fn task(&self) -> Task {
        match (&self.phase, &self.drawn_frame, self.has_frame()) {
            (Phase::Ended(why), ..) => Task::Ended(why.clone()),
            (_, Some((frame, ..)), _) if self.show => Task::Present(*frame),
            (Phase::Joining, ..) => Task::Wait(if self.lost { WaitReason::Lost } else { WaitReason::Server }),
            (_, Some((frame, ..)), _) => Task::Wait(WaitReason::Others(*frame)),
            (_, None, true) => Task::Draw,
            (_, None, false) => Task::Wait(WaitReason::Frame),
        }
    }

    /// Returns whether a frame waits to be drawn.
    fn has_frame(&self) -> bool {
        self.pending.is_some() || self.content.has_frames()
    }

    /// Applies the pending frame and returns its number. Returns `None` if there is none, or if it
    /// did not fit and was refused.
    pub fn begin(&mut self) -> Option<u64> {
        let Shown::Mirrored(mirror) = &mut self.content else { return self.make_frames() };
        let PendingState { header, message, arrived } = self.pending.take()?;
        let applied = mirror.apply_state(header.frame, header.time_s, message.get(HEADER_BYTES..).unwrap_or(&[]));
        if applied.is_err() {
            increment(&mut self.counts.refused);
            self.newest = None; // so that it is taken when it comes again
            self.resync(arrived);
            return None;
        }
        self.drawing = Some((header.frame, arrived));
        Some(header.frame)
    }

    /// Reports that the frame of [`begin`](Self::begin) is drawn. `image` holds the first 16 bytes
    /// of the BLAKE3 hash of its pixels, or zeros if there are none.
    pub fn drawn(&mut self, now: Duration, image: Hash) {
        let Some((frame, arrived)) = self.drawing.take() else { return };
        let took_us = short_micros(now.saturating_sub(arrived));
        let hash = self.content.hash();
        let done = FrameAck {
            hash,
            image,
            took_us,
            input_us: None,
            received_us: Some(micros(arrived)),
            completed_us: micros(now),
        };
        self.drawn_frame = Some((frame, done, now));
        self.show = self.options.mode == SyncMode::Latest || self.has_frame();
        self.present_received = (self.options.mode == SyncMode::Latest).then_some(arrived);
        if self.options.mode == SyncMode::Lockstep {
            self.answer(MessageKind::Ready, frame, &done);
        }
        if let Some(PendingState { header, message, .. }) = self.list.take()
            && self.on_snapshot(now, &header, &message[HEADER_BYTES..]).is_err()
        {
            increment(&mut self.counts.refused);
        }
    }

    /// Reports that the drawn frame is on the screen.
    pub fn presented(&mut self, now: Duration) {
        let Some((frame, done, since)) = self.drawn_frame.take() else { return };
        let (took_us, input_us) = (
            short_micros(now.saturating_sub(since)),
            self.take_shown_input().map(|sent| short_micros(now.saturating_sub(sent))),
        );
        let done = FrameAck {
            took_us,
            input_us,
            received_us: self.present_received.take().map(micros),
            completed_us: micros(now),
            ..done
        };
        (self.show, self.shown) = (false, Some((frame, done)));
        increment(&mut self.counts.shown);
        self.answer(MessageKind::Presented, frame, &done);
    }

    /// Returns when the newest of this facet's inputs in the picture was sent, if the picture is
    /// the first to show it. Forgets all inputs up to it.
    fn take_shown_input(&mut self) -> Option<Duration> {
        let users = &self.content.viewer().users;
        let shows = |user: u16| users.get(user as usize).map(|u| u.input);
        let newest = self
            .inputs
            .iter()
            .rev()
            .find(|(user, sequence, _)| shows(*user) == Some(*sequence))
            .map(|(.., sent)| *sent);
        self.inputs.retain(|(user, sequence, _)| shows(*user).is_none_or(|shown| is_later(*sequence, shown)));
        newest
    }

    /// Sends a user's input. Returns `false` while there is no server.
    pub fn send_input(&mut self, now: Duration, input: &Input) -> bool {
        let live = self.phase == Phase::Live;
        if live {
            if self.inputs.len() == MAX_PENDING_INPUTS {
                self.inputs.pop_front();
            }
            self.inputs.push_back((input.user, input.sequence, now));
            self.send(MessageKind::Input, 0, |out| input.write(out));
        }
        live
    }

    /// Sends LEAVE and ends the session.
    pub fn leave(&mut self) {
        if self.phase == Phase::Live {
            self.send(MessageKind::Leave, 0, |_| {});
        }
        self.phase = Phase::Ended(EndReason::Left);
    }

    /// Processes an event of the link with its message, if it has one. A state is kept as it
    /// arrived until it is drawn.
    pub fn on_event(&mut self, now: Duration, event: LinkEvent, message: Message) {
        match event {
            LinkEvent::Opened => self.asked = None,
            LinkEvent::Message => self.on_message(now, message),
            LinkEvent::Closed(_) => match self.phase {
                Phase::Live => self.on_server_lost(),
                Phase::Joining => self.restart_join(), // the server may have taken the old number, and takes none twice
                Phase::Ended(_) => {}
            },
        }
        self.advance(now);
    }

    /// Does the work that is due; must be called after each return of `recv`.
    pub fn advance(&mut self, now: Duration) {
        match self.phase {
            Phase::Ended(_) => {}
            Phase::Joining => {
                if self.asked.is_none_or(|asked| now >= asked.saturating_add(self.options.join_interval)) {
                    self.asked = Some(now);
                    let content = self.content.wanted(self.options.exact);
                    let join = Join { scene: self.options.scene, name: self.options.name.clone(), content };
                    self.send(MessageKind::Join, 0, |out| join.write(out));
                }
            }
            Phase::Live => {
                if now >= self.last_received.saturating_add(self.options.drop_timeout) {
                    self.on_server_lost();
                    self.close = true;
                } else if now >= self.last_heartbeat.saturating_add(self.options.drop_timeout / 4) {
                    self.last_heartbeat = now;
                    let counts = self.counts;
                    self.send(MessageKind::Heartbeat, 0, |out| counts.write(out));
                }
            }
        }
    }

    fn on_server_lost(&mut self) {
        increment(&mut self.counts.lost);
        self.lost = true;
        self.restart_join();
    }

    fn restart_join(&mut self) {
        self.options.seed = self.options.seed.wrapping_add(1);
        (self.phase, self.run, self.join, self.asked) =
            (Phase::Joining, 0, self.process | splitmix64(self.options.seed) & !PROCESS_MASK, None);
        (self.listed, self.newest, self.resynced) = (None, None, None);
        (self.pending, self.early, self.list, self.drawing, self.drawn_frame, self.show, self.shown) =
            (None, None, None, None, None, false, None);
        (self.present_received, self.inputs) = (None, VecDeque::new());
        self.content.restart();
    }

    fn answer(&mut self, kind: MessageKind, frame: u64, done: &FrameAck) {
        if self.phase == Phase::Live {
            self.send(kind, frame, |out| done.write(out));
        }
    }

    fn send(&mut self, kind: MessageKind, frame: u64, write: impl FnOnce(&mut Vec<u8>)) {
        let header = MessageHeader { kind, run: self.run, join: self.join, frame, time_s: 0.0 };
        self.out.push((Delivery::Reliable, message(&header, write)));
    }
}

fn short_micros(duration: Duration) -> u32 {
    u32::try_from(duration.as_micros()).unwrap_or(u32::MAX)
}

fn micros(duration: Duration) -> u64 {
    u64::try_from(duration.as_micros()).unwrap_or(u64::MAX)
}

/// Mixes a seed into a number without visible pattern: splitmix64.
pub(crate) fn splitmix64(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
