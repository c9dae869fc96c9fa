//! The fuzz targets of `fuzz/` for archives, warps, photographs and configurations, run without a fuzzer: on their seeds,
//! and on these with bits flipped, pieces lost, repeated or replaced by words, and ends cut off. `TUMBLE_SLOW=1` runs 100,000 of each.

use std::path::Path;
use std::time::Instant;
use tumble_calibrate::{Mpcdi, Photo, mpcdi_to_cave, parse_marks, sgct_to_cave};
use tumble_render::{ScreenMesh, Warp};

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
    ($($name:ident $path:literal)*) => { $(#[allow(unused_attributes, unused_imports)] #[path = $path] mod $name;)* };
}

targets! {
    mpcdi_target "../../../../fuzz/fuzz_targets/mpcdi.rs"
    photo_target "../../../../fuzz/fuzz_targets/photo.rs"
    sgct_target "../../../../fuzz/fuzz_targets/sgct.rs"
    warp_target "../../../../fuzz/fuzz_targets/warp.rs"
}

/// Words that replace bytes: extreme numbers, numbers in binary, marks of the formats.
const WORDS: [&[u8]; 24] = [
    b"0",
    b"-1",
    b"4294967295",
    b"99999999999",
    b"1e300",
    b"nan",
    b"\n",
    b" ",
    b"f ",
    b"vt ",
    b"/",
    b"#",
    b"PF\n",
    b"-1.0\n",
    b"{",
    b"]",
    b"null",
    b"\"planarProjection\"",
    b"\xff\xff\xff\xff",
    b"\x00\x00\xc0\x7f",
    b"\xff\xff\x7f\x7f",
    b"IDAT",
    b"\xff\xc0",
    b"\x80",
];

/// Numbers by the generator of xorshift64*.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % n
    }
}

fn changed(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].clone();
    for _ in 0..1 + random.below(3) {
        if bytes.is_empty() {
            break;
        }
        let at = random.below(bytes.len());
        let end = (at + 1 + random.below(12)).min(bytes.len());
        let word = WORDS[random.below(WORDS.len())];
        match random.below(7) {
            0 | 1 => bytes[at] ^= 1 << random.below(8),
            2 if random.below(4) == 0 => bytes.truncate(at),
            3 => drop(bytes.splice(at..at, word.iter().copied())),
            4 => drop(bytes.drain(at..end)),
            5 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => drop(bytes.splice(at..end, word.iter().copied())),
        }
    }
    bytes
}

/// Runs a target on the seeds of its name and on changed ones. `is_read` says whether an input is read.
fn fuzz(name: &str, target: fn(&[u8]), is_read: impl Fn(&[u8]) -> bool) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(name);
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let seeds: Vec<Vec<u8>> = files.iter().map(|path| std::fs::read(path).unwrap()).collect();
    assert!(seeds.len() > 1 && seeds.iter().all(|seed| is_read(seed)), "{name}");
    let slow = std::env::var_os("TUMBLE_SLOW").is_some_and(|value| value == "1");
    let count = if slow { 100_000 } else { 3000 };
    let (mut random, mut read, mut longest) = (Random(31), 0, 0.0_f64);
    for n in 0..count {
        let bytes = if n < seeds.len() { seeds[n].clone() } else { changed(&seeds, &mut random) };
        let start = Instant::now();
        target(&bytes);
        longest = longest.max(start.elapsed().as_secs_f64());
        read += usize::from(is_read(&bytes));
    }
    println!("{name}: {count} inputs, {read} read, at most {longest:.3} s");
    assert!(read > count / 50 && read < count, "{name}: {read} of {count}");
    assert!(longest < 5.0, "{name}: {longest} s for a few hundred bytes");
}

#[test]
fn seeds_are_read_whole_and_damaged_without_a_panic() {
    for name in ["archive", "description"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/mpcdi").join(name);
        let seed = std::fs::read(path).unwrap();
        let read = Mpcdi::parse(&seed).unwrap_or_else(|e| panic!("{name}: {e}"));
        mpcdi_to_cave(&read, [0.0, 0.0, 1.7]).unwrap_or_else(|e| panic!("{name}: {e}"));
        for i in 0..seed.len() {
            let mut damaged = seed.clone();
            damaged[i] ^= 1 << (i % 8);
            mpcdi_target::target(&damaged);
            mpcdi_target::target(&seed[..i]);
        }
    }
}

#[test]
fn changed_warps_are_read_or_refused_full_length() {
    let is_read = |bytes: &[u8]| {
        Warp::from_pfm(bytes).is_ok()
            || Warp::from_obj(bytes).is_ok()
            || ScreenMesh::from_pfm(bytes).is_ok()
            || ScreenMesh::from_obj(bytes).is_ok()
    };
    fuzz("warp", warp_target::target, is_read);
}

#[test]
fn changed_photographs_are_read_or_refused_full_length() {
    fuzz("photo", photo_target::target, |bytes| Photo::parse(bytes).is_ok());
}

#[test]
fn changed_configurations_are_read_or_refused_full_length() {
    let is_read = |bytes: &[u8]| {
        std::str::from_utf8(bytes)
            .is_ok_and(|text| sgct_to_cave(text).is_ok() || parse_marks(text, "marks.toml").is_ok())
    };
    fuzz("sgct", sgct_target::target, is_read);
}
