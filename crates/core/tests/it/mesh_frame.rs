//! A mesh keeps the frame of its file: bodies are placed by it, and move about their center of
//! mass.

use crate::common::*;
use nalgebra::{Point3, UnitQuaternion};
use tumble_core::collide::{Mat3, Pose, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

/// A cube of edge 1 with one corner at the origin of its file, and its vertices there.
fn corner_cube() -> (Shape, Vec<Vec3>) {
    let mesh = TriMesh::cuboid(Vec3::repeat(1.0)).translated(&Vec3::repeat(0.5));
    let vertices = mesh.vertices.clone();
    (Shape::mesh(mesh, &TreeSettings::octree()).unwrap(), vertices)
}

fn turned() -> Pose {
    Pose::from_parts(Vec3::new(3.0, -2.0, 5.0).into(), UnitQuaternion::from_euler_angles(0.3, -0.8, 1.9))
}

fn off(a: &Vec3, b: &Vec3) -> f64 {
    (a - b).norm()
}

/// Returns the largest distance of a vertex of a part from its place by the file's frame at
/// `frame`.
fn farthest(world: &World, id: ObjectId, part: usize, file: &[Vec3], frame: &Pose) -> f64 {
    let shape = world.object(id).unwrap().collidable().unwrap().shape(part).unwrap();
    let Shape::Mesh(mesh) = shape else { panic!("a mesh") };
    let part_state = world.part_state(id, part).unwrap().pose;
    let at = |pose: &Pose, v: &Vec3| (pose * Point3::from(*v)).coords;
    mesh.mesh().vertices.iter().zip(file).map(|(v, f)| off(&at(&part_state, v), &at(frame, f))).fold(0.0, f64::max)
}

#[test]
fn a_body_is_placed_by_the_frame_of_its_file() {
    let (shape, file) = corner_cube();
    let (half, pose) = (Vec3::repeat(0.5), turned());
    for fixed in [false, true] {
        let mut world = world("time_stepping", 1.0 / 240.0);
        let body = match fixed {
            true => RigidBody::fixed(shape.clone()).with_name("cube"),
            false => RigidBody::new(shape.clone()).with_name("cube").with_mass(2.0),
        };
        let body = body.with_pose(pose);
        assert!(off(&body.center_of_mass(), &half) < 1e-15);
        let id = world.add(body).unwrap();
        assert!(farthest(&world, id, 0, &file, &pose) < 1e-14);
        let read = world.pose(id, 0).unwrap();
        assert!(off(&read.translation.vector, &pose.translation.vector) < 1e-14 && read.rotation == pose.rotation);
        let center = pose.translation.vector + pose.rotation * half;
        assert!(off(&position(&world, id), &center) < 1e-14, "the site is at the center of mass");
        let other =
            Pose::from_parts(Vec3::new(-1.0, 0.5, 2.0).into(), UnitQuaternion::from_euler_angles(-2.0, 0.4, 0.1));
        world.set_pose(id, other).unwrap();
        assert!(farthest(&world, id, 0, &file, &other) < 1e-14);
    }
}

/// Spun about an axis through its center, the center stays in place and the corner at the file's
/// origin circles it; momentum is conserved.
#[test]
fn it_spins_about_its_center_of_mass() {
    let (shape, file) = corner_cube();
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 240.0));
        let spin = Vec3::new(0.7, -1.1, 2.3);
        let body = RigidBody::new(shape.clone())
            .with_name("cube")
            .with_mass(2.0)
            .with_pose(turned())
            .with_angular_velocity(spin);
        let id = world.add(body).unwrap();
        let (center, before) = (position(&world, id), world.momentum());
        (0..480).for_each(|_| {
            world.step().unwrap();
        });
        assert!(off(&position(&world, id), &center) < 1e-12, "{stepper}");
        assert!((world.momentum().angular - before.angular).norm() < 1e-12, "{stepper}");
        // a cube's inertia is a multiple of 1: it rotates evenly about the axis of its spin
        let turn = UnitQuaternion::from_scaled_axis(spin * world.time());
        let origin = center + turn * (turned().translation.vector - center);
        let frame = world.pose(id, 0).unwrap();
        assert!(off(&frame.translation.vector, &origin) < 1e-9, "{stepper}: {frame}");
        assert!(farthest(&world, id, 0, &file, &frame) < 1e-12);
    }
}

#[test]
fn a_kinematic_body_brings_its_frame_to_the_target() {
    let (shape, file) = corner_cube();
    let mut world = world("time_stepping", 1.0 / 240.0);
    let id = world.add_boxed(Box::new(RigidBody::fixed(shape).with_name("cube")), Mode::Kinematic).unwrap();
    let target =
        Pose::from_parts(Vec3::new(0.01, 0.02, -0.03).into(), UnitQuaternion::from_euler_angles(0.02, 0.0, 0.01));
    world.move_to(id, target).unwrap();
    world.step().unwrap();
    assert!(farthest(&world, id, 0, &file, &target) < 1e-12);
}

/// On a link, too, the pose of a collider is that of the file's frame.
#[test]
fn a_mesh_on_a_link_keeps_its_frame() {
    let (shape, file) = corner_cube();
    let mut builder = ModelBuilder::new();
    let mass = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: Mat3::identity() };
    builder.link("arm", None, Joint::revolute(Vec3::z()), Pose::identity(), mass);
    let mut body = ArticulatedBody::new("arm", builder.build().unwrap());
    body.add_collider("arm", Collider::new(shape, turned())).unwrap();
    let part = body.colliders_of(Some(0)).next().unwrap();
    let mut world = world("time_stepping", 1.0 / 240.0);
    let id = world.add(body).unwrap();
    assert!(farthest(&world, id, part, &file, &turned()) < 1e-14);
}

/// A camera on the body is placed in the file's frame.
#[test]
fn mounts_of_a_body_are_placed_in_its_frame() {
    let (shape, _) = corner_cube();
    let body = RigidBody::new(shape).with_name("cube").with_mass(1.0).with_pose(turned());
    let at = Pose::translation(1.0, 0.0, 0.0);
    let mount = CameraMount::new("", 0, at);
    let mut world = world("time_stepping", 1.0 / 240.0);
    let id = world.add(body.with_camera(mount)).unwrap();
    let mounted = &world.object(id).unwrap().camera().unwrap().cameras()[0];
    let eye = world.part_state(id, 0).unwrap().pose * mounted.pose;
    assert!(off(&eye.translation.vector, &(turned() * at).translation.vector) < 1e-14);
}
