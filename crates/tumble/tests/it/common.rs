//! Runs the command, and gives each test a temporary folder.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::LazyLock;

/// The shipped scenes.
pub const SCENES: [&str; 26] = [
    "arch",
    "ball_machine",
    "billiards",
    "bird",
    "bowling",
    "campfire",
    "card_house",
    "chain",
    "cloth",
    "dominoes",
    "falling",
    "flock",
    "incline",
    "jelly",
    "marble_run",
    "mechanism",
    "newtons_cradle",
    "pendulum",
    "piston",
    "robot",
    "skeleton",
    "sparks",
    "stack",
    "steam_engine",
    "walker",
    "wrecking_ball",
];
pub const STEPPERS: [&str; 2] = ["time_stepping", "backtracking"];

/// A folder that is removed at the end.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new(test: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("tumble-{test}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    pub fn path(&self, file: &str) -> PathBuf {
        self.0.join(file)
    }

    /// Writes a file and returns its path as text.
    pub fn write(&self, file: &str, bytes: impl AsRef<[u8]>) -> String {
        std::fs::write(self.path(file), bytes).unwrap();
        text(&self.path(file))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub fn text(path: &Path) -> String {
    path.to_str().unwrap().to_string()
}

/// Returns the command of a program that is killed when the test that starts it ends in any way, also
/// when the process of the test is killed.
pub fn tied(program: &str) -> Command {
    // by its whole path, because some tests change PATH
    static SETPRIV: LazyLock<Option<PathBuf>> = LazyLock::new(|| {
        let folders = std::env::var_os("PATH").unwrap_or_default();
        let setpriv =
            std::env::split_paths(&folders).map(|folder| folder.join("setpriv")).find(|path| path.is_file())?;
        let asked = Command::new(&setpriv).args(["--pdeathsig", "KILL", "true"]).stderr(Stdio::null()).status();
        asked.is_ok_and(|status| status.success()).then_some(setpriv)
    });
    let Some(setpriv) = &*SETPRIV else { return Command::new(program) };
    let mut command = Command::new(setpriv);
    command.args(["--pdeathsig", "KILL", "--", program]);
    command
}

/// The command, outside the repository: shipped scenes are inside it.
pub fn command(args: &[&str]) -> Command {
    let mut command = tied(env!("CARGO_BIN_EXE_tumble"));
    command.args(args).current_dir(std::env::temp_dir());
    command
}

pub fn tumble(args: &[&str]) -> Output {
    command(args).output().unwrap()
}

/// Runs the command, expects success, and returns its stdout.
pub fn succeed(args: &[&str]) -> String {
    let out = tumble(args);
    let (said, wrong) = (String::from_utf8(out.stdout).unwrap(), String::from_utf8(out.stderr).unwrap());
    assert!(out.status.success(), "tumble {args:?} ended with {}: {wrong}", out.status);
    said
}

/// Runs the command, expects a failure with one message that does not look like a panic, and
/// returns the message.
pub fn fail(args: &[&str], code: i32) -> String {
    let wrong = fail_often(args, code);
    let messages = wrong.lines().filter(|line| line.starts_with("error: ")).count();
    assert_eq!(messages, 1, "tumble {args:?} gives {messages} messages:\n{wrong}");
    assert!(wrong.lines().count() <= 12, "tumble {args:?} is long-winded:\n{wrong}");
    wrong
}

/// As [`fail`], with at least one message.
pub fn fail_often(args: &[&str], code: i32) -> String {
    let out = tumble(args);
    let wrong = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(code), "tumble {args:?} says: {wrong}");
    assert!(wrong.contains("error: ") && !wrong.contains("panicked"), "tumble {args:?} says: {wrong}");
    wrong
}

pub fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// A scene of one falling body, with extra lines at the two places.
pub fn scene(body: &str, rest: &str) -> String {
    format!(
        "description = \"A test\"\n[world]\nduration_s = 0.1\n[[body]]\nname = \"ball\"\nshape = {{ type = \"sphere\", radius_m = 0.1 }}\nmass_kg = 1.0\n{body}\n{rest}\n"
    )
}

/// A cave of one screen, 2 m x 1.5 m and 2 m ahead, with these keys for its facet `f`.
pub fn cave(facet: &str) -> String {
    format!(
        "[[user]]\nname = \"u\"\neye_m = [0, 0, 1.5]\n[[screen]]\nname = \"s\"\nlower_left_m = [-1, 2, 0.5]\nlower_right_m = [1, 2, 0.5]\nupper_left_m = [-1, 2, 2.0]\n\
         [[facet]]\nname = \"f\"\nscreen = \"s\"\n{facet}\n"
    )
}
