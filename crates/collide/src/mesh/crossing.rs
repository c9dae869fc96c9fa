//! Which faces cross or touch others that they are no neighbors of.
//!
//! Signs of orient3d and orient2d are exact (Shewchuk's adaptive predicates, crate `robust`), so the answer depends on
//! no tolerance. Neighbors share corners, by index: with one shared corner the opposite edge of either must meet the
//! other face; with two, the faces must be folded onto each other.

use super::TriMesh;
use super::aabb_tree::AabbTree;
use crate::{Aabb, Vec3};
use robust::{Coord, Coord3D};

/// Pairs of boxes looked at per face, on average, before the search gives up; and a floor for small meshes.
const MAX_BOX_TESTS_PER_FACE: usize = 2_000;
const MIN_BOX_TESTS: usize = 4_000_000;
/// Pairs kept per face, on average, and a floor.
const MAX_PAIRS_PER_FACE: usize = 16;
const MIN_PAIRS: usize = 100_000;

/// What was found.
#[derive(Clone, Debug, Default)]
pub(super) struct Crossings {
    /// Pairs of faces, the lower first, in ascending order.
    pub pairs: Vec<(u32, u32)>,
    /// Whether the search gave up before its end: there may be more.
    pub capped: bool,
}

/// Which shells (told per face) have faces that cross or touch: pairs, the lower first, a shell with itself too; `None` where they are too many to know.
pub(crate) fn crossing_shells(mesh: &TriMesh, shell: &[u32]) -> Option<Vec<(u32, u32)>> {
    let found = Crossings::of(mesh);
    let of = |&(a, b): &(u32, u32)| [shell[a as usize], shell[b as usize]];
    let mut pairs: Vec<(u32, u32)> = found.pairs.iter().map(of).map(|[a, b]| (a.min(b), a.max(b))).collect();
    pairs.sort_unstable();
    pairs.dedup();
    (!found.capped).then_some(pairs)
}

impl Crossings {
    /// All pairs of a mesh whose indices are in range.
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

    /// How many faces are in a pair.
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

/// Do two faces of a mesh have a point in common that their shared corners do not account for?
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

/// Do the triangles `u v p` and `u v q` lie in one plane, on the same side of `uv`?
fn folded(u: &Vec3, v: &Vec3, p: &Vec3, q: &Vec3) -> bool {
    orient3d(u, v, p, q) == 0.0 && PLANES.iter().any(|&plane| orient2d(plane, u, v, p) * orient2d(plane, u, v, q) > 0.0)
}

/// Does a closed segment meet a closed triangle? A triangle without area is met by nothing.
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

/// The same where all five points lie in one plane.
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
        // four zeros: all on one line, where an end of one would lie in the other, which `within` sees
        lines.iter().any(|t| *t != 0.0) && across(lines[0], lines[1]) && across(lines[2], lines[3])
    };
    within(p) || within(q) || meets(a, b) || meets(b, c) || meets(c, a)
}

/// Coordinates to look at, seen along the third.
const PLANES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

fn orient2d([k, l]: [usize; 2], a: &Vec3, b: &Vec3, c: &Vec3) -> f64 {
    let at = |p: &Vec3| Coord { x: p[k], y: p[l] };
    robust::orient2d(at(a), at(b), at(c))
}

fn orient3d(a: &Vec3, b: &Vec3, c: &Vec3, d: &Vec3) -> f64 {
    let at = |p: &Vec3| Coord3D { x: p.x, y: p.y, z: p.z };
    robust::orient3d(at(a), at(b), at(c), at(d))
}
