//! Hash of a drawn frame. The server computes it from the message that it sent. A facet computes it
//! from the world that it drew, read back after drawing, so the two can differ.

use super::wire::{Hash, put_name};
use tumble_collide::Pose;
use xxhash_rust::xxh3::xxh3_128;

/// Collects the bytes that are hashed, object by object.
#[derive(Default)]
pub(crate) struct FrameHasher(Vec<u8>);

impl FrameHasher {
    /// Begins the hash of a frame. `table` is the hash of the object table with its stationary
    /// objects.
    pub fn frame(mut self, frame: u64, time_s: f64, table: Hash) -> FrameHasher {
        self.0.clear();
        self.0.extend(frame.to_le_bytes());
        self.0.extend(time_s.to_bits().to_le_bytes());
        self.0.extend(table);
        self
    }

    /// Begins the hash of an object table.
    pub fn table(mut self) -> FrameHasher {
        self.0.clear();
        self
    }

    pub fn name(&mut self, name: &str) {
        put_name(&mut self.0, name);
    }

    #[inline]
    pub fn enabled(&mut self, enabled: bool) {
        self.0.push(enabled as u8);
    }

    /// Adds a pose as it is drawn: the position exactly, the rotation in the renderer's single
    /// precision. Poses that differ in the message differ here.
    #[inline]
    pub fn pose(&mut self, pose: &Pose) {
        let (p, q) = (&pose.translation.vector, &pose.rotation.coords);
        let mut out = [0; 40];
        let (position, rotation) = out.split_at_mut(24);
        position.as_chunks_mut().0.iter_mut().zip(p.iter()).for_each(|(to, x)| *to = x.to_le_bytes());
        rotation.as_chunks_mut().0.iter_mut().zip(q.iter()).for_each(|(to, x)| *to = (*x as f32).to_le_bytes());
        self.0.extend_from_slice(&out);
    }

    pub fn bytes(&mut self, write: impl FnOnce(&mut Vec<u8>)) {
        write(&mut self.0);
    }

    /// Returns the hash, and the hasher with its memory for the next frame.
    pub fn hash(self) -> (Hash, FrameHasher) {
        (xxh3_128(&self.0).to_le_bytes(), self)
    }
}
