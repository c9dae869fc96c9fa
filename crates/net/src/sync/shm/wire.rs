//! The head of every sample in shared memory, 48 bytes, little-endian; then the bytes of the message.
//!
//! | byte | size | what |
//! |---|---|---|
//! | 0 | 1 | [`Kind`] |
//! | 1 | 1 | flags: 1 newest, 2 more of this message follows, 4 nothing for you under this number |
//! | 2 | 2 | facet |
//! | 4 | 4 | magic `shm1` |
//! | 8 | 8 | the server's reign: a number that each server process draws |
//! | 16 | 8 | the facet's connection: a number of each of its connections; 0 on a piece sent to all, its own on a piece sent again |
//! | 24 | 8 | for whom: bit k for facet k (from the server) |
//! | 32 | 8 | number of this piece, or the first that is asked for again |
//! | 40 | 8 | first number that is not taken yet, or the one after the last that is asked for again |

use crate::sync::transport::{FacetNumber, Refused};

/// Bytes before the message.
pub const HEAD: usize = 48;
const MAGIC: u32 = u32::from_le_bytes(*b"shm1");

/// What a sample is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Facet: I am here.
    Hello = 1,
    /// Server: you are connected; `number` is the first piece that is for you.
    Welcome = 2,
    /// A piece of a message.
    Piece = 3,
    /// Send these again.
    Again = 4,
    /// I live.
    Ping = 5,
    /// The connection is over.
    Close = 6,
}

const KINDS: [Kind; 6] = [Kind::Hello, Kind::Welcome, Kind::Piece, Kind::Again, Kind::Ping, Kind::Close];

/// The head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// What the sample is for.
    pub kind: Kind,
    /// Of a newest message.
    pub newest: bool,
    /// More of this message follows.
    pub more: bool,
    /// Nothing for you under this number.
    pub skip: bool,
    /// From or to which facet.
    pub facet: FacetNumber,
    /// The server's number.
    pub reign: u64,
    /// The facet's number.
    pub connection: u64,
    /// For whom.
    pub mask: u64,
    /// Number of the piece.
    pub number: u64,
    /// What is taken.
    pub until: u64,
}

impl Head {
    /// A head with zeros behind the kind.
    pub fn new(kind: Kind, reign: u64) -> Head {
        Head { kind, newest: false, more: false, skip: false, facet: 0, reign, connection: 0, mask: 0, number: 0, until: 0 }
    }

    /// Its bytes.
    pub fn bytes(&self) -> [u8; HEAD] {
        let mut out = [0; HEAD];
        out[0] = self.kind as u8;
        out[1] = u8::from(self.newest) | u8::from(self.more) << 1 | u8::from(self.skip) << 2;
        out[2..4].copy_from_slice(&self.facet.to_le_bytes());
        out[4..8].copy_from_slice(&MAGIC.to_le_bytes());
        for (at, value) in [self.reign, self.connection, self.mask, self.number, self.until].into_iter().enumerate() {
            out[8 + 8 * at..16 + 8 * at].copy_from_slice(&value.to_le_bytes());
        }
        out
    }

    /// The head of a sample, and what follows it.
    pub fn parse(sample: &[u8]) -> Result<(Head, &[u8]), Refused> {
        let (head, rest) = sample.split_first_chunk::<HEAD>().ok_or(Refused::Truncated)?;
        let u64_at = |at: usize| head[at..at + 8].iter().rev().fold(0u64, |value, byte| value << 8 | u64::from(*byte));
        let kind = KINDS.into_iter().find(|kind| *kind as u8 == head[0]).ok_or(Refused::Foreign)?;
        if head[4..8] != MAGIC.to_le_bytes() || head[1] > 7 {
            return Err(Refused::Foreign);
        }
        let flag = |bit: u8| head[1] >> bit & 1 == 1;
        let facet = u16::from_le_bytes([head[2], head[3]]);
        let [reign, connection, mask, number, until] = [8, 16, 24, 32, 40].map(u64_at);
        Ok((Head { kind, newest: flag(0), more: flag(1), skip: flag(2), facet, reign, connection, mask, number, until }, rest))
    }
}
