//! Recordings of a run: frames as they were sent, inputs of the users and acknowledgements of the
//! facets. A recording can drive the same facets again.
//!
//! [`crate::record`] writes the file, with poses for viewers of other programs. The state bytes of
//! a frame are NetSync messages in sequence, each with its header:
//!
//! | kind | `join` in the header | content |
//! |---|---|---|
//! | JOIN | 0 | in the first frame: hash of the scene; the name is the server's |
//! | SNAPSHOT | 0 | if the object table is new, and in the first frame |
//! | STATE | 0 | the frame |
//! | READY | 0 | hash that a facet must acknowledge: the server's own |
//! | INPUT | facet | inputs since the frame before |
//! | PRESENTED | facet | acknowledgements since then, each with its frame in the header |

use super::events::LastStep;
use super::input::Input;
use super::messages::{Content, FrameAck, Join};
use super::server::ServerEvent;
use super::transport::{FacetNumber, MAX_MESSAGE_BYTES};
use super::wire::{ByteReader, HEADER_BYTES, Hash, MessageError, MessageHeader, MessageKind, message, open};
use crate::record::{
    Contact, Deforming, Ending, Images, MAX_EVENTS, MAX_STATE_BYTES, Pose, Reader, Readings, RecordError,
    RecordedEvent, Recorder, RecorderOptions, Summary, read,
};
use crate::world::{contacts, deforming, entities, events, images, names, poses, readings};
use std::path::Path;
use std::sync::Arc;
use tumble_core::World;

/// A frame as it was published.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameRecord {
    /// Its number.
    pub frame: u64,
    /// Simulated time, s.
    pub time_s: f64,
    /// Payload of SNAPSHOT if the object table is new.
    pub snapshot: Option<Arc<Vec<u8>>>,
    /// Payload of STATE.
    pub state: Vec<u8>,
    /// Hash that a facet which drew the frame must acknowledge.
    pub hash: Hash,
}

/// A frame that waits for its acknowledgements.
struct WaitingFrame {
    frame: u64,
    time_s: f64,
    poses: Vec<Pose>,
    contacts: Vec<Contact>,
    deforming: Deforming,
    readings: Readings,
    events: Vec<RecordedEvent>,
    images: Images,
    /// Messages so far.
    messages: Vec<u8>,
}

/// Writes the recording of a session. A frame is written when the next one arrives, together with
/// its acknowledgements.
pub struct SessionRecorder {
    recorder: Recorder,
    every: u32,
    count: u64,
    /// The frame that waits for its acknowledgements.
    waiting: Option<WaitingFrame>,
    /// Inputs and acknowledgements of frames that are not recorded.
    notes: Vec<u8>,
    /// Events of the steps since the last recorded frame.
    steps: Vec<RecordedEvent>,
    last_step: LastStep,
    /// Whether images of cameras are recorded.
    cameras: bool,
    list: Option<Arc<Vec<u8>>>,
    names: Vec<String>,
    scene: [u8; 32],
    /// Time of the last frame in the file, and how much later it is than simulated time, s: a world that
    /// is set back does not set back the file.
    last_s: f64,
    shift_s: f64,
}

impl SessionRecorder {
    /// Creates or replaces the file. `name` is the scene's name for readers, `scene` its hash.
    /// Every `every`-th frame is recorded (`every_frames` of a cave file; 0 counts as 1), and every
    /// input and acknowledgement.
    ///
    /// # Errors
    /// Those of [`Recorder::create`].
    pub fn create(
        path: impl AsRef<Path>,
        name: &str,
        scene: [u8; 32],
        world: &World,
        every: u32,
        options: RecorderOptions,
    ) -> Result<SessionRecorder, RecordError> {
        let all = entities(world);
        let names = all.iter().map(|e| e.name.clone()).collect();
        let recorder = Recorder::create(path, name, &all, options)?;
        Ok(SessionRecorder {
            recorder,
            every: every.max(1),
            count: 0,
            waiting: None,
            notes: Vec::new(),
            steps: Vec::new(),
            last_step: LastStep::default(),
            cameras: false,
            list: None,
            names,
            scene,
            last_s: 0.0,
            shift_s: 0.0,
        })
    }

    /// Records the images of all cameras with each recorded frame. By default there are none.
    #[must_use]
    pub fn with_cameras(mut self, cameras: bool) -> SessionRecorder {
        self.cameras = cameras;
        self
    }

    /// Takes the events of the world's last step into the next recorded frame. A program that makes several steps a frame calls
    /// it after each; [`frame`](Self::frame) does it for the last one. Of more than
    /// [`MAX_EVENTS`](crate::record::MAX_EVENTS) the first ones are recorded.
    pub fn step(&mut self, world: &World) {
        if self.last_step.is_new(world) && self.steps.len() < MAX_EVENTS {
            self.steps.extend(events(world));
            self.steps.truncate(MAX_EVENTS);
        }
    }

    /// Records the last published frame, with the readings of its sensors and the events of all steps since the last one:
    /// [`ServerSession::recorded`](super::ServerSession::recorded) of the world at that time, with
    /// `fresh` at the first call.
    ///
    /// # Errors
    /// Those of [`Recorder::frame`].
    pub fn frame(&mut self, world: &World, recorded: FrameRecord) -> Result<(), RecordError> {
        let first = self.count == 0;
        self.list = recorded.snapshot.or(self.list.take());
        self.step(world);
        self.count += 1;
        if !(self.count - 1).is_multiple_of(self.every as u64) {
            return Ok(());
        }
        self.write_waiting()?;
        self.shift_s = self.shift_s.max(self.last_s - recorded.time_s);
        let file_time_s = (recorded.time_s + self.shift_s).max(self.last_s);
        self.last_s = file_time_s;
        let names = names(world);
        if names != self.names {
            self.recorder.set_entities(file_time_s, &entities(world))?;
            self.names = names;
        }
        let head = |kind| MessageHeader { kind, run: 0, join: 0, frame: recorded.frame, time_s: recorded.time_s };
        let mut out = Vec::new();
        if first {
            let join = Join { scene: self.scene, name: "server".into(), content: Content::Poses };
            out.extend(message(&head(MessageKind::Join), |out| join.write(out)));
        }
        if let Some(list) = self.list.take() {
            out.extend(message(&head(MessageKind::Snapshot), |out| out.extend(list.iter())));
        }
        out.extend(message(&head(MessageKind::State), |out| out.extend(&recorded.state)));
        let done = FrameAck { hash: recorded.hash, ..FrameAck::default() };
        out.extend(message(&head(MessageKind::Ready), |out| done.write(out)));
        let (frame, time_s) = (recorded.frame, file_time_s);
        self.waiting = Some(WaitingFrame {
            frame,
            time_s,
            poses: poses(world),
            contacts: contacts(world),
            deforming: deforming(world),
            readings: readings(world),
            events: std::mem::take(&mut self.steps),
            images: if self.cameras { images(world) } else { Images::new() },
            messages: out,
        });
        Ok(())
    }

    /// Records the inputs and acknowledgements among the events.
    pub fn events(&mut self, events: &[ServerEvent]) {
        for event in events {
            let head = |kind, facet: FacetNumber, frame| MessageHeader {
                kind,
                run: 0,
                join: facet as u64,
                frame,
                time_s: 0.0,
            };
            let note = match event {
                ServerEvent::Input(facet, input) => {
                    message(&head(MessageKind::Input, *facet, 0), |out| input.write(out))
                }
                ServerEvent::Presented(facet, frame, done, _) => {
                    message(&head(MessageKind::Presented, *facet, *frame), |out| done.write(out))
                }
                _ => continue,
            };
            if self.notes.len() + note.len() <= MAX_STATE_BYTES / 4 {
                self.notes.extend(note);
            }
        }
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// Those of [`Recorder::finish`].
    pub fn finish(mut self) -> Result<Summary, RecordError> {
        self.write_waiting()?;
        self.recorder.finish()
    }

    fn write_waiting(&mut self) -> Result<(), RecordError> {
        let Some(mut waiting) = self.waiting.take() else { return Ok(()) };
        waiting.messages.append(&mut self.notes);
        let WaitingFrame { frame, time_s, poses, contacts, deforming, readings, events, images, messages } = waiting;
        self.recorder.report(&readings, &events)?;
        self.recorder.images(&images)?;
        self.recorder.deforming(time_s, &deforming)?;
        self.recorder.frame(time_s, frame, &poses, &contacts, &messages)
    }
}

/// One frame of a recorded session.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedFrame {
    /// The published frame.
    pub recorded: FrameRecord,
    /// Inputs of users, by the facet that sent them.
    pub inputs: Vec<(FacetNumber, Input)>,
    /// Acknowledgements of facets, each with its frame.
    pub presented: Vec<(FacetNumber, u64, FrameAck)>,
}

/// Error of a recording that cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum SessionReadError {
    /// The file cannot be read as a recording.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A frame of the recording holds no session.
    #[error("frame {0} of the recording holds no session ({1}); record one with `[recording]` in the cave file")]
    Frame(u64, MessageError),
    /// The recording ends before its first frame.
    #[error("the recording has no frame{}", .0.as_ref().map_or(String::new(), |cut| format!(": it is {cut}")))]
    Empty(Option<String>),
    /// The recording was made with another scene.
    #[error("the recording is of a scene with the hash {theirs}; this scene has {ours}")]
    Scene {
        /// Hash in the file, hexadecimal.
        theirs: String,
        /// Hash of this scene, hexadecimal.
        ours: String,
    },
}

/// Reads the recording of a session, frame by frame.
pub struct SessionReader {
    reader: Reader,
    ahead: Option<RecordedFrame>,
    scene: [u8; 32],
}

impl SessionReader {
    /// Opens a recording, complete or truncated.
    ///
    /// # Errors
    /// [`SessionReadError`] if the file is no recording, or not one of a session.
    pub fn open(path: impl AsRef<Path>) -> Result<SessionReader, SessionReadError> {
        let mut replay = SessionReader { reader: read(path)?, ahead: None, scene: [0; 32] };
        replay.ahead = replay.read_frame()?;
        Ok(replay)
    }

    /// Returns the hash of the recorded scene; zeros if no frame can be read.
    pub fn scene(&self) -> [u8; 32] {
        self.scene
    }

    /// Checks that the recording was made with the scene of this hash.
    ///
    /// # Errors
    /// [`SessionReadError::Scene`], and [`SessionReadError::Empty`] before the first call of
    /// [`next_frame`](Self::next_frame) of a recording without frames.
    pub fn check_scene(&self, ours: [u8; 32]) -> Result<(), SessionReadError> {
        let hex = super::server::hex;
        if self.ahead.is_none() && self.scene == [0; 32] {
            let cut = match self.reader.ending() {
                Some(Ending::Cut { offset, .. }) => Some(format!("cut at byte {offset}, before the first frame")),
                _ => None,
            };
            Err(SessionReadError::Empty(cut))
        } else if self.scene == ours {
            Ok(())
        } else {
            Err(SessionReadError::Scene { theirs: hex(&self.scene), ours: hex(&ours) })
        }
    }

    /// Returns the next frame, or `None` at the end.
    ///
    /// # Errors
    /// [`SessionReadError`].
    pub fn next_frame(&mut self) -> Result<Option<RecordedFrame>, SessionReadError> {
        match self.ahead.take() {
            Some(frame) => Ok(Some(frame)),
            None => self.read_frame(),
        }
    }

    fn read_frame(&mut self) -> Result<Option<RecordedFrame>, SessionReadError> {
        let Some(frame) = self.reader.next_frame()? else { return Ok(None) };
        let (replayed, scene) =
            parse_frame(&frame.state).map_err(|fault| SessionReadError::Frame(frame.frame, fault))?;
        self.scene = scene.unwrap_or(self.scene);
        Ok(Some(replayed))
    }
}

/// Parses the messages of a frame. Returns the hash of the scene too if it is among them.
///
/// # Errors
/// [`MessageError`].
pub fn parse_frame(mut bytes: &[u8]) -> Result<(RecordedFrame, Option<[u8; 32]>), MessageError> {
    let (mut state, mut hash, mut snapshot, mut scene) = (None, None, None, None);
    let (mut inputs, mut presented) = (Vec::new(), Vec::new());
    while !bytes.is_empty() {
        let (header, payload, rest) = next_message(bytes)?;
        let facet = u16::try_from(header.join).map_err(|_| MessageError::Malformed("an unknown facet"))?;
        match header.kind {
            MessageKind::Join => scene = Some(Join::read(payload)?.scene),
            MessageKind::Snapshot => snapshot = Some(Arc::new(payload.to_vec())),
            MessageKind::State => state = Some((header.frame, header.time_s, payload.to_vec())),
            MessageKind::Ready => hash = Some(FrameAck::read(payload)?.hash),
            MessageKind::Input => inputs.push((facet, Input::read(payload)?)),
            MessageKind::Presented => presented.push((facet, header.frame, FrameAck::read(payload)?)),
            _ => return Err(MessageError::Malformed("a kind that recordings have not")),
        }
        bytes = rest;
    }
    let ((frame, time_s, state), hash) =
        state.zip(hash).ok_or(MessageError::Malformed("no STATE, or no hash of it"))?;
    Ok((RecordedFrame { recorded: FrameRecord { frame, time_s, snapshot, state, hash }, inputs, presented }, scene))
}

/// Splits off the first message: header, payload, rest.
fn next_message(bytes: &[u8]) -> Result<(MessageHeader, &[u8], &[u8]), MessageError> {
    let size = ByteReader(bytes.get(64..).unwrap_or_default()).u64()?;
    if size < HEADER_BYTES as u64 || size > MAX_MESSAGE_BYTES as u64 {
        return Err(MessageError::Malformed("a message with an impossible size"));
    }
    let (first, rest) = bytes.split_at_checked(size as usize).ok_or(MessageError::Malformed("unexpected end"))?;
    open(first).map(|(header, payload)| (header, payload, rest))
}
