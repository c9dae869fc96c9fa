//! A run as a recording: what was sent, what users did, what facets answered. And back: the same facets driven from the file.
//!
//! The file is what [`crate::record`] writes, with poses for viewers. The state bytes of a frame are NetSync messages one behind the other, as
//! [`wire`](super::wire) frames them:
//!
//! | kind | header's `join` | |
//! |---|---|---|
//! | JOIN | 0 | in the first frame: the hash of the scene; the name is the server's |
//! | SNAPSHOT | 0 | where the list of objects is new, and in the first frame |
//! | STATE | 0 | the frame |
//! | READY | 0 | what a client must answer: the server's own hash |
//! | INPUT | facet | what users did since the frame before |
//! | PRESENTED | facet | what facets answered since then, each with its frame in the header |

use super::input::Input;
use super::messages::{FrameAck, Join};
use super::server::ServerEvent;
use super::transport::{FacetNumber, MAX_MESSAGE_BYTES};
use super::wire::{ByteReader, HEADER_BYTES, Hash, MessageError, MessageHeader, MessageKind, message, open};
use crate::record::{MAX_STATE_BYTES, Pose, Reader, RecordError, Recorder, RecorderOptions, Summary, read};
use crate::world::{entities, names, poses};
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
    /// Payload of SNAPSHOT, where the list of objects is new.
    pub snapshot: Option<Arc<Vec<u8>>>,
    /// Payload of STATE.
    pub state: Vec<u8>,
    /// What a client that drew it must answer.
    pub hash: Hash,
}

/// Writes a session. A frame is written when the next one comes, so that its answers are with it.
pub struct SessionRecorder {
    recorder: Recorder,
    every: u32,
    count: u64,
    /// The frame that waits for its answers: number, time, poses, messages so far.
    waiting: Option<(u64, f64, Vec<Pose>, Vec<u8>)>,
    /// What came in frames that are left out.
    notes: Vec<u8>,
    list: Option<Arc<Vec<u8>>>,
    names: Vec<String>,
    scene: [u8; 32],
}

impl SessionRecorder {
    /// Creates (or replaces) the file. `name` is the scene's, for people; `scene` its hash. One in `every` frames is recorded (`every_frames` of a cave file;
    /// 0 counts as 1); inputs and answers all are.
    ///
    /// # Errors
    /// As [`Recorder::create`].
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
            list: None,
            names,
            scene,
        })
    }

    /// Records the frame published last: [`ServerSession::recorded`](super::ServerSession::recorded) of the world as it was then, with
    /// `fresh` at the first call.
    ///
    /// # Errors
    /// As [`Recorder::frame`].
    pub fn frame(&mut self, world: &World, recorded: FrameRecord) -> Result<(), RecordError> {
        let first = self.count == 0;
        self.list = recorded.snapshot.or(self.list.take());
        self.count += 1;
        if !(self.count - 1).is_multiple_of(self.every as u64) {
            return Ok(());
        }
        self.write_waiting()?;
        let names = names(world);
        if names != self.names {
            self.recorder.set_entities(recorded.time_s, &entities(world))?;
            self.names = names;
        }
        let head = |kind| MessageHeader { kind, run: 0, join: 0, frame: recorded.frame, time_s: recorded.time_s };
        let mut out = Vec::new();
        if first {
            let join = Join { scene: self.scene, name: "server".into(), exact: false };
            out.extend(message(&head(MessageKind::Join), |out| join.write(out)));
        }
        if let Some(list) = self.list.take() {
            out.extend(message(&head(MessageKind::Snapshot), |out| out.extend(list.iter())));
        }
        out.extend(message(&head(MessageKind::State), |out| out.extend(&recorded.state)));
        let done = FrameAck { hash: recorded.hash, ..FrameAck::default() };
        out.extend(message(&head(MessageKind::Ready), |out| done.write(out)));
        self.waiting = Some((recorded.frame, recorded.time_s, poses(world), out));
        Ok(())
    }

    /// Records what happened: inputs and answers.
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
    /// As [`Recorder::finish`].
    pub fn finish(mut self) -> Result<Summary, RecordError> {
        self.write_waiting()?;
        self.recorder.finish()
    }

    fn write_waiting(&mut self) -> Result<(), RecordError> {
        let Some((frame, time_s, poses, mut messages)) = self.waiting.take() else { return Ok(()) };
        messages.append(&mut self.notes);
        self.recorder.frame(time_s, frame, &poses, &messages)
    }
}

/// One frame of a recorded session.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedFrame {
    /// What was published.
    pub recorded: FrameRecord,
    /// What users did.
    pub inputs: Vec<(FacetNumber, Input)>,
    /// What facets answered, each with its frame.
    pub presented: Vec<(FacetNumber, u64, FrameAck)>,
}

/// Why a recording is not replayed.
#[derive(Debug, thiserror::Error)]
pub enum SessionReadError {
    /// The file.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A recording, and of no session.
    #[error(
        "frame {0} of the recording is no frame of a session ({1}); record one with `[recording]` in the cave file"
    )]
    Frame(u64, MessageError),
    /// Of another scene.
    #[error("the recording is of a scene with the hash {theirs}; this scene has {ours}")]
    Scene {
        /// In the file.
        theirs: String,
        /// Here.
        ours: String,
    },
}

/// Reads a session back, frame by frame.
pub struct SessionReader {
    reader: Reader,
    ahead: Option<RecordedFrame>,
    scene: [u8; 32],
}

impl SessionReader {
    /// Opens a recording, complete or cut.
    ///
    /// # Errors
    /// [`SessionReadError`]: no recording, or not of a session.
    pub fn open(path: impl AsRef<Path>) -> Result<SessionReader, SessionReadError> {
        let mut replay = SessionReader { reader: read(path)?, ahead: None, scene: [0; 32] };
        replay.ahead = replay.read_frame()?;
        Ok(replay)
    }

    /// The hash of the scene it is of; zeros where no frame is left.
    pub fn scene(&self) -> [u8; 32] {
        self.scene
    }

    /// Refuses another scene, with both hashes.
    ///
    /// # Errors
    /// [`SessionReadError::Scene`].
    pub fn check_scene(&self, ours: [u8; 32]) -> Result<(), SessionReadError> {
        let hex = super::server::hex;
        if self.scene == ours {
            Ok(())
        } else {
            Err(SessionReadError::Scene { theirs: hex(&self.scene), ours: hex(&ours) })
        }
    }

    /// The next frame; `None` at the end.
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

/// A frame's messages, and the scene's hash if it is among them.
///
/// # Errors
/// [`MessageError`].
pub fn parse_frame(mut bytes: &[u8]) -> Result<(RecordedFrame, Option<[u8; 32]>), MessageError> {
    let (mut state, mut hash, mut snapshot, mut scene) = (None, None, None, None);
    let (mut inputs, mut presented) = (Vec::new(), Vec::new());
    while !bytes.is_empty() {
        let (header, payload, rest) = next_message(bytes)?;
        let facet = u16::try_from(header.join).map_err(|_| MessageError::Malformed("a facet that there is not"))?;
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

/// The message at the front, and what follows.
fn next_message(bytes: &[u8]) -> Result<(MessageHeader, &[u8], &[u8]), MessageError> {
    let size = ByteReader(bytes.get(64..).unwrap_or_default()).u64()?;
    if size < HEADER_BYTES as u64 || size > MAX_MESSAGE_BYTES as u64 {
        return Err(MessageError::Malformed("a message with a size that cannot be"));
    }
    let (first, rest) = bytes.split_at_checked(size as usize).ok_or(MessageError::Malformed("it ends too early"))?;
    open(first).map(|(header, payload)| (header, payload, rest))
}
