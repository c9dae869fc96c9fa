//! Several facets of one process in windows (Xvfb): the same pictures as with a process each, the operator's
//! console, patterns, recordings, keys, and the end.

use crate::cave_console::{ask, link, status};
use crate::cave_groups::{NAMES, assert_whole, lines, room};
use crate::cave_place::*;
use crate::common::json;
use crate::desktop::{Desktop, Running, skip};
use std::process::Stdio;
use tumble::render::Image;

/// Returns a desktop, if windows can be drawn there.
fn desktop() -> Option<Desktop> {
    if tumble::render::Renderer::new().is_err() {
        skip("this machine has no graphics adapter");
        return None;
    }
    Desktop::open()
}

/// Starts a command on the desktop; its messages are in the file `stderr`.
fn start(place: &Place, desktop: &Desktop, what: &str, args: &[&str]) -> Running {
    let log = std::fs::File::create(place.folder.path("stderr")).unwrap();
    let mut command = place.command(what, args);
    command.current_dir(place.folder.path(".")).env("DISPLAY", &desktop.display);
    Running(command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log).spawn().unwrap())
}

/// Waits for the end and returns exit code and messages.
fn end(place: &Place, run: &mut Running) -> (Option<i32>, String) {
    wait("the end of a process", || run.0.try_wait().unwrap().is_some());
    (run.0.wait().unwrap().code(), std::fs::read_to_string(place.folder.path("stderr")).unwrap())
}

/// Returns the X11 id of the window of a facet.
fn window(desktop: &Desktop, facet: &str) -> Option<String> {
    let name = format!("^tumble: .* on {facet}$");
    let out = std::process::Command::new("xdotool")
        .args(["search", "--name", &name])
        .env("DISPLAY", &desktop.display)
        .output()
        .unwrap();
    String::from_utf8(out.stdout).unwrap().lines().next().map(str::to_owned)
}

/// Waits until the window of a facet shows a picture to within a level.
fn comes_to_show(desktop: &Desktop, facet: &str, image: impl Fn() -> Image) {
    let id = window(desktop, facet).unwrap();
    wait(&format!("the picture of {facet}"), || {
        let (shown, image) = (desktop.run("import", &["-window", &id, "-depth", "8", "rgb:-"]), image());
        assert_eq!(shown.len(), image.rgba.len() / 4 * 3, "the window has another size");
        let same = |(a, b): (&[u8], &[u8])| (0..3).all(|k| a[k].abs_diff(b[k]) <= 1);
        shown.chunks_exact(3).zip(image.rgba.chunks_exact(4)).all(same)
    });
}

/// Returns the last whole picture of a facet.
fn last_picture(place: &Place, facet: &str) -> Image {
    let frame = *numbers(&place.log("out", facet)).last().unwrap();
    Image::read_png(place.folder.path("out").join(facet).join(format!("frame_{frame:06}.png"))).unwrap()
}

/// Name, processes of the four facets, and options of a run.
type Form = (&'static str, [Option<&'static str>; 4], &'static [&'static str]);

#[test]
fn windows_of_one_process_draw_the_bytes_of_single_ones() {
    let Some(desktop) = desktop() else { return };
    let some = [Some("walls"), None, Some("walls"), Some("walls")];
    let forms: [Form; 3] =
        [("window-single", [None; 4], &[]), ("window-some", some, &[]), ("window-all", [None; 4], &["--one-process"])];
    let places = forms.map(|(test, processes, more)| {
        let cave = room(processes).replace("position_px", "output = \"window\"\nposition_px");
        let place = Place::new(test, &cave);
        let (out, summary) = (place.path("out"), place.path("summary.json"));
        let args = ["--duration", "0.04", "--no-realtime", "--quality", "fastest", "--frames-dir", &out];
        let mut run = start(&place, &desktop, "cave", &[&args[..], &["--summary", &summary], more].concat());
        let (code, wrong) = end(&place, &mut run);
        assert!(code == Some(0) && !wrong.contains("into memory"), "{wrong}");
        assert_whole(&json(&place.folder.path("summary.json")), 5);
        place.assert_clean();
        place
    });
    let [single, grouped @ ..] = &places;
    for name in NAMES {
        let log = single.log("out", name);
        assert_eq!(numbers(&log), (0..5).collect::<Vec<_>>());
        for place in grouped {
            assert_eq!(lines(&place.log("out", name)), lines(&log), "{name}");
            for frame in 0..5 {
                let file = |place: &Place| place.folder.path("out").join(name).join(format!("frame_{frame:06}.png"));
                let picture = |place: &Place| Image::read_png(file(place)).unwrap();
                assert!(picture(place).rgba == picture(single).rgba, "{name}, frame {frame}");
            }
        }
    }
}

/// The console sees and directs all facets of the process: time, patterns, recordings. What a window shows is
/// its last picture.
#[test]
fn the_console_directs_windows_of_one_process_and_shows_a_recording_there() {
    let Some(desktop) = desktop() else { return };
    let place = Place::new("window-console", &room([None; 4]));
    let out = place.path("out");
    let common = ["--one-process", "--quality", "fastest", "--quiet"];
    let more = ["--console", "127.0.0.1:0", "--frames-dir", &out];
    let mut run = start(&place, &desktop, "cave", &[&common[..], &more].concat());
    let (at, token) = link(&place);
    let post = |what: &str| assert_eq!(ask(at, &token, "POST", &format!("/api/{what}")).0, 200, "{what}");
    NAMES.iter().for_each(|name| place.wait_for("out", name, 5));
    post("record/show.mcap");
    NAMES.iter().for_each(|name| place.wait_for("out", name, numbers(&place.log("out", name)).len() as u64 + 10));
    post("unrecord");
    post("pause");
    wait("the pause", || status(at, &token)["paused"] == true);
    let frame = status(at, &token)["frame"].as_u64().unwrap();
    NAMES.iter().for_each(|name| place.wait_for("out", name, frame + 3));
    for name in NAMES {
        comes_to_show(&desktop, name, || last_picture(&place, name));
        wait("a small picture", || ask(at, &token, "GET", &format!("/api/picture/{name}")).0 == 200);
    }
    let image = |name: &str| place.log("out", name).last().unwrap()["image"].clone();
    let scene = NAMES.map(image);
    assert!((1..4).all(|k| scene[k] != scene[0]), "{scene:?}");
    // each facet shows its own pattern, and the scene again
    post("pattern/grid");
    for (k, name) in NAMES.into_iter().enumerate() {
        wait("the pattern", || image(name) != scene[k]);
        comes_to_show(&desktop, name, || last_picture(&place, name));
    }
    post("pattern/off");
    for (k, name) in NAMES.into_iter().enumerate() {
        wait("the scene", || image(name) == scene[k]);
        comes_to_show(&desktop, name, || last_picture(&place, name));
    }
    let facets = status(at, &token)["facets"].clone();
    assert!(facets.as_array().unwrap().iter().all(|facet| facet["pictures"].as_u64() > Some(10)), "{facets}");
    post("stop");
    let (code, wrong) = end(&place, &mut run);
    assert_eq!(code, Some(0), "{wrong}");
    // the recording, in windows of one process
    let (record, summary) = (place.path("show.mcap"), place.path("summary.json"));
    let args = [&[&record[..], &place.scene, "--cave", &place.cave], &common[..]].concat();
    let args = [&args[..], &["--no-realtime", "--summary", &summary]].concat();
    let log = std::fs::File::create(place.folder.path("stderr")).unwrap();
    let mut command = in_place(&place.folder, &[&["replay"], &args[..]].concat());
    let mut run = Running(command.env("DISPLAY", &desktop.display).stderr(log).stdout(Stdio::null()).spawn().unwrap());
    let (code, wrong) = end(&place, &mut run);
    assert_eq!(code, Some(0), "{wrong}");
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    for facet in facets.as_array().unwrap() {
        assert!(facet["presented"].as_u64() >= Some(10) && facet["mismatched"] == 0, "{facet}");
    }
    place.assert_clean();
}

/// Keys of any window reach the server, and the end of one window ends the process.
#[test]
fn keys_of_a_window_move_the_cave_and_escape_ends_all() {
    let Some(desktop) = desktop() else { return };
    let place = Place::new("window-keys", &room([None; 4]));
    // nothing moves but the cave
    let still = SCENE
        .replace("velocity_m_per_s = [1.0, 0.5, 0.0]\n", "")
        .replace("angular_velocity_rad_per_s = [1.0, 2.0, 3.0]\n", "")
        .replace("dt_s = 0.01\n", "dt_s = 0.01\ngravity_m_per_s2 = [0, 0, 0]\n");
    place.folder.write("scene.toml", still);
    let out = place.path("out");
    let mut run = start(&place, &desktop, "cave", &["--one-process", "--quality", "fastest", "--log-dir", &out]);
    NAMES.iter().for_each(|name| place.wait_for("out", name, 10));
    let image = |back: usize| place.log("out", "front").iter().rev().nth(back).unwrap()["image"].clone();
    wait("a still picture", || image(0) == image(5));
    let still = image(0);
    let id = window(&desktop, "right").unwrap();
    desktop.run("xdotool", &["windowfocus", "--sync", &id]);
    desktop.run("xdotool", &["keydown", "w"]);
    wait("another view", || image(0) != still);
    desktop.run("xdotool", &["keyup", "w"]);
    wait("a still picture", || image(0) == image(5));
    assert_ne!(image(0), still, "the cave has moved");
    desktop.run("xdotool", &["key", "Escape"]);
    let (code, wrong) = end(&place, &mut run);
    assert_eq!(code, Some(0), "{wrong}");
    place.assert_clean();
}

#[test]
fn a_desktop_that_is_lost_ends_all_windows_of_a_process_with_a_failure() {
    let Some(mut desktop) = desktop() else { return };
    let place = Place::new("window-lost", &room([None; 4]));
    let out = place.path("out");
    let mut run = start(&place, &desktop, "cave", &["--one-process", "--quality", "fastest", "--log-dir", &out]);
    NAMES.iter().for_each(|name| place.wait_for("out", name, 5));
    desktop.server.0.kill().unwrap();
    let (code, wrong) = end(&place, &mut run);
    assert!(code == Some(1) && wrong.contains("no facet is left"), "{code:?} {wrong}");
}
