//! The pieces of a surface that a [`Covering`](super::Covering) covers.
//!
//! A piece is a triangle, and the surface that it stands for is within `bulge` of it: 0 for the
//! faces of a mesh, the height of the arc above its chord for a round shape. A piece lies in a
//! sphere about `c` of radius `r` if `max |p − c| + bulge ≤ r` over its corners.
//!
//! A piece that is inside another shape of the union is no outer surface and is left out. It is
//! inside if the sphere about its middle that contains it is: `s(m) + max |p − m| + bulge ≤ 0`, with
//! the signed distance `s` to the other shape. Pieces that reach into another shape are halved
//! until they are inside, outside or small; the small ones are kept.

use crate::tree::grow_to_cover::halves_of;
use crate::{MeshDistance, TriMesh, Vec3};
use std::collections::BinaryHeap;

/// Number of pieces that the surface is split into initially.
const INITIAL_PIECES: usize = 4000;
/// Longest side up to which a piece partly inside another shape is kept, as a fraction of the
/// diagonal of the union.
const SMALL: f64 = 1e-2;

/// One shape of a union of shapes, all in the same frame.
#[derive(Clone, Debug)]
pub struct CoveredShape {
    /// The surface to cover.
    pub given: TriMesh,
    /// A closed, outward-wound surface around the shape if `given` is not closed.
    pub closed: Option<TriMesh>,
    /// Largest distance of the shape's surface outside `given`, meters: 0 unless the shape is
    /// round. The corners of a round shape's mesh lie on it.
    pub bulge: f64,
    /// Whether its surface is to be covered. Otherwise the shape only hides the surface of others.
    pub covered: bool,
}

impl CoveredShape {
    /// Returns the closed surface of the shape.
    pub fn solid(&self) -> &TriMesh {
        self.closed.as_ref().unwrap_or(&self.given)
    }

    /// Returns the solids of several shapes as one mesh of overlapping shells.
    pub fn union(shapes: &[CoveredShape]) -> TriMesh {
        let mut union = TriMesh { vertices: Vec::new(), triangles: Vec::new() };
        for solid in shapes.iter().map(CoveredShape::solid) {
            let first = union.vertices.len() as u32;
            union.vertices.extend(&solid.vertices);
            union.triangles.extend(solid.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        union
    }
}

/// A piece of the outer surface of a union of shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePiece {
    /// Corners of the triangle, meters, in the frame of the shapes.
    pub corners: [Vec3; 3],
    /// Largest distance of the surface that it stands for from the triangle, meters.
    pub bulge: f64,
    /// Index of its shape.
    pub shape: u32,
}

impl SurfacePiece {
    /// Returns the radius of the smallest sphere about a center that contains the piece, meters.
    pub fn reach(&self, center: &Vec3) -> f64 {
        self.corners.iter().map(|p| (p - center).norm_squared()).fold(0.0, f64::max).sqrt() + self.bulge
    }

    pub(super) fn middle(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() / 3.0
    }

    /// Returns the area of the triangle, m².
    pub fn area(&self) -> f64 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).cross(&(c - a)).norm()
    }

    /// Returns the length of the longest side, and the two halves.
    pub(super) fn halves(&self) -> (f64, [SurfacePiece; 2]) {
        let (size, halves) = halves_of(&self.corners);
        (size, halves.map(|corners| SurfacePiece { corners, ..*self }))
    }
}

/// Returns the outer surface of the shapes that are to be covered, in pieces.
pub(super) fn outer_pieces(shapes: &[CoveredShape], diagonal: f64) -> Vec<SurfacePiece> {
    let all: Vec<SurfacePiece> = (0..shapes.len())
        .filter(|k| shapes[*k].covered)
        .flat_map(|k| {
            let CoveredShape { given, bulge, .. } = &shapes[k];
            (0..given.triangles.len()).map(move |t| SurfacePiece {
                corners: given.corners(t),
                bulge: *bulge,
                shape: k as u32,
            })
        })
        .collect();
    if shapes.len() == 1 {
        return split(all);
    }
    // an open surface hides nothing
    let hiding: Vec<Option<MeshDistance>> =
        shapes.iter().map(|shape| shape.closed.is_none().then(|| MeshDistance::new(&shape.given))).collect();
    let mut outer = Vec::new();
    for piece in split(all) {
        let others: Vec<&MeshDistance> =
            (0..shapes.len()).filter(|k| *k != piece.shape as usize).filter_map(|k| hiding[k].as_ref()).collect();
        keep_outer(piece, &others, SMALL * diagonal, &mut outer);
    }
    outer
}

/// Adds the parts of a piece that may be outside the other shapes.
fn keep_outer(piece: SurfacePiece, others: &[&MeshDistance], small: f64, outer: &mut Vec<SurfacePiece>) {
    let middle = piece.middle();
    let size = piece.reach(&middle);
    let mut near = Vec::new();
    for other in others {
        let distance = other.closest(&middle).signed_distance;
        if distance + size <= 0.0 {
            return;
        }
        if distance < size {
            near.push(*other);
        }
    }
    let (longest, halves) = piece.halves();
    if near.is_empty() || longest <= small {
        outer.push(piece);
    } else {
        halves.into_iter().for_each(|half| keep_outer(half, &near, small, outer));
    }
}

/// Halves the longest pieces until the initial number is reached.
fn split(pieces: Vec<SurfacePiece>) -> Vec<SurfacePiece> {
    let mut heap: BinaryHeap<Longest> =
        pieces.into_iter().enumerate().map(|(n, piece)| Longest::new(piece, n)).collect();
    while heap.len() < INITIAL_PIECES {
        let Some(longest) = heap.pop() else { break };
        let count = heap.len();
        let [one, other] = longest.piece.halves().1;
        heap.push(Longest::new(one, count));
        heap.push(Longest::new(other, count + 1));
    }
    let mut all = heap.into_vec();
    all.sort_by(|a, b| b.cmp(a));
    all.into_iter().map(|entry| entry.piece).collect()
}

/// A piece in the order of its longest side; among equals by number.
struct Longest {
    size: f64,
    number: usize,
    piece: SurfacePiece,
}

impl Longest {
    fn new(piece: SurfacePiece, number: usize) -> Longest {
        Longest { size: piece.halves().0, number, piece }
    }
}

impl Ord for Longest {
    fn cmp(&self, other: &Longest) -> std::cmp::Ordering {
        self.size.total_cmp(&other.size).then(other.number.cmp(&self.number))
    }
}

impl PartialOrd for Longest {
    fn partial_cmp(&self, other: &Longest) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Longest {
    fn eq(&self, other: &Longest) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Longest {}
