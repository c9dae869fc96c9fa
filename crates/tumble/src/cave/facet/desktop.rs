//! Detection of a desktop on which a window can be opened.

use std::os::unix::net::UnixStream;
use std::sync::mpsc;
use std::time::{Duration, Instant};
use x11rb::rust_connection::RustConnection;

/// Time for which a desktop that does not answer is asked again: an X server that has just lost its
/// last client resets itself, and answers nobody meanwhile.
const RETRY_TIMEOUT: Duration = Duration::from_millis(1500);
/// Interval between two attempts.
const RETRY_INTERVAL: Duration = Duration::from_millis(100);
/// Time for the answer of an X server that accepts the connection: on a busy machine it takes seconds.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(10);

/// The desktop of this process.
pub enum Desktop {
    /// No variable names a desktop.
    None,
    /// A variable names a desktop that does not answer: which, and why.
    Unreachable(String),
    Available(Probe),
}

/// A connection to the desktop. It is kept until the window is open: an X server without other
/// clients resets when a connection ends, and cuts those that were made meanwhile.
#[allow(dead_code)] // held, not used
pub enum Probe {
    X(Box<RustConnection>),
    Wayland(UnixStream),
}

/// Connects to the desktop that the window library will use: Wayland if it is named, else X.
pub fn desktop() -> Desktop {
    let named = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    let answer = match (named("WAYLAND_DISPLAY"), named("DISPLAY")) {
        (Some(name), _) => {
            let path = std::path::Path::new(&named("XDG_RUNTIME_DIR").unwrap_or_default()).join(&name);
            let connect = || UnixStream::connect(&path).map(Probe::Wayland).map_err(|e| e.to_string());
            retried(connect).map_err(|e| format!("WAYLAND_DISPLAY={name}: {e}"))
        }
        (None, Some(name)) if too_high(&name) => Err(format!("DISPLAY={name}: invalid display number")),
        (None, Some(name)) => retried(connect_x).map_err(|e| format!("DISPLAY={name}: {e}")),
        (None, None) => return Desktop::None,
    };
    answer.map_or_else(Desktop::Unreachable, Desktop::Available)
}

/// Connects to the X server. A thread waits for its answer, because a stopped server never gives one.
fn connect_x() -> Result<Probe, String> {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let answer = x11rb::connect(None).map(|(x, _)| Probe::X(Box::new(x))).map_err(|e| e.to_string());
        // nobody receives it after the timeout
        let _ = sender.send(answer);
    });
    let silent = || format!("it takes connections and is silent for {} s", ANSWER_TIMEOUT.as_secs());
    receiver.recv_timeout(ANSWER_TIMEOUT).map_err(|_| silent())?
}

/// Tries until it succeeds, or for [`RETRY_TIMEOUT`].
fn retried(mut connect: impl FnMut() -> Result<Probe, String>) -> Result<Probe, String> {
    let start = Instant::now();
    loop {
        match connect() {
            Err(_) if start.elapsed() < RETRY_TIMEOUT => std::thread::sleep(RETRY_INTERVAL),
            result => return result,
        }
    }
}

/// Returns whether a display number has no TCP port (6000 more), which the library does not check.
fn too_high(display: &str) -> bool {
    let number = display.rsplit(':').next().and_then(|rest| rest.split('.').next()).and_then(|n| n.parse::<u32>().ok());
    number.is_some_and(|n| n > 59_535)
}
