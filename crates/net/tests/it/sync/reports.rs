//! Readings of sensors and events of a world, in a facet and in the recording of a session: the same as in the world itself.

use super::simulated_session::{SCENE, viewer};
use crate::support::Scratch;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{
    Anchor, EventKind, LoopJoint, LoopJointKind, Material, Optics, RigidBody, ScriptedEvent, Sensor, SensorKind,
    SensorNoise, Settings, Sleep, Trigger, World,
};
use tumble_net::record::{Images, Readings, RecordedEvent, RecorderOptions, read};
use tumble_net::sync::wire::MessageError;
use tumble_net::sync::*;
use tumble_net::world::{events, images, readings};

/// Balls that bounce and come to rest, a gate through which they fall, a joint that breaks, an event that fires, and sensors with
/// and without errors.
fn scene() -> World {
    let mut world =
        World::new(Settings::default().with_dt(1.0 / 240.0).with_sleep(Some(Sleep { after: 0.3, ..Sleep::default() })))
            .unwrap();
    let ground = world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
    let gate = RigidBody::fixed(Shape::cuboid(Vec3::new(2.0, 2.0, 0.1)).unwrap()).with_name("gate").with_sensor(true);
    world.add_static(gate.with_pose(Pose::translation(0.0, 0.0, 0.5))).unwrap();
    let mut balls = Vec::new();
    for k in 0..3 {
        let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_name(format!("ball {k}")).with_mass(1.0);
        let place = Pose::translation(0.3 * f64::from(k), 0.0, 0.8 + 0.2 * f64::from(k));
        let elastic = Material { restitution: 0.5, ..Material::default() };
        balls.push(world.add(ball.with_pose(place).with_material(elastic)).unwrap());
    }
    let weight = RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("weight").with_mass(10.0);
    let weight = world.add(weight.with_pose(Pose::translation(5.0, 0.0, 0.6))).unwrap();
    let hook = Pose::translation(5.0, 0.0, 0.6);
    let joint = LoopJoint::new(
        "thread",
        LoopJointKind::Spherical,
        Anchor::world(hook),
        Anchor::on(weight, 0, Pose::identity()),
    )
    .unwrap();
    world.add(joint.with_breaking_force(50.0).unwrap()).unwrap();
    let hit = Trigger::Contact { a: vec![ground], b: vec![balls[0]], impulse: 0.0 };
    world.add(ScriptedEvent::new("hit", hit)).unwrap();
    let on = |id| Anchor::on(id, 0, Pose::identity());
    world.add(Sensor::new("felt", SensorKind::Touch, on(balls[0])).unwrap()).unwrap();
    let noise = SensorNoise { deviation: 0.1, bias_walk: 0.01, delay: 2, seed: 5, ..SensorNoise::default() };
    let imu = Sensor::new("imu", SensorKind::Accelerometer, on(balls[1])).unwrap();
    world.add(imu.with_noise(noise).unwrap()).unwrap();
    let down = Anchor::world(Pose::new(Vec3::new(0.0, 0.0, 2.0), Vec3::x() * std::f64::consts::PI));
    let optics = Optics { resolution: [4, 3], vertical_fov: 1.0 };
    for kind in [SensorKind::Depth, SensorKind::Color, SensorKind::Segmentation] {
        let camera = Sensor::new(kind.name(), kind, down).unwrap().with_optics(optics).unwrap();
        let delay = if kind == SensorKind::Color { 2 } else { 0 };
        world.add(camera.with_noise(SensorNoise { delay, ..SensorNoise::default() }).unwrap()).unwrap();
    }
    world
}

/// Kind, names of both sides with part and shape, and the numbers in single precision.
type Seen = (EventKind, String, Option<String>, [usize; 4], [[f32; 3]; 2]);

fn seen(world: &World) -> Vec<Seen> {
    let name = |id| world.name(id).unwrap().to_string();
    let one = |e: &tumble_core::Event| {
        let places = [e.part_a, e.shape_a, e.part_b, e.shape_b];
        (e.kind, name(e.a), e.b.map(name), places, [e.impulse.cast().into(), e.point.cast().into()])
    };
    world.events().iter().map(one).collect()
}

#[test]
fn a_facet_reads_the_events_of_all_steps_of_its_frame_and_the_readings_of_the_server() {
    for exact in [false, true] {
        let mut world = scene();
        let mut publisher = Publisher::new(&world, exact, 0).with_events(MAX_FRAME_EVENTS);
        let (mut mirror, mut slow) = (Mirror::new(scene()), Mirror::new(scene()));
        let mut kinds = Vec::new();
        for frame in 1..=120 {
            let mut expected = Vec::new();
            for _ in 0..4 {
                world.step().unwrap();
                publisher.step(&world);
                expected.extend(seen(&world));
            }
            let published = publisher.publish(&world, &viewer(frame), frame).unwrap();
            // the second facet misses two frames of three
            for facet in [&mut mirror, &mut slow].into_iter().take(if frame % 3 == 0 { 2 } else { 1 }) {
                if facet.revision().is_none() {
                    facet.apply_snapshot(&publisher.snapshot()).unwrap();
                }
                facet.apply_state(frame, world.time(), &published.state).unwrap();
                assert_eq!(facet.hash(), published.hash);
                assert_eq!(seen(facet.world()), expected, "frame {frame}");
                assert_eq!(readings(facet.world()), readings(&world), "frame {frame}");
                // a late image is a reading like others
                let late = |world: &World| world.color_image(world.find("color").unwrap()).unwrap();
                assert_eq!(late(facet.world()), late(&world), "frame {frame}");
            }
            kinds.extend(expected.iter().map(|e| e.0));
        }
        for (name, kind) in EventKind::NAMES.iter().filter(|(_, kind)| *kind != EventKind::Awake) {
            assert!(kinds.contains(kind), "{name} did not happen");
        }
        assert_eq!(readings(&world).len(), 2);
        // a paused frame has no events, and the readings stay
        let published = publisher.publish(&world, &viewer(200), 200).unwrap();
        mirror.apply_state(200, world.time(), &published.state).unwrap();
        assert!(mirror.world().events().is_empty() && readings(mirror.world()) == readings(&world));
    }
}

/// A replica has the noise and the delayed readings of the server too.
#[test]
fn a_replica_of_sensors_is_exact() {
    let (mut world, base) = (scene(), scene());
    let (mut publisher, mut mirror) = (Publisher::new(&world, true, 0), Mirror::new(base));
    for frame in 1..=50 {
        world.step().unwrap();
        let published = publisher.publish(&world, &viewer(frame), frame).unwrap();
        if published.fresh {
            mirror.apply_snapshot(&publisher.snapshot()).unwrap();
        }
        mirror.apply_state(frame, world.time(), &published.state).unwrap();
        let of = |world: &World, name: &str| world.state_of(world.find(name).unwrap()).unwrap().to_vec();
        for name in ["felt", "imu"] {
            assert_eq!(of(mirror.world(), name), of(&world, name));
        }
    }
}

/// Without sensors, and if events are not asked for, a state has eight bytes more than its poses and contacts: the count of events, and
/// the mark that the pairs that touch are not sent.
#[test]
fn nothing_is_sent_that_is_not_asked_for() {
    let mut world = super::simulated_session::scene();
    (0..60).for_each(|_| _ = world.step().unwrap());
    assert!(!world.events().is_empty());
    let (mut plain, mut with) = (Publisher::new(&world, false, 0), Publisher::new(&world, false, 0).with_events(1024));
    let state = plain.publish(&world, &viewer(1), 1).unwrap().state;
    assert_eq!(state[state.len() - 12..], [[0; 8].as_slice(), &[255; 4]].concat(), "the counts of contacts and events");
    let more = with.publish(&world, &viewer(1), 1).unwrap().state;
    let pairs = world.touching_pairs().len();
    assert!(pairs > 0);
    assert_eq!(more.len() - state.len(), world.events().len() * (1 + 2 * 12 + 24) + pairs * (1 + 4 * 4));
}

#[test]
fn malformed_reports_are_refused_and_change_nothing() {
    let (mut world, mut mirror) = (scene(), Mirror::new(scene()));
    let mut publisher = Publisher::new(&world, false, 0).with_events(MAX_FRAME_EVENTS);
    while !world.events().iter().any(|e| e.kind == EventKind::ContactBegin) {
        world.step().unwrap();
    }
    let published = publisher.publish(&world, &viewer(1), 1).unwrap();
    mirror.apply_snapshot(&publisher.snapshot()).unwrap();
    mirror.apply_state(1, world.time(), &published.state).unwrap();
    let (before, events) = (mirror.hash(), world.events().len());
    assert!(events >= 1);
    let state = published.state;
    let pairs = state.len() - world.touching_pairs().len() * (1 + 4 * 4) - 4;
    let start = pairs - events * (1 + 2 * 12 + 24) - 4;
    assert_eq!(state[start..start + 4], (events as u32).to_le_bytes());
    let mut refused = |bytes: &[u8], why: &str| {
        let error = mirror.apply_state(2, 1.0, bytes).unwrap_err();
        assert!(error.to_string().contains(why), "{error}, not {why}");
        assert_eq!(mirror.hash(), before);
        assert_eq!(seen(mirror.world()), seen(&world));
        assert_eq!(readings(mirror.world()), readings(&world));
    };
    for end in start..state.len() {
        refused(&state[..end], "unexpected end");
    }
    refused(&[&state[..], &[0]].concat(), "trailing bytes");
    let with = |at: usize, bytes: &[u8]| {
        let mut changed = state.clone();
        changed[at..at + bytes.len()].copy_from_slice(bytes);
        changed
    };
    refused(&with(start, &1025_u32.to_le_bytes()), "more than 1024 events");
    refused(&with(start + 4, &[9]), "an unknown kind of event");
    refused(&with(start + 5, &999_u32.to_le_bytes()), "an event of an unknown object");
    refused(&with(start + 9, &1_u32.to_le_bytes()), "an event of an unknown part");
    refused(&with(start + 29, &f32::NAN.to_le_bytes()), "not finite");
    refused(&with(pairs, &65_537_u32.to_le_bytes()), "more than 65536 pairs");
    refused(&with(pairs + 4, &[2]), "an unknown flag of a pair");
    refused(&with(pairs + 5, &999_u32.to_le_bytes()), "a pair of an unknown part");
    refused(&with(pairs + 9, &1_u32.to_le_bytes()), "a pair of an unknown part");
    let named = |name: &str| {
        let name = [&(u32::MAX - 1).to_le_bytes()[..], &(name.len() as u32).to_le_bytes(), name.as_bytes()].concat();
        [&state[..start + 5], &name, &state[start + 17..]].concat()
    };
    refused(&named("nobody"), "'nobody' is not in this scene");
    refused(&named("ground"), "names an object of the table");
    refused(&named(""), "an empty name");
    // a reading that is not finite: the numbers of the sensor are sent as they are
    let felt = world.state_of(world.find("felt").unwrap()).unwrap().to_vec();
    let bytes: Vec<u8> = felt.iter().flat_map(|x| x.to_le_bytes()).collect();
    let head = [8, 0, 0, 0];
    let body = |k: &usize| state[*k..].starts_with(&head) && state[*k + 4..].starts_with(&bytes);
    let at = (0..start).rfind(body).expect("the reading of 'felt'");
    refused(&with(at + 4, &f64::INFINITY.to_le_bytes()), "not finite");
    assert!(matches!(mirror.apply_state(2, 1.0, &[]), Err(MessageError::Malformed(_))));
}

/// The recording of a session has the readings and events of the world, through the code of a single run. Two steps a frame,
/// every third frame: no event is lost.
#[test]
fn the_recording_of_a_session_has_sensors_and_events() {
    let scratch = Scratch::new("session-report");
    for (every, steps) in [(1, 1), (3, 2)] {
        let path = scratch.file("session.mcap");
        let mut world = scene();
        let slots = vec![FacetSlot { name: "facet".into(), critical: false }];
        let mut session = ServerSession::new(ServerOptions::new(1, SCENE, slots), &world);
        let mut recorder =
            SessionRecorder::create(&path, "test", SCENE, &world, every, RecorderOptions::default()).unwrap();
        recorder = recorder.with_cameras(steps == 2);
        let mut expected: Vec<(Readings, Vec<RecordedEvent>, Images)> = Vec::new();
        let mut happened = Vec::new();
        for frame in 0..240 {
            for _ in 0..if frame > 0 { steps } else { 0 } {
                world.step().unwrap();
                recorder.step(&world);
                happened.extend(events(&world));
            }
            session.publish(std::time::Duration::from_millis(4 * frame), &world, &viewer(frame)).unwrap();
            recorder.frame(&world, session.recorded(frame == 0).unwrap()).unwrap();
            if frame % u64::from(every) == 0 {
                let seen = if steps == 2 { images(&world) } else { Images::new() };
                expected.push((readings(&world), std::mem::take(&mut happened), seen));
            }
        }
        recorder.finish().unwrap();
        let recorded: Vec<_> =
            read(&path).unwrap().map(|frame| frame.unwrap()).map(|f| (f.sensors, f.events, f.images)).collect();
        assert_eq!(recorded, expected);
        let kinds: Vec<&str> = expected.iter().flat_map(|(_, events, _)| events).map(|e| e.kind.as_str()).collect();
        assert!(
            ["contact_begin", "sensor_begin", "joint_broken", "fired", "asleep"]
                .iter()
                .all(|kind| kinds.contains(kind))
        );
        assert!(expected.iter().all(|(readings, ..)| readings.len() == 2));
    }
}

/// The pairs that touch, by the names of the others.
fn touching(world: &World, name: &str) -> Vec<(String, usize)> {
    let id = world.find(name).unwrap();
    world.touching(id).into_iter().map(|(id, part)| (world.name(id).unwrap().to_string(), part)).collect()
}

/// `World::touching` of a facet is that of the server if events are sent, in every frame, also for a facet that missed frames or joined
/// late; without events the facet says that it does not know.
#[test]
fn a_facet_knows_what_touches_if_events_are_sent() {
    for sends in [true, false] {
        let mut world = scene();
        let publisher = Publisher::new(&world, false, 0);
        let mut publisher = if sends { publisher.with_events(1) } else { publisher };
        let (mut mirror, mut seen) = (Mirror::new(scene()), 0);
        for frame in 1..=200 {
            (0..4).for_each(|_| _ = world.step().unwrap());
            let published = publisher.publish(&world, &viewer(frame), frame).unwrap();
            if frame % 7 != 0 {
                continue; // missed
            }
            if mirror.revision().is_none() {
                mirror.apply_snapshot(&publisher.snapshot()).unwrap();
            }
            mirror.apply_state(frame, world.time(), &published.state).unwrap();
            assert_eq!(mirror.hash(), published.hash, "frame {frame}");
            assert_eq!(mirror.world().knows_touching(), sends);
            for name in ["ground", "gate", "ball 0", "ball 1", "ball 2", "weight"] {
                let expected = touching(&world, name);
                seen += expected.len();
                assert_eq!(touching(mirror.world(), name), if sends { expected } else { Vec::new() }, "{name}");
            }
        }
        assert!(seen > 50 && world.knows_touching(), "{seen}");
    }
}

/// Sensors that a program adds while a cave runs, on bodies of the scene, on bodies and robots that it adds too, and on joints that a facet
/// does not have, are read in the facet, and images are made there.
#[test]
fn sensors_that_a_program_adds_are_sent() {
    use tumble_core::{ArticulationBuilder, Joint, LinkBuilder, SensorPlace};
    for exact in [false, true] {
        let mut world = scene();
        let (mut publisher, mut mirror) = (Publisher::new(&world, exact, 0), Mirror::new(scene()));
        let mut added = Vec::new();
        for frame in 1..=60 {
            if frame == 10 {
                let on = |id| Anchor::on(id, 0, Pose::identity());
                let ball = world.find("ball 2").unwrap();
                let noise =
                    SensorNoise { deviation: 0.1, bias_walk: 0.01, delay: 3, seed: 9, ..SensorNoise::default() };
                let imu = Sensor::new("late imu", SensorKind::Accelerometer, on(ball)).unwrap();
                added.push(world.add(imu.with_noise(noise).unwrap()).unwrap());
                let link = LinkBuilder::new("arm", Joint::revolute(Vec3::y()));
                let shape = Shape::capsule(0.05, 0.4).unwrap();
                let arm =
                    ArticulationBuilder::new("late arm").link(link.with_shape(shape, Pose::translation(0.2, 0.0, 0.0)));
                let arm = world.add(arm.build().unwrap()).unwrap();
                added.push(world.add(Sensor::of_dof("angle", SensorKind::JointPosition, arm, 0).unwrap()).unwrap());
                added.push(world.add(Sensor::new("strain", SensorKind::Torque, on(arm)).unwrap()).unwrap());
                let hook = LoopJoint::new("hook", LoopJointKind::Spherical, Anchor::world(Pose::identity()), on(ball))
                    .unwrap();
                let hook = world.add(hook).unwrap();
                let pull = Sensor::at("pull".into(), SensorKind::Force, SensorPlace::LoopJoint(hook)).unwrap();
                added.push(world.add(pull).unwrap());
                let optics = Optics { resolution: [5, 4], vertical_fov: 0.8 };
                let down = Pose::new(Vec3::new(0.0, 0.0, 2.0), Vec3::x() * std::f64::consts::PI);
                let eye = Sensor::new("late eye", SensorKind::Depth, Anchor::world(down)).unwrap();
                world.add(eye.with_optics(optics).unwrap()).unwrap();
            }
            if frame == 40 {
                world.remove(world.find("late imu").unwrap()).unwrap();
            }
            (0..4).for_each(|_| _ = world.step().unwrap());
            let published = publisher.publish(&world, &viewer(frame), frame).unwrap();
            if published.fresh {
                mirror.apply_snapshot(&publisher.snapshot()).unwrap();
            }
            mirror.apply_state(frame, world.time(), &published.state).unwrap();
            assert_eq!(mirror.hash(), published.hash, "frame {frame}");
            assert_eq!(readings(mirror.world()), readings(&world), "frame {frame}");
            let count = match frame {
                0..10 => 2,
                10..40 => 6,
                _ => 5,
            };
            assert_eq!(readings(mirror.world()).len(), count, "frame {frame}");
            if frame == 30 {
                for id in &added {
                    let sensor = mirror.world().find(world.name(*id).unwrap()).unwrap();
                    assert_eq!(mirror.world().reading(sensor), world.reading(*id));
                    assert!(world.reading(*id).unwrap().iter().any(|x| *x != 0.0), "{}", world.name(*id).unwrap());
                }
                // made from the poses that the facet shows
                let seen = |world: &World| world.depth_image(world.find("late eye").unwrap()).unwrap().pixels;
                let (here, there) = (seen(mirror.world()), seen(&world));
                let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-3;
                let agree = here.iter().zip(&there).filter(|pair| near(*pair)).count();
                assert!(agree >= 16 && here.len() == 20, "{here:?} {there:?}");
            }
        }
    }
}

/// A table with a damaged sensor is refused whole.
#[test]
fn a_damaged_sensor_of_a_table_is_refused() {
    let mut world = scene();
    let mut publisher = Publisher::new(&world, false, 0);
    let ball = world.find("ball 2").unwrap();
    let imu = Sensor::new("late imu", SensorKind::Gyroscope, Anchor::on(ball, 0, Pose::identity())).unwrap();
    world.add(imu.with_noise(SensorNoise { deviation: 0.5, ..SensorNoise::default() }).unwrap()).unwrap();
    publisher.publish(&world, &viewer(1), 1).unwrap();
    let table = publisher.snapshot().to_vec();
    let mut mirror = Mirror::new(scene());
    mirror.apply_snapshot(&table).unwrap();
    let at = table.windows(8).position(|bytes| bytes == b"late imu").unwrap() + 8 + 8 + 4;
    let damaged = |place: usize, bytes: &[u8]| {
        let mut damaged = table.clone();
        damaged[at + place..at + place + bytes.len()].copy_from_slice(bytes);
        Mirror::new(scene()).apply_snapshot(&damaged).unwrap_err()
    };
    let malformed = |error: MessageError| matches!(error, MessageError::Malformed(_));
    assert!(malformed(damaged(0, &[200])), "an unknown kind");
    assert!(malformed(damaged(9, &f64::NAN.to_le_bytes())), "a deviation that is not finite");
    assert!(matches!(damaged(1, &(-1.0f64).to_le_bytes()), MessageError::Unfit(_)), "a cutoff below 0");
    assert!(matches!(damaged(33, &u32::MAX.to_le_bytes()), MessageError::Unfit(_)), "a delay without end");
    assert!(malformed(damaged(45, &1000u32.to_le_bytes())), "an object that is not there");
    assert!(malformed(damaged(49, &7u32.to_le_bytes())), "a part that is not there");
    assert!(malformed(damaged(77, &1.0f64.to_le_bytes())), "a rotation of another length");
    assert_eq!(mirror.world().sensors().count(), 6);
}
