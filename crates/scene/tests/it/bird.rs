//! Claims of the page of the bird: laws of momentum and energy.

use std::sync::Arc;

use tumble_core::articulated::{Drive, Playback};
use tumble_core::collide::Vec3;
use tumble_core::{ArticulatedBody, Integratable, ObjectId, World};
use tumble_scene::{FieldKind, PanelSpec, SceneFile, part_by_name, shipped};

const G: f64 = 9.81;
/// The parts of the panels in the order of the file.
const PARTS: [&str; 6] = ["left_wing", "left_wing", "right_wing", "right_wing", "torso", "torso"];

/// The scene without the flock and its swifts: nothing steers the bird.
fn bird() -> SceneFile {
    let mut scene = flock();
    scene.behaviors.body_flocks.clear();
    scene.bodies.retain(|body| !body.name.starts_with("swift"));
    scene
}

fn flock() -> SceneFile {
    shipped().iter().find(|scene| scene.name == "bird").unwrap().read().unwrap()
}

fn panels(scene: &SceneFile) -> Vec<PanelSpec> {
    match &scene.behaviors.fields[0].kind {
        FieldKind::Panels { panels, .. } => panels.clone(),
        other => panic!("{other:?}"),
    }
}

/// Returns the force of the air on all panels, N, and its power on the bird, W, by the formula of the page of behaviors.
fn air(world: &World, panels: &[PanelSpec]) -> (Vec3, f64) {
    let (mut force, mut power) = (Vec3::zeros(), 0.0);
    for (panel, link) in panels.iter().zip(PARTS) {
        let (id, part) = part_by_name(world, &format!("bird/{link}")).unwrap();
        let state = world.part_state(id, part).unwrap();
        let at = state.pose.transform_point(&panel.point_m.into()).coords;
        let v = state.velocity + state.angular_velocity.cross(&(at - state.position()));
        let n = state.pose.rotation * Vec3::from(panel.normal);
        let u = Vec3::new(-10.0, 0.0, 0.0) - v;
        let f = 0.5 * 1.2 * panel.area_m2 * u.norm() * (panel.lift_slope * u.dot(&n) * n + panel.drag * u);
        force += f;
        power += f.dot(&v);
    }
    (force, power)
}

fn mass(world: &World, id: ObjectId) -> f64 {
    let body: &ArticulatedBody = world.get(id).unwrap();
    (0..=body.model().links().len()).map(|part| body.part_mass(part)).sum()
}

/// Flies for 6 s, then ten flaps. Returns the mean force of the air, the rate of momentum beyond weight, N, and the mean speed up, m/s.
fn ten_flaps(dt: f64) -> (Vec3, Vec3, f64) {
    let mut scene = bird();
    scene.world.dt_s = dt;
    let (mut world, _) = scene.build().unwrap();
    let id = world.find("bird").unwrap();
    let (panels, m) = (panels(&scene), mass(&world, id));
    assert!((m - 0.792).abs() < 1e-9, "{m}");
    for _ in 0..(6.0 / dt).round() as usize {
        world.step().unwrap();
    }
    let height = |world: &World| world.part_state(id, 0).unwrap().position().z;
    let (before, start, steps) = (world.momentum().linear, height(&world), (2.0 / dt).round() as usize);
    let mut mean = Vec3::zeros();
    for _ in 0..steps {
        world.step().unwrap();
        mean += air(&world, &panels).0 / steps as f64;
    }
    let change = (world.momentum().linear - before) / 2.0;
    (mean, change, (height(&world) - start) / 2.0)
}

#[test]
fn the_mean_lift_over_whole_flaps_is_the_weight() {
    let weight = Vec3::new(0.0, 0.0, 0.792 * G);
    let errors = [240.0, 480.0, 960.0].map(|rate| {
        let (mean, change, rise) = ten_flaps(1.0 / rate);
        println!("{rate} Hz: mean {mean:?} N, change of momentum {change:?} N, rises {rise} m/s");
        assert!((mean.z / weight.z - 1.0).abs() < 0.03 && rise.abs() < 0.25, "{} N, {rise} m/s", mean.z);
        (mean - weight - change).norm() / weight.z
    });
    // the law of momentum: forces are constant over a step, an error of first order
    assert!(errors[0] < 0.02 && errors[1] < 0.6 * errors[0] && errors[2] < 0.6 * errors[1], "{errors:?}");
}

/// The bird with its wings held at the mean of their motions.
fn held(dt: f64) -> World {
    let mut scene = bird();
    scene.world.dt_s = dt;
    scene.bodies.clear(); // no ground below
    for link in &mut scene.articulated[0].links {
        if let Drive::Playback { motion, limit } = link.joint.dof.drive.clone() {
            let mean = (0..24).map(|k| motion.at(f64::from(k) * 0.2 / 24.0).0).sum::<f64>() / 24.0;
            let still = Playback::new(vec![0.0, 1.0], vec![mean; 2]).unwrap();
            link.joint.dof.drive = Drive::Playback { motion: Arc::new(still), limit };
        }
    }
    scene.build().unwrap().0
}

#[test]
fn wings_that_are_held_let_it_sink_by_the_work_of_the_air() {
    let panels = panels(&bird());
    let errors: Vec<f64> = [1.0 / 240.0, 1.0 / 480.0]
        .into_iter()
        .map(|dt| {
            let mut world = held(dt);
            // the wings are at the mean from the first step on
            (0..(0.5 / dt) as usize).for_each(|_| {
                world.step().unwrap();
            });
            let id = world.find("bird").unwrap();
            let height = |world: &World| world.part_state(id, 0).unwrap().position().z;
            let (start, top, mut work, mut power) =
                (world.energy().total(), height(&world), 0.0, air(&world, &panels).1);
            for _ in 0..(8.0 / dt) as usize {
                world.step().unwrap();
                let now = air(&world, &panels).1;
                (work, power) = (work + 0.5 * dt * (power + now), now);
            }
            let sink = (top - height(&world)) / 8.0;
            println!("dt {dt}: sinks {sink} m/s, energy {} J, work {work} J", world.energy().total() - start);
            assert!((1.5..2.0).contains(&sink), "{sink}");
            (world.energy().total() - start - work).abs()
        })
        .collect();
    assert!(errors[0] < 1.0 && errors[1] < 0.6 * errors[0], "{errors:?}");
}

/// In the flock the gull is a boid: it keeps its speed and its place, turns back what disturbs it, and its wings still carry it.
#[test]
fn the_flock_steers_the_torso_of_the_bird() {
    let scene = flock();
    let (mut world, _) = scene.build().unwrap();
    let id = world.find("bird").unwrap();
    let swifts: Vec<ObjectId> = (1..=4).map(|k| world.find(&format!("swift_{k}")).unwrap()).collect();
    let (panels, wind) = (panels(&scene), Vec3::new(-10.0, 0.0, 0.0));
    let nose = |world: &World| world.part_state(id, 0).unwrap().pose.rotation * Vec3::x();
    let run = |world: &mut World, seconds: f64| {
        let steps = (seconds * 240.0).round() as usize;
        let (mut lift, mut farthest, mut course) = (0.0, 0f64, 1f64);
        for _ in 0..steps {
            world.step().unwrap();
            lift += air(world, &panels).0.z / steps as f64;
            let state = world.part_state(id, 0).unwrap();
            let v = state.velocity - wind;
            farthest = farthest.max((state.position() - Vec3::new(0.0, 0.0, 2.2)).norm());
            course = course.min(nose(world).dot(&v.normalize()));
            assert!((7.0..13.0).contains(&v.norm()), "{} m/s at {} s", v.norm(), world.time());
        }
        (lift, farthest, course)
    };
    run(&mut world, 4.0);
    let (lift, farthest, course) = run(&mut world, 4.0);
    println!("lift {lift} N, within {farthest} m, nose within {} rad", course.acos());
    assert!((lift / (0.792 * G) - 1.0).abs() < 0.25, "{lift} N");
    assert!(farthest < 2.5 && course > 0.9, "{farthest} m, {course}");
    for (k, a) in swifts.iter().enumerate() {
        let x = world.part_state(*a, 0).unwrap().position();
        assert!((x - Vec3::new(0.0, 0.0, 2.2)).norm() < 2.5, "{x}");
        for b in swifts[k + 1..].iter().chain([&id]) {
            assert!((x - world.part_state(*b, 0).unwrap().position()).norm() > 0.2);
        }
    }
}

/// A push against the tail turns the bird. Free, it flies off on a slow curve, as gliders do; in the flock its nose comes back.
#[test]
fn a_push_against_the_tail_is_steered_back() {
    let off = |scene: SceneFile| {
        let (mut world, _) = scene.build().unwrap();
        let id = world.find("bird").unwrap();
        let steps = |world: &mut World, seconds: f64| {
            (0..(seconds * 240.0) as usize).for_each(|_| {
                world.step().unwrap();
            });
        };
        steps(&mut world, 4.0);
        let tail = world.part_state(id, 0).unwrap().pose.transform_point(&Vec3::new(-0.3, 0.0, 0.0).into()).coords;
        world.apply_impulse(id, 0, Vec3::new(0.0, 0.4, 0.0), &tail).unwrap();
        steps(&mut world, 3.0);
        let nose = world.part_state(id, 0).unwrap().pose.rotation * Vec3::x();
        nose.y.atan2(nose.x).abs()
    };
    let (free, steered) = (off(bird()), off(flock()));
    println!("off the wind by {free} rad free, {steered} rad in the flock");
    assert!(steered < 0.15 && free > 2.0 * steered, "{free} rad free, {steered} rad in the flock");
}
