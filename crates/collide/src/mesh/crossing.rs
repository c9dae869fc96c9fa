//! Detection of faces that cross or touch faces that are not their neighbors.
//!
//! The signs of orient3d and orient2d are exact (Shewchuk's adaptive predicates, crate `robust`),
//! so the result depends on no tolerance. Neighbors share corners, by index. Faces with one shared
//! corner cross if the opposite edge of either meets the other face; faces with two shared corners,
//! if they are folded onto each other.

use super::TriMesh;
use super::aabb_tree::AabbTree;
use crate::{Aabb, Vec3};
use robust::{Coord, Coord3D};

/// Maximum number of box tests, per face on average, and its minimum for small meshes.
const MAX_BOX_TESTS_PER_FACE: usize = 2_000;
const MIN_BOX_TESTS: usize = 4_000_000;
/// Maximum number of stored pairs, per face on average, and its minimum.
const MAX_PAIRS_PER_FACE: usize = 16;
const MIN_PAIRS: usize = 100_000;

/// The crossing faces of a mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Crossings {
    /// Pairs of faces, lower index first, in ascending order.
    pub pairs: Vec<(u32, u32)>,
    /// Whether the search ended early; there may be more pairs.
    pub capped: bool,
}

/// Returns the pairs of shells whose faces cross or touch, lower index first; a shell can be paired
/// with itself. `shell` is the shell of each face. Returns `None` if there are too many crossings
/// to find all.
pub(crate) fn crossing_shells(mesh: &TriMesh, shell: &[u32]) -> Option<Vec<(u32, u32)>> {
    let found = Crossings::of(mesh);
    let of = |&(a, b): &(u32, u32)| [shell[a as usize], shell[b as usize]];
    let mut pairs: Vec<(u32, u32)> = found.pairs.iter().map(of).map(|[a, b]| (a.min(b), a.max(b))).collect();
    pairs.sort_unstable();
    pairs.dedup();
    (!found.capped).then_some(pairs)
}

impl Crossings {
    /// Finds all pairs of a mesh whose indices are in range.
    pub fn of(mesh: &TriMesh) -> Crossings {
        let corners: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        if corners.is_empty() {
            return Crossings::default();
        }
        let tree = AabbTree::new(&corners);
        let boxes: Vec<Aabb> = corners.iter().map(|c| Aabb::around(*c)).collect();
        let (max_tests, max_pairs) = (
            (MAX_BOX_TESTS_PER_FACE * corners.len()).max(MIN_BOX_TESTS),
            (MAX_PAIRS_PER_FACE * corners.len()).max(MIN_PAIRS),
        );
        let mut found = Crossings::default();
        let mut tests = 0;
        let mut open = Vec::new();
        for face in 0..corners.len() {
            open.push(0);
            while let Some(n) = open.pop() {
                tests += 1;
                let node = &tree.nodes[n];
                if !overlap(&node.bounds, &boxes[face]) {
                    continue;
                }
                if node.count == 0 {
                    open.extend([node.second as usize, n + 1]);
                    continue;
                }
                let others = node.range().map(|k| tree.ids[k] as usize).filter(|&other| other > face);
                for other in others.filter(|&other| overlap(&boxes[other], &boxes[face])) {
                    if faces_cross(mesh, &corners, face, other) {
                        found.pairs.push((face as u32, other as u32));
                    }
                }
            }
            if tests > max_tests || found.pairs.len() > max_pairs {
                found.capped = true;
                break;
            }
        }
        found.pairs.sort_unstable();
        found
    }

    /// Returns the number of faces that are in a pair.
    pub fn faces(&self) -> usize {
        let mut faces: Vec<u32> = self.pairs.iter().flat_map(|&(a, b)| [a, b]).collect();
        faces.sort_unstable();
        faces.dedup();
        faces.len()
    }
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k])
}

/// Returns whether two faces share a point beyond their shared corners.
fn faces_cross(mesh: &TriMesh, corners: &[[Vec3; 3]], i: usize, j: usize) -> bool {
    let (ti, tj) = (mesh.triangles[i], mesh.triangles[j]);
    let (a, b) = (&corners[i], &corners[j]);
    let own: Vec<usize> = (0..3).filter(|&k| !tj.contains(&ti[k])).collect();
    let others: Vec<usize> = (0..3).filter(|&k| !ti.contains(&tj[k])).collect();
    match (own.as_slice(), others.as_slice()) {
        (&[k], &[l]) => folded(&a[(k + 1) % 3], &a[(k + 2) % 3], &a[k], &b[l]),
        (&[k, l], &[m, n]) => segment_meets([&a[k], &a[l]], b) || segment_meets([&b[m], &b[n]], a),
        (&[], _) | (_, &[]) => true,
        _ => {
            let edges =
                |t: &[Vec3; 3], other: &[Vec3; 3]| (0..3).any(|k| segment_meets([&t[k], &t[(k + 1) % 3]], other));
            edges(a, b) || edges(b, a)
        }
    }
}

/// Returns whether the triangles `u v p` and `u v q` lie in one plane, on the same side of `uv`.
fn folded(u: &Vec3, v: &Vec3, p: &Vec3, q: &Vec3) -> bool {
    orient3d(u, v, p, q) == 0.0 && PLANES.iter().any(|&plane| orient2d(plane, u, v, p) * orient2d(plane, u, v, q) > 0.0)
}

/// Returns whether a closed segment meets a closed triangle; false for a triangle without area.
fn segment_meets([p, q]: [&Vec3; 2], [a, b, c]: &[Vec3; 3]) -> bool {
    let (sp, sq) = (orient3d(a, b, c, p), orient3d(a, b, c, q));
    if sp * sq > 0.0 || (sp > 0.0 && sq > 0.0) || (sp < 0.0 && sq < 0.0) {
        return false;
    }
    if sp == 0.0 && sq == 0.0 {
        return flat_segment_meets([p, q], [a, b, c]);
    }
    let s = [orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)];
    s.iter().all(|x| *x >= 0.0) || s.iter().all(|x| *x <= 0.0)
}

/// Like [`segment_meets`], for five points in one plane.
fn flat_segment_meets([p, q]: [&Vec3; 2], [a, b, c]: [&Vec3; 3]) -> bool {
    let Some(&plane) = PLANES.iter().find(|&&plane| orient2d(plane, a, b, c) != 0.0) else { return false };
    let within = |x: &Vec3| {
        let s = [orient2d(plane, a, b, x), orient2d(plane, b, c, x), orient2d(plane, c, a, x)];
        s.iter().all(|t| *t >= 0.0) || s.iter().all(|t| *t <= 0.0)
    };
    let meets = |u: &Vec3, v: &Vec3| {
        let across = |s: f64, t: f64| !((s > 0.0 && t > 0.0) || (s < 0.0 && t < 0.0));
        let lines =
            [orient2d(plane, p, q, u), orient2d(plane, p, q, v), orient2d(plane, u, v, p), orient2d(plane, u, v, q)];
        // four zeros: all on one line, so that an end of one lies in the other, which `within`
        // detects
        lines.iter().any(|t| *t != 0.0) && across(lines[0], lines[1]) && across(lines[2], lines[3])
    };
    within(p) || within(q) || meets(a, b) || meets(b, c) || meets(c, a)
}

/// The two coordinates of the projections along each axis.
const PLANES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

pub(super) fn orient2d([k, l]: [usize; 2], a: &Vec3, b: &Vec3, c: &Vec3) -> f64 {
    let at = |p: &Vec3| Coord { x: p[k], y: p[l] };
    robust::orient2d(at(a), at(b), at(c))
}

pub(super) fn orient3d(a: &Vec3, b: &Vec3, c: &Vec3, d: &Vec3) -> f64 {
    let at = |p: &Vec3| Coord3D { x: p.x, y: p.y, z: p.z };
    robust::orient3d(at(a), at(b), at(c), at(d))
}
