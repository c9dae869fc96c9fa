//! Options of the commands for files of caves.

use super::values::{millimeters, png, point};
use clap::{Args, Subcommand};
use std::path::PathBuf;
use tumble::render::CalibrationPattern;

#[derive(Args)]
pub struct CavesOptions {
    /// Draw a calibration pattern: grid, corners, colors, ramps, blend, convergence or name.
    #[arg(long, value_name = "WHAT", requires_all = ["cave", "facet", "screenshot"])]
    pub pattern: Option<CalibrationPattern>,
    /// A cave file or the name of a shipped cave.
    #[arg(long, value_name = "CAVE", requires = "pattern")]
    pub cave: Option<String>,
    /// The facet that shows the pattern.
    #[arg(long, value_name = "NAME", requires = "pattern")]
    pub facet: Option<String>,
    /// Warp, blend and color the pattern, as pictures for the projector are.
    #[arg(long, requires = "pattern")]
    pub finish: bool,
    /// Write the pattern here (PNG).
    #[arg(long, value_name = "FILE", requires = "pattern", value_parser = png)]
    pub screenshot: Option<PathBuf>,
}

#[derive(Args)]
pub struct MpcdiOptions {
    /// An archive (.mpcdi, or its description .xml), a configuration of SGCT (.json), or a cave file or the
    /// name of a shipped cave.
    #[arg(value_name = "FILE")]
    pub name: String,
    /// The folder of the new cave, which gets cave.toml, warps and masks; or the archive to write.
    #[arg(long, short, value_name = "DIR|FILE")]
    pub output: PathBuf,
    /// The eye of the cave's user between the projectors, m: x right, y ahead, z up.
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,1.7", value_parser = point, allow_hyphen_values = true)]
    pub eye: [f64; 3],
    /// Replace an archive or a cave that is there already. Without it such an output is refused.
    #[arg(long)]
    pub overwrite: bool,
}

#[derive(Args)]
pub struct CalibrateOptions {
    #[command(subcommand)]
    pub action: CalibrateAction,
}

#[derive(Subcommand)]
pub enum CalibrateAction {
    /// Write the patterns of each projector as pictures, in the order in which they are photographed
    Patterns {
        /// A cave file or the name of a shipped cave, with the screens as built and one facet for each projector.
        #[arg(value_name = "CAVE")]
        cave: String,
        /// The folder that gets a folder of pictures for each facet.
        #[arg(long, short, value_name = "DIR", alias = "out")]
        output: PathBuf,
        /// Replace pictures that are there already. Without it they are refused.
        #[arg(long)]
        overwrite: bool,
    },
    /// Make a cave file with warps and blends of photographs of the patterns
    Solve(SolveOptions),
}

#[derive(Args)]
pub struct SolveOptions {
    /// The cave file of the patterns.
    #[arg(value_name = "CAVE")]
    pub cave: String,
    /// The folder with a folder of photographs for each place of the camera.
    #[arg(long, value_name = "DIR")]
    pub photos: PathBuf,
    /// Points of the cave and their pixels in the photographs (TOML), four or more for each view.
    #[arg(long, value_name = "FILE")]
    pub marks: PathBuf,
    /// The folder of the new cave, which gets cave.toml, screens.toml, warps and masks.
    #[arg(long, short, value_name = "DIR", alias = "out")]
    pub output: PathBuf,
    /// The view whose photographs were taken from the first user's place: the camera's position becomes the
    /// user's eye.
    #[arg(long, value_name = "VIEW")]
    pub eye: Option<String>,
    /// How exactly the screens of the cave file were measured, mm (standard deviation). They are moved and
    /// tilted as the photographs say; 0 takes them as exact.
    #[arg(long, value_name = "MM", default_value = "5", value_parser = millimeters)]
    pub screens_mm: f64,
    /// Replace a cave that is there already. Without it it is refused.
    #[arg(long)]
    pub overwrite: bool,
}
