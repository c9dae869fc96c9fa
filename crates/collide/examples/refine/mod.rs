//! Large meshes that resemble scans: finer than the available files, with noise where they were
//! refined.

use std::collections::{BTreeMap, BinaryHeap};
use tumble_collide::{TriMesh, Vec3};

/// Maximum displacement of the middle of an edge, as a fraction of its length.
const NOISE: f64 = 0.08;

/// Returns a sphere of radius 1 with bumps of many sizes: 20·4ⁿ triangles.
pub fn bumps(n: u32) -> TriMesh {
    let mut mesh = TriMesh::icosphere(1.0, n);
    for v in &mut mesh.vertices {
        let wave = |k: f64| (k * v.x + 1.0).sin() * (k * v.y + 2.0).sin() * (k * v.z + 3.0).sin();
        *v *= 1.0 + 0.1 * wave(5.0) + 0.02 * wave(23.0) + 0.004 * wave(71.0);
    }
    mesh
}

/// Returns a closed mesh whose longest edges are halved until it has `count` triangles. Each middle
/// is moved slightly along the normal.
pub fn refined(mesh: &TriMesh, count: usize) -> TriMesh {
    let mut mesh = mesh.clone();
    let mut faces_of: BTreeMap<(u32, u32), Vec<u32>> = BTreeMap::new();
    let mut open = BinaryHeap::new();
    let key = |u: u32, v: u32| (u.min(v), u.max(v));
    let length = |mesh: &TriMesh, (u, v): (u32, u32)| (mesh.vertices[u as usize] - mesh.vertices[v as usize]).norm();
    for (t, c) in mesh.triangles.iter().enumerate() {
        (0..3).for_each(|k| faces_of.entry(key(c[k], c[(k + 1) % 3])).or_default().push(t as u32));
    }
    open.extend(faces_of.keys().map(|&edge| (length(&mesh, edge).to_bits(), edge)));
    while mesh.triangles.len() < count
        && let Some((_, edge)) = open.pop()
    {
        let faces = faces_of.remove(&edge).unwrap_or_default();
        let middle = mesh.vertices.len() as u32;
        mesh.vertices.push(moved(&mesh, edge, &faces));
        for t in faces {
            let c = mesh.triangles[t as usize];
            let k = (0..3).find(|&k| key(c[k], c[(k + 1) % 3]) == edge).expect("the face has the edge");
            let (from, to, apex, new) = (c[k], c[(k + 1) % 3], c[(k + 2) % 3], mesh.triangles.len() as u32);
            mesh.triangles[t as usize] = [from, middle, apex];
            mesh.triangles.push([middle, to, apex]);
            faces_of.entry(key(to, apex)).or_default().iter_mut().filter(|f| **f == t).for_each(|f| *f = new);
            for (edge, face) in
                [(key(from, middle), t), (key(middle, to), new), (key(middle, apex), t), (key(middle, apex), new)]
            {
                let faces = faces_of.entry(edge).or_default();
                if faces.is_empty() {
                    open.push((length(&mesh, edge).to_bits(), edge));
                }
                faces.push(face);
            }
        }
    }
    mesh
}

fn moved(mesh: &TriMesh, edge: (u32, u32), faces: &[u32]) -> Vec3 {
    let [u, v] = [edge.0, edge.1].map(|n| mesh.vertices[n as usize]);
    let normal: Vec3 = faces.iter().map(|&t| mesh.corners(t as usize)).map(|[a, b, c]| (b - a).cross(&(c - a))).sum();
    // deterministic, and random enough
    let noise = (12.9898 * f64::from(edge.0) + 78.233 * f64::from(edge.1)).sin();
    0.5 * (u + v) + normal.try_normalize(0.0).unwrap_or_default() * (NOISE * noise * (v - u).norm())
}
