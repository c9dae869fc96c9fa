//! What the session asks of whatever carries its messages: shared memory, datagrams, or a simulated network.
//!
//! One server, up to [`MAX_FACETS`] facets. A facet is known by its number in the cave file, so a facet that was killed and started again comes back
//! under the same number. A *connection* lives from [`LinkEvent::Opened`] to [`LinkEvent::Closed`] on the same side; a facet has at most one at a time.
//!
//! # The contract
//!
//! - A message is opaque bytes, 1 to [`MAX_MESSAGE_BYTES`]. It arrives whole and unchanged or not at all; a link never delivers a part.
//! - [`Delivery::Reliable`]: within a connection every such message arrives, once, in the order in which it was sent, or the connection is closed.
//!   There is no promise across connections: what was under way when one closed is gone.
//! - [`Delivery::Newest`]: arrives at most once, never after a later one, and may be left out where a later one exists or a repair would be late. The
//!   last one sent does arrive while the connection lives. Reliable and newest messages may overtake each other.
//! - Nothing of an earlier connection arrives after the `Opened` of a later one.
//! - `send` never waits. Where a peer has not taken [`MAX_QUEUED_BYTES`] of reliable messages its connection is closed (`Closed::Overrun`): a slow viewer
//!   never stalls the wall. Where the link is not open a message is dropped, counted as `unsent`, and `send` says `false`.
//! - `recv` waits at most `timeout` and is also where the link does its work (retransmission, liveness): whoever holds a link calls it again and again.
//!   `None` means that the time is over. It does not spin.
//! - A facet's link looks for its server by itself and goes on for ever: after `Closed` it looks again, and tells `Opened` when it found one.
//! - What a peer sends is not trusted: lengths are checked before any allocation, and what is refused is counted by reason ([`Refused`]) and never
//!   ends the link. [`LinkError`] is for this side's own system (a socket, shared memory) alone.
//!
//! Whether a peer may draw, is late or speaks the same version is the session's business.

use std::time::Duration;

/// Most facets of a server.
pub const MAX_FACETS: usize = 64;
/// Most bytes in one message.
pub const MAX_MESSAGE_BYTES: usize = 16 << 20;
/// Most bytes of reliable messages that wait for one peer.
pub const MAX_QUEUED_BYTES: usize = 64 << 20;

/// A facet's number: its place among the facets of the cave file, below [`MAX_FACETS`].
pub type FacetNumber = u16;

/// What is promised for a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// Every one, once, in order, or the connection closes.
    Reliable,
    /// The newest is what matters.
    Newest,
}

/// Why a connection ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Closed {
    /// The other side said so.
    ByPeer,
    /// This side said so ([`ServerLink::close`], [`FacetLink::close`]).
    ByUs,
    /// Nothing was heard for too long.
    TimedOut,
    /// A new connection of the same facet took its place: it was started again.
    Replaced,
    /// It did not take what was sent to it.
    Overrun,
}

/// What `recv` reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkEvent {
    /// A connection is there.
    Opened,
    /// A message is in the buffer.
    Message,
    /// The connection is gone.
    Closed(Closed),
}

/// The server's end.
pub trait ServerLink {
    /// Sends to one facet. `false`: there is no connection, or the message is empty or too long; nothing was sent.
    ///
    /// Errors: this side's system refuses.
    fn send(&mut self, to: FacetNumber, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError>;
    /// Sends the same message to each of `to`; how many it was sent to. A transport that can write once for all does.
    fn send_all(&mut self, to: &[FacetNumber], delivery: Delivery, message: &[u8]) -> Result<usize, LinkError> {
        let mut sent = 0;
        for &facet in to {
            sent += usize::from(self.send(facet, delivery, message)?);
        }
        Ok(sent)
    }
    /// Waits at most `timeout` for something from any facet. `message` is cleared, and filled on [`LinkEvent::Message`]. `None`: time is over.
    fn recv(&mut self, timeout: Duration, message: &mut Vec<u8>)
    -> Result<Option<(FacetNumber, LinkEvent)>, LinkError>;
    /// Ends a facet's connection; it may come back. What was sent before need not arrive. `recv` reports `Closed(ByUs)` if there was one.
    fn close(&mut self, facet: FacetNumber);
    /// What happened on a facet's connections so far.
    fn counters(&self, facet: FacetNumber) -> LinkCounters;
    /// What was refused and could not be laid to any facet (a stranger's datagram).
    fn unknown_peers(&self) -> LinkCounters {
        LinkCounters::default()
    }
}

/// A facet's end.
pub trait FacetLink {
    /// Sends to the server. `false`: there is no connection, or the message is empty or too long; nothing was sent.
    ///
    /// Errors: this side's system refuses.
    fn send(&mut self, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError>;
    /// Waits at most `timeout` for something from the server. `message` is cleared, and filled on [`LinkEvent::Message`]. `None`: time is over.
    fn recv(&mut self, timeout: Duration, message: &mut Message) -> Result<Option<LinkEvent>, LinkError>;
    /// Ends the connection; the link then looks for a server anew. `recv` reports `Closed(ByUs)` if there was one.
    fn close(&mut self);
    /// What happened on this link so far.
    fn counters(&self) -> LinkCounters;
}

/// The bytes of a message that arrived: a facet's own, or lent by the transport where they lie (shared memory), until this is dropped.
#[derive(Default)]
pub struct Message(Storage);

enum Storage {
    Owned(Vec<u8>),
    Loaned(Box<dyn AsRef<[u8]> + Send>),
}

impl Message {
    /// Shows bytes that somebody lends.
    pub fn loaned(bytes: impl AsRef<[u8]> + Send + 'static) -> Message {
        Message(Storage::Loaned(Box::new(bytes)))
    }

    /// The bytes as one's own: copied if they are lent.
    pub fn into_vec(self) -> Vec<u8> {
        match self.0 {
            Storage::Owned(bytes) => bytes,
            Storage::Loaned(bytes) => (*bytes).as_ref().to_vec(),
        }
    }

    /// An empty one, and the buffer that this one had, if it had one of its own.
    pub(crate) fn clear(&mut self) -> Vec<u8> {
        match std::mem::take(&mut self.0) {
            Storage::Owned(mut buffer) => {
                buffer.clear();
                buffer
            }
            Storage::Loaned(_) => Vec::new(),
        }
    }
}

impl Default for Storage {
    fn default() -> Storage {
        Storage::Owned(Vec::new())
    }
}

impl From<Vec<u8>> for Message {
    fn from(bytes: Vec<u8>) -> Message {
        Message(Storage::Owned(bytes))
    }
}

impl std::ops::Deref for Message {
    type Target = [u8];
    fn deref(&self) -> &[u8] {
        match &self.0 {
            Storage::Owned(bytes) => bytes,
            Storage::Loaned(bytes) => (**bytes).as_ref(),
        }
    }
}

/// Why something that arrived was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refused {
    /// Shorter than its header, or than its header says.
    Truncated,
    /// Longer than allowed, or than its header says.
    Oversize,
    /// Not of this protocol, or of another version of it.
    Foreign,
    /// Its seal does not fit: forged, flipped, or of another key.
    Forged,
    /// It was taken before.
    Replayed,
    /// Older than what the replay window remembers, or of an earlier connection.
    Stale,
    /// Its fragments contradict each other, or its checksum does not fit.
    Torn,
    /// From no facet that this cave has.
    UnknownPeer,
}

impl Refused {
    /// All of them, in the order of [`LinkCounters::refused`].
    pub const ALL: [Refused; 8] = [
        Refused::Truncated,
        Refused::Oversize,
        Refused::Foreign,
        Refused::Forged,
        Refused::Replayed,
        Refused::Stale,
        Refused::Torn,
        Refused::UnknownPeer,
    ];

    /// In lower case, as reports print it.
    pub fn name(self) -> &'static str {
        match self {
            Refused::Truncated => "truncated",
            Refused::Oversize => "oversize",
            Refused::Foreign => "foreign",
            Refused::Forged => "forged",
            Refused::Replayed => "replayed",
            Refused::Stale => "stale",
            Refused::Torn => "torn",
            Refused::UnknownPeer => "unknown_peer",
        }
    }
}

/// Counts of one link. They wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounters {
    /// Connections opened.
    pub opened: u64,
    /// Messages delivered to this side.
    pub messages_in: u64,
    /// Messages sent from this side.
    pub messages_out: u64,
    /// Bytes that arrived, with everything around the messages.
    pub bytes_in: u64,
    /// Bytes that left, with everything around the messages and every repeat.
    pub bytes_out: u64,
    /// Packets (or fragments) sent again.
    pub repeated: u64,
    /// Newest messages that a later one replaced before they were delivered.
    pub superseded: u64,
    /// Messages that were not sent because there was no connection.
    pub unsent: u64,
    /// What arrived and was not taken, in the order of [`Refused::ALL`].
    pub refused: [u64; Refused::ALL.len()],
}

impl LinkCounters {
    /// Counts something that was not taken.
    pub fn refuse(&mut self, why: Refused) {
        let count = &mut self.refused[why as usize];
        *count = count.wrapping_add(1);
    }

    /// How often something was refused for this reason.
    pub fn refused_for(&self, why: Refused) -> u64 {
        self.refused[why as usize]
    }
}

/// This side's system refuses.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// A socket or file.
    #[error("{what}: {why}")]
    Io {
        /// What was tried, with the address or path.
        what: String,
        /// What the system says.
        why: std::io::Error,
    },
    /// Anything else: a service that cannot be opened, a key that is none.
    #[error("{0}")]
    Other(String),
}
