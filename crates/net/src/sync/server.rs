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

use super::input::Input;
use super::messages::{Done, FacetCounts, Join, Refusal, count};
use super::publisher::{PublishError, Publisher};
use super::recording::Recorded;
use super::transport::{Closed, Delivery, FacetNumber, LinkEvent, MAX_FACETS};
use super::viewer::Viewer;
use super::wire::{Fault, HEADER_BYTES, Hash, Header, Kind, later, message, open};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;
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
    /// `ready_timeout_ms`.
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
            run, scene, seats, pace: Pace::Lockstep, ready_after: ms(100), first_after: ms(10_000), drop_after: ms(2000), history: 8, resend_after: None,
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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
    exact: bool,
    heard: Duration,
    sent: Duration,
    /// It has answered the snapshot with a frame.
    synced: bool,
    ready: Option<u64>,
    presented: Option<u64>,
    counts: SeatCounts,
    told: FacetCounts,
    inputs: std::collections::BTreeMap<u16, u64>,
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
    out: Vec<ToFacets>,
    events: VecDeque<ServerEvent>,
    close: Vec<FacetNumber>,
    ended: bool,
}

impl ServerSession {
    /// `base`: the world as the scene file makes it, before the first step.
    pub fn new(mut options: ServerOptions, base: &World) -> ServerSession {
        options.seats.truncate(MAX_FACETS);
        options.history = options.history.clamp(1, 1024);
        let place = |seat: &Seat| Place {
            seat: seat.clone(), standing: Standing::Absent, join: 0, retired: VecDeque::new(), exact: false, heard: Duration::ZERO, sent: Duration::ZERO,
            synced: false, ready: None, presented: None, counts: SeatCounts::default(), told: FacetCounts::default(), inputs: Default::default(),
        };
        let places = options.seats.iter().map(place).collect();
        let stream = |exact| Stream { publisher: Publisher::new(base, exact, 0), snapshot: Arc::default(), listed: None, state: Arc::default(), hashes: VecDeque::new() };
        let next = options.first_frame;
        ServerSession {
            options, places, streams: [stream(false), stream(true)], frame: None, next, time_s: 0.0, stage: Stage::Idle, out: Vec::new(),
            events: VecDeque::new(), close: Vec::new(), ended: false,
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

    /// Whether every critical facet is there.
    pub fn complete(&self) -> bool {
        self.places.iter().all(|p| !p.seat.critical || p.standing != Standing::Absent)
    }

    /// Names of the critical facets that are not there.
    pub fn absent(&self) -> Vec<&str> {
        self.places.iter().filter(|p| p.seat.critical && p.standing == Standing::Absent).map(|p| p.seat.name.as_str()).collect()
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

    /// Publishes the world as the next frame; its number. Publish also while the world stands still, so that who joins sees it. Where a frame is still
    /// under way it is given up, and who has not shown it counts as late.
    ///
    /// # Errors
    /// [`PublishError`]; nothing was sent.
    pub fn publish(&mut self, now: Duration, world: &World, viewer: &Viewer) -> Result<u64, PublishError> {
        self.give_up();
        let frame = self.next;
        let replicas = self.there().any(|(_, p)| p.exact);
        for exact in [false, true] {
            let stream = &mut self.streams[exact as usize];
            stream.state = Arc::default();
            if exact && !replicas {
                continue; // no replica, no work
            }
            let published = stream.publisher.publish(world, viewer, frame)?;
            let list = published.fresh.then(|| stream.publisher.snapshot());
            self.time_s = world.time();
            self.take(exact, frame, list, &published.state, published.hash);
        }
        self.send_frame(now, frame);
        Ok(frame)
    }

    /// Publishes a frame as it was recorded, under its number. One session either simulates or replays. Replicas get nothing: recordings hold poses.
    pub fn publish_recorded(&mut self, now: Duration, recorded: &Recorded) {
        self.give_up();
        self.time_s = recorded.time_s;
        self.take(false, recorded.frame, recorded.snapshot.clone(), &recorded.state, recorded.hash);
        self.send_frame(now, recorded.frame);
    }

    /// The frame published last, as a recording keeps it; `fresh`: with its list of objects even if that is an old one.
    pub fn recorded(&self, fresh: bool) -> Option<Recorded> {
        let (frame, stream) = (self.frame?, &self.streams[0]);
        let state = stream.state.get(HEADER_BYTES..)?.to_vec();
        let snapshot = (fresh || stream.listed == Some(frame)).then(|| stream.snapshot.clone());
        Some(Recorded { frame, time_s: self.time_s, snapshot, state, hash: stream.hashes.back()?.1 })
    }

    /// Keeps a frame for sending.
    fn take(&mut self, exact: bool, frame: u64, list: Option<Arc<Vec<u8>>>, state: &[u8], hash: Hash) {
        let head = self.head(Kind::State, 0, frame);
        let stream = &mut self.streams[exact as usize];
        if let Some(list) = list {
            (stream.snapshot, stream.listed) = (list, Some(frame));
        }
        stream.state = Arc::new(message(&head, |out| out.extend(state)));
        stream.hashes.push_back((frame, hash));
        while stream.hashes.len() > self.options.history {
            stream.hashes.pop_front();
        }
    }

    /// Sends the frame that was kept, with its list of objects if that is new.
    fn send_frame(&mut self, now: Duration, frame: u64) {
        let first = self.frame.is_none();
        (self.frame, self.next, self.stage) = (Some(frame), frame.wrapping_add(1), Stage::Idle);
        for exact in [false, true] {
            let to: Vec<FacetNumber> = self.there().filter(|(_, p)| p.exact == exact).map(|(k, _)| k).collect();
            let stream = &self.streams[exact as usize];
            let (fresh, state) = (stream.listed == Some(frame), stream.state.clone());
            if fresh {
                to.iter().for_each(|&k| self.send_snapshot(k));
            }
            if !state.is_empty() {
                self.send(to, self.state_delivery(), state);
            }
        }
        for place in self.places.iter_mut().filter(|p| p.standing != Standing::Absent) {
            place.sent = now;
            if first && place.standing == Standing::Following {
                place.standing = Standing::InStep;
            }
        }
        if self.options.pace == Pace::Lockstep {
            self.stage = Stage::Ready(now);
        }
        self.advance(now);
    }

    /// Tells all facets that the run is over.
    pub fn end(&mut self) {
        let to = self.there().map(|(k, _)| k).collect();
        let end = message(&self.head(Kind::End, 0, self.frame.unwrap_or(0)), |_| {});
        self.send(to, Delivery::Reliable, Arc::new(end));
        (self.ended, self.stage) = (true, Stage::Idle);
    }

    /// Takes what a link reports; `bytes` is the message, if it is one.
    pub fn on_event(&mut self, now: Duration, facet: FacetNumber, event: LinkEvent, bytes: &[u8]) {
        match event {
            LinkEvent::Opened => {}
            LinkEvent::Message => self.on_message(now, facet, bytes),
            LinkEvent::Closed(why) => self.gone(facet, why == Closed::ByPeer),
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

    fn turn(&mut self, now: Duration) {
        let Some(frame) = self.frame else { return };
        match self.stage {
            Stage::Idle => {}
            Stage::Ready(since) => {
                let all = self.waited_for().all(|p| p.ready == Some(frame));
                let patience = |p: &Place| if p.synced { self.options.ready_after } else { self.options.first_after };
                let over = |p: &Place| now >= since.saturating_add(patience(p));
                if !all && !self.waited_for().filter(|p| p.ready != Some(frame)).all(over) {
                    return;
                }
                self.leave_behind(frame, |p| p.ready == Some(frame), |counts| &mut counts.late);
                let to: Vec<FacetNumber> = self.there().filter(|(_, p)| p.ready == Some(frame)).map(|(k, _)| k).collect();
                self.stage = Stage::Presented(now);
                self.send_present(to, frame);
            }
            Stage::Presented(since) => {
                if !self.waited_for().all(|p| p.presented == Some(frame)) && now < since.saturating_add(self.options.ready_after) {
                    return;
                }
                self.leave_behind(frame, |p| p.presented == Some(frame), |counts| &mut counts.missing);
                self.stage = Stage::Idle;
                self.tell(ServerEvent::Finished(frame));
            }
        }
    }

    /// Waits no longer for those who are in step and not `done`.
    fn leave_behind(&mut self, frame: u64, done: impl Fn(&Place) -> bool, counter: impl Fn(&mut SeatCounts) -> &mut u64) {
        for k in 0..self.places.len() {
            let place = &mut self.places[k];
            if place.standing == Standing::InStep && !done(place) {
                place.standing = Standing::Following;
                count(counter(&mut place.counts));
                self.tell(ServerEvent::Late(k as FacetNumber, frame));
            }
        }
    }

    /// Ends the waiting for the frame that is under way.
    fn give_up(&mut self) {
        let Some(frame) = self.frame else { return };
        if let Stage::Ready(_) = self.stage {
            self.leave_behind(frame, |p| p.ready == Some(frame), |counts| &mut counts.late);
        }
        if let Stage::Presented(_) = self.stage {
            self.leave_behind(frame, |p| p.presented == Some(frame), |counts| &mut counts.missing);
        }
    }

    fn on_message(&mut self, now: Duration, facet: FacetNumber, bytes: &[u8]) {
        if facet as usize >= self.places.len() {
            return;
        }
        match open(bytes) {
            Ok((header, payload)) => {
                if let Err(fault) = self.on_header(now, facet, &header, payload) {
                    self.refuse(facet, &fault);
                }
            }
            Err(Fault::Version(theirs)) => {
                let ours = super::wire::VERSION;
                self.deny(facet, 0, format!("the server speaks NetSync version {ours}, this facet version {theirs}: use the same build of tumble on both"));
            }
            Err(fault) => self.refuse(facet, &fault),
        }
    }

    fn refuse(&mut self, facet: FacetNumber, fault: &Fault) {
        let counts = &mut self.places[facet as usize].counts;
        count(if *fault == Fault::Torn { &mut counts.torn } else { &mut counts.refused });
    }

    fn on_header(&mut self, now: Duration, facet: FacetNumber, header: &Header, payload: &[u8]) -> Result<(), Fault> {
        if header.kind == Kind::Join {
            self.on_join(now, facet, header.join, Join::read(payload)?);
            return Ok(());
        }
        let place = &mut self.places[facet as usize];
        if header.run != self.options.run || header.join != place.join || place.standing == Standing::Absent {
            count(&mut place.counts.stale);
            if place.standing == Standing::Absent || !place.retired.contains(&header.join) && header.join != place.join {
                self.send_to(facet, Kind::Rejoin, header.join, 0, |_| {});
            }
            return Ok(());
        }
        place.heard = now;
        match header.kind {
            Kind::Ready => self.on_ready(now, facet, header.frame, Done::read(payload)?),
            Kind::Presented => self.on_presented(facet, header.frame, Done::read(payload)?),
            Kind::Resync => self.send_all_again(facet),
            Kind::Beat => place.told = FacetCounts::read(payload)?,
            Kind::Leave => self.gone(facet, true),
            Kind::Input => self.on_input(facet, Input::read(payload)?),
            _ => return Err(Fault::Malformed("a kind that only servers send")),
        }
        Ok(())
    }

    fn on_join(&mut self, now: Duration, facet: FacetNumber, join: u64, wanted: Join) {
        let place = &mut self.places[facet as usize];
        if place.retired.contains(&join) {
            return count(&mut place.counts.stale);
        }
        if place.standing != Standing::Absent && place.join == join {
            count(&mut place.counts.duplicate);
            place.heard = now;
            return if place.synced { () } else { self.send_all_again(facet) };
        }
        if self.ended {
            return self.send_to(facet, Kind::End, join, 0, |_| {});
        }
        if let Some(why) = self.objection(facet, &wanted) {
            return self.deny(facet, join, why);
        }
        if self.places[facet as usize].standing != Standing::Absent {
            self.gone(facet, false);
        }
        let place = &mut self.places[facet as usize];
        (place.standing, place.join, place.exact, place.heard, place.sent) = (Standing::Following, join, wanted.exact, now, now);
        (place.synced, place.ready, place.presented, place.told) = (false, None, None, FacetCounts::default());
        place.inputs.clear();
        count(&mut place.counts.joined);
        self.tell(ServerEvent::Joined(facet));
        self.send_all_again(facet);
    }

    /// Why a facet cannot be let in.
    fn objection(&self, facet: FacetNumber, wanted: &Join) -> Option<String> {
        let seat = &self.places[facet as usize].seat;
        if seat.name != wanted.name {
            return Some(format!("facet {facet} of the server's cave is '{}', not '{}': use the same cave file on both", seat.name, wanted.name));
        }
        let (ours, theirs) = (hex(&self.options.scene), hex(&wanted.scene));
        (ours != theirs).then(|| format!("the server's scene has the hash {ours}, that of facet '{}' has {theirs}: use the same files on both", seat.name))
    }

    fn deny(&mut self, facet: FacetNumber, join: u64, why: String) {
        count(&mut self.places[facet as usize].counts.refused);
        let refusal = Refusal(why.clone());
        self.send_to(facet, Kind::Refused, join, 0, |out| refusal.write(out));
        self.tell(ServerEvent::Refused(facet, why));
    }

    /// Whether a frame's hash is what was sent, if it is remembered.
    fn check(&self, exact: bool, frame: u64, hash: &Hash) -> Option<bool> {
        self.streams[exact as usize].hashes.iter().find(|(f, _)| *f == frame).map(|(_, ours)| ours == hash)
    }

    fn on_ready(&mut self, now: Duration, facet: FacetNumber, frame: u64, done: Done) {
        let place = &self.places[facet as usize];
        let right = self.check(place.exact, frame, &done.hash);
        let place = &mut self.places[facet as usize];
        let Some(right) = right else { return count(&mut place.counts.stale) };
        let again = place.ready.is_some_and(|f| !later(frame, f));
        place.synced = true;
        if again {
            count(&mut place.counts.duplicate);
        } else {
            place.ready = Some(frame);
            if self.frame == Some(frame) && self.options.pace == Pace::Lockstep {
                place.standing = Standing::InStep;
            }
            if !right {
                count(&mut place.counts.mismatched);
            }
            self.tell(ServerEvent::Ready(facet, frame, done, right));
        }
        let at_the_barrier = self.frame == Some(frame) && matches!(self.stage, Stage::Ready(_));
        self.turn(now);
        // who comes when the frame has been shown, or asks again, is answered by itself
        if !at_the_barrier && self.places[facet as usize].presented != Some(frame) {
            self.send_present(vec![facet], frame);
        }
    }

    fn on_presented(&mut self, facet: FacetNumber, frame: u64, done: Done) {
        let place = &self.places[facet as usize];
        let right = self.check(place.exact, frame, &done.hash);
        let latest = self.options.pace == Pace::Latest;
        let place = &mut self.places[facet as usize];
        let Some(right) = right else { return count(&mut place.counts.stale) };
        if place.presented.is_some_and(|f| !later(frame, f)) {
            return count(&mut place.counts.duplicate);
        }
        place.presented = Some(frame);
        place.synced = true;
        count(&mut place.counts.presented);
        if latest {
            place.standing = Standing::InStep;
        }
        if !right && latest {
            count(&mut place.counts.mismatched);
        }
        self.tell(ServerEvent::Presented(facet, frame, done, right));
    }

    fn on_input(&mut self, facet: FacetNumber, input: Input) {
        let place = &mut self.places[facet as usize];
        if let Some(&newest) = place.inputs.get(&input.user)
            && !later(input.sequence, newest)
        {
            return count(if input.sequence == newest { &mut place.counts.duplicate } else { &mut place.counts.stale });
        }
        place.inputs.insert(input.user, input.sequence);
        self.tell(ServerEvent::Input(facet, input));
    }

    fn gone(&mut self, facet: FacetNumber, by_its_word: bool) {
        let Some(place) = self.places.get_mut(facet as usize).filter(|p| p.standing != Standing::Absent) else { return };
        place.standing = Standing::Absent;
        place.retired.push_back(place.join);
        if place.retired.len() > MAX_RETIRED {
            place.retired.pop_front();
        }
        if !by_its_word {
            count(&mut place.counts.dropped);
        }
        self.tell(ServerEvent::Gone(facet, by_its_word));
    }

    fn drop_the_silent(&mut self, now: Duration) {
        let silent = |p: &Place| now >= p.heard.saturating_add(self.options.drop_after);
        let silent: Vec<FacetNumber> = self.there().filter(|(_, p)| silent(p)).map(|(k, _)| k).collect();
        for facet in silent {
            self.gone(facet, false);
            self.close.push(facet);
        }
    }

    /// Over a link that loses messages: what is unanswered goes out again.
    fn resend(&mut self, now: Duration, after: Duration) {
        let due: Vec<FacetNumber> = self.there().filter(|(_, p)| now >= p.sent.saturating_add(after)).map(|(k, _)| k).collect();
        for facet in due {
            let place = &mut self.places[facet as usize];
            place.sent = now;
            let (synced, ready, presented) = (place.synced, place.ready == self.frame, place.presented == self.frame);
            match self.stage {
                _ if !synced => self.send_all_again(facet),
                Stage::Ready(_) if !ready => self.send_state(facet),
                Stage::Presented(_) if ready && !presented => self.send_present(vec![facet], self.frame.unwrap_or(0)),
                _ => {}
            }
        }
    }

    /// Who hears nothing else hears that the server lives.
    fn beat(&mut self, now: Duration) {
        let every = self.options.drop_after / 4;
        let due: Vec<FacetNumber> = self.there().filter(|(_, p)| now >= p.sent.saturating_add(every)).map(|(k, _)| k).collect();
        if !due.is_empty() {
            due.iter().for_each(|&k| self.places[k as usize].sent = now);
            let beat = message(&self.head(Kind::Beat, 0, self.frame.unwrap_or(0)), |_| {});
            self.send(due, Delivery::Newest, Arc::new(beat));
        }
    }

    fn there(&self) -> impl Iterator<Item = (FacetNumber, &Place)> {
        let numbered = self.places.iter().enumerate().map(|(k, p)| (k as FacetNumber, p));
        numbered.filter(|(_, p)| p.standing != Standing::Absent)
    }

    fn waited_for(&self) -> impl Iterator<Item = &Place> {
        self.places.iter().filter(|p| p.standing == Standing::InStep && p.seat.critical)
    }

    fn state_delivery(&self) -> Delivery {
        if self.options.pace == Pace::Lockstep { Delivery::Reliable } else { Delivery::Newest }
    }

    fn head(&self, kind: Kind, join: u64, frame: u64) -> Header {
        Header { kind, run: self.options.run, join, frame, time_s: self.time_s }
    }

    /// The snapshot, and the frame published last: what a facet needs to begin.
    fn send_all_again(&mut self, facet: FacetNumber) {
        if self.frame.is_some() {
            self.send_snapshot(facet);
            self.send_state(facet);
        }
    }

    fn send_snapshot(&mut self, facet: FacetNumber) {
        let place = &self.places[facet as usize];
        let (snapshot, join) = (self.streams[place.exact as usize].snapshot.clone(), place.join);
        if !snapshot.is_empty() {
            self.send_to(facet, Kind::Snapshot, join, self.frame.unwrap_or(self.next), |out| out.extend(snapshot.iter()));
        }
    }

    fn send_state(&mut self, facet: FacetNumber) {
        let state = self.streams[self.places[facet as usize].exact as usize].state.clone();
        if !state.is_empty() {
            self.send(vec![facet], self.state_delivery(), state);
        }
    }

    fn send_present(&mut self, to: Vec<FacetNumber>, frame: u64) {
        if self.options.pace == Pace::Lockstep {
            let present = message(&self.head(Kind::Present, 0, frame), |_| {});
            self.send(to, Delivery::Reliable, Arc::new(present));
        }
    }

    fn send_to(&mut self, facet: FacetNumber, kind: Kind, join: u64, frame: u64, write: impl FnOnce(&mut Vec<u8>)) {
        let bytes = message(&self.head(kind, join, frame), write);
        self.send(vec![facet], Delivery::Reliable, Arc::new(bytes));
    }

    fn send(&mut self, to: Vec<FacetNumber>, delivery: Delivery, message: Arc<Vec<u8>>) {
        if !to.is_empty() {
            self.out.push(ToFacets { to, delivery, message });
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
