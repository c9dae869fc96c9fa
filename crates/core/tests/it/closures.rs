//! Loop closures: mechanisms of rigid bars against the closed forms of their motion.

use crate::common::*;
use std::f64::consts::PI;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::solver::by_name;
use tumble_core::*;

/// Hinges of a planar mechanism turn about −y, so that angles in the x-z plane grow from x towards z.
const AXIS: Vec3 = Vec3::new(0.0, -1.0, 0.0);

fn at(angle: f64) -> Vec3 {
    Vec3::new(angle.cos(), 0.0, angle.sin())
}

/// A bar of 1 kg per metre between two points of the x-z plane, along its own x axis; it collides with nothing.
fn bar(name: &str, from: Vec3, to: Vec3) -> RigidBody {
    let d = to - from;
    let shape = Shape::cuboid(Vec3::new(0.5 * d.norm(), 0.01, 0.01)).unwrap();
    let middle = 0.5 * (from + to);
    let pose = Pose::new(middle, AXIS * d.z.atan2(d.x));
    let mut bar = RigidBody::with_mass(name, shape, d.norm()).unwrap().at(pose);
    bar.meets = 0;
    bar
}

fn direct(stepper: &str, dt: f64) -> World {
    let mut world = world(stepper, dt);
    world.set_solver(by_name("lcp_pyramid").unwrap());
    world
}

/// Crank, coupler and rocker of a four-bar linkage.
struct FourBar {
    world: World,
    bars: [ObjectId; 3],
}

const CRANK: f64 = 0.2;
const COUPLER: f64 = 0.5;
const ROCKER: f64 = 0.4;
const GROUND: f64 = 0.4;

/// The closed form: where crank and rocker meet the coupler at a crank angle, coupler above the line.
fn pins(crank: f64) -> (Vec3, Vec3) {
    let (a, c) = (CRANK * at(crank), Vec3::new(GROUND, 0.0, 0.0));
    let d = c - a;
    let along = (COUPLER.powi(2) - ROCKER.powi(2) + d.norm_squared()) / (2.0 * d.norm());
    let up = (COUPLER.powi(2) - along.powi(2)).sqrt();
    let (x, z) = (d.normalize(), Vec3::new(-d.z, 0.0, d.x).normalize());
    (a, a + along * x + up * z)
}

fn four_bar(stepper: &str, dt: f64, crank: f64) -> FourBar {
    let mut world = direct(stepper, dt);
    let (a, b) = pins(crank);
    let c = Vec3::new(GROUND, 0.0, 0.0);
    let bars = [("crank", Vec3::zeros(), a), ("coupler", a, b), ("rocker", b, c)].map(|(name, from, to)| world.add(bar(name, from, to)).unwrap());
    let [crank, coupler, rocker] = bars.map(|id| Some((id, 0)));
    for (name, one, other, p) in [("o", crank, None, Vec3::zeros()), ("a", coupler, crank, a), ("b", coupler, rocker, b), ("c", rocker, None, c)] {
        world.add(Closure::hinge_at(name, &world, one, other, p, AXIS).unwrap()).unwrap();
    }
    FourBar { world, bars }
}

impl FourBar {
    /// The distance of the pins that should meet, from the poses of the bars alone.
    fn gap(&self) -> f64 {
        let ends = self.bars.map(|id| {
            let pose = self.world.site(id, 0).unwrap().pose;
            [-0.5, 0.5].map(|s| pose.translation.vector + pose.rotation * Vec3::x() * s)
        });
        let lengths = [CRANK, COUPLER, ROCKER];
        let end = |bar: usize, side: usize| {
            let pose = self.world.site(self.bars[bar], 0).unwrap().pose;
            let _ = ends;
            pose.translation.vector + pose.rotation * Vec3::x() * lengths[bar] * (side as f64 - 0.5)
        };
        let c = Vec3::new(GROUND, 0.0, 0.0);
        [end(0, 0), end(0, 1) - end(1, 0), end(1, 1) - end(2, 0), end(2, 1) - c].iter().map(|d| d.norm()).fold(0.0, f64::max)
    }

    fn crank_angle(&self) -> f64 {
        let x = self.world.site(self.bars[0], 0).unwrap().pose.rotation * Vec3::x();
        x.z.atan2(x.x)
    }
}

#[test]
fn figures() {
    for stepper in STEPPERS {
        for dt in [1.0 / 60.0, 1.0 / 240.0, 1.0 / 1000.0] {
            let mut it = four_bar(stepper, dt, 1.9);
            let start = it.world.energy().total();
            let (mut gap, mut off, mut energy, mut residual) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
            let (mut lo, mut hi, mut kin) = (f64::MAX, f64::MIN, 0.0f64);
            for _ in 0..(60.0 / dt) as usize {
                it.world.step().unwrap();
                gap = gap.max(it.gap());
                let t = it.crank_angle();
                (lo, hi) = (lo.min(t), hi.max(t));
                let (a, b) = pins(t);
                off = off.max((position(&it.world, it.bars[1]) - 0.5 * (a + b)).norm());
                energy = energy.max((it.world.energy().total() - start).abs());
                kin = kin.max(it.world.energy().kinetic);
                residual = residual.max(it.world.report().residual);
            }
            let end = it.world.energy().total() - start;
            println!("{stepper} dt {dt:.5}: gap {gap:e} off {off:e} energy {energy:e} end {end:e} of {kin} residual {residual:e} angle {lo} {hi}");
        }
    }
    let _ = PI;
}
