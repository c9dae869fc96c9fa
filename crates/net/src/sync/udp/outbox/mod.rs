//! Sending: splits messages into pieces of packets, and repairs losses after acknowledgements.
//!
//! A packet is lost if it is not acknowledged within `loss_delay` although a later one was, or not
//! within `timeout` at all:
//!
//! ```text
//! srtt   ← 7/8 srtt + 1/8 sample          var ← 3/4 var + 1/4 |srtt − sample|          (RFC 6298; smoothed round trip and its deviation)
//! loss_delay = srtt + max(2 var, 0.5 ms)
//! timeout    = srtt + min(4 var, 4 ms) + 1 ms              for the first two timeouts in a row
//!            = (srtt + 4 var + 1 ms) · 2^(k − 2)           for those after k, at most 250 ms
//! ```
//!
//! Lost pieces are sent again, twice if the budget allows. At a loss of 5 % a repair then fails
//! 0.25 % of the time, for 5 % more bytes; repairs of repairs make the longest delays. While more
//! than 0.5 % of packets are lost, a message of several fragments gets a parity fragment for each
//! four, and a message of one fragment is sent twice, if the budget allows. The budget bounds the
//! total number of bytes:
//!
//! ```text
//! budget += 1.5 · length of a message        budget −= length of each packet sent or received
//! ```
//!
//! Redundant packets are sent only while the budget covers them. Packets are declared lost after a
//! time instead of after a number of later packets, so that reordering is not mistaken for loss.

mod loss_detection;
mod stream;

use super::frames::{Channel, FRAGMENT_BYTES, Frame, MessageInfo, PARITY_HEADER_BYTES};
use super::inbox::parity;
use crate::sync::transport::MAX_QUEUED_BYTES;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;
use stream::Stream;

/// Maximum number of packets in flight: half of what the default buffer of a socket holds.
const MAX_PACKETS_IN_FLIGHT: usize = 64;
/// Fraction of lost packets above which redundancy is sent.
const REDUNDANCY_THRESHOLD: f64 = 0.005;
/// Bounds of the budget, bytes.
const MAX_BUDGET: i64 = 32 << 10;

/// Content of a packet.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Piece {
    Fragment(Channel, u32, u16),
    Parity(Channel, u32, u16),
    Ping,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum PacketStatus {
    InFlight,
    Lost,
    Acknowledged,
}

struct Sent {
    sequence: u64,
    at: Duration,
    pieces: Vec<Piece>,
    status: PacketStatus,
}

/// More data waits than allowed.
#[derive(Debug, PartialEq, Eq)]
pub struct QueueFull;

/// Messages of one connection on their way out.
pub struct Outbox {
    streams: [Stream; 2],
    sent: VecDeque<Sent>,
    in_flight: usize,
    repairs: VecDeque<Piece>,
    /// Second copies, each sent in its own packet.
    again: VecDeque<Piece>,
    ping: bool,
    srtt: Duration,
    var: Duration,
    measured: bool,
    timeouts: u32,
    largest: Option<u64>,
    loss: f64,
    budget: i64,
    repeated: u64,
    superseded: u64,
}

impl Outbox {
    /// Creates an empty outbox. Message numbers begin at `first`, which is 0 except in tests of the
    /// wrap.
    pub fn new(first: u32) -> Outbox {
        Outbox {
            streams: [(); 2].map(|()| Stream::new(first)),
            sent: VecDeque::new(),
            in_flight: 0,
            repairs: VecDeque::new(),
            again: VecDeque::new(),
            ping: false,
            srtt: Duration::from_millis(5),
            var: Duration::from_millis(5),
            measured: false,
            timeouts: 0,
            largest: None,
            loss: 0.0,
            budget: 0,
            repeated: 0,
            superseded: 0,
        }
    }

    /// Queues a message of 1 to [`MAX_MESSAGE_BYTES`](crate::sync::transport::MAX_MESSAGE_BYTES)
    /// bytes.
    ///
    /// # Errors
    /// [`QueueFull`].
    pub fn push(&mut self, channel: Channel, message: Arc<[u8]>) -> Result<(), QueueFull> {
        self.credit(message.len() * 3 / 2);
        let stream = &mut self.streams[channel as usize];
        if channel == Channel::Newest {
            self.superseded += stream.waiting.len() as u64;
            stream.waiting.clear();
            stream.waiting_bytes = 0;
        } else if stream.waiting_bytes + stream.begun_bytes + message.len() > MAX_QUEUED_BYTES {
            return Err(QueueFull);
        }
        stream.waiting_bytes += message.len();
        stream.waiting.push_back(message);
        self.begin_messages();
        Ok(())
    }

    /// Requests an acknowledgement even if there is nothing to send.
    pub fn ping(&mut self) {
        self.ping = true;
    }

    /// Returns the number of pieces resent or sent for redundancy since the last call.
    pub fn take_repeated(&mut self) -> u64 {
        std::mem::take(&mut self.repeated)
    }

    /// Returns the number of newest messages replaced before they were started, since the last
    /// call.
    pub fn take_superseded(&mut self) -> u64 {
        std::mem::take(&mut self.superseded)
    }

    /// Fills a packet with up to `room` bytes of frames. Returns `false` if there is nothing to
    /// send now.
    pub fn fill(&mut self, now: Duration, sequence: u64, room: usize, body: &mut Vec<u8>) -> bool {
        let end = body.len() + room;
        let mut pieces = Vec::new();
        while let Some(piece) = self.choose(end - body.len(), pieces.is_empty()) {
            self.write(piece, body);
            pieces.push(piece);
        }
        if pieces.is_empty() {
            return false;
        }
        self.sent.push_back(Sent { sequence, at: now, pieces, status: PacketStatus::InFlight });
        self.in_flight += 1;
        self.forget();
        true
    }

    /// Debits a sent or received packet.
    pub fn debit(&mut self, bytes: usize) {
        self.budget = (self.budget - bytes as i64).max(-MAX_BUDGET);
    }

    fn credit(&mut self, bytes: usize) {
        // a long message is credited and debited within one burst, so only an idle budget is capped
        self.budget = self.budget.min(MAX_BUDGET) + bytes as i64;
    }

    /// Returns the next piece to send: repairs, then new pieces, then redundancy.
    fn choose(&mut self, room: usize, first: bool) -> Option<Piece> {
        while let Some(&piece) = self.repairs.front() {
            match self.size(piece) {
                Some(size) if size > room => return None,
                Some(size) => {
                    self.repairs.pop_front();
                    self.repeated += 1;
                    self.repeat(piece, size);
                    return Some(piece);
                }
                None => _ = self.repairs.pop_front(),
            }
        }
        if self.in_flight < MAX_PACKETS_IN_FLIGHT {
            if let Some(piece) = self.unsent(room) {
                return Some(piece);
            }
            while let (true, Some(piece)) = (first, self.again.pop_front()) {
                if self.size(piece).is_some() {
                    self.repeated += 1;
                    return Some(piece);
                }
            }
        }
        (first && std::mem::take(&mut self.ping)).then_some(Piece::Ping)
    }

    /// Returns the next new piece if it fits.
    fn unsent(&mut self, room: usize) -> Option<Piece> {
        let (loss, budget) = (self.loss, self.budget);
        let outgoing = self
            .streams
            .iter_mut()
            .flat_map(|stream| stream.begun.iter_mut())
            .find(|outgoing| outgoing.has_unsent())?;
        let MessageInfo { channel, message, .. } = outgoing.part;
        if outgoing.unsent == outgoing.part.fragments() {
            if FRAGMENT_BYTES + PARITY_HEADER_BYTES > room {
                return None;
            }
            outgoing.unsent_parity += 1;
            self.repeated += 1;
            return Some(Piece::Parity(channel, message, outgoing.unsent_parity - 1));
        }
        let (index, length) = (outgoing.unsent, outgoing.part.length(outgoing.unsent));
        let header_bytes = outgoing.part.header_bytes();
        if length + header_bytes > room {
            return None;
        }
        outgoing.unsent += 1;
        let piece = Piece::Fragment(channel, message, index);
        if outgoing.unsent == outgoing.part.fragments() && loss > REDUNDANCY_THRESHOLD {
            outgoing.groups = parity_groups(&outgoing.part, budget - length as i64);
            if outgoing.part.fragments() == 1 {
                self.repeat(piece, length + header_bytes);
            }
        }
        Some(piece)
    }

    /// Schedules a second copy in a packet of its own, if the budget covers it.
    fn repeat(&mut self, piece: Piece, size: usize) {
        if self.budget >= 2 * (size + 64) as i64 && self.again.len() < MAX_PACKETS_IN_FLIGHT {
            self.again.push_back(piece);
        }
    }

    /// Returns the length of a piece; `None` if it is no longer needed.
    fn size(&mut self, piece: Piece) -> Option<usize> {
        let Piece::Fragment(channel, message, index) = piece else { return Some(1) };
        let outgoing = self.streams[channel as usize].find(message)?;
        (!outgoing.progress[usize::from(index)].arrived)
            .then(|| outgoing.part.length(index) + outgoing.part.header_bytes())
    }

    fn write(&mut self, piece: Piece, body: &mut Vec<u8>) {
        match piece {
            Piece::Fragment(channel, message, index) => {
                if let Some(outgoing) = self.streams[channel as usize].find(message) {
                    let at = usize::from(index) * FRAGMENT_BYTES;
                    let progress = &mut outgoing.progress[usize::from(index)];
                    progress.copies = progress.copies.saturating_add(1);
                    Frame::Fragment(outgoing.part, index, &outgoing.data[at..at + outgoing.part.length(index)])
                        .write(body);
                }
            }
            Piece::Parity(channel, message, group) => {
                if let Some(outgoing) = self.streams[channel as usize].find(message) {
                    Frame::Parity(
                        outgoing.part,
                        group,
                        outgoing.groups,
                        &parity(&outgoing.data, group, outgoing.groups),
                    )
                    .write(body);
                }
            }
            Piece::Ping => Frame::Ping.write(body),
        }
    }

    fn begin_messages(&mut self) {
        for (stream, channel) in self.streams.iter_mut().zip([Channel::Reliable, Channel::Newest]) {
            while stream.may_begin(channel)
                && let Some(data) = stream.waiting.pop_front()
            {
                stream.begin(channel, data);
            }
        }
    }
}

/// Returns the number of parity fragments: one for each four, as far as the budget covers them.
fn parity_groups(part: &MessageInfo, budget: i64) -> u16 {
    let affordable = budget.max(0) / (FRAGMENT_BYTES + 100) as i64;
    let fragments = i64::from(part.fragments());
    ((fragments + 3) / 4).min(affordable).min(fragments - 1) as u16
}
