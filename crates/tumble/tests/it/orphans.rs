//! A test whose process is killed from outside leaves no process behind: no cave, no desktop, no browser.

use crate::cave_place::*;
use crate::chromium::Chromium;
use crate::common::tied;
use crate::desktop::{Desktop, Running, is_installed, skip};
use rustix::process::Signal;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

const READY: &str = "everything runs";

/// The process that the other test kills.
#[test]
#[ignore = "runs until it is killed, by a_killed_test_leaves_no_process"]
fn runs_until_it_is_killed() {
    let place = Place::new("orphans", &wall());
    let _run = place.start("cave", &["--offscreen", "--no-pictures", "--log-dir", &place.path("out")]);
    let _desktop = Desktop::open();
    let _page = Chromium::start("orphans", [100, 100], &[]);
    place.wait_for("out", "r", 2);
    println!("{READY}");
    std::thread::sleep(PATIENCE * 2);
}

#[test]
fn a_killed_test_leaves_no_process() {
    if !is_installed("setpriv") {
        return skip("killed tests: there is no setpriv (util-linux), which ends what they have started");
    }
    let mut command = tied(std::env::current_exe().unwrap().to_str().unwrap());
    command.args(["--exact", "orphans::runs_until_it_is_killed", "--ignored", "--nocapture"]);
    let mut test = Running(command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap());
    let pid = test.0.id() as i32;
    let mut lines = BufReader::new(test.0.stdout.take().unwrap()).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains(READY)), "the test has ended");
    let started = descendants(pid);
    // the launcher, two facets, and the desktop and the browser where they are installed
    assert!(started.len() >= 3, "{started:?}");
    signal(pid, Signal::KILL);
    wait("the end of all processes", || !started.iter().any(|&pid| alive(pid)));
    for name in ["orphans", "chromium-orphans"] {
        let _ = std::fs::remove_dir_all(std::env::temp_dir().join(format!("tumble-{name}-{pid}")));
    }
}

/// Returns the processes that a process has started, and those that they have started.
fn descendants(pid: i32) -> Vec<i32> {
    let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
    let children = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok());
    let children: Vec<i32> = children
        .flat_map(|text| text.split_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<_>>())
        .collect();
    children.iter().copied().chain(children.iter().flat_map(|&child| descendants(child))).collect()
}
