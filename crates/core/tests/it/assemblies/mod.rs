//! Assemblies from raw meshes: the contacts alone guide the parts, as they do real ones.

mod bearing;
mod grid;
mod lock;
#[path = "../../../examples/mechanism_meshes.rs"]
mod mechanism_meshes;
mod worm;
mod zipper;

use crate::common::*;
use mechanism_meshes::gear::{self, Gear};
use mechanism_meshes::thread::{self, Thread};
use std::f64::consts::TAU;
use std::time::Instant;
use tumble_core::articulated::Drive;
use tumble_core::collide::{Pose, Shape, TreeSettings, TriMesh, Vec3, contacts};
use tumble_core::*;

const DT: f64 = 1.0 / 240.0;

fn slow() -> bool {
    std::env::var_os("TUMBLE_SLOW").is_some_and(|v| v == "1")
}

fn shape(mesh: TriMesh) -> Shape {
    Shape::mesh(mesh, &TreeSettings::default()).unwrap()
}

/// A body of steel, or of steel that is held.
fn steel(name: &str, shape: Shape, friction: f64) -> RigidBody {
    RigidBody::new(shape)
        .with_name(name)
        .with_density(7800.0)
        .with_material(Material { friction, ..Material::default() })
}

/// The turns of a body about z since the last call, added up.
#[derive(Default)]
struct Turns {
    total: f64,
    last: f64,
}

impl Turns {
    fn of_now(world: &World, id: ObjectId) -> Turns {
        let mut turns = Turns::default();
        turns.of(world, id);
        Turns { total: 0.0, ..turns }
    }

    fn of(&mut self, world: &World, id: ObjectId) {
        let axis = world.part_state(id, 0).unwrap().pose.rotation * Vec3::x();
        let angle = axis.y.atan2(axis.x);
        self.total += (angle - self.last + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
        self.last = angle;
    }
}

/// The time that this thread has computed, as that of a core without other work; elapsed time without /proc.
struct Stopwatch {
    began: Instant,
    cpu: Option<f64>,
}

impl Stopwatch {
    fn start() -> Stopwatch {
        Stopwatch { began: Instant::now(), cpu: Stopwatch::cpu() }
    }

    /// Returns the CPU time of this thread, s.
    fn cpu() -> Option<f64> {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
    }

    fn seconds(&self) -> f64 {
        match (self.cpu, Stopwatch::cpu()) {
            (Some(from), Some(to)) => to - from,
            _ => self.began.elapsed().as_secs_f64(),
        }
    }
}

/// Runs `seconds` and returns the real-time factor, by CPU time.
fn run(world: &mut World, seconds: f64, mut each: impl FnMut(&mut World)) -> f64 {
    let start = Stopwatch::start();
    for _ in 0..(seconds / world.settings().dt).round() as usize {
        world.step().unwrap();
        each(world);
    }
    seconds / start.seconds()
}

/// A nut of two turns on a bolt, under its own weight, turned up and down by a torque: it moves by the pitch in each turn.
/// Within the play of 0.1 mm it may tilt and lift.
#[test]
fn a_nut_climbs_a_bolt_by_its_pitch_full_length() {
    let turns = if slow() { 10.0 } else { 1.0 };
    let thread = Thread { pitch: 0.004, root: 0.0084, crest: 0.010, facets: 64, turns: 14 };
    let (bolt, nut) = (thread.bolt(0.016), Thread { turns: 2, ..thread }.nut(0.0001, 0.017));
    let triangles = bolt.triangles.len() + nut.triangles.len();
    let (bolt, nut) = (shape(bolt), shape(nut));
    for direction in [1.0, -1.0] {
        let mut world = world("time_stepping", DT);
        world.add_static(steel("bolt", bolt.clone(), 0.1)).unwrap();
        let start = thread.pitch * if direction > 0.0 { 1.5 } else { 11.5 };
        let nut = steel("nut", nut.clone(), 0.1).with_pose(Pose::translation(0.0, 0.0, start));
        let nut = world.add(nut.with_damping(0.0, 20.0)).unwrap();
        run(&mut world, 0.25, |_| {});
        let mut count = Turns::of_now(&world, nut);
        let (mut from, mut worst, mut overlap, mut unconverged) = (None, 0.0f64, 0.0f64, 0);
        let (began, mut steps) = (Stopwatch::start(), 0);
        while count.total.abs() < (turns + 0.25) * TAU {
            world.apply_torque(nut, 0, Vec3::z() * 0.004 * direction).unwrap();
            let report = world.step().unwrap();
            (overlap, unconverged) = (overlap.max(report.max_penetration), unconverged + report.unconverged);
            count.of(&world, nut);
            steps += 1;
            assert!(steps < 240 * 60, "{} turns in a minute", count.total / TAU);
            // the first quarter takes up the play
            let place = position(&world, nut).z - thread.pitch * count.total / TAU;
            if count.total.abs() > 0.25 * TAU {
                worst = worst.max((place - *from.get_or_insert(place)).abs());
            }
        }
        let place = position(&world, nut).z - thread.pitch * count.total / TAU;
        let error = (place - from.unwrap_or(place)) / (turns * thread.pitch);
        let seconds = f64::from(steps) * DT;
        println!(
            "nut, {triangles} triangles, {:.2} turns in {seconds:.2} s: pitch error {error:.1e}, {worst:.1e} m at any time, overlap {overlap:.1e} m, {unconverged} unconverged, real-time factor {:.2}",
            count.total / TAU,
            seconds / began.seconds()
        );
        assert!(worst < 1e-4 && overlap < 1e-4, "{worst} m, {overlap} m");
        assert!(!slow() || error.abs() < 1e-3, "{error}");
    }
}

/// Two spur gears on hinges: the wheel follows the pinion within their play, over any number of turns.
#[test]
fn spur_gears_keep_their_ratio_full_length() {
    let turns = if slow() { 100.0 } else { 4.0 };
    let pinion = Gear { module: 0.004, teeth: 20, play: 0.0002, width: 0.02, points: 8 };
    let wheel = Gear { teeth: 30, width: 0.018, ..pinion };
    let mut world = no_gravity(world("time_stepping", DT));
    let apart = pinion.pitch_radius() + wheel.pitch_radius();
    let triangles = pinion.mesh().triangles.len() + wheel.mesh().triangles.len();
    let add = |world: &mut World, name: &str, gear: Gear, pose: Pose, drive: Drive, damping: f64| {
        let body = world.add(steel(name, shape(gear.mesh()), 0.1).with_pose(pose)).unwrap();
        let hinge = LoopJoint::revolute_at(
            name.to_string() + " axle",
            world,
            Some((body, 0)),
            None,
            pose.translation.vector,
            Vec3::z(),
        );
        world.add(hinge.unwrap().with_dof(DofSettings { drive, damping, ..DofSettings::default() }).unwrap()).unwrap();
        body
    };
    let drive = Drive::Velocity { target: TAU, limit: f64::INFINITY };
    let small = add(&mut world, "pinion", pinion, Pose::identity(), drive, 0.0);
    // a gap of the wheel faces the tooth of the pinion on the x axis
    let turned = Pose::new(Vec3::new(apart, 0.0, 0.0), Vec3::z() * (0.5 * TAU + 0.5 * TAU / wheel.teeth as f64));
    let large = add(&mut world, "wheel", wheel, turned, Drive::None, 0.002);
    let (mut first, mut second) = (Turns::of_now(&world, small), Turns::of_now(&world, large));
    let ratio = pinion.teeth as f64 / wheel.teeth as f64;
    let (mut least, mut most, mut overlap, mut unconverged) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64, 0);
    let (mut slowest, mut fastest) = (f64::INFINITY, 0.0f64);
    let speed = run(&mut world, turns, |world| {
        first.of(world, small);
        second.of(world, large);
        let lag = second.total + ratio * first.total;
        (least, most) = (least.min(lag), most.max(lag));
        overlap = overlap.max(world.report().max_penetration);
        unconverged += world.report().unconverged;
        if world.time() > 0.5 {
            let rate = -world.part_state(large, 0).unwrap().angular_velocity.z / (ratio * TAU);
            (slowest, fastest) = (slowest.min(rate), fastest.max(rate));
        }
    });
    println!(
        "gears, {triangles} triangles, {:.3} turns: lag of the wheel {least:.1e} to {most:.1e} rad, rate {slowest:.4} to {fastest:.4}, overlap {overlap:.1e} m, {unconverged} unconverged, real-time factor {speed:.2}",
        first.total / TAU
    );
    // both plays together, as an angle of the wheel
    let play = 2.0 * pinion.play / wheel.pitch_radius();
    assert!(most - least < play && overlap < 1e-4, "{least} to {most} rad, play {play}, overlap {overlap} m");
    assert_eq!(unconverged, 0);
}

/// A pinion that drives a rack on a slide by a turn: the rack follows by the pitch radius within the play.
#[test]
fn a_rack_follows_its_pinion() {
    let pinion = Gear { module: 0.004, teeth: 20, play: 0.0002, width: 0.02, points: 8 };
    let mut world = no_gravity(world("time_stepping", DT));
    let gear = world.add(steel("pinion", shape(pinion.mesh()), 0.1)).unwrap();
    let axle = LoopJoint::revolute_at("axle", &world, Some((gear, 0)), None, Vec3::zeros(), Vec3::z()).unwrap();
    let drive = Drive::Velocity { target: 0.5 * TAU, limit: f64::INFINITY };
    world.add(axle.with_dof(DofSettings { drive, ..DofSettings::default() }).unwrap()).unwrap();
    // a gap faces the tooth of the pinion below its axle
    let mesh = gear::rack(&Gear { width: 0.018, ..pinion }, 30, 25);
    let at = Pose::translation(0.0, -pinion.pitch_radius(), 0.0);
    let rack = world.add(steel("rack", shape(mesh), 0.1).with_pose(at)).unwrap();
    let slide = LoopJoint::prismatic_at("slide", &world, Some((rack, 0)), None, Vec3::zeros(), Vec3::x()).unwrap();
    world.add(slide.with_dof(DofSettings { damping: 20.0, ..DofSettings::default() }).unwrap()).unwrap();
    let (mut turns, start) = (Turns::of_now(&world, gear), position(&world, rack).x);
    let (mut least, mut most, mut overlap, mut unconverged) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64, 0);
    let speed = run(&mut world, 2.0, |world| {
        turns.of(world, gear);
        let lag = position(world, rack).x - start - pinion.pitch_radius() * turns.total;
        (least, most) = (least.min(lag), most.max(lag));
        (overlap, unconverged) =
            (overlap.max(world.report().max_penetration), unconverged + world.report().unconverged);
    });
    println!(
        "rack, {:.3} turns: lag {least:.1e} to {most:.1e} m, overlap {overlap:.1e} m, {unconverged} unconverged, real-time factor {speed:.2}",
        turns.total / TAU
    );
    assert!((turns.total - TAU).abs() < 0.01);
    assert!(most - least < 2e-5 && overlap < 1e-5, "{least} to {most} m, overlap {overlap} m");
}

/// Gears that turn in the exact ratio, in the middle of their play: the gaps that the contacts report against those of
/// the outlines.
#[test]
fn contacts_of_turning_gears_have_the_gaps_of_their_outlines() {
    let pinion = Gear { module: 0.004, teeth: 20, play: 0.0002, width: 0.02, points: 8 };
    let wheel = Gear { teeth: 30, ..pinion };
    let apart = pinion.pitch_radius() + wheel.pitch_radius();
    let (small, large) = (shape(pinion.mesh()), shape(Gear { width: 0.018, ..wheel }.mesh()));
    let mut worst = 0.0f64;
    for k in 0..100 {
        let angle = k as f64 * 0.01;
        let first = Pose::rotation(Vec3::z() * angle);
        let turn = 0.5 * TAU + 0.5 * TAU / wheel.teeth as f64 - angle * 20.0 / 30.0;
        let second = Pose::new(Vec3::new(apart, 0.0, 0.0), Vec3::z() * turn);
        let mut found = Vec::new();
        contacts(&small, &first, &large, &second, 0.0005, &mut found);
        let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
        let exact = gear::gap([&pinion, &wheel], [angle, turn], apart);
        worst = worst.max((least - exact).abs());
        if k % 10 == 0 || (least - exact).abs() > 1e-6 {
            let c = found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap));
            println!(
                "{angle:.2}: {} contacts, gap {least:.3e}, exact {exact:.3e} {:?}",
                found.len(),
                c.map(|c| (c.point, c.normal, c.feature))
            );
        }
    }
    println!("worst {worst:e}");
    assert!(worst < 1e-6);
}

/// The meshes of the scene `mechanism` are those of its program: equal triangles, and points within the rounding of the files.
#[test]
fn the_meshes_of_the_mechanism_are_those_of_its_program() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/mechanism");
    for (name, mesh) in mechanism_meshes::meshes() {
        let text = std::fs::read_to_string(folder.join(format!("{name}.obj"))).unwrap();
        let file = TriMesh::from_obj(&text).unwrap().scaled(0.001);
        let off = file.vertices.iter().zip(&mesh.vertices).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
        assert_eq!((file.vertices.len(), &file.triangles), (mesh.vertices.len(), &mesh.triangles), "{name}");
        assert!(off < 1e-7, "{name}: {off} m");
    }
}
