//! Comparison of the recorded path with integrations that end at the same times, and of the
//! exponential map's differential with finite differences.

use super::Adaptive;
use crate::derived::Derived;
use crate::integrators::context::IntegrationContext;
use crate::object::part_state::{Forces, PartState, StateRange, Wrench};
use crate::object::{ForceGenerator, Object};
use crate::rigid::RigidBody;
use crate::rigid::rotation;
use crate::settings::Settings;
use crate::threads::Threads;
use crate::world::ObjectState;
use crate::world::view::{Table, WorldView};
use tumble_collide::{Mat3, Quat, Shape, Vec3};

/// A spring that pulls part 0 of the first object to the origin and twists it.
#[derive(Clone)]
struct Spring;

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
        let part_state = &view.part_states[0];
        out.wrenches[0].force -= 100.0 * part_state.position();
        out.wrenches[0].torque +=
            3.0 * (part_state.pose.rotation * Vec3::x()) + Vec3::new((5.0 * view.time).cos(), 0.0, 0.0);
    }
}

/// A world of one body and its spring, without a stepper.
struct Bench {
    table: Table,
    states: [ObjectState; 2],
    x: Vec<f64>,
    derived: Derived,
    forces: Forces,
    applied: Vec<Wrench>,
    held: Vec<f64>,
}

impl Bench {
    fn new() -> Bench {
        let inertia = Mat3::from_diagonal(&Vec3::new(1.0, 2.0, 3.0));
        let body = RigidBody::new(Shape::sphere(1.0).unwrap())
            .with_name("top")
            .with_mass_and_inertia(1.0, inertia)
            .with_velocity(Vec3::new(10.0, 0.0, 3.0))
            .with_angular_velocity(Vec3::new(0.1, 5.0, 2.0));
        let mut table = Table::default();
        let mut x = vec![0.0; 13];
        crate::object::Integratable::write_initial(&body, &mut x);
        let state_ranges =
            [StateRange { x: 0..13, v: 0..6, parts: 0..1 }, StateRange { x: 13..13, v: 6..6, parts: 1..1 }];
        let objects: [Box<dyn Object>; 2] = [Box::new(body), Box::new(Spring)];
        let caches = objects.iter().map(|object| object.new_cache()).collect();
        for (object, state_range) in objects.into_iter().zip(state_ranges) {
            table.push("".into(), object, state_range);
        }
        table.gather();
        Bench {
            table,
            states: Default::default(),
            x,
            derived: Derived { part_states: vec![PartState::default()], caches },
            forces: Forces::default(),
            applied: vec![Wrench::default()],
            held: vec![0.0; 6],
        }
    }

    fn integration(&mut self) -> IntegrationContext<'_> {
        IntegrationContext {
            threads: &Threads::NONE,
            table: &self.table,
            states: &self.states,
            x: &mut self.x,
            derived: &mut self.derived,
            forces: &mut self.forces,
            gravity: Vec3::zeros(),
            implicit: false,
            applied: &self.applied,
            applied_generalized: &[0.0; 6],
            held: &self.held,
            held_wrenches: &[],
        }
    }
}

/// Integrates over `h` and keeps the record.
fn integrate(bench: &mut Bench, tolerance: f64, h: f64) -> Adaptive {
    let mut adaptive = Adaptive::default();
    adaptive.set(&Settings { integrator_tolerance: tolerance, dt: 1.0, ..Settings::default() }, 0.0, 0);
    let came = adaptive.integrate(&mut bench.integration(), 0.0, h, &mut [0.0; 6], true).unwrap();
    assert_eq!(came, h);
    adaptive
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn dense_output_is_as_good_as_the_steps() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let mut bench = Bench::new();
        let adaptive = integrate(&mut bench, tolerance, 0.5);
        let (end, mut worst) = (bench.x.clone(), 0.0f64);
        for i in 1..=50 {
            let t = 0.01 * i as f64;
            adaptive.path.write(&mut bench.integration(), t);
            let mut fine = Bench::new();
            integrate(&mut fine, 1e-13, t);
            worst = worst.max(apart(&bench.x, &fine.x));
        }
        println!(
            "tolerance {tolerance:e}: {worst:e} in {} steps; at the end {:e}",
            adaptive.steps,
            apart(&bench.x, &end)
        );
        assert!(worst < 10.0 * tolerance, "tolerance {tolerance:e}: the dense output is off by {worst:e}");
        assert!(apart(&bench.x, &end) < 1e-14 * 10.0, "its end is the end of the last step");
    }
}

/// The rotation from `exp(θ)` to `exp(θ + h·pull_back(θ, ω))` is `h·ω`, to second order in `h` by
/// central differences.
#[test]
fn the_pulled_back_rate_turns_with_the_velocity() {
    for size in [1e-6, 1e-3, 0.09, 0.11, 1.0, 3.0] {
        for (theta, omega) in [
            (Vec3::new(1.0, 2.0, -1.0), Vec3::new(0.4, -0.3, 0.9)),
            (Vec3::new(0.0, 0.0, 1.0), Vec3::new(1.0, 0.2, 0.5)),
        ] {
            let theta = theta.normalize() * size;
            let rate = rotation::pull_back(&theta, &omega);
            let (h, q) = (1e-5, Quat::identity());
            let (after, before) =
                (rotation::turn(&q, &(theta + h * rate), 1.0), rotation::turn(&q, &(theta - h * rate), 1.0));
            let turned = (after * before.inverse()).imag() / h;
            assert!((turned - omega).norm() < 1e-8, "at |θ| = {size}: it turns with {turned}, not {omega}");
        }
    }
}

#[test]
fn a_full_record_ends_the_call_early() {
    let mut bench = Bench::new();
    let mut adaptive = Adaptive::default();
    // a state of 13 and 6 degrees of freedom takes 61 numbers a step: 68,759 steps fit into 2²²
    adaptive.set(&Settings { integrator_tolerance: 1e-6, dt: 1e-3, ..Settings::default() }, 0.0, 0);
    let came = adaptive.integrate(&mut bench.integration(), 0.0, 100.0, &mut [0.0; 6], true).unwrap();
    assert_eq!(adaptive.steps, 68_759);
    assert!(
        (came - 68.759).abs() < 1e-3 && adaptive.path.reaches(came) && !adaptive.path.extends_beyond(came),
        "{came}"
    );
}
