//! A solid as evenly distributed points, for the comparison with sets of spheres.
//!
//! The solid is known by its signed distance alone, so unions and round shapes are measured by formula.

use super::samples;
use super::sphere_union::SphereUnion;
use crate::{Aabb, Vec3};
use rayon::prelude::*;

/// Samples of the volume, and of all spheres of a set together.
const VOLUME_SAMPLES: usize = 1 << 17;
const SPHERE_SAMPLES: usize = 60_000;
/// Minimum number of samples on each sphere.
const MIN_SPHERE_SAMPLES: usize = 48;
/// Depth below another sphere from which a point is not exposed, as a fraction of the radius.
const EXPOSED: f64 = 1e-9;

/// Evenly distributed points in a box around a solid, of which those outside are kept.
pub struct SolidSamples<'a> {
    distance: &'a (dyn Fn(&Vec3) -> f64 + Sync),
    outside: Vec<Vec3>,
    share: f64,
    volume: f64,
}

impl<'a> SolidSamples<'a> {
    /// Samples the solid in `bounds` and all places up to `reach` meters outside the bounds. `distance`
    /// is the signed distance of a point to the solid: exact outside, and inside negative and not
    /// larger than exact by magnitude.
    pub fn new(bounds: &Aabb, reach: f64, distance: &'a (dyn Fn(&Vec3) -> f64 + Sync)) -> SolidSamples<'a> {
        let bounds = Aabb { min: bounds.min.add_scalar(-reach), max: bounds.max.add_scalar(reach) };
        let points = samples::in_box(&bounds, VOLUME_SAMPLES);
        let inside = samples::inside(&|p| distance(p), &points, &bounds);
        let share = (bounds.max - bounds.min).product() / points.len() as f64;
        let volume = share * inside.iter().filter(|inside| **inside).count() as f64;
        let outside = points.into_iter().zip(inside).filter(|(_, inside)| !inside).map(|(p, _)| p).collect();
        SolidSamples { distance, outside, share, volume }
    }

    /// Returns the points outside the solid, meters.
    pub fn outside(&self) -> &[Vec3] {
        &self.outside
    }

    /// Returns the volume that each point stands for, m³.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Returns the volume of the solid, m³.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Returns the volume of the union of spheres (center and radius, meters) outside the solid, m³. What
    /// is further than `reach` outside the bounds does not count.
    pub fn volume_outside(&self, spheres: &[(Vec3, f64)]) -> f64 {
        if spheres.is_empty() {
            return 0.0;
        }
        let union = SphereUnion::new(spheres.to_vec());
        self.outside.par_iter().filter(|p| union.contains(p, 0.0)).count() as f64 * self.share
    }

    /// Returns the mean by area of the distance by which the exposed surface of spheres (center and
    /// radius, meters) is outside the solid, meters; 0 where it is inside. 0 for no spheres.
    pub fn mean_protrusion(&self, spheres: &[(Vec3, f64)]) -> f64 {
        let square: f64 = spheres.iter().map(|(_, r)| r * r).sum();
        if square <= 0.0 {
            return 0.0;
        }
        let union = SphereUnion::new(spheres.to_vec());
        let of_sphere = |(center, radius): &(Vec3, f64)| {
            let count = ((SPHERE_SAMPLES as f64 * radius * radius / square) as usize).max(MIN_SPHERE_SAMPLES);
            let points = samples::fibonacci(count).into_iter().map(|u| center + u * *radius);
            let distances: Vec<f64> =
                points.filter(|p| !union.contains(p, EXPOSED * radius)).map(|p| (self.distance)(&p).max(0.0)).collect();
            let area = radius * radius / count as f64;
            [area * distances.iter().sum::<f64>(), area * distances.len() as f64]
        };
        let sums: Vec<[f64; 2]> = spheres.par_iter().map(of_sphere).collect();
        let [sum, area] = sums.iter().fold([0.0, 0.0], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
        if area > 0.0 { sum / area } else { 0.0 }
    }
}
