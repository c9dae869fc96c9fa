//! `tumble view` in a real window: an X server of the test's own (Xvfb), real keys and mouse (xdotool), a picture of the window (import).

use crate::common::*;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Nothing here waits longer.
const PATIENCE: Duration = Duration::from_secs(60);

/// A ball of 2 kg that hangs in the middle of the view, without gravity; the eye is 4 m in front of it.
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

/// Ends a process when the test does, however that is.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// An X server without a screen, on a display that was free.
struct Desktop {
    server: Running,
    display: String,
}

fn skip(why: &str) {
    // past the harness, which keeps what passing tests print
    let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("\nSKIPPED: {why}\n"));
}

impl Desktop {
    /// `None`, said visibly, where a program is missing.
    fn open() -> Option<Desktop> {
        let has = |program: &str| std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()).any(|folder| folder.join(program).is_file());
        if let Some(missing) = ["Xvfb", "xdotool", "import"].into_iter().find(|p| !has(p)) {
            skip(&format!("windows are not tested: there is no {missing}; on Debian: apt-get install xvfb xdotool imagemagick"));
            return None;
        }
        let mut command = Command::new("Xvfb");
        // without -noreset it begins anew when the last window closes, and refuses who comes in that moment
        command.args(["-displayfd", "1", "-screen", "0", "1000x700x24", "-nolisten", "tcp", "-noreset"]).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut server = Running(command.spawn().unwrap());
        let mut number = String::new();
        // the server closes its end when it fails, so this ends
        BufReader::new(server.0.stdout.take().unwrap()).read_line(&mut number).unwrap();
        assert!(!number.trim().is_empty(), "Xvfb did not start");
        Some(Desktop { server, display: format!(":{}", number.trim()) })
    }

    fn run(&self, program: &str, args: &[&str]) -> Vec<u8> {
        let out = Command::new(program).args(args).env("DISPLAY", &self.display).output().unwrap();
        assert!(out.status.success(), "{program} {args:?}: {}", String::from_utf8_lossy(&out.stderr));
        out.stdout
    }
}

/// `tumble view` on a desktop, with its status.
struct Session<'a> {
    desktop: &'a Desktop,
    folder: Folder,
    process: Running,
    window: String,
}

impl<'a> Session<'a> {
    /// Opens a window and waits for its first picture. `None` where there is no graphics adapter.
    fn open(desktop: &'a Desktop, name: &str, args: &[&str]) -> Option<Session<'a>> {
        let folder = Folder::new(name);
        let mut session = Session::spawn(desktop, folder, args);
        let start = Instant::now();
        while session.status().is_none_or(|s| s["shown"] == 0) {
            if let Some(ended) = session.process.0.try_wait().unwrap() {
                let said = std::fs::read_to_string(session.folder.path("stderr")).unwrap();
                assert!(said.contains("no graphics adapter"), "ended with {ended}: {said}");
                skip(&format!("this machine has no graphics adapter; {said}"));
                return None;
            }
            assert!(start.elapsed() < PATIENCE, "no picture came");
            std::thread::sleep(Duration::from_millis(20));
        }
        let windows = String::from_utf8(desktop.run("xdotool", &["search", "--name", "^tumble: "])).unwrap();
        session.window = windows.lines().next().unwrap().to_string();
        desktop.run("xdotool", &["windowfocus", &session.window]);
        session.until("the keyboard", |s| s["focused"] == true);
        Some(session)
    }

    fn spawn(desktop: &'a Desktop, folder: Folder, args: &[&str]) -> Session<'a> {
        let (status, log) = (text(&folder.path("status")), std::fs::File::create(folder.path("stderr")).unwrap());
        let mut command = command(&[&["view"], args, &["--status", &status]].concat());
        command.env("DISPLAY", &desktop.display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").stderr(log);
        let process = Running(command.spawn().unwrap());
        Session { desktop, folder, process, window: String::new() }
    }

    /// The last whole line of the status.
    fn status(&self) -> Option<Value> {
        let text = std::fs::read_to_string(self.folder.path("status")).ok()?;
        let whole = &text[..text.rfind('\n')?];
        Some(serde_json::from_str(whole.lines().last()?).unwrap())
    }

    /// Waits until the status is as wanted.
    fn until(&mut self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            let status = self.status().unwrap();
            if wanted(&status) {
                return status;
            }
            assert!(self.process.0.try_wait().unwrap().is_none(), "the window closed before {what}");
            assert!(start.elapsed() < PATIENCE, "waited in vain for {what}; the status is {status}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn key(&self, key: &str) {
        self.desktop.run("xdotool", &["key", key]);
    }

    fn mouse(&self, [x, y]: [u32; 2]) {
        self.desktop.run("xdotool", &["mousemove", "--window", &self.window, &x.to_string(), &y.to_string()]);
    }

    fn button(&self, what: &str, button: &str) {
        self.desktop.run("xdotool", &[what, button]);
    }

    /// What the window shows: rows of red, green, blue.
    fn shot(&self) -> Vec<u8> {
        self.desktop.run("import", &["-window", &self.window, "-depth", "8", "rgb:-"])
    }

    /// Waits until the window shows a picture, but for a level of each channel: presenting takes its time.
    fn comes_to_show(&self, image: &tumble::render::Image) {
        let start = Instant::now();
        loop {
            let window = self.shot();
            assert_eq!(window.len(), image.rgba.len() / 4 * 3, "the window has another size");
            let off = window.chunks_exact(3).zip(image.rgba.chunks_exact(4)).filter(|(a, b)| (0..3).any(|k| a[k].abs_diff(b[k]) > 1)).count();
            if off == 0 {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "{off} pixels differ by more than a level");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// As a desktop does when the cross in the title bar is clicked.
    fn ask_to_close(&self) {
        use x11rb::connection::Connection;
        use x11rb::protocol::xproto::{ClientMessageEvent, ConnectionExt, EventMask};
        let (server, _) = x11rb::connect(Some(&self.desktop.display)).unwrap();
        let atom = |name: &[u8]| server.intern_atom(false, name).unwrap().reply().unwrap().atom;
        let window = self.window.parse().unwrap();
        let message = ClientMessageEvent::new(32, window, atom(b"WM_PROTOCOLS"), [atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0]);
        server.send_event(false, window, EventMask::NO_EVENT, message).unwrap().check().unwrap();
        server.flush().unwrap();
    }

    /// The exit code, and what was said.
    fn end(&mut self) -> (Option<i32>, String) {
        let start = Instant::now();
        loop {
            if let Some(status) = self.process.0.try_wait().unwrap() {
                return (status.code(), std::fs::read_to_string(self.folder.path("stderr")).unwrap());
            }
            assert!(start.elapsed() < PATIENCE, "the window does not close");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

fn three(value: &Value) -> [f64; 3] {
    std::array::from_fn(|k| value[k].as_f64().unwrap())
}

fn close(a: [f64; 3], b: [f64; 3], within: f64) -> bool {
    (0..3).all(|k| (a[k] - b[k]).abs() <= within)
}

/// The hash of the state after so many seconds of `tumble run`.
fn state_of_run(folder: &Folder, scene: &str, seconds: &str) -> String {
    let path = text(&folder.path("run.state"));
    succeed(&["run", scene, "--quiet", "--seconds", seconds, "--save", &path]);
    blake3::hash(&std::fs::read(path).unwrap()).to_hex().to_string()
}

#[test]
fn keys_and_mouse_do_what_they_say() {
    let Some(desktop) = Desktop::open() else { return };
    let folder = Folder::new("view-keys");
    let scene = folder.write("ball.toml", BALL.replace("mass_kg = 2.0", "mass_kg = 2.0\nvelocity_m_per_s = [0.01, 0, 0]"));
    let Some(mut view) = Session::open(&desktop, "view-keys-status", &[&scene, "--size", "200x150", "--quality", "fast"]) else { return };
    let title = String::from_utf8(desktop.run("xdotool", &["getwindowname", &view.window])).unwrap();
    assert!(title.starts_with(&format!("tumble: {scene}")), "{title}");

    view.key("space");
    let stands = view.until("the pause", |s| s["paused"] == true);
    let later = stands["shown"].as_u64().unwrap();
    view.key("c");
    view.until("a camera", |s| s["camera"] == "front" && s["shown"].as_u64().unwrap() > later);
    view.key("shift+c");
    let stood = view.until("the camera before", |s| s["camera"] == "scene");
    assert_eq!((&stood["frame"], &stood["state_blake3"]), (&stands["frame"], &stands["state_blake3"]), "time went on while it stood");

    // a step is dt = 0.01 s, one by one
    for (key, n) in [("period", 1), ("n", 2)] {
        view.key(key);
        let frame = stands["frame"].as_u64().unwrap() + n;
        let stepped = view.until("a step", |s| s["frame"].as_u64() == Some(frame));
        assert!((stepped["time_s"].as_f64().unwrap() - stands["time_s"].as_f64().unwrap() - 0.01 * n as f64).abs() < 1e-9);
        assert_eq!(stepped["paused"], true);
    }
    view.key("r");
    let reset = view.until("time 0", |s| s["frame"] == 0);
    assert_eq!(reset["time_s"], 0.0);
    assert_eq!(reset["state_blake3"], state_of_run(&folder, &scene, "0").as_str(), "another state than the beginning");

    // 4 m from the target: 1 m/s, so 0.1 m a tap, along y, which is ahead
    assert_eq!(reset["step_m"].as_f64().unwrap(), 0.1);
    let mut eye = [0.0, -4.0, 1.0];
    for (key, by) in [("w", [0.0, 0.1, 0.0]), ("Down", [0.0, -0.1, 0.0]), ("d", [0.1, 0.0, 0.0]), ("a", [-0.1, 0.0, 0.0]), ("e", [0.0, 0.0, 0.1]), ("Next", [0.0, 0.0, -0.1])] {
        view.key(key);
        eye = std::array::from_fn(|k| eye[k] + by[k]);
        view.until(&format!("{key} to move the eye to {eye:?}"), |s| close(three(&s["eye_m"]), eye, 1e-5));
    }
    // a mouse that is dragged by 100 pixels turns by 0.5 rad to the right, and as much up
    view.mouse([50, 120]);
    view.button("mousedown", "3");
    view.mouse([150, 20]);
    view.button("mouseup", "3");
    let (sin, cos) = 0.5f64.sin_cos();
    view.until("the turn", |s| close(three(&s["forward"]), [cos * sin, cos * cos, sin], 1e-5));
    // on foot ahead is level, in flight it is where one looks
    view.key("w");
    eye = [eye[0] + 0.1 * sin, eye[1] + 0.1 * cos, eye[2]];
    view.until("a level step", |s| close(three(&s["eye_m"]), eye, 1e-5));
    view.key("f");
    view.key("w");
    eye = [eye[0] + 0.1 * cos * sin, eye[1] + 0.1 * cos * cos, eye[2] + 0.1 * sin];
    view.until("a flight upwards", |s| s["flies"] == true && close(three(&s["eye_m"]), eye, 1e-5));
    view.key("Home");
    view.until("the scene's camera", |s| close(three(&s["eye_m"]), [0.0, -4.0, 1.0], 1e-6) && close(three(&s["forward"]), [0.0, 1.0, 0.0], 1e-6));

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
fn a_window_shows_the_picture_that_run_takes() {
    let Some(desktop) = Desktop::open() else { return };
    let Some(mut view) = Session::open(&desktop, "view-picture", &["bowling", "--size", "160x90", "--quality", "usual", "--plain", "--paused"]) else { return };
    for n in 1..=12 {
        view.key("period");
        view.until("a step", |s| s["frame"] == n);
    }
    let picture = view.folder.path("run.png");
    succeed(&["run", "bowling", "--quiet", "--seconds", "0.05", "--size", "160x90", "--picture", &text(&picture)]);
    let image = tumble::render::Image::read_png(&picture).unwrap();
    view.comes_to_show(&image);
    let bright = image.rgba.chunks_exact(4).map(|p| u64::from(p[1])).collect::<Vec<_>>();
    assert!(bright.iter().max() > bright.iter().min().map(|m| m + 60).as_ref(), "the picture shows nothing");
}

#[test]
fn a_run_that_nobody_touches_is_the_run_of_the_command() {
    let Some(desktop) = Desktop::open() else { return };
    let folder = Folder::new("view-same");
    for scene in ["billiards", "robot"] {
        // it may end before anyone finds its window
        let args = [scene, "--size", "64x48", "--fps", "15", "--seconds", "0.5"];
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
    // the middle of the ball's front is 3.5 m away
    view.mouse([100, 100]);
    view.button("mousedown", "1");
    let held = view.until("the ball in the hand", |s| s["held"] == "ball");
    assert!(close(three(&held["hand_at_m"]), [0.0, -0.5, 1.0], 0.03), "{held}");
    // tan 26.565° = 1/2: the picture's half height is 1.75 m there, 100 pixels
    view.mouse([140, 60]);
    let hand = [0.4 * 1.75, -0.5, 1.0 + 0.4 * 1.75];
    view.until("the hand below the pointer", |s| close(three(&s["hand_at_m"]), hand, 0.03));
    let there = view.until("the ball at the hand", |s| close(three(&s["held_at_m"]), three(&s["hand_at_m"]), 0.005));
    assert_eq!(there["held"], "ball");
    view.button("mouseup", "1");
    view.until("the ball let go", |s| s["held"].is_null());
    // beside the ball there is nothing to hold: the view turns
    view.mouse([5, 195]);
    view.button("mousedown", "1");
    view.mouse([25, 195]);
    view.button("mouseup", "1");
    let turned = view.until("the turn", |s| close(three(&s["forward"]), [0.1f64.sin(), 0.1f64.cos(), 0.0], 1e-5));
    assert!(turned["held"].is_null());
}

#[test]
fn facets_and_unfolded_caves_show_what_run_takes() {
    let Some(desktop) = Desktop::open() else { return };
    let folder = Folder::new("view-cave");
    let cave = "
[[user]]
name = \"u\"
eye_m = [0, 0, 1.5]
interpupillary_m = 0.06
[[screen]]
name = \"s\"
lower_left_m = [-1, 2, 0.5]
lower_right_m = [1, 2, 0.5]
upper_left_m = [-1, 2, 2.0]
[[facet]]
name = \"f\"
screen = \"s\"
size_px = [120, 90]
stereo = \"STEREO\"
flip = \"FLIP\"
";
    let anaglyph = folder.write("a.toml", cave.replace("STEREO", "anaglyph").replace("FLIP", "horizontal"));
    let beside = folder.write("b.toml", cave.replace("STEREO", "side_by_side").replace("FLIP", "vertical"));
    let cases: [(&str, &[&str], usize); 3] = [(&anaglyph, &["--facet", "f"], 120 * 90), (&beside, &["--facet", "f"], 240 * 90), ("cube4", &["--size", "150x100"], 150 * 100)];
    for (cave, more, pixels) in cases {
        let args = [&["stack", "--cave", cave], more].concat();
        let Some(view) = Session::open(&desktop, "view-cave-status", &[&args[..], &["--quality", "usual", "--plain", "--paused"]].concat()) else { return };
        let picture = view.folder.path("run.png");
        succeed(&[&["run"], &args[..], &["--quiet", "--seconds", "0", "--picture", &text(&picture)]].concat());
        let image = tumble::render::Image::read_png(&picture).unwrap();
        assert_eq!(image.width as usize * image.height as usize, pixels, "{cave}");
        view.comes_to_show(&image);
    }
}

#[test]
fn windows_that_end_end_well() {
    let Some(desktop) = Desktop::open() else { return };
    let args = ["stack", "--size", "64x48"];
    let Some(mut view) = Session::open(&desktop, "view-close", &args) else { return };
    view.ask_to_close();
    assert_eq!(view.end(), (Some(0), String::new()), "closed");
    let mut view = Session::spawn(&desktop, Folder::new("view-frames"), &[&args[..], &["--frames", "3", "--paused"]].concat());
    assert_eq!(view.end(), (Some(0), String::new()));
    assert_eq!(view.status().unwrap()["shown"], 3);
    // without its X server a window ends too: X's own library sees to that, and says so
    let Some(mut view) = Session::open(&desktop, "view-lost", &args) else { return };
    assert!(Command::new("kill").arg(desktop.server.0.id().to_string()).status().unwrap().success());
    let (code, said) = view.end();
    assert!(code == Some(1) && said.contains("X "), "{code:?}: {said}");
}

#[test]
fn without_a_desktop_there_is_one_clear_message() {
    let mut command = command(&["view", "stack"]);
    let out = command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").output().unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!((out.status.code(), said.lines().count()), (Some(1), 1), "{said}");
    assert!(said.starts_with("Error: ") && ["DISPLAY", "WAYLAND_DISPLAY", "tumble run SCENE --picture"].iter().all(|word| said.contains(word)), "{said}");
}

#[test]
fn what_cannot_be_shown_ends_with_code_2_before_a_window_opens() {
    assert!(fail(&["view", "stack", "--camera", "below"], 2).contains("scene, front, left, back, right, top"));
    assert!(fail(&["view", "stack", "--cave", "cube4", "--facet", "fron"], 2).contains("did you mean `front`?"));
    assert!(fail(&["view", "stack", "--cave", "cube4", "--facet", "front", "--size", "80x60"], 2).contains("size_px"));
    assert!(fail(&["view", "stack", "--size", "16384x16384"], 2).contains("at most"));
    assert!(fail_often(&["view", "stack", "--size", "0x10"], 2).contains("1 to 16384"));
    assert!(fail_often(&["view", "stack", "--facet", "front"], 2).contains("--cave"));
}
