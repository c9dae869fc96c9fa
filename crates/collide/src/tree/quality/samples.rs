//! Deterministic, evenly distributed points on a surface, on a sphere and in a box.
//!
//! Additive recurrences `xₙ = frac(½ + n·α)` with the powers of `1/φ_d`, where `φ_d` is the root of
//! `x^(d+1) = x + 1`: Roberts, *The unreasonable effectiveness of quasirandom sequences* (2018). On
//! a sphere the Fibonacci lattice: `z = 1 − 2(n + ½)/N`, longitude by the golden angle.

use crate::{Aabb, TriMesh, Vec3};
use nalgebra::ComplexField;
use std::f64::consts::PI;

const PLASTIC: f64 = 1.324_717_957_244_746;
const PHI_3: f64 = 1.220_744_084_605_759_6;
/// Number of points of a cell up to which each is tested by itself.
const MAX_CELL_POINTS: usize = 4;

/// Returns `count` points, uniform by area: even steps along the summed areas, an additive
/// recurrence within the triangles.
pub(super) fn on_surface(mesh: &TriMesh, count: usize) -> Vec<Vec3> {
    let mut summed = Vec::with_capacity(mesh.triangles.len());
    let mut total = 0.0;
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        total += 0.5 * (b - a).cross(&(c - a)).norm();
        summed.push(total);
    }
    let last = mesh.triangles.len() - 1;
    (0..count)
        .map(|n| {
            let at = (n as f64 + 0.5) / count as f64 * total;
            let [a, b, c] = mesh.corners(summed.partition_point(|s| *s < at).min(last));
            let (u, v) = (step(n, 1.0 / PLASTIC), step(n, 1.0 / (PLASTIC * PLASTIC)));
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            a + (b - a) * u + (c - a) * v
        })
        .collect()
}

/// Returns `count` points on the unit sphere.
pub(super) fn fibonacci(count: usize) -> Vec<Vec3> {
    let golden = PI * (1.0 + 5.0_f64.sqrt());
    (0..count)
        .map(|n| {
            let at = n as f64 + 0.5;
            let z = 1.0 - 2.0 * at / count as f64;
            let (sin, cos) = ComplexField::sin_cos(golden * at);
            let s = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(s * cos, s * sin, z)
        })
        .collect()
}

/// Returns `count` points in a box.
pub(super) fn in_box(bounds: &Aabb, count: usize) -> Vec<Vec3> {
    let size = bounds.max - bounds.min;
    let steps = [1.0 / PHI_3, 1.0 / (PHI_3 * PHI_3), 1.0 / (PHI_3 * PHI_3 * PHI_3)];
    (0..count).map(|n| bounds.min + Vec3::from_fn(|k, _| size[k] * step(n, steps[k]))).collect()
}

fn step(n: usize, alpha: f64) -> f64 {
    (0.5 + n as f64 * alpha).fract()
}

/// Returns which of the points lie inside the solid. If the center of a cell is further from the
/// surface than its corners, all its points are inside or all are outside. Other cells are halved
/// along the three axes until few points are left.
///
/// `distance` is the signed distance, negative inside, or less than that by magnitude.
pub(super) fn inside(distance: &dyn Fn(&Vec3) -> f64, points: &[Vec3], bounds: &Aabb) -> Vec<bool> {
    let mut answer = vec![false; points.len()];
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    classify(distance, points, &mut order, *bounds, &mut answer);
    answer
}

fn classify(distance: &dyn Fn(&Vec3) -> f64, points: &[Vec3], order: &mut [u32], cell: Aabb, answer: &mut [bool]) {
    if order.len() <= MAX_CELL_POINTS {
        order.iter().for_each(|&n| answer[n as usize] = distance(&points[n as usize]) < 0.0);
        return;
    }
    let half = 0.5 * (cell.max - cell.min);
    let center = cell.min + half;
    let d = distance(&center);
    if d.abs() > half.norm() {
        order.iter().for_each(|&n| answer[n as usize] = d < 0.0);
        return;
    }
    // splits the slice at the cell's middle, one axis after the other
    let mut parts = vec![(order, cell)];
    for k in 0..3 {
        parts = parts.into_iter().flat_map(|(part, cell)| split_points(points, part, cell, k, center[k])).collect();
    }
    parts.into_iter().for_each(|(part, cell)| classify(distance, points, part, cell, answer));
}

fn split_points<'a>(points: &[Vec3], part: &'a mut [u32], cell: Aabb, k: usize, at: f64) -> [(&'a mut [u32], Aabb); 2] {
    part.sort_unstable_by_key(|&n| (points[n as usize][k] >= at, n));
    let below = part.partition_point(|&n| points[n as usize][k] < at);
    let (low, high) = part.split_at_mut(below);
    let (mut lower, mut upper) = (cell, cell);
    lower.max[k] = at;
    upper.min[k] = at;
    [(low, lower), (high, upper)]
}
