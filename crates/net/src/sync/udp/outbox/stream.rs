//! One outgoing stream: waiting messages, started messages, and the progress of their fragments.

use super::super::frames::{Channel, MessageInfo, before};
use super::super::inbox::{MAX_BYTES_IN_FLIGHT, MAX_NEWEST_IN_FLIGHT, MAX_RELIABLE_IN_FLIGHT};
use std::collections::VecDeque;
use std::sync::Arc;

/// Progress of a fragment.
#[derive(Clone, Copy, Default)]
pub struct Progress {
    /// Number of packets in flight that contain it.
    pub copies: u8,
    pub arrived: bool,
}

/// A started message.
pub struct Outgoing {
    pub part: MessageInfo,
    pub data: Arc<[u8]>,
    pub progress: Vec<Progress>,
    pub missing: u16,
    /// First fragment that was never sent.
    pub unsent: u16,
    /// Number of parity groups, 0 until the last fragment was sent; and the first one never sent.
    pub groups: u16,
    pub unsent_parity: u16,
}

/// One stream of messages.
pub struct Stream {
    /// Messages that were not started; at most one in the newest stream.
    pub waiting: VecDeque<Arc<[u8]>>,
    pub begun: VecDeque<Outgoing>,
    pub begun_bytes: usize,
    pub waiting_bytes: usize,
    pub next: u32,
    /// The peer has all messages before this one.
    pub done: u32,
}

impl Outgoing {
    /// Returns whether a fragment, or a parity fragment that can still help, was never sent.
    pub fn has_unsent(&self) -> bool {
        self.unsent < self.part.fragments() || (self.unsent_parity < self.groups && self.missing > 0)
    }
}

impl Stream {
    /// Creates an empty stream. Numbers begin at `first`.
    pub fn new(first: u32) -> Stream {
        Stream {
            waiting: VecDeque::new(),
            begun: VecDeque::new(),
            begun_bytes: 0,
            waiting_bytes: 0,
            next: first,
            done: first,
        }
    }

    pub fn may_begin(&self, channel: Channel) -> bool {
        let ahead = if channel == Channel::Reliable { MAX_RELIABLE_IN_FLIGHT } else { MAX_NEWEST_IN_FLIGHT };
        let Some(first) = self.waiting.front() else { return false };
        self.begun.is_empty()
            || (self.next.wrapping_sub(self.done) < ahead && self.begun_bytes + first.len() <= MAX_BYTES_IN_FLIGHT)
    }

    pub fn begin(&mut self, channel: Channel, data: Arc<[u8]>) {
        let part = MessageInfo { channel, message: self.next, total: data.len() as u32 };
        let fragments = part.fragments();
        self.next = self.next.wrapping_add(1);
        self.waiting_bytes -= data.len();
        self.begun_bytes += data.len();
        let progress = vec![Progress::default(); usize::from(fragments)];
        self.begun.push_back(Outgoing {
            part,
            data,
            progress,
            missing: fragments,
            unsent: 0,
            groups: 0,
            unsent_parity: 0,
        });
    }

    /// Returns the message if it is in progress.
    pub fn find(&mut self, message: u32) -> Option<&mut Outgoing> {
        let first = self.begun.front()?.part.message;
        self.begun.get_mut(message.wrapping_sub(first) as usize)
    }

    /// Notes that the peer has all messages before `done`.
    pub fn finish(&mut self, done: u32) {
        if before(self.done, done) {
            self.done = done;
        }
        while let Some(front) = self.begun.front().filter(|outgoing| before(outgoing.part.message, self.done)) {
            self.begun_bytes -= front.data.len();
            self.begun.pop_front();
        }
    }
}
