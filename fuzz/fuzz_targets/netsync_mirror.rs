//! An object list or a state, applied to a world: applied whole, or refused without a change. The world has sensors, and the
//! states have events.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_core::collide::{Pose, Shape};
use tumble_core::{Anchor, LoopJoint, LoopJointKind, RigidBody, Sensor, SensorKind, SensorNoise, Settings, World};
use tumble_net::sync::{Mirror, Publisher, Viewer};

fn world() -> World {
    let mut world = World::new(Settings::default()).expect("the default settings are sound");
    world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).expect("a new name");
    let ball = RigidBody::new(Shape::sphere(0.1).expect("a radius")).with_name("ball").with_mass(1.0);
    let ball = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.1))).expect("a new name");
    let at = Anchor::on(ball, 0, Pose::identity());
    let noise = SensorNoise { deviation: 0.1, bias_walk: 0.1, delay: 1, ..SensorNoise::default() };
    world.add(Sensor::new("felt", SensorKind::Touch, at).expect("a place")).expect("a new name");
    let imu = Sensor::new("imu", SensorKind::Accelerometer, at).and_then(|imu| imu.with_noise(noise));
    world.add(imu.expect("a place")).expect("a new name");
    let thread = LoopJoint::new("thread", LoopJointKind::Spherical, Anchor::world(Pose::translation(0.0, 0.0, 0.1)), at);
    let thread = thread.and_then(|thread| thread.with_breaking_force(1e-3));
    world.add(thread.expect("two sides")).expect("a new name");
    world
}

/// A world after two steps, in which the ball touches the ground and the joint has broken.
fn stepped() -> World {
    let mut world = world();
    (0..2).for_each(|_| _ = world.step());
    world
}

fuzz_target!(|bytes: &[u8]| {
    let (base, mut publisher) = (world(), Publisher::new(&world(), false, 0).with_events(16));
    let mut mirror = Mirror::new(base);
    let published = publisher.publish(&stepped(), &Viewer::default(), 1).expect("a sound world");
    mirror.apply_snapshot(&publisher.snapshot()).expect("its own list");
    mirror.apply_state(1, 0.0, &published.state).expect("its own state");
    let before = mirror.hash();
    assert!(
        mirror.apply_state(1, 0.0, bytes).is_ok() || mirror.hash() == before,
        "a state that is refused changes nothing"
    );
    let before = mirror.hash();
    assert!(mirror.apply_snapshot(bytes).is_ok() || mirror.hash() == before, "a list that is refused changes nothing");
});
