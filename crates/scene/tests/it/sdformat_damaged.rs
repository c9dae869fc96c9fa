//! Damaged SDF files: any text gives a scene or an error, and a scene that is given can be built or is refused.

use proptest::prelude::*;
use tumble_scene::sdformat::parse;
use tumble_scene::urdf::{MissingMeshes, UrdfOptions};

use crate::damage::{beginnings, damaged, edits};

const FILES: [&str; 2] = [include_str!("../sdformat/arm.sdf"), include_str!("../sdformat/world.sdf")];
/// Words that replace others.
const WORDS: [&str; 22] = [
    "0",
    "-1",
    "1e300",
    "nan",
    "",
    "0 0 0 0 0 0",
    "true",
    "ball",
    "universal",
    "world",
    "__model__",
    "a",
    "b",
    "f",
    "j",
    "k",
    "mesh",
    "plane",
    "link",
    "joint",
    "1e-12",
    "a::b",
];

/// Reads a text and builds what is read.
fn survives(text: &str) {
    for missing_meshes in [MissingMeshes::Error, MissingMeshes::Skip] {
        match parse(text, "damaged.sdf", &UrdfOptions { missing_meshes, ..UrdfOptions::default() }) {
            Ok(scene) => drop(scene.build()),
            Err(error) => assert!(!error.report(false).is_empty()),
        }
    }
}

#[test]
fn the_files_are_whole() {
    for text in FILES {
        let scene = parse(text, "whole.sdf", &UrdfOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        scene.build().unwrap();
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn replaced_words_and_lost_pieces_never_panic(
        file in 0..FILES.len(),
        edits in edits(),
    ) {
        survives(&damaged(FILES[file], edits, &WORDS));
    }
}

#[test]
fn every_beginning_of_a_file_is_an_error_or_a_scene() {
    beginnings(FILES[0], 3).for_each(survives);
}
