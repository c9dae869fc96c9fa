//! `tumble spheretree --screenshot`: draws a level of the tree over its mesh and writes the
//! picture.

use crate::args::SphereTreeOptions;
use crate::capture::{open_renderer, write_png};
use crate::failure::Failure;
use std::path::Path;
use tumble::collide::{SphereTree, TriMesh};
use tumble::render::{RenderError, UpAxis, tree_over_mesh};

/// Draws the level and writes it to `path`. Without a graphics adapter it prints a note and writes
/// nothing.
pub fn picture(mesh: &TriMesh, tree: &SphereTree, path: &Path, options: &SphereTreeOptions) -> Result<(), Failure> {
    let last = tree.levels() - 1;
    let level = options.level.unwrap_or(last);
    if level > last {
        return Err(Failure::input(format!("--level is {level}; the tree has levels 0 to {last}")));
    }
    let failed = |e: RenderError| Failure::run("the picture", e);
    let up = match options.up.as_str() {
        "x" => UpAxis::X,
        "y" => UpAxis::Y,
        _ => UpAxis::Z,
    };
    let list = tree_over_mesh(mesh, tree, level, up).map_err(failed)?;
    let Some(mut renderer) = open_renderer()? else { return Ok(()) };
    let image = renderer.render(&list, options.size.0, options.size.1).map_err(failed)?;
    write_png(&image, path)?;
    super::say(options, "picture", path);
    Ok(())
}
