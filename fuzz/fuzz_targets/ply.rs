//! A PLY mesh, text or binary: read, no larger than its file, checked, repaired, thickened.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_collide::{MeshDistance, RepairSettings, TriMesh};

fuzz_target!(|bytes: &[u8]| {
    let Ok(mut mesh) = TriMesh::from_ply(bytes) else { return };
    assert!(mesh.vertices.len() <= bytes.len() && mesh.triangles.len() <= bytes.len());
    if mesh.triangles.len() > 2000 {
        return;
    }
    let mut mended = mesh.clone();
    if mended.repair(&RepairSettings::default()).is_ok() {
        let again = mended.check_closed();
        assert!(again.is_ok(), "what comes out of repair is a solid: {again:?}");
        let _ = mended.union_mass_properties(1.0);
        let _ = MeshDistance::new(&mended).closest(&mended.vertices[0]);
    }
    if let Ok(mut walls) = mesh.thickened(None, true) {
        let _ = walls.check_closed();
    }
    if mesh.check_closed().is_ok() {
        let _ = mesh.mass_properties(1.0);
    }
});
