//! Spawned bodies, colors, lights and cameras of scripted events: on facets, and in recordings.

use super::simulated_session::viewer;
use crate::support::Scratch;
use std::collections::BTreeMap;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{
    Action, CameraChange, LightChange, Looks, RigidBody, ScriptedEvent, Subject, Template, Trigger, World,
};
use tumble_net::record::{Recorder, RecorderOptions, read};
use tumble_net::sync::{Mirror, Publisher};
use tumble_net::world::{contacts, entities, events, poses, readings};

/// Balls are spawned, one at a time takes another color at its first contact, a light fades and the camera turns.
/// A ball each tenth of a second, too fast for the next one to meet it.
fn scripted() -> World {
    let mut world = World::default();
    let floor = world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(1.0);
    let store = Template::add(&mut world, "ball", &ball, 4, true).unwrap();
    let balls = world.get::<Template>(store).unwrap().bodies().to_vec();
    let drop = ScriptedEvent::new("drop", Trigger::Every { period: 0.1, first: 0.05 });
    world.add(drop.with_action(Action::spawn(store, Pose::translation(0.0, 0.0, 0.3), 3.0 * Vec3::x()))).unwrap();
    let hit = ScriptedEvent::new("hit", Trigger::Contact { a: vec![floor], b: balls, impulse: 0.0 });
    world.add(hit.with_action(Action::Recolor { body: Subject::Other, color: [1.0, 0.0, 0.0] })).unwrap();
    let light = LightChange { light: 0, intensity: Some(0.3), color: None };
    let dusk = ScriptedEvent::new("dusk", Trigger::Time { at: 0.5 }).with_action(Action::Light(light));
    world.add(dusk.with_action(Action::Camera(CameraChange::Named("scene".into())))).unwrap();
    world
}

/// The looks with the names of the bodies.
fn looks(world: &World) -> (BTreeMap<String, [f32; 3]>, Looks) {
    let looks = world.looks();
    let colors = looks.colors.iter().map(|(id, color)| (world.name(*id).unwrap().to_string(), *color)).collect();
    (colors, Looks { colors: BTreeMap::new(), ..looks })
}

/// The names of the bodies that are there.
fn present(world: &World) -> Vec<String> {
    let enabled = world.ids().iter().filter(|id| world.status(**id).unwrap().enabled);
    let mut names: Vec<String> = enabled.map(|id| world.name(*id).unwrap().to_string()).collect();
    names.sort();
    names
}

#[test]
fn a_facet_sees_what_events_spawn_recolor_and_light() {
    for exact in [false, true] {
        let mut world = scripted();
        let (mut publisher, mut mirror) = (Publisher::new(&world, exact, 0), Mirror::new(scripted()));
        let mut seen = (0, 0);
        for frame in 1..=240 {
            world.step().unwrap();
            let published = publisher.publish(&world, &viewer(frame), frame).unwrap();
            if published.fresh {
                mirror.apply_snapshot(&publisher.snapshot()).unwrap();
            }
            mirror.apply_state(frame, world.time(), &published.state).unwrap();
            assert_eq!(present(mirror.world()), present(&world), "frame {frame}");
            assert_eq!(looks(mirror.world()), looks(&world), "frame {frame}");
            seen = (present(&world).len(), world.looks().colors.len());
        }
        assert_eq!(seen.0, present(&scripted()).len() + 4, "all balls are there");
        assert!(seen.1 >= 2 && world.looks().lights.len() == 1 && world.looks().camera.is_some());
    }
}

#[test]
fn a_recording_replays_spawned_bodies_to_the_same_bits() {
    let scratch = Scratch::new("spawned");
    let path = scratch.file("a.mcap");
    let mut world = scripted();
    let mut recorder = Recorder::create(&path, "", &entities(&world), RecorderOptions::default()).unwrap();
    let mut kept = Vec::new();
    for _ in 0..120 {
        world.step().unwrap();
        recorder.report(&readings(&world), &events(&world)).unwrap();
        recorder.frame(world.time(), world.frame(), &poses(&world), &contacts(&world), &world.save()).unwrap();
        kept.push((world.save(), present(&world), looks(&world)));
    }
    recorder.finish().unwrap();
    let mut replay = scripted();
    let mut count = 0;
    for (frame, (saved, there, looked)) in read(&path).unwrap().zip(&kept) {
        let frame = frame.unwrap();
        replay.restore(&frame.state).unwrap();
        assert!(replay.save() == *saved && present(&replay) == *there && looks(&replay) == *looked);
        count += frame.events.iter().filter(|event| event.kind == "fired").count();
        // a world that goes on from any frame fires the same events again
        if frame.frame == 47 {
            let mut other = replay.fork();
            (47..120).for_each(|_| {
                other.step().unwrap();
            });
            assert!(other.save() == world.save(), "the replay goes on otherwise");
        }
    }
    assert!(count > 5, "{count} events fired");
}
