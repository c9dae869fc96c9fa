//! Top-down builds: the points of the surface are partitioned among a few spheres, then the points
//! of each again.
//!
//! Builders differ in how a region is partitioned ([`Part`]). This module has the shared parts: the
//! levels, the stopping rule, and the growth of the leaves to cover the surface itself
//! ([`super::grow_to_cover`]).

use super::builder::{Built, Cell, Job, Progress, StageCount};
use super::grow_to_cover::grown_to_cover;
use super::medial::CoverPoints;
use super::nelder_mead::nelder_mead;
use super::sphere::{Sphere, around_points};
use crate::{MeshDistance, Vec3};
use rayon::prelude::*;

/// Cover points per sphere of the deepest level, and the limits of their number.
const POINTS_PER_SPHERE: f64 = 40.0;
const POINT_RANGE: (f64, f64) = (4000.0, 24_000.0);
/// A region of fewer points is a leaf. Together with the number of points this limits the number of
/// leaves.
const MIN_POINTS: usize = 4;
/// Smallest radius of a sphere, as a fraction of the diagonal.
const MIN_RADIUS: f64 = 1e-9;
/// Maximum number of rounds of [`refitted`].
const MAX_REFITS: usize = 6;
/// Evaluations of the search for a part's center.
const EVALUATIONS: usize = 60;

/// Points of the surface, as indices into the cover points, and a sphere that contains them.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub sphere: Sphere,
    pub points: Vec<u32>,
    /// Upper bound of how far the sphere extends outside the solid, meters.
    pub outward: f64,
}

impl Part {
    /// Fits a sphere to the points that extends little outside the solid. The search starts at the
    /// smallest enclosing sphere, or at `center`, and minimizes `max |p − c| + s(c)`, where `s` is
    /// the signed distance of the center.
    pub fn of(points: Vec<u32>, center: Option<Vec3>, all: &[Vec3], distance: &MeshDistance) -> Part {
        let own: Vec<Vec3> = points.iter().map(|&i| all[i as usize]).collect();
        let start = around_points(&own);
        let mut best = Part { outward: f64::INFINITY, sphere: start, points };
        let mut judge = |c: &Vec3| {
            let sphere = Sphere::about(*c, &own);
            let outward = sphere.radius + distance.closest(c).signed_distance;
            if outward < best.outward {
                (best.outward, best.sphere) = (outward, sphere);
            }
            outward
        };
        let known = judge(&start.center);
        let from = center.filter(|c| judge(c) < known).unwrap_or(start.center);
        nelder_mead(from, 0.4 * start.radius, EVALUATIONS, &mut judge);
        best
    }
}

/// Alternates two steps while the worst outward error decreases: each point selects the sphere that
/// extends outside least to contain it, and the spheres are fitted again.
pub(super) fn refitted(
    mut parts: Vec<Part>,
    all: &[Vec3],
    distance: &MeshDistance,
    progress: &dyn Progress,
) -> Vec<Part> {
    for _ in (0..MAX_REFITS).take_while(|_| !progress.stopped()) {
        let needs: Vec<(Vec3, f64)> = parts.iter().map(|p| (p.sphere.center, p.outward - p.sphere.radius)).collect();
        let mut chosen: Vec<Vec<u32>> = vec![Vec::new(); parts.len()];
        for &i in parts.iter().flat_map(|p| &p.points) {
            let need = |k: usize| (all[i as usize] - needs[k].0).norm() + needs[k].1;
            let least = (0..parts.len()).min_by(|&a, &b| need(a).total_cmp(&need(b))).unwrap_or(0);
            chosen[least].push(i);
        }
        let centers = parts.iter().map(|p| p.sphere.center);
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

/// Returns the largest outward error of the parts, meters.
pub(super) fn worst(parts: &[Part]) -> f64 {
    parts.iter().map(|p| p.outward).fold(0.0, f64::max)
}

/// Returns the cover points of a build.
pub(super) fn cover_points(job: &Job) -> CoverPoints {
    let spheres = f64::from(job.settings.branch).powi(job.settings.depth as i32);
    CoverPoints::on(job.mesh, (spheres * POINTS_PER_SPHERE).clamp(POINT_RANGE.0, POINT_RANGE.1) as usize)
}

/// Builds all levels down to the depth of the settings. `divide` partitions a region (indices of
/// cover points, at least [`MIN_POINTS`]) into at most `branch` parts. A region that it cannot
/// partition stays a leaf.
pub(super) fn build(job: &Job, cover: &CoverPoints, divide: &(dyn Fn(&[u32]) -> Vec<Part> + Sync)) -> Built {
    let (enough, tiny) = (job.settings.error * job.mesh.diagonal(), MIN_RADIUS * job.mesh.diagonal());
    let all: Vec<u32> = (0..cover.points.len() as u32).collect();
    let mut leaves = vec![Part::of(all, None, &cover.points, job.distance)];
    let (mut parents, mut stages) = (Vec::new(), Vec::new());
    for level in 1..=job.settings.depth {
        let partitions: Vec<Vec<Part>> = leaves
            .into_par_iter()
            .map(|part| {
                let mut parts = if part.outward > enough && part.points.len() >= MIN_POINTS && !job.progress.stopped() {
                    divide(&part.points)
                } else {
                    Vec::new()
                };
                // coincident points make no sphere; other spheres are grown to contain them later
                parts.retain(|p| p.sphere.radius > tiny);
                if parts.len() < 2 { vec![part] } else { parts }
            })
            .collect();
        let of: Vec<usize> =
            partitions.iter().enumerate().flat_map(|(n, parts)| parts.iter().map(move |_| n)).collect();
        leaves = partitions.into_iter().flatten().collect();
        stages.push(StageCount { level, stage: "spheres".into(), count: leaves.len() as u64 });
        let finished = leaves.len() == parents.last().map_or(1, Vec::len);
        parents.push(of);
        job.progress.report(0.95 * f64::from(level) / f64::from(job.settings.depth));
        if finished {
            break;
        }
    }
    let spheres = grown_to_cover(job.mesh, leaves.iter().map(|part| part.sphere).collect(), job.progress);
    Built { root: nested(&spheres, &parents), stages }
}

/// Returns nested cells over the leaves' spheres. `parents` lists for each level the index of each
/// sphere's parent in the level above, the deepest level last.
fn nested(spheres: &[Sphere], parents: &[Vec<usize>]) -> Cell {
    let mut below: Vec<Cell> = spheres.iter().map(|sphere| Cell::Leaf(*sphere)).collect();
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
