//! The text of a scene with meshes, from files and generated, height fields, grids and images: parsed in a folder with
//! such files; if it is small and names no others, built. With TUMBLE_CACHE=off, so that no tree of it is kept, it is
//! built whole and stepped once.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tumble_scene::{MeshSource, MeshSpec, SceneFile};

const OBJ: &str = "v 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0 0 0.2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
                   property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0.1\n0 1 0\n1 1 0.2\n3 0 1 2\n3 1 3 2\n";

/// Returns a folder with the files, written once.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("tumble-fuzz-scene-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a temporary folder");
        let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("a temporary file");
        write("solid.obj", OBJ.as_bytes());
        write("sheet.ply", PLY.as_bytes());
        write("solid.stl", include_bytes!("../seeds/stl/text.stl"));
        write("solid.dae", include_bytes!("../seeds/collada/cube.dae"));
        write("map.png", include_bytes!("../seeds/heights/image"));
        write("map.txt", include_bytes!("../seeds/heights/text"));
        write("grid.npy", include_bytes!("../seeds/npy/ball_f8"));
        folder
    })
}

/// Returns the name of the scene, in the folder.
pub fn file() -> String {
    folder().join("fuzz.toml").display().to_string()
}

/// Whether a mesh is quickly built from files of the folder.
fn is_small(mesh: &MeshSpec) -> bool {
    let known = mesh.source.file().is_none_or(|file| file.parent() == Some(folder()));
    let few = match &mesh.source {
        MeshSource::Lathe { profile_m, segments, .. } => profile_m.len() * *segments as usize <= 2000,
        MeshSource::Torus { segments, tube_segments, .. } => u64::from(*segments) * u64::from(*tube_segments) <= 1000,
        MeshSource::Icosphere { subdivisions, .. } => *subdivisions <= 3,
        MeshSource::Cylinder { segments, .. } | MeshSource::Capsule { segments, .. } => *segments <= 32,
        _ => true,
    };
    known
        && few
        && mesh.sphere_tree_depth.is_none_or(|depth| depth <= 3)
        && mesh.sphere_tree_max_error.is_none_or(|error| error >= 0.01)
}

fuzz_target!(|text: &str| {
    match SceneFile::parse(text, &file()) {
        Err(error) => assert!(!error.report(false).is_empty()),
        Ok(scene) if scene.bodies.len() <= 20 && scene.meshes.iter().all(is_small) => {
            if std::env::var_os("TUMBLE_CACHE").is_some_and(|value| value == "off") {
                if let Ok((mut world, _)) = scene.build() {
                    let _ = world.step();
                }
            } else {
                let _ = scene.build_drawn();
            }
        }
        Ok(_) => {}
    }
});
