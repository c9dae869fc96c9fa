//! The fuzz targets of `fuzz/` for NetSync and datagrams, run without a fuzzer: on their seeds, and
//! on seeds that were cut, joined and flipped.

use crate::udp::frames as count;
use std::path::Path;
use tumble_net::sync::compute::{ObjectHashes, Step};
use tumble_net::sync::messages::{FacetCounts, FrameAck, Join};
use tumble_net::sync::parse_frame;
use tumble_net::sync::shm::wire::SampleHeader;
use tumble_net::sync::table::Snapshot;
use tumble_net::sync::udp::frames;
use tumble_net::sync::udp::network::Random;
use tumble_net::sync::{Input, Viewer, wire};

/// Replaces the macro of `libfuzzer_sys`: makes a target a function of its bytes.
#[macro_export]
macro_rules! fuzz_target {
    (|$bytes:ident: &[u8]| $body:block) => {
        pub fn target($bytes: &[u8]) {
            $body
        }
    };
}

macro_rules! targets {
    ($($name:ident $path:literal)*) => {
        $(#[allow(unused_attributes, unused_imports)] #[path = $path] mod $name;)*
        const TARGETS: &[(&str, fn(&[u8]))] = &[$((stringify!($name), $name::target)),*];
    };
}

targets! {
    netsync_frame "../../../../fuzz/fuzz_targets/netsync_frame.rs"
    netsync_mirror "../../../../fuzz/fuzz_targets/netsync_mirror.rs"
    netsync_session "../../../../fuzz/fuzz_targets/netsync_session.rs"
    netsync_recording "../../../../fuzz/fuzz_targets/netsync_recording.rs"
    browser "../../../../fuzz/fuzz_targets/browser.rs"
    console "../../../../fuzz/fuzz_targets/console.rs"
    key "../../../../fuzz/fuzz_targets/key.rs"
    udp_packet "../../../../fuzz/fuzz_targets/udp_packet.rs"
    udp_session "../../../../fuzz/fuzz_targets/udp_session.rs"
}

/// The seeds are of the current versions: a parser refuses another version at its first bytes, so
/// such a seed would test nothing.
#[test]
fn seeds_are_of_the_current_versions() {
    let seed =
        |name: &str| std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(name)).unwrap();
    assert!(wire::open(&seed("netsync_frame/message")).is_ok());
    assert!(
        Snapshot::parse(&seed("netsync_frame/snapshot")).is_ok() && Viewer::read(&seed("netsync_frame/viewer")).is_ok()
    );
    assert!(
        Step::read(&seed("netsync_frame/step")).is_ok() && ObjectHashes::read(&seed("netsync_frame/differs")).is_ok()
    );
    assert!(Join::read(&seed("netsync_frame/join")).is_ok() && Input::read(&seed("netsync_frame/input")).is_ok());
    assert!(
        FrameAck::read(&seed("netsync_frame/done")).is_ok() && FacetCounts::read(&seed("netsync_frame/counts")).is_ok()
    );
    assert!(
        Snapshot::parse(&seed("netsync_mirror/snapshot")).is_ok()
            && Snapshot::parse(&seed("netsync_mirror/snapshot_guests")).is_ok()
    );
    assert!(parse_frame(&seed("netsync_recording/frame")).is_ok());
    for name in ["ack", "close", "fragment", "newest", "parity"] {
        assert!(frames::parse(&seed(&format!("udp_packet/{name}"))).is_some_and(|frames| !frames.is_empty()), "{name}");
    }
    let bytes = seed("udp_packet/shm");
    let words: Vec<u64> = bytes.chunks_exact(8).map(|word| u64::from_le_bytes(word.try_into().unwrap())).collect();
    assert!(SampleHeader::parse(words[..6].try_into().unwrap()).is_ok());
}

fn seeds(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(name);
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read(file).unwrap()).collect()
}

/// Returns a seed with a few changes: bits flipped, bytes set to extreme values, a piece of another
/// seed inserted, or the end cut off.
fn changed(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].clone();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len());
        match random.below(5) {
            0 => bytes.truncate(at),
            1 => {
                let other = &seeds[random.below(seeds.len())];
                let from = random.below(other.len());
                bytes.splice(at..at, other[from..].iter().take(64).copied());
            }
            2 if at < bytes.len() => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][random.below(5)],
            _ if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            _ => {}
        }
    }
    bytes
}

#[test]
fn no_target_panics_on_its_seeds_or_on_changed_seeds_full_length() {
    for (name, target) in TARGETS {
        let (seeds, mut random) = (seeds(name), Random::new(name.len() as u64));
        assert!(!seeds.is_empty());
        seeds.iter().for_each(|seed| target(seed));
        for _ in 0..count(2_000, 200_000) {
            target(&changed(&seeds, &mut random));
        }
    }
}
