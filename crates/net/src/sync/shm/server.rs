//! The server's end of shared memory.

use super::order::{Again, Memory, Order};
use super::ports::{Ports, Received};
use super::wire::{HEAD, Head, Kind};
use super::{PING, SILENCE, draw};
use crate::sync::transport::{
    Closed, Delivery, FacetNumber, LinkCounters, LinkError, LinkEvent, MAX_FACETS, MAX_MESSAGE_BYTES, Refused,
    ServerLink,
};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Pieces remembered for those who missed them.
const MEMORY: usize = 16_384;

/// How long the server sleeps while a piece is missing, before it asks for it again.
const GAP: Duration = Duration::from_millis(2);

/// A facet that is connected.
struct Connection {
    number: u64,
    order: Order,
    /// The first piece it has not taken.
    taken: u64,
    heard: Duration,
    /// It was sent something since its last message.
    owes: bool,
}

/// What waits for the user.
enum Waiting {
    Event(LinkEvent),
    Message(Delivery, Vec<u8>),
}

/// The server's end of shared memory.
pub struct ShmServer {
    ports: Ports,
    reign: u64,
    start: Instant,
    connections: Vec<Option<Connection>>,
    memory: Memory,
    waiting: VecDeque<(FacetNumber, Waiting)>,
    counters: Vec<LinkCounters>,
    strangers: LinkCounters,
    sent: Duration,
    silence: Duration,
}

impl ShmServer {
    /// Begins run `run` for facets with numbers below `facets`.
    ///
    /// Errors: iceoryx2 or the system refuses; the message names the service or the folder.
    pub fn new(run: &str, facets: FacetNumber) -> Result<ShmServer, LinkError> {
        let facets = facets.min(MAX_FACETS as FacetNumber);
        let count = usize::from(facets);
        Ok(ShmServer {
            ports: Ports::serve(run, facets)?,
            reign: draw()?,
            start: Instant::now(),
            connections: (0..count).map(|_| None).collect(),
            memory: Memory::default(),
            waiting: VecDeque::new(),
            counters: vec![LinkCounters::default(); count],
            strangers: LinkCounters::default(),
            sent: Duration::ZERO,
            silence: SILENCE,
        })
    }

    /// A facet of which nothing was heard for so long is given up, in place of [`SILENCE`]. While it draws it says nothing: give it more than a picture takes.
    pub fn silent_after(mut self, silence: Duration) -> ShmServer {
        self.silence = silence;
        self
    }

    fn mask_of(&self, to: &[FacetNumber]) -> u64 {
        let connected = |facet: &&FacetNumber| self.connections.get(usize::from(**facet)).is_some_and(Option::is_some);
        to.iter().filter(connected).fold(0, |mask, facet| mask | 1 << facet)
    }

    /// Writes once for all; wakes everyone; then remembers, which is not what anyone waits for.
    fn publish(&mut self, mask: u64, delivery: Delivery, message: &[u8]) -> Result<(), LinkError> {
        let mut chunks = message.chunks(self.ports.piece_bytes()).peekable();
        let newest = delivery == Delivery::Newest;
        while let Some(chunk) = chunks.next() {
            let more = chunks.peek().is_some();
            let head = Head { newest, more, mask, number: self.memory.next(), ..Head::new(Kind::Piece, self.reign) };
            self.ports.publish(head.words(), chunk)?;
            if !more {
                self.ports.bell().ring();
            }
            for counters in of_mask(&mut self.counters, mask) {
                counters.bytes_out += (HEAD + chunk.len()) as u64;
            }
            self.memory.keep(mask, newest, more, chunk);
        }
        let here = self.connections.iter_mut().enumerate().filter(|(k, _)| mask >> k & 1 == 1);
        here.filter_map(|(_, connection)| connection.as_mut()).for_each(|connection| connection.owes = true);
        self.sent = self.start.elapsed();
        let first = self.memory.trim(MEMORY);
        self.end_all(Closed::Overrun, |connection| connection.taken < first);
        Ok(())
    }

    fn tell(&mut self, head: Head) -> Result<(), LinkError> {
        self.sent = self.start.elapsed();
        self.ports.publish(head.words(), &[])?;
        self.ports.bell().ring();
        Ok(())
    }

    fn take_all(&mut self) -> Result<(), LinkError> {
        while let Some(sample) = self.ports.receive()? {
            self.take(&sample)?;
        }
        Ok(())
    }

    fn take(&mut self, sample: &Received) -> Result<(), LinkError> {
        let data = sample.as_ref();
        let head = match Head::parse(sample.head()) {
            Ok(head) => head,
            Err(why) => {
                self.strangers.refuse(why);
                return Ok(());
            }
        };
        let facet = usize::from(head.facet);
        if facet >= self.connections.len() {
            self.strangers.refuse(Refused::Stranger);
            return Ok(());
        }
        self.counters[facet].bytes_in += (HEAD + data.len()) as u64;
        if head.kind == Kind::Hello {
            return self.welcome(&head);
        }
        let now = self.start.elapsed();
        let known = |connection: &&mut Connection| connection.number == head.connection && head.reign == self.reign;
        let Some(connection) = self.connections[facet].as_mut().filter(known) else {
            self.counters[facet].refuse(Refused::Stale);
            // One that was stopped for long and goes on: it does not know yet that it was given up.
            return self.tell(Head {
                facet: head.facet,
                connection: head.connection,
                ..Head::new(Kind::Close, self.reign)
            });
        };
        connection.heard = now;
        if head.until > self.memory.next() {
            self.counters[facet].refuse(Refused::Torn);
            return Ok(());
        }
        match head.kind {
            Kind::Piece => {
                connection.taken = connection.taken.max(head.until);
                connection.owes &= head.more;
                let waiting = &mut self.waiting;
                let taken = connection.order.take(&head, true, data.to_vec().into(), |delivery, message| {
                    queue(waiting, head.facet, delivery, message.into_vec())
                });
                if taken.is_err() {
                    self.end(head.facet, Closed::Overrun);
                }
            }
            Kind::Ping => connection.taken = connection.taken.max(head.until),
            Kind::Again => self.send_again(&head)?,
            Kind::Close => self.end(head.facet, Closed::ByPeer),
            Kind::Hello | Kind::Welcome => self.counters[facet].refuse(Refused::Foreign),
        }
        Ok(())
    }

    fn welcome(&mut self, hello: &Head) -> Result<(), LinkError> {
        let facet = usize::from(hello.facet);
        let next = self.memory.next();
        let same = self.connections[facet].as_ref().is_some_and(|connection| connection.number == hello.connection);
        if !same {
            self.end(hello.facet, Closed::Replaced);
            let connection = Connection {
                number: hello.connection,
                order: Order::new(0),
                taken: next,
                heard: self.start.elapsed(),
                owes: false,
            };
            self.connections[facet] = Some(connection);
            self.counters[facet].opened += 1;
            self.waiting.push_back((hello.facet, Waiting::Event(LinkEvent::Opened)));
        }
        let number = self.connections[facet].as_ref().map_or(next, |connection| connection.taken);
        self.tell(Head {
            facet: hello.facet,
            connection: hello.connection,
            number,
            ..Head::new(Kind::Welcome, self.reign)
        })
    }

    /// Sends again what a slow facet missed and still wants; of the rest, that there is nothing.
    fn send_again(&mut self, asked: &Head) -> Result<(), LinkError> {
        let bit = 1 << asked.facet;
        let Some(again) = self.memory.again_to(asked, bit) else {
            self.end(asked.facet, Closed::Overrun);
            return Ok(());
        };
        let base =
            Head { facet: asked.facet, connection: asked.connection, mask: bit, ..Head::new(Kind::Piece, self.reign) };
        let counters = &mut self.counters[usize::from(asked.facet)];
        for again in again {
            let (head, data) = match again {
                Again::Piece(number, kept) => {
                    (Head { newest: kept.newest, more: kept.more, number, ..base }, &kept.data[..])
                }
                Again::Nothing(number, until) => (Head { skip: true, number, until, ..base }, &[][..]),
            };
            self.ports.publish(head.words(), data)?;
            counters.repeated += u64::from(!head.skip);
            counters.bytes_out += (HEAD + data.len()) as u64;
        }
        self.ports.bell().ring();
        Ok(())
    }

    /// Pings, asks again, forgets what all have, and finds who is silent.
    fn keep_house(&mut self) -> Result<(), LinkError> {
        let now = self.start.elapsed();
        for facet in 0..self.connections.len() {
            let Some(connection) = &mut self.connections[facet] else { continue };
            if let Some((number, until)) = connection.order.ask(now) {
                let head = Head {
                    facet: facet as u16,
                    connection: connection.number,
                    number,
                    until,
                    ..Head::new(Kind::Again, self.reign)
                };
                self.tell(head)?;
            }
        }
        let silence = self.silence;
        if now >= self.sent + PING.min(silence / 4) {
            self.tell(Head::new(Kind::Ping, self.reign))?;
        }
        let next = self.memory.next();
        let taken = self.connections.iter().flatten().map(|connection| connection.taken).min().unwrap_or(next);
        self.memory.forget_before(taken);
        if self.end_all(Closed::Silent, |connection| now >= connection.heard + silence) {
            self.ports.clean_up();
        }
        Ok(())
    }

    fn end_all(&mut self, why: Closed, is_over: impl Fn(&Connection) -> bool) -> bool {
        let over: Vec<u16> = (0..self.connections.len() as u16)
            .filter(|k| self.connections[usize::from(*k)].as_ref().is_some_and(&is_over))
            .collect();
        over.iter().for_each(|facet| self.end(*facet, why));
        !over.is_empty()
    }

    /// What had arrived is told before, unless this side closes.
    fn end(&mut self, facet: FacetNumber, why: Closed) {
        if self.connections[usize::from(facet)].take().is_some() {
            if why == Closed::ByUs {
                self.waiting.retain(|(of, what)| *of != facet || matches!(what, Waiting::Event(_)));
            }
            self.waiting.push_back((facet, Waiting::Event(LinkEvent::Closed(why))));
        }
    }
}

fn of_mask(counters: &mut [LinkCounters], mask: u64) -> impl Iterator<Item = &mut LinkCounters> {
    counters.iter_mut().enumerate().filter(move |(facet, _)| mask >> facet & 1 == 1).map(|(_, counters)| counters)
}

/// A newest message that still waits is replaced.
fn queue(waiting: &mut VecDeque<(FacetNumber, Waiting)>, facet: FacetNumber, delivery: Delivery, message: Vec<u8>) {
    if delivery == Delivery::Newest {
        waiting.retain(|(of, what)| *of != facet || !matches!(what, Waiting::Message(Delivery::Newest, _)));
    }
    waiting.push_back((facet, Waiting::Message(delivery, message)));
}

impl ServerLink for ShmServer {
    fn send(&mut self, to: FacetNumber, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        Ok(self.send_all(&[to], delivery, message)? == 1)
    }

    fn send_all(&mut self, to: &[FacetNumber], delivery: Delivery, message: &[u8]) -> Result<usize, LinkError> {
        let fits = (1..=MAX_MESSAGE_BYTES).contains(&message.len());
        let mask = if fits { self.mask_of(to) } else { 0 };
        for facet in to {
            if let Some(counters) = self.counters.get_mut(usize::from(*facet)) {
                let sent = mask >> facet & 1;
                counters.messages_out += sent;
                counters.unsent += 1 - sent;
            }
        }
        if mask != 0 {
            self.publish(mask, delivery, message)?;
        }
        Ok(mask.count_ones() as usize)
    }

    fn recv(
        &mut self,
        timeout: Duration,
        message: &mut Vec<u8>,
    ) -> Result<Option<(FacetNumber, LinkEvent)>, LinkError> {
        message.clear();
        let end = self.start.elapsed() + timeout;
        loop {
            let seen = self.ports.bell().answers();
            if self.waiting.is_empty() {
                self.take_all()?;
                self.keep_house()?;
            }
            match self.waiting.pop_front() {
                Some((facet, Waiting::Event(event))) => return Ok(Some((facet, event))),
                Some((facet, Waiting::Message(_, bytes))) => {
                    *message = bytes;
                    self.counters[usize::from(facet)].messages_in += 1;
                    return Ok(Some((facet, LinkEvent::Message)));
                }
                None => {}
            }
            let left = end.saturating_sub(self.start.elapsed());
            if left.is_zero() {
                return Ok(None);
            }
            let owed = self.connections.iter().flatten().filter(|connection| connection.owes).count() as u32;
            let gap = self.connections.iter().flatten().any(|connection| connection.order.has_gap());
            let most = if gap { GAP } else { PING / 4 };
            self.ports.bell().wait_for_answers(seen, owed, left.min(most))?;
        }
    }

    fn close(&mut self, facet: FacetNumber) {
        let Some(connection) = self.connections.get(usize::from(facet)).and_then(Option::as_ref) else { return };
        // A facet that does not hear it finds the silence.
        let _ = self.tell(Head { facet, connection: connection.number, ..Head::new(Kind::Close, self.reign) });
        self.end(facet, Closed::ByUs);
    }

    fn counters(&self, facet: FacetNumber) -> LinkCounters {
        self.counters.get(usize::from(facet)).copied().unwrap_or_default()
    }

    fn strangers(&self) -> LinkCounters {
        self.strangers
    }
}

impl Drop for ShmServer {
    fn drop(&mut self) {
        (0..self.connections.len() as u16).for_each(|facet| self.close(facet));
        self.ports.clean_up();
    }
}
