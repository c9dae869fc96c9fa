//! Soft rows of constraints in a world: springs and drives that are solved together with all other
//! rows.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::rows::RowSet;
use tumble_core::*;

/// An implicit PD drive of a body's center along x, or any given row.
#[derive(Clone)]
struct Drive {
    body: ObjectId,
    set: RowSet,
    stiffness: f64,
    damping: f64,
    /// Target, m.
    place: f64,
    h: f64,
}

impl Object for Drive {
    fn name(&self) -> &str {
        "drive"
    }
    fn constraint(&self) -> Option<&dyn Constraint> {
        Some(self)
    }
}

impl Constraint for Drive {
    fn rows(&self, _me: &StateRange, view: &WorldView, _level: Level, out: &mut RowBuilder) {
        let p = view.part_state(self.body, 0).unwrap().position();
        let gain = self.damping + self.h * self.stiffness;
        let target = RowTarget {
            compliance: 1.0 / (self.h * gain),
            velocity: self.stiffness * (self.place - p.x) / gain,
            ..RowTarget::new(self.set, p.x - self.place)
        };
        out.row(target).on_point(self.body, 0, &p, &Vec3::x(), 1.0);
    }
}

fn ball(world: &mut World, mass: f64, v: f64) -> ObjectId {
    let ball = RigidBody::new(sphere(0.1))
        .with_name("ball")
        .with_mass(mass)
        .with_material(Material { friction: 0.0, ..Material::default() })
        .with_pose(Pose::translation(0.0, 0.0, 0.0));
    world.add(ball.with_velocity(Vec3::new(v, 0.0, 0.0))).unwrap()
}

/// `m·(v⁺ − v) = h·(kp·(q* − q − h·v⁺) − kd·v⁺)`; `time_stepping` evaluates `q` in the middle of
/// the step, after free motion.
#[test]
fn a_drive_gives_the_velocity_found_by_hand() {
    let (h, m, v, place) = (0.01, 2.0, 0.5, 0.3);
    for stepper in STEPPERS {
        for set in [RowSet::Equality, RowSet::Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY }] {
            for (stiffness, damping) in [(100.0, 0.0), (5000.0, 30.0), (0.0, 4.0)] {
                let mut world = no_gravity(world(stepper, h));
                let body = ball(&mut world, m, v);
                world.add(Drive { body, set, stiffness, damping, place, h }).unwrap();
                world.step().unwrap();
                let q = 0.5 * h * v;
                let expected = (m * v + h * stiffness * (place - q)) / (m + h * (damping + h * stiffness));
                let got = velocity(&world, body).x;
                assert!(
                    (got - expected).abs() < 1e-12,
                    "{stepper} {set:?} {stiffness} {damping}: {got}, by hand {expected}"
                );
            }
        }
    }
}

/// Under its weight a spring extends by `m·g/k`: it is not corrected in position as a joint would
/// be.
#[test]
fn a_soft_equality_is_a_spring_and_no_joint() {
    let (h, m, k) = (1.0 / 60.0, 2.0, 100.0);
    for stepper in STEPPERS {
        let mut world = world(stepper, h);
        world.set_settings(world.settings().with_gravity(Vec3::new(-9.81, 0.0, 0.0))).unwrap();
        let body = ball(&mut world, m, 0.0);
        world.add(Drive { body, set: RowSet::Equality, stiffness: k, damping: 30.0, place: 0.0, h }).unwrap();
        for _ in 0..600 {
            world.step().unwrap();
        }
        let x = position(&world, body).x;
        assert!((x + m * 9.81 / k).abs() < 1e-9, "{stepper}: {x}");
    }
}

/// An impact takes no time, so a spring has no effect in it: two balls of equal mass exchange their
/// velocities.
#[test]
fn a_spring_takes_no_part_in_an_impact() {
    let h = 1.0 / 240.0;
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, h));
        let at = |name: &str, x: f64, v: f64| {
            let ball = RigidBody::new(sphere(0.1))
                .with_name(name)
                .with_mass(1.0)
                .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
                .with_pose(Pose::translation(x, 0.0, 0.0));
            ball.with_velocity(Vec3::new(v, 0.0, 0.0))
        };
        let held = world.add(at("held", 0.0, 0.0)).unwrap();
        let comes = world.add(at("comes", -0.201, 1.0)).unwrap();
        // 1e-6 N·s/m: negligible in a step, but decisive if the row were rigid
        world.add(Drive { body: held, set: RowSet::Equality, stiffness: 0.0, damping: 1e-6, place: 0.0, h }).unwrap();
        world.step().unwrap();
        let (a, b) = (velocity(&world, held).x, velocity(&world, comes).x);
        assert!((a - 1.0).abs() < 1e-6 && b.abs() < 1e-6, "{stepper}: {a} {b}");
    }
}

#[test]
fn a_compliance_that_is_none_is_refused() {
    #[derive(Clone)]
    struct Row(ObjectId, f64);
    impl Object for Row {
        fn name(&self) -> &str {
            "row"
        }
        fn constraint(&self) -> Option<&dyn Constraint> {
            Some(self)
        }
    }
    impl Constraint for Row {
        fn rows(&self, _me: &StateRange, _view: &WorldView, _level: Level, out: &mut RowBuilder) {
            let target = RowTarget { compliance: self.1, ..RowTarget::new(RowSet::Equality, 0.0) };
            out.row(target).on_point(self.0, 0, &Vec3::zeros(), &Vec3::x(), 1.0);
        }
    }
    for stepper in STEPPERS {
        for compliance in [-1e-9, f64::NAN, f64::INFINITY] {
            let mut world = world(stepper, 0.01);
            let body = ball(&mut world, 1.0, 0.0);
            world.add(Row(body, compliance)).unwrap();
            let error = world.step().unwrap_err().to_string();
            assert!(
                error.contains("compliance") && error.contains(&format!("{compliance}")) && error.contains("'row'"),
                "{error}"
            );
        }
    }
}
