//! A facet's copy of the world: built from the scene file, updated by messages, drawn and never
//! stepped.

use super::cloud::{get_cloud, put_cloud};
use super::contacts::{get_contacts, put_contacts};
use super::events::{get_events, put_events};
use super::frame_hash::FrameHasher;
use super::publisher::put_message;
use super::quantize::get_pose;
use super::render_proxy::RenderProxy;
use super::sensors::get_sensor;
use super::table::{Entry, EntryKind, Snapshot, parse_state, poses_bytes};
use super::touching::{get_touching, put_touching};
use super::viewer::{VIEWER_NAME, Viewer};
use super::visuals::get_looks;
use super::wire::{ByteReader, Hash, MessageError};
use std::collections::BTreeSet;
use tumble_collide::Pose;
use tumble_core::{Mode, ObjectId, World};

/// An object of the table in this copy.
struct MirroredObject {
    /// `None` for the viewer.
    id: Option<ObjectId>,
    kind: EntryKind,
    stationary: bool,
    parts: u16,
}

/// A copy of the server's world. It is built from the same scene file and then follows the
/// messages.
///
/// A message is applied whole or not at all.
pub struct Mirror {
    base: World,
    world: World,
    slots: Vec<MirroredObject>,
    /// Objects of the slots; `None` for the viewer.
    ids: Vec<Option<ObjectId>>,
    /// Number of objects that are not stationary.
    moving: usize,
    /// Scratch memory for the poses of a frame.
    poses: Vec<Pose>,
    revision: Option<u32>,
    viewer: Viewer,
    frame: u64,
    table: Hash,
    scratch: FrameHasher,
}

impl Mirror {
    /// Creates the copy. `base` is the world as the scene file makes it.
    pub fn new(base: World) -> Mirror {
        let world = base.fork();
        Mirror {
            base,
            world,
            slots: Vec::new(),
            ids: Vec::new(),
            moving: 0,
            poses: Vec::new(),
            revision: None,
            viewer: Viewer::default(),
            frame: 0,
            table: [0; 16],
            scratch: FrameHasher::default(),
        }
    }

    /// Returns the world to draw.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Returns the users' heads and the cave's place in the scene.
    pub fn viewer(&self) -> &Viewer {
        &self.viewer
    }

    /// Returns the number of the last applied frame.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// Returns the revision of the object table; `None` before the first snapshot.
    pub fn revision(&self) -> Option<u32> {
        self.revision
    }

    /// Applies the object table of a snapshot.
    ///
    /// # Errors
    /// [`MessageError::Malformed`], [`MessageError::Unfit`]. The copy is then unchanged.
    pub fn apply_snapshot(&mut self, payload: &[u8]) -> Result<(), MessageError> {
        let snapshot = Snapshot::parse(payload)?;
        let (mut world, mut names, mut slots) =
            (self.base.fork(), BTreeSet::new(), Vec::with_capacity(snapshot.entries.len()));
        let mut viewers = 0;
        for entry in &snapshot.entries {
            if !names.insert(entry.name) {
                return Err(MessageError::Malformed("a duplicate name"));
            }
            viewers += usize::from(entry.kind == EntryKind::Viewer);
        }
        if viewers != 1 || snapshot.entries.last().is_none_or(|e| e.kind != EntryKind::Viewer || e.name != VIEWER_NAME)
        {
            return Err(MessageError::Malformed("a table that does not end with its only viewer"));
        }
        for &id in self.base.ids() {
            let absent = self.base.object(id).is_some_and(|o| {
                !self.base.name(id).is_some_and(|name| names.contains(name))
                    && (has_parts(&self.base, id) || o.net_sync().is_some())
            });
            if absent {
                let _ = world.replica().remove(id);
            }
        }
        let mut numbers = 0;
        for entry in &snapshot.entries {
            let slot = self.slot(&mut world, entry, &slots, &mut numbers)?;
            slots.push(slot);
        }
        self.moving = slots.iter().filter(|slot| !slot.stationary).count();
        self.ids = slots.iter().map(|slot| slot.id).collect();
        (self.world, self.slots, self.revision) = (world, slots, Some(snapshot.revision));
        self.hash_table();
        Ok(())
    }

    /// Finds or adds one object of the table, and places it if it is stationary.
    fn slot(
        &self,
        world: &mut World,
        entry: &Entry<'_>,
        slots: &[MirroredObject],
        numbers: &mut usize,
    ) -> Result<MirroredObject, MessageError> {
        let unfit = |why: &str| MessageError::Unfit(format!("'{}' {why}", entry.name));
        let (stationary, parts) = (entry.stationary, entry.parts);
        if entry.kind == EntryKind::Viewer {
            return Ok(MirroredObject { id: None, kind: entry.kind, stationary, parts });
        }
        let still_bytes = if stationary { poses_bytes(parts) } else { 0 };
        let (poses, looks) =
            entry.body.split_at_checked(still_bytes).ok_or(MessageError::Malformed("unexpected end"))?;
        let id = match (entry.described, world.find(entry.name)) {
            (false, Some(id)) => id,
            (false, None) => return Err(unfit("is not in this scene")),
            (true, old) if entry.kind == EntryKind::Exact => {
                let _ = old.map(|id| world.replica().remove(id));
                let sensor = get_sensor(looks, entry.name, |k| slots.get(k)?.id, world, numbers)?;
                world.replica().add_sensor(sensor).map_err(|why| unfit(&why.to_string()))?
            }
            (true, old) => {
                let looks = get_looks(looks, parts as usize, entry.kind == EntryKind::Cloud, &self.base)?;
                let _ = old.map(|id| world.replica().remove(id));
                let render_proxy = RenderProxy::new(entry.name, parts as usize, looks);
                world.add_boxed(Box::new(render_proxy), Mode::Static).map_err(|why| unfit(&why.to_string()))?
            }
        };
        if !entry.described && !looks.is_empty() {
            return Err(MessageError::Malformed("trailing bytes"));
        }
        if entry.kind == EntryKind::Exact && !stationary && world.object(id).is_none_or(|o| o.net_sync().is_none()) {
            return Err(unfit("accepts no messages"));
        }
        let here = world.view().state_range(id).map_or(0, |span| span.parts.len());
        if here != parts as usize {
            return Err(unfit(&format!("has {here} parts here and {parts} on the server")));
        }
        let _ = world.set_enabled(id, entry.enabled);
        if stationary {
            let mut stand = Vec::new();
            read_poses(poses, parts, &mut stand)?;
            world.replica().set_poses(id, &stand).map_err(|why| unfit(&why.to_string()))?;
        }
        Ok(MirroredObject { id: Some(id), kind: entry.kind, stationary, parts })
    }

    /// Returns the table revision that a STATE payload belongs to.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn revision_of(payload: &[u8]) -> Result<u32, MessageError> {
        parse_state(payload).map(|(revision, ..)| revision)
    }

    /// Applies the payload of a frame.
    ///
    /// # Errors
    /// [`MessageError::Malformed`], [`MessageError::Unfit`]. The copy is then unchanged.
    pub fn apply_state(&mut self, frame: u64, time_s: f64, payload: &[u8]) -> Result<(), MessageError> {
        let (revision, count, mut records) = parse_state(payload)?;
        if Some(revision) != self.revision {
            return Err(MessageError::Unfit(format!("list of objects {revision}; here is {:?}", self.revision)));
        }
        if count as usize != self.moving {
            return Err(MessageError::Malformed("a wrong number of objects"));
        }
        let (mut viewer, mut messages, mut clouds) = (None, Vec::new(), Vec::new());
        let (mut poses, mut shown) = (std::mem::take(&mut self.poses), Vec::with_capacity(self.moving));
        poses.clear();
        for (wanted, slot) in self.slots.iter().enumerate().filter(|(_, slot)| !slot.stationary) {
            let (index, body) = records.next().ok_or(MessageError::Malformed("unexpected end"))??;
            match (slot.id, slot.kind) {
                _ if index != wanted => return Err(MessageError::Malformed("objects out of order")),
                (None, _) => viewer = Some(Viewer::read(body)?),
                (Some(id), _) if body.is_empty() => shown.push((id, 0..0)),
                (Some(id), EntryKind::Exact) => messages.push((id, body)),
                (Some(id), EntryKind::Cloud) => clouds.push((id, get_cloud(body)?)),
                (Some(id), _) => {
                    let start = poses.len();
                    read_poses(body, slot.parts, &mut poses)?;
                    shown.push((id, start..poses.len()));
                }
            }
        }
        let mut rest = ByteReader(records.rest());
        let contacts = get_contacts(&mut rest, &self.ids, &self.world)?;
        let events = get_events(&mut rest, &self.ids, &self.world)?;
        let touching = get_touching(&mut rest, &self.ids, &self.world)?;
        rest.end()?;
        let viewer = viewer.ok_or(MessageError::Malformed("no viewer"))?;
        self.apply_messages(&messages)?;
        for (id, spheres) in clouds {
            let _ = self.world.set_enabled(id, true); // as below
            if let Some(proxy) = self.world.get_mut::<RenderProxy>(id) {
                proxy.spheres = spheres;
            }
        }
        for (id, range) in shown {
            let enabled = !range.is_empty();
            if self.world.status(id).is_some_and(|s| s.enabled != enabled) {
                let _ = self.world.set_enabled(id, enabled); // ids of our own list are there
            }
            if enabled {
                let _ = self.world.replica().set_poses(id, &poses[range]); // as many as there are parts, and finite
            }
        }
        self.world.replica().set_time(time_s);
        self.world.replica().set_contacts(contacts);
        self.world.replica().set_events(events);
        self.world.replica().set_touching(touching);
        (self.viewer, self.frame, self.poses) = (viewer, frame, poses);
        Ok(())
    }

    /// Applies the objects' own messages: all of them or none.
    fn apply_messages(&mut self, messages: &[(ObjectId, &[u8])]) -> Result<(), MessageError> {
        let before: Vec<Vec<f64>> =
            messages.iter().map(|(id, _)| self.world.state_of(*id).unwrap_or_default().to_vec()).collect();
        for (done, (id, data)) in messages.iter().enumerate() {
            if let Err(why) = self.world.replica().read_data(*id, data) {
                for ((id, _), x) in messages[..done].iter().zip(&before) {
                    let _ = self.world.write_state_of(*id, x); // it held these numbers before
                }
                return Err(MessageError::Unfit(why.to_string()));
            }
        }
        for (id, _) in messages {
            let _ = self.world.set_enabled(*id, true);
        }
        Ok(())
    }

    /// Returns the hash of the state that [`world`](Self::world) shows, read back from the world
    /// itself.
    pub fn hash(&mut self) -> Hash {
        let mut hasher = std::mem::take(&mut self.scratch).frame(self.frame, self.world.time(), self.table);
        for slot in self.slots.iter().filter(|slot| !slot.stationary) {
            let Some(id) = slot.id else {
                hasher.bytes(|out| self.viewer.write(out));
                continue;
            };
            let enabled = self.world.status(id).is_some_and(|s| s.enabled);
            hasher.enabled(enabled);
            if enabled {
                self.hash_object(id, slot, &mut hasher);
            }
        }
        let (shown, events) = (self.world.contacts(), self.world.events());
        let known = self.world.knows_touching();
        let ids = self.ids.iter().zip(0..).filter(|_| !shown.is_empty() || !events.is_empty() || known);
        let indices = ids.filter_map(|(id, index)| Some(((*id)?, index))).collect();
        hasher.bytes(|out| put_contacts(out, shown, &indices));
        hasher.bytes(|out| put_events(out, events, &indices, &self.world));
        hasher.bytes(|out| put_touching(out, &self.world, known, &indices));
        let (hash, scratch) = hasher.hash();
        self.scratch = scratch;
        hash
    }

    fn hash_object(&self, id: ObjectId, slot: &MirroredObject, hasher: &mut FrameHasher) {
        match slot.kind {
            EntryKind::Exact => return hasher.bytes(|out| put_message(&self.world, id, out)),
            EntryKind::Cloud => return hasher.bytes(|out| put_cloud(&self.world, id, out)),
            _ => {}
        }
        let part_states = self
            .world
            .view()
            .state_range(id)
            .and_then(|span| self.world.part_states().get(span.parts.clone()))
            .unwrap_or_default();
        part_states.iter().for_each(|part_state| hasher.pose(&part_state.pose));
    }

    fn hash_table(&mut self) {
        let mut hasher = std::mem::take(&mut self.scratch).table();
        for slot in &self.slots {
            let Some(id) = slot.id else { continue };
            hasher.name(self.world.name(id).unwrap_or_default());
            hasher.enabled(slot.stationary && self.world.status(id).is_some_and(|s| s.enabled));
            if slot.stationary {
                self.hash_object(id, slot, &mut hasher);
            }
        }
        (self.table, self.scratch) = hasher.hash();
    }
}

fn has_parts(world: &World, id: ObjectId) -> bool {
    world.view().state_range(id).is_some_and(|span| !span.parts.is_empty())
}

/// Appends one pose per part.
fn read_poses(body: &[u8], parts: u16, out: &mut Vec<Pose>) -> Result<(), MessageError> {
    let (poses, rest) = body.as_chunks();
    if poses.len() != parts as usize || !rest.is_empty() {
        return Err(MessageError::Malformed("not as many poses as parts"));
    }
    for pose in poses {
        out.push(get_pose(pose)?);
    }
    Ok(())
}
