//! Rigid bodies that bounce without loss: kinetic energy is conserved for any shape and spin.

use crate::common::*;
use std::f64::consts::{FRAC_PI_2, PI};
use tumble_core::collide::{Mat3, Pose, Shape, Vec3};
use tumble_core::*;

/// Six walls of restitution 1, each `half` m from the origin, friction as given.
fn room(world: &mut World, half: f64, restitution: f64, friction: f64) {
    let turns = [(0.0, 0.0), (PI, 0.0), (FRAC_PI_2, 0.0), (-FRAC_PI_2, 0.0), (0.0, FRAC_PI_2), (0.0, -FRAC_PI_2)];
    for (k, (x, y)) in turns.into_iter().enumerate() {
        let rotation = Pose::rotation(Vec3::new(x, y, 0.0)).rotation;
        let wall = RigidBody::fixed(Shape::half_space()).with_name(format!("wall{k}")).with_material(Material {
            restitution,
            friction,
            ..Material::default()
        });
        world
            .add_static(wall.with_pose(Pose::from_parts((rotation * Vec3::new(0.0, 0.0, -half)).into(), rotation)))
            .unwrap();
    }
}

/// Shapes whose contacts have long lever arms.
fn shapes() -> [(&'static str, Shape); 5] {
    let cuboid = |x, y, z| Shape::cuboid(Vec3::new(2.0 * x, 2.0 * y, 2.0 * z)).unwrap();
    [
        ("capsule", Shape::capsule(0.02, 0.4).unwrap()),
        ("long box", cuboid(0.02, 0.03, 0.2)),
        ("plate", cuboid(0.2, 0.15, 0.01)),
        ("brick", cuboid(0.05, 0.1, 0.15)),
        ("cube", cuboid(0.1, 0.1, 0.1)),
    ]
}

/// Extremes of the kinetic energy as fractions of its initial value, the largest increase by a
/// step, and passes of the impact phase.
struct Swing {
    most: f64,
    least: f64,
    jump: f64,
    passes: u32,
}

fn watch(world: &mut World, seconds: f64) -> Swing {
    let start = world.energy().kinetic;
    let (mut swing, mut before) = (Swing { most: 0.0, least: 0.0, jump: 0.0, passes: 0 }, start);
    for _ in 0..(seconds / world.settings().dt).round() as usize {
        swing.passes += world.step().unwrap().impact_passes;
        let now = world.energy().kinetic;
        swing.most = swing.most.max(now / start - 1.0);
        swing.least = swing.least.min(now / start - 1.0);
        swing.jump = swing.jump.max((now - before) / start);
        before = now;
    }
    swing
}

/// A body of the shape that flies and spins in a room of 1.2 m.
fn alone(shape: Shape, rate: f64, spin: Vec3, restitution: f64, friction: f64) -> World {
    let mut world = no_gravity(world("time_stepping", 1.0 / rate));
    room(&mut world, 0.6, restitution, friction);
    let body = RigidBody::new(shape).with_name("body").with_mass(1.0).with_material(Material {
        restitution,
        friction,
        ..Material::default()
    });
    world.add(body.with_velocity(Vec3::new(1.0, 0.7, 0.4)).with_angular_velocity(spin)).unwrap();
    world
}

#[test]
fn a_body_that_spins_in_an_elastic_room_keeps_its_energy() {
    // with rows of the start of the step and the impulse at the time of impact, the capsule gained
    // 321 % in 60 s at 240 Hz, 18 % at 960 Hz, and long boxes without bound
    for (name, shape) in shapes() {
        for (spin, rate) in [
            ([3.0, 8.0, 5.0], 240.0),
            ([0.0, 20.0, 0.0], 240.0),
            ([15.0, 2.0, 30.0], 240.0),
            ([15.0, 2.0, 30.0], 960.0),
        ] {
            let swing = watch(&mut alone(shape.clone(), rate, Vec3::from(spin), 1.0, 0.0), 60.0);
            println!("{name} {spin:?} at {rate} Hz: {:+e} to {:+e}, {} passes", swing.least, swing.most, swing.passes);
            assert!(swing.passes > 100, "{name}: {} passes", swing.passes);
            assert!(
                swing.most < 1e-9 && swing.least > -1e-9,
                "{name} {spin:?} at {rate} Hz: energy from {:+e} to {:+e}",
                swing.least,
                swing.most
            );
        }
    }
}

#[test]
fn a_body_that_loses_a_little_at_every_wall_gains_at_none() {
    for (name, shape) in shapes() {
        for (restitution, friction) in [(0.9, 0.0), (0.8, 0.3), (1.0, 0.3)] {
            let swing = watch(&mut alone(shape.clone(), 240.0, Vec3::new(3.0, 8.0, 5.0), restitution, friction), 20.0);
            println!(
                "{name} e {restitution} mu {friction}: {:+e} to {:+e}, jump {:e}, {} passes",
                swing.least, swing.most, swing.jump, swing.passes
            );
            assert!(swing.passes > 10 && swing.least < -0.5, "{name}: {} passes, {:+e}", swing.passes, swing.least);
            assert!(
                swing.jump < 1e-12,
                "{name}, e = {restitution}, mu = {friction}: a step added {:e} of the energy",
                swing.jump
            );
        }
    }
}

#[test]
fn bodies_that_strike_each_other_and_the_walls_keep_their_energy() {
    for count in [2, 6] {
        let mut world = no_gravity(world("time_stepping", 1.0 / 240.0));
        room(&mut world, 0.6, 1.0, 0.0);
        for (i, (name, shape)) in shapes().into_iter().cycle().take(count).enumerate() {
            let (x, y) = ((i % 2) as f64 - 0.5, (i / 2) as f64 / 2.0 - 0.5);
            let body = RigidBody::new(shape)
                .with_name(format!("{name} {i}"))
                .with_mass(1.0 + i as f64)
                .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() });
            let spin = Vec3::new(5.0 - i as f64, 8.0, 3.0 + i as f64);
            world
                .add(
                    body.with_pose(Pose::translation(0.6 * x, 0.7 * y, 0.1 * x))
                        .with_velocity(Vec3::new(-x, 0.7 * y, 0.4))
                        .with_angular_velocity(spin),
                )
                .unwrap();
        }
        let swing = watch(&mut world, 60.0);
        println!("{count} bodies: {:+e} to {:+e}, {} passes", swing.least, swing.most, swing.passes);
        assert!(
            swing.passes > 200 && swing.most.max(-swing.least) < 1e-9,
            "{count} bodies: {:+e} to {:+e}",
            swing.least,
            swing.most
        );
    }
}

#[test]
fn a_body_that_bounces_on_the_ground_keeps_its_energy() {
    for (name, shape) in shapes() {
        let mut world = world("time_stepping", 1.0 / 240.0);
        ground(&mut world, 1.0, 0.0);
        let body = RigidBody::new(shape)
            .with_name("body")
            .with_mass(1.0)
            .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
            .with_pose(Pose::translation(0.0, 0.0, 1.0));
        world.add(body.with_angular_velocity(Vec3::new(3.0, 8.0, 5.0))).unwrap();
        let start = world.energy().total();
        let (mut most, mut least, mut passes): (f64, f64, u32) = (0.0, 0.0, 0);
        for _ in 0..240 * 60 {
            passes += world.step().unwrap().impact_passes;
            let change = world.energy().total() / start - 1.0;
            (most, least) = (most.max(change), least.min(change));
        }
        println!("{name} under gravity: {least:+e} to {most:+e}, {passes} passes");
        assert!(passes > 50, "{name}: {passes} passes");
        assert!(most.max(-least) < 1e-3, "{name}: energy from {least:+e} to {most:+e}");
    }
}

#[test]
fn a_free_body_of_three_moments_keeps_energy_and_angular_momentum() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 60.0));
        let body = RigidBody::new(sphere(1.0))
            .with_name("top")
            .with_mass_and_inertia(1.0, Mat3::from_diagonal(&Vec3::new(1.0, 2.0, 3.0)));
        world.add(body.with_angular_velocity(Vec3::new(0.01, 8.0, 0.01))).unwrap();
        let (energy, momentum) = (world.energy().kinetic, world.momentum().angular);
        for _ in 0..60 * 20 {
            world.step().unwrap();
            let (e, l) =
                (world.energy().kinetic / energy - 1.0, (world.momentum().angular - momentum).norm() / momentum.norm());
            assert!(e.abs() < 1e-12 && l < 1e-12, "{stepper}: energy off by {e:e}, angular momentum by {l:e}");
        }
    }
}
