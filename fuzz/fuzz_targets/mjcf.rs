//! The text of a model of MuJoCo. No file is opened.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_scene::mjcf::{MjcfOptions, parse};

fuzz_target!(|text: &str| {
    for keyframe in [None, Some("0".to_owned())] {
        match parse(text, "fuzz.xml", &MjcfOptions { keyframe, ..MjcfOptions::default() }) {
            Err(error) => assert!(!error.report(false).is_empty()),
            Ok(scene) => assert!(scene.articulated.iter().all(|body| !body.links.is_empty())),
        }
    }
});
