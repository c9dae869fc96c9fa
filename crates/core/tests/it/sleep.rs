//! Sleep: bodies at rest are left out of the step, and the world is otherwise the same as without
//! sleep.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

const H: f64 = 1.0 / 60.0;

fn sleepy(stepper: &str) -> World {
    let mut world = world(stepper, H);
    let settings = world.settings().with_sleep(Some(Sleep::default()));
    world.set_settings(settings).unwrap();
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

fn stack(world: &mut World, name: &str, x: f64, n: usize) -> Vec<ObjectId> {
    let body = |i| {
        RigidBody::new(cube(0.5))
            .with_name(format!("{name}{i}"))
            .with_mass(10.0)
            .with_material(Material { friction: 0.5, ..Material::default() })
    };
    (0..n).map(|i| world.add(body(i).with_pose(Pose::translation(x, 0.0, 0.25 + 0.5 * i as f64))).unwrap()).collect()
}

/// Returns a sleeping stack on the ground.
fn sleeping_stack(stepper: &str) -> (World, Vec<ObjectId>) {
    let mut world = sleepy(stepper);
    ground(&mut world, 0.0, 0.5);
    let ids = stack(&mut world, "box", 0.0, 3);
    run(&mut world, 60);
    assert!(ids.iter().all(|&id| world.asleep(id)), "{stepper}: still awake after a second: {:?}", world.report());
    (world, ids)
}

fn asleep(world: &World, ids: &[ObjectId]) -> usize {
    ids.iter().filter(|&&id| world.asleep(id)).count()
}

#[test]
fn a_stack_falls_asleep_and_costs_nothing() {
    for stepper in STEPPERS {
        let (mut world, _) = sleeping_stack(stepper);
        let (state, energy) = (bits(&world), world.energy());
        assert!(
            energy.kinetic == 0.0 && (energy.potential - 10.0 * G * (0.25 + 0.75 + 1.25)).abs() < 1e-3,
            "{energy:?}: sleepers keep their energy"
        );
        run(&mut world, 60);
        assert_eq!(bits(&world), state, "{stepper}: sleepers stay where they are");
        assert_eq!((world.report().contacts, world.report().iterations, world.report().asleep), (0, 0, 3), "{stepper}");
    }
}

/// In a world without gravity a sleeping ball has exactly its state: a strike gives the same bits.
#[test]
fn a_strike_on_sleepers_is_the_same_bits_as_on_the_waking() {
    for stepper in STEPPERS {
        let cradle = |sleep: Option<Sleep>| {
            let mut world = no_gravity(sleepy(stepper));
            let settings = world.settings().with_sleep(sleep);
            world.set_settings(settings).unwrap();
            let ball = |name: String| {
                RigidBody::new(sphere(0.1)).with_name(name).with_mass(1.0).with_material(Material {
                    restitution: 1.0,
                    friction: 0.3,
                    ..Material::default()
                })
            };
            let ids: Vec<ObjectId> = (0..5)
                .map(|i| {
                    world.add(ball(format!("ball{i}")).with_pose(Pose::translation(0.2 * i as f64, 0.0, 0.0))).unwrap()
                })
                .collect();
            world
                .add(ball("striker".into()).with_pose(Pose::translation(-2.1, 0.02, 0.0)).with_velocity(Vec3::x()))
                .unwrap();
            (world, ids)
        };
        let ((mut sleeping, ids), (mut waking, _)) = (cradle(Some(Sleep::default())), cradle(None));
        run(&mut sleeping, 90);
        run(&mut waking, 90);
        assert_eq!(asleep(&sleeping, &ids), 5, "{stepper}");
        for frame in 0..120 {
            run(&mut sleeping, 1);
            run(&mut waking, 1);
            assert_eq!(bits(&sleeping), bits(&waking), "{stepper}: frame {frame}");
        }
        assert!(velocity(&waking, ids[4]).x > 0.5, "{stepper}: the last ball never left");
    }
}

#[test]
fn only_the_island_that_is_struck_wakes() {
    for stepper in STEPPERS {
        let mut world = sleepy(stepper);
        ground(&mut world, 0.0, 0.5);
        let (left, right) = (stack(&mut world, "left", -2.0, 3), stack(&mut world, "right", 2.0, 3));
        run(&mut world, 60);
        assert_eq!((asleep(&world, &left), asleep(&world, &right)), (3, 3), "{stepper}");
        let ball = RigidBody::new(sphere(0.2)).with_name("ball").with_mass(5.0);
        world.add(ball.with_pose(Pose::translation(-4.0, 0.0, 0.25)).with_velocity(Vec3::new(6.0, 0.0, 0.0))).unwrap();
        run(&mut world, 40);
        assert_eq!((asleep(&world, &left), asleep(&world, &right)), (0, 3), "{stepper}");
    }
}

/// Every action of a user or a neighbor on sleeping bodies wakes all of them in the same frame.
#[test]
fn every_action_on_a_sleeping_body_wakes_its_island() {
    type Deed = (&'static str, fn(&mut World, &[ObjectId]));
    let deeds: [Deed; 10] = [
        ("a force", |w, ids| w.apply_force(ids[2], 0, Vec3::x(), &Vec3::zeros()).unwrap()),
        ("a torque", |w, ids| w.apply_torque(ids[2], 0, Vec3::x()).unwrap()),
        ("a generalized force", |w, ids| w.apply_generalized(ids[1], &[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]).unwrap()),
        ("an impulse", |w, ids| w.apply_impulse(ids[0], 0, Vec3::x(), &Vec3::zeros()).unwrap()),
        ("a velocity", |w, ids| w.set_velocity(ids[0], Vec3::x(), Vec3::zeros()).unwrap()),
        ("a pose", |w, ids| w.set_pose(ids[2], Pose::translation(0.0, 0.0, 3.0)).unwrap()),
        ("gravity", |w, _| {
            let settings = w.settings().with_gravity(Vec3::new(3.0, 0.0, -9.81));
            w.set_settings(settings).unwrap();
        }),
        ("the ground goes", |w, _| drop(w.remove(w.find("ground").unwrap()).unwrap())),
        ("one of them goes", |w, ids| drop(w.remove(ids[0]).unwrap())),
        ("the ground is put lower", |w, _| {
            w.set_pose(w.find("ground").unwrap(), Pose::translation(0.0, 0.0, -1.0)).unwrap()
        }),
    ];
    for stepper in STEPPERS {
        for (name, deed) in deeds {
            let (mut world, ids) = sleeping_stack(stepper);
            deed(&mut world, &ids);
            run(&mut world, 1);
            assert_eq!(asleep(&world, &ids), 0, "{stepper}: {name}");
        }
    }
}

/// A lift at rest supports sleeping bodies, and carries them along when it starts. A kinematic
/// pusher wakes them when it arrives.
#[test]
fn a_kinematic_body_wakes_bodies_that_it_carries_or_strikes() {
    for stepper in STEPPERS {
        let mut world = sleepy(stepper);
        let lift = world
            .add_boxed(
                Box::new(
                    RigidBody::new(cube(1.0))
                        .with_name("lift")
                        .with_mass(1.0)
                        .with_material(Material { friction: 0.5, ..Material::default() }),
                ),
                Mode::Kinematic,
            )
            .unwrap();
        let cargo = RigidBody::new(cube(0.5))
            .with_name("cargo")
            .with_mass(10.0)
            .with_material(Material { friction: 0.5, ..Material::default() });
        let cargo = world.add(cargo.with_pose(Pose::translation(0.0, 0.0, 0.75))).unwrap();
        run(&mut world, 60);
        assert!(world.asleep(cargo), "{stepper}");
        world.set_velocity(lift, Vec3::new(0.0, 0.0, 0.5), Vec3::zeros()).unwrap();
        run(&mut world, 60);
        assert!(
            !world.asleep(cargo) && (position(&world, cargo).z - 1.25).abs() < 1e-3,
            "{stepper}: {}",
            position(&world, cargo)
        );
        world.set_velocity(lift, Vec3::zeros(), Vec3::zeros()).unwrap();
        run(&mut world, 90);
        assert!(world.asleep(cargo), "{stepper}: not asleep again");
        let pusher = RigidBody::new(cube(0.4)).with_name("pusher").with_mass(1.0).with_pose(Pose::translation(
            -3.0,
            0.0,
            position(&world, cargo).z,
        ));
        let pusher = world.add_boxed(Box::new(pusher), Mode::Kinematic).unwrap();
        world.set_velocity(pusher, Vec3::new(2.0, 0.0, 0.0), Vec3::zeros()).unwrap();
        run(&mut world, 75);
        // 2.5 m from -3 puts its face at -0.3, and the cargo's is at -0.25: no touch yet. Then 0.3
        // m more.
        assert!(world.asleep(cargo), "{stepper}: woken without a touch");
        run(&mut world, 9);
        assert!(position(&world, cargo).x > 0.2, "{stepper}: the pusher went through: {}", position(&world, cargo));
    }
}

#[derive(Clone)]
struct Gust;

impl Object for Gust {
    fn name(&self) -> &str {
        "gust"
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Gust {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        let blows = if view.time > 2.0 { 80.0 } else { 1.0 };
        out.wrenches.iter_mut().skip(1).for_each(|w| w.force.x += blows);
    }
}

/// Bodies sleep under a constant force. A change of the force after 2 s wakes them, and drives them
/// as if they had never slept.
#[test]
fn a_force_that_changes_wakes_them_and_a_steady_one_does_not() {
    for stepper in STEPPERS {
        let blown = |sleep: Option<Sleep>| {
            let mut world = sleepy(stepper);
            let settings = world.settings().with_sleep(sleep);
            world.set_settings(settings).unwrap();
            ground(&mut world, 0.0, 0.5);
            let ids = stack(&mut world, "box", 0.0, 1);
            world.add(Gust).unwrap();
            run(&mut world, 100);
            let slept = world.asleep(ids[0]);
            run(&mut world, 80);
            (slept, position(&world, ids[0]).x)
        };
        let ((slept, x), (never, waking)) = (blown(Some(Sleep::default())), blown(None));
        assert!(slept && !never, "{stepper}");
        // 80 N against μ·m·g = 49 N for a second; a step in which the force changes may use the
        // friction of its start for all of it: μ·g·h for a second
        assert!(
            (waking - 0.5 * (8.0 - 0.5 * G)).abs() < 1.2 * 0.5 * G * H && (x - waking).abs() < 1e-6,
            "{stepper}: {x} m, and {waking} m without sleep"
        );
    }
}

/// A pendulum at its turning points, and a ball that rolls at a millimeter per second, do not fall
/// asleep.
#[test]
fn pausing_and_creeping_bodies_stay_awake() {
    for stepper in STEPPERS {
        let mut world = sleepy(stepper);
        ground(&mut world, 0.0, 0.5);
        let bob =
            RigidBody::new(sphere(0.1)).with_name("bob").with_mass(1.0).with_pose(Pose::translation(5.0, 0.3, 2.0));
        let bob = world.add(bob).unwrap();
        let hinge =
            LoopJoint::revolute_at("hinge", &world, Some((bob, 0)), None, Vec3::new(5.0, 0.0, 3.0), Vec3::x()).unwrap();
        world.add(hinge).unwrap();
        let roller = RigidBody::new(sphere(0.2))
            .with_name("roller")
            .with_mass(1.0)
            .with_material(Material { friction: 0.5, ..Material::default() })
            .with_pose(Pose::translation(0.0, 0.0, 0.2));
        let roller = world
            .add(roller.with_velocity(Vec3::new(1e-3, 0.0, 0.0)).with_angular_velocity(Vec3::new(0.0, 1e-3 / 0.2, 0.0)))
            .unwrap();
        for _ in 0..300 {
            run(&mut world, 1);
            assert!(!world.asleep(bob) && !world.asleep(roller), "{stepper} at {} s", world.time());
        }
        assert!((position(&world, roller).x - 5e-3).abs() < 1e-5, "{stepper}: {}", position(&world, roller).x);
    }
}

/// A chain that hangs from the world sleeps as one island, and a pull at its end wakes all of it.
#[test]
fn joints_hold_an_island_together() {
    let mut world = sleepy("time_stepping");
    let mut above: Option<(ObjectId, usize)> = None;
    let mut ids = Vec::new();
    for i in 0..4 {
        let rod = RigidBody::new(cube(0.2)).with_name(format!("rod{i}")).with_mass(1.0).with_pose(Pose::translation(
            0.0,
            0.0,
            -0.5 * i as f64,
        ));
        let id = world.add(rod).unwrap();
        let pin = LoopJoint::revolute_at(
            format!("pin{i}"),
            &world,
            Some((id, 0)),
            above,
            Vec3::new(0.0, 0.0, 0.25 - 0.5 * i as f64),
            Vec3::y(),
        )
        .unwrap();
        world.add(pin).unwrap();
        above = Some((id, 0));
        ids.push(id);
    }
    run(&mut world, 60);
    assert_eq!(asleep(&world, &ids), 4);
    let tip = position(&world, ids[3]);
    world.apply_force(ids[3], 0, Vec3::new(20.0, 0.0, 0.0), &tip).unwrap();
    run(&mut world, 30);
    assert_eq!(asleep(&world, &ids), 0);
    assert!(ids.iter().all(|&id| velocity(&world, id).norm() > 1e-3), "the pull did not reach the top");
}

#[test]
fn saved_and_forked_sleepers_wake_to_the_same_bytes() {
    for stepper in STEPPERS {
        let (mut world, ids) = sleeping_stack(stepper);
        let ball = RigidBody::new(sphere(0.2)).with_name("ball").with_mass(5.0);
        world.add(ball.with_pose(Pose::translation(-4.0, 0.1, 0.6)).with_velocity(Vec3::new(6.0, 0.0, 2.0))).unwrap();
        run(&mut world, 10);
        assert_eq!(asleep(&world, &ids), 3, "{stepper}");
        let (saved, mut fork) = (world.save(), world.fork());
        run(&mut world, 60);
        assert_eq!(asleep(&world, &ids), 0, "{stepper}");
        let after = world.save();
        world.restore(&saved).unwrap();
        assert_eq!(world.save(), saved, "{stepper}");
        run(&mut world, 60);
        run(&mut fork, 60);
        assert!(world.save() == after && fork.save() == after, "{stepper}");
    }
}

/// Adds a NaN force to a part of an awake object.
#[derive(Clone)]
struct Fault(ObjectId);

impl Object for Fault {
    fn name(&self) -> &str {
        "fault"
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Fault {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        let part = view.state_range(self.0).unwrap().parts.start;
        out.wrenches[part].force.x += if view.asleep(self.0) { 0.0 } else { f64::NAN };
    }
}

/// The ball wakes the stack within the failing frame, so the frame is repeated before it fails.
#[test]
fn a_step_that_fails_after_it_woke_sleepers_leaves_every_byte_as_it_was() {
    for stepper in STEPPERS {
        let (mut world, ids) = sleeping_stack(stepper);
        let roller = RigidBody::new(sphere(0.2)).with_name("roller").with_mass(1.0);
        world.add(roller.with_pose(Pose::translation(0.0, 5.0, 0.2)).with_velocity(Vec3::x())).unwrap();
        let ball = RigidBody::new(sphere(0.2)).with_name("ball").with_mass(5.0);
        let ball = ball.with_pose(Pose::translation(-4.0, 0.1, 0.6)).with_velocity(Vec3::new(6.0, 0.0, 2.0));
        let ball = world.add(ball).unwrap();
        let mut ahead = world.fork();
        while asleep(&ahead, &ids) == 3 {
            run(&mut ahead, 1);
        }
        let frames = (ahead.frame() - world.frame()) as usize;
        run(&mut world, frames - 1);
        let fault = world.add(Fault(ids[0])).unwrap();
        world.apply_force(ball, 0, Vec3::new(0.0, 1e-3, 0.0), &position(&world, ball)).unwrap();
        world.apply_generalized(ball, &[1e-3; 6]).unwrap();
        let mut twin = world.fork();
        let (before, contacts, report) = (world.save(), world.contacts().to_vec(), *world.report());
        assert!(asleep(&world, &ids) == 3 && !contacts.is_empty(), "{stepper}");
        for _ in 0..2 {
            let error = world.step().unwrap_err();
            assert!(matches!(&error, StepError::NotFinite { object, .. } if object == "box0"), "{stepper}: {error}");
            assert!(world.save() == before, "{stepper}: the state is another");
            assert!(
                world.contacts() == contacts && *world.report() == report && asleep(&world, &ids) == 3,
                "{stepper}"
            );
        }
        for world in [&mut world, &mut twin] {
            world.remove(fault).map(drop).unwrap();
            run(world, 30);
            assert_eq!(asleep(world, &ids), 0, "{stepper}");
        }
        assert!(world.save() == twin.save(), "{stepper}: after a failed step a world goes another way");
    }
}

#[test]
fn a_checkpoint_holds_sleep_and_is_refused_after_an_object_was_added() {
    for stepper in STEPPERS {
        let (mut world, ids) = sleeping_stack(stepper);
        let (mut checkpoint, before) = (WorldState::default(), world.save());
        world.checkpoint(&mut checkpoint);
        for _ in 0..2 {
            world.apply_impulse(ids[2], 0, Vec3::new(50.0, 0.0, 0.0), &position(&world, ids[2])).unwrap();
            run(&mut world, 30);
            assert!(asleep(&world, &ids) == 0 && world.save() != before, "{stepper}");
            assert!(world.roll_back(&checkpoint));
            assert!(world.save() == before && asleep(&world, &ids) == 3, "{stepper}");
        }
        world.add(RigidBody::new(sphere(0.2)).with_name("late").with_mass(1.0)).unwrap();
        let now = world.save();
        assert!(!world.roll_back(&checkpoint) && world.save() == now, "{stepper}");
    }
}

#[test]
fn a_joint_that_is_added_to_sleepers_wakes_them() {
    for stepper in STEPPERS {
        let (mut world, ids) = sleeping_stack(stepper);
        let top = Vec3::new(0.0, 0.0, 1.25);
        let place = JointPlace::between(top, top + Vec3::new(0.0, 0.0, 2.0));
        let mut spring =
            LoopJoint::joining("s", LoopJointKind::Spring, &world, Some((ids[2], 0)), None, place).unwrap();
        let dof = spring.dof().clone();
        let pulls = articulated::Spring { stiffness: 400.0, rest: 0.5 };
        spring.set_dof(articulated::DofSettings { spring: Some(pulls), ..dof }).unwrap();
        world.add(spring).unwrap();
        run(&mut world, 30);
        let height = world.part_state(ids[2], 0).unwrap().position().z;
        assert!(height > 1.3, "{stepper}: at {height} m, asleep: {}", world.asleep(ids[2]));
    }
}

#[test]
fn a_static_body_that_comes_into_a_sleeper_wakes_it() {
    for stepper in STEPPERS {
        let wedge = || RigidBody::new(cube(0.5)).with_name("wedge");
        let inside = Pose::translation(0.4, 0.0, 1.25);
        let (mut world, ids) = sleeping_stack(stepper);
        world.add_static(wedge().with_pose(inside)).unwrap();
        assert!(!world.asleep(ids[2]), "{stepper}: added");
        let (mut world, ids) = sleeping_stack(stepper);
        let far = world.add_static(wedge().with_pose(Pose::translation(40.0, 0.0, 1.25))).unwrap();
        assert!(world.asleep(ids[2]), "{stepper}: added far away");
        world.set_pose(far, inside).unwrap();
        assert!(!world.asleep(ids[2]), "{stepper}: moved");
        run(&mut world, 60);
        let x = world.part_state(ids[2], 0).unwrap().position().x;
        assert!(x < -0.05, "{stepper}: pushed to {x} m");
    }
}
