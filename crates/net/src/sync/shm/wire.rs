//! The head of every sample in shared memory: six words of 64 bits beside the bytes of the message, so that those are copied as they are.
//!
//! | word | bits | what |
//! |---|---|---|
//! | 0 | 0 to 7 | [`SampleKind`] |
//! | | 8 to 15 | flags: 1 newest, 2 more of this message follows, 4 nothing for you under these numbers |
//! | | 16 to 31 | facet |
//! | | 32 to 63 | magic `shm3` |
//! | 1 | | the server's reign: a number that each server process draws |
//! | 2 | | the facet's connection: a number of each of its connections; 0 on a piece sent to all, its own on a piece sent again |
//! | 3 | | for whom: bit k for facet k (from the server) |
//! | 4 | | number of this piece, or the first that is asked for again |
//! | 5 | | first number that is not taken yet, or the one after the last that is asked for again, or after the last under which there is nothing |

use crate::sync::transport::{FacetNumber, Refused};

/// A head as it lies in shared memory.
pub type HeaderWords = [u64; 6];
/// Its bytes.
pub const HEADER_BYTES: usize = size_of::<HeaderWords>();
const MAGIC: u32 = u32::from_le_bytes(*b"shm3");

/// What a sample is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleKind {
    /// Facet: I am here.
    Hello = 1,
    /// Server: you are connected; `number` is the first piece that is for you.
    Welcome = 2,
    /// A piece of a message.
    Piece = 3,
    /// Send these again.
    ResendRequest = 4,
    /// I live.
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

/// The head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleHeader {
    /// What the sample is for.
    pub kind: SampleKind,
    /// Of a newest message.
    pub newest: bool,
    /// More of this message follows.
    pub more: bool,
    /// Nothing for you from `number` to before `until`.
    pub skip: bool,
    /// From or to which facet.
    pub facet: FacetNumber,
    /// The server's number.
    pub server_id: u64,
    /// The facet's number.
    pub connection: u64,
    /// For whom.
    pub mask: u64,
    /// Number of the piece.
    pub number: u64,
    /// What is taken; in a head with `skip` and in one that asks again, the end.
    pub until: u64,
}

impl SampleHeader {
    /// A head with zeros behind the kind.
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

    /// As it lies in shared memory.
    pub fn words(&self) -> HeaderWords {
        let flags = u64::from(self.newest) | u64::from(self.more) << 1 | u64::from(self.skip) << 2;
        let first = self.kind as u64 | flags << 8 | u64::from(self.facet) << 16 | u64::from(MAGIC) << 32;
        [first, self.server_id, self.connection, self.mask, self.number, self.until]
    }

    /// The head of a sample.
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
