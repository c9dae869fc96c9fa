//! The recorder: writes frames to an MCAP file.

use super::budget;
use super::chain::{ChainHash, chain_hash};
use super::deforming::Deforming;
use super::error::{RecordError, Result};
use super::images::{ImageChannels, Images, encode_image, image_message};
use super::messages::{nanoseconds, scene_update, set_transforms, transforms_for};
use super::report::{Readings, RecordedEvent, ReportChannels, encode_events, encode_readings};
use super::scene::{Contact, Entity, Pose, check_entities, encode_contacts};
use super::schemas::{Channels, METADATA_NAME, State, VERSION, add_channels};
use super::{MAX_CONTACTS, MAX_NAME_BYTES, MAX_SCENE_BYTES, MAX_STATE_BYTES, MAX_TIME_S};
use foxglove::messages::{FrameTransforms, RawImage};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{WriteOptions, Writer};
use prost::Message;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Compression of chunks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// No compression.
    None,
    /// LZ4: faster.
    Lz4,
    /// Zstandard: smaller.
    Zstd,
}

impl Compression {
    pub(crate) fn to_mcap(self) -> Option<mcap::Compression> {
        match self {
            Compression::None => None,
            Compression::Lz4 => Some(mcap::Compression::Lz4),
            Compression::Zstd => Some(mcap::Compression::Zstd),
        }
    }
}

/// Interval of flushes: a killed run loses at most the frames since the last one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FlushEvery {
    /// A flush after this number of frames, at least 1.
    Frames(u32),
    /// A flush after this many seconds of simulated time, above 0.
    SimulatedSeconds(f64),
}

/// Settings of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecorderOptions {
    /// A chunk of this uncompressed size in bytes is written at once, even if no flush is due; 1 to
    /// 64 MiB.
    pub chunk_size: u64,
    /// Interval of flushes.
    pub flush_every: FlushEvery,
    /// Compression of chunks.
    pub compression: Compression,
}

impl Default for RecorderOptions {
    /// Chunks of 1 MiB, a flush every quarter of a simulated second, LZ4.
    fn default() -> Self {
        Self { chunk_size: 1 << 20, flush_every: FlushEvery::SimulatedSeconds(0.25), compression: Compression::Lz4 }
    }
}

/// Maximum of `chunk_size`.
const MAX_CHUNK_SIZE: u64 = 64 << 20;

impl RecorderOptions {
    fn check(&self) -> Result<()> {
        if !(1..=MAX_CHUNK_SIZE).contains(&self.chunk_size) {
            return Err(RecordError::input(
                "with these options",
                format!("chunk_size {}, 1 to {MAX_CHUNK_SIZE} bytes is allowed", self.chunk_size),
            ));
        }
        let fault = match self.flush_every {
            FlushEvery::Frames(0) => "flush_every 0 frames, at least 1 is needed".to_owned(),
            FlushEvery::SimulatedSeconds(s) if !(s.is_finite() && s > 0.0) => {
                format!("flush_every {s} s, a finite number above 0 is needed")
            }
            _ => return Ok(()),
        };
        Err(RecordError::input("with these options", fault))
    }
}

/// Summary of a finished recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The file.
    pub path: PathBuf,
    /// Number of frames.
    pub frames: u64,
    /// Number of chunks.
    pub chunks: u64,
    /// Size of the file.
    pub bytes: u64,
    /// Simulated time of the last frame, s; 0 without frames.
    pub end_time_s: f64,
}

/// An MCAP writer that only appends: a chunk is built in memory and written whole.
pub(crate) type AppendWriter = Writer<NoSeek<BufWriter<File>>>;

/// Returns options with which the bytes depend on the input only: no threads, no seeking, and
/// chunks that end on request.
pub(crate) fn append_options(compression: Option<mcap::Compression>) -> WriteOptions {
    WriteOptions::new().disable_seeking(true).chunk_size(None).compression(compression).compression_threads(0)
}

/// Writes a recording. Dropping it finishes the file if possible and ignores errors;
/// [`Recorder::finish`] reports them.
pub struct Recorder {
    path: PathBuf,
    options: RecorderOptions,
    writer: AppendWriter,
    channels: Channels,
    names: Vec<String>,
    /// Names of the surfaces of the last frame, and whether it had points.
    shown: (Vec<String>, bool),
    transforms: FrameTransforms,
    /// Bytes of messages in the open chunk.
    pending_bytes: u64,
    /// Frames in the open chunk.
    pending_frames: u64,
    flushed_frames: u64,
    flushed_time_s: f64,
    last: Option<(f64, u64)>,
    report_channels: ReportChannels,
    /// Hash of the last frame and of all before.
    chain: Option<ChainHash>,
    /// Messages of sensors and events that the next frame writes.
    report: [Option<Vec<u8>>; 2],
    image_channels: ImageChannels,
    /// Images that the next frame writes, by their cameras.
    images: Vec<(String, RawImage)>,
}

impl Recorder {
    /// Creates or replaces the file `path`, and writes the scene. `world` is a name for display.
    ///
    /// # Errors
    /// [`RecordError`] if the file cannot be created, or an option, a name or a number is out of
    /// range.
    pub fn create(
        path: impl AsRef<Path>,
        world: &str,
        entities: &[Entity],
        options: RecorderOptions,
    ) -> Result<Recorder> {
        let path = path.as_ref().to_owned();
        options.check()?;
        check_entities(entities)?;
        if world.len() > MAX_NAME_BYTES {
            return Err(RecordError::input(
                "this world",
                format!("its name has {} bytes, at most {MAX_NAME_BYTES} are allowed", world.len()),
            ));
        }
        let file = File::create(&path).map_err(RecordError::io(&path, "cannot create"))?;
        let mut writer = append_options(options.compression.to_mcap())
            .library(concat!("tumble-net/", env!("CARGO_PKG_VERSION")))
            .create(NoSeek::new(BufWriter::new(file)))
            .map_err(RecordError::write(&path))?;
        writer.write_metadata(&description(world)).map_err(RecordError::write(&path))?;
        let channels = add_channels(&mut writer, &path)?;
        let mut recorder = Recorder {
            path,
            options,
            writer,
            channels,
            names: Vec::new(),
            shown: (Vec::new(), false),
            transforms: FrameTransforms::default(),
            pending_bytes: 0,
            pending_frames: 0,
            flushed_frames: 0,
            flushed_time_s: 0.0,
            last: None,
            chain: None,
            report_channels: ReportChannels::default(),
            report: [None, None],
            image_channels: ImageChannels::default(),
            images: Vec::new(),
        };
        recorder.write_scene(0.0, entities)?;
        Ok(recorder)
    }

    /// Replaces the list of entities from `time_s` on; later frames have one pose for each of
    /// these.
    ///
    /// # Errors
    /// As [`Recorder::create`]; also a time before the last frame's.
    pub fn set_entities(&mut self, time_s: f64, entities: &[Entity]) -> Result<()> {
        check_entities(entities)?;
        self.check_time(time_s)?;
        self.flush()?;
        self.write_scene(time_s, entities)
    }

    /// Gives the next frame readings of sensors and events. Without any it has no message of them.
    ///
    /// # Errors
    /// [`RecordError`] for numbers that are not finite, long names, and more than [`MAX_EVENTS`](super::MAX_EVENTS) events.
    pub fn report(&mut self, sensors: &Readings, events: &[RecordedEvent]) -> Result<()> {
        let refuse = |why: String| RecordError::input("a frame", why);
        let sensors = (!sensors.is_empty()).then(|| encode_readings(sensors)).transpose().map_err(refuse)?;
        let events = (!events.is_empty()).then(|| encode_events(events)).transpose().map_err(refuse)?;
        self.report = [sensors, events];
        Ok(())
    }

    /// Gives the next frame images of cameras. Without any it has none.
    ///
    /// # Errors
    /// [`RecordError`] for an image whose pixels are not as many as its size says or are not finite, long names, more than
    /// [`MAX_STATE_BYTES`] bytes, and more than [`MAX_CAMERAS`](super::MAX_CAMERAS) cameras.
    pub fn images(&mut self, images: &Images) -> Result<()> {
        let refuse = |why: String| RecordError::input("a frame", why);
        let one = |(name, image): (&String, _)| Ok((name.clone(), encode_image(name, image)?));
        self.images = images.iter().map(one).collect::<std::result::Result<_, String>>().map_err(refuse)?;
        Ok(())
    }

    /// Records one frame.
    ///
    /// - `time_s`: simulated time, s, finite, 0 to [`MAX_TIME_S`], never before the last frame's.
    /// - `frame`: its number, above the last frame's.
    /// - `poses`: one per entity in the order of the list, `X_WB`.
    /// - `contacts`: between entities of the list, at most [`MAX_CONTACTS`].
    /// - `state`: the caller's bytes to restore the world, at most [`MAX_STATE_BYTES`]; may be
    ///   empty.
    ///
    /// # Errors
    /// [`RecordError`] if a value is out of range, in which case nothing is written, or if writing
    /// fails.
    pub fn frame(&mut self, time_s: f64, frame: u64, poses: &[Pose], contacts: &[Contact], state: &[u8]) -> Result<()> {
        self.check_time(time_s)?;
        self.check_frame(frame, poses, contacts, state)?;
        let log_time = nanoseconds(time_s);
        let sequence = frame as u32; // for people; the whole number is in the state message
        set_transforms(&mut self.transforms, log_time, poses);
        let transforms = self.transforms.encode_to_vec();
        self.write(self.channels.transforms, sequence, log_time, &transforms)?;
        let [sensors, events] = std::mem::take(&mut self.report);
        if let Some(message) = sensors {
            let channel = self.report_channels.sensors(&mut self.writer, &self.path)?;
            self.write(channel, sequence, log_time, &message)?;
        }
        if let Some(message) = events {
            let channel = self.report_channels.events(&mut self.writer, &self.path)?;
            self.write(channel, sequence, log_time, &message)?;
        }
        for (name, image) in std::mem::take(&mut self.images) {
            let channel = self.image_channels.of(&name, &mut self.writer, &self.path)?;
            self.write(channel, sequence, log_time, &image_message(image, log_time))?;
        }
        let chain = chain_hash(self.chain.as_ref(), frame, time_s, state);
        self.chain = Some(chain);
        let state = State {
            version: VERSION,
            frame,
            time_s,
            payload: state.to_vec(),
            contacts: encode_contacts(contacts),
            chain: chain.to_vec(),
        };
        self.write(self.channels.state, sequence, log_time, &state.encode_to_vec())?;
        self.pending_frames += 1;
        self.last = Some((time_s, frame));
        if self.flush_is_due(time_s) { self.flush() } else { Ok(()) }
    }

    /// Records surfaces and points of a frame for viewers, before the [`frame`](Self::frame) itself.
    ///
    /// # Errors
    /// [`RecordError`]: a value is out of range, in which case nothing is written, or writing fails.
    pub fn deforming(&mut self, time_s: f64, shown: &Deforming) -> Result<()> {
        self.check_time(time_s)?;
        let log_time = nanoseconds(time_s);
        let (surfaces, points) = (!shown.surfaces.is_empty(), !shown.points.is_empty());
        if surfaces || !self.shown.0.is_empty() {
            let message = shown.surfaces_message(log_time, &self.shown.0)?.encode_to_vec();
            self.write(self.channels.surfaces, 0, log_time, &message)?;
            self.shown.0 = shown.surfaces.iter().map(|surface| surface.name.clone()).collect();
        }
        if points || self.shown.1 {
            let message = shown.points_message(log_time).encode_to_vec();
            self.write(self.channels.particles, 0, log_time, &message)?;
            self.shown.1 = points;
        }
        Ok(())
    }

    /// Writes all frames so far to the file; they survive if the run is killed.
    pub fn flush(&mut self) -> Result<()> {
        self.writer.flush().map_err(RecordError::write(&self.path))?;
        self.flushed_frames += self.pending_frames;
        self.flushed_time_s = self.last.map_or(self.flushed_time_s, |(time_s, _)| time_s);
        self.pending_frames = 0;
        self.pending_bytes = 0;
        Ok(())
    }

    /// Returns the number of frames that survive if the run is killed.
    pub fn flushed_frames(&self) -> u64 {
        self.flushed_frames
    }

    /// Ends the recording: index, checksums, and a sync to the disk.
    pub fn finish(mut self) -> Result<Summary> {
        self.flush()?;
        let summary = self.writer.finish().map_err(RecordError::write(&self.path))?;
        let file = self.writer.into_inner().into_inner().into_inner();
        let file = file.map_err(|e| RecordError::io(&self.path, "cannot write")(e.into_error()))?;
        file.sync_all().map_err(RecordError::io(&self.path, "cannot sync"))?;
        let bytes = file.metadata().map_err(RecordError::io(&self.path, "cannot ask for its size"))?.len();
        Ok(Summary {
            path: self.path,
            frames: self.flushed_frames,
            chunks: summary.chunk_indexes.len() as u64,
            bytes,
            end_time_s: self.last.map_or(0.0, |(time_s, _)| time_s),
        })
    }

    fn check_time(&self, time_s: f64) -> Result<()> {
        let earliest = self.last.map_or(0.0, |(time_s, _)| time_s);
        if (earliest..=MAX_TIME_S).contains(&time_s) {
            return Ok(());
        }
        Err(RecordError::input(
            format!("time {time_s} s"),
            format!("it must lie from {earliest} (the last frame's) to {MAX_TIME_S}"),
        ))
    }

    fn check_frame(&self, frame: u64, poses: &[Pose], contacts: &[Contact], state: &[u8]) -> Result<()> {
        let refuse = |why: String| Err(RecordError::input(format!("frame {frame}"), why));
        if let Some((_, last)) = self.last
            && frame <= last
        {
            return refuse(format!("frame {last} is already recorded, and numbers must increase"));
        }
        if poses.len() != self.names.len() {
            return refuse(format!("{} poses for {} entities", poses.len(), self.names.len()));
        }
        if contacts.len() > MAX_CONTACTS {
            return refuse(format!("{} contacts, at most {MAX_CONTACTS} are allowed", contacts.len()));
        }
        if let Some(why) = contacts.iter().find_map(|contact| contact.fault(self.names.len())) {
            return refuse(why);
        }
        if state.len() > MAX_STATE_BYTES {
            return refuse(format!("{} bytes of state, at most {MAX_STATE_BYTES} are allowed", state.len()));
        }
        match poses.iter().zip(&self.names).find_map(|(pose, name)| Some((pose.fault()?, name))) {
            Some((why, name)) => refuse(format!("entity \"{name}\": {why}")),
            None => Ok(()),
        }
    }

    /// Writes the scene as a chunk of its own and flushes it: without it nothing can be drawn.
    fn write_scene(&mut self, time_s: f64, entities: &[Entity]) -> Result<()> {
        let log_time = nanoseconds(time_s);
        let update = scene_update(log_time, entities, &self.names);
        let bytes = update.encoded_len();
        if bytes > MAX_SCENE_BYTES {
            return Err(RecordError::input(
                "the scene",
                format!("its meshes take {bytes} bytes, at most {MAX_SCENE_BYTES} are allowed"),
            ));
        }
        let update = update.encode_to_vec();
        budget::check_scene(&update).map_err(|why| RecordError::input("the scene", why))?;
        self.write(self.channels.scene, 0, log_time, &update)?;
        self.names = entities.iter().map(|entity| entity.name.clone()).collect();
        self.transforms = transforms_for(entities);
        self.flush()
    }

    fn write(&mut self, channel_id: u16, sequence: u32, log_time: u64, message: &[u8]) -> Result<()> {
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        self.pending_bytes += message.len() as u64;
        self.writer.write_to_known_channel(&header, message).map_err(RecordError::write(&self.path))
    }

    fn flush_is_due(&self, time_s: f64) -> bool {
        let waited = match self.options.flush_every {
            FlushEvery::Frames(n) => self.pending_frames >= u64::from(n),
            FlushEvery::SimulatedSeconds(s) => time_s - self.flushed_time_s >= s,
        };
        waited || self.pending_bytes >= self.options.chunk_size
    }
}

/// Returns the record that marks a file as a recording of tumble, with its version.
fn description(world: &str) -> Metadata {
    let entries = [
        ("version", VERSION.to_string()),
        ("world", world.to_owned()),
        ("time", "simulated time in nanoseconds from 0".to_owned()),
        ("units", "meters, seconds, z up, right-handed, quaternions x y z w".to_owned()),
    ];
    Metadata { name: METADATA_NAME.into(), metadata: BTreeMap::from(entries.map(|(k, v)| (k.to_owned(), v))) }
}
