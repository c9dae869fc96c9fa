//! States that follow the world.

use crate::steps;
use tumble_core::prelude::*;
use tumble_core::{Frame, FrameImpulse, FrameState, Sleep, StateRange};

/// Counts frames in `x[0]`, sums `z` of a body at their ends in `x[1]`, and pushes the body upwards in one frame.
#[derive(Clone)]
struct Counter {
    body: ObjectId,
    push_at: f64,
    breaks_at: f64,
}

impl Object for Counter {
    fn frame_state(&self) -> Option<&dyn FrameState> {
        Some(self)
    }
}

impl FrameState for Counter {
    fn len(&self) -> usize {
        2
    }
    fn advance(&self, me: &StateRange, frame: &Frame, x: &mut [f64], out: &mut Vec<FrameImpulse>) {
        assert_eq!(frame.view.x[me.x.clone()], *x, "the view shows the state at the start");
        let Some(state) = frame.view.part_state(self.body, 0) else { return };
        x[0] += 1.0;
        x[1] += state.position().z;
        if x[0] == self.push_at {
            let impulse = Vec3::new(0.0, 0.0, 2.0);
            out.push(FrameImpulse { id: self.body, part: 0, impulse, point: state.position() });
        }
        if x[0] == self.breaks_at {
            x[1] = f64::NAN;
        }
    }
}

fn world(push_at: f64, breaks_at: f64) -> (World, ObjectId, ObjectId) {
    let mut world = World::default();
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(0.5);
    let ball = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.1))).unwrap();
    let counter = world.add(Counter { body: ball, push_at, breaks_at }).unwrap();
    (world, ball, counter)
}

#[test]
fn a_frame_state_advances_once_per_frame_and_is_saved_and_forked() {
    let (mut world, _, counter) = world(1e9, 1e9);
    world.set_settings(world.settings().with_substeps(4)).unwrap();
    steps(&mut world, 10);
    assert_eq!(world.state_of(counter).unwrap()[0], 10.0);
    let (saved, mut fork) = (world.save(), world.fork());
    steps(&mut world, 5);
    steps(&mut fork, 5);
    assert!(world.save() == fork.save());
    world.restore(&saved).unwrap();
    assert_eq!(world.state_of(counter).unwrap()[0], 10.0);
    world.set_enabled(counter, false).unwrap();
    steps(&mut world, 5);
    assert_eq!(world.state_of(counter).unwrap()[0], 10.0);
    world.write_state_of(counter, &[3.0, 0.0]).unwrap();
    assert!(world.write_state_of(counter, &[f64::NAN, 0.0]).is_err());
    assert!(world.write_state_of(counter, &[1.0]).is_err());
    assert_eq!(world.state_of(counter).unwrap(), [3.0, 0.0]);
}

#[test]
fn its_impulses_act_at_the_end_of_the_frame() {
    let (mut world, ball, _) = world(3.0, 1e9);
    steps(&mut world, 2);
    assert!(world.body(ball).unwrap().velocity().norm() < 1e-9);
    steps(&mut world, 1);
    assert!((world.body(ball).unwrap().velocity() - 4.0 * Vec3::z()).norm() < 1e-9, "2 N·s on 0.5 kg");
}

#[test]
fn an_impulse_wakes_a_sleeper() {
    let (mut world, ball, counter) = world(400.0, 1e9);
    world.set_settings(world.settings().with_sleep(Some(Sleep::default()))).unwrap();
    steps(&mut world, 399);
    assert!(world.asleep(ball));
    steps(&mut world, 1);
    assert!(!world.asleep(ball) && (world.body(ball).unwrap().velocity().z - 4.0).abs() < 1e-6);
    assert_eq!(world.state_of(counter).unwrap()[0], 400.0, "the repeated frame counts once");
}

#[test]
fn a_state_that_is_not_finite_fails_the_frame_and_leaves_the_world() {
    let (mut world, _, _) = world(5.0, 5.0);
    steps(&mut world, 4);
    let saved = world.save();
    assert!(matches!(world.step(), Err(StepError::NotFinite { what: "its state", .. })));
    assert!(world.save() == saved);
}

#[test]
fn it_moves_up_when_an_object_before_it_is_removed() {
    let (mut world, ball, counter) = world(1e9, 1e9);
    steps(&mut world, 3);
    world.remove(ball).unwrap();
    steps(&mut world, 3);
    assert_eq!(world.state_of(counter).unwrap()[0], 3.0, "its body is gone");
}
