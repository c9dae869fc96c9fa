//! Contacts that run over curved surfaces, ellipsoids and rims, from a start in motion: without friction they take no energy.

use crate::common::{no_gravity, world};
use nalgebra::{UnitQuaternion, Vector3};
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

fn smooth() -> Material {
    Material { friction: 0.0, restitution: 0.0, ..Material::default() }
}

/// A convex shape, with its point farthest along a direction in its frame.
struct Curved {
    shape: Shape,
    farthest: fn(&Vec3) -> Vec3,
}

fn ellipsoid() -> Curved {
    let farthest = |n: &Vec3| {
        let half = Vec3::new(0.25, 0.15, 0.125);
        half.component_mul(&half).component_mul(n) / half.component_mul(n).norm()
    };
    Curved { shape: Shape::ellipsoid(Vec3::new(0.5, 0.3, 0.25)).unwrap(), farthest }
}

fn circle(n: &Vec3, radius: f64, height: f64) -> Vec3 {
    Vec3::new(n.x, n.y, 0.0) * (radius / n.xy().norm()) + height * Vec3::z()
}

/// A cylinder that touches with its lower or upper rim.
fn cylinder() -> Curved {
    let farthest = |n: &Vec3| circle(n, 0.2, 0.15f64.copysign(n.z));
    Curved { shape: Shape::cylinder(0.2, 0.3).unwrap(), farthest }
}

fn rounded_cylinder() -> Curved {
    let farthest = |n: &Vec3| circle(n, 0.15, 0.1f64.copysign(n.z)) + 0.05 * n;
    Curved { shape: Shape::rounded_cylinder(0.2, 0.3, 0.05).unwrap(), farthest }
}

/// A cone that touches with its rim.
fn cone() -> Curved {
    Curved { shape: Shape::cone(0.2, 0.5).unwrap(), farthest: |n| circle(n, 0.2, -0.125) }
}

fn ball() -> Curved {
    Curved { shape: Shape::sphere(0.3).unwrap(), farthest: |n| 0.3 * n }
}

/// Change of the energy of a body of 2 kg that spins, and presses on a fixed one by a force, from a start in contact, in parts
/// of it, after 0.1 s.
fn change(moving: &Curved, fixed: &Curved, stepper: &str, rate: f64) -> f64 {
    let exact = stepper == "dp";
    let mut world = no_gravity(world(if exact { "backtracking" } else { stepper }, 1.0 / rate));
    let normal = Vec3::new(0.2, -0.3, 1.0).normalize();
    let mut settings = world.settings().with_gravity(-20.0 * normal);
    if exact {
        settings = settings.with_integrator(Integrator::DormandPrince).with_integrator_tolerance(1e-10);
    }
    world.set_settings(settings).unwrap();
    let [on, under] =
        [Vector3::new(0.4, -0.5, 0.2), Vector3::new(-0.3, 0.2, 0.6)].map(UnitQuaternion::from_scaled_axis);
    let touching = under * (fixed.farthest)(&(under.inverse() * normal));
    let arm = on * (moving.farthest)(&(on.inverse() * -normal));
    let below = RigidBody::fixed(fixed.shape.clone()).with_material(smooth());
    world.add_static(below.with_pose(Pose::from_parts(Vec3::zeros().into(), under))).unwrap();
    let spin = Vec3::new(0.8, -1.0, 1.5);
    // the bodies do not part or meet
    let velocity = -normal * normal.dot(&spin.cross(&arm)) + Vec3::new(0.3, 0.1, 0.0)
        - normal * normal.dot(&Vec3::new(0.3, 0.1, 0.0));
    let body = RigidBody::new(moving.shape.clone()).with_mass(2.0).with_material(smooth()).with_angular_velocity(spin);
    let id = world.add(body.with_pose(Pose::from_parts((touching - arm).into(), on)).with_velocity(velocity)).unwrap();
    let before = world.energy().total();
    let kinetic = world.energy().kinetic;
    (0..(0.1 * rate).round() as usize).for_each(|_| {
        world.step().unwrap();
    });
    assert!(world.contacts().iter().any(|c| c.a == id || c.b == id), "it stays in contact");
    let change = (world.energy().total() - before) / kinetic;
    println!("{:?}, {stepper} at {rate} Hz: {change:.1e}", [&moving.shape, &fixed.shape].map(name));
    change
}

fn name(shape: &Shape) -> &'static str {
    match shape {
        Shape::Ellipsoid { .. } => "ellipsoid",
        Shape::Cone { .. } => "cone",
        Shape::RoundedCylinder { .. } => "rounded cylinder",
        Shape::Cylinder(_) => "cylinder",
        _ => "ball",
    }
}

#[test]
fn contacts_that_run_over_curved_surfaces_take_no_energy() {
    // largest change with `dormand_prince`: the rounded rim rolls off its middle
    for (name, moving, fixed, exact) in [
        ("ellipsoid on ball", ellipsoid(), ball(), 1e-8),
        ("ellipsoid on ellipsoid", ellipsoid(), ellipsoid(), 1e-8),
        ("ball on ellipsoid", ball(), ellipsoid(), 1e-9),
        ("rim on ball", cylinder(), ball(), 2e-6),
        ("rounded rim on ball", rounded_cylinder(), ball(), 2e-4),
        ("cone on ball", cone(), ball(), 2e-6),
        ("cone on ellipsoid", cone(), ellipsoid(), 2e-7),
        ("ball on cylinder", ball(), cylinder(), 2e-8),
    ] {
        let of = |stepper: &str, rate: f64| change(&moving, &fixed, stepper, rate).abs();
        of("time_stepping", 60.0);
        let steps = [240.0, 480.0, 960.0].map(|rate| of("time_stepping", rate));
        let second_order = steps[0] > 2.9 * steps[1] && steps[1] > 2.9 * steps[2] && steps[2] < 2e-4;
        assert!(second_order, "{name}, time_stepping at 240, 480, 960 Hz: {steps:?}");
        for (rate, most) in [(60.0, 5e-3), (120.0, 1e-3), (240.0, 1e-4), (960.0, 3e-5)] {
            let found = of("backtracking", rate);
            assert!(found < most, "{name}, backtracking at {rate} Hz: {found:e}");
        }
        for rate in [60.0, 120.0, 240.0, 960.0] {
            let found = of("dp", rate);
            assert!(found < exact, "{name}, dormand_prince at {rate} Hz: {found:e}");
        }
    }
}

/// Energy of an ellipsoid after 0.4 s, of which it has fallen obliquely on a plane, J.
fn after_a_fall(stepper: &str, rate: f64) -> f64 {
    let exact = stepper == "dp";
    let mut world = world(if exact { "backtracking" } else { stepper }, 1.0 / rate);
    if exact {
        let settings = world.settings().with_integrator(Integrator::DormandPrince);
        world.set_settings(settings).unwrap();
    }
    world.add_static(RigidBody::fixed(Shape::half_space()).with_material(smooth())).unwrap();
    let turn = UnitQuaternion::from_scaled_axis(0.9 * Vector3::new(1.0, 2.0, 0.5).normalize());
    let body =
        RigidBody::new(Shape::ellipsoid(Vec3::new(0.5, 0.3, 0.25)).unwrap()).with_mass(6.0).with_material(smooth());
    let body = body.with_pose(Pose::from_parts(Vec3::new(0.0, 0.0, 0.6).into(), turn));
    let body = body.with_velocity(Vec3::new(0.9, -1.4, -3.0)).with_angular_velocity(Vec3::new(-5.0, -0.9, -3.3));
    world.add(body).unwrap();
    (0..(0.4 * rate).round() as usize).for_each(|_| {
        world.step().unwrap();
    });
    world.energy().total()
}

#[test]
fn an_ellipsoid_that_strikes_obliquely_approaches_its_energy() {
    let exact = after_a_fall("dp", 960.0);
    for (stepper, rate, most) in [
        ("time_stepping", 60.0, 0.4),
        ("time_stepping", 240.0, 0.06),
        ("time_stepping", 960.0, 2e-3),
        ("backtracking", 240.0, 2e-3),
        ("backtracking", 960.0, 2e-5),
    ] {
        let error = after_a_fall(stepper, rate) / exact - 1.0;
        println!("{stepper} at {rate} Hz: {error:.1e} of {exact:.3} J");
        assert!(error.abs() < most, "{stepper} at {rate} Hz: {error}");
    }
}
