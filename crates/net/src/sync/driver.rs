//! Runs sessions over links in real time. `tumble serve` and `tumble facet` use [`Server`] and
//! [`Facet`].

use super::compute::{FrameInputs, Simulation};
use super::facet::{AppliedFrame, FacetOptions, FacetSession, Task};
use super::input::Input;
use super::messages::FacetCounts;
use super::publisher::PublishError;
use super::recording::FrameRecord;
use super::server::{Membership, ServerEvent, ServerOptions, ServerSession, SlotCounts};
use super::transport::{FacetLink, FacetNumber, LinkCounters, LinkError, Message, ServerLink};
use super::viewer::Viewer;
use super::wire::Hash;
use std::time::{Duration, Instant};
use tumble_core::{World, WorldError};

/// Error of a server or a facet that ends its session.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The world cannot be sent.
    #[error(transparent)]
    Publish(#[from] PublishError),
    /// Critical facets did not join within the timeout.
    #[error("{} did not join within {:.1} s; start them, or check why they ended", .0.join(", "), .1.as_secs_f64())]
    Missing(Vec<String>, Duration),
}

/// Longest wait for a link event. A wait ends early if an event arrives or work is due.
const MAX_WAIT: Duration = Duration::from_secs(1);

/// A server session and its link.
pub struct Server<L> {
    link: L,
    session: ServerSession,
    start: Instant,
    buffer: Vec<u8>,
}

impl<L: ServerLink> Server<L> {
    /// Creates the session. `base` is the world as the scene file makes it, before the first step.
    pub fn new(link: L, options: ServerOptions, base: &World) -> Server<L> {
        Server { link, session: ServerSession::new(options, base), start: Instant::now(), buffer: Vec::new() }
    }

    /// Waits until every critical facet has joined.
    ///
    /// # Errors
    /// [`SessionError::Missing`] with the names of the missing facets after `timeout`; errors of
    /// the link.
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

    /// Publishes the world as the next frame and returns its number. In lockstep it first waits
    /// until all facets in step have shown the frame, bounded by the timeouts.
    ///
    /// # Errors
    /// Errors of the link, and [`PublishError`].
    pub fn frame(&mut self, world: &World, viewer: &Viewer) -> Result<u64, SessionError> {
        let frame = self.begin(world, viewer)?;
        while !self.shown(MAX_WAIT)? {}
        Ok(frame)
    }

    /// Publishes the world as the next frame and returns its number without waiting.
    /// [`shown`](Self::shown) waits.
    ///
    /// # Errors
    /// Errors of the link, and [`PublishError`].
    pub fn begin(&mut self, world: &World, viewer: &Viewer) -> Result<u64, SessionError> {
        self.poll(Duration::ZERO)?;
        let frame = self.session.publish(self.now(), world, viewer)?;
        self.flush()?;
        Ok(frame)
    }

    /// Takes the events of the world's last step into the next frame: call it after each step of a frame with several, if
    /// [`ServerOptions::events`] is above 0.
    pub fn step(&mut self, world: &World) {
        self.session.step(world);
    }

    /// Sends everything that acts on the world in the next frame to the facets that step by
    /// themselves. [`begin_simulation`](Self::begin_simulation) of that frame follows.
    ///
    /// # Errors
    /// Errors of the link.
    pub fn send_inputs(&mut self, inputs: FrameInputs) -> Result<(), SessionError> {
        self.session.send_inputs(self.now(), inputs);
        self.flush()
    }

    /// Publishes the world of a simulation as the next frame without waiting, like
    /// [`begin`](Self::begin).
    ///
    /// # Errors
    /// Errors of the link, and [`PublishError`].
    pub fn begin_simulation(&mut self, simulation: &dyn Simulation) -> Result<u64, SessionError> {
        let frame = self.session.publish_simulation(self.now(), simulation)?;
        self.flush()?;
        Ok(frame)
    }

    /// Publishes a recorded frame without waiting, like [`begin`](Self::begin).
    ///
    /// # Errors
    /// Errors of the link.
    pub fn begin_recorded(&mut self, recorded: &FrameRecord) -> Result<(), SessionError> {
        self.poll(Duration::ZERO)?;
        self.session.publish_recorded(self.now(), recorded);
        self.flush()
    }

    /// Waits at most `timeout` until all awaited facets have shown the frame. Returns whether they
    /// have.
    ///
    /// # Errors
    /// Errors of the link.
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

    /// Publishes a recorded frame and waits, like [`frame`](Self::frame).
    ///
    /// # Errors
    /// Errors of the link.
    pub fn replay(&mut self, recorded: &FrameRecord) -> Result<(), SessionError> {
        self.begin_recorded(recorded)?;
        while !self.shown(MAX_WAIT)? {}
        Ok(())
    }

    /// Removes a facet whose process has ended, so that no frame waits for it.
    ///
    /// # Errors
    /// Errors of the link.
    pub fn facet_exited(&mut self, facet: FacetNumber) -> Result<(), SessionError> {
        self.session.facet_exited(self.now(), facet);
        self.flush()
    }

    /// Returns the session.
    pub fn session(&self) -> &ServerSession {
        &self.session
    }

    /// Processes link events until `until`, a time since the start ([`now`](Self::now)). A server
    /// calls it between two frames.
    ///
    /// # Errors
    /// Errors of the link.
    pub fn idle_until(&mut self, until: Duration) -> Result<(), SessionError> {
        loop {
            let left = until.saturating_sub(self.now());
            self.poll(left)?;
            if left.is_zero() {
                return Ok(());
            }
        }
    }

    /// Sends END to all facets and waits at most 1 s until each has acknowledged it. A facet that
    /// is drawing acknowledges after its picture.
    ///
    /// # Errors
    /// Errors of the link.
    pub fn end(&mut self) -> Result<(), SessionError> {
        self.session.end();
        self.flush()?;
        let until = self.now() + Duration::from_secs(1);
        while self.session.has_facets() && self.now() < until {
            self.poll(until.saturating_sub(self.now()))?;
        }
        Ok(())
    }

    /// Returns the time since the start.
    pub fn now(&self) -> Duration {
        self.start.elapsed()
    }

    /// Returns the events since the last call.
    pub fn events(&mut self) -> Vec<ServerEvent> {
        self.session.events()
    }

    /// Returns the membership of a facet.
    pub fn membership(&self, facet: FacetNumber) -> Membership {
        self.session.membership(facet)
    }

    /// Returns the counters of packets that belong to no facet.
    pub fn unknown_peers(&self) -> LinkCounters {
        self.link.unknown_peers()
    }

    /// Notes an input that no facet sent and that arrived this time ago, so that its latency is measured; see
    /// [`ServerSession::note_input`].
    pub fn note_input(&mut self, user: u16, sequence: u64, age: Duration) {
        self.session.note_input(self.now().saturating_sub(age), user, sequence);
    }

    /// Returns the counts about a facet: the server's, the facet's own, and those of its link.
    pub fn counts(&self, facet: FacetNumber) -> (SlotCounts, FacetCounts, LinkCounters) {
        let (here, there) = self.session.counts(facet);
        (here, there, self.link.counters(facet))
    }

    /// Waits for one link event, at most `timeout` and no longer than until the session has work
    /// due. Then does the work.
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

/// A facet session and its link.
pub struct Facet<L> {
    link: L,
    session: FacetSession,
    start: Instant,
}

impl<L: FacetLink> Facet<L> {
    /// Creates the session. `base` is the world as the scene file makes it.
    pub fn new(link: L, options: FacetOptions, base: World) -> Facet<L> {
        Facet { link, session: FacetSession::new(options, base), start: Instant::now() }
    }

    /// Creates the session of a facet that steps the world by itself; see
    /// [`FacetSession::computing`].
    pub fn computing(link: L, options: FacetOptions, simulation: Box<dyn Simulation>) -> Facet<L> {
        Facet { link, session: FacetSession::computing(options, simulation), start: Instant::now() }
    }

    /// Creates a session that follows another one of this process; see [`FacetSession::following`].
    ///
    /// # Errors
    /// As [`FacetSession::following`].
    pub fn following(link: L, options: FacetOptions, computing: bool) -> Result<Facet<L>, WorldError> {
        Ok(Facet { link, session: FacetSession::following(options, computing)?, start: Instant::now() })
    }

    /// Waits at most `timeout` for the next task and returns it. On [`Task::Draw`] call
    /// [`begin`](Self::begin), draw, then call [`drawn`](Self::drawn). On [`Task::Present`] show
    /// the picture and call [`presented`](Self::presented). On [`Task::Wait`] process window events
    /// and call this again.
    ///
    /// # Errors
    /// Errors of the link.
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

    /// Applies the next frame and returns its number. Returns `None` if the frame did not fit the
    /// scene and was refused.
    pub fn begin(&mut self) -> Option<u64> {
        self.session.begin()
    }

    /// Returns the frame that has begun, for followers; see [`FacetSession::applied`].
    pub fn applied(&mut self) -> Option<AppliedFrame> {
        self.session.applied()
    }

    /// Begins the waiting frame if the leader has applied it; see [`FacetSession::follow`].
    pub fn follow(&mut self, leader: &AppliedFrame) -> bool {
        self.session.follow(leader)
    }

    /// Returns the world to draw.
    pub fn world(&self) -> &World {
        self.session.world()
    }

    /// Returns the users' heads and the cave's place in the scene.
    pub fn viewer(&self) -> &Viewer {
        self.session.viewer()
    }

    /// Reports that the frame is drawn. `image` holds the first 16 bytes of the BLAKE3 hash of its
    /// pixels, or zeros if there are none.
    ///
    /// # Errors
    /// Errors of the link.
    pub fn drawn(&mut self, image: Hash) -> Result<(), SessionError> {
        self.session.drawn(self.now(), image);
        self.flush()
    }

    /// Reports that the frame is on the screen.
    ///
    /// # Errors
    /// Errors of the link.
    pub fn presented(&mut self) -> Result<(), SessionError> {
        self.session.presented(self.now());
        self.flush()
    }

    /// Sends a user's input. Returns `false` while there is no server.
    ///
    /// # Errors
    /// Errors of the link.
    pub fn send_input(&mut self, input: &Input) -> Result<bool, SessionError> {
        let sent = self.session.send_input(self.now(), input);
        self.flush().map(|()| sent)
    }

    /// Sends LEAVE and gives the link 20 ms to transmit it.
    ///
    /// # Errors
    /// Errors of the link.
    pub fn leave(&mut self) -> Result<(), SessionError> {
        self.session.leave();
        self.flush()?;
        self.poll(Duration::from_millis(20))
    }

    /// Returns the session.
    pub fn session(&self) -> &FacetSession {
        &self.session
    }

    /// Returns the counters of the link.
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
