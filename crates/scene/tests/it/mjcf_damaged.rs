//! Damaged models of MuJoCo: any text gives a scene or an error, and a scene that is given can be built
//! or is refused.

use proptest::prelude::*;
use tumble_scene::mjcf::{MjcfOptions, parse};

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
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0..WORDS.len(), 0..3usize), 1..5),
    ) {
        let mut text = MODELS[model].to_owned();
        for (at, word, kind) in edits {
            let ends: Vec<usize> = text.match_indices(['"', ' ', '<', '>', '=']).map(|(k, _)| k).collect();
            if ends.len() < 2 {
                break;
            }
            let from = at.index(ends.len() - 1);
            let range = ends[from] + 1..ends[from + 1];
            match kind {
                0 => text.replace_range(range, WORDS[word]),
                1 => text.replace_range(range, ""),
                _ => {
                    let piece = text[range].to_owned();
                    text.insert_str(ends[from] + 1, &piece);
                }
            }
        }
        survives(&text);
    }
}

#[test]
fn every_beginning_of_a_model_is_an_error_or_a_scene() {
    let text = MODELS[3];
    (0..text.len()).step_by(7).filter(|end| text.is_char_boundary(*end)).for_each(|end| survives(&text[..end]));
}
