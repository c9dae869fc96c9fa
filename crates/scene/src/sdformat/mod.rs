//! SDF, the format of Gazebo (SDFormat): models and worlds as scenes.
//!
//! ```no_run
//! use tumble_scene::sdformat::load;
//! use tumble_scene::urdf::UrdfOptions;
//!
//! let scene = load("pendulum.sdf", &UrdfOptions::default())?;
//! scene.notes.iter().for_each(|note| println!("{note}"));
//! # Ok::<(), tumble_scene::sdformat::SdformatError>(())
//! ```
//!
//! | element | meaning |
//! |---|---|
//! | `<world>` | gravity, `max_step_size`, directional and point lights, models |
//! | `<model>` | articulated bodies: each link that no joint moves floats with all below it; nothing moves if it is `<static>` |
//! | `<pose relative_to>`, `<frame attached_to>`, `<xyz expressed_in>` | resolved during reading |
//! | `<joint>` revolute, continuous, prismatic, fixed, ball | the joint of that type; a parent `world` fixes its root |
//! | `<joint>` universal, revolute2 | two revolute joints `NAME/axis` and `NAME`, with a massless link between them |
//! | `<limit>`, `<dynamics>`, `<mimic>` | limits, effort, damping, dry friction, spring, coupling |
//! | `<inertial>` | mass, center of mass and inertia; `auto` computes them from the collision shapes |
//! | `<collision>`, `<visual>` | box, sphere, cylinder, capsule, ellipsoid, mesh; planes of static models are half-spaces |
//! | `<surface>`, `<material>` | `mu` and `restitution_coefficient`; the diffuse color |
//!
//! Everything else is a note with the file, the line and the element. Nested models and `<include>` are errors, as are other
//! types of joints and links with two joints. How meshes are found and what replaces the file's surfaces are
//! [`UrdfOptions`]; the file says whether its roots float.

mod error;
mod frames;
mod joint;
mod lenient;
mod link;
mod model;
mod read;
mod value;

use std::path::Path;

use tumble_core::articulated::ArticulatedBody;

pub use error::SdformatError;

use crate::build::articulated;
use crate::build::shapes::{Purpose, ShapeMaker};
use crate::notes::Notes;
use crate::parse::articulated::ArticulatedSpec;
use crate::parse::file::SceneFile;
use crate::urdf::{UrdfOptions, text_of};

/// Number of names that an error lists.
const MAX_LISTED: usize = 12;

/// Reads an SDF file as a scene. [`SceneFile::notes`] says what is left out, each with file, line and element.
///
/// # Errors
/// [`SdformatError`]: a file cannot be read, or has problems. All problems are reported at once, with file, line and column.
pub fn load(path: impl AsRef<Path>, options: &UrdfOptions) -> Result<SceneFile, SdformatError> {
    let path = path.as_ref();
    read::read(&text_of(path)?, path, options)
}

/// As [`load`], from a text; `file_name` is shown in errors, and meshes are relative to its folder.
///
/// # Errors
/// As [`load`], except those of the file.
pub fn parse(text: &str, file_name: &str, options: &UrdfOptions) -> Result<SceneFile, SdformatError> {
    read::read(text, Path::new(file_name), options)
}

/// Reads the only body of joined links of a file, with its shapes, at the place that it has in the file. Also returns the
/// names of its joints, and notes about the file and about the rest of it, which is left out.
///
/// # Errors
/// As [`load`]; [`SdformatError::Bodies`] if the file has none or several.
pub fn articulation(
    path: impl AsRef<Path>,
    options: &UrdfOptions,
) -> Result<(ArticulatedBody, Vec<String>, Notes), SdformatError> {
    let path = path.as_ref();
    let (spec, notes) = one_body(path, options)?;
    let mut maker = ShapeMaker::new(&[], Purpose::Stepped);
    let body =
        articulated::body(&spec, &mut maker).map_err(|why| SdformatError::Body { file: path.to_path_buf(), why })?;
    let joints = articulated::moving_joints(&spec.links);
    Ok((body, joints, notes.into_iter().chain(maker.notes.take()).collect()))
}

/// Reads the only body of joined links of a file.
pub(crate) fn one_body(path: &Path, options: &UrdfOptions) -> Result<(ArticulatedSpec, Notes), SdformatError> {
    let mut scene = load(path, options)?;
    if scene.articulated.len() != 1 {
        let names = scene.articulated.iter().take(MAX_LISTED).map(|spec| spec.name.clone()).collect();
        return Err(SdformatError::Bodies { file: path.to_path_buf(), count: scene.articulated.len(), names });
    }
    let mut notes = std::mem::take(&mut scene.notes);
    if !scene.bodies.is_empty() {
        let count = scene.bodies.len();
        notes.push(format!("{}: {count} planes are left out; the whole file is read as a scene", path.display()));
    }
    Ok((scene.articulated.remove(0), notes))
}
