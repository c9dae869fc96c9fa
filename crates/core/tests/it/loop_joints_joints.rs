//! Single loop joints: pendulums, fixed joints, doors on two revolute joints, and a removed side.

use crate::common::*;
use crate::loop_joints::{AXIS, bar, hinge};
use std::f64::consts::PI;
use tumble_core::collide::{Mat3, Pose, Shape, Vec3};
use tumble_core::*;

/// Returns `4·√(L/g)·K(sin θ/2)` by the arithmetic-geometric mean; `L` is the length of the simple
/// pendulum with the same period.
fn period(length: f64, amplitude: f64) -> f64 {
    let (mut a, mut b) = (1.0, (0.5 * amplitude).cos());
    for _ in 0..10 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    2.0 * PI * (length / G).sqrt() / a
}

/// Returns the mean period of four swings of a bar of 0.6 m, which hangs from a revolute joint at
/// its end and is released at an angle.
fn measured(stepper: &str, rate: f64, amplitude: f64) -> f64 {
    let mut world = world(stepper, 1.0 / rate);
    let rod = world.add(bar("bar", Vec3::zeros(), 0.6 * Vec3::new(amplitude.sin(), 0.0, -amplitude.cos()))).unwrap();
    hinge(&mut world, "hinge", rod, None, Vec3::zeros(), AXIS);
    let state = |world: &World| {
        let (p, part_state) = (position(world, rod), world.part_state(rod, 0).unwrap());
        (p.x.atan2(-p.z), -part_state.angular_velocity.y)
    };
    let mut downs = Vec::new();
    let mut before = state(&world);
    while downs.len() < 5 {
        let start = world.time();
        world.step().unwrap();
        let after = state(&world);
        if before.0 > 0.0 && after.0 <= 0.0 {
            downs.push(start + zero_of_cubic(before, after, 1.0 / rate));
        }
        before = after;
    }
    (downs[4] - downs[0]) / 4.0
}

/// Returns the zero of the cubic with the given values and slopes at 0 and `h`, by bisection.
fn zero_of_cubic((a, da): (f64, f64), (b, db): (f64, f64), h: f64) -> f64 {
    let value = |s: f64| {
        let r = 1.0 - s;
        a * (1.0 + 2.0 * s) * r * r + b * s * s * (3.0 - 2.0 * s) + h * s * r * (da * r - db * s)
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if value(middle) > 0.0 { low = middle } else { high = middle }
    }
    h * low
}

#[test]
fn a_hinged_bar_swings_with_the_period_of_the_elliptic_integral() {
    // a cuboid of 0.6 × 0.02 × 0.02 about its end: I/(m·r) = (r² + (0.6² + 0.02²)/12)/r
    let length = (0.09 + (0.36 + 0.0004) / 12.0) / 0.3;
    for stepper in STEPPERS {
        for (amplitude, bound) in [(0.01, 5e-7), (1.0, 5e-7), (2.8, 5e-7)] {
            let exact = period(length, amplitude);
            let [coarse, fine] = [240.0, 480.0].map(|rate| measured(stepper, rate, amplitude) / exact - 1.0);
            println!("{stepper}, {amplitude} rad: period off by {coarse:.3e} at 240 Hz, {fine:.3e} at 480 Hz");
            assert!(coarse.abs() < bound, "{stepper}, {amplitude} rad: {coarse:e}");
        }
    }
}

/// Returns mass, center, and inertia about it of several boxes `(mass, half extents, center)` with
/// common axes.
fn sum(boxes: &[(f64, Vec3, Vec3)]) -> (f64, Vec3, Mat3) {
    let mass: f64 = boxes.iter().map(|b| b.0).sum();
    let center = boxes.iter().map(|b| b.0 * b.2).sum::<Vec3>() / mass;
    let inertia = boxes.iter().map(|&(m, half, c)| {
        let (s, d) = (half.component_mul(&half), c - center);
        let own = Mat3::from_diagonal(&Vec3::new(s.y + s.z, s.z + s.x, s.x + s.y)) * (m / 3.0);
        own + m * (Mat3::identity() * d.norm_squared() - d * d.transpose())
    });
    (mass, center, inertia.sum())
}

#[test]
fn a_fixed_joint_makes_one_body_of_two() {
    let boxes =
        [(1.0, Vec3::new(0.3, 0.1, 0.05), Vec3::zeros()), (0.4, Vec3::new(0.1, 0.2, 0.15), Vec3::new(0.3, 0.2, 0.1))];
    let (mass, center, inertia) = sum(&boxes);
    let spin = Vec3::new(1.0, 3.0, -2.0);
    let push = Vec3::new(0.5, -0.2, 3.0);
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let ids: Vec<ObjectId> = boxes
            .iter()
            .enumerate()
            .map(|(i, &(m, half, c))| {
                let mut body = RigidBody::new(Shape::cuboid(2.0 * half).unwrap())
                    .with_name(format!("box {i}"))
                    .with_mass(m)
                    .with_pose(Pose::from(c));
                body.mask = 0;
                world.add(body.with_velocity(push + spin.cross(&(c - center))).with_angular_velocity(spin)).unwrap()
            })
            .collect();
        let joint =
            LoopJoint::fixed_at("joint", &world, Some((ids[0], 0)), Some((ids[1], 0)), Vec3::new(0.3, 0.1, 0.05))
                .unwrap();
        let joint = world.add(joint).unwrap();
        let about_center = |world: &World| {
            let (m, c) = (
                world.momentum(),
                ids.iter().zip(&boxes).map(|(id, b)| b.0 * position(world, *id)).sum::<Vec3>() / mass,
            );
            (c, m.linear, m.angular - c.cross(&m.linear))
        };
        let (start, energy) = (about_center(&world), world.energy().total());
        let spun = 0.5 * spin.dot(&(inertia * spin));
        let (mut fall, mut angular, mut inertial, mut kept) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for frame in 1..=480 {
            world.step().unwrap();
            let (c, _, l) = about_center(&world);
            let t = frame as f64 / 240.0;
            fall = fall.max((c - (center + push * t - Vec3::z() * (0.5 * G * t * t))).norm());
            angular = angular.max((l - start.2).norm() / start.2.norm());
            // one body: ω = R·I⁻¹·Rᵀ·L with the summed inertia
            let part_state = world.part_state(ids[0], 0).unwrap();
            let r = part_state.pose.rotation.to_rotation_matrix().into_inner();
            let omega = r * inertia.try_inverse().unwrap() * r.transpose() * l;
            inertial = inertial.max((part_state.angular_velocity - omega).norm());
            kept = kept.max((world.energy().total() - energy).abs() / spun);
        }
        let position_error = world.get::<LoopJoint>(joint).unwrap().position_error(&world.view()).unwrap();
        println!(
            "{stepper}: center off by {fall:.1e} m, L by {angular:.1e}, ω by {inertial:.1e} rad/s, energy by {kept:.1e} of the spin, {position_error:?}"
        );
        assert!(fall < 1e-9, "{stepper}: the center leaves the parabola by {fall:e} m");
        // impulses conserve it; correcting the positions with momenta held has an error of third
        // order in the step
        assert!(angular < 1e-5, "{stepper}: angular momentum changes by {angular:e}");
        assert!(inertial < 1e-7, "{stepper}: ω is {inertial:e} rad/s off that of one body");
        assert!(kept < 1e-4, "{stepper}: energy changes by {kept:e} of the spin's");
        assert!(position_error.distance < 2e-9 && position_error.angle < 2e-9, "{stepper}: {position_error:?}");
    }
}

/// Adds a door with an eccentric mass and tilted principal axes, on `hinges` revolute joints along
/// an inclined axis. Its initial energy is kinetic.
fn door(stepper: &str, solver: &str, hinges: usize) -> (World, ObjectId) {
    let mut world = world(stepper, 1.0 / 240.0);
    world.set_solver(solver::by_name(solver).unwrap());
    let shape = Shape::cuboid(Vec3::new(0.8, 0.04, 2.0)).unwrap();
    let inertia = Mat3::new(3.0, 0.4, 0.7, 0.4, 3.5, -0.3, 0.7, -0.3, 1.2);
    let (axis, foot) = (Vec3::new(0.1, 0.2, 1.0).normalize(), Vec3::new(-0.4, 0.0, -0.8));
    let spin = 4.0 * axis;
    let mut body = RigidBody::new(shape)
        .with_name("door")
        .with_mass_and_inertia(10.0, inertia)
        .with_velocity(spin.cross(&-foot))
        .with_angular_velocity(spin);
    body.mask = 0;
    let id = world.add(body).unwrap();
    for i in 0..hinges {
        hinge(&mut world, &format!("hinge {i}"), id, None, foot + 0.8 * i as f64 * axis, axis);
    }
    (world, id)
}

#[test]
fn more_hinges_than_needed_swing_a_door_as_one_does() {
    for stepper in STEPPERS {
        for solver in ["gauss_seidel", "lcp_pyramid"] {
            let [(mut one, a), (mut three, b)] = [1, 3].map(|n| door(stepper, solver, n));
            let energy = three.energy().total();
            let (mut apart, mut drift, mut least) = (0.0f64, 0.0f64, f64::MAX);
            for _ in 0..240 * 20 {
                one.step().unwrap();
                three.step().unwrap();
                apart = apart.max((position(&one, a) - position(&three, b)).norm());
                drift = drift.max((three.energy().total() - energy).abs());
                least = least.min(position(&three, b).x);
            }
            println!(
                "{stepper}, {solver}: {apart:.1e} m from the door with one hinge in 20 s, energy off by {drift:.1e} J of {:.1}",
                0.5 * 10.0 * 2.56
            );
            assert!(least < -0.5, "{stepper}, {solver}: it turns");
            assert!(apart < 1e-5, "{stepper}, {solver}: {apart:e} m from the door on one hinge");
            assert!(drift < 0.1, "{stepper}, {solver}: energy off by {drift:e} J");
        }
    }
}

#[test]
fn a_loop_joint_without_one_of_its_sides_holds_nothing() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let post = world
            .add_static(RigidBody::fixed(sphere(0.1)).with_name("post").with_pose(Pose::translation(0.0, 0.0, 1.0)))
            .unwrap();
        let ball = world
            .add(
                RigidBody::new(sphere(0.1))
                    .with_name("ball")
                    .with_mass(1.0)
                    .with_pose(Pose::translation(0.0, 0.0, 0.5)),
            )
            .unwrap();
        let joint =
            LoopJoint::fixed_at("joint", &world, Some((ball, 0)), Some((post, 0)), Vec3::new(0.0, 0.0, 0.7)).unwrap();
        let joint = world.add(joint).unwrap();
        let falls = |world: &mut World| {
            let before = position(world, ball).z;
            (0..24).for_each(|_| {
                world.step().unwrap();
            });
            before - position(world, ball).z
        };
        assert!(falls(&mut world).abs() < 1e-9, "{stepper}: it hangs");
        world.set_enabled(post, false).unwrap();
        assert!(world.get::<LoopJoint>(joint).unwrap().position_error(&world.view()).is_none());
        assert!((falls(&mut world) - 0.5 * G * 0.01).abs() < 1e-9, "{stepper}: it falls when the post is disabled");
        world.remove(post).unwrap();
        assert!(world.object(joint).is_none(), "a joint goes with its body");
        world.set_velocity(ball, Vec3::zeros(), Vec3::zeros()).unwrap();
        assert!((falls(&mut world) - 0.5 * G * 0.01).abs() < 1e-9, "{stepper}: it falls when the post is gone");
    }
}

#[test]
fn impossible_loop_joints_are_refused() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    let ball = world.add(RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0)).unwrap();
    let (here, side) = (Vec3::zeros(), Some((ball, 0)));
    assert_eq!(LoopJoint::spherical_at("j", &world, None, None, here).unwrap_err(), LoopJointError::NoPart("j".into()));
    assert_eq!(
        LoopJoint::spherical_at("j", &world, side, side, here).unwrap_err(),
        LoopJointError::SamePart("j".into())
    );
    assert_eq!(
        LoopJoint::spherical_at("j", &world, Some((ball, 3)), None, here).unwrap_err(),
        LoopJointError::Gone { name: "j".into(), part: 3 }
    );
    assert_eq!(
        LoopJoint::spherical_at("j", &world, side, None, Vec3::new(f64::NAN, 0.0, 0.0)).unwrap_err(),
        LoopJointError::NotFinite("j".into())
    );
    assert_eq!(
        LoopJoint::revolute_at("j", &world, side, None, here, Vec3::zeros()).unwrap_err(),
        LoopJointError::Axis("j".into())
    );
    let wrong = LoopJoint::new(
        "j",
        LoopJointKind::Fixed,
        Anchor::on(ball, 3, Pose::identity()),
        Anchor::world(Pose::identity()),
    )
    .unwrap();
    world.add(wrong).unwrap();
    assert_eq!(
        world.step().unwrap_err().to_string(),
        "constraint 'j': 'ball' has no part 3 that answers impulses, or the row names a third object"
    );
}

#[test]
fn a_joint_that_starts_open_closes_at_the_recovery_speed() {
    // 0.3 m apart at 3 m/s: 0.1 s; then it stays, and no body has gained speed
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 240.0));
        let ball = world
            .add(
                RigidBody::new(sphere(0.1))
                    .with_name("ball")
                    .with_mass(1.0)
                    .with_pose(Pose::translation(0.3, 0.0, 0.0)),
            )
            .unwrap();
        let joint = LoopJoint::new(
            "joint",
            LoopJointKind::Fixed,
            Anchor::on(ball, 0, Pose::identity()),
            Anchor::world(Pose::identity()),
        )
        .unwrap();
        world.add(joint).unwrap();
        for frame in 1..=30 {
            world.step().unwrap();
            let left = (0.3 - 3.0 * frame as f64 / 240.0).max(0.0);
            assert!(
                (position(&world, ball).x - left).abs() < 1e-8,
                "{stepper}, frame {frame}: {} m, by hand {left}",
                position(&world, ball).x
            );
            assert!(velocity(&world, ball).norm() < 1e-9, "{stepper}");
        }
    }
}

#[test]
fn hinged_boxes_come_to_rest_on_the_ground() {
    // two boxes joined edge to edge fall flat on the floor and rest there: the joint is closed, and
    // no box is inside a surface
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        ground(&mut world, 0.0, 0.5);
        let ids = [-0.2, 0.2].map(|x| {
            let body = RigidBody::new(Shape::cuboid(Vec3::new(0.36, 0.2, 0.1)).unwrap())
                .with_name(format!("box at {x}"))
                .with_mass(1.0);
            world
                .add(
                    body.with_pose(Pose::translation(x, 0.0, 0.3))
                        .with_material(Material { friction: 0.5, ..Material::default() }),
                )
                .unwrap()
        });
        let joint = hinge(&mut world, "hinge", ids[0], Some(ids[1]), Vec3::new(0.0, 0.0, 0.3), Vec3::y());
        let mut worst = PositionError::default();
        for _ in 0..480 {
            world.step().unwrap();
            let now = world.get::<LoopJoint>(joint).unwrap().position_error(&world.view()).unwrap();
            worst = PositionError { distance: worst.distance.max(now.distance), angle: worst.angle.max(now.angle) };
        }
        println!(
            "{stepper}: {worst:?}, {:e} deep, heights {:?}",
            world.report().max_penetration,
            ids.map(|id| position(&world, id).z)
        );
        assert!(worst.distance < 1e-6 && worst.angle < 1e-6, "{stepper}: {worst:?}");
        for id in ids {
            assert!((position(&world, id).z - 0.05).abs() < 1e-6, "{stepper}: at {} m", position(&world, id).z);
            assert!(velocity(&world, id).norm() < 1e-6, "{stepper}: moves at {:e} m/s", velocity(&world, id).norm());
        }
    }
}

/// A ball that a joint leads around on ground without friction: the joint has all of the centripetal force.
#[test]
fn a_joint_beside_a_contact_without_friction_reports_all_of_its_force() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 60.0);
        ground(&mut world, 0.0, 0.0);
        let spin = Vec3::new(0.0, 0.0, 2.0);
        let ball =
            RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0).with_pose(Pose::translation(1.0, 0.0, 0.1));
        let smooth = Material { friction: 0.0, ..Material::default() };
        let moving = ball.with_material(smooth).with_velocity(Vec3::new(0.0, 2.0, 0.0)).with_angular_velocity(spin);
        let ball = world.add(moving).unwrap();
        let pivot = Vec3::new(0.0, 0.0, 0.6);
        let joint = LoopJoint::spherical_at("pivot", &world, Some((ball, 0)), None, pivot).unwrap();
        let joint = world.add(joint).unwrap();
        for frame in 0..60 {
            let before = world.part_state(ball, 0).unwrap().velocity;
            world.step().unwrap();
            let change = (world.part_state(ball, 0).unwrap().velocity - before) * 60.0;
            let off = (world.joint_force(joint).unwrap().force - change).xy().norm();
            assert!(frame < 2 || off < 1e-2, "{stepper}: {off} N off of {} N", change.norm());
        }
    }
}
