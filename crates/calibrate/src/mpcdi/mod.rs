//! MPCDI: Multiple Projection Common Data Interchange (VESA), versions 1 and 2. A zip archive with a
//! description `mpcdi.xml`, warps as PFM and masks as PNG.
//!
//! From public descriptions of the standard and the files of its open library, not from the text of the
//! standard:
//!
//! - A display has buffers, a buffer regions; a region is the picture of one projector.
//! - Profile `2d`: a warp gives places `u, v` of the region's part of the buffer. `3d`: of the picture that
//!   the frustum shows. `a3`: points `x, y, z`. `sl`: the frustum is the projector itself.
//! - Rows of a warp go from the top, `u` to the right, `v` down, from 0 to 1. Nodes are spread evenly, each
//!   in the middle of its cell.
//! - `alphaMap`: shares of light to the power `1 / gammaEmbedded`; `betaMap`: light added to black.
//! - Yaw is positive to the right, pitch upward, roll clockwise for a pilot; degrees, in this order.

mod archive;
mod read;
mod write;

pub(crate) use read::flipped as upside_down;
use thiserror::Error;
use tumble_render::Pfm;

/// The meaning of warps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// `2d`: places of a flat picture.
    TwoD,
    /// `3d`: places of pictures from one eye.
    ThreeD,
    /// `a3`: points in the room.
    Advanced3D,
    /// `sl`: poses of projectors.
    ShaderLamps,
}

impl Profile {
    pub(crate) const NAMES: [(&str, Profile); 4] =
        [("2d", Profile::TwoD), ("3d", Profile::ThreeD), ("a3", Profile::Advanced3D), ("sl", Profile::ShaderLamps)];

    /// Returns the word of the standard.
    pub fn name(self) -> &'static str {
        Profile::NAMES.iter().find(|(_, profile)| *profile == self).map_or("", |(name, _)| name)
    }
}

/// A view: its direction and the angles of its edges; degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// To the right, upward, clockwise.
    pub yaw_pitch_roll_deg: [f64; 3],
    /// Left, right, lower and upper edge from the line of sight; left and lower are mostly negative.
    pub edges_deg: [f64; 4],
}

/// A mask of a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The file.
    pub png: Vec<u8>,
    /// Light = value^gamma.
    pub gamma: f64,
}

/// The picture of one projector.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// The buffer that it is a part of.
    pub buffer: String,
    /// Width over height of the buffer's picture, if its resolution is known.
    pub buffer_aspect: Option<f64>,
    /// Unique among regions.
    pub id: String,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Upper left corner in the buffer, and width and height: shares of the buffer.
    pub part: [f64; 4],
    /// The view.
    pub frustum: Option<Frustum>,
    /// Position of the projector, in the axes of the file.
    pub position: [f64; 3],
    /// Rows: the directions to the right, ahead and up in the axes of the file.
    pub axes: [[f64; 3]; 3],
    /// The warp; its first row is the one at the bottom, as in [`Pfm`].
    pub warp: Option<Pfm>,
    /// Meters per unit of the points of a warp.
    pub unit_m: f64,
    /// Shares of light.
    pub alpha: Option<Map>,
    /// Light added to black.
    pub beta: Option<Map>,
}

/// An archive.
#[derive(Clone, Debug, PartialEq)]
pub struct Mpcdi {
    /// The meaning of warps.
    pub profile: Profile,
    /// The projectors, at least one.
    pub regions: Vec<Region>,
    /// Parts of the file that were not used.
    pub notes: Vec<String>,
}

/// A fault of an archive.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{place}: {reason}")]
pub struct CalibrationError {
    /// The file in the archive, with line and column of a description; or `the archive`.
    pub place: String,
    /// The fault, and the expected value.
    pub reason: String,
}

impl CalibrationError {
    pub(crate) fn new(place: impl Into<String>, reason: impl Into<String>) -> CalibrationError {
        CalibrationError { place: place.into(), reason: reason.into() }
    }
}

impl Mpcdi {
    /// Reads the bytes of an archive, or of a description by itself (`.mpcdi.xml`).
    ///
    /// Limits: 1024 files, 64 MiB per file, 512 MiB together after decompression, 4 MiB of description, 256
    /// regions.
    ///
    /// # Errors
    /// [`CalibrationError`] with the place of the first fault.
    pub fn parse(bytes: &[u8]) -> Result<Mpcdi, CalibrationError> {
        if bytes.trim_ascii_start().first() == Some(&b'<') {
            return read::parse("the description", bytes, &mut archive::Archive::none());
        }
        let mut archive = archive::Archive::open(bytes)?;
        let (name, description) = archive.description()?;
        read::parse(&name, &description, &mut archive)
    }

    /// Writes the archive.
    ///
    /// # Errors
    /// [`CalibrationError`] for an archive that is too large for its format.
    pub fn to_bytes(&self) -> Result<Vec<u8>, CalibrationError> {
        write::archive(self)
    }
}
