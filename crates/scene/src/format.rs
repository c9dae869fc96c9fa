//! What a file is, by the extension of its name.

use std::path::Path;

/// Extensions of meshes.
const MESHES: [&str; 4] = ["obj", "stl", "ply", "dae"];
/// Extensions of meshes that are not read.
const OTHER_MESHES: [&str; 24] = [
    "off", "glb", "gltf", "fbx", "3ds", "3mf", "amf", "blend", "usd", "usda", "usdc", "usdz", "wrl", "x3d", "step",
    "stp", "iges", "igs", "brep", "vtk", "vtp", "msh", "lwo", "ctm",
];
/// Extensions of robots that are not read.
const OTHER_ROBOTS: [&str; 3] = ["sdf", "mjcf", "xml"];

/// The extension of a path in small letters; empty where it has none.
pub(crate) fn extension(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase()
}

/// What is in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A scene; also a cave, and whatever has no extension that is known.
    Scene,
    /// A robot.
    Urdf,
    /// A mesh of a format that is read.
    Mesh,
}

impl FileKind {
    /// By the extension of the name.
    ///
    /// # Errors
    /// The extension names a format that is known and not read: a sentence without the file's name.
    pub fn of(path: &Path) -> Result<FileKind, String> {
        let own = extension(path);
        match own.as_str() {
            "urdf" => Ok(FileKind::Urdf),
            e if MESHES.contains(&e) => Ok(FileKind::Mesh),
            e if OTHER_MESHES.contains(&e) => Err(format!(
                "meshes are read from OBJ, STL, PLY and COLLADA (.obj, .stl, .ply, .dae); .{e} is not one of them; convert the file, as Blender and MeshLab do"
            )),
            e if OTHER_ROBOTS.contains(&e) => {
                Err(format!("robots are read from URDF (.urdf); .{e} is not read; convert the file"))
            }
            "xacro" => {
                Err("robots are read from URDF (.urdf); expand the macros first: xacro NAME.xacro > NAME.urdf".into())
            }
            _ => Ok(FileKind::Scene),
        }
    }
}

/// Whether a name has an extension by which files of scenes, robots and meshes are known, read or not.
pub(crate) fn is_file_name(path: &Path) -> bool {
    let own = extension(path);
    ["toml", "urdf", "xacro"].iter().chain(&MESHES).chain(&OTHER_MESHES).chain(&OTHER_ROBOTS).any(|known| own == *known)
}
