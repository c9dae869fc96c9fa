//! The scenes that come with tumble, and lookup of a scene by path or name.

use std::path::{Path, PathBuf};

use crate::error::SceneError;
use crate::open::LoadOptions;
use crate::open::format::is_file_name;
use crate::parse::file::{SceneFile, description};
use crate::parse::suggest::{listed, nearest};

/// A scene that is built into the library.
#[derive(Clone, Copy, Debug)]
pub struct Shipped {
    /// The name of its folder under `scenes/`.
    pub name: &'static str,
    /// The whole text of its `scene.toml`.
    pub text: &'static str,
    /// Names and contents of the other files that it reads from its folder.
    pub files: &'static [(&'static str, &'static str)],
}

macro_rules! shipped_file {
    ($name:literal, $file:literal) => {
        include_str!(concat!("../../scenes/", $name, "/", $file))
    };
}

/// Takes names of folders, each with the other files beside its `scene.toml`.
macro_rules! shipped_scenes {
    ($($name:literal $([$($file:literal),*])?),* $(,)?) => {
        &[$(Shipped { name: $name, text: shipped_file!($name, "scene.toml"), files: &[$($(($file, shipped_file!($name, $file))),*)?] }),*]
    };
}

const SHIPPED: &[Shipped] = shipped_scenes![
    "falling",
    "stack",
    "billiards",
    "bowling",
    "incline",
    "pendulum",
    "chain",
    "piston",
    "skeleton",
    "robot"["arm.urdf"],
    "dominoes",
    "newtons_cradle",
    "arch",
    "card_house",
    "wrecking_ball",
    "marble_run",
    "steam_engine",
    "walker",
    "cloth",
    "jelly",
    "sparks",
    "campfire",
    "flock",
    "ball_machine",
    "bird",
    "mechanism"[
        "worm.obj",
        "worm_wheel.obj",
        "pinion.obj",
        "wheel.obj",
        "rack.obj",
        "screw.obj",
        "nut.obj"
    ],
];

/// Returns the scenes that come with tumble.
pub fn shipped() -> &'static [Shipped] {
    SHIPPED
}

impl Shipped {
    /// Returns the line that describes the scene.
    pub fn description(&self) -> String {
        description(self.text)
    }

    /// Reads the scene.
    ///
    /// # Errors
    /// None for the shipped texts; the type is that of [`SceneFile::parse`].
    pub fn read(&self) -> Result<SceneFile, SceneError> {
        SceneFile::parse_with(self.text, &format!("scenes/{}/scene.toml", self.name), self.files)
    }
}

/// The place where a scene was found.
#[derive(Clone, Debug)]
pub enum SceneSource {
    /// A file.
    Path(PathBuf),
    /// Built in.
    Shipped(Shipped),
}

impl SceneSource {
    /// Reads the scene.
    ///
    /// # Errors
    /// As [`SceneFile::load`].
    pub fn load(&self) -> Result<SceneFile, SceneError> {
        self.load_with(&LoadOptions::default())
    }

    /// Reads the scene, a robot or a mesh file with the given options.
    ///
    /// # Errors
    /// As [`SceneFile::load`].
    pub fn load_with(&self, options: &LoadOptions) -> Result<SceneFile, SceneError> {
        match self {
            SceneSource::Path(path) => SceneFile::load_with(path, options),
            SceneSource::Shipped(scene) => scene.read(),
        }
    }
}

/// Finds a scene by path or name. A path is a file (a scene, a URDF or a mesh) or a folder with a
/// `scene.toml`. A name is searched as a folder in each of `search_dirs`, then among the shipped
/// scenes. Text with a separator or with the extension of a scene, robot or mesh is always a path.
///
/// # Errors
/// [`SceneError::Unknown`] for an unknown name; [`SceneError::Read`] for a path that does not
/// exist.
pub fn resolve_scene(name_or_path: &str, search_dirs: &[PathBuf]) -> Result<SceneSource, SceneError> {
    let path = Path::new(name_or_path);
    let like_a_path = name_or_path.contains(['/', '\\']) || is_file_name(path);
    if path.is_file() || path.join("scene.toml").is_file() {
        return Ok(SceneSource::Path(path.to_path_buf()));
    }
    if like_a_path {
        let file = if path.is_dir() { path.join("scene.toml") } else { path.to_path_buf() };
        // The system's reason why it cannot be opened, if there is one.
        let source = std::fs::metadata(&file).err().unwrap_or_else(crate::open::plain::no_regular_file);
        return Err(SceneError::Read { file, source });
    }
    let in_folders = search_dirs.iter().map(|dir| dir.join(name_or_path).join("scene.toml")).find(|p| p.is_file());
    let built_in = || SHIPPED.iter().find(|scene| scene.name == name_or_path);
    in_folders
        .map(SceneSource::Path)
        .or_else(|| built_in().map(|scene| SceneSource::Shipped(*scene)))
        .ok_or_else(|| unknown(name_or_path))
}

fn unknown(name: &str) -> SceneError {
    let names = SHIPPED.iter().map(|scene| scene.name);
    let all = listed(names.clone(), "and");
    let hint = match nearest(name, names) {
        Some(near) => format!("did you mean `{near}`? There are {all}"),
        None => format!("there are {all}; or give the path of a scene.toml"),
    };
    SceneError::Unknown { name: name.to_owned(), hint }
}
