//! Whether there is a desktop on which a window can be opened.

use std::os::unix::net::UnixStream;

/// What there is to open windows on.
pub enum Desktop {
    /// Nothing is named.
    None,
    /// Something is named that does not answer: what, and why.
    Unreachable(String),
    Available,
}

/// Looks for it, as the window library will: Wayland where that is named, else X.
pub fn desktop() -> Desktop {
    let named = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    let answer = match (named("WAYLAND_DISPLAY"), named("DISPLAY")) {
        (Some(name), _) => {
            let path = std::path::Path::new(&named("XDG_RUNTIME_DIR").unwrap_or_default()).join(&name);
            UnixStream::connect(path).map(drop).map_err(|e| format!("WAYLAND_DISPLAY={name}: {e}"))
        }
        (None, Some(name)) if too_high(&name) => Err(format!("DISPLAY={name}: there is no such number")),
        (None, Some(name)) => x11rb::connect(None).map(drop).map_err(|e| format!("DISPLAY={name}: {e}")),
        (None, None) => return Desktop::None,
    };
    answer.map_or_else(Desktop::Unreachable, |()| Desktop::Available)
}

/// Whether the number of a display has no port: that is 6000 more, and the library does not look.
fn too_high(display: &str) -> bool {
    let number = display.rsplit(':').next().and_then(|rest| rest.split('.').next()).and_then(|n| n.parse::<u32>().ok());
    number.is_some_and(|n| n > 59_535)
}
