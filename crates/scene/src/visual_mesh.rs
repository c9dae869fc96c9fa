//! Mesh files that are drawn: each is read by whoever draws it first, and the same content stands in memory once per process.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use tumble_core::VisualMesh;
use tumble_core::collide::TriMesh;

use crate::build::read_triangles;
use crate::link_shapes::{read_mesh_bytes, stretched};

/// BLAKE3 of a file, its extension, and the bits of its scale.
type Content = ([u8; 32], String, [u64; 3]);

/// Meshes that somebody holds.
static KNOWN: Mutex<BTreeMap<Content, Weak<TriMesh>>> = Mutex::new(BTreeMap::new());

/// The mesh of a file, which nobody has read yet.
pub(crate) fn of_file(path: &Path, scale: [f64; 3]) -> VisualMesh {
    let file = path.to_path_buf();
    VisualMesh::read_by(path.display().to_string(), move || read(&file, scale))
}

fn read(path: &Path, scale: [f64; 3]) -> Result<Arc<TriMesh>, String> {
    let bytes = read_mesh_bytes(path)?;
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let content = (*blake3::hash(&bytes).as_bytes(), extension, scale.map(f64::to_bits));
    let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(mesh) = known().get(&content).and_then(Weak::upgrade) {
        return Ok(mesh);
    }
    let mesh = stretched(read_triangles(path, &bytes)?, scale);
    mesh.check_data().map_err(|why| why.to_string())?;
    // corners that faces have in common are smoothed over
    let mesh = Arc::new(mesh.welded());
    let mut known = known();
    known.retain(|_, mesh| mesh.strong_count() > 0);
    known.insert(content, Arc::downgrade(&mesh));
    Ok(mesh)
}
