//! Reassembly of messages from fragments, with limits.
//!
//! A message is complete when each fragment has arrived or follows from the parity of its group.
//! Reliable messages leave in the order of their numbers. A newest message leaves when it is
//! complete, and all earlier ones are discarded.
//!
//! Memory is allocated for bytes that have arrived, never for announced ones.

use super::frames::{Channel, FRAGMENT_BYTES, MessageInfo, before};
use crate::sync::transport::{Delivery, MAX_QUEUED_BYTES};
use std::collections::{BTreeMap, VecDeque};

/// Maximum number of reliable messages in flight; the sender starts no more.
pub const MAX_RELIABLE_IN_FLIGHT: u32 = 256;
/// Maximum number of newest messages in flight; the sender starts no more.
pub const MAX_NEWEST_IN_FLIGHT: u32 = 4;
/// Maximum size of the messages in flight, bytes; the sender starts no more, or one larger message
/// alone.
pub const MAX_BYTES_IN_FLIGHT: usize = 32 << 20;

/// A message that is being reassembled.
struct Assembly {
    part: MessageInfo,
    fragments: BTreeMap<u16, Box<[u8]>>,
    parity: BTreeMap<u16, Box<[u8]>>,
    groups: u16,
}

/// A fragment or parity frame contradicts the limits or an earlier frame.
#[derive(Debug, PartialEq, Eq)]
pub struct ConflictingFragment;

/// Received messages of one connection.
pub struct Inbox {
    /// First incomplete message (reliable), and the one after the last delivered (newest).
    next: [u32; 2],
    first: u32,
    assemblies: [BTreeMap<u32, Assembly>; 2],
    held: usize,
    ready: VecDeque<(Delivery, Vec<u8>)>,
    ready_bytes: usize,
    superseded: u64,
}

impl Inbox {
    /// Creates an empty inbox. Message numbers begin at `first`, which is 0 except in tests of the
    /// wrap.
    pub fn new(first: u32) -> Inbox {
        Inbox {
            first,
            next: [first; 2],
            assemblies: Default::default(),
            held: 0,
            ready: VecDeque::new(),
            ready_bytes: 0,
            superseded: 0,
        }
    }

    /// Returns the first message number.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Returns the message numbers of an acknowledgement: all messages before these are complete.
    pub fn complete(&self) -> [u32; 2] {
        self.next
    }

    /// Returns the number of newest messages superseded since the last call.
    pub fn take_superseded(&mut self) -> u64 {
        std::mem::take(&mut self.superseded)
    }

    /// Returns the next message.
    pub fn pop(&mut self) -> Option<(Delivery, Vec<u8>)> {
        let (delivery, message) = self.ready.pop_front()?;
        self.ready_bytes -= message.len();
        self.release();
        Some((delivery, message))
    }

    /// Takes a fragment. One of a complete message is ignored: it was resent.
    pub fn fragment(&mut self, part: MessageInfo, index: u16, data: &[u8]) -> Result<(), ConflictingFragment> {
        let Some(assembly) = self.assembly(part)? else { return Ok(()) };
        if assembly.fragments.contains_key(&index) {
            return Ok(());
        }
        assembly.fragments.insert(index, data.into());
        let recovered = if assembly.groups > 0 { assembly.recover(index % assembly.groups) } else { 0 };
        self.held += data.len() + recovered;
        self.release_if_complete(part);
        Ok(())
    }

    /// Takes the parity of a group of fragments.
    pub fn parity(
        &mut self,
        part: MessageInfo,
        group: u16,
        groups: u16,
        data: &[u8],
    ) -> Result<(), ConflictingFragment> {
        let Some(assembly) = self.assembly(part)? else { return Ok(()) };
        if assembly.groups != 0 && assembly.groups != groups {
            return Err(ConflictingFragment);
        }
        assembly.groups = groups;
        if assembly.parity.insert(group, data.into()).is_some() {
            return Ok(());
        }
        let recovered = assembly.recover(group);
        self.held += data.len() + recovered;
        self.release_if_complete(part);
        Ok(())
    }

    /// Returns the assembly of a message, created if needed; `None` if the message is already
    /// complete.
    fn assembly(&mut self, part: MessageInfo) -> Result<Option<&mut Assembly>, ConflictingFragment> {
        let channel = part.channel as usize;
        let ahead = if part.channel == Channel::Reliable { MAX_RELIABLE_IN_FLIGHT } else { 1 << 24 };
        if before(part.message, self.next[channel]) {
            return Ok(None);
        }
        // twice the sender's limit, because messages that it counts as done may still be held here
        if part.message.wrapping_sub(self.next[channel]) >= ahead || self.held > 2 * MAX_BYTES_IN_FLIGHT {
            return Err(ConflictingFragment);
        }
        if part.channel == Channel::Newest {
            self.make_room(part.message);
        }
        let begun = || Assembly { part, fragments: BTreeMap::new(), parity: BTreeMap::new(), groups: 0 };
        let assembly = self.assemblies[channel].entry(part.message).or_insert_with(begun);
        if assembly.part == part { Ok(Some(assembly)) } else { Err(ConflictingFragment) }
    }

    /// Discards the oldest newest messages beyond twice the sender's limit.
    fn make_room(&mut self, message: u32) {
        let assemblies = &mut self.assemblies[Channel::Newest as usize];
        while assemblies.len() >= 2 * MAX_NEWEST_IN_FLIGHT as usize && !assemblies.contains_key(&message) {
            let next = self.next[Channel::Newest as usize];
            let Some(oldest) = assemblies.keys().copied().min_by_key(|k| k.wrapping_sub(next)) else { return };
            if let Some(gone) = assemblies.remove(&oldest) {
                self.held -= gone.held();
            }
        }
    }

    fn release_if_complete(&mut self, part: MessageInfo) {
        let channel = part.channel as usize;
        if !self.assemblies[channel].get(&part.message).is_some_and(Assembly::is_complete) {
            return;
        }
        if part.channel == Channel::Newest
            && let Some(assembly) = self.assemblies[channel].remove(&part.message)
        {
            self.held -= assembly.held();
            let gone: Vec<u32> =
                self.assemblies[channel].keys().copied().filter(|k| before(*k, part.message)).collect();
            for gone in gone.iter().filter_map(|k| self.assemblies[channel].remove(k)) {
                self.held -= gone.held();
            }
            self.superseded += u64::from(part.message.wrapping_sub(self.next[channel]));
            self.next[channel] = part.message.wrapping_add(1);
            self.deliver_newest(assembly.join());
        }
        self.release();
    }

    /// Queues a newest message; it replaces one that still waits.
    fn deliver_newest(&mut self, message: Vec<u8>) {
        if let Some(waiting) = self.ready.iter().position(|(delivery, _)| *delivery == Delivery::Newest)
            && let Some((_, old)) = self.ready.remove(waiting)
        {
            self.ready_bytes -= old.len();
            self.superseded += 1;
        }
        self.ready_bytes += message.len();
        self.ready.push_back((Delivery::Newest, message));
    }

    /// Queues complete reliable messages in order, as long as the caller takes them.
    fn release(&mut self) {
        let next = &mut self.next[Channel::Reliable as usize];
        let assemblies = &mut self.assemblies[Channel::Reliable as usize];
        while self.ready_bytes < MAX_QUEUED_BYTES && assemblies.get(next).is_some_and(Assembly::is_complete) {
            let Some(assembly) = assemblies.remove(next) else { return };
            self.held -= assembly.held();
            let message = assembly.join();
            self.ready_bytes += message.len();
            self.ready.push_back((Delivery::Reliable, message));
            *next = next.wrapping_add(1);
        }
    }
}

impl Assembly {
    fn is_complete(&self) -> bool {
        self.fragments.len() == usize::from(self.part.fragments())
    }

    fn held(&self) -> usize {
        self.fragments.values().chain(self.parity.values()).map(|piece| piece.len()).sum()
    }

    fn join(self) -> Vec<u8> {
        let mut message = Vec::with_capacity(self.part.total as usize);
        self.fragments.values().for_each(|piece| message.extend_from_slice(piece));
        message
    }

    /// Recovers the only missing fragment of a group: `missing = parity ⊕ the others`. Returns its
    /// length, or 0.
    fn recover(&mut self, group: u16) -> usize {
        let Some(parity) = self.parity.get(&group) else { return 0 };
        let members = (group..self.part.fragments()).step_by(usize::from(self.groups));
        let mut missing = members.clone().filter(|index| !self.fragments.contains_key(index));
        let (Some(lost), None) = (missing.next(), missing.next()) else { return 0 };
        let mut piece = parity.clone();
        for other in members.filter_map(|index| self.fragments.get(&index)) {
            xor(&mut piece, other);
        }
        let length = self.part.length(lost);
        self.fragments.insert(lost, piece[..length].into());
        length
    }
}

/// Computes `into ^= other`, with a shorter `other` padded with zeros.
pub fn xor(into: &mut [u8], other: &[u8]) {
    into.iter_mut().zip(other).for_each(|(a, b)| *a ^= b);
}

/// Returns the parity of a group of a message's fragments.
pub fn parity(message: &[u8], group: u16, groups: u16) -> [u8; FRAGMENT_BYTES] {
    let mut parity = [0; FRAGMENT_BYTES];
    message
        .chunks(FRAGMENT_BYTES)
        .skip(usize::from(group))
        .step_by(usize::from(groups))
        .for_each(|fragment| xor(&mut parity, fragment));
    parity
}
