//! Damping, gravity scale, own mass properties and locked axes of rigid bodies, against closed forms
//! at several lengths of a step.

use crate::common::*;
use tumble_core::collide::{Mat3, Pose, Quat, Vec3};
use tumble_core::*;

const STEPS: [f64; 3] = [1.0 / 30.0, 1.0 / 240.0, 1.0 / 1000.0];

fn run(world: &mut World, seconds: f64) {
    let steps = (seconds / world.settings().dt).round() as usize;
    for _ in 0..steps {
        world.step().unwrap();
    }
}

fn with_integrator(stepper: &str, integrator: Integrator, dt: f64) -> World {
    let mut world = world(stepper, dt);
    world.set_settings(world.settings().with_integrator(integrator)).unwrap();
    world
}

/// Returns every stepper with the integrators of first and second order.
fn methods(dt: f64) -> Vec<World> {
    let mut all = vec![world("time_stepping", dt)];
    for integrator in [Integrator::Verlet, Integrator::SymplecticEuler, Integrator::ExplicitEuler] {
        all.push(with_integrator("backtracking", integrator, dt));
    }
    all
}

#[test]
fn damping_is_an_exact_exponential_at_every_step() {
    for dt in STEPS {
        for mut world in methods(dt) {
            let (c, k) = (3.0, 7.0);
            let body =
                RigidBody::new(cube(0.2)).with_mass(2.0).with_damping(c, k).with_velocity(Vec3::new(5.0, 0.0, 0.0));
            let id = world.add(body.with_angular_velocity(Vec3::new(0.0, 0.0, 4.0))).unwrap();
            run(&mut world, 1.0);
            let v = velocity(&world, id);
            assert!((v.x - 5.0 * (-c).exp()).abs() < 1e-12, "{dt}: {v:?}");
            // dv/dt = −g − c v
            assert!((v.z + G / c * (1.0 - (-c).exp())).abs() < 1e-12, "{dt}: {v:?}");
            let spin = world.body(id).unwrap().angular_velocity();
            assert!((spin.z - 4.0 * (-k).exp()).abs() < 1e-12, "{dt}: {spin:?}");
            run(&mut world, 20.0);
            assert!((velocity(&world, id).z + G / c).abs() < 1e-12, "{dt}: the terminal velocity");
        }
    }
}

#[test]
fn strong_damping_stops_a_body_and_keeps_it_stable() {
    for mut world in methods(1.0 / 60.0) {
        let body = RigidBody::new(sphere(0.1)).with_damping(1e4, 1e4).with_velocity(Vec3::new(5.0, 0.0, 0.0));
        let id = world.add(body).unwrap();
        run(&mut world, 1.0);
        assert!((velocity(&world, id) + Vec3::z() * (G / 1e4)).norm() < 1e-12);
    }
}

/// With damping the position of the second-order methods has an error of second order, and RK4
/// keeps its fourth.
#[test]
fn damping_keeps_the_order_of_the_integrators() {
    let error = |stepper: &str, integrator: Integrator, dt: f64| {
        let mut world = with_integrator(stepper, integrator, dt);
        let body = RigidBody::new(sphere(0.1)).with_damping(2.0, 0.0).with_velocity(Vec3::new(5.0, 0.0, 0.0));
        let id = world.add(body).unwrap();
        run(&mut world, 1.0);
        (position(&world, id).x - 2.5 * (1.0 - (-2.0f64).exp())).abs()
    };
    for (stepper, integrator, order) in [
        ("time_stepping", Integrator::Verlet, 2.0),
        ("backtracking", Integrator::Verlet, 2.0),
        ("backtracking", Integrator::Rk4, 4.0),
    ] {
        let (coarse, fine) = (error(stepper, integrator, 0.1), error(stepper, integrator, 0.05));
        assert!(((coarse / fine).log2() - order).abs() < 0.2, "{stepper}, {integrator:?}: {coarse} and {fine}");
    }
}

#[test]
fn gravity_is_scaled() {
    for dt in STEPS {
        for stepper in STEPPERS {
            let mut world = world(stepper, dt);
            let scales = [0.0, 0.5, 1.0, -2.0];
            let ids = scales.map(|scale| world.add(RigidBody::new(sphere(0.1)).with_gravity_scale(scale)).unwrap());
            for (k, id) in ids.iter().enumerate() {
                world.set_pose(*id, Pose::translation(k as f64, 0.0, 0.0)).unwrap();
            }
            let energy = world.energy().total();
            run(&mut world, 1.0);
            for (scale, id) in scales.iter().zip(ids) {
                assert!((position(&world, id).z + 0.5 * scale * G).abs() < 1e-9, "{stepper}, {dt}: {scale}");
            }
            assert!((world.energy().total() - energy).abs() < 1e-9, "{stepper}, {dt}");
        }
    }
}

/// The center of mass of a spinning body flies on a parabola, and its frame circles around it.
#[test]
fn a_body_with_a_center_of_mass_of_its_own_turns_about_it() {
    for dt in STEPS {
        for stepper in STEPPERS {
            let mut world = world(stepper, dt);
            let inertia = Mat3::from_diagonal(&Vec3::new(0.3, 0.4, 0.5));
            let center = Vec3::new(0.2, 0.0, 0.0);
            let body = RigidBody::new(cube(0.4)).with_mass_and_inertia(3.0, inertia).with_center_of_mass(center);
            let spin = Vec3::new(0.0, 0.0, 2.0);
            let id = world.add(body.with_velocity(Vec3::new(1.0, 0.0, 4.0)).with_angular_velocity(spin)).unwrap();
            let momentum = world.momentum();
            assert!((momentum.linear - Vec3::new(3.0, 0.0, 12.0)).norm() < 1e-12);
            let view = world.body(id).unwrap();
            assert!(view.position().norm() < 1e-12, "it is placed by the frame of its shape");
            assert!((world.center_state(id).unwrap().position() - center).norm() < 1e-12);
            run(&mut world, 1.0);
            let state = world.center_state(id).unwrap();
            assert!((state.position() - Vec3::new(1.2, 0.0, 4.0 - 0.5 * G)).norm() < 1e-9, "{stepper}, {dt}");
            let turned = Quat::from_scaled_axis(spin);
            let view = world.body(id).unwrap();
            assert!((view.position() - (state.position() - turned * center)).norm() < 1e-9, "{stepper}, {dt}");
            assert!((view.velocity() - Vec3::new(1.0, 0.0, 4.0 - G)).norm() < 1e-9, "of the center of mass");
            assert!(
                (world.part_state(id, 0).unwrap().velocity - (view.velocity() - spin.cross(&(turned * center)))).norm()
                    < 1e-9
            );
            // forces are evaluated in the middle of a step, and the arm is that of its end
            assert!((view.acceleration() + Vec3::z() * G).norm() < dt);
        }
    }
}

/// A ball whose center of mass is `d` below its middle rocks on the ground: `ω² = m g d/(I + m (r −
/// d)²)` for small angles.
#[test]
fn a_weighted_ball_rocks_with_the_period_of_theory() {
    let (mass, radius, d, moment) = (2.0, 0.5, 0.2, 0.05);
    let omega = (mass * G * d / (moment + mass * (radius - d) * (radius - d))).sqrt();
    for stepper in STEPPERS {
        for dt in [1.0 / 240.0, 1.0 / 1000.0] {
            let mut world = world(stepper, dt);
            ground(&mut world, 0.0, 1.0);
            let inertia = Mat3::from_diagonal_element(moment);
            let body = RigidBody::new(sphere(radius)).with_mass_and_inertia(mass, inertia);
            let angle = 0.01;
            let pose = Pose::from_parts(Vec3::new(0.0, 0.0, radius).into(), Quat::from_scaled_axis(Vec3::y() * angle));
            let id = world.add(body.with_center_of_mass(Vec3::new(0.0, 0.0, -d)).with_pose(pose)).unwrap();
            let tilt = |world: &World| world.body(id).unwrap().orientation().scaled_axis().y;
            let (mut before, mut crossings) = (tilt(&world), Vec::new());
            while crossings.len() < 5 {
                world.step().unwrap();
                let now = tilt(&world);
                if before * now < 0.0 {
                    crossings.push(world.time() - dt * now / (now - before));
                }
                before = now;
                assert!(world.time() < 20.0, "{stepper}: {crossings:?}");
            }
            let period = 2.0 * (crossings[4] - crossings[0]) / 4.0;
            let wanted = std::f64::consts::TAU / omega;
            assert!((period - wanted).abs() < 2e-3 * wanted, "{stepper}, {dt}: {period} instead of {wanted}");
        }
    }
}

#[test]
fn an_impulse_acts_with_the_arm_about_the_own_center_of_mass() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let inertia = Mat3::from_diagonal(&Vec3::new(0.3, 0.4, 0.5));
    let body =
        RigidBody::new(cube(0.4)).with_mass_and_inertia(2.0, inertia).with_center_of_mass(Vec3::new(0.3, 0.0, 0.0));
    let id = world.add(body).unwrap();
    // at the origin of the frame, 0.3 m beside the center
    world.apply_impulse(id, 0, Vec3::new(0.0, 4.0, 0.0), &Vec3::zeros()).unwrap();
    let view = world.body(id).unwrap();
    assert!((view.velocity() - Vec3::new(0.0, 2.0, 0.0)).norm() < 1e-12);
    assert!((view.angular_velocity() - Vec3::new(0.0, 0.0, -0.3 * 4.0 / 0.5)).norm() < 1e-12);
    // a force for one step has the same effect
    let force = Vec3::new(0.0, -400.0, 0.0);
    let other = world.add(world.get::<RigidBody>(id).unwrap().clone().with_name("other")).unwrap();
    world.set_collidable(other, false).unwrap();
    world.apply_force(other, 0, force, &Vec3::zeros()).unwrap();
    world.step().unwrap();
    let view = world.body(other).unwrap();
    assert!((view.velocity() - Vec3::new(0.0, -2.0, 0.0)).norm() < 1e-9);
    assert!((view.angular_velocity() - Vec3::new(0.0, 0.0, 2.4)).norm() < 1e-9);
}

#[test]
fn constants_change_in_motion_and_the_motion_stays() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let pose = Pose::from_parts(Vec3::new(1.0, 2.0, 3.0).into(), Quat::from_scaled_axis(Vec3::new(0.4, 0.2, -0.7)));
    let body = RigidBody::new(cube(0.4)).with_mass(2.0).with_pose(pose).with_velocity(Vec3::new(1.0, 0.0, 0.5));
    let id = world.add(body.with_angular_velocity(Vec3::new(0.3, 1.0, 0.0))).unwrap();
    let points = [Vec3::zeros(), Vec3::x(), Vec3::new(3.0, -1.0, 2.0)];
    let motion = |world: &World| points.map(|p| world.body(id).unwrap().velocity_at(&p));
    let (before, moment) = (motion(&world), world.get::<RigidBody>(id).unwrap().inertia().m11);
    let same = |world: &World| {
        motion(world).iter().zip(&before).all(|(a, b)| (a - b).norm() < 1e-12)
            && (world.pose(id, 0).unwrap().translation.vector - pose.translation.vector).norm() < 1e-12
    };
    world.set_mass(id, 6.0).unwrap();
    let constants = world.get::<RigidBody>(id).unwrap();
    assert!(same(&world) && constants.mass() == 6.0 && (constants.inertia().m11 - 3.0 * moment).abs() < 1e-15);
    assert!((world.momentum().linear - 6.0 * Vec3::new(1.0, 0.0, 0.5)).norm() < 1e-12);
    world.set_inertia(id, Mat3::from_diagonal(&Vec3::new(1.0, 2.0, 2.5))).unwrap();
    assert!(same(&world));
    world.set_center_of_mass(id, Vec3::new(0.1, -0.2, 0.3)).unwrap();
    assert!(same(&world) && world.get::<RigidBody>(id).unwrap().center_of_mass() == Vec3::new(0.1, -0.2, 0.3));
    let archived = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    assert_eq!(archived.save(), world.save());
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let saved = world.save();
        assert!(world.set_mass(id, wrong).is_err());
        assert!(world.set_inertia(id, Mat3::from_diagonal_element(wrong)).is_err() || wrong == f64::INFINITY);
        assert!(wrong.is_finite() || world.set_center_of_mass(id, Vec3::repeat(wrong)).is_err());
        assert!(world.change_body(id, |body| body.gravity_scale = wrong).is_err() || wrong.is_finite());
        assert_eq!(world.save(), saved, "a refused constant changes nothing");
    }
    assert!(world.change_body(ObjectId::default(), |_| ()).is_err());
    let (mut fork, mut archived) = (world.fork(), archived);
    run(&mut world, 0.5);
    run(&mut fork, 0.5);
    run(&mut archived, 0.5);
    assert_eq!((fork.save(), archived.save()), (world.save(), world.save()));
}

fn locks(names: &[&str]) -> LockedAxes {
    LockedAxes::of_names(names.iter().copied()).unwrap()
}

#[test]
fn names_of_locked_axes() {
    assert_eq!(locks(&["x", "rotation_z"]).names().collect::<Vec<_>>(), ["x", "rotation_z"]);
    assert_eq!(LockedAxes::of_names(["y", "w"]), Err("w"));
    assert_eq!(locks(&LockedAxes::NAMES), LockedAxes { translation: [true; 3], rotation: [true; 3] });
}

#[test]
fn a_body_does_not_move_along_locked_axes() {
    for dt in STEPS {
        for stepper in STEPPERS {
            let mut world = world(stepper, dt);
            let body =
                RigidBody::new(cube(0.2)).with_mass(2.0).with_locked(locks(&["x", "z", "rotation_x", "rotation_y"]));
            let id = world.add(body.with_velocity(Vec3::repeat(1.0)).with_angular_velocity(Vec3::repeat(2.0))).unwrap();
            let moment = world.get::<RigidBody>(id).unwrap().inertia().m33;
            let steps = (1.0 / dt).round() as usize;
            for _ in 0..steps {
                world.apply_force(id, 0, Vec3::new(7.0, 4.0, 9.0), &position(&world, id)).unwrap();
                world.apply_torque(id, 0, Vec3::repeat(0.02)).unwrap();
                world.step().unwrap();
            }
            let view = world.body(id).unwrap();
            assert!((view.position() - Vec3::new(0.0, 2.0, 0.0)).norm() < 1e-9, "y = t + t²: {:?}", view.position());
            assert!((view.velocity() - Vec3::new(0.0, 3.0, 0.0)).norm() < 1e-9);
            let spin = 2.0 + 0.02 / moment;
            assert!((view.angular_velocity() - Vec3::new(0.0, 0.0, spin)).norm() < 1e-9, "{stepper}, {dt}");
            assert!((view.acceleration() - Vec3::new(0.0, 2.0, 0.0)).norm() < 1e-9);
        }
    }
}

/// An elastic impact on a body that is locked along the normal is one on a wall.
#[test]
fn a_locked_axis_has_no_inverse_mass_in_an_impact() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 240.0));
        let elastic = Material { restitution: 1.0, friction: 0.0, ..Material::default() };
        let ball = |x: f64| {
            RigidBody::new(sphere(0.1)).with_mass(1.0).with_material(elastic).with_pose(Pose::translation(x, 0.0, 0.0))
        };
        let flying = world.add(ball(-1.0).with_velocity(Vec3::new(2.0, 0.0, 0.0))).unwrap();
        let locked = world.add(ball(0.0).with_locked(locks(&["x"]))).unwrap();
        run(&mut world, 1.0);
        assert!(
            (velocity(&world, flying) + Vec3::x() * 2.0).norm() < 1e-9,
            "{stepper}: {:?}",
            velocity(&world, flying)
        );
        assert_eq!(position(&world, locked).x, 0.0);
        assert!(velocity(&world, locked).norm() < 1e-9);
    }
}

/// Both sides of a contact may be unable to move along its normal, or at all.
#[test]
fn contacts_along_locked_axes_are_harmless() {
    for stepper in STEPPERS {
        for solver in solver::NAMES {
            let mut world = world(stepper, 1.0 / 240.0);
            world.set_solver(solver::by_name(solver).unwrap());
            ground(&mut world, 0.0, 0.5);
            let block = |x: f64, height: f64| {
                RigidBody::new(cube(0.2)).with_mass(1.0).with_pose(Pose::translation(x, 0.0, height))
            };
            let upright = world.add(block(0.0, 0.1).with_locked(locks(&["z"])).with_velocity(Vec3::x())).unwrap();
            let frozen = world.add(block(1.0, 0.1).with_locked(locks(&LockedAxes::NAMES))).unwrap();
            let deep = world.add(block(2.0, 0.05).with_locked(locks(&["z", "rotation_x", "rotation_y"]))).unwrap();
            let load = world.add(block(1.0, 0.3)).unwrap();
            run(&mut world, 1.0);
            for (id, height) in [(upright, 0.1), (frozen, 0.1), (deep, 0.05), (load, 0.3)] {
                assert!(
                    (position(&world, id).z - height).abs() < 1e-4,
                    "{stepper}, {solver}: {:?}",
                    position(&world, id)
                );
            }
            assert!(velocity(&world, load).norm() < 1e-3, "{stepper}, {solver}");
            assert!(world.report().residual < 1e-6, "{stepper}, {solver}: {}", world.report().residual);
        }
    }
}

/// A block that cannot turn slides down a slope like a point: `a = g (sin α − µ cos α)`.
#[test]
fn a_ball_that_cannot_turn_slides() {
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        for stepper in STEPPERS {
            let (angle, friction) = (0.5f64, 0.2);
            let mut world = world(stepper, dt);
            slope(&mut world, angle, friction);
            let normal = Quat::from_scaled_axis(Vec3::y() * angle) * Vec3::z();
            let material = Material { friction, ..Material::default() };
            let body = RigidBody::new(sphere(0.1)).with_material(material);
            let body = body.with_locked(locks(&["rotation_x", "rotation_y", "rotation_z"]));
            let id = world.add(body.with_pose(Pose::from_parts((0.1 * normal).into(), Quat::identity()))).unwrap();
            run(&mut world, 1.0);
            let wanted = G * (angle.sin() - friction * angle.cos());
            assert!((velocity(&world, id).norm() - wanted).abs() < 5e-3 * wanted, "{stepper}, {dt}");
            assert_eq!(world.body(id).unwrap().angular_velocity(), Vec3::zeros());
        }
    }
}

/// With two free axes of rotation the angular momentum along them stays, and the motion converges
/// with second order.
#[test]
fn rotation_about_two_free_axes_has_second_order() {
    let turned = |stepper: &str, dt: f64| {
        let mut world = no_gravity(world(stepper, dt));
        let inertia = Mat3::from_diagonal(&Vec3::new(0.2, 0.5, 0.6));
        let body = RigidBody::new(cube(0.2)).with_mass_and_inertia(1.0, inertia).with_locked(locks(&["rotation_z"]));
        let pose = Pose::from_parts(Vec3::zeros().into(), Quat::from_scaled_axis(Vec3::new(0.3, 0.4, 0.5)));
        let id = world.add(body.with_pose(pose).with_angular_velocity(Vec3::new(2.0, 1.0, 5.0))).unwrap();
        let (momentum, energy) = (world.state()[10..13].to_vec(), world.energy().kinetic);
        assert_eq!((momentum[2], world.body(id).unwrap().angular_velocity().z), (0.0, 0.0));
        run(&mut world, 2.0);
        assert_eq!(world.state()[10..13], momentum[..], "no torque acts");
        assert_eq!(world.body(id).unwrap().angular_velocity().z, 0.0);
        assert!(
            (world.energy().kinetic - energy).abs() < 0.3 * dt * dt * 1e2 * energy,
            "{}",
            world.energy().kinetic - energy
        );
        world.body(id).unwrap().orientation()
    };
    for stepper in STEPPERS {
        let [coarse, middle, fine, exact] = [0.04, 0.02, 0.01, 0.000_5].map(|dt| turned(stepper, dt));
        let errors = [coarse, middle, fine].map(|q| q.angle_to(&exact));
        for pair in errors.windows(2) {
            assert!(((pair[0] / pair[1]).log2() - 2.0).abs() < 0.25, "{stepper}: {errors:?}");
        }
    }
}

/// A pendulum on a cart that only moves along x: `ω² = (1 + m/M)·g/l` for small swings. Bob and cart are
/// joined by a loop joint, which acts on the free axis of the cart alone.
#[test]
fn a_joint_acts_on_the_free_axes_alone() {
    let (mass, bob_mass, length, angle) = (3.0, 1.5, 0.8, 1e-3_f64);
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let cart = RigidBody::new(cube(0.2)).with_mass(mass).with_locked(locks(&[
            "y",
            "z",
            "rotation_x",
            "rotation_y",
            "rotation_z",
        ]));
        let cart = world.add(cart).unwrap();
        // the rod has no inertia to speak of
        let at = Vec3::new(length * angle.sin(), 0.0, -length * angle.cos());
        let bob = RigidBody::new(sphere(0.05))
            .with_mass_and_inertia(bob_mass, Mat3::identity() * 1e-6)
            .with_pose(Pose::from_parts(at.into(), Quat::identity()));
        let bob = world.add(bob).unwrap();
        world.set_collidable(bob, false).unwrap();
        let pin =
            LoopJoint::revolute_at("pin", &world, Some((bob, 0)), Some((cart, 0)), Vec3::zeros(), Vec3::y()).unwrap();
        world.add(pin).unwrap();
        let omega = ((1.0 + bob_mass / mass) * G / length).sqrt();
        let period = std::f64::consts::TAU / omega;
        let amplitude = bob_mass / (mass + bob_mass) * length * angle;
        for k in 1..=(3.0 * period * 240.0) as usize {
            world.step().unwrap();
            let expected = amplitude * (1.0 - (omega * k as f64 / 240.0).cos());
            let x = position(&world, cart).x;
            assert!((x - expected).abs() < 0.02 * amplitude, "{stepper}, step {k}: {x} for {expected}");
        }
        let pose = world.body(cart).unwrap().pose();
        assert_eq!((pose.translation.y, pose.translation.z, pose.rotation), (0.0, 0.0, Quat::identity()));
    }
}
