//! `tumble view`: keys and mouse, the steps that are taken, and errors before a window opens.

use crate::common::*;
use crate::desktop::{Desktop, Session, skip};
use serde_json::Value;

/// A sphere of 2 kg in the middle of the view, without gravity; the eye is 4 m in front of it.
const BALL: &str = "description = \"A ball in the middle\"
[world]
dt_s = 0.01
gravity_m_per_s2 = [0, 0, 0]
[[body]]
name = \"ball\"
shape = { type = \"sphere\", radius_m = 0.5 }
mass_kg = 2.0
position_m = [0, 0, 1]
[camera]
eye_m = [0, -4, 1]
target_m = [0, 0, 1]
vertical_fov_deg = 53.13010235415598
";

fn three(value: &Value) -> [f64; 3] {
    std::array::from_fn(|k| value[k].as_f64().unwrap())
}

fn close(a: [f64; 3], b: [f64; 3], within: f64) -> bool {
    (0..3).all(|k| (a[k] - b[k]).abs() <= within)
}

/// The hash of the state after this simulated time of `tumble run`, s.
fn state_of_run(folder: &Folder, scene: &str, seconds: &str) -> String {
    let path = text(&folder.path("run.state"));
    succeed(&["run", scene, "--quiet", "--duration", seconds, "--save", &path]);
    blake3::hash(&std::fs::read(path).unwrap()).to_hex().to_string()
}

#[test]
fn keys_and_mouse_do_what_they_say() {
    let Some(desktop) = Desktop::open() else { return };
    let folder = Folder::new("view-keys");
    let scene =
        folder.write("ball.toml", BALL.replace("mass_kg = 2.0", "mass_kg = 2.0\nvelocity_m_per_s = [0.01, 0, 0]"));
    let Some(mut view) =
        Session::open(&desktop, "view-keys-status", &[&scene, "--size", "200x150", "--quality", "fast"])
    else {
        return;
    };
    let title = String::from_utf8(desktop.run("xdotool", &["getwindowname", &view.window])).unwrap();
    assert!(title.starts_with(&format!("tumble: {scene}")), "{title}");

    view.key("space");
    let stands = view.until("the pause", |s| s["paused"] == true);
    let later = stands["shown"].as_u64().unwrap();
    view.key("c");
    view.until("a camera", |s| s["camera"] == "front" && s["shown"].as_u64().unwrap() > later);
    view.key("shift+c");
    let stood = view.until("the camera before", |s| s["camera"] == "scene");
    assert_eq!(
        (&stood["frame"], &stood["state_blake3"]),
        (&stands["frame"], &stands["state_blake3"]),
        "time went on while it stood"
    );

    // a step is dt = 0.01 s, one by one
    for (key, n) in [("period", 1), ("n", 2)] {
        view.key(key);
        let frame = stands["frame"].as_u64().unwrap() + n;
        let stepped = view.until("a step", |s| s["frame"].as_u64() == Some(frame));
        assert!(
            (stepped["time_s"].as_f64().unwrap() - stands["time_s"].as_f64().unwrap() - 0.01 * n as f64).abs() < 1e-9
        );
        assert_eq!(stepped["paused"], true);
    }
    view.key("r");
    let reset = view.until("time 0", |s| s["frame"] == 0);
    assert_eq!(reset["time_s"], 0.0);
    assert_eq!(reset["state_blake3"], state_of_run(&folder, &scene, "0").as_str(), "another state than the beginning");

    // 4 m from the target: 1 m/s, so 0.1 m a tap, along y, which is ahead
    assert_eq!(reset["step_m"].as_f64().unwrap(), 0.1);
    let mut eye = [0.0, -4.0, 1.0];
    for (key, by) in [
        ("w", [0.0, 0.1, 0.0]),
        ("Down", [0.0, -0.1, 0.0]),
        ("d", [0.1, 0.0, 0.0]),
        ("a", [-0.1, 0.0, 0.0]),
        ("e", [0.0, 0.0, 0.1]),
        ("Next", [0.0, 0.0, -0.1]),
    ] {
        view.key(key);
        eye = std::array::from_fn(|k| eye[k] + by[k]);
        view.until(&format!("{key} to move the eye to {eye:?}"), |s| close(three(&s["eye_m"]), eye, 1e-5));
    }
    // dragging by 100 pixels turns by 0.5 rad to the right, and by the same angle up
    view.mouse([50, 120]);
    view.button("mousedown", "3");
    view.mouse([150, 20]);
    view.button("mouseup", "3");
    let (sin, cos) = 0.5f64.sin_cos();
    view.until("the turn", |s| close(three(&s["forward"]), [cos * sin, cos * cos, sin], 1e-5));
    // walking is level, flying is along the view
    view.key("w");
    eye = [eye[0] + 0.1 * sin, eye[1] + 0.1 * cos, eye[2]];
    view.until("a level step", |s| close(three(&s["eye_m"]), eye, 1e-5));
    view.key("f");
    view.key("w");
    eye = [eye[0] + 0.1 * cos * sin, eye[1] + 0.1 * cos * cos, eye[2] + 0.1 * sin];
    view.until("a flight upwards", |s| s["flies"] == true && close(three(&s["eye_m"]), eye, 1e-5));
    view.key("Home");
    view.until("the scene's camera", |s| {
        close(three(&s["eye_m"]), [0.0, -4.0, 1.0], 1e-6) && close(three(&s["forward"]), [0.0, 1.0, 0.0], 1e-6)
    });

    for key in ["2", "7", "8", "8"] {
        view.key(key);
    }
    view.until("overlays", |s| s["overlays"] == serde_json::json!(["normals", "islands", "tree=1"]));
    view.key("g");
    view.key("g");
    view.until("the usual looks", |s| s["quality"] == "shadows=soft,samples=4,occlusion=on,map=2048");
    view.key("minus");
    view.key("minus");
    view.until("a quarter of the speed", |s| s["speed"] == 0.25);
    view.button("click", "4");
    view.until("longer steps", |s| s["step_m"].as_f64().unwrap() > 0.1);
    view.key("t");
    view.until("no text", |s| s["caption"] == false);
    view.key("Escape");
    assert_eq!(view.end(), (Some(0), String::new()));
}

#[test]
fn a_run_that_nobody_touches_is_the_run_of_the_command() {
    let Some(desktop) = Desktop::open() else { return };
    let folder = Folder::new("view-same");
    for scene in ["billiards", "robot"] {
        // the run may end before its window is found
        let args = [scene, "--size", "64x48", "--fps", "15", "--duration", "0.5"];
        let mut view = Session::spawn(&desktop, Folder::new("view-same-status"), &args);
        let (code, said) = view.end();
        if said.contains("no graphics adapter") {
            return skip(&format!("this machine has no graphics adapter; {said}"));
        }
        assert_eq!((code, said.as_str()), (Some(0), ""));
        let last = view.status().unwrap();
        assert!((last["time_s"].as_f64().unwrap() - 0.5).abs() < 1e-9, "{last}");
        assert_eq!(last["state_blake3"], state_of_run(&folder, scene, "0.5").as_str(), "{scene}");
    }
}

#[test]
fn a_body_is_pulled_to_the_pointer() {
    let Some(desktop) = Desktop::open() else { return };
    let folder = Folder::new("view-pull");
    let scene = folder.write("ball.toml", BALL);
    let Some(mut view) = Session::open(&desktop, "view-pull-status", &[&scene, "--size", "200x200"]) else { return };
    // the middle of the sphere's front is 3.5 m away
    view.mouse([100, 100]);
    view.button("mousedown", "1");
    let held = view.until("the ball in the hand", |s| s["picked"] == "ball");
    assert!(close(three(&held["pick_target_m"]), [0.0, -0.5, 1.0], 0.03), "{held}");
    // tan 26.565° = 1/2: the picture's half height is 1.75 m there, 100 pixels
    view.mouse([140, 60]);
    let hand = [0.4 * 1.75, -0.5, 1.0 + 0.4 * 1.75];
    view.until("the hand below the pointer", |s| close(three(&s["pick_target_m"]), hand, 0.03));
    let there =
        view.until("the ball at the hand", |s| close(three(&s["picked_point_m"]), three(&s["pick_target_m"]), 0.005));
    assert_eq!(there["picked"], "ball");
    view.button("mouseup", "1");
    view.until("the ball let go", |s| s["picked"].is_null());
    // beside the sphere there is nothing to pick: the view turns
    view.mouse([5, 195]);
    view.button("mousedown", "1");
    view.mouse([25, 195]);
    view.button("mouseup", "1");
    let turned = view.until("the turn", |s| close(three(&s["forward"]), [0.1f64.sin(), 0.1f64.cos(), 0.0], 1e-5));
    assert!(turned["picked"].is_null());
}

/// The first picture takes seconds while a software driver builds its pipelines; the scene starts
/// with it.
#[test]
fn time_begins_with_the_first_picture() {
    let Some(desktop) = Desktop::open() else { return };
    let mut view =
        Session::spawn(&desktop, Folder::new("view-begin"), &["billiards", "--size", "64x48", "--duration", "0.3"]);
    let (code, said) = view.end();
    if said.contains("no graphics adapter") {
        return skip(&format!("this machine has no graphics adapter; {said}"));
    }
    assert_eq!((code, said.as_str()), (Some(0), ""));
    let lines: Vec<Value> = std::fs::read_to_string(view.folder.path("status"))
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let first = lines.iter().find(|s| s["shown"].as_u64().unwrap() > 0).unwrap();
    assert_eq!((&first["time_s"], &first["frame"]), (&serde_json::json!(0.0), &serde_json::json!(0)));
    assert!((lines.last().unwrap()["time_s"].as_f64().unwrap() - 0.3).abs() < 1e-9);
}

#[test]
fn a_picture_that_cannot_be_written_ends_no_session() {
    let Some(desktop) = Desktop::open() else { return };
    let folder = Folder::new("view-shots");
    let shots = folder.path("shots");
    std::fs::create_dir(&shots).unwrap();
    let Some(mut view) =
        Session::open(&desktop, "view-shots-status", &["stack", "--size", "64x48", "--screenshot-dir", &text(&shots)])
    else {
        return;
    };
    view.key("space");
    view.until("the pause", |s| s["paused"] == true);
    // the folder is removed while the window is open
    std::fs::remove_dir(&shots).unwrap();
    view.key("p");
    view.key("1");
    view.until("the overlay", |s| s["overlays"] == serde_json::json!(["contacts"]));
    view.key("Escape");
    let (code, said) = view.end();
    assert!(
        code == Some(0) && said.lines().count() == 1 && said.contains("no picture: ") && said.contains(&text(&shots)),
        "{code:?} {said}"
    );
}

#[test]
fn without_a_desktop_there_is_one_clear_message() {
    let mut command = command(&["view", "stack"]);
    let out =
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").output().unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!((out.status.code(), said.lines().count()), (Some(1), 1), "{said}");
    assert!(
        said.starts_with("error: ")
            && ["DISPLAY", "WAYLAND_DISPLAY", "tumble run SCENE --screenshot"].iter().all(|word| said.contains(word)),
        "{said}"
    );
}

#[test]
fn what_cannot_be_shown_ends_with_code_2_before_a_window_opens() {
    assert!(fail(&["view", "stack", "--camera", "below"], 2).contains("scene, front, left, back, right, top"));
    assert!(fail(&["view", "stack", "--cave", "cube4", "--facet", "fron"], 2).contains("did you mean `front`?"));
    assert!(fail(&["view", "stack", "--cave", "cube4", "--facet", "front", "--size", "80x60"], 2).contains("size_px"));
    assert!(
        fail(&["view", "stack", "--screenshot", "/nonexistent/x.png"], 2).contains("there is no folder /nonexistent")
    );
    assert!(
        fail(&["view", "stack", "--screenshot-dir", "/nonexistent/dir"], 2)
            .contains("--screenshot-dir /nonexistent/dir: there is no such folder")
    );
    assert!(fail(&["view", "stack", "--size", "16384x16384"], 2).contains("at most"));
    assert!(fail_often(&["view", "stack", "--size", "0x10"], 2).contains("1 to 16384"));
    assert!(fail_often(&["view", "stack", "--facet", "front"], 2).contains("--cave"));
}
