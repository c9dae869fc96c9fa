//! The errors of this crate.

/// Every failure of this crate. Bad data never causes a panic.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The machine has no graphics adapter, not even a software one. Simulations and recordings
    /// work without one.
    #[error(
        "no graphics adapter found ({reason}); a picture needs Vulkan or OpenGL. On Debian and Ubuntu the software driver is enough: \
         apt-get install mesa-vulkan-drivers libvulkan1"
    )]
    NoAdapter {
        /// The message of the graphics library.
        reason: String,
    },
    /// No graphics adapter has the wanted name.
    #[error("no graphics adapter has \"{wanted}\" in its name; there are: {present}")]
    NoSuchAdapter {
        /// The wanted part of the name.
        wanted: String,
        /// The names of all adapters.
        present: String,
    },
    /// An adapter exists but fails: too old, out of memory, lost.
    #[error("the graphics device {adapter} failed: {reason}")]
    Device {
        /// The adapter's name.
        adapter: String,
        /// The message of the graphics library.
        reason: String,
    },
    /// The shaders have no translation for another renderer.
    #[error("the shaders cannot be translated: {reason}")]
    Translation {
        /// The message of the translator.
        reason: String,
    },
    /// There is no desktop to open a window on, or the desktop refuses to.
    #[error(
        "no window can be opened ({reason}). A window needs a desktop: X11, named by DISPLAY, or Wayland, named by WAYLAND_DISPLAY; \
         `tumble run SCENE --screenshot out.png` needs none"
    )]
    NoWindow {
        /// The message of the window system.
        reason: String,
    },
    /// A monitor is missing, or is not what a full-screen picture needs.
    #[error("{0}")]
    Monitor(String),
    /// The picture is empty, or larger than the limits or the device allow.
    #[error(
        "cannot render a picture of {width} x {height} pixels: each side must be 1 to {max_side} and their product at most {max_pixels}"
    )]
    BadSize {
        /// Requested width, pixels.
        width: u32,
        /// Requested height, pixels.
        height: u32,
        /// Largest side that is accepted.
        max_side: u32,
        /// Largest product of the sides that is accepted.
        max_pixels: u64,
    },
    /// A constant or a number of free particles is out of its range.
    #[error("{what} is {value}, but must be {range}")]
    Particles {
        /// The constant.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        range: &'static str,
    },
    /// An image cannot be encoded as PNG: it has no pixels, or not four bytes for each.
    #[error("the picture cannot be written as PNG: {0}")]
    Png(String),
    /// A list has more items than its limit.
    #[error("{count} {what} in the draw list, at most {cap} can be drawn")]
    TooMany {
        /// The kind of item, in the plural.
        what: &'static str,
        /// Number of items.
        count: usize,
        /// Largest number that is accepted.
        cap: usize,
    },
    /// A number is not finite or lies outside its range.
    #[error("{what} {index}: {field} is {value}, expected {expected}")]
    BadValue {
        /// The kind of item, such as `instance`.
        what: &'static str,
        /// Its index in its list; 0 if there is only one.
        index: usize,
        /// The invalid field.
        field: &'static str,
        /// Its value.
        value: String,
        /// Which values are valid.
        expected: &'static str,
    },
    /// The arrays of a mesh do not fit each other.
    #[error("mesh: {0}")]
    BadMesh(String),
    /// A picture cannot be written or read.
    #[error("{path}: {reason}")]
    File {
        /// The path of the file.
        path: String,
        /// The message of the operating system or of the PNG library.
        reason: String,
    },
}
