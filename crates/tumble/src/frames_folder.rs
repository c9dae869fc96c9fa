//! Folders of `--frames-dir` and `--log-dir`: that of `tumble run`, or one per facet of a cave with
//! the facet's pictures and `frames.jsonl`. A run begins with an empty place or refuses, so that no file of an earlier run
//! is taken for one of this run.

use crate::failure::Failure;
use std::path::{Path, PathBuf};

/// Name of the list of frames in a facet's folder.
pub const LIST: &str = "frames.jsonl";
/// Ending of a picture that is being written.
const UNFINISHED: &str = ".unfinished";

/// Returns a facet's folder. A name may contain dots, and none leads out of `folder`.
pub fn facet_folder(folder: &Path, name: &str) -> PathBuf {
    folder.join(if name.starts_with('.') { format!("_{name}") } else { name.to_owned() })
}

/// Returns the path of a picture, and where it is written until it is whole.
pub fn picture_paths(folder: &Path, frame: u64) -> [PathBuf; 2] {
    let name = format!("frame_{frame:06}.png");
    [folder.join(&name), folder.join(format!(".{name}{UNFINISHED}"))]
}

/// Returns whether a file's name is one that a facet or a run gives: the list, a picture, or an unfinished
/// picture.
fn is_facets(name: &str) -> bool {
    let whole = name.strip_suffix(UNFINISHED).and_then(|name| name.strip_prefix('.')).unwrap_or(name);
    let number = whole.strip_prefix("frame_").and_then(|n| n.strip_suffix(".png"));
    name == LIST || number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
}

/// Returns the files in `folder` that a facet has written.
fn files_of_a_facet(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|e| e.file_name().to_str().is_some_and(is_facets)).map(|e| e.path()).collect()
}

/// Makes a facet's folder ready for a run: it has no file of an earlier run afterwards. With
/// `overwrite` such files are removed.
///
/// # Errors
/// There is a file of an earlier run, or one cannot be removed.
pub fn begin(folder: &Path, overwrite: bool) -> Result<(), Failure> {
    let earlier = files_of_a_facet(folder);
    match earlier.first() {
        Some(first) if !overwrite => Err(Failure::input(format!(
            "{} is of an earlier run; choose another folder, or remove the earlier frames with --overwrite",
            first.display()
        ))),
        _ => earlier.iter().try_for_each(|path| {
            // the list is emptied when it is opened: it may be a link to another place
            if path.file_name().is_some_and(|name| name == LIST) {
                return Ok(());
            }
            std::fs::remove_file(path)
                .map_err(|e| Failure::input(format!("{}: cannot be removed: {e}", path.display())))
        }),
    }
}

/// Makes the folder of a whole run ready, as [`begin`] does for each facet's folder in it. Folders
/// of facets that this cave does not have count too.
///
/// # Errors
/// Those of [`begin`].
pub fn begin_all(folder: &Path, overwrite: bool) -> Result<(), Failure> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = entries.map(|e| e.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders.iter().try_for_each(|folder| begin_without_list(folder, overwrite))
}

/// Makes a folder ready for a run that writes no list there, as [`begin`] does.
///
/// # Errors
/// Those of [`begin`].
pub fn begin_without_list(folder: &Path, overwrite: bool) -> Result<(), Failure> {
    begin(folder, overwrite)?;
    let list = folder.join(LIST);
    if overwrite && list.symlink_metadata().is_ok_and(|about| about.is_file()) {
        std::fs::remove_file(&list)
            .map_err(|e| Failure::input(format!("{}: cannot be removed: {e}", list.display())))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_facets_own_files_are_of_an_earlier_run() {
        for name in ["frames.jsonl", "frame_000000.png", "frame_1234567.png", ".frame_000002.png.unfinished"] {
            assert!(is_facets(name), "{name}");
        }
        for name in ["frames.json", "frame_.png", "frame_12a.png", "notes.txt", "frame_000000.png.bak", ".frame_1.png"]
        {
            assert!(!is_facets(name), "{name}");
        }
    }
}
