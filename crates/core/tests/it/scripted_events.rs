//! Scripted events: triggers and actions against closed forms, and their place in the state.

use crate::common::*;
use std::sync::Arc;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

fn ball(name: &str, at: [f64; 3]) -> RigidBody {
    RigidBody::new(sphere(0.1)).with_name(name).with_mass(2.0).with_pose(Pose::translation(at[0], at[1], at[2]))
}

fn at(time: f64) -> ScriptedEvent {
    ScriptedEvent::new("event", Trigger::Time { at: time })
}

fn run_to(world: &mut World, time: f64) {
    while world.time() < time - 1e-9 {
        world.step().unwrap();
    }
}

fn fired(world: &World) -> u64 {
    ScriptedEvent::fired(world, world.find("event").unwrap()).unwrap()
}

#[test]
fn a_body_thrown_by_an_impulse_lands_where_the_parabola_says() {
    for stepper in STEPPERS {
        for dt in [1.0 / 60.0, 1.0 / 240.0, 1.0 / 1000.0] {
            let mut world = world(stepper, dt);
            ground(&mut world, 0.0, 0.0);
            let ball = world.add(ball("ball", [0.0, 0.0, 0.1])).unwrap();
            world.add(at(0.1).with_action(Action::push(ball, Vec3::new(6.0, 0.0, 8.0)))).unwrap();
            run_to(&mut world, 0.1);
            let start = world.time();
            assert!(start - 0.1 < dt && fired(&world) == 1);
            assert!((velocity(&world, ball) - Vec3::new(3.0, 0.0, 4.0)).norm() < 1e-9, "J/m");
            let flight = 2.0 * 4.0 / G;
            let mut landed = None;
            while landed.is_none() {
                world.step().unwrap();
                let low = position(&world, ball).z < 0.1 + 4.0 * 2.0 * dt;
                let begins = world.events().iter().any(|e| e.kind == EventKind::ContactBegin);
                landed = (low && begins).then_some(world.time() - start);
            }
            let time = landed.unwrap();
            assert!((time - flight).abs() <= 2.0 * dt, "{stepper}, {dt}: {time} s instead of {flight} s");
            assert!((position(&world, ball).x - 3.0 * time).abs() < 1e-9, "{stepper}, {dt}");
        }
    }
}

#[test]
fn an_impulse_off_the_center_turns_the_body() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let cube = world.add(RigidBody::new(cube(0.6)).with_mass(5.0)).unwrap();
    let (impulse, point) = (Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.3, 0.0, 0.0));
    let push = Action::Push { body: Subject::Part(cube, 0), impulse, point: Some(point) };
    world.add(at(0.05).with_action(push)).unwrap();
    run_to(&mut world, 0.05);
    let spin = world.part_state(cube, 0).unwrap().angular_velocity;
    assert!((spin.z - 0.3 * 2.0 / (5.0 * 0.36 / 6.0)).abs() < 1e-12, "r × J / I"); // I = m a²/6
    assert!((velocity(&world, cube).y - 0.4).abs() < 1e-12);
}

#[test]
fn a_force_for_some_time_gives_force_times_duration() {
    for dt in [0.01, 0.004] {
        let mut world = no_gravity(world("time_stepping", dt));
        let ball = world.add(ball("ball", [0.0; 3])).unwrap();
        let force = Action::Force {
            body: Subject::Part(ball, 0),
            force: Vec3::new(3.0, 0.0, 0.0),
            torque: Vec3::new(0.0, 0.0, 0.2),
            duration: 0.3333,
        };
        world.add(at(0.1).with_action(force)).unwrap();
        run_to(&mut world, 1.0);
        assert!((velocity(&world, ball).x - 3.0 * 0.3333 / 2.0).abs() < 1e-9, "{dt}");
        let inertia = 0.4 * 2.0 * 0.01;
        let spin = world.part_state(ball, 0).unwrap().angular_velocity.z;
        assert!((spin - 0.2 * 0.3333 / inertia).abs() < 1e-9, "{dt}: {spin}");
    }
}

#[test]
fn bodies_are_spawned_on_time_and_fly_freely() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 128.0);
        let template = Template::add(&mut world, "shot", &ball("", [0.0; 3]), 3, false).unwrap();
        let (start, v) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 0.0, 5.0));
        let every = Trigger::Every { period: 0.25, first: 0.5 };
        let event = ScriptedEvent::new("event", every);
        world.add(event.with_action(Action::spawn(template, Pose::from(start), v))).unwrap();
        let ids = world.get::<Template>(template).unwrap().bodies().to_vec();
        assert_eq!(world.name(ids[2]), Some("shot 3"));
        for k in 0..256 {
            world.step().unwrap();
            let time = f64::from(k + 1) / 128.0;
            for (number, &id) in ids.iter().enumerate() {
                let age = time - 0.5 - 0.25 * number as f64;
                assert_eq!(world.status(id).unwrap().enabled, age >= 0.0);
                let flown = start + v * age - Vec3::z() * (0.5 * G * age * age);
                assert!(age < 0.0 || (position(&world, id) - flown).norm() < 1e-9, "{stepper}: {number} at {time}");
            }
        }
        // at 0.5, 0.75, 1, and in vain at 1.25, 1.5, 1.75, 2
        assert_eq!(Template::counts(&world, template), Some([3, 4]));
        assert_eq!(fired(&world), 7);
    }
}

#[test]
fn a_template_that_is_used_again_moves_the_oldest_body() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let template = Template::add(&mut world, "shot", &ball("", [0.0; 3]), 2, true).unwrap();
    let spawn = Action::spawn(template, Pose::identity(), 5.0 * Vec3::x());
    world.add(ScriptedEvent::new("event", Trigger::Every { period: 0.1, first: 0.1 }).with_action(spawn)).unwrap();
    run_to(&mut world, 0.35);
    let ids = world.get::<Template>(template).unwrap().bodies().to_vec();
    assert_eq!(Template::counts(&world, template), Some([3, 0]));
    // the first one was spawned again at 0.3
    let x: Vec<f64> = ids.iter().map(|id| position(&world, *id).x).collect();
    assert!((x[0] - 0.25).abs() < 1e-9 && (x[1] - 0.75).abs() < 1e-9, "{x:?}");
}

#[test]
fn a_thrower_places_what_it_spawns_and_adds_its_velocity() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let (spin, v) = (Vec3::new(0.0, 0.0, 2.0), Vec3::new(0.5, 0.0, 0.0));
    let turret = world.add(ball("turret", [1.0, 0.0, 0.0]).with_angular_velocity(spin).with_velocity(v)).unwrap();
    let template = Template::add(&mut world, "shot", &ball("", [0.0; 3]), 1, false).unwrap();
    let action = Action::Spawn {
        template,
        pose: Pose::translation(1.0, 0.0, 0.0),
        velocity: Vec3::new(3.0, 0.0, 0.0),
        angular_velocity: Vec3::zeros(),
        from: Some(turret),
    };
    world.add(at(0.2).with_action(action)).unwrap();
    run_to(&mut world, 0.2);
    let shot = world.find("shot 1").unwrap();
    let (angle, time) = (2.0 * 0.2f64, 0.2);
    let out = Vec3::new(angle.cos(), angle.sin(), 0.0);
    let center = Vec3::new(1.0, 0.0, 0.0) + v * time;
    assert!((position(&world, shot) - (center + out)).norm() < 1e-6);
    assert!((velocity(&world, shot) - (3.0 * out + v + spin.cross(&out))).norm() < 1e-6);
}

/// A shot at rest relative to a spinning turret moves as a point of it: `ω` of the turret, and `v + ω × r` at its own center of
/// mass, which is beside its origin.
#[test]
fn what_is_spawned_at_rest_moves_with_its_thrower() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let (spin, v) = (Vec3::new(0.0, 0.0, 2.0), Vec3::new(0.5, 0.0, 0.0));
    let turret = world.add(ball("turret", [1.0, 0.0, 0.0]).with_angular_velocity(spin).with_velocity(v)).unwrap();
    let shape = ball("", [0.0; 3]).with_center_of_mass(Vec3::new(0.0, 0.3, 0.0));
    let template = Template::add(&mut world, "shot", &shape, 1, false).unwrap();
    let action = Action::Spawn {
        template,
        pose: Pose::translation(1.0, 0.0, 0.0),
        velocity: Vec3::zeros(),
        angular_velocity: Vec3::new(0.0, 0.0, 0.5),
        from: Some(turret),
    };
    world.add(at(0.2).with_action(action)).unwrap();
    run_to(&mut world, 0.2);
    let shot = world.center_state(world.find("shot 1").unwrap()).unwrap();
    let (sin, cos) = 0.4f64.sin_cos();
    let center = Vec3::new(cos - 0.3 * sin, sin + 0.3 * cos, 0.0);
    assert!((shot.velocity - (v + spin.cross(&center))).norm() < 1e-6, "{}", shot.velocity);
    assert!((shot.angular_velocity - Vec3::new(0.0, 0.0, 2.5)).norm() < 1e-9, "{}", shot.angular_velocity);
}

#[test]
fn a_contact_fires_from_its_threshold_on() {
    let impulse = 2.0 * 1.5 * (2.0 * G).sqrt(); // m·(1 + e)·v after 1 m
    for (threshold, expected) in [(0.0, 1), (0.95 * impulse, 1), (1.05 * impulse, 0)] {
        let mut world = world("time_stepping", 1.0 / 240.0);
        let floor = ground(&mut world, 0.5, 0.0);
        let ball = world.add(ball("ball", [0.0, 0.0, 1.1])).unwrap();
        let trigger = Trigger::Contact { a: vec![floor], b: vec![ball], impulse: threshold };
        let event = ScriptedEvent::new("event", trigger);
        let away = Action::Remove(Subject::Other);
        world.add(event.with_action(away)).unwrap();
        run_to(&mut world, 1.0);
        assert_eq!(fired(&world), expected, "{threshold}");
        assert_eq!(world.status(ball).unwrap().enabled, expected == 0);
    }
}

#[test]
fn sensors_partings_keys_and_broken_joints_fire_once_each() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    let floor = ground(&mut world, 0.8, 0.0);
    let gate = RigidBody::fixed(Shape::cuboid(Vec3::new(1.0, 1.0, 0.2)).unwrap()).with_name("gate").with_sensor(true);
    let gate = world.add_static(gate.with_pose(Pose::translation(0.0, 0.0, 1.0))).unwrap();
    let ball = world.add(ball("ball", [0.0, 0.0, 2.0])).unwrap();
    let other =
        world.add(RigidBody::new(sphere(0.1)).with_mass(1.0).with_pose(Pose::translation(5.0, 0.0, 2.0))).unwrap();
    let anchor = Anchor::world(Pose::translation(5.0, 0.0, 2.0));
    let joint = LoopJoint::new("rope", LoopJointKind::Spherical, Anchor::on(other, 0, Pose::identity()), anchor);
    let joint = world.add(joint.unwrap().with_breaking_force(20.0).unwrap()).unwrap();
    let triggers = [
        ("enters", Trigger::Enters { sensor: gate, bodies: vec![ball] }),
        ("leaves", Trigger::Leaves { sensor: gate, bodies: vec![] }),
        ("never", Trigger::Enters { sensor: gate, bodies: vec![other] }),
        ("parts", Trigger::Parting { a: vec![ball], b: vec![floor] }),
        ("key", Trigger::Key { key: "k".into() }),
        ("breaks", Trigger::Breaks { joint }),
    ];
    let ids: Vec<ObjectId> =
        triggers.into_iter().map(|(name, t)| world.add(ScriptedEvent::new(name, t)).unwrap()).collect();
    world.add(at(0.6).with_action(Action::push(other, Vec3::new(0.0, 0.0, -30.0)))).unwrap();
    assert!(!world.press("j"));
    let mut times = vec![Vec::new(); ids.len()];
    for k in 0..240 {
        if k == 120 {
            assert!(world.press("k"));
        }
        world.step().unwrap();
        for (event, times) in ids.iter().zip(&mut times) {
            let of_event = |e: &&Event| e.kind == EventKind::Fired && e.a == *event;
            times.extend(world.events().iter().filter(of_event).map(|_| world.time()));
        }
    }
    // it falls to the upper face, out of the lower face, onto the floor, and leaves it
    let fall = |h: f64| (2.0 * h / G).sqrt();
    let expected = [vec![fall(0.8)], vec![fall(1.2)], vec![], vec![fall(1.9)], vec![121.0 / 240.0], vec![0.6]];
    for (k, (times, expected)) in times.iter().zip(&expected).enumerate() {
        let upward = k == 0 || k == 1; // it passes the gate again on its way up
        assert!(times.len() == expected.len() || upward && times.len() > expected.len(), "{k}: {times:?}");
        for (time, right) in times.iter().zip(expected) {
            assert!((time - right).abs() < 3.5 / 240.0, "{k}: {time} s instead of {right} s");
        }
    }
}

/// A block rests and falls asleep after half a second; a ball that falls 4 m wakes it.
#[test]
fn lasting_contacts_sleep_and_waking_fire() {
    for stepper in STEPPERS {
        let sleep = Some(Sleep { after: 0.5, within: 1e-3 });
        let mut world = World::new(Settings::default().with_dt(1.0 / 240.0).with_sleep(sleep)).unwrap();
        world.set_stepper(stepper_by_name(stepper).unwrap());
        let floor = ground(&mut world, 0.0, 0.5);
        let cube = RigidBody::new(Shape::cuboid(Vec3::repeat(0.4)).unwrap()).with_mass(10.0).with_name("block");
        let block = world.add(cube.with_pose(Pose::translation(0.0, 0.0, 0.2))).unwrap();
        let dropped = world.add(ball("ball", [0.0, 0.0, 4.5])).unwrap();
        let triggers = [
            ("meets", Trigger::Contact { a: vec![floor], b: vec![block], impulse: 0.0 }),
            ("lasts", Trigger::Touching { a: vec![block], b: vec![floor] }),
            ("sleeps", Trigger::Asleep { bodies: vec![block] }),
            ("wakes", Trigger::Awake { bodies: Vec::new() }),
            ("never", Trigger::Asleep { bodies: vec![floor] }),
        ];
        let ids = triggers.map(|(name, t)| world.add(ScriptedEvent::new(name, t)).unwrap());
        let mut times = ids.map(|_| Vec::<i32>::new());
        for frame in 1..=250 {
            world.step().unwrap();
            let lasts = |e: &&Event| e.kind == EventKind::ContactPersist && (e.a, e.b) == (floor, Some(block));
            let expected = world.events().iter().filter(lasts).count();
            for (event, times) in ids.iter().zip(&mut times) {
                let firings: Vec<Event> =
                    world.events().iter().filter(|e| e.kind == EventKind::Fired && e.a == *event).copied().collect();
                if *event == ids[1] {
                    assert_eq!(firings.len(), expected, "frame {frame}");
                    assert!(firings.iter().all(|e| e.b == Some(floor)));
                } else {
                    assert!(firings.iter().all(|e| e.b == Some(block)), "frame {frame}: {firings:?}");
                }
                times.extend(firings.iter().map(|_| frame));
            }
        }
        let hit = ((2.0 * (4.5 - 0.1 - 0.4) / G).sqrt() * 240.0_f64).ceil() as i32; // the frame in which the ball arrives
        let [meets, lasts, sleeps, wakes, never] = &times;
        assert_eq!((meets.len(), sleeps.len(), never.len()), (1, 1, 0), "{stepper}: {times:?}");
        assert_eq!(lasts[0], meets[0] + 1);
        assert!((sleeps[0] - 120).abs() <= 2 && (wakes[0] - hit).abs() <= 1 && wakes.len() == 1, "{hit}: {times:?}");
        // every frame up to sleep, none during it
        assert_eq!(lasts.iter().filter(|frame| **frame < wakes[0]).count() as i32, sleeps[0] - meets[0]);
        assert!(!lasts.iter().any(|frame| (sleeps[0] + 1..wakes[0]).contains(frame)));
        let _ = dropped;
    }
}

#[test]
fn an_event_after_an_event_waits_for_its_delay() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let ball = world.add(ball("ball", [0.0; 3])).unwrap();
    let first = world.add(at(0.2)).unwrap();
    let second = ScriptedEvent::new("second", Trigger::Fired { event: first }).with_delay(0.3);
    let second = world.add(second.with_action(Action::push(ball, Vec3::x()))).unwrap();
    run_to(&mut world, 0.49);
    assert_eq!((fired(&world), ScriptedEvent::fired(&world, second)), (1, Some(0)));
    run_to(&mut world, 0.5);
    assert_eq!(ScriptedEvent::fired(&world, second), Some(1));
    assert!((velocity(&world, ball).x - 0.5).abs() < 1e-12);
    run_to(&mut world, 1.0);
    assert_eq!(ScriptedEvent::fired(&world, second), Some(1));
}

#[test]
fn an_event_fires_at_most_as_often_as_it_may_and_not_while_disabled() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let every = Trigger::Every { period: 0.1, first: 0.1 };
    let event = world.add(ScriptedEvent::new("event", every).with_times(3)).unwrap();
    let off = ScriptedEvent::new("off", Trigger::Time { at: 0.15 }).with_action(Action::Disable(event));
    let on = ScriptedEvent::new("on", Trigger::Time { at: 0.45 }).with_action(Action::Enable(event));
    world.add(off).unwrap();
    world.add(on).unwrap();
    run_to(&mut world, 0.44);
    assert_eq!(fired(&world), 1);
    run_to(&mut world, 2.0);
    assert_eq!(fired(&world), 3);
}

#[test]
fn a_drive_moves_to_the_target_of_the_latest_event_and_back_after_a_restore() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let body = world.add(ball("ball", [0.0; 3])).unwrap();
    let slide = LoopJoint::new(
        "slide",
        LoopJointKind::Prismatic,
        Anchor::on(body, 0, Pose::identity()),
        Anchor::world(Pose::identity()),
    );
    let drive = Drive::Position { stiffness: 4000.0, damping: 400.0, target: 0.0, velocity: 0.0, limit: f64::INFINITY };
    let dof = DofSettings { drive: drive.clone(), ..DofSettings::default() };
    let slide = world.add(slide.unwrap().with_dof(dof).unwrap()).unwrap();
    let link = LinkBuilder::new("link", Joint::Prismatic { axis: Vec3::x() }).with_shape(cube(0.1), Pose::identity());
    let arm = ArticulationBuilder::new("arm").link(link.with_mass(1.0).with_drive(drive)).build().unwrap();
    let arm = world.add(arm.with_pose(Pose::translation(0.0, 5.0, 0.0))).unwrap();
    world.add(at(0.1).with_action(Action::drive(slide, 0, 0.5)).with_action(Action::drive(arm, 0, -0.25))).unwrap();
    let start = world.save();
    let target = |world: &World| match world.get::<LoopJoint>(slide).unwrap().dof().drive {
        Drive::Position { target, .. } => target,
        _ => f64::NAN,
    };
    run_to(&mut world, 0.1);
    run_to(&mut world, 2.0);
    assert!((position(&world, body).z - 0.5).abs() < 1e-3 && target(&world) == 0.5);
    assert!((position(&world, arm).x + 0.25).abs() < 1e-3);
    world.restore(&start).unwrap();
    run_to(&mut world, 0.05);
    assert!(position(&world, body).norm() < 1e-12 && target(&world) == 0.0);
    assert!(position(&world, arm).x.abs() < 1e-12);
}

#[test]
fn a_joint_holds_two_bodies_where_they_are() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 0.005));
        let a = world.add(ball("a", [0.0; 3]).with_angular_velocity(Vec3::new(0.0, 0.0, 1.0))).unwrap();
        let b = world.add(ball("b", [0.7, 0.0, 0.0]).with_velocity(Vec3::new(0.3, 0.2, 0.0))).unwrap();
        let sides = [a, b].map(|id| Anchor::on(id, 0, Pose::identity()));
        let joint = world.add(LoopJoint::new("bond", LoopJointKind::Fixed, sides[0], sides[1]).unwrap()).unwrap();
        world.set_enabled(joint, false).unwrap();
        let attach = Action::Attach { joint, here: true };
        world.add(at(0.5).with_action(attach)).unwrap();
        let off = ScriptedEvent::new("off", Trigger::Time { at: 1.5 }).with_action(Action::Disable(joint));
        world.add(off).unwrap();
        run_to(&mut world, 0.5);
        let relative = |world: &World| {
            let [a, b] = [a, b].map(|id| world.part_state(id, 0).unwrap().pose);
            a.inverse() * b
        };
        let (held, before) = (relative(&world), world.momentum());
        while world.time() < 1.5 - 1e-9 {
            world.step().unwrap();
            let off = held.inverse() * relative(&world);
            let error = off.translation.vector.norm() + off.rotation.angle();
            assert!(error < 1e-4, "{stepper}: {error} at {}", world.time());
        }
        let after = world.momentum();
        let (linear, angular) = ((after.linear - before.linear).norm(), (after.angular - before.angular).norm());
        // they meet at 0.4 m/s, and the half step to that moment is corrected: m·v·(v·h/2)
        assert!(linear < 1e-9 && angular < 2.0 * 0.4 * 0.4 * 0.0025, "{stepper}: {linear}, {angular}");
        let [pa, pb] = [a, b].map(|id| world.body(id).unwrap().position());
        let [va, vb] = [a, b].map(|id| world.body(id).unwrap().velocity());
        let straight = (pb - pa + (vb - va) * 1.0).norm();
        run_to(&mut world, 2.5);
        let distance = relative(&world).translation.vector.norm();
        assert!(straight > held.translation.vector.norm() + 1e-3, "{stepper}: they would part");
        assert!((distance - straight).abs() < 1e-6, "{stepper}: {distance}, free flight {straight}");
    }
}

#[test]
fn colors_lights_and_cameras_follow_the_latest_event() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let gate = RigidBody::fixed(cube(0.2)).with_name("gate").with_sensor(true);
    let gate = world.add_static(gate.with_pose(Pose::translation(0.5, 0.0, 0.0))).unwrap();
    let template = Template::add(&mut world, "shot", &ball("", [0.0; 3]), 1, true).unwrap();
    let shot = world.find("shot 1").unwrap();
    let spawn = Action::spawn(template, Pose::identity(), Vec3::x());
    let every = ScriptedEvent::new("spawn", Trigger::Every { period: 1.0, first: 0.1 });
    world.add(every.with_action(spawn)).unwrap();
    let red = Action::Recolor { body: Subject::Other, color: [1.0, 0.0, 0.0] };
    let enters = Trigger::Enters { sensor: gate, bodies: vec![shot] };
    world.add(ScriptedEvent::new("red", enters).with_action(red)).unwrap();
    let dark = LightChange { light: 0, intensity: Some(0.1), color: None };
    let view = CameraChange::Named("gate".into());
    world.add(at(0.3).with_action(Action::Light(dark)).with_action(Action::Camera(view.clone()))).unwrap();
    assert_eq!(world.looks(), Looks::default());
    run_to(&mut world, 0.35);
    let looks = world.looks();
    assert!(looks.colors.is_empty() && looks.lights[&0] == dark && looks.camera == Some(view));
    run_to(&mut world, 0.6); // 0.3 m from the gate's face
    assert_eq!(world.looks().colors[&shot], [1.0, 0.0, 0.0]);
    let at_0_6 = world.save();
    run_to(&mut world, 1.2);
    assert!(world.looks().colors.is_empty(), "spawned again");
    world.restore(&at_0_6).unwrap();
    assert_eq!(world.looks().colors[&shot], [1.0, 0.0, 0.0]);
}

/// Everything at once: spawns, bounces with recoloring, pushes, a path, a joint, chains and delays.
fn busy(threads: u32) -> World {
    let mut world = World::new(Settings::default().with_dt(1.0 / 120.0).with_threads(threads)).unwrap();
    let floor = ground(&mut world, 0.4, 0.5);
    let lift = RigidBody::fixed(cube(0.5)).with_name("lift");
    let lift = world.add_boxed(Box::new(lift.with_pose(Pose::translation(0.0, 0.0, 0.25))), Mode::Kinematic).unwrap();
    let template = Template::add(&mut world, "shot", &ball("", [0.0; 3]), 6, true).unwrap();
    let shots = world.get::<Template>(template).unwrap().bodies().to_vec();
    let sides = [Anchor::on(shots[0], 0, Pose::identity()), Anchor::on(shots[1], 0, Pose::identity())];
    let joint = world.add(LoopJoint::new("bond", LoopJointKind::Fixed, sides[0], sides[1]).unwrap()).unwrap();
    world.set_enabled(joint, false).unwrap();
    let keys = [(0.0, 0.25), (0.7, 0.9), (1.5, 0.25)];
    let keys = keys.map(|(time, z)| Keyframe { time, pose: Pose::translation(0.0, 0.0, z) });
    let path = Arc::new(Spline::new(keys.to_vec(), Smoothness::C2, Ends::Loop).unwrap());
    let event = |name: &str, trigger| ScriptedEvent::new(name, trigger);
    let add = |world: &mut World, event: ScriptedEvent| world.add(event).unwrap();
    let spawn = Action::spawn(template, Pose::translation(0.05, 0.02, 1.4), Vec3::new(0.4, 0.1, 0.0));
    let spawns = add(&mut world, event("spawns", Trigger::Every { period: 0.21, first: 0.1 }).with_action(spawn));
    add(&mut world, event("lifts", Trigger::Time { at: 0.3 }).with_action(Action::MoveAlong { body: lift, path }));
    let hits = Trigger::Contact { a: vec![floor], b: shots.clone(), impulse: 0.5 };
    let kick = Action::Push { body: Subject::Other, impulse: Vec3::new(0.0, 0.3, 2.0), point: None };
    let red = Action::Recolor { body: Subject::Other, color: [1.0, 0.2, 0.1] };
    add(&mut world, event("hits", hits).with_action(kick).with_action(red));
    let after = event("after", Trigger::Fired { event: spawns }).with_delay(0.33).with_times(4);
    add(&mut world, after.with_action(Action::Attach { joint, here: true }));
    add(&mut world, event("off", Trigger::Time { at: 1.6 }).with_action(Action::Disable(joint)));
    world
}

#[test]
fn events_are_part_of_the_state_to_the_bit_on_any_number_of_threads() {
    let mut one = busy(1);
    for k in 0..300 {
        one.step().unwrap();
        if [20, 70, 150].contains(&k) {
            let (start, bytes) = (one.save(), one.archive(&[]).unwrap());
            let mut copies = vec![one.fork(), World::from_archive(&bytes, &mut |_| None).unwrap()];
            assert_eq!(copies[1].archive(&[]).unwrap(), bytes);
            let mut end = one.fork();
            (0..60).for_each(|_| {
                end.step().unwrap();
            });
            let mut looks = vec![end.looks()];
            end.restore(&start).unwrap(); // back, over spawns and attachments
            copies.push(end);
            copies.push(busy(3));
            copies[3].restore(&start).unwrap();
            let saved: Vec<Vec<u8>> = copies
                .iter_mut()
                .map(|copy| {
                    (0..60).for_each(|_| {
                        copy.step().unwrap();
                    });
                    copy.save()
                })
                .collect();
            assert!(saved.iter().all(|s| *s == saved[0]), "after frame {k}");
            looks.extend([&copies[0], &copies[2]].map(World::looks));
            assert!(looks.iter().all(|l| *l == looks[0]));
        }
    }
    let fired = |name: &str| ScriptedEvent::fired(&one, one.find(name).unwrap()).unwrap();
    assert!(fired("spawns") == 12 && fired("hits") > 3 && fired("after") == 4 && fired("off") == 1);
    for threads in [2, 3] {
        let mut many = busy(threads);
        (0..300).for_each(|_| {
            many.step().unwrap();
        });
        assert_eq!(many.save(), one.save(), "{threads} threads");
    }
}

#[test]
fn a_failing_action_rolls_the_frame_back() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let ball = world.add(RigidBody::new(sphere(0.1)).with_mass(1e-200).with_gravity_scale(0.0)).unwrap();
    world.add(at(0.02).with_action(Action::push(ball, Vec3::new(1e300, 0.0, 0.0)))).unwrap();
    world.step().unwrap();
    let before = world.save();
    let error = world.step().unwrap_err();
    assert!(matches!(&error, StepError::Event { event, .. } if event == "event"), "{error}");
    assert_eq!(world.save(), before);
}

/// A static body takes no velocity: named, it is a fault of the event; met by a contact, it is left alone.
#[test]
fn a_static_body_takes_no_velocity_of_an_event() {
    let mut world = world("time_stepping", 0.01);
    ground(&mut world, 0.0, 0.0);
    let floor = world.ids()[0];
    let ball = world.add(ball("ball", [0.0, 0.0, 0.2])).unwrap();
    let kick = |body| Action::SetVelocity { body, velocity: Vec3::z(), angular_velocity: Vec3::zeros() };
    let refused = world.add(at(1.0).with_action(kick(Subject::Part(floor, 0)))).unwrap_err().to_string();
    assert!(refused.contains("is not dynamic or kinematic; a static body has no velocity"), "{refused}");
    let hit = |name: &str, a, b| {
        let trigger = Trigger::Contact { a: vec![a], b: vec![b], impulse: 0.0 };
        ScriptedEvent::new(name, trigger).with_times(1).with_action(kick(Subject::Other))
    };
    let ids = [hit("meets floor", ball, floor), hit("meets ball", floor, ball)].map(|event| world.add(event).unwrap());
    while ScriptedEvent::fired(&world, ids[1]) == Some(0) {
        world.step().unwrap();
    }
    assert_eq!(ScriptedEvent::fired(&world, ids[0]), Some(1));
    assert_eq!((velocity(&world, ball), velocity(&world, floor)), (Vec3::z(), Vec3::zeros()));
}

#[test]
fn what_was_removed_is_left_alone() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let [gone, kept] = ["gone", "kept"].map(|name| world.add(ball(name, [0.0, 0.0, name.len() as f64])).unwrap());
    let kept_z = position(&world, kept).z;
    world.add(at(0.02).with_action(Action::push(gone, Vec3::x())).with_action(Action::push(kept, Vec3::x()))).unwrap();
    drop(world.remove(gone).unwrap());
    let bytes = world.archive(&[]).unwrap();
    run_to(&mut world, 0.03);
    assert!(velocity(&world, kept).x == 0.5 && position(&world, kept).z == kept_z);
    let mut read = World::from_archive(&bytes, &mut |_| None).unwrap();
    run_to(&mut read, 0.03);
    assert_eq!(read.save(), world.save());
}

#[test]
fn wrong_events_are_refused_with_the_reason() {
    let mut world = World::default();
    let ball = world.add(ball("ball", [0.0; 3])).unwrap();
    let mut other = World::default();
    let strange = [other.add(RigidBody::new(sphere(0.1))), other.add(RigidBody::new(sphere(0.1)))][1].clone().unwrap();
    let path = [0.0, 1.0].map(|time| Keyframe { time, pose: Pose::identity() });
    let path = Arc::new(Spline::new(path.to_vec(), Smoothness::C1, Ends::Rest).unwrap());
    let push = Action::push(ball, Vec3::x());
    let nan = Vec3::repeat(f64::NAN);
    let cases = [
        (at(0.0), "the time of an event is 0; expected above 0"),
        (at(1.0).with_delay(-1.0), "the delay is -1; expected at least 0"),
        (at(1.0).with_times(0), "the number of firings is 0; expected at least 1"),
        (at(1.0).with_action(Action::push(strange, Vec3::x())), "a body of an event is not in the world"),
        (
            at(1.0).with_action(Action::push(ball, nan)),
            "an impulse has a number that is not finite or out of its range",
        ),
        (at(1.0).with_action(Action::Remove(Subject::Other)), "the other body of a trigger that has none"),
        (at(1.0).with_action(Action::MoveAlong { body: ball, path }), "'ball' is not kinematic"),
        (at(1.0).with_action(Action::drive(ball, 0, 1.0)), "'ball' is not a body or joint with a drive"),
        (at(1.0).with_action(Action::spawn(ball, Pose::identity(), Vec3::x())), "'ball' is not a template"),
        (at(1.0).with_action(Action::recolor(ball, [2.0, 0.0, 0.0])), "a color has a number"),
        (at(1.0).with_action(Action::Attach { joint: ball, here: true }), "'ball' is not a loop joint"),
        (ScriptedEvent::new("event", Trigger::Enters { sensor: ball, bodies: vec![] }), "'ball' is not a sensor"),
        (ScriptedEvent::new("event", Trigger::Key { key: String::new() }).with_action(push), "the name of a key is 0"),
        (ScriptedEvent::new("event", Trigger::Fired { event: ball }), "'ball' is not an event"),
        (
            ScriptedEvent::new("event", Trigger::Contact { a: vec![ball], b: vec![], impulse: 0.0 })
                .with_action(Action::Recolor { body: Subject::Other, color: [0.0; 3] }),
            "only a trigger with a list of bodies can recolor the other one",
        ),
    ];
    for (event, why) in cases {
        let error = world.add(event).unwrap_err().to_string();
        assert!(error.starts_with(&format!("event 'event': {why}")), "{error}");
    }
    assert_eq!(world.ids().len(), 1);
    let error = Template::add(&mut world, "shot", &RigidBody::new(sphere(0.1)), 0, false).unwrap_err();
    assert_eq!(error.to_string(), "event 'shot': a template has 0 bodies; expected 1 to 10000");
    world.add(RigidBody::new(sphere(0.1)).with_name("shot 3")).unwrap();
    Template::add(&mut world, "shot", &RigidBody::new(sphere(0.1)), 5, false).unwrap_err();
    assert_eq!(world.ids().len(), 2, "nothing is left of it");
}
