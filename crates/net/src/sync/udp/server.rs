//! The server's side of UDP without socket and clock.

use super::Timing;
use super::handshake::{Cookies, Hello, Reply};
use super::keys::{Agreement, Entropy, Handshake, SharedKey, Side};
use super::packet::{self, PacketHeader, PacketKind};
use super::session::{Numbering, Session};
use crate::sync::transport::{
    Closed, Delivery, FacetNumber, LinkCounters, LinkEvent, MAX_FACETS, MAX_MESSAGE_BYTES, Refused,
};
use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

/// Maximum number of prepared sessions that are not live; beyond it the oldest is discarded.
const MAX_PREPARED: usize = 2 * MAX_FACETS;
/// Maximum number of ended sessions whose late packets are recognized; beyond it the oldest is
/// discarded.
const MAX_OVER: usize = 2 * MAX_FACETS;
/// Maximum number of handshake replies that wait to be sent; further ones are dropped and the facet
/// repeats its request.
const MAX_REPLIES: usize = 256;

/// Settings of a server.
#[derive(Clone, Copy, Debug)]
pub struct ServerSettings {
    /// Facets have numbers below this, at most [`MAX_FACETS`].
    pub facets: FacetNumber,
    /// Intervals and timeouts.
    pub timing: Timing,
    /// First packet and message numbers.
    pub numbering: Numbering,
}

/// A server's state machine: datagrams and times in, datagrams and events out.
pub struct ServerMachine {
    settings: ServerSettings,
    shared: SharedKey,
    handshake: Handshake,
    entropy: Entropy,
    cookies: Cookies,
    sessions: BTreeMap<u32, Session>,
    /// The live session of each facet.
    live: Vec<Option<u32>>,
    prepared: VecDeque<u32>,
    /// Ended sessions that were live: packets that the facet sent before the end may still arrive.
    over: VecDeque<Session>,
    replies: VecDeque<(SocketAddr, Vec<u8>)>,
    events: VecDeque<(FacetNumber, LinkEvent, Vec<u8>)>,
    counters: Vec<LinkCounters>,
    unknown_peers: LinkCounters,
    /// The facet that is polled first for a message.
    turn: usize,
}

impl ServerMachine {
    /// Creates a server without connections.
    pub fn new(settings: ServerSettings, shared: SharedKey, mut entropy: Entropy) -> ServerMachine {
        let facets = usize::from(settings.facets).min(MAX_FACETS);
        ServerMachine {
            settings,
            handshake: Handshake::new(&shared),
            shared,
            cookies: Cookies::new(entropy.next_bytes()),
            entropy,
            sessions: BTreeMap::new(),
            live: vec![None; facets],
            prepared: VecDeque::new(),
            over: VecDeque::new(),
            replies: VecDeque::new(),
            events: VecDeque::new(),
            counters: vec![LinkCounters::default(); facets],
            unknown_peers: LinkCounters::default(),
            turn: 0,
        }
    }

    /// Processes a datagram.
    pub fn receive(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]) {
        let header = packet::parse(datagram);
        let facet = match &header {
            Ok(header) if header.kind == PacketKind::Data => {
                self.sessions.get(&header.session).map(|session| session.agreed.facet)
            }
            _ => self.facet_at(from),
        };
        self.counters_of(facet).bytes_in += datagram.len() as u64;
        let taken = header.and_then(|header| match header.kind {
            PacketKind::Data => self.take_data(now, from, &header, datagram),
            PacketKind::Hello => self.take_hello(now, from, datagram),
            PacketKind::Answer => self.take_answer(now, from, datagram),
            _ => Err(Refused::Foreign),
        });
        if let Err(why) = taken {
            self.counters_of(facet).refuse(why);
        }
    }

    /// Sends due datagrams by `emit`, and ends sessions that are closed, timed out or exhausted.
    pub fn transmit(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        for (to, datagram) in self.replies.drain(..) {
            self.unknown_peers.bytes_out += datagram.len() as u64;
            emit(to, &datagram);
        }
        let mut over = Vec::new();
        for (id, session) in &mut self.sessions {
            let counters = &mut self.counters[usize::from(session.agreed.facet)];
            if session.live {
                session.transmit(now, counters, emit);
            }
            if session.is_closed_by_peer() {
                over.push((*id, Closed::ByPeer));
            } else if session.is_timed_out(now) {
                over.push((*id, Closed::TimedOut));
            } else if session.is_exhausted() {
                over.push((*id, Closed::ByUs));
            }
        }
        for (id, why) in over {
            self.end(id, why);
        }
    }

    /// Returns when [`transmit`](Self::transmit) has work, if no datagram arrives before.
    pub fn wake(&self) -> Option<Duration> {
        self.sessions.values().map(Session::wake).min()
    }

    /// Queues a message for a facet. Returns `false` if there is no connection, or if the message
    /// is empty or too long.
    pub fn send(&mut self, to: FacetNumber, delivery: Delivery, message: &Arc<[u8]>) -> bool {
        let session = self.live_session(to);
        let fits = (1..=MAX_MESSAGE_BYTES).contains(&message.len());
        let Some(session) = session.filter(|_| fits) else {
            if let Some(counters) = self.counters.get_mut(usize::from(to)) {
                counters.unsent += 1;
            }
            return false;
        };
        if session.send(delivery, message.clone()).is_err() {
            let id = session.agreed.session;
            self.end(id, Closed::Overrun);
            return false;
        }
        self.counters[usize::from(to)].messages_out += 1;
        true
    }

    /// Returns the next event, in order for each facet, and round-robin over the facets.
    pub fn poll(&mut self) -> Option<(FacetNumber, LinkEvent, Vec<u8>)> {
        if let Some((facet, event, message)) = self.events.pop_front() {
            self.counters[usize::from(facet)].messages_in += u64::from(event == LinkEvent::Message);
            return Some((facet, event, message));
        }
        for _ in 0..self.live.len() {
            self.turn = (self.turn + 1) % self.live.len();
            let facet = self.turn as FacetNumber;
            if let Some((_, message)) = self.live_session(facet).and_then(Session::pop) {
                self.counters[usize::from(facet)].messages_in += 1;
                return Some((facet, LinkEvent::Message, message));
            }
        }
        None
    }

    /// Ends a facet's connection.
    pub fn close(&mut self, now: Duration, facet: FacetNumber, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        let Some(id) = self.live.get(usize::from(facet)).copied().flatten() else { return };
        if let Some(session) = self.sessions.get_mut(&id) {
            session.send_close(now, &mut self.counters[usize::from(facet)], emit);
        }
        self.end(id, Closed::ByUs);
    }

    /// Returns the counters of a facet's connections.
    pub fn counters(&self, facet: FacetNumber) -> LinkCounters {
        self.counters.get(usize::from(facet)).copied().unwrap_or_default()
    }

    /// Returns the counters of datagrams that belong to no facet.
    pub fn unknown_peers(&self) -> LinkCounters {
        self.unknown_peers
    }

    fn take_data(
        &mut self,
        now: Duration,
        from: SocketAddr,
        header: &PacketHeader,
        datagram: &[u8],
    ) -> Result<(), Refused> {
        let Some(session) = self.sessions.get_mut(&header.session) else {
            return self.take_late(from, header, datagram);
        };
        if session.address != from {
            return Err(Refused::UnknownPeer);
        }
        let facet = session.agreed.facet;
        let was_live = session.live;
        let taken = session.receive(now, header, datagram, &mut self.counters[usize::from(facet)]);
        if session.live && !was_live {
            self.establish(header.session, facet);
        }
        taken
    }

    /// Processes a packet of an unknown or ended session. It is not answered, because it proves
    /// nothing. A genuine late packet of an ended session does not count as refused.
    fn take_late(&mut self, from: SocketAddr, header: &PacketHeader, datagram: &[u8]) -> Result<(), Refused> {
        let over =
            self.over.iter_mut().find(|session| session.agreed.session == header.session && session.address == from);
        over.ok_or(Refused::Stale)?.receive_late(header, datagram)
    }

    fn take_hello(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]) -> Result<(), Refused> {
        let hello = self.known(Hello::read(datagram, &self.handshake)?)?;
        let known = self
            .sessions
            .get_mut(&hello.suspect_session)
            .filter(|s| s.live && s.address == from && s.agreed.facet == hello.facet);
        if let Some(session) = known {
            session.ping();
            return Ok(());
        }
        let mut reply = Vec::new();
        Reply { nonce: hello.nonce, value: self.cookies.create(now, from, &hello) }.write(
            PacketKind::Challenge,
            0,
            &self.handshake,
            &mut reply,
        );
        self.reply(from, reply);
        Ok(())
    }

    fn take_answer(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]) -> Result<(), Refused> {
        let answer = self.known(Hello::read(datagram, &self.handshake)?)?;
        if !self.cookies.verify(now, from, &answer) {
            return Err(Refused::Stale);
        }
        let same = |session: &&Session| {
            session.agreed.facet_nonce == answer.nonce
                && session.agreed.facet == answer.facet
                && session.address == from
        };
        let agreed = match self.sessions.values().find(same) {
            Some(session) => session.agreed,
            None => self.prepare(now, from, &answer),
        };
        let mut reply = Vec::new();
        Reply { nonce: agreed.facet_nonce, value: agreed.server_nonce }.write(
            PacketKind::Welcome,
            agreed.session,
            &self.handshake,
            &mut reply,
        );
        self.reply(from, reply);
        Ok(())
    }

    /// Prepares a session; its first sealed packet makes it live.
    fn prepare(&mut self, now: Duration, from: SocketAddr, answer: &Hello) -> Agreement {
        while self.prepared.len() >= MAX_PREPARED {
            if let Some(oldest) = self.prepared.pop_front() {
                self.sessions.remove(&oldest);
            }
        }
        let mut session = 0;
        while session == 0 || self.sessions.contains_key(&session) {
            session = self.entropy.next_u64() as u32;
        }
        let agreed = Agreement {
            session,
            facet: answer.facet,
            facet_nonce: answer.nonce,
            server_nonce: self.entropy.next_bytes(),
        };
        let prepared =
            Session::new(now, &self.shared, agreed, Side::Server, from, self.settings.timing, self.settings.numbering);
        self.sessions.insert(session, prepared);
        self.prepared.push_back(session);
        agreed
    }

    fn establish(&mut self, id: u32, facet: FacetNumber) {
        self.prepared.retain(|prepared| *prepared != id);
        if let Some(old) = self.live[usize::from(facet)] {
            self.end(old, Closed::Replaced);
        }
        self.live[usize::from(facet)] = Some(id);
        self.counters[usize::from(facet)].opened += 1;
        self.events.push_back((facet, LinkEvent::Opened, Vec::new()));
    }

    /// Ends a session. Received messages are reported first, unless this side closes.
    fn end(&mut self, id: u32, why: Closed) {
        let Some(mut session) = self.sessions.remove(&id) else { return };
        self.prepared.retain(|prepared| *prepared != id);
        let facet = session.agreed.facet;
        let live = &mut self.live[usize::from(facet)];
        if *live == Some(id) {
            *live = None;
            if why != Closed::ByUs {
                self.events.extend(
                    std::iter::from_fn(|| session.pop()).map(|(_, message)| (facet, LinkEvent::Message, message)),
                );
            }
            self.events.push_back((facet, LinkEvent::Closed(why), Vec::new()));
            session.clear_messages();
            if self.over.len() == MAX_OVER {
                self.over.pop_front();
            }
            self.over.push_back(session);
        }
    }

    fn known(&self, hello: Hello) -> Result<Hello, Refused> {
        if usize::from(hello.facet) < self.live.len() { Ok(hello) } else { Err(Refused::UnknownPeer) }
    }

    fn live_session(&mut self, facet: FacetNumber) -> Option<&mut Session> {
        let id = self.live.get(usize::from(facet)).copied().flatten()?;
        self.sessions.get_mut(&id)
    }

    fn facet_at(&self, from: SocketAddr) -> Option<FacetNumber> {
        self.sessions
            .values()
            .find(|session| session.live && session.address == from)
            .map(|session| session.agreed.facet)
    }

    fn counters_of(&mut self, facet: Option<FacetNumber>) -> &mut LinkCounters {
        match facet {
            Some(facet) => &mut self.counters[usize::from(facet)],
            None => &mut self.unknown_peers,
        }
    }

    fn reply(&mut self, to: SocketAddr, datagram: Vec<u8>) {
        if self.replies.len() < MAX_REPLIES {
            self.replies.push_back((to, datagram));
        }
    }
}
