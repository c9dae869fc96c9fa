//! A cave on a desktop: an X server for the test (Xvfb), and a window per facet at the place in the
//! cave file.

use crate::cave_place::{Place, Process, ROOM, alive, cave_of, in_place, make_runtime, signal, wait};
use crate::common::{Folder, json, text};
use crate::desktop::{Desktop, Running, skip};
use rustix::process::Signal;
use std::process::Stdio;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{AtomEnum, ClientMessageEvent, ConnectionExt, EventMask, MapState};
use x11rb::rust_connection::RustConnection;

/// A ball that rotates forever.
const SCENE: &str = "description = \"A ball that turns\"
[world]
dt_s = 0.02
gravity_m_per_s2 = [0, 0, 0]
[[body]]
name = \"ball\"
shape = { type = \"sphere\", radius_m = 0.3 }
mass_kg = 1.0
position_m = [0, 1, 1]
angular_velocity_rad_per_s = [0, 0, 1]
[camera]
eye_m = [0, -2, 1.7]
target_m = [0, 0, 1.7]
[[light]]
type = \"directional\"
direction = [0.3, 0.5, -1]
casts_shadow = false
";

/// Four screens of a room, in windows beside each other.
fn cave() -> String {
    let place = |k: usize| format!("size_px = [100, 100]\nposition_px = [{}, 20]", 110 * k);
    cave_of(&ROOM, place, "ready_timeout_ms = 2000\ndrop_timeout_ms = 4000\nconnect_timeout_ms = 90000")
}

/// Returns title, id, position and size of every visible window with a title.
fn windows(server: &RustConnection, root: u32) -> Vec<(String, u32, [i16; 2], [u16; 2])> {
    let children = server.query_tree(root).unwrap().reply().unwrap().children;
    let one = |window: u32| {
        if server.get_window_attributes(window).ok()?.reply().ok()?.map_state != MapState::VIEWABLE {
            return None;
        }
        let title =
            server.get_property(false, window, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 1024).ok()?.reply().ok()?.value;
        let at = server.get_geometry(window).ok()?.reply().ok()?;
        (!title.is_empty())
            .then(|| (String::from_utf8_lossy(&title).into_owned(), window, [at.x, at.y], [at.width, at.height]))
    };
    children.into_iter().filter_map(one).collect()
}

#[test]
fn four_windows_open_where_the_cave_says_and_the_others_go_on_when_one_is_closed() {
    let Some(desktop) = Desktop::open() else { return };
    if tumble::render::Renderer::new().is_err() {
        return skip("this machine has no graphics adapter");
    }
    let folder = Folder::new("cave-windows");
    make_runtime(&folder);
    let (scene, cave, summary) =
        (folder.write("scene.toml", SCENE), folder.write("cave.toml", cave()), folder.path("summary.json"));
    let args = [
        "cave",
        &scene,
        "--cave",
        &cave,
        "--quality",
        "fastest",
        "--log-dir",
        &text(&folder.path("out")),
        "--summary",
        &text(&summary),
    ];
    let log = std::fs::File::create(folder.path("stderr")).unwrap();
    let mut run = Running(
        in_place(&folder, &args).env("DISPLAY", &desktop.display).stderr(log).stdout(Stdio::null()).spawn().unwrap(),
    );
    let (server, screen) = x11rb::connect(Some(&desktop.display)).unwrap();
    let root = server.setup().roots[screen].root;
    wait("the fourth window", || {
        if let Some(status) = run.0.try_wait().unwrap() {
            panic!("it ended with {status}: {}", std::fs::read_to_string(folder.path("stderr")).unwrap());
        }
        windows(&server, root).len() == 4
    });
    let mut there: Vec<_> =
        windows(&server, root).into_iter().map(|(title, _, at, size)| (at[0], at[1], size, title)).collect();
    there.sort();
    for ((x, y, size, title), (k, facet)) in there.iter().zip(["front", "left", "right", "floor"].iter().enumerate()) {
        assert_eq!((*x, *y, *size), (110 * k as i16, 20, [100, 100]), "{title}");
        assert!(title.starts_with("tumble: ") && title.ends_with(&format!(" on {facet}")), "{title}");
    }
    let frames = |facet: &str| -> Vec<u64> {
        let text = std::fs::read_to_string(folder.path("out").join(facet).join("frames.jsonl")).unwrap_or_default();
        let lines = text.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
        lines.map(|line| line["frame"].as_u64().unwrap()).collect()
    };
    wait("some frames", || ["front", "left", "right", "floor"].iter().all(|facet| frames(facet).len() > 3));
    // closing one window ends that facet; the others go on
    let close = |facet: &str| {
        let window =
            windows(&server, root).into_iter().find(|(title, ..)| title.ends_with(&format!(" on {facet}"))).unwrap().1;
        let atom = |name: &[u8]| server.intern_atom(false, name).unwrap().reply().unwrap().atom;
        let message =
            ClientMessageEvent::new(32, window, atom(b"WM_PROTOCOLS"), [atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0]);
        server.send_event(false, window, EventMask::NO_EVENT, message).unwrap().check().unwrap();
        server.flush().unwrap();
    };
    close("right");
    wait("the end of a window", || windows(&server, root).len() == 3);
    let (at, left) = (*frames("front").last().unwrap(), frames("right").len());
    wait("more frames", || frames("front").last().is_some_and(|frame| *frame > at + 5));
    assert_eq!(frames("right").len(), left, "the closed window goes on");
    // closing all windows ends the run, without a failure
    ["front", "left", "floor"].into_iter().for_each(close);
    wait("the end", || run.0.try_wait().unwrap().is_some());
    assert_eq!(run.0.wait().unwrap().code(), Some(0), "{}", std::fs::read_to_string(folder.path("stderr")).unwrap());
    let facets = json(&summary)["facets"].clone();
    for facet in facets.as_array().unwrap() {
        assert_eq!(
            (&facet["dropped"], &facet["torn"], &facet["mismatched"]),
            (&0.into(), &0.into(), &0.into()),
            "{facet}"
        );
    }
}

/// A window that stands by is hidden, and opens at the place of a killed one.
#[test]
fn a_hidden_window_takes_the_place_of_a_killed_one() {
    let Some(desktop) = Desktop::open() else { return };
    if tumble::render::Renderer::new().is_err() {
        return skip("this machine has no graphics adapter");
    }
    let place = Place::new("cave-hidden", &cave());
    let args = ["--quality", "fastest", "--log-dir", &place.path("out"), "--restart", "--stand-by"];
    let run = Process::start(place.command("cave", &args).env("DISPLAY", &desktop.display));
    let (server, screen) = x11rb::connect(Some(&desktop.display)).unwrap();
    let root = server.setup().roots[screen].root;
    let all = || server.query_tree(root).unwrap().reply().unwrap().children.len();
    wait("four windows", || windows(&server, root).len() == 4);
    let shown = all();
    let of = || -> Vec<i32> {
        run.facets().into_iter().filter(|(name, pid)| name == "left" && alive(*pid)).map(|(_, pid)| pid).collect()
    };
    // one after the other, so that of the left facet is there when the third one begins
    wait("hidden windows", || run.facets().len() > 6 && all() > shown);
    assert_eq!(windows(&server, root).len(), 4);
    let [first, standby] = of()[..] else { panic!() };
    let before = place.log("out", "left").len();
    signal(first, Signal::KILL);
    wait("the window of the second process", || {
        windows(&server, root).iter().any(|(title, _, at, _)| title.ends_with(" on left") && *at == [110, 20])
            && of().first() == Some(&standby)
            && place.log("out", "left").len() > before + 5
    });
    signal(run.pid(), Signal::TERM);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert_eq!(windows(&server, root).len(), 0);
}

/// A bare X server without other clients resets when a connection ends, which cuts the others.
#[test]
fn all_windows_open_on_a_server_that_resets() {
    let Some(desktop) = Desktop::that_resets() else { return };
    if tumble::render::Renderer::new().is_err() {
        return skip("this machine has no graphics adapter");
    }
    let folder = Folder::new("cave-reset");
    make_runtime(&folder);
    let cave = cave().replace("position_px", "output = \"window\"\nposition_px");
    let (scene, cave) = (folder.write("scene.toml", SCENE), folder.write("cave.toml", cave));
    for round in 0..3 {
        let (out, log) = (text(&folder.path(&format!("out{round}"))), folder.path(&format!("stderr{round}")));
        let args = ["cave", &scene, "--cave", &cave, "--quality", "fastest", "--log-dir", &out];
        let mut run = Running(
            in_place(&folder, &args)
                .env("DISPLAY", &desktop.display)
                .stderr(std::fs::File::create(&log).unwrap())
                .stdout(Stdio::null())
                .spawn()
                .unwrap(),
        );
        let frames = |facet: &str| std::fs::read_to_string(format!("{out}/{facet}/frames.jsonl")).unwrap_or_default();
        wait("frames on all facets", || {
            if let Some(status) = run.0.try_wait().unwrap() {
                panic!("it ended with {status}: {}", std::fs::read_to_string(&log).unwrap());
            }
            ["front", "left", "right", "floor"].iter().all(|facet| frames(facet).lines().count() > 3)
        });
        // not before: this connection would keep the server from resetting
        let (server, screen) = x11rb::connect(Some(&desktop.display)).unwrap();
        assert_eq!(windows(&server, server.setup().roots[screen].root).len(), 4);
        drop(server);
        let pid = rustix::process::Pid::from_raw(run.0.id() as i32).unwrap();
        rustix::process::kill_process(pid, rustix::process::Signal::INT).unwrap();
        wait("the end", || run.0.try_wait().unwrap().is_some());
        let wrong = std::fs::read_to_string(&log).unwrap();
        assert_eq!(run.0.wait().unwrap().code(), Some(0), "{wrong}");
        assert!(!wrong.contains("draws into memory"), "{wrong}");
    }
}

#[test]
fn a_desktop_that_is_lost_during_the_run_fails_it() {
    let Some(mut desktop) = Desktop::open() else { return };
    if tumble::render::Renderer::new().is_err() {
        return skip("this machine has no graphics adapter");
    }
    let folder = Folder::new("cave-lost-desktop");
    make_runtime(&folder);
    let cave = cave().replace("position_px", "output = \"window\"\nposition_px");
    let (scene, cave, out) =
        (folder.write("scene.toml", SCENE), folder.write("cave.toml", cave), text(&folder.path("out")));
    let log = folder.path("stderr");
    let args = ["cave", &scene, "--cave", &cave, "--quality", "fastest", "--log-dir", &out];
    let mut command = in_place(&folder, &args);
    command.env("DISPLAY", &desktop.display).stderr(std::fs::File::create(&log).unwrap()).stdout(Stdio::null());
    let mut run = Running(command.spawn().unwrap());
    let frames = |facet: &str| std::fs::read_to_string(format!("{out}/{facet}/frames.jsonl")).unwrap_or_default();
    wait("frames on all facets", || {
        ["front", "left", "right", "floor"].iter().all(|facet| frames(facet).lines().count() > 3)
    });
    desktop.server.0.kill().unwrap();
    wait("the end", || run.0.try_wait().unwrap().is_some());
    let wrong = std::fs::read_to_string(&log).unwrap();
    assert_eq!(run.0.wait().unwrap().code(), Some(1), "{wrong}");
    assert!(wrong.contains("no facet is left"), "{wrong}");
}

#[test]
fn a_facet_that_must_be_a_window_fails_without_one() {
    let folder = Folder::new("cave-must-be-window");
    make_runtime(&folder);
    let cave = cave().replace("position_px", "output = \"window\"\nposition_px");
    let (scene, cave) = (folder.write("scene.toml", SCENE), folder.write("cave.toml", cave));
    let args = ["cave", &scene, "--cave", &cave, "--duration", "0.04", "--no-realtime", "--quality", "fastest"];
    for (display, why) in [(Some(":4711"), "does not answer (DISPLAY=:4711"), (None, "there is no desktop")] {
        let mut command = in_place(&folder, &args);
        display.map(|display| command.env("DISPLAY", display));
        let out = command.output().unwrap();
        let wrong = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{wrong}");
        assert!(wrong.contains("no window: ") && wrong.contains(why), "{wrong}");
    }
    // in memory only on request
    let offscreen = [&args[..], &["--no-pictures"]].concat();
    assert!(in_place(&folder, &offscreen).output().unwrap().status.success());
}

#[test]
fn a_desktop_that_takes_connections_and_is_silent_is_not_waited_for() {
    let folder = Folder::new("cave-silent-desktop");
    make_runtime(&folder);
    let cave = cave().replace("position_px", "output = \"window\"\nposition_px");
    let (scene, cave) = (folder.write("scene.toml", SCENE), folder.write("cave.toml", cave));
    // a server that has stopped: connections wait in its queue
    let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = silent.local_addr().unwrap().port();
    let display = format!("127.0.0.1:{}", port.checked_sub(6000).expect("a port that a display can have"));
    let args = ["cave", &scene, "--cave", &cave, "--duration", "0.04", "--no-realtime", "--quality", "fastest"];
    let start = std::time::Instant::now();
    let out = in_place(&folder, &args).env("DISPLAY", &display).output().unwrap();
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{wrong}");
    assert!(
        wrong.contains(&format!("does not answer (DISPLAY={display}: it takes connections and is silent")),
        "{wrong}"
    );
    assert!(start.elapsed() < std::time::Duration::from_secs(60), "{:?}", start.elapsed());
}

#[test]
fn a_desktop_that_does_not_answer_is_said_and_drawn_for_in_memory() {
    if tumble::render::Renderer::new().is_err() {
        return skip("this machine has no graphics adapter");
    }
    let folder = Folder::new("cave-no-desktop");
    make_runtime(&folder);
    let (scene, cave) = (folder.write("scene.toml", SCENE), folder.write("cave.toml", cave()));
    let args = ["cave", &scene, "--cave", &cave, "--duration", "0.04", "--no-realtime", "--quality", "fastest"];
    // a display that does not exist here, and one that cannot exist
    for display in [":4711", ":59999"] {
        let out = in_place(&folder, &args).env("DISPLAY", display).output().unwrap();
        let wrong = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "{wrong}");
        assert_eq!(
            wrong
                .matches(&format!("draws into memory, because the desktop does not answer (DISPLAY={display}: "))
                .count(),
            4,
            "{wrong}"
        );
    }
}
