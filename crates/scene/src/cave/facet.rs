//! `[[facet]]`: one image on one screen, for one user, drawn by one node.

use std::path::{Path, PathBuf};

use super::checks;
use super::parts::{NAME, Node, Screen, User, is_name, read_name};
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};

/// How one image shows both eyes, or one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stereo {
    /// One image from the point between the eyes.
    Mono,
    /// The left eye's image alone: one of two projectors or machines for a screen.
    Left,
    /// The right eye's image alone.
    Right,
    /// The left eye's image to the left of the right eye's: twice the width.
    SideBySide,
    /// The left eye's image above the right eye's: twice the height.
    TopBottom,
    /// Red from the left eye, green and blue from the right, for red and cyan glasses.
    Anaglyph,
    /// Rows of pixels in turn, the first from the left eye: row-interlaced displays.
    Rows,
    /// Columns of pixels in turn, the first from the left eye: column-interlaced displays.
    Columns,
    /// Pixels in turn along rows and columns, the upper left one from the left eye: checkerboard
    /// displays.
    Checkerboard,
    /// Frames with even numbers from the left eye, with odd ones from the right: shutter glasses.
    FrameSequential,
}

/// Mirroring of the final image, for mirrors and rear projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flip {
    /// No mirroring.
    None,
    /// Left and right are exchanged.
    Horizontal,
    /// Top and bottom are exchanged.
    Vertical,
    /// Both: a rotation by 180 degrees.
    Both,
}

/// The place where the image is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// A borderless window at a position of the desktop.
    Window {
        /// Pixels from the left and from the top of the desktop; may be negative.
        position_px: [i32; 2],
    },
    /// Memory only.
    Offscreen,
}

/// The graphics card and the monitor of a facet, on its machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Display {
    /// Text that the name of the graphics adapter contains, in any case. Default any adapter.
    pub gpu: Option<String>,
    /// Name of a monitor of the desktop; the position of the window counts from its upper left corner.
    /// Default the whole desktop.
    pub monitor: Option<String>,
    /// Whether the image covers the monitor, whose size it has. Default false.
    pub full_screen: bool,
    /// Refresh rate that the monitor must have, Hz. Default any rate.
    pub refresh_hz: Option<f64>,
}

impl Display {
    fn read(f: &mut Fields<'_>, output: Output) -> Display {
        let mut text = |key| f.optional_text(key).map(|(text, _)| text.to_owned());
        let (gpu, monitor) = (text("gpu"), text("monitor"));
        let full_screen = f.flag_or("full_screen", false);
        let refresh_hz = f.optional_number("refresh_hz", REFRESH);
        if output == Output::Offscreen && (monitor.is_some() || full_screen || refresh_hz.is_some()) {
            let message = format!("{} is offscreen, and has a monitor", f.what);
            f.log.report(f.span.clone(), message, "expected `monitor`, `full_screen` and `refresh_hz` of a window");
        }
        Display { gpu, monitor, full_screen, refresh_hz }
    }
}

const REFRESH: Bound = Bound::new(1.0, 1000.0, "a rate from 1 to 1000 Hz");

impl Stereo {
    pub(crate) const NAMES: Names<Self> = &[
        ("mono", Stereo::Mono),
        ("left", Stereo::Left),
        ("right", Stereo::Right),
        ("side_by_side", Stereo::SideBySide),
        ("top_bottom", Stereo::TopBottom),
        ("anaglyph", Stereo::Anaglyph),
        ("rows", Stereo::Rows),
        ("columns", Stereo::Columns),
        ("checkerboard", Stereo::Checkerboard),
        ("frame_sequential", Stereo::FrameSequential),
    ];

    /// Returns the sides of the eyes that are drawn: −1 left, 0 between, +1 right.
    pub fn sides(self) -> &'static [f64] {
        match self {
            Stereo::Mono => &[0.0],
            Stereo::Left => &[-1.0],
            Stereo::Right => &[1.0],
            _ => &[-1.0, 1.0],
        }
    }

    /// Returns the size of the whole image from that of one eye's, pixels.
    pub fn whole_px(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            Stereo::SideBySide => [2 * width, height],
            Stereo::TopBottom => [width, 2 * height],
            _ => [width, height],
        }
    }
}

impl Flip {
    pub(crate) const NAMES: Names<Self> =
        &[("none", Flip::None), ("horizontal", Flip::Horizontal), ("vertical", Flip::Vertical), ("both", Flip::Both)];
}

#[derive(Clone, Copy)]
enum Target {
    Window,
    Offscreen,
}
const TARGETS: Names<Target> = &[("window", Target::Window), ("offscreen", Target::Offscreen)];

/// An image on a screen.
#[derive(Clone, Debug, PartialEq)]
pub struct Facet {
    /// Unique among facets.
    pub name: String,
    /// Index of the screen.
    pub screen: usize,
    /// Index of the user from whose eyes it is drawn. Default the first.
    pub user: usize,
    /// Index of the node that draws it; `None` for the machine that runs the world.
    pub node: Option<usize>,
    /// Name of the process that draws it, together with the other facets of this name, on the same node
    /// and adapter. Default a process of its own.
    pub process: Option<String>,
    /// The place where the image is shown. Default a window at 0, 0.
    pub output: Output,
    /// Its graphics card and its monitor.
    pub display: Display,
    /// Whether the file says that it is a window (`output = "window"`). A facet without a window is
    /// then a failure; otherwise it may draw into memory.
    pub window_required: bool,
    /// Width and height of one eye's image, pixels, at least 1 each. The image with both eyes, and
    /// that with the rim of [`RIM_PX`](super::RIM_PX), must be within
    /// [`MAX_SIDE_PX`](super::MAX_SIDE_PX) and [`MAX_PIXELS`](super::MAX_PIXELS).
    pub size_px: [u32; 2],
    /// Nearest depth drawn, from the eye along the screen's normal, m. Default 0.05.
    pub near_m: f64,
    /// Farthest depth drawn, from the eye along the screen's normal, m. Default 500.
    pub far_m: f64,
    /// Default mono.
    pub stereo: Stereo,
    /// Whether the eyes change places in the image: for displays that begin with the right eye. Default
    /// false.
    pub swap_eyes: bool,
    /// Default none.
    pub flip: Flip,
    /// Whether the other facets wait for it (`lockstep`). Default true.
    pub critical: bool,
    /// A grid that warps the final image: OBJ or PFM.
    pub warp_file: Option<PathBuf>,
    /// An image that darkens the final one where projectors overlap: PNG.
    pub blend_file: Option<PathBuf>,
    /// An image of shares of the lift of black, 1 without it: PNG.
    pub black_file: Option<PathBuf>,
    /// The projector's color.
    pub color: Option<FacetColor>,
}

/// The color of a projector; numbers are by red, green, blue.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetColor {
    /// Exponent of the transfer curve, light = code^gamma, 1 to 4; `None` for sRGB.
    pub gamma: Option<f64>,
    /// Gain of light, 0 to 1. Default 1.
    pub white: [f64; 3],
    /// Light at code 0, as a share of full light, 0 to 0.5. Default 0.
    pub black: [f64; 3],
    /// Darkest light of the wall that black is lifted to, as a share of full light, at least
    /// `black`. Default `black`.
    pub floor: [f64; 3],
    /// A table of colors: `.cube`.
    pub lut_file: Option<PathBuf>,
}

impl FacetColor {
    fn read(mut f: Fields<'_>, folder: &Path) -> FacetColor {
        let problems = f.log.count();
        let gamma = f.optional_number("gamma", Bound::new(1.0, 4.0, "a number from 1 to 4"));
        let white = f.vector_or("white", Bound::UNIT, [1.0; 3]);
        let black = f.vector_or("black", LEAK, [0.0; 3]);
        let floor = f.vector_or("floor", LEAK, black);
        let lut_file = file(&mut f, "lut_file", folder, &["cube"]);
        if f.log.count() == problems && (0..3).any(|k| floor[k] < black[k]) {
            let message = format!("`floor` of {} is {floor:?}, and `black` {black:?}", f.what);
            f.log.report(f.span.clone(), message, "expected a floor of at least the projector's own black");
        }
        f.finish();
        FacetColor { gamma, white, black, floor, lut_file }
    }
}

const LEAK: Bound = Bound::new(0.0, 0.5, "a share of full light from 0 to 0.5");

impl Facet {
    pub(crate) fn read(
        mut f: Fields<'_>,
        users: &[User],
        screens: &[Screen],
        nodes: &[Node],
        folder: &Path,
    ) -> Option<Facet> {
        let name = read_name(&mut f)?;
        let problems = f.log.count();
        let screen = match f.text("screen", "the name of a [[screen]]") {
            Some((typed, value)) => {
                reference(&f, "screen", typed, value, screens.iter().map(|s| s.name.as_str()).collect())
            }
            None => None,
        };
        let user = f.optional_text("user").map_or(Some(0), |(typed, value)| {
            reference(&f, "user", typed, value, users.iter().map(|u| u.name.as_str()).collect())
        });
        let node = f
            .optional_text("node")
            .map(|(typed, value)| reference(&f, "node", typed, value, nodes.iter().map(|n| n.name.as_str()).collect()));
        let process = process(&mut f);
        let target = f.optional_choice("output", TARGETS);
        let window_required = matches!(target, Some(Target::Window));
        let output = match target.unwrap_or(Target::Window) {
            Target::Window => Output::Window { position_px: position(&mut f) },
            Target::Offscreen => Output::Offscreen,
        };
        let display = Display::read(&mut f, output);
        let size_px = size(&mut f);
        let facet = Facet {
            name,
            screen: screen.unwrap_or(usize::MAX),
            user: user.unwrap_or(usize::MAX),
            node: node.flatten(),
            process,
            output,
            display,
            window_required,
            size_px,
            near_m: f.number_or("near_m", NEAR, 0.05),
            far_m: f.number_or("far_m", Bound::POSITIVE, 500.0),
            stereo: f.choice_or("stereo", Stereo::NAMES, Stereo::Mono),
            swap_eyes: f.flag_or("swap_eyes", false),
            flip: f.choice_or("flip", Flip::NAMES, Flip::None),
            critical: f.flag_or("critical", true),
            warp_file: file(&mut f, "warp_file", folder, &["obj", "pfm"]),
            blend_file: file(&mut f, "blend_file", folder, &["png"]),
            black_file: file(&mut f, "black_file", folder, &["png"]),
            color: color(&mut f, folder),
        };
        let parts = (screens.get(facet.screen), users.get(facet.user));
        if let (true, (Some(screen), Some(user))) = (f.log.count() == problems, parts) {
            checks::facet(&facet, screen, user, &mut f);
        }
        if f.log.count() == problems {
            checks::target(facet.size_px, facet.stereo, &mut f);
            checks::swapped(&facet, &mut f);
        }
        f.finish();
        Some(facet)
    }

    /// Returns the sides of the eyes in the image of a frame, in the order of their places in it: −1 left, 0
    /// between, +1 right.
    pub fn eyes(&self, frame: u64) -> &'static [f64] {
        match (self.stereo.sides(), self.stereo) {
            (_, Stereo::FrameSequential) if frame.is_multiple_of(2) != self.swap_eyes => &[-1.0],
            (_, Stereo::FrameSequential) => &[1.0],
            ([_, _], _) if self.swap_eyes => &[1.0, -1.0],
            (sides, _) => sides,
        }
    }

    /// Returns the size of the target with both eyes in it, pixels.
    pub fn whole_px(&self) -> [u32; 2] {
        self.stereo.whole_px(self.size_px)
    }
}

const NEAR: Bound = Bound::new(1e-4, 1e6, "a length of at least 0.0001 m");

/// Returns the index of `typed` among `known`; `None`, with the problem recorded, if it is not
/// there.
fn reference(
    f: &Fields<'_>,
    key: &str,
    typed: &str,
    value: &crate::parse::fields::Value<'_>,
    known: Vec<&str>,
) -> Option<usize> {
    let found = known.iter().position(|name| *name == typed);
    if found.is_none() && known.is_empty() {
        f.wrong(key, value, format!("a table [[{key}]] of this name; there is no such table"));
    } else if found.is_none() {
        f.unknown_name(key, value, typed, known);
    }
    found
}

/// Reads the name of the process.
fn process(f: &mut Fields<'_>) -> Option<String> {
    let (name, value) = f.optional_text("process")?;
    if !is_name(name) {
        f.wrong("process", value, NAME);
    }
    Some(name.to_owned())
}

/// Reads the table `color`.
fn color(f: &mut Fields<'_>, folder: &Path) -> Option<FacetColor> {
    let value = f.value("color")?;
    let table = Fields::of(f.log, value, format!("`color` of {}", f.what), "{ gamma = 2.2 }")?;
    Some(FacetColor::read(table, folder))
}

/// Reads `size_px`: two integers.
fn size(f: &mut Fields<'_>) -> [u32; 2] {
    let Some(value) = f.required("size_px", "width and height in pixels, such as [1920, 1080]") else { return [1, 1] };
    match value.get_ref().as_array().filter(|items| items.len() == 2) {
        Some(items) => std::array::from_fn(|k| {
            items.get(k).map_or(1, |item| f.as_integer("size_px", item, 1..=checks::MAX_SIDE_PX))
        }),
        None => {
            f.wrong("size_px", value, "width and height in pixels, such as [1920, 1080]");
            [1, 1]
        }
    }
}

/// Reads `position_px`: two integers, which may be negative.
fn position(f: &mut Fields<'_>) -> [i32; 2] {
    let problems = f.log.count();
    let place: [f64; 2] =
        f.vector_or("position_px", Bound::new(-1e6, 1e6, "a number of pixels from -1e6 to 1e6"), [0.0; 2]);
    if f.log.count() == problems && place.iter().any(|x| x.fract() != 0.0) {
        let message = format!("`position_px` of {} has fractions of pixels", f.what);
        f.log.report(f.span.clone(), message, "expected two integers");
    }
    place.map(|x| x as i32)
}

/// Reads the path of a file beside the cave and checks its extension. Its content is read when it
/// is used.
pub(crate) fn file(f: &mut Fields<'_>, key: &'static str, folder: &Path, endings: &[&'static str]) -> Option<PathBuf> {
    let (text, value) = f.optional_text(key)?;
    let ending = Path::new(text).extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    if !endings.contains(&ending.as_str()) {
        f.wrong(key, value, format!("a file that ends in .{}", endings.join(" or .")));
    }
    Some(folder.join(text))
}
