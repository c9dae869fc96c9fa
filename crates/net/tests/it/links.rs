//! Links of articulated bodies in recordings: names, poses, contacts and events.

use crate::support::Scratch;
use tumble_core::collide::{CompoundPart, Mat3, Pose, Shape, Vec3};
use tumble_core::{
    ArticulatedBody, ArticulationBuilder, Collider, Joint, LinkBuilder, LinkMass, RigidBody, Settings, World,
};
use tumble_net::record::{Recorder, RecorderOptions, read};
use tumble_net::world::{contacts, entities, events, names, poses, show_contacts};

/// A leg on a slider, whose foot is fixed to the calf 1 m aside. The sole is the second shape of the foot, and the
/// lowest one.
fn leg(name: &str, links: [&str; 3]) -> ArticulatedBody {
    let mass = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: Mat3::identity() };
    let ball = |z: f64| (Shape::sphere(0.1).unwrap(), Pose::translation(0.0, 0.0, z));
    let part = |z: f64, name: &str| CompoundPart::new(ball(z).0, ball(z).1).with_name(name);
    let [stand, calf, foot] = links;
    let pads = Shape::compound(vec![part(-0.1, "sole"), part(0.4, "ankle")]).unwrap();
    let (ball, at) = ball(0.5);
    let lower = LinkBuilder::new(foot, Joint::Fixed).with_parent(calf).with_pose(Pose::translation(1.0, 0.0, 0.0));
    ArticulationBuilder::new(name)
        .link(LinkBuilder::new(stand, Joint::Fixed).with_pose(Pose::translation(0.0, 0.0, 0.5)))
        .link(LinkBuilder::new(calf, Joint::prismatic(Vec3::z())).with_parent(stand).with_mass_properties(mass))
        .link(lower.with_shape(ball, at).with_collider(Collider::new(pads, Pose::identity())))
        .build()
        .unwrap()
}

fn world() -> World {
    let mut world = World::new(Settings::default()).unwrap();
    world.add(RigidBody::fixed(Shape::half_space()).with_name("ground").with_shape_name("soil")).unwrap();
    world.add(leg("leg", ["stand", "calf", "foot"])).unwrap();
    world
}

#[test]
fn recorded_links_contacts_and_events_have_the_names_of_the_user() {
    let mut world = world();
    assert_eq!(names(&world), ["ground", "leg/stand", "leg/calf", "leg/foot"]);
    // what is drawn of the foot is in the frame of the foot
    let drawn: Vec<(String, usize)> = entities(&world).iter().map(|e| (e.name.clone(), e.parts.len())).collect();
    assert_eq!(drawn[2..], [("leg/calf".into(), 0), ("leg/foot".into(), 2)]);
    let scratch = Scratch::new("links");
    let path = scratch.file("a.mcap");
    let mut recorder = Recorder::create(&path, "", &entities(&world), RecorderOptions::default()).unwrap();
    for _ in 0..120 {
        world.step().unwrap();
        recorder.report(&Default::default(), &events(&world)).unwrap();
        recorder.frame(world.time(), world.frame(), &poses(&world), &contacts(&world), &world.save()).unwrap();
    }
    recorder.finish().unwrap();
    let mut reader = read(&path).unwrap();
    let mut kinds = Vec::new();
    let mut last = None;
    while let Some(frame) = reader.next_frame().unwrap() {
        for event in &frame.events {
            kinds.push(event.kind.clone());
            assert_eq!((event.a.as_str(), event.b.as_deref()), ("ground", Some("leg/foot")));
            assert_eq!(event.bodies, [Some("ground".to_owned()), Some("leg".to_owned())]);
            assert_eq!(event.links, [None, Some("foot".to_owned())]);
            assert_eq!((event.shapes, &event.shape_names), ([0, 1], &[Some("soil".into()), Some("sole".into())]));
        }
        last = Some(frame);
    }
    assert_eq!(kinds[..2], ["contact_begin", "contact_persist"]);
    let last = last.unwrap();
    // at rest on the sole: the foot is 0.2 m above the ground, and 1 m beside the calf
    for (pose, at) in last.poses[1..].iter().zip([[0.0, 0.0, 0.5], [0.0, 0.0, 0.2], [1.0, 0.0, 0.2]]) {
        let off = Vec3::from(pose.position) - Vec3::from(at);
        assert!(off.norm() < 1e-6, "{:?} is not {at:?}", pose.position);
    }
    assert_eq!(last.contacts.len(), 1);
    let found = &last.contacts[0];
    let sides = [(found.a, found.shapes[0]), (found.b, found.shapes[1])];
    assert!(sides.contains(&(0, 0)) && sides.contains(&(3, 1)), "{sides:?}");
    let before = world.contacts()[0];
    world.restore(&last.state).unwrap();
    show_contacts(&mut world, &last.contacts);
    let shown = world.contacts()[0];
    assert_eq!(
        (shown.a, shown.part_a, shown.shape_a, shown.b, shown.part_b, shown.shape_b),
        (before.a, before.part_a, before.shape_a, before.b, before.part_b, before.shape_b)
    );
}

/// The full name of a link may be that of a body, or of a link of a body whose name has a slash.
#[test]
fn links_with_a_name_that_is_taken_have_numbers() {
    let mut world = world();
    world.add(leg("leg/calf", ["top", "a", "b"])).unwrap();
    assert_eq!(names(&world)[1..4], ["leg/0", "leg/1", "leg/2"], "a body is named as the calf");
    assert_eq!(names(&world)[4..], ["leg/calf/top", "leg/calf/a", "leg/calf/b"]);
    let mut world = World::default();
    world.add(leg("x", ["s", "t", "y/t"])).unwrap();
    world.add(leg("x/y", ["s", "t", "u"])).unwrap();
    assert_eq!(names(&world), ["x/0", "x/1", "x/2", "x/y/0", "x/y/1", "x/y/2"], "\"x/y/t\" is two links");
    let mut world = World::default();
    world.add(leg("x", ["", "1", "2"])).unwrap();
    assert_eq!(names(&world), ["x/0", "x/1", "x/2"], "one has no name");
    // bodies have the names and the numbers
    let mut world = World::default();
    world.add(leg("x", ["s", "t", "u"])).unwrap();
    for name in ["x/u", "x/1"] {
        world.add(RigidBody::new(Shape::sphere(0.1).unwrap()).with_name(name)).unwrap();
    }
    assert_eq!(names(&world), ["x/#0", "x/#1", "x/#2", "x/u", "x/1"]);
}
