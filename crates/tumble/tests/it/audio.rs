//! `--audio`: the file, its gain and where it is heard.

use crate::common::*;

/// A ball that falls at x = 0, and two static cameras that look along y, left and right of it.
const SCENE: &str = r#"
description = "A test"
[world]
duration_s = 0.5
[camera]
eye_m = [0, -3, 0.5]
target_m = [0, 0, 0.5]
[[body]]
name = "floor"
mode = "static"
shape = { type = "half_space" }
[[body]]
name = "ball"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 1.0
position_m = [0, 0, 0.4]
[[body]]
name = "left"
mode = "static"
collidable = false
shape = { type = "sphere", radius_m = 0.1 }
position_m = [-3, 0, 0.5]
camera = { forward = [0, 1, 0] }
[[body]]
name = "right"
mode = "static"
collidable = false
shape = { type = "sphere", radius_m = 0.1 }
position_m = [3, 0, 0.5]
camera = { forward = [0, 1, 0] }
"#;

/// Energies of the left and the right ear, and the largest sample.
fn ears(path: &str) -> ([f64; 2], i32) {
    let samples: Vec<i32> =
        hound::WavReader::open(path).unwrap().into_samples::<i16>().map(|s| i32::from(s.unwrap())).collect();
    let energy = |side: usize| samples.iter().skip(side).step_by(2).map(|s| f64::from(*s).powi(2)).sum();
    ([energy(0), energy(1)], samples.iter().map(|s| s.abs()).max().unwrap())
}

#[test]
fn the_peak_is_at_3_db_and_a_gain_is_honored_and_both_are_printed() {
    let folder = Folder::new("audio-gain");
    let (scene, wav) = (folder.write("scene.toml", SCENE), text(&folder.path("run.wav")));
    let said = succeed(&["run", &scene, "--audio", &wav]);
    assert!(said.contains("sound of 1 impacts, peak -3.0 dB, gain "), "{said}");
    assert_eq!(ears(&wav).1, (0.5f64.sqrt() * 32767.0).round() as i32);
    let said = succeed(&["run", &scene, "--audio", &wav, "--audio-gain", "-20"]);
    assert!(said.contains("gain -20.0 dB") && !said.contains("limited"), "{said}");
    let said = succeed(&["run", &scene, "--audio", &wav, "--audio-gain", "120"]);
    assert!(said.contains("peak -0.2 dB") && said.contains("limited"), "{said}");
    assert_eq!(ears(&wav).1, (0.98 * 32767.0f64).round() as i32);
    for wrong in ["121", "loud", "nan"] {
        let said = fail(&["run", &scene, "--audio", &wav, "--audio-gain", wrong], 2);
        assert!(said.contains("expected a number from -120 to 120"), "{said}");
    }
    fail(&["run", &scene, "--audio-gain", "3"], 2);
}

#[test]
fn other_endings_are_refused_before_the_run() {
    let folder = Folder::new("audio-ending");
    let scene = folder.write("scene.toml", SCENE);
    for name in ["run.mp3", "run.ogg", "run.wave"] {
        let path = text(&folder.path(name));
        let said = fail(&["run", &scene, "--audio", &path], 2);
        assert!(said.contains("expected a file that ends in .wav"), "{said}");
        assert!(!folder.path(name).exists());
    }
}

#[test]
fn the_ears_are_at_the_camera_that_is_drawn() {
    let folder = Folder::new("audio-camera");
    let (scene, wav) = (folder.write("scene.toml", SCENE), text(&folder.path("run.wav")));
    let heard = |options: &[&str]| {
        succeed(&[&["run", &scene, "--audio", &wav], options].concat());
        let ([left, right], _) = ears(&wav);
        right / left
    };
    for middle in [&[][..], &["--camera", "scene"]] {
        assert!((heard(middle) - 1.0).abs() < 1e-3, "{middle:?}");
    }
    // from the left the ball is at the right
    assert!(heard(&["--camera", "left"]) > 1e3);
    assert!(heard(&["--camera", "right"]) < 1e-3);
    let said = fail(&["run", &scene, "--audio", &wav, "--camera", "behind"], 2);
    assert!(said.contains("no camera is named 'behind'; expected one of scene, left, right"), "{said}");
    // an event that changes the camera changes the ears
    let event = "[[event]]\nname = \"cut\"\nwhen = { time_s = 0.1 }\ndo = [{ camera = \"right\" }]\n";
    let cut = folder.write("cut.toml", format!("{SCENE}{event}"));
    succeed(&["run", &cut, "--audio", &wav]);
    let ([left, right], _) = ears(&wav);
    assert!(right < 1e-3 * left, "{left} {right}");
}
