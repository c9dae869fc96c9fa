//! The frame around every message: the thesis's engine header (§IV.A.6, Fig. 13), and behind it what an engine must know before it reads on.
//!
//! | byte | field | |
//! |---|---|---|
//! | 0 | name | 64 bytes, `Engine` and zeros |
//! | 64 | size | u64, of the whole message |
//! | 72 | magic | `NSyn` |
//! | 76 | version | u16, [`VERSION`] |
//! | 78 | kind | u8, [`MessageKind`] |
//! | 79 | | zero |
//! | 80 | run | u64, the server's run; 0 from a facet that knows none |
//! | 88 | join | u64, the facet's joining that this is about; 0 to all |
//! | 96 | frame | u64, wraps |
//! | 104 | time | f64, simulated, s |
//! | 112 | hash | XXH3 (128 bits) of the payload, seeded by the XXH3 (64 bits) of bytes 72 to 112 |
//! | 128 | payload | |
//!
//! All numbers are little-endian, and every byte counts: a message with any bit flipped is refused. The hash finds damage and torn reads; against
//! forgery stands the seal of the transport.

use super::transport::MAX_MESSAGE_BYTES;
use xxhash_rust::xxh3::{xxh3_64, xxh3_128_with_seed};

/// Version of all messages; the frame up to here stays as it is in later ones.
pub const VERSION: u16 = 2;
/// Bytes before the payload.
pub const HEADER_BYTES: usize = 128;
/// Bytes of a name, the last one zero (thesis §IV.A.6).
pub const NAME_BYTES: usize = 64;
const MAGIC: [u8; 4] = *b"NSyn";
const ENGINE: &str = "Engine";

/// Sixteen bytes that tell what differs: of a message or of what was drawn an XXH3, of a picture the first of a BLAKE3.
pub type Hash = [u8; 16];

/// What a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum MessageKind {
    /// Facet: let me in.
    Join = 1,
    /// Server: no, and why.
    Refused = 2,
    /// Server: all objects by name.
    Snapshot = 3,
    /// Server: a frame.
    State = 4,
    /// Facet: this frame is drawn.
    Ready = 5,
    /// Server: show it.
    Present = 6,
    /// Facet: it is shown.
    Presented = 7,
    /// Facet: send the snapshot again.
    Resync = 8,
    /// Server: I do not know you; join.
    Rejoin = 9,
    /// Both: I live.
    Heartbeat = 10,
    /// Server: the run is over.
    End = 11,
    /// Facet: I go.
    Leave = 12,
    /// Facet: what the user does.
    Input = 13,
}

impl MessageKind {
    const ALL: [MessageKind; 13] = [
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
    ];
}

/// Why a message was not taken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// Shorter than its header or than it says.
    #[error("a message of {got} bytes, {wanted} are wanted")]
    Truncated {
        /// Bytes there.
        got: usize,
        /// Bytes wanted.
        wanted: u64,
    },
    /// Longer than allowed or than it says.
    #[error("a message of {got} bytes, at most {max} are allowed")]
    Oversize {
        /// Bytes there.
        got: u64,
        /// Bytes allowed.
        max: u64,
    },
    /// Not NetSync.
    #[error("not a NetSync message: {0}")]
    Foreign(&'static str),
    /// Another version of NetSync.
    #[error("a message of NetSync version {0}; this is version {VERSION}")]
    Version(u16),
    /// Its hash does not fit: damaged, or read while it was written.
    #[error("a message whose hash does not fit its bytes")]
    Torn,
    /// Sound as a frame, and yet no message.
    #[error("not a message: {0}")]
    Malformed(&'static str),
    /// It names or fits nothing here.
    #[error("does not fit the scene: {0}")]
    Unfit(String),
}

/// What stands before the payload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MessageHeader {
    /// What it is.
    pub kind: MessageKind,
    /// The server's run.
    pub run: u64,
    /// The facet's joining.
    pub join: u64,
    /// Frame number.
    pub frame: u64,
    /// Simulated time, s, finite.
    pub time_s: f64,
}

/// A message: header and the payload that `write` appends.
pub fn message(header: &MessageHeader, write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEADER_BYTES + 64);
    put_name(&mut out, ENGINE);
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

/// The header and payload of a message that nothing is known about.
///
/// # Errors
/// Any [`MessageError`] but `Unfit`.
pub fn open(bytes: &[u8]) -> Result<(MessageHeader, &[u8]), MessageError> {
    if bytes.len() < HEADER_BYTES {
        return Err(MessageError::Truncated { got: bytes.len(), wanted: HEADER_BYTES as u64 });
    }
    if bytes.len() > MAX_MESSAGE_BYTES {
        return Err(MessageError::Oversize { got: bytes.len() as u64, max: MAX_MESSAGE_BYTES as u64 });
    }
    let mut rest = ByteReader(bytes);
    if rest.name()? != ENGINE {
        return Err(MessageError::Foreign("the first name is not Engine"));
    }
    let size = rest.u64()?;
    if rest.array()? != MAGIC {
        return Err(MessageError::Foreign("the magic bytes are others"));
    }
    let version = rest.u16()?;
    if version != VERSION {
        return Err(MessageError::Version(version));
    }
    if (bytes.len() as u64) < size {
        return Err(MessageError::Truncated { got: bytes.len(), wanted: size });
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
        .ok_or(MessageError::Malformed("a kind that there is not"))?;
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

/// Appends a name of at most 63 bytes and zeros up to 64; a longer one is cut (worlds refuse longer ones).
pub(crate) fn put_name(out: &mut Vec<u8>, name: &str) {
    let end = out.len() + NAME_BYTES;
    out.extend(name.bytes().take(NAME_BYTES - 1));
    out.resize(end, 0);
}

/// Appends numbers.
pub(crate) fn put_f64(out: &mut Vec<u8>, numbers: &[f64]) {
    out.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
}

/// The unread rest of a payload. A length is believed only as far as the bytes go.
pub(crate) struct ByteReader<'a>(pub &'a [u8]);

impl<'a> ByteReader<'a> {
    #[inline]
    pub fn take(&mut self, n: u64) -> Result<&'a [u8], MessageError> {
        let short = MessageError::Malformed("it ends too early");
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

    /// A finite number.
    pub fn f64(&mut self) -> Result<f64, MessageError> {
        let x = f64::from_le_bytes(self.array()?);
        if x.is_finite() { Ok(x) } else { Err(MessageError::Malformed("a number that is not finite")) }
    }

    /// Finite numbers.
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N], MessageError> {
        let mut out = [0.0; N];
        for x in &mut out {
            *x = self.f64()?;
        }
        Ok(out)
    }

    /// A name in its 64 bytes.
    pub fn name(&mut self) -> Result<&'a str, MessageError> {
        let field = self.take(NAME_BYTES as u64)?;
        let end = field.iter().position(|&b| b == 0).ok_or(MessageError::Malformed("a name without an end"))?;
        let (name, zeros) = field.split_at(end);
        if name.is_empty() || zeros.iter().any(|&b| b != 0) {
            return Err(MessageError::Malformed("an empty name, or something behind a name's end"));
        }
        std::str::from_utf8(name).map_err(|_| MessageError::Malformed("a name that is not UTF-8"))
    }

    /// Nothing may be left.
    pub fn end(&self) -> Result<(), MessageError> {
        if self.0.is_empty() { Ok(()) } else { Err(MessageError::Malformed("it goes on after its end")) }
    }
}

/// Whether frame `a` is later than `b`, where numbers wrap: within half the range.
pub fn is_later(a: u64, b: u64) -> bool {
    a != b && a.wrapping_sub(b) < 1 << 63
}
