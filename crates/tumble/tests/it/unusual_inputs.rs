//! Inputs that used to hang the command or to end it as a success: named pipes, and simulations that
//! diverge.

use crate::common::*;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Runs the command and returns exit code and messages; fails if it does not end within 20 s.
fn ends(args: &[&str]) -> (Option<i32>, String) {
    let mut child = command(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(20) {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("tumble {args:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let out = child.wait_with_output().unwrap();
    (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
}

#[test]
fn named_pipes_are_refused_and_not_waited_for() {
    let folder = Folder::new("fifos");
    let pipe = |name: &str| {
        let path = text(&folder.path(name));
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        path
    };
    let out = text(&folder.path("out.mcap"));
    let (toml, urdf, obj, mcap, cave) =
        (pipe("a.toml"), pipe("a.urdf"), pipe("a.obj"), pipe("a.mcap"), pipe("cave.toml"));
    pipe("warp.obj");
    pipe("blend.png");
    let with = |line: &str| {
        folder.write(&format!("{}.toml", &line[..4]), crate::common::cave(&format!("size_px = [80, 60]\n{line}")))
    };
    let (warp, blend) = (with("warp_file = \"warp.obj\""), with("blend_file = \"blend.png\""));
    pipe("key");
    let key = folder.write("key.toml", crate::common::cave("size_px = [80, 60]") + "[security]\nkey_file = \"key\"\n");
    for args in [
        &["check", &toml][..],
        &["check", &urdf],
        &["check", &obj],
        &["check", &warp],
        &["check", &blend],
        &["check", &key],
        &["cave", "pendulum", "--cave", &warp, "--offscreen", "--duration", "0.02"],
        &["cave", "pendulum", "--cave", &blend, "--offscreen", "--duration", "0.02"],
        &["recover", &mcap, "--output", &out],
        &["run", &toml],
        &["run", "stack", "--restore", &mcap],
        &["spheretree", &obj],
        &["caves", "--pattern", "grid", "--cave", &cave, "--facet", "f", "--screenshot", "a.png"],
    ] {
        let (code, wrong) = ends(args);
        assert_eq!(code, Some(2), "tumble {args:?}: {wrong}");
        assert!(wrong.contains("pipe") || wrong.contains("regular file") || wrong.contains("plain file"), "{wrong}");
    }
}

/// A device without an end behind a symbolic link, as a file that a cave names. The command may have 8 GB of addresses,
/// so that a reader without a limit fails soon.
#[test]
fn devices_behind_links_are_refused_and_not_read() {
    let folder = Folder::new("devices");
    for (key, name) in [("warp_file", "w.pfm"), ("blend_file", "b.png"), ("black_file", "k.png"), ("color", "c.cube")] {
        std::os::unix::fs::symlink("/dev/zero", folder.path(name)).unwrap();
        let value = if key == "color" { format!("{{ lut_file = \"{name}\" }}") } else { format!("\"{name}\"") };
        let mask = if key == "black_file" { "blend_file = \"b.png\"\n" } else { "" };
        let cave = crate::common::cave(&format!("size_px = [80, 60]\n{mask}{key} = {value}"));
        let cave = folder.write(&format!("{key}.toml"), cave);
        for args in [&["check", &cave][..], &["cave", "pendulum", "--cave", &cave, "--offscreen", "--duration", "0.02"]]
        {
            let line = format!("ulimit -v 8000000; exec {} {}", env!("CARGO_BIN_EXE_tumble"), args.join(" "));
            let out = Command::new("sh").args(["-c", &line]).output().unwrap();
            let wrong = String::from_utf8_lossy(&out.stderr);
            assert_eq!(out.status.code(), Some(2), "tumble {args:?}: {wrong}");
            assert!(wrong.contains("regular file") || wrong.contains("PNG"), "tumble {args:?}: {wrong}");
        }
    }
}

#[test]
fn a_pipe_that_somebody_writes_to_is_read() {
    let folder = Folder::new("open-pipe");
    let state = text(&folder.path("state"));
    succeed(&["run", "stack", "--quiet", "--duration", "0.02", "--save", &state]);
    let tumble = env!("CARGO_BIN_EXE_tumble");
    let line = format!("cat {state} | {tumble} run stack --quiet --duration 0.02 --restore /dev/stdin");
    let out = Command::new("sh").args(["-c", &line]).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
}

#[test]
fn a_simulation_that_diverges_is_a_failure_with_its_results() {
    let folder = Folder::new("diverges");
    let summary = folder.path("summary.json");
    let run = |velocity: &str| {
        let scene = folder.write("scene.toml", scene(&format!("velocity_m_per_s = [{velocity}, 0, 0]"), ""));
        tumble(&["run", &scene, "--quiet", "--summary", &text(&summary)])
    };
    let out = run("1e12");
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{wrong}");
    assert!(
        wrong.contains("error: the simulation stopped: 'ball' at t = ") && wrong.contains("its speed, m/s, is 1e12"),
        "{wrong}"
    );
    assert!(json(&summary)["steps"].as_u64() <= Some(1));
    // fast, and slower than light
    assert!(run("2.9e8").status.success());
}
