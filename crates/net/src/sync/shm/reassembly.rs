//! Reliable, ordered delivery over a buffer that overflows: sequence numbers, a history of sent
//! pieces, and resend requests.
//!
//! A reader that is slower than its buffer loses the *oldest* samples. The newest sample always
//! arrives, and its number reveals the gap. The reader requests the first few missing pieces, no
//! more than its buffer holds, and the next ones when those have arrived; so the reader sets the
//! rate. Pieces of a message that a newer one has superseded are not sent again: one sample marks
//! any number of them as skipped.

use super::wire::SampleHeader;
use crate::sync::transport::{Delivery, MAX_MESSAGE_BYTES, MAX_QUEUED_BYTES, Message};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Maximum number of pieces per resend request, below the capacity of a reader's buffer.
const MAX_RESEND: u64 = 6;
/// Time after which a request is repeated.
const RESEND_TIMEOUT: Duration = Duration::from_millis(5);
/// Maximum number of pieces held out of order.
const MAX_PENDING: usize = 65_536;

/// A sent piece.
pub struct SentPiece {
    /// Receivers, one bit per facet.
    pub mask: u64,
    /// Whether the message has [`Delivery::Newest`].
    pub newest: bool,
    /// Whether more pieces of the message follow.
    pub more: bool,
    /// The bytes.
    pub data: Vec<u8>,
}

/// Sent pieces that may be requested again.
#[derive(Default)]
pub struct SendHistory {
    first: u64,
    sent_piece: VecDeque<SentPiece>,
    bytes: usize,
    /// A buffer to reuse: allocating costs more than the copy.
    spare: Vec<u8>,
}

impl SendHistory {
    /// Returns the number of the next piece.
    pub fn next(&self) -> u64 {
        self.first + self.sent_piece.len() as u64
    }

    /// Keeps the piece that was sent as [`next`](Self::next).
    pub fn keep(&mut self, mask: u64, newest: bool, more: bool, bytes: &[u8]) {
        // a small piece does not take a large buffer
        let mut data =
            if self.spare.capacity() / 4 <= bytes.len() { std::mem::take(&mut self.spare) } else { Vec::new() };
        data.clear();
        data.extend_from_slice(bytes);
        self.bytes += data.len();
        self.sent_piece.push_back(SentPiece { mask, newest, more, data });
    }

    fn forget_first(&mut self) -> bool {
        let Some(sent_piece) = self.sent_piece.pop_front() else { return false };
        self.bytes -= sent_piece.data.len();
        self.first += 1;
        if self.spare.capacity() < sent_piece.data.capacity() {
            self.spare = sent_piece.data;
        }
        true
    }

    /// Forgets all pieces before `number`.
    pub fn forget_before(&mut self, number: u64) {
        while self.first < number && self.forget_first() {}
    }

    /// Forgets pieces beyond the limits and returns the number of the first one left. A reader that
    /// misses an earlier piece cannot be served any more.
    pub fn trim(&mut self, pieces: usize) -> u64 {
        while (self.bytes > MAX_QUEUED_BYTES || self.sent_piece.len() > pieces) && self.forget_first() {}
        self.first
    }

    /// Returns the requested pieces, at most [`MAX_RESEND`]; `None` if one of them is forgotten.
    pub fn resend(&self, header: &SampleHeader) -> Option<impl Iterator<Item = (u64, &SentPiece)>> {
        let until = header.until.min(header.number.saturating_add(MAX_RESEND)).min(self.next());
        let range = header.number..until;
        (header.number >= self.first)
            .then(|| range.filter_map(|number| Some((number, self.sent_piece.get((number - self.first) as usize)?))))
    }

    /// Returns the requested pieces for the reader with mask bit `bit`. Pieces for others, or
    /// superseded by the reader's newest message, are merged into one skip each.
    pub fn resend_to(&self, header: &SampleHeader, bit: u64) -> Option<Vec<Resend<'_>>> {
        let mut left = self
            .sent_piece
            .iter()
            .enumerate()
            .skip(usize::try_from(header.number.checked_sub(self.first)?).ok()?)
            .peekable();
        let newest = self.newest_of(bit);
        let wanted = |k: usize, sent_piece: &SentPiece| {
            sent_piece.mask & bit != 0 && !(sent_piece.newest && newest.is_some_and(|first| k < first))
        };
        let mut resend = Vec::new();
        while resend.len() < MAX_RESEND as usize
            && let Some((k, sent_piece)) = left.next()
        {
            let number = self.first + k as u64;
            if wanted(k, sent_piece) {
                if number >= header.until {
                    break;
                }
                resend.push(Resend::Piece(number, sent_piece));
            } else {
                let mut until = number + 1;
                while left.next_if(|(k, sent_piece)| !wanted(*k, sent_piece)).is_some() {
                    until += 1;
                }
                resend.push(Resend::Nothing(number, until));
            }
        }
        Some(resend)
    }

    /// Returns the first piece of a reader's last newest message. The pieces of a message are
    /// contiguous.
    fn newest_of(&self, bit: u64) -> Option<usize> {
        let is_of = |sent_piece: &SentPiece| sent_piece.newest && sent_piece.mask & bit != 0;
        let last = self.sent_piece.iter().rposition(|sent_piece| is_of(sent_piece) && !sent_piece.more)?;
        let before = self.sent_piece.iter().take(last).rposition(|sent_piece| !(is_of(sent_piece) && sent_piece.more));
        Some(before.map_or(0, |before| before + 1))
    }
}

/// Answer to a resend request.
pub enum Resend<'a> {
    /// The piece with this number.
    Piece(u64, &'a SentPiece),
    /// No piece for the reader, from the first number to before the second.
    Nothing(u64, u64),
}

/// A piece held out of order.
struct Pending {
    newest: bool,
    more: bool,
    mine: bool,
    data: Vec<u8>,
}

/// The gap cannot be closed: more pieces are held than allowed.
#[derive(Debug, PartialEq, Eq)]
pub struct Overrun;

/// Orders pieces and joins them to messages.
pub struct Reassembly {
    next: u64,
    pending: BTreeMap<u64, Pending>,
    pending_bytes: usize,
    partial: Vec<u8>,
    asked: Option<(u64, Duration)>,
}

impl Reassembly {
    /// Creates the state in which `next` is the first expected piece.
    pub fn new(next: u64) -> Reassembly {
        Reassembly { next, pending: BTreeMap::new(), pending_bytes: 0, partial: Vec::new(), asked: None }
    }

    /// Returns the first number not taken yet.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Takes a piece and delivers complete messages. A message of one piece that arrives in order
    /// is passed on without a copy.
    pub fn take(
        &mut self,
        header: &SampleHeader,
        mine: bool,
        data: Message,
        mut deliver: impl FnMut(Delivery, Message),
    ) -> Result<(), Overrun> {
        if header.number < self.next || self.pending.contains_key(&header.number) {
            return Ok(());
        }
        if header.number > self.next {
            if self.pending.len() >= MAX_PENDING || self.pending_bytes + data.len() > MAX_QUEUED_BYTES {
                return Err(Overrun);
            }
            let data = if mine { data.into_vec() } else { Vec::new() };
            self.pending_bytes += data.len();
            self.pending.insert(header.number, Pending { newest: header.newest, more: header.more, mine, data });
            return Ok(());
        }
        self.join(mine, header.newest, header.more, data, &mut deliver)?;
        self.join_held(&mut deliver)
    }

    fn join_held(&mut self, deliver: &mut impl FnMut(Delivery, Message)) -> Result<(), Overrun> {
        while let Some(piece) = self.pending.remove(&self.next) {
            self.pending_bytes -= piece.data.len();
            self.join(piece.mine, piece.newest, piece.more, piece.data.into(), deliver)?;
        }
        Ok(())
    }

    /// Skips the numbers from `from` to before `until`, under which there is nothing for this side.
    /// A message that was begun is discarded.
    pub fn skip(&mut self, from: u64, until: u64, mut deliver: impl FnMut(Delivery, Message)) -> Result<(), Overrun> {
        if from > self.next || until <= self.next {
            return Ok(());
        }
        self.partial.clear();
        self.next = until;
        let held = self.pending.split_off(&until);
        let left_out = std::mem::replace(&mut self.pending, held);
        self.pending_bytes -= left_out.values().map(|piece| piece.data.len()).sum::<usize>();
        self.join_held(&mut deliver)
    }

    /// Returns the range of numbers to request now, if any: the first, and the one after the last.
    pub fn ask(&mut self, now: Duration) -> Option<(u64, u64)> {
        let known = *self.pending.keys().next()?;
        if self.asked.is_some_and(|(until, at)| self.next < until && now < at + RESEND_TIMEOUT) {
            return None;
        }
        let until = known.min(self.next.saturating_add(MAX_RESEND));
        self.asked = Some((until, now));
        Some((self.next, until))
    }

    /// Takes an empty buffer for the next message, if there is none.
    pub fn loan(&mut self, buffer: Vec<u8>) {
        if self.partial.is_empty() && self.partial.capacity() < buffer.capacity() {
            self.partial = buffer;
        }
    }

    /// Returns whether a piece is missing.
    pub fn has_gap(&self) -> bool {
        !self.pending.is_empty()
    }

    fn join(
        &mut self,
        mine: bool,
        newest: bool,
        more: bool,
        data: Message,
        deliver: &mut impl FnMut(Delivery, Message),
    ) -> Result<(), Overrun> {
        self.next = self.next.saturating_add(1); // the other side draws the numbers, and may lie
        if !mine {
            return Ok(());
        }
        if self.partial.len() + data.len() > MAX_MESSAGE_BYTES {
            return Err(Overrun);
        }
        let delivery = if newest { Delivery::Newest } else { Delivery::Reliable };
        if !more && self.partial.is_empty() {
            deliver(delivery, data);
            return Ok(());
        }
        self.partial.extend_from_slice(&data);
        if !more {
            deliver(delivery, std::mem::take(&mut self.partial).into());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::SampleKind;
    use super::*;

    /// A buffer of 8 that drops the oldest sample, like safe overflow, between a writer and a
    /// reader that rarely reads.
    #[test]
    fn a_slow_reader_gets_all_in_order() {
        let (mut history, mut reassembly, mut buffer) = (SendHistory::default(), Reassembly::new(0), VecDeque::new());
        let mut got = Vec::new();
        let header = |number, sent_piece: &SentPiece| SampleHeader {
            number,
            mask: sent_piece.mask,
            newest: sent_piece.newest,
            more: sent_piece.more,
            ..SampleHeader::new(SampleKind::Piece, 1)
        };
        for round in 0..400u64 {
            if round < 100 {
                for _ in 0..round % 23 {
                    let number = history.next();
                    let sent_piece = SentPiece {
                        mask: 1 << (number % 3 / 2),
                        newest: false,
                        more: number % 3 == 0,
                        data: vec![number as u8; 3],
                    };
                    history.keep(sent_piece.mask, false, sent_piece.more, &sent_piece.data);
                    buffer.push_back((header(number, &sent_piece), sent_piece.data));
                }
            }
            while buffer.len() > 8 {
                buffer.pop_front();
            }
            for (header, data) in buffer.drain(..) {
                reassembly
                    .take(&header, header.mask == 1, data.into(), |_, message| got.push(message.into_vec()))
                    .unwrap();
            }
            if let Some((number, until)) = reassembly.ask(Duration::from_millis(round)) {
                let asked = SampleHeader { number, until, ..SampleHeader::new(SampleKind::ResendRequest, 1) };
                buffer.extend(
                    history
                        .resend(&asked)
                        .unwrap()
                        .map(|(number, sent_piece)| (header(number, sent_piece), sent_piece.data.clone())),
                );
            }
        }
        // numbers 3k and 3k + 1 are the two pieces of a message for this reader; 3k + 2 is for
        // another
        let want: Vec<Vec<u8>> =
            (0..history.next()).step_by(3).map(|k| [[k as u8; 3], [(k + 1) as u8; 3]].concat()).collect();
        let whole = history.next() as usize / 3 + usize::from(history.next() % 3 == 2);
        assert_eq!(reassembly.next(), history.next());
        assert!(got.len() > 300 && got == want[..whole]);
    }

    /// The reader missed many newest messages of two pieces each, among them two for others and one
    /// reliable. It gets the reliable one and the newest, in one request.
    #[test]
    fn what_a_newer_message_replaces_is_not_sent_again() {
        let mut history = SendHistory::default();
        for message in 0..1000u64 {
            let reliable = message == 400;
            for more in [true, false] {
                history.keep(if message % 500 == 7 { 2 } else { 1 }, !reliable, more, &message.to_le_bytes());
            }
        }
        // it has the first half of the first message, and then only the last piece
        let (mut reassembly, mut got) = (Reassembly::new(0), Vec::new());
        let header = |number, sent_piece: &SentPiece| SampleHeader {
            number,
            mask: sent_piece.mask,
            newest: sent_piece.newest,
            more: sent_piece.more,
            ..SampleHeader::new(SampleKind::Piece, 1)
        };
        let sent_piece = |number: u64| history.sent_piece.get(number as usize).unwrap();
        for number in [0, 1999] {
            reassembly
                .take(
                    &header(number, sent_piece(number)),
                    true,
                    sent_piece(number).data.clone().into(),
                    |_, message| got.push(message.into_vec()),
                )
                .unwrap();
        }
        let mut rounds = 0;
        while let Some((number, until)) = reassembly.ask(RESEND_TIMEOUT * 2 * rounds) {
            rounds += 1;
            for resend in history
                .resend_to(&SampleHeader { number, until, ..SampleHeader::new(SampleKind::ResendRequest, 1) }, 1)
                .unwrap()
            {
                match resend {
                    Resend::Piece(number, sent_piece) => reassembly
                        .take(&header(number, sent_piece), true, sent_piece.data.clone().into(), |_, message| {
                            got.push(message.into_vec())
                        })
                        .unwrap(),
                    Resend::Nothing(from, until) => {
                        reassembly.skip(from, until, |_, message| got.push(message.into_vec())).unwrap()
                    }
                }
            }
            assert!(rounds < 4, "asked again and again");
        }
        let twice = |message: u64| [message.to_le_bytes(), message.to_le_bytes()].concat();
        assert_eq!((got, reassembly.next(), reassembly.pending_bytes), (vec![twice(400), twice(999)], 2000, 0));
    }

    #[test]
    fn numbers_at_the_end_of_u64_are_taken() {
        let header = |number| SampleHeader { number, ..SampleHeader::new(SampleKind::Piece, 1) };
        let (mut reassembly, mut got) = (Reassembly::new(u64::MAX - 2), 0);
        reassembly.take(&header(u64::MAX), true, vec![1].into(), |_, _| got += 1).unwrap();
        assert_eq!(reassembly.ask(Duration::ZERO), Some((u64::MAX - 2, u64::MAX)));
        for number in [u64::MAX - 2, u64::MAX - 1, u64::MAX] {
            reassembly.take(&header(number), true, vec![1].into(), |_, _| got += 1).unwrap();
        }
        assert!(got >= 3 && reassembly.next() == u64::MAX);
    }

    #[test]
    fn what_is_forgotten_cannot_be_asked_for() {
        let mut history = SendHistory::default();
        for _ in 0..10 {
            history.keep(1, false, false, &[0]);
        }
        history.forget_before(4);
        let asked =
            |number| SampleHeader { number, until: u64::MAX, ..SampleHeader::new(SampleKind::ResendRequest, 1) };
        assert!(history.resend(&asked(3)).is_none());
        assert_eq!(history.resend(&asked(7)).unwrap().map(|(number, _)| number).collect::<Vec<_>>(), [7, 8, 9]);
        assert_eq!(history.trim(3), 7);
    }
}
