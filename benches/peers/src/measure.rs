//! One run of one engine: CPU time, and errors computed from shapes and poses only, the same for
//! every engine.

use crate::overlap::deepest;
use crate::scene::{Joint, Mode, Scene};
use crate::{Engine, Motion, Solves};

/// Samples of the errors per second.
const SAMPLES: usize = 60;

/// The result of a run, over the measured time of its scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct Run {
    /// Seconds of the clock per simulated second.
    pub cpu: f64,
    /// Largest depth of two bodies, or of a body in a plane, meters.
    pub overlap: f64,
    /// The same in the last frame, meters.
    pub overlap_at_end: f64,
    /// Largest distance of a body from its place at the start of the scene, meters.
    pub movement: f64,
    /// Largest distance of the two points of a joint, meters.
    pub joint_gap: f64,
    /// Largest speed of a body at the end, m/s.
    pub speed: f64,
    /// Largest residual and number of unconverged solves, if the engine reports them.
    pub solves: Option<Solves>,
}

/// Steps an engine through the whole time and measures it by a clock, which returns seconds.
pub fn run(engine: &mut dyn Engine, scene: &Scene, clock: fn() -> f64) -> Run {
    let [first, last] = scene.measured.map(|t| (t * scene.rate as f64).round() as usize);
    (0..first).for_each(|_| engine.step());
    let mut run = Run::default();
    for frame in first + 1..=last {
        let before = clock();
        engine.step();
        run.cpu += clock() - before;
        run.record(engine.solves());
        if frame.is_multiple_of(scene.rate / SAMPLES) {
            let motions: Vec<Motion> = (0..scene.bodies.len()).map(|i| engine.motion(i)).collect();
            run.sample(scene, &motions);
        }
    }
    run.cpu /= scene.measured[1] - scene.measured[0];
    run
}

impl Run {
    fn record(&mut self, solves: Option<Solves>) {
        let Some(new) = solves else { return };
        let all = self.solves.get_or_insert(Solves { residual: 0.0, unconverged: 0 });
        all.residual = all.residual.max(new.residual);
        all.unconverged += new.unconverged;
    }

    fn sample(&mut self, scene: &Scene, motions: &[Motion]) {
        self.overlap_at_end = deepest(scene, motions);
        self.overlap = self.overlap.max(self.overlap_at_end);
        let bodies = scene.bodies.iter().zip(motions).filter(|(body, _)| body.mode == Mode::Dynamic);
        let moved = bodies.clone().map(|(body, motion)| distance(&body.center, &motion.center));
        self.movement = moved.fold(self.movement, f64::max);
        self.speed = bodies.map(|(_, motion)| motion.speed).fold(0.0, f64::max);
        let gaps = scene.joints.iter().map(|joint| gap(joint, motions));
        self.joint_gap = gaps.fold(self.joint_gap, f64::max);
    }
}

fn gap(joint: &Joint, motions: &[Motion]) -> f64 {
    let [a, b] = [0, 1].map(|side| motions[joint.bodies[side]].point(joint.anchors[side]));
    distance(&a, &b)
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}
