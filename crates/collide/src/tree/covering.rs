//! A cover of a surface by spheres, refined one sphere at a time.
//!
//! The surface is split into small pieces of triangles. Each piece belongs to one sphere, which
//! contains it: a piece lies in a sphere iff its corners do. So the spheres cover the surface at
//! all times. A sphere about `c` with the pieces `P` extends outside the solid by at most
//!
//! ```text
//! need(c, P) = max over the corners p of P of |p − c| + s(c)
//! ```
//!
//! where `s` is the signed distance of the center, negative inside. [`Covering::refine`] divides
//! the sphere of the greatest need into two, at the mean of its pieces, across their principal axes
//! and some others. The two spheres of the best division select their pieces again and are fitted
//! again. Neither half has a greater need than the whole, as the old sphere would contain both. So
//! the greatest need never increases with the number of spheres. [`Covering::suggest`] uses centers
//! from elsewhere, such as those of a tree, if they are better.

use super::grow_to_cover::halves_of;
use super::nelder_mead::nelder_mead;
use super::sphere::{Sphere, around_points};
use crate::{Mat3, MeshDistance, TriMesh, Vec3};
use nalgebra::SymmetricEigen;
use rayon::prelude::*;

/// Number of pieces that the surface is split into initially.
const INITIAL_PIECES: usize = 4000;
/// Maximum number of pieces.
const MAX_PIECES: usize = 4_000_000;
/// The pieces of a sphere with fewer are halved before the sphere is divided. Suggested centers are
/// tried only with this many pieces per center.
const MIN_SPHERE_PIECES: usize = 100;
/// The pieces of a sphere that is to be divided are halved until none is longer than this fraction
/// of its radius, or until there are `MAX_SPHERE_PIECES`.
const PIECE_SIZE: f64 = 0.2;
const MAX_SPHERE_PIECES: usize = 2000;
/// Number of divisions whose spheres are fitted, the best by bounding boxes.
const FITTED_SPLITS: usize = 2;
/// Smallest piece that is halved, as a fraction of the diagonal.
const MIN_PIECE: f64 = 1e-9;
/// Maximum number of fitting rounds.
const MAX_REFITS: usize = 6;
/// Maximum number of pairs of a piece and a sphere that one round compares.
const MAX_CHOICES: usize = 100_000_000;
/// Evaluations of the search for a center.
const EVALUATIONS: usize = 60;
/// Relative growth of the spheres, so that containment holds in floating point.
const ROUNDING: f64 = 1e-12;

/// Spheres that cover a surface.
#[derive(Clone, Debug)]
pub struct Covering {
    distance: MeshDistance,
    pieces: Vec<[Vec3; 3]>,
    spheres: Vec<PieceSphere>,
    small: f64,
}

/// A sphere with its pieces.
#[derive(Clone, Debug)]
struct PieceSphere {
    sphere: Sphere,
    /// Meters; at least 0.
    outward: f64,
    pieces: Vec<u32>,
    /// Whether the sphere cannot be divided.
    indivisible: bool,
}

impl Covering {
    /// Returns one sphere around the surface `given`, which need not be closed. Outward errors are
    /// measured from `solid`, a closed, outward-wound mesh. Both need at least one triangle.
    pub fn new(given: &TriMesh, solid: &TriMesh) -> Covering {
        let (distance, pieces) = (MeshDistance::new(solid), initial_pieces(given));
        let mut covering = Covering { distance, spheres: Vec::new(), small: MIN_PIECE * given.diagonal(), pieces };
        covering.spheres = vec![covering.fit_sphere((0..covering.pieces.len() as u32).collect(), &[])];
        covering
    }

    /// Returns the number of spheres.
    pub fn count(&self) -> usize {
        self.spheres.len()
    }

    /// Returns the center and radius of each sphere, and its outward error, meters.
    pub fn spheres(&self) -> impl Iterator<Item = (Vec3, f64, f64)> {
        self.spheres.iter().map(|entry| (entry.sphere.center, entry.sphere.radius, entry.outward))
    }

    /// Returns the largest outward error, meters.
    pub fn worst(&self) -> f64 {
        worst(&self.spheres)
    }

    /// Divides the sphere with the largest outward error into two. Returns `false` if no sphere can
    /// be divided.
    pub fn refine(&mut self) -> bool {
        loop {
            let candidates = (0..self.spheres.len()).filter(|k| !self.spheres[*k].indivisible);
            let Some(worst) =
                candidates.max_by(|a, b| self.spheres[*a].outward.total_cmp(&self.spheres[*b].outward).then(b.cmp(a)))
            else {
                return false;
            };
            match self.split_sphere(worst) {
                Some([one, other]) => {
                    self.spheres[worst] = one;
                    self.spheres.push(other);
                    return true;
                }
                None => self.spheres[worst].indivisible = true,
            }
        }
    }

    /// Uses spheres about these centers, fitted to the pieces assigned to them, if they have a
    /// smaller outward error and are at most `most`. Returns whether they are used.
    pub fn suggest(&mut self, centers: &[Vec3], most: usize) -> bool {
        if centers.is_empty() {
            return false;
        }
        while self.pieces.len() < MIN_SPHERE_PIECES * centers.len() {
            let before = self.pieces.len();
            (0..self.spheres.len())
                .for_each(|k| _ = self.halve_pieces(k, PIECE_SIZE * self.spheres[k].sphere.radius / 4.0));
            if self.pieces.len() == before {
                break;
            }
        }
        let all: Vec<u32> = (0..self.pieces.len() as u32).collect();
        let mut best = self.fitted(&all, centers);
        for _ in 1..MAX_REFITS {
            let centers: Vec<Vec3> = best.iter().map(|entry| entry.sphere.center).collect();
            let next = self.fitted(&all, &centers);
            if worst(&next) >= worst(&best) {
                break;
            }
            best = next;
        }
        let better = best.len() <= most && worst(&best) < self.worst();
        if better {
            self.spheres = best;
        }
        better
    }

    /// Calls [`Covering::suggest`] with the present centers: pieces can change their spheres. Does
    /// nothing if there are too many pairs of pieces and spheres.
    pub fn settle(&mut self) -> bool {
        if self.pieces.len() * self.spheres.len() > MAX_CHOICES {
            return false;
        }
        let centers: Vec<Vec3> = self.spheres.iter().map(|entry| entry.sphere.center).collect();
        self.suggest(&centers, centers.len())
    }

    /// Fits the sphere of a set of pieces. The search starts at the center of the smallest sphere
    /// or at one of `tried`, and minimizes the need.
    fn fit_sphere(&self, pieces: Vec<u32>, tried: &[Vec3]) -> PieceSphere {
        let points: Vec<Vec3> = pieces.iter().flat_map(|n| self.pieces[*n as usize]).collect();
        let start = around_points(&points);
        let mut best = (f64::INFINITY, start);
        let mut judge = |c: &Vec3| {
            let mut sphere = Sphere::about(*c, &points);
            sphere.radius *= 1.0 + ROUNDING;
            let need = sphere.radius + self.distance.closest(c).signed_distance;
            if need < best.0 {
                best = (need, sphere);
            }
            need
        };
        let first = tried
            .iter()
            .chain([&start.center])
            .map(|c| (judge(c), *c))
            .fold((f64::INFINITY, start.center), |a, b| if b.0 < a.0 { b } else { a });
        nelder_mead(first.1, 0.4 * start.radius, EVALUATIONS, &mut judge);
        PieceSphere { outward: best.0.max(0.0), sphere: best.1, pieces, indivisible: false }
    }

    /// Assigns each piece to the center with the smallest need, and fits a sphere to the pieces of
    /// each center. Centers without pieces are left out.
    fn fitted(&self, pieces: &[u32], centers: &[Vec3]) -> Vec<PieceSphere> {
        let depths: Vec<f64> = centers.iter().map(|c| self.distance.closest(c).signed_distance).collect();
        let chosen: Vec<usize> = pieces
            .par_iter()
            .map(|n| {
                let corners = &self.pieces[*n as usize];
                let mut least = (f64::INFINITY, 0);
                for (k, (center, depth)) in centers.iter().zip(&depths).enumerate() {
                    let bar = least.0 - depth;
                    let square = corners.iter().map(|p| (p - center).norm_squared()).fold(0.0, f64::max);
                    if bar > 0.0 && square < bar * bar {
                        least = (square.sqrt() + depth, k);
                    }
                }
                least.1
            })
            .collect();
        let mut parts: Vec<Vec<u32>> = vec![Vec::new(); centers.len()];
        pieces.iter().zip(chosen).for_each(|(n, k)| parts[k].push(*n));
        parts
            .into_par_iter()
            .zip(centers)
            .filter(|(part, _)| !part.is_empty())
            .map(|(part, center)| self.fit_sphere(part, &[*center]))
            .collect()
    }

    fn split_sphere(&mut self, worst: usize) -> Option<[PieceSphere; 2]> {
        while self.spheres[worst].pieces.len() < MIN_SPHERE_PIECES {
            self.halve_pieces(worst, self.small)?;
        }
        // both halves would have to contain long pieces
        let fine = PIECE_SIZE * self.spheres[worst].sphere.radius;
        while self.spheres[worst].pieces.len() < MAX_SPHERE_PIECES && self.halve_pieces(worst, fine).is_some() {}
        let (pieces, old) = (&self.spheres[worst].pieces, self.spheres[worst].sphere.center);
        let middles: Vec<Vec3> = pieces.iter().map(|n| self.pieces[*n as usize].iter().sum::<Vec3>() / 3.0).collect();
        let mean = middles.iter().sum::<Vec3>() / middles.len() as f64;
        let covariance: Mat3 = middles.iter().map(|m| (m - mean) * (m - mean).transpose()).sum();
        let across = |axis: &Vec3| {
            let (one, other): (Vec<_>, Vec<_>) =
                pieces.iter().zip(&middles).partition(|(_, m)| (*m - mean).dot(axis) < 0.0);
            [one, other].map(|half| half.into_iter().map(|(n, _)| *n).collect::<Vec<u32>>())
        };
        let partitions: Vec<[Vec<u32>; 2]> = directions(&covariance)
            .iter()
            .map(across)
            .filter(|[one, other]| !one.is_empty() && !other.is_empty())
            .collect();
        let mut ranked: Vec<(f64, [Vec<u32>; 2])> = partitions
            .into_iter()
            .map(|halves| (self.box_estimate(&halves[0]).max(self.box_estimate(&halves[1])), halves))
            .collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        ranked.truncate(FITTED_SPLITS);
        // the old sphere contains either half, so neither has a greater need
        let fit = |(_, halves): (f64, [Vec<u32>; 2])| self.refitted(halves.map(|half| self.fit_sphere(half, &[old])));
        ranked.into_par_iter().map(fit).collect::<Vec<_>>().into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }

    /// Returns the need of the sphere about the middle of the pieces' bounding box, meters.
    fn box_estimate(&self, pieces: &[u32]) -> f64 {
        let points = || pieces.iter().flat_map(|n| self.pieces[*n as usize]);
        let bounds = crate::Aabb::around(points());
        let middle = 0.5 * (bounds.min + bounds.max);
        let square = points().map(|p| (p - middle).norm_squared()).fold(0.0, f64::max);
        square.sqrt() + self.distance.closest(&middle).signed_distance
    }

    /// Reassigns the pieces between the two spheres as long as that helps.
    fn refitted(&self, mut pair: [PieceSphere; 2]) -> [PieceSphere; 2] {
        for _ in 0..MAX_REFITS {
            let all: Vec<u32> = pair.iter().flat_map(|entry| entry.pieces.iter().copied()).collect();
            let next = self.fitted(&all, &[pair[0].sphere.center, pair[1].sphere.center]);
            match <[PieceSphere; 2]>::try_from(next) {
                Ok(next) if worst(&next) <= worst(&pair) && cost(&next) < cost(&pair) => pair = next,
                _ => break,
            }
        }
        pair
    }

    /// Halves the pieces of a sphere that are larger than `larger`. Returns `None` if there is
    /// none, or if the maximum number of pieces is reached.
    fn halve_pieces(&mut self, sphere: usize, larger: f64) -> Option<()> {
        if self.pieces.len() + self.spheres[sphere].pieces.len() > MAX_PIECES {
            return None;
        }
        let mut new = Vec::new();
        for n in &self.spheres[sphere].pieces {
            let (size, [one, other]) = halves_of(&self.pieces[*n as usize]);
            if size > larger.max(self.small) {
                self.pieces[*n as usize] = one;
                new.push(self.pieces.len() as u32);
                self.pieces.push(other);
            }
        }
        let some = !new.is_empty();
        self.spheres[sphere].pieces.extend(new);
        some.then_some(())
    }
}

/// Returns the principal axes, the directions half-way between two of them, and the coordinate
/// axes. Between equal principal values any axes are principal axes, for instance the diagonals of
/// a square.
fn directions(covariance: &Mat3) -> Vec<Vec3> {
    let axes = SymmetricEigen::new(*covariance).eigenvectors;
    let [u, v, w] = [0, 1, 2].map(|k| axes.column(k).into_owned());
    vec![u, v, w, u + v, u - v, v + w, v - w, w + u, w - u, Vec3::x(), Vec3::y(), Vec3::z()]
}

fn worst(spheres: &[PieceSphere]) -> f64 {
    spheres.iter().map(|entry| entry.outward).fold(0.0, f64::max)
}

/// The larger outward error, plus a small part of the sum.
fn cost(pair: &[PieceSphere; 2]) -> f64 {
    worst(pair) + 1e-3 * (pair[0].outward + pair[1].outward)
}

/// Splits the longest triangles until the initial number of pieces is reached.
fn initial_pieces(mesh: &TriMesh) -> Vec<[Vec3; 3]> {
    let mut pieces: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
    while pieces.len() < INITIAL_PIECES {
        let sizes: Vec<f64> = pieces.iter().map(|p| halves_of(p).0).collect();
        // all pieces within a factor of the longest at once
        let bar = 0.7 * sizes.iter().copied().fold(0.0, f64::max);
        for n in 0..sizes.len() {
            if sizes[n] >= bar {
                let [one, other] = halves_of(&pieces[n]).1;
                pieces[n] = one;
                pieces.push(other);
            }
        }
    }
    pieces
}
