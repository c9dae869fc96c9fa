//! An object list or a state, applied to a world: applied whole, or refused without a change.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_core::collide::{Pose, Shape};
use tumble_core::{RigidBody, Settings, World};
use tumble_net::sync::{Mirror, Publisher, Viewer};

fn world() -> World {
    let mut world = World::new(Settings::default()).expect("the default settings are sound");
    world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).expect("a new name");
    let ball = RigidBody::new(Shape::sphere(0.1).expect("a radius")).with_name("ball").with_mass(1.0);
    world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.1))).expect("a new name");
    world
}

fuzz_target!(|bytes: &[u8]| {
    let (base, mut publisher) = (world(), Publisher::new(&world(), false, 0));
    let published = publisher.publish(&base, &Viewer::default(), 1).expect("a sound world");
    let mut mirror = Mirror::new(base);
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
