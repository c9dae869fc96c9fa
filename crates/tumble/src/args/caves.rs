//! Options of the commands for files of caves.

use super::values::{png, point};
use clap::Args;
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
}
