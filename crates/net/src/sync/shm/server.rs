//! The server's endpoint in shared memory.

use super::ports::{Ports, Received};
use super::reassembly::{Reassembly, Resend, SendHistory};
use super::wire::{HEADER_BYTES, SampleHeader, SampleKind};
use super::{IDLE_TIMEOUT, PING_INTERVAL, random_id};
use crate::sync::transport::{
    Closed, Delivery, FacetNumber, LinkCounters, LinkError, LinkEvent, MAX_FACETS, MAX_MESSAGE_BYTES, Refused,
    ServerLink,
};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Number of pieces kept for resending.
const HISTORY_PIECES: usize = 16_384;

/// Wait of the server before it requests a missing piece.
const GAP_POLL: Duration = Duration::from_millis(2);

/// A connected facet.
struct Connection {
    number: u64,
    reassembly: Reassembly,
    /// First piece that the facet has not taken.
    taken: u64,
    last_received: Duration,
    /// Whether a message was sent to it since its last message.
    owes_reply: bool,
}

/// Event or message that waits for the caller.
enum Queued {
    Event(LinkEvent),
    Message(Delivery, Vec<u8>),
}

/// The server's endpoint in shared memory.
pub struct ShmServer {
    ports: Ports,
    server_id: u64,
    start: Instant,
    connections: Vec<Option<Connection>>,
    history: SendHistory,
    queued: VecDeque<(FacetNumber, Queued)>,
    counters: Vec<LinkCounters>,
    unknown_peers: LinkCounters,
    sent: Duration,
    idle_timeout: Duration,
}

impl ShmServer {
    /// Creates run `run` for facets with numbers below `facets`.
    ///
    /// # Errors
    /// iceoryx2 or the system refuses; the message names the service or the folder.
    pub fn new(run: &str, facets: FacetNumber) -> Result<ShmServer, LinkError> {
        let facets = facets.min(MAX_FACETS as FacetNumber);
        let count = usize::from(facets);
        Ok(ShmServer {
            ports: Ports::serve(run, facets)?,
            server_id: random_id()?,
            start: Instant::now(),
            connections: (0..count).map(|_| None).collect(),
            history: SendHistory::default(),
            queued: VecDeque::new(),
            counters: vec![LinkCounters::default(); count],
            unknown_peers: LinkCounters::default(),
            sent: Duration::ZERO,
            idle_timeout: IDLE_TIMEOUT,
        })
    }

    /// Sets the time without any message after which a facet is dropped, instead of
    /// [`IDLE_TIMEOUT`]. A facet sends nothing while it draws, so the time must exceed that of a
    /// picture.
    pub fn with_idle_timeout(mut self, idle_timeout: Duration) -> ShmServer {
        self.idle_timeout = idle_timeout;
        self
    }

    fn mask_of(&self, to: &[FacetNumber]) -> u64 {
        let connected = |facet: &&FacetNumber| self.connections.get(usize::from(**facet)).is_some_and(Option::is_some);
        to.iter().filter(connected).fold(0, |mask, facet| mask | 1 << facet)
    }

    /// Writes the message once for all receivers, wakes them, and then keeps it for resending,
    /// which no process waits for.
    fn publish(&mut self, mask: u64, delivery: Delivery, message: &[u8]) -> Result<(), LinkError> {
        let mut chunks = message.chunks(self.ports.piece_bytes()).peekable();
        let newest = delivery == Delivery::Newest;
        while let Some(chunk) = chunks.next() {
            let more = chunks.peek().is_some();
            let header = SampleHeader {
                newest,
                more,
                mask,
                number: self.history.next(),
                ..SampleHeader::new(SampleKind::Piece, self.server_id)
            };
            self.ports.publish(header.words(), chunk)?;
            if !more {
                self.ports.wakeup().notify_facets();
            }
            for counters in of_mask(&mut self.counters, mask) {
                counters.bytes_out += (HEADER_BYTES + chunk.len()) as u64;
            }
            self.history.keep(mask, newest, more, chunk);
        }
        let here = self.connections.iter_mut().enumerate().filter(|(k, _)| mask >> k & 1 == 1);
        here.filter_map(|(_, connection)| connection.as_mut()).for_each(|connection| connection.owes_reply = true);
        self.sent = self.start.elapsed();
        let first = self.history.trim(HISTORY_PIECES);
        self.end_all(Closed::Overrun, |connection| connection.taken < first);
        Ok(())
    }

    fn send_control(&mut self, header: SampleHeader) -> Result<(), LinkError> {
        self.sent = self.start.elapsed();
        self.ports.publish(header.words(), &[])?;
        self.ports.wakeup().notify_facets();
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
        let header = match SampleHeader::parse(sample.header()) {
            Ok(header) => header,
            Err(why) => {
                self.unknown_peers.refuse(why);
                return Ok(());
            }
        };
        let facet = usize::from(header.facet);
        if facet >= self.connections.len() {
            self.unknown_peers.refuse(Refused::UnknownPeer);
            return Ok(());
        }
        self.counters[facet].bytes_in += (HEADER_BYTES + data.len()) as u64;
        if header.kind == SampleKind::Hello {
            return self.welcome(&header);
        }
        let now = self.start.elapsed();
        let known =
            |connection: &&mut Connection| connection.number == header.connection && header.server_id == self.server_id;
        let Some(connection) = self.connections[facet].as_mut().filter(known) else {
            self.counters[facet].refuse(Refused::Stale);
            // a facet that was stopped and continues does not know that it was dropped
            return self.send_control(SampleHeader {
                facet: header.facet,
                connection: header.connection,
                ..SampleHeader::new(SampleKind::Close, self.server_id)
            });
        };
        connection.last_received = now;
        if header.until > self.history.next() {
            self.counters[facet].refuse(Refused::Torn);
            return Ok(());
        }
        match header.kind {
            SampleKind::Piece => {
                connection.taken = connection.taken.max(header.until);
                connection.owes_reply &= header.more;
                let queued = &mut self.queued;
                let taken = connection.reassembly.take(&header, true, data.to_vec().into(), |delivery, message| {
                    queue(queued, header.facet, delivery, message.into_vec())
                });
                if taken.is_err() {
                    self.end(header.facet, Closed::Overrun);
                }
            }
            SampleKind::Ping => connection.taken = connection.taken.max(header.until),
            SampleKind::ResendRequest => self.send_missing(&header)?,
            SampleKind::Close => self.end(header.facet, Closed::ByPeer),
            SampleKind::Hello | SampleKind::Welcome => self.counters[facet].refuse(Refused::Foreign),
        }
        Ok(())
    }

    fn welcome(&mut self, hello: &SampleHeader) -> Result<(), LinkError> {
        let facet = usize::from(hello.facet);
        let next = self.history.next();
        let same = self.connections[facet].as_ref().is_some_and(|connection| connection.number == hello.connection);
        if !same {
            self.end(hello.facet, Closed::Replaced);
            let connection = Connection {
                number: hello.connection,
                reassembly: Reassembly::new(0),
                taken: next,
                last_received: self.start.elapsed(),
                owes_reply: false,
            };
            self.connections[facet] = Some(connection);
            self.counters[facet].opened += 1;
            self.queued.push_back((hello.facet, Queued::Event(LinkEvent::Opened)));
        }
        let number = self.connections[facet].as_ref().map_or(next, |connection| connection.taken);
        self.send_control(SampleHeader {
            facet: hello.facet,
            connection: hello.connection,
            number,
            ..SampleHeader::new(SampleKind::Welcome, self.server_id)
        })
    }

    /// Resends the pieces that a slow facet missed and still needs, and skips for the rest.
    fn send_missing(&mut self, asked: &SampleHeader) -> Result<(), LinkError> {
        let bit = 1 << asked.facet;
        let Some(resend) = self.history.resend_to(asked, bit) else {
            self.end(asked.facet, Closed::Overrun);
            return Ok(());
        };
        let base = SampleHeader {
            facet: asked.facet,
            connection: asked.connection,
            mask: bit,
            ..SampleHeader::new(SampleKind::Piece, self.server_id)
        };
        let counters = &mut self.counters[usize::from(asked.facet)];
        for resend in resend {
            let (header, data) = match resend {
                Resend::Piece(number, sent_piece) => (
                    SampleHeader { newest: sent_piece.newest, more: sent_piece.more, number, ..base },
                    &sent_piece.data[..],
                ),
                Resend::Nothing(number, until) => (SampleHeader { skip: true, number, until, ..base }, &[][..]),
            };
            self.ports.publish(header.words(), data)?;
            counters.repeated += u64::from(!header.skip);
            counters.bytes_out += (HEADER_BYTES + data.len()) as u64;
        }
        self.ports.wakeup().notify_facets();
        Ok(())
    }

    /// Pings, requests missing pieces, forgets pieces that all facets have, and checks the idle
    /// timeouts.
    fn maintain(&mut self) -> Result<(), LinkError> {
        let now = self.start.elapsed();
        for facet in 0..self.connections.len() {
            let Some(connection) = &mut self.connections[facet] else { continue };
            if let Some((number, until)) = connection.reassembly.ask(now) {
                let header = SampleHeader {
                    facet: facet as u16,
                    connection: connection.number,
                    number,
                    until,
                    ..SampleHeader::new(SampleKind::ResendRequest, self.server_id)
                };
                self.send_control(header)?;
            }
        }
        let idle_timeout = self.idle_timeout;
        if now >= self.sent + PING_INTERVAL.min(idle_timeout / 4) {
            self.send_control(SampleHeader::new(SampleKind::Ping, self.server_id))?;
        }
        let next = self.history.next();
        let taken = self.connections.iter().flatten().map(|connection| connection.taken).min().unwrap_or(next);
        self.history.forget_before(taken);
        if self.end_all(Closed::TimedOut, |connection| now >= connection.last_received + idle_timeout) {
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

    /// Ends a connection. Received messages are reported first, unless this side closes.
    fn end(&mut self, facet: FacetNumber, why: Closed) {
        if self.connections[usize::from(facet)].take().is_some() {
            if why == Closed::ByUs {
                self.queued.retain(|(of, what)| *of != facet || matches!(what, Queued::Event(_)));
            }
            self.queued.push_back((facet, Queued::Event(LinkEvent::Closed(why))));
        }
    }
}

fn of_mask(counters: &mut [LinkCounters], mask: u64) -> impl Iterator<Item = &mut LinkCounters> {
    counters.iter_mut().enumerate().filter(move |(facet, _)| mask >> facet & 1 == 1).map(|(_, counters)| counters)
}

/// Queues a message. A newest message replaces one that still waits.
fn queue(queued: &mut VecDeque<(FacetNumber, Queued)>, facet: FacetNumber, delivery: Delivery, message: Vec<u8>) {
    if delivery == Delivery::Newest {
        queued.retain(|(of, what)| *of != facet || !matches!(what, Queued::Message(Delivery::Newest, _)));
    }
    queued.push_back((facet, Queued::Message(delivery, message)));
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
            let seen = self.ports.wakeup().server_notifications();
            if self.queued.is_empty() {
                self.take_all()?;
                self.maintain()?;
            }
            match self.queued.pop_front() {
                Some((facet, Queued::Event(event))) => return Ok(Some((facet, event))),
                Some((facet, Queued::Message(_, bytes))) => {
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
            let owed = self.connections.iter().flatten().filter(|connection| connection.owes_reply).count() as u32;
            let gap = self.connections.iter().flatten().any(|connection| connection.reassembly.has_gap());
            let most = if gap { GAP_POLL } else { PING_INTERVAL / 4 };
            self.ports.wakeup().wait_for_server_notifications(seen, owed, left.min(most))?;
        }
    }

    fn close(&mut self, facet: FacetNumber) {
        let Some(connection) = self.connections.get(usize::from(facet)).and_then(Option::as_ref) else { return };
        // if the facet misses it, its idle timeout ends the connection
        let _ = self.send_control(SampleHeader {
            facet,
            connection: connection.number,
            ..SampleHeader::new(SampleKind::Close, self.server_id)
        });
        self.end(facet, Closed::ByUs);
    }

    fn counters(&self, facet: FacetNumber) -> LinkCounters {
        self.counters.get(usize::from(facet)).copied().unwrap_or_default()
    }

    fn unknown_peers(&self) -> LinkCounters {
        self.unknown_peers
    }
}

impl Drop for ShmServer {
    fn drop(&mut self) {
        (0..self.connections.len() as u16).for_each(|facet| self.close(facet));
        self.ports.clean_up();
    }
}
