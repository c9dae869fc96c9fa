//! Free motion: parabolas, spinning bodies, springs.

use crate::common::*;
use std::any::Any;
use tumble_core::collide::{Mat3, Vec3};
use tumble_core::*;

/// Body with I = (1, 2, 3) kg·m² spinning about its unstable axis.
fn tumbling(integrator: Integrator, stepper: &str, dt: f64) -> (World, ObjectId) {
    let mut world = no_gravity(world(stepper, dt));
    let settings = world.settings().with_integrator(integrator);
    world.set_settings(settings).unwrap();
    let body = RigidBody::new(sphere(1.0))
        .with_name("top")
        .with_mass_and_inertia(1.0, Mat3::from_diagonal(&Vec3::new(1.0, 2.0, 3.0)));
    let id = world.add(body.with_angular_velocity(Vec3::new(0.01, 5.0, 0.01))).unwrap();
    (world, id)
}

fn drift_of(mut world: World, seconds: f64) -> (f64, f64) {
    let (e0, l0) = (world.energy().kinetic, world.momentum().angular);
    let steps = (seconds / world.settings().dt).round() as usize;
    let (mut worst_e, mut worst_l) = (0.0f64, 0.0f64);
    for _ in 0..steps {
        world.step().unwrap();
        worst_e = worst_e.max((world.energy().kinetic / e0 - 1.0).abs());
        worst_l = worst_l.max((world.momentum().angular - l0).norm() / l0.norm());
    }
    (worst_e, worst_l)
}

#[test]
fn rk4_keeps_angular_momentum_and_energy_of_the_free_body() {
    let (world, _) = tumbling(Integrator::Rk4, "backtracking", 1.0 / 60.0);
    let (e, l) = drift_of(world, 20.0);
    assert!(l < 1e-12, "angular momentum drifts by {l:e}");
    assert!(e < 1e-6, "energy drifts by {e:e}");
}

#[test]
fn the_default_integrator_keeps_the_energy_of_the_free_body() {
    for stepper in STEPPERS {
        let (world, _) = tumbling(Integrator::default(), stepper, 1.0 / 60.0);
        let (e, l) = drift_of(world, 20.0);
        assert!(l < 1e-12 && e < 1e-3, "{stepper}: energy {e:e}, angular momentum {l:e}");
    }
}

/// Orientation at 2 s against steps 64 times shorter: the order of each integrator.
#[test]
fn integrators_converge_at_their_order() {
    for (integrator, order) in [
        (Integrator::ExplicitEuler, 1.0),
        (Integrator::SymplecticEuler, 1.0),
        (Integrator::Verlet, 2.0),
        (Integrator::Rk4, 4.0),
    ] {
        let at = |dt: f64| {
            let (mut world, id) = tumbling(integrator, "backtracking", dt);
            (0..(2.0 / dt).round() as usize).for_each(|_| {
                world.step().unwrap();
            });
            world.part_state(id, 0).unwrap().pose.rotation
        };
        let reference = {
            let (mut w, id) = tumbling(Integrator::Rk4, "backtracking", 1.0 / 3840.0);
            (0..7680).for_each(|_| {
                w.step().unwrap();
            });
            w.part_state(id, 0).unwrap().pose.rotation
        };
        let (coarse, fine) = (at(1.0 / 120.0).angle_to(&reference), at(1.0 / 240.0).angle_to(&reference));
        let measured = (coarse / fine).log2();
        assert!((measured - order).abs() < 0.35, "{integrator:?}: order {measured} ({coarse:e} to {fine:e})");
    }
}

#[test]
fn a_thrown_body_follows_the_parabola() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 60.0);
        let ball = world
            .add(RigidBody::new(sphere(0.1)).with_name("ball").with_mass(2.0).with_velocity(Vec3::new(3.0, 0.0, 4.0)))
            .unwrap();
        (0..60).for_each(|_| {
            world.step().unwrap();
        });
        let expected = Vec3::new(3.0, 0.0, 4.0 - 0.5 * G);
        assert!((position(&world, ball) - expected).norm() < 1e-12, "{stepper}: {}", position(&world, ball));
    }
}

#[test]
fn damping_is_exponential() {
    let mut world = no_gravity(world("backtracking", 1.0 / 240.0));
    let settings = world.settings().with_integrator(Integrator::Rk4);
    world.set_settings(settings).unwrap();
    let mut body = RigidBody::new(sphere(0.1))
        .with_name("ball")
        .with_mass(2.0)
        .with_velocity(Vec3::x())
        .with_angular_velocity(Vec3::z());
    (body.linear_damping, body.angular_damping) = (0.7, 0.3);
    let id = world.add(body).unwrap();
    (0..480).for_each(|_| {
        world.step().unwrap();
    });
    assert!((velocity(&world, id).x - (-1.4f64).exp()).abs() < 1e-10);
    assert!((world.part_state(id, 0).unwrap().angular_velocity.z - (-0.6f64).exp()).abs() < 1e-10);
}

/// A spring between a body and the origin: a custom force generator.
#[derive(Clone)]
struct Spring(ObjectId, f64);

impl Object for Spring {
    fn name(&self) -> &str {
        "spring"
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Spring {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        let (Some(part_state), Some(state_range)) = (view.part_state(self.0, 0), view.state_range(self.0)) else {
            return;
        };
        out.add_at(state_range.parts.start, part_state, -self.1 * part_state.position(), &part_state.position());
    }
}

#[test]
fn forces_are_taken_at_each_stage_so_a_spring_keeps_its_energy() {
    let _: &dyn Any = &Spring(ObjectId::default(), 0.0);
    for (stepper, integrator, bound) in [
        ("time_stepping", Integrator::Verlet, 2e-3),
        ("backtracking", Integrator::Verlet, 2e-3),
        ("backtracking", Integrator::SymplecticEuler, 5e-2),
        ("backtracking", Integrator::Rk4, 1e-4),
    ] {
        let mut world = no_gravity(world(stepper, 1.0 / 240.0));
        let settings = world.settings().with_integrator(integrator);
        world.set_settings(settings).unwrap();
        let body =
            RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0).with_velocity(Vec3::new(10.0, 0.0, 0.0));
        let id = world.add(body).unwrap();
        world.add(Spring(id, 100.0)).unwrap();
        let mut worst = 0.0f64;
        for _ in 0..240 * 20 {
            world.step().unwrap();
            let energy = world.energy().kinetic + 50.0 * position(&world, id).norm_squared();
            worst = worst.max((energy / 50.0 - 1.0).abs());
        }
        assert!(worst < bound, "{stepper} {integrator:?}: energy off by {worst:e}");
    }
}
