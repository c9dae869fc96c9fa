//! What can go wrong between a draw list and a picture.

/// Every failure of this crate. Nothing here panics on data.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The machine has no graphics adapter, not even a software one. Simulating and recording need none: go on without a picture.
    #[error(
        "no graphics adapter found ({reason}); a picture needs Vulkan or OpenGL. On Debian and Ubuntu the software driver is enough: \
         apt-get install mesa-vulkan-drivers libvulkan1"
    )]
    NoAdapter {
        /// What the graphics library said.
        reason: String,
    },
    /// An adapter exists but would not do what was asked (too old, out of memory, lost).
    #[error("the graphics device {adapter} failed: {reason}")]
    Device {
        /// The adapter's name.
        adapter: String,
        /// What the graphics library said.
        reason: String,
    },
    /// There is no desktop to open a window on, or it would not open one.
    #[error(
        "no window can be opened ({reason}). A window needs a desktop: X11, named by DISPLAY, or Wayland, named by WAYLAND_DISPLAY; \
         `tumble run SCENE --screenshot out.png` needs none"
    )]
    NoWindow {
        /// What the window system said.
        reason: String,
    },
    /// The picture is empty, or larger than the caps or the device allow.
    #[error(
        "cannot render a picture of {width} x {height} pixels: each side must be 1 to {max_side} and their product at most {max_pixels}"
    )]
    BadSize {
        /// Width asked for, in pixels.
        width: u32,
        /// Height asked for, in pixels.
        height: u32,
        /// Largest side that would be accepted.
        max_side: u32,
        /// Largest product of the sides that would be accepted.
        max_pixels: u64,
    },
    /// An image cannot be encoded as PNG: it has no pixels, or a number of bytes that its sides do not give.
    #[error("the picture cannot be written as PNG: {0}")]
    Png(String),
    /// More of something than the cap.
    #[error("{count} {what} in the draw list, at most {cap} can be drawn")]
    TooMany {
        /// What was counted, in the plural.
        what: &'static str,
        /// How many there were.
        count: usize,
        /// The most that are accepted.
        cap: usize,
    },
    /// A number that is not finite or lies outside its range.
    #[error("{what} {index}: {field} is {value}, expected {expected}")]
    BadValue {
        /// The kind of item, such as `instance`.
        what: &'static str,
        /// Its place in its list (0 where there is only one).
        index: usize,
        /// The field at fault.
        field: &'static str,
        /// What stood there.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// A mesh whose arrays do not fit each other.
    #[error("mesh: {0}")]
    BadMesh(String),
    /// The picture could not be written or read.
    #[error("{path}: {reason}")]
    File {
        /// The file concerned.
        path: String,
        /// What the system or the PNG library said.
        reason: String,
    },
}
