//! Reliable order over a buffer that overflows: numbers, a memory of what was sent, and asking again.
//!
//! A reader that is slower than its buffer loses the *oldest* samples, so the newest always arrives and shows by its number what is missing. The reader
//! asks for the first few of those again, at most as many as its buffer holds, and for the next when they came: it sets the pace itself. What is no longer wanted
//! of those, messages of which a newer one is there, is not sent again but said to be nothing, in one sample however much it is.

use super::wire::SampleHeader;
use crate::sync::transport::{Delivery, MAX_MESSAGE_BYTES, MAX_QUEUED_BYTES, Message};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Pieces asked for at once: below what a reader's buffer holds.
const MAX_RESEND: u64 = 6;
/// When what was asked for has not come, it is asked for again.
const RESEND_TIMEOUT: Duration = Duration::from_millis(5);
/// Pieces held out of order.
const MAX_PENDING: usize = 65_536;

/// A piece that was sent.
pub struct SentPiece {
    /// For whom.
    pub mask: u64,
    /// Of a newest message.
    pub newest: bool,
    /// More of this message follows.
    pub more: bool,
    /// The bytes.
    pub data: Vec<u8>,
}

/// What was sent and may be asked for again.
#[derive(Default)]
pub struct SendHistory {
    first: u64,
    sent_piece: VecDeque<SentPiece>,
    bytes: usize,
    /// A buffer to use again: fresh memory costs more than the copy.
    spare: Vec<u8>,
}

impl SendHistory {
    /// The number of the next piece.
    pub fn next(&self) -> u64 {
        self.first + self.sent_piece.len() as u64
    }

    /// Remembers the piece that was sent as [`next`](Self::next).
    pub fn keep(&mut self, mask: u64, newest: bool, more: bool, bytes: &[u8]) {
        // A small piece does not take a large buffer away.
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

    /// Forgets all before `number`.
    pub fn forget_before(&mut self, number: u64) {
        while self.first < number && self.forget_first() {}
    }

    /// Forgets beyond the cap; what is first then. Everyone who lacks an earlier piece cannot be served any more.
    pub fn trim(&mut self, pieces: usize) -> u64 {
        while (self.bytes > MAX_QUEUED_BYTES || self.sent_piece.len() > pieces) && self.forget_first() {}
        self.first
    }

    /// The pieces asked for, capped; `None` where one is forgotten.
    pub fn resend(&self, header: &SampleHeader) -> Option<impl Iterator<Item = (u64, &SentPiece)>> {
        let until = header.until.min(header.number.saturating_add(MAX_RESEND)).min(self.next());
        let range = header.number..until;
        (header.number >= self.first)
            .then(|| range.filter_map(|number| Some((number, self.sent_piece.get((number - self.first) as usize)?))))
    }

    /// The same for one reader of many, whose bit of the masks is `bit`: what is for others, or older than its newest, is left out, however much that is.
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

    /// Where the last newest message of a reader begins; the pieces of a message lie together.
    fn newest_of(&self, bit: u64) -> Option<usize> {
        let is_of = |sent_piece: &SentPiece| sent_piece.newest && sent_piece.mask & bit != 0;
        let last = self.sent_piece.iter().rposition(|sent_piece| is_of(sent_piece) && !sent_piece.more)?;
        let before = self.sent_piece.iter().take(last).rposition(|sent_piece| !(is_of(sent_piece) && sent_piece.more));
        Some(before.map_or(0, |before| before + 1))
    }
}

/// What a reader gets that asked for pieces again.
pub enum Resend<'a> {
    /// The piece of this number.
    Piece(u64, &'a SentPiece),
    /// Nothing for it, from the first number to before the second.
    Nothing(u64, u64),
}

/// A piece held out of order.
struct Pending {
    newest: bool,
    more: bool,
    mine: bool,
    data: Vec<u8>,
}

/// A gap that will not close: more is held than may be.
#[derive(Debug, PartialEq, Eq)]
pub struct Overrun;

/// Puts pieces in order and joins them.
pub struct Reassembly {
    next: u64,
    pending: BTreeMap<u64, Pending>,
    pending_bytes: usize,
    partial: Vec<u8>,
    asked: Option<(u64, Duration)>,
}

impl Reassembly {
    /// The first piece expected is `next`.
    pub fn new(next: u64) -> Reassembly {
        Reassembly { next, pending: BTreeMap::new(), pending_bytes: 0, partial: Vec::new(), asked: None }
    }

    /// The first number that was not taken.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Takes a piece; whole messages go to `deliver`. One that came in one piece and in order goes on as it is.
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

    /// There is nothing for this side from one number to before another: a message that was begun goes no further.
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

    /// What to ask for now, if anything: first and the one after the last.
    pub fn ask(&mut self, now: Duration) -> Option<(u64, u64)> {
        let known = *self.pending.keys().next()?;
        if self.asked.is_some_and(|(until, at)| self.next < until && now < at + RESEND_TIMEOUT) {
            return None;
        }
        let until = known.min(self.next.saturating_add(MAX_RESEND));
        self.asked = Some((until, now));
        Some((self.next, until))
    }

    /// An empty buffer to build the next message in, where there is none.
    pub fn loan(&mut self, buffer: Vec<u8>) {
        if self.partial.is_empty() && self.partial.capacity() < buffer.capacity() {
            self.partial = buffer;
        }
    }

    /// Whether something is missing.
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

    /// A buffer of 8 that drops the oldest, as safe overflow does, between a writer and a reader that looks rarely.
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
        // Numbers 3k and 3k + 1 are the two pieces of a message for this reader; 3k + 2 is for another.
        let want: Vec<Vec<u8>> =
            (0..history.next()).step_by(3).map(|k| [[k as u8; 3], [(k + 1) as u8; 3]].concat()).collect();
        let whole = history.next() as usize / 3 + usize::from(history.next() % 3 == 2);
        assert_eq!(reassembly.next(), history.next());
        assert!(got.len() > 300 && got == want[..whole]);
    }

    /// A reader that slept through many newest messages of two pieces, among which two were for others and one was reliable, gets the reliable one and the newest, at once.
    #[test]
    fn what_a_newer_message_replaces_is_not_sent_again() {
        let mut history = SendHistory::default();
        for message in 0..1000u64 {
            let reliable = message == 400;
            for more in [true, false] {
                history.keep(if message % 500 == 7 { 2 } else { 1 }, !reliable, more, &message.to_le_bytes());
            }
        }
        // it has the first half of the first message; nothing after that came but the very last piece
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
