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
use super::messages::{Done, FacetCounts, Join, count};
use super::mirror::Mirror;
use super::server::Pace;
use super::transport::{Delivery, LinkEvent, Message};
use super::viewer::Viewer;
use super::wire::{HEADER_BYTES, Hash, Header, Kind, later, message};
use std::collections::VecDeque;
use std::time::Duration;
use tumble_core::World;

/// Inputs remembered until a picture shows them.
const MAX_INPUTS: usize = 256;

/// The half of a joining's number that tells the process.
const PROCESS: u64 = !0 << 32;

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
    pub pace: Pace,
    /// `drop_timeout_ms`: the server is lost when nothing was heard for so long.
    pub drop_after: Duration,
    /// How often it asks to be let in.
    pub join_every: Duration,
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
            pace: Pace::Lockstep,
            drop_after: ms(2000),
            join_every: ms(250),
            seed,
        }
    }
}

/// What a facet does next.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Wait for a message.
    Wait(Waiting),
    /// [`begin`](FacetSession::begin), draw [`world`](FacetSession::world), and say [`drawn`](FacetSession::drawn).
    Draw,
    /// Show what was drawn, and say [`presented`](FacetSession::presented).
    Present(u64),
    /// Nothing any more.
    Over(Over),
}

/// What a facet waits for: what its screen should say where it has no picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Waiting {
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
pub enum Over {
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
    Over(Over),
}

/// A state that waits to be drawn.
struct Pending {
    header: Header,
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
    heard: Duration,
    beaten: Duration,
    resynced: Option<Duration>,
    /// Frame of the newest snapshot.
    listed: Option<u64>,
    /// The newest frame that came.
    newest: Option<u64>,
    pending: Option<Pending>,
    /// Came before its list of objects, or before the answer to JOIN.
    early: Option<Pending>,
    /// A list of objects that came while a frame is being drawn: it waits, since that frame is of the old one.
    list: Option<Pending>,
    /// Applied, and being drawn: frame and when it came.
    drawing: Option<(u64, Duration)>,
    /// Drawn: frame, what READY said, when it was drawn.
    held: Option<(u64, Done, Duration)>,
    show: bool,
    /// When PRESENT came for the frame that is held.
    told: Option<Duration>,
    /// Inputs that no picture has shown yet: user, number, when they were sent.
    inputs: VecDeque<(u16, u64, Duration)>,
    shown: Option<(u64, Done)>,
    counts: FacetCounts,
    out: Vec<(Delivery, Vec<u8>)>,
    close: bool,
}

impl FacetSession {
    /// `base`: the world as the scene file makes it.
    pub fn new(options: FacetOptions, base: World) -> FacetSession {
        let mut session = FacetSession {
            process: mixed(options.seed) & PROCESS,
            options,
            mirror: Mirror::new(base),
            phase: Phase::Joining,
            lost: false,
            run: 0,
            join: 0,
            asked: None,
            heard: Duration::ZERO,
            beaten: Duration::ZERO,
            resynced: None,
            listed: None,
            newest: None,
            pending: None,
            early: None,
            list: None,
            drawing: None,
            held: None,
            show: false,
            told: None,
            inputs: VecDeque::new(),
            shown: None,
            counts: FacetCounts::default(),
            out: Vec::new(),
            close: false,
        };
        session.join_anew();
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
    pub fn shown(&self) -> Option<(u64, Done)> {
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
        match (&self.phase, &self.held, &self.pending) {
            (Phase::Over(why), ..) => Task::Over(why.clone()),
            (_, Some((frame, ..)), _) if self.show => Task::Present(*frame),
            (Phase::Joining, ..) => Task::Wait(if self.lost { Waiting::Lost } else { Waiting::Server }),
            (_, Some((frame, ..)), _) => Task::Wait(Waiting::Others(*frame)),
            (_, None, Some(_)) => Task::Draw,
            (_, None, None) => Task::Wait(Waiting::Frame),
        }
    }

    /// Applies the frame that waits to be drawn; its number. `None`: there is none, or it does not fit and was refused.
    pub fn begin(&mut self) -> Option<u64> {
        let Pending { header, message, arrived } = self.pending.take()?;
        let applied = self.mirror.apply_state(header.frame, header.time_s, message.get(HEADER_BYTES..).unwrap_or(&[]));
        if applied.is_err() {
            count(&mut self.counts.refused);
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
        let done = Done {
            hash: self.mirror.hash(),
            image,
            took_us,
            input_us: None,
            heard_us: Some(micros(arrived)),
            at_us: micros(now),
        };
        self.held = Some((frame, done, now));
        self.show = self.options.pace == Pace::Latest || self.pending.is_some();
        self.told = (self.options.pace == Pace::Latest).then_some(arrived);
        if self.options.pace == Pace::Lockstep {
            self.answer(Kind::Ready, frame, &done);
        }
        if let Some(Pending { header, message, .. }) = self.list.take()
            && self.on_snapshot(now, &header, &message[HEADER_BYTES..]).is_err()
        {
            count(&mut self.counts.refused);
        }
    }

    /// The frame that was held is on the screen.
    pub fn presented(&mut self, now: Duration) {
        let Some((frame, done, since)) = self.held.take() else { return };
        let (took_us, input_us) = (
            short_micros(now.saturating_sub(since)),
            self.take_shown_input().map(|sent| short_micros(now.saturating_sub(sent))),
        );
        let done = Done { took_us, input_us, heard_us: self.told.take().map(micros), at_us: micros(now), ..done };
        (self.show, self.shown) = (false, Some((frame, done)));
        count(&mut self.counts.shown);
        self.answer(Kind::Presented, frame, &done);
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
        self.inputs.retain(|(user, sequence, _)| shows(*user).is_none_or(|shown| later(*sequence, shown)));
        newest
    }

    /// Sends what a user does; `false` while there is no server.
    pub fn send_input(&mut self, now: Duration, input: &Input) -> bool {
        let live = self.phase == Phase::Live;
        if live {
            if self.inputs.len() == MAX_INPUTS {
                self.inputs.pop_front();
            }
            self.inputs.push_back((input.user, input.sequence, now));
            self.send(Kind::Input, 0, |out| input.write(out));
        }
        live
    }

    /// Says good-bye.
    pub fn leave(&mut self) {
        if self.phase == Phase::Live {
            self.send(Kind::Leave, 0, |_| {});
        }
        self.phase = Phase::Over(Over::Left);
    }

    /// Takes what the link reports, and the message, if it is one: a state is kept as it came until it is drawn.
    pub fn on_event(&mut self, now: Duration, event: LinkEvent, message: Message) {
        match event {
            LinkEvent::Opened => self.asked = None,
            LinkEvent::Message => self.on_message(now, message),
            LinkEvent::Closed(_) => match self.phase {
                Phase::Live => self.lose(),
                Phase::Joining => self.join_anew(), // the server may have taken the old number, and takes none twice
                Phase::Over(_) => {}
            },
        }
        self.advance(now);
    }

    /// Does what is due by now: call it whenever `recv` returns.
    pub fn advance(&mut self, now: Duration) {
        match self.phase {
            Phase::Over(_) => {}
            Phase::Joining => {
                if self.asked.is_none_or(|asked| now >= asked.saturating_add(self.options.join_every)) {
                    self.asked = Some(now);
                    let join =
                        Join { scene: self.options.scene, name: self.options.name.clone(), exact: self.options.exact };
                    self.send(Kind::Join, 0, |out| join.write(out));
                }
            }
            Phase::Live => {
                if now >= self.heard.saturating_add(self.options.drop_after) {
                    self.lose();
                    self.close = true;
                } else if now >= self.beaten.saturating_add(self.options.drop_after / 4) {
                    self.beaten = now;
                    let counts = self.counts;
                    self.send(Kind::Beat, 0, |out| counts.write(out));
                }
            }
        }
    }

    fn lose(&mut self) {
        count(&mut self.counts.lost);
        self.lost = true;
        self.join_anew();
    }

    fn join_anew(&mut self) {
        self.options.seed = self.options.seed.wrapping_add(1);
        (self.phase, self.run, self.join, self.asked) =
            (Phase::Joining, 0, self.process | mixed(self.options.seed) & !PROCESS, None);
        (self.listed, self.newest, self.resynced) = (None, None, None);
        (self.pending, self.early, self.list, self.drawing, self.held, self.show, self.shown) =
            (None, None, None, None, None, false, None);
        (self.told, self.inputs) = (None, VecDeque::new());
    }

    fn answer(&mut self, kind: Kind, frame: u64, done: &Done) {
        if self.phase == Phase::Live {
            self.send(kind, frame, |out| done.write(out));
        }
    }

    fn send(&mut self, kind: Kind, frame: u64, write: impl FnOnce(&mut Vec<u8>)) {
        let header = Header { kind, run: self.run, join: self.join, frame, time_s: 0.0 };
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
pub(crate) fn mixed(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
