//! The worst that data can ask for: very few boids, all of them at one place, very fast particles on thin parts, very stiff cloth.

use crate::{Numbers, boid, steps};
use tumble_behaviors::{Cloth, Flock, ParticleSettings, ParticleSystem, Search, SpringMesh, Steering};
use tumble_core::prelude::*;

fn flock(search: Search, count: usize, velocity: Vec3) -> World {
    let mut world = crate::world();
    let flock = world.add(Flock::new("flock", Steering::default()).unwrap().with_search(search)).unwrap();
    for _ in 0..count {
        let boid = boid(Vec3::new(1.0, 2.0, 3.0), velocity);
        let id = Flock::add(&mut world, flock, boid).unwrap();
        world.set_collidable(id, false).unwrap();
    }
    world
}

#[test]
fn boids_at_one_place_part_with_finite_forces_and_the_same_bits_for_both_searches() {
    for count in [0, 1, 2, 3, 300] {
        for velocity in [Vec3::zeros(), 3.0 * Vec3::x()] {
            let [grid, brute] = [Search::Grid, Search::BruteForce].map(|search| {
                let mut world = flock(search, count, velocity);
                steps(&mut world, 240);
                world
            });
            assert!(grid.state() == brute.state(), "{count}");
            let places: Vec<Vec3> = grid.part_states().iter().map(|part| part.position()).collect();
            assert!(places.iter().all(|place| place.norm() < 100.0), "{count}");
            if count == 2 && velocity != Vec3::zeros() {
                assert!((places[0] - places[1]).norm() > 0.1, "they part");
            }
        }
    }
}

/// Points that cross a plate of 1 mm by up to 170 m in a frame, at any angle: each ends on the side from which it came if its
/// line meets the plate, and flies on otherwise.
#[test]
fn very_fast_points_do_not_pass_a_thin_plate() {
    let mut numbers = Numbers(3);
    let settings = Settings::default().with_dt(1.0 / 60.0).with_gravity(Vec3::zeros());
    let mut world = World::new(settings).unwrap();
    world.add(RigidBody::fixed(Shape::cuboid(Vec3::new(2.0, 2.0, 0.001)).unwrap())).unwrap();
    let points = ParticleSettings { radius: 0.0, capacity: 4000, ..ParticleSettings::default() };
    let system = world.add(ParticleSystem::new("points", points).unwrap()).unwrap();
    let mut starts = Vec::new();
    while starts.len() < 4000 {
        let aim = Vec3::new(1.5 * numbers.number(), 1.5 * numbers.number(), 0.0);
        let direction = numbers.vector(1.0).normalize();
        let start = aim - 3.0 * numbers.number().abs() * direction;
        // far from the plate and its edges: the oracle is the plane
        if start.z.abs() < 0.01
            || (aim.x.abs() - 1.0).abs() < 0.1
            || (aim.y.abs() - 1.0).abs() < 0.1
            || direction.z.abs() < 0.02
        {
            continue;
        }
        let velocity = 1e4 * numbers.number().abs().max(0.05) * direction;
        ParticleSystem::spawn(&mut world, system, start, velocity, 9.0).unwrap();
        starts.push((start, velocity, aim.x.abs() < 1.0 && aim.y.abs() < 1.0));
    }
    world.step().unwrap();
    let mut hits = 0;
    for (particle, (start, velocity, meets)) in ParticleSystem::particles(&world, system).unwrap().zip(&starts) {
        let deflected = (particle.velocity - velocity).norm() > 1e-9;
        assert_eq!(deflected, *meets, "{start:?} {velocity:?}");
        assert!(!meets || particle.position.z * start.z > 0.0, "{particle:?} from {start:?}");
        hits += usize::from(*meets);
    }
    assert!((1000..3000).contains(&hits), "{hits}");
}

/// A blade of 2 mm that turns by almost 2 rad in a frame sweeps drops that hang in its way: none is inside it, whatever it does.
#[test]
fn a_fast_blade_has_no_drop_inside() {
    let settings = Settings::default().with_dt(1.0 / 60.0).with_gravity(Vec3::zeros());
    let mut world = World::new(settings).unwrap();
    let size = Vec3::new(2.0, 0.002, 0.4);
    let blade = RigidBody::new(Shape::cuboid(size).unwrap()).with_angular_velocity(110.0 * Vec3::z());
    let blade = world.add(blade).unwrap();
    world.set_mode(blade, Mode::Kinematic).unwrap();
    let drops = ParticleSettings { radius: 0.003, capacity: 500, ..ParticleSettings::default() };
    let system = world.add(ParticleSystem::new("drops", drops).unwrap()).unwrap();
    let mut numbers = Numbers(8);
    for _ in 0..500 {
        let place = Vec3::new(numbers.number(), 0.02 + 0.9 * numbers.number().abs(), 0.15 * numbers.number());
        ParticleSystem::spawn(&mut world, system, place, Vec3::zeros(), 99.0).unwrap();
    }
    let mut struck = 0;
    for _ in 0..10 {
        world.step().unwrap();
        let (pose, shape) = (world.body(blade).unwrap().pose(), Shape::cuboid(size).unwrap());
        for particle in ParticleSystem::particles(&world, system).unwrap() {
            let gap = shape.closest_point(&pose, &particle.position).distance - 0.003;
            assert!(gap > -1e-9, "{gap} m");
            struck += usize::from(particle.velocity.norm() > 1.0);
        }
    }
    assert!(struck > 1000, "{struck}");
}

#[test]
fn cloth_of_absurd_stiffness_hangs_still() {
    for stiffness in [1e9, 1e12] {
        let mut world = World::new(Settings::default().with_dt(1.0 / 240.0)).unwrap();
        let cloth = Cloth { stiffness: [stiffness, stiffness, 0.1 * stiffness], ..Cloth::default() };
        let cloth = cloth.mesh().unwrap().with_pins(|x| x.y > 0.499);
        let cloth = SpringMesh::add(&mut world, cloth).unwrap();
        let before = SpringMesh::positions(&world, cloth).unwrap();
        steps(&mut world, 240);
        let after = SpringMesh::positions(&world, cloth).unwrap();
        // it lies in a plane and swings about its pins; no spring of 1 GN/m stretches by more than rounding and tolerances
        let length = |x: &[Vec3], a: usize, b: usize| (x[a] - x[b]).norm();
        let count = before.len();
        let worst = (1..count)
            .map(|k| (length(&after, k - 1, k) / length(&before, k - 1, k) - 1.0).abs())
            .filter(|strain| strain.is_finite())
            .fold(0.0, f64::max);
        println!("{stiffness:e} N/m: largest change between neighbors in the list {worst:e}");
        assert!(after.iter().all(|x| x.norm() < 3.0) && worst < 1e-2, "{worst}");
    }
}
