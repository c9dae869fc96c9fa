//! Header of every sample in shared memory: six words of 64 bits beside the message bytes, which
//! are therefore copied unchanged.
//!
//! | word | bits | content |
//! |---|---|---|
//! | 0 | 0 to 7 | [`SampleKind`] |
//! | | 8 to 15 | flags: 1 newest, 2 more of this message follows, 4 skip these numbers |
//! | | 16 to 31 | facet |
//! | | 32 to 63 | magic `shm3` |
//! | 1 | | id of the server process, a random number |
//! | 2 | | number of the facet's connection; 0 on a piece for all, its own on a resent piece |
//! | 3 | | receivers: bit k for facet k (from the server) |
//! | 4 | | number of this piece, or the first requested one |
//! | 5 | | first number not taken yet; for a resend request or a skip, the number after its last |

use crate::sync::transport::{FacetNumber, Refused};

/// A header as it lies in shared memory.
pub type HeaderWords = [u64; 6];
/// Length of the header, bytes.
pub const HEADER_BYTES: usize = size_of::<HeaderWords>();
const MAGIC: u32 = u32::from_le_bytes(*b"shm3");

/// Kind of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleKind {
    /// Facet: request to connect.
    Hello = 1,
    /// Server: connected; `number` is the first piece for the facet.
    Welcome = 2,
    /// A piece of a message.
    Piece = 3,
    /// Request to send pieces again.
    ResendRequest = 4,
    /// Sign of life.
    Ping = 5,
    /// The connection is over.
    Close = 6,
}

const SAMPLE_KINDS: [SampleKind; 6] = [
    SampleKind::Hello,
    SampleKind::Welcome,
    SampleKind::Piece,
    SampleKind::ResendRequest,
    SampleKind::Ping,
    SampleKind::Close,
];

/// Header of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleHeader {
    /// Kind of the sample.
    pub kind: SampleKind,
    /// Whether the message has newest delivery.
    pub newest: bool,
    /// Whether more pieces of this message follow.
    pub more: bool,
    /// Whether there is nothing for the receiver from `number` to before `until`.
    pub skip: bool,
    /// Sending or receiving facet.
    pub facet: FacetNumber,
    /// Id of the server process.
    pub server_id: u64,
    /// Number of the facet's connection.
    pub connection: u64,
    /// Receivers, one bit per facet.
    pub mask: u64,
    /// Number of the piece.
    pub number: u64,
    /// First number not taken yet; for a skip or a resend request, the number after its last.
    pub until: u64,
}

impl SampleHeader {
    /// Returns a header with zeros after the kind.
    pub fn new(kind: SampleKind, server_id: u64) -> SampleHeader {
        SampleHeader {
            kind,
            newest: false,
            more: false,
            skip: false,
            facet: 0,
            server_id,
            connection: 0,
            mask: 0,
            number: 0,
            until: 0,
        }
    }

    /// Encodes the header.
    pub fn words(&self) -> HeaderWords {
        let flags = u64::from(self.newest) | u64::from(self.more) << 1 | u64::from(self.skip) << 2;
        let first = self.kind as u64 | flags << 8 | u64::from(self.facet) << 16 | u64::from(MAGIC) << 32;
        [first, self.server_id, self.connection, self.mask, self.number, self.until]
    }

    /// Parses a header.
    ///
    /// # Errors
    /// [`Refused::Foreign`] for an unknown kind, magic or flag.
    pub fn parse([first, server_id, connection, mask, number, until]: HeaderWords) -> Result<SampleHeader, Refused> {
        let [kind, flags, facet @ ..] = (first as u32).to_le_bytes();
        let kind = SAMPLE_KINDS.into_iter().find(|known| *known as u8 == kind).ok_or(Refused::Foreign)?;
        if (first >> 32) as u32 != MAGIC || flags > 7 {
            return Err(Refused::Foreign);
        }
        let flag = |bit: u8| flags >> bit & 1 == 1;
        Ok(SampleHeader {
            kind,
            newest: flag(0),
            more: flag(1),
            skip: flag(2),
            facet: u16::from_le_bytes(facet),
            server_id,
            connection,
            mask,
            number,
            until,
        })
    }
}
