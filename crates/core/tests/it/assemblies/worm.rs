//! A worm and its wheel: a trapezoidal thread whose axial section is the rack of the wheel's involute teeth.
//!
//! ```text
//! p = π·m        tan γ = m/(2·r₁)        θ = φ/z        a free worm is held by friction if μ > cos α·tan γ
//! ```
//!
//! `m` module, `p` pitch of the thread, `r₁` its pitch radius, `γ` its lead angle, `φ`, `θ` angles of worm and wheel, `z`
//! teeth of the wheel, `α` = 20°.

use super::gear::Gear;
use super::thread::Thread;
use super::*;
use std::f64::consts::PI;
use tumble_core::collide::Mat3;

const MODULE: f64 = 0.004;
const RADIUS: f64 = 5.0 * MODULE;
const WHEEL: Gear = Gear { module: MODULE, teeth: 30, play: 0.0003, width: 0.012, points: 6 };

fn thread() -> Thread {
    // flanks of a quarter of the pitch at 20°
    let depth = 0.25 * PI * MODULE / 20.0_f64.to_radians().tan();
    Thread { pitch: PI * MODULE, root: RADIUS - 0.5 * depth, crest: RADIUS + 0.5 * depth, facets: 48, turns: 5 }
}

/// Returns the wheel about z with its teeth along the thread.
fn wheel() -> TriMesh {
    WHEEL.twisted(MODULE / (2.0 * RADIUS) / WHEEL.pitch_radius(), 5)
}

/// Worm and wheel on hinges. Returns both bodies and the number of triangles.
fn gearbox(friction: f64, worm_drive: Drive, damping: f64) -> (World, [ObjectId; 2], usize) {
    let mut world = no_gravity(world("time_stepping", DT));
    let (thread, teeth) = (thread(), wheel());
    let bolt = thread.bolt(0.8 * thread.root);
    let triangles = bolt.triangles.len() + teeth.triangles.len();
    // a gap of the thread faces the tooth of the wheel: its x axis towards the worm, its axis along y
    let rotation = Mat3::from_columns(&[-Vec3::x(), Vec3::z(), Vec3::y()]);
    let rotation = nalgebra::UnitQuaternion::from_matrix(&rotation);
    let at = Vec3::new(RADIUS + WHEEL.pitch_radius(), 0.0, 2.875 * thread.pitch);
    let mut ids = Vec::new();
    for (name, mesh, pose, axis, drive, damping) in [
        ("worm", bolt, Pose::identity(), Vec3::z(), worm_drive, 0.0),
        ("wheel", teeth, Pose::from_parts(at.into(), rotation), Vec3::y(), Drive::None, damping),
    ] {
        let body = world.add(steel(name, shape(mesh), friction).with_pose(pose)).unwrap();
        let hinge = LoopJoint::revolute_at(
            format!("{name} axle"),
            &world,
            Some((body, 0)),
            None,
            pose.translation.vector,
            axis,
        );
        world.add(hinge.unwrap().with_dof(DofSettings { drive, damping, ..DofSettings::default() }).unwrap()).unwrap();
        ids.push(body);
    }
    (world, [ids[0], ids[1]], triangles)
}

fn angle(world: &World, axle: &str) -> f64 {
    world.get::<LoopJoint>(world.find(axle).unwrap()).unwrap().position(&world.view()).unwrap()[0]
}

/// The wheel follows the worm by a tooth in each turn, within the play.
#[test]
fn a_worm_turns_its_wheel_by_a_tooth_in_a_turn_full_length() {
    let seconds = if slow() { 30.0 } else { 2.0 };
    let drive = Drive::Velocity { target: 2.0 * TAU, limit: f64::INFINITY };
    let (mut world, [worm, _], triangles) = gearbox(0.05, drive, 0.01);
    assert!(triangles <= 20_000);
    let mut turns = Turns::of_now(&world, worm);
    let (mut total, mut last) = (0.0, 0.0);
    let (mut least, mut most, mut overlap, mut unconverged) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64, 0);
    let speed = run(&mut world, seconds, |world| {
        turns.of(world, worm);
        let now = angle(world, "wheel axle");
        total += (now - last + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
        last = now;
        // the first tenth of a turn takes up the play
        if turns.total > 0.1 * TAU {
            let lag = total + turns.total / WHEEL.teeth as f64;
            (least, most) = (least.min(lag), most.max(lag));
        }
        (overlap, unconverged) =
            (overlap.max(world.report().max_penetration), unconverged + world.report().unconverged);
    });
    let play = 2.0 * WHEEL.play / WHEEL.pitch_radius();
    println!(
        "worm, {triangles} triangles, {:.2} turns, wheel {:.5} turns: lag {least:.1e} to {most:.1e} rad, play {play:.1e}, overlap {overlap:.1e} m, {unconverged} unconverged, real-time factor {speed:.2}",
        turns.total / TAU,
        total / TAU
    );
    assert!((turns.total / TAU - 2.0 * seconds).abs() < 0.01);
    assert!(most - least < play && overlap < 1e-4, "{least} to {most} rad, play {play}, overlap {overlap} m");
}

/// A torque on the wheel turns the free worm without friction, and is held with a friction above `cos α·tan γ` = 0.094.
#[test]
fn friction_locks_a_worm_against_its_wheel() {
    for (friction, locks) in [(0.0, false), (0.3, true)] {
        let (mut world, [worm, wheel], _) = gearbox(friction, Drive::None, 0.0);
        let mut turns = Turns::of_now(&world, worm);
        run(&mut world, 0.5, |world| {
            world.apply_torque(wheel, 0, Vec3::y() * 0.5).unwrap();
            turns.of(world, worm);
        });
        println!("friction {friction}: the worm turns by {:.2e} turns", turns.total / TAU);
        assert_eq!(turns.total.abs() < 0.1 * TAU, locks, "{}", turns.total);
    }
}
