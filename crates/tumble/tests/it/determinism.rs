//! Same input, same bits: between processes, across a save in mid-contact, and in the recording of
//! a killed run.

use crate::common::*;
use std::process::Stdio;
use std::time::{Duration, Instant};
use tumble::net::record::read;

fn state(folder: &Folder, name: &str, args: &[&str]) -> Vec<u8> {
    let path = folder.path(name);
    let mut all = vec!["run"];
    all.extend(args);
    let path_text = text(&path);
    all.extend(["--quiet", "--save", &path_text]);
    succeed(&all);
    std::fs::read(path).unwrap()
}

/// Duration of a scene's run: past its first contacts and into its piles; with `TUMBLE_SLOW=1` a
/// minute.
fn seconds(scene: &str) -> f64 {
    match scene {
        // `backtracking` takes seconds for a frame of what follows
        "dominoes" => 0.3,
        "arch" | "wrecking_ball" => 0.4,
        "mechanism" => 0.2,
        _ if std::env::var_os("TUMBLE_SLOW").is_some_and(|v| v == "1") => 60.0,
        "bowling" => 3.2, // the ball meets the pins after 2.55 s
        "stack" => 0.5,
        "chain" => 1.0, // the ball meets it after 0.29 s
        "walker" | "cloth" | "jelly" => 0.5,
        "ball_machine" => 4.0, // balls lie in the tray after 2 s
        _ => 2.0,
    }
}

#[test]
fn two_runs_of_every_shipped_scene_give_the_same_bytes() {
    let folder = Folder::new("two-runs");
    for scene in SCENES {
        for stepper in STEPPERS {
            let length = seconds(scene).to_string();
            let args = [scene, "--duration", &length, "--stepper", stepper];
            let (a, b) = (state(&folder, "a", &args), state(&folder, "b", &args));
            assert!(!a.is_empty() && a == b, "{scene} in {stepper}: two runs differ");
        }
    }
}

#[test]
fn a_state_saved_in_mid_contact_goes_on_in_another_process_as_if_nothing_had_happened() {
    let folder = Folder::new("restore");
    for scene in SCENES {
        for stepper in STEPPERS {
            // both halves are whole numbers of frames of 1/240 s
            let half = seconds(scene) / 2.0;
            let whole =
                state(&folder, "whole", &[scene, "--duration", &(2.0 * half).to_string(), "--stepper", stepper]);
            let summary = text(&folder.path("half.json"));
            let first = [scene, "--duration", &half.to_string(), "--stepper", stepper, "--summary", &summary];
            let halfway = state(&folder, "half", &first);
            let free = ["pendulum", "piston", "steam_engine", "flock", "sparks", "campfire", "bird"].contains(&scene);
            assert!(
                free || json(summary.as_ref())["contacts_max"].as_u64() > Some(0),
                "{scene} in {stepper}: nothing touched before the save"
            );
            let from = text(&folder.path("half"));
            let resumed = state(
                &folder,
                "rest",
                &[scene, "--duration", &half.to_string(), "--stepper", stepper, "--restore", &from],
            );
            assert!(resumed != halfway, "{scene} in {stepper}: nothing happened after the restore");
            assert!(resumed == whole, "{scene} in {stepper}: the restored run goes another way");
        }
    }
}

#[test]
fn two_recordings_are_the_same_file() {
    let folder = Folder::new("recordings");
    let paths = ["a.mcap", "b.mcap"].map(|name| text(&folder.path(name)));
    for path in &paths {
        succeed(&["run", "falling", "--duration", "0.7", "--quiet", "--record", path]);
    }
    assert!(std::fs::read(&paths[0]).unwrap() == std::fs::read(&paths[1]).unwrap());
}

/// A run that would take minutes is killed (SIGKILL on Unix) once it has written something.
#[test]
fn the_recording_of_a_killed_run_is_readable() {
    let folder = Folder::new("killed");
    let path = folder.path("killed.mcap");
    let mut run = command(&["run", "stack", "--duration", "100000", "--quiet", "--record", &text(&path)])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let patience = Instant::now() + Duration::from_secs(60);
    let written = || std::fs::metadata(&path).map_or(0, |m| m.len());
    while written() < 1 << 20 && Instant::now() < patience {
        std::thread::sleep(Duration::from_millis(10));
    }
    run.kill().unwrap();
    run.wait().unwrap();
    let mut reader = read(&path).unwrap();
    let frames: Vec<_> = reader.by_ref().map(|frame| frame.unwrap()).collect();
    assert!(frames.len() > 10, "{} frames in {} bytes", frames.len(), written());
    assert!(frames.iter().enumerate().all(|(i, frame)| frame.frame == i as u64), "none is missing up to the cut");
    assert_eq!(reader.entities().len(), 11);
    // the frames recorded before the kill are those of a complete run
    let frame = &frames[10];
    let whole = state(&folder, "whole", &["stack", "--duration", &(10.0 / 240.0).to_string()]);
    assert!(frame.state == whole, "frame 10 differs from that of a whole run");
}
