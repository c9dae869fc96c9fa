//! Format of every datagram: a header that can be checked without a key, and the authentication
//! tag.
//!
//! All numbers are little-endian.
//!
//! | byte | size | content |
//! |---|---|---|
//! | 0 | 2 | magic `74 db` |
//! | 2 | 1 | version, [`VERSION`] (upper four bits), and [`PacketKind`] (lower four) |
//! | 3 | 2 | length of the whole datagram |
//! | 5 | 4 | CRC-32 of all bytes except these four: distinguishes a damaged packet from a forged one |
//! | 9 | 4 | session (in a Hello: the probed one, or 0) |
//! | 13 | 4 | lower half of the sequence number of this packet within its session and direction |
//! | 17 | n | body: encrypted in [`PacketKind::Data`], plain in the others |
//! | 17 + n | 16 | tag: Poly1305 in [`PacketKind::Data`], keyed BLAKE3 in the others |
//!
//! The tag covers the whole header except the checksum, so no field can be changed. The nonce of
//! the encryption is the full sequence number of 64 bits. Its upper half follows from the packets
//! before ([`full_sequence`]); if that guess is wrong, the tag does not match.

use crate::sync::transport::Refused;

/// Version of the protocol; datagrams of other versions are refused.
pub const VERSION: u8 = 2;
/// Maximum length of a datagram (UDP payload), bytes. It fits every path with an MTU of 1280 bytes,
/// the minimum of IPv6.
pub const MAX_DATAGRAM: usize = 1200;
/// Length of the header, bytes.
pub const HEADER_BYTES: usize = 17;
/// Length of the tag, bytes.
pub const TAG_BYTES: usize = 16;

const MAGIC: [u8; 2] = [0x74, 0xdb];
const CHECKSUM: std::ops::Range<usize> = 5..9;

/// Kind of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PacketKind {
    /// Facet: request to connect, padded so that no answer is larger than its request.
    Hello = 1,
    /// Server: request to prove that the facet receives at its address. The server keeps no state.
    Challenge = 2,
    /// Facet: the proof.
    Answer = 3,
    /// Server: the session.
    Welcome = 4,
    /// Both: encrypted frames.
    Data = 6,
}

const PACKET_KINDS: [PacketKind; 5] =
    [PacketKind::Hello, PacketKind::Challenge, PacketKind::Answer, PacketKind::Welcome, PacketKind::Data];

/// Header of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PacketHeader {
    /// Kind of the datagram.
    pub kind: PacketKind,
    /// Number of the session.
    pub session: u32,
    /// Sequence number; [`parse`] returns its lower half only.
    pub sequence: u64,
}

/// Returns the session in the header of a datagram that [`parse`] accepted.
pub fn session_of(datagram: &[u8]) -> u32 {
    u32_at(datagram, 9)
}

/// Parses the header without looking at the body. Needs no key and no allocation.
///
/// # Errors
/// The length, magic, version, checksum or kind is wrong.
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

/// Returns the number with this lower half that is nearest to `near`.
pub fn full_sequence(lower: u32, near: u64) -> u64 {
    let same = near & !u64::from(u32::MAX) | u64::from(lower);
    let others = [same.checked_sub(1 << 32), same.checked_add(1 << 32)];
    others
        .into_iter()
        .flatten()
        .fold(same, |best, other| if other.abs_diff(near) < best.abs_diff(near) { other } else { best })
}

/// Clears `datagram` and writes the header. [`set_length`] and [`finish`] set length and checksum.
pub fn begin(datagram: &mut Vec<u8>, header: PacketHeader) {
    datagram.clear();
    datagram.extend_from_slice(&MAGIC);
    datagram.push(VERSION << 4 | header.kind as u8);
    datagram.extend_from_slice(&[0; 6]);
    datagram.extend_from_slice(&header.session.to_le_bytes());
    datagram.extend_from_slice(&(header.sequence as u32).to_le_bytes());
}

/// Sets the length of the datagram with its tag; must precede the tag, which covers the length.
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

/// Returns the header bytes that the tag covers: all except the checksum.
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
    fn the_upper_half_of_a_number_is_that_of_its_neighbors() {
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
