//! An OBJ mesh: read, checked, repaired, its hull, the solid below it and the one behind it; if the result is a small solid, measured.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_collide::{MeshDistance, RepairSettings, TriMesh};

fuzz_target!(|text: &str| {
    let Ok(mut mesh) = TriMesh::from_obj(text) else { return };
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
    if let Ok(mut hull) = mesh.convex_hull() {
        assert!(hull.check_closed().is_ok(), "a hull is a solid");
    }
    if let Ok(mut solid) = mesh.terrain(None) {
        let _ = solid.check_closed();
    }
    for centered in [false, true] {
        if let Ok(mut walls) = mesh.thickened(None, centered) {
            let _ = walls.check_closed();
        }
    }
    if mesh.check_closed().is_ok() {
        let _ = mesh.mass_properties(1.0);
    }
});
