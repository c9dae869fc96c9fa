//! Sensors among the shapes of links.

use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::prelude::*;
use tumble_core::{
    Action, ArticulationBuilder, Collider, CollisionGroup, EventKind, Joint, LinkBuilder, ObjectId, ScriptedEvent,
    Trigger,
};

/// A carriage that slides along x at 2 m/s, with a feeler of 0.1 m that reaches 0.5 m ahead.
fn carriage() -> ArticulationBuilder {
    let feeler = Collider::new(Shape::sphere(0.1).unwrap(), Pose::translation(0.5, 0.0, 0.0)).with_sensor(true);
    let carriage = LinkBuilder::new("carriage", Joint::Prismatic { axis: Vec3::x() }).with_velocity(2.0);
    let carriage = carriage.with_shape(Shape::sphere(0.1).unwrap(), Pose::identity()).with_collider(feeler);
    ArticulationBuilder::new("feeler").link(carriage)
}

fn at(x: f64) -> RigidBody {
    let post = RigidBody::fixed(Shape::sphere(0.1).unwrap()).with_pose(Pose::translation(x, 0.15, 0.0));
    post.with_groups(CollisionGroup::new(1).unwrap(), u64::MAX)
}

/// Returns kinds and times of the events of sensors.
fn sensed(world: &mut World, seconds: f64) -> Vec<(EventKind, ObjectId, usize, f64)> {
    let mut found = Vec::new();
    while world.time() < seconds {
        world.step().unwrap();
        let events = world.events().iter().filter(|e| [EventKind::SensorBegin, EventKind::SensorEnd].contains(&e.kind));
        found.extend(events.map(|e| (e.kind, e.b.unwrap(), e.part_a, world.time())).collect::<Vec<_>>());
    }
    found
}

/// Two balls of 0.1 m whose centers pass at 0.15 m overlap while they are nearer than √(0.2² − 0.15²) along x. The feeler
/// does not brake the carriage.
#[test]
fn a_sensor_on_a_link_reports_what_it_passes_and_touches_nothing() {
    let dt = 1.0 / 240.0;
    let mut world = World::new(Settings::default().with_dt(dt)).unwrap();
    let id = world.add(carriage().build().unwrap()).unwrap();
    let post = world.add_static(at(1.0)).unwrap();
    let stop = ScriptedEvent::new("stop", Trigger::Enters { sensor: id, bodies: vec![post] });
    world
        .add(stop.with_action(Action::Recolor { body: tumble_core::Subject::Part(post, 0), color: [1.0; 3] }))
        .unwrap();
    let found = sensed(&mut world, 0.35);
    let half = (0.2_f64 * 0.2 - 0.15 * 0.15).sqrt();
    let times = [(1.0 - 0.5 - half) / 2.0, (1.0 - 0.5 + half) / 2.0];
    assert_eq!(found.len(), 2, "{found:?}");
    for ((kind, other, part, time), (expected, entry)) in
        found.into_iter().zip([EventKind::SensorBegin, EventKind::SensorEnd].into_iter().zip(times))
    {
        // parts: the link, the base, the ball, the feeler
        assert_eq!((kind, other, part), (expected, post, 3));
        assert!(time >= entry - 1e-9 && time < entry + dt + 1e-9, "{time} {entry}");
    }
    assert_eq!(world.state_of(id).unwrap()[1], 2.0);
    assert_eq!(ScriptedEvent::fired(&world, world.find("stop").unwrap()), Some(1));
}

#[test]
fn a_sensor_on_a_link_obeys_its_groups_and_is_archived() {
    for (mask, expected) in [(0b10, 2), (0b01, 0)] {
        let mut world = World::default();
        let mut body = carriage().build().unwrap();
        body.set_groups(CollisionGroup::default(), mask);
        world.add(body).unwrap();
        world.add_static(at(1.0)).unwrap();
        let mut read = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| unreachable!()).unwrap();
        assert_eq!(sensed(&mut world, 0.35).len(), expected);
        assert_eq!(sensed(&mut read, 0.35).len(), expected);
    }
}
