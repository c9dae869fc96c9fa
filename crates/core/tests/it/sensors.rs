//! Measuring sensors against closed forms.

use tumble_core::collide::Mat3;
use tumble_core::prelude::*;
use tumble_core::{
    Anchor, ArticulatedBody, ArticulationBuilder, Collider, DofSettings, Drive, EventKind, Joint, JointPlace,
    LinkBuilder, LinkMass, LoopJointKind, Sensor, SensorKind, Settings, stepper_by_name,
};

const G: f64 = 9.81;
const STEPPERS: [&str; 2] = ["time_stepping", "backtracking"];

fn world(stepper: &str, dt: f64) -> World {
    let mut world = World::new(Settings::default().with_dt(dt)).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world
}

fn site(id: ObjectId, part: usize, at: [f64; 3]) -> Anchor {
    Anchor::on(id, part, Pose::translation(at[0], at[1], at[2]))
}

fn sensor(world: &mut World, kind: SensorKind, at: Anchor) -> ObjectId {
    world.add(Sensor::new("", kind, at).unwrap()).unwrap()
}

fn reading(world: &World, id: ObjectId) -> Vec3 {
    Vec3::from_column_slice(world.reading(id).unwrap())
}

fn close(a: Vec3, b: [f64; 3], error: f64, label: &str) {
    assert!((a - Vec3::from(b)).norm() <= error, "{label}: {a:?} is not {b:?}");
}

fn steps(world: &mut World, n: usize) {
    (0..n).for_each(|_| {
        world.step().unwrap();
    });
}

#[test]
fn an_accelerometer_reads_g_upwards_at_rest_and_nothing_in_free_fall() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        world.add(RigidBody::fixed(Shape::half_space())).unwrap();
        let cube = Shape::cuboid(Vec3::new(1.0, 1.0, 1.0)).unwrap();
        let rests = world.add(RigidBody::new(cube.clone()).with_pose(Pose::translation(0.0, 0.0, 0.5))).unwrap();
        let falls = world.add(RigidBody::new(cube).with_pose(Pose::translation(5.0, 0.0, 50.0))).unwrap();
        world.set_velocity(falls, Vec3::new(1.0, 2.0, 3.0), Vec3::zeros()).unwrap();
        let turned = Pose::rotation(Vec3::new(std::f64::consts::FRAC_PI_2, 0.0, 0.0)); // the site's y axis points up
        let on_rest = sensor(&mut world, SensorKind::Accelerometer, Anchor::on(rests, 0, turned));
        let on_fall = sensor(&mut world, SensorKind::Accelerometer, site(falls, 0, [0.3, 0.2, 0.1]));
        let fallen = sensor(&mut world, SensorKind::LinearAcceleration, site(falls, 0, [0.3, 0.2, 0.1]));
        close(reading(&world, on_rest), [0.0; 3], 0.0, "before the first frame");
        for _ in 0..50 {
            world.step().unwrap();
            close(reading(&world, on_rest), [0.0, G, 0.0], 1e-7, stepper);
            close(reading(&world, on_fall), [0.0; 3], 1e-11, stepper);
            close(reading(&world, fallen), [0.0, 0.0, -G], 1e-11, stepper);
        }
    }
}

/// A turntable that is driven with the angular acceleration α: centripetal `r·ω²` towards the axis and `r·α` along the motion.
#[test]
fn an_accelerometer_on_a_turntable_reads_the_centripetal_and_the_tangential_part() {
    let (r, torque, inertia) = (0.4, 0.6, 2.0 * 0.5 * 0.5 / 2.0);
    for stepper in STEPPERS {
        let mut errors = Vec::new();
        for dt in [1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0] {
            let mut world = world(stepper, dt);
            let disc = RigidBody::new(Shape::cylinder(0.5, 0.1).unwrap()).with_mass(2.0);
            let disc = world.add(disc).unwrap();
            let axle =
                tumble_core::LoopJoint::revolute_at("axle", &world, Some((disc, 0)), None, Vec3::zeros(), Vec3::z());
            world.add(axle.unwrap()).unwrap();
            world.set_velocity(disc, Vec3::zeros(), Vec3::new(0.0, 0.0, 3.0)).unwrap();
            let edge = site(disc, 0, [r, 0.0, 0.0]);
            let felt = sensor(&mut world, SensorKind::Accelerometer, edge);
            let gyro = sensor(&mut world, SensorKind::Gyroscope, edge);
            let alpha = sensor(&mut world, SensorKind::AngularAcceleration, edge);
            let frames = (0.5 / dt).round() as usize;
            for _ in 0..frames {
                world.apply_torque(disc, 0, Vec3::new(0.0, 0.0, torque)).unwrap();
                world.step().unwrap();
            }
            let (a, end) = (torque / inertia, 3.0 + torque / inertia * frames as f64 * dt);
            close(reading(&world, gyro), [0.0, 0.0, end], 1e-8, stepper);
            close(reading(&world, alpha), [0.0, 0.0, a], 1e-6, stepper);
            let middle = end - a * 0.5 * dt; // angular velocity in the middle of the frame
            errors.push((reading(&world, felt) - Vec3::new(-r * middle * middle, r * a, G)).norm());
        }
        println!("turntable, {stepper}: errors {errors:?} m/s²");
        assert!(errors[2] < 1e-3, "{stepper}: {errors:?}");
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 2.0).abs() < 0.2, "{stepper}: order {order} of {errors:?}");
        }
    }
}

/// A symmetric top without torque: its angular velocity in its own axes turns about its own axis with the rate
/// `(I₃ − I₁)/I₁·ω₃`, and keeps its length.
#[test]
fn a_gyroscope_on_a_free_top_reads_the_precession_in_its_own_axes() {
    let shape = Shape::cuboid(Vec3::new(0.4, 0.4, 0.1)).unwrap();
    let (i1, i3) = ((0.16 + 0.01) / 12.0, 0.32 / 12.0);
    let (across, along) = (0.8, 4.0);
    let mut errors = Vec::new();
    for dt in [1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0] {
        let mut world = world("time_stepping", dt);
        let top = world.add(RigidBody::new(shape.clone()).with_mass(1.0)).unwrap();
        world.set_velocity(top, Vec3::zeros(), Vec3::new(across, 0.0, along)).unwrap();
        let gyro = sensor(&mut world, SensorKind::Gyroscope, site(top, 0, [0.1, 0.0, 0.0]));
        let frames = (1.0 / dt).round() as usize;
        steps(&mut world, frames);
        let phase = (i3 - i1) / i1 * along * frames as f64 * dt;
        let expected = Vec3::new(across * phase.cos(), across * phase.sin(), along);
        errors.push((reading(&world, gyro) - expected).norm());
    }
    println!("free top: errors {errors:?} rad/s");
    assert!(errors[2] < 1e-3, "{errors:?}");
    // free motion is exact, or of second order
    assert!(errors.windows(2).all(|pair| pair[1] < 1e-9 || (pair[0] / pair[1] - 4.0).abs() < 0.6), "{errors:?}");
}

/// A weight on a driven slider that stands still: m·g upwards, and the moment of an arm.
#[test]
fn a_force_sensor_under_a_weight_reads_its_weight() {
    for stepper in STEPPERS {
        let mut builder = ModelBuilder::new();
        let carriage = builder.link(
            "carriage",
            None,
            Joint::prismatic(Vec3::x()),
            Pose::identity(),
            LinkMass::point(1.0, Vec3::zeros()),
        );
        let arm = LinkMass::point(3.0, Vec3::new(0.5, 0.0, 0.0));
        builder.link("arm", Some(carriage), Joint::revolute(Vec3::y()), Pose::translation(0.0, 0.0, 0.2), arm);
        let mut body = ArticulatedBody::new("lift", builder.build().unwrap());
        for dof in 0..2 {
            let drive = Drive::Velocity { target: 0.0, limit: f64::INFINITY };
            body.set_dof(dof, DofSettings { drive, ..DofSettings::default() }).unwrap();
        }
        let mut world = world(stepper, 1.0 / 240.0);
        let body = world.add(body).unwrap();
        let force = sensor(&mut world, SensorKind::Force, site(body, 1, [0.0; 3]));
        let torque = sensor(&mut world, SensorKind::Torque, site(body, 1, [0.0; 3]));
        let below = sensor(&mut world, SensorKind::Force, site(body, 0, [0.0; 3]));
        let shifted = sensor(&mut world, SensorKind::Torque, site(body, 0, [0.1, 0.0, 0.0]));
        let drive = world.add(Sensor::of_dof("", SensorKind::DriveForce, body, 1).unwrap()).unwrap();
        steps(&mut world, 20);
        close(reading(&world, force), [0.0, 0.0, 3.0 * G], 1e-7, stepper);
        close(reading(&world, torque), [0.0, -3.0 * G * 0.5, 0.0], 1e-7, stepper); // the weight at +x turns towards +y
        close(reading(&world, below), [0.0, 0.0, 4.0 * G], 1e-7, stepper);
        close(reading(&world, shifted), [0.0, -3.0 * G * 0.4 + 1.0 * G * 0.1, 0.0], 1e-7, stepper);
        let held = world.reading(drive).unwrap()[0];
        assert!((held + 3.0 * G * 0.5).abs() < 1e-7, "{stepper}: {held}");
    }
}

/// The equations of a double pendulum of two point masses give its accelerations, and these the forces in its joints.
#[test]
fn the_joint_forces_of_a_swinging_double_pendulum_follow_from_its_accelerations() {
    let (l1, l2, m1, m2) = (0.7, 0.5, 2.0, 1.0);
    for stepper in STEPPERS {
        let mut errors = Vec::new();
        for dt in [1.0 / 240.0, 1.0 / 480.0, 1.0 / 960.0] {
            let mut builder = ModelBuilder::new();
            let upper = LinkMass::point(m1, Vec3::new(0.0, 0.0, -l1));
            let first = builder.link("upper", None, Joint::revolute(-Vec3::y()), Pose::identity(), upper);
            let lower = LinkMass::point(m2, Vec3::new(0.0, 0.0, -l2));
            builder.link("lower", Some(first), Joint::revolute(-Vec3::y()), Pose::translation(0.0, 0.0, -l1), lower);
            let body = ArticulatedBody::new("", builder.build().unwrap()).with_positions(&[1.0, -0.4]).unwrap();
            let mut world = world(stepper, dt);
            let body = world.add(body).unwrap();
            let forces = [0, 1].map(|link| sensor(&mut world, SensorKind::Force, site(body, link, [0.0; 3])));
            let frames = (0.3 / dt).round() as usize;
            steps(&mut world, frames);
            let before = world.state_of(body).unwrap().to_vec();
            world.step().unwrap();
            let after = world.state_of(body).unwrap().to_vec();
            // absolute angles and rates in the middle of the frame; x to the right, z upwards
            let mean = |k: usize| 0.5 * (before[k] + after[k]);
            let (a, b) = (mean(0), mean(0) + mean(1));
            let (u, v) = (mean(2), mean(2) + mean(3));
            let d = a - b;
            // m·l1·α + m2·l2·β·cos d = −m2·l2·v²·sin d − m·G·sin a;   l1·α·cos d + l2·β = l1·u²·sin d − G·sin b
            let m = m1 + m2;
            let (r1, r2) = (-m2 * l2 * v * v * d.sin() - m * G * a.sin(), l1 * u * u * d.sin() - G * b.sin());
            let det = m * l1 * l2 - m2 * l2 * d.cos() * l1 * d.cos();
            let alpha = (r1 * l2 - m2 * l2 * d.cos() * r2) / det;
            let beta = (m * l1 * r2 - l1 * d.cos() * r1) / det;
            let point = |l: f64, q: f64, w: f64, acc: f64| {
                Vec3::new(l * (acc * q.cos() - w * w * q.sin()), 0.0, l * (acc * q.sin() + w * w * q.cos()))
            };
            let g = Vec3::new(0.0, 0.0, G);
            let (a1, a2) = (point(l1, a, u, alpha), point(l1, a, u, alpha) + point(l2, b, v, beta));
            let on_lower = m2 * (a2 + g);
            let on_upper = m1 * (a1 + g) + on_lower;
            let in_axes = |f: Vec3, q: f64| Pose::rotation(Vec3::new(0.0, q, 0.0)).transform_vector(&f); // −y axis: back by q
            let error = (reading(&world, forces[0]) - in_axes(on_upper, a)).norm()
                + (reading(&world, forces[1]) - in_axes(on_lower, b)).norm();
            errors.push(error);
        }
        println!("double pendulum, {stepper}: errors {errors:?} N");
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 2.0).abs() < 0.3, "{stepper}: order {order} of {errors:?}");
        }
    }
}

/// A weight that hangs from a loop joint, and one that is struck: force of the joint on side A, and the touch on the ground.
#[test]
fn loop_joints_and_the_ground_carry_the_weight_of_what_hangs_and_lies() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let ground = world.add(RigidBody::fixed(Shape::half_space())).unwrap();
        let cube = Shape::cuboid(Vec3::new(0.2, 0.2, 0.2)).unwrap();
        let lies = RigidBody::new(cube.clone()).with_mass(4.0).with_pose(Pose::translation(0.0, 0.0, 0.1));
        let hangs = RigidBody::new(cube).with_mass(2.0).with_pose(Pose::translation(1.0, 0.0, 3.0));
        let (lies, hangs) = (world.add(lies).unwrap(), world.add(hangs).unwrap());
        let hook = tumble_core::LoopJoint::joining(
            "hook",
            LoopJointKind::Fixed,
            &world,
            Some((hangs, 0)),
            None,
            JointPlace::at(Vec3::new(0.5, 0.0, 3.0)).with_second_axis(Vec3::x()),
        );
        let hook = world.add(hook.unwrap()).unwrap();
        let force = world.add(Sensor::of_joint("", SensorKind::Force, hook).unwrap()).unwrap();
        let torque = world.add(Sensor::of_joint("", SensorKind::Torque, hook).unwrap()).unwrap();
        let touch = sensor(&mut world, SensorKind::Touch, site(lies, 0, [0.0; 3]));
        let felt = sensor(&mut world, SensorKind::Touch, site(ground, 0, [0.0; 3]));
        let half = Sensor::new("", SensorKind::Touch, site(lies, 0, [0.1, 0.0, -0.1])).unwrap();
        let half = world.add(half.with_volume(Shape::cuboid(Vec3::new(0.1, 1.0, 0.1)).unwrap()).unwrap()).unwrap();
        let away = Sensor::new("", SensorKind::Touch, site(lies, 0, [0.0, 0.0, 0.1])).unwrap();
        let away = world.add(away.with_volume(Shape::sphere(0.15).unwrap()).unwrap()).unwrap();
        steps(&mut world, 60);
        close(reading(&world, force), [0.0, 0.0, 2.0 * G], 1e-6, stepper);
        close(reading(&world, torque), [0.0, -2.0 * G * 0.5, 0.0], 1e-6, stepper);
        for (id, expected) in [(touch, 4.0 * G), (felt, 4.0 * G), (half, 2.0 * G), (away, 0.0)] {
            let value = world.reading(id).unwrap()[0];
            assert!((value - expected).abs() < 1e-5, "{stepper}: {value} is not {expected}");
        }
    }
}

/// The sum of readings times dt is the momentum that an impact and the weight give, to rounding.
#[test]
fn an_impact_is_in_the_mean_over_its_frame() {
    for stepper in STEPPERS {
        let dt = 1.0 / 240.0;
        let mut world = world(stepper, dt);
        world.add(RigidBody::fixed(Shape::half_space())).unwrap();
        let ball =
            RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(0.5).with_pose(Pose::translation(0.0, 0.0, 0.6));
        let ball = world.add(ball.with_material(Material { restitution: 0.8, ..Material::default() })).unwrap();
        let felt = sensor(&mut world, SensorKind::Accelerometer, site(ball, 0, [0.0; 3]));
        let touch = sensor(&mut world, SensorKind::Touch, site(ball, 0, [0.0; 3]));
        let (mut gain, mut pressed, mut t) = (0.0, 0.0, 0.0);
        for _ in 0..240 {
            world.step().unwrap();
            gain += dt * (reading(&world, felt).z - G);
            pressed += dt * world.reading(touch).unwrap()[0];
            t += dt;
        }
        let v = world.part_state(ball, 0).unwrap().velocity.z;
        assert!((gain - v).abs() < 1e-10, "{stepper}: {gain} and {v}");
        assert!((pressed - 0.5 * (v + G * t)).abs() < 1e-6, "{stepper}: {pressed} and {}", 0.5 * (v + G * t));
        assert!(pressed > 1.0);
    }
}

#[test]
fn a_range_finder_measures_to_the_next_part_of_another_link() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let cube = Shape::cuboid(Vec3::new(0.2, 0.2, 0.2)).unwrap();
    let drone = world.add(RigidBody::new(cube).with_pose(Pose::translation(0.0, 0.0, 3.0))).unwrap();
    let tilt = 0.3_f64;
    let down = Pose::rotation(Vec3::new(std::f64::consts::PI - tilt, 0.0, 0.0));
    let slant = sensor(&mut world, SensorKind::RangeFinder, Anchor::on(drone, 0, down));
    let up = sensor(&mut world, SensorKind::RangeFinder, site(drone, 0, [0.0; 3]));
    let short = Sensor::new("", SensorKind::RangeFinder, Anchor::on(drone, 0, down)).unwrap().with_cutoff(1.0).unwrap();
    let short = world.add(short).unwrap();
    let value = |world: &World, id| world.reading(id).unwrap()[0];
    assert!((value(&world, slant) - 3.0 / tilt.cos()).abs() < 1e-12);
    steps(&mut world, 10);
    let height = world.part_state(drone, 0).unwrap().position().z;
    assert!((value(&world, slant) - height / tilt.cos()).abs() < 1e-12);
    assert_eq!((value(&world, up), value(&world, short)), (-1.0, 1.0));
}

/// Velocities and accelerations of a site on a moving body against finite differences of its poses.
#[test]
fn velocities_and_accelerations_are_the_differences_of_poses() {
    let mut errors = Vec::new();
    for dt in [1.0 / 120.0, 1.0 / 240.0, 1.0 / 480.0] {
        let mut world = world("time_stepping", dt);
        let bar = RigidBody::new(Shape::cuboid(Vec3::new(0.5, 0.3, 0.1)).unwrap());
        let (bar, table) =
            (world.add(bar.clone()).unwrap(), world.add(bar.with_pose(Pose::translation(3.0, 0.0, 0.0))).unwrap());
        world.set_velocity(bar, Vec3::new(1.0, 0.0, 2.0), Vec3::new(1.0, 2.0, 0.5)).unwrap();
        world.set_velocity(table, Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.5, 1.0)).unwrap();
        let (tip, base) = (site(bar, 0, [0.25, 0.1, 0.0]), site(table, 0, [0.1, 0.0, 0.2]));
        let relative = |world: &mut World, kind| {
            world.add(Sensor::new("", kind, tip).unwrap().relative_to(base).unwrap()).unwrap()
        };
        let position = relative(&mut world, SensorKind::Position);
        let velocity = relative(&mut world, SensorKind::LinearVelocity);
        let orientation = relative(&mut world, SensorKind::Orientation);
        let spin = relative(&mut world, SensorKind::AngularVelocity);
        let world_position = sensor(&mut world, SensorKind::Position, tip);
        let acceleration = sensor(&mut world, SensorKind::LinearAcceleration, tip);
        let turn = |world: &World| {
            let q = world.reading(orientation).unwrap();
            Quat::new_normalize([q[0], q[1], q[2], q[3]].into())
        };
        let frames = (0.5 / dt).round() as usize;
        steps(&mut world, frames - 1);
        let (p0, w0, q0) = (reading(&world, position), reading(&world, world_position), turn(&world));
        world.step().unwrap();
        let (v1, w1, s1, a1) = (
            reading(&world, velocity),
            reading(&world, world_position),
            reading(&world, spin),
            reading(&world, acceleration),
        );
        world.step().unwrap();
        let (p2, w2, q2, a2) =
            (reading(&world, position), reading(&world, world_position), turn(&world), reading(&world, acceleration));
        errors.push([
            ((p2 - p0) / (2.0 * dt) - v1).norm(),
            ((q2 * q0.inverse()).scaled_axis() / (2.0 * dt) - s1).norm(),
            ((w2 - 2.0 * w1 + w0) / (dt * dt) - 0.5 * (a1 + a2)).norm(),
        ]);
    }
    println!("differences: {errors:?}");
    for pair in errors.windows(2) {
        for k in 0..3 {
            let order = (pair[0][k] / pair[1][k]).log2();
            assert!((order - 2.0).abs() < 0.2, "{k}: order {order} of {errors:?}");
        }
    }
}

/// A leg: the calf has one shape and the foot, which a fixed joint holds on it 1 m aside, has two, at 1 m and at 2 m. Each link
/// weighs 2 kg.
fn leg(joint: Joint) -> ArticulatedBody {
    let mass = LinkMass { mass: 2.0, center: Vec3::zeros(), inertia: Mat3::identity() };
    let ball = |x: f64| Collider::new(Shape::sphere(0.1).unwrap(), Pose::translation(x, 0.0, 0.0));
    let calf = LinkBuilder::new("calf", joint).with_pose(Pose::translation(0.0, 0.0, 0.1));
    let calf = calf.with_mass_properties(mass).with_collider(ball(0.0).with_name("knee"));
    let foot = LinkBuilder::new("foot", Joint::Fixed).with_parent("calf").with_mass_properties(mass);
    let foot = foot.with_pose(Pose::translation(1.0, 0.0, 0.0)).with_collider(ball(0.0).with_name("heel"));
    ArticulationBuilder::new("leg").link(calf).link(foot.with_collider(ball(1.0).with_name("toe"))).build().unwrap()
}

#[test]
fn touch_sensors_and_events_tell_a_fixed_foot_from_the_calf_that_carries_it() {
    let slides = Joint::prismatic(Vec3::z());
    // the height of the pads decides which shapes touch: -0.5 is out of reach. A free leg rests on two of them by the law of
    // the lever: its center of mass is at 0.5 m
    for (joint, heights, touched, forces) in [
        (slides, [0.0, -0.5, -0.5], vec![("calf", "knee")], [4.0 * G, 0.0]),
        (slides, [-0.5, 0.0, -0.5], vec![("foot", "heel")], [0.0, 4.0 * G]),
        (slides, [-0.5, -0.5, 0.0], vec![("foot", "toe")], [0.0, 4.0 * G]),
        (Joint::Floating, [0.0, -0.5, 0.0], vec![("calf", "knee"), ("foot", "toe")], [3.0 * G, G]),
        (Joint::Floating, [0.0, 0.0, -0.5], vec![("calf", "knee"), ("foot", "heel")], [2.0 * G, 2.0 * G]),
    ] {
        for stepper in STEPPERS {
            let mut world = world(stepper, 1.0 / 240.0);
            let leg = world.add(leg(joint)).unwrap();
            for (x, height) in heights.into_iter().enumerate() {
                let pad = Shape::cuboid(Vec3::new(0.5, 0.5, 0.2)).unwrap();
                let at = Pose::translation(x as f64, 0.0, height - 0.1);
                world.add_static(RigidBody::fixed(pad).with_pose(at)).unwrap();
            }
            let named = |world: &World, link: &str| {
                world.get::<ArticulatedBody>(leg).unwrap().anchor(leg, link, &Pose::identity()).unwrap()
            };
            let [calf, foot] = ["calf", "foot"].map(|link| {
                let at = named(&world, link);
                sensor(&mut world, SensorKind::Touch, at)
            });
            let by_part = sensor(&mut world, SensorKind::Touch, site(leg, 0, [0.0; 3]));
            steps(&mut world, 60);
            let again = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
            for mut world in [world, again] {
                steps(&mut world, 1);
                let read = |name: usize| world.reading(world.sensors().nth(name).unwrap()).unwrap()[0];
                close(Vec3::new(read(0), read(1), 0.0), [forces[0], forces[1], 0.0], 1e-6, stepper);
                assert_eq!(read(2), read(0), "a part without a name of a link is that of the moving link");
                let leg = world.find("leg").unwrap();
                let mut names: Vec<_> = world
                    .events()
                    .iter()
                    .filter(|event| event.kind == EventKind::ContactPersist)
                    .map(|e| {
                        let name = world.shape_name(leg, e.part_a, e.shape_a).unwrap();
                        (world.part_name(leg, e.part_a).unwrap(), name)
                    })
                    .collect();
                names.sort_unstable();
                assert_eq!(names, touched);
            }
            let _ = (calf, foot, by_part);
        }
    }
}
