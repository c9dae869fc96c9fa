//! Reliable order over a buffer that overflows: numbers, a memory of what was sent, and asking again.
//!
//! A reader that is slower than its buffer loses the *oldest* samples, so the newest always arrives and shows by its number what is missing. The reader
//! asks for the first few of those again, at most as many as its buffer holds, and for the next when they came: it sets the pace itself. What is no longer wanted
//! of those, messages of which a newer one is there, is not sent again but said to be nothing, in one sample however much it is.

use super::wire::Head;
use crate::sync::transport::{Delivery, MAX_MESSAGE_BYTES, MAX_QUEUED_BYTES, Message};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Pieces asked for at once: below what a reader's buffer holds.
const AT_ONCE: u64 = 6;
/// When what was asked for has not come, it is asked for again.
const PATIENCE: Duration = Duration::from_millis(5);
/// Pieces held out of order.
const MAX_PENDING: usize = 65_536;

/// A piece that was sent.
pub struct Kept {
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
pub struct Memory {
    first: u64,
    kept: VecDeque<Kept>,
    bytes: usize,
    /// A buffer to use again: fresh memory costs more than the copy.
    spare: Vec<u8>,
}

impl Memory {
    /// The number of the next piece.
    pub fn next(&self) -> u64 {
        self.first + self.kept.len() as u64
    }

    /// Remembers the piece that was sent as [`next`](Self::next).
    pub fn keep(&mut self, mask: u64, newest: bool, more: bool, bytes: &[u8]) {
        // A small piece does not take a large buffer away.
        let mut data =
            if self.spare.capacity() / 4 <= bytes.len() { std::mem::take(&mut self.spare) } else { Vec::new() };
        data.clear();
        data.extend_from_slice(bytes);
        self.bytes += data.len();
        self.kept.push_back(Kept { mask, newest, more, data });
    }

    fn forget_first(&mut self) -> bool {
        let Some(kept) = self.kept.pop_front() else { return false };
        self.bytes -= kept.data.len();
        self.first += 1;
        if self.spare.capacity() < kept.data.capacity() {
            self.spare = kept.data;
        }
        true
    }

    /// Forgets all before `number`.
    pub fn forget_before(&mut self, number: u64) {
        while self.first < number && self.forget_first() {}
    }

    /// Forgets beyond the cap; what is first then. Everyone who lacks an earlier piece cannot be served any more.
    pub fn trim(&mut self, pieces: usize) -> u64 {
        while (self.bytes > MAX_QUEUED_BYTES || self.kept.len() > pieces) && self.forget_first() {}
        self.first
    }

    /// The pieces asked for, capped; `None` where one is forgotten.
    pub fn again(&self, head: &Head) -> Option<impl Iterator<Item = (u64, &Kept)>> {
        let until = head.until.min(head.number.saturating_add(AT_ONCE)).min(self.next());
        let range = head.number..until;
        (head.number >= self.first)
            .then(|| range.filter_map(|number| Some((number, self.kept.get((number - self.first) as usize)?))))
    }

    /// The same for one reader of many, whose bit of the masks is `bit`: what is for others, or older than its newest, is left out, however much that is.
    pub fn again_to(&self, head: &Head, bit: u64) -> Option<Vec<Again<'_>>> {
        let mut left =
            self.kept.iter().enumerate().skip(usize::try_from(head.number.checked_sub(self.first)?).ok()?).peekable();
        let newest = self.newest_of(bit);
        let wanted =
            |k: usize, kept: &Kept| kept.mask & bit != 0 && !(kept.newest && newest.is_some_and(|first| k < first));
        let mut again = Vec::new();
        while again.len() < AT_ONCE as usize
            && let Some((k, kept)) = left.next()
        {
            let number = self.first + k as u64;
            if wanted(k, kept) {
                if number >= head.until {
                    break;
                }
                again.push(Again::Piece(number, kept));
            } else {
                let mut until = number + 1;
                while left.next_if(|(k, kept)| !wanted(*k, kept)).is_some() {
                    until += 1;
                }
                again.push(Again::Nothing(number, until));
            }
        }
        Some(again)
    }

    /// Where the last newest message of a reader begins; the pieces of a message lie together.
    fn newest_of(&self, bit: u64) -> Option<usize> {
        let is_of = |kept: &Kept| kept.newest && kept.mask & bit != 0;
        let last = self.kept.iter().rposition(|kept| is_of(kept) && !kept.more)?;
        let before = self.kept.iter().take(last).rposition(|kept| !(is_of(kept) && kept.more));
        Some(before.map_or(0, |before| before + 1))
    }
}

/// What a reader gets that asked for pieces again.
pub enum Again<'a> {
    /// The piece of this number.
    Piece(u64, &'a Kept),
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
pub struct Order {
    next: u64,
    pending: BTreeMap<u64, Pending>,
    pending_bytes: usize,
    partial: Vec<u8>,
    asked: Option<(u64, Duration)>,
}

impl Order {
    /// The first piece expected is `next`.
    pub fn new(next: u64) -> Order {
        Order { next, pending: BTreeMap::new(), pending_bytes: 0, partial: Vec::new(), asked: None }
    }

    /// The first number that was not taken.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Takes a piece; whole messages go to `deliver`. One that came in one piece and in order goes on as it is.
    pub fn take(
        &mut self,
        head: &Head,
        mine: bool,
        data: Message,
        mut deliver: impl FnMut(Delivery, Message),
    ) -> Result<(), Overrun> {
        if head.number < self.next || self.pending.contains_key(&head.number) {
            return Ok(());
        }
        if head.number > self.next {
            if self.pending.len() >= MAX_PENDING || self.pending_bytes + data.len() > MAX_QUEUED_BYTES {
                return Err(Overrun);
            }
            let data = if mine { data.into_vec() } else { Vec::new() };
            self.pending_bytes += data.len();
            self.pending.insert(head.number, Pending { newest: head.newest, more: head.more, mine, data });
            return Ok(());
        }
        self.join(mine, head.newest, head.more, data, &mut deliver)?;
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
        if self.asked.is_some_and(|(until, at)| self.next < until && now < at + PATIENCE) {
            return None;
        }
        let until = known.min(self.next.saturating_add(AT_ONCE));
        self.asked = Some((until, now));
        Some((self.next, until))
    }

    /// An empty buffer to build the next message in, where there is none.
    pub fn lend(&mut self, buffer: Vec<u8>) {
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
    use super::super::wire::Kind;
    use super::*;

    /// A buffer of 8 that drops the oldest, as safe overflow does, between a writer and a reader that looks rarely.
    #[test]
    fn a_slow_reader_gets_all_in_order() {
        let (mut memory, mut order, mut buffer) = (Memory::default(), Order::new(0), VecDeque::new());
        let mut got = Vec::new();
        let head = |number, kept: &Kept| Head {
            number,
            mask: kept.mask,
            newest: kept.newest,
            more: kept.more,
            ..Head::new(Kind::Piece, 1)
        };
        for round in 0..400u64 {
            if round < 100 {
                for _ in 0..round % 23 {
                    let number = memory.next();
                    let kept = Kept {
                        mask: 1 << (number % 3 / 2),
                        newest: false,
                        more: number % 3 == 0,
                        data: vec![number as u8; 3],
                    };
                    memory.keep(kept.mask, false, kept.more, &kept.data);
                    buffer.push_back((head(number, &kept), kept.data));
                }
            }
            while buffer.len() > 8 {
                buffer.pop_front();
            }
            for (head, data) in buffer.drain(..) {
                order.take(&head, head.mask == 1, data.into(), |_, message| got.push(message.into_vec())).unwrap();
            }
            if let Some((number, until)) = order.ask(Duration::from_millis(round)) {
                let asked = Head { number, until, ..Head::new(Kind::Again, 1) };
                buffer.extend(
                    memory.again(&asked).unwrap().map(|(number, kept)| (head(number, kept), kept.data.clone())),
                );
            }
        }
        // Numbers 3k and 3k + 1 are the two pieces of a message for this reader; 3k + 2 is for another.
        let want: Vec<Vec<u8>> =
            (0..memory.next()).step_by(3).map(|k| [[k as u8; 3], [(k + 1) as u8; 3]].concat()).collect();
        let whole = memory.next() as usize / 3 + usize::from(memory.next() % 3 == 2);
        assert_eq!(order.next(), memory.next());
        assert!(got.len() > 300 && got == want[..whole]);
    }

    /// A reader that slept through many newest messages of two pieces, among which two were for others and one was reliable, gets the reliable one and the newest, at once.
    #[test]
    fn what_a_newer_message_replaces_is_not_sent_again() {
        let mut memory = Memory::default();
        for message in 0..1000u64 {
            let reliable = message == 400;
            for more in [true, false] {
                memory.keep(if message % 500 == 7 { 2 } else { 1 }, !reliable, more, &message.to_le_bytes());
            }
        }
        // it has the first half of the first message; nothing after that came but the very last piece
        let (mut order, mut got) = (Order::new(0), Vec::new());
        let head = |number, kept: &Kept| Head {
            number,
            mask: kept.mask,
            newest: kept.newest,
            more: kept.more,
            ..Head::new(Kind::Piece, 1)
        };
        let kept = |number: u64| memory.kept.get(number as usize).unwrap();
        for number in [0, 1999] {
            order
                .take(&head(number, kept(number)), true, kept(number).data.clone().into(), |_, message| {
                    got.push(message.into_vec())
                })
                .unwrap();
        }
        let mut rounds = 0;
        while let Some((number, until)) = order.ask(PATIENCE * 2 * rounds) {
            rounds += 1;
            for again in memory.again_to(&Head { number, until, ..Head::new(Kind::Again, 1) }, 1).unwrap() {
                match again {
                    Again::Piece(number, kept) => order
                        .take(&head(number, kept), true, kept.data.clone().into(), |_, message| {
                            got.push(message.into_vec())
                        })
                        .unwrap(),
                    Again::Nothing(from, until) => {
                        order.skip(from, until, |_, message| got.push(message.into_vec())).unwrap()
                    }
                }
            }
            assert!(rounds < 4, "asked again and again");
        }
        let twice = |message: u64| [message.to_le_bytes(), message.to_le_bytes()].concat();
        assert_eq!((got, order.next(), order.pending_bytes), (vec![twice(400), twice(999)], 2000, 0));
    }

    #[test]
    fn numbers_at_the_end_of_u64_are_taken() {
        let head = |number| Head { number, ..Head::new(Kind::Piece, 1) };
        let (mut order, mut got) = (Order::new(u64::MAX - 2), 0);
        order.take(&head(u64::MAX), true, vec![1].into(), |_, _| got += 1).unwrap();
        assert_eq!(order.ask(Duration::ZERO), Some((u64::MAX - 2, u64::MAX)));
        for number in [u64::MAX - 2, u64::MAX - 1, u64::MAX] {
            order.take(&head(number), true, vec![1].into(), |_, _| got += 1).unwrap();
        }
        assert!(got >= 3 && order.next() == u64::MAX);
    }

    #[test]
    fn what_is_forgotten_cannot_be_asked_for() {
        let mut memory = Memory::default();
        for _ in 0..10 {
            memory.keep(1, false, false, &[0]);
        }
        memory.forget_before(4);
        let asked = |number| Head { number, until: u64::MAX, ..Head::new(Kind::Again, 1) };
        assert!(memory.again(&asked(3)).is_none());
        assert_eq!(memory.again(&asked(7)).unwrap().map(|(number, _)| number).collect::<Vec<_>>(), [7, 8, 9]);
        assert_eq!(memory.trim(3), 7);
    }
}
