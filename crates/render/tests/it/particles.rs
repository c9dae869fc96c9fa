//! Particles on the graphics device against closed forms and against those of `tumble-behaviors`.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use tumble_behaviors::{ParticleSettings, ParticleSystem};
use tumble_core::prelude::*;
use tumble_render::{FreeParticle, FreeParticles, GpuParticles, Obstacle, ObstacleShape, Precision, RenderError};

const DT: f64 = 1.0 / 60.0;

/// Advances particles; `None` without an adapter, which is printed.
fn flown(
    constants: &FreeParticles,
    obstacles: &[Obstacle],
    particles: &[FreeParticle],
    frames: u32,
) -> Option<Vec<FreeParticle>> {
    flown_by(constants, obstacles, particles, frames).map(|(particles, _)| particles)
}

/// The same with the name of the adapter.
fn flown_by(
    constants: &FreeParticles,
    obstacles: &[Obstacle],
    particles: &[FreeParticle],
    frames: u32,
) -> Option<(Vec<FreeParticle>, String)> {
    match GpuParticles::new(constants, obstacles, particles) {
        Ok(mut on_gpu) => {
            on_gpu.advance(frames).unwrap();
            Some((on_gpu.read().unwrap(), on_gpu.adapter().to_owned()))
        }
        Err(RenderError::NoAdapter { reason }) => skipped(&format!("no graphics adapter ({reason})")),
        Err(RenderError::Device { adapter, reason }) if constants.precision == Precision::Double => {
            skipped(&format!("{adapter}: {reason}"))
        }
        Err(other) => panic!("an adapter exists and fails: {other}"),
    }
}

/// Prints why there is nothing to compare.
fn skipped<T>(why: &str) -> Option<T> {
    // past the harness, which keeps what passing tests print
    let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("\nSKIPPED: {why}\n"));
    None
}

/// A fixed cloud of particles about a point.
fn cloud(count: usize, about: Vector3<f64>, size: f64, speed: f64) -> Vec<FreeParticle> {
    let mut seed = 5u64;
    let mut number = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let mut vector = |size: f64| size * Vector3::new(number(), number(), number());
    (0..count).map(|_| FreeParticle { position: about + vector(size), velocity: vector(speed), life: 1e6 }).collect()
}

/// The same particles in a world with the same things.
fn in_a_world(
    constants: &FreeParticles,
    obstacles: &[Obstacle],
    particles: &[FreeParticle],
    frames: u32,
) -> Vec<FreeParticle> {
    let settings = Settings::default().with_dt(constants.dt).with_gravity(constants.gravity);
    let mut world = World::new(settings).unwrap();
    for obstacle in obstacles {
        let shape = match obstacle.shape {
            ObstacleShape::HalfSpace => Shape::half_space(),
            ObstacleShape::Sphere(radius) => Shape::sphere(radius).unwrap(),
            ObstacleShape::Box(size) => Shape::cuboid(size).unwrap(),
        };
        let material =
            Material { restitution: obstacle.restitution, friction: obstacle.friction, ..Material::default() };
        world.add(RigidBody::fixed(shape).with_pose(obstacle.pose).with_material(material)).unwrap();
    }
    // the constants of a pair are those of the obstacle
    let pair = |of: &dyn Fn(&Obstacle) -> f64| obstacles.first().map_or(0.0, of);
    let material =
        Material { restitution: pair(&|o| o.restitution), friction: pair(&|o| o.friction), ..Material::default() };
    let settings = ParticleSettings {
        capacity: particles.len(),
        material,
        radius: constants.radius,
        linear_drag: constants.linear_drag,
        quadratic_drag: constants.quadratic_drag,
        wind: constants.wind,
        ..ParticleSettings::default()
    };
    let system = world.add(ParticleSystem::new("drops", settings).unwrap()).unwrap();
    for particle in particles {
        ParticleSystem::spawn(&mut world, system, particle.position, particle.velocity, particle.life).unwrap();
    }
    (0..frames).for_each(|_| {
        world.step().unwrap();
    });
    let all = ParticleSystem::particles(&world, system).unwrap();
    all.map(|p| FreeParticle { position: p.position, velocity: p.velocity, life: p.life }).collect()
}

/// Returns the deviations of positions over the distance from the origin (at least 1 m).
fn deviations(ours: &[FreeParticle], others: &[FreeParticle]) -> Vec<f64> {
    assert_eq!(ours.len(), others.len());
    let pairs = ours.iter().zip(others);
    pairs.map(|(a, b)| (a.position - b.position).norm() / b.position.norm().max(1.0)).collect()
}

fn largest(deviations: &[f64]) -> f64 {
    deviations.iter().copied().fold(0.0, f64::max)
}

#[test]
fn ten_seconds_of_fall_with_linear_drag_are_those_of_the_closed_form() {
    for (drag, wind) in
        [(0.0, Vector3::zeros()), (0.01, Vector3::new(3.0, -1.0, 0.5)), (0.8, Vector3::new(0.0, 9.0, 0.0))]
    {
        for (precision, bound) in [(Precision::Single, 2e-6), (Precision::Double, 1e-13)] {
            let constants = FreeParticles { linear_drag: drag, wind, precision, ..FreeParticles::default() };
            let start = cloud(1000, Vector3::new(0.0, 0.0, 20.0), 10.0, 30.0);
            let Some(end) = flown(&constants, &[], &start, 600) else { return };
            let mut worst = 0.0f64;
            for (start, end) in start.iter().zip(&end) {
                let (t, g) = (10.0, constants.gravity);
                // x = x₀ + w_∞·t + (v₀ − w_∞)·(1 − e^{−d·t})/d,  w_∞ = w + g/d
                let exact = if drag == 0.0 {
                    start.position + t * start.velocity + 0.5 * t * t * g
                } else {
                    let last = wind + g / drag;
                    start.position + t * last + (start.velocity - last) * -(-drag * t).exp_m1() / drag
                };
                worst = worst.max((end.position - exact).norm() / exact.norm().max(1.0));
                assert!((end.life - (1e6 - t)).abs() < 1e-6);
            }
            println!("drag {drag}, {precision:?}: {worst:.1e} of the distance from the origin");
            assert!(worst < bound, "{worst:e}");
        }
    }
}

#[test]
fn quadratic_drag_is_that_of_the_processor() {
    for (precision, bound) in [(Precision::Single, 1e-5), (Precision::Double, 1e-12)] {
        let wind = Vector3::new(4.0, 0.0, 1.0);
        let constants = FreeParticles { quadratic_drag: 0.05, wind, precision, ..FreeParticles::default() };
        let start = cloud(500, Vector3::new(0.0, 0.0, 50.0), 5.0, 40.0);
        let Some(end) = flown(&constants, &[], &start, 600) else { return };
        let worst = largest(&deviations(&end, &in_a_world(&constants, &[], &start, 600)));
        println!("{precision:?}: {worst:.1e}");
        assert!(worst < bound, "{worst:e}");
    }
}

/// Drag, wind, and a slope, a sphere and a box.
fn bumpy(precision: Precision) -> (FreeParticles, [Obstacle; 3]) {
    let obstacle = |shape, x: f64, y: f64, z: f64, turn: Vector3<f64>| Obstacle {
        shape,
        pose: Isometry3::from_parts(Vector3::new(x, y, z).into(), UnitQuaternion::from_scaled_axis(turn)),
        restitution: 0.6,
        friction: 0.3,
    };
    let ground = obstacle(ObstacleShape::HalfSpace, 0.0, 0.0, 0.0, Vector3::new(0.05, 0.02, 0.0));
    let ball = obstacle(ObstacleShape::Sphere(1.5), 2.0, 0.0, 0.5, Vector3::zeros());
    let block = obstacle(ObstacleShape::Box(Vector3::new(3.0, 3.0, 1.0)), -2.0, 0.0, 0.6, Vector3::new(0.3, -0.2, 0.1));
    let wind = Vector3::new(0.3, 0.2, 0.0);
    let constants = FreeParticles { linear_drag: 0.1, wind, precision, ..FreeParticles::default() };
    (constants, [ground, ball, block])
}

#[test]
fn ten_seconds_of_bounces_are_those_of_the_processor() {
    let (constants, things) = bumpy(Precision::Double);
    for (count, things) in [(400, &things[..1]), (400, &things), (4000, &things)] {
        let start = cloud(count, Vector3::new(0.0, 0.0, 6.0), 3.0, 2.0);
        let Some((end, adapter)) = flown_by(&constants, things, &start, 600) else { return };
        let worst = largest(&deviations(&end, &in_a_world(&constants, things, &start, 600)));
        println!("{} things, {count} particles on {adapter}: worst {worst:.1e}", things.len());
        assert!(worst < 1e-8, "{worst:e}");
    }
}

#[test]
fn ten_seconds_of_bounces_in_single_precision() {
    let (constants, things) = bumpy(Precision::Single);
    let start = cloud(400, Vector3::new(0.0, 0.0, 6.0), 3.0, 2.0);
    let Some(on_ground) = flown(&constants, &things[..1], &start, 600) else { return };
    let worst = largest(&deviations(&on_ground, &in_a_world(&constants, &things[..1], &start, 600)));
    println!("on the ground: worst {worst:.1e}");
    assert!(worst < 1e-5, "{worst:e}");

    // A sphere and the edges of a box part neighbors, so that a difference of rounding grows.
    let compared = |start: &[FreeParticle]| {
        let (end, adapter) = flown_by(&constants, &things, start, 600)?;
        Some((deviations(&end, &in_a_world(&constants, &things, start, 600)), adapter))
    };
    let Some((all, adapter)) = compared(&start) else { return };
    println!("all things: worst of {} is {:.1e}", all.len(), largest(&all));
    // graphics cards divide and take roots to a few units in the last place; processors round correctly
    let bound = if adapter.contains("Cpu") { 1e-5 } else { 1e-4 };
    assert!(largest(&all) < bound, "{:e} on {adapter}", largest(&all));
    let Some((all, _)) = compared(&cloud(4000, Vector3::new(0.0, 0.0, 6.0), 3.0, 2.0)) else { return };
    let close = all.iter().filter(|own| **own < 1e-5).count();
    println!("{close} of {} within 1e-5, worst {:.1e}", all.len(), largest(&all));
    assert!(close >= 3980 && largest(&all) < 1e-3, "{close}, {:e}", largest(&all));
}

#[test]
fn particles_die_and_bad_numbers_are_refused() {
    let particle = |life: f64| FreeParticle { position: Vector3::zeros(), velocity: Vector3::x(), life };
    let still = FreeParticles { gravity: Vector3::zeros(), ..FreeParticles::default() };
    let bad = FreeParticles { linear_drag: -1.0, ..still.clone() };
    assert!(matches!(GpuParticles::new(&bad, &[], &[]), Err(RenderError::Particles { .. })));
    let far = FreeParticle { position: Vector3::new(2e6, 0.0, 0.0), ..particle(1.0) };
    assert!(GpuParticles::new(&still, &[], &[far]).is_err_and(|e| e.to_string().contains("2000000")));
    let start = [particle(2.5 * DT), particle(-1.0), particle(100.0)];
    let Some(end) = flown(&still, &[], &start, 10) else { return };
    let frames: Vec<f64> = end.iter().map(|p| p.position.x / DT).collect();
    for (frames, expected) in frames.iter().zip([2.0, 0.0, 10.0]) {
        assert!((frames - expected).abs() < 1e-5, "{frames}");
    }
    assert!(flown(&still, &[], &[], 3).unwrap().is_empty());
}
