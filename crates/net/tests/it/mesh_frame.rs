//! Recordings of worlds: a mesh is placed by the frame of its file, and names may have any length.

use crate::support::Scratch;
use nalgebra::{Point3, Quaternion, UnitQuaternion};
use tumble_core::collide::{CompoundPart, Pose, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::{RigidBody, Settings, World};
use tumble_net::record::{self, Recorder, RecorderOptions, read};
use tumble_net::world::{contacts, entities, poses, show_contacts};

fn isometry(pose: &record::Pose) -> Pose {
    let [x, y, z, w] = pose.rotation;
    Pose::from_parts(Vec3::from(pose.position).into(), UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)))
}

#[test]
fn a_recorded_mesh_stands_where_its_file_says() {
    let mesh = TriMesh::cuboid(Vec3::repeat(1.0)).translated(&Vec3::repeat(0.5));
    let file = mesh.vertices.clone();
    let shape = Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
    let frame = Pose::from_parts(Vec3::new(3.0, -2.0, 5.0).into(), UnitQuaternion::from_euler_angles(0.3, -0.8, 1.9));
    let mut world = World::new(Settings::default()).unwrap();
    world.add(RigidBody::new(shape).with_name("cube").with_mass(1.0).with_pose(frame)).unwrap();
    let scratch = Scratch::new("mesh_frame");
    let path = scratch.file("a.mcap");
    let mut recorder = Recorder::create(&path, "", &entities(&world), RecorderOptions::default()).unwrap();
    recorder.frame(world.time(), world.frame(), &poses(&world), &contacts(&world), &world.save()).unwrap();
    recorder.finish().unwrap();
    let mut reader = read(&path).unwrap();
    let entity = reader.entities()[0].clone();
    let first = reader.next_frame().unwrap().unwrap();
    let at = isometry(&first.poses[0]);
    assert!((at.translation.vector - frame.translation.vector).norm() < 1e-14, "{at}");
    let record::Shape::Mesh { vertices, .. } = &entity.parts[0].shape else { panic!("a mesh") };
    let placed = at * isometry(&entity.parts[0].pose);
    for (recorded, file) in vertices.iter().zip(&file) {
        let off = placed * Point3::from(*recorded) - frame * Point3::from(*file);
        assert!(off.norm() < 1e-6, "vertices are recorded in single precision: {off}");
    }
}

#[test]
fn a_recorded_compound_stands_where_its_parts_are() {
    let block = Shape::cuboid(Vec3::repeat(0.2)).unwrap();
    let part = |x: f64| CompoundPart::new(block.clone(), Pose::translation(x, 0.0, 0.0));
    let shape = Shape::compound(vec![part(0.0), part(1.0)]).unwrap();
    let mut world = World::new(Settings::default()).unwrap();
    world.add(RigidBody::new(shape).with_pose(Pose::translation(0.0, 0.0, 2.0))).unwrap();
    let (entity, at) = (&entities(&world)[0], isometry(&poses(&world)[0]));
    let record::Shape::Mesh { vertices, .. } = &entity.parts[0].shape else { panic!("a mesh") };
    let placed = at * isometry(&entity.parts[0].pose);
    let bounds = vertices.iter().map(|v| (placed * Point3::from(*v)).coords);
    let (low, high) = bounds.fold((Vec3::repeat(9.0), Vec3::repeat(-9.0)), |(l, h), v| (l.inf(&v), h.sup(&v)));
    assert!((low - Vec3::new(-0.1, -0.1, 1.9)).norm() < 1e-9 && (high - Vec3::new(1.1, 0.1, 2.1)).norm() < 1e-9);
}

/// A name of 200 bytes is recorded as it is. Longer ones than a recording can hold keep their
/// beginning and stay different.
#[test]
fn a_world_with_long_names_is_recorded() {
    let long = "x".repeat(200);
    let longer = ["é".repeat(200) + "1", "é".repeat(200) + "2"];
    let mut world = World::default();
    for name in [&long, &longer[0], &longer[1]] {
        world.add(RigidBody::new(Shape::sphere(0.1).unwrap()).with_name(name).with_mass(1.0)).unwrap();
    }
    let scratch = Scratch::new("long_names");
    let path = scratch.file("a.mcap");
    let mut recorder = Recorder::create(&path, "", &entities(&world), RecorderOptions::default()).unwrap();
    recorder.frame(world.time(), world.frame(), &poses(&world), &contacts(&world), &world.save()).unwrap();
    recorder.finish().unwrap();
    let mut reader = read(&path).unwrap();
    let names: Vec<String> = reader.entities().iter().map(|e| e.name.clone()).collect();
    assert_eq!(names[0], long);
    assert_ne!(names[1], names[2]);
    for (name, whole) in names[1..].iter().zip(&longer) {
        let (beginning, hash) = name.split_once('~').unwrap();
        assert!(whole.starts_with(beginning) && name.len() > record::MAX_NAME_BYTES - 2 && hash.len() == 16, "{name}");
    }
    let state = reader.next_frame().unwrap().unwrap().state;
    world.step().unwrap();
    world.restore(&state).unwrap();
    assert_eq!(world.save(), state);
}

/// Contacts of a ball at rest are recorded exactly, and can be shown in a world whose snapshot was
/// restored.
#[test]
fn contacts_are_recorded_and_shown_again() {
    let mut world = World::default();
    world.add(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
    // the ball is the second shape of its compound, the first one hangs above it and weighs next to nothing
    let above = CompoundPart::new(Shape::sphere(1e-4).unwrap(), Pose::translation(0.0, 0.0, 0.2));
    let ball = CompoundPart::new(Shape::sphere(0.1).unwrap(), Pose::identity());
    let ball = Shape::compound(vec![above, ball]).unwrap();
    world.add(RigidBody::new(ball).with_pose(Pose::translation(0.0, 0.0, 0.1))).unwrap();
    let scratch = Scratch::new("contacts");
    let path = scratch.file("a.mcap");
    let mut recorder = Recorder::create(&path, "", &entities(&world), RecorderOptions::default()).unwrap();
    for _ in 0..60 {
        world.step().unwrap();
        recorder.frame(world.time(), world.frame(), &poses(&world), &contacts(&world), &world.save()).unwrap();
    }
    let wrong = record::Contact { a: 2, ..contacts(&world)[0] };
    let error = recorder.frame(world.time(), 99, &poses(&world), &[wrong], &[]).unwrap_err().to_string();
    assert!(error.contains("a contact of entities 2 and"), "{error}");
    let wrong = record::Contact { depth: f64::NAN, ..contacts(&world)[0] };
    assert!(recorder.frame(world.time(), 99, &poses(&world), &[wrong], &[]).is_err());
    let many = vec![contacts(&world)[0]; record::MAX_CONTACTS + 1];
    assert!(recorder.frame(world.time(), 99, &poses(&world), &many, &[]).is_err());
    recorder.finish().unwrap();
    let last = read(&path).unwrap().last().unwrap().unwrap();
    assert_eq!(last.contacts, contacts(&world));
    assert_eq!(last.contacts[0].shapes, if last.contacts[0].a == 1 { [1, 0] } else { [0, 1] });
    assert!((last.contacts[0].force[2].abs() - weight()).abs() < 1e-6);
    let shown = world.contacts().to_vec();
    world.restore(&last.state).unwrap();
    assert!(world.contacts().is_empty());
    show_contacts(&mut world, &last.contacts);
    for (shown, before) in world.contacts().iter().zip(&shown) {
        assert_eq!((shown.a, shown.b, shown.point, shown.normal), (before.a, before.b, before.point, before.normal));
        assert_eq!([shown.shape_a, shown.shape_b], [before.shape_a, before.shape_b]);
        assert_eq!((shown.depth, shown.force), (before.depth, before.force));
    }
    assert_eq!(world.contacts().len(), shown.len());
}

/// Weight of a ball of water with a radius of 0.1 m, N.
fn weight() -> f64 {
    9.81 * 4.0 * std::f64::consts::PI / 3.0
}
