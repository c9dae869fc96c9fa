//! The archive of a world, behind its head and its checksum, which are made anew: refused, or a world that steps and is
//! written again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_behaviors::read_object;
use tumble_core::World;
use xxhash_rust::xxh3::xxh3_64;

/// Bytes of the head and the checksum.
const BEFORE: usize = 16;
/// Largest input: no archive of the seeds is longer.
pub const MAX_BYTES: usize = 1 << 17;

/// Returns the bytes with the head of the present format and their own checksum.
pub fn sealed(bytes: &[u8]) -> Vec<u8> {
    let own = World::default().archive(&[]).expect("an empty world has an archive");
    let body = &bytes[BEFORE.min(bytes.len())..];
    [&own[..8], &xxh3_64(body).to_le_bytes(), body].concat()
}

fuzz_target!(|bytes: &[u8]| {
    if bytes.len() > MAX_BYTES {
        return;
    }
    let Ok(mut world) = World::from_archive(&sealed(bytes), &mut read_object) else { return };
    let _ = world.archive(&[]);
    let before = world.save();
    match world.step() {
        Ok(_) => assert!(!world.save().is_empty()),
        Err(_) => assert!(world.save() == before, "a step that fails changes nothing"),
    }
});
