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
    /// Asks for a challenge, or answers one that came.
    Looking(Question),
    /// Has keys.
    Connected(Box<Session>),
}

/// Asks for a challenge, or answers one that came; anew at the given time.
struct Question {
    hello: Hello,
    answering: bool,
    next: Duration,
    give_up: Duration,
}

/// What is done beside a session of which nothing was heard for some time.
struct Doubt {
    question: Question,
    /// The session that would take its place, when the server has said something under its seal.
    other: Option<Box<Session>>,
}

/// A session is doubted when nothing was heard for so many pings.
const DOUBT_PINGS: u32 = 2;

/// A facet's side: datagrams and time in, datagrams and events out.
pub struct FacetMachine {
    settings: FacetSettings,
    shared: SharedKey,
    handshake: Handshake,
    entropy: Entropy,
    stage: Stage,
    doubt: Option<Doubt>,
    events: VecDeque<(LinkEvent, Vec<u8>)>,
    counters: LinkCounters,
}

impl FacetMachine {
    /// A facet that begins to look for its server.
    pub fn new(now: Duration, settings: FacetSettings, shared: SharedKey, entropy: Entropy) -> FacetMachine {
        let mut entropy = entropy;
        FacetMachine {
            settings,
            handshake: Handshake::new(&shared),
            shared,
            stage: Stage::Looking(Question::new(now, &settings, &mut entropy, 0)),
            doubt: None,
            entropy,
            events: VecDeque::new(),
            counters: LinkCounters::default(),
        }
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
        match &mut self.stage {
            Stage::Looking(question) => {
                if now >= question.give_up {
                    *question = Question::new(now, &self.settings, &mut self.entropy, 0);
                }
                question.transmit(now, &self.settings, &self.handshake, &mut self.counters, emit);
            }
            Stage::Connected(session) => {
                session.transmit(now, &mut self.counters, emit);
                if session.is_closed_by_peer() {
                    self.end(now, Closed::ByPeer);
                } else if session.is_silent(now) {
                    self.end(now, Closed::Silent);
                } else if session.is_exhausted() {
                    self.end(now, Closed::ByUs);
                } else {
                    self.doubt(now, emit);
                }
            }
        }
    }

    /// Asks whether the server still knows the session, where nothing was heard for some time.
    fn doubt(&mut self, now: Duration, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        let Stage::Connected(session) = &self.stage else { return };
        let number = session.agreed.session;
        if now < doubted_from(session, &self.settings)
            || self.doubt.as_ref().is_some_and(|doubt| now >= doubt.question.give_up)
        {
            self.doubt = None;
        }
        if now < doubted_from(session, &self.settings) {
            return;
        }
        let fresh = || Doubt { question: Question::new(now, &self.settings, &mut self.entropy, number), other: None };
        let Doubt { question, other } = self.doubt.get_or_insert_with(fresh);
        match other {
            Some(other) => other.transmit(now, &mut self.counters, emit),
            None => question.transmit(now, &self.settings, &self.handshake, &mut self.counters, emit),
        }
    }

    /// When [`transmit`](Self::transmit) has something to do, if nothing arrives before.
    pub fn wake(&self) -> Duration {
        match (&self.stage, &self.doubt) {
            (Stage::Looking(question), _) => question.next.min(question.give_up),
            (Stage::Connected(session), None) => session.wake().min(doubted_from(session, &self.settings)),
            (Stage::Connected(session), Some(Doubt { question, other })) => {
                session.wake().min(question.give_up).min(other.as_ref().map_or(question.next, |other| other.wake()))
            }
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
            Stage::Looking(_) => None,
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
            Kind::Data => self.take_data(now, &header, datagram),
            Kind::Hello | Kind::Answer => Err(Refused::Foreign),
        }
    }

    fn take_challenge(&mut self, now: Duration, datagram: &[u8]) -> Result<(), Refused> {
        let reply = Reply::read(datagram, &self.handshake)?;
        let question = self.question().filter(|question| question.hello.nonce == reply.nonce).ok_or(Refused::Stale)?;
        if std::mem::replace(&mut question.answering, true) {
            return Err(Refused::Replayed);
        }
        question.hello.cookie = reply.value;
        question.next = now;
        Ok(())
    }

    /// What was asked and is not answered yet.
    fn question(&mut self) -> Option<&mut Question> {
        match (&mut self.stage, &mut self.doubt) {
            (Stage::Looking(question), _) => Some(question),
            (Stage::Connected(_), Some(Doubt { question, other: None })) => Some(question),
            _ => None,
        }
    }

    fn take_data(&mut self, now: Duration, header: &Header, datagram: &[u8]) -> Result<(), Refused> {
        let (Stage::Connected(session), counters) = (&mut self.stage, &mut self.counters) else {
            return Err(Refused::Stale);
        };
        if session.agreed.session == header.session {
            return session.receive(now, header, datagram, counters).inspect(|()| self.doubt = None);
        }
        let other = self
            .doubt
            .as_mut()
            .and_then(|doubt| doubt.other.as_mut())
            .filter(|other| other.agreed.session == header.session);
        other.ok_or(Refused::Stale)?.receive(now, header, datagram, counters)?;
        // the server has the new keys, and said nothing by the old ones
        if let Some(other) = self.doubt.take().and_then(|doubt| doubt.other) {
            self.end(now, Closed::ByPeer);
            self.connect(other);
        }
        Ok(())
    }

    fn connect(&mut self, session: Box<Session>) {
        self.stage = Stage::Connected(session);
        self.counters.opened += 1;
        self.events.push_back((LinkEvent::Opened, Vec::new()));
    }

    fn take_welcome(&mut self, now: Duration, header: &Header, datagram: &[u8]) -> Result<(), Refused> {
        let reply = Reply::read(datagram, &self.handshake)?;
        let question = self
            .question()
            .filter(|question| question.answering && question.hello.nonce == reply.nonce)
            .ok_or(Refused::Stale)?;
        let facet_nonce = question.hello.nonce;
        let FacetSettings { facet, server, timing, numbering } = self.settings;
        let agreed = Agreement { session: header.session, facet, facet_nonce, server_nonce: reply.value };
        let mut session = Session::new(now, &self.shared, agreed, Side::Facet, server, timing, numbering);
        session.live = true;
        session.ping();
        match &mut self.doubt {
            Some(doubt) => doubt.other = Some(Box::new(session)),
            None => self.connect(Box::new(session)),
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

    fn look(&mut self, now: Duration) {
        self.doubt = None;
        self.stage = Stage::Looking(Question::new(now, &self.settings, &mut self.entropy, 0));
    }
}

impl Question {
    /// With a fresh nonce. An answer that leads nowhere for a second is given up: the server may have been started again meanwhile.
    fn new(now: Duration, settings: &FacetSettings, entropy: &mut Entropy, doubted: u32) -> Question {
        let hello = Hello { nonce: entropy.next_bytes(), facet: settings.facet, cookie: [0; 32], doubted };
        Question { hello, answering: false, next: now, give_up: now + 10 * settings.timing.ask }
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
            self.next = now + settings.timing.ask;
            let mut datagram = Vec::new();
            self.hello.write(if self.answering { Kind::Answer } else { Kind::Hello }, handshake, &mut datagram);
            counters.bytes_out += datagram.len() as u64;
            emit(settings.server, &datagram);
        }
    }
}

/// When a session is doubted, if nothing comes before.
fn doubted_from(session: &Session, settings: &FacetSettings) -> Duration {
    session.heard() + DOUBT_PINGS * settings.timing.ping
}
