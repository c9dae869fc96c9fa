//! Boxes that are meshes of twelve triangles, in the `surface` mode: they rest and stack like
//! primitive boxes.

use crate::common::*;
use tumble_core::collide::{Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

fn mesh_cube(edge: f64) -> Shape {
    Shape::mesh(TriMesh::cuboid(Vec3::repeat(edge)), &TreeSettings::octree()).unwrap()
}

fn add(world: &mut World, name: &str, shape: &Shape, pose: Pose) -> ObjectId {
    world
        .add(
            RigidBody::new(shape.clone())
                .with_name(name)
                .with_mass(10.0)
                .with_material(Material { friction: 0.5, ..Material::default() })
                .with_pose(pose),
        )
        .unwrap()
}

fn run(world: &mut World, seconds: f64) {
    (0..(seconds * 60.0) as usize).for_each(|_| {
        world.step().unwrap();
    });
}

#[test]
fn a_mesh_box_on_a_plane_does_not_rock() {
    for stepper in STEPPERS {
        // placed, dropped, and dropped askew
        for (height, turn) in [(0.25, Vec3::zeros()), (0.35, Vec3::zeros()), (0.5, Vec3::new(0.3, 0.2, 0.1))] {
            let mut world = world(stepper, 1.0 / 60.0);
            ground(&mut world, 0.0, 0.5);
            let id = add(&mut world, "box", &mesh_cube(0.5), Pose::new(Vec3::z() * height, turn));
            run(&mut world, 2.0);
            let part_state = world.part_state(id, 0).unwrap();
            let (spin, speed) = (part_state.angular_velocity.norm(), part_state.velocity.norm());
            assert!(spin < 1e-6 && speed < 1e-6, "{stepper}, from {height}: {spin} rad/s, {speed} m/s");
            assert!(
                (part_state.position().z - 0.25).abs() < 2e-4,
                "{stepper}, from {height}: at {}",
                part_state.position().z
            );
        }
    }
}

#[test]
fn ten_mesh_boxes_stand_for_a_minute() {
    for stepper in STEPPERS {
        let (mut world, shape) = (world(stepper, 1.0 / 60.0), mesh_cube(0.5));
        ground(&mut world, 0.0, 0.5);
        let place = |i: usize| Vec3::z() * (0.25 + 0.5 * i as f64);
        let ids: Vec<_> = (0..10).map(|i| add(&mut world, &format!("box{i}"), &shape, Pose::from(place(i)))).collect();
        run(&mut world, 60.0);
        let off = |i: usize| (position(&world, ids[i]) - place(i)).norm();
        println!("{stepper}: the top box moved by {:.1e} m in 60 s", off(9));
        assert!((0..10).all(|i| off(i) < 1e-3), "{stepper}: {:?}", (0..10).map(off).collect::<Vec<_>>());
    }
}

#[test]
fn a_mesh_box_rests_on_another_however_it_lies() {
    let small = mesh_cube(0.2);
    for stepper in STEPPERS {
        for (shift, yaw) in [(0.0, 0.0), (0.1, 0.0), (0.15, 0.0), (0.0, 0.25 * std::f64::consts::PI), (0.05, 0.7)] {
            for upper in [mesh_cube(0.5), small.clone()] {
                let mut world = world(stepper, 1.0 / 60.0);
                ground(&mut world, 0.0, 0.5);
                let lower = add(&mut world, "lower", &mesh_cube(0.5), Pose::translation(0.0, 0.0, 0.25));
                let height = 0.5 + if upper.bounding_radius() > 0.2 { 0.25 } else { 0.1 };
                let pose = Pose::from_parts(
                    Vec3::new(shift, 0.6 * shift, height).into(),
                    Quat::from_scaled_axis(Vec3::z() * yaw),
                );
                let upper = add(&mut world, "upper", &upper, pose);
                run(&mut world, 2.0);
                for id in [lower, upper] {
                    let part_state = world.part_state(id, 0).unwrap();
                    let (spin, speed) = (part_state.angular_velocity.norm(), part_state.velocity.norm());
                    assert!(spin < 1e-6 && speed < 1e-6, "{stepper}, {shift} m, {yaw} rad: {spin} rad/s, {speed} m/s");
                }
                assert!((position(&world, upper) - pose.translation.vector).norm() < 1e-4, "{stepper}, {shift}, {yaw}");
            }
        }
    }
}

/// A cylinder stands on a mesh box and rolls along it, as on a plane.
#[test]
fn a_cylinder_stands_and_rolls_on_a_block() {
    for stepper in STEPPERS {
        for block in [
            Shape::cuboid(Vec3::new(10.0, 2.0, 0.2)).unwrap(),
            Shape::mesh(TriMesh::cuboid(Vec3::new(10.0, 2.0, 0.2)), &TreeSettings::octree()).unwrap(),
        ] {
            let mut world = world(stepper, 1.0 / 60.0);
            world
                .add_static(
                    RigidBody::fixed(block)
                        .with_name("floor")
                        .with_material(Material { friction: 0.5, ..Material::default() }),
                )
                .unwrap();
            let shape = Shape::cylinder(0.1, 0.4).unwrap();
            let standing = add(&mut world, "standing", &shape, Pose::translation(-2.0, 0.5, 0.3));
            let lying = Pose::new(Vec3::new(-2.0, 0.0, 0.2), Vec3::x() * std::f64::consts::FRAC_PI_2);
            let body = RigidBody::new(shape)
                .with_name("rolling")
                .with_mass(10.0)
                .with_material(Material { friction: 0.5, ..Material::default() })
                .with_pose(lying);
            // rolls at 1 m/s: turns at 10 rad/s
            let rolling = world.add(body.with_velocity(Vec3::x()).with_angular_velocity(Vec3::y() * 10.0)).unwrap();
            run(&mut world, 2.0);
            let part_state = world.part_state(standing, 0).unwrap();
            // the solver leaves a residual of about 1e-4 m/s in this tall body's contacts
            assert!(
                (part_state.position() - Vec3::new(-2.0, 0.5, 0.3)).norm() < 2e-3,
                "{stepper}: {:?}",
                part_state.pose
            );
            assert!((part_state.pose.rotation * Vec3::z()).z > 1.0 - 1e-6, "{stepper}: {:?}", part_state.pose);
            let part_state = world.part_state(rolling, 0).unwrap();
            let off = part_state.position() - Vec3::new(0.0, 0.0, 0.2);
            assert!(
                off.norm() < 2e-3 && (part_state.velocity - Vec3::x()).norm() < 2e-3,
                "{stepper}: {off:?} {:?}",
                part_state.velocity
            );
        }
    }
}
