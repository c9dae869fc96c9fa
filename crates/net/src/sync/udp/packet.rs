//! The outside of every datagram: a header that can be checked before any key is used, and the seal.
//!
//! All numbers are little-endian.
//!
//! | byte | size | what |
//! |---|---|---|
//! | 0 | 2 | magic `74 db` |
//! | 2 | 1 | version, [`VERSION`] (upper four bits), and [`PacketKind`] (lower four) |
//! | 3 | 2 | length of the whole datagram |
//! | 5 | 4 | CRC-32 of all bytes but these four: tells a packet damaged on its way from a forged one |
//! | 9 | 4 | session (in a Hello: the one in doubt; 0 where there is none) |
//! | 13 | 4 | sequence, its lower half: the number of this packet within its session and direction |
//! | 17 | n | body: sealed in [`PacketKind::Data`], plain in the others |
//! | 17 + n | 16 | tag: Poly1305 in [`PacketKind::Data`], keyed BLAKE3 in the others |
//!
//! Everything of the header but the checksum is associated data of the tag, so none of it can be changed. The whole sequence number, 64 bits, is the nonce of
//! the seal; its upper half follows from what came before ([`full_sequence`]), and where that guess is wrong the seal does not fit.

use crate::sync::transport::Refused;

/// The protocol's version; a datagram of another one is refused.
pub const VERSION: u8 = 2;
/// Most bytes of a datagram (payload of UDP): passes every path of 1280 bytes, which IPv6 demands.
pub const MAX_DATAGRAM: usize = 1200;
/// Bytes before the body.
pub const HEADER_BYTES: usize = 17;
/// Bytes after the body.
pub const TAG_BYTES: usize = 16;

const MAGIC: [u8; 2] = [0x74, 0xdb];
const CHECKSUM: std::ops::Range<usize> = 5..9;

/// What a datagram is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PacketKind {
    /// Facet: I am here. Padded, so that no answer is larger than what asked for it.
    Hello = 1,
    /// Server: prove that you receive at this address. It keeps nothing.
    Challenge = 2,
    /// Facet: the proof.
    Answer = 3,
    /// Server: your session.
    Welcome = 4,
    /// Either: sealed frames.
    Data = 6,
}

const PACKET_KINDS: [PacketKind; 5] =
    [PacketKind::Hello, PacketKind::Challenge, PacketKind::Answer, PacketKind::Welcome, PacketKind::Data];

/// What the header says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PacketHeader {
    /// What the datagram is for.
    pub kind: PacketKind,
    /// Whose it is.
    pub session: u32,
    /// Its number; as [`parse`] reads it only the lower half.
    pub sequence: u64,
}

/// The session that a header names: of a datagram that [`parse`] took.
pub fn session_of(datagram: &[u8]) -> u32 {
    u32_at(datagram, 9)
}

/// Reads the header; looks at nothing else. Cheap: no key, no allocation.
pub fn parse(datagram: &[u8]) -> Result<PacketHeader, Refused> {
    if datagram.len() < HEADER_BYTES + TAG_BYTES {
        return Err(Refused::Truncated);
    }
    if datagram.len() > MAX_DATAGRAM {
        return Err(Refused::Oversize);
    }
    if datagram[..2] != MAGIC || datagram[2] >> 4 != VERSION {
        return Err(Refused::Foreign);
    }
    let claimed = usize::from(u16::from_le_bytes([datagram[3], datagram[4]]));
    if claimed > datagram.len() {
        return Err(Refused::Truncated);
    }
    if claimed < datagram.len() {
        return Err(Refused::Oversize);
    }
    if u32_at(datagram, CHECKSUM.start) != checksum(datagram) {
        return Err(Refused::Torn);
    }
    let kind = PACKET_KINDS.into_iter().find(|kind| *kind as u8 == datagram[2] & 15).ok_or(Refused::Foreign)?;
    Ok(PacketHeader { kind, session: u32_at(datagram, 9), sequence: u64::from(u32_at(datagram, 13)) })
}

/// The whole number whose lower half this is, nearest to `near`.
pub fn full_sequence(lower: u32, near: u64) -> u64 {
    let same = near & !u64::from(u32::MAX) | u64::from(lower);
    let others = [same.checked_sub(1 << 32), same.checked_add(1 << 32)];
    others
        .into_iter()
        .flatten()
        .fold(same, |best, other| if other.abs_diff(near) < best.abs_diff(near) { other } else { best })
}

/// Clears `datagram` and writes the header into it; `seal_off` or [`finish`] set length and checksum.
pub fn begin(datagram: &mut Vec<u8>, header: PacketHeader) {
    datagram.clear();
    datagram.extend_from_slice(&MAGIC);
    datagram.push(VERSION << 4 | header.kind as u8);
    datagram.extend_from_slice(&[0; 6]);
    datagram.extend_from_slice(&header.session.to_le_bytes());
    datagram.extend_from_slice(&(header.sequence as u32).to_le_bytes());
}

/// Sets the length that the datagram will have with its tag. Before the tag is made, because the tag covers it.
pub fn set_length(datagram: &mut [u8]) {
    let length = (datagram.len() + TAG_BYTES) as u16;
    datagram[3..5].copy_from_slice(&length.to_le_bytes());
}

/// Appends the tag, then sets the checksum.
pub fn finish(datagram: &mut Vec<u8>, tag: &[u8; TAG_BYTES]) {
    datagram.extend_from_slice(tag);
    let sum = checksum(datagram);
    datagram[CHECKSUM].copy_from_slice(&sum.to_le_bytes());
}

/// What of the header the tag covers: all but the checksum.
pub fn associated(datagram: &[u8]) -> [u8; HEADER_BYTES - 4] {
    let mut covered = [0; HEADER_BYTES - 4];
    covered[..CHECKSUM.start].copy_from_slice(&datagram[..CHECKSUM.start]);
    covered[CHECKSUM.start..].copy_from_slice(&datagram[CHECKSUM.end..HEADER_BYTES]);
    covered
}

fn checksum(datagram: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&datagram[..CHECKSUM.start]);
    hasher.update(&datagram[CHECKSUM.end..]);
    hasher.finalize()
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

#[cfg(test)]
mod tests {
    use super::full_sequence;

    #[test]
    fn the_upper_half_of_a_number_is_that_of_its_neighbours() {
        let corners = [
            0u64,
            1,
            200,
            (1 << 31) - 1,
            1 << 31,
            (1 << 32) - 1,
            1 << 32,
            7 << 32 | 5,
            u64::MAX - (1 << 31),
            u64::MAX - 1,
            u64::MAX,
        ];
        for near in corners {
            for step in [0u64, 1, 255, (1 << 31) - 1] {
                for number in [near.checked_sub(step), near.checked_add(step)].into_iter().flatten() {
                    assert_eq!(full_sequence(number as u32, near), number, "near {near}");
                }
            }
        }
    }
}
