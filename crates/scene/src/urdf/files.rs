//! Finds the meshes of a URDF.

use std::path::{Path, PathBuf};

use super::options::UrdfOptions;

/// Number of folders above a URDF that are searched for its packages.
const MAX_FOLDERS: usize = 32;

/// The result of a search.
pub(crate) enum Found {
    Here(PathBuf),
    /// No file at these places.
    Missing(String),
    /// A format that is not supported.
    Format(String),
}

/// Finds the file that `uri` names in a URDF in `folder`. `package://NAME/path` and
/// `model://NAME/path` are searched in the folder given for NAME, else in a folder NAME that
/// contains the URDF or lies beside a folder that does. `file://path` is absolute; any other path
/// is relative to the folder of the URDF.
pub(crate) fn find(uri: &str, folder: &Path, options: &UrdfOptions) -> Found {
    let places = places(uri.trim(), folder, options);
    let extension = Path::new(uri.trim()).extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match places.iter().find(|place| place.is_file()) {
        _ if !["stl", "obj", "ply", "dae"].contains(&extension.as_str()) => Found::Format(extension),
        Some(place) => Found::Here(place.clone()),
        None => Found::Missing(places.first().map_or_else(|| uri.to_owned(), |place| place.display().to_string())),
    }
}

/// Returns the places where the file may be, best first.
fn places(uri: &str, folder: &Path, options: &UrdfOptions) -> Vec<PathBuf> {
    let package = uri.strip_prefix("package://").or_else(|| uri.strip_prefix("model://"));
    if let Some(package) = package {
        let (name, rest) = package.split_once('/').unwrap_or((package, ""));
        return packages(name, folder, options).into_iter().map(|dir| dir.join(rest)).collect();
    }
    let path = uri.strip_prefix("file://").unwrap_or(uri);
    vec![folder.join(path)]
}

/// Returns the folders that may be the package of that name.
fn packages(name: &str, folder: &Path, options: &UrdfOptions) -> Vec<PathBuf> {
    if let Some(dir) = options.packages.get(name) {
        return vec![dir.clone()];
    }
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    let above = || whole.ancestors().take(MAX_FOLDERS);
    let itself = above().filter(|dir| dir.file_name().is_some_and(|last| last == name)).map(Path::to_path_buf);
    itself.chain(above().map(|dir| dir.join(name)).filter(|dir| dir.is_dir())).collect()
}
