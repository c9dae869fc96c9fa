//! Reports meshes that take long to load while they are loaded.

use std::sync::OnceLock;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Loading that takes longer is reported.
const LONG: Duration = Duration::from_secs(2);

type Listener = fn(&str);

static LISTENER: OnceLock<Listener> = OnceLock::new();

/// Sets the function that is called once for each mesh whose loading takes longer than 2 s, as soon
/// as it does, with a line such as `building the collision surface of "bunny.obj" (69,664
/// triangles)`. It is called from another thread. The first listener of a process stays; without
/// one nothing is reported.
pub fn set_slow_load_listener(listener: fn(&str)) {
    let _ = LISTENER.set(listener);
}

/// Runs `work`, which builds the collision surface of a mesh, and reports it if it takes long.
/// `mesh` names the mesh, for example by its file; `triangles` is the number of its triangles.
pub fn building_surface<T>(mesh: &str, triangles: usize, work: impl FnOnce() -> T) -> T {
    match LISTENER.get() {
        Some(listener) => watched(LONG, || listener(&line(mesh, triangles)), work),
        None => work(),
    }
}

fn line(mesh: &str, triangles: usize) -> String {
    format!("building the collision surface of \"{mesh}\" ({} triangles)", grouped(triangles))
}

/// Calls `report` from another thread if `work` takes longer than `long`.
fn watched<T>(long: Duration, report: impl FnOnce() + Send, work: impl FnOnce() -> T) -> T {
    let (done, waiting) = channel::<()>();
    thread::scope(|scope| {
        let watch = move || {
            if waiting.recv_timeout(long) == Err(RecvTimeoutError::Timeout) {
                report();
            }
        };
        // If no thread can be started nothing is reported, and the work is done all the same.
        let _ = thread::Builder::new().name("slow load".into()).spawn_scoped(scope, watch);
        let result = work();
        drop(done);
        result
    })
}

/// Formats a number with a comma before every three digits.
fn grouped(n: usize) -> String {
    let digits = n.to_string();
    let starts = |k: &usize| *k > 0 && (digits.len() - k).is_multiple_of(3);
    (0..digits.len()).map(|k| format!("{}{}", if starts(&k) { "," } else { "" }, &digits[k..=k])).collect()
}

#[cfg(test)]
mod tests {
    use super::{grouped, line, watched};
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::time::Duration;

    #[test]
    fn only_long_work_is_reported_and_once() {
        let reports = AtomicU32::new(0);
        let report = || _ = reports.fetch_add(1, Ordering::Relaxed);
        assert_eq!(watched(Duration::from_secs(600), report, || 7), 7);
        assert_eq!(reports.load(Ordering::Relaxed), 0);
        // The work ends after the report, however slow the machine is.
        let waits = || while reports.load(Ordering::Relaxed) == 0 {};
        watched(Duration::from_millis(5), report, waits);
        assert_eq!(reports.load(Ordering::Relaxed), 1);
    }

    #[test]
    fn the_line_names_mesh_and_size() {
        assert_eq!(line("bunny.obj", 69_664), "building the collision surface of \"bunny.obj\" (69,664 triangles)");
        assert_eq!([7, 999, 1000, 1_234_567].map(grouped), ["7", "999", "1,000", "1,234,567"]);
    }
}
