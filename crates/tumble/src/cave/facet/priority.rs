//! Real-time priority and software drivers. A launcher with real-time priority (`chrt`) passes it to
//! all threads of its facets. The threads of a software driver would then take the cores from the
//! sessions for as long as a picture takes, so they get the normal priority.

use std::path::Path;
use std::process::{Command, Stdio};

/// Beginnings of the names of threads that draw: those of the driver, and the one that calls it.
const DRAWING: [&str; 3] = ["llvmpipe", "lvp", "painter"];
/// Scheduling policies with real-time priority: first in, first out, and round robin.
const REAL_TIME: [u32; 2] = [1, 2];

/// Gives the normal priority to the threads of this process that draw, if they have real-time
/// priority. Returns the error of the command that does it.
pub fn lower_drawing_threads() -> Result<(), String> {
    for thread in std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten() {
        let path = thread.path();
        let name = std::fs::read_to_string(path.join("comm")).unwrap_or_default();
        if !DRAWING.iter().any(|begin| name.starts_with(begin))
            || !policy(&path).is_some_and(|p| REAL_TIME.contains(&p))
        {
            continue;
        }
        let mut command = Command::new("chrt");
        command.args(["--other", "--pid", "0"]).arg(thread.file_name());
        let done = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).output();
        match done {
            Ok(done) if done.status.success() => {}
            Ok(done) => return Err(String::from_utf8_lossy(&done.stderr).trim().to_owned()),
            Err(error) => return Err(format!("chrt: {error}")),
        }
    }
    Ok(())
}

/// Returns the scheduling policy of a thread from its folder in `/proc`.
fn policy(thread: &Path) -> Option<u32> {
    let about = std::fs::read_to_string(thread.join("stat")).ok()?;
    // the name in parentheses may contain anything; the third field follows it, the policy is the
    // 41st
    about.rsplit_once(')')?.1.split_whitespace().nth(41 - 3)?.parse().ok()
}
