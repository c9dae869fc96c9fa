//! A cover of the union of shapes by spheres, refined one sphere at a time.
//!
//! The outer surface of the union is split into small pieces ([`pieces`]). Each piece belongs to one
//! sphere, which contains it. So the spheres cover the surface at all times. A sphere about `c` with
//! the pieces `P` extends outside the union by at most
//!
//! ```text
//! need(c, P) = max over the pieces p of P of reach(c, p) + s(c)
//! ```
//!
//! where `reach(c, p)` is the radius of the smallest sphere about `c` that contains `p`, and `s` the
//! signed distance of the center to the union, negative inside. [`Covering::refine`] divides
//! the sphere of the greatest need into two, at the mean of its pieces, across their principal axes
//! and some others. The two spheres of the best division select their pieces again and are fitted
//! again. Neither half has a greater need than the whole, as the old sphere would contain both. So
//! the greatest need never increases with the number of spheres. [`Covering::suggest`] uses centers
//! from elsewhere, such as those of a tree, if they are better. [`Covering::improve`] also removes a
//! sphere whose pieces others can take, and divides the worst one instead.
//!
//! With a coverage below 1, the pieces of greatest need are left out, up to that share of the area,
//! each time the pieces are assigned to centers.

mod pieces;

use super::nelder_mead::nelder_mead;
use super::sphere::{SEARCH_TRIANGLES, Sphere, around_points};
use crate::{Mat3, MeshDistance, Vec3};
use nalgebra::SymmetricEigen;
use pieces::outer_pieces;
pub use pieces::{CoveredShape, SurfacePiece};
use rayon::prelude::*;

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
/// Longest side of a piece at the rim of the covered surface, as a fraction of the diagonal.
const RIM: f64 = 5e-3;
/// Number of times that pieces at the rim are halved after each new sphere.
const RIM_ROUNDS: usize = 2;
/// Maximum number of fitting rounds.
const MAX_REFITS: usize = 6;
/// Maximum number of pairs of a piece and a sphere that one round compares.
const MAX_CHOICES: usize = 100_000_000;
/// Evaluations of the search for a center.
const EVALUATIONS: usize = 60;
/// Maximum number of searches of a sphere, each with one piece more.
const MAX_SEARCHES: usize = 8;
/// Maximum number of pairs of a piece and a sphere for the rearrangement after each new sphere.
const MAX_IMPROVED_CHOICES: usize = 3_000_000;
/// Maximum number of exchanges in one rearrangement.
const MAX_EXCHANGES: usize = 4;
/// Exponent of the sum of outward errors that is minimized beside the largest.
const POWER: i32 = 8;
/// Smallest relative gain that counts.
const MIN_GAIN: f64 = 1e-3;
/// Relative growth of the spheres, so that containment holds in floating point.
const ROUNDING: f64 = 1e-12;

/// Spheres that cover the outer surface of a union of shapes.
#[derive(Clone, Debug)]
pub struct Covering {
    distance: MeshDistance,
    pieces: Vec<SurfacePiece>,
    spheres: Vec<PieceSphere>,
    /// Area of the outer surface, and the part of it that may be left uncovered, m².
    area: f64,
    spare: f64,
    small: f64,
    /// Longest side of a piece at the rim of the covered surface, meters.
    rim: f64,
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

/// A sphere of a [`Covering`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoveringSphere {
    /// Meters, in the frame of the shapes.
    pub center: Vec3,
    /// Meters.
    pub radius: f64,
    /// Upper bound of how far it extends outside the union, meters.
    pub outward: f64,
    /// Index of the shape that most of its pieces belong to.
    pub shape: usize,
}

impl Covering {
    /// Returns one sphere around the shapes to be covered, `None` if other shapes hide all of their
    /// surface. Outward errors are measured from the union of all shapes. `coverage` is the share of
    /// the area that is covered at least, above 0 and at most 1. Shapes need at least one triangle.
    pub fn new(shapes: &[CoveredShape], coverage: f64) -> Option<Covering> {
        let union = CoveredShape::union(shapes);
        let pieces = outer_pieces(shapes, union.diagonal());
        if pieces.is_empty() {
            return None;
        }
        let area = pieces.iter().map(SurfacePiece::area).sum::<f64>();
        let spare = (1.0 - coverage) * area;
        let [small, rim] = [MIN_PIECE, RIM].map(|share| share * union.diagonal());
        let mut covering =
            Covering { distance: MeshDistance::new(&union), spheres: Vec::new(), area, spare, small, rim, pieces };
        covering.spheres = vec![covering.fit_sphere((0..covering.pieces.len() as u32).collect(), &[])];
        covering.rebalance();
        Some(covering)
    }

    /// Returns the share of the outer surface, by area, that is proved to be covered: of pieces that
    /// lie in one sphere. The surface of the meshes is measured, not that of round shapes.
    pub fn coverage(&self) -> f64 {
        if self.spare <= 0.0 {
            return 1.0;
        }
        let covered = |piece: &SurfacePiece| {
            self.spheres.iter().any(|entry| piece.reach(&entry.sphere.center) <= entry.sphere.radius)
        };
        let areas: Vec<(f64, f64)> = self
            .pieces
            .par_iter()
            .map(|piece| (piece.area(), if covered(piece) { piece.area() } else { 0.0 }))
            .collect();
        areas.iter().map(|a| a.1).sum::<f64>() / areas.iter().map(|a| a.0).sum::<f64>()
    }

    /// Lets the spheres cover less: at least the share `coverage` of the outer surface, above 0 and at most
    /// that of before. They reach no further outside. Does nothing for a larger share.
    pub fn loosen(&mut self, coverage: f64) {
        let spare = (1.0 - coverage) * self.area;
        if spare > self.spare {
            self.spare = spare;
            self.rebalance();
            self.improve();
        }
    }

    /// Halves the pieces in spheres, the longest first, until there are `count` in all, if they can be halved:
    /// what is covered is known more exactly then.
    pub fn split_pieces(&mut self, count: usize) {
        let longest = |piece: &SurfacePiece| piece.halves().0;
        let mut size = self.pieces.iter().map(longest).fold(0.0, f64::max);
        while self.pieces.len() < count && size > self.small {
            size *= 0.7;
            (0..self.count()).for_each(|k| _ = self.halve_pieces(k, size));
        }
    }

    /// Returns the pieces of the outer surface.
    pub fn pieces(&self) -> &[SurfacePiece] {
        &self.pieces
    }

    /// Returns the signed distance of a point to the union of the shapes, negative inside, meters. Round
    /// shapes are the meshes that stand for them.
    pub fn signed_distance(&self, point: &Vec3) -> f64 {
        self.distance.closest(point).signed_distance
    }

    /// Returns the number of spheres.
    pub fn count(&self) -> usize {
        self.spheres.len()
    }

    /// Returns the spheres.
    pub fn spheres(&self) -> impl Iterator<Item = CoveringSphere> {
        self.spheres.iter().map(|entry| CoveringSphere {
            center: entry.sphere.center,
            radius: entry.sphere.radius,
            outward: entry.outward,
            shape: self.owner(entry),
        })
    }

    fn owner(&self, entry: &PieceSphere) -> usize {
        let mut counts: Vec<usize> = Vec::new();
        for n in &entry.pieces {
            let shape = self.pieces[*n as usize].shape as usize;
            counts.resize(counts.len().max(shape + 1), 0);
            counts[shape] += 1;
        }
        (0..counts.len()).max_by_key(|k| (counts[*k], std::cmp::Reverse(*k))).unwrap_or(0)
    }

    /// Returns the largest outward error, meters.
    pub fn worst(&self) -> f64 {
        worst(&self.spheres)
    }

    /// Divides the sphere with the largest outward error into two. Returns `false` if no sphere can
    /// be divided.
    pub fn refine(&mut self) -> bool {
        let divided = self.divide_worst();
        if divided {
            self.rebalance();
        }
        divided
    }

    /// Assigns all pieces again as long as that helps, if some may be left out.
    fn rebalance(&mut self) {
        if self.spare > 0.0 {
            for _ in 0..RIM_ROUNDS {
                self.settle();
                self.halve_rims();
            }
            self.settle();
        }
    }

    /// Halves the pieces that are left out and reach into a sphere, so that the area which is covered
    /// by half a piece counts.
    fn halve_rims(&mut self) {
        let mut kept = vec![false; self.pieces.len()];
        self.spheres.iter().flat_map(|entry| &entry.pieces).for_each(|n| kept[*n as usize] = true);
        for n in (0..kept.len()).filter(|n| !kept[*n]) {
            let middle = self.pieces[n].middle();
            let size = self.pieces[n].reach(&middle);
            let near = |entry: &PieceSphere| (middle - entry.sphere.center).norm() < entry.sphere.radius + size;
            let (longest, [one, other]) = self.pieces[n].halves();
            if longest > self.rim && self.pieces.len() < MAX_PIECES && self.spheres.iter().any(near) {
                self.pieces[n] = one;
                self.pieces.push(other);
            }
        }
    }

    /// Rearranges the spheres as long as that helps, up to a number of rounds: pieces change their
    /// spheres, and spheres their place. The largest outward error does not grow. Does nothing if
    /// there are too many pairs of pieces and spheres.
    pub fn improve(&mut self) {
        if self.pieces.len() * self.count() <= MAX_IMPROVED_CHOICES {
            self.settle();
            _ = (0..MAX_EXCHANGES).take_while(|_| self.exchange()).count();
        }
    }

    /// Gives the pieces of one sphere to the others and divides the worst one instead, if the
    /// spheres are better then. Returns whether they are.
    fn exchange(&mut self) -> bool {
        let Some((_, removed)) = self.most_dispensable().filter(|(need, _)| *need < self.worst()) else { return false };
        let mut changed = self.clone();
        let orphans = changed.spheres.swap_remove(removed).pieces;
        changed.adopt(&orphans);
        let better = changed.divide_worst() && is_better(&changed.spheres, &self.spheres);
        if better {
            *self = changed;
        }
        better
    }

    /// Gives each of the pieces to the sphere with the smallest need, and fits those spheres again.
    fn adopt(&mut self, orphans: &[u32]) {
        let centers: Vec<Vec3> = self.spheres.iter().map(|entry| entry.sphere.center).collect();
        for (part, entry) in self.assigned(orphans, &centers, 0.0).into_iter().zip(0..) {
            if !part.is_empty() {
                let own: Vec<u32> = self.spheres[entry].pieces.iter().chain(&part).copied().collect();
                self.spheres[entry] = self.fit_sphere(own, &[centers[entry]]);
            }
        }
    }

    /// Returns the sphere without which the greatest need of its pieces is the least, and that
    /// need, meters.
    fn most_dispensable(&self) -> Option<(f64, usize)> {
        let depths = self.depths(self.spheres.iter().map(|entry| entry.sphere.center));
        let need_elsewhere = |k: usize| {
            let other = |piece: &SurfacePiece| {
                let needs = (0..self.count())
                    .filter(|j| *j != k)
                    .map(|j| piece.reach(&self.spheres[j].sphere.center) + depths[j]);
                needs.fold(f64::INFINITY, f64::min)
            };
            self.spheres[k].pieces.iter().map(|n| other(&self.pieces[*n as usize])).fold(0.0, f64::max)
        };
        if self.count() < 3 {
            return None;
        }
        let needs: Vec<f64> = (0..self.count()).into_par_iter().map(need_elsewhere).collect();
        (0..needs.len()).map(|k| (needs[k], k)).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Divides the sphere with the largest outward error that can be divided.
    fn divide_worst(&mut self) -> bool {
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

    /// Uses spheres about these centers, fitted to the pieces assigned to them, if their largest
    /// outward error is not larger, they are better together, and are at most `most`. Returns
    /// whether they are used.
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
        let all = self.all();
        let mut best = self.fitted(&all, centers, self.spare);
        for _ in 1..MAX_REFITS {
            let centers: Vec<Vec3> = best.iter().map(|entry| entry.sphere.center).collect();
            let next = self.fitted(&all, &centers, self.spare);
            if power_sum(&next) >= power_sum(&best) {
                break;
            }
            best = next;
        }
        let better = best.len() <= most && is_better(&best, &self.spheres);
        if better {
            self.spheres = best;
        }
        better
    }

    fn all(&self) -> Vec<u32> {
        (0..self.pieces.len() as u32).collect()
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

    /// Fits the sphere of a set of pieces: minimizes the need from one of `tried` or from the center
    /// of a small sphere. The search knows the outermost pieces in some directions and those that
    /// its results left out; needs are of all pieces.
    fn fit_sphere(&self, pieces: Vec<u32>, tried: &[Vec3]) -> PieceSphere {
        let own: Vec<SurfacePiece> = pieces.iter().map(|n| self.pieces[*n as usize]).collect();
        let mut outermost = outermost(&own);
        let start = around_points(&outermost.iter().flat_map(|piece| piece.corners).collect::<Vec<Vec3>>());
        let mut best = (f64::INFINITY, start);
        let mut judge = |center: Vec3| {
            let (reach, far) = own
                .iter()
                .map(|piece| (piece.reach(&center), piece))
                .fold((0.0, None), |best, one| if one.0 > best.0 { (one.0, Some(one.1)) } else { best });
            let sphere = Sphere { center, radius: reach * (1.0 + ROUNDING) };
            let need = sphere.outward(&self.distance);
            if need < best.0 {
                best = (need, sphere);
            }
            (need, center, far)
        };
        let mut from = (judge(start.center), 0.4 * start.radius);
        for center in tried {
            let one = judge(*center);
            if one.0 < from.0.0 {
                from.0 = one;
            }
        }
        for _ in 0..MAX_SEARCHES {
            let (expected, center) = self.search(&outermost, from.0.1, from.1);
            let found = judge(center);
            match found.2 {
                Some(far) if found.0 > expected * (1.0 + MIN_GAIN) && !outermost.contains(far) => outermost.push(*far),
                _ => break,
            }
            from = (found, 0.1 * start.radius);
        }
        PieceSphere { outward: best.0, sphere: best.1, pieces, indivisible: false }
    }

    /// Returns the least need of pieces that a search from a center finds, and its center.
    fn search(&self, pieces: &[SurfacePiece], from: Vec3, step: f64) -> (f64, Vec3) {
        let mut best = (f64::INFINITY, from);
        nelder_mead(from, step, EVALUATIONS, |c| {
            let reach = pieces.iter().map(|piece| piece.reach(c)).fold(0.0, f64::max);
            let need = reach + self.distance.closest_approximate(c, SEARCH_TRIANGLES).signed_distance;
            if need < best.0 {
                best = (need, *c);
            }
            need
        });
        best
    }

    fn depths(&self, centers: impl Iterator<Item = Vec3>) -> Vec<f64> {
        centers.map(|c| self.distance.closest(&c).signed_distance).collect()
    }

    /// Assigns pieces to centers, and fits a sphere to the pieces of each. Centers without pieces are
    /// left out.
    fn fitted(&self, pieces: &[u32], centers: &[Vec3], spare: f64) -> Vec<PieceSphere> {
        self.assigned(pieces, centers, spare)
            .into_par_iter()
            .zip(centers)
            .filter(|(part, _)| !part.is_empty())
            .map(|(part, center)| self.fit_sphere(part, &[*center]))
            .collect()
    }

    /// Returns for each center the pieces for which it has the smallest need, without those of the
    /// greatest need, up to the area `spare`.
    fn assigned(&self, pieces: &[u32], centers: &[Vec3], spare: f64) -> Vec<Vec<u32>> {
        let depths = self.depths(centers.iter().copied());
        let mut chosen: Vec<(f64, usize, u32)> = pieces
            .par_iter()
            .map(|n| {
                let piece = &self.pieces[*n as usize];
                let mut least = (f64::INFINITY, 0);
                for (k, (center, depth)) in centers.iter().zip(&depths).enumerate() {
                    let bar = least.0 - depth - piece.bulge;
                    let square = piece.corners.iter().map(|p| (p - center).norm_squared()).fold(0.0, f64::max);
                    if bar > 0.0 && square < bar * bar {
                        least = (square.sqrt() + depth + piece.bulge, k);
                    }
                }
                (least.0, least.1, *n)
            })
            .collect();
        if spare > 0.0 {
            self.leave_out(&mut chosen, spare);
        }
        let mut parts: Vec<Vec<u32>> = vec![Vec::new(); centers.len()];
        chosen.into_iter().for_each(|(_, k, n)| parts[k].push(n));
        parts
    }

    /// Removes the pieces of the greatest need whose area together is at most `spare`; one stays.
    fn leave_out(&self, chosen: &mut Vec<(f64, usize, u32)>, mut spare: f64) {
        chosen.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        while chosen.len() > 1 {
            spare -= chosen.last().map_or(0.0, |last| self.pieces[last.2 as usize].area());
            if spare < 0.0 {
                break;
            }
            chosen.pop();
        }
    }

    fn split_sphere(&mut self, worst: usize) -> Option<[PieceSphere; 2]> {
        while self.spheres[worst].pieces.len() < MIN_SPHERE_PIECES {
            self.halve_pieces(worst, self.small)?;
        }
        // both halves would have to contain long pieces
        let fine = PIECE_SIZE * self.spheres[worst].sphere.radius;
        while self.spheres[worst].pieces.len() < MAX_SPHERE_PIECES && self.halve_pieces(worst, fine).is_some() {}
        let (pieces, old) = (&self.spheres[worst].pieces, self.spheres[worst].sphere.center);
        let middles: Vec<Vec3> = pieces.iter().map(|n| self.pieces[*n as usize].middle()).collect();
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
        let points = || pieces.iter().flat_map(|n| self.pieces[*n as usize].corners);
        let bounds = crate::Aabb::around(points());
        let middle = 0.5 * (bounds.min + bounds.max);
        let square = points().map(|p| (p - middle).norm_squared()).fold(0.0, f64::max);
        square.sqrt() + self.distance.closest(&middle).signed_distance
    }

    /// Reassigns the pieces between the two spheres as long as that helps.
    fn refitted(&self, mut pair: [PieceSphere; 2]) -> [PieceSphere; 2] {
        for _ in 0..MAX_REFITS {
            let all: Vec<u32> = pair.iter().flat_map(|entry| entry.pieces.iter().copied()).collect();
            let next = self.fitted(&all, &[pair[0].sphere.center, pair[1].sphere.center], 0.0);
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
            let (size, [one, other]) = self.pieces[*n as usize].halves();
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

/// Returns the pieces that are outermost in some directions.
fn outermost(pieces: &[SurfacePiece]) -> Vec<SurfacePiece> {
    let signs = [-1.0, 0.0, 1.0];
    let directions = signs.iter().flat_map(|x| signs.iter().flat_map(move |y| signs.map(|z| Vec3::new(*x, *y, z))));
    let mut outermost: Vec<SurfacePiece> = Vec::new();
    for direction in directions {
        let height =
            |piece: &SurfacePiece| piece.corners.iter().map(|p| p.dot(&direction)).fold(f64::NEG_INFINITY, f64::max);
        let farthest = pieces.iter().map(|piece| (height(piece), piece)).reduce(|a, b| if b.0 > a.0 { b } else { a });
        if let Some((_, piece)) = farthest.filter(|one| !outermost.contains(one.1)) {
            outermost.push(*piece);
        }
    }
    outermost
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

/// Returns whether spheres have a largest outward error that is not larger, and a smaller sum of
/// powers: where all extend equally far, relieving one leads on. Fewer spheres, which have a smaller
/// sum anyway, need a smaller largest error.
fn is_better(spheres: &[PieceSphere], before: &[PieceSphere]) -> bool {
    let less = 1.0 - MIN_GAIN;
    if spheres.len() < before.len() {
        return worst(spheres) < less * worst(before);
    }
    worst(spheres) <= worst(before) && power_sum(spheres) < less * power_sum(before)
}

/// Returns the sum of a high power of the outward errors.
fn power_sum(spheres: &[PieceSphere]) -> f64 {
    spheres.iter().map(|entry| entry.outward.powi(POWER)).sum()
}

/// The larger outward error, plus a small part of the sum.
fn cost(pair: &[PieceSphere; 2]) -> f64 {
    worst(pair) + 1e-3 * (pair[0].outward + pair[1].outward)
}
