//! Sessions over links, by the clock: what `tumble serve` and `tumble facet` call.

use super::facet::{FacetOptions, FacetSession, Task};
use super::input::Input;
use super::messages::FacetCounts;
use super::publisher::PublishError;
use super::recording::FrameRecord;
use super::server::{Membership, ServerEvent, ServerOptions, ServerSession, SlotCounts};
use super::transport::{FacetLink, FacetNumber, LinkCounters, LinkError, Message, ServerLink};
use super::viewer::Viewer;
use super::wire::Hash;
use std::time::{Duration, Instant};
use tumble_core::World;

/// Why a server or a facet cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The link.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The world cannot be sent.
    #[error(transparent)]
    Publish(#[from] PublishError),
    /// Critical facets did not come.
    #[error("{} did not join within {:.1} s; start them, or look at why they end", .0.join(", "), .1.as_secs_f64())]
    Missing(Vec<String>, Duration),
}

/// A wait that is over when something comes or is due.
const MAX_WAIT: Duration = Duration::from_secs(1);

/// A server and its link.
pub struct Server<L> {
    link: L,
    session: ServerSession,
    start: Instant,
    buffer: Vec<u8>,
}

impl<L: ServerLink> Server<L> {
    /// `base`: the world as the scene file makes it, before the first step.
    pub fn new(link: L, options: ServerOptions, base: &World) -> Server<L> {
        Server { link, session: ServerSession::new(options, base), start: Instant::now(), buffer: Vec::new() }
    }

    /// Waits until every critical facet has joined.
    ///
    /// # Errors
    /// [`SessionError::Missing`] when `timeout` is over, with their names.
    pub fn wait_for_facets(&mut self, timeout: Duration) -> Result<(), SessionError> {
        let until = self.now() + timeout;
        while !self.session.all_critical_joined() {
            let left = until.saturating_sub(self.now());
            if left.is_zero() {
                return Err(SessionError::Missing(
                    self.session.missing_facets().into_iter().map(str::to_owned).collect(),
                    timeout,
                ));
            }
            self.poll(left.min(Duration::from_millis(20)))?;
        }
        Ok(())
    }

    /// Publishes the world as the next frame, and in lockstep waits until it is shown by all who are in step (bounded by the time-outs). Its number.
    ///
    /// # Errors
    /// The link's, and [`PublishError`].
    pub fn frame(&mut self, world: &World, viewer: &Viewer) -> Result<u64, SessionError> {
        let frame = self.begin(world, viewer)?;
        while !self.shown(MAX_WAIT)? {}
        Ok(frame)
    }

    /// Publishes the world as the next frame, and does not wait: [`shown`](Self::shown) does. Its number.
    ///
    /// # Errors
    /// The link's, and [`PublishError`].
    pub fn begin(&mut self, world: &World, viewer: &Viewer) -> Result<u64, SessionError> {
        self.poll(Duration::ZERO)?;
        let frame = self.session.publish(self.now(), world, viewer)?;
        self.flush()?;
        Ok(frame)
    }

    /// Publishes a frame as it was recorded, like [`begin`](Self::begin).
    ///
    /// # Errors
    /// The link's.
    pub fn begin_recorded(&mut self, recorded: &FrameRecord) -> Result<(), SessionError> {
        self.poll(Duration::ZERO)?;
        self.session.publish_recorded(self.now(), recorded);
        self.flush()
    }

    /// Whether the frame is shown by all who are waited for, after waiting for that for at most `timeout`.
    ///
    /// # Errors
    /// The link's.
    pub fn shown(&mut self, timeout: Duration) -> Result<bool, SessionError> {
        let until = self.now().saturating_add(timeout);
        while !self.session.is_idle() {
            let left = until.saturating_sub(self.now());
            if left.is_zero() {
                return Ok(false);
            }
            self.poll(left)?;
        }
        Ok(true)
    }

    /// Publishes a frame as it was recorded, and waits like [`frame`](Self::frame).
    ///
    /// # Errors
    /// The link's.
    pub fn replay(&mut self, recorded: &FrameRecord) -> Result<(), SessionError> {
        self.begin_recorded(recorded)?;
        while !self.shown(MAX_WAIT)? {}
        Ok(())
    }

    /// A facet's process has ended: nobody waits for it any more.
    ///
    /// # Errors
    /// The link's.
    pub fn facet_exited(&mut self, facet: FacetNumber) -> Result<(), SessionError> {
        self.session.facet_exited(self.now(), facet);
        self.flush()
    }

    /// The session, to be asked.
    pub fn session(&self) -> &ServerSession {
        &self.session
    }

    /// Looks after the link until `until` from the start ([`now`](Self::now)): the time between two frames.
    ///
    /// # Errors
    /// The link's.
    pub fn idle_until(&mut self, until: Duration) -> Result<(), SessionError> {
        loop {
            let left = until.saturating_sub(self.now());
            self.poll(left)?;
            if left.is_zero() {
                return Ok(());
            }
        }
    }

    /// Tells the facets that the run is over, and waits until they have heard it: who draws hears it after the picture. At most a second.
    ///
    /// # Errors
    /// The link's.
    pub fn end(&mut self) -> Result<(), SessionError> {
        self.session.end();
        self.flush()?;
        let until = self.now() + Duration::from_secs(1);
        while self.session.has_facets() && self.now() < until {
            self.poll(until.saturating_sub(self.now()))?;
        }
        Ok(())
    }

    /// Since the start.
    pub fn now(&self) -> Duration {
        self.start.elapsed()
    }

    /// What happened since the last call.
    pub fn events(&mut self) -> Vec<ServerEvent> {
        self.session.events()
    }

    /// How a facet stands.
    pub fn membership(&self, facet: FacetNumber) -> Membership {
        self.session.membership(facet)
    }

    /// What was counted about those who are no facet.
    pub fn unknown_peers(&self) -> LinkCounters {
        self.link.unknown_peers()
    }

    /// Notes when an input came that no facet sent, so that the picture that shows it is timed: see [`ServerSession::note_input`].
    pub fn note_input(&mut self, user: u16, sequence: u64) {
        self.session.note_input(self.now(), user, sequence);
    }

    /// What was counted about a facet: here, by itself, and on its link.
    pub fn counts(&self, facet: FacetNumber) -> (SlotCounts, FacetCounts, LinkCounters) {
        let (here, there) = self.session.counts(facet);
        (here, there, self.link.counters(facet))
    }

    /// Waits for one report of the link, at most `timeout` and until something is due, and does what is due.
    fn poll(&mut self, timeout: Duration) -> Result<(), SessionError> {
        let due = self.session.wake().map_or(timeout, |wake| wake.saturating_sub(self.now()));
        let event = self.link.recv(timeout.min(due), &mut self.buffer)?;
        let now = self.now();
        match event {
            Some((facet, event)) => self.session.on_event(now, facet, event, &self.buffer),
            None => self.session.advance(now),
        }
        self.flush()
    }

    fn flush(&mut self) -> Result<(), SessionError> {
        for out in self.session.outgoing() {
            self.link.send_all(&out.to, out.delivery, &out.message)?;
        }
        self.session.closing().into_iter().for_each(|facet| self.link.close(facet));
        Ok(())
    }
}

/// A facet and its link.
pub struct Facet<L> {
    link: L,
    session: FacetSession,
    start: Instant,
}

impl<L: FacetLink> Facet<L> {
    /// `base`: the world as the scene file makes it.
    pub fn new(link: L, options: FacetOptions, base: World) -> Facet<L> {
        Facet { link, session: FacetSession::new(options, base), start: Instant::now() }
    }

    /// What to do next, after waiting for it for at most `timeout`. On [`Task::Draw`] call [`begin`](Self::begin), draw, and [`drawn`](Self::drawn); on
    /// [`Task::Present`] show it and call [`presented`](Self::presented); on [`Task::Wait`] keep the window alive and come again.
    ///
    /// # Errors
    /// The link's.
    pub fn next(&mut self, timeout: Duration) -> Result<Task, SessionError> {
        let until = self.now() + timeout;
        loop {
            self.poll(Duration::ZERO)?;
            let (task, left) = (self.session.task(), until.saturating_sub(self.now()));
            match task {
                Task::Wait(_) if !left.is_zero() => self.poll(left.min(Duration::from_millis(20)))?,
                task => return Ok(task),
            }
        }
    }

    /// Applies the frame to be drawn; its number. `None`: it did not fit and was refused.
    pub fn begin(&mut self) -> Option<u64> {
        self.session.begin()
    }

    /// What to draw.
    pub fn world(&self) -> &World {
        self.session.world()
    }

    /// Who looks, and where the cave stands.
    pub fn viewer(&self) -> &Viewer {
        self.session.viewer()
    }

    /// The frame is drawn. `image`: first 16 bytes of the BLAKE3 of its pixels, zeros where there are none.
    ///
    /// # Errors
    /// The link's.
    pub fn drawn(&mut self, image: Hash) -> Result<(), SessionError> {
        self.session.drawn(self.now(), image);
        self.flush()
    }

    /// The frame is on the screen.
    ///
    /// # Errors
    /// The link's.
    pub fn presented(&mut self) -> Result<(), SessionError> {
        self.session.presented(self.now());
        self.flush()
    }

    /// Sends what a user does; `false` while there is no server.
    ///
    /// # Errors
    /// The link's.
    pub fn send_input(&mut self, input: &Input) -> Result<bool, SessionError> {
        let sent = self.session.send_input(self.now(), input);
        self.flush().map(|()| sent)
    }

    /// Says good-bye, and gives the link a moment to carry it.
    ///
    /// # Errors
    /// The link's.
    pub fn leave(&mut self) -> Result<(), SessionError> {
        self.session.leave();
        self.flush()?;
        self.poll(Duration::from_millis(20))
    }

    /// The session, to be asked.
    pub fn session(&self) -> &FacetSession {
        &self.session
    }

    /// What happened on its link.
    pub fn link_counters(&self) -> LinkCounters {
        self.link.counters()
    }

    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    fn poll(&mut self, timeout: Duration) -> Result<(), SessionError> {
        let mut message = Message::default();
        let event = self.link.recv(timeout, &mut message)?;
        let now = self.now();
        match event {
            Some(event) => self.session.on_event(now, event, message),
            None => self.session.advance(now),
        }
        self.flush()
    }

    fn flush(&mut self) -> Result<(), SessionError> {
        for (delivery, message) in self.session.outgoing() {
            self.link.send(delivery, &message)?;
        }
        if self.session.closing() {
            self.link.close();
        }
        Ok(())
    }
}
