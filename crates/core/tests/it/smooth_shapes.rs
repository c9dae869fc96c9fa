//! Ellipsoids, cones and rounded boxes in motion: closed forms at several time steps, and conservation
//! laws.

use crate::common::*;
use tumble_core::collide::{Mat3, Pose, Quat, Shape, Vec3};
use tumble_core::*;

const G: f64 = 9.81;

fn floor(world: &mut World, friction: f64) -> Material {
    let material = Material { friction, restitution: 0.0, ..Material::default() };
    world.add_static(RigidBody::fixed(Shape::half_space()).with_name("floor").with_material(material)).unwrap();
    material
}

/// Returns the time between two downward zero crossings of a swing that starts at its turning point,
/// four quarters, by linear interpolation.
fn period(dt: f64, mut angle: impl FnMut() -> f64) -> f64 {
    let (mut crossings, mut last) = (Vec::new(), angle());
    for n in 1..200_000 {
        let next = angle();
        if last * next < 0.0 {
            crossings.push((n as f64 - 1.0 + last / (last - next)) * dt);
        }
        last = next;
        if crossings.len() == 5 {
            break;
        }
    }
    0.5 * (crossings[4] - crossings[0])
}

/// An ellipsoid that rocks without sliding about its lowest axis: with half axes `a` along x and `c`
/// upright the radius of curvature below is `a²/c`, so `ω² = g·(a²/c − c)·m/(I + m·c²)`.
#[test]
fn a_rocking_ellipsoid_has_the_period_of_its_curvature() {
    let (a, b, c) = (0.3, 0.2, 0.1);
    let inertia = (a * a + c * c) / 5.0;
    let exact = std::f64::consts::TAU * ((inertia + c * c) / (G * (a * a / c - c))).sqrt();
    for stepper in STEPPERS {
        let errors = [60.0, 120.0, 240.0].map(|rate| {
            let mut world = world(stepper, 1.0 / rate);
            let material = floor(&mut world, 10.0);
            let (tilt, shape) = (1e-3_f64, Shape::ellipsoid(2.0 * Vec3::new(a, b, c)).unwrap());
            // the height of the center over the tangent plane
            let height = (a * a * tilt.sin().powi(2) + c * c * tilt.cos().powi(2)).sqrt();
            let turn = Quat::from_euler_angles(0.0, tilt, 0.0);
            let body = RigidBody::new(shape)
                .with_material(material)
                .with_pose(Pose::from_parts(Vec3::new(0.0, 0.0, height).into(), turn));
            let id = world.add(body).unwrap();
            let measured = period(1.0 / rate, || {
                world.step().unwrap();
                (world.body(id).unwrap().pose().rotation * Vec3::x()).z
            });
            measured / exact - 1.0
        });
        println!("{stepper}: period {exact:.6} s, relative errors {errors:?}");
        // the amplitude adds about 8·tilt²; the leapfrog has −(ω·h)²/24
        let leapfrog = |rate: f64| -(std::f64::consts::TAU / exact / rate).powi(2) / 24.0;
        let factor = if stepper == "backtracking" { 1.5 } else { 1.1 };
        let most = [60.0, 120.0, 240.0].map(|rate| factor * leapfrog(rate).abs() + 2e-5);
        assert!(errors.iter().zip(most).all(|(error, most)| error.abs() < most), "{stepper}: {errors:?}");
    }
}

/// Without friction and without loss an ellipsoid that slides and tumbles on a plane keeps its energy and
/// the part of its angular momentum across the plane.
#[test]
fn an_ellipsoid_on_ice_keeps_its_energy() {
    for stepper in STEPPERS {
        let drift = [240.0, 480.0].map(|rate| {
            let mut world = world(stepper, 1.0 / rate);
            let material = floor(&mut world, 0.0);
            let shape = Shape::ellipsoid(2.0 * Vec3::new(0.15, 0.1, 0.08)).unwrap();
            let tilt = 0.2_f64;
            let height = (0.1_f64.powi(2) * tilt.sin().powi(2) + 0.08_f64.powi(2) * tilt.cos().powi(2)).sqrt();
            let body = RigidBody::new(shape).with_material(material).with_pose(Pose::from_parts(
                Vec3::new(0.0, 0.0, height).into(),
                Quat::from_euler_angles(tilt, 0.0, 0.0),
            ));
            world.add(body).unwrap();
            let start = world.energy().total();
            let mut worst: f64 = 0.0;
            for _ in 0..(2.0 * rate) as usize {
                world.step().unwrap();
                worst = worst.max((world.energy().total() - start).abs());
            }
            worst / start
        });
        println!("{stepper}: relative change of the energy within 2 s {drift:?}");
        assert!(drift[1] < 0.02, "{stepper}: {drift:?}");
    }
}

/// A cone that rolls on its side: its tip stays, its axis turns about the vertical at `Ω`, the body spins at
/// `ω = Ω·cot α` about the line of contact, `v = Ω·(3h/4)·cos α`.
#[test]
fn a_cone_rolls_about_its_tip() {
    let (radius, height) = (0.1_f64, 0.2_f64);
    let half_angle = (radius / height).atan();
    let turning = 1.5;
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 480.0);
        let material = floor(&mut world, 1.0);
        // on its side, tip at the origin: the axis from the tip falls to the line of contact by α
        let along = Vec3::new(-half_angle.cos(), 0.0, -half_angle.sin());
        let turn = Quat::rotation_between(&Vec3::z(), &along).unwrap();
        let center = -along * (0.75 * height);
        let body = RigidBody::new(Shape::cone(radius, height).unwrap())
            .with_material(material)
            .with_pose(Pose::from_parts(center.into(), turn))
            .with_velocity(Vec3::new(0.0, turning * center.x, 0.0))
            .with_angular_velocity(Vec3::new(-turning / half_angle.tan(), 0.0, 0.0));
        let id = world.add(body).unwrap();
        let start = world.energy().total();
        let time = 2.0;
        for _ in 0..(time * 480.0) as usize {
            world.step().unwrap();
        }
        let pose = world.body(id).unwrap().pose();
        let tip = pose * nalgebra::Point3::new(0.0, 0.0, 0.75 * height);
        let angle = pose.translation.y.atan2(pose.translation.x);
        let expected = (turning * time + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        let loss = 1.0 - world.energy().total() / start;
        println!("{stepper}: tip {:?}, angle {angle} for {expected}, energy lost {loss:e}", tip.coords);
        assert!(tip.coords.norm() < 0.01, "{stepper}: the tip moved to {tip:?}");
        assert!((angle - expected).abs() < 0.03, "{stepper}: {angle}, not {expected}");
        assert!(loss.abs() < 0.03, "{stepper}: {loss}");
    }
}

/// A rounded box slides as `v² = v₀² − 2·μ·g·s`, and stands on its faces.
#[test]
fn a_rounded_box_slides_by_coulombs_law() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let material = floor(&mut world, 0.3);
        let body = RigidBody::new(Shape::rounded_cuboid(Vec3::new(0.4, 0.3, 0.2), 0.05).unwrap())
            .with_material(material)
            .with_pose(Pose::translation(0.0, 0.0, 0.1))
            .with_velocity(Vec3::new(1.5, 0.0, 0.0));
        let id = world.add(body).unwrap();
        for _ in 0..240 {
            world.step().unwrap();
        }
        let pose = world.body(id).unwrap().pose();
        let way = 1.5 * 1.5 / (2.0 * 0.3 * G);
        println!("{stepper}: {} m for {way} m, height {}", pose.translation.x, pose.translation.z);
        assert!((pose.translation.x - way).abs() < 0.01, "{stepper}: {} for {way}", pose.translation.x);
        assert!((pose.translation.z - 0.1).abs() < 1e-3 && pose.rotation.angle() < 1e-2, "{stepper}: {pose:?}");
    }
}

/// A rounded box on its edge rolls over it without sliding: the energy of a fall about the rounding's
/// middle `C` is kept, `½·(I + m·d²(θ))·ω²`, `d` from the contact to the center of mass.
#[test]
fn a_rounded_box_rolls_over_its_edge() {
    let (size, rounding) = (0.2_f64, 0.05_f64);
    let shape = Shape::rounded_cuboid(Vec3::new(size, 0.4, size), rounding).unwrap();
    let unit = shape.mass_properties(1.0).unwrap();
    let (mass, inertia) = (unit.mass, unit.inertia[(1, 1)]);
    // from the middle of the rounding to the center; θ is its angle from the vertical
    let arm = std::f64::consts::SQRT_2 * (0.5 * size - rounding);
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 960.0);
        let material = floor(&mut world, 10.0);
        let start = 0.05_f64;
        let turn = Quat::from_euler_angles(0.0, std::f64::consts::FRAC_PI_4 + start, 0.0);
        let middle = Vec3::new(0.0, 0.0, rounding);
        let center = middle + arm * Vec3::new(start.sin(), 0.0, start.cos());
        let body =
            RigidBody::new(shape.clone()).with_material(material).with_pose(Pose::from_parts(center.into(), turn));
        let id = world.add(body).unwrap();
        let mut checked = 0;
        for _ in 0..960 {
            world.step().unwrap();
            let view = world.body(id).unwrap();
            let theta = (view.pose().rotation.angle() - std::f64::consts::FRAC_PI_4).abs();
            if theta > 0.6 {
                break;
            }
            if theta > 0.15 {
                // squared distance from the line of contact to the center
                let square = arm * arm + rounding * rounding + 2.0 * arm * rounding * theta.cos();
                let fall = mass * G * arm * (start.cos() - theta.cos());
                let omega = (2.0 * fall / (inertia + mass * square)).sqrt();
                let found = view.angular_velocity().y.abs();
                assert!((found / omega - 1.0).abs() < 0.01, "{stepper}: at {theta} rad {found}, not {omega} rad/s");
                checked += 1;
            }
        }
        assert!(checked > 50, "{stepper}: {checked}");
    }
}

/// A stone whose axes of inertia are turned against those of its surface rolls, rocks and spins without
/// sliding (the numbers of Kane and Levinson, *Realistic mathematical modeling of the rattleback*, 1982):
/// the energy is kept.
#[test]
fn a_spinning_stone_keeps_its_energy() {
    let worst = |spin: f64, rate: f64| {
        let mut world = world("time_stepping", 1.0 / rate);
        let material = floor(&mut world, 10.0);
        let inertia = Mat3::new(2e-4, -2e-5, 0.0, -2e-5, 16e-4, 0.0, 0.0, 0.0, 17e-4);
        let tilt = 0.5_f64.to_radians();
        let height = ((0.03 * tilt.sin()).powi(2) + (0.02 * tilt.cos()).powi(2)).sqrt();
        let body = RigidBody::new(Shape::ellipsoid(2.0 * Vec3::new(0.2, 0.03, 0.02)).unwrap())
            .with_mass_and_inertia(1.0, inertia)
            .with_center_of_mass(Vec3::new(0.0, 0.0, -0.01))
            .with_material(material)
            .with_pose(Pose::from_parts(Vec3::new(0.0, 0.0, height).into(), Quat::from_euler_angles(tilt, 0.0, 0.0)))
            .with_angular_velocity(Vec3::new(0.0, 0.0, spin));
        world.add(body).unwrap();
        let start = world.energy().total();
        let mut worst = 0.0_f64;
        for _ in 0..(4.0 * rate) as usize {
            world.step().unwrap();
            worst = worst.max((world.energy().total() / start - 1.0).abs());
        }
        println!("spin {spin} at {rate} Hz: energy within {worst:e}");
        worst
    };
    // it begins to rock, and turns about: the error is of second order
    let [coarse, fine] = [1920.0, 3840.0].map(|rate| worst(-5.0, rate));
    assert!(coarse > 3.5 * fine && fine < 1.5e-3, "{coarse}, {fine}");
    assert!(worst(5.0, 960.0) < 2e-5);
}
