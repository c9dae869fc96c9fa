//! Shares of light of projectors that overlap.

use super::Light;
use crate::fit::{Fit, lens_pixel, nearest};
use nalgebra::Point3;
use tumble_scene::cave::Cave;

/// Largest distance of two points that are the same, m.
const SAME_M: f64 = 0.01;

/// Returns the share of light of each pixel of a projector, 0 to 1, rows from the top.
pub(super) fn shares(cave: &Cave, fit: &Fit, i: usize) -> Vec<f32> {
    let [w, h] = cave.facets[i].size_px;
    let light = Light { fit, projector: i };
    let share = |place: [f64; 2]| {
        let Some((_, point)) = light.at(place, 0.0) else { return 0.0 };
        let own = edge(place, cave.facets[i].size_px).powi(2);
        let others = (0..fit.projectors.len()).filter(|j| *j != i).filter_map(|j| lit_by(cave, fit, j, &point));
        let all: f64 = own + others.map(|e| e.powi(2)).sum::<f64>();
        if all > 0.0 { own / all } else { 0.0 }
    };
    (0..h)
        .flat_map(|y| (0..w).map(move |x| [f64::from(x) + 0.5, f64::from(y) + 0.5]))
        .map(|place| share(place) as f32)
        .collect()
}

/// Returns the distance of a place from the edge of the picture: 1 in the middle, 0 at the edge.
fn edge([x, y]: [f64; 2], size: [u32; 2]) -> f64 {
    let [w, h] = size.map(f64::from);
    x.min(w - x).min(y).min(h - y).max(0.0) / (0.5 * w.min(h))
}

/// Returns how far from the edge of its picture a projector lights a point; `None` if it does not.
fn lit_by(cave: &Cave, fit: &Fit, j: usize, point: &Point3<f64>) -> Option<f64> {
    let (pose, lens) = &fit.projectors[j];
    let [w, h] = cave.facets[j].size_px.map(f64::from);
    let [x, y] = lens_pixel(lens, &pose.local(point))?;
    if !(0.0..=w).contains(&x) || !(0.0..=h).contains(&y) {
        return None;
    }
    let (_, first) = nearest(&fit.walls, &pose.position, &(point - pose.position), 1e-6)?;
    ((first - point).norm() < SAME_M).then(|| edge([x, y], cave.facets[j].size_px))
}
