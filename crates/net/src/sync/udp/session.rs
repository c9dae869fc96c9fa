//! One session, one side of it: packets and messages through seal, window, inbox and outbox.

use super::Timing;
use super::frames::{self, ACK_BYTES, Ack, Channel, Frame};
use super::inbox::Inbox;
use super::keys::{Agreement, Seal, SharedKey, Side};
use super::outbox::{Outbox, QueueFull};
use super::packet::{HEADER_BYTES, MAX_DATAGRAM, PacketHeader, TAG_BYTES, full_sequence};
use super::window::ReplayWindow;
use crate::sync::transport::{Delivery, LinkCounters, Refused};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

/// Packets that may arrive before they are acknowledged at once.
const PACKETS_PER_ACK: u32 = 8;
/// How long an acknowledgement may wait for a message that it can travel with: what is answered at once costs no packet of its own.
const ACK_DELAY: Duration = Duration::from_micros(500);
/// Each packet is told by so many acknowledgements, so that one that is lost does no harm.
const ACK_REPEATS: usize = 4;
const BODY: usize = MAX_DATAGRAM - HEADER_BYTES - TAG_BYTES;

/// Where the counting begins; other than 0 in tests of the wrap.
#[derive(Clone, Copy, Debug, Default)]
pub struct Numbering {
    /// First packet.
    pub sequence: u64,
    /// First message of each stream.
    pub message: u32,
}

/// One side of a session.
pub struct Session {
    /// Where the other side is.
    pub address: SocketAddr,
    /// What both sides agreed on.
    pub agreed: Agreement,
    /// Whether the other side has shown that it has the keys.
    pub live: bool,
    seal: Seal,
    window: ReplayWindow,
    inbox: Inbox,
    outbox: Outbox,
    timing: Timing,
    last_received: Duration,
    sent: Duration,
    /// Packets that want an acknowledgement, and when it is due.
    unacknowledged: u32,
    ack_due: Option<Duration>,
    /// The largest packets that the last acknowledgements told, the oldest first.
    acked_largest: [u64; ACK_REPEATS],
    /// Number of the first packet of either side.
    first: u64,
    closed_by_peer: bool,
    exhausted: bool,
    body: Vec<u8>,
    datagram: Vec<u8>,
}

impl Session {
    /// Begins a session.
    pub fn new(
        now: Duration,
        shared: &SharedKey,
        agreed: Agreement,
        side: Side,
        address: SocketAddr,
        timing: Timing,
        from: Numbering,
    ) -> Session {
        Session {
            address,
            agreed,
            live: false,
            seal: Seal::new(shared, &agreed, side, from.sequence),
            window: ReplayWindow::default(),
            inbox: Inbox::new(from.message),
            outbox: Outbox::new(from.message),
            timing,
            last_received: now,
            sent: now,
            unacknowledged: 0,
            ack_due: None,
            acked_largest: [from.sequence; ACK_REPEATS],
            first: from.sequence,
            closed_by_peer: false,
            exhausted: false,
            body: Vec::new(),
            datagram: Vec::new(),
        }
    }

    /// Takes a packet. Nothing of it is believed before its seal was checked, and nothing of it is taken where one frame contradicts.
    pub fn receive(
        &mut self,
        now: Duration,
        header: &PacketHeader,
        datagram: &[u8],
        counters: &mut LinkCounters,
    ) -> Result<(), Refused> {
        let mut body = std::mem::take(&mut self.body);
        let result = self.open(header, datagram, &mut body).and_then(|()| {
            self.last_received = now;
            self.live = true;
            let frames = frames::parse(&body).ok_or(Refused::Torn)?;
            self.take_frames(now, &frames, datagram.len())
        });
        self.body = body;
        counters.superseded += self.inbox.take_superseded();
        result
    }

    /// Looks at a packet that comes when the session is over: whether the other side sent it before it knew.
    pub fn receive_late(&mut self, header: &PacketHeader, datagram: &[u8]) -> Result<(), Refused> {
        let mut body = std::mem::take(&mut self.body);
        let result = self.open(header, datagram, &mut body);
        self.body = body;
        result
    }

    /// Lets go of all messages: the session is over.
    pub fn clear_messages(&mut self) {
        (self.inbox, self.outbox) = (Inbox::new(0), Outbox::new(0));
    }

    /// Window and seal.
    fn open(&mut self, header: &PacketHeader, datagram: &[u8], body: &mut Vec<u8>) -> Result<(), Refused> {
        let header = PacketHeader {
            sequence: full_sequence(header.sequence as u32, self.window.largest().unwrap_or(self.first)),
            ..*header
        };
        self.window.check(header.sequence)?;
        self.seal.open(&header, datagram, body)?;
        self.window.take(header.sequence);
        Ok(())
    }

    fn take_frames(&mut self, now: Duration, frames: &[Frame], bytes: usize) -> Result<(), Refused> {
        self.outbox.debit(bytes);
        let mut wants_ack = false;
        for frame in frames {
            match frame {
                Frame::Ack(ack) => {
                    let next = self.seal.next_sequence().unwrap_or(u64::MAX);
                    self.outbox.acknowledged(now, ack, next).map_err(|_| Refused::Torn)?;
                }
                Frame::Fragment(part, index, data) => {
                    self.inbox.fragment(*part, *index, data).map_err(|_| Refused::Torn)?
                }
                Frame::Parity(part, group, groups, data) => {
                    self.inbox.parity(*part, *group, *groups, data).map_err(|_| Refused::Torn)?
                }
                Frame::Ping => {}
                Frame::Close => self.closed_by_peer = true,
            }
            wants_ack |= !matches!(frame, Frame::Ack(_) | Frame::Close);
        }
        if wants_ack {
            self.unacknowledged += 1;
            let due = if self.unacknowledged >= PACKETS_PER_ACK { now } else { now + ACK_DELAY };
            self.ack_due = Some(self.ack_due.map_or(due, |old| old.min(due)));
        }
        Ok(())
    }

    /// Takes a message to be sent.
    pub fn send(&mut self, delivery: Delivery, message: Arc<[u8]>) -> Result<(), QueueFull> {
        self.outbox.push(Channel::from(delivery), message)
    }

    /// The next message that arrived.
    pub fn pop(&mut self) -> Option<(Delivery, Vec<u8>)> {
        self.inbox.pop()
    }

    /// Asks the other side for a sign of life with the next packet.
    pub fn ping(&mut self) {
        self.outbox.ping();
    }

    /// Sends what is due by `emit`.
    pub fn transmit(&mut self, now: Duration, counters: &mut LinkCounters, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        self.outbox.tick(now);
        if now >= self.sent + self.timing.ping_interval {
            self.outbox.ping();
        }
        while let Some(sequence) = self.seal.next_sequence() {
            self.body.clear();
            let ack_is_due = self.ack_due.is_some_and(|due| now >= due);
            if self.unacknowledged > 0 {
                self.write_ack();
            }
            let room = BODY - ACK_BYTES.max(self.body.len());
            if !self.outbox.fill(now, sequence, room, &mut self.body) && !ack_is_due {
                break;
            }
            if self.unacknowledged > 0 {
                self.acked_largest.rotate_left(1);
                self.acked_largest[ACK_REPEATS - 1] = self.window.largest().unwrap_or(self.first);
            }
            self.unacknowledged = 0;
            self.ack_due = None;
            self.seal_and_emit(now, counters, emit);
        }
        self.exhausted = self.seal.next_sequence().is_none();
        counters.repeated += self.outbox.take_repeated();
        counters.superseded += self.outbox.take_superseded();
    }

    /// Tells the other side that the session is over; three times, because nobody will repeat it.
    pub fn send_close(&mut self, now: Duration, counters: &mut LinkCounters, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        for _ in 0..3 {
            self.body.clear();
            Frame::Close.write(&mut self.body);
            self.seal_and_emit(now, counters, emit);
        }
    }

    /// When [`transmit`](Self::transmit) has something to do, if nothing arrives before.
    pub fn wake(&self) -> Duration {
        let over = self.last_received + self.timing.idle_timeout;
        if !self.live {
            return over;
        }
        let idle = over.min(self.sent + self.timing.ping_interval);
        [self.ack_due, self.outbox.wake()].into_iter().flatten().fold(idle, Duration::min)
    }

    /// When something was heard last.
    pub fn last_received(&self) -> Duration {
        self.last_received
    }

    /// Whether nothing was heard for too long.
    pub fn is_timed_out(&self, now: Duration) -> bool {
        now >= self.last_received + self.timing.idle_timeout
    }

    /// Whether the other side closed it.
    pub fn is_closed_by_peer(&self) -> bool {
        self.closed_by_peer
    }

    /// Whether the sequence numbers are used up.
    pub fn is_exhausted(&self) -> bool {
        self.exhausted
    }

    fn write_ack(&mut self) {
        if let Some((largest, mask)) = self.window.taken() {
            let bits = largest.saturating_sub(self.acked_largest[0]).clamp(1, 128);
            let bytes = bits.div_ceil(8) as u8;
            let [reliable, newest] = self.inbox.complete();
            let newest = (newest != self.inbox.first()).then_some(newest);
            let mask = mask & (u128::MAX >> (128 - 8 * u32::from(bytes)));
            Frame::Ack(Ack { reliable, newest, largest: largest as u32, bytes, mask }).write(&mut self.body);
        }
    }

    fn seal_and_emit(&mut self, now: Duration, counters: &mut LinkCounters, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        if self.seal.close(&self.body, &mut self.datagram) {
            self.sent = now;
            self.outbox.debit(self.datagram.len());
            counters.bytes_out += self.datagram.len() as u64;
            emit(self.address, &self.datagram);
        }
    }
}
