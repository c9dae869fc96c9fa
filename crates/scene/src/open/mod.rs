//! Opens scenes by path or name, and robots and meshes as scenes of their own.

pub(crate) mod format;
pub(crate) mod on_floor;
pub(crate) mod plain;
pub(crate) mod shipped;

use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::SceneError;
use crate::mjcf::{self, MjcfOptions};
use crate::open::format::FileKind;
use crate::parse::file::{MAX_BYTES, SceneFile};
use crate::sdformat;
use crate::urdf::UrdfOptions;

/// How a robot or a mesh file is opened as a scene. Scene files have keys for these options.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// How a URDF or a file of Gazebo is read.
    pub urdf: UrdfOptions,
    /// How a model of MuJoCo is read.
    pub mjcf: MjcfOptions,
    /// Whether holes and other defects of a mesh are repaired. Otherwise they are an error.
    pub repair: bool,
}

impl SceneFile {
    /// Reads the file at `path`, or `scene.toml` in the folder `path`. A URDF (`.urdf`) becomes a
    /// scene with the robot on a floor through its lowest point. A model of MuJoCo (`.xml`, `.mjcf`)
    /// or of Gazebo (`.sdf`) becomes a scene with all its bodies. A mesh (`.obj`, `.stl`, `.ply`,
    /// `.dae`) becomes a dynamic body of 1000 kg/m³ above a floor, in the frame of its file.
    ///
    /// # Errors
    /// [`SceneError`]: the file cannot be read, is larger than 16 MiB, not UTF-8 or of another
    /// format, or has problems. All problems are reported at once.
    pub fn load(path: impl AsRef<Path>) -> Result<SceneFile, SceneError> {
        SceneFile::load_with(path, &LoadOptions::default())
    }

    /// As [`SceneFile::load`], with options for robots and meshes.
    ///
    /// # Errors
    /// As [`SceneFile::load`].
    pub fn load_with(path: impl AsRef<Path>, options: &LoadOptions) -> Result<SceneFile, SceneError> {
        let mut path = path.as_ref().to_path_buf();
        if path.is_dir() {
            path.push("scene.toml");
        }
        match FileKind::of(&path).map_err(|why| SceneError::Format { file: path.clone(), why })? {
            FileKind::Scene => {}
            FileKind::Urdf => return on_floor::robot(&path, &options.urdf),
            FileKind::Mjcf => return Ok(mjcf::load(&path, &options.mjcf)?),
            FileKind::Sdformat => return Ok(sdformat::load(&path, &options.urdf)?),
            FileKind::Mesh => return on_floor::mesh(&path, options.repair),
        }
        let bytes = read_capped(&path)?;
        if let Some(at) = bytes.iter().position(|b| *b == 0) {
            let why = format!("byte {at} of the file is 0, so it is not text; a scene is a UTF-8 text in TOML");
            return Err(SceneError::Format { file: path, why });
        }
        match std::str::from_utf8(&bytes) {
            Ok(text) => SceneFile::parse(text, &path.display().to_string()),
            Err(error) => {
                let byte = error.valid_up_to();
                let line = 1 + bytes[..byte].iter().filter(|&&b| b == b'\n').count();
                Err(SceneError::NotUtf8 { file: path, line, byte })
            }
        }
    }
}

/// Reads a file of at most [`MAX_BYTES`].
fn read_capped(path: &Path) -> Result<Vec<u8>, SceneError> {
    let unread = |source| SceneError::Read { file: path.to_path_buf(), source };
    let file = plain::open_file(path).map_err(unread)?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unread)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(SceneError::TooLarge { file: PathBuf::from(path), limit: MAX_BYTES });
    }
    Ok(bytes)
}
