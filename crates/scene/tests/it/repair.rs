//! `repair` of `[meshes.NAME]`: a mesh that is an error without it becomes a solid, with a note.

use tumble_collide::RepairSettings;
use tumble_scene::{SceneFile, read_solid};

/// A box of 1 m × 2 m × 3 m in millimeters, whose top (the last line) is missing.
const OPEN: &str = "# an open box\nv 0 0 0\nv 1000 0 0\nv 1000 2000 0\nv 0 2000 0\nv 0 0 3000\nv 1000 0 3000\nv 1000 2000 3000\nv 0 2000 3000\n\
                    f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

fn scene(repair: &str) -> (std::path::PathBuf, SceneFile) {
    let folder = std::env::temp_dir().join(format!("tumble-repair-{}-{}", std::process::id(), repair.len()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("open.obj"), OPEN).unwrap();
    let toml = format!(
        "[meshes.crate]\ntype = \"file\"\nfile = \"open.obj\"\nscale = 0.001\n{repair}[[body]]\nname = \"b\"\nshape = {{ type = \"mesh\", mesh = \"crate\" }}\ndensity_kg_per_m3 = 2\n"
    );
    std::fs::write(folder.join("scene.toml"), toml).unwrap();
    let scene = SceneFile::load(folder.join("scene.toml")).unwrap();
    (folder, scene)
}

#[test]
fn open_mesh_is_an_error_that_names_the_line_or_is_closed_on_request() {
    let (folder, strict) = scene("");
    let error = strict.build().err().unwrap().to_string();
    // the first face at the hole is the second of five, `f 1 2 6 5`, whose second triangle has the
    // open edge
    assert!(error.contains("open.obj") && error.contains("line 11: the mesh is open: 4 edges"), "{error}");
    let _ = std::fs::remove_dir_all(folder);

    let (folder, mended) = scene("repair = true\n");
    let (world, notes) = mended.build().unwrap();
    assert!(
        notes.iter().any(|n| n.contains("mesh \"crate\": 1 hole(s) were filled with 2 faces; the longest has 4 edges")),
        "{notes:?}"
    );
    let body = world.get::<tumble_core::RigidBody>(world.find("b").unwrap()).unwrap();
    assert!((body.mass() - 12.0).abs() < 1e-9, "{}", body.mass());
    let _ = std::fs::remove_dir_all(folder);
}

#[test]
fn solids_are_read_with_notes_or_refused_with_the_line() {
    let path = std::path::Path::new("open.obj");
    let (mesh, notes) = read_solid(path, OPEN.as_bytes(), Some(&RepairSettings::default())).unwrap();
    assert_eq!((mesh.triangles.len(), notes.len()), (12, 1));
    assert!(read_solid(path, OPEN.as_bytes(), None).unwrap_err().starts_with("line 11: "));
    let few = RepairSettings { hole_edges: 3, ..RepairSettings::default() };
    let error = read_solid(path, OPEN.as_bytes(), Some(&few)).unwrap_err();
    assert!(
        error.starts_with("line 11: ") && error.ends_with("its longest hole has 4 edges; at most 3 are filled"),
        "{error}"
    );
}
