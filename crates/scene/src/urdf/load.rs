//! Makes bodies and models from URDF files.

use std::path::Path;

use tumble_core::articulated::{ArticulatedBody, DofSettings, LinkMass, Model};

use super::error::UrdfError;
use super::options::UrdfOptions;
use super::read::{Content, Robot, read_file, read_text};
use crate::build::articulated;
use crate::build::shapes::{Purpose, ShapeMaker};
use crate::notes::Notes;
use crate::parse::articulated::ArticulatedSpec;
use crate::parse::link::LinkSpec;
/// Reads a URDF as an articulated body at the origin with its shapes, limits and couplings. Visual
/// meshes are read when they are first drawn. Also returns notes about the file.
///
/// # Errors
/// [`UrdfError`]: a file cannot be read, or has problems. All problems of the XML are reported at
/// once, with line and column.
pub fn load(path: impl AsRef<Path>, options: &UrdfOptions) -> Result<(ArticulatedBody, Notes), UrdfError> {
    let path = path.as_ref();
    let robot = read_file(path, options, Content::Body)?;
    let mut maker = ShapeMaker::new(&[], Purpose::Stepped);
    let spec = ArticulatedSpec { exclude_overlapping: true, ..ArticulatedSpec::of(robot.name, robot.links) };
    let body = articulated::body(&spec, &mut maker).map_err(|why| UrdfError::Body { file: path.to_path_buf(), why })?;
    Ok((body, robot.notes.into_iter().chain(maker.notes.take()).collect()))
}

/// The tree of a URDF without its shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfModel {
    /// The robot's name.
    pub name: String,
    /// Its links and joints.
    pub model: Model,
    /// Names of its joints, one for each of [`Model::links`], in the order of the coordinates. The
    /// name for a floating root is that of the root link.
    pub joints: Vec<String>,
    /// Limits, damping and dry friction of its degrees of freedom, in the order of the velocities.
    pub dofs: Vec<DofSettings>,
    /// Notes about the file.
    pub notes: Vec<String>,
}

/// Reads the tree of a URDF without its shapes. No mesh is searched for.
///
/// # Errors
/// [`UrdfError`]: the file cannot be read, or has problems. All problems are reported at once, with
/// line and column.
pub fn model(path: impl AsRef<Path>, options: &UrdfOptions) -> Result<UrdfModel, UrdfError> {
    let path = path.as_ref();
    let robot = read_file(path, options, Content::Tree)?;
    robot.into_model(path)
}

/// As [`model`], from a text; `file_name` is shown in errors.
///
/// # Errors
/// As [`model`], except those of files.
pub fn parse_model(text: &str, file_name: &str, options: &UrdfOptions) -> Result<UrdfModel, UrdfError> {
    let path = Path::new(file_name);
    read_text(text, path, options, Content::Tree)?.into_model(path)
}

impl Robot {
    fn into_model(self, path: &Path) -> Result<UrdfModel, UrdfError> {
        let masses: Vec<LinkMass> = self.links.iter().map(LinkSpec::given_mass).collect();
        let model = articulated::model(&self.links, &masses)
            .map_err(|source| UrdfError::Model { file: path.to_path_buf(), source })?;
        let (joints, dofs) = (articulated::moving_joints(&self.links), articulated::dofs(&self.links));
        Ok(UrdfModel { joints, dofs, name: self.name, model, notes: self.notes })
    }
}
