//! The boundary of the solid that a closed surface encloses at least once.
//!
//! If shells overlap, or a surface crosses itself, part of it is buried in the solid. Faces that
//! cross others are cut along the planes of those others, so that each piece lies on one side of
//! every other face. The piece is then classified at its center `c`, without the faces through `c`:
//!
//! ```text
//! front = w(c) − J/2        back = w(c) + J/2        J = Σ ±1 over the faces through c, + where they face alike
//! ```
//!
//! are the winding numbers in front of the piece and behind it, without the jump at the surface.
//! The piece bounds the solid if exactly one of them is above 1/2. It then has the weight `1/|J|`,
//! since each of the coincident faces has such a piece. Faces without crossings are classified
//! patch by patch.
//!
//! Integrals over the pieces of the boundary are exact for the union, however often the surface
//! encloses it.

use super::TriMesh;
use super::crossing::Crossings;
use super::edges::{EdgeGroups, edge_groups};
use super::integrals::Moments;
use super::triangle::closest_on_triangle;
use super::winding::WindingNumber;
use crate::{MassProperties, UnionFind, Vec3};

/// Maximum number of crossing faces for which a face is cut.
const MAX_PARTNERS: usize = 64;
/// Maximum number of pieces of one face.
const MAX_PIECES: usize = 512;
/// Maximum number of pieces, per face of the mesh on average, and its minimum for small meshes;
/// further faces are not cut.
const MAX_CUT: usize = 4;
const MIN_CUT: usize = 200_000;
/// Largest distance of coincident faces, as a fraction of the diagonal.
const SAME_PLACE: f64 = 1e-10;
/// Least cosine between a ray and the normal of the piece at which it starts.
const STEEP: f64 = 0.1;
/// Largest difference of a reliable winding number from an integer.
const MAX_ROUNDING: f64 = 0.2;

/// A triangle of the boundary.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub corners: [Vec3; 3],
    /// The face of which this is all or a part.
    pub face: u32,
    /// Weight of the piece in integrals over the boundary, 0 to 1.
    pub weight: f64,
    /// The normals that determine the side on which a point lies.
    pub trust: Trust,
}

/// The places where the normals of a piece determine the side on which a point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trust {
    /// Nowhere.
    None,
    /// Above the interior of the face, but not at edges and corners.
    Face,
    /// Everywhere: the faces around all its corners are whole, and form one fan at each corner.
    All,
}

/// The boundary of a closed mesh's solid.
#[derive(Clone, Debug)]
pub(super) struct Boundary {
    pub pieces: Vec<Piece>,
    pub crossing_faces: usize,
    /// Whether there can be more crossing faces.
    pub capped: bool,
    /// Whether part of the surface is not boundary, or has a weight other than 1.
    pub differs: bool,
    /// Area of pieces that are kept although their classification is uncertain, m².
    pub doubtful_area: f64,
}

impl TriMesh {
    /// Like [`TriMesh::mass_properties`], for surfaces that cross themselves or have overlapping
    /// shells: volume that is enclosed several times counts once. Exact up to rounding, except for
    /// faces that cross more than 64 others, which count whole.
    pub fn union_mass_properties(&self, density: f64) -> MassProperties {
        Boundary::of(self).0.moments(&self.middle()).mass_properties(&self.middle(), density)
    }
}

impl Boundary {
    /// Computes the boundary of a closed mesh (see [`TriMesh::check_closed`]).
    pub fn of(mesh: &TriMesh) -> (Boundary, Option<WindingNumber>) {
        Boundary::from_crossings(mesh, &Crossings::of(mesh))
    }

    /// Computes the boundary of a mesh with known crossing faces.
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
            // a surface around nothing: it has a distance, but no inside
            (0..mesh.triangles.len()).for_each(|t| boundary.add_piece(t, mesh.corners(t), PieceClass::Doubtful));
        }
        boundary.trust(mesh, split);
        (boundary, winding)
    }

    /// Integrates over the solid, about `origin`.
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

    /// Trusts the normals of the edges and corners of a face if all faces around its corners are
    /// whole and trusted.
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

/// The relation of a piece to the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PieceClass {
    /// Inside or outside the solid on both sides.
    Buried,
    /// Boundary, with this weight; negative if the solid is in front of it.
    Bounds(f64),
    /// Uncertain; treated as boundary.
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
    let middle = middle_winding(winding, &center, &through, &normal, jump);
    let (front, back) = (middle - 0.5 * jump, middle + 0.5 * jump);
    if (front - front.round()).abs() > MAX_ROUNDING || normal.norm() == 0.0 {
        return PieceClass::Doubtful;
    }
    if (front > 0.5) == (back > 0.5) { PieceClass::Buried } else { PieceClass::Bounds(1.0 / jump) }
}

/// Returns the mean of the winding numbers in front of a piece and behind it: what a ray counts that leaves it to one side, which is the number on
/// that side. Axes that are nearly in its plane are left out; without a ray that meets no edge it is the sum of solid angles.
fn middle_winding(winding: &WindingNumber, center: &Vec3, through: &[u32], normal: &Vec3, jump: f64) -> f64 {
    let mut axes = [0, 1, 2];
    axes.sort_by(|a, b| normal[*b].abs().total_cmp(&normal[*a].abs()));
    let steep = axes.into_iter().filter(|&axis| normal[axis].abs() > STEEP * normal.norm());
    let counted = steep.into_iter().find_map(|axis| {
        let count = f64::from(winding.count(center, through, axis)?);
        Some(count + 0.5 * jump * normal[axis].signum())
    });
    counted.unwrap_or_else(|| winding.excluding(center, through))
}

/// Cuts a face along the planes of others, and along the edges of coplanar others. Returns `None`
/// if there are too many others or pieces.
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

/// Cuts the convex pieces that can meet the triangle `across`, by the plane through `at` with
/// normal `normal`.
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

/// Returns the part of a convex piece with `sign · height ≥ 0`.
fn clip_half(piece: &[Vec3], heights: &[f64], sign: f64) -> Vec<Vec3> {
    let mut kept = Vec::with_capacity(piece.len() + 1);
    for n in 0..piece.len() {
        let m = (n + 1) % piece.len();
        let (h, g) = (sign * heights[n], sign * heights[m]);
        if h >= 0.0 {
            kept.push(piece[n]);
        }
        if h * g < 0.0 {
            // interpolated from the same end for both halves, so that they share the exact point
            let (low, high) = if heights[n] < heights[m] { (n, m) } else { (m, n) };
            let fraction = heights[low] / (heights[low] - heights[high]);
            kept.push(piece[low] + (piece[high] - piece[low]) * fraction);
        }
    }
    kept
}

/// Returns the normal with the length of twice the area.
fn area_vector([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a))
}

/// Patches of faces without crossings, connected across edges with two faces. All faces of a patch
/// have the same class.
struct Patches {
    /// Patch of each face; undefined for faces with crossings.
    of: Vec<u32>,
    /// The largest face of each patch.
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

/// Returns the vertices with several fans of faces, with an edge of more than two faces, or with a
/// face without area.
fn pinched_vertices(mesh: &TriMesh, groups: &EdgeGroups) -> Vec<bool> {
    let mut pinched = vec![false; mesh.vertices.len()];
    for (_, triangle) in
        mesh.triangles.iter().enumerate().filter(|(t, _)| area_vector(&mesh.corners(*t)) == Vec3::zeros())
    {
        triangle.iter().for_each(|&v| pinched[v as usize] = true);
    }
    // corners of faces, joined across the edges that meet there: one set per fan
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
