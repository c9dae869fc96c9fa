//! Reads a recording frame by frame.

use super::budget;
use super::bytes::Fields;
use super::chain::{ChainHash, chain_hash};
use super::chunk::{Channel, Inner, Schema, define, next_inner, open_chunk, parse_inner};
use super::container::{Container, Ending, Next, RawRecord};
use super::error::{RecordError, Result};
use super::images::{IMAGE_SCHEMA, Images, TOPIC_CAMERAS, decode_image};
use super::messages::{entities_of, nanoseconds, poses_of};
use super::report::{
    EVENTS_SCHEMA, JSON, Readings, RecordedEvent, SENSORS_SCHEMA, TOPIC_EVENTS, TOPIC_SENSORS, decode_events,
    decode_readings,
};
use super::scene::{Contact, Entity, Pose, decode_contacts, name_fault};
use super::schemas::{
    METADATA_NAME, PROTOBUF, SCENE_SCHEMA, STATE_SCHEMA, State, TOPIC_SCENE, TOPIC_STATE, TOPIC_TRANSFORMS,
    TRANSFORMS_SCHEMA, VERSION,
};
use super::{MAX_DEFINITION_BYTES, MAX_TIME_S};
use foxglove::messages::{FrameTransforms, SceneUpdate};
use mcap::records::op;
use prost::Message;
use std::collections::BTreeMap;
use std::path::Path;

/// One frame of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Simulated time as recorded, s (not rounded).
    pub time_s: f64,
    /// Frame number.
    pub frame: u64,
    /// One pose per entity, in the order of [`Reader::entities`].
    pub poses: Vec<Pose>,
    /// Contacts; each refers to two entities by their indices in [`Reader::entities`].
    pub contacts: Vec<Contact>,
    /// The recorded state bytes.
    pub state: Vec<u8>,
    /// Readings of measuring sensors by their names.
    pub sensors: Readings,
    /// Events of the frame.
    pub events: Vec<RecordedEvent>,
    /// Images of cameras by their names, if they were recorded.
    pub images: Images,
}

/// Readings, events and images of the frame at a log time, whose state comes next.
#[derive(Debug, Default)]
struct Report {
    log_time: u64,
    sensors: Readings,
    events: Vec<RecordedEvent>,
    images: Images,
}

/// Opens a recording, complete or cut, and reads up to its first scene.
///
/// A file that is cut before its first scene is not an error: it has no entities and no frames, and
/// [`Reader::ending`] reports where it ends.
///
/// # Errors
/// [`RecordError`] for a missing file, a file that is not MCAP, an MCAP file that is not a
/// recording, and damage before the first scene.
pub fn read(path: impl AsRef<Path>) -> Result<Reader> {
    let mut reader = Reader {
        container: Container::open(path.as_ref())?,
        schemas: BTreeMap::new(),
        channels: BTreeMap::new(),
        world: None,
        entities: Vec::new(),
        content: Vec::new(),
        position: 0,
        chunk_offset: 0,
        poses: None,
        report: None,
        ahead: None,
        last_frame: None,
        chain: None,
        broken_at: None,
        ending: None,
        failed: false,
    };
    if let Event::Frame(frame) = reader.next_event()? {
        reader.ahead = Some(frame);
    }
    if reader.world.is_none() {
        let why = match &reader.ending {
            Some(Ending::Cut { offset, .. }) => format!("it is cut at byte {offset}, before its description"),
            _ => format!("it has no metadata record \"{METADATA_NAME}\""),
        };
        return Err(RecordError::NotARecording { path: path.as_ref().to_owned(), why });
    }
    Ok(reader)
}

/// Number of records, from the beginning of a file, among which its description must be.
const DESCRIPTION_WITHIN: usize = 8;

/// Returns whether a file is a recording of tumble, complete or cut: an MCAP file that begins with
/// the description of one. Its frames are not read.
pub fn is_recording(path: impl AsRef<Path>) -> bool {
    let Ok(mut container) = Container::open(path.as_ref()) else { return false };
    for _ in 0..DESCRIPTION_WITHIN {
        match container.next() {
            Ok(Next::Record(record)) if record.opcode == op::METADATA => {
                if metadata_of(&record.body).is_ok_and(|(name, _)| name == METADATA_NAME) {
                    return true;
                }
            }
            Ok(Next::Record(_)) => {}
            Ok(Next::End(_)) | Err(_) => return false,
        }
    }
    false
}

/// Reads frames in order; also an iterator over them.
#[derive(Debug)]
pub struct Reader {
    container: Container,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    world: Option<String>,
    entities: Vec<Entity>,
    /// Records of the open chunk, the position of its unread part, and its offset in the file.
    content: Vec<u8>,
    position: usize,
    chunk_offset: u64,
    /// Poses of the frame whose state comes next, with their log time.
    poses: Option<(u64, Vec<Pose>)>,
    /// Readings, events and images of the frame whose state comes next.
    report: Option<Report>,
    /// A frame that was read before the first scene.
    ahead: Option<Frame>,
    last_frame: Option<u64>,
    /// Hash of the last frame, and the first frame whose hash does not follow from the frames before.
    chain: Option<ChainHash>,
    broken_at: Option<u64>,
    ending: Option<Ending>,
    failed: bool,
}

enum Event {
    Scene,
    Frame(Frame),
    End,
}

impl Reader {
    /// Returns the world's name.
    pub fn world(&self) -> &str {
        self.world.as_deref().unwrap_or_default()
    }

    /// Returns the entities that the last frame's poses belong to; before the first frame, those of
    /// the first scene. Their parts are as drawn: a capsule is a cylinder and two spheres, a plane
    /// is a mesh. An entity whose scene was lost to damage has a name and no parts.
    pub fn entities(&self) -> &[Entity] {
        &self.entities
    }

    /// Returns how the file ends; `None` until all frames are read.
    pub fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }

    /// Returns the hash of the frames so far, as the last one has it ([`chain_hash`]).
    pub fn last_hash(&self) -> Option<&ChainHash> {
        self.chain.as_ref()
    }

    /// Returns the first frame so far whose hash does not follow from the frames before: one of them was changed or
    /// removed, as in a recovered file. `None` if the chain is whole.
    pub fn broken_at(&self) -> Option<u64> {
        self.broken_at
    }

    /// Returns the next frame; `None` at the end. Each returned frame has passed its chunk's
    /// checksum. A missing chunk is only detected by the checksum at the end.
    ///
    /// # Errors
    /// [`RecordError::Corrupt`] with the offset of the damaged record. No frames follow an error.
    pub fn next_frame(&mut self) -> Result<Option<Frame>> {
        if let Some(frame) = self.ahead.take() {
            return Ok(Some(frame));
        }
        while !self.failed {
            match self.next_event()? {
                Event::Scene => {}
                Event::Frame(frame) => return Ok(Some(frame)),
                Event::End => return Ok(None),
            }
        }
        Ok(None)
    }

    fn next_event(&mut self) -> Result<Event> {
        let event = self.find_event();
        self.failed |= event.is_err();
        event
    }

    fn find_event(&mut self) -> Result<Event> {
        while self.ending.is_none() {
            if let Some(event) = self.next_in_chunk().map_err(|what| self.damaged(what))? {
                return Ok(event);
            }
            match self.container.next()? {
                Next::Record(record) => self.outer_record(record)?,
                Next::End(ending) => self.ending = Some(ending),
            }
        }
        Ok(Event::End)
    }

    fn damaged(&self, what: String) -> RecordError {
        RecordError::corrupt(self.container.path(), self.chunk_offset, what)
    }

    /// Opens a chunk, or handles a record outside of chunks.
    fn outer_record(&mut self, record: RawRecord) -> Result<()> {
        self.chunk_offset = record.offset;
        match record.opcode {
            op::METADATA => return self.metadata(&record),
            op::CHUNK => self.content = open_chunk(&record.body).map_err(|what| self.damaged(what))?.content,
            op::SCHEMA | op::CHANNEL | op::MESSAGE => self.content = as_content(record),
            _ => return Ok(()),
        }
        self.position = 0;
        Ok(())
    }

    fn metadata(&mut self, record: &RawRecord) -> Result<()> {
        let (name, mut entries) = metadata_of(&record.body).map_err(|what| self.damaged(what))?;
        if name != METADATA_NAME {
            return Ok(());
        }
        let version = entries.remove("version").unwrap_or_default();
        if version != VERSION.to_string() {
            let why = format!("its version is \"{version}\"; expected {VERSION}");
            return Err(RecordError::NotARecording { path: self.container.path().to_owned(), why });
        }
        self.world = Some(entries.remove("world").unwrap_or_default());
        Ok(())
    }

    /// Continues in the open chunk; `None` at its end.
    fn next_in_chunk(&mut self) -> std::result::Result<Option<Event>, String> {
        let content = std::mem::take(&mut self.content);
        let mut rest = Fields(content.get(self.position..).unwrap_or_default());
        let mut event = Ok(None);
        while let Ok(None) = event {
            event = match next_inner(&mut rest) {
                Ok(Some((opcode, body))) => parse_inner(opcode, body).and_then(|record| self.inner_record(record)),
                Ok(None) => break,
                Err(what) => Err(what),
            };
        }
        self.position = content.len() - rest.0.len();
        self.content = content;
        event
    }

    fn inner_record(&mut self, record: Inner) -> std::result::Result<Option<Event>, String> {
        match record {
            Inner::Schema(id, schema) => define(&BTreeMap::new(), &mut self.schemas, id, schema)?,
            Inner::Channel(id, channel) => define(&BTreeMap::new(), &mut self.channels, id, channel)?,
            Inner::Message { channel, log_time, data, .. } => return self.message(channel, log_time, data),
            Inner::Other => {}
        }
        Ok(None)
    }

    fn message(&mut self, channel: u16, log_time: u64, data: &[u8]) -> std::result::Result<Option<Event>, String> {
        let info = self
            .channels
            .get(&channel)
            .ok_or_else(|| format!("a message on channel {channel}, which the file does not define"))?;
        let wanted = match info.topic.as_str() {
            TOPIC_SCENE => SCENE_SCHEMA,
            TOPIC_TRANSFORMS => TRANSFORMS_SCHEMA,
            TOPIC_STATE => STATE_SCHEMA,
            TOPIC_SENSORS => SENSORS_SCHEMA,
            TOPIC_EVENTS => EVENTS_SCHEMA,
            topic if topic.starts_with(TOPIC_CAMERAS) => IMAGE_SCHEMA,
            _ => return Ok(None),
        };
        let schema = self.schemas.get(&info.schema).map_or("", |schema| schema.name.as_str());
        let encoding = if matches!(wanted, SENSORS_SCHEMA | EVENTS_SCHEMA) { JSON } else { PROTOBUF };
        if schema != wanted || info.encoding != encoding {
            return Err(format!(
                "topic {} has schema \"{schema}\" in \"{}\", not {wanted} in {encoding}",
                info.topic, info.encoding
            ));
        }
        match wanted {
            SCENE_SCHEMA => self.scene(data).map(|()| Some(Event::Scene)),
            TRANSFORMS_SCHEMA => self.transforms(log_time, data).map(|()| None),
            SENSORS_SCHEMA => decode_readings(data).map(|sensors| {
                self.report_at(log_time).sensors = sensors;
                None
            }),
            EVENTS_SCHEMA => decode_events(data).map(|events| {
                self.report_at(log_time).events = events;
                None
            }),
            IMAGE_SCHEMA => {
                let name = info.topic[TOPIC_CAMERAS.len()..].to_owned();
                let image = decode_image(&name, data)?;
                self.report_at(log_time).images.insert(name, image);
                Ok(None)
            }
            _ => self.state(log_time, data).map(|frame| Some(Event::Frame(frame))),
        }
    }

    /// Returns the readings, events and images of the frame at a log time.
    fn report_at(&mut self, log_time: u64) -> &mut Report {
        self.report = self.report.take().filter(|report| report.log_time == log_time);
        self.report.get_or_insert_with(|| Report { log_time, ..Report::default() })
    }

    fn scene(&mut self, data: &[u8]) -> std::result::Result<(), String> {
        budget::check_scene(data)?;
        let message = SceneUpdate::decode(data).map_err(|e| format!("scene: {e}"))?;
        let entities = entities_of(message);
        super::scene::check_entities(&entities).map_err(|e| format!("scene: {e}"))?;
        self.entities = entities;
        Ok(())
    }

    fn transforms(&mut self, log_time: u64, data: &[u8]) -> std::result::Result<(), String> {
        budget::check_transforms(data)?;
        let message = FrameTransforms::decode(data).map_err(|e| format!("transforms: {e}"))?;
        let named = poses_of(message);
        if let Some((name, why)) =
            named.iter().find_map(|(name, pose)| Some((name, name_fault(name).or_else(|| pose.fault())?)))
        {
            return Err(format!("transform of \"{name}\": {why}"));
        }
        self.adopt_names(&named);
        self.poses = Some((log_time, named.into_iter().map(|(_, pose)| pose).collect()));
        Ok(())
    }

    /// Changes the list of entities to the names of these transforms. They differ only if a scene
    /// was lost.
    fn adopt_names(&mut self, named: &[(String, Pose)]) {
        if named.iter().map(|(name, _)| name).eq(self.entities.iter().map(|entity| &entity.name)) {
            return;
        }
        let mut known: BTreeMap<String, Entity> =
            self.entities.drain(..).map(|entity| (entity.name.clone(), entity)).collect();
        let entity = |(name, _): &(String, Pose)| {
            known.remove(name).unwrap_or_else(|| Entity { name: name.clone(), parts: Vec::new() })
        };
        self.entities = named.iter().map(entity).collect();
    }

    fn state(&mut self, log_time: u64, data: &[u8]) -> std::result::Result<Frame, String> {
        let State { version, frame, time_s, payload, contacts, chain } =
            State::decode(data).map_err(|e| format!("state: {e}"))?;
        if version != VERSION {
            return Err(format!("state of version {version}; expected {VERSION}"));
        }
        if !(0.0..=MAX_TIME_S).contains(&time_s) || nanoseconds(time_s) != log_time {
            return Err(format!("frame {frame} is of time {time_s} s, but was logged at {log_time} ns"));
        }
        if let Some(last) = self.last_frame
            && frame <= last
        {
            return Err(format!("frame {frame} follows frame {last}"));
        }
        let poses = match self.poses.take() {
            Some((at, poses)) if at == log_time => poses,
            _ => return Err(format!("frame {frame} has a state and no transforms")),
        };
        let contacts = decode_contacts(&contacts).map_err(|why| format!("frame {frame}: {why}"))?;
        if let Some(why) = contacts.iter().find_map(|contact| contact.fault(poses.len())) {
            return Err(format!("frame {frame}: {why}"));
        }
        self.last_frame = Some(frame);
        if chain != chain_hash(self.chain.as_ref(), frame, time_s, &payload) {
            self.broken_at = self.broken_at.or(Some(frame));
        }
        self.chain = chain.try_into().ok();
        let report = self.report.take().filter(|report| report.log_time == log_time);
        let Report { sensors, events, images, .. } = report.unwrap_or_default();
        Ok(Frame { time_s, frame, poses, contacts, state: payload, sensors, events, images })
    }
}

impl Iterator for Reader {
    type Item = std::result::Result<Frame, RecordError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_frame().transpose()
    }
}

/// Returns name and entries of a metadata record.
pub(crate) fn metadata_of(body: &[u8]) -> std::result::Result<(String, BTreeMap<String, String>), String> {
    if body.len() > MAX_DEFINITION_BYTES {
        return Err(format!("a metadata record of {} bytes, at most {MAX_DEFINITION_BYTES} are read", body.len()));
    }
    let mut fields = Fields(body);
    let name = fields.string("metadata name")?.to_owned();
    let entries = fields.map("metadata")?;
    fields.end("the metadata")?;
    Ok((name, entries))
}

/// Returns a record from outside of a chunk in the form of a chunk's content.
pub(crate) fn as_content(record: RawRecord) -> Vec<u8> {
    let mut content = vec![record.opcode];
    content.extend((record.body.len() as u64).to_le_bytes());
    content.extend(record.body);
    content
}
