//! One run of one engine: CPU time from t = 1 to 4 s, and errors computed from the positions only,
//! the same for every engine.

use crate::clock::cpu_seconds;
use crate::scene::{Body, EDGE, RADIUS, Scene};
use crate::{DT, Engine};

/// Start of the measurement, s.
const FROM: f64 = 1.0;
/// End of the measurement, s.
const TO: f64 = 4.0;

/// The result of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Run {
    /// CPU seconds per simulated second.
    pub cpu: f64,
    /// Largest error of position, meters. Spheres: the deepest overlap of two of them or of one
    /// with a plane. Boxes: the depth of the lowest one below its place in the pyramid.
    pub penetration: f64,
    /// Largest movement of a body from `t = 1` to `t = 4 s`, meters.
    pub movement: f64,
    /// Largest residual that the engine reported, m/s.
    pub residual: Option<f64>,
}

/// Steps an engine through the whole time and measures it.
pub fn run(engine: &mut dyn Engine, scene: &Scene) -> Run {
    let frames = |t: f64| (t / DT).round() as usize;
    (0..frames(FROM)).for_each(|_| engine.step());
    let centers =
        |engine: &dyn Engine| -> Vec<[f64; 3]> { (0..scene.centers.len()).map(|i| engine.center(i)).collect() };
    let start = centers(engine);
    let mut run = Run::default();
    for _ in frames(FROM)..frames(TO) {
        let before = cpu_seconds();
        engine.step();
        run.cpu += cpu_seconds() - before;
        run.penetration = run.penetration.max(penetration(scene, &centers(engine)));
        run.residual = engine.residual().map(|r| run.residual.unwrap_or(0.0).max(r));
    }
    run.cpu /= TO - FROM;
    let end = centers(engine);
    run.movement = start.iter().zip(&end).map(|(a, b)| distance(a, b)).fold(0.0, f64::max);
    run
}

fn penetration(scene: &Scene, centers: &[[f64; 3]]) -> f64 {
    match scene.body {
        Body::Sphere => sphere_overlap(scene, centers),
        Body::Box => scene.centers.iter().zip(centers).map(|(place, c)| place[2] - c[2]).fold(0.0, f64::max),
    }
}

fn sphere_overlap(scene: &Scene, centers: &[[f64; 3]]) -> f64 {
    let mut worst = 0.0f64;
    for c in centers {
        for plane in &scene.planes {
            let height: f64 = (0..3).map(|k| (c[k] - plane.point[k]) * plane.normal[k]).sum();
            worst = worst.max(RADIUS - height);
        }
    }
    let mut sorted = centers.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
    for (i, a) in sorted.iter().enumerate() {
        for b in sorted[i + 1..].iter().take_while(|b| b[0] - a[0] < 2.0 * RADIUS) {
            worst = worst.max(2.0 * RADIUS - distance(a, b));
        }
    }
    worst
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Returns whether the pyramid still stands, by the height of its top above its place: negative if
/// it sank.
pub fn stands(scene: &Scene, run: &Run) -> bool {
    scene.body == Body::Sphere || run.penetration < 0.5 * EDGE
}
