//! Content of a sealed packet: a sequence of frames.
//!
//! | frame | bytes, after its first byte | content |
//! |---|---|---|
//! | 1 acknowledgement | reliable u32, [newest u32], largest u32, n u8, mask n | all reliable messages before `reliable` and all newest messages before `newest` have arrived; packet `largest - k` has arrived for each bit k of the mask; packets beyond the mask are not covered |
//! | 2 whole | message u32, total u16, data | a message of at most 1120 bytes |
//! | 3 fragment | message u32, total u32, index u16, data | bytes `1120 index …` of a message of `total` bytes |
//! | 4 parity | message u32, total u32, group u16, groups u16, 1120 bytes | exclusive or of the fragments i with `i mod groups = group`, padded with zeros |
//! | 5 ping | | requests an acknowledgement |
//! | 6 close | | the session is over |
//!
//! The first byte is the number of the frame. 16 is added for a newest message (2 to 4), and for an
//! acknowledgement with `newest` (1). `largest` is the lower half of a packet number.
//!
//! The length of a fragment follows from `total` and `index`, so no second number can contradict
//! it.

use crate::sync::transport::{Delivery, MAX_MESSAGE_BYTES};

/// Length of a full fragment, bytes. With header, tag, an acknowledgement and its own header a
/// packet stays below 1200 bytes.
pub const FRAGMENT_BYTES: usize = 1120;
/// Maximum length of an acknowledgement, bytes.
pub const ACK_BYTES: usize = 30;
/// Bytes of a parity frame around its data.
pub const PARITY_HEADER_BYTES: usize = 13;
/// Added to a frame's number for newest messages.
const NEWEST: u8 = 16;
/// Maximum number of frames in a packet.
const MAX_FRAMES: usize = 128;

/// One of the two streams of messages; an index into pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Every message, in order.
    Reliable = 0,
    /// Only the newest message matters.
    Newest = 1,
}

impl From<Delivery> for Channel {
    fn from(delivery: Delivery) -> Channel {
        match delivery {
            Delivery::Reliable => Channel::Reliable,
            Delivery::Newest => Channel::Newest,
        }
    }
}

/// Acknowledgement of received packets and messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ack {
    /// All reliable messages before this one are complete.
    pub reliable: u32,
    /// All newest messages before this one are complete; `None` while none has arrived.
    pub newest: Option<u32>,
    /// The largest packet received: the lower half of its number.
    pub largest: u32,
    /// Number of mask bytes, 1 to 16.
    pub bytes: u8,
    /// Bit k: packet `largest - k` was received. Bits beyond the mask bytes are zero.
    pub mask: u128,
}

/// Number and length of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageInfo {
    /// Its stream.
    pub channel: Channel,
    /// Number in its stream; wraps.
    pub message: u32,
    /// Length in bytes, 1 to [`MAX_MESSAGE_BYTES`].
    pub total: u32,
}

impl MessageInfo {
    /// Returns the number of fragments.
    pub fn fragments(&self) -> u16 {
        (self.total as usize).div_ceil(FRAGMENT_BYTES) as u16
    }

    /// Returns the bytes of a fragment frame around its data.
    pub fn header_bytes(&self) -> usize {
        if self.fragments() == 1 { 7 } else { 11 }
    }

    /// Returns the length of a fragment, bytes.
    pub fn length(&self, index: u16) -> usize {
        (self.total as usize - usize::from(index) * FRAGMENT_BYTES).min(FRAGMENT_BYTES)
    }
}

/// A frame that borrows its bytes from the packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame<'a> {
    /// Acknowledgement.
    Ack(Ack),
    /// Fragment of a message: index and bytes.
    Fragment(MessageInfo, u16, &'a [u8]),
    /// Exclusive or of a group of fragments: group, number of groups, bytes.
    Parity(MessageInfo, u16, u16, &'a [u8]),
    /// Requests an acknowledgement.
    Ping,
    /// The session is over.
    Close,
}

impl Frame<'_> {
    /// Appends the frame.
    pub fn write(&self, out: &mut Vec<u8>) {
        match self {
            Frame::Ack(ack) => {
                out.push(1 + if ack.newest.is_some() { NEWEST } else { 0 });
                [Some(ack.reliable), ack.newest, Some(ack.largest)]
                    .iter()
                    .flatten()
                    .for_each(|n| out.extend_from_slice(&n.to_le_bytes()));
                out.push(ack.bytes);
                out.extend_from_slice(&ack.mask.to_le_bytes()[..usize::from(ack.bytes.min(16))]);
            }
            Frame::Fragment(part, _, data) if part.fragments() == 1 => {
                out.push(2 + NEWEST * part.channel as u8);
                out.extend_from_slice(&part.message.to_le_bytes());
                out.extend_from_slice(&(part.total as u16).to_le_bytes());
                out.extend_from_slice(data);
            }
            Frame::Fragment(part, index, data) => {
                write_part(3, part, out);
                out.extend_from_slice(&index.to_le_bytes());
                out.extend_from_slice(data);
            }
            Frame::Parity(part, group, groups, data) => {
                write_part(4, part, out);
                out.extend_from_slice(&group.to_le_bytes());
                out.extend_from_slice(&groups.to_le_bytes());
                out.extend_from_slice(data);
            }
            Frame::Ping => out.push(5),
            Frame::Close => out.push(6),
        }
    }
}

fn write_part(kind: u8, part: &MessageInfo, out: &mut Vec<u8>) {
    out.push(kind + NEWEST * part.channel as u8);
    out.extend_from_slice(&part.message.to_le_bytes());
    out.extend_from_slice(&part.total.to_le_bytes());
}

/// Parses all frames of a body, or none: one invalid frame invalidates the body. Allocates for at
/// most 128 frames.
pub fn parse(mut body: &[u8]) -> Option<Vec<Frame<'_>>> {
    let mut frames = Vec::with_capacity(4);
    while !body.is_empty() {
        if frames.len() == MAX_FRAMES {
            return None;
        }
        let body = &mut body;
        let [first] = take::<1>(body)?;
        let channel = if first & NEWEST == 0 { Channel::Reliable } else { Channel::Newest };
        frames.push(match (first & !NEWEST, channel) {
            (1, _) => Frame::Ack(take_ack(body, channel)?),
            (2, _) => {
                let (message, total) = (u32::from_le_bytes(take(body)?), u16::from_le_bytes(take(body)?));
                let part = MessageInfo { channel, message, total: total.into() };
                if !(1..=FRAGMENT_BYTES).contains(&usize::from(total)) {
                    return None;
                }
                Frame::Fragment(part, 0, take_slice(body, total.into())?)
            }
            (3, _) => {
                let part = take_part(body, channel)?;
                let index = u16::from_le_bytes(take(body)?);
                if index >= part.fragments() || part.fragments() == 1 {
                    return None;
                }
                Frame::Fragment(part, index, take_slice(body, part.length(index))?)
            }
            (4, _) => {
                let part = take_part(body, channel)?;
                let (group, groups) = (u16::from_le_bytes(take(body)?), u16::from_le_bytes(take(body)?));
                if group >= groups || groups >= part.fragments() {
                    return None;
                }
                Frame::Parity(part, group, groups, take_slice(body, FRAGMENT_BYTES)?)
            }
            (5, Channel::Reliable) => Frame::Ping,
            (6, Channel::Reliable) => Frame::Close,
            _ => return None,
        });
    }
    Some(frames)
}

fn take_ack(body: &mut &[u8], channel: Channel) -> Option<Ack> {
    let reliable = u32::from_le_bytes(take(body)?);
    let newest = if channel == Channel::Newest { Some(u32::from_le_bytes(take(body)?)) } else { None };
    let (largest, [bytes]) = (u32::from_le_bytes(take(body)?), take::<1>(body)?);
    let mut mask = [0; 16];
    if !(1..=16).contains(&bytes) {
        return None;
    }
    mask[..usize::from(bytes)].copy_from_slice(take_slice(body, bytes.into())?);
    Some(Ack { reliable, newest, largest, bytes, mask: u128::from_le_bytes(mask) })
}

fn take_part(body: &mut &[u8], channel: Channel) -> Option<MessageInfo> {
    let part =
        MessageInfo { channel, message: u32::from_le_bytes(take(body)?), total: u32::from_le_bytes(take(body)?) };
    (1..=MAX_MESSAGE_BYTES).contains(&(part.total as usize)).then_some(part)
}

fn take<const N: usize>(body: &mut &[u8]) -> Option<[u8; N]> {
    let (header_bytes, rest) = body.split_first_chunk::<N>()?;
    *body = rest;
    Some(*header_bytes)
}

fn take_slice<'a>(body: &mut &'a [u8], n: usize) -> Option<&'a [u8]> {
    let (header_bytes, rest) = body.split_at_checked(n)?;
    *body = rest;
    Some(header_bytes)
}

/// Returns whether `a` precedes `b`; numbers wrap.
pub fn before(a: u32, b: u32) -> bool {
    (b.wrapping_sub(a) as i32) > 0
}
