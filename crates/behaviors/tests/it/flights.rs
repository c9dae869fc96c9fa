//! Flocks in worlds.

use crate::{Numbers, boid, steps, world};
use tumble_behaviors::{BehaviorError, Flock, Search, Steering};
use tumble_core::prelude::*;

fn flock(world: &mut World, steering: Steering, search: Search, count: usize, size: f64) -> ObjectId {
    let mut numbers = Numbers(5);
    let flock = world.add(Flock::new("flock", steering).unwrap().with_search(search)).unwrap();
    for _ in 0..count {
        Flock::add(world, flock, boid(numbers.vector(size), numbers.vector(5.0))).unwrap();
    }
    flock
}

#[test]
fn a_lone_boid_reaches_the_desired_speed() {
    let mut world = world();
    let steering = Steering { desired_speed: 10.0, speed_rate: 0.8, boundary_stiffness: 0.0, ..Steering::default() };
    let id = flock(&mut world, steering, Search::Grid, 0, 0.0);
    let slow = Flock::add(&mut world, id, boid(Vec3::zeros(), Vec3::new(0.0, -2.0, 0.0))).unwrap();
    let fast = Flock::add(&mut world, id, boid(Vec3::new(50.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 25.0))).unwrap();
    let rest = Flock::add(&mut world, id, boid(Vec3::new(0.0, 50.0, 0.0), Vec3::zeros())).unwrap();
    let speed = |world: &World, id| world.part_state(id, 0).unwrap().velocity.norm();
    for second in 1..=10 {
        steps(&mut world, 120);
        // V + (v₀ − V)·exp(−Ks·t) in time; a force is constant over a step h: a factor of 1 − Ks·h each
        let (t, rate, h) = (f64::from(second), 0.8, 1.0 / 120.0);
        let (decay, stepped) = ((-rate * t).exp(), (1.0 - rate * h).powi(120 * second));
        for (id, start) in [(slow, 2.0), (fast, 25.0), (rest, 0.0)] {
            let off = speed(&world, id) - 10.0;
            assert!((off - (start - 10.0) * stepped).abs() < 1e-9, "{start}: {off}");
            // the error of first order, ½·Ks²·h·t of the rest, and 2 % for those of higher order
            let error = 1.02 * 0.5 * rate * rate * h * t * decay * (start - 10.0f64).abs();
            assert!((off - (start - 10.0) * decay).abs() < error, "{start}: {off}");
        }
    }
    steps(&mut world, 1800);
    assert!([slow, fast, rest].iter().all(|id| (speed(&world, *id) - 10.0).abs() < 1e-6));
}

#[test]
fn a_flock_for_ten_minutes_stays_finite_and_inside_its_boundary() {
    let minutes = 10;
    let steering = Steering { boundary_radius: 25.0, boundary_stiffness: 4.0, ..Steering::default() };
    let mut world = World::new(Settings::default().with_dt(1.0 / 60.0).with_gravity(Vec3::zeros())).unwrap();
    let id = flock(&mut world, steering, Search::Grid, 60, 10.0);
    let boids = world.get::<Flock>(id).unwrap().boids().to_vec();
    // dv/dt ≤ F/m − Ks·(v − V) bounds the speed; beyond the radius k·x²/2 ≤ m·v²/2 + (F + m·Ks·V)·x
    let Steering { max_force, desired_speed, speed_rate, boundary_stiffness, .. } = steering;
    let fastest = desired_speed + max_force / speed_rate;
    let push = max_force + speed_rate * desired_speed;
    let beyond = (push + (push * push + boundary_stiffness * fastest * fastest).sqrt()) / boundary_stiffness;
    let (mut farthest, mut top) = (0.0f64, 0.0f64);
    for _ in 0..minutes * 3600 {
        world.step().unwrap();
        for id in &boids {
            let state = world.part_state(*id, 0).unwrap();
            farthest = farthest.max(state.position().norm());
            top = top.max(state.velocity.norm());
            assert!(state.pose.to_homogeneous().iter().all(|x| x.is_finite()));
        }
    }
    println!("farthest {farthest:.1} m of at most {:.1}, fastest {top:.1} m/s of at most {fastest}", 25.0 + beyond);
    assert!(farthest > 5.0 && farthest < 25.0 + beyond, "{farthest}");
    assert!(top > 5.0 && top < fastest, "{top}");
}

/// Flies 40 boids between six walls and returns the bytes of the world.
fn in_a_box(threads: u32, minutes: f64) -> Vec<u8> {
    let settings = Settings::default().with_dt(1.0 / 60.0).with_gravity(Vec3::zeros()).with_threads(threads);
    let mut world = World::new(settings).unwrap();
    for axis in [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| [axis, -axis]).concat() {
        let facing = Quat::rotation_between(&Vec3::z(), &axis).unwrap_or(Quat::from_euler_angles(
            std::f64::consts::PI,
            0.0,
            0.0,
        ));
        let wall = RigidBody::fixed(Shape::half_space()).with_pose(Pose::from_parts((-12.0 * axis).into(), facing));
        world.add(wall).unwrap();
    }
    let id = flock(&mut world, Steering::default(), Search::Grid, 40, 10.0);
    let boids = world.get::<Flock>(id).unwrap().boids().to_vec();
    for _ in 0..(3600.0 * minutes) as usize {
        world.step().unwrap();
        // false for what is not a number, too
        let inside = |id: &ObjectId| world.part_state(*id, 0).unwrap().position().iter().all(|x| x.abs() < 12.0);
        assert!(boids.iter().all(inside));
    }
    world.save()
}

/// A minute, and ten with `TUMBLE_SLOW=1`.
#[test]
fn boids_in_a_box_of_walls_stay_in_it_with_the_same_bytes_on_any_number_of_threads_full_length() {
    let minutes = if std::env::var_os("TUMBLE_SLOW").is_some_and(|v| v == "1") { 10.0 } else { 1.0 };
    let first = in_a_box(1, minutes);
    for threads in [1, 2, 3] {
        assert!(in_a_box(threads, minutes) == first, "{threads} threads");
    }
}

#[test]
fn boids_of_a_flock_fly_the_same_way() {
    let mut world = world();
    let steering =
        Steering { boundary_stiffness: 0.0, visibility_distance: 40.0, matching: 1.0, ..Steering::default() };
    let id = flock(&mut world, steering, Search::Grid, 40, 8.0);
    let boids = world.get::<Flock>(id).unwrap().boids().to_vec();
    let order = |world: &World| {
        let noses = boids.iter().map(|id| world.part_state(*id, 0).unwrap().velocity.normalize());
        noses.sum::<Vec3>().norm() / boids.len() as f64
    };
    assert!(order(&world) < 0.4);
    steps(&mut world, 3600);
    assert!(order(&world) > 0.95, "{}", order(&world));
}

#[test]
fn the_bits_are_the_same_for_grid_brute_force_and_any_number_of_threads() {
    let run = |search, threads| {
        let mut world = world();
        world.set_settings(world.settings().with_threads(threads)).unwrap();
        flock(&mut world, Steering::default(), search, 300, 15.0);
        steps(&mut world, 120);
        world.save()
    };
    let first = run(Search::Grid, 1);
    for (search, threads) in [(Search::Grid, 1), (Search::BruteForce, 1), (Search::Grid, 2), (Search::Grid, 5)] {
        assert!(first == run(search, threads), "{search:?}, {threads} threads");
    }
}

#[test]
fn a_fork_flies_on_with_the_same_bits() {
    let mut world = world();
    flock(&mut world, Steering::default(), Search::Grid, 30, 8.0);
    steps(&mut world, 60);
    let mut fork = world.fork();
    steps(&mut world, 60);
    steps(&mut fork, 60);
    assert!(world.save() == fork.save());
}

#[test]
fn boids_come_and_go_in_flight() {
    let mut world = world();
    let id = flock(&mut world, Steering::default(), Search::Grid, 20, 6.0);
    let boids = world.get::<Flock>(id).unwrap().boids().to_vec();
    steps(&mut world, 30);
    Flock::remove(&mut world, id, boids[3]).unwrap();
    world.remove(boids[0]).unwrap(); // behind the back of the flock
    world.set_enabled(boids[7], false).unwrap();
    steps(&mut world, 30);
    assert!(world.part_state(boids[3], 0).is_none());
    assert_eq!(Flock::remove(&mut world, id, boids[3]), Err(BehaviorError::NoBoid));
    assert_eq!(Flock::remove(&mut world, boids[5], boids[6]), Err(BehaviorError::NoFlock));
    let late = Flock::add(&mut world, id, boid(Vec3::new(1.0, 2.0, 3.0), Vec3::y())).unwrap();
    steps(&mut world, 30);
    assert!(world.part_state(late, 0).unwrap().velocity.norm() > 1.0);
    assert_eq!(world.get::<Flock>(id).unwrap().boids().last(), Some(&late));
    // the last one of a flock is alone
    for id_of in world.get::<Flock>(id).unwrap().boids().to_vec() {
        let _ = Flock::remove(&mut world, id, id_of);
    }
    steps(&mut world, 30);
    assert_eq!(world.ids(), [id]);
}

#[test]
fn removed_and_disabled_boids_are_seen_no_more() {
    // the first of two brakes for the second; without it, it flies on as if alone
    for disabled in [true, false] {
        let mut world = world();
        let steering = Steering { speed_rate: 0.0, ..Steering::default() };
        let id = flock(&mut world, steering, Search::Grid, 0, 0.0);
        let first = Flock::add(&mut world, id, boid(Vec3::zeros(), Vec3::x())).unwrap();
        let second = Flock::add(&mut world, id, boid(Vec3::new(4.0, 0.0, 0.0), Vec3::x())).unwrap();
        steps(&mut world, 1);
        let braked = world.part_state(first, 0).unwrap().velocity;
        assert!(braked.x < 1.0);
        if disabled {
            world.set_enabled(second, false).unwrap();
        } else {
            Flock::remove(&mut world, id, second).unwrap();
        }
        steps(&mut world, 120);
        assert_eq!(world.part_state(first, 0).unwrap().velocity, braked);
    }
}
