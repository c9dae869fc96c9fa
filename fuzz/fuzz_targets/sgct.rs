//! A configuration of SGCT, made a cave, and a list of marks in photographs.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_calibrate::{parse_marks, sgct_to_cave};
use tumble_scene::cave::Cave;

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(made) = sgct_to_cave(text) {
        let _ = Cave::parse(&made.cave, "fuzz.toml");
    }
    let _ = parse_marks(text, "fuzz.toml");
});
