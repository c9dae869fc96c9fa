//! An STL mesh, text or binary: read, checked, and where it is closed and small, measured.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_collide::TriMesh;

fuzz_target!(|bytes: &[u8]| {
    let Ok(mut mesh) = TriMesh::from_stl(bytes) else { return };
    if mesh.triangles.len() <= 2000 && mesh.check_closed().is_ok() {
        let _ = mesh.mass_properties(1.0);
    }
});
