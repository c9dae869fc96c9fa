//! Energy of bodies of every convex shape, rounded ones among them, that fall on a ground and that strike each other in free space.

use crate::common::world;
use crate::random_scenes::Random;
use tumble_core::collide::{Pose, Quat, Shape, Vec3};
use tumble_core::*;

/// Shapes of a size of about 0.2 m.
fn shapes() -> Vec<(&'static str, Shape)> {
    vec![
        ("box", Shape::cuboid(Vec3::new(0.2, 0.15, 0.1)).unwrap()),
        ("rounded box", Shape::rounded_cuboid(Vec3::new(0.2, 0.15, 0.1), 0.02).unwrap()),
        ("capsule", Shape::capsule(0.05, 0.2).unwrap()),
        ("cylinder", Shape::cylinder(0.1, 0.12).unwrap()),
        ("rounded cylinder", Shape::rounded_cylinder(0.1, 0.12, 0.012).unwrap()),
        ("disc", Shape::cylinder(0.1, 0.03).unwrap()),
        ("rounded disc", Shape::rounded_cylinder(0.1, 0.03, 0.01).unwrap()),
        ("cone", Shape::cone(0.1, 0.15).unwrap()),
        ("ellipsoid", Shape::ellipsoid(Vec3::new(0.2, 0.1, 0.15)).unwrap()),
    ]
}

/// The largest rise of the energy in a frame of 2 s, relative to the first energy.
fn rise(world: &mut World, rate: f64) -> f64 {
    let first = world.energy().total();
    let (mut last, mut rise) = (first, 0.0f64);
    for _ in 0..(2.0 * rate) as usize {
        world.step().unwrap();
        let now = world.energy().total();
        rise = rise.max((now - last) / first);
        last = now;
    }
    rise
}

fn turned(random: &mut Random, at: Vec3) -> Pose {
    Pose::from_parts(at.into(), Quat::from_scaled_axis(random.vector(3.0)))
}

/// The worst of some scenes and the number of those above a thousandth.
fn worst(count: u64, mut scene: impl FnMut(u64) -> f64) -> (f64, u64, u32) {
    let mut found = (0.0, 0, 0);
    for seed in 0..count {
        let rise = scene(seed);
        found.2 += u32::from(rise > 1e-3);
        if rise > found.0 {
            (found.0, found.1) = (rise, seed);
        }
    }
    found
}

#[test]
fn a_body_that_falls_gains_no_energy() {
    for stepper in STEPPERS {
        for rate in [60.0, 240.0] {
            for (name, shape) in shapes() {
                let found = [0.0, 0.5].map(|restitution| {
                    worst(if stepper == "time_stepping" { 24 } else { 6 }, |seed| {
                        let mut random = Random(seed + 1);
                        let mut world = world(stepper, 1.0 / rate);
                        let material = Material { restitution, friction: 0.5, ..Material::default() };
                        world.add(RigidBody::fixed(Shape::half_space()).with_material(material)).unwrap();
                        let pose = turned(&mut random, Vec3::z() * 0.4);
                        let spin = random.vector(5.0);
                        let body = RigidBody::new(shape.clone()).with_mass(1.0).with_material(material);
                        world.add(body.with_pose(pose).with_angular_velocity(spin)).unwrap();
                        rise(&mut world, rate)
                    })
                });
                println!(
                    "{stepper} {rate} {name}: worst rise, its scene and those above 1e-3 at e = 0 and 0.5 {found:?}"
                );
                // what is left is the lift of overlaps, and vanishes with the step
                let bar = if rate == 60.0 { 1.5e-2 } else { 5e-3 };
                assert!(found.iter().all(|(rise, ..)| *rise < bar), "{stepper} {rate} {name}: {found:?}");
            }
        }
    }
}

#[test]
fn bodies_that_strike_each_other_gain_no_energy() {
    let shapes = shapes();
    for stepper in STEPPERS {
        for rate in [60.0, 240.0] {
            for restitution in [0.0, 0.5, 0.9] {
                let found = [0.0, 0.3].map(|friction| {
                    worst(if stepper == "time_stepping" { 200 } else { 30 }, |seed| {
                        let mut random = Random(seed + 1);
                        let mut world = world(stepper, 1.0 / rate);
                        world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
                        let material = Material { restitution, friction, ..Material::default() };
                        for side in [-1.0, 1.0] {
                            let shape = shapes[random.next(0.0, shapes.len() as f64) as usize].1.clone();
                            let pose = turned(&mut random, Vec3::new(0.15 * side, 0.0, 0.0));
                            let velocity = Vec3::new(-0.5 * side, 0.0, 0.0);
                            let spin = random.vector(30.0);
                            let body = RigidBody::new(shape).with_mass(random.next(0.3, 3.0)).with_material(material);
                            let body = body.with_pose(pose).with_velocity(velocity).with_angular_velocity(spin);
                            world.add(body).unwrap();
                        }
                        rise(&mut world, rate)
                    })
                });
                println!("{stepper} {rate} e {restitution}: worst rise, its scene and those above 1e-3 {found:?}");
                assert!(found.iter().all(|(rise, ..)| *rise < 3e-3), "{stepper} {rate} {restitution}: {found:?}");
            }
        }
    }
}
