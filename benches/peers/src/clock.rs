//! CPU time of this thread, so that other work on the machine does not count; and time of the day, for
//! work on several threads.

use rustix::time::{ClockId, clock_gettime};

/// Returns the CPU seconds of this thread so far, to the nanosecond.
pub fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Returns the seconds since some time in the past, to the nanosecond.
pub fn wall_seconds() -> f64 {
    let time = clock_gettime(ClockId::Monotonic);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
