//! Loss detection: marks packets as acknowledged or lost, and measures the round trip. The
//! equations are at the top of the parent module.

use super::super::frames::{Ack, before};
use super::super::packet::full_sequence;
use super::stream::Stream;
use super::{Outbox, PacketStatus, Piece, Sent};
use std::time::Duration;

/// Maximum number of packets remembered after their loss, so that a late acknowledgement still
/// measures the round trip.
const MAX_REMEMBERED: usize = 512;
const RESOLUTION: Duration = Duration::from_millis(1);
const MAX_TIMEOUT: Duration = Duration::from_millis(250);

/// An acknowledgement of something that was never sent.
#[derive(Debug, PartialEq, Eq)]
pub struct InvalidAck;

impl Outbox {
    /// Processes an acknowledgement.
    ///
    /// # Errors
    /// [`InvalidAck`].
    pub fn acknowledged(&mut self, now: Duration, ack: &Ack, next_sequence: u64) -> Result<(), InvalidAck> {
        let largest = full_sequence(ack.largest, next_sequence);
        let complete = [Some(ack.reliable), ack.newest];
        let possible = |(stream, done): (&Stream, Option<u32>)| done.is_none_or(|done| !before(stream.next, done));
        if largest >= next_sequence || !self.streams.iter().zip(complete).all(possible) {
            return Err(InvalidAck);
        }
        self.largest = self.largest.max(Some(largest));
        self.mark(now, largest, ack.mask);
        for (stream, done) in self.streams.iter_mut().zip(complete) {
            done.into_iter().for_each(|done| stream.finish(done));
        }
        self.forget();
        self.begin_messages();
        Ok(())
    }

    /// Returns when a packet times out, if no packet arrives before.
    pub fn wake(&self) -> Option<Duration> {
        self.sent.iter().filter(|sent| sent.status == PacketStatus::InFlight).map(|sent| self.due(sent)).min()
    }

    /// Marks packets as lost whose time has passed.
    pub fn tick(&mut self, now: Duration) {
        let mut timed_out = false;
        for k in 0..self.sent.len() {
            if self.sent[k].status != PacketStatus::InFlight || now < self.due(&self.sent[k]) {
                continue;
            }
            timed_out |= self.largest.is_none_or(|largest| self.sent[k].sequence > largest);
            self.sent[k].status = PacketStatus::Lost;
            self.in_flight -= 1;
            self.loss += (1.0 - self.loss) / 128.0;
            for p in 0..self.sent[k].pieces.len() {
                self.on_lost(self.sent[k].pieces[p]);
            }
        }
        self.timeouts = self.timeouts.saturating_add(u32::from(timed_out)).min(16);
    }

    fn due(&self, sent: &Sent) -> Duration {
        if self.largest.is_some_and(|largest| sent.sequence < largest) {
            return sent.at + self.srtt + (2 * self.var).max(RESOLUTION / 2);
        }
        let timeout = match self.timeouts.checked_sub(2) {
            None => self.srtt + (4 * self.var).min(4 * RESOLUTION) + RESOLUTION,
            Some(more) => (self.srtt + 4 * self.var + RESOLUTION) * (1 << more.min(8)),
        };
        sent.at + timeout.min(MAX_TIMEOUT)
    }

    fn mark(&mut self, now: Duration, largest: u64, mask: u128) {
        let mut newest = None;
        for k in 0..self.sent.len() {
            let sent = &mut self.sent[k];
            let taken = largest.checked_sub(sent.sequence).is_some_and(|age| age < 128 && mask >> age & 1 == 1);
            if !taken || sent.status == PacketStatus::Acknowledged {
                continue;
            }
            self.in_flight -= usize::from(sent.status == PacketStatus::InFlight);
            sent.status = PacketStatus::Acknowledged;
            newest = Some(sent.at);
            self.loss -= self.loss / 128.0;
            for p in 0..self.sent[k].pieces.len() {
                self.on_acknowledged(self.sent[k].pieces[p]);
            }
        }
        if let Some(at) = newest {
            self.timeouts = 0;
            self.measure(now.saturating_sub(at));
        }
    }

    fn measure(&mut self, sample: Duration) {
        if !std::mem::replace(&mut self.measured, true) {
            (self.srtt, self.var) = (sample, sample / 2);
            return;
        }
        self.var = (3 * self.var + self.srtt.abs_diff(sample)) / 4;
        self.srtt = (7 * self.srtt + sample) / 8;
    }

    fn on_acknowledged(&mut self, piece: Piece) {
        let Piece::Fragment(channel, message, index) = piece else { return };
        let stream = &mut self.streams[channel as usize];
        if let Some(outgoing) = stream.find(message) {
            let progress = &mut outgoing.progress[usize::from(index)];
            progress.copies = progress.copies.saturating_sub(1);
            if !std::mem::replace(&mut progress.arrived, true) {
                outgoing.missing -= 1;
            }
        }
    }

    fn on_lost(&mut self, piece: Piece) {
        match piece {
            Piece::Fragment(channel, message, index) => {
                if let Some(outgoing) = self.streams[channel as usize].find(message) {
                    let progress = &mut outgoing.progress[usize::from(index)];
                    progress.copies = progress.copies.saturating_sub(1);
                    if !progress.arrived && progress.copies == 0 {
                        self.repairs.push_back(piece);
                    }
                }
            }
            Piece::Parity(..) => {}
            Piece::Ping => self.ping = true,
        }
    }

    /// Forgets packets at the front that need no further attention.
    pub(super) fn forget(&mut self) {
        while self.sent.front().is_some_and(|sent| {
            sent.status == PacketStatus::Acknowledged
                || (sent.status == PacketStatus::Lost && self.sent.len() > MAX_REMEMBERED)
        }) {
            self.sent.pop_front();
        }
    }
}
