//! The server's side of a frame: turns a world into payloads, and computes the hash that a facet
//! must acknowledge.

use super::cloud::{cloud_of, put_cloud};
use super::contacts::{MAX_CONTACTS, put_contacts};
use super::events::{MAX_FRAME_EVENTS, StepEvents, put_events};
use super::frame_hash::FrameHasher;
use super::quantize::{get_pose, put_pose};
use super::sensors::{put_sensor, sent};
use super::table::{Entry, EntryKind, MAX_OBJECTS, put_record, put_snapshot_head, put_state_head};
use super::touching::put_touching;
use super::transport::MAX_MESSAGE_BYTES;
use super::viewer::{VIEWER_NAME, Viewer};
use super::visuals::{put_appearance, put_surface, put_visuals};
use super::wire::{HEADER_BYTES, Hash};
use crate::world::strongest;
use std::collections::BTreeMap;
use std::sync::Arc;
use tumble_collide::Pose;
use tumble_core::{Event, Mode, ObjectId, World};

/// Error of a world that cannot be sent.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PublishError {
    /// A pose is not finite.
    #[error("part {part} of '{name}' has a pose that is not finite")]
    NotFinite {
        /// Name of the object.
        name: String,
        /// Index of the part.
        part: usize,
    },
    /// A limit of the protocol is exceeded.
    #[error("{what}: {count}, at most {max} can be sent")]
    LimitExceeded {
        /// The quantity that has the limit.
        what: String,
        /// Its value.
        count: usize,
        /// Its maximum.
        max: usize,
    },
    /// An object has the name that the protocol reserves for the viewer.
    #[error("an object is named '{VIEWER_NAME}', which is the viewer's name; rename it")]
    Name,
}

/// A frame, encoded.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// Payload of STATE.
    pub state: Vec<u8>,
    /// Hash that a facet which drew the frame must acknowledge.
    pub hash: Hash,
    /// Whether the object table is new, so that the snapshot must be sent first.
    pub fresh: bool,
    /// Number of poses beyond ±32768 m, which are clamped in the message.
    pub saturated: u32,
}

struct TableRow {
    id: ObjectId,
    kind: EntryKind,
    /// Whether the mode is static.
    fixed: bool,
    /// Static and sent as poses: its poses are in the table and in no state.
    stationary: bool,
    /// Whether a stationary object is enabled.
    enabled: bool,
    parts: usize,
    /// Poses of a stationary object, as the world has them.
    poses: Vec<Pose>,
}

/// Encodes the payloads for one kind of facet: those that draw poses, or replicas that take exact
/// messages.
pub struct Publisher {
    exact: bool,
    /// Largest number of contacts in a frame.
    contacts: usize,
    /// Largest number of events in a frame, and those of the steps since the last one.
    events: usize,
    steps: StepEvents,
    base: World,
    /// Objects of the world at the last rebuild of the table.
    ids: Vec<ObjectId>,
    rows: Vec<TableRow>,
    /// Index of each row's object.
    indices: BTreeMap<ObjectId, u32>,
    revision: u32,
    snapshot: Arc<Vec<u8>>,
    table: Hash,
    scratch: FrameHasher,
}

impl Publisher {
    /// Creates a publisher. `base` is the world as the scene file makes it, before the first step.
    /// `revision` is the number before that of the first table; it wraps.
    pub fn new(base: &World, exact: bool, revision: u32) -> Publisher {
        Publisher {
            exact,
            contacts: 0,
            events: 0,
            steps: StepEvents::default(),
            base: base.fork(),
            ids: Vec::new(),
            rows: Vec::new(),
            indices: BTreeMap::new(),
            revision,
            snapshot: Arc::default(),
            table: [0; 16],
            scratch: FrameHasher::default(),
        }
    }

    /// Sends contacts with every frame: those that touch, at most `max` and [`MAX_CONTACTS`]. If
    /// there are more, those with the largest forces are sent. By default there are none.
    #[must_use]
    pub fn with_contacts(mut self, max: usize) -> Publisher {
        self.contacts = max.min(MAX_CONTACTS);
        self
    }

    /// Sends the events of the steps of every frame, at most `max` and [`MAX_FRAME_EVENTS`]. If there are more, contacts that
    /// persist are left out first, those with the smallest impulses. By default there are none.
    ///
    /// ```
    /// use tumble_core::prelude::*;
    /// use tumble_core::{Anchor, EventKind, Sensor, SensorKind};
    /// use tumble_net::sync::{MAX_FRAME_EVENTS, Mirror, Publisher, Viewer};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let mut world = World::default();
    /// world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground"))?;
    /// let ball = RigidBody::new(Shape::sphere(0.1)?).with_name("ball").with_mass(2.0);
    /// let ball = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.2)))?;
    /// world.add(Sensor::new("felt", SensorKind::Touch, Anchor::on(ball, 0, Pose::identity()))?)?;
    /// let base = world.fork(); // a facet reads the same scene
    /// let mut publisher = Publisher::new(&world, false, 0).with_events(MAX_FRAME_EVENTS);
    /// let mut mirror = Mirror::new(base);
    /// while world.events().is_empty() {
    ///     world.step()?;
    /// }
    /// let published = publisher.publish(&world, &Viewer::default(), 1)?;
    /// mirror.apply_snapshot(&publisher.snapshot())?;
    /// mirror.apply_state(1, world.time(), &published.state)?;
    /// let (shown, felt) = (mirror.world(), mirror.world().find("felt").unwrap());
    /// assert_eq!(shown.events()[0].kind, EventKind::ContactBegin);
    /// assert_eq!(shown.reading(felt), world.reading(felt));
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn with_events(mut self, max: usize) -> Publisher {
        self.events = max.min(MAX_FRAME_EVENTS);
        self
    }

    /// Takes the events of the world's last step into the next frame. A program that makes several steps a frame calls it
    /// after each; [`publish`](Self::publish) does it for the last one. Does nothing without [`with_events`](Self::with_events).
    pub fn step(&mut self, world: &World) {
        if self.events > 0 {
            self.steps.step(world, self.events);
        }
    }

    /// Leaves out a frame with its events.
    pub(super) fn skip(&mut self) {
        self.steps.take();
    }

    /// Returns the SNAPSHOT payload of the last [`publish`](Self::publish); empty before the first.
    pub fn snapshot(&self) -> Arc<Vec<u8>> {
        self.snapshot.clone()
    }

    /// Encodes the payloads of a frame.
    ///
    /// # Errors
    /// [`PublishError`]. The next call then rebuilds the object table.
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
        let start = state.len();
        put_contacts(&mut state, strongest(world, self.contacts), &self.indices);
        self.step(world);
        let events: Vec<Event> = self.steps.take().into_iter().filter(|e| self.is_sent(e, world)).collect();
        put_events(&mut state, &events, &self.indices, world);
        put_touching(&mut state, world, self.events > 0, &self.indices);
        hasher.bytes(|out| out.extend(&state[start..]));
        let (hash, scratch) = hasher.hash();
        self.scratch = scratch;
        check_limit("bytes of a frame", state.len() + HEADER_BYTES, MAX_MESSAGE_BYTES)?;
        Ok(Published { state, hash, fresh, saturated })
    }

    /// Returns whether a facet knows the objects of an event: they are there, and in the table or in the scene file.
    fn is_sent(&self, event: &Event, world: &World) -> bool {
        let known = |id: ObjectId| self.indices.contains_key(&id) || self.base.object(id).is_some();
        std::iter::once(event.a).chain(event.b).all(|id| world.object(id).is_some() && known(id))
    }

    /// Returns whether the table still describes the world: the same objects, with every stationary
    /// object at its pose.
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

    /// Returns kind, stationary flag, enabled flag and number of parts of an object; `None` if it
    /// is not sent.
    fn classify(&self, world: &World, id: ObjectId) -> Option<(EntryKind, bool, bool, usize)> {
        let (object, status) = (world.object(id)?, world.status(id)?);
        let parts = world.view().state_range(id)?.parts.len();
        let known = self.base.object(id).is_some();
        let exact = known && object.net_sync().is_some() && (self.exact || parts == 0);
        match (exact, parts) {
            // a camera whose image is made where it is read has no numbers to send
            (false, 0) if !known && sent(world, id).is_some() => {
                let still = world.state_of(id).is_none_or(<[f64]>::is_empty);
                Some((EntryKind::Exact, still, status.enabled, parts))
            }
            (true, _) => Some((EntryKind::Exact, false, status.enabled, parts)),
            (false, 0) if !known && cloud_of(world, id).is_some() => {
                Some((EntryKind::Cloud, false, status.enabled, parts))
            }
            (false, 0) => None,
            _ => Some((EntryKind::Poses, status.mode == Mode::Static, status.enabled, parts)),
        }
    }

    /// Rebuilds the object table and writes the snapshot.
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
        self.indices = self.rows.iter().map(|row| row.id).zip(0..).collect();
        self.ids = world.ids().to_vec();
        check_limit("objects", self.rows.len() + 1, MAX_OBJECTS)?;
        let mut out = Vec::new();
        put_snapshot_head(&mut out, self.revision, self.exact, self.rows.len() + 1);
        let (mut hasher, mut body) = (std::mem::take(&mut self.scratch).table(), Vec::new());
        for row in &self.rows {
            let (Some(name), Some(object)) = (world.name(row.id), world.object(row.id)) else { continue };
            let described = self.base.object(row.id).is_none();
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
            if described && row.kind == EntryKind::Exact {
                sent(world, row.id).iter().for_each(|sensor| put_sensor(&mut body, sensor, &self.indices));
            } else if described {
                put_visuals(&mut body, object.renderable().map_or(&[], |r| r.visuals()), &self.base);
                put_surface(&mut body, object.renderable().and_then(|r| r.surface()));
                if let (EntryKind::Cloud, Some(cloud)) = (row.kind, cloud_of(world, row.id)) {
                    put_appearance(&mut body, cloud.appearance);
                }
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

/// Appends the body of one object and hashes what a facet will see of it.
fn put_row(
    out: &mut Vec<u8>,
    row: &TableRow,
    world: &World,
    hasher: &mut FrameHasher,
    saturated: &mut u32,
) -> Result<(), PublishError> {
    let start = out.len();
    if matches!(row.kind, EntryKind::Exact | EntryKind::Cloud) {
        let put = if row.kind == EntryKind::Exact { put_message } else { put_cloud };
        put(world, row.id, out);
        hasher.bytes(|seen| seen.extend(&out[start..]));
        return Ok(());
    }
    for (part, pose) in poses(world, row.id).enumerate() {
        let sum = pose.translation.vector.sum() + pose.rotation.coords.sum(); // finite numbers of a world sum to a finite one
        if !sum.is_finite() {
            let name = world.name(row.id).unwrap_or_default().to_string();
            return Err(PublishError::NotFinite { name, part });
        }
        *saturated += u32::from(!put_pose(out, &pose));
        if let Some(Ok(sent)) = out.last_chunk().map(get_pose) {
            hasher.pose(&sent);
        }
    }
    Ok(())
}

/// Appends an object's own message (thesis `GetData`); nothing for an object that has none.
pub(super) fn put_message(world: &World, id: ObjectId, out: &mut Vec<u8>) {
    let view = world.view();
    if let (Some(sync), Some(range)) = (world.object(id).and_then(|o| o.net_sync()), view.state_range(id)) {
        sync.get_data(range, &view, out);
    }
}

fn poses(world: &World, id: ObjectId) -> impl Iterator<Item = Pose> + '_ {
    let part_states =
        world.view().state_range(id).and_then(|span| world.part_states().get(span.parts.clone())).unwrap_or_default();
    part_states.iter().map(|part_state| part_state.pose)
}

fn check_limit(what: &str, count: usize, max: usize) -> Result<(), PublishError> {
    if count <= max { Ok(()) } else { Err(PublishError::LimitExceeded { what: what.to_owned(), count, max }) }
}
