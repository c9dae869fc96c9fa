//! Support for tests of caves: their files, a folder with its own locks and sockets, and processes
//! that end with the test.

use crate::common::*;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::io::Read;
use std::os::unix::fs::DirBuilderExt;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Maximum time that a test waits for anything.
pub const PATIENCE: Duration = Duration::from_secs(90);

/// Two bodies that fall, without shadows.
pub const SCENE: &str = "description = \"Things that fall\"
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

/// The screens of a room like cube4: name, and corners lower left, lower right, upper left.
pub const ROOM: [(&str, [&str; 3]); 4] = [
    ("front", ["[-1.5, 1.5, 0]", "[1.5, 1.5, 0]", "[-1.5, 1.5, 3]"]),
    ("left", ["[-1.5, -1.5, 0]", "[-1.5, 1.5, 0]", "[-1.5, -1.5, 3]"]),
    ("right", ["[1.5, 1.5, 0]", "[1.5, -1.5, 0]", "[1.5, 1.5, 3]"]),
    ("floor", ["[-1.5, -1.5, 0]", "[1.5, -1.5, 0]", "[-1.5, 1.5, 0]"]),
];

/// Returns a cave with one user, these screens with a facet each of the same name, and the keys
/// `sync` of the table `[sync]`. `facet` gives further keys of a facet by its index.
pub fn cave_of(screens: &[(&str, [&str; 3])], facet: impl Fn(usize) -> String, sync: &str) -> String {
    let part = |(k, (name, [a, b, c])): (usize, &(&str, [&str; 3]))| {
        let facet = facet(k);
        format!(
            "[[screen]]\nname = \"{name}\"\nlower_left_m = {a}\nlower_right_m = {b}\nupper_left_m = {c}\n[[facet]]\nname = \"{name}\"\nscreen = \"{name}\"\n{facet}\n"
        )
    };
    let parts: String = screens.iter().enumerate().map(part).collect();
    format!("[[user]]\nname = \"u\"\neye_m = [0, 0, 1.5]\n{parts}[sync]\n{sync}\n")
}

/// Returns the room, with small pictures. A frame waits for 2 s, so that a busy machine loses none.
pub fn cube() -> String {
    cave_of(
        &ROOM,
        |_| "size_px = [80, 80]".into(),
        "ready_timeout_ms = 2000\ndrop_timeout_ms = 2000\nconnect_timeout_ms = 60000",
    )
}

/// Returns a wall of two screens. A frame waits for 200 ms; a facet is dropped after 500 ms.
pub fn wall() -> String {
    let screens =
        [("l", ["[-2, 2, 0.5]", "[0, 2, 0.5]", "[-2, 2, 2.0]"]), ("r", ["[0, 2, 0.5]", "[2, 2, 0.5]", "[0, 2, 2.0]"])];
    cave_of(
        &screens,
        |_| "size_px = [80, 60]".into(),
        "ready_timeout_ms = 200\ndrop_timeout_ms = 500\nconnect_timeout_ms = 60000",
    )
}

/// Makes the folder for locks and sockets.
pub fn make_runtime(folder: &Folder) {
    std::fs::DirBuilder::new().mode(0o700).create(folder.path("run")).unwrap();
}

/// Returns the command with its locks and sockets in the folder, and without a display.
pub fn in_place(folder: &Folder, args: &[&str]) -> Command {
    let mut command = command(args);
    command.env("XDG_RUNTIME_DIR", folder.path("run")).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command
}

/// Returns the lock file of the run whose runtime folder is in this one.
pub fn lock_file(folder: &Folder) -> Option<PathBuf> {
    let folders = std::fs::read_dir(folder.path("run")).ok()?.flatten();
    let files = folders.filter_map(|folder| std::fs::read_dir(folder.path()).ok()).flat_map(|files| files.flatten());
    files.map(|file| file.path()).find(|path| {
        path.extension().is_some_and(|e| e == "lock")
            && path.file_name().unwrap().to_str().unwrap().starts_with("cave-")
    })
}

/// Returns the content of the lock file; null while there is none.
pub fn run_info(folder: &Folder) -> Value {
    let text = lock_file(folder).and_then(|file| std::fs::read(file).ok()).unwrap_or_default();
    serde_json::from_slice(&text).unwrap_or_default()
}

/// Returns the key of a run over UDP; waits for it.
pub fn run_key(folder: &Folder) -> [u8; 32] {
    wait("the key of the run", || run_info(folder)["key"].is_array());
    serde_json::from_value(run_info(folder)["key"].clone()).unwrap()
}

/// A folder with a scene and a cave, and with its own locks and sockets.
pub struct Place {
    pub folder: Folder,
    pub scene: String,
    pub cave: String,
}

impl Place {
    pub fn new(test: &str, cave: &str) -> Place {
        let folder = Folder::new(test);
        let (scene, cave) = (folder.write("scene.toml", SCENE), folder.write("cave.toml", cave));
        make_runtime(&folder);
        Place { folder, scene, cave }
    }

    pub fn path(&self, file: &str) -> String {
        text(&self.folder.path(file))
    }

    /// Returns the command `tumble WHAT SCENE --cave CAVE ARGS`.
    pub fn command(&self, what: &str, args: &[&str]) -> Command {
        in_place(&self.folder, &[&[what, &self.scene, "--cave", &self.cave], args].concat())
    }

    pub fn start(&self, what: &str, args: &[&str]) -> Process {
        Process::start(&mut self.command(what, args))
    }

    /// Runs the command to its end, which must be a success; returns the summary.
    pub fn succeed(&self, what: &str, args: &[&str]) -> Value {
        let summary = self.path("summary.json");
        let (code, _, wrong) = self.start(what, &[args, &["--summary", &summary]].concat()).end();
        assert_eq!(code, Some(0), "{wrong}");
        json(&self.folder.path("summary.json"))
    }

    /// Returns the records of a facet about its shown frames; empty before the first.
    pub fn log(&self, folder: &str, facet: &str) -> Vec<Value> {
        let text =
            std::fs::read_to_string(self.folder.path(folder).join(facet).join("frames.jsonl")).unwrap_or_default();
        // the last line may be incomplete
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    }

    /// Waits until a facet has shown a frame after `frame`.
    pub fn wait_for(&self, folder: &str, facet: &str, frame: u64) {
        wait(&format!("frame {frame} of {facet}"), || {
            self.log(folder, facet).last().is_some_and(|line| line["frame"].as_u64() > Some(frame))
        });
    }

    /// Asserts that no locks, sockets and services are left.
    pub fn assert_clean(&self) {
        fn files(folder: PathBuf) -> Vec<PathBuf> {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            entries.flat_map(|e| if e.path().is_dir() { files(e.path()) } else { vec![e.path()] }).collect()
        }
        let left = files(self.folder.path("run"));
        assert!(left.is_empty(), "left behind: {left:?}");
    }
}

/// Collects the output of a pipe.
fn reader(mut pipe: impl Read + Send + 'static) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = pipe.read_to_end(&mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// A process that is killed at the end of the test.
pub struct Process {
    child: Child,
    said: Option<std::thread::JoinHandle<String>>,
    wrong: Option<std::thread::JoinHandle<String>>,
}

impl Process {
    pub fn start(command: &mut Command) -> Process {
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (said, wrong) = (reader(child.stdout.take().unwrap()), reader(child.stderr.take().unwrap()));
        Process { child, said: Some(said), wrong: Some(wrong) }
    }

    pub fn pid(&self) -> i32 {
        self.child.id() as i32
    }

    /// Waits for the end; returns exit code, stdout and stderr.
    pub fn end(mut self) -> (Option<i32>, String, String) {
        let mut status = None;
        wait("the end of a process", || {
            status = self.child.try_wait().unwrap();
            status.is_some()
        });
        let text = |thread: Option<std::thread::JoinHandle<String>>| thread.unwrap().join().unwrap();
        (status.unwrap().code(), text(self.said.take()), text(self.wrong.take()))
    }

    /// Returns the names and process ids of its facets.
    pub fn facets(&self) -> Vec<(String, i32)> {
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

    pub fn facet(&self, name: &str) -> i32 {
        self.facets().into_iter().find(|(facet, _)| facet == name).unwrap().1
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub fn signal(pid: i32, signal: Signal) {
    kill_process(Pid::from_raw(pid).unwrap(), signal).unwrap();
}

pub fn alive(pid: i32) -> bool {
    // a zombie, which has ended and was not waited for yet, does not count
    std::fs::read_to_string(format!("/proc/{pid}/stat"))
        .is_ok_and(|stat| !stat.rsplit(')').next().unwrap_or("").trim_start().starts_with('Z'))
}

pub fn wait(what: &str, mut until: impl FnMut() -> bool) {
    let start = Instant::now();
    while !until() {
        assert!(start.elapsed() < PATIENCE, "{what} did not come within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

pub fn numbers(log: &[Value]) -> Vec<u64> {
    log.iter().map(|line| line["frame"].as_u64().unwrap()).collect()
}

pub fn states(log: &[Value]) -> Vec<&str> {
    log.iter().map(|line| line["state"].as_str().unwrap()).collect()
}
