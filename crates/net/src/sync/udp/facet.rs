//! A facet's side of UDP without socket and clock.

use super::Timing;
use super::handshake::{Hello, Reply};
use super::keys::{Agreement, Entropy, Handshake, SharedKey, Side};
use super::packet::{self, PacketHeader, PacketKind};
use super::session::{Numbering, Session};
use crate::sync::transport::{Closed, Delivery, FacetNumber, LinkCounters, LinkEvent, MAX_MESSAGE_BYTES, Refused};
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

/// Settings of a facet.
#[derive(Clone, Copy, Debug)]
pub struct FacetSettings {
    /// Number of the facet.
    pub facet: FacetNumber,
    /// Address of the server.
    pub server: SocketAddr,
    /// Intervals and timeouts.
    pub timing: Timing,
    /// First packet and message numbers.
    pub numbering: Numbering,
}

/// State of the connection.
enum ConnectionState {
    /// Requests or answers a challenge.
    Connecting(HandshakeAttempt),
    /// Has session keys.
    Connected(Box<Session>),
}

/// A handshake in progress: requests or answers a challenge, again at `next`.
struct HandshakeAttempt {
    hello: Hello,
    answering: bool,
    next: Duration,
    give_up: Duration,
}

/// A second handshake beside a session from which nothing was received for some time.
struct Probe {
    attempt: HandshakeAttempt,
    /// The session that replaces the current one as soon as it has received a sealed packet.
    other: Option<Box<Session>>,
}

/// Number of ping intervals without any packet after which the session is probed.
const PROBE_AFTER_PINGS: u32 = 2;

/// A facet's state machine: datagrams and times in, datagrams and events out.
pub struct FacetMachine {
    settings: FacetSettings,
    shared: SharedKey,
    handshake: Handshake,
    entropy: Entropy,
    state: ConnectionState,
    probe: Option<Probe>,
    events: VecDeque<(LinkEvent, Vec<u8>)>,
    counters: LinkCounters,
}

impl FacetMachine {
    /// Creates a facet that looks for its server.
    pub fn new(now: Duration, settings: FacetSettings, shared: SharedKey, entropy: Entropy) -> FacetMachine {
        let mut entropy = entropy;
        FacetMachine {
            settings,
            handshake: Handshake::new(&shared),
            shared,
            state: ConnectionState::Connecting(HandshakeAttempt::new(now, &settings, &mut entropy, 0)),
            probe: None,
            entropy,
            events: VecDeque::new(),
            counters: LinkCounters::default(),
        }
    }

    /// Processes a datagram.
    pub fn receive(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]) {
        self.counters.bytes_in += datagram.len() as u64;
        if let Err(why) = self.take(now, from, datagram) {
            self.counters.refuse(why);
        }
    }

    /// Sends due datagrams by `emit`, and ends the connection if it is closed, timed out or
    /// exhausted.
    pub fn transmit(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        match &mut self.state {
            ConnectionState::Connecting(attempt) => {
                if now >= attempt.give_up {
                    *attempt = HandshakeAttempt::new(now, &self.settings, &mut self.entropy, 0);
                }
                attempt.transmit(now, &self.settings, &self.handshake, &mut self.counters, emit);
            }
            ConnectionState::Connected(session) => {
                session.transmit(now, &mut self.counters, emit);
                if session.is_closed_by_peer() {
                    self.end(now, Closed::ByPeer);
                } else if session.is_timed_out(now) {
                    self.end(now, Closed::TimedOut);
                } else if session.is_exhausted() {
                    self.end(now, Closed::ByUs);
                } else {
                    self.probe(now, emit);
                }
            }
        }
    }

    /// Probes whether the server still knows a session from which nothing was received for some
    /// time.
    fn probe(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        let ConnectionState::Connected(session) = &self.state else { return };
        let number = session.agreed.session;
        if now < probe_time(session, &self.settings)
            || self.probe.as_ref().is_some_and(|probe| now >= probe.attempt.give_up)
        {
            self.probe = None;
        }
        if now < probe_time(session, &self.settings) {
            return;
        }
        let fresh =
            || Probe { attempt: HandshakeAttempt::new(now, &self.settings, &mut self.entropy, number), other: None };
        let Probe { attempt, other } = self.probe.get_or_insert_with(fresh);
        match other {
            Some(other) => other.transmit(now, &mut self.counters, emit),
            None => attempt.transmit(now, &self.settings, &self.handshake, &mut self.counters, emit),
        }
    }

    /// Returns when [`transmit`](Self::transmit) has work, if no datagram arrives before.
    pub fn wake(&self) -> Duration {
        match (&self.state, &self.probe) {
            (ConnectionState::Connecting(attempt), _) => attempt.next.min(attempt.give_up),
            (ConnectionState::Connected(session), None) => session.wake().min(probe_time(session, &self.settings)),
            (ConnectionState::Connected(session), Some(Probe { attempt, other })) => {
                session.wake().min(attempt.give_up).min(other.as_ref().map_or(attempt.next, |other| other.wake()))
            }
        }
    }

    /// Queues a message for the server. Returns `false` if there is no connection, or if the
    /// message is empty or too long.
    pub fn send(&mut self, now: Duration, delivery: Delivery, message: &[u8]) -> bool {
        let fits = (1..=MAX_MESSAGE_BYTES).contains(&message.len());
        let ConnectionState::Connected(session) = &mut self.state else {
            self.counters.unsent += 1;
            return false;
        };
        if !fits {
            self.counters.unsent += 1;
            return false;
        }
        if session.send(delivery, Arc::from(message)).is_err() {
            self.end(now, Closed::Overrun);
            return false;
        }
        self.counters.messages_out += 1;
        true
    }

    /// Returns the next event and its message.
    pub fn poll(&mut self) -> Option<(LinkEvent, Vec<u8>)> {
        let event = self.events.pop_front().or_else(|| match &mut self.state {
            ConnectionState::Connected(session) => session.pop().map(|(_, message)| (LinkEvent::Message, message)),
            ConnectionState::Connecting(_) => None,
        });
        self.counters.messages_in += u64::from(matches!(event, Some((LinkEvent::Message, _))));
        event
    }

    /// Ends the connection and looks for a server again.
    pub fn close(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        if let ConnectionState::Connected(session) = &mut self.state {
            session.send_close(now, &mut self.counters, emit);
            self.end(now, Closed::ByUs);
        }
    }

    /// Returns the counters of this link.
    pub fn counters(&self) -> LinkCounters {
        self.counters
    }

    fn take(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]) -> Result<(), Refused> {
        let header = packet::parse(datagram)?;
        if from != self.settings.server {
            return Err(Refused::UnknownPeer);
        }
        match header.kind {
            PacketKind::Challenge => self.take_challenge(now, datagram),
            PacketKind::Welcome => self.take_welcome(now, &header, datagram),
            PacketKind::Data => self.take_data(now, &header, datagram),
            PacketKind::Hello | PacketKind::Answer => Err(Refused::Foreign),
        }
    }

    fn take_challenge(&mut self, now: Duration, datagram: &[u8]) -> Result<(), Refused> {
        let reply = Reply::read(datagram, &self.handshake)?;
        let attempt = self.attempt().filter(|attempt| attempt.hello.nonce == reply.nonce).ok_or(Refused::Stale)?;
        if std::mem::replace(&mut attempt.answering, true) {
            return Err(Refused::Replayed);
        }
        attempt.hello.cookie = reply.value;
        attempt.next = now;
        Ok(())
    }

    /// Returns the handshake that waits for an answer.
    fn attempt(&mut self) -> Option<&mut HandshakeAttempt> {
        match (&mut self.state, &mut self.probe) {
            (ConnectionState::Connecting(attempt), _) => Some(attempt),
            (ConnectionState::Connected(_), Some(Probe { attempt, other: None })) => Some(attempt),
            _ => None,
        }
    }

    fn take_data(&mut self, now: Duration, header: &PacketHeader, datagram: &[u8]) -> Result<(), Refused> {
        let (ConnectionState::Connected(session), counters) = (&mut self.state, &mut self.counters) else {
            return Err(Refused::Stale);
        };
        if session.agreed.session == header.session {
            return session.receive(now, header, datagram, counters).inspect(|()| self.probe = None);
        }
        let other = self
            .probe
            .as_mut()
            .and_then(|probe| probe.other.as_mut())
            .filter(|other| other.agreed.session == header.session);
        other.ok_or(Refused::Stale)?.receive(now, header, datagram, counters)?;
        // the server has the new keys, and sent nothing with the old ones
        if let Some(other) = self.probe.take().and_then(|probe| probe.other) {
            self.end(now, Closed::ByPeer);
            self.connect(other);
        }
        Ok(())
    }

    fn connect(&mut self, session: Box<Session>) {
        self.state = ConnectionState::Connected(session);
        self.counters.opened += 1;
        self.events.push_back((LinkEvent::Opened, Vec::new()));
    }

    fn take_welcome(&mut self, now: Duration, header: &PacketHeader, datagram: &[u8]) -> Result<(), Refused> {
        let reply = Reply::read(datagram, &self.handshake)?;
        let attempt = self
            .attempt()
            .filter(|attempt| attempt.answering && attempt.hello.nonce == reply.nonce)
            .ok_or(Refused::Stale)?;
        let facet_nonce = attempt.hello.nonce;
        let FacetSettings { facet, server, timing, numbering } = self.settings;
        let agreed = Agreement { session: header.session, facet, facet_nonce, server_nonce: reply.value };
        let mut session = Session::new(now, &self.shared, agreed, Side::Facet, server, timing, numbering);
        session.live = true;
        session.ping();
        match &mut self.probe {
            Some(probe) => probe.other = Some(Box::new(session)),
            None => self.connect(Box::new(session)),
        }
        Ok(())
    }

    /// Ends the connection. Received messages are reported first, because they may say why the peer
    /// closes.
    fn end(&mut self, now: Duration, why: Closed) {
        if let (ConnectionState::Connected(session), true) = (&mut self.state, why != Closed::ByUs) {
            self.events.extend(std::iter::from_fn(|| session.pop()).map(|(_, message)| (LinkEvent::Message, message)));
        }
        self.events.push_back((LinkEvent::Closed(why), Vec::new()));
        self.reconnect(now);
    }

    fn reconnect(&mut self, now: Duration) {
        self.probe = None;
        self.state = ConnectionState::Connecting(HandshakeAttempt::new(now, &self.settings, &mut self.entropy, 0));
    }
}

impl HandshakeAttempt {
    /// Starts with a fresh nonce. A handshake without result is given up after a second, because
    /// the server may have been restarted.
    fn new(now: Duration, settings: &FacetSettings, entropy: &mut Entropy, suspect_session: u32) -> HandshakeAttempt {
        let hello = Hello { nonce: entropy.next_bytes(), facet: settings.facet, cookie: [0; 32], suspect_session };
        HandshakeAttempt { hello, answering: false, next: now, give_up: now + 10 * settings.timing.connect_interval }
    }

    fn transmit(
        &mut self,
        now: Duration,
        settings: &FacetSettings,
        handshake: &Handshake,
        counters: &mut LinkCounters,
        emit: &mut dyn FnMut(SocketAddr, &[u8]),
    ) {
        if now >= self.next {
            self.next = now + settings.timing.connect_interval;
            let mut datagram = Vec::new();
            self.hello.write(
                if self.answering { PacketKind::Answer } else { PacketKind::Hello },
                handshake,
                &mut datagram,
            );
            counters.bytes_out += datagram.len() as u64;
            emit(settings.server, &datagram);
        }
    }
}

/// Returns when a session is probed, if no packet arrives before.
fn probe_time(session: &Session, settings: &FacetSettings) -> Duration {
    session.last_received() + PROBE_AFTER_PINGS * settings.timing.ping_interval
}
