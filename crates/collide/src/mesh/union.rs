//! The boundary of the solid that a closed surface goes around at least once.
//!
//! Where shells overlap, or a surface crosses itself, some of it is buried. Faces that cross others are cut along the
//! planes of those others, so that each piece lies on one side of every other face. A piece's center `c` then tells
//! for the whole of it: with the faces through `c` left out,
//!
//! ```text
//! front = w(c) − J/2        back = w(c) + J/2        J = Σ ±1 over the faces through c, + where they face alike
//! ```
//!
//! are the winding numbers in front of the piece and behind it, with no step off the surface. The piece bounds the
//! solid if one of them is above 1/2 and the other is not; it is then counted `1/|J|` times, since each of the faces
//! that lie on each other there has such a piece. Faces that cross none are told patch by patch.
//!
//! Integrals over the boundary's pieces are exact for the union, whatever the number of times it is gone around.

use super::TriMesh;
use super::crossing::Crossings;
use super::edges::{EdgeGroups, edge_groups};
use super::integrals::Moments;
use super::triangle::closest_on_triangle;
use super::winding::WindingNumber;
use crate::{MassProperties, UnionFind, Vec3};

/// Faces with more others across them than this are not cut.
const MAX_PARTNERS: usize = 64;
/// Pieces of one face.
const MAX_PIECES: usize = 512;
/// Pieces per face of the mesh, on average, and a floor for small meshes; further faces are not cut.
const MAX_CUT: usize = 4;
const MIN_CUT: usize = 200_000;
/// Faces closer than this part of the diagonal lie on each other.
const SAME_PLACE: f64 = 1e-10;
/// A winding number farther than this from an integer is not believed.
const MAX_ROUNDING: f64 = 0.2;

/// A triangle of the boundary.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub corners: [Vec3; 3],
    /// The face that it is, or is a part of.
    pub face: u32,
    /// How often it counts in an integral over the boundary, 0 to 1.
    pub weight: f64,
    /// Which normals tell the side that a point is on.
    pub trust: Trust,
}

/// How far the normals of a piece tell which side is which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trust {
    /// Not at all.
    None,
    /// Above its middle, but not at edges and corners.
    Face,
    /// Everywhere: the faces around all its corners are whole, and lie round each in one fan.
    All,
}

/// The boundary of a closed mesh's solid.
#[derive(Clone, Debug)]
pub(super) struct Boundary {
    pub pieces: Vec<Piece>,
    pub crossing_faces: usize,
    /// Whether there may be more of these.
    pub capped: bool,
    /// Whether some of the surface is no boundary, or counts other than once.
    pub differs: bool,
    /// Area of what was kept without being sure, m².
    pub doubtful_area: f64,
}

impl TriMesh {
    /// The same where the surface crosses itself or shells overlap: of all that it goes around at least once, each
    /// place counted once. Exact up to rounding, but for faces that cross more than 64 others, which count whole.
    pub fn union_mass_properties(&self, density: f64) -> MassProperties {
        Boundary::of(self).0.moments(&self.middle()).mass_properties(&self.middle(), density)
    }
}

impl Boundary {
    /// Of a closed mesh (see [`TriMesh::check_closed`]).
    pub fn of(mesh: &TriMesh) -> (Boundary, Option<WindingNumber>) {
        Boundary::from_crossings(mesh, &Crossings::of(mesh))
    }

    /// The same of a mesh whose crossing faces are known.
    pub fn from_crossings(mesh: &TriMesh, crossings: &Crossings) -> (Boundary, Option<WindingNumber>) {
        let groups = edge_groups(mesh);
        let patches = patches(mesh, &groups, crossings);
        let split = pinched_vertices(mesh, &groups);
        let simple = crossings.pairs.is_empty() && !crossings.capped && patches.count == 1;
        let winding = (!simple || split.contains(&true)).then(|| WindingNumber::new(mesh));
        let mut boundary = Boundary {
            pieces: Vec::with_capacity(mesh.triangles.len()),
            crossing_faces: crossings.faces(),
            capped: crossings.capped,
            differs: false,
            doubtful_area: 0.0,
        };
        match &winding {
            Some(winding) if !simple => boundary.split(mesh, crossings, &patches, winding),
            _ => {
                (0..mesh.triangles.len()).for_each(|t| boundary.add_piece(t, mesh.corners(t), PieceClass::Bounds(1.0)))
            }
        }
        if boundary.pieces.is_empty() {
            // a surface around nothing: there is a distance, and no inside
            (0..mesh.triangles.len()).for_each(|t| boundary.add_piece(t, mesh.corners(t), PieceClass::Doubtful));
        }
        boundary.trust(mesh, split);
        (boundary, winding)
    }

    /// Integrals over the solid, about `origin`.
    pub fn moments(&self, origin: &Vec3) -> Moments {
        Moments::of(self.pieces.iter().map(|p| (p.corners, p.weight)), origin)
    }

    fn split(&mut self, mesh: &TriMesh, crossings: &Crossings, patches: &Patches, winding: &WindingNumber) {
        let mut partners = vec![Vec::new(); mesh.triangles.len()];
        for &(a, b) in &crossings.pairs {
            partners[a as usize].push(b);
            partners[b as usize].push(a);
        }
        let tolerance = SAME_PLACE * mesh.diagonal();
        let most = (MAX_CUT * mesh.triangles.len()).max(MIN_CUT);
        let mut split = 0;
        let mut outcome: Vec<Option<PieceClass>> = vec![None; patches.count];
        for face in 0..mesh.triangles.len() {
            let others = &partners[face];
            if crossings.capped {
                self.add_piece(face, mesh.corners(face), PieceClass::Doubtful);
            } else if others.is_empty() {
                let class = *outcome[patches.of[face] as usize].get_or_insert_with(|| {
                    let largest = patches.largest[patches.of[face] as usize];
                    classify(mesh, winding, largest, &mesh.corners(largest), &[], tolerance)
                });
                self.add_piece(face, mesh.corners(face), class);
            } else if let Some(parts) = split_face(mesh, face, others).filter(|_| split <= most) {
                split += parts.len();
                for part in parts {
                    self.add_piece(face, part, classify(mesh, winding, face, &part, others, tolerance));
                }
            } else {
                self.add_piece(face, mesh.corners(face), PieceClass::Doubtful);
            }
        }
    }

    fn add_piece(&mut self, face: usize, corners: [Vec3; 3], class: PieceClass) {
        let weight = match class {
            PieceClass::Buried => 0.0,
            PieceClass::Bounds(fraction) => fraction.abs(),
            PieceClass::Doubtful => {
                self.doubtful_area += 0.5 * area_vector(&corners).norm();
                1.0
            }
        };
        self.differs |= weight != 1.0;
        if weight != 0.0 {
            let faces_out = matches!(class, PieceClass::Bounds(fraction) if fraction > 0.0);
            let trust = if faces_out { Trust::Face } else { Trust::None };
            self.pieces.push(Piece { corners, face: face as u32, weight, trust });
        }
    }

    /// Where all faces around all corners of a face are whole and trusted, so are the normals of its edges and corners.
    fn trust(&mut self, mesh: &TriMesh, mut pinched: Vec<bool>) {
        let mut whole = vec![false; mesh.triangles.len()];
        for piece in self.pieces.iter().filter(|p| p.weight == 1.0 && p.trust == Trust::Face) {
            whole[piece.face as usize] = piece.corners == mesh.corners(piece.face as usize);
        }
        for (triangle, whole) in mesh.triangles.iter().zip(&whole) {
            triangle.iter().for_each(|&v| pinched[v as usize] |= !whole);
        }
        for piece in self.pieces.iter_mut().filter(|p| whole[p.face as usize]) {
            if mesh.triangles[piece.face as usize].iter().all(|&v| !pinched[v as usize]) {
                piece.trust = Trust::All;
            }
        }
    }
}

/// What a piece is to the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PieceClass {
    /// Solid, or none, on both sides.
    Buried,
    /// Its boundary, of which it is such a share; negative where the solid is in front of it.
    Bounds(f64),
    /// Taken as its boundary for safety.
    Doubtful,
}

fn classify(
    mesh: &TriMesh,
    winding: &WindingNumber,
    face: usize,
    part: &[Vec3; 3],
    others: &[u32],
    tolerance: f64,
) -> PieceClass {
    let center = part.iter().sum::<Vec3>() / 3.0;
    let normal = area_vector(&mesh.corners(face));
    let mut through = vec![face as u32];
    let mut jump = 1.0;
    for &other in others {
        let corners = mesh.corners(other as usize);
        let facing = area_vector(&corners);
        let aligned = normal.cross(&facing).norm() <= 1e-6 * normal.norm() * facing.norm();
        if aligned && (closest_on_triangle(&center, &corners).0 - center).norm() <= tolerance {
            through.push(other);
            jump += normal.dot(&facing).signum();
        }
    }
    let middle = winding.excluding(&center, &through);
    let (front, back) = (middle - 0.5 * jump, middle + 0.5 * jump);
    if (front - front.round()).abs() > MAX_ROUNDING || normal.norm() == 0.0 {
        return PieceClass::Doubtful;
    }
    if (front > 0.5) == (back > 0.5) { PieceClass::Buried } else { PieceClass::Bounds(1.0 / jump) }
}

/// A face cut along the planes of others, and of the edges of those that lie in its own plane; `None` if they are
/// too many.
fn split_face(mesh: &TriMesh, face: usize, others: &[u32]) -> Option<Vec<[Vec3; 3]>> {
    let corners = mesh.corners(face);
    if others.len() > MAX_PARTNERS {
        return None;
    }
    let normal = area_vector(&corners);
    let mut pieces = vec![corners.to_vec()];
    for &other in others {
        let across = mesh.corners(other as usize);
        let facing = area_vector(&across);
        if normal.cross(&facing).norm() <= 1e-9 * normal.norm() * facing.norm() {
            for k in 0..3 {
                let (from, to) = (across[k], across[(k + 1) % 3]);
                pieces = split(pieces, &across, &from, &normal.cross(&(to - from)));
            }
        } else {
            pieces = split(pieces, &across, &across[0], &facing);
        }
        if pieces.len() > MAX_PIECES {
            return None;
        }
    }
    Some(pieces.iter().flat_map(|p| (1..p.len() - 1).map(|k| [p[0], p[k], p[k + 1]])).collect())
}

/// Cuts those convex pieces that could meet the triangle `across` by the plane through `at` along `normal`.
fn split(pieces: Vec<Vec<Vec3>>, across: &[Vec3; 3], at: &Vec3, normal: &Vec3) -> Vec<Vec<Vec3>> {
    let bounds = crate::Aabb::around(*across);
    let mut after = Vec::with_capacity(pieces.len() + 1);
    for piece in pieces {
        let own = crate::Aabb::around(piece.iter().copied());
        let heights: Vec<f64> = piece.iter().map(|p| (p - at).dot(normal)).collect();
        let near = (0..3).all(|k| own.min[k] <= bounds.max[k] && bounds.min[k] <= own.max[k]);
        if !near || heights.iter().all(|h| *h >= 0.0) || heights.iter().all(|h| *h <= 0.0) {
            after.push(piece);
            continue;
        }
        after.extend([1.0, -1.0].map(|sign| clip_half(&piece, &heights, sign)).into_iter().filter(|p| p.len() >= 3));
    }
    after
}

/// What of a convex piece lies where `sign · height ≥ 0`.
fn clip_half(piece: &[Vec3], heights: &[f64], sign: f64) -> Vec<Vec3> {
    let mut kept = Vec::with_capacity(piece.len() + 1);
    for n in 0..piece.len() {
        let m = (n + 1) % piece.len();
        let (h, g) = (sign * heights[n], sign * heights[m]);
        if h >= 0.0 {
            kept.push(piece[n]);
        }
        if h * g < 0.0 {
            // from the same end for both halves, so that they share the very point
            let (low, high) = if heights[n] < heights[m] { (n, m) } else { (m, n) };
            let fraction = heights[low] / (heights[low] - heights[high]);
            kept.push(piece[low] + (piece[high] - piece[low]) * fraction);
        }
    }
    kept
}

/// Twice the area, along the normal.
fn area_vector([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a))
}

/// Faces that cross none, joined over edges of two faces: all of a patch has the same on either side.
struct Patches {
    /// Of each face; means nothing for one that crosses.
    of: Vec<u32>,
    /// The face of each patch that is largest.
    largest: Vec<usize>,
    count: usize,
}

fn patches(mesh: &TriMesh, groups: &EdgeGroups, crossings: &Crossings) -> Patches {
    let mut crosses = vec![false; mesh.triangles.len()];
    for &(a, b) in &crossings.pairs {
        (crosses[a as usize], crosses[b as usize]) = (true, true);
    }
    let mut neighbors = vec![Vec::new(); mesh.triangles.len()];
    for group in groups.iter().filter(|g| g.len() == 2 && !crosses[g[0].face] && !crosses[g[1].face]) {
        neighbors[group[0].face].push(group[1].face);
        neighbors[group[1].face].push(group[0].face);
    }
    let mut patches = Patches { of: vec![u32::MAX; mesh.triangles.len()], largest: Vec::new(), count: 0 };
    let area = |t: usize| area_vector(&mesh.corners(t)).norm_squared();
    for seed in 0..mesh.triangles.len() {
        if patches.of[seed] != u32::MAX || crosses[seed] {
            continue;
        }
        let patch = patches.count as u32;
        patches.count += 1;
        patches.of[seed] = patch;
        let (mut open, mut largest) = (vec![seed], seed);
        while let Some(face) = open.pop() {
            if area(face) > area(largest) {
                largest = face;
            }
            for &next in &neighbors[face] {
                if patches.of[next] == u32::MAX {
                    patches.of[next] = patch;
                    open.push(next);
                }
            }
        }
        patches.largest.push(largest);
    }
    patches
}

/// Which vertices have more than one fan of faces around them, an edge of more than two, or a face without area.
fn pinched_vertices(mesh: &TriMesh, groups: &EdgeGroups) -> Vec<bool> {
    let mut pinched = vec![false; mesh.vertices.len()];
    for (_, triangle) in
        mesh.triangles.iter().enumerate().filter(|(t, _)| area_vector(&mesh.corners(*t)) == Vec3::zeros())
    {
        triangle.iter().for_each(|&v| pinched[v as usize] = true);
    }
    // corners of faces, joined over the edges that meet there: one set per fan
    let mut sets = UnionFind::new(3 * mesh.triangles.len());
    let corner =
        |face: usize, v: u32| (3 * face + mesh.triangles[face].iter().position(|&w| w == v).unwrap_or(0)) as u32;
    for group in groups.iter() {
        for v in [group[0].low, group[0].high] {
            if group.len() != 2 {
                pinched[v as usize] = true;
                continue;
            }
            sets.union(corner(group[0].face, v), corner(group[1].face, v));
        }
    }
    let mut fan = vec![u32::MAX; mesh.vertices.len()];
    for n in 0..3 * mesh.triangles.len() as u32 {
        let v = mesh.triangles[n as usize / 3][n as usize % 3] as usize;
        if sets.find(n) == n {
            pinched[v] |= fan[v] != u32::MAX;
            fan[v] = n;
        }
    }
    pinched
}
