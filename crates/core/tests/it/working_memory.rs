//! Working memory that worlds use in turn: it changes no bit, and a world without any can do
//! everything.

use crate::articulated_world::{loose_chain, world};
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

/// Returns a world with a chain and a ball that fall on the ground.
fn falling(stepper: &'static str) -> (World, ObjectId, ObjectId) {
    let mut world = world(1.0 / 120.0, stepper, Integrator::Verlet);
    world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
    let model = loose_chain(4, Vec3::zeros(), 0.0).model().clone();
    let mut chain = ArticulatedBody::new("chain", model).with_pose(Pose::translation(0.0, 0.0, 0.15));
    chain.self_collision = false;
    for i in 0..4 {
        chain
            .add_collider(&format!("link {i}"), Collider::new(Shape::sphere(0.05).unwrap(), Pose::identity()))
            .unwrap();
    }
    let chain = world.add(chain).unwrap();
    let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("ball");
    let ball = world.add(ball.with_pose(Pose::translation(1.0, 0.0, 0.12))).unwrap();
    (world, chain, ball)
}

#[test]
fn worlds_that_share_memory_move_as_they_would_alone() {
    for stepper in ["time_stepping", "backtracking"] {
        let (world, _, ball) = falling(stepper);
        let mut alone: Vec<World> = (0..3).map(|_| world.fork()).collect();
        let mut sharing: Vec<World> = (0..3).map(|_| world.fork()).collect();
        for (k, world) in (0u8..).zip(alone.iter_mut().zip(&mut sharing)) {
            for world in [world.0, world.1] {
                world.set_velocity(ball, Vec3::new(f64::from(k), 0.0, 0.0), Vec3::zeros()).unwrap();
            }
        }
        let mut memory = WorkingMemory::default();
        for _ in 0..40 {
            for (alone, sharing) in alone.iter_mut().zip(&mut sharing) {
                alone.step().unwrap();
                sharing.lend_working_memory(&mut memory);
                sharing.step().unwrap();
                sharing.return_working_memory(&mut memory);
                assert_eq!(alone.save(), sharing.save(), "{stepper}");
                assert_eq!(alone.part_states(), sharing.part_states());
            }
        }
        assert!(alone.iter().all(|world| !world.contacts().is_empty()));
    }
}

#[test]
fn a_world_without_memory_can_do_everything() {
    let (mut world, chain, ball) = falling("time_stepping");
    world.step().unwrap();
    let mut bare = world.fork();
    let mut memory = WorkingMemory::default();
    type Call<'a> = (&'a str, &'a dyn Fn(&mut World));
    let calls: [Call; 7] = [
        ("impulse on the chain", &|w| w.apply_impulse(chain, 1, Vec3::x(), &Vec3::zeros()).unwrap()),
        ("state", &|w| {
            let x: Vec<f64> = w.state_of(chain).unwrap().iter().map(|x| x * 1.0).collect();
            w.write_state_of(chain, &x).unwrap()
        }),
        ("pose", &|w| w.set_pose(ball, Pose::translation(0.5, 0.0, 0.3)).unwrap()),
        ("mass", &|w| w.set_mass(ball, 2.0).unwrap()),
        ("snapshot", &|w| w.restore(&w.save()).unwrap()),
        ("another body", &|w| _ = w.add(RigidBody::new(Shape::sphere(0.1).unwrap())).unwrap()),
        ("one less", &|w| drop(w.remove(ball).unwrap())),
    ];
    for (name, call) in calls {
        bare.lend_working_memory(&mut memory);
        bare.return_working_memory(&mut memory);
        call(&mut bare);
        call(&mut world);
        assert_eq!(bare.save(), world.save(), "{name}");
        assert_eq!(bare.part_states(), world.part_states(), "{name}");
        bare.step().unwrap();
        world.step().unwrap();
        assert_eq!(bare.save(), world.save(), "{name}");
    }
    assert_eq!(bare.fork().save(), world.save());
}
