//! The hash of what a facet has drawn. The server makes it of what it sent, a facet of the world it drew, read back after drawing: so it can differ.

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

    pub fn pose(&mut self, pose: &Pose) {
        let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
        self.0.extend(numbers.flat_map(|x| x.to_bits().to_le_bytes()));
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
