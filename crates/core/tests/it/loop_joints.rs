//! Mechanisms of rigid bars joined by loop joints, against the closed forms of their motion:
//! four-bar linkage, slider-crank.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

const RATE: f64 = 240.0;
/// The revolute joints of a planar mechanism turn about −y, so that angles in the x-z plane grow
/// from x towards z.
pub const AXIS: Vec3 = Vec3::new(0.0, -1.0, 0.0);

fn at(angle: f64) -> Vec3 {
    Vec3::new(angle.cos(), 0.0, angle.sin())
}

/// Returns a bar of 1 kg per meter between two points of the x-z plane, along its own x axis,
/// without collisions.
pub fn bar(name: &str, from: Vec3, to: Vec3) -> RigidBody {
    let d = to - from;
    let shape = Shape::cuboid(Vec3::new(d.norm(), 0.02, 0.02)).unwrap();
    let pose = Pose::new(0.5 * (from + to), AXIS * d.z.atan2(d.x));
    let mut bar = RigidBody::new(shape).with_name(name).with_mass(d.norm()).with_pose(pose);
    bar.mask = 0;
    bar
}

pub fn hinge(world: &mut World, name: &str, a: ObjectId, b: Option<ObjectId>, point: Vec3, axis: Vec3) -> ObjectId {
    let hinge = LoopJoint::revolute_at(name, world, Some((a, 0)), b.map(|b| (b, 0)), point, axis).unwrap();
    world.add(hinge).unwrap()
}

/// Returns the end of a bar, from its pose alone: `side` is −½ or ½.
fn end(world: &World, bar: ObjectId, length: f64, side: f64) -> Vec3 {
    world.part_state(bar, 0).unwrap().pose * nalgebra::Point3::new(side * length, 0.0, 0.0) - nalgebra::Point3::origin()
}

fn angle(world: &World, bar: ObjectId) -> f64 {
    let x = world.part_state(bar, 0).unwrap().pose.rotation * Vec3::x();
    x.z.atan2(x.x)
}

/// Crank, coupler and rocker on the ground. The shortest and the longest bar together are shorter
/// than the other two: by Grashof's law the crank makes full turns.
pub struct FourBar {
    pub world: World,
    pub bars: [ObjectId; 3],
    start: f64,
}

pub const LENGTHS: [f64; 3] = [0.2, 0.5, 0.4];
pub const GROUND: Vec3 = Vec3::new(0.4, 0.0, 0.0);

/// Returns the pins between crank and coupler, and between coupler and rocker, at an angle of the
/// crank, in closed form (coupler above).
pub fn pins(crank: f64) -> (Vec3, Vec3) {
    let a = LENGTHS[0] * at(crank);
    let d = GROUND - a;
    let along = (LENGTHS[1].powi(2) - LENGTHS[2].powi(2) + d.norm_squared()) / (2.0 * d.norm());
    let up = (LENGTHS[1].powi(2) - along.powi(2)).sqrt();
    (a, a + along * d.normalize() + up * Vec3::new(-d.z, 0.0, d.x).normalize())
}

impl FourBar {
    /// Returns the linkage at rest near its highest point.
    pub fn new(stepper: &str, dt: f64) -> FourBar {
        let mut world = world(stepper, dt);
        let (a, b) = pins(1.9);
        let bars = [("crank", Vec3::zeros(), a), ("coupler", a, b), ("rocker", b, GROUND)]
            .map(|(name, from, to)| world.add(bar(name, from, to)).unwrap());
        let [crank, coupler, rocker] = bars;
        for (name, one, other, p) in [
            ("o", crank, None, Vec3::zeros()),
            ("a", coupler, Some(crank), a),
            ("b", coupler, Some(rocker), b),
            ("c", rocker, None, GROUND),
        ] {
            hinge(&mut world, name, one, other, p, AXIS);
        }
        let start = world.energy().total();
        FourBar { world, bars, start }
    }

    /// Returns the largest distance between pins that should coincide.
    fn gap(&self) -> f64 {
        let end = |k: usize, side| end(&self.world, self.bars[k], LENGTHS[k], side);
        let gaps = [end(0, -0.5), end(0, 0.5) - end(1, -0.5), end(1, 0.5) - end(2, -0.5), end(2, 0.5) - GROUND];
        gaps.iter().map(|d| d.norm()).fold(0.0, f64::max)
    }

    /// Returns the distance of the coupler's middle from its closed form at the crank's angle.
    fn off(&self) -> f64 {
        let (a, b) = pins(angle(&self.world, self.bars[0]));
        (position(&self.world, self.bars[1]) - 0.5 * (a + b)).norm()
    }
}

/// Largest errors of a run.
#[derive(Debug, Default)]
struct Worst {
    gap: f64,
    off: f64,
    energy: f64,
    /// Energy lost at the end.
    lost: f64,
    /// Largest kinetic energy.
    kinetic: f64,
    turns: f64,
    residual: f64,
}

fn run(linkage: &mut FourBar, seconds: f64) -> Worst {
    let mut worst = Worst::default();
    let mut last = angle(&linkage.world, linkage.bars[0]);
    for _ in 0..(seconds / linkage.world.settings().dt).round() as usize {
        worst.residual = worst.residual.max(linkage.world.step().unwrap().residual);
        let (now, energy) = (angle(&linkage.world, linkage.bars[0]), linkage.world.energy());
        worst.turns += ((now - last).abs()).min(std::f64::consts::TAU - (now - last).abs()) / std::f64::consts::TAU;
        last = now;
        worst.gap = worst.gap.max(linkage.gap());
        worst.off = worst.off.max(linkage.off());
        worst.lost = linkage.start - energy.total();
        worst.energy = worst.energy.max(worst.lost.abs());
        worst.kinetic = worst.kinetic.max(energy.kinetic);
    }
    worst
}

#[test]
fn a_four_bar_linkage_stays_closed_for_a_minute_and_keeps_its_energy() {
    for stepper in STEPPERS {
        let worst = run(&mut FourBar::new(stepper, 1.0 / RATE), 60.0);
        println!("{stepper}, 60 s at {RATE} Hz: {worst:?}");
        assert!(worst.turns > 30.0, "{stepper}: the crank goes about, {} turns", worst.turns);
        // joints are closed to 1e-9 m along each axis
        assert!(worst.gap < 3e-9, "{stepper}: pins are {:e} m apart", worst.gap);
        assert!(worst.off < 1e-6, "{stepper}: the coupler is {:e} m off the closed form", worst.off);
        assert!(
            worst.energy < 1e-6 * worst.kinetic,
            "{stepper}: energy is off by {:e} J of {} J",
            worst.energy,
            worst.kinetic
        );
        assert!(worst.residual < 1e-9, "{stepper}: residual {:e} m/s", worst.residual);
    }
}

#[test]
fn without_stabilization_the_same_linkage_drifts() {
    for stepper in STEPPERS {
        let mut linkage = FourBar::new(stepper, 1.0 / RATE);
        let settings = linkage.world.settings().with_stabilize_positions(false);
        linkage.world.set_settings(settings).unwrap();
        let worst = run(&mut linkage, 60.0);
        println!("{stepper}, 60 s at {RATE} Hz, not stabilized: {worst:?}");
        assert!(worst.gap > 1e-5, "{stepper}: pins are {:e} m apart", worst.gap);
    }
}

/// Returns the position of a slider-crank's piston on the x axis at an angle of the crank.
fn piston(crank: f64) -> f64 {
    let (r, l) = (CRANK, ROD);
    r * crank.cos() + (l * l - (r * crank.sin()).powi(2)).sqrt()
}

const CRANK: f64 = 0.1;
const ROD: f64 = 0.25;

/// Adds rod and piston to a crank or wheel whose pin is at (CRANK, 0, 0).
fn engine(world: &mut World, crank: ObjectId) -> ObjectId {
    let (pin, gudgeon) = (Vec3::new(CRANK, 0.0, 0.0), Vec3::new(piston(0.0), 0.0, 0.0));
    let rod = world.add(bar("rod", pin, gudgeon)).unwrap();
    let mut slug = RigidBody::new(cube(0.05)).with_name("piston").with_mass(0.5).with_pose(Pose::from(gudgeon));
    slug.mask = 0;
    let piston = world.add(slug).unwrap();
    hinge(world, "crank pin", rod, Some(crank), pin, AXIS);
    hinge(world, "gudgeon pin", piston, Some(rod), gudgeon, AXIS);
    world
        .add(LoopJoint::prismatic_at("cylinder", world, Some((piston, 0)), None, Vec3::zeros(), Vec3::x()).unwrap())
        .unwrap();
    piston
}

#[test]
fn a_slider_crank_follows_its_closed_form() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / RATE);
        let flung = Vec3::new(0.0, -20.0, 0.0);
        let crank = world
            .add(
                bar("crank", Vec3::zeros(), Vec3::new(CRANK, 0.0, 0.0))
                    .with_velocity(flung.cross(&Vec3::new(0.5 * CRANK, 0.0, 0.0)))
                    .with_angular_velocity(flung),
            )
            .unwrap();
        hinge(&mut world, "main bearing", crank, None, Vec3::zeros(), AXIS);
        let piston_id = engine(&mut world, crank);
        let (mut worst, mut turns, mut last) = (0.0f64, 0.0, 0.0);
        let mut strokes = (f64::MAX, f64::MIN);
        for _ in 0..(10.0 * RATE) as usize {
            world.step().unwrap();
            let now = angle(&world, crank);
            turns += (now - last).abs().min(std::f64::consts::TAU - (now - last).abs()) / std::f64::consts::TAU;
            last = now;
            let p = position(&world, piston_id);
            worst = worst.max((p - Vec3::new(piston(now), 0.0, 0.0)).norm());
            strokes = (strokes.0.min(p.x), strokes.1.max(p.x));
        }
        println!("{stepper}: piston off by {worst:e} m in {turns} turns");
        assert!(turns > 5.0 && strokes.1 - strokes.0 > 1.9 * CRANK, "{stepper}: {turns} turns, strokes {strokes:?}");
        assert!(worst < 1e-6, "{stepper}: the piston is {worst:e} m off the closed form");
    }
}

#[test]
fn a_kinematic_wheel_drives_the_piston() {
    // it starts at once, with the engine at rest, and is right from the first frame on: x(t) =
    // r·cos ωt + √(l² − r²·sin² ωt), and its rate
    let spin = 10.0;
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / RATE);
        let wheel = RigidBody::fixed(sphere(0.12)).with_name("wheel").with_angular_velocity(Vec3::new(0.0, -spin, 0.0));
        let wheel = world.add_boxed(Box::new(wheel), Mode::Kinematic).unwrap();
        world.set_collidable(wheel, false).unwrap();
        let piston_id = engine(&mut world, wheel);
        let (mut place, mut speed) = (0.0f64, 0.0f64);
        for frame in 1..=(10.0 * RATE) as usize {
            world.step().unwrap();
            let angle = spin * frame as f64 / RATE;
            let root = (ROD.powi(2) - (CRANK * angle.sin()).powi(2)).sqrt();
            let rate = -spin * CRANK * angle.sin() * (1.0 + CRANK * angle.cos() / root);
            place = place.max((position(&world, piston_id) - Vec3::new(piston(angle), 0.0, 0.0)).norm());
            speed = speed.max((velocity(&world, piston_id) - Vec3::new(rate, 0.0, 0.0)).norm());
        }
        println!("{stepper}: driven piston off by {place:e} m, {speed:e} m/s");
        assert!(place < 1e-6, "{stepper}: the piston is {place:e} m off");
        assert!(speed < 1e-6, "{stepper}: its speed is {speed:e} m/s off");
    }
}

#[test]
fn steps_that_are_too_long_leave_the_linkage_closed() {
    // the crank turns by up to 0.25 rad per frame
    for stepper in STEPPERS {
        for (max_turn, bound) in [(1e6, 1e-5), (1.0, 1e-6), (0.25, 1e-6)] {
            let mut bars = FourBar::new(stepper, 1.0 / 60.0);
            bars.world.set_settings(bars.world.settings().with_max_turn(max_turn)).unwrap();
            let worst = run(&mut bars, 60.0);
            println!("{stepper}, 60 s at 60 Hz, max_turn {max_turn}: {worst:?}");
            assert!(worst.gap < 3e-9 && worst.off < 1e-6, "{stepper}: {worst:?}");
            assert!(
                worst.energy < bound * worst.kinetic,
                "{stepper}, max_turn {max_turn}: energy is off by {} J of {} J",
                worst.energy,
                worst.kinetic
            );
        }
    }
}

#[test]
fn a_linkage_that_strikes_the_ground_stays_closed_and_out_of_it() {
    for stepper in STEPPERS {
        for (restitution, friction) in [(0.0, 0.5), (0.5, 0.0)] {
            let mut linkage = FourBar::new(stepper, 1.0 / RATE);
            for id in linkage.bars {
                // bars overlap at their pins: they collide with the ground only
                let body: &mut RigidBody = linkage.world.get_mut(id).unwrap();
                (body.group, body.mask) = (CollisionGroup::new(1).unwrap(), CollisionGroup::default().bit());
                (body.material.restitution, body.material.friction) = (restitution, friction);
            }
            let floor = RigidBody::fixed(Shape::half_space())
                .with_name("floor")
                .with_material(Material { restitution, friction, ..Material::default() })
                .with_pose(Pose::translation(0.0, 0.0, -0.12));
            linkage.world.add_static(floor).unwrap();
            let (mut gap, mut deep, mut energy, mut touched) = (0.0f64, 0.0f64, f64::MIN, 0);
            for _ in 0..(10.0 * RATE) as usize {
                deep = deep.max(linkage.world.step().unwrap().max_penetration);
                gap = gap.max(linkage.gap());
                energy = energy.max(linkage.world.energy().total() - linkage.start);
                touched += linkage.world.contacts().iter().any(|c| c.impulse.norm() > 0.0) as u32;
            }
            println!(
                "{stepper}, e = {restitution}, μ = {friction}: gap {gap:.1e} m, {deep:.1e} m deep, energy gained {energy:.1e} J, {touched} frames on the ground"
            );
            assert!(touched > 5, "{stepper}: it reaches the ground");
            assert!(gap < 1e-6, "{stepper}: pins are {gap:e} m apart");
            assert!(deep < 1e-4, "{stepper}: {deep:e} m deep");
            assert!(energy < 1e-2, "{stepper}: {energy:e} J gained");
        }
    }
}

#[test]
fn joints_that_cannot_close_do_not_open_others() {
    // a box with fixed joints to two places 10 mm apart, beside the linkage
    for stepper in STEPPERS {
        let mut linkage = FourBar::new(stepper, 1.0 / RATE);
        let stuck = linkage.world.add(bar("stuck", Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.2, 1.0, 0.0))).unwrap();
        for (i, place) in [Vec3::new(0.1, 1.0, 0.0), Vec3::new(0.11, 1.0, 0.0)].into_iter().enumerate() {
            let sides = (Anchor::on(stuck, 0, Pose::identity()), Anchor::world(Pose::from(place)));
            linkage
                .world
                .add(LoopJoint::new(format!("joint {i}"), LoopJointKind::Fixed, sides.0, sides.1).unwrap())
                .unwrap();
        }
        let worst = run(&mut linkage, 5.0);
        println!("{stepper}, beside a box fixed to two places: {worst:?}");
        assert!(worst.gap < 3e-9 && worst.off < 1e-6, "{stepper}: {worst:?}");
        let stuck = (position(&linkage.world, stuck) - Vec3::new(0.105, 1.0, 0.0)).norm();
        assert!(stuck < 6e-3, "{stepper}: the box is {stuck} m from between the two places");
    }
}

#[test]
fn a_linkage_restored_from_a_snapshot_goes_on_with_the_same_bits() {
    for stepper in STEPPERS {
        let mut first = FourBar::new(stepper, 1.0 / RATE).world;
        (0..100).for_each(|_| {
            first.step().unwrap();
        });
        let saved = first.save();
        let mut second = FourBar::new(stepper, 1.0 / RATE).world;
        second.restore(&saved).unwrap();
        let mut third = first.fork();
        for _ in 0..200 {
            for world in [&mut first, &mut second, &mut third] {
                world.step().unwrap();
            }
        }
        assert!(first.save() == second.save() && first.save() == third.save(), "{stepper}");
    }
}
