//! Paths of kinematic bodies: splines against polynomials that they contain, and what stands on a moving body.

use crate::common::*;
use std::sync::Arc;
use tumble_core::collide::{Pose, Quat, Vec3};
use tumble_core::*;

fn keys(points: &[(f64, f64)]) -> Vec<Keyframe> {
    points.iter().map(|&(time, x)| Keyframe { time, pose: Pose::translation(x, 2.0 * x, 0.0) }).collect()
}

/// Keyframes of a function at uneven times.
fn sampled(f: impl Fn(f64) -> f64) -> Vec<Keyframe> {
    keys(&[0.0, 0.3, 0.45, 0.8, 1.0].map(|t| (t, f(t))))
}

#[test]
fn splines_contain_the_polynomials_of_their_order() {
    // a clamped C2 spline is exact for a cubic that is at rest at both ends
    let cubic = Spline::new(sampled(|t| 3.0 * t * t - 2.0 * t * t * t), Smoothness::C2, Ends::Rest).unwrap();
    // C1 slopes are those of parabolas
    let parabola = Spline::new(sampled(|t| 1.0 - 2.0 * t + 3.0 * t * t), Smoothness::C1, Ends::Free).unwrap();
    // a natural C2 spline is exact for lines
    let line = Spline::new(sampled(|t| 2.0 - t), Smoothness::C2, Ends::Free).unwrap();
    for k in 1..100 {
        let t = f64::from(k) / 100.0;
        let cases = [
            (&cubic, 3.0 * t * t - 2.0 * t * t * t, 6.0 * t - 6.0 * t * t),
            (&parabola, 1.0 - 2.0 * t + 3.0 * t * t, 6.0 * t - 2.0),
            (&line, 2.0 - t, -1.0),
        ];
        for (spline, x, v) in cases {
            let point = spline.at(t);
            assert!((point.pose.translation.vector - Vec3::new(x, 2.0 * x, 0.0)).norm() < 1e-13);
            assert!((point.velocity - Vec3::new(v, 2.0 * v, 0.0)).norm() < 1e-12);
        }
    }
    let end = cubic.at(2.0);
    assert!(end.pose.translation.x == 1.0 && end.velocity == Vec3::zeros());
}

/// Largest jump of the velocity and of the acceleration over all keyframes, by differences.
fn jumps(spline: &Spline, times: &[f64]) -> [f64; 2] {
    let h = 1e-5;
    let acceleration = |t: f64| (spline.at(t + h / 2.0).velocity.x - spline.at(t - h / 2.0).velocity.x) / h;
    let jump = |t: &f64| {
        let v = (spline.at(t + 1e-9).velocity.x - spline.at(t - 1e-9).velocity.x).abs();
        [v, (acceleration(t + h) - acceleration(t - h)).abs()]
    };
    times.iter().map(jump).fold([0.0; 2], |most, j| [most[0].max(j[0]), most[1].max(j[1])])
}

#[test]
fn smoothness_is_what_it_says_at_the_seam_of_a_loop_too() {
    let points = keys(&[(0.0, 0.0), (0.4, 1.0), (0.7, -0.5), (1.3, 0.2), (2.0, 0.0)]);
    let times = [0.4, 0.7, 1.3, 2.0, 4.0];
    let c1 = jumps(&Spline::new(points.clone(), Smoothness::C1, Ends::Loop).unwrap(), &times);
    let c2 = jumps(&Spline::new(points.clone(), Smoothness::C2, Ends::Loop).unwrap(), &times);
    assert!(c1[0] < 1e-6 && c1[1] > 1.0, "{c1:?}");
    assert!(c2[0] < 1e-6 && c2[1] < 1e-2, "{c2:?}");
    let rest = Spline::new(points[..3].to_vec(), Smoothness::C2, Ends::Rest).unwrap();
    assert!(jumps(&rest, &[0.4])[1] < 1e-2);
    // natural: no acceleration at the ends
    let free = Spline::new(points[..4].to_vec(), Smoothness::C2, Ends::Free).unwrap();
    let bent = (free.at(1e-4).velocity.x - free.at(0.0).velocity.x) / 1e-4;
    assert!(bent.abs() < 0.05, "{bent}");
    // a loop of two pieces
    let two = keys(&[(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]);
    let two = Spline::new(two, Smoothness::C2, Ends::Loop).unwrap();
    assert!(two.at(0.0).velocity.norm() < 1e-12 && two.at(1.0).velocity.norm() < 1e-12);
    assert!(jumps(&two, &[1.0, 2.0])[1] < 1e-2);
}

#[test]
fn angular_velocity_is_the_derivative_of_the_orientation() {
    let turns = [0.0, 1.5, 3.0, 4.7, std::f64::consts::TAU];
    let pose = |a: f64| Pose::from_parts(Vec3::zeros().into(), Quat::from_axis_angle(&Vec3::z_axis(), a));
    let keys: Vec<Keyframe> = (0..).zip(turns).map(|(k, a)| Keyframe { time: f64::from(k), pose: pose(a) }).collect();
    let mixed = |k: usize| Quat::from_scaled_axis(Vec3::new(0.5, -0.3, 0.2) * k as f64) * keys[k].pose.rotation;
    let tilted: Vec<Keyframe> = (0..4)
        .map(|k| Keyframe { time: 0.7 * k as f64, pose: Pose::from_parts(Vec3::zeros().into(), mixed(k)) })
        .collect();
    for (spline, seam) in [
        (Spline::new(keys, Smoothness::C2, Ends::Loop).unwrap(), true),
        (Spline::new(tilted, Smoothness::C1, Ends::Free).unwrap(), false),
    ] {
        let h = 1e-6;
        for k in 1..400 {
            let t = f64::from(k) * if seam { 0.0201 } else { 0.005 };
            let (a, b) = (spline.at(t - h).pose.rotation, spline.at(t + h).pose.rotation);
            let w = (b * a.inverse()).scaled_axis() / (2.0 * h);
            assert!((w - spline.at(t).angular_velocity).norm() < 1e-6, "{t}: {w}");
        }
    }
}

#[test]
fn wrong_keyframes_are_refused() {
    let why = |keys: Vec<Keyframe>, ends| Spline::new(keys, Smoothness::C2, ends).unwrap_err().to_string();
    assert_eq!(why(keys(&[(0.0, 1.0)]), Ends::Rest), "a path has 1 keyframes; expected 2 to 10000");
    assert!(why(keys(&[(0.5, 1.0), (1.0, 1.0)]), Ends::Rest).starts_with("keyframe 1 has the time 0.5 s"));
    assert!(why(keys(&[(0.0, 1.0), (1.0, 1.0), (1.0, 2.0)]), Ends::Rest).starts_with("keyframe 3 has the time 1 s"));
    assert!(why(keys(&[(0.0, f64::NAN), (1.0, 1.0)]), Ends::Rest).starts_with("keyframe 1 has a number"));
    assert!(why(keys(&[(0.0, 0.0), (1.0, 1.0)]), Ends::Loop).starts_with("the first and the last pose"));
}

#[test]
fn a_body_on_a_path_is_on_it_with_its_exact_velocity_and_carries_what_stands_on_it() {
    for stepper in STEPPERS {
        for dt in [1.0 / 60.0, 1.0 / 240.0] {
            let mut world = world(stepper, dt);
            let top = RigidBody::fixed(cube(1.0)).with_name("lift").with_pose(Pose::translation(0.0, 0.0, -0.5));
            let friction = Material { friction: 0.6, ..Material::default() };
            let lift = world.add_boxed(Box::new(top.with_material(friction)), Mode::Kinematic).unwrap();
            let load = RigidBody::new(cube(0.2)).with_mass(1.0).with_material(friction);
            let load = world.add(load.with_pose(Pose::translation(0.1, 0.0, 0.1))).unwrap();
            // 1 m in 2 s: at most 6·1/4 = 1.5 m/s² along, less than μ·g
            let ends = [(0.0, 0.0), (2.0, 1.0)];
            let path = ends.map(|(time, x)| Keyframe { time, pose: Pose::translation(x, 0.0, -0.5) });
            let path = Arc::new(Spline::new(path.to_vec(), Smoothness::C2, Ends::Rest).unwrap());
            let event = ScriptedEvent::new("event", Trigger::Time { at: 0.5 });
            world.add(event.with_action(Action::MoveAlong { body: lift, path })).unwrap();
            let mut slip = 0.0f64;
            while world.time() < 3.0 - 1e-9 {
                world.step().unwrap();
                let u = ((world.time() - 0.5) / 2.0).clamp(0.0, 1.0);
                let (x, v) = (3.0 * u * u - 2.0 * u * u * u, 3.0 * u * (1.0 - u));
                assert!((position(&world, lift).x - x).abs() < 1e-9, "{stepper}, {dt}");
                assert!((velocity(&world, lift).x - v).abs() < 1e-9, "{stepper}, {dt}");
                slip = slip.max((position(&world, load).x - 0.1 - x).abs());
            }
            // by second order in the step, at the largest acceleration
            assert!(slip < 0.5 * 1.5 * dt * dt, "{stepper}, {dt}: it slips by {slip} m");
            let left = (position(&world, load).x - 1.1).abs();
            assert!(left < 0.2 * dt * dt, "{stepper}, {dt}: {left} m are left of it");
        }
    }
}
