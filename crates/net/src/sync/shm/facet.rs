//! A facet's endpoint in shared memory.

use super::ports::{Ports, Received};
use super::reassembly::{Reassembly, SendHistory};
use super::wire::{HEADER_BYTES, SampleHeader, SampleKind};
use super::{CONNECT_INTERVAL, IDLE_TIMEOUT, PING_INTERVAL, random_id};
use crate::sync::transport::{
    Closed, Delivery, FacetLink, FacetNumber, LinkCounters, LinkError, LinkEvent, MAX_FACETS, MAX_MESSAGE_BYTES,
    Message,
};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Number of pieces kept for resending, enough for one message of maximum length.
const HISTORY_PIECES: usize = 2048;

/// State of the connection.
enum ConnectionState {
    /// Sends Hello again at the given time.
    Connecting { next: Duration },
    /// Connected to the server process with this id.
    Connected { server_id: u64, reassembly: Reassembly, last_received: Duration, sent: Duration },
}

/// Event or message that waits for the caller.
enum Queued {
    Event(LinkEvent),
    Message(Delivery, Message),
}

/// A facet's endpoint in shared memory.
pub struct ShmFacet {
    run: String,
    facet: FacetNumber,
    ports: Option<Ports>,
    start: Instant,
    connection: u64,
    state: ConnectionState,
    history: SendHistory,
    queued: VecDeque<Queued>,
    counters: LinkCounters,
    idle_timeout: Duration,
}

impl ShmFacet {
    /// Starts to connect to the server of run `run`.
    ///
    /// # Errors
    /// The facet's number is too large; iceoryx2 or the system refuses.
    pub fn new(run: &str, facet: FacetNumber) -> Result<ShmFacet, LinkError> {
        if usize::from(facet) >= MAX_FACETS {
            return Err(LinkError::Other(format!("facet {facet}: the largest number is {}", MAX_FACETS - 1)));
        }
        Ok(ShmFacet {
            run: run.into(),
            facet,
            ports: Ports::join(run)?,
            start: Instant::now(),
            connection: random_id()?,
            state: ConnectionState::Connecting { next: Duration::ZERO },
            history: SendHistory::default(),
            queued: VecDeque::new(),
            counters: LinkCounters::default(),
            idle_timeout: IDLE_TIMEOUT,
        })
    }

    /// Sets the time without any message after which the server is given up, instead of
    /// [`IDLE_TIMEOUT`].
    pub fn with_idle_timeout(mut self, idle_timeout: Duration) -> ShmFacet {
        self.idle_timeout = idle_timeout;
        self
    }

    fn header(&self, kind: SampleKind) -> SampleHeader {
        let (server_id, until) = match &self.state {
            ConnectionState::Connecting { .. } => (0, 0),
            ConnectionState::Connected { server_id, reassembly, .. } => (*server_id, reassembly.next()),
        };
        SampleHeader { facet: self.facet, connection: self.connection, until, ..SampleHeader::new(kind, server_id) }
    }

    fn send_control(&mut self, header: SampleHeader, data: &[u8]) -> Result<(), LinkError> {
        let Some(ports) = &self.ports else { return Ok(()) };
        ports.publish(header.words(), data)?;
        let rings = !header.more;
        self.counters.bytes_out += (HEADER_BYTES + data.len()) as u64;
        let now = self.start.elapsed();
        if let ConnectionState::Connected { sent, .. } = &mut self.state {
            *sent = now;
        }
        if rings {
            ports.wakeup().notify_server(!matches!(header.kind, SampleKind::Piece | SampleKind::Ping));
        }
        Ok(())
    }

    fn take_all(&mut self) -> Result<(), LinkError> {
        let Some(ports) = self.ports.take() else { return Ok(()) };
        let mut resend = Vec::new();
        let result = loop {
            match ports.receive() {
                Ok(Some(sample)) => resend.extend(self.take(&ports, sample)),
                Ok(None) => break Ok(()),
                Err(why) => break Err(why),
            }
        };
        self.ports = Some(ports);
        result?;
        for header in resend {
            self.send_missing(&header)?;
        }
        Ok(())
    }

    /// Processes a sample. Returns the header of a resend request.
    fn take(&mut self, ports: &Ports, sample: Received) -> Option<SampleHeader> {
        let now = self.start.elapsed();
        let header = match SampleHeader::parse(sample.header()) {
            Ok(header) => header,
            Err(why) => {
                self.counters.refuse(why);
                return None;
            }
        };
        let for_me = header.facet == self.facet && header.connection == self.connection;
        if let ConnectionState::Connecting { .. } = self.state {
            if header.kind == SampleKind::Welcome && for_me {
                self.state = ConnectionState::Connected {
                    server_id: header.server_id,
                    reassembly: Reassembly::new(header.number),
                    last_received: now,
                    sent: now,
                };
                self.counters.opened += 1;
                self.queued.push_back(Queued::Event(LinkEvent::Opened));
            }
            return None;
        }
        let ConnectionState::Connected { server_id, reassembly, last_received, .. } = &mut self.state else {
            return None;
        };
        if *server_id != header.server_id {
            // another server has taken over the run
            self.end(Closed::ByPeer);
            return None;
        }
        *last_received = now;
        match header.kind {
            SampleKind::Piece => {
                let mine = header.mask >> self.facet & 1 == 1;
                self.counters.bytes_in += if mine { (HEADER_BYTES + sample.as_ref().len()) as u64 } else { 0 };
                // a piece repeated for another facet has no meaning here, even if this facet misses
                // the same number
                let repeated_for_another = header.connection != 0 && !for_me;
                let (queued, superseded) = (&mut self.queued, &mut self.counters.superseded);
                let deliver = |delivery, message| *superseded += queue(queued, delivery, message);
                let data = if mine && !repeated_for_another { ports.loan(sample) } else { Message::default() };
                let taken = match (repeated_for_another, header.skip) {
                    (true, _) => Ok(()),
                    (false, true) => reassembly.skip(header.number, header.until, deliver),
                    (false, false) => reassembly.take(&header, mine, data, deliver),
                };
                if taken.is_err() {
                    self.end(Closed::Overrun);
                }
            }
            SampleKind::ResendRequest if for_me => return Some(header),
            SampleKind::Close if for_me => self.end(Closed::ByPeer),
            _ => {}
        }
        None
    }

    fn send_missing(&mut self, asked: &SampleHeader) -> Result<(), LinkError> {
        let Some(pieces) = self.history.resend(asked) else {
            self.end(Closed::Overrun);
            return Ok(());
        };
        let base = self.header(SampleKind::Piece);
        let pieces: Vec<(SampleHeader, Vec<u8>)> = pieces
            .map(|(number, sent_piece)| {
                (
                    SampleHeader { newest: sent_piece.newest, more: sent_piece.more, number, ..base },
                    sent_piece.data.clone(),
                )
            })
            .collect();
        for (header, data) in pieces {
            self.counters.repeated += 1;
            self.send_control(header, &data)?;
        }
        Ok(())
    }

    /// Connects, requests missing pieces, pings and checks the idle timeout.
    fn maintain(&mut self) -> Result<(), LinkError> {
        let now = self.start.elapsed();
        match &mut self.state {
            ConnectionState::Connecting { next } if now >= *next => {
                *next = now + CONNECT_INTERVAL;
                match &mut self.ports {
                    Some(ports) => ports.reopen_wakeup(&self.run)?,
                    none => *none = Ports::join(&self.run)?,
                }
                let hello = self.header(SampleKind::Hello);
                self.send_control(hello, &[])?;
            }
            ConnectionState::Connecting { .. } => {}
            ConnectionState::Connected { reassembly, last_received, sent, .. } => {
                if now >= *last_received + self.idle_timeout {
                    self.end(Closed::TimedOut);
                    // the services may be those of a killed server: open them again
                    self.ports = None;
                } else if let Some((number, until)) = reassembly.ask(now) {
                    let header = SampleHeader { number, until, ..self.header(SampleKind::ResendRequest) };
                    self.send_control(header, &[])?;
                } else if now >= *sent + PING_INTERVAL.min(self.idle_timeout / 4) {
                    let ping = self.header(SampleKind::Ping);
                    self.send_control(ping, &[])?;
                }
            }
        }
        Ok(())
    }

    fn end(&mut self, why: Closed) {
        if let ConnectionState::Connected { .. } = self.state {
            self.state = ConnectionState::Connecting { next: self.start.elapsed() };
            self.connection = self.connection.wrapping_add(1);
            self.history = SendHistory::default();
            if why == Closed::ByUs {
                self.queued.retain(|what| matches!(what, Queued::Event(_)));
            }
            self.queued.push_back(Queued::Event(LinkEvent::Closed(why)));
        }
    }

    fn next_event(&mut self, message: &mut Message) -> Option<LinkEvent> {
        match self.queued.pop_front()? {
            Queued::Event(event) => Some(event),
            Queued::Message(_, bytes) => {
                *message = bytes;
                self.counters.messages_in += 1;
                Some(LinkEvent::Message)
            }
        }
    }
}

/// Queues a message. A newest message replaces one that still waits; returns how many were
/// replaced.
fn queue(queued: &mut VecDeque<Queued>, delivery: Delivery, message: Message) -> u64 {
    let before = queued.len();
    if delivery == Delivery::Newest {
        queued.retain(|what| !matches!(what, Queued::Message(Delivery::Newest, _)));
    }
    let replaced = before - queued.len();
    queued.push_back(Queued::Message(delivery, message));
    replaced as u64
}

impl FacetLink for ShmFacet {
    fn send(&mut self, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        let fits = (1..=MAX_MESSAGE_BYTES).contains(&message.len());
        let (ConnectionState::Connected { .. }, true, Some(ports)) = (&self.state, fits, &self.ports) else {
            self.counters.unsent += 1;
            return Ok(false);
        };
        let mut chunks = message.chunks(ports.piece_bytes()).peekable();
        let newest = delivery == Delivery::Newest;
        while let Some(chunk) = chunks.next() {
            let more = chunks.peek().is_some();
            let header = SampleHeader { newest, more, number: self.history.next(), ..self.header(SampleKind::Piece) };
            self.send_control(header, chunk)?;
            self.history.keep(0, newest, more, chunk);
        }
        self.history.trim(HISTORY_PIECES);
        self.counters.messages_out += 1;
        Ok(true)
    }

    fn recv(&mut self, timeout: Duration, message: &mut Message) -> Result<Option<LinkEvent>, LinkError> {
        let buffer = message.clear();
        if let ConnectionState::Connected { reassembly, .. } = &mut self.state {
            reassembly.loan(buffer);
        }
        let end = self.start.elapsed() + timeout;
        loop {
            if let Some(event) = self.next_event(message) {
                return Ok(Some(event));
            }
            let seen = self.ports.as_ref().map_or(0, |ports| ports.wakeup().facet_notifications());
            self.take_all()?;
            self.maintain()?;
            if let Some(event) = self.next_event(message) {
                return Ok(Some(event));
            }
            let left = end.saturating_sub(self.start.elapsed());
            if left.is_zero() {
                return Ok(None);
            }
            let gap = matches!(&self.state, ConnectionState::Connected { reassembly, .. } if reassembly.has_gap());
            let wait = left.min(if gap { Duration::from_millis(2) } else { CONNECT_INTERVAL });
            match &self.ports {
                Some(ports) => ports.wakeup().wait_for_facet_notification(seen, wait)?,
                None => std::thread::sleep(wait),
            }
        }
    }

    fn close(&mut self) {
        if let ConnectionState::Connected { .. } = self.state {
            let close = self.header(SampleKind::Close);
            // if the server misses it, its idle timeout ends the connection
            let _ = self.send_control(close, &[]);
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
