//! Reduced detail of objects: fewer triangles, edges, or the spheres of the sphere tree (thesis
//! §III.A, render quality per object).

use crate::{DebugStyle, DrawList, Material, MeshData};
use nalgebra::{Isometry3, Point3};
use std::collections::BTreeMap;
use tumble_collide::{Pose, Shape, SphereTree};

/// Cells along the longest side of a mesh that is simplified; all vertices in a cell become one.
const CELLS: f32 = 10.0;
/// Cosine of the angle between two faces above which their common edge is not part of a wireframe.
const FLAT_COS: f32 = 0.999;
/// Largest number of edges drawn of one mesh.
const MAX_EDGES: usize = 50_000;

/// Merges the vertices in each cell of a grid and keeps the triangles that remain.
pub(super) fn simplified(mesh: &MeshData) -> MeshData {
    let Some((lo, hi)) = mesh.bounds() else { return mesh.clone() };
    let cell = (0..3).map(|k| hi[k] - lo[k]).fold(0.0, f32::max) / CELLS;
    if cell <= 0.0 {
        return mesh.clone();
    }
    let key = |p: &[f32; 3]| -> [i32; 3] { std::array::from_fn(|k| ((p[k] - lo[k]) / cell).round() as i32) };
    let mut numbers: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    let mut sums: Vec<([f32; 3], f32)> = Vec::new();
    let mut of = Vec::with_capacity(mesh.positions.len());
    for p in &mesh.positions {
        let number = *numbers.entry(key(p)).or_insert_with(|| {
            sums.push(([0.0; 3], 0.0));
            sums.len() as u32 - 1
        });
        let (sum, count) = &mut sums[number as usize];
        (0..3).for_each(|k| sum[k] += p[k]);
        *count += 1.0;
        of.push(number);
    }
    let positions: Vec<[f32; 3]> = sums.iter().map(|(sum, count)| sum.map(|s| s / count)).collect();
    let corners = mesh.indices.chunks_exact(3).map(|t| [of[t[0] as usize], of[t[1] as usize], of[t[2] as usize]]);
    let triangles: Vec<[u32; 3]> = corners.filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).collect();
    // flat shading shows the coarse triangles
    MeshData::from_triangles(&positions, &triangles, 0.0)
        .ok()
        .filter(|m| !m.indices.is_empty())
        .unwrap_or_else(|| mesh.clone())
}

/// Returns the edges between faces that are not in one plane, each once.
pub(super) fn edges(mesh: &MeshData) -> Vec<[[f32; 3]; 2]> {
    let bits = |p: &[f32; 3]| p.map(|c| (c + 0.0).to_bits());
    let mut faces: BTreeMap<[[u32; 3]; 2], (nalgebra::Vector3<f32>, bool)> = BTreeMap::new();
    for t in mesh.indices.chunks_exact(3) {
        let p = [0, 1, 2].map(|k| mesh.positions[t[k] as usize]);
        let [a, b, c] = p.map(nalgebra::Vector3::from);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        for k in 0..3 {
            let (a, b) = (bits(&p[k]), bits(&p[(k + 1) % 3]));
            let edge = if a < b { [a, b] } else { [b, a] };
            faces
                .entry(edge)
                .and_modify(|(other, sharp)| *sharp |= other.dot(&normal) < FLAT_COS)
                .or_insert((normal, false));
        }
    }
    let mut seen: BTreeMap<[[u32; 3]; 2], u32> = BTreeMap::new();
    for t in mesh.indices.chunks_exact(3) {
        for k in 0..3 {
            let (a, b) = (bits(&mesh.positions[t[k] as usize]), bits(&mesh.positions[t[(k + 1) % 3] as usize]));
            *seen.entry(if a < b { [a, b] } else { [b, a] }).or_insert(0) += 1;
        }
    }
    let open = |edge: &[[u32; 3]; 2]| seen.get(edge).is_some_and(|count| *count == 1);
    let shown = faces.iter().filter(|(edge, (_, sharp))| *sharp || open(edge)).take(MAX_EDGES);
    shown.map(|(edge, _)| edge.map(|p| p.map(f32::from_bits))).collect()
}

/// Draws lines along the edges.
pub(super) fn draw_edges(list: &mut DrawList, edges: &[[[f32; 3]; 2]], pose: &Isometry3<f32>, color: [f32; 3]) {
    for [a, b] in edges {
        list.line(pose * Point3::from(*a), pose * Point3::from(*b), DebugStyle::new(color).width(1.5));
    }
}

/// Draws the spheres of a level, and the leaves above it. Returns `None` without a tree.
pub(super) fn draw_tree_spheres(
    list: &mut DrawList,
    shape: &Shape,
    level: u32,
    pose: &Pose,
    material: Material,
) -> Option<()> {
    let tree: &SphereTree = shape.tree()?;
    for node in tree.nodes().iter().filter(|n| n.level == level || (n.is_leaf() && n.level < level)) {
        let center = pose * Point3::from(node.center);
        list.add_sphere(Point3::from(super::small(&center.coords)), node.radius as f32, pose.rotation.cast(), material);
    }
    Some(())
}
