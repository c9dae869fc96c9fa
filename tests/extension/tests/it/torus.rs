//! An object with an intersection test of its own against closed forms.

use crate::common::*;
use tumble_core::collide::{Pose, Quat, Shape, Vec3};
use tumble_core::*;
use tumble_extension::Torus;

const MAJOR: f64 = 0.5;
const MINOR: f64 = 0.1;

fn slippery(restitution: f64) -> Material {
    Material { restitution, friction: 0.0, ..Material::default() }
}

fn ball(radius: f64, at: Vec3, velocity: Vec3, material: Material) -> RigidBody {
    let body = RigidBody::new(sphere(radius)).with_mass(1.0).with_velocity(velocity).with_material(material);
    body.with_pose(Pose::translation(at.x, at.y, at.z))
}

/// A torus at the origin that nothing moves.
fn ring(world: &mut World, material: Material) -> ObjectId {
    let torus = Torus::new(1.0, MAJOR, MINOR).unwrap().with(|body| body.with_material(material));
    let id = world.add(torus).unwrap();
    world.set_mode(id, Mode::Static).unwrap();
    id
}

#[test]
fn a_sphere_falls_freely_through_the_hole_that_the_shape_around_has_not() {
    for stepper in STEPPERS {
        let mut world = world(stepper, true);
        ring(&mut world, slippery(0.5));
        // the hole is 0.4 m wide; 1 mm is left on one side
        let small = world.add(ball(0.3, Vec3::new(0.099, 0.0, 1.0), Vec3::zeros(), slippery(0.5))).unwrap();
        step(&mut world, 240);
        assert!((position(&world, small).z - (1.0 - 0.5 * G)).abs() < 1e-9, "{stepper}");
        assert_eq!(position(&world, small).x, 0.099);
    }
}

#[test]
fn a_sphere_rests_in_the_hole_at_the_height_of_pythagoras() {
    for stepper in STEPPERS {
        for torus_first in [true, false] {
            let mut world = world(stepper, true);
            let large = || ball(0.45, Vec3::new(0.0, 0.0, 0.4), Vec3::zeros(), slippery(0.0));
            let id = if torus_first {
                ring(&mut world, slippery(0.0));
                world.add(large()).unwrap()
            } else {
                let id = world.add(large()).unwrap();
                ring(&mut world, slippery(0.0));
                id
            };
            step(&mut world, 480);
            // (r + s)² = R² + z²
            let height = ((MINOR + 0.45f64).powi(2) - MAJOR * MAJOR).sqrt();
            let at = position(&world, id);
            let within = 2.0 * world.settings().drift_tolerance * (MINOR + 0.45) / height;
            assert!((at.z - height).abs() < within, "{stepper}: {} is not {height}", at.z);
            assert!(at.xy().norm() < 1e-3, "{stepper}: {at}");
        }
    }
}

/// A sphere that strikes the tube off its top is reflected by the normal of the impact.
#[test]
fn a_sphere_is_reflected_by_the_tube() {
    let deflected = |stepper: &str, torus_first: bool, dt: f64| {
        let mut world = world(stepper, false);
        world.set_settings(world.settings().with_dt(dt)).unwrap();
        let struck = || ball(0.1, Vec3::new(MAJOR + 0.12, 0.0, 0.5), Vec3::new(0.0, 0.0, -1.0), slippery(1.0));
        let id = if torus_first {
            ring(&mut world, slippery(1.0));
            world.add(struck()).unwrap()
        } else {
            let id = world.add(struck()).unwrap();
            ring(&mut world, slippery(1.0));
            id
        };
        step(&mut world, (0.8 / dt) as usize);
        velocity(&world, id)
    };
    // centers 0.2 m apart and 0.12 m aside: n = (0.6, 0, 0.8), v' = v − 2·(v·n)·n
    let exact = Vec3::new(2.0 * 0.8 * 0.6, 0.0, 2.0 * 0.64 - 1.0);
    for stepper in STEPPERS {
        for torus_first in [true, false] {
            let [coarse, fine] = [1.0 / 60.0, 1.0 / 960.0].map(|dt| deflected(stepper, torus_first, dt));
            let errors = [coarse, fine].map(|v| (v - exact).norm());
            println!("{stepper}, {torus_first}: {errors:?}");
            assert!((fine.norm() - 1.0).abs() < 1e-9, "{stepper}: the speed stays: {fine}");
            assert!(errors[1] < 0.01 && errors[0] < 0.16, "{stepper}: {errors:?}");
        }
    }
}

/// An upright torus rolls down a slope at `g·sin α/(1 + I/(m·(R + r)²))`, and lies flat at the height of its tube.
#[test]
fn a_torus_rolls_down_a_slope_and_lies_on_the_ground() {
    let rough = Material { restitution: 0.0, friction: 1.0, ..Material::default() };
    for stepper in STEPPERS {
        let mut world = world(stepper, true);
        let slope = 0.1f64;
        // the slope falls along x: its normal leans to +x
        let plane = Pose::from_parts(Vec3::zeros().into(), Quat::from_axis_angle(&Vec3::y_axis(), slope));
        world.add(RigidBody::fixed(Shape::half_space()).with_pose(plane).with_material(rough)).unwrap();
        let normal = plane.rotation * Vec3::z();
        let upright = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
        let start = (MAJOR + MINOR) * normal;
        let torus = Torus::new(2.0, MAJOR, MINOR).unwrap();
        let torus = torus.with(|body| body.with_material(rough).with_pose(Pose::from_parts(start.into(), upright)));
        let id = world.add(torus).unwrap();
        step(&mut world, 240);
        let share = (MAJOR * MAJOR + 0.75 * MINOR * MINOR) / (MAJOR + MINOR).powi(2);
        let expected = G * slope.sin() / (1.0 + share); // m/s after 1 s
        let v = velocity(&world, id);
        assert!((v.norm() - expected).abs() < 2e-3 * expected, "{stepper}: {} is not {expected}", v.norm());
        assert!(v.normalize().dot(&(plane.rotation * Vec3::x())) > 0.999_99);
    }
    let mut flat = world("time_stepping", true);
    flat.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let torus = Torus::new(2.0, MAJOR, MINOR).unwrap();
    let id = flat.add(torus.with(|body| body.with_pose(Pose::translation(0.0, 0.0, 0.3)))).unwrap();
    step(&mut flat, 480);
    assert!((position(&flat, id).z - MINOR).abs() < 2.0 * flat.settings().drift_tolerance);
}

#[test]
fn a_shape_without_a_test_meets_the_shape_around() {
    let mut world = world("time_stepping", true);
    ring(&mut world, slippery(0.0));
    let block = RigidBody::new(Shape::cuboid(Vec3::repeat(0.2)).unwrap()).with_pose(Pose::translation(0.0, 0.0, 0.5));
    let block = world.add(block).unwrap();
    step(&mut world, 480);
    assert!((position(&world, block).z - (MINOR + 0.1)).abs() < 1e-3, "it lies on the cylinder");
}

#[test]
fn sensors_and_overlaps_are_those_of_the_test() {
    let mut world = world("time_stepping", false);
    let torus = world.add(Torus::new(1.0, MAJOR, MINOR).unwrap()).unwrap();
    let gate = |x: f64| RigidBody::new(sphere(0.2)).with_sensor(true).with_pose(Pose::translation(x, 0.0, 0.0));
    let (hole, tube) = (world.add(gate(0.0)).unwrap(), world.add(gate(0.65)).unwrap());
    step(&mut world, 1);
    assert!(world.touching(hole).is_empty());
    assert_eq!(world.touching(tube), [(torus, 0)]);
    let inside = world.add(ball(0.2, Vec3::zeros(), Vec3::zeros(), slippery(0.0))).unwrap();
    assert!(world.overlapping_pairs(0.0).is_empty(), "{inside:?} is in the hole");
    let deep = world.add(ball(0.2, Vec3::new(0.0, -0.7, 0.0), Vec3::zeros(), slippery(0.0))).unwrap();
    let pairs = world.overlapping_pairs(0.0);
    assert_eq!((pairs.len(), pairs[0].objects), (1, [torus, deep]));
    assert!((pairs[0].depth - 0.1).abs() < 1e-12, "{}", pairs[0].depth); // r + s − 0.2
}

#[test]
fn the_bits_are_the_same_for_forks_snapshots_and_threads() {
    let run = |threads: u32| {
        let mut world = world("time_stepping", true);
        world.set_settings(world.settings().with_threads(threads)).unwrap();
        ring(&mut world, slippery(0.3));
        for k in 0..60 {
            let at =
                Vec3::new(0.3 * (k % 5) as f64 - 0.6, 0.3 * (k / 5 % 4) as f64 - 0.5, 0.5 + 0.25 * (k / 20) as f64);
            world.add(ball(0.11, at, Vec3::zeros(), slippery(0.3))).unwrap();
        }
        step(&mut world, 100);
        let mut fork = world.fork();
        let saved = world.save();
        step(&mut world, 60);
        let end = world.save();
        step(&mut fork, 60);
        assert!(fork.save() == end);
        world.restore(&saved).unwrap();
        step(&mut world, 60);
        assert!(world.save() == end);
        end
    };
    assert!(run(1) == run(3));
}
