//! Saving, forking, removing, disabling: all changing data are in the world.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

fn messy(stepper: &str) -> World {
    let mut world = world(stepper, 1.0 / 60.0);
    ground(&mut world, 0.3, 0.4);
    for i in 0..12 {
        let shape = if i % 2 == 0 { sphere(0.2) } else { cube(0.35) };
        let body = RigidBody::new(shape)
            .with_name(format!("body{i}"))
            .with_mass(1.0 + i as f64)
            .with_material(Material { restitution: 0.3, friction: 0.4, ..Material::default() });
        let pose = Pose::translation(0.05 * (i % 3) as f64, 0.04 * (i % 4) as f64, 0.4 + 0.45 * i as f64);
        world.add(body.with_pose(pose).with_angular_velocity(Vec3::new(0.3 * i as f64, 1.0, 0.2))).unwrap();
    }
    world
}

fn run(world: &mut World, frames: usize) {
    (0..frames).for_each(|_| {
        world.step().unwrap();
    });
}

fn bits(world: &World) -> Vec<u64> {
    world.state().iter().map(|x| x.to_bits()).collect()
}

#[test]
fn two_runs_give_the_same_bits() {
    for stepper in STEPPERS {
        let (mut a, mut b) = (messy(stepper), messy(stepper));
        for frame in 0..90 {
            run(&mut a, 1);
            run(&mut b, 1);
            assert_eq!(bits(&a), bits(&b), "{stepper}: frame {frame}");
        }
    }
}

#[test]
fn save_run_restore_run_gives_the_same_bytes() {
    for stepper in STEPPERS {
        let mut world = messy(stepper);
        run(&mut world, 45);
        assert!(!world.contacts().is_empty(), "saved in mid-contact");
        let saved = world.save();
        run(&mut world, 45);
        let expected = world.save();
        let mut other = messy(stepper);
        other.restore(&saved).unwrap();
        run(&mut other, 45);
        assert!(other.save() == expected, "{stepper}: a restored world goes another way");
        let mut forked = messy(stepper);
        run(&mut forked, 45);
        let mut forked = forked.fork();
        run(&mut forked, 45);
        assert!(forked.save() == expected, "{stepper}: a forked world goes another way");
    }
}

#[test]
fn a_damaged_or_foreign_snapshot_is_refused_and_changes_nothing() {
    let mut world = messy("time_stepping");
    run(&mut world, 20);
    let saved = world.save();
    for cut in 0..saved.len() {
        assert!(world.restore(&saved[..cut]).is_err(), "cut at {cut}");
    }
    let before = bits(&world);
    let mut other = crate::common::world("time_stepping", 1.0 / 60.0);
    ground(&mut other, 0.0, 0.0);
    assert!(matches!(other.restore(&saved), Err(SnapshotError::Objects { index: 1, .. })));
    assert_eq!(bits(&world), before);
}

#[test]
fn objects_come_and_go_in_mid_run() {
    let mut world = messy("time_stepping");
    run(&mut world, 30);
    let gone = world.find("body5").unwrap();
    world.remove(gone).unwrap();
    assert!(world.object(gone).is_none() && world.part_state(gone, 0).is_none());
    assert!(matches!(world.set_mode(gone, Mode::Static), Err(WorldError::Stale)));
    let added = world
        .add(RigidBody::new(sphere(0.1)).with_name("late").with_mass(1.0).with_pose(Pose::translation(3.0, 0.0, 1.0)))
        .unwrap();
    assert_ne!(gone, added);
    run(&mut world, 120);
    assert!((position(&world, added).z - 0.1).abs() < 1e-6, "the late one landed");
    assert!(matches!(world.add(RigidBody::fixed(sphere(1.0)).with_name("late")), Err(WorldError::DuplicateName(_))));
}

#[test]
fn bodies_that_came_and_went_leave_no_trace_in_a_fork() {
    for stepper in STEPPERS {
        let mut world = messy(stepper);
        // the broad phase has cached bodies that are now removed, disabled or elsewhere; forks and
        // restored worlds begin without its cache
        let mut copies: Vec<World> = Vec::new();
        let mut contacts = 0;
        for frame in 0..60 {
            if frame % 5 == 0 {
                let gone = world.find(&format!("body{}", frame / 5)).unwrap();
                if frame % 10 == 0 {
                    world.remove(gone).map(drop).unwrap()
                } else {
                    world.set_collidable(gone, false).unwrap()
                }
                let place = Pose::translation(0.1 * (frame % 3) as f64, 0.0, 1.0 + 0.1 * frame as f64);
                world
                    .add(
                        RigidBody::new(cube(0.3))
                            .with_name(format!("late{frame}"))
                            .with_mass(2.0)
                            .with_material(Material { restitution: 0.2, friction: 0.4, ..Material::default() })
                            .with_pose(place),
                    )
                    .unwrap();
                copies = vec![world.fork(), world.fork()];
                let saved = world.save();
                run(&mut copies[1], 1);
                copies[1].restore(&saved).unwrap();
            }
            run(&mut world, 1);
            contacts += world.contacts().len();
            for copy in &mut copies {
                run(copy, 1);
                assert_eq!(bits(&world), bits(copy), "{stepper}: frame {frame}");
            }
        }
        assert!(contacts > 200, "{stepper}: only {contacts} contacts were met");
    }
}

#[test]
fn a_kinematic_body_follows_its_motion_and_pushes() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 60.0);
        ground(&mut world, 0.0, 0.0);
        let pusher = RigidBody::fixed(cube(0.4))
            .with_name("pusher")
            .with_material(Material { friction: 0.0, ..Material::default() })
            .with_pose(Pose::translation(-1.0, 0.0, 0.2));
        let pusher = world.add(pusher).unwrap();
        world.set_mode(pusher, Mode::Kinematic).unwrap();
        world.set_velocity(pusher, Vec3::new(2.0, 0.0, 0.0), Vec3::zeros()).unwrap();
        let ball = RigidBody::new(cube(0.2))
            .with_name("box")
            .with_mass(3.0)
            .with_material(Material { friction: 0.0, ..Material::default() })
            .with_pose(Pose::translation(0.0, 0.0, 0.1));
        let ball = world.add(ball).unwrap();
        run(&mut world, 60);
        assert!((position(&world, pusher).x - 1.0).abs() < 1e-9, "{stepper}: pusher at {}", position(&world, pusher).x);
        assert!((position(&world, ball).x - 1.3).abs() < 1e-5, "{stepper}: pushed to {}", position(&world, ball).x);
        let target = Pose::new(Vec3::new(0.5, 0.5, 0.7), Vec3::new(0.0, 0.3, 1.0));
        world.move_to(pusher, target).unwrap();
        run(&mut world, 1);
        let reached = world.part_state(pusher, 0).unwrap().pose;
        assert!(
            (reached.inverse() * target).translation.vector.norm() < 1e-12
                && reached.rotation.angle_to(&target.rotation) < 1e-7
        );
    }
}

#[test]
fn switches_take_a_body_out_and_back_in() {
    let mut world = world("time_stepping", 1.0 / 60.0);
    ground(&mut world, 0.0, 0.5);
    let id = world
        .add(RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0).with_pose(Pose::translation(0.0, 0.0, 0.1)))
        .unwrap();
    world.set_collidable(id, false).unwrap();
    run(&mut world, 60);
    assert!((position(&world, id).z - (0.1 - 0.5 * G)).abs() < 1e-9, "falls through");
    world.set_enabled(id, false).unwrap();
    let there = position(&world, id);
    run(&mut world, 60);
    assert_eq!(position(&world, id), there, "stands still");
}

#[test]
fn user_forces_act_for_one_frame_and_impulses_at_once() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let id = world.add(RigidBody::new(sphere(0.5)).with_name("ball").with_mass(2.0)).unwrap();
    world.apply_force(id, 0, Vec3::new(4.0, 0.0, 0.0), &Vec3::new(0.0, 0.5, 0.0)).unwrap();
    run(&mut world, 2);
    assert!((velocity(&world, id).x - 0.02).abs() < 1e-14);
    // τ = r × f = (0, 0.5, 0) × (4, 0, 0) = (0, 0, −2); I = 2/5·2·0.25 = 0.2
    assert!((world.part_state(id, 0).unwrap().angular_velocity.z + 0.1).abs() < 1e-12);
    world.apply_impulse(id, 0, Vec3::new(0.0, 1.0, 0.0), &position(&world, id)).unwrap();
    assert!((velocity(&world, id).y - 0.5).abs() < 1e-14);
    assert!(world.apply_force(id, 0, Vec3::new(f64::NAN, 0.0, 0.0), &Vec3::zeros()).is_err());
}

#[test]
fn a_state_that_is_not_finite_is_reported_with_its_object() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let id = world.add(RigidBody::new(sphere(0.5)).with_name("ball").with_mass(2.0)).unwrap();
    world.apply_force(id, 0, Vec3::new(f64::MAX, f64::MAX, 0.0), &Vec3::new(f64::MAX, 0.0, 0.0)).unwrap();
    let error = world.step().unwrap_err();
    assert!(error.to_string().contains("'ball'"), "{error}");
}

#[test]
fn kinds_that_do_not_meet_pass_through_each_other() {
    let mut world = no_gravity(world("time_stepping", 1.0 / 60.0));
    let ghost = CollisionGroup::new(5).unwrap();
    let mut add = |name: &str, x: f64, v: f64, group: CollisionGroup, mask: u64| {
        let mut body = RigidBody::new(sphere(0.5)).with_name(name).with_mass(1.0).with_material(Material {
            restitution: 1.0,
            friction: 0.0,
            ..Material::default()
        });
        (body.group, body.mask) = (group, mask);
        world.add(body.with_pose(Pose::translation(x, 0.0, 0.0)).with_velocity(Vec3::new(v, 0.0, 0.0))).unwrap()
    };
    let solid = CollisionGroup::default();
    let ids = [
        add("a", -2.0, 1.0, solid, !ghost.bit()),
        add("ghost", 0.0, 0.0, ghost, u64::MAX),
        add("b", 2.0, -1.0, solid, u64::MAX),
    ];
    run(&mut world, 180);
    // b collides with the ghost at t = 1 s, x = 1 and stops; the ghost flies off at -1 m/s through
    // a; a collides with b at t = 2 s, x = 0 and stops.
    let x: Vec<f64> = ids.iter().map(|id| position(&world, *id).x).collect();
    assert!(x.iter().zip([0.0, -2.0, 2.0]).all(|(x, e)| (x - e).abs() < 1e-9), "{x:?}");
    assert!(CollisionGroup::new(64).is_none());
}

#[test]
fn a_body_in_another_process_is_kept_in_step_by_messages() {
    let mut world = messy("time_stepping");
    run(&mut world, 40);
    let mut replica = messy("time_stepping");
    for (&theirs, &ours) in world.ids().iter().zip(replica.ids().to_vec().iter()) {
        let (view, mut message) = (world.view(), Vec::new());
        world.object(theirs).unwrap().net_sync().unwrap().get_data(
            view.state_range(theirs).unwrap(),
            &view,
            &mut message,
        );
        let mut x = replica.state_of(ours).unwrap().to_vec();
        let sync = replica.object(ours).unwrap().net_sync().unwrap();
        assert_eq!(sync.read_data(&message[1..], &mut x), Err(SyncError::Length { got: 103, expected: 104 }));
        let mut bad = message.clone();
        bad[24..32].copy_from_slice(&f64::NAN.to_le_bytes());
        assert_eq!(sync.read_data(&bad, &mut x), Err(SyncError::Value));
        sync.read_data(&message, &mut x).unwrap();
        replica.write_state_of(ours, &x).unwrap();
    }
    assert_eq!(bits(&world), bits(&replica));
}

/// `|L·v|² = vᵀMv = 2T` at either state, whichever was refreshed last; `T` is summed over the
/// links.
#[test]
fn two_states_of_one_object_exist_at_once() {
    let rod =
        LinkMass { mass: 2.0, center: Vec3::new(0.0, 0.1, -0.5), inertia: tumble_core::collide::Mat3::identity() };
    let mut builder = ModelBuilder::new();
    let upper = builder.link("upper", None, Joint::revolute(Vec3::y()), Pose::identity(), rod);
    builder.link("lower", Some(upper), Joint::revolute(Vec3::x()), Pose::translation(0.0, 0.0, -1.0), rod);
    let arm = ArticulatedBody::new("arm", builder.build().unwrap());
    let body = arm.integratable().unwrap();
    let states = [[0.3, -0.4, 1.0, 2.0], [1.2, 0.9, -1.5, 0.5]];
    let mut caches = [arm.new_cache(), arm.new_cache()];
    let mut part_states = vec![PartState::default(); body.state_sizes().parts];
    for (x, cache) in states.iter().zip(&mut caches) {
        arm.refresh(x, cache, &mut part_states);
    }
    for (x, cache) in states.iter().zip(&mut caches) {
        let mut u = [0.0; 2];
        body.whitened_velocity(cache, x, &mut u);
        let twice = 2.0 * body.energy(x, &Vec3::zeros()).kinetic;
        let sum: f64 = u.iter().map(|u| u * u).sum();
        assert!((sum - twice).abs() < 1e-12 * twice, "{sum} and {twice} at {x:?}");
    }
}

/// `move_to` of a body that is moved by forces would throw it.
#[test]
fn only_kinematic_bodies_are_moved_to_a_pose() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    let ball = world.add(RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0)).unwrap();
    let wall = world.add(RigidBody::fixed(cube(1.0)).with_name("wall").with_pose(Pose::translation(5.0, 0.0, 0.0)));
    let (wall, before) = (wall.unwrap(), bits(&world));
    for (id, name, mode, word) in [(ball, "ball", Mode::Dynamic, "dynamic"), (wall, "wall", Mode::Static, "static")] {
        let refused = world.move_to(id, Pose::translation(1.0, 0.0, 0.0)).unwrap_err();
        assert_eq!(refused, WorldError::NotKinematic { name: name.into(), mode });
        assert!(refused.to_string().starts_with(&format!("body '{name}' is {word}, and move_to is for kinematic")));
        assert_eq!(bits(&world), before);
        world.set_mode(id, Mode::Kinematic).unwrap();
        world.move_to(id, Pose::translation(1.0, 0.0, 0.0)).unwrap();
        world.set_velocity(id, Vec3::zeros(), Vec3::zeros()).unwrap();
        world.set_mode(id, mode).unwrap();
    }
}

#[test]
fn a_static_body_takes_no_velocity() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    let wall = world.add(RigidBody::fixed(cube(1.0)).with_name("wall")).unwrap();
    for [velocity, spin] in [[Vec3::x(), Vec3::zeros()], [Vec3::zeros(), Vec3::z()]] {
        assert_eq!(world.set_velocity(wall, velocity, spin), Err(WorldError::Static("wall".into())));
    }
    world.set_velocity(wall, Vec3::zeros(), Vec3::zeros()).unwrap();
    world.set_mode(wall, Mode::Kinematic).unwrap();
    world.set_velocity(wall, Vec3::x(), Vec3::zeros()).unwrap();
}
