//! The octree builder: the planes of an octree cut the surface, and each cell's piece gets a tight
//! sphere.
//!
//! The sphere of a piece starts as the small enclosing sphere of its corners and is moved inwards
//! along the mean normal, growing to contain the piece. A larger sphere with a deeper center bulges
//! less (`δ²/2R` for a flat piece of radius `δ`). Of a few such spheres the one with the smallest
//! outward error is kept. A cell whose sphere meets the target is a leaf; others are divided.
//!
//! With `even`, each leaf is then grown until it extends exactly `target` outside. The outermost
//! points of the leaves lie on one offset surface, so a flat face stays flat. A tree of one sphere
//! is not grown.
//!
//! Departs from the classic octree (spheres around cells) in all of this, but accepts any triangles
//! as that does.

use super::builder::{Built, Cell, Job, Progress, StageCount, TreeBuilder};
use super::sphere::{Sphere, around_points};
use crate::{MeshDistance, MeshError, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Maximum number of leaves of a tree.
const MAX_LEAVES: usize = 400_000;
/// Distances by which the sphere's center is moved inwards, in radii of the initial sphere.
const SHIFTS: [f64; 9] = [0.0, 0.3, 0.6, 1.0, 1.5, 2.2, 3.2, 4.5, 6.5];
/// Growth of each leaf, as a fraction of its initial radius, so that neighbors overlap by more than
/// rounding.
const OVERLAP: f64 = 0.01;

/// Depth above which the children of a cell are made on several threads.
const PARALLEL: u32 = 3;

/// A convex piece of one triangle.
type Piece = Vec<Vec3>;

struct Context<'a> {
    distance: &'a MeshDistance,
    /// Outward error at which a cell is not divided, meters.
    target: f64,
    depth: u32,
    even: bool,
    leaves: AtomicUsize,
    progress: &'a dyn Progress,
}

/// The octree builder.
pub(super) struct Octree;

impl TreeBuilder for Octree {
    fn build(&self, job: &Job) -> Result<Built, MeshError> {
        let (mesh, settings) = (job.mesh, job.settings);
        let bounds = mesh.aabb();
        let side = (bounds.max - bounds.min).max();
        let pieces = (0..mesh.triangles.len()).map(|t| mesh.corners(t).to_vec()).collect();
        let context = Context {
            distance: job.distance,
            target: settings.error * mesh.diagonal(),
            depth: settings.depth,
            even: settings.even,
            leaves: AtomicUsize::new(0),
            progress: job.progress,
        };
        let root = context.cell(pieces, 0.5 * (bounds.min + bounds.max), 0.5 * side, 0);
        let count = context.leaves.into_inner();
        if count > MAX_LEAVES {
            let (what, allowed) =
                ("the number of leaves of a sphere tree", "at most 400000: lower the depth or raise the error");
            return Err(MeshError::Settings { what, value: (MAX_LEAVES + 1) as f64, allowed });
        }
        let leaves = StageCount { level: settings.depth, stage: "leaves".into(), count: count as u64 };
        Ok(Built { root, stages: vec![leaves] })
    }
}

impl Context<'_> {
    /// Makes the cell of some pieces; its children on several threads, which changes nothing in it.
    fn cell(&self, pieces: Vec<Piece>, center: Vec3, half: f64, depth: u32) -> Cell {
        let (mut sphere, outward) = self.tight_sphere(&pieces);
        let fine = outward <= self.target || depth == self.depth;
        if fine || self.leaves.load(Ordering::Relaxed) > MAX_LEAVES || self.progress.stopped() {
            self.leaves.fetch_add(1, Ordering::Relaxed);
            // a root that is the only leaf has no neighbors to be even with
            if self.even && depth > 0 {
                sphere.radius += (self.target - outward).max(0.0);
            }
            return Cell::Leaf(sphere);
        }
        let mut parts = vec![pieces];
        for k in 0..3 {
            parts = parts.into_iter().flat_map(|p| cut(p, k, center[k])).collect();
        }
        // bit 2 of the index is the side on x, bit 1 on y, bit 0 on z
        let child = |(n, p): (usize, Vec<Piece>)| {
            let side = Vec3::from_fn(|k, _| if n >> (2 - k) & 1 == 1 { 0.5 } else { -0.5 });
            self.cell(p, center + side * half, 0.5 * half, depth + 1)
        };
        let parts: Vec<(usize, Vec<Piece>)> = parts.into_iter().enumerate().filter(|(_, p)| !p.is_empty()).collect();
        Cell::Inner(if depth < PARALLEL {
            parts.into_par_iter().map(child).collect()
        } else {
            parts.into_iter().map(child).collect()
        })
    }

    /// Returns the tried sphere with the smallest outward error, and that error.
    fn tight_sphere(&self, pieces: &[Piece]) -> (Sphere, f64) {
        let points: Vec<Vec3> = pieces.iter().flatten().copied().collect();
        let start = around_points(&points);
        let inward = -area_vector(pieces).try_normalize(0.0).unwrap_or_default();
        let tried = SHIFTS.map(|shift| {
            let mut sphere = Sphere::about(start.center + inward * (shift * start.radius), &points);
            sphere.radius += OVERLAP * start.radius;
            sphere
        });
        // the side of a center is asked for only where the sphere may be the best: if it is inside
        let near = tried.map(|sphere| self.distance.nearest(&sphere.center));
        let least = |k: usize| (tried[k].radius - near[k].distance()).max(0.0);
        let mut order: [usize; SHIFTS.len()] = std::array::from_fn(|k| k);
        order.sort_by(|a, b| least(*a).total_cmp(&least(*b)));
        let mut best = (usize::MAX, f64::INFINITY);
        for k in order {
            if least(k) > best.1 {
                break;
            }
            let outward = (tried[k].radius + self.distance.signed(&tried[k].center, &near[k])).max(0.0);
            // of equals the first
            if outward < best.1 || (outward == best.1 && k < best.0) {
                best = (k, outward);
            }
        }
        tried.get(best.0).map_or((start, f64::INFINITY), |sphere| (*sphere, best.1))
    }
}

/// Returns the sum of the pieces' areas times their normals, doubled.
fn area_vector(pieces: &[Piece]) -> Vec3 {
    pieces.iter().map(|p| p.windows(2).skip(1).map(|w| (w[0] - p[0]).cross(&(w[1] - p[0]))).sum::<Vec3>()).sum()
}

/// Cuts all pieces at `x_k = at` into those below and those above. A corner that a cut makes has
/// the same bits on both sides.
fn cut(pieces: Vec<Piece>, k: usize, at: f64) -> [Vec<Piece>; 2] {
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for piece in pieces {
        if piece.iter().all(|p| p[k] <= at) {
            below.push(piece);
        } else if piece.iter().all(|p| p[k] >= at) {
            above.push(piece);
        } else {
            let (low, high) = cut_one(&piece, k, at);
            below.push(low);
            above.push(high);
        }
    }
    [below, above]
}

fn cut_one(piece: &Piece, k: usize, at: f64) -> (Piece, Piece) {
    let (mut low, mut high) = (Piece::new(), Piece::new());
    for n in 0..piece.len() {
        let (p, q) = (piece[n], piece[(n + 1) % piece.len()]);
        if p[k] <= at {
            low.push(p);
        }
        if p[k] >= at {
            high.push(p);
        }
        if (p[k] < at && q[k] > at) || (p[k] > at && q[k] < at) {
            let mut crossing = p + (q - p) * ((at - p[k]) / (q[k] - p[k]));
            crossing[k] = at;
            low.push(crossing);
            high.push(crossing);
        }
    }
    (low, high)
}
