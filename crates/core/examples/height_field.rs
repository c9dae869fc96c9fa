//! Measures a height field of 256 × 256 heights: the time to build it, and the time of a step with
//! bodies in its valleys.
//!
//! `cargo run --release -p tumble-core --example height_field [NAME]`: all bodies, or those whose
//! names begin with NAME.

#![allow(clippy::disallowed_methods)] // what is measured need not have the same bits on every platform

use std::error::Error;
use std::time::Instant;
use tumble_core::collide::{Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::prelude::*;

const COUNT: usize = 256;
const STEPS: usize = 240;

fn main() -> Result<(), Box<dyn Error>> {
    // a valley for each of the bodies
    let place = |n: usize| n as f64 / (COUNT - 1) as f64 * 20.0 * std::f64::consts::PI;
    let heights: Vec<f64> =
        (0..COUNT * COUNT).map(|n| 0.3 * (place(n % COUNT).cos() + place(n / COUNT).cos())).collect();
    let started = Instant::now();
    let ground = Shape::height_field(&heights, COUNT, [64.0, 64.0], None)?;
    println!("built in {:.2} s", started.elapsed().as_secs_f64());
    let hull = Shape::convex_hull(&TriMesh::icosphere(0.3, 1).vertices)?;
    let mesh = Shape::mesh(TriMesh::torus(0.3, 0.1, 16, 8), &TreeSettings::octree())?;
    let shapes = [
        ("spheres", Shape::sphere(0.3)?),
        ("boxes", Shape::cuboid(Vec3::repeat(0.5))?),
        ("capsules", Shape::capsule(0.2, 0.4)?),
        ("cylinders", Shape::cylinder(0.25, 0.5)?),
        ("hulls of 42 points", hull),
        ("tori of 256 triangles", mesh),
    ];
    let flat = Shape::height_field(&vec![0.0; COUNT * COUNT], COUNT, [64.0, 64.0], None)?;
    println!("| 100 bodies, ms a step | half-space | flat field | hills |\n|---|---|---|---|");
    let wanted = std::env::args().nth(1).unwrap_or_default();
    for (name, shape) in shapes.into_iter().filter(|(name, _)| name.starts_with(&wanted)) {
        let mut times = Vec::new();
        for ground in [&Shape::half_space(), &flat, &ground] {
            times.push(format!("{:.2}", ms_per_step(ground, &shape)?));
        }
        println!("| {name} | {} |", times.join(" | "));
    }
    Ok(())
}

/// Drops 100 bodies far from each other and returns the mean time of a step after they have landed,
/// ms.
fn ms_per_step(ground: &Shape, shape: &Shape) -> Result<f64, Box<dyn Error>> {
    let mut world = World::new(Settings::default())?;
    let placed = |at: Vec3| Pose::from_parts(at.into(), Quat::identity());
    world.add_static(RigidBody::fixed(ground.clone()))?;
    let top = if ground.bounding_radius().is_finite() {
        ground.tight_aabb(&placed(ground.center_of_mass())).max.z
    } else {
        0.0
    };
    for n in 0..100 {
        let at = Vec3::new((n % 10) as f64 * 6.4 - 28.3, (n / 10) as f64 * 6.4 - 29.3, top + 0.5);
        world.add(RigidBody::new(shape.clone()).with_pose(placed(at)))?;
    }
    for _ in 0..STEPS {
        world.step()?;
    }
    let started = Instant::now();
    for _ in 0..STEPS {
        world.step()?;
    }
    Ok(1e3 * started.elapsed().as_secs_f64() / STEPS as f64)
}
