//! The parts of the interface that read a world and act on it in one line.

use tumble_core::prelude::*;

fn ball(name: &str, height: f64) -> RigidBody {
    let shape = Shape::sphere(0.1).unwrap();
    RigidBody::with_mass(name, shape, 2.0).unwrap().at(Pose::translation(0.0, 0.0, height))
}

#[test]
fn a_ball_at_rest_touches_the_ground_and_another_in_the_air_touches_nothing() {
    let mut world = World::default();
    let ground = world.add_static(RigidBody::fixed("ground", Shape::half_space())).unwrap();
    let (low, high) = (world.add(ball("low", 0.1)).unwrap(), world.add(ball("high", 50.0)).unwrap());
    for _ in 0..240 {
        world.step().unwrap();
    }
    let contacts: Vec<&ContactPoint> = world.contacts_of(low).collect();
    assert_eq!(contacts.len(), 1);
    assert!(contacts[0].is_touching());
    assert_eq!((contacts[0].other(low), contacts[0].other(ground)), (Some(ground), Some(low)));
    assert_eq!(contacts[0].other(high), None);
    assert!((contacts[0].force.norm() - 2.0 * 9.81).abs() < 1e-6, "{:?}", contacts[0].force);
    assert_eq!(world.body(ground).unwrap().contacts().count(), 1);
    assert_eq!(world.body(low).unwrap().contacts().count(), 1);
    assert_eq!(world.contacts_of(high).count(), 0);
}

#[test]
fn an_object_without_a_name_gets_the_next_free_one() {
    let mut world = World::default();
    let add = |world: &mut World, name: &str| {
        let id = world.add(ball(name, 1.0)).unwrap();
        world.name(id).unwrap().to_string()
    };
    assert_eq!(add(&mut world, ""), "body 0");
    assert_eq!(add(&mut world, "body 2"), "body 2");
    assert_eq!(add(&mut world, ""), "body 3", "2 is taken");
    world.remove(world.find("body 3").unwrap()).unwrap();
    let mut fork = world.fork();
    assert_eq!((add(&mut world, ""), add(&mut fork, "")), ("body 3".to_string(), "body 3".to_string()));
    let wind = world.add_force("", |_, _| ()).unwrap();
    assert_eq!(world.name(wind), Some("force 4"));
}

#[test]
fn names_of_any_length_are_unique_and_survive_an_archive_and_a_snapshot() {
    let mut world = World::default();
    let long = "long ".repeat(40);
    let (named, unnamed) = (world.add(ball(&long, 1.0)).unwrap(), world.add(ball("", 3.0)).unwrap());
    assert_eq!(world.body(unnamed).unwrap().name(), "body 1");
    assert_eq!(world.add(ball(&long, 2.0)), Err(WorldError::DuplicateName(long.clone())));
    assert_eq!((world.find(&long), world.find("body 1")), (Some(named), Some(unnamed)));
    world.step().unwrap();
    let saved = world.save();
    let mut copy = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    let names: Vec<&str> = copy.ids().iter().map(|&id| copy.name(id).unwrap()).collect();
    assert_eq!(names, [&long, "body 1"]);
    assert_eq!(copy.save(), saved);
    world.step().unwrap();
    copy.step().unwrap();
    copy.restore(&world.save()).unwrap();
    assert_eq!(copy.save(), world.save());
}

#[test]
fn a_contact_within_the_margin_touches_only_with_an_impulse() {
    let mut world = World::default();
    let (a, b) = (world.add(ball("a", 1.0)).unwrap(), world.add(ball("b", 2.0)).unwrap());
    let zero = Vec3::zeros();
    let (point, normal, velocity) = (zero, Vec3::z(), zero);
    let apart =
        ContactPoint { a, part_a: 0, b, part_b: 0, point, normal, depth: -1e-6, velocity, impulse: zero, force: zero };
    assert!(!apart.is_touching());
    assert!(ContactPoint { impulse: Vec3::z(), ..apart }.is_touching());
    assert!(ContactPoint { depth: 0.0, ..apart }.is_touching());
}

#[test]
fn a_body_is_read_through_its_view() {
    let mut world = World::default();
    // a mesh away from its origin, placed by its file's frame
    let mesh = TriMesh::cuboid(Vec3::repeat(0.2)).translated(&Vec3::new(1.0, 0.0, 0.0));
    let shape = Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
    let velocity = Vec3::new(1.0, 2.0, 3.0);
    let body = RigidBody::with_mass("crate", shape, 1.0).unwrap();
    let id = world.add(body.at(Pose::translation(4.0, 5.0, 6.0)).moving(velocity, Vec3::z())).unwrap();
    let view = world.body(id).unwrap();
    assert_eq!((view.id(), view.name(), view.mode(), view.is_asleep()), (id, "crate", Mode::Dynamic, false));
    assert!((view.position() - Vec3::new(4.0, 5.0, 6.0)).norm() < 1e-12);
    assert!((view.velocity() - velocity).norm() < 1e-12);
    assert!((view.angular_velocity() - Vec3::z()).norm() < 1e-12);
    // the origin of the file turns about the center of mass, 1 m away
    assert!((view.velocity_at(&view.position()) - (velocity - Vec3::y())).norm() < 1e-12);
    assert!(matches!(view.part(1), Err(WorldError::NoPart { part: 1, .. })));
    world.step().unwrap();
    assert!((world.body(id).unwrap().acceleration() - Vec3::new(0.0, 0.0, -9.81)).norm() < 1e-9);
    world.remove(id).unwrap();
    assert!(matches!(world.body(id), Err(WorldError::Stale)));
}

/// Linear drag `F = −c·v` on a free body: `v(t) = v₀·e^(−c·t/m)`. A force that depends on velocity is of first order in the step `h`, so the
/// relative error is at most `(c/m)²·t·h/2 = 0.47 %`.
#[test]
fn a_force_from_a_function_acts_as_its_formula_says() {
    let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
    let id = world.add(ball("ball", 0.0).moving(Vec3::x(), Vec3::zeros())).unwrap();
    let drag = world.add_force("drag", move |view, out| out.act_on(view, id, |state| -3.0 * state.velocity)).unwrap();
    let mut fork = world.fork();
    for _ in 0..240 {
        world.step().unwrap();
        fork.step().unwrap();
    }
    let expected = (-3.0_f64 / 2.0).exp();
    let speed = world.body(id).unwrap().velocity().x;
    assert!((speed - expected).abs() < 4.7e-3 * expected, "{speed} m/s, {expected} expected");
    assert_eq!(world.state(), fork.state());
    assert!(matches!(world.body(drag), Err(WorldError::NoPart { .. })));
    // without what it acts on it does nothing
    world.remove(id).unwrap();
    world.step().unwrap();
    assert!(world.add_force("drag", |_, _| {}).is_err());
}
