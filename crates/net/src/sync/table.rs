//! Payloads of SNAPSHOT and STATE. A snapshot lists the objects by name (the object table), and a
//! state refers to them by index.
//!
//! ```text
//! SNAPSHOT  revision u32 | exact u8 | 0 u8 | 0 u16 | count u32 | count times: name, size u64, body
//!           name: length u32, UTF-8
//!           body: kind u8 | flags u8 | parts u16 | 20 bytes per part if it is stationary | visuals and surface if it is described, and the
//!                 appearance of a cloud; of a described object with a message, which is a sensor, its constants
//! STATE     revision u32 | count u32 | count times: index u32, size u32, body | contacts | events | pairs that touch
//!           body: 20 bytes per part | the object's own message | the viewer | spheres; nothing if it is not enabled
//! ```
//!
//! A state holds every object of the snapshot that is not stationary, in order; a partial state is
//! refused. Every change of the table makes a new revision and a new snapshot: an object added or
//! removed, or a stationary object moved.

use super::quantize::POSE_BYTES;
use super::wire::{ByteReader, MessageError, put_name};

/// Maximum number of objects of a scene.
pub const MAX_OBJECTS: usize = 100_000;

/// How an object is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntryKind {
    /// Quantized poses of its parts.
    Poses,
    /// Its own message, exact (thesis §IV.C, `GetData`).
    Exact,
    /// The viewer.
    Viewer,
    /// Spheres of an object without parts that the scene file does not have.
    Cloud,
}

const KINDS: [EntryKind; 4] = [EntryKind::Poses, EntryKind::Exact, EntryKind::Viewer, EntryKind::Cloud];
const ALIVE: u8 = 1;
const STATIONARY: u8 = 2;
const DESCRIBED: u8 = 4;

/// An entry of the object table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry<'a> {
    /// Its name.
    pub name: &'a str,
    /// How the object is sent.
    pub kind: EntryKind,
    /// Whether a stationary object is enabled. For others the state says so.
    pub enabled: bool,
    /// The object does not move: its poses are in the table and in no state.
    pub stationary: bool,
    /// The scene file does not have the object: its visuals are in the table.
    pub described: bool,
    /// Number of its parts.
    pub parts: u16,
    /// Poses of a stationary object, then visuals of a described one.
    pub body: &'a [u8],
}

impl Entry<'_> {
    /// Appends the entry with its header.
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

/// Payload of a snapshot, parsed.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot<'a> {
    /// Number of the table.
    pub revision: u32,
    /// For a replica: exact messages of the objects that have them.
    pub exact: bool,
    /// The objects.
    pub entries: Vec<Entry<'a>>,
}

/// Appends the header before the entries.
pub(crate) fn put_snapshot_head(out: &mut Vec<u8>, revision: u32, exact: bool, count: usize) {
    out.extend(revision.to_le_bytes());
    out.extend([exact as u8, 0, 0, 0]);
    out.extend((count as u32).to_le_bytes());
}

impl<'a> Snapshot<'a> {
    /// Returns the revision alone.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn revision_of(payload: &[u8]) -> Result<u32, MessageError> {
        ByteReader(payload).u32()
    }

    /// Parses a payload.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn parse(payload: &'a [u8]) -> Result<Snapshot<'a>, MessageError> {
        let mut rest = ByteReader(payload);
        let (revision, exact) = (rest.u32()?, rest.array()?);
        let count = rest.u32()? as usize;
        if count > MAX_OBJECTS || !matches!(exact, [0 | 1, 0, 0, 0]) {
            return Err(MessageError::Malformed("more than 100000 objects, or an unknown flag"));
        }
        // the capacity is bounded by the bytes there: an entry has at least 17
        let mut entries = Vec::with_capacity(count.min(payload.len() / 17));
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
    let kind = *KINDS.get(kind as usize).ok_or(MessageError::Malformed("an unknown kind of object"))?;
    if flags & !(ALIVE | STATIONARY | DESCRIBED) != 0 {
        return Err(MessageError::Malformed("an unknown flag"));
    }
    let [enabled, stationary, described] = [ALIVE, STATIONARY, DESCRIBED].map(|bit| flags & bit != 0);
    if (stationary || described) && kind == EntryKind::Viewer {
        return Err(MessageError::Malformed("a viewer that is stationary or described"));
    }
    if kind == EntryKind::Cloud && (stationary || !described || parts > 0) {
        return Err(MessageError::Malformed("a cloud that is stationary, not described or has parts"));
    }
    Ok(Entry { name, kind, enabled, stationary, described, parts, body: body.0 })
}

/// Appends the header before the records of a state.
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

/// Returns revision, count and records of a state's payload.
///
/// # Errors
/// [`MessageError::Malformed`] of the header. The iterator returns the error of a record.
pub(crate) fn parse_state(payload: &[u8]) -> Result<(u32, u32, Records<'_>), MessageError> {
    let mut rest = ByteReader(payload);
    let (revision, count) = (rest.u32()?, rest.u32()?);
    Ok((revision, count, Records { rest, left: count }))
}

/// Iterator over the records of a state: index and body.
pub(crate) struct Records<'a> {
    rest: ByteReader<'a>,
    left: u32,
}

impl<'a> Records<'a> {
    /// Returns the bytes behind the records, after the last one was read.
    pub fn rest(self) -> &'a [u8] {
        self.rest.0
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = Result<(usize, &'a [u8]), MessageError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.left == 0 {
            return None;
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

/// Returns the number of bytes of the poses of `parts` parts.
pub(crate) fn poses_bytes(parts: u16) -> usize {
    parts as usize * POSE_BYTES
}
