//! The grid builder: a grid of cubes partitions a region, and one sphere is fitted to the points of
//! each cube.
//!
//! Source: Bradshaw and O'Sullivan, *Adaptive medial-axis approximation for sphere-tree
//! construction* (2004), which has an oriented, optimized grid of spheres among its simpler
//! methods. Grids of several orientations, offsets and spacings are tried. Those with few enough
//! cubes are ranked by the largest box around the points of a cube. Spheres are fitted for the best
//! few grids, and the grid with the smallest worst outward error wins. Spheres are fitted to the
//! points of a cube, not to the cube, so they are far smaller where the surface cuts a corner of
//! it.

use super::builder::{Built, Job, TreeBuilder};
use super::regions::{Part, build, cover_points, refitted, worst};
use crate::{Mat3, MeshError, Vec3};
use nalgebra::{Rotation3, SymmetricEigen, Unit};

/// Maximum number of points of a region that rank the grids.
const MAX_SAMPLES: usize = 500;
/// Number of spacings that are tried: from the longest side of the region's box, each smaller by
/// `SPACING_FACTOR`.
const SPACINGS: usize = 24;
const SPACING_FACTOR: f64 = 0.9;
/// Number of grids whose spheres are fitted.
const FITTED_GRIDS: usize = 6;

/// The grid builder.
pub(super) struct Grid;

impl TreeBuilder for Grid {
    fn build(&self, job: &Job) -> Result<Built, MeshError> {
        let cover = cover_points(job);
        let most = job.settings.branch as usize;
        Ok(build(job, &cover, &|region| best_partition(region, &cover.points, most, job)))
    }
}

/// Cubes of side `spacing` along the rows of `axes`; one cube has its lowest corner at `origin` in
/// these axes.
#[derive(Clone, Copy, Debug)]
struct Cubes {
    axes: Mat3,
    origin: Vec3,
    spacing: f64,
}

impl Cubes {
    fn cube(&self, p: &Vec3) -> [i64; 3] {
        let at = (self.axes * p - self.origin) / self.spacing;
        [at.x.floor() as i64, at.y.floor() as i64, at.z.floor() as i64]
    }

    /// Returns the longest diagonal of the boxes of the cubes' points; `None` if more than `most`
    /// cubes have points.
    fn rank(&self, points: &[Vec3], most: usize) -> Option<f64> {
        let mut boxes: Vec<([i64; 3], Vec3, Vec3)> = Vec::with_capacity(most);
        for p in points {
            let (cube, at) = (self.cube(p), self.axes * p);
            match boxes.iter().position(|b| b.0 == cube) {
                Some(n) => (boxes[n].1, boxes[n].2) = (boxes[n].1.inf(&at), boxes[n].2.sup(&at)),
                None if boxes.len() == most => return None,
                None => boxes.push((cube, at, at)),
            }
        }
        Some(boxes.iter().map(|b| (b.2 - b.1).norm()).fold(0.0, f64::max))
    }

    /// Returns the points of each cube, in the order of first occurrence.
    fn parts(&self, region: &[u32], points: &[Vec3]) -> Vec<Vec<u32>> {
        let mut parts: Vec<([i64; 3], Vec<u32>)> = Vec::new();
        for &i in region {
            let cube = self.cube(&points[i as usize]);
            match parts.iter_mut().find(|part| part.0 == cube) {
                Some(part) => part.1.push(i),
                None => parts.push((cube, vec![i])),
            }
        }
        parts.into_iter().map(|part| part.1).collect()
    }
}

/// Returns the region partitioned by the best grid found; empty if no grid partitions it.
fn best_partition(region: &[u32], points: &[Vec3], most: usize, job: &Job) -> Vec<Part> {
    let sampled: Vec<u32> = region.iter().copied().step_by(region.len().div_ceil(MAX_SAMPLES)).collect();
    let some: Vec<Vec3> = sampled.iter().map(|&i| points[i as usize]).collect();
    let mut ranked: Vec<(f64, Cubes)> =
        grids(&some).into_iter().filter_map(|cubes| Some((cubes.rank(&some, most)?, cubes))).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let best = ranked
        .iter()
        .take_while(|_| !job.progress.stopped())
        .map(|(_, cubes)| cubes.parts(region, points))
        // points that were not sampled can lie in further cubes
        .filter(|parts| (2..=most).contains(&parts.len()))
        .take(FITTED_GRIDS)
        .map(|parts| parts.into_iter().map(|own| Part::of(own, None, points, job.distance)).collect::<Vec<Part>>())
        .min_by(|a, b| worst(a).total_cmp(&worst(b)))
        .unwrap_or_default();
    refitted(best, points, job.distance, job.progress)
}

/// Returns the grids to try: along the given axes, along the principal axes, and the latter rotated
/// by 45° about each axis.
fn grids(points: &[Vec3]) -> Vec<Cubes> {
    let principal = principal_axes(points);
    let mut frames = vec![Mat3::identity(), principal];
    for k in 0..3 {
        let axis = Unit::new_normalize(principal.row(k).transpose());
        frames.push(principal * Rotation3::from_axis_angle(&axis, std::f64::consts::FRAC_PI_4).into_inner());
    }
    let mut all = Vec::new();
    for axes in frames {
        let bounds = crate::Aabb::around(points.iter().map(|p| axes * p));
        let side = (bounds.max - bounds.min).max();
        if side <= 0.0 {
            continue;
        }
        for n in 0..SPACINGS {
            let spacing = side * 1.001 * SPACING_FACTOR.powi(n as i32);
            // on each axis either a cube boundary or a cube center at the middle
            for offset in 0..8_u32 {
                let shift = |k: u32| if offset >> k & 1 == 0 { 0.0 } else { 0.5 * spacing };
                let origin = 0.5 * (bounds.min + bounds.max) + Vec3::new(shift(0), shift(1), shift(2));
                all.push(Cubes { axes, origin, spacing });
            }
        }
    }
    all
}

/// Returns the axes of the points' covariance as rows, a right-handed set.
fn principal_axes(points: &[Vec3]) -> Mat3 {
    let mean = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    let covariance: Mat3 = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let mut axes = SymmetricEigen::new(covariance).eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(0).neg_mut();
    }
    axes.transpose()
}
