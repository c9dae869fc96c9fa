//! Contract between a session and the transport that carries its messages: shared memory, UDP, or
//! queues within a process.
//!
//! There is one server and up to [`MAX_FACETS`] facets. A facet is identified by its number in the
//! cave file, so a facet that was killed and restarted returns under the same number. A
//! *connection* lives from [`LinkEvent::Opened`] to [`LinkEvent::Closed`] on the same side. A facet
//! has at most one connection at a time.
//!
//! # The contract
//!
//! - A message is an opaque byte string of 1 to [`MAX_MESSAGE_BYTES`]. It arrives whole and
//!   unchanged or not at all.
//! - [`Delivery::Reliable`]: within a connection, every such message arrives once and in order, or
//!   the connection is closed. Nothing is guaranteed across connections: messages in flight are
//!   lost when a connection closes.
//! - [`Delivery::Newest`]: a message arrives at most once and never after a later one. It may be
//!   dropped if a later one exists or a repair would be late. The last one sent does arrive while
//!   the connection lives. Reliable and newest messages may overtake each other.
//! - No message of an earlier connection arrives after the `Opened` of a later one.
//! - `send` never blocks. If a peer has not taken [`MAX_QUEUED_BYTES`] of reliable messages, its
//!   connection is closed (`Closed::Overrun`), so a slow facet never stalls the others. Without a
//!   connection the message is dropped and counted as `unsent`, and `send` returns `false`.
//! - `recv` waits at most `timeout`, and does the link's work (retransmission, liveness). The owner
//!   of a link must call it again and again. `None` means that the timeout has passed. It does not
//!   spin.
//! - A facet's link looks for its server by itself and without end: after `Closed` it reconnects
//!   and reports `Opened`.
//! - Data of a peer is not trusted. Lengths are checked before any allocation. Refused data is
//!   counted by reason ([`Refused`]) and never ends the link. [`LinkError`] reports only failures
//!   of this side's system (a socket, shared memory).
//!
//! The session decides whether a peer may join, is late or has the right version.

use std::time::Duration;

/// Maximum number of facets of a server.
pub const MAX_FACETS: usize = 64;
/// Maximum length of a message, bytes.
pub const MAX_MESSAGE_BYTES: usize = 16 << 20;
/// Maximum size of the reliable messages that wait for one peer, bytes.
pub const MAX_QUEUED_BYTES: usize = 64 << 20;

/// Number of a facet: its index in the cave file, below [`MAX_FACETS`].
pub type FacetNumber = u16;

/// Delivery guarantee of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// Each message arrives once and in order, or the connection closes.
    Reliable,
    /// Only the newest message matters.
    Newest,
}

/// Why a connection ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Closed {
    /// The peer closed it.
    ByPeer,
    /// This side closed it ([`ServerLink::close`], [`FacetLink::close`]).
    ByUs,
    /// Nothing was received for the idle timeout.
    TimedOut,
    /// A new connection of the same facet replaced it: the facet was restarted.
    Replaced,
    /// The peer did not take the messages sent to it.
    Overrun,
}

/// Event that `recv` reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkEvent {
    /// A connection was opened.
    Opened,
    /// A message is in the buffer.
    Message,
    /// The connection was closed.
    Closed(Closed),
}

/// The server's side of a transport.
pub trait ServerLink {
    /// Sends a message to one facet. Returns `false` if there is no connection, or if the message
    /// is empty or too long.
    ///
    /// # Errors
    /// This side's system refuses.
    fn send(&mut self, to: FacetNumber, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError>;
    /// Sends a message to each facet of `to` and returns how many it was sent to. A transport that
    /// can write once for all does so.
    ///
    /// # Errors
    /// This side's system refuses.
    fn send_all(&mut self, to: &[FacetNumber], delivery: Delivery, message: &[u8]) -> Result<usize, LinkError> {
        let mut sent = 0;
        for &facet in to {
            sent += usize::from(self.send(facet, delivery, message)?);
        }
        Ok(sent)
    }
    /// Waits at most `timeout` for an event of any facet. `message` is cleared, and filled on
    /// [`LinkEvent::Message`]. Returns `None` after the timeout.
    ///
    /// # Errors
    /// This side's system fails.
    fn recv(&mut self, timeout: Duration, message: &mut Vec<u8>)
    -> Result<Option<(FacetNumber, LinkEvent)>, LinkError>;
    /// Closes a facet's connection; the facet may return. Messages sent before need not arrive.
    /// `recv` reports `Closed(ByUs)` if there was a connection.
    fn close(&mut self, facet: FacetNumber);
    /// Returns the counters of a facet's connections.
    fn counters(&self, facet: FacetNumber) -> LinkCounters;
    /// Returns the counters of refused data that belongs to no facet.
    fn unknown_peers(&self) -> LinkCounters {
        LinkCounters::default()
    }
}

/// A facet's side of a transport.
pub trait FacetLink {
    /// Sends a message to the server. Returns `false` if there is no connection, or if the message
    /// is empty or too long.
    ///
    /// # Errors
    /// This side's system refuses.
    fn send(&mut self, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError>;
    /// Waits at most `timeout` for an event of the server. `message` is cleared, and filled on
    /// [`LinkEvent::Message`]. Returns `None` after the timeout.
    ///
    /// # Errors
    /// This side's system fails.
    fn recv(&mut self, timeout: Duration, message: &mut Message) -> Result<Option<LinkEvent>, LinkError>;
    /// Closes the connection; the link then looks for a server again. `recv` reports `Closed(ByUs)`
    /// if there was a connection.
    fn close(&mut self);
    /// Returns the counters of this link.
    fn counters(&self) -> LinkCounters;
}

/// Bytes of a received message: owned, or on loan from the transport (shared memory) until this
/// value is dropped.
#[derive(Default)]
pub struct Message(Storage);

enum Storage {
    Owned(Vec<u8>),
    Loaned(Box<dyn AsRef<[u8]> + Send>),
}

impl Message {
    /// Wraps bytes on loan.
    pub fn loaned(bytes: impl AsRef<[u8]> + Send + 'static) -> Message {
        Message(Storage::Loaned(Box::new(bytes)))
    }

    /// Returns the bytes, copied if they are on loan.
    pub fn into_vec(self) -> Vec<u8> {
        match self.0 {
            Storage::Owned(bytes) => bytes,
            Storage::Loaned(bytes) => (*bytes).as_ref().to_vec(),
        }
    }

    /// Empties the message and returns its buffer if it owned one.
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

/// Reason for which received data was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refused {
    /// Shorter than its header, or than the header says.
    Truncated,
    /// Longer than allowed, or than the header says.
    Oversize,
    /// Not of this protocol, or of another version of it.
    Foreign,
    /// The authentication tag is wrong: forged, damaged, or made with another key.
    Forged,
    /// Received before.
    Replayed,
    /// Older than the replay window, or of an earlier connection.
    Stale,
    /// Contradictory fragments, or a wrong checksum.
    Torn,
    /// From an unknown address, or for a facet that the cave does not have.
    UnknownPeer,
}

impl Refused {
    /// All reasons, in the order of [`LinkCounters::refused`].
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

    /// Returns the name in lower case, as reports print it.
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

/// Counters of one link. They wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounters {
    /// Connections opened.
    pub opened: u64,
    /// Messages delivered to this side.
    pub messages_in: u64,
    /// Messages sent from this side.
    pub messages_out: u64,
    /// Bytes received, including headers.
    pub bytes_in: u64,
    /// Bytes sent, including headers and repeated packets.
    pub bytes_out: u64,
    /// Packets or fragments sent again.
    pub repeated: u64,
    /// Newest messages that a later one replaced before delivery.
    pub superseded: u64,
    /// Messages not sent because there was no connection.
    pub unsent: u64,
    /// Refused packets, in the order of [`Refused::ALL`].
    pub refused: [u64; Refused::ALL.len()],
}

impl LinkCounters {
    /// Counts refused data.
    pub fn refuse(&mut self, why: Refused) {
        let count = &mut self.refused[why as usize];
        *count = count.wrapping_add(1);
    }

    /// Returns how often data was refused for this reason.
    pub fn refused_for(&self, why: Refused) -> u64 {
        self.refused[why as usize]
    }
}

/// Failure of this side's system.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// A socket or file failed.
    #[error("{what}: {why}")]
    Io {
        /// The operation, with the address or path.
        what: String,
        /// The system's error.
        why: std::io::Error,
    },
    /// Any other failure, such as a service that cannot be opened or an invalid key.
    #[error("{0}")]
    Other(String),
}
