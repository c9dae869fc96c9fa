//! The server's side of the frame: a world to payloads, and the hash that a client which drew them must answer.

use super::frame_hash::FrameHasher;
use super::quantize::{get_pose, put_pose};
use super::table::{Entry, EntryKind, MAX_OBJECTS, put_record, put_snapshot_head, put_state_head};
use super::transport::MAX_MESSAGE_BYTES;
use super::viewer::{VIEWER_NAME, Viewer};
use super::visuals::put_visuals;
use super::wire::{HEADER_BYTES, Hash};
use std::sync::Arc;
use tumble_collide::Pose;
use tumble_core::{Mode, ObjectId, World};

/// Why a world cannot be sent.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PublishError {
    /// A pose that is no number.
    #[error("part {part} of '{name}' stands at a pose that is not finite")]
    NotFinite {
        /// Object.
        name: String,
        /// Its part.
        part: usize,
    },
    /// Too many objects, or one with too many parts.
    #[error("{what}: {count}, at most {max} can be sent")]
    LimitExceeded {
        /// Of what.
        what: String,
        /// How many.
        count: usize,
        /// Allowed.
        max: usize,
    },
    /// A name that the protocol needs.
    #[error("an object is named '{VIEWER_NAME}', which is the viewer's name; rename it")]
    Name,
}

/// A frame as it travels.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// Payload of STATE.
    pub state: Vec<u8>,
    /// What a client that drew it must answer.
    pub hash: Hash,
    /// Whether the list of objects is new: the snapshot goes first.
    pub fresh: bool,
    /// Poses beyond ±32768 m, which stand at the edge in the message.
    pub saturated: u32,
}

struct TableRow {
    id: ObjectId,
    kind: EntryKind,
    /// Whether its mode is static.
    fixed: bool,
    /// Fixed, and sent as poses: in the list and in no state.
    stationary: bool,
    /// Whether it is alive, of a still one.
    enabled: bool,
    parts: usize,
    /// Poses of a still one, as the world has them.
    poses: Vec<Pose>,
}

/// Makes the payloads of one kind of client: those that draw, or replicas that want exact messages.
pub struct Publisher {
    exact: bool,
    base: World,
    /// Objects of the world that was listed.
    ids: Vec<ObjectId>,
    rows: Vec<TableRow>,
    revision: u32,
    snapshot: Arc<Vec<u8>>,
    table: Hash,
    scratch: FrameHasher,
}

impl Publisher {
    /// `base`: the world as the scene file makes it, before the first step. `revision`: number before the first list's (it wraps).
    pub fn new(base: &World, exact: bool, revision: u32) -> Publisher {
        Publisher {
            exact,
            base: base.fork(),
            ids: Vec::new(),
            rows: Vec::new(),
            revision,
            snapshot: Arc::default(),
            table: [0; 16],
            scratch: FrameHasher::default(),
        }
    }

    /// Payload of SNAPSHOT, of the last [`publish`](Self::publish); empty before the first.
    pub fn snapshot(&self) -> Arc<Vec<u8>> {
        self.snapshot.clone()
    }

    /// Makes the payloads of a frame.
    ///
    /// # Errors
    /// [`PublishError`]; the list of objects is then made anew by the next call.
    pub fn publish(&mut self, world: &World, viewer: &Viewer, frame: u64) -> Result<Published, PublishError> {
        let fresh = self.snapshot.is_empty() || !self.is_current(world);
        if fresh {
            self.snapshot = Arc::default();
            self.rebuild_table(world)?;
        }
        let mut hasher = std::mem::take(&mut self.scratch).frame(frame, world.time(), self.table);
        let moving = self.rows.iter().filter(|row| !row.stationary).count() + 1;
        let mut state = Vec::with_capacity(1024 + 28 * self.rows.iter().map(|row| row.parts.max(1)).sum::<usize>());
        put_state_head(&mut state, self.revision, moving);
        let mut saturated = 0;
        for (index, row) in self.rows.iter().enumerate().filter(|(_, row)| !row.stationary) {
            let enabled = world.status(row.id).is_some_and(|s| s.enabled);
            hasher.enabled(enabled);
            let mut fine = Ok(());
            put_record(&mut state, index, |out| {
                if enabled {
                    fine = put_row(out, row, world, &mut hasher, &mut saturated);
                }
            });
            fine?;
        }
        hasher.bytes(|out| viewer.write(out));
        put_record(&mut state, self.rows.len(), |out| viewer.write(out));
        let (hash, scratch) = hasher.hash();
        self.scratch = scratch;
        check_limit("bytes of a frame", state.len() + HEADER_BYTES, MAX_MESSAGE_BYTES)?;
        Ok(Published { state, hash, fresh, saturated })
    }

    /// Whether the list is still that of the world: the same objects, and what stood still stands where it stood.
    fn is_current(&self, world: &World) -> bool {
        let same = |row: &TableRow| {
            let Some(status) = world.status(row.id) else { return false };
            let fixed = status.mode == Mode::Static;
            fixed == row.fixed
                && (!row.stationary
                    || status.enabled == row.enabled && poses(world, row.id).eq(row.poses.iter().copied()))
        };
        world.ids() == self.ids && self.rows.iter().all(same)
    }

    /// What of an object travels: kind, whether it is still, whether it is alive, parts. `None`: nothing.
    fn classify(&self, world: &World, id: ObjectId) -> Option<(EntryKind, bool, bool, usize)> {
        let (object, status) = (world.object(id)?, world.status(id)?);
        let parts = world.view().state_range(id)?.parts.len();
        let known = self.base.object(id).is_some();
        let exact = known && object.net_sync().is_some() && (self.exact || parts == 0);
        match (exact, parts) {
            (true, _) => Some((EntryKind::Exact, false, status.enabled, parts)),
            (false, 0) => None,
            _ => Some((EntryKind::Poses, status.mode == Mode::Static, status.enabled, parts)),
        }
    }

    /// Lists the objects anew and writes the snapshot.
    fn rebuild_table(&mut self, world: &World) -> Result<(), PublishError> {
        self.revision = self.revision.wrapping_add(1);
        self.rows.clear();
        for &id in world.ids() {
            if let Some((kind, stationary, enabled, parts)) = self.classify(world, id) {
                let poses = if stationary { poses(world, id).collect() } else { Vec::new() };
                let fixed = world.status(id).is_some_and(|s| s.mode == Mode::Static);
                self.rows.push(TableRow { id, kind, fixed, stationary, enabled, parts, poses });
            }
        }
        self.ids = world.ids().to_vec();
        check_limit("objects", self.rows.len() + 1, MAX_OBJECTS)?;
        let mut out = Vec::new();
        put_snapshot_head(&mut out, self.revision, self.exact, self.rows.len() + 1);
        let (mut hasher, mut body) = (std::mem::take(&mut self.scratch).table(), Vec::new());
        for row in &self.rows {
            let Some(object) = world.object(row.id) else { continue };
            let (name, described) = (object.name(), self.base.object(row.id).is_none());
            if name == VIEWER_NAME {
                return Err(PublishError::Name);
            }
            check_limit(&format!("parts of '{name}'"), row.parts, u16::MAX as usize)?;
            hasher.name(name);
            hasher.enabled(row.stationary && row.enabled);
            body.clear();
            if row.stationary {
                put_row(&mut body, row, world, &mut hasher, &mut 0)?;
            }
            if described {
                put_visuals(&mut body, object.renderable().map_or(&[], |r| r.visuals()), &self.base);
            }
            let entry = Entry {
                name,
                kind: row.kind,
                enabled: row.enabled,
                stationary: row.stationary,
                described,
                parts: row.parts as u16,
                body: &body,
            };
            entry.write(&mut out);
        }
        let viewer = Entry {
            name: VIEWER_NAME,
            kind: EntryKind::Viewer,
            enabled: true,
            stationary: false,
            described: false,
            parts: 0,
            body: &[],
        };
        viewer.write(&mut out);
        check_limit("bytes of a snapshot", out.len() + HEADER_BYTES, MAX_MESSAGE_BYTES)?;
        (self.table, self.scratch) = hasher.hash();
        self.snapshot = Arc::new(out);
        Ok(())
    }
}

/// One object's body, and what of it will be seen.
fn put_row(
    out: &mut Vec<u8>,
    row: &TableRow,
    world: &World,
    hasher: &mut FrameHasher,
    saturated: &mut u32,
) -> Result<(), PublishError> {
    let start = out.len();
    if row.kind == EntryKind::Exact {
        world.get_data(row.id, out);
        hasher.bytes(|seen| seen.extend(&out[start..]));
        return Ok(());
    }
    for (part, pose) in poses(world, row.id).enumerate() {
        let sum = pose.translation.vector.sum() + pose.rotation.coords.sum(); // finite numbers of a world sum to a finite one
        if !sum.is_finite() {
            let name = world.object(row.id).map_or(String::new(), |o| o.name().to_string());
            return Err(PublishError::NotFinite { name, part });
        }
        *saturated += u32::from(!put_pose(out, &pose));
        if let Some(Ok(sent)) = out.last_chunk().map(get_pose) {
            hasher.pose(&sent);
        }
    }
    Ok(())
}

fn poses(world: &World, id: ObjectId) -> impl Iterator<Item = Pose> + '_ {
    let part_states =
        world.view().state_range(id).and_then(|span| world.part_states().get(span.parts.clone())).unwrap_or_default();
    part_states.iter().map(|part_state| part_state.pose)
}

fn check_limit(what: &str, count: usize, max: usize) -> Result<(), PublishError> {
    if count <= max { Ok(()) } else { Err(PublishError::LimitExceeded { what: what.to_owned(), count, max }) }
}
