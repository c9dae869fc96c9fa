//! Reads models as scenes and as single articulated bodies.

use std::path::Path;

use tumble_core::articulated::ArticulatedBody;

use super::error::MjcfError;
use super::options::MjcfOptions;
use super::source::{Texts, join};
use super::{Reader, scene};
use crate::build::articulated;
use crate::build::shapes::{Purpose, ShapeMaker};
use crate::notes::Notes;
use crate::parse::articulated::ArticulatedSpec;
use crate::parse::file::SceneFile;
use crate::parse::pair::PairSideSpec;

/// Reads a model of MuJoCo as a scene. [`SceneFile::notes`] says what is left out, each with file,
/// line and element.
///
/// # Errors
/// [`MjcfError`]: a file cannot be read, or has problems. All problems are reported at once, with
/// file, line and column.
pub fn load(path: impl AsRef<Path>, options: &MjcfOptions) -> Result<SceneFile, MjcfError> {
    let path = path.as_ref();
    read(&Texts::of_file(path)?, path, options, true)
}

/// As [`load`], from a text; `file_name` is shown in errors. No file is opened: `<include>` is a
/// problem, and meshes in files are left out.
///
/// # Errors
/// As [`load`], except those of files.
pub fn parse(text: &str, file_name: &str, options: &MjcfOptions) -> Result<SceneFile, MjcfError> {
    let path = Path::new(file_name);
    read(&Texts::alone(text.to_owned(), path)?, path, options, false)
}

fn read(texts: &Texts, path: &Path, options: &MjcfOptions, files: bool) -> Result<SceneFile, MjcfError> {
    let logs = texts.logs();
    let documents = texts.documents(&logs);
    let folder = path.parent().unwrap_or(Path::new(""));
    let is_good = || logs.iter().all(|log| log.count() == 0);
    let scene = join(texts, &logs, &documents).filter(|_| is_good()).and_then(|root| {
        let reader = Reader::new(&root, folder, options, files);
        scene::read(&root, path, &reader, &logs)
    });
    match scene {
        Some(scene) => Ok(scene),
        None => {
            let problems = logs.into_iter().map(crate::parse::log::Log::into_problems).collect();
            Err(texts.invalid(problems))
        }
    }
}

/// Reads the only articulated body of a model, with its shapes, at the place that it has in the
/// model. Also returns notes about the file, and about the rest of the model, which is left out.
///
/// # Errors
/// As [`load`]; [`MjcfError::Bodies`] if the model has none or several.
pub fn articulation(
    path: impl AsRef<Path>,
    options: &MjcfOptions,
) -> Result<(ArticulatedBody, Vec<String>, Notes), MjcfError> {
    let path = path.as_ref();
    let (spec, notes) = one_body(path, options)?;
    let mut maker = ShapeMaker::new(&[], Purpose::Stepped);
    let wrong = |why: String| MjcfError::Body { why: format!("{}: {why}", path.display()) };
    let body = articulated::body(&spec, &mut maker).map_err(wrong)?;
    let joints = articulated::moving_joints(&spec.links);
    Ok((body, joints, notes.into_iter().chain(maker.notes.take()).collect()))
}

/// Reads the only articulated body of a model.
pub(crate) fn one_body(path: &Path, options: &MjcfOptions) -> Result<(ArticulatedSpec, Notes), MjcfError> {
    let mut scene = load(path, options)?;
    if scene.articulated.len() != 1 {
        let names = scene.articulated.iter().map(|spec| spec.name.clone()).collect();
        return Err(MjcfError::Bodies { file: path.to_path_buf(), count: scene.articulated.len(), names });
    }
    let mut spec = scene.articulated.remove(0);
    // the material of geoms without friction is one of the model, not of the scene that takes the body
    let shapes = spec.links.iter_mut().flat_map(|link| &mut link.shapes);
    for surface in shapes.map(|shape| &mut shape.surface).filter(|surface| surface.material.is_some()) {
        surface.material = None;
        surface.contact.friction = 0.0;
    }
    let mut notes = std::mem::take(&mut scene.notes);
    let others = [
        (scene.bodies.len(), "static and rigid bodies"),
        (scene.loop_joints.len(), "loop joints"),
        (scene.mimics.len(), "couplings of joints"),
        (scene.pairs.iter().filter(|pair| !matches!(pair.sides[0], PairSideSpec::Material(_))).count(), "pairs"),
    ];
    for (count, what) in others.into_iter().filter(|(count, _)| *count > 0) {
        notes.push(format!(
            "{}: {count} {what} of the model are left out; the whole model is read as a scene",
            path.display()
        ));
    }
    Ok((spec, notes))
}
