//! A level of a tree over its mesh (thesis Fig. 16).

use crate::args::SphereTreeOptions;
use crate::failure::Failure;
use std::path::Path;
use tumble::collide::{SphereTree, TriMesh};
use tumble::render::{RenderError, Renderer, UpAxis, tree_over_mesh};
use tumble::whole::write_whole;

/// Draws and writes. Without a graphics adapter all else still counts, and the message says what brings one.
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
    let image = match Renderer::new() {
        Ok(mut renderer) => renderer.render(&list, options.size.0, options.size.1).map_err(failed)?,
        Err(error @ RenderError::NoAdapter { .. }) => {
            eprintln!("no picture: {error}");
            return Ok(());
        }
        Err(error) => return Err(failed(error)),
    };
    write_whole(path, |path| image.write_png(path).map_err(std::io::Error::other))
        .map_err(|e| Failure::run(&format!("writing {}", path.display()), e))?;
    super::say(options, "picture", path);
    Ok(())
}
