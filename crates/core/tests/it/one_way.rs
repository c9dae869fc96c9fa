//! Bodies that collide on one side only: one-way platforms and one-sided terrain.

use tumble_core::collide::{Pose, Quat, Shape, TriMesh, Vec3};
use tumble_core::prelude::*;
use tumble_core::{ObjectId, STEPPERS, stepper_by_name};

const G: f64 = 9.81;

fn world(stepper: &str) -> World {
    let mut world = World::new(Settings::default().with_dt(1.0 / 240.0)).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world
}

fn ball(z: f64, speed: f64) -> RigidBody {
    let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(1.0);
    ball.with_pose(Pose::translation(0.0, 0.0, z)).with_velocity(speed * Vec3::z())
}

fn height(world: &World, id: ObjectId) -> f64 {
    world.body(id).unwrap().position().z
}

/// A hill of 4 × 4 m whose middle has the height 1 m and whose border has 0.7 m.
fn hill() -> Shape {
    let at = |k: usize| -2.0 + 0.25 * k as f64;
    let height = |x: f64, y: f64| 1.0 - 0.15 * (x * x).max(y * y) / 2.0;
    let vertices = (0..17 * 17).map(|n| (at(n % 17), at(n / 17))).map(|(x, y)| Vec3::new(x, y, height(x, y)));
    let cell = |n: usize| {
        let (a, b) = ((n / 16 * 17 + n % 16) as u32, 17);
        [[a, a + 1, a + b + 1], [a, a + b + 1, a + b]]
    };
    let mesh = TriMesh { vertices: vertices.collect(), triangles: (0..256).flat_map(cell).collect() };
    Shape::terrain(&mesh, Some(0.1)).unwrap()
}

fn surfaces() -> [(RigidBody, f64); 2] {
    let platform = RigidBody::fixed(Shape::cuboid(Vec3::new(1.0, 1.0, 0.1)).unwrap());
    [(platform.with_pose(Pose::translation(0.0, 0.0, 0.95)), 1.0), (RigidBody::fixed(hill()), 1.0)]
}

#[test]
fn what_comes_from_below_passes_and_lands_on_top() {
    for (surface, top) in surfaces() {
        for stepper in STEPPERS {
            let mut world = world(stepper);
            world.add_static(surface.clone().with_one_way(3.0 * Vec3::z())).unwrap();
            let id = world.add(ball(0.2, 6.0)).unwrap();
            let mut highest: f64 = 0.0;
            for _ in 0..480 {
                world.step().unwrap();
                highest = highest.max(height(&world, id));
            }
            // nothing brakes it on its way up, by the energy
            let wanted = 0.2 + 6.0 * 6.0 / (2.0 * G);
            assert!((highest - wanted).abs() < 2e-3, "{stepper}: {highest} instead of {wanted}");
            let rest = height(&world, id);
            assert!((rest - (top + 0.1)).abs() < 1e-3, "{stepper}: it rests at {rest}");
        }
    }
}

#[test]
fn without_a_direction_both_sides_collide() {
    for (surface, top) in surfaces() {
        let mut world = world("time_stepping");
        world.add_static(surface).unwrap();
        let id = world.add(ball(0.2, 6.0)).unwrap();
        for _ in 0..60 {
            world.step().unwrap();
            assert!(height(&world, id) < top - 0.1);
        }
    }
}

#[test]
fn fast_bodies_are_stopped_on_one_side_and_pass_on_the_other() {
    for (surface, top) in surfaces() {
        let mut world = world("time_stepping");
        world.add_static(surface.with_one_way(Vec3::z())).unwrap();
        let down = world.add(ball(6.0, -80.0)).unwrap();
        let up = world.add(ball(-3.0, 80.0).with_pose(Pose::translation(0.3, 0.0, -3.0))).unwrap();
        for _ in 0..24 {
            world.step().unwrap();
        }
        assert!(height(&world, down) > top, "{}", height(&world, down));
        let free = -3.0 + 80.0 * 0.1 - 0.5 * G * 0.01;
        assert!((height(&world, up) - free).abs() < 1e-9, "{}", height(&world, up));
    }
}

#[test]
fn the_direction_turns_with_the_body_and_is_kept() {
    // upside down the open side is above
    let (surface, _) = surfaces().into_iter().next().unwrap();
    let turned = Pose::from_parts(Vec3::zeros().into(), Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI));
    let mut world = world("time_stepping");
    let platform = world.add_static(surface.with_pose(turned).with_one_way(Vec3::z())).unwrap();
    let id = world.add(ball(0.5, 0.0)).unwrap();
    let mut copies = [world.fork(), World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap()];
    let after = |world: &mut World| {
        (0..240).for_each(|_| {
            world.step().unwrap();
        });
        world.state().to_vec()
    };
    let wanted = after(&mut world);
    assert!((height(&world, id) - (0.5 - 0.5 * G)).abs() < 1e-9, "it falls through");
    assert!(copies.iter_mut().all(|copy| after(copy) == wanted));
    assert_eq!(world.get::<RigidBody>(platform).unwrap().one_way, Some(Vec3::z()));
    let wrong = ball(0.0, 0.0).with_one_way(Vec3::zeros()).validate().unwrap_err().to_string();
    assert!(wrong.contains("one-way direction"), "{wrong}");
}

#[test]
fn a_heap_rests_on_one_sided_terrain_as_on_a_solid_one() {
    let rest = |one_way: bool| {
        let mut world = world("time_stepping");
        let hill = RigidBody::fixed(hill());
        world.add_static(if one_way { hill.with_one_way(Vec3::z()) } else { hill }).unwrap();
        for k in 0..8 {
            let shape = if k % 2 == 0 { Shape::cuboid(Vec3::repeat(0.2)) } else { Shape::capsule(0.08, 0.2) };
            let pose = Pose::translation(0.3 * (k % 3) as f64 - 0.3, 0.3 * (k / 3) as f64 - 0.3, 1.3);
            let body = RigidBody::new(shape.unwrap()).with_material(Material { friction: 0.9, ..Material::default() });
            world.add(body.with_pose(pose)).unwrap();
        }
        (0..480).for_each(|_| {
            world.step().unwrap();
        });
        world.state().to_vec()
    };
    assert!(rest(true) == rest(false), "the same bits: no contact on top is lost");
}
