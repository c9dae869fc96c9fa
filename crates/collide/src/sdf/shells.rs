//! A mesh of several shells that overlap, shell by shell.
//!
//! ```text
//! d_U(p) = min over the shells i of d_i(p)      outside the union exact, inside it at least what the depth is
//! ```
//!
//! The closest place of the union from outside is the closest of one of its shells, so each shell has elements and a field of its own, as a body
//! that stands alone; what they find on a place that lies inside another shell is buried and does not count. A shell that lies wholly
//! inside another one is left out.

use super::{DistanceField, Surface};
use crate::mesh::{crossing_shells, edge_groups, shells};
use crate::{SphereTree, TriMesh, Vec3};

/// More shells than this collide by spheres.
const MAX_SHELLS: usize = 32;

/// The surfaces of the shells of a closed mesh that overlap; `None` where a shell crosses itself or is a cavity, or they are too many.
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
    // what does not cross is inside with all its points or with none
    let crosses = |n: usize, m: usize| crossings.contains(&(n.min(m) as u32, n.max(m) as u32));
    let within = |n: usize, m: usize| {
        n != m && !crosses(n, m) && meshes[n].vertices.iter().take(1).all(|p| all[m].field.nearest(p).distance < 0.0)
    };
    let hidden: Vec<bool> = (0..count).map(|n| (0..count).any(|m| within(n, m))).collect();
    Some(all.into_iter().zip(hidden).filter(|(_, hidden)| !hidden).map(|(surface, _)| surface).collect())
}

/// How deep inside another shell a place is buried, as a part of the diagonal: what lies on the common boundary of two shells is not.
const MIN_BURIED_DEPTH: f64 = 1e-6;

/// Whether a place on the surface of shell `own` lies inside another one.
pub(crate) fn is_inside_other_shell(parts: &[Surface], own: usize, p: &Vec3) -> bool {
    parts.iter().enumerate().any(|(n, part)| {
        n != own
            && part.field.bound(p) < 0.0
            && part.field.nearest(p).distance < -MIN_BURIED_DEPTH * part.field.diagonal()
    })
}
