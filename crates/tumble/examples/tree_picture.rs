//! Draws the picture of the documentation: a mesh with levels 1 to 3 of its tree, a row per method.

use std::error::Error;
use tumble::collide::{Builder, SphereTree, TreeCache, TreeSettings, TriMesh};
use tumble::render::{Image, Renderer, UpAxis, tree_over_mesh};

/// Pixels of a tile's side.
const TILE: u32 = 400;
const METHODS: [Builder; 4] = [Builder::Octree, Builder::Grid, Builder::Hubbard, Builder::Medial];
const LEVELS: [u32; 3] = [1, 2, 3];

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(mesh), Some(picture)) = (words.next(), words.next()) else {
        return Err("expected MESH.obj PICTURE.png".into());
    };
    let mut mesh = TriMesh::from_obj(&std::fs::read_to_string(mesh)?)?;
    mesh.check_closed()?;
    let mut renderer = Renderer::new()?;
    let (width, height) = (TILE * LEVELS.len() as u32, TILE * METHODS.len() as u32);
    let mut whole = Image { width, height, rgba: vec![255; 4 * (width * height) as usize] };
    for (row, builder) in METHODS.into_iter().enumerate() {
        let settings = TreeSettings { builder, depth: 3, branch: 8, error: 1e-3, even: false };
        let tree = SphereTree::build_cached(&mesh, &settings, &TreeCache::of_environment())?.tree;
        for (column, level) in LEVELS.into_iter().enumerate() {
            let tile = renderer.render(&tree_over_mesh(&mesh, &tree, level, UpAxis::Y)?, TILE, TILE)?;
            println!("{builder:?} level {level}: {} balls", tree.at_level(level).count());
            put(&tile, &mut whole, column as u32 * TILE, row as u32 * TILE);
        }
    }
    whole.write_png(picture)?;
    Ok(())
}

/// Copies a tile's rows to `(x, y)`.
fn put(tile: &Image, whole: &mut Image, x: u32, y: u32) {
    for (n, row) in tile.rgba.chunks_exact(4 * tile.width as usize).enumerate() {
        let start = 4 * ((y as usize + n) * whole.width as usize + x as usize);
        whole.rgba[start..start + row.len()].copy_from_slice(row);
    }
}
