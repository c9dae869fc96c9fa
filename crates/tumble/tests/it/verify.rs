//! `tumble verify`: a recording is computed again, and the first frame that differs is named.

use crate::common::*;
use tumble::net::record::{Recorder, RecorderOptions, read};

#[test]
fn a_recording_is_computed_again_with_the_same_bits() {
    let folder = Folder::new("verify");
    for (scene, extra) in
        [("falling", &["--stepper", "backtracking"][..]), ("newtons_cradle", &[][..]), ("sparks", &[][..])]
    {
        let recording = text(&folder.path(&format!("{scene}.mcap")));
        let with = |words: &[&str]| succeed(&[words, extra].concat());
        with(&["run", scene, "--duration", "0.5", "--quiet", "--record", &recording]);
        let mut reader = read(&recording).unwrap();
        while reader.next_frame().unwrap().is_some() {}
        let hash: String = reader.last_hash().unwrap()[..8].iter().map(|byte| format!("{byte:02x}")).collect();
        let said = with(&["verify", &recording, scene]);
        assert!(said.contains("the same bits in all") && said.contains(&hash), "{said}");
    }
}

#[test]
fn the_first_frame_that_differs_is_named() {
    let folder = Folder::new("verify_differs");
    let recording = text(&folder.path("falling.mcap"));
    succeed(&["run", "falling", "--duration", "0.5", "--quiet", "--record", &recording]);
    // another stepper: the ball falls the same parabola, to rounding
    let said = fail(&["verify", &recording, "falling", "--stepper", "backtracking"], 1);
    assert!(said.contains("differs") && said.contains("in the recording"), "{said}");
    // a copy in which one bit of one frame is another: the frame after it cannot follow
    let (mut reader, copy) = (read(&recording).unwrap(), text(&folder.path("changed.mcap")));
    let mut writer = Recorder::create(&copy, "falling", reader.entities(), RecorderOptions::default()).unwrap();
    while let Some(mut frame) = reader.next_frame().unwrap() {
        let last = frame.state.len() - 1;
        frame.state[last] ^= u8::from(frame.frame == 7);
        writer.frame(frame.time_s, frame.frame, &frame.poses, &frame.contacts, &frame.state).unwrap();
    }
    writer.finish().unwrap();
    let said = fail(&["verify", &copy, "falling"], 1);
    assert!(said.contains("frame 7 ("), "{said}");
}

#[test]
fn a_recording_without_a_frame_is_not_verified() {
    let folder = Folder::new("verify_cut");
    let recording = text(&folder.path("falling.mcap"));
    succeed(&["run", "falling", "--duration", "0.5", "--quiet", "--record", &recording]);
    let bytes = std::fs::read(&recording).unwrap();
    let cut = folder.write("cut.mcap", &bytes[..20_000]);
    let said = fail(&["verify", &cut, "falling"], 2);
    assert!(said.contains("no complete frame"), "{said}");
}

#[test]
fn another_scene_is_an_error_that_says_so() {
    let folder = Folder::new("verify_other");
    let recording = text(&folder.path("falling.mcap"));
    succeed(&["run", "falling", "--duration", "0.1", "--quiet", "--record", &recording]);
    let said = fail(&["verify", &recording, "pendulum"], 2);
    assert!(said.contains("is no state of this scene"), "{said}");
}
