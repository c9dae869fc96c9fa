//! Events, sensors and filters: kinds, times and impulses against closed forms, and the same events
//! after a restored state, in forks and in archives.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

fn ball(height: f64) -> RigidBody {
    RigidBody::new(sphere(0.1)).with_mass(2.0).with_pose(Pose::translation(0.0, 0.0, height))
}

/// The kinds of the events of a pair, in every step of a run.
fn kinds(world: &mut World, steps: usize, pair: [ObjectId; 2]) -> Vec<Option<EventKind>> {
    (0..steps)
        .map(|_| {
            world.step().unwrap();
            let of_pair: Vec<_> = world.events().iter().filter(|e| (e.a, e.b) == (pair[0], Some(pair[1]))).collect();
            assert!(of_pair.len() <= 1, "at most one event of a pair in a step");
            of_pair.first().map(|event| event.kind)
        })
        .collect()
}

#[test]
fn a_bounce_begins_and_ends_with_the_impulse_of_newtons_law() {
    for stepper in STEPPERS {
        for (dt, substeps) in [(1.0 / 60.0, 4), (1.0 / 240.0, 1), (1.0 / 1000.0, 1)] {
            let mut world = world(stepper, dt);
            world.set_settings(world.settings().with_substeps(substeps)).unwrap();
            let floor = ground(&mut world, 0.5, 0.0);
            let ball = world.add(ball(0.1 + 0.8)).unwrap();
            let (mut total, mut seen) = (Vec3::zeros(), Vec::new());
            while world.time() < 0.7 {
                world.step().unwrap();
                for event in world.events() {
                    assert_eq!((event.a, event.b), (floor, Some(ball)));
                    total += event.impulse;
                    seen.push((event.kind, world.time()));
                }
            }
            // it falls for √(2h/g) = 0.404 s and flies for half of twice that; m (1 + e) v
            let speed = (2.0 * G * 0.8f64).sqrt();
            let (kind, time) = seen[0];
            assert!(kind == EventKind::ContactBegin && (time - speed / G).abs() <= 2.0 * dt, "{stepper}: {seen:?}");
            assert!(
                (total.z + 2.0 * 1.5 * speed).abs() < 0.02 * 2.0 * 1.5 * speed,
                "{stepper}, {dt}: an impulse of {total:?}"
            );
            assert_eq!(seen.last().unwrap().0, EventKind::ContactEnd, "{stepper}, {dt}");
            assert!(seen.len() <= 4, "{stepper}, {dt}: {seen:?}");
            assert!(world.touching(ball).is_empty());
        }
    }
}

#[test]
fn a_body_at_rest_persists_with_its_weight() {
    for stepper in STEPPERS {
        let dt = 1.0 / 240.0;
        let mut world = world(stepper, dt);
        let floor = ground(&mut world, 0.0, 0.5);
        let block = RigidBody::new(cube(0.2)).with_mass(3.0).with_pose(Pose::translation(0.0, 0.0, 0.1));
        let block = world.add(block).unwrap();
        let all = kinds(&mut world, 240, [floor, block]);
        assert_eq!(all[0], Some(EventKind::ContactBegin), "{stepper}");
        assert!(all[1..].iter().all(|kind| *kind == Some(EventKind::ContactPersist)), "{stepper}: {all:?}");
        let impulse = world.events()[0].impulse;
        assert!(
            (impulse + Vec3::z() * 3.0 * G * dt).norm() < 1e-6 * 3.0 * G * dt,
            "{stepper}: four contacts are one event"
        );
        assert_eq!((world.touching(block), world.touching(floor)), (vec![(floor, 0)], vec![(block, 0)]));
        world.set_pose(block, Pose::translation(0.0, 0.0, 5.0)).unwrap();
        assert_eq!(kinds(&mut world, 2, [floor, block]), [Some(EventKind::ContactEnd), None], "{stepper}");
    }
}

#[test]
fn a_threshold_leaves_out_weak_contacts() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    // a weight of 2 kg presses with 0.082 N·s a step, and falls with more
    world.set_settings(world.settings().with_event_impulse(0.5)).unwrap();
    let floor = ground(&mut world, 0.0, 0.5);
    let ball = world.add(ball(0.1 + 0.2)).unwrap();
    let all = kinds(&mut world, 240, [floor, ball]);
    let listed: Vec<EventKind> = all.into_iter().flatten().collect();
    // the impact alone, which may need two steps
    assert!(listed.len() <= 3 && listed[0] == EventKind::ContactBegin, "{listed:?}");
    assert_eq!(*listed.last().unwrap(), EventKind::ContactEnd);
    let wrong = world.settings().with_event_impulse(-1.0);
    assert!(world.set_settings(wrong).is_err());
}

#[test]
fn a_sensor_sees_a_body_pass_and_does_not_touch_it() {
    for stepper in STEPPERS {
        let dt = 1.0 / 480.0;
        let mut world = world(stepper, dt);
        let gate = RigidBody::fixed(Shape::cuboid(Vec3::new(1.0, 1.0, 0.2)).unwrap()).with_sensor(true);
        let gate = world.add(gate.with_pose(Pose::translation(0.0, 0.0, 1.0))).unwrap();
        let falling = world.add(ball(2.0)).unwrap();
        let all = kinds(&mut world, 300, [gate, falling]);
        let step = |kind| all.iter().position(|k| *k == Some(kind)).unwrap() as f64 + 1.0;
        // 0.8 m to the upper face, 1.2 m to leave the lower one
        let time = |fall: f64| (2.0 * fall / G).sqrt();
        assert!((step(EventKind::SensorBegin) * dt - time(0.8)).abs() <= dt, "{stepper}");
        assert!((step(EventKind::SensorEnd) * dt - time(1.2)).abs() <= dt, "{stepper}");
        assert_eq!(all.iter().flatten().count(), 2);
        let fallen = 2.0 - position(&world, falling).z;
        assert!((fallen - 0.5 * G * world.time().powi(2)).abs() < 1e-9, "{stepper}: free fall");
        assert!(world.contacts().is_empty());
    }
}

#[test]
fn sensors_obey_groups_switches_and_other_sensors() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let group = |n| CollisionGroup::new(n).unwrap();
    let sensor = RigidBody::fixed(sphere(1.0)).with_sensor(true).with_groups(group(0), 0b10);
    let sensor = world.add(sensor).unwrap();
    let seen = world.add(ball(0.5).with_groups(group(1), u64::MAX)).unwrap();
    world.add(ball(-0.5).with_groups(group(2), u64::MAX)).unwrap(); // not in its mask
    world.add(ball(0.0).with_groups(group(1), 0b10)).unwrap(); // does not collide with group 0
    world.add(RigidBody::fixed(sphere(0.2)).with_groups(group(1), u64::MAX)).unwrap(); // both are static
    world.add(ball(0.2).with_groups(group(1), u64::MAX).with_sensor(true)).unwrap();
    world.step().unwrap();
    assert_eq!(world.touching(sensor), vec![(seen, 0)]);
    assert!(world.touching(seen).iter().all(|(id, _)| *id != sensor), "a sensor is not touched");
    world.set_collidable(sensor, false).unwrap();
    world.step().unwrap();
    assert!(world.events().iter().any(|e| e.kind == EventKind::SensorEnd && e.b == Some(seen)));
    world.set_collidable(sensor, true).unwrap();
    let ignored = PairMaterial { collides: Some(false), ..PairMaterial::default() };
    world.set_pair_material(sensor, seen, ignored).unwrap();
    world.step().unwrap();
    assert!(world.touching(sensor).is_empty(), "an ignored pair");
    world.set_pair_material(sensor, seen, PairMaterial::default()).unwrap();
    world.step().unwrap();
    assert_eq!(world.touching(sensor), vec![(seen, 0)]);
    world.remove(seen).unwrap();
    assert!(world.events().iter().all(|event| event.a != seen && event.b != Some(seen)));
    assert!(world.touching(sensor).is_empty());
}

#[test]
fn an_ignored_pair_falls_through() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let floor = ground(&mut world, 0.0, 0.5);
        let [through, stays] = [0.0, 1.0].map(|x| {
            let pose = Pose::translation(x, 0.0, 0.5);
            world.add(RigidBody::new(sphere(0.1)).with_mass(1.0).with_pose(pose)).unwrap()
        });
        let ignored = PairMaterial { collides: Some(false), ..PairMaterial::default() };
        world.set_pair_material(through, floor, ignored).unwrap();
        for _ in 0..240 {
            world.step().unwrap();
        }
        assert!((position(&world, through).z - (0.5 - 0.5 * G)).abs() < 1e-9, "{stepper}: free fall");
        assert!((position(&world, stays).z - 0.1).abs() < 1e-4, "{stepper}");
        assert!(world.overlapping_pairs(0.0).iter().all(|pair| !pair.objects.contains(&through)));
    }
}

#[test]
fn sleepers_stay_in_contact_without_events() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    world.set_settings(world.settings().with_sleep(Some(Sleep { after: 0.1, within: 1e-4 }))).unwrap();
    let floor = ground(&mut world, 0.0, 0.5);
    let block = RigidBody::new(cube(0.2)).with_mass(3.0).with_pose(Pose::translation(0.0, 0.0, 0.1));
    let block = world.add(block).unwrap();
    let mut slept = 0;
    for _ in 0..120 {
        let before = world.asleep(block);
        world.step().unwrap();
        let sleep: Vec<EventKind> = world.events().iter().filter(|e| e.b.is_none()).map(|e| e.kind).collect();
        match (before, world.asleep(block)) {
            (false, true) => assert_eq!(sleep, [EventKind::Asleep]),
            (true, true) => {
                assert!(world.events().is_empty());
                slept += 1;
            }
            _ => assert_eq!(sleep, []),
        }
        assert_eq!(world.touching(block), vec![(floor, 0)]);
    }
    assert!(slept > 10);
    world.apply_impulse(block, 0, Vec3::x(), &Vec3::new(0.0, 0.0, 0.1)).unwrap();
    world.step().unwrap();
    let listed: Vec<EventKind> = world.events().iter().map(|e| e.kind).collect();
    assert_eq!(listed, [EventKind::ContactPersist], "a change between steps wakes it before the step");
    world.remove(floor).unwrap();
    world.step().unwrap();
    assert!(world.events().is_empty());
}

/// Balls that fall on each other, a sensor among them.
fn heap(stepper: &str) -> World {
    let mut world = world(stepper, 1.0 / 120.0);
    world.set_settings(world.settings().with_sleep(Some(Sleep { after: 0.2, within: 1e-3 }))).unwrap();
    ground(&mut world, 0.3, 0.5);
    let gate = RigidBody::fixed(sphere(0.5)).with_sensor(true).with_pose(Pose::translation(0.0, 0.0, 1.0));
    world.add(gate).unwrap();
    for k in 0..6 {
        let pose = Pose::translation(0.03 * f64::from(k % 2), 0.02 * f64::from(k % 3), 0.3 + 0.25 * f64::from(k));
        world.add(RigidBody::new(sphere(0.1)).with_mass(1.0).with_pose(pose)).unwrap();
    }
    world
}

#[test]
fn restored_forked_and_archived_worlds_have_the_same_events() {
    for stepper in STEPPERS {
        let mut world = heap(stepper);
        let (mut events, mut others) = (0, Vec::new());
        for step in 0..300 {
            if step % 50 == 25 {
                let mut restored = heap(stepper);
                restored.restore(&world.save()).unwrap();
                assert!(restored.events().is_empty());
                let archived = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
                assert_eq!(format!("{:?}", archived.events()), format!("{:?}", world.events()));
                let fork = world.fork();
                assert_eq!(fork.events(), world.events());
                others = vec![restored, archived, fork];
            }
            world.step().unwrap();
            events += world.events().len();
            for other in &mut others {
                other.step().unwrap();
                assert_eq!(format!("{:?}", other.events()), format!("{:?}", world.events()), "{stepper}, step {step}");
            }
        }
        assert!(events > 100, "{events}");
        let mut at = WorldState::default();
        world.checkpoint(&mut at);
        assert!(world.roll_back(&at) && world.events().is_empty());
    }
}
