//! A facet's side of a session: a state machine. It has no clock and no link; `now` and messages go in, messages and tasks come out.
//!
//! ```text
//!  joining ──SNAPSHOT, STATE──► live: draw ──► READY ──PRESENT──► show ──► PRESENTED, and again
//!     ▲                          │
//!     └── silent for drop_after, REJOIN, link closed          REFUSED, END: over
//!         (each time under a new number)
//! ```
//!
//! A state of a later frame stands for the PRESENT of the one that is drawn: the server would not have sent it before.

mod receiving;

use super::input::Input;
use super::messages::{FacetCounts, FrameAck, Join, increment};
use super::mirror::Mirror;
use super::server::SyncMode;
use super::transport::{Delivery, LinkEvent, Message};
use super::viewer::Viewer;
use super::wire::{HEADER_BYTES, Hash, MessageHeader, MessageKind, is_later, message};
use std::collections::VecDeque;
use std::time::Duration;
use tumble_core::World;

/// Inputs remembered until a picture shows them.
const MAX_PENDING_INPUTS: usize = 256;

/// The half of a joining's number that tells the process.
const PROCESS_MASK: u64 = !0 << 32;

/// What a facet is told at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetOptions {
    /// Its name in the cave file.
    pub name: String,
    /// BLAKE3 of the scene.
    pub scene: [u8; 32],
    /// Whether it wants exact messages (a replica) and not poses.
    pub exact: bool,
    /// When frames are shown; as the server's.
    pub mode: SyncMode,
    /// `drop_timeout_ms`: the server is lost when nothing was heard for so long.
    pub drop_timeout: Duration,
    /// How often it asks to be let in.
    pub join_interval: Duration,
    /// Where the numbers of its joinings begin: another one at each start of the process. The upper half of all of them tells the process.
    pub seed: u64,
}

impl FacetOptions {
    /// The defaults of a cave file.
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

/// What a facet does next.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Wait for a message.
    Wait(WaitReason),
    /// [`begin`](FacetSession::begin), draw [`world`](FacetSession::world), and say [`drawn`](FacetSession::drawn).
    Draw,
    /// Show what was drawn, and say [`presented`](FacetSession::presented).
    Present(u64),
    /// Nothing any more.
    Ended(EndReason),
}

/// What a facet waits for: what its screen should say where it has no picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaitReason {
    /// A server, for the first time.
    Server,
    /// A server: the one it had is lost. The last picture is old.
    Lost,
    /// A frame.
    Frame,
    /// The others: it has drawn the frame.
    Others(u64),
}

/// Why it is over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EndReason {
    /// The server said that the run is over.
    Ended,
    /// The server does not let it in.
    Refused(String),
    /// It left.
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
    mirror: Mirror,
    phase: Phase,
    lost: bool,
    run: u64,
    join: u64,
    /// In the upper half of the numbers of its joinings.
    process: u64,
    asked: Option<Duration>,
    last_received: Duration,
    last_heartbeat: Duration,
    resynced: Option<Duration>,
    /// Frame of the newest snapshot.
    listed: Option<u64>,
    /// The newest frame that came.
    newest: Option<u64>,
    pending: Option<PendingState>,
    /// Came before its list of objects, or before the answer to JOIN.
    early: Option<PendingState>,
    /// A list of objects that came while a frame is being drawn: it waits, since that frame is of the old one.
    list: Option<PendingState>,
    /// Applied, and being drawn: frame and when it came.
    drawing: Option<(u64, Duration)>,
    /// Drawn: frame, what READY said, when it was drawn.
    drawn_frame: Option<(u64, FrameAck, Duration)>,
    show: bool,
    /// When PRESENT came for the frame that is held.
    present_received: Option<Duration>,
    /// Inputs that no picture has shown yet: user, number, when they were sent.
    inputs: VecDeque<(u16, u64, Duration)>,
    shown: Option<(u64, FrameAck)>,
    counts: FacetCounts,
    out: Vec<(Delivery, Vec<u8>)>,
    close: bool,
}

impl FacetSession {
    /// `base`: the world as the scene file makes it.
    pub fn new(options: FacetOptions, base: World) -> FacetSession {
        let mut session = FacetSession {
            process: splitmix64(options.seed) & PROCESS_MASK,
            options,
            mirror: Mirror::new(base),
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

    /// What to draw after [`begin`](Self::begin).
    pub fn world(&self) -> &World {
        self.mirror.world()
    }

    /// Who looks, and where the cave stands.
    pub fn viewer(&self) -> &Viewer {
        self.mirror.viewer()
    }

    /// What was counted.
    pub fn counts(&self) -> FacetCounts {
        self.counts
    }

    /// The frame shown last since the last joining, and what PRESENTED said of it.
    pub fn shown(&self) -> Option<(u64, FrameAck)> {
        self.shown
    }

    /// What is to be sent.
    pub fn outgoing(&mut self) -> Vec<(Delivery, Vec<u8>)> {
        std::mem::take(&mut self.out)
    }

    /// Whether the link is to be closed, so that it looks for a server anew.
    pub fn closing(&mut self) -> bool {
        std::mem::take(&mut self.close)
    }

    /// What to do next.
    pub fn task(&self) -> Task {
        match (&self.phase, &self.drawn_frame, &self.pending) {
            (Phase::Ended(why), ..) => Task::Ended(why.clone()),
            (_, Some((frame, ..)), _) if self.show => Task::Present(*frame),
            (Phase::Joining, ..) => Task::Wait(if self.lost { WaitReason::Lost } else { WaitReason::Server }),
            (_, Some((frame, ..)), _) => Task::Wait(WaitReason::Others(*frame)),
            (_, None, Some(_)) => Task::Draw,
            (_, None, None) => Task::Wait(WaitReason::Frame),
        }
    }

    /// Applies the frame that waits to be drawn; its number. `None`: there is none, or it does not fit and was refused.
    pub fn begin(&mut self) -> Option<u64> {
        let PendingState { header, message, arrived } = self.pending.take()?;
        let applied = self.mirror.apply_state(header.frame, header.time_s, message.get(HEADER_BYTES..).unwrap_or(&[]));
        if applied.is_err() {
            increment(&mut self.counts.refused);
            self.newest = None; // so that it is taken when it comes again
            self.resync(arrived);
            return None;
        }
        self.drawing = Some((header.frame, arrived));
        Some(header.frame)
    }

    /// The frame of [`begin`](Self::begin) is drawn. `image`: first 16 bytes of the BLAKE3 of its pixels, zeros where there are none.
    pub fn drawn(&mut self, now: Duration, image: Hash) {
        let Some((frame, arrived)) = self.drawing.take() else { return };
        let took_us = short_micros(now.saturating_sub(arrived));
        let done = FrameAck {
            hash: self.mirror.hash(),
            image,
            took_us,
            input_us: None,
            received_us: Some(micros(arrived)),
            completed_us: micros(now),
        };
        self.drawn_frame = Some((frame, done, now));
        self.show = self.options.mode == SyncMode::Latest || self.pending.is_some();
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

    /// The frame that was held is on the screen.
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

    /// When the newest of our inputs was sent that the picture shows, if it is the first to; all up to it are forgotten.
    fn take_shown_input(&mut self) -> Option<Duration> {
        let users = &self.mirror.viewer().users;
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

    /// Sends what a user does; `false` while there is no server.
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

    /// Says good-bye.
    pub fn leave(&mut self) {
        if self.phase == Phase::Live {
            self.send(MessageKind::Leave, 0, |_| {});
        }
        self.phase = Phase::Ended(EndReason::Left);
    }

    /// Takes what the link reports, and the message, if it is one: a state is kept as it came until it is drawn.
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

    /// Does what is due by now: call it whenever `recv` returns.
    pub fn advance(&mut self, now: Duration) {
        match self.phase {
            Phase::Ended(_) => {}
            Phase::Joining => {
                if self.asked.is_none_or(|asked| now >= asked.saturating_add(self.options.join_interval)) {
                    self.asked = Some(now);
                    let join =
                        Join { scene: self.options.scene, name: self.options.name.clone(), exact: self.options.exact };
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

/// A number that looks nothing like its neighbours: splitmix64.
pub(crate) fn splitmix64(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
