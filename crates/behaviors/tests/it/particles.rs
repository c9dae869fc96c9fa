//! Particles against closed forms and conservation laws.

use crate::steps;
use std::f64::consts::PI;
use tumble_behaviors::{Emitter, Particle, ParticleSettings, ParticleSystem};
use tumble_core::prelude::*;

const G: f64 = 9.81;

fn world(dt: f64) -> World {
    World::new(Settings::default().with_dt(dt).with_gravity(Vec3::new(0.0, 0.0, -G))).unwrap()
}

fn settings() -> ParticleSettings {
    ParticleSettings { capacity: 1000, ..ParticleSettings::default() }
}

fn add(world: &mut World, settings: ParticleSettings) -> ObjectId {
    world.add(ParticleSystem::new("particles", settings).unwrap()).unwrap()
}

fn all(world: &World, id: ObjectId) -> Vec<Particle> {
    ParticleSystem::particles(world, id).unwrap().collect()
}

/// A world with one particle.
fn one(dt: f64, settings: ParticleSettings, position: Vec3, velocity: Vec3) -> (World, ObjectId) {
    let mut world = world(dt);
    let id = add(&mut world, settings);
    ParticleSystem::spawn(&mut world, id, position, velocity, 1e9).unwrap();
    (world, id)
}

#[test]
fn terminal_velocities_at_any_step() {
    let wind = Vec3::new(4.0, 0.0, 1.0);
    for dt in [0.5, 1.0 / 60.0] {
        for (linear_drag, quadratic_drag, terminal) in [(3.0, 0.0, G / 3.0), (0.0, 0.2, (G / 0.2f64).sqrt())] {
            let settings = ParticleSettings { linear_drag, quadratic_drag, wind, ..settings() };
            let (mut world, id) = one(dt, settings, Vec3::zeros(), Vec3::zeros());
            steps(&mut world, (60.0 / dt) as usize);
            let off = all(&world, id)[0].velocity - wind + terminal * Vec3::z();
            assert!(off.norm() < 1e-9, "{off}");
        }
    }
}

#[test]
fn a_ballistic_path_is_exact_with_linear_drag_and_of_second_order_with_quadratic() {
    let start = Vec3::new(6.0, 0.0, 8.0);
    let fly = |rate: usize, linear_drag: f64, quadratic_drag: f64, velocity: Vec3| {
        let settings = ParticleSettings { linear_drag, quadratic_drag, ..settings() };
        let (mut world, id) = one(1.0 / rate as f64, settings, Vec3::zeros(), velocity);
        steps(&mut world, rate);
        all(&world, id)[0].position
    };
    for rate in [4, 60] {
        // x = v₀/d·(1 − e^{−d·t}), z alike with v₀ + g/d, less g·t/d; without drag the parabola
        let (d, decay) = (0.7f64, 1.0 - (-0.7f64).exp());
        let exact = Vec3::new(6.0 / d * decay, 0.0, (8.0 + G / d) / d * decay - G / d);
        assert!((fly(rate, d, 0.0, start) - exact).norm() < 1e-12);
        assert!((fly(rate, 0.0, 0.0, start) - Vec3::new(6.0, 0.0, 8.0 - 0.5 * G)).norm() < 1e-12);
    }
    // straight up and down: z = v_t²/g·ln(cosh(g·t/v_t)) of a fall
    let terminal = (G / 0.3f64).sqrt();
    let exact = -terminal * terminal / G * (G / terminal).cosh().ln();
    let errors = [15, 30, 60, 120].map(|rate| (fly(rate, 0.0, 0.3, Vec3::zeros()).z - exact).abs());
    println!("errors of a fall with quadratic drag {errors:?} m");
    assert!(errors.windows(2).all(|e| e[0] / e[1] > 3.6), "{errors:?}");
}

#[test]
fn elastic_bounces_keep_their_height_and_others_lose_it() {
    for (dt, restitution) in [(1.0 / 60.0, 1.0), (1.0 / 240.0, 1.0), (1.0 / 60.0, 0.8)] {
        let material = Material { restitution, ..Material::default() };
        let height = 1.3;
        let settings = ParticleSettings { material, ..settings() };
        let (mut world, id) = one(dt, settings, Vec3::new(0.0, 0.0, height + 0.01), Vec3::zeros());
        world.add(RigidBody::fixed(Shape::half_space())).unwrap();
        // m·g·z + ½·m·v² falls by the square of the restitution at each bounce
        let (mut bounces, mut last) = (0, 0.0);
        for _ in 0..(4.0 / dt) as usize {
            steps(&mut world, 1);
            let p = all(&world, id)[0];
            bounces += i32::from(p.velocity.z > last && last < 0.0);
            last = p.velocity.z;
            let energy = (p.position.z - 0.01) * G + 0.5 * p.velocity.norm_squared();
            let expected = height * G * f64::powi(restitution, 2 * bounces);
            assert!((energy - expected).abs() < 1e-8, "{restitution}, bounce {bounces}: {energy} is not {expected}");
        }
        assert!(bounces >= 4);
    }
}

#[test]
fn a_particle_slides_to_its_stop_as_coulomb_says() {
    // with friction 0.5 of the ground, √(0.5·0.5): v²/(2·μ·g)
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let (mut world, id) = one(dt, settings(), Vec3::new(0.0, 0.0, 0.01), Vec3::new(3.0, 0.0, 0.0));
        world.add(RigidBody::fixed(Shape::half_space())).unwrap();
        steps(&mut world, (2.0 / dt) as usize);
        let p = all(&world, id)[0];
        assert!(p.velocity.norm() < 1e-12 && (p.position.z - 0.01).abs() < 1e-9, "{p:?}");
        assert!((p.position.x - 9.0 / G).abs() < 2e-3, "{p:?}");
    }
}

#[test]
fn nothing_tunnels_through_a_thin_moving_plate() {
    // fast particles against a plate of 1 mm that comes towards them, of three kinds of shape
    let size = Vec3::new(4.0, 4.0, 0.001);
    let mesh = Shape::mesh(TriMesh::cuboid(size), &TreeSettings::octree()).unwrap();
    for shape in [Shape::cuboid(size).unwrap(), mesh, Shape::cylinder(2.0, 0.001).unwrap()] {
        let mut world = world(1.0 / 60.0);
        let plate = RigidBody::fixed(shape).with_pose(Pose::translation(0.0, 0.0, 1.0));
        let plate = world.add(plate.with_velocity(3.0 * Vec3::z())).unwrap();
        world.set_mode(plate, Mode::Kinematic).unwrap();
        let id = add(&mut world, ParticleSettings { radius: 0.002, ..settings() });
        for k in 0..200 {
            let (x, y) = (-1.0 + 0.01 * k as f64, 0.3 * (k % 7) as f64 - 0.9);
            ParticleSystem::spawn(&mut world, id, Vec3::new(x, y, 4.0), Vec3::new(0.0, 0.0, -200.0), 10.0).unwrap();
        }
        for _ in 0..60 {
            steps(&mut world, 1);
            let top = world.body(plate).unwrap().position().z + 0.0005;
            assert!(all(&world, id).iter().all(|p| p.position.z > top + 0.002 - 1e-9));
        }
        let lifted = all(&world, id).iter().filter(|p| (p.velocity.z - 3.0).abs() < 1e-6).count();
        assert_eq!(lifted, 200, "all ride on it");
    }
}

#[test]
fn the_momentum_of_a_burst_is_that_of_its_mount_and_its_particles() {
    let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
    let shell = RigidBody::new(Shape::sphere(0.05).unwrap()).with_mass(0.3);
    let shell = world.add(shell.with_velocity(Vec3::new(0.0, 0.0, 0.0))).unwrap();
    let emitter = Emitter {
        mount: Some((shell, 0)),
        speed: [2.0, 9.0],
        half_angle: 0.4,
        lifetime: [5.0, 6.0],
        ..Emitter::burst(0.2 * Vec3::z(), 400, 0.01)
    };
    let settings = ParticleSettings { two_way: true, ..settings() };
    let id = world.add(ParticleSystem::new("", settings).unwrap().with_emitter(emitter).unwrap()).unwrap();
    steps(&mut world, 60);
    let sum: Vec3 = all(&world, id).iter().map(|p| 1e-3 * p.velocity).sum();
    assert!(all(&world, id).len() == 400 && sum.z > 1.0);
    let rest = sum + 0.3 * world.body(shell).unwrap().velocity();
    assert!(rest.norm() < 1e-12, "{rest}");
    // without a mount, pairs of an open burst cancel
    let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
    let emitter = Emitter { speed: [1.0, 5.0], lifetime: [9.0; 2], ..Emitter::burst(Vec3::x(), 500, 0.0) };
    let id = world.add(ParticleSystem::new("", self::settings()).unwrap().with_emitter(emitter).unwrap()).unwrap();
    steps(&mut world, 30);
    let sum: Vec3 = all(&world, id).iter().map(|p| p.velocity).sum();
    let speeds: f64 = all(&world, id).iter().map(|p| p.velocity.norm()).sum::<f64>() / 500.0;
    assert!(sum.norm() < 1e-11 && (speeds - 3.0).abs() < 0.2, "{sum}, {speeds}");
}

#[test]
fn particles_and_a_body_exchange_momentum() {
    // 300 particles strike a ball that floats: its momentum is what they lost
    let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
    let ball = world.add(RigidBody::new(Shape::sphere(0.3).unwrap()).with_mass(2.0)).unwrap();
    let material = Material { restitution: 0.5, ..Material::default() };
    let id = add(&mut world, ParticleSettings { two_way: true, material, ..settings() });
    for k in 0..300 {
        let aside = Vec3::new(-2.0 - 0.01 * k as f64, 0.02 * (k % 17) as f64 - 0.16, 0.02 * (k % 13) as f64 - 0.12);
        ParticleSystem::spawn(&mut world, id, aside, Vec3::new(5.0, 0.0, 0.0), 100.0).unwrap();
    }
    steps(&mut world, 600);
    let particles: Vec3 = all(&world, id).iter().map(|p| 1e-3 * p.velocity).sum();
    let ball = world.body(ball).unwrap();
    assert!(ball.velocity().x > 0.5 && ball.angular_velocity().norm() > 1e-3);
    let change = particles + 2.0 * ball.velocity() - Vec3::new(1.5, 0.0, 0.0);
    assert!(change.norm() < 1e-10, "{change}");
}

fn fountain(threads: u32, seed: u64) -> (World, ObjectId) {
    let mut world = world(1.0 / 60.0);
    world.set_settings(world.settings().with_threads(threads)).unwrap();
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let ball = RigidBody::new(Shape::sphere(0.4).unwrap()).with_mass(1.0);
    world.add(ball.with_pose(Pose::translation(0.5, 0.0, 0.4))).unwrap();
    let emitter = Emitter {
        speed: [4.0, 6.0],
        half_angle: 0.5,
        lifetime: [1.0, 2.0],
        burst: 3000,
        ..Emitter::stream(Pose::translation(0.0, 0.0, 0.2), 2000.0)
    };
    let settings = ParticleSettings { capacity: 8000, seed, two_way: true, ..settings() };
    let id = world.add(ParticleSystem::new("", settings).unwrap().with_emitter(emitter).unwrap()).unwrap();
    (world, id)
}

#[test]
fn the_bytes_are_the_same_on_every_run_and_any_number_of_threads() {
    let run = |threads, seed| {
        let (mut world, id) = fountain(threads, seed);
        steps(&mut world, 90);
        let count = all(&world, id).len();
        (world.save(), count)
    };
    let first = run(1, 1);
    assert!(first.1 > 3000);
    assert!([1, 2, 3, 5].iter().all(|threads| run(*threads, 1) == first));
    assert!(run(1, 2).0 != first.0);
}

#[test]
fn particles_are_saved_forked_and_rolled_back() {
    let (mut world, _) = fountain(1, 1);
    steps(&mut world, 40);
    let (saved, mut fork) = (world.save(), world.fork());
    steps(&mut world, 40);
    steps(&mut fork, 40);
    assert!(world.save() == fork.save());
    let mut other = fountain(2, 1).0;
    other.restore(&saved).unwrap();
    steps(&mut other, 40);
    assert!(world.save() == other.save());
}

#[test]
fn emission_counts_lifetimes_and_capacity() {
    let mut world = world(1.0 / 60.0);
    let emitter =
        Emitter { lifetime: [0.5; 2], end: 2.0, start: 0.245, burst: 10, ..Emitter::stream(Pose::identity(), 97.0) };
    let id = world.add(ParticleSystem::new("", settings()).unwrap().with_emitter(emitter).unwrap()).unwrap();
    steps(&mut world, 15);
    assert_eq!(all(&world, id).len(), 10);
    steps(&mut world, 60);
    // ⌊97·1.005⌋ have left, and ⌊97·0.505⌋ of them are dead
    let now = all(&world, id);
    assert_eq!(now.len(), 97 - 48);
    assert_eq!(now.iter().map(|p| p.serial).max(), Some(10 + 97 - 1));
    steps(&mut world, 120);
    assert!(all(&world, id).is_empty());
    let full = ParticleSettings { capacity: 50, ..settings() };
    let emitter = Emitter { burst: 80, start: 4.0, ..Emitter::default() };
    let id = world.add(ParticleSystem::new("", full).unwrap().with_emitter(emitter).unwrap()).unwrap();
    steps(&mut world, 90);
    assert_eq!(all(&world, id).len(), 50);
    assert_eq!(ParticleSystem::spawn(&mut world, id, Vec3::zeros(), Vec3::zeros(), 1.0), Ok(None));
    assert!(ParticleSystem::spawn(&mut world, id, Vec3::zeros(), Vec3::zeros(), f64::NAN).is_ok_and(|s| s.is_none()));
}

#[test]
fn directions_are_uniform_within_the_cone() {
    let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
    let emitter = Emitter { half_angle: PI / 3.0, lifetime: [9.0; 2], burst: 20_000, ..Emitter::default() };
    let settings = ParticleSettings { capacity: 20_000, ..settings() };
    let id = world.add(ParticleSystem::new("", settings).unwrap().with_emitter(emitter).unwrap()).unwrap();
    steps(&mut world, 1);
    let particles = all(&world, id);
    let mean: Vec3 = particles.iter().map(|p| p.velocity).sum::<Vec3>() / 20_000.0;
    // the mean of z over the cap is (1 + cos 60°)/2
    assert!((mean - 0.75 * Vec3::z()).norm() < 0.01, "{mean}");
    assert!(particles.iter().all(|p| p.velocity.z > 0.5 - 1e-12 && (p.velocity.norm() - 1.0).abs() < 1e-12));
}

#[test]
fn constants_of_particles_are_refused_by_name() {
    let bad = [
        ParticleSettings { capacity: 0, ..settings() },
        ParticleSettings { mass: 0.0, ..settings() },
        ParticleSettings { quadratic_drag: f64::NAN, ..settings() },
        ParticleSettings { wind: Vec3::new(f64::INFINITY, 0.0, 0.0), ..settings() },
    ];
    let names = ["the capacity", "the mass of a particle", "the quadratic drag", "the velocity of the air"];
    for (settings, name) in bad.into_iter().zip(names) {
        let error = ParticleSystem::new("", settings).unwrap_err().to_string();
        assert!(error.starts_with(name), "{error}");
    }
    let emitter = Emitter { lifetime: [2.0, 1.0], ..Emitter::default() };
    assert!(ParticleSystem::new("", settings()).unwrap().with_emitter(emitter).is_err());
}

/// A bounce that ends within a frame: the particle does not stay where it left the ground.
#[test]
fn a_low_bounce_on_a_slope_does_not_stop_the_particle() {
    let slope = 0.5f64;
    for restitution in [0.2, 0.3, 0.4, 0.5, 0.6, 0.8] {
        let mut world = World::new(Settings::default().with_dt(1.0 / 60.0)).unwrap();
        let material = Material { restitution, friction: 0.0, ..Material::default() };
        let plane = Pose::from_parts(Vec3::zeros().into(), Quat::from_axis_angle(&Vec3::y_axis(), slope));
        world.add(RigidBody::fixed(Shape::half_space()).with_pose(plane).with_material(material)).unwrap();
        let settings = ParticleSettings { material, ..ParticleSettings::default() };
        let system = world.add(ParticleSystem::new("drops", settings).unwrap()).unwrap();
        for k in 0..100 {
            let at = Vec3::new(0.0, 0.0, 0.05 + 0.01 * f64::from(k));
            ParticleSystem::spawn(&mut world, system, at, Vec3::zeros(), 100.0).unwrap();
        }
        steps(&mut world, 300);
        // no force along the slope but gravity: v = g·sin α·t, whatever the bounces
        let (along, expected) = (plane.rotation * Vec3::x(), 9.81 * slope.sin() * 5.0);
        for particle in ParticleSystem::particles(&world, system).unwrap() {
            let v = particle.velocity.dot(&along);
            assert!(
                (v - expected).abs() < 1e-6 * expected,
                "{restitution}, {}: {v} is not {expected}",
                particle.serial
            );
        }
    }
}

/// A ground without a finite box does not hide what is beside it.
#[test]
fn nothing_enters_a_ball_on_a_tilted_ground() {
    let mut world = world(1.0 / 60.0);
    let tilted = Pose::from_parts(Vec3::zeros().into(), Quat::from_axis_angle(&Vec3::x_axis(), 0.05));
    world.add(RigidBody::fixed(Shape::half_space()).with_pose(tilted)).unwrap();
    let center = Vec3::new(0.0, 0.0, 0.7);
    world
        .add(RigidBody::fixed(Shape::sphere(0.8).unwrap()).with_pose(Pose::from_parts(center.into(), Quat::identity())))
        .unwrap();
    let rain = Emitter {
        radius: 1.0,
        speed: [0.0, 1.0],
        lifetime: [9.0; 2],
        ..Emitter::burst(Vec3::new(0.0, 0.0, 4.0), 1000, 0.0)
    };
    let system = ParticleSystem::new("rain", settings()).unwrap().with_emitter(rain).unwrap();
    let id = world.add(system).unwrap();
    let mut nearest = f64::INFINITY;
    for _ in 0..240 {
        world.step().unwrap();
        let gaps = all(&world, id).into_iter().map(|particle| (particle.position - center).norm() - 0.81);
        nearest = gaps.fold(nearest, f64::min);
    }
    assert!(nearest > -1e-9 && nearest < 1e-6, "{nearest}");
}
