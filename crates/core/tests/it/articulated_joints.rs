//! Forces on joints: limits, drives, friction, springs, recorded motions, couplings, torques;
//! and joints that cannot move.

use crate::articulated_world::{adaptive, chain, hinged, rod, run, world};
use std::sync::Arc;
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::{
    ArticulatedBody, Coupling, DofSettings, Drive, Integrator, Joint, LinkMass, ModelBuilder, Playback, Spring,
    StepError, World,
};

/// No gravity, and one rod of 1 kg and 0.6 m: its moment of inertia about the joint is 0.12 kg·m².
fn arm(stepper: &str, dof: DofSettings) -> World {
    let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
    world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
    let mut body = ArticulatedBody::new("arm", hinged(1, 0.6, rod(1.0, 0.6)));
    body.set_dof(0, dof).unwrap();
    world.add(body).unwrap();
    world
}

fn state(world: &World) -> &[f64] {
    world.state_of(world.ids()[0]).unwrap()
}

#[test]
fn a_limit_is_not_passed_in_time_stepping() {
    let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
    let mut body = chain(2, 1.5);
    body.set_dof(0, DofSettings { limits: Some([-0.3, 2.0]), ..DofSettings::default() }).unwrap();
    body.set_dof(1, DofSettings { limits: Some([-1.0, 1.0]), ..DofSettings::default() }).unwrap();
    world.add(body).unwrap();
    let (mut worst, mut reached): (f64, bool) = (0.0, false);
    for _ in 0..240 * 10 {
        world.step().unwrap();
        let q = state(&world);
        worst = worst.max(-0.3 - q[0]).max(q[0] - 2.0).max(q[1].abs() - 1.0);
        reached |= q[0] < -0.299;
    }
    println!("limits passed by {worst:.1e} rad at most");
    assert!(reached && worst < 1e-4, "{worst}");
}

#[test]
fn a_limit_is_found_in_time_by_backtracking() {
    for integrator in [Integrator::Verlet, Integrator::DormandPrince] {
        let mut world = world(1.0 / 60.0, "backtracking", integrator);
        let mut body = chain(1, 1.5);
        body.set_dof(0, DofSettings { limits: Some([0.3, 2.0]), ..DofSettings::default() }).unwrap();
        world.add(body).unwrap();
        let mut worst: f64 = 0.0;
        for _ in 0..120 {
            world.step().unwrap();
            worst = worst.max(0.3 - state(&world)[0]);
        }
        let rest = state(&world);
        assert!(
            worst < 1e-6 && (rest[0] - 0.3).abs() < 1e-6 && rest[1].abs() < 1e-6,
            "{integrator:?}: {worst:.1e}, at rest {rest:?}"
        );
    }
}

#[test]
fn a_torque_gives_its_acceleration() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = arm(stepper, DofSettings::default());
        for _ in 0..240 {
            world.apply_generalized(world.ids()[0], &[0.06]).unwrap();
            world.step().unwrap();
        }
        let (q, v) = (state(&world)[0], state(&world)[1]);
        assert!((q - 0.25).abs() < 1e-9 && (v - 0.5).abs() < 1e-9, "{stepper}: {q} {v}");
        world.step().unwrap();
        assert!((state(&world)[1] - v).abs() < 1e-12, "{stepper}: the torque is for one frame");
    }
    let mut world = arm("time_stepping", DofSettings::default());
    let id = world.ids()[0];
    assert!(world.apply_generalized(id, &[1.0, 2.0]).is_err() && world.apply_generalized(id, &[f64::NAN]).is_err());
    world.apply_generalized(id, &[0.5]).unwrap();
    world.apply_generalized(id, &[0.25]).unwrap();
    assert!(world.set_applied_generalized(id, &[f64::INFINITY]).is_err());
    assert_eq!(world.applied_generalized(id), Some(&[0.75][..]));
    world.set_applied_generalized(id, &[0.1]).unwrap();
    assert_eq!(world.applied_generalized(id), Some(&[0.1][..]));
    world.step().unwrap();
    assert_eq!(world.applied_generalized(id), Some(&[0.0][..]));
}

#[test]
fn damping_decays_and_a_spring_swings() {
    // v = v0·exp(−c·t/I) with c/I = 2/s; implicit Euler is (1 + h·c/I)^−n, exactly
    let damped = DofSettings { damping: 0.24, ..DofSettings::default() };
    for (stepper, want) in [("time_stepping", (1.0_f64 + 2.0 / 240.0).powi(-240)), ("backtracking", (-2.0_f64).exp())] {
        let mut world = arm(stepper, damped.clone());
        world.set_settings(world.settings().with_integrator(Integrator::DormandPrince)).unwrap();
        let id = world.ids()[0];
        world.write_state_of(id, &[0.0, 1.0]).unwrap();
        run(&mut world, 1.0);
        assert!((state(&world)[1] - want).abs() < 1e-4 * want, "{stepper}: {} {want}", state(&world)[1]);
    }
    let mut world = arm("time_stepping", DofSettings { damping: 1e6, ..DofSettings::default() });
    let id = world.ids()[0];
    world.write_state_of(id, &[0.0, 1.0]).unwrap();
    run(&mut world, 0.1);
    assert!(state(&world)[1].abs() < 1e-9, "stiff damping stops and does not explode");
    // a spring of k = 0.12·(2π)² swings once a second
    let mut world = arm(
        "time_stepping",
        DofSettings {
            spring: Some(Spring { stiffness: 0.12 * 4.0 * std::f64::consts::PI.powi(2), rest: 0.2 }),
            ..DofSettings::default()
        },
    );
    let start = world.energy().total();
    run(&mut world, 3.5);
    assert!((state(&world)[0] - 0.4).abs() < 1e-4, "{}", state(&world)[0]);
    assert!((world.energy().total() - start).abs() < 1e-3 * start, "the energy of the spring counts");
}

#[test]
fn dry_friction_holds_up_to_its_torque_and_slows_by_it() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = arm(stepper, DofSettings { friction: 0.06, ..DofSettings::default() });
        let id = world.ids()[0];
        for _ in 0..240 {
            world.apply_generalized(id, &[0.0599]).unwrap();
            world.step().unwrap();
        }
        assert!(state(&world)[0].abs() < 1e-9, "{stepper}: held");
        // ω̇ = −0.06/0.12: stops from 1 rad/s after 2 s and 1 rad
        world.write_state_of(id, &[0.0, 1.0]).unwrap();
        run(&mut world, 3.0);
        assert!(
            (state(&world)[0] - 1.0).abs() < 1e-4 && state(&world)[1].abs() < 1e-9,
            "{stepper}: {:?}",
            state(&world)
        );
    }
}

#[test]
fn drives_hold_turn_and_keep_to_their_torque() {
    for stepper in ["time_stepping", "backtracking"] {
        // without gravity, a position drive reaches its target, stiff or soft
        let position =
            Drive::Position { stiffness: 30.0, damping: 4.0, target: 0.7, velocity: 0.0, limit: f64::INFINITY };
        let mut world = arm(stepper, DofSettings { drive: position, ..DofSettings::default() });
        run(&mut world, 4.0);
        assert!((state(&world)[0] - 0.7).abs() < 1e-6, "{stepper}: {:?}", state(&world));
        let mut world = arm(
            stepper,
            DofSettings { drive: Drive::Velocity { target: 0.5, limit: f64::INFINITY }, ..DofSettings::default() },
        );
        run(&mut world, 2.0);
        assert!(
            (state(&world)[1] - 0.5).abs() < 1e-9 && (state(&world)[0] - 1.0).abs() < 3e-3,
            "{stepper}: {:?}",
            state(&world)
        );
        // 0.06 N·m on 0.12 kg·m² for one second give 0.5 rad/s, whatever the target
        for drive in [
            Drive::Velocity { target: 9.0, limit: 0.06 },
            Drive::Position { stiffness: 1e5, damping: 10.0, target: 50.0, velocity: 0.0, limit: 0.06 },
            Drive::Playback { motion: Arc::new(Playback::new(vec![0.0, 1.0], vec![0.0, 100.0]).unwrap()), limit: 0.06 },
        ] {
            let mut world = arm(stepper, DofSettings { drive: drive.clone(), ..DofSettings::default() });
            run(&mut world, 1.0);
            assert!((state(&world)[1] - 0.5).abs() < 1e-6, "{stepper} {drive:?}: {:?}", state(&world));
        }
    }
    // extremely stiff: k·h² is 10⁴ times the inertia
    let stiff = Drive::Position { stiffness: 1e8, damping: 1e5, target: 0.7, velocity: 0.0, limit: f64::INFINITY };
    let mut world = arm("time_stepping", DofSettings { drive: stiff, ..DofSettings::default() });
    run(&mut world, 2.0);
    assert!((state(&world)[0] - 0.7).abs() < 1e-6, "{:?}", state(&world));
}

#[test]
fn a_recorded_motion_is_followed_exactly() {
    let times: Vec<f64> = (0..=50).map(|i| 0.04 * i as f64).collect();
    let wave = Arc::new(
        Playback::repeating(times.clone(), times.iter().map(|t| (std::f64::consts::PI * t).sin()).collect()).unwrap(),
    );
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
        let mut body = chain(2, 0.0);
        body.set_dof(
            0,
            DofSettings {
                drive: Drive::Playback { motion: wave.clone(), limit: f64::INFINITY },
                ..DofSettings::default()
            },
        )
        .unwrap();
        world.add(body).unwrap();
        let mut worst: f64 = 0.0;
        for _ in 0..240 * 3 {
            world.step().unwrap();
            worst = worst.max((state(&world)[0] - wave.at(world.time()).0).abs());
        }
        println!("{stepper}: off the recorded motion by {worst:.1e} rad at most");
        assert!(worst < 1e-6, "{stepper}: {worst}");
    }
}

#[test]
fn a_coupled_joint_follows() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
        let mut body = chain(3, 1.0).with_positions(&[1.0, 0.3, -1.9]).unwrap();
        body.couple(Coupling { dof: 2, of: 0, multiplier: -2.0, offset: 0.1 }).unwrap();
        world.add(body).unwrap();
        let start = world.energy().total();
        let (mut worst, mut swing): (f64, f64) = (0.0, 0.0);
        for _ in 0..240 * 5 {
            world.step().unwrap();
            let x = state(&world);
            worst = worst.max((x[2] + 2.0 * x[0] - 0.1).abs());
            swing = swing.max((world.energy().total() - start).abs());
        }
        println!("{stepper}: coupling off by {worst:.1e} rad, energy by {swing:.1e} J");
        assert!(worst < 1e-6, "{stepper}: {worst}");
    }
    let mut body = chain(2, 0.0);
    assert!(body.couple(Coupling { dof: 0, of: 0, multiplier: 1.0, offset: 0.0 }).is_err());
}

/// Three revolute joints in one place on massless links, about z, y and x.
fn gimbals(middle: f64) -> ArticulatedBody {
    let mut builder = ModelBuilder::new();
    let outer = builder.link("outer", None, Joint::revolute(Vec3::z()), Pose::identity(), LinkMass::none());
    let inner = builder.link("inner", Some(outer), Joint::revolute(Vec3::y()), Pose::identity(), LinkMass::none());
    let top = LinkMass {
        mass: 1.0,
        center: Vec3::new(0.0, 0.0, 0.1),
        inertia: Mat3::from_diagonal(&Vec3::new(0.01, 0.01, 0.02)),
    };
    builder.link("top", Some(inner), Joint::revolute(Vec3::x()), Pose::identity(), top);
    ArticulatedBody::new("gimbals", builder.build().unwrap()).with_positions(&[0.0, middle, 0.0]).unwrap()
}

#[test]
fn gimbal_lock_is_an_error_that_says_so_and_nothing_is_lost() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
        let id = world.add(gimbals(std::f64::consts::FRAC_PI_2)).unwrap();
        let before = world.state().to_vec();
        let error = world.step().unwrap_err();
        assert!(matches!(error, StepError::Singular { .. }), "{error}");
        let text = error.to_string();
        assert!(text.contains("gimbals") && text.contains("outer") && text.contains("spherical"), "{text}");
        assert_eq!(world.state(), before, "the state is put back");
        world.write_state_of(id, &[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        run(&mut world, 0.1);
    }
}

#[test]
fn a_stack_of_hinges_is_a_ball_joint_away_from_its_lock() {
    // the same top on a spherical joint: the same position after some time, by two sets of
    // coordinates
    let mut stacked = adaptive(1.0 / 60.0, 1e-10);
    let a = stacked.add(gimbals(0.3).with_velocities(&[1.0, 0.5, 2.0]).unwrap()).unwrap();
    let part_state = *stacked.part_state(a, 2).unwrap();
    let mut builder = ModelBuilder::new();
    let top = LinkMass {
        mass: 1.0,
        center: Vec3::new(0.0, 0.0, 0.1),
        inertia: Mat3::from_diagonal(&Vec3::new(0.01, 0.01, 0.02)),
    };
    builder.link("top", None, Joint::Spherical, Pose::identity(), top);
    let spin = part_state.pose.rotation.inverse_transform_vector(&part_state.angular_velocity);
    let body = ArticulatedBody::new("top", builder.build().unwrap())
        .with_positions(part_state.pose.rotation.coords.as_slice())
        .unwrap();
    let mut whole = adaptive(1.0 / 60.0, 1e-10);
    let b = whole.add(body.with_velocities(spin.as_slice()).unwrap()).unwrap();
    for _ in 0..30 {
        run(&mut stacked, 1.0 / 60.0);
        run(&mut whole, 1.0 / 60.0);
    }
    let (a, b) = (stacked.part_state(a, 2).unwrap(), whole.part_state(b, 0).unwrap());
    assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-7, "{}", a.pose.rotation.angle_to(&b.pose.rotation));
}

#[test]
fn invalid_input_is_reported() {
    let model = || hinged(2, 0.2, rod(1.0, 0.2));
    let mut body = ArticulatedBody::new("arm", model());
    let wrong = [
        DofSettings { damping: -1.0, ..DofSettings::default() },
        DofSettings { friction: f64::NAN, ..DofSettings::default() },
        DofSettings { limits: Some([1.0, -1.0]), ..DofSettings::default() },
        DofSettings { drive: Drive::Velocity { target: 1.0, limit: -1.0 }, ..DofSettings::default() },
        DofSettings {
            drive: Drive::Position { stiffness: 0.0, damping: 0.0, target: 0.0, velocity: 0.0, limit: 1.0 },
            ..DofSettings::default()
        },
    ];
    for dof in wrong {
        let error = body.set_dof(1, dof.clone()).unwrap_err().to_string();
        assert!(error.contains("'arm'") && error.contains("'link 1'"), "{error}");
    }
    assert!(body.set_dof(7, DofSettings::default()).is_err());
    assert!(ArticulatedBody::new("arm", model()).with_positions(&[0.0]).is_err());
    assert!(ArticulatedBody::new("arm", model()).with_velocities(&[0.0, f64::INFINITY]).is_err());
    let mut builder = ModelBuilder::new();
    let parent = builder.link("heavy", None, Joint::revolute(Vec3::x()), Pose::identity(), rod(1.0, 1.0));
    builder.link("leaf", Some(parent), Joint::revolute(Vec3::x()), Pose::identity(), LinkMass::none());
    let error = builder.build().unwrap_err().to_string();
    assert!(error.contains("'leaf'") && error.contains("mass"), "{error}");
}
