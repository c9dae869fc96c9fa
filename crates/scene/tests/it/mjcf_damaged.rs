//! Damaged models of MuJoCo: any text gives a scene or an error, and a scene that is given can be built
//! or is refused.

use proptest::prelude::*;
use tumble_scene::mjcf::{MjcfOptions, parse};

use crate::damage::{beginnings, damaged, edits};

const MODELS: [&str; 5] = [
    include_str!("../mjcf/cartpole.xml"),
    include_str!("../mjcf/double_pendulum.xml"),
    include_str!("../mjcf/joints.xml"),
    include_str!("../mjcf/scene.xml"),
    include_str!("../mjcf/quadruped.xml"),
];
/// Words that replace others.
const WORDS: [&str; 20] = [
    "0", "-1", "1e300", "nan", "", "1 2 3", "true", "free", "ball", "mesh", "hfield", "world", "body", "joint", "geom",
    "class", "0 0 0 0", "1e-12", "\"/>", "<body>",
];

/// Reads a text and builds what is read.
fn survives(text: &str) {
    match parse(text, "damaged.xml", &MjcfOptions { keyframe: Some("0".into()), ..MjcfOptions::default() }) {
        Ok(scene) => drop(scene.build()),
        Err(error) => assert!(!error.report(false).is_empty()),
    }
    let _ = parse(text, "damaged.xml", &MjcfOptions::default());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn replaced_words_and_lost_pieces_never_panic(
        model in 0..MODELS.len(),
        edits in edits(),
    ) {
        survives(&damaged(MODELS[model], edits, &WORDS));
    }
}

#[test]
fn every_beginning_of_a_model_is_an_error_or_a_scene() {
    beginnings(MODELS[3], 7).for_each(survives);
}
