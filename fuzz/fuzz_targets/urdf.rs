//! The text of a robot: the tree of its links and joints. No file is opened.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_scene::urdf::{UrdfOptions, parse_model};

fuzz_target!(|text: &str| {
    for floating in [false, true] {
        match parse_model(text, "fuzz.urdf", &UrdfOptions { floating, ..UrdfOptions::default() }) {
            Err(error) => assert!(!error.report(false).is_empty()),
            Ok(robot) => assert_eq!(robot.joints.len(), robot.model.links().len()),
        }
    }
});
