//! CPU time of this thread, so that other work on the machine does not count.

use std::time::Instant;

/// A clock that runs while this thread does.
pub struct Clock {
    since: Instant,
}

impl Clock {
    /// Starts a clock.
    #[allow(clippy::new_without_default)]
    pub fn new() -> Clock {
        Clock { since: Instant::now() }
    }

    /// Returns the CPU seconds of this thread, or wall time if the system has no such clock.
    pub fn seconds(&self) -> f64 {
        on_cpu().unwrap_or_else(|| self.since.elapsed().as_secs_f64())
    }
}

/// The kernel's count, ns resolution: the first number of `schedstat`.
fn on_cpu() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: u64 = text.split_whitespace().next()?.parse().ok()?;
    Some(nanoseconds as f64 * 1e-9)
}
