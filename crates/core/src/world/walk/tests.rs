//! A world that leaves out what is settled moves bit for bit as its fork, which walks all objects in
//! every frame.

use super::Rest;
use crate::prelude::*;
use crate::{Anchor, EventKind, Forces, LoopJointKind, STEPPERS, Sleep, WorldState, WorldView, stepper_by_name};
use proptest::prelude::*;

const SIDE: usize = 6;

/// A grid of fixed blocks with a cube at rest on every other one, three falling balls, a hinged pendulum and a
/// kinematic paddle.
fn scene(stepper: &str, threads: u32) -> World {
    let mut settings = Settings::default().with_dt(1.0 / 60.0).with_threads(threads);
    settings.sleep = Some(Sleep::default());
    let mut world = World::new(settings).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    let block = Shape::cuboid(Vec3::repeat(1.0)).unwrap();
    let cube = Shape::cuboid(Vec3::repeat(0.4)).unwrap();
    for i in 0..SIDE * SIDE {
        let (x, y) = ((i % SIDE) as f64, (i / SIDE) as f64);
        world.add(RigidBody::fixed(block.clone()).with_pose(Pose::translation(x, y, -0.5))).unwrap();
        if i % 2 == 0 {
            world.add(RigidBody::new(cube.clone()).with_pose(Pose::translation(x, y, 0.2))).unwrap();
        }
    }
    for i in 0..3 {
        let height = 1.0 + 2.0 * i as f64;
        let pose = Pose::translation(0.3 + 1.7 * i as f64, 2.1, height);
        world.add(RigidBody::new(Shape::sphere(0.2).unwrap()).with_pose(pose)).unwrap();
    }
    let rod = RigidBody::new(cube.clone()).with_pose(Pose::translation(9.0, 0.0, 2.0));
    let rod = world.add(rod).unwrap();
    let sides = [Anchor::world(at(8.0, 0.0, 2.0)), Anchor::on(rod, 0, at(-1.0, 0.0, 0.0))];
    let [a, b] = sides;
    world.add(LoopJoint::new("pivot", LoopJointKind::Spherical, a, b).unwrap()).unwrap();
    let paddle =
        world.add(RigidBody::new(cube).with_name("paddle").with_pose(Pose::translation(-1.2, 0.0, 0.2))).unwrap();
    world.set_mode(paddle, Mode::Kinematic).unwrap();
    world
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

fn settled(world: &World) -> usize {
    let walk = &world.core.table.walk;
    walk.rest.iter().filter(|rest| matches!(rest, Rest::Settled { .. })).count()
}

/// Takes a frame, which must have the bits of that of a fork. Returns whether it succeeded.
fn step(world: &mut World) -> bool {
    let mut whole = world.fork();
    assert_eq!(settled(&whole), 0, "a fork walks everything in its first frame");
    let before = world.save();
    let (expected, done) = (whole.step().copied(), world.step().copied());
    assert_eq!(expected, done, "reports differ");
    assert!(world.save() == whole.save(), "states differ in frame {}", world.frame());
    assert_eq!(world.contacts(), whole.contacts());
    assert_eq!(world.events(), whole.events());
    assert_eq!(world.part_states(), whole.part_states());
    if done.is_err() {
        assert!(world.save() == before, "a failed frame changed the world");
        world.clear_applied();
    }
    done.is_ok()
}

fn run(world: &mut World, frames: usize) {
    (0..frames).for_each(|_| assert!(step(world)));
}

/// Changes of a world between frames.
fn change(world: &mut World, kind: u32, pick: usize, kept: &mut WorldState) {
    let ids: Vec<ObjectId> = world.ids().to_vec();
    let id = ids[pick % ids.len()];
    let up = Vec3::new(0.0, 0.0, 1.0);
    let is_body = world.get::<RigidBody>(id).is_some();
    match kind {
        0 => _ = world.apply_force(id, 0, 3000.0 * up, &Vec3::zeros()),
        1 => _ = world.apply_impulse(id, 0, up, &Vec3::zeros()),
        2 if is_body => {
            let pose = world.pose(id, 0).unwrap();
            world.set_pose(id, Pose::translation(0.0, 0.0, 0.3) * pose).unwrap();
        }
        3 => _ = world.remove(id),
        4 => {
            let pose = Pose::translation((pick % SIDE) as f64, (pick / SIDE % SIDE) as f64, 1.5);
            let ball = RigidBody::new(Shape::sphere(0.2).unwrap()).with_pose(pose);
            world.add(ball).unwrap();
        }
        5 if is_body => {
            let modes = [Mode::Static, Mode::Dynamic, Mode::Kinematic];
            world.set_mode(id, modes[pick % 3]).unwrap();
        }
        6 => {
            let on = world.status(id).unwrap().enabled;
            world.set_enabled(id, !on).unwrap();
        }
        7 => {
            let bytes = world.save();
            world.restore(&bytes).unwrap();
        }
        8 => world.checkpoint(kept),
        9 => _ = world.roll_back(kept),
        10 => *world = world.fork(),
        11 => {
            let pull =
                move |_: &WorldView, forces: &mut Forces| forces.wrenches.iter_mut().for_each(|w| w.force.x += 0.5);
            _ = world.add_force("pull", pull);
        }
        12 => _ = world.find("pull").map(|pull| world.remove(pull)),
        // a static body has none
        13 if is_body => _ = world.set_velocity(id, Vec3::new(1.0, 0.0, 0.0), Vec3::zeros()),
        14 if is_body => _ = world.set_mass(id, 0.5 + pick as f64),
        15 => _ = world.apply_force(id, 0, 1e306 * up, &Vec3::zeros()),
        16 => {
            let collidable = world.status(id).unwrap().collidable;
            world.set_collidable(id, !collidable).unwrap();
        }
        17 => {
            let mut settings = *world.settings();
            settings.gravity = Vec3::new(0.1 * (pick % 3) as f64, 0.0, -9.81);
            world.set_settings(settings).unwrap();
        }
        _ => world.clear_applied(),
    }
}

#[test]
fn what_rests_settles_and_wakes_with_the_same_bits() {
    for stepper in STEPPERS {
        for threads in [1, 2] {
            let mut world = scene(stepper, threads);
            run(&mut world, 5);
            assert_eq!(settled(&world), SIDE * SIDE, "{stepper}: the blocks are settled");
            run(&mut world, 60);
            let asleep = world.report().asleep as usize;
            assert!(asleep >= 15, "{stepper}: {asleep} cubes sleep");
            assert!(settled(&world) >= SIDE * SIDE + 15, "{stepper}: {} settled", settled(&world));
            // the paddle drives through a row of sleeping cubes
            let paddle = world.find("paddle").unwrap();
            world.set_velocity(paddle, Vec3::new(2.0, 0.0, 0.0), Vec3::zeros()).unwrap();
            let woken = (0..60).any(|_| step(&mut world) && world.events().iter().any(|e| e.kind == EventKind::Awake));
            assert!(woken, "{stepper}: the paddle wakes cubes");
            run(&mut world, 20);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_changes_leave_the_bits_of_a_walk_of_all_objects(
        which in 0..2usize, warm in 3..45usize, changes in prop::collection::vec((0..18u32, 0..100usize, 1..6usize), 1..14),
    ) {
        let mut world = scene(STEPPERS[which], 1);
        (0..warm).for_each(|_| _ = step(&mut world));
        prop_assert!(settled(&world) > 0);
        let mut kept = WorldState::default();
        world.checkpoint(&mut kept);
        for (kind, pick, frames) in changes {
            change(&mut world, kind, pick, &mut kept);
            (0..frames).for_each(|_| _ = step(&mut world));
        }
    }
}
