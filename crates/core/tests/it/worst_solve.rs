//! The report names the solve with the largest residual.

use crate::common::{cube, ground, world};
use tumble_core::collide::{Pose, Vec3};
use tumble_core::solver::SolverSettings;
use tumble_core::{Material, ObjectId, RigidBody, World};

/// A tower of 30 boxes whose boxes slide in various directions. It has 180 degrees of freedom and is
/// not at rest, so sweeps alone solve it, and one sweep does not carry the load of 30 boxes.
fn restless_tower(world: &mut World, x: f64) -> Vec<ObjectId> {
    let body = |i: usize| {
        let angle = 2.4 * i as f64;
        RigidBody::new(cube(0.4))
            .with_name(format!("tower {i}"))
            .with_material(Material::default())
            .with_pose(Pose::translation(x, 0.0, 0.4 * (i as f64 + 0.5)))
            .with_velocity(Vec3::new(angle.cos(), angle.sin(), 0.0))
    };
    (0..30).map(|i| world.add(body(i)).unwrap()).collect()
}

/// A box on the ground: one island, which is solved exactly.
fn quiet_box(world: &mut World, x: f64) -> ObjectId {
    let body = RigidBody::new(cube(0.4)).with_name("quiet").with_material(Material::default());
    world.add(body.with_pose(Pose::translation(x, 0.0, 0.2))).unwrap()
}

fn one_sweep(stepper: &str) -> World {
    let mut world = world(stepper, 1.0 / 240.0);
    let solver = SolverSettings { max_sweeps: 1, ..world.settings().solver_settings };
    world.set_settings(world.settings().with_solver_settings(solver)).unwrap();
    ground(&mut world, 0.0, 0.5);
    world
}

#[test]
fn the_report_names_the_island_that_one_sweep_does_not_solve() {
    for quiet_first in [true, false] {
        let mut world = one_sweep("time_stepping");
        let before = quiet_first.then(|| quiet_box(&mut world, -5.0));
        let tower = restless_tower(&mut world, 0.0);
        let quiet = before.unwrap_or_else(|| quiet_box(&mut world, -5.0));
        let report = *world.step().unwrap();
        let worst = report.worst_solve.expect("a solve with an error");
        assert!(report.unconverged == 1 && !worst.converged, "{report:?}");
        assert!(tower.contains(&worst.object) && worst.other.is_none_or(|other| tower.contains(&other)), "{report:?}");
        let contacts = world.contacts().iter().filter(|c| c.a != quiet && c.b != quiet).count();
        assert_eq!((worst.objects as usize, worst.rows as usize), (30, 3 * contacts));
        assert!(report.residual > worst.tolerance && (worst.tolerance - 1e-8).abs() < 1e-20, "{report:?}");
        let islands = world.islands();
        assert!(islands.contains(&tower), "{islands:?}");
        // a fork and an archive keep it
        assert_eq!(world.fork().report().worst_solve, Some(worst));
        let read = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
        let again = read.report().worst_solve.unwrap();
        assert_eq!(read.name(again.object), world.name(worst.object));
        assert_eq!((again.objects, again.rows, again.tolerance), (worst.objects, worst.rows, worst.tolerance));
    }
}

#[test]
fn a_frame_without_contacts_has_no_worst_solve() {
    for stepper in tumble_core::STEPPERS {
        let mut world = one_sweep(stepper);
        let body = RigidBody::new(cube(0.4)).with_pose(Pose::translation(0.0, 0.0, 5.0));
        world.add(body).unwrap();
        let report = *world.step().unwrap();
        assert_eq!((report.worst_solve, report.residual, report.unconverged), (None, 0.0, 0));
    }
}
