//! Contacts that no forces can satisfy: bounded and always reported.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

/// A box between two kinematic jaws that close: no velocity satisfies both contacts, so pivoting
/// ends on a ray.
#[test]
fn a_squeezed_body_ends_on_a_ray_which_is_reported_and_survived() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 60.0));
        world.set_solver(solver::by_name("lcp").unwrap());
        for (name, side) in [("left", -1.0), ("right", 1.0)] {
            let jaw = RigidBody::fixed(cube(0.4))
                .with_name(name)
                .with_material(Material { friction: 0.5, ..Material::default() })
                .with_pose(Pose::translation(0.3 * side, 0.0, 0.0));
            let jaw = world.add(jaw).unwrap();
            world.set_mode(jaw, Mode::Kinematic).unwrap();
            world.set_velocity(jaw, Vec3::new(-0.1 * side, 0.0, 0.0), Vec3::zeros()).unwrap();
        }
        let body = world
            .add(
                RigidBody::new(cube(0.2))
                    .with_name("box")
                    .with_mass(1.0)
                    .with_material(Material { friction: 0.5, ..Material::default() }),
            )
            .unwrap();
        let mut rays = 0;
        for _ in 0..10 {
            rays += world.step().unwrap().rays;
        }
        assert!(rays > 0, "{stepper}: the contradiction is not reported");
        assert!(
            position(&world, body).norm() < 0.1 && velocity(&world, body).norm() < 0.2,
            "{stepper}: thrown to {}",
            position(&world, body)
        );
    }
}

/// Painlevé's rod is pushed into the ground by its own friction. It must not gain energy or sink,
/// with any solver.
#[test]
fn painleves_rod_gains_no_energy_and_does_not_sink() {
    for stepper in STEPPERS {
        for name in solver::NAMES {
            let mut world = world(stepper, 1.0 / 240.0);
            world.set_solver(solver::by_name(name).unwrap());
            ground(&mut world, 0.0, 2.0);
            let (radius, half, tilt) = (0.01, 0.5, 0.9f64);
            let rod = RigidBody::new(tumble_core::collide::Shape::capsule(radius, 2.0 * half).unwrap())
                .with_name("rod")
                .with_mass(1.0)
                .with_material(Material { friction: 2.0, ..Material::default() });
            // the upper end leans back from the sliding direction, so that friction presses the
            // lower end down
            let pose = Pose::new(Vec3::new(0.0, 0.0, half * tilt.cos() + radius), Vec3::new(0.0, -tilt, 0.0));
            let id = world.add(rod.with_pose(pose).with_velocity(Vec3::new(-3.0, 0.0, 0.0))).unwrap();
            let start = world.energy().total();
            let mut highest = start;
            for _ in 0..240 {
                let report = *world.step().unwrap();
                assert!(report.max_penetration < 2e-3, "{stepper} {name}: sinks by {}", report.max_penetration);
                highest = highest.max(world.energy().total());
            }
            assert!(highest < start * (1.0 + 1e-6), "{stepper} {name}: energy from {start} to {highest}");
            assert!(position(&world, id).z > radius - 1e-4);
        }
    }
}
