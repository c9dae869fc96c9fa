//! A facet's end of shared memory.

use super::order::{Memory, Order};
use super::ports::{Ports, Received};
use super::wire::{HEAD, Head, Kind};
use super::{ASK, PING, SILENCE, draw};
use crate::sync::transport::{
    Closed, Delivery, FacetLink, FacetNumber, LinkCounters, LinkError, LinkEvent, MAX_FACETS, MAX_MESSAGE_BYTES,
    Message,
};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Pieces remembered for a server that missed them: at least one longest message.
const MEMORY: usize = 2048;

/// How far the connection is.
enum Stage {
    /// Asks, anew at the given time.
    Looking { next: Duration },
    /// Knows its server's number.
    Connected { reign: u64, order: Order, heard: Duration, sent: Duration },
}

/// What waits for the user.
enum Waiting {
    Event(LinkEvent),
    Message(Delivery, Message),
}

/// A facet's end of shared memory.
pub struct ShmFacet {
    run: String,
    facet: FacetNumber,
    ports: Option<Ports>,
    start: Instant,
    connection: u64,
    stage: Stage,
    memory: Memory,
    waiting: VecDeque<Waiting>,
    counters: LinkCounters,
    silence: Duration,
}

impl ShmFacet {
    /// Begins to look for the server of run `run`.
    ///
    /// Errors: the facet's number is too large; iceoryx2 or the system refuses.
    pub fn new(run: &str, facet: FacetNumber) -> Result<ShmFacet, LinkError> {
        if usize::from(facet) >= MAX_FACETS {
            return Err(LinkError::Other(format!("facet {facet}: the largest number is {}", MAX_FACETS - 1)));
        }
        Ok(ShmFacet {
            run: run.into(),
            facet,
            ports: Ports::join(run)?,
            start: Instant::now(),
            connection: draw()?,
            stage: Stage::Looking { next: Duration::ZERO },
            memory: Memory::default(),
            waiting: VecDeque::new(),
            counters: LinkCounters::default(),
            silence: SILENCE,
        })
    }

    /// A server of which nothing was heard for so long is given up, in place of [`SILENCE`].
    pub fn silent_after(mut self, silence: Duration) -> ShmFacet {
        self.silence = silence;
        self
    }

    fn head(&self, kind: Kind) -> Head {
        let (reign, until) = match &self.stage {
            Stage::Looking { .. } => (0, 0),
            Stage::Connected { reign, order, .. } => (*reign, order.next()),
        };
        Head { facet: self.facet, connection: self.connection, until, ..Head::new(kind, reign) }
    }

    fn tell(&mut self, head: Head, data: &[u8]) -> Result<(), LinkError> {
        let Some(ports) = &self.ports else { return Ok(()) };
        ports.publish(head.words(), data)?;
        let rings = !head.more;
        self.counters.bytes_out += (HEAD + data.len()) as u64;
        let now = self.start.elapsed();
        if let Stage::Connected { sent, .. } = &mut self.stage {
            *sent = now;
        }
        if rings {
            ports.bell().answer(!matches!(head.kind, Kind::Piece | Kind::Ping));
        }
        Ok(())
    }

    fn take_all(&mut self) -> Result<(), LinkError> {
        let Some(ports) = self.ports.take() else { return Ok(()) };
        let mut again = Vec::new();
        let result = loop {
            match ports.receive() {
                Ok(Some(sample)) => again.extend(self.take(&ports, sample)),
                Ok(None) => break Ok(()),
                Err(why) => break Err(why),
            }
        };
        self.ports = Some(ports);
        result?;
        for head in again {
            self.send_again(&head)?;
        }
        Ok(())
    }

    /// Takes a sample; what is asked for again comes back.
    fn take(&mut self, ports: &Ports, sample: Received) -> Option<Head> {
        let now = self.start.elapsed();
        let head = match Head::parse(sample.head()) {
            Ok(head) => head,
            Err(why) => {
                self.counters.refuse(why);
                return None;
            }
        };
        let for_me = head.facet == self.facet && head.connection == self.connection;
        if let Stage::Looking { .. } = self.stage {
            if head.kind == Kind::Welcome && for_me {
                self.stage =
                    Stage::Connected { reign: head.reign, order: Order::new(head.number), heard: now, sent: now };
                self.counters.opened += 1;
                self.waiting.push_back(Waiting::Event(LinkEvent::Opened));
            }
            return None;
        }
        let Stage::Connected { reign, order, heard, .. } = &mut self.stage else { return None };
        if *reign != head.reign {
            // Another server took the run over.
            self.end(Closed::ByPeer);
            return None;
        }
        *heard = now;
        match head.kind {
            Kind::Piece => {
                let mine = head.mask >> self.facet & 1 == 1;
                self.counters.bytes_in += if mine { (HEAD + sample.as_ref().len()) as u64 } else { 0 };
                // What is repeated for another facet says nothing to this one, even where it misses the same number.
                let repeated_for_another = head.connection != 0 && !for_me;
                let (waiting, superseded) = (&mut self.waiting, &mut self.counters.superseded);
                let deliver = |delivery, message| *superseded += queue(waiting, delivery, message);
                let data = if mine && !repeated_for_another { ports.lend(sample) } else { Message::default() };
                let taken = match (repeated_for_another, head.skip) {
                    (true, _) => Ok(()),
                    (false, true) => order.skip(head.number, head.until, deliver),
                    (false, false) => order.take(&head, mine, data, deliver),
                };
                if taken.is_err() {
                    self.end(Closed::Overrun);
                }
            }
            Kind::Again if for_me => return Some(head),
            Kind::Close if for_me => self.end(Closed::ByPeer),
            _ => {}
        }
        None
    }

    fn send_again(&mut self, asked: &Head) -> Result<(), LinkError> {
        let Some(pieces) = self.memory.again(asked) else {
            self.end(Closed::Overrun);
            return Ok(());
        };
        let base = self.head(Kind::Piece);
        let pieces: Vec<(Head, Vec<u8>)> = pieces
            .map(|(number, kept)| (Head { newest: kept.newest, more: kept.more, number, ..base }, kept.data.clone()))
            .collect();
        for (head, data) in pieces {
            self.counters.repeated += 1;
            self.tell(head, &data)?;
        }
        Ok(())
    }

    /// Asks for the server, or again for what is missing; pings; finds silence.
    fn keep_house(&mut self) -> Result<(), LinkError> {
        let now = self.start.elapsed();
        match &mut self.stage {
            Stage::Looking { next } if now >= *next => {
                *next = now + ASK;
                match &mut self.ports {
                    Some(ports) => ports.look_for_bell(&self.run)?,
                    none => *none = Ports::join(&self.run)?,
                }
                let hello = self.head(Kind::Hello);
                self.tell(hello, &[])?;
            }
            Stage::Looking { .. } => {}
            Stage::Connected { order, heard, sent, .. } => {
                if now >= *heard + self.silence {
                    self.end(Closed::Silent);
                    // The services may be those of a server that was killed: join anew.
                    self.ports = None;
                } else if let Some((number, until)) = order.ask(now) {
                    let head = Head { number, until, ..self.head(Kind::Again) };
                    self.tell(head, &[])?;
                } else if now >= *sent + PING.min(self.silence / 4) {
                    let ping = self.head(Kind::Ping);
                    self.tell(ping, &[])?;
                }
            }
        }
        Ok(())
    }

    fn end(&mut self, why: Closed) {
        if let Stage::Connected { .. } = self.stage {
            self.stage = Stage::Looking { next: self.start.elapsed() };
            self.connection = self.connection.wrapping_add(1);
            self.memory = Memory::default();
            if why == Closed::ByUs {
                self.waiting.retain(|what| matches!(what, Waiting::Event(_)));
            }
            self.waiting.push_back(Waiting::Event(LinkEvent::Closed(why)));
        }
    }

    fn next_event(&mut self, message: &mut Message) -> Option<LinkEvent> {
        match self.waiting.pop_front()? {
            Waiting::Event(event) => Some(event),
            Waiting::Message(_, bytes) => {
                *message = bytes;
                self.counters.messages_in += 1;
                Some(LinkEvent::Message)
            }
        }
    }
}

/// A newest message that still waits is replaced; how many were.
fn queue(waiting: &mut VecDeque<Waiting>, delivery: Delivery, message: Message) -> u64 {
    let before = waiting.len();
    if delivery == Delivery::Newest {
        waiting.retain(|what| !matches!(what, Waiting::Message(Delivery::Newest, _)));
    }
    let replaced = before - waiting.len();
    waiting.push_back(Waiting::Message(delivery, message));
    replaced as u64
}

impl FacetLink for ShmFacet {
    fn send(&mut self, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        let fits = (1..=MAX_MESSAGE_BYTES).contains(&message.len());
        let (Stage::Connected { .. }, true, Some(ports)) = (&self.stage, fits, &self.ports) else {
            self.counters.unsent += 1;
            return Ok(false);
        };
        let mut chunks = message.chunks(ports.piece_bytes()).peekable();
        let newest = delivery == Delivery::Newest;
        while let Some(chunk) = chunks.next() {
            let more = chunks.peek().is_some();
            let head = Head { newest, more, number: self.memory.next(), ..self.head(Kind::Piece) };
            self.tell(head, chunk)?;
            self.memory.keep(0, newest, more, chunk);
        }
        self.memory.trim(MEMORY);
        self.counters.messages_out += 1;
        Ok(true)
    }

    fn recv(&mut self, timeout: Duration, message: &mut Message) -> Result<Option<LinkEvent>, LinkError> {
        let buffer = message.clear();
        if let Stage::Connected { order, .. } = &mut self.stage {
            order.lend(buffer);
        }
        let end = self.start.elapsed() + timeout;
        loop {
            if let Some(event) = self.next_event(message) {
                return Ok(Some(event));
            }
            let seen = self.ports.as_ref().map_or(0, |ports| ports.bell().rung());
            self.take_all()?;
            self.keep_house()?;
            if let Some(event) = self.next_event(message) {
                return Ok(Some(event));
            }
            let left = end.saturating_sub(self.start.elapsed());
            if left.is_zero() {
                return Ok(None);
            }
            let gap = matches!(&self.stage, Stage::Connected { order, .. } if order.has_gap());
            let wait = left.min(if gap { Duration::from_millis(2) } else { ASK });
            match &self.ports {
                Some(ports) => ports.bell().wait_for_ring(seen, wait)?,
                None => std::thread::sleep(wait),
            }
        }
    }

    fn close(&mut self) {
        if let Stage::Connected { .. } = self.stage {
            let close = self.head(Kind::Close);
            // A server that does not hear it finds the silence.
            let _ = self.tell(close, &[]);
            self.end(Closed::ByUs);
        }
    }

    fn counters(&self) -> LinkCounters {
        self.counters
    }
}

impl Drop for ShmFacet {
    fn drop(&mut self) {
        self.close();
    }
}
