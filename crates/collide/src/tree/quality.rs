//! Quality of a sphere tree: compares each level with the solid, by sampling.
//!
//! The measure works for any spheres and knows nothing about the builder. `L` is the union of the
//! spheres of a level, `M` the solid inside the mesh, `D` the diagonal of its bounding box, `d_M`
//! the signed distance to `M` (above 0 outside), `d_L(p) = minᵢ |p − cᵢ| − rᵢ`:
//!
//! | figure | meaning |
//! |---|---|
//! | coverage | fraction of surface samples with `d_L ≤ tolerance` |
//! | gap | `max(0, d_L)` over surface samples, divided by `D`: distance of uncovered points from `L` |
//! | protrusion | `max(0, d_M)` over the exposed boundary of `L`, weighted by area, divided by `D` |
//! | sphere error | per sphere the largest `d_M` of any of its points, exposed or not, divided by `D` (the measure of Bradshaw and O'Sullivan) |
//! | volume ratio | `vol L / vol M`; outside is `vol(L ∖ M) / vol M`, missing `vol(M ∖ L) / vol M` |
//! | nesting | number of spheres outside their parent by more than the tolerance (or without a parent), and the largest excess, divided by `D` |
//!
//! Samples are deterministic and evenly distributed; results have the same bits on any number of
//! threads. Sampled maxima are slightly too small: [`SphereTree::outward_error_at`] is the upper
//! bound, [`SphereTree::check_coverage`] proves coverage.

mod samples;
mod solid_samples;
mod sphere_union;

use super::SphereTree;
use super::levels::LevelSphere;
use crate::{Aabb, MeshDistance, TriMesh, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
pub use solid_samples::SolidSamples;
use sphere_union::SphereUnion;

/// Maximum number of samples of one kind.
const MAX_SAMPLES: usize = 1 << 26;
/// Depth, as a fraction of `D`, below the surface of another sphere from which a point is not
/// exposed.
const EXPOSED: f64 = 1e-9;

/// Numbers of samples. Counts above 67 million are reduced to that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QualitySettings {
    /// Samples on the surface of the mesh.
    pub surface_samples: usize,
    /// Samples on all spheres of a level together, in proportion to their areas.
    pub sphere_samples: usize,
    /// Minimum number of samples on each sphere.
    pub min_samples_per_sphere: usize,
    /// Samples in the box around mesh and spheres.
    pub volume_samples: usize,
    /// Tolerance of coverage and nesting, as a fraction of the diagonal.
    pub tolerance: f64,
}

impl Default for QualitySettings {
    /// Returns 20,000 samples on the surface, 60,000 on the spheres (at least 48 each), 131,072 in
    /// the volume; tolerance 1e-6.
    fn default() -> QualitySettings {
        QualitySettings {
            surface_samples: 20_000,
            sphere_samples: 60_000,
            min_samples_per_sphere: 48,
            volume_samples: 1 << 17,
            tolerance: 1e-6,
        }
    }
}

/// Quality of one level. Lengths are divided by the diagonal of the mesh's bounding box.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevelQuality {
    /// 0 for the root.
    pub level: u32,
    /// Number of spheres that represent the solid at this level.
    pub spheres: usize,
    /// Fraction of the surface inside the spheres, 0 to 1.
    pub coverage: f64,
    /// Mean distance of uncovered surface points from the spheres, over the whole surface.
    pub gap_mean: f64,
    /// 95th percentile of that distance.
    pub gap_p95: f64,
    /// Largest such distance.
    pub gap_max: f64,
    /// Fraction of vertices inside the spheres.
    pub vertex_coverage: f64,
    /// Largest distance of a vertex from the spheres.
    pub vertex_gap_max: f64,
    /// Largest distance of the exposed boundary of the spheres outside the solid.
    pub protrusion_max: f64,
    /// 95th percentile of that distance, by area.
    pub protrusion_p95: f64,
    /// Mean of that distance, by area.
    pub protrusion_mean: f64,
    /// Largest distance that any sphere extends outside.
    pub sphere_worst: f64,
    /// Mean over the spheres of the distance that each extends outside.
    pub sphere_mean: f64,
    /// Volume of the union divided by that of the solid.
    pub volume_ratio: f64,
    /// Volume of the union outside the solid, divided by that of the solid.
    pub outside: f64,
    /// Volume of the solid outside the union, divided by that of the solid.
    pub missing: f64,
    /// Number of spheres outside their parents.
    pub nesting_broken: usize,
    /// Largest excess of a sphere over its parent.
    pub nesting_max: f64,
}

impl SphereTree {
    /// Measures every level of the tree against its mesh, which must be closed, outward-wound and
    /// not empty.
    pub fn quality(&self, mesh: &TriMesh, settings: &QualitySettings) -> Vec<LevelQuality> {
        LevelQuality::of_levels(&self.level_lists(), mesh, settings)
    }
}

impl LevelQuality {
    /// Measures any spheres, level by level; `node` is ignored. A level without spheres has all
    /// figures 0. A missing parent (below the first level) counts as broken nesting.
    pub fn of_levels(levels: &[Vec<LevelSphere>], mesh: &TriMesh, settings: &QualitySettings) -> Vec<LevelQuality> {
        let solid = Solid::new(mesh, settings);
        let above = std::iter::once(None).chain(levels.iter().map(Some));
        levels
            .iter()
            .zip(above)
            .enumerate()
            .map(|(n, (level, above))| solid.measure(n, level, above.map(Vec::as_slice)))
            .collect()
    }
}

/// The mesh, prepared for the comparison.
struct Solid<'a> {
    mesh: &'a TriMesh,
    distance: MeshDistance,
    diagonal: f64,
    volume: f64,
    surface: Vec<Vec3>,
    settings: QualitySettings,
}

/// A sample on a sphere: the sphere, the area it represents, its distance outside the solid,
/// whether it is outside all other spheres.
struct BoundaryPoint {
    sphere: usize,
    area: f64,
    outside: f64,
    exposed: bool,
}

impl<'a> Solid<'a> {
    fn new(mesh: &'a TriMesh, settings: &QualitySettings) -> Solid<'a> {
        let count = |n: usize| n.clamp(1, MAX_SAMPLES);
        let settings = QualitySettings {
            surface_samples: count(settings.surface_samples),
            sphere_samples: count(settings.sphere_samples),
            min_samples_per_sphere: count(settings.min_samples_per_sphere).min(1 << 16),
            volume_samples: count(settings.volume_samples),
            ..*settings
        };
        Solid {
            distance: MeshDistance::new(mesh),
            diagonal: mesh.diagonal(),
            volume: mesh.union_mass_properties(1.0).mass.abs(),
            surface: samples::on_surface(mesh, settings.surface_samples),
            mesh,
            settings,
        }
    }

    fn measure(&self, number: usize, level: &[LevelSphere], above: Option<&[LevelSphere]>) -> LevelQuality {
        let mut row = LevelQuality { level: number as u32, spheres: level.len(), ..LevelQuality::default() };
        if level.is_empty() {
            return row;
        }
        let union = SphereUnion::new(level.iter().map(|b| (b.center, b.radius)).collect());
        self.measure_gaps(&union, &mut row);
        self.measure_protrusion(level, &union, &mut row);
        self.measure_volumes(level, &union, &mut row);
        self.measure_nesting(level, above, &mut row);
        row
    }

    fn measure_gaps(&self, union: &SphereUnion, row: &mut LevelQuality) {
        let (share, gaps) = self.gaps(union, &self.surface);
        (row.coverage, row.gap_max) = (share, largest(&gaps));
        row.gap_mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
        row.gap_p95 = percentile_95(gaps.iter().map(|g| (*g, 1.0)).collect());
        let (share, gaps) = self.gaps(union, &self.mesh.vertices);
        (row.vertex_coverage, row.vertex_gap_max) = (share, largest(&gaps));
    }

    /// Returns the fraction of the points within the tolerance, and the gaps of all points.
    fn gaps(&self, union: &SphereUnion, points: &[Vec3]) -> (f64, Vec<f64>) {
        let gaps: Vec<f64> = points.par_iter().map(|p| union.distance(p).max(0.0) / self.diagonal).collect();
        let covered = gaps.iter().filter(|g| **g <= self.settings.tolerance).count();
        (covered as f64 / gaps.len() as f64, gaps)
    }

    fn measure_protrusion(&self, level: &[LevelSphere], union: &SphereUnion, row: &mut LevelQuality) {
        let points = self.boundary(level, union);
        let mut worst = vec![0.0_f64; level.len()];
        points.iter().for_each(|p| worst[p.sphere] = worst[p.sphere].max(p.outside));
        (row.sphere_worst, row.sphere_mean) = (largest(&worst), worst.iter().sum::<f64>() / worst.len() as f64);
        let exposed: Vec<(f64, f64)> = points.iter().filter(|p| p.exposed).map(|p| (p.outside, p.area)).collect();
        let area: f64 = exposed.iter().map(|p| p.1).sum();
        if area > 0.0 {
            row.protrusion_mean = exposed.iter().map(|p| p.0 * p.1).sum::<f64>() / area;
        }
        row.protrusion_max = exposed.iter().map(|p| p.0).fold(0.0, f64::max);
        row.protrusion_p95 = percentile_95(exposed);
    }

    /// Samples all spheres, in their order.
    fn boundary(&self, level: &[LevelSphere], union: &SphereUnion) -> Vec<BoundaryPoint> {
        let square: f64 = level.iter().map(|b| b.radius * b.radius).sum::<f64>().max(f64::MIN_POSITIVE);
        let of_sphere = |(sphere, b): (usize, &LevelSphere)| {
            let share = self.settings.sphere_samples as f64 * (b.radius * b.radius / square);
            let count = (share as usize).max(self.settings.min_samples_per_sphere);
            let area = b.radius * b.radius / count as f64;
            let point = |u: Vec3| {
                let p = b.center + u * b.radius;
                let outside = self.distance.closest(&p).signed_distance.max(0.0) / self.diagonal;
                BoundaryPoint { sphere, area, outside, exposed: !union.contains(&p, EXPOSED * self.diagonal) }
            };
            samples::fibonacci(count).into_par_iter().map(point).collect::<Vec<_>>()
        };
        level.par_iter().enumerate().flat_map_iter(of_sphere).collect()
    }

    fn measure_volumes(&self, level: &[LevelSphere], union: &SphereUnion, row: &mut LevelQuality) {
        let corners = level.iter().flat_map(|b| [b.center.add_scalar(-b.radius), b.center.add_scalar(b.radius)]);
        let bounds = Aabb::around(corners.chain(self.mesh.vertices.iter().copied()));
        let points = samples::in_box(&bounds, self.settings.volume_samples);
        let in_mesh = samples::inside(&|p| self.distance.closest(p).signed_distance, &points, &bounds);
        let in_union: Vec<bool> = points.par_iter().map(|p| union.contains(p, 0.0)).collect();
        let one = (bounds.max - bounds.min).product() / points.len() as f64 / self.volume;
        let count = |wanted: fn(bool, bool) -> bool| {
            in_union.iter().zip(&in_mesh).filter(|(l, m)| wanted(**l, **m)).count() as f64 * one
        };
        row.volume_ratio = count(|l, _| l);
        row.outside = count(|l, m| l && !m);
        row.missing = count(|l, m| m && !l);
    }

    fn measure_nesting(&self, level: &[LevelSphere], above: Option<&[LevelSphere]>, row: &mut LevelQuality) {
        let Some(above) = above else { return };
        for b in level {
            let Some(parent) = b.parent.and_then(|p| above.get(p)) else {
                row.nesting_broken += 1;
                continue;
            };
            let excess = ((b.center - parent.center).norm() + b.radius - parent.radius) / self.diagonal;
            row.nesting_broken += usize::from(excess > self.settings.tolerance);
            row.nesting_max = row.nesting_max.max(excess);
        }
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// Returns the smallest value that is not exceeded by 95 % of the weight; 0 for no items. Items are
/// (value, weight).
fn percentile_95(mut items: Vec<(f64, f64)>) -> f64 {
    items.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let wanted = 0.95 * items.iter().map(|i| i.1).sum::<f64>();
    let mut sum = 0.0;
    let found = items.iter().find(|(_, weight)| {
        sum += weight;
        sum >= wanted
    });
    found.map_or(0.0, |i| i.0)
}
