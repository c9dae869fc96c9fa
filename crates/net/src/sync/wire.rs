//! Header of every message: the engine header of the thesis (§IV.A.6, Fig. 13) with the fields of
//! NetSync behind it.
//!
//! | byte | field | |
//! |---|---|---|
//! | 0 | name | 64 bytes, `Engine` and zeros |
//! | 64 | size | u64, of the whole message |
//! | 72 | magic | `NSyn` |
//! | 76 | version | u16, [`VERSION`] |
//! | 78 | kind | u8, [`MessageKind`] |
//! | 79 | | zero |
//! | 80 | run | u64, number of the server's run; 0 from a facet that does not know it |
//! | 88 | join | u64, number of the facet's join that the message belongs to; 0 for all |
//! | 96 | frame | u64, wraps |
//! | 104 | time | f64, simulated time, s |
//! | 112 | hash | XXH3 (128 bits) of the payload, seeded by the XXH3 (64 bits) of bytes 72 to 112 |
//! | 128 | payload | |
//!
//! All numbers are little-endian. Every byte is checked: a message with any bit flipped is refused.
//! The hash detects damage and torn reads. Against forgery the transport authenticates its packets.

use super::transport::MAX_MESSAGE_BYTES;
use xxhash_rust::xxh3::{xxh3_64, xxh3_128_with_seed};

/// Version of all messages. Later versions keep the header up to this field.
pub const VERSION: u16 = 10;
/// Length of the header, bytes.
pub const HEADER_BYTES: usize = 128;
/// Length of the name in the header, bytes, the last one zero (thesis §IV.A.6).
const ENGINE_BYTES: usize = 64;
const MAGIC: [u8; 4] = *b"NSyn";
const ENGINE_FIELD: [u8; ENGINE_BYTES] = {
    let (mut field, engine) = ([0; ENGINE_BYTES], b"Engine");
    field.split_at_mut(engine.len()).0.copy_from_slice(engine);
    field
};

/// Hash of 16 bytes: XXH3 of messages and drawn states, the first half of a BLAKE3 hash of
/// pictures.
pub type Hash = [u8; 16];

/// Kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum MessageKind {
    /// Facet: request to join.
    Join = 1,
    /// Server: refusal to join, with the reason.
    Refused = 2,
    /// Server: the object table.
    Snapshot = 3,
    /// Server: the state of a frame.
    State = 4,
    /// Facet: the frame is drawn.
    Ready = 5,
    /// Server: present the frame.
    Present = 6,
    /// Facet: the frame is presented.
    Presented = 7,
    /// Facet: request to send the snapshot again.
    Resync = 8,
    /// Server: the join is unknown; join again.
    Rejoin = 9,
    /// Both: sign of life.
    Heartbeat = 10,
    /// Server: the run is over.
    End = 11,
    /// Facet: it leaves the run.
    Leave = 12,
    /// Facet: input of a user.
    Input = 13,
    /// Server: a whole world with its users, for a facet that steps by itself.
    World = 14,
    /// Server: everything that acts on the world in a frame, for the same.
    Step = 15,
    /// Facet: hashes of its objects after a frame whose hash differs from the server's.
    Differs = 16,
}

impl MessageKind {
    /// Every kind, in the order of their codes.
    pub const ALL: [MessageKind; 16] = [
        MessageKind::Join,
        MessageKind::Refused,
        MessageKind::Snapshot,
        MessageKind::State,
        MessageKind::Ready,
        MessageKind::Present,
        MessageKind::Presented,
        MessageKind::Resync,
        MessageKind::Rejoin,
        MessageKind::Heartbeat,
        MessageKind::End,
        MessageKind::Leave,
        MessageKind::Input,
        MessageKind::World,
        MessageKind::Step,
        MessageKind::Differs,
    ];
}

/// Reason for which a message was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// Shorter than its header, or than the header says.
    #[error("a message of {got} bytes, expected {expected}")]
    Truncated {
        /// Bytes received.
        got: usize,
        /// Bytes expected.
        expected: u64,
    },
    /// Longer than allowed, or than the header says.
    #[error("a message of {got} bytes, at most {max} are allowed")]
    Oversize {
        /// Bytes received.
        got: u64,
        /// Maximum number of bytes.
        max: u64,
    },
    /// Not a NetSync message.
    #[error("not a NetSync message: {0}")]
    Foreign(&'static str),
    /// Another version of NetSync.
    #[error("a message of NetSync version {0}; this is version {VERSION}")]
    Version(u16),
    /// Wrong hash: damaged, or read while it was written.
    #[error("a message with a wrong hash")]
    Torn,
    /// The header is valid and the payload is not.
    #[error("not a message: {0}")]
    Malformed(&'static str),
    /// The content does not fit the scene.
    #[error("does not fit the scene: {0}")]
    Unfit(String),
}

/// Header of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MessageHeader {
    /// Kind of the message.
    pub kind: MessageKind,
    /// Number of the server's run.
    pub run: u64,
    /// Number of the facet's join.
    pub join: u64,
    /// Frame number.
    pub frame: u64,
    /// Simulated time, s; finite.
    pub time_s: f64,
}

/// Encodes a message: the header, then the payload that `write` appends.
pub fn message(header: &MessageHeader, write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEADER_BYTES + 64);
    out.extend(ENGINE_FIELD);
    out.extend([0; 8]);
    out.extend(MAGIC);
    out.extend(VERSION.to_le_bytes());
    out.extend([header.kind as u8, 0]);
    for number in [header.run, header.join, header.frame, header.time_s.to_bits()] {
        out.extend(number.to_le_bytes());
    }
    out.extend([0; 16]);
    write(&mut out);
    let (size, hash) = (out.len() as u64, hash_of(&out));
    out[64..72].copy_from_slice(&size.to_le_bytes());
    out[112..128].copy_from_slice(&hash);
    out
}

/// Parses a message from an untrusted source. Returns its header and payload.
///
/// # Errors
/// Every [`MessageError`] except `Unfit`.
pub fn open(bytes: &[u8]) -> Result<(MessageHeader, &[u8]), MessageError> {
    if bytes.len() < HEADER_BYTES {
        return Err(MessageError::Truncated { got: bytes.len(), expected: HEADER_BYTES as u64 });
    }
    if bytes.len() > MAX_MESSAGE_BYTES {
        return Err(MessageError::Oversize { got: bytes.len() as u64, max: MAX_MESSAGE_BYTES as u64 });
    }
    let mut rest = ByteReader(bytes);
    if rest.array()? != ENGINE_FIELD {
        return Err(MessageError::Foreign("the first name is not Engine"));
    }
    let size = rest.u64()?;
    if rest.array()? != MAGIC {
        return Err(MessageError::Foreign("wrong magic bytes"));
    }
    let version = rest.u16()?;
    if version != VERSION {
        return Err(MessageError::Version(version));
    }
    if (bytes.len() as u64) < size {
        return Err(MessageError::Truncated { got: bytes.len(), expected: size });
    }
    if (bytes.len() as u64) > size {
        return Err(MessageError::Oversize { got: bytes.len() as u64, max: size });
    }
    let [kind, zero] = rest.array()?;
    let numbers = [rest.u64()?, rest.u64()?, rest.u64()?, rest.u64()?];
    if rest.array()? != hash_of(bytes) {
        return Err(MessageError::Torn);
    }
    let kind = MessageKind::ALL
        .into_iter()
        .find(|k| *k as u8 == kind)
        .filter(|_| zero == 0)
        .ok_or(MessageError::Malformed("an unknown kind of message"))?;
    let header = MessageHeader {
        kind,
        run: numbers[0],
        join: numbers[1],
        frame: numbers[2],
        time_s: f64::from_bits(numbers[3]),
    };
    if !header.time_s.is_finite() {
        return Err(MessageError::Malformed("a time that is not finite"));
    }
    Ok((header, rest.0))
}

fn hash_of(message: &[u8]) -> Hash {
    xxh3_128_with_seed(&message[HEADER_BYTES..], xxh3_64(&message[72..112])).to_le_bytes()
}

/// Appends a name of any length: its number of bytes (u32), then the bytes.
pub(crate) fn put_name(out: &mut Vec<u8>, name: &str) {
    out.extend((name.len() as u32).to_le_bytes());
    out.extend(name.bytes());
}

/// Appends numbers.
pub(crate) fn put_f64(out: &mut Vec<u8>, numbers: &[f64]) {
    out.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
}

/// Reader of a payload. It never reads or allocates beyond the bytes there.
pub(crate) struct ByteReader<'a>(pub &'a [u8]);

impl<'a> ByteReader<'a> {
    #[inline]
    pub fn take(&mut self, n: u64) -> Result<&'a [u8], MessageError> {
        let short = MessageError::Malformed("unexpected end");
        let (head, rest) = usize::try_from(n).ok().and_then(|n| self.0.split_at_checked(n)).ok_or(short)?;
        self.0 = rest;
        Ok(head)
    }

    #[inline]
    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], MessageError> {
        let mut out = [0; N];
        out.copy_from_slice(self.take(N as u64)?);
        Ok(out)
    }

    pub fn u8(&mut self) -> Result<u8, MessageError> {
        self.array::<1>().map(|[b]| b)
    }

    pub fn u16(&mut self) -> Result<u16, MessageError> {
        self.array().map(u16::from_le_bytes)
    }

    #[inline]
    pub fn u32(&mut self) -> Result<u32, MessageError> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Result<u64, MessageError> {
        self.array().map(u64::from_le_bytes)
    }

    /// Reads a finite number.
    pub fn f64(&mut self) -> Result<f64, MessageError> {
        let x = f64::from_le_bytes(self.array()?);
        if x.is_finite() { Ok(x) } else { Err(MessageError::Malformed("a number that is not finite")) }
    }

    /// Reads finite numbers.
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N], MessageError> {
        let mut out = [0.0; N];
        for x in &mut out {
            *x = self.f64()?;
        }
        Ok(out)
    }

    /// Reads a name.
    pub fn name(&mut self) -> Result<&'a str, MessageError> {
        let length = self.u32()?;
        let name = self.take(length as u64)?;
        if name.is_empty() {
            return Err(MessageError::Malformed("an empty name"));
        }
        std::str::from_utf8(name).map_err(|_| MessageError::Malformed("a name that is not UTF-8"))
    }

    /// Checks that nothing is left.
    pub fn end(&self) -> Result<(), MessageError> {
        if self.0.is_empty() { Ok(()) } else { Err(MessageError::Malformed("trailing bytes")) }
    }
}

/// Returns whether frame `a` is later than `b`. Numbers wrap, so the difference must be within half
/// the range.
pub fn is_later(a: u64, b: u64) -> bool {
    a != b && a.wrapping_sub(b) < 1 << 63
}
