//! A facet's side, without socket or clock.

use super::Timing;
use super::handshake::{Hello, Reply};
use super::keys::{Agreement, Entropy, Handshake, SharedKey, Side};
use super::packet::{self, Header, Kind};
use super::session::{Numbering, Session};
use crate::sync::transport::{Closed, Delivery, FacetNumber, LinkCounters, LinkEvent, MAX_MESSAGE_BYTES, Refused};
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

/// What is set when a facet begins.
#[derive(Clone, Copy, Debug)]
pub struct FacetSettings {
    /// Which facet.
    pub facet: FacetNumber,
    /// Where its server is.
    pub server: SocketAddr,
    /// How often, and how long at most.
    pub timing: Timing,
    /// Where counting begins.
    pub numbering: Numbering,
}

/// How far the connection is.
enum Stage {
    /// Asks for a challenge, or answers one that came; anew at the given time.
    Looking { hello: Hello, answering: bool, next: Duration, give_up: Duration },
    /// Has keys.
    Connected(Box<Session>),
}

/// A facet's side: datagrams and time in, datagrams and events out.
pub struct FacetMachine {
    settings: FacetSettings,
    shared: SharedKey,
    handshake: Handshake,
    entropy: Entropy,
    stage: Stage,
    events: VecDeque<(LinkEvent, Vec<u8>)>,
    counters: LinkCounters,
}

impl FacetMachine {
    /// A facet that begins to look for its server.
    pub fn new(now: Duration, settings: FacetSettings, shared: SharedKey, entropy: Entropy) -> FacetMachine {
        let mut machine = FacetMachine {
            settings,
            handshake: Handshake::new(&shared),
            shared,
            entropy,
            stage: Stage::Looking { hello: Hello { nonce: [0; 32], facet: 0, cookie: [0; 32] }, answering: false, next: now, give_up: now },
            events: VecDeque::new(),
            counters: LinkCounters::default(),
        };
        machine.look(now);
        machine
    }

    /// Takes a datagram.
    pub fn receive(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]) {
        self.counters.bytes_in += datagram.len() as u64;
        if let Err(why) = self.take(now, from, datagram) {
            self.counters.refuse(why);
        }
    }

    /// Sends what is due by `emit`, and finds what is over.
    pub fn transmit(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        let server = self.settings.server;
        match &mut self.stage {
            Stage::Looking { give_up, .. } if now >= *give_up => {
                self.look(now);
                self.transmit(now, emit);
            }
            Stage::Looking { hello, answering, next, .. } => {
                if now >= *next {
                    *next = now + self.settings.timing.ask;
                    let mut datagram = Vec::new();
                    hello.write(if *answering { Kind::Answer } else { Kind::Hello }, &self.handshake, &mut datagram);
                    self.counters.bytes_out += datagram.len() as u64;
                    emit(server, &datagram);
                }
            }
            Stage::Connected(session) => {
                session.transmit(now, &mut self.counters, emit);
                if session.is_closed_by_peer() {
                    self.end(now, Closed::ByPeer);
                } else if session.is_silent(now) {
                    self.end(now, Closed::Silent);
                } else if session.is_exhausted() {
                    self.end(now, Closed::ByUs);
                }
            }
        }
    }

    /// When [`transmit`](Self::transmit) has something to do, if nothing arrives before.
    pub fn wake(&self) -> Duration {
        match &self.stage {
            Stage::Looking { next, .. } => *next,
            Stage::Connected(session) => session.wake(),
        }
    }

    /// Takes a message for the server. `false`: there is no connection, or the message is empty or too long.
    pub fn send(&mut self, now: Duration, delivery: Delivery, message: &[u8]) -> bool {
        let fits = (1..=MAX_MESSAGE_BYTES).contains(&message.len());
        let Stage::Connected(session) = &mut self.stage else {
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

    /// The next event.
    pub fn poll(&mut self) -> Option<(LinkEvent, Vec<u8>)> {
        let event = self.events.pop_front().or_else(|| match &mut self.stage {
            Stage::Connected(session) => session.pop().map(|(_, message)| (LinkEvent::Message, message)),
            Stage::Looking { .. } => None,
        });
        self.counters.messages_in += u64::from(matches!(event, Some((LinkEvent::Message, _))));
        event
    }

    /// Ends the connection and looks for a server anew.
    pub fn close(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        if let Stage::Connected(session) = &mut self.stage {
            session.say_close(now, &mut self.counters, emit);
            self.end(now, Closed::ByUs);
        }
    }

    /// What happened on this link so far.
    pub fn counters(&self) -> LinkCounters {
        self.counters
    }

    fn take(&mut self, now: Duration, from: SocketAddr, datagram: &[u8]) -> Result<(), Refused> {
        let header = packet::parse(datagram)?;
        if from != self.settings.server {
            return Err(Refused::Stranger);
        }
        match header.kind {
            Kind::Challenge => self.take_challenge(now, datagram),
            Kind::Welcome => self.take_welcome(now, &header, datagram),
            Kind::Unknown => self.take_unknown(now, &header, datagram),
            Kind::Data => match &mut self.stage {
                Stage::Connected(session) if session.agreed.session == header.session => {
                    session.receive(now, &header, datagram, &mut self.counters)
                }
                _ => Err(Refused::Stale),
            },
            Kind::Hello | Kind::Answer => Err(Refused::Foreign),
        }
    }

    fn take_challenge(&mut self, now: Duration, datagram: &[u8]) -> Result<(), Refused> {
        let reply = Reply::read(datagram, &self.handshake)?;
        match &mut self.stage {
            Stage::Looking { hello, answering, next, .. } if hello.nonce == reply.nonce => {
                if std::mem::replace(answering, true) {
                    return Err(Refused::Replayed);
                }
                hello.cookie = reply.value;
                *next = now;
                Ok(())
            }
            _ => Err(Refused::Stale),
        }
    }

    fn take_welcome(&mut self, now: Duration, header: &Header, datagram: &[u8]) -> Result<(), Refused> {
        let reply = Reply::read(datagram, &self.handshake)?;
        let Stage::Looking { hello, answering: true, .. } = &self.stage else { return Err(Refused::Stale) };
        if hello.nonce != reply.nonce {
            return Err(Refused::Stale);
        }
        let FacetSettings { facet, server, timing, numbering } = self.settings;
        let agreed = Agreement { session: header.session, facet, facet_nonce: hello.nonce, server_nonce: reply.value };
        let mut session = Session::new(now, &self.shared, agreed, Side::Facet, server, timing, numbering);
        session.live = true;
        session.ping();
        self.stage = Stage::Connected(Box::new(session));
        self.counters.opened += 1;
        self.events.push_back((LinkEvent::Opened, Vec::new()));
        Ok(())
    }

    fn take_unknown(&mut self, now: Duration, header: &Header, datagram: &[u8]) -> Result<(), Refused> {
        if !self.handshake.open(datagram)?.is_empty() {
            return Err(Refused::Oversize);
        }
        match &self.stage {
            Stage::Connected(session) if session.agreed.session == header.session => self.end(now, Closed::ByPeer),
            _ => return Err(Refused::Stale),
        }
        Ok(())
    }

    /// What had arrived is told before: it may say why the other side closes.
    fn end(&mut self, now: Duration, why: Closed) {
        if let (Stage::Connected(session), true) = (&mut self.stage, why != Closed::ByUs) {
            self.events.extend(std::iter::from_fn(|| session.pop()).map(|(_, message)| (LinkEvent::Message, message)));
        }
        self.events.push_back((LinkEvent::Closed(why), Vec::new()));
        self.look(now);
    }

    /// Begins anew, with a fresh nonce. An answer that leads nowhere for a second is given up too: the server may have been started again meanwhile.
    fn look(&mut self, now: Duration) {
        let hello = Hello { nonce: self.entropy.next_bytes(), facet: self.settings.facet, cookie: [0; 32] };
        self.stage = Stage::Looking { hello, answering: false, next: now, give_up: now + 10 * self.settings.timing.ask };
    }
}
