//! Payloads of SNAPSHOT and STATE: objects by name once, by index afterwards.
//!
//! ```text
//! SNAPSHOT  revision u32 | exact u8 | 0 u8 | 0 u16 | count u32 | count times: name 64, size u64, body
//!           body: kind u8 | flags u8 | parts u16 | 20 bytes per part if it is still | looks if it is described
//! STATE     revision u32 | count u32 | count times: index u32, size u32, body
//!           body: 20 bytes per part | the object's own message | the viewer; nothing if it is not alive
//! ```
//!
//! A state has each object of the snapshot that is not still, in order: whole, or refused. Whatever changes the list (an object added, removed, a still
//! one moved) makes a new revision and a new snapshot.

use super::quantize::POSE_BYTES;
use super::wire::{ByteReader, MessageError, put_name};

/// Most objects of a scene.
pub const MAX_OBJECTS: usize = 100_000;

/// What of an object travels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntryKind {
    /// Quantised poses of its parts.
    Poses,
    /// Its own message, exact (thesis `GetData`).
    Exact,
    /// The viewer's.
    Viewer,
}

const KINDS: [EntryKind; 3] = [EntryKind::Poses, EntryKind::Exact, EntryKind::Viewer];
const ALIVE: u8 = 1;
const STATIONARY: u8 = 2;
const DESCRIBED: u8 = 4;

/// One object in a snapshot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry<'a> {
    /// Its name.
    pub name: &'a str,
    /// What of it travels.
    pub kind: EntryKind,
    /// Whether a still object is there; of others the state says.
    pub enabled: bool,
    /// It does not move: its poses are here and in no state.
    pub stationary: bool,
    /// It is not in the scene file: how it looks is here.
    pub described: bool,
    /// Number of its parts.
    pub parts: u16,
    /// Poses of a still one, then looks of a described one.
    pub body: &'a [u8],
}

impl Entry<'_> {
    /// Appends it, with its header.
    pub fn write(&self, out: &mut Vec<u8>) {
        put_name(out, self.name);
        out.extend((4 + self.body.len() as u64).to_le_bytes());
        let flag = |on: bool, bit: u8| if on { bit } else { 0 };
        out.push(self.kind as u8);
        out.push(flag(self.enabled, ALIVE) | flag(self.stationary, STATIONARY) | flag(self.described, DESCRIBED));
        out.extend(self.parts.to_le_bytes());
        out.extend(self.body);
    }
}

/// A snapshot's payload, taken apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot<'a> {
    /// Number of the list.
    pub revision: u32,
    /// For a replica: exact messages where objects have them.
    pub exact: bool,
    /// The objects.
    pub entries: Vec<Entry<'a>>,
}

/// Appends what stands before the entries.
pub(crate) fn put_snapshot_head(out: &mut Vec<u8>, revision: u32, exact: bool, count: usize) {
    out.extend(revision.to_le_bytes());
    out.extend([exact as u8, 0, 0, 0]);
    out.extend((count as u32).to_le_bytes());
}

impl<'a> Snapshot<'a> {
    /// The number of its list alone.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn revision_of(payload: &[u8]) -> Result<u32, MessageError> {
        ByteReader(payload).u32()
    }

    /// Takes a payload apart.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn parse(payload: &'a [u8]) -> Result<Snapshot<'a>, MessageError> {
        let mut rest = ByteReader(payload);
        let (revision, exact) = (rest.u32()?, rest.array()?);
        let count = rest.u32()? as usize;
        if count > MAX_OBJECTS || !matches!(exact, [0 | 1, 0, 0, 0]) {
            return Err(MessageError::Malformed("more than 100000 objects, or a flag that there is not"));
        }
        // a count is believed no further than the bytes go: an entry has 76 at least
        let mut entries = Vec::with_capacity(count.min(payload.len() / 76));
        for _ in 0..count {
            entries.push(entry(&mut rest)?);
        }
        rest.end()?;
        Ok(Snapshot { revision, exact: exact[0] == 1, entries })
    }
}

fn entry<'a>(rest: &mut ByteReader<'a>) -> Result<Entry<'a>, MessageError> {
    let name = rest.name()?;
    let size = rest.u64()?;
    let mut body = ByteReader(rest.take(size)?);
    let (kind, flags, parts) = (body.u8()?, body.u8()?, body.u16()?);
    let kind = *KINDS.get(kind as usize).ok_or(MessageError::Malformed("a kind of object that there is not"))?;
    if flags & !(ALIVE | STATIONARY | DESCRIBED) != 0 {
        return Err(MessageError::Malformed("a flag that there is not"));
    }
    let [enabled, stationary, described] = [ALIVE, STATIONARY, DESCRIBED].map(|bit| flags & bit != 0);
    if (stationary || described) && kind == EntryKind::Viewer {
        return Err(MessageError::Malformed("a viewer that is still or described"));
    }
    Ok(Entry { name, kind, enabled, stationary, described, parts, body: body.0 })
}

/// Appends what stands before the records of a state.
pub(crate) fn put_state_head(out: &mut Vec<u8>, revision: u32, count: usize) {
    out.extend(revision.to_le_bytes());
    out.extend((count as u32).to_le_bytes());
}

/// Appends a record of a state; `write` appends its body.
pub(crate) fn put_record(out: &mut Vec<u8>, index: usize, write: impl FnOnce(&mut Vec<u8>)) {
    out.extend((index as u32).to_le_bytes());
    out.extend([0; 4]);
    let start = out.len();
    write(out);
    let size = (out.len() - start) as u32;
    out[start - 4..start].copy_from_slice(&size.to_le_bytes());
}

/// The revision and the records of a state's payload, in order.
///
/// # Errors
/// [`MessageError::Malformed`], of the head here and of a record where it comes.
pub(crate) fn parse_state(payload: &[u8]) -> Result<(u32, u32, Records<'_>), MessageError> {
    let mut rest = ByteReader(payload);
    let (revision, count) = (rest.u32()?, rest.u32()?);
    Ok((revision, count, Records { rest, left: count }))
}

/// Records of a state: index and body.
pub(crate) struct Records<'a> {
    rest: ByteReader<'a>,
    left: u32,
}

impl<'a> Iterator for Records<'a> {
    type Item = Result<(usize, &'a [u8]), MessageError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.left == 0 {
            let end = self.rest.end();
            self.rest = ByteReader(&[]);
            return end.err().map(Err);
        }
        self.left -= 1;
        let mut record = || {
            let (index, size) = (self.rest.u32()?, self.rest.u32()?);
            Ok((index as usize, self.rest.take(size as u64)?))
        };
        let record = record();
        if record.is_err() {
            (self.left, self.rest) = (0, ByteReader(&[]));
        }
        Some(record)
    }
}

/// How many bytes the poses of that many parts take.
pub(crate) fn poses_bytes(parts: u16) -> usize {
    parts as usize * POSE_BYTES
}
