//! A small world with closed forms, and a temporary folder.

use std::path::{Path, PathBuf};
use tumble_net::record::*;

/// A folder for one test, removed at the end.
pub struct Scratch(PathBuf);

impl Scratch {
    pub fn new(name: &str) -> Scratch {
        let folder = std::env::temp_dir().join(format!("tumble-net-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        Scratch(folder)
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub const WORLD: &str = "thrown ball";
pub const COMPRESSIONS: [Compression; 3] = [Compression::None, Compression::Lz4, Compression::Zstd];

pub fn part(shape: Shape) -> VisualPart {
    VisualPart { shape, pose: Pose::IDENTITY, color: [0.25, 0.5, 0.75, 1.0] }
}

/// A ball that is thrown, a box that rotates, a static ground.
pub fn entities() -> Vec<Entity> {
    vec![
        Entity { name: "ball".into(), parts: vec![part(Shape::Sphere { radius: 0.125 })] },
        Entity { name: "crate".into(), parts: vec![part(Shape::Box { size: [1.0, 2.0, 3.0] })] },
        Entity { name: "ground".into(), parts: vec![part(Shape::Plane { size: 20.0 })] },
    ]
}

pub fn time(k: u64) -> f64 {
    k as f64 / 240.0
}

/// Thrown from (0, 0, 1) at (0.5, 0, 2) under g = 9.81; turning about z at 1 rad/s.
pub fn poses(k: u64) -> Vec<Pose> {
    let t = time(k);
    vec![
        Pose::at([0.5 * t, 0.0, 1.0 + 2.0 * t - 4.905 * t * t]),
        Pose { position: [3.0, 0.0, 1.5], rotation: [0.0, 0.0, (t / 2.0).sin(), (t / 2.0).cos()] },
        Pose::IDENTITY,
    ]
}

/// Frame number and its square, little-endian.
pub fn state(k: u64) -> Vec<u8> {
    [k.to_le_bytes(), (k * k).to_le_bytes()].concat()
}

pub fn options(compression: Compression, frames: u32) -> RecorderOptions {
    RecorderOptions { flush_every: FlushEvery::Frames(frames), compression, ..Default::default() }
}

/// Records frames `0..count` and returns the file's length after each frame, frame 0 first: what a
/// kill at that time leaves.
pub fn record(path: &Path, count: u64, options: RecorderOptions) -> Vec<u64> {
    let mut recorder = Recorder::create(path, WORLD, &entities(), options).unwrap();
    let mut lengths = Vec::new();
    for k in 0..count {
        recorder.frame(time(k), k, &poses(k), &[], &state(k)).unwrap();
        lengths.push(std::fs::metadata(path).unwrap().len());
    }
    assert_eq!(recorder.finish().unwrap().frames, count);
    lengths
}

/// Asserts that these are the frames `0..frames.len()` of the little world, bit for bit.
pub fn assert_frames(frames: &[Frame]) {
    for (k, frame) in (0..).zip(frames) {
        assert_eq!((frame.frame, frame.time_s), (k, time(k)));
        assert_eq!(frame.poses, poses(k), "poses of frame {k}");
        assert_eq!(frame.state, state(k), "state of frame {k}");
    }
}

/// Asserts that each of these frames is right by its own number, and that numbers increase; some
/// may be missing.
pub fn assert_true_frames(frames: &[Frame]) {
    assert!(frames.is_sorted_by(|a, b| a.frame < b.frame));
    for frame in frames {
        let k = frame.frame;
        assert_eq!((frame.time_s, &frame.poses, &frame.state), (time(k), &poses(k), &state(k)), "frame {k}");
    }
}

/// All that can be read: the frames, and the ending or the error.
pub fn read_all(path: &Path) -> (Vec<Frame>, Result<Ending, RecordError>) {
    let mut reader = match read(path) {
        Ok(reader) => reader,
        Err(error) => return (Vec::new(), Err(error)),
    };
    let mut frames = Vec::new();
    loop {
        match reader.next_frame() {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => return (frames, Ok(reader.ending().expect("an ending after the last frame").clone())),
            Err(error) => return (frames, Err(error)),
        }
    }
}

/// xorshift64*, for damage that can be repeated.
pub struct Dice(pub u64);

impl Dice {
    pub fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) % n
    }
}
