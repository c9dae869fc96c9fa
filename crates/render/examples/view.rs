//! A world made in code, in a window: a tower of blocks that a ball hits.
//!
//! ```sh
//! cargo run --release -p tumble-render --example view
//! ```

use tumble_core::prelude::*;
use tumble_render::{WindowOptions, view};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut world = World::default();
    world.add_static(RigidBody::fixed(Shape::half_space()))?;
    for k in 0..6 {
        let block = RigidBody::new(Shape::cuboid(Vec3::new(0.4, 0.4, 0.2))?).with_mass(1.0);
        world.add(block.with_pose(Pose::translation(0.0, 0.0, 0.1 + 0.2 * f64::from(k))))?;
    }
    let ball = RigidBody::new(Shape::sphere(0.15)?).with_mass(2.0).with_pose(Pose::translation(-3.0, 0.0, 0.8));
    world.add(ball.with_velocity(Vec3::new(6.0, 0.0, 2.0)))?;
    view(&mut world, &WindowOptions::new("a tower", [1280, 720]))?;
    println!("closed after {:.2} s of simulated time", world.time());
    Ok(())
}
