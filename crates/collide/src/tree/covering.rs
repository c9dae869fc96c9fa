//! Balls around a surface, one more at a time.
//!
//! The surface is split into small pieces of triangles. Each piece belongs to one ball, which holds it: a piece lies in a ball iff its corners do. So the balls
//! cover the surface at all times, whatever is done to them. What a ball about `c` with the pieces `P` needs to reach outside the solid is at most
//!
//! ```text
//! need(c, P) = max over the corners p of P of |p − c| + s(c)
//! ```
//!
//! `s` the signed distance of the centre, negative inside. [`Covering::refine`] divides the ball of the greatest need into two: at the middle of its pieces, across
//! their principal and some other axes, and the two balls of the way that comes out best choose their pieces anew and are fitted again. Either half has no greater need than the whole,
//! as the old ball would do for both. So the greatest need never rises with the number of balls. [`Covering::suggest`] takes centres from elsewhere, such as a
//! tree's, where they do better.

use super::ball::{Ball, around_points};
use super::close::halved;
use super::simplex::simplex;
use crate::{Mat3, MeshDistance, TriMesh, Vec3};
use nalgebra::SymmetricEigen;
use rayon::prelude::*;

/// Pieces that the surface is split into at first.
const FIRST: usize = 4000;
/// Pieces in all.
const MOST: usize = 4_000_000;
/// A ball of fewer pieces has them halved before it is divided; all together have as many times the balls before centres from elsewhere are looked at.
const FEWEST: usize = 100;
/// Pieces of a ball that is to be divided are halved until none is longer than this part of its radius, or they are so many.
const FINE: f64 = 0.2;
const MOST_OF_ONE: usize = 2000;
/// Ways of dividing whose balls are fitted, the most promising by boxes.
const FITTED: usize = 2;
/// Pieces smaller than this part of the diagonal are not halved.
const SMALL: f64 = 1e-9;
/// Rounds of fitting anew.
const ROUNDS: usize = 6;
/// Pairs of a piece and a ball that may be looked at in a round.
const MOST_CHOICES: usize = 100_000_000;
/// Evaluations of the search for a centre.
const EVALUATIONS: usize = 60;
/// Balls are larger by this share, so that they hold what they should in floating point.
const ROUNDING: f64 = 1e-12;

/// Balls that cover a surface.
#[derive(Clone, Debug)]
pub struct Covering {
    distance: MeshDistance,
    pieces: Vec<[Vec3; 3]>,
    balls: Vec<Own>,
    small: f64,
}

/// A ball with its pieces.
#[derive(Clone, Debug)]
struct Own {
    ball: Ball,
    /// Metres; at least 0.
    outward: f64,
    pieces: Vec<u32>,
    /// It cannot be divided.
    whole: bool,
}

impl Covering {
    /// One ball around the surface `given`, which need not be closed; how far balls reach outside is measured from `solid`: closed, outward-wound. Both of at
    /// least one triangle.
    pub fn new(given: &TriMesh, solid: &TriMesh) -> Covering {
        let (distance, pieces) = (MeshDistance::new(solid), split(given));
        let mut covering = Covering { distance, balls: Vec::new(), small: SMALL * given.diagonal(), pieces };
        covering.balls = vec![covering.own((0..covering.pieces.len() as u32).collect(), &[])];
        covering
    }

    /// Number of balls.
    pub fn count(&self) -> usize {
        self.balls.len()
    }

    /// Centre and radius of each, metres, and how far it reaches outside the solid at most.
    pub fn balls(&self) -> impl Iterator<Item = (Vec3, f64, f64)> {
        self.balls.iter().map(|own| (own.ball.center, own.ball.radius, own.outward))
    }

    /// The most that a ball reaches outside, metres.
    pub fn worst(&self) -> f64 {
        worst(&self.balls)
    }

    /// Divides the ball that reaches furthest outside into two; `false` where none can be divided.
    pub fn refine(&mut self) -> bool {
        loop {
            let candidates = (0..self.balls.len()).filter(|k| !self.balls[*k].whole);
            let Some(worst) =
                candidates.max_by(|a, b| self.balls[*a].outward.total_cmp(&self.balls[*b].outward).then(b.cmp(a)))
            else {
                return false;
            };
            match self.divided(worst) {
                Some([one, other]) => {
                    self.balls[worst] = one;
                    self.balls.push(other);
                    return true;
                }
                None => self.balls[worst].whole = true,
            }
        }
    }

    /// Takes balls about these centres, fitted to the pieces that they get, if they reach out less and are no more than `most`. Whether they were taken.
    pub fn suggest(&mut self, centers: &[Vec3], most: usize) -> bool {
        if centers.is_empty() {
            return false;
        }
        while self.pieces.len() < FEWEST * centers.len() {
            let before = self.pieces.len();
            (0..self.balls.len()).for_each(|k| _ = self.halve_pieces(k, FINE * self.balls[k].ball.radius / 4.0));
            if self.pieces.len() == before {
                break;
            }
        }
        let all: Vec<u32> = (0..self.pieces.len() as u32).collect();
        let mut best = self.fitted(&all, centers);
        for _ in 1..ROUNDS {
            let centers: Vec<Vec3> = best.iter().map(|own| own.ball.center).collect();
            let next = self.fitted(&all, &centers);
            if worst(&next) >= worst(&best) {
                break;
            }
            best = next;
        }
        let better = best.len() <= most && worst(&best) < self.worst();
        if better {
            self.balls = best;
        }
        better
    }

    /// [`Covering::suggest`] with the centres there are: pieces may change their balls. Nothing is done where they are too many.
    pub fn settle(&mut self) -> bool {
        if self.pieces.len() * self.balls.len() > MOST_CHOICES {
            return false;
        }
        let centers: Vec<Vec3> = self.balls.iter().map(|own| own.ball.center).collect();
        self.suggest(&centers, centers.len())
    }

    /// The ball of a set of pieces: around the smallest ball's centre or one of `tried`, moved to where its need is less.
    fn own(&self, pieces: Vec<u32>, tried: &[Vec3]) -> Own {
        let points: Vec<Vec3> = pieces.iter().flat_map(|n| self.pieces[*n as usize]).collect();
        let start = around_points(&points);
        let mut best = (f64::INFINITY, start);
        let mut judge = |c: &Vec3| {
            let mut ball = Ball::holding(*c, &points);
            ball.radius *= 1.0 + ROUNDING;
            let need = ball.radius + self.distance.closest(c).signed_distance;
            if need < best.0 {
                best = (need, ball);
            }
            need
        };
        let first = tried
            .iter()
            .chain([&start.center])
            .map(|c| (judge(c), *c))
            .fold((f64::INFINITY, start.center), |a, b| if b.0 < a.0 { b } else { a });
        simplex(first.1, 0.4 * start.radius, EVALUATIONS, &mut judge);
        Own { outward: best.0.max(0.0), ball: best.1, pieces, whole: false }
    }

    /// The pieces, each with the centre of which it needs least, and balls fitted to what each gets. Centres that get none are left out.
    fn fitted(&self, pieces: &[u32], centers: &[Vec3]) -> Vec<Own> {
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
            .map(|(part, center)| self.own(part, &[*center]))
            .collect()
    }

    fn divided(&mut self, worst: usize) -> Option<[Own; 2]> {
        while self.balls[worst].pieces.len() < FEWEST {
            self.halve_pieces(worst, self.small)?;
        }
        // long ones would be held by both halves
        let fine = FINE * self.balls[worst].ball.radius;
        while self.balls[worst].pieces.len() < MOST_OF_ONE && self.halve_pieces(worst, fine).is_some() {}
        let (pieces, old) = (&self.balls[worst].pieces, self.balls[worst].ball.center);
        let middles: Vec<Vec3> = pieces.iter().map(|n| self.pieces[*n as usize].iter().sum::<Vec3>() / 3.0).collect();
        let mean = middles.iter().sum::<Vec3>() / middles.len() as f64;
        let covariance: Mat3 = middles.iter().map(|m| (m - mean) * (m - mean).transpose()).sum();
        let across = |axis: &Vec3| {
            let (one, other): (Vec<_>, Vec<_>) =
                pieces.iter().zip(&middles).partition(|(_, m)| (*m - mean).dot(axis) < 0.0);
            [one, other].map(|half| half.into_iter().map(|(n, _)| *n).collect::<Vec<u32>>())
        };
        let ways: Vec<[Vec<u32>; 2]> = directions(&covariance)
            .iter()
            .map(across)
            .filter(|[one, other]| !one.is_empty() && !other.is_empty())
            .collect();
        let mut ranked: Vec<(f64, [Vec<u32>; 2])> =
            ways.into_iter().map(|halves| (self.rough(&halves[0]).max(self.rough(&halves[1])), halves)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        ranked.truncate(FITTED);
        // the old ball does for either half, so that neither needs more
        let fit = |(_, halves): (f64, [Vec<u32>; 2])| self.refitted(halves.map(|half| self.own(half, &[old])));
        ranked.into_par_iter().map(fit).collect::<Vec<_>>().into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }

    /// What the ball about the middle of the box around pieces needs, metres.
    fn rough(&self, pieces: &[u32]) -> f64 {
        let points = || pieces.iter().flat_map(|n| self.pieces[*n as usize]);
        let bounds = crate::Aabb::around(points());
        let middle = 0.5 * (bounds.min + bounds.max);
        let square = points().map(|p| (p - middle).norm_squared()).fold(0.0, f64::max);
        square.sqrt() + self.distance.closest(&middle).signed_distance
    }

    /// The two choose their pieces anew, while that helps.
    fn refitted(&self, mut pair: [Own; 2]) -> [Own; 2] {
        for _ in 0..ROUNDS {
            let all: Vec<u32> = pair.iter().flat_map(|own| own.pieces.iter().copied()).collect();
            let next = self.fitted(&all, &[pair[0].ball.center, pair[1].ball.center]);
            match <[Own; 2]>::try_from(next) {
                Ok(next) if worst(&next) <= worst(&pair) && cost(&next) < cost(&pair) => pair = next,
                _ => break,
            }
        }
        pair
    }

    /// Halves the pieces of a ball that are larger; `None` where none is, or they are as many as they may be.
    fn halve_pieces(&mut self, ball: usize, larger: f64) -> Option<()> {
        if self.pieces.len() + self.balls[ball].pieces.len() > MOST {
            return None;
        }
        let mut new = Vec::new();
        for n in &self.balls[ball].pieces {
            let (size, [one, other]) = halved(&self.pieces[*n as usize]);
            if size > larger.max(self.small) {
                self.pieces[*n as usize] = one;
                new.push(self.pieces.len() as u32);
                self.pieces.push(other);
            }
        }
        let some = !new.is_empty();
        self.balls[ball].pieces.extend(new);
        some.then_some(())
    }
}

/// The principal axes, those half-way between two of them (of equal ones any are principal axes, as the diagonals of a square), and the axes of the mesh.
fn directions(covariance: &Mat3) -> Vec<Vec3> {
    let axes = SymmetricEigen::new(*covariance).eigenvectors;
    let [u, v, w] = [0, 1, 2].map(|k| axes.column(k).into_owned());
    vec![u, v, w, u + v, u - v, v + w, v - w, w + u, w - u, Vec3::x(), Vec3::y(), Vec3::z()]
}

fn worst(balls: &[Own]) -> f64 {
    balls.iter().map(|own| own.outward).fold(0.0, f64::max)
}

/// The worst first, and a little of the other.
fn cost(pair: &[Own; 2]) -> f64 {
    worst(pair) + 1e-3 * (pair[0].outward + pair[1].outward)
}

/// The triangles, the longest halved first, until there are as many pieces as there shall be at first.
fn split(mesh: &TriMesh) -> Vec<[Vec3; 3]> {
    let mut pieces: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
    while pieces.len() < FIRST {
        let sizes: Vec<f64> = pieces.iter().map(|p| halved(p).0).collect();
        // all within a factor of the longest at once
        let bar = 0.7 * sizes.iter().copied().fold(0.0, f64::max);
        for n in 0..sizes.len() {
            if sizes[n] >= bar {
                let [one, other] = halved(&pieces[n]).1;
                pieces[n] = one;
                pieces.push(other);
            }
        }
    }
    pieces
}
