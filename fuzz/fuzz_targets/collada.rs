//! A COLLADA document: refused, or triangles in proportion to its length; if they are few, checked and repaired.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use tumble_core::collide::RepairSettings;
use tumble_scene::read_triangles;

fuzz_target!(|bytes: &[u8]| {
    let mut mesh = match read_triangles(Path::new("fuzz.dae"), bytes) {
        Err(why) => return assert!(!why.is_empty()),
        Ok(mesh) => mesh,
    };
    assert!(mesh.triangles.len().max(mesh.vertices.len()) <= 1_000_000 + 10 * bytes.len());
    if mesh.triangles.len() <= 2000 && mesh.check_data().is_ok() {
        let mut mended = mesh.clone();
        if mended.repair(&RepairSettings::default()).is_ok() {
            let again = mended.check_closed();
            assert!(again.is_ok(), "what comes out of repair is a solid: {again:?}");
        }
        if mesh.check_closed().is_ok() {
            let _ = mesh.mass_properties(1.0);
        }
    }
});
