//! A file of heights: a PNG, and a text; made a solid if it is small.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use tumble_collide::TriMesh;
use tumble_scene::read_heights;

fuzz_target!(|bytes: &[u8]| {
    for name in ["map.png", "map.txt"] {
        let Ok(grid) = read_heights(Path::new(name), bytes, [-1.0, 2.0]) else { continue };
        if grid.heights_m.len() <= 4096
            && let Ok(mut mesh) = TriMesh::height_field(&grid.heights_m, grid.columns, [3.0, 2.0], None)
        {
            let _ = mesh.check_closed();
        }
    }
});
