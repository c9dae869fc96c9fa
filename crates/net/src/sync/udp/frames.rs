//! The inside of a sealed packet: frames, one after another.
//!
//! | frame | bytes, after its first byte | what |
//! |---|---|---|
//! | 1 acknowledgement | reliable u32, newest u32, largest u64, mask 16 | all reliable messages before `reliable` and all newest ones before `newest` are there; so is packet `largest - k` for each bit k of the mask |
//! | 2 fragment | channel u8, message u32, total u32, index u16, data | bytes `1100 index …` of a message of `total` bytes |
//! | 3 parity | channel u8, message u32, total u32, group u16, groups u16, 1100 bytes | exclusive or of the fragments i with `i mod groups = group`, padded with zeros |
//! | 4 ping | | acknowledge this |
//! | 5 close | | the session is over |
//!
//! The length of a fragment follows from `total` and `index`, so there is no second number that could contradict it.

use crate::sync::transport::{Delivery, MAX_MESSAGE_BYTES};

/// Bytes of a whole fragment. With header, seal, an acknowledgement and its own head it stays below 1200.
pub const FRAGMENT: usize = 1100;
/// Bytes of an acknowledgement.
pub const ACK_BYTES: usize = 33;
/// Bytes around the data of a fragment.
pub const FRAGMENT_HEAD: usize = 12;
/// Bytes around the data of a parity frame.
pub const PARITY_HEAD: usize = 14;
/// Most frames in a packet.
const MAX_FRAMES: usize = 128;

/// Which of the two streams of messages: the index into pairs of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Every one, in order.
    Reliable = 0,
    /// The newest is what matters.
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

/// What has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ack {
    /// Messages before this one are complete, per channel.
    pub complete: [u32; 2],
    /// The largest packet taken.
    pub largest: u64,
    /// Bit k: packet `largest - k` was taken.
    pub mask: u128,
}

/// Which message, and how long it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Its stream.
    pub channel: Channel,
    /// Its number in the stream; wraps.
    pub message: u32,
    /// Its length in bytes, 1 to [`MAX_MESSAGE_BYTES`].
    pub total: u32,
}

impl Part {
    /// Number of fragments.
    pub fn fragments(&self) -> u16 {
        (self.total as usize).div_ceil(FRAGMENT) as u16
    }

    /// Length of a fragment.
    pub fn length(&self, index: u16) -> usize {
        (self.total as usize - usize::from(index) * FRAGMENT).min(FRAGMENT)
    }
}

/// A frame, with its bytes still in the packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame<'a> {
    /// What has arrived.
    Ack(Ack),
    /// A piece of a message.
    Fragment(Part, u16, &'a [u8]),
    /// Exclusive or of a group of fragments: group, number of groups, bytes.
    Parity(Part, u16, u16, &'a [u8]),
    /// Wants an acknowledgement.
    Ping,
    /// The session is over.
    Close,
}

impl Frame<'_> {
    /// Appends the frame.
    pub fn write(&self, out: &mut Vec<u8>) {
        match self {
            Frame::Ack(ack) => {
                out.push(1);
                ack.complete.iter().for_each(|next| out.extend_from_slice(&next.to_le_bytes()));
                out.extend_from_slice(&ack.largest.to_le_bytes());
                out.extend_from_slice(&ack.mask.to_le_bytes());
            }
            Frame::Fragment(part, index, data) => {
                write_part(2, part, out);
                out.extend_from_slice(&index.to_le_bytes());
                out.extend_from_slice(data);
            }
            Frame::Parity(part, group, groups, data) => {
                write_part(3, part, out);
                out.extend_from_slice(&group.to_le_bytes());
                out.extend_from_slice(&groups.to_le_bytes());
                out.extend_from_slice(data);
            }
            Frame::Ping => out.push(4),
            Frame::Close => out.push(5),
        }
    }
}

fn write_part(kind: u8, part: &Part, out: &mut Vec<u8>) {
    out.extend_from_slice(&[kind, part.channel as u8]);
    out.extend_from_slice(&part.message.to_le_bytes());
    out.extend_from_slice(&part.total.to_le_bytes());
}

/// All frames of a body, or none: a body that contradicts itself anywhere is refused whole. Allocates for at most 128 frames.
pub fn parse(mut body: &[u8]) -> Option<Vec<Frame<'_>>> {
    let mut frames = Vec::with_capacity(4);
    while !body.is_empty() {
        if frames.len() == MAX_FRAMES {
            return None;
        }
        let body = &mut body;
        frames.push(match take::<1>(body)? {
            [1] => Frame::Ack(Ack {
                complete: [u32::from_le_bytes(take(body)?), u32::from_le_bytes(take(body)?)],
                largest: u64::from_le_bytes(take(body)?),
                mask: u128::from_le_bytes(take(body)?),
            }),
            [2] => {
                let part = take_part(body)?;
                let index = u16::from_le_bytes(take(body)?);
                if index >= part.fragments() {
                    return None;
                }
                Frame::Fragment(part, index, take_slice(body, part.length(index))?)
            }
            [3] => {
                let part = take_part(body)?;
                let (group, groups) = (u16::from_le_bytes(take(body)?), u16::from_le_bytes(take(body)?));
                if group >= groups || groups >= part.fragments() {
                    return None;
                }
                Frame::Parity(part, group, groups, take_slice(body, FRAGMENT)?)
            }
            [4] => Frame::Ping,
            [5] => Frame::Close,
            _ => return None,
        });
    }
    Some(frames)
}

fn take_part(body: &mut &[u8]) -> Option<Part> {
    let channel = match take::<1>(body)? {
        [0] => Channel::Reliable,
        [1] => Channel::Newest,
        _ => return None,
    };
    let part = Part { channel, message: u32::from_le_bytes(take(body)?), total: u32::from_le_bytes(take(body)?) };
    (1..=MAX_MESSAGE_BYTES).contains(&(part.total as usize)).then_some(part)
}

fn take<const N: usize>(body: &mut &[u8]) -> Option<[u8; N]> {
    let (head, rest) = body.split_first_chunk::<N>()?;
    *body = rest;
    Some(*head)
}

fn take_slice<'a>(body: &mut &'a [u8], n: usize) -> Option<&'a [u8]> {
    let (head, rest) = body.split_at_checked(n)?;
    *body = rest;
    Some(head)
}

/// Whether `a` comes before `b` in numbers that wrap.
pub fn before(a: u32, b: u32) -> bool {
    (b.wrapping_sub(a) as i32) > 0
}
