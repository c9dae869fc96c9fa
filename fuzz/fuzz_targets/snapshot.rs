//! A snapshot: refused without a change, or restored; then the world steps and saves.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_core::collide::{Pose, Shape};
use tumble_core::{RigidBody, Settings, World};

/// Returns the world that `seeds/snapshot` was saved from: a ball on the ground.
fn world() -> World {
    let mut world = World::new(Settings::default()).expect("the default settings are sound");
    world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).expect("a new name");
    let ball = RigidBody::new(Shape::sphere(0.1).expect("a radius")).with_name("ball").with_mass(1.0);
    world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.1))).expect("a new name");
    world
}

fuzz_target!(|bytes: &[u8]| {
    let mut world = world();
    let before = world.save();
    if world.restore(bytes).is_err() {
        assert!(world.save() == before, "a snapshot that is refused changes nothing");
        return;
    }
    let _ = world.step();
    assert!(!world.save().is_empty());
});
