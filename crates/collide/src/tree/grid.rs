//! The grid builder: a region is parted by a grid of cubes, and each cube's points get a sphere.
//!
//! Source: Bradshaw and O'Sullivan, *Adaptive medial-axis approximation for sphere-tree construction* (2004), which has an
//! oriented, optimized grid of spheres among its simpler methods. Of grids in several orientations, offsets and
//! spacings, those that need no more cubes than there may be spheres are ranked by the largest box of a cube's
//! points; the spheres of the best few are fitted, and the grid whose worst sphere reaches out least is taken. Spheres are fitted
//! to the cube's points, not drawn around cubes, so that they are far smaller where the surface cuts a corner.

use super::builder::{Built, Job, TreeBuilder};
use super::regions::{Part, build, cover_points, refitted, worst};
use crate::{Mat3, MeshError, Vec3};
use nalgebra::{Rotation3, SymmetricEigen, Unit};

/// Points of a region that grids are ranked by.
const MAX_SAMPLES: usize = 500;
/// Spacings tried: from the longest side of the region's box down by this factor each.
const SPACINGS: usize = 24;
const SPACING_FACTOR: f64 = 0.9;
/// Grids whose spheres are fitted.
const FITTED_GRIDS: usize = 6;

/// The builder.
pub(super) struct Grid;

impl TreeBuilder for Grid {
    fn build(&self, job: &Job) -> Result<Built, MeshError> {
        let cover = cover_points(job);
        let most = job.settings.branch as usize;
        Ok(build(job, &cover, &|region| best_partition(region, &cover.points, most, job)))
    }
}

/// Cubes of side `spacing` along the rows of `axes`, one of which has its least corner at `origin` in these axes.
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

    /// The longest diagonal of the boxes of cubes' points, `None` if more than `most` cubes have points.
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

    /// The points of each cube, in the order in which they come.
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

/// The region parted by the best grid found; nothing if no grid parts it.
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
        // points that were not looked at may lie in more cubes
        .filter(|parts| (2..=most).contains(&parts.len()))
        .take(FITTED_GRIDS)
        .map(|parts| parts.into_iter().map(|own| Part::of(own, None, points, job.distance)).collect::<Vec<Part>>())
        .min_by(|a, b| worst(a).total_cmp(&worst(b)))
        .unwrap_or_default();
    refitted(best, points, job.distance, job.progress)
}

/// The grids tried: along the axes given, along the principal axes, and these turned by 45° about each.
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
            // with its cubes even about the middle, or a cube in the middle, along each axis by itself
            for offset in 0..8_u32 {
                let shift = |k: u32| if offset >> k & 1 == 0 { 0.0 } else { 0.5 * spacing };
                let origin = 0.5 * (bounds.min + bounds.max) + Vec3::new(shift(0), shift(1), shift(2));
                all.push(Cubes { axes, origin, spacing });
            }
        }
    }
    all
}

/// Rows are the axes of the points' covariance, a right-handed set.
fn principal_axes(points: &[Vec3]) -> Mat3 {
    let mean = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    let covariance: Mat3 = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let mut axes = SymmetricEigen::new(covariance).eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(0).neg_mut();
    }
    axes.transpose()
}
