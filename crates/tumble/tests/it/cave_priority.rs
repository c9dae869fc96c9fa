//! Real-time priority: the sessions have it, and the threads of a software driver do not.

use crate::cave_place::*;
use rustix::process::Signal;
use std::process::{Command, Stdio};

/// Returns name and scheduling policy of every thread of a process.
fn threads(pid: i32) -> Vec<(String, u32)> {
    let entries = std::fs::read_dir(format!("/proc/{pid}/task")).unwrap().flatten();
    let one = |path: std::path::PathBuf| {
        let stat = std::fs::read_to_string(path.join("stat")).ok()?;
        let policy = stat.rsplit_once(')')?.1.split_whitespace().nth(38)?.parse().ok()?;
        Some((std::fs::read_to_string(path.join("comm")).ok()?.trim().to_owned(), policy))
    };
    entries.filter_map(|entry| one(entry.path())).collect()
}

#[test]
fn drawing_by_a_software_driver_has_no_real_time_priority() {
    let may = Command::new("chrt").args(["-f", "5", "true"]).stderr(Stdio::null()).status();
    if !may.is_ok_and(|status| status.success()) {
        return crate::desktop::skip("this user may not use real-time priority (chrt)");
    }
    match tumble::render::Renderer::new() {
        Ok(renderer) if renderer.is_software() => {}
        _ => return crate::desktop::skip("this machine has no software driver, or prefers another one"),
    }
    let place = Place::new("cave-priority", &wall());
    let plain = place.command("cave", &["--offscreen", "--quality", "fastest", "--log-dir", &place.path("out")]);
    let mut command = Command::new("chrt");
    command.args(["-f", "5"]).arg(plain.get_program()).args(plain.get_args());
    for (name, value) in plain.get_envs() {
        match value {
            Some(value) => command.env(name, value),
            None => command.env_remove(name),
        };
    }
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let mut run = crate::desktop::Running(child);
    place.wait_for("out", "r", 2);
    let pid = run.0.id() as i32;
    let children = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap();
    for facet in children.split_whitespace().map(|child| child.parse().unwrap()) {
        let threads = threads(facet);
        let drawing = |name: &str| name.starts_with("llvmpipe") || name == "painter";
        assert!(threads.iter().filter(|(name, _)| drawing(name)).count() > 1, "{threads:?}");
        // Mesa gives its threads that write caches the policy for batches (3), and on a busy machine they still
        // have the name of the thread that started them
        let is_real_time = |policy: u32| [1, 2].contains(&policy);
        assert!(threads.iter().all(|(name, policy)| !drawing(name) || !is_real_time(*policy)), "{threads:?}");
        // the session is in the main thread
        assert!(threads.iter().any(|(name, policy)| name == "tumble" && *policy == 1), "{threads:?}");
    }
    signal(pid, Signal::INT);
    wait("the end", || run.0.try_wait().unwrap().is_some());
    assert_eq!(run.0.wait().unwrap().code(), Some(0));
}
