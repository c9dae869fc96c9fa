//! Mesh files: OBJ, STL, PLY and COLLADA, read by their extension and repaired on request.

use std::path::Path;

use tumble_core::collide::{RepairSettings, TriMesh, Vec3, decode_text};

use crate::build::collada;
use crate::open::plain::MAX_FILE_BYTES;

/// Returns the bytes of a mesh file, at most 1 GiB. Pipes and devices, which could block the
/// reader, are an error.
///
/// # Errors
/// A sentence without the file's name.
pub fn read_mesh_bytes(path: &Path) -> Result<Vec<u8>, String> {
    let unread = |error: std::io::Error| format!("cannot be read: {error}");
    let about = std::fs::metadata(path).map_err(unread)?;
    if !about.is_file() {
        return Err("cannot be read: it is not a regular file".into());
    }
    if about.len() > MAX_FILE_BYTES {
        return Err(format!("it has {} bytes; the limit is {MAX_FILE_BYTES}", about.len()));
    }
    std::fs::read(path).map_err(unread)
}

pub(crate) fn read_file(path: &Path) -> Result<TriMesh, String> {
    read_triangles(path, &read_mesh_bytes(path)?)
}

/// Reads OBJ, STL, PLY or COLLADA, chosen by the file's extension. The mesh need not be closed.
///
/// # Errors
/// A sentence without the file's name.
pub fn read_triangles(path: &Path, bytes: &[u8]) -> Result<TriMesh, String> {
    Ok(read_with_lines(path, bytes)?.0)
}

/// As [`read_triangles`], with the line of each triangle if the format has lines.
pub(crate) fn read_with_lines(path: &Path, bytes: &[u8]) -> Result<(TriMesh, Vec<usize>), String> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match extension.as_str() {
        "stl" => Ok((TriMesh::from_stl(bytes).map_err(|e| e.to_string())?, Vec::new())),
        "ply" => Ok((TriMesh::from_ply(bytes).map_err(|e| e.to_string())?, Vec::new())),
        "obj" => {
            let text = decode_text(bytes).map_err(|at| format!("byte {at} of the file is 0; an OBJ file is text"))?;
            TriMesh::from_obj_with_lines(&text).map_err(|e| e.to_string())
        }
        "dae" => {
            let text = std::str::from_utf8(bytes)
                .map_err(|e| format!("byte {} is not UTF-8; a COLLADA file is text", e.valid_up_to()))?;
            Ok((collada::read(text)?, Vec::new()))
        }
        other => Err(format!("the extension is '{other}'; supported are .obj, .stl, .ply and .dae")),
    }
}

/// Reads OBJ, STL, PLY or COLLADA, chosen by the file's extension, as a closed solid
/// ([`TriMesh::check_closed`]). With `repair` the mesh is repaired first ([`TriMesh::repair`]).
/// Also returns a note for each repair and each defect that a user should know.
///
/// # Errors
/// A sentence without the file's name. It names the first wrong triangle, and in an OBJ its line.
pub fn read_solid(
    path: &Path,
    bytes: &[u8],
    repair: Option<&RepairSettings>,
) -> Result<(TriMesh, Vec<String>), String> {
    let (mut mesh, lines) = read_with_lines(path, bytes)?;
    let notes = make_solid(&mut mesh, &lines, repair)?;
    Ok((mesh, notes))
}

pub(crate) fn make_solid(
    mesh: &mut TriMesh,
    lines: &[usize],
    repair: Option<&RepairSettings>,
) -> Result<Vec<String>, String> {
    let notes = match repair {
        Some(settings) => mesh.repair(settings).map(|report| report.notes()),
        None => mesh.check_closed().map(|report| report.notes()),
    };
    notes.map_err(|e| e.at_line(lines).to_string())
}

/// Scales a mesh along each axis. A mirrored mesh keeps its outside.
pub(crate) fn stretched(mut mesh: TriMesh, scale: [f64; 3]) -> TriMesh {
    let scale = Vec3::from(scale);
    mesh.vertices.iter_mut().for_each(|v| v.component_mul_assign(&scale));
    if scale.product() < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    mesh
}
