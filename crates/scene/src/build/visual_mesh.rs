//! Visual mesh files. Each is read when it is first drawn, and equal content is in memory once per
//! process.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use tumble_core::VisualMesh;
use tumble_core::collide::TriMesh;

use crate::build::mesh_files::{read_mesh_bytes, read_triangles, stretched};

/// BLAKE3 of a file, its extension, and the bits of its scale.
type ContentKey = ([u8; 32], String, [u64; 3]);

/// Meshes in use.
static KNOWN: Mutex<BTreeMap<ContentKey, Weak<TriMesh>>> = Mutex::new(BTreeMap::new());

/// Returns the mesh of a file, which is not read yet.
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
    // Smooths over corners that faces share.
    let mesh = Arc::new(mesh.welded());
    let mut known = known();
    known.retain(|_, mesh| mesh.strong_count() > 0);
    known.insert(content, Arc::downgrade(&mesh));
    Ok(mesh)
}
