//! The fuzz targets of `fuzz/` for NetSync and datagrams, without a fuzzer: on their seeds, and on seeds that were cut, joined and flipped.

use crate::udp::frames;
use std::path::Path;
use tumble_net::sync::udp::network::Random;

/// What a target's macro makes here: a function of its bytes.
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
    udp_packet "../../../../fuzz/fuzz_targets/udp_packet.rs"
    udp_session "../../../../fuzz/fuzz_targets/udp_session.rs"
}

fn seeds(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(name);
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read(file).unwrap()).collect()
}

/// A seed with a few bits flipped, bytes set to corners, a piece of another seed put in, or an end cut off.
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
fn no_target_panics_on_its_seeds_or_on_what_is_made_of_them_full_length() {
    for (name, target) in TARGETS {
        let (seeds, mut random) = (seeds(name), Random::new(name.len() as u64));
        assert!(!seeds.is_empty());
        seeds.iter().for_each(|seed| target(seed));
        for _ in 0..frames(2_000, 200_000) {
            target(&changed(&seeds, &mut random));
        }
    }
}
