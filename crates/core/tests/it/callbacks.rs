//! Functions of a program in a world: callbacks of events, and intersection tests of links as filters.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use tumble_core::collide::Contact;
use tumble_core::prelude::*;
use tumble_core::{
    Action, ArchiveError, ArticulationBuilder, EventKind, Firing, Intersect, IntersectPart, Joint, LinkBuilder,
    Material, ObjectId, ScriptedEvent, Sleep, StepError, Subject, Trigger,
};

/// A ball above the ground, and an event for their contact.
fn bouncing() -> (World, ObjectId, ScriptedEvent) {
    let mut world = World::default();
    let ground = world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("ball").with_mass(2.0);
    let ball = ball.with_material(Material { restitution: 0.5, ..Material::default() });
    let ball = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.5))).unwrap();
    (world, ball, ScriptedEvent::new("hit", Trigger::Contact { a: vec![ground], b: vec![ball], impulse: 0.0 }))
}

#[test]
fn a_callback_gets_the_firing_with_its_cause_once_and_after_the_actions() {
    let (mut world, ball, hit) = bouncing();
    let seen = Arc::new(Mutex::new(Vec::new()));
    let note = seen.clone();
    // the action of the event is done before the callback sees the world
    let hit = hit.with_action(Action::SetVelocity {
        body: Subject::Other,
        velocity: Vec3::new(0.0, 0.0, 1.0),
        angular_velocity: Vec3::zeros(),
    });
    let call = move |world: &World, firing: &Firing| {
        note.lock().unwrap().push((*firing, world.body(ball).unwrap().velocity().z, world.frame()));
        Ok(Vec::new())
    };
    let event = world.add(hit.with_times(1).with_call(call)).unwrap();
    let (mut begun, mut frame) = (None, 0);
    while world.time() < 0.4 {
        world.step().unwrap();
        if let Some(e) = world.events().iter().find(|e| e.kind == EventKind::ContactBegin && begun.is_none()) {
            (begun, frame) = (Some(*e), world.frame());
        }
    }
    let (begun, seen) = (begun.unwrap(), seen.lock().unwrap());
    let [(firing, velocity, at)] = seen[..] else { panic!("called {} times", seen.len()) };
    assert_eq!((firing.event, firing.other, at, velocity), (event, Some(ball), frame, 1.0));
    // the event has the impulse on the ground, the firing that on the ball: m·(1 + e)·√(2·g·h)
    assert_eq!((firing.impulse, firing.point), (-begun.impulse, begun.point));
    let fall = 2.0 * 1.5 * (2.0_f64 * 9.81 * 0.4).sqrt();
    assert!((firing.impulse.z - fall).abs() < 0.03 * fall, "{}", firing.impulse.z);
}

#[test]
fn actions_of_a_callback_are_done_at_once_and_forks_share_the_function() {
    let (mut world, ball, hit) = bouncing();
    let calls = Arc::new(AtomicU32::new(0));
    let count = calls.clone();
    let up = Action::SetVelocity { body: Subject::Other, velocity: Vec3::z(), angular_velocity: Vec3::zeros() };
    world
        .add(hit.with_call(move |_, _| {
            count.fetch_add(1, Ordering::Relaxed);
            Ok(vec![up.clone()])
        }))
        .unwrap();
    let (start, mut fork) = (world.save(), world.fork());
    while calls.load(Ordering::Relaxed) == 0 {
        world.step().unwrap();
    }
    assert_eq!(world.body(ball).unwrap().velocity(), Vec3::z());
    let steps = world.frame();
    (0..steps).for_each(|_| _ = fork.step().unwrap());
    assert!(fork.save() == world.save() && calls.load(Ordering::Relaxed) == 2);
    // a snapshot has no functions, and fits the world that has them
    let there = world.save();
    world.restore(&start).unwrap();
    (0..steps).for_each(|_| _ = world.step().unwrap());
    assert!(world.save() == there && calls.load(Ordering::Relaxed) == 3);
}

#[test]
fn an_error_of_a_callback_undoes_the_step() {
    let (mut world, _, hit) = bouncing();
    world.add(hit.with_call(|_, _| Err("no more".into()))).unwrap();
    let error = loop {
        let before = world.save();
        if let Err(error) = world.step() {
            assert!(world.save() == before && world.events().is_empty());
            break error;
        }
    };
    assert!(matches!(&error, StepError::Callback { event, why } if event == "hit" && why == "no more"));
    assert_eq!(error.to_string(), "the callback of event 'hit': no more");
    // an action that cannot be done now is an error, too
    let (mut world, ball, hit) = bouncing();
    world.add(hit.with_call(move |_, _| Ok(vec![Action::recolor(ball, [1.0, 0.0, 0.0])]))).unwrap();
    let error = (0..240).find_map(|_| world.step().err()).unwrap();
    assert!(matches!(&error, StepError::Event { event, .. } if event == "hit"), "{error}");
}

/// Leaves all pairs with the named shapes out, and counts.
struct Filter {
    passes: &'static str,
    asked: AtomicU32,
}

impl Intersect for Filter {
    fn contacts(&self, own: &IntersectPart, other: &IntersectPart, _: f64, _: &mut Vec<Contact>) -> bool {
        assert_eq!((own.name(), own.link()), ("shelf", Some("lower")));
        self.asked.fetch_add(1, Ordering::Relaxed);
        own.shape_name() == Some(self.passes) || other.name() == self.passes
    }
}

/// A shelf of two fixed links above each other, the lower one with two boards beside each other.
fn shelf() -> tumble_core::ArticulatedBody {
    let board = || Shape::cuboid(Vec3::new(1.0, 1.0, 0.1)).unwrap();
    let link = |name: &str, z: f64| LinkBuilder::new(name, Joint::Fixed).with_pose(Pose::translation(0.0, 0.0, z));
    let at = |x: f64| Pose::translation(x, 0.0, 0.0);
    let lower = link("lower", 0.5).with_shape(board(), at(-0.5)).with_shape_name("left");
    let lower = lower.with_shape(board(), at(0.5)).with_shape_name("right");
    let upper = link("upper", 2.0).with_shape(board(), at(-0.5)).with_shape_name("left");
    ArticulationBuilder::new("shelf").link(lower).link(upper).build().unwrap()
}

/// Balls over the left and the right board below, and over the upper board; returns their heights after two seconds.
fn dropped(world: &mut World) -> [f64; 3] {
    let balls = [(-0.5, 1.0), (0.5, 1.0), (-0.5, 2.5)].map(|(x, z)| {
        let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(1.0);
        world.add(ball.with_pose(Pose::translation(x, 0.0, z))).unwrap()
    });
    (0..480).for_each(|_| _ = world.step().unwrap());
    balls.map(|ball| world.body(ball).unwrap().position().z)
}

#[test]
fn a_link_or_one_of_its_shapes_has_a_filter_of_its_own() {
    let filter = |passes| Arc::new(Filter { passes, asked: AtomicU32::new(0) });
    for (shape, passes, expected) in [
        (None, "nobody", [true; 3]),
        (None, "left", [false, true, true]),
        (Some(0), "left", [false, true, true]),
        (Some(1), "left", [true; 3]),
    ] {
        let test = filter(passes);
        let (mut world, mut body) = (World::default(), shelf());
        assert!(!body.has_intersect());
        body.set_intersect("lower", shape, Some(test.clone())).unwrap();
        assert!(body.has_intersect());
        let id = world.add(body).unwrap();
        let mut fork = world.fork();
        let heights = dropped(&mut world);
        let rest = [0.65, 0.65, 2.15];
        let held: Vec<bool> = heights.iter().zip(rest).map(|(z, rest)| (z - rest).abs() < 1e-3).collect();
        assert_eq!(held, expected, "{heights:?} with {passes} on {shape:?}");
        assert!(test.asked.load(Ordering::Relaxed) > 0);
        assert_eq!(dropped(&mut fork), heights, "a fork has the same test");
        assert!(matches!(world.archive(&[]), Err(ArchiveError::Foreign(name)) if name == "shelf"));
        world.set_link_intersect(id, "lower", shape, None).unwrap();
        assert!(world.archive(&[]).is_ok());
    }
}

/// It collides with nothing.
struct Ghost;

impl Intersect for Ghost {
    fn contacts(&self, _: &IntersectPart, _: &IntersectPart, _: f64, _: &mut Vec<Contact>) -> bool {
        true
    }
}

#[test]
fn a_filter_wakes_the_body_that_gets_it() {
    let mut world = World::new(Settings::default().with_sleep(Some(Sleep::default()))).unwrap();
    world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
    let link = LinkBuilder::new("slide", Joint::prismatic(Vec3::z())).with_mass(1.0);
    let link =
        link.with_shape(Shape::sphere(0.1).unwrap(), Pose::identity()).with_pose(Pose::translation(0.0, 0.0, 0.1));
    let id = world.add(ArticulationBuilder::new("slide").link(link).build().unwrap()).unwrap();
    while !world.asleep(id) {
        assert!(world.time() < 10.0);
        world.step().unwrap();
    }
    world.set_link_intersect(id, "slide", None, Some(Arc::new(Ghost))).unwrap();
    (0..60).for_each(|_| _ = world.step().unwrap());
    assert!(!world.asleep(id) && world.state_of(id).unwrap()[0] < -0.01);
}

#[test]
fn filters_of_links_that_are_not_there_are_refused() {
    let (mut world, test) = (World::default(), Arc::new(Filter { passes: "", asked: AtomicU32::new(0) }));
    let (id, ball) = (world.add(shelf()).unwrap(), RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(1.0));
    let ball = world.add(ball).unwrap();
    let mut set =
        |id, link: &str, shape| world.set_link_intersect(id, link, shape, Some(test.clone())).unwrap_err().to_string();
    assert!(set(id, "middle", None).contains("'middle'"));
    let why = set(id, "lower", Some(2));
    assert!(why.contains("number of a shape is 2") && why.contains("below the number of shapes of the link"), "{why}");
    set(ball, "lower", None);
    let (mut world, _, hit) = bouncing();
    world.add(hit.with_call(|_, _| Ok(Vec::new()))).unwrap();
    assert!(matches!(world.archive(&[]), Err(ArchiveError::Foreign(name)) if name == "hit"));
}
