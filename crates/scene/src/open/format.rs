//! File formats by extension.

use std::path::Path;

/// Extensions of supported mesh formats.
const MESHES: [&str; 4] = ["obj", "stl", "ply", "dae"];
/// Extensions of mesh formats that are not supported.
const OTHER_MESHES: [&str; 24] = [
    "off", "glb", "gltf", "fbx", "3ds", "3mf", "amf", "blend", "usd", "usda", "usdc", "usdz", "wrl", "x3d", "step",
    "stp", "iges", "igs", "brep", "vtk", "vtp", "msh", "lwo", "ctm",
];
/// Extensions of models of MuJoCo.
const MODELS: [&str; 2] = ["xml", "mjcf"];

/// Returns the extension of a path in lower case; empty if it has none.
pub(crate) fn extension(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase()
}

/// The kind of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A scene or a cave, and any file whose extension is not known.
    Scene,
    /// A robot.
    Urdf,
    /// A model of MuJoCo.
    Mjcf,
    /// A model or world of Gazebo.
    Sdformat,
    /// A mesh of a supported format.
    Mesh,
}

impl FileKind {
    /// Returns the kind of a file by its extension.
    ///
    /// # Errors
    /// The extension names a known format that is not supported: a sentence without the file's
    /// name.
    pub fn of(path: &Path) -> Result<FileKind, String> {
        let own = extension(path);
        match own.as_str() {
            "urdf" => Ok(FileKind::Urdf),
            "sdf" => Ok(FileKind::Sdformat),
            e if MODELS.contains(&e) => Ok(FileKind::Mjcf),
            e if MESHES.contains(&e) => Ok(FileKind::Mesh),
            e if OTHER_MESHES.contains(&e) => Err(format!(
                "the mesh format .{e} is not supported; convert the file to .obj, .stl, .ply or .dae, for example with Blender or MeshLab"
            )),
            "xacro" => {
                Err("macros of .xacro are not supported; expand them first: xacro NAME.xacro > NAME.urdf".into())
            }
            _ => Ok(FileKind::Scene),
        }
    }
}

/// Returns whether a name has the extension of a scene, robot or mesh format, supported or not.
pub(crate) fn is_file_name(path: &Path) -> bool {
    let own = extension(path);
    ["toml", "urdf", "sdf", "xacro"]
        .iter()
        .chain(&MODELS)
        .chain(&MESHES)
        .chain(&OTHER_MESHES)
        .any(|known| own == *known)
}
