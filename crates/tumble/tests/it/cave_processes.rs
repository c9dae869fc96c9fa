//! `tumble cave`, `tumble serve` and `tumble facet` as processes: frames, kills, freezes, locks, and what is left behind.

use crate::common::*;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Nothing here waits longer.
const PATIENCE: Duration = Duration::from_secs(90);

/// Two things that fall, without shadows.
const SCENE: &str = "description = \"Things that fall\"
[world]
dt_s = 0.01
[[body]]
name = \"floor\"
mode = \"static\"
shape = { type = \"half_space\" }
[[body]]
name = \"ball\"
shape = { type = \"sphere\", radius_m = 0.3 }
mass_kg = 1.0
position_m = [0.3, 0.6, 2.0]
velocity_m_per_s = [1.0, 0.5, 0.0]
[[body]]
name = \"box\"
shape = { type = \"box\", size_m = [0.4, 0.4, 0.4] }
mass_kg = 1.0
position_m = [-0.5, 1.0, 1.5]
angular_velocity_rad_per_s = [1.0, 2.0, 3.0]
[camera]
eye_m = [0, -2, 1.7]
target_m = [0, 0, 1.7]
[[light]]
type = \"directional\"
direction = [0.3, 0.5, -1]
casts_shadow = false
";

/// A room of four screens like cube4, with small pictures. A frame waits for 2 s, so that a busy machine loses none.
fn cube() -> String {
    let screens = [
        ("front", "[-1.5, 1.5, 0]", "[1.5, 1.5, 0]", "[-1.5, 1.5, 3]"),
        ("left", "[-1.5, -1.5, 0]", "[-1.5, 1.5, 0]", "[-1.5, -1.5, 3]"),
        ("right", "[1.5, 1.5, 0]", "[1.5, -1.5, 0]", "[1.5, 1.5, 3]"),
        ("floor", "[-1.5, -1.5, 0]", "[1.5, -1.5, 0]", "[-1.5, 1.5, 0]"),
    ];
    let part = |(name, a, b, c): &(&str, &str, &str, &str)| {
        format!(
            "[[screen]]\nname = \"{name}\"\nlower_left_m = {a}\nlower_right_m = {b}\nupper_left_m = {c}\n[[facet]]\nname = \"{name}\"\nscreen = \"{name}\"\nsize_px = [80, 80]\n"
        )
    };
    let sync = "[sync]\nready_timeout_ms = 2000\ndrop_timeout_ms = 2000\nconnect_timeout_ms = 60000\n";
    format!("[[user]]\nname = \"u\"\neye_m = [0, 0, 1.7]\n{}{sync}", screens.iter().map(part).collect::<String>())
}

/// A wall of two screens. A frame waits for 200 ms, a facet is dropped after 500.
const WALL: &str = "
[[user]]
name = \"u\"
eye_m = [0, 0, 1.5]
[[screen]]
name = \"l\"
lower_left_m = [-2, 2, 0.5]
lower_right_m = [0, 2, 0.5]
upper_left_m = [-2, 2, 2.0]
[[screen]]
name = \"r\"
lower_left_m = [0, 2, 0.5]
lower_right_m = [2, 2, 0.5]
upper_left_m = [0, 2, 2.0]
[[facet]]
name = \"l\"
screen = \"l\"
size_px = [80, 60]
[[facet]]
name = \"r\"
screen = \"r\"
size_px = [80, 60]
[sync]
ready_timeout_ms = 200
drop_timeout_ms = 500
connect_timeout_ms = 60000
";

/// A folder with a scene and a cave, and a place of its own for locks and sockets.
struct Place {
    folder: Folder,
    scene: String,
    cave: String,
}

impl Place {
    fn new(test: &str, cave: &str) -> Place {
        let folder = Folder::new(test);
        let (scene, cave) = (folder.write("scene.toml", SCENE), folder.write("cave.toml", cave));
        use std::os::unix::fs::DirBuilderExt;
        std::fs::DirBuilder::new().mode(0o700).create(folder.path("run")).unwrap();
        Place { folder, scene, cave }
    }

    fn path(&self, file: &str) -> String {
        text(&self.folder.path(file))
    }

    /// `tumble WHAT SCENE --cave CAVE ARGS`.
    fn command(&self, what: &str, args: &[&str]) -> Command {
        let mut command = command(&[what, &self.scene, "--cave", &self.cave]);
        command.args(args).env("XDG_RUNTIME_DIR", self.folder.path("run")).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        command
    }

    fn start(&self, what: &str, args: &[&str]) -> Process {
        let mut child = self.command(what, args).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (said, wrong) = (reader(child.stdout.take().unwrap()), reader(child.stderr.take().unwrap()));
        Process { child, said: Some(said), wrong: Some(wrong) }
    }

    /// Runs to its end, with success; the summary.
    fn succeed(&self, what: &str, args: &[&str]) -> Value {
        let summary = self.path("summary.json");
        let (code, _, wrong) = self.start(what, &[args, &["--summary", &summary]].concat()).end();
        assert_eq!(code, Some(0), "{wrong}");
        json(&self.folder.path("summary.json"))
    }

    /// What facets wrote about the frames they have shown; an empty list before there is any.
    fn log(&self, folder: &str, facet: &str) -> Vec<Value> {
        let text = std::fs::read_to_string(self.folder.path(folder).join(facet).join("frames.jsonl")).unwrap_or_default();
        // the last line may be on its way
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    }

    /// Waits until a facet has shown a frame beyond `frame`.
    fn wait_for(&self, folder: &str, facet: &str, frame: u64) {
        wait(&format!("frame {frame} of {facet}"), || self.log(folder, facet).last().is_some_and(|line| line["frame"].as_u64() > Some(frame)));
    }

    /// Locks, sockets, services: nothing may be left of them.
    fn assert_clean(&self) {
        fn files(folder: PathBuf) -> Vec<PathBuf> {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            entries.flat_map(|e| if e.path().is_dir() { files(e.path()) } else { vec![e.path()] }).collect()
        }
        let left = files(self.folder.path("run"));
        assert!(left.is_empty(), "left behind: {left:?}");
    }
}

/// Keeps what a pipe says.
fn reader(mut pipe: impl Read + Send + 'static) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = pipe.read_to_end(&mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// A process that ends with the test.
struct Process {
    child: Child,
    said: Option<std::thread::JoinHandle<String>>,
    wrong: Option<std::thread::JoinHandle<String>>,
}

impl Process {
    fn pid(&self) -> i32 {
        self.child.id() as i32
    }

    /// Waits for its end: exit code, stdout, stderr.
    fn end(mut self) -> (Option<i32>, String, String) {
        let mut status = None;
        wait("the end of a process", || {
            status = self.child.try_wait().unwrap();
            status.is_some()
        });
        let text = |thread: Option<std::thread::JoinHandle<String>>| thread.unwrap().join().unwrap();
        (status.unwrap().code(), text(self.said.take()), text(self.wrong.take()))
    }

    /// Its facets, by name.
    fn facets(&self) -> Vec<(String, i32)> {
        let pid = self.pid();
        let children = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap();
        let named = |pid: &str| {
            let line = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
            let words: Vec<String> = line.split(|b| *b == 0).map(|w| String::from_utf8_lossy(w).into_owned()).collect();
            let at = words.iter().position(|w| w == "--facet")?;
            Some((words.get(at + 1)?.clone(), pid.parse().ok()?))
        };
        children.split_whitespace().filter_map(named).collect()
    }

    fn facet(&self, name: &str) -> i32 {
        self.facets().into_iter().find(|(facet, _)| facet == name).unwrap().1
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn signal(pid: i32, signal: Signal) {
    kill_process(Pid::from_raw(pid).unwrap(), signal).unwrap();
}

fn alive(pid: i32) -> bool {
    // a process that ended and was not asked for yet is none any more
    std::fs::read_to_string(format!("/proc/{pid}/stat")).is_ok_and(|stat| !stat.rsplit(')').next().unwrap_or("").trim_start().starts_with('Z'))
}

fn wait(what: &str, mut until: impl FnMut() -> bool) {
    let start = Instant::now();
    while !until() {
        assert!(start.elapsed() < PATIENCE, "{what} did not come within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn numbers(log: &[Value]) -> Vec<u64> {
    log.iter().map(|line| line["frame"].as_u64().unwrap()).collect()
}

fn states(log: &[Value]) -> Vec<&str> {
    log.iter().map(|line| line["state"].as_str().unwrap()).collect()
}

/// The number in a stamped picture: 64 squares in two rows of 32, the highest bit first.
fn stamped(image: &tumble::render::Image) -> u64 {
    let side = (image.width / 64).max(2);
    (0..64).fold(0, |number, k| {
        let [r, g, b, _] = image.pixel(k % 32 * side + side / 2, k / 32 * side + side / 2).unwrap();
        assert!([r, g, b] == [255; 3] || [r, g, b] == [0; 3], "bit {k} is {r} {g} {b}");
        number << 1 | u64::from(r == 255)
    })
}

/// Five processes, lockstep: each facet shows each frame once and in order, of the same states, and the pictures are those of the frames they name.
fn all_facets_show_the_same_frames(test: &str, frames: u64) {
    let place = Place::new(test, &cube());
    let seconds = (frames as f64 * 0.01).to_string();
    let (code, _, wrong) =
        place.start("cave", &["--seconds", &seconds, "--fast", "--stamp", "--frames-dir", &place.path("out"), "--summary", &place.path("summary.json")]).end();
    if wrong.contains("no graphics adapter") || wrong.contains("no Vulkan driver") {
        let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("\nSKIPPED: this machine has no graphics adapter; {wrong}\n"));
        return;
    }
    assert_eq!(code, Some(0), "{wrong}");
    let front = place.log("out", "front");
    for facet in ["front", "left", "right", "floor"] {
        let log = place.log("out", facet);
        assert_eq!(numbers(&log), (0..=frames).collect::<Vec<_>>(), "{facet}");
        assert_eq!(states(&log), states(&front), "{facet}");
        for line in &log {
            let frame = line["frame"].as_u64().unwrap();
            let image = tumble::render::Image::read_png(place.folder.path("out").join(facet).join(format!("frame_{frame:06}.png"))).unwrap();
            assert_eq!(stamped(&image), frame, "{facet}");
            assert_eq!(&blake3::hash(&image.rgba).to_hex()[..32], line["image"].as_str().unwrap(), "{facet} {frame}");
        }
    }
    // a world that moves has another state in each frame
    let mut different = states(&front);
    different.dedup();
    assert_eq!(different.len() as u64, frames + 1);
    let summary = json(&place.folder.path("summary.json"));
    for facet in summary["facets"].as_array().unwrap() {
        for zero in ["late", "missing", "torn", "mismatched", "dropped", "refused"] {
            assert_eq!(facet[zero], 0, "{zero} of {facet}");
        }
        assert_eq!(facet["presented"], frames + 1);
    }
    // the same picture as without any of this, below the stamp
    let alone = place.path("alone.png");
    succeed(&["run", &place.scene, "--cave", &place.cave, "--facet", "left", "--seconds", &seconds, "--picture", &alone, "--quiet"]);
    let alone = tumble::render::Image::read_png(&alone).unwrap();
    let ours = tumble::render::Image::read_png(place.folder.path("out").join("left").join(format!("frame_{frames:06}.png"))).unwrap();
    let below = 4 * 80 * 24;
    let worst = alone.rgba[below..].iter().zip(&ours.rgba[below..]).map(|(a, b)| a.abs_diff(*b)).max();
    // poses travel in steps of 1/65536 m
    let differing = alone.rgba[below..].iter().zip(&ours.rgba[below..]).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(differing < 60, "{differing} of {} values differ, at most by {worst:?}", ours.rgba.len() - below);
    place.assert_clean();
}

#[test]
fn thirty_frames_are_the_same_on_four_facets() {
    all_facets_show_the_same_frames("cave-frames", 30);
}

#[test]
fn full_length_600_frames_are_the_same_on_four_facets() {
    if std::env::var_os("TUMBLE_SLOW").is_some() {
        all_facets_show_the_same_frames("cave-600", 600);
    }
}

#[test]
fn datagrams_carry_the_same_states_as_shared_memory() {
    let place = Place::new("cave-udp", &cube());
    for (transport, folder) in [("udp", "a"), ("shared_memory", "b")] {
        let summary = place.succeed("cave", &["--seconds", "0.4", "--fast", "--no-pictures", "--log-dir", &place.path(folder), "--transport", transport]);
        assert_eq!(summary["frames"], 41);
        assert_eq!(summary["transport"].as_str().unwrap().replace(' ', "_"), transport);
        place.assert_clean();
    }
    for facet in ["front", "left", "right", "floor"] {
        let (a, b) = (place.log("a", facet), place.log("b", facet));
        assert_eq!(numbers(&a), (0..=40).collect::<Vec<_>>());
        assert_eq!((numbers(&a), states(&a)), (numbers(&b), states(&b)), "{facet}");
    }
}

#[test]
fn ctrl_c_ends_all_and_leaves_nothing() {
    let place = Place::new("cave-ctrl-c", WALL);
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out")]);
    place.wait_for("out", "r", 5);
    let facets = run.facets();
    assert_eq!(facets.len(), 2);
    signal(run.pid(), Signal::INT);
    let (code, said, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(said.contains("facet l: ") && said.contains("facet r: "), "{said}");
    assert!(!wrong.contains("rror"), "{wrong}");
    facets.iter().for_each(|(name, pid)| assert!(!alive(*pid), "facet {name} lives on"));
    place.assert_clean();
}

#[test]
fn a_run_that_goes_on_is_refused_by_name_or_replaced() {
    let place = Place::new("cave-lock", WALL);
    let first = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out")]);
    place.wait_for("out", "r", 5);
    let (code, _, wrong) = place.start("cave", &["--no-pictures", "--seconds", "0.1"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    for word in [format!("process {}", first.pid()), place.scene.clone(), "since 20".into(), "--replace".into()] {
        assert!(wrong.contains(&word), "'{word}' is not said: {wrong}");
    }
    // another cave is another matter
    let elsewhere = place.folder.write("elsewhere.toml", WALL);
    let mut other = command(&["cave", &place.scene, "--cave", &elsewhere, "--no-pictures", "--seconds", "0.1", "--quiet"]);
    assert!(other.env("XDG_RUNTIME_DIR", place.folder.path("run")).status().unwrap().success());
    let facets = first.facets();
    let summary = place.succeed("cave", &["--no-pictures", "--seconds", "0.1", "--replace"]);
    assert_eq!(summary["frames"], 11);
    let (code, _, wrong) = first.end();
    assert_eq!(code, Some(0), "{wrong}");
    facets.iter().for_each(|(name, pid)| assert!(!alive(*pid), "facet {name} lives on"));
    place.assert_clean();
}

#[test]
fn the_wall_goes_on_without_a_killed_facet_which_comes_back() {
    let place = Place::new("cave-kill", WALL);
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out"), "--restart", "--summary", &place.path("summary.json")]);
    place.wait_for("out", "r", 5);
    signal(run.facet("r"), Signal::KILL);
    let killed_at = *numbers(&place.log("out", "l")).last().unwrap();
    place.wait_for("out", "l", killed_at + 100);
    place.wait_for("out", "r", killed_at + 100);
    signal(run.pid(), Signal::TERM);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(wrong.contains("facet r ended (killed by signal 9)"), "{wrong}");
    let left = numbers(&place.log("out", "l"));
    // who was not killed missed nothing
    assert_eq!(left, (0..left.len() as u64).collect::<Vec<_>>());
    let right = place.log("out", "r");
    let left = place.log("out", "l");
    right.iter().for_each(|line| assert_eq!(line["state"], left[line["frame"].as_u64().unwrap() as usize]["state"]));
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!((&facets[0]["joined"], &facets[1]["joined"], &facets[1]["mismatched"]), (&1.into(), &2.into(), &0.into()));
    place.assert_clean();
}

#[test]
fn a_frozen_facet_is_dropped_and_comes_back_when_it_goes_on() {
    let place = Place::new("cave-freeze", WALL);
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out"), "--summary", &place.path("summary.json")]);
    place.wait_for("out", "r", 5);
    let frozen = run.facet("r");
    signal(frozen, Signal::STOP);
    let at = *numbers(&place.log("out", "l")).last().unwrap();
    place.wait_for("out", "l", at + 150);
    signal(frozen, Signal::CONT);
    place.wait_for("out", "r", at + 150);
    signal(run.pid(), Signal::INT);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(wrong.contains("facet r is late") && wrong.contains("facet r is dropped; the others go on"), "{wrong}");
    let left = numbers(&place.log("out", "l"));
    assert_eq!(left, (0..left.len() as u64).collect::<Vec<_>>());
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!((&facets[0]["dropped"], &facets[1]["dropped"], &facets[1]["joined"]), (&0.into(), &1.into(), &2.into()), "{wrong}");
    place.assert_clean();
}

#[test]
fn without_a_launcher_its_facets_end_and_others_wait_for_a_server_in_vain() {
    let place = Place::new("cave-orphans", WALL);
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out")]);
    place.wait_for("out", "r", 5);
    let facets = run.facets();
    signal(run.pid(), Signal::KILL);
    wait("the end of all facets", || facets.iter().all(|(_, pid)| !alive(*pid)));
    drop(run);
    // by hand
    let server = place.start("serve", &["--quiet"]);
    let l = place.start("facet", &["--facet", "l", "--no-pictures", "--log-dir", &place.path("hand"), "--wait", "10"]);
    let r = place.start("facet", &["--facet", "r", "--no-pictures", "--log-dir", &place.path("hand"), "--wait", "60"]);
    place.wait_for("hand", "r", 5);
    place.wait_for("hand", "l", 5);
    signal(server.pid(), Signal::KILL);
    let (code, _, wrong) = l.end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("facet l: has lost its server") && wrong.contains("did not come back, 10 s long"), "{wrong}");
    // Ctrl-C while it waits is no failure
    signal(r.pid(), Signal::INT);
    let (code, _, wrong) = r.end();
    assert_eq!(code, Some(0), "{wrong}");
    // what kill -9 left is taken away by the next run
    place.succeed("cave", &["--no-pictures", "--seconds", "0.1", "--quiet"]);
    place.assert_clean();
}

#[test]
fn a_facet_of_another_scene_is_refused_with_both_hashes() {
    let place = Place::new("cave-refused", WALL);
    let server = place.start("serve", &["--wait", "60"]);
    let other = place.folder.write("other.toml", SCENE.replace("radius_m = 0.3", "radius_m = 0.31"));
    let mut facet = command(&["facet", &other, "--cave", &place.cave, "--facet", "l", "--no-pictures", "--wait", "60"]);
    let out = facet.env("XDG_RUNTIME_DIR", place.folder.path("run")).output().unwrap();
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{wrong}");
    let hashes = wrong.split(|c: char| !c.is_ascii_hexdigit()).filter(|word| word.len() >= 16).count();
    assert!(wrong.contains("refuses it") && hashes == 2, "{wrong}");
    signal(server.pid(), Signal::TERM);
    let (_, _, wrong) = server.end();
    assert!(wrong.contains("facet l is not let in"), "{wrong}");
}

#[test]
fn who_is_missing_at_the_start_is_named() {
    let place = Place::new("cave-missing", WALL);
    let (code, _, wrong) = place.start("serve", &["--wait", "0.3"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("tumble facet") && wrong.contains("l, r did not join within 0.3 s"), "{wrong}");
    let (code, _, wrong) = place.start("facet", &["--facet", "l", "--no-pictures", "--wait", "0.3"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("no run goes on"), "{wrong}");
    // a facet that cannot start ends the start, not the patience
    let (code, _, wrong) = place.start("cave", &["--frames-dir", "/proc/nowhere", "--no-pictures"]).end();
    assert_eq!(code, Some(2), "{wrong}");
    let (code, _, wrong) = place.start("cave", &["--log-dir", "/proc/nowhere", "--no-pictures"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("/proc/nowhere") && wrong.contains("ended before the start"), "{wrong}");
    place.assert_clean();
}

#[test]
fn an_environment_brings_lights_camera_and_what_stands_still() {
    let place = Place::new("cave-environment", WALL);
    let hall = "[[body]]\nname = \"column\"\nmode = \"static\"\nshape = { type = \"box\", size_m = [1, 1, 3] }\nposition_m = [0.3, 0.6, 1.5]\n[[body]]\nname = \"loose\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 1.0\n[camera]\neye_m = [0, -3, 2]\ntarget_m = [0, 0, 1]\n";
    let environment = place.folder.write("hall.toml", hall);
    let args = ["--no-pictures", "--seconds", "0.2", "--fast", "--environment", &environment, "--log-dir"];
    let (code, _, wrong) = place.start("cave", &[&args[..], &[&place.path("with")]].concat()).end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(wrong.contains("1 bodies that do not move; camera and lights of") && wrong.contains("are ignored"), "{wrong}");
    assert!(wrong.contains("1 objects that move are left out"), "{wrong}");
    assert_eq!(place.log("with", "l").len(), 21);
    // one body that stands in the way of the other: names meet
    let clash = place.folder.write("clash.toml", hall.replace("column", "ball"));
    let (code, _, wrong) = place.start("cave", &["--environment", &clash]).end();
    assert_eq!(code, Some(2), "{wrong}");
    assert!(wrong.contains("\"ball\"") && wrong.contains("rename one"), "{wrong}");
}
