//! The hash of what a facet has drawn. The server makes it of what it sent, a facet of the world it drew, read back after drawing: so it can differ.

use super::quantise::{PER_M, nearest};
use super::wire::{Hash, put_name, short};
use tumble_collide::Pose;

/// Collects what is seen, object by object.
#[derive(Default)]
pub(crate) struct Drawn(Vec<u8>);

impl Drawn {
    /// Of a frame: `table` is the hash of the list of objects with what stands still.
    pub fn frame(mut self, frame: u64, time_s: f64, table: Hash) -> Drawn {
        self.0.clear();
        self.0.extend(frame.to_le_bytes());
        self.0.extend(time_s.to_bits().to_le_bytes());
        self.0.extend(table);
        self
    }

    /// Of a list of objects.
    pub fn table(mut self) -> Drawn {
        self.0.clear();
        self
    }

    pub fn name(&mut self, name: &str) {
        put_name(&mut self.0, name);
    }

    pub fn alive(&mut self, alive: bool) {
        self.0.push(alive as u8);
    }

    /// A pose as it is drawn: positions in the units in which they travel, rotations in the renderer's precision. Poses that differ as they
    /// travel differ here.
    pub fn pose(&mut self, pose: &Pose) {
        let (p, q) = (pose.translation.vector, pose.rotation.coords);
        let mut out = [0; 28];
        for k in 0..3 {
            out[4 * k..4 * k + 4].copy_from_slice(&nearest(p[k] * PER_M).to_le_bytes());
        }
        for k in 0..4 {
            out[12 + 4 * k..16 + 4 * k].copy_from_slice(&(q[k] as f32).to_le_bytes());
        }
        self.0.extend_from_slice(&out);
    }

    pub fn bytes(&mut self, write: impl FnOnce(&mut Vec<u8>)) {
        write(&mut self.0);
    }

    /// The hash; the memory is kept for the next.
    pub fn hash(self) -> (Hash, Drawn) {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.0);
        (short(&hasher), self)
    }
}
