//! A grid of signed distances in a NumPy file; made a solid if it is small.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_collide::{TriMesh, Vec3};
use tumble_scene::read_grid;

fuzz_target!(|bytes: &[u8]| {
    let Ok(grid) = read_grid(bytes) else { return };
    assert_eq!(grid.values.len(), grid.counts.iter().product::<usize>());
    if grid.values.len() <= 4096
        && let Ok(mut mesh) = TriMesh::isosurface_within(&grid.values, grid.counts, -Vec3::repeat(1.0), Vec3::repeat(1.0))
    {
        let _ = mesh.check_closed();
    }
});
