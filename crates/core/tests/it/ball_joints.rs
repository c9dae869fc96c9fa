//! Springs, drives and limits of the twist of spherical joints of articulated bodies, against closed forms and against loop joints.

use crate::common::*;
use tumble_core::articulated::{Joint, LinkMass, ModelBuilder};
use tumble_core::collide::{Mat3, Pose, Quat, Vec3};
use tumble_core::*;

/// kg·m², of the link about its joint.
const INERTIA: f64 = 0.5;

/// A link of 2 kg whose center of mass is on its spherical joint.
fn top(start: &Vec3, omega: &Vec3, dofs: [DofSettings; 3]) -> ArticulatedBody {
    let mut builder = ModelBuilder::new();
    let mass = LinkMass { mass: 2.0, center: Vec3::zeros(), inertia: Mat3::identity() * INERTIA };
    builder.link("top", None, Joint::Spherical, Pose::identity(), mass);
    let body = ArticulatedBody::new("top", builder.build().unwrap());
    let body = body.with_positions(Quat::from_scaled_axis(*start).coords.as_slice()).unwrap();
    let mut body = body.with_velocities(omega.as_slice()).unwrap();
    dofs.into_iter().enumerate().for_each(|(k, dof)| body.set_dof(k, dof).unwrap());
    body
}

fn springs(stiffness: f64, rest: Vec3) -> [DofSettings; 3] {
    [0, 1, 2].map(|k| DofSettings { spring: Some(Spring { stiffness, rest: rest[k] }), ..DofSettings::default() })
}

fn drives(stiffness: f64, damping: f64, target: Vec3, limit: f64) -> [DofSettings; 3] {
    [0, 1, 2].map(|k| {
        let drive = Drive::Position { stiffness, damping, target: target[k], velocity: 0.0, limit };
        DofSettings { drive, ..DofSettings::default() }
    })
}

fn turn(world: &World, id: ObjectId) -> Quat {
    world.part_state(id, 0).unwrap().pose.rotation
}

fn omega(world: &World, id: ObjectId) -> Vec3 {
    world.part_state(id, 0).unwrap().angular_velocity
}

/// About one axis the way from rest is `θ₀·cos(ωt)`, `ω = √(k/I)`, at any amplitude and from any rest orientation: to second order
/// in the step.
#[test]
fn a_spring_swings_with_its_period() {
    let axis = Vec3::new(0.6, -0.64, 0.48);
    for stepper in STEPPERS {
        for rest in [Vec3::zeros(), Vec3::new(0.4, -0.9, 0.5)] {
            let error = |dt: f64| {
                let mut world = no_gravity(world(stepper, dt));
                let start = Quat::from_scaled_axis(rest) * Quat::from_scaled_axis(axis * 1.5);
                let id = world.add(top(&start.scaled_axis(), &Vec3::zeros(), springs(8.0, rest))).unwrap();
                let energy = world.energy().total();
                assert!((energy - 0.5 * 8.0 * 1.5 * 1.5).abs() < 1e-9, "{energy}");
                let mut worst = 0.0f64;
                for frame in 1..=(4.0 / dt).round() as usize {
                    world.step().unwrap();
                    let left = (Quat::from_scaled_axis(rest).inverse() * turn(&world, id)).scaled_axis();
                    let expected = axis * (1.5 * (4.0 * frame as f64 * dt).cos());
                    worst = worst.max((left - expected).norm());
                    assert!((world.energy().total() / energy - 1.0).abs() < 2e-2, "{stepper}");
                }
                worst
            };
            let errors = [1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0].map(error);
            println!("{stepper}, rest {:?}: {errors:?}", rest.as_slice());
            assert!(errors[2] < 3e-3, "{stepper}: {errors:?}");
            assert!(errors[0] / errors[1] > 3.5 && errors[1] / errors[2] > 3.5, "{stepper}: {errors:?}");
        }
    }
}

/// No stiffness is too large for the step: the energy stays what it was.
#[test]
fn a_spring_of_a_billion_is_stable() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 60.0));
        let id = world.add(top(&Vec3::zeros(), &Vec3::new(1.0, 2.0, -0.5), springs(1e9, Vec3::zeros()))).unwrap();
        let energy = world.energy().total();
        for _ in 0..300 {
            world.step().unwrap();
            assert!(world.energy().total() < 1.01 * energy, "{stepper}: {}", world.energy().total() / energy);
        }
        assert!(turn(&world, id).angle() < 1e-2, "{stepper}: {}", turn(&world, id).angle());
    }
}

/// A drive takes the link to its target orientation at gains from soft to 1e9, and holds it there against a weight: with a finite
/// stiffness `k` the sag is `m·g·l·sin θ = k·(θ − θ*)`.
#[test]
fn a_drive_reaches_its_target_orientation() {
    let target = Vec3::new(0.8, -1.1, 0.7);
    for stepper in STEPPERS {
        for (stiffness, damping) in [(20.0, 6.0), (1e4, 1e3), (1e9, 1e7), (1e9, 1e2)] {
            let mut world = no_gravity(world(stepper, 1.0 / 120.0));
            let start = Vec3::new(-0.5, 0.3, 1.2);
            let id =
                world.add(top(&start, &Vec3::new(0.0, 3.0, 0.0), drives(stiffness, damping, target, f64::INFINITY)));
            let id = id.unwrap();
            for _ in 0..600 {
                world.step().unwrap();
            }
            let off = (Quat::from_scaled_axis(target).inverse() * turn(&world, id)).angle();
            assert!(off < 1e-6, "{stepper}, gains {stiffness}, {damping}: {off:e}");
        }
    }
    // a rod of 0.3 m along x, held level about y
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let mut builder = ModelBuilder::new();
        let mass = LinkMass { mass: 2.0, center: Vec3::x() * 0.3, inertia: Mat3::identity() * 0.02 };
        builder.link("rod", None, Joint::Spherical, Pose::identity(), mass);
        let mut rod = ArticulatedBody::new("rod", builder.build().unwrap());
        drives(60.0, 20.0, Vec3::zeros(), f64::INFINITY)
            .into_iter()
            .enumerate()
            .for_each(|(k, dof)| rod.set_dof(k, dof).unwrap());
        let id = world.add(rod).unwrap();
        for _ in 0..2400 {
            world.step().unwrap();
        }
        let mut sag = 0.1f64;
        for _ in 0..100 {
            sag = 2.0 * G * 0.3 * sag.cos() / 60.0;
        }
        let held = turn(&world, id).scaled_axis();
        assert!((held - Vec3::new(0.0, sag, 0.0)).norm() < 1e-7, "{stepper}: {held:?}, wanted {sag}");
    }
}

/// A drive that is too weak turns the link at a constant acceleration `τ/I` about the axis of the way to its target.
#[test]
fn a_drive_keeps_its_largest_torque() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 240.0));
        let dofs = drives(1e6, 1e4, Vec3::new(0.0, 3.0, 0.0), 0.25);
        let id = world.add(top(&Vec3::zeros(), &Vec3::zeros(), dofs)).unwrap();
        for _ in 0..240 {
            world.step().unwrap();
        }
        let (rate, angle) = (omega(&world, id), turn(&world, id).scaled_axis());
        assert!((rate - Vec3::y() * (0.25 / INERTIA)).norm() < 1e-9, "{stepper}: {rate:?}");
        assert!((angle - Vec3::y() * (0.5 * 0.25 / INERTIA)).norm() < 1e-9, "{stepper}: {angle:?}");
    }
}

/// A velocity drive of a spherical joint keeps its rate about the link's axis, also with a cone on another axis.
#[test]
fn a_velocity_drive_turns_about_an_axis_of_the_link() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 120.0));
        let spin = DofSettings {
            drive: Drive::Velocity { target: 2.0, limit: f64::INFINITY },
            limits: Some([0.0, 0.4]),
            ..DofSettings::default()
        };
        let dofs = [DofSettings::default(), DofSettings::default(), spin];
        let id = world.add(top(&Vec3::zeros(), &Vec3::zeros(), dofs)).unwrap();
        for _ in 0..120 {
            world.step().unwrap();
        }
        let angle = turn(&world, id).scaled_axis();
        assert!((angle - Vec3::z() * 2.0).norm() < 2e-2, "{stepper}: {angle:?}");
        assert!((omega(&world, id) - Vec3::z() * 2.0).norm() < 1e-9, "{stepper}");
    }
}

/// The turn about each axis of the link stops at both limits of its twist and never passes them, whatever the swing; about other
/// axes the link goes on.
#[test]
fn limits_of_the_twist_stop_the_turn_about_each_axis() {
    for stepper in STEPPERS {
        for k in 0..3 {
            for (sign, limit) in [(1.0, 0.7), (-1.0, 0.3)] {
                let mut world = no_gravity(world(stepper, 1.0 / 120.0));
                let dofs = [0, 1, 2].map(|axis| DofSettings {
                    twist_limits: (axis == k).then_some([-0.3, 0.7]),
                    ..DofSettings::default()
                });
                let (along, across) = (Vec3::ith(k, 1.0), Vec3::ith((k + 1) % 3, 1.0));
                let id = world.add(top(&Vec3::zeros(), &(along * (2.0 * sign) + across * 0.8), dofs)).unwrap();
                let (mut farthest, mut widest) = (0.0f64, 0.0f64);
                for _ in 0..240 {
                    world.step().unwrap();
                    let q = turn(&world, id);
                    let twist = 2.0 * q.coords[k].atan2(q.coords.w);
                    let twist = sign * (twist + 5.0 * std::f64::consts::PI).rem_euclid(2.0 * std::f64::consts::PI);
                    let twist = twist - sign * std::f64::consts::PI;
                    farthest = farthest.max(twist);
                    widest = widest.max((q * along).dot(&along).acos());
                }
                println!("{stepper}, axis {k}: {farthest} of {limit}, swing {widest}");
                assert!((limit - 1e-3..limit + 1e-6).contains(&farthest), "{stepper}, axis {k}: {farthest}");
                assert!(widest > 0.5, "{stepper}, axis {k}: {widest}");
            }
        }
    }
}

/// The same lamp as a rigid body on a spherical loop joint, with spring, drive, damping, cone and limits of the twist: apart by the
/// square of the step.
#[test]
fn a_loop_joint_and_a_joint_of_a_robot_have_the_same_settings() {
    type Case = (&'static str, DofSettings, Option<f64>, Option<[f64; 2]>);
    let spring = DofSettings { spring: Some(Spring { stiffness: 6.0, rest: 0.0 }), ..DofSettings::default() };
    let drive = Drive::Position { stiffness: 15.0, damping: 0.5, target: 0.0, velocity: 0.0, limit: f64::INFINITY };
    let damped = DofSettings { damping: 0.3, drive, ..DofSettings::default() };
    let cases: [Case; 3] = [
        ("spring", spring.clone(), None, None),
        ("drive", damped, None, None),
        ("limits", spring, Some(0.5), Some([-0.2, 0.3])),
    ];
    let goal = Vec3::new(0.3, -0.2, 0.4);
    for (name, settings, cone, twist) in cases {
        let mut far = Vec::new();
        for rate in [240.0, 960.0] {
            let mut world = world("time_stepping", 1.0 / rate);
            let spin = Vec3::new(3.0, 1.0, 2.0);
            let of = |k: usize| {
                let mut own = settings.clone();
                own.spring = own.spring.map(|spring| Spring { rest: goal[k], ..spring });
                if let Drive::Position { target, .. } = &mut own.drive {
                    *target = goal[k];
                }
                own
            };
            let mass = LinkMass { mass: 2.0, center: Vec3::z() * -0.3, inertia: Mat3::identity() * 0.02 };
            let mut builder = ModelBuilder::new();
            builder.link("lamp", None, Joint::Spherical, Pose::identity(), mass);
            let lamp = ArticulatedBody::new("lamp", builder.build().unwrap());
            let mut lamp = lamp.with_velocities(spin.as_slice()).unwrap();
            for k in 0..3 {
                let limits = cone.filter(|_| k == 2).map(|cone| [0.0, cone]);
                lamp.set_dof(k, DofSettings { limits, twist_limits: twist.filter(|_| k == 2), ..of(k) }).unwrap();
            }
            let lamp = world.add(lamp).unwrap();
            let body = RigidBody::new(sphere(0.05)).with_mass_and_inertia(2.0, Mat3::identity() * 0.02);
            let body = world.add(body.with_pose(Pose::translation(0.0, 0.0, -0.3))).unwrap();
            world.set_collidable(body, false).unwrap();
            let sides = (Anchor::on(body, 0, Pose::translation(0.0, 0.0, 0.3)), Anchor::world(Pose::identity()));
            let mut joint = LoopJoint::new("", LoopJointKind::Spherical, sides.0, sides.1).unwrap();
            (0..3).for_each(|k| joint.set_dof_at(k, of(k)).unwrap());
            joint.set_cone(cone).unwrap();
            joint.set_twist_limits(twist).unwrap();
            world.add(joint).unwrap();
            world.set_velocity(body, spin.cross(&Vec3::new(0.0, 0.0, -0.3)), spin).unwrap();
            let mut worst = 0.0f64;
            for _ in 0..rate as usize {
                world.step().unwrap();
                worst = worst.max((turn(&world, lamp).inverse() * turn(&world, body)).angle());
            }
            far.push(worst);
        }
        println!("{name}: apart by {far:?}");
        assert!(far[0] < 0.03 && far[1] < far[0] / 3.0, "{name}: {far:?}");
    }
}

/// Initial rotations, twists and settings of single degrees of freedom of a link builder; what does not fit is refused.
#[test]
fn a_builder_takes_all_of_them() {
    let lamp = || {
        LinkBuilder::new("lamp", Joint::Spherical)
            .with_mass(1.0)
            .with_shape(sphere(0.1), Pose::translation(0.0, 0.0, 1.0))
    };
    let build = |link: LinkBuilder| ArticulationBuilder::new("robot").link(link).build();
    let why = |link: LinkBuilder| build(link).map(drop).unwrap_err().to_string();
    let start = Quat::from_scaled_axis(Vec3::new(0.1, 0.2, 0.3));
    let aimed = springs(5.0, Vec3::new(0.0, 0.7, 0.0))[1].clone();
    let link = lamp().with_rotation(start).with_velocities(&[1.0, 2.0, 3.0]).with_cone(2, 0.5);
    let link = link.with_twist_limits(2, [-0.1, 0.2]).with_spring(5.0, 0.0).with_dof_at(1, aimed);
    let body = build(link).unwrap();
    assert_eq!(body.dofs()[2].twist_limits, Some([-0.1, 0.2]));
    assert_eq!(body.dofs()[2].limits, Some([0.0, 0.5]));
    assert_eq!([0, 1, 2].map(|k| body.dofs()[k].spring.unwrap().rest), [0.0, 0.7, 0.0]);
    let mut world = world("time_stepping", 0.01);
    let id = world.add(body).unwrap();
    assert!((turn(&world, id).inverse() * start).angle() < 1e-12);
    assert!((omega(&world, id) - start * Vec3::new(1.0, 2.0, 3.0)).norm() < 1e-12);
    assert!(why(lamp().with_positions(&[0.0, 0.0, 1.0])).contains("another count of numbers"));
    assert!(why(lamp().with_positions(&[0.0, 0.0, 0.0, 2.0])).contains("quaternions of unit length"));
    assert!(why(lamp().with_twist_limits(2, [0.5, 0.2])).contains("not above the upper limit"));
    assert!(why(lamp().with_twist_limits(2, [-3.0, 3.0])).contains("at most 3π/2"));
    assert!(why(lamp().with_twist_limits(3, [0.0, 0.2])).contains("axis of its twist"));
    assert!(why(lamp().with_dof_at(3, DofSettings::default())).contains("another degree of freedom"));
    let hinge =
        LinkBuilder::new("arm", Joint::revolute(Vec3::z())).with_mass(1.0).with_shape(sphere(0.1), Pose::identity());
    assert!(why(hinge.clone().with_twist_limits(2, [0.0, 0.2])).contains("only spherical joints have"));
    let twist = DofSettings { twist_limits: Some([0.0, 0.2]), ..DofSettings::default() };
    assert!(why(hinge.with_dof(twist)).contains("lower limit of the twist"));
}
