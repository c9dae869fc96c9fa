//! Accessors and commands of the API that take one line.

use tumble_core::prelude::*;

fn ball(name: &str, height: f64) -> RigidBody {
    let shape = Shape::sphere(0.1).unwrap();
    RigidBody::new(shape).with_name(name).with_mass(2.0).with_pose(Pose::translation(0.0, 0.0, height))
}

#[test]
fn a_ball_at_rest_touches_the_ground_and_another_in_the_air_touches_nothing() {
    let mut world = World::default();
    let ground = world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
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

/// A stack of two balls and one beside it: the ground carries both of the stack, and forces come in pairs.
#[test]
fn the_contact_force_of_two_bodies_carries_the_weight_between_them() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = World::default();
        world.set_stepper(tumble_core::stepper_by_name(stepper).unwrap());
        let ground = world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
        let (low, high) = (world.add(ball("low", 0.1)).unwrap(), world.add(ball("high", 0.3)).unwrap());
        let beside = ball("beside", 0.1).with_pose(Pose::translation(1.0, 0.0, 0.1));
        let beside = world.add(beside).unwrap();
        for _ in 0..3 {
            world.step().unwrap();
        }
        let weight = 2.0 * 9.81;
        for (a, b, wanted) in [
            (ground, low, 2.0 * weight),
            (low, ground, -2.0 * weight),
            (low, high, weight),
            (ground, beside, weight),
            (ground, high, 0.0),
            (low, low, 0.0),
        ] {
            let force = world.contact_force(a, b).unwrap();
            assert!((force - Vec3::new(0.0, 0.0, wanted)).norm() < 1e-6, "{stepper}: {force:?} instead of {wanted}");
        }
        let part = world.contact_force_of((ground, Some(&[0])), (low, Some(&[0]))).unwrap();
        assert_eq!(part, world.contact_force(ground, low).unwrap());
        assert_eq!(world.contact_force_of((ground, Some(&[7])), (low, None)).unwrap(), Vec3::zeros());
        world.remove(high).unwrap();
        assert!(matches!(world.contact_force(ground, high), Err(WorldError::Stale)));
    }
}

/// A ball of water with a radius of 0.1 m: `m = 1000·4/3·π·r³`, `I = 2/5·m·r²`.
#[test]
fn a_body_without_a_mass_has_the_density_of_water() {
    let body = RigidBody::new(Shape::sphere(0.1).unwrap());
    let mass = 4.0 * std::f64::consts::PI / 3.0;
    assert!((body.mass() - mass).abs() < 1e-12 && (body.inertia().m11 - 0.4 * mass * 0.01).abs() < 1e-13);
    let body = RigidBody::fixed(Shape::sphere(0.1).unwrap());
    assert!(body.is_fixed() && !body.clone().with_density(500.0).is_fixed());
    assert!((body.with_density(500.0).mass() - 0.5 * mass).abs() < 1e-12);
}

#[test]
fn a_body_with_a_wrong_constant_is_refused_by_its_name_in_the_world() {
    let mut world = World::default();
    let ball = || RigidBody::new(Shape::sphere(0.1).unwrap());
    let material = Material { friction: -1.0, ..Material::default() };
    for (body, why) in [
        (ball().with_mass(-2.0), "body 'body 0': mass is -2 kg; it must be finite and above 0"),
        (ball().with_name("b").with_density(0.0), "body 'b': density is 0, but must be finite and above 0"),
        (
            ball().with_name("b").with_mass_and_inertia(1.0, Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 3.0))),
            "body 'b': inertia",
        ),
        (ball().with_name("b").with_material(material), "body 'b': friction is -1; it must be at least 0"),
        (RigidBody::new(Shape::half_space()), "body 'body 0': "),
    ] {
        let error = world.add(body).unwrap_err().to_string();
        assert!(error.starts_with(why), "{error}");
    }
    assert!(world.ids().is_empty());
    // a later value replaces a wrong one
    world.add(ball().with_mass(-1.0).with_mass(1.0)).unwrap();
    world.add(RigidBody::new(Shape::half_space()).with_mass_and_inertia(1.0, Mat3::identity())).unwrap();
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
    let apart = ContactPoint {
        a,
        part_a: 0,
        shape_a: 0,
        b,
        part_b: 0,
        shape_b: 0,
        point,
        normal,
        depth: -1e-6,
        velocity,
        impulse: zero,
        force: zero,
    };
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
    let body = RigidBody::new(shape).with_name("crate").with_mass(1.0);
    let id = world
        .add(body.with_pose(Pose::translation(4.0, 5.0, 6.0)).with_velocity(velocity).with_angular_velocity(Vec3::z()))
        .unwrap();
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

/// Linear drag `F = −c·v` on a free body: `v(t) = v₀·e^(−c·t/m)`. A force that depends on velocity
/// is of first order in the step `h`, so the relative error is at most `(c/m)²·t·h/2 = 0.47 %`.
#[test]
fn a_force_from_a_function_acts_as_its_formula_says() {
    let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
    let id = world.add(ball("ball", 0.0).with_velocity(Vec3::x())).unwrap();
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
    // without the body that it acts on, it does nothing
    world.remove(id).unwrap();
    world.step().unwrap();
    assert!(world.add_force("drag", |_, _| {}).is_err());
}

/// Two balls that touch over static ground, one in the air, and two that a joint connects: three
/// islands.
#[test]
fn islands_are_what_contacts_and_joints_connect() {
    let mut world = World::default();
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let at = |name: &str, x: f64, z: f64| ball(name, z).with_pose(Pose::translation(x, 0.0, z));
    let ids: Vec<ObjectId> = [("a", 0.0, 0.1), ("b", 5.0, 3.0), ("c", 0.199, 0.1), ("d", 9.0, 3.0), ("e", 9.5, 3.0)]
        .into_iter()
        .map(|(name, x, z)| world.add(at(name, x, z)).unwrap())
        .collect();
    let [a, b, c, d, e] = ids[..] else { unreachable!() };
    let (one, other) = (Some((d, 0)), Some((e, 0)));
    let joint = LoopJoint::spherical_at("pin", &world, one, other, Vec3::new(9.25, 0.0, 3.0)).unwrap();
    world.add(joint).unwrap();
    world.step().unwrap();
    assert_eq!(world.islands(), [vec![a, c], vec![b], vec![d, e]]);
    world.remove(c).unwrap();
    world.set_mode(d, Mode::Static).unwrap();
    assert_eq!(world.islands(), [vec![a], vec![b], vec![e]]);
}

/// Objects that sleep have no contacts and stay the island that they fell asleep as.
#[test]
fn a_sleeping_stack_is_one_island() {
    let mut world = World::new(Settings::default().with_sleep(Some(tumble_core::Sleep::default()))).unwrap();
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let cube =
        |z: f64| RigidBody::new(Shape::cuboid(Vec3::repeat(0.2)).unwrap()).with_pose(Pose::translation(0.0, 0.0, z));
    let stack = [world.add(cube(0.1)).unwrap(), world.add(cube(0.3)).unwrap()];
    let far = world.add(cube(0.1).with_pose(Pose::translation(3.0, 0.0, 0.1))).unwrap();
    for _ in 0..480 {
        world.step().unwrap();
    }
    assert!(world.asleep(stack[0]) && world.asleep(far));
    assert_eq!(world.islands(), [stack.to_vec(), vec![far]]);
}

#[test]
fn a_replica_shows_what_it_is_given() {
    let mut world = World::default();
    let id = world.add(ball("ball", 1.0)).unwrap();
    let gone = world.add(ball("gone", 3.0)).unwrap();
    world.remove(gone).unwrap();
    let (zero, up) = (Vec3::zeros(), Vec3::z());
    let contact = |b| ContactPoint {
        a: id,
        part_a: 0,
        shape_a: 0,
        b,
        part_b: 0,
        shape_b: 0,
        point: up,
        normal: up,
        depth: 0.1,
        velocity: zero,
        impulse: zero,
        force: up,
    };
    let mut replica = world.replica();
    replica.set_poses(id, &[Pose::translation(7.0, 0.0, 0.0)]).unwrap();
    replica.set_time(2.5);
    replica.set_time(f64::NAN);
    replica.set_contacts([contact(id), contact(gone)]);
    assert!(matches!(replica.set_poses(id, &[]), Err(WorldError::NoPart { part: 0, .. })));
    assert_eq!((world.body(id).unwrap().position().x, world.time()), (7.0, 2.5));
    assert_eq!(world.contacts(), [contact(id)]);
}
