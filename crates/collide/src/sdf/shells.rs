//! A mesh of several overlapping shells, shell by shell.
//!
//! ```text
//! d_U(p) = min over the shells i of d_i(p)      outside the union exact, inside it at least the depth
//! ```
//!
//! From outside, the closest point of the union is the closest point of one of its shells. So each
//! shell has elements and a field of its own, and contacts at places inside another shell are
//! ignored. A shell that lies completely inside another one is left out.

use super::{DistanceField, Surface};
use crate::mesh::{crossing_shells, edge_groups, shells};
use crate::{SphereTree, TriMesh, Vec3};

/// Maximum number of shells; meshes with more collide by spheres.
const MAX_SHELLS: usize = 32;

/// Returns the surfaces of the overlapping shells of a closed mesh; `None` if a shell crosses
/// itself or is a cavity, or if there are too many.
pub(crate) fn shell_surfaces(mesh: &TriMesh, tree: &SphereTree) -> Option<Vec<Surface>> {
    let (shell, count) = shells(mesh, &edge_groups(mesh));
    let crossings = crossing_shells(mesh, &shell)?;
    if !(2..=MAX_SHELLS).contains(&count) || crossings.iter().any(|(a, b)| a == b) {
        return None;
    }
    let faces = |n: u32| mesh.triangles.iter().zip(&shell).filter(move |(_, s)| **s == n).map(|(t, _)| *t).collect();
    let meshes: Vec<TriMesh> = (0..count as u32)
        .map(|n| TriMesh { vertices: mesh.vertices.clone(), triangles: faces(n) }.compacted())
        .collect();
    if meshes.iter().any(|part| part.signed_volume() <= 0.0) {
        return None;
    }
    let all: Vec<Surface> = meshes.iter().map(|part| Surface::new(part, tree)).collect();
    // shells that do not cross are inside with all points or with none
    let crosses = |n: usize, m: usize| crossings.contains(&(n.min(m) as u32, n.max(m) as u32));
    let within = |n: usize, m: usize| {
        n != m && !crosses(n, m) && meshes[n].vertices.iter().take(1).all(|p| all[m].field.nearest(p).distance < 0.0)
    };
    let hidden: Vec<bool> = (0..count).map(|n| (0..count).any(|m| within(n, m))).collect();
    Some(all.into_iter().zip(hidden).filter(|(_, hidden)| !hidden).map(|(surface, _)| surface).collect())
}

/// Smallest depth inside another shell, as a fraction of the diagonal: the common boundary of two
/// shells is not inside.
const MIN_BURIED_DEPTH: f64 = 1e-6;

/// Returns whether a point on the surface of shell `own` lies inside another shell.
pub(crate) fn is_inside_other_shell(parts: &[Surface], own: usize, p: &Vec3) -> bool {
    parts.iter().enumerate().any(|(n, part)| {
        n != own
            && part.field.bound(p) < 0.0
            && part.field.nearest(p).distance < -MIN_BURIED_DEPTH * part.field.diagonal()
    })
}
