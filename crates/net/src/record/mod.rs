//! Recordings: MCAP files that Foxglove and Rerun open without conversion, and that stay readable
//! after a run was killed.
//!
//! ```
//! use tumble_net::record::{Entity, Pose, Recorder, RecorderOptions, Shape, VisualPart, read};
//! # fn main() -> Result<(), tumble_net::record::RecordError> {
//! # let path = std::env::temp_dir().join(format!("tumble-doc-{}.mcap", std::process::id()));
//! let shape = Shape::Sphere { radius: 0.1 };
//! let ball = VisualPart { shape, pose: Pose::IDENTITY, color: [0.9, 0.2, 0.2, 1.0] };
//! let entities = [Entity { name: "ball".into(), parts: vec![ball] }];
//! let mut recorder = Recorder::create(&path, "falling", &entities, RecorderOptions::default())?;
//! for frame in 0..60 {
//!     let t = frame as f64 / 60.0;
//!     recorder.frame(t, frame, &[Pose::at([0.0, 0.0, 5.0 - 4.905 * t * t])], &[], b"state")?;
//! }
//! recorder.finish()?;
//!
//! let last = read(&path)?.last().expect("60 frames")?;
//! assert_eq!((last.frame, last.state.as_slice()), (59, &b"state"[..]));
//! # std::fs::remove_file(&path).ok();
//! # Ok(())
//! # }
//! ```
//!
//! # Content of a file
//!
//! | topic | schema | when |
//! |---|---|---|
//! | [`TOPIC_SCENE`] | `foxglove.SceneUpdate` | at the start and at every change of the list of entities; always the whole list |
//! | [`TOPIC_TRANSFORMS`] | `foxglove.FrameTransforms` | every frame: [`ROOT_FRAME`] → each entity's frame, named as the entity |
//! | [`TOPIC_STATE`] | `tumble.State` | every frame: frame number, exact time and the caller's state bytes and contacts |
//! | [`TOPIC_SURFACES`] | `foxglove.SceneUpdate` | every frame of a world with cloth or jelly: its surfaces |
//! | [`TOPIC_PARTICLES`] | `foxglove.PointCloud` | every frame of a world with particles: at most [`MAX_POINTS`] of them |
//! | [`TOPIC_CAMERAS`] and a name | `foxglove.RawImage` | every frame for which [`Recorder::images`] was called: the image of a camera |
//!
//! All are protobuf, with their schemas in the file. The metadata of the state channel also
//! contains the text of `tumble.State`, under `proto`. A metadata record named `tumble` contains
//! the version and the world's name.
//!
//! **Viewers.** Foxglove draws the entities and moves them. Rerun (0.41) reads the first three topics and
//! moves the frames, but does not draw `foxglove.SceneUpdate`; it lists the message's fields.
//!
//! **Time.** Every time stamp is *simulated* time in nanoseconds from 0, rounded to the nearest. No
//! wall clock enters the file, so the same run gives the same bytes. A viewer that shows dates
//! shows 1 January 1970. `tumble.State` contains the unrounded `f64`.
//!
//! **Killed runs.** Chunks are built in memory and appended whole; the recorder never changes bytes
//! that it has written. A file that ends anywhere is readable up to its last flush
//! ([`FlushEvery`]). A flush passes the bytes to the operating system: they survive the death of
//! the process, but not a power cut. A chunk contains whole frames only. [`read`] accepts a cut
//! file and reports where it ends; [`recover`] makes a complete file of it, for programs that need
//! one.
//!
//! # Bounds
//!
//! Every length in a file is checked against the available bytes and against a limit before it is
//! used: [`MAX_RECORD_BYTES`], [`MAX_CHUNK_BYTES`], [`MAX_DEFINITION_BYTES`], [`MAX_DEFINITIONS`],
//! [`MAX_SCENE_MEMORY`], [`MAX_ENTITIES`], [`MAX_NAME_BYTES`]. The writer respects the same limits
//! (and [`MAX_STATE_BYTES`], [`MAX_SCENE_BYTES`]), so every file that it writes can be read.

mod budget;
mod bytes;
mod chain;
mod chunk;
mod container;
mod deforming;
mod error;
mod images;
#[cfg(feature = "live")]
pub mod live;
mod messages;
mod reader;
mod recover;
mod report;
mod scene;
mod schemas;
mod writer;

pub use chain::{ChainHash, chain_hash};
pub use container::Ending;
pub use deforming::{Deforming, MAX_POINTS, Point, Surface};
pub use error::RecordError;
pub use images::{Images, MAX_CAMERAS, Pixels, RecordedImage, TOPIC_CAMERAS};
pub use reader::{Frame, Reader, is_recording, read};
pub use recover::{RecoverReport, recover};
pub use report::{MAX_EVENTS, Readings, RecordedEvent, TOPIC_EVENTS, TOPIC_SENSORS};
pub use scene::{Contact, Entity, Pose, Shape, VisualPart, decode_contacts, encode_contacts};
pub use schemas::{
    ROOT_FRAME, STATE_PROTO, TOPIC_PARTICLES, TOPIC_SCENE, TOPIC_STATE, TOPIC_SURFACES, TOPIC_TRANSFORMS,
};
pub use writer::{Compression, FlushEvery, Recorder, RecorderOptions, Summary};

/// Maximum number of bytes in one record of a file (a stored chunk, a metadata record).
pub const MAX_RECORD_BYTES: u64 = 256 << 20;
/// Maximum number of bytes in one chunk after decompression.
pub const MAX_CHUNK_BYTES: u64 = 256 << 20;
/// Maximum number of entities at a time.
pub const MAX_ENTITIES: usize = 100_000;
/// Most contacts in one frame.
pub const MAX_CONTACTS: usize = 4096;
/// Maximum number of bytes (UTF-8) in a name.
pub const MAX_NAME_BYTES: usize = 256;
/// Maximum number of state bytes in one frame.
pub const MAX_STATE_BYTES: usize = 64 << 20;
/// Maximum number of bytes of one encoded scene (all entities with their meshes).
pub const MAX_SCENE_BYTES: usize = 128 << 20;
/// Maximum memory of a decoded scene, in bytes, computed before decoding.
pub const MAX_SCENE_MEMORY: u64 = 512 << 20;
/// Maximum number of bytes in the definition of one schema or channel, or in one metadata record.
pub const MAX_DEFINITION_BYTES: usize = 1 << 20;
/// Maximum number of schemas, of channels, and of metadata records in a file.
pub const MAX_DEFINITIONS: usize = 256;
/// Latest simulated time, s: Foxglove's time stamps count seconds in 32 bits.
pub const MAX_TIME_S: f64 = 4.0e9;
