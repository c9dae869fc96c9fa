//! States that follow the world.

use crate::steps;
use tumble_core::prelude::*;
use tumble_core::{
    Cache, Frame, FrameImpulse, FrameState, Integratable, PartPoint, PartState, Sleep, StateRange, StateSizes,
    WorldError,
};

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

/// Pushes a body at several points in the first frame.
#[derive(Clone)]
struct Pushes(Vec<FrameImpulse>);

impl Object for Pushes {
    fn frame_state(&self) -> Option<&dyn FrameState> {
        Some(self)
    }
}

impl FrameState for Pushes {
    fn len(&self) -> usize {
        1
    }
    fn advance(&self, _me: &StateRange, _frame: &Frame, x: &mut [f64], out: &mut Vec<FrameImpulse>) {
        if x[0] == 0.0 {
            out.extend(&self.0);
        }
        x[0] = 1.0;
    }
}

fn floating_ball() -> (World, ObjectId) {
    let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
    let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("ball").with_mass(0.5);
    let ball = world.add(ball).unwrap();
    (world, ball)
}

#[test]
fn impulses_on_one_body_add_up() {
    let (mut world, ball) = floating_ball();
    let push = |impulse, point| FrameImpulse { id: ball, part: 0, impulse, point };
    let (x, y) = (Vec3::x(), Vec3::y());
    world.add(Pushes(vec![push(x, 0.1 * y), push(2.0 * y, Vec3::zeros()), push(-x, -0.1 * y)])).unwrap();
    steps(&mut world, 1);
    // 4 m/s along y; a torque of -0.2 N·m·s about z on 2/5·m·r²
    let body = world.body(ball).unwrap();
    assert!((body.velocity() - 4.0 * y).norm() < 1e-12, "{}", body.velocity());
    let spin = -0.2 / (0.4 * 0.5 * 0.01) * Vec3::z();
    assert!((body.angular_velocity() - spin).norm() < 1e-9, "{}", body.angular_velocity());
}

#[test]
fn impulses_that_leave_no_finite_state_fail_the_frame_and_name_the_body() {
    let (mut world, ball) = floating_ball();
    let push = FrameImpulse { id: ball, part: 0, impulse: 1e308 * Vec3::x(), point: Vec3::zeros() };
    world.add(Pushes(vec![push; 2])).unwrap();
    let saved = world.save();
    match world.step() {
        Err(StepError::NotFinite { object, what, .. }) => {
            assert_eq!((&*object, what), ("ball", "its state after impulses"))
        }
        other => panic!("{other:?}"),
    }
    assert!(world.save() == saved);
    let refused = world.apply_impulse(ball, 0, 1e308 * Vec3::x(), &Vec3::new(0.0, 1e300, 0.0));
    assert_eq!(refused, Err(WorldError::NotFinite("ball".into())));
    assert!(world.save() == saved);
}

/// A point on a line whose own frame state sets its velocity to 1 at the end of each frame.
#[derive(Clone)]
struct Pace;

impl Object for Pace {
    fn refresh(&self, x: &[f64], _cache: &mut Cache, part_states: &mut [PartState]) {
        part_states[0].pose = Pose::translation(x[0], 0.0, 0.0);
        part_states[0].velocity = x[1] * Vec3::x();
    }
    fn integratable(&self) -> Option<&dyn Integratable> {
        Some(self)
    }
    fn frame_state(&self) -> Option<&dyn FrameState> {
        Some(self)
    }
}

impl FrameState for Pace {
    fn len(&self) -> usize {
        2
    }
    fn advance(&self, _me: &StateRange, _frame: &Frame, x: &mut [f64], _out: &mut Vec<FrameImpulse>) {
        x[1] = 1.0;
    }
}

impl Integratable for Pace {
    fn state_sizes(&self) -> StateSizes {
        StateSizes { x: 2, dof: 1, parts: 1 }
    }
    fn write_initial(&self, x: &mut [f64]) {
        x.fill(0.0);
    }
    fn jacobian(&self, _cache: &mut Cache, at: &PartPoint, j: &mut [f64]) {
        j.iter_mut().zip(at.axes).for_each(|(j, axis)| *j += axis.x);
    }
    fn mul_l(&self, _cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        u.copy_from_slice(v);
    }
    fn solve_l(&self, _cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        v.copy_from_slice(u);
    }
    fn solve_lt(&self, _cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        y.copy_from_slice(j);
    }
    fn mul_lt(&self, _cache: &mut Cache, u: &[f64], j: &mut [f64]) {
        j.copy_from_slice(u);
    }
}

#[test]
fn part_states_follow_a_frame_state_that_moves_its_own_body() {
    let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
    let pace = world.add(Pace).unwrap();
    steps(&mut world, 1);
    assert_eq!(world.state_of(pace).unwrap()[1], 1.0);
    assert_eq!(world.part_state(pace, 0).unwrap().velocity, Vec3::x());
}
