//! Building by regions: points of the surface are parted among a few balls, and each part among its own few.
//!
//! What the builders differ in is how a region is parted ([`Part`]); what they share is here: the levels, when to stop, and the closing
//! of the leaves over the surface itself ([`super::close`]).

use super::ball::{Ball, around_points};
use super::builder::{Built, Cell, Job, Progress, StageCount};
use super::close::closed;
use super::medial::CoverPoints;
use super::simplex::simplex;
use crate::{MeshDistance, Vec3};
use rayon::prelude::*;

/// Cover points per ball of the deepest level, and bounds of their number.
const POINTS_EACH: f64 = 40.0;
const POINTS: (f64, f64) = (4000.0, 24_000.0);
/// A region of fewer points is a leaf. With the number of points it bounds the number of leaves.
const FEWEST: usize = 4;
/// Balls of a smaller radius, as a part of the diagonal, are none.
const TINY: f64 = 1e-9;
/// Greatest number of rounds of [`refitted`].
const REFITS: usize = 6;
/// Evaluations of the search for a part's centre.
const EVALUATIONS: usize = 60;

/// Points of the surface, by their place in the cover, and a ball that holds them.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub ball: Ball,
    pub points: Vec<u32>,
    /// Upper bound of how far the ball reaches out of the solid, metres.
    pub outward: f64,
}

impl Part {
    /// The points with a ball that reaches out of the solid little: the small enclosing ball, or the one about `center`,
    /// moved to where `max |p − c| + s(c)` is less, `s` the signed distance of the centre.
    pub fn of(points: Vec<u32>, center: Option<Vec3>, all: &[Vec3], distance: &MeshDistance) -> Part {
        let own: Vec<Vec3> = points.iter().map(|&i| all[i as usize]).collect();
        let start = around_points(&own);
        let mut best = Part { outward: f64::INFINITY, ball: start, points };
        let mut judge = |c: &Vec3| {
            let ball = Ball::holding(*c, &own);
            let outward = ball.radius + distance.closest(c).signed_distance;
            if outward < best.outward {
                (best.outward, best.ball) = (outward, ball);
            }
            outward
        };
        let known = judge(&start.center);
        let from = center.filter(|c| judge(c) < known).unwrap_or(start.center);
        simplex(from, 0.4 * start.radius, EVALUATIONS, &mut judge);
        best
    }
}

/// Points choose the ball that reaches out least to hold them, and balls are fitted anew, while that lowers how far the worst reaches out.
pub(super) fn refitted(
    mut parts: Vec<Part>,
    all: &[Vec3],
    distance: &MeshDistance,
    progress: &dyn Progress,
) -> Vec<Part> {
    for _ in (0..REFITS).take_while(|_| !progress.stopped()) {
        let needs: Vec<(Vec3, f64)> = parts.iter().map(|p| (p.ball.center, p.outward - p.ball.radius)).collect();
        let mut chosen: Vec<Vec<u32>> = vec![Vec::new(); parts.len()];
        for &i in parts.iter().flat_map(|p| &p.points) {
            let need = |k: usize| (all[i as usize] - needs[k].0).norm() + needs[k].1;
            let least = (0..parts.len()).min_by(|&a, &b| need(a).total_cmp(&need(b))).unwrap_or(0);
            chosen[least].push(i);
        }
        let centers = parts.iter().map(|p| p.ball.center);
        let next: Vec<Part> = chosen
            .into_iter()
            .zip(centers)
            .filter(|(points, _)| !points.is_empty())
            .map(|(points, center)| Part::of(points, Some(center), all, distance))
            .collect();
        if worst(&next) >= worst(&parts) {
            break;
        }
        parts = next;
    }
    parts
}

/// How far the parts' balls reach out, metres.
pub(super) fn worst(parts: &[Part]) -> f64 {
    parts.iter().map(|p| p.outward).fold(0.0, f64::max)
}

/// The cover points of a build.
pub(super) fn cover_of(job: &Job) -> CoverPoints {
    let balls = f64::from(job.settings.branch).powi(job.settings.depth as i32);
    CoverPoints::on(job.mesh, (balls * POINTS_EACH).clamp(POINTS.0, POINTS.1) as usize)
}

/// Builds down to the settings' depth. `divide` parts a region (places in the cover, at least [`FEWEST`]) into at most
/// `branch` parts; a region that it cannot part stays a leaf.
pub(super) fn build(job: &Job, cover: &CoverPoints, divide: &(dyn Fn(&[u32]) -> Vec<Part> + Sync)) -> Built {
    let (enough, tiny) = (job.settings.error * job.mesh.diagonal(), TINY * job.mesh.diagonal());
    let all: Vec<u32> = (0..cover.points.len() as u32).collect();
    let mut leaves = vec![Part::of(all, None, &cover.points, job.distance)];
    let (mut parents, mut stages) = (Vec::new(), Vec::new());
    for level in 1..=job.settings.depth {
        let divided: Vec<Vec<Part>> = leaves
            .into_par_iter()
            .map(|part| {
                let mut parts = if part.outward > enough && part.points.len() >= FEWEST && !job.progress.stopped() {
                    divide(&part.points)
                } else {
                    Vec::new()
                };
                // points at one place make no ball; closing has others hold them
                parts.retain(|p| p.ball.radius > tiny);
                if parts.len() < 2 { vec![part] } else { parts }
            })
            .collect();
        let of: Vec<usize> = divided.iter().enumerate().flat_map(|(n, parts)| parts.iter().map(move |_| n)).collect();
        leaves = divided.into_iter().flatten().collect();
        stages.push(StageCount { level, stage: "balls".into(), count: leaves.len() as u64 });
        let finished = leaves.len() == parents.last().map_or(1, Vec::len);
        parents.push(of);
        job.progress.at(0.95 * f64::from(level) / f64::from(job.settings.depth));
        if finished {
            break;
        }
    }
    let balls = closed(job.mesh, leaves.iter().map(|part| part.ball).collect(), job.progress);
    Built { root: nested(&balls, &parents), stages }
}

/// Nested cells over the leaves' balls. `parents` has per level the place of each ball's parent in the level above, the deepest level last.
fn nested(balls: &[Ball], parents: &[Vec<usize>]) -> Cell {
    let mut below: Vec<Cell> = balls.iter().map(|ball| Cell::Leaf(*ball)).collect();
    for of in parents.iter().rev() {
        let mut inside: Vec<Vec<Cell>> = Vec::new();
        inside.resize_with(of.last().map_or(0, |p| p + 1), Vec::new);
        for (parent, cell) in of.iter().zip(below) {
            inside[*parent].push(cell);
        }
        below = inside.into_iter().map(Cell::Inner).collect();
    }
    below.pop().unwrap_or(Cell::Inner(Vec::new()))
}
