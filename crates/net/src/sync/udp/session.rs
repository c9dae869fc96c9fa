//! One side of a session: packets and messages pass encryption, replay window, inbox and outbox.

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

/// Number of received packets that are acknowledged at once.
const PACKETS_PER_ACK: u32 = 8;
/// Delay of an acknowledgement, so that it can travel with a message. A prompt answer costs no
/// packet of its own.
const ACK_DELAY: Duration = Duration::from_micros(500);
/// Number of acknowledgements that cover each packet, so that the loss of one does no harm.
const ACK_REPEATS: usize = 4;
const BODY: usize = MAX_DATAGRAM - HEADER_BYTES - TAG_BYTES;

/// First numbers of a session, 0 except in tests of the wrap.
#[derive(Clone, Copy, Debug, Default)]
pub struct Numbering {
    /// Number of the first packet.
    pub sequence: u64,
    /// Number of the first message of each stream.
    pub message: u32,
}

/// One side of a session.
pub struct Session {
    /// Address of the peer.
    pub address: SocketAddr,
    /// Parameters of the session.
    pub agreed: Agreement,
    /// Whether the peer has proved that it has the keys.
    pub live: bool,
    seal: Seal,
    window: ReplayWindow,
    inbox: Inbox,
    outbox: Outbox,
    timing: Timing,
    last_received: Duration,
    sent: Duration,
    /// Number of packets to acknowledge, and when that is due.
    unacknowledged: u32,
    ack_due: Option<Duration>,
    /// Largest packet of each of the last acknowledgements, the oldest first.
    acked_largest: [u64; ACK_REPEATS],
    /// Number of the first packet of either side.
    first: u64,
    closed_by_peer: bool,
    exhausted: bool,
    body: Vec<u8>,
    datagram: Vec<u8>,
}

impl Session {
    /// Creates a session.
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

    /// Processes a packet. Nothing of it is used before its tag is checked, and none of it if one
    /// frame is invalid.
    ///
    /// # Errors
    /// The reason for which the packet was refused.
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

    /// Checks a packet that arrives after the end of the session: whether the peer sent it before
    /// the end.
    ///
    /// # Errors
    /// The reason for which the packet was refused.
    pub fn receive_late(&mut self, header: &PacketHeader, datagram: &[u8]) -> Result<(), Refused> {
        let mut body = std::mem::take(&mut self.body);
        let result = self.open(header, datagram, &mut body);
        self.body = body;
        result
    }

    /// Discards all messages after the end of the session.
    pub fn clear_messages(&mut self) {
        (self.inbox, self.outbox) = (Inbox::new(0), Outbox::new(0));
    }

    /// Checks the replay window and decrypts the body.
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

    /// Queues a message.
    ///
    /// # Errors
    /// [`QueueFull`].
    pub fn send(&mut self, delivery: Delivery, message: Arc<[u8]>) -> Result<(), QueueFull> {
        self.outbox.push(Channel::from(delivery), message)
    }

    /// Returns the next received message.
    pub fn pop(&mut self) -> Option<(Delivery, Vec<u8>)> {
        self.inbox.pop()
    }

    /// Requests an acknowledgement with the next packet.
    pub fn ping(&mut self) {
        self.outbox.ping();
    }

    /// Sends due packets by `emit`.
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

    /// Sends Close three times, because it is never resent.
    pub fn send_close(&mut self, now: Duration, counters: &mut LinkCounters, emit: &mut dyn FnMut(SocketAddr, &[u8])) {
        for _ in 0..3 {
            self.body.clear();
            Frame::Close.write(&mut self.body);
            self.seal_and_emit(now, counters, emit);
        }
    }

    /// Returns when [`transmit`](Self::transmit) has work, if no packet arrives before.
    pub fn wake(&self) -> Duration {
        let over = self.last_received + self.timing.idle_timeout;
        if !self.live {
            return over;
        }
        let idle = over.min(self.sent + self.timing.ping_interval);
        [self.ack_due, self.outbox.wake()].into_iter().flatten().fold(idle, Duration::min)
    }

    /// Returns when the last packet was received.
    pub fn last_received(&self) -> Duration {
        self.last_received
    }

    /// Returns whether nothing was received for the idle timeout.
    pub fn is_timed_out(&self, now: Duration) -> bool {
        now >= self.last_received + self.timing.idle_timeout
    }

    /// Returns whether the peer closed the session.
    pub fn is_closed_by_peer(&self) -> bool {
        self.closed_by_peer
    }

    /// Returns whether the sequence numbers are used up.
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
