//! The hash chain of a recording: a frame has the hash of itself and of all frames before it.
//!
//! ```text
//! chain_0 = BLAKE3(frame_0, time_0, payload_0)        chain_k = BLAKE3(chain_(k−1), frame_k, time_k, payload_k)
//! ```
//!
//! Frame numbers and times are little-endian, 8 bytes each. So two recordings with the same last hash have the same
//! states in all frames.

/// The hash of a frame and of all before it.
pub type ChainHash = [u8; 32];

/// Returns the hash of a frame that follows the frame with the hash `before`.
pub fn chain_hash(before: Option<&ChainHash>, frame: u64, time_s: f64, state: &[u8]) -> ChainHash {
    let mut hasher = blake3::Hasher::new();
    before.map(|before| hasher.update(before));
    hasher.update(&frame.to_le_bytes());
    hasher.update(&time_s.to_le_bytes());
    hasher.update(state);
    *hasher.finalize().as_bytes()
}
