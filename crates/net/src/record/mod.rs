//! Recordings: MCAP files that Foxglove and Rerun open as they are, and that a killed run leaves
//! readable.
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
//!     recorder.frame(t, frame, &[Pose::at([0.0, 0.0, 5.0 - 4.905 * t * t])], b"state")?;
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
//! # What is in a file
//!
//! | topic | schema | when |
//! |---|---|---|
//! | [`TOPIC_SCENE`] | `foxglove.SceneUpdate` | at the start and whenever the list of entities changes; always the whole list |
//! | [`TOPIC_TRANSFORMS`] | `foxglove.FrameTransforms` | every frame: [`ROOT_FRAME`] → each entity's frame, named as the entity |
//! | [`TOPIC_STATE`] | `tumble.State` | every frame: frame number, exact time and the caller's state bytes |
//!
//! All three are protobuf and carry their schema in the file; the text of `tumble.State` stands in
//! the channel's metadata under `proto` as well. A metadata record named `tumble` says the version
//! and the world's name.
//!
//! **What viewers show.** Foxglove draws the entities and moves them. Rerun (0.41) reads all three
//! topics and moves the frames, but does not draw `foxglove.SceneUpdate`; it lists the message's
//! fields.
//!
//! **Time.** Every time stamp is *simulated* time in nanoseconds from 0, rounded to the nearest; no
//! wall clock enters the file, so the same run gives the same bytes. A viewer that shows dates
//! shows 1 January 1970. The unrounded `f64` is in `tumble.State`.
//!
//! **Killed runs.** Chunks are built in memory and appended whole; nothing already written is
//! touched again. A file that ends anywhere is readable up to its last flush ([`FlushEvery`]),
//! which puts the bytes into the operating system's hands: they survive the death of the process,
//! not a power cut. A chunk holds whole frames only. [`read`] accepts a cut file and says where it
//! ends; [`recover`] turns it into a complete one, for programs that insist.
//!
//! # Bounds
//!
//! No length in a file is believed before it was checked against the bytes that are there and
//! against a cap: [`MAX_RECORD_BYTES`], [`MAX_CHUNK_BYTES`], [`MAX_DEFINITION_BYTES`],
//! [`MAX_DEFINITIONS`], [`MAX_SCENE_MEMORY`], [`MAX_ENTITIES`], [`MAX_NAME_BYTES`]. The writer
//! keeps to the same caps (and [`MAX_STATE_BYTES`], [`MAX_SCENE_BYTES`]), so whatever it writes can
//! be read.

mod budget;
mod bytes;
mod chunk;
mod container;
mod error;
#[cfg(feature = "live")]
pub mod live;
mod messages;
mod reader;
mod recover;
mod scene;
mod schemas;
mod writer;

pub use container::Ending;
pub use error::RecordError;
pub use reader::{Frame, Reader, read};
pub use recover::{RecoverReport, recover};
pub use scene::{Entity, Pose, Shape, VisualPart};
pub use schemas::{ROOT_FRAME, STATE_PROTO, TOPIC_SCENE, TOPIC_STATE, TOPIC_TRANSFORMS};
pub use writer::{Compression, FlushEvery, Recorder, RecorderOptions, Summary};

/// Most bytes in one record of a file (a chunk as stored, a metadata record).
pub const MAX_RECORD_BYTES: u64 = 256 << 20;
/// Most bytes in one chunk after decompression.
pub const MAX_CHUNK_BYTES: u64 = 256 << 20;
/// Most entities at a time.
pub const MAX_ENTITIES: usize = 100_000;
/// Most bytes (UTF-8) in a name.
pub const MAX_NAME_BYTES: usize = 256;
/// Most bytes of state in one frame.
pub const MAX_STATE_BYTES: usize = 64 << 20;
/// Most bytes of one encoded scene (all entities with their meshes).
pub const MAX_SCENE_BYTES: usize = 128 << 20;
/// Most memory that a scene may take once decoded, by a count made before.
pub const MAX_SCENE_MEMORY: u64 = 512 << 20;
/// Most bytes in the definition of one schema or channel, or in one metadata record.
pub const MAX_DEFINITION_BYTES: usize = 1 << 20;
/// Most schemas, channels and metadata records in a file, of each.
pub const MAX_DEFINITIONS: usize = 256;
/// Latest simulated time, s: Foxglove's time stamps count seconds in 32 bits.
pub const MAX_TIME_S: f64 = 4.0e9;
