//! Photographs in folders: one folder for each place of the camera.
//!
//! ```text
//! PHOTOS/VIEW/FACET/*.jpg      the photographs of a projector, in the order of the patterns
//! PHOTOS/VIEW/*.jpg            or those of all projectors, in the order of the cave file
//! ```
//!
//! Files are taken in the order of their names, in which numbers count as such. A view need not have all
//! projectors if it has folders.

use super::{Decoded, Decoder, Pattern, Photo};
use crate::fit::{Mark, View};
use crate::mpcdi::CalibrationError;
use std::path::{Path, PathBuf};
use tumble_scene::cave::{Cave, Facet};

/// Fewer decoded pixels than these are noise.
const LEAST_DECODED: usize = 300;
/// Largest number of files of a folder.
const MAX_FILES: usize = 65536;
/// Largest number of views.
const MAX_VIEWS: usize = 64;

/// Reads and decodes the photographs below a folder. `marks` are points with the names of their views. `said`
/// gets a line for each projector of each view.
///
/// # Errors
/// [`CalibrationError`] with the folder or file: missing or superfluous photographs, other sizes, files that
/// are no pictures, marks of unknown views and beside the photograph.
pub fn photographs(
    folder: &Path,
    cave: &Cave,
    marks: &[(String, Mark)],
    mut said: impl FnMut(&str),
) -> Result<Vec<View>, CalibrationError> {
    let views = sorted(folder, |path| path.is_dir())?;
    if views.is_empty() || views.len() > MAX_VIEWS {
        let reason =
            format!("has {} folders, expected one for each place of the camera, 1 to {MAX_VIEWS}", views.len());
        return Err(CalibrationError::new(folder.display().to_string(), reason));
    }
    let names: Vec<String> = views.iter().map(|path| name(path)).collect();
    if let Some((stray, _)) = marks.iter().find(|(view, _)| !names.contains(view)) {
        let reason =
            format!("a mark is in view \"{stray}\"; expected a folder of {}: {}", folder.display(), names.join(", "));
        return Err(CalibrationError::new("the marks", reason));
    }
    let mut out = Vec::new();
    for (path, name) in views.iter().zip(names) {
        let decoded = view(path, cave, &mut said)?;
        let Some(size_px) = decoded.iter().flatten().map(|d| d.size_px).next() else {
            return Err(CalibrationError::new(
                path.display().to_string(),
                "none of its photographs shows a projector: too dark, clipped, or not the patterns in their order?",
            ));
        };
        let marks: Vec<Mark> = marks.iter().filter(|(view, _)| *view == name).map(|(_, mark)| mark.clone()).collect();
        for mark in &marks {
            if (0..2).any(|k| !(0.0..=f64::from(size_px[k])).contains(&mark.pixel[k])) {
                let reason = format!("the mark {:?} m has the pixel {:?} of {size_px:?}", mark.point_m, mark.pixel);
                return Err(CalibrationError::new(path.display().to_string(), reason));
            }
        }
        out.push(View { name, size_px, marks, decoded });
    }
    Ok(out)
}

/// Decodes the photographs of one view, by facet.
fn view(path: &Path, cave: &Cave, said: &mut impl FnMut(&str)) -> Result<Vec<Option<Decoded>>, CalibrationError> {
    let mut out = Vec::new();
    let mut flat = sorted(path, is_picture)?;
    let wanted: usize = cave.facets.iter().map(|f| Pattern::sequence(f.size_px).len()).sum();
    if !flat.is_empty() && flat.len() != wanted {
        return Err(CalibrationError::new(
            path.display().to_string(),
            format!(
                "has {} photographs, expected {wanted}: the patterns of {} projectors in their order",
                flat.len(),
                cave.facets.len()
            ),
        ));
    }
    for facet in &cave.facets {
        let count = Pattern::sequence(facet.size_px).len();
        let folder = path.join(&facet.name);
        let files = match (flat.is_empty(), folder.is_dir()) {
            (false, _) => flat.drain(..count).collect(),
            (true, true) => sorted(&folder, is_picture)?,
            (true, false) => Vec::new(),
        };
        if files.is_empty() {
            out.push(None);
            continue;
        }
        if files.len() != count {
            let reason =
                format!("has {} photographs, expected {count}, one for each pattern in their order", files.len());
            return Err(CalibrationError::new(folder.display().to_string(), reason));
        }
        let decoded = sequence(facet, &files)?;
        let pixels = decoded.size_px[0] as usize * decoded.size_px[1] as usize;
        said(&format!(
            "{}: \"{}\" lights {} of {pixels} pixels (refused: {} dark, {} clipped, {} without fine stripes, {} contradictory)",
            path.display(),
            facet.name,
            decoded.count(),
            decoded.refused.dark,
            decoded.refused.clipped,
            decoded.refused.indirect,
            decoded.refused.unsure
        ));
        out.push(Some(decoded).filter(|decoded| decoded.count() >= LEAST_DECODED));
    }
    Ok(out)
}

fn sequence(facet: &Facet, files: &[PathBuf]) -> Result<Decoded, CalibrationError> {
    let mut decoder = Decoder::new(facet.size_px);
    for file in files {
        let fail = |reason: String| CalibrationError::new(file.display().to_string(), reason);
        let photo = Photo::load(file).map_err(fail)?;
        decoder.add(photo).map_err(fail)?;
    }
    decoder.finish().map_err(|reason| CalibrationError::new(format!("facet \"{}\"", facet.name), reason))
}

fn name(path: &Path) -> String {
    path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned())
}

fn is_picture(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    path.is_file() && ending.is_some_and(|e| ["png", "jpg", "jpeg"].contains(&e.as_str()))
}

/// Returns the entries of a folder that are wanted and not hidden, in the order of their names.
fn sorted(folder: &Path, wanted: impl Fn(&Path) -> bool) -> Result<Vec<PathBuf>, CalibrationError> {
    let fail = |reason: String| CalibrationError::new(folder.display().to_string(), reason);
    let entries = std::fs::read_dir(folder).map_err(|e| fail(format!("cannot be read: {e}")))?;
    let mut out = Vec::new();
    for entry in entries {
        let path = entry.map_err(|e| fail(format!("cannot be read: {e}")))?.path();
        if !name(&path).starts_with('.') && wanted(&path) {
            out.push(path);
        }
        if out.len() > MAX_FILES {
            return Err(fail(format!("has more than {MAX_FILES} files")));
        }
    }
    out.sort_by_cached_key(|path| order(&name(path)));
    Ok(out)
}

/// Returns a text that sorts as the name with its numbers by value: `2.png` before `10.png`.
fn order(name: &str) -> String {
    let mut out = String::new();
    let mut digits = String::new();
    for c in name.chars().chain([' ']) {
        if c.is_ascii_digit() {
            digits.push(c);
        } else {
            if !digits.is_empty() {
                out += &format!("{:0>20}", digits.trim_start_matches('0'));
                digits.clear();
            }
            out.push(c);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = ["IMG_10000.JPG", "IMG_9999.JPG", "IMG_007.JPG", "IMG_8.JPG"];
        names.sort_by_cached_key(|name| super::order(name));
        assert_eq!(names, ["IMG_007.JPG", "IMG_8.JPG", "IMG_9999.JPG", "IMG_10000.JPG"]);
    }
}
