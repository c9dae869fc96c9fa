//! Detection of a desktop on which a window can be opened.

use std::os::unix::net::UnixStream;

/// The desktop of this process.
pub enum Desktop {
    /// No variable names a desktop.
    None,
    /// A variable names a desktop that does not answer: which, and why.
    Unreachable(String),
    Available,
}

/// Probes the desktop that the window library will use: Wayland if it is named, else X.
pub fn desktop() -> Desktop {
    let named = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    let answer = match (named("WAYLAND_DISPLAY"), named("DISPLAY")) {
        (Some(name), _) => {
            let path = std::path::Path::new(&named("XDG_RUNTIME_DIR").unwrap_or_default()).join(&name);
            UnixStream::connect(path).map(drop).map_err(|e| format!("WAYLAND_DISPLAY={name}: {e}"))
        }
        (None, Some(name)) if too_high(&name) => Err(format!("DISPLAY={name}: invalid display number")),
        (None, Some(name)) => x11rb::connect(None).map(drop).map_err(|e| format!("DISPLAY={name}: {e}")),
        (None, None) => return Desktop::None,
    };
    answer.map_or_else(Desktop::Unreachable, |()| Desktop::Available)
}

/// Returns whether a display number has no TCP port (6000 more), which the library does not check.
fn too_high(display: &str) -> bool {
    let number = display.rsplit(':').next().and_then(|rest| rest.split('.').next()).and_then(|n| n.parse::<u32>().ok());
    number.is_some_and(|n| n > 59_535)
}
