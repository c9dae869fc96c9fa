//! Rigid bodies that are steered by torques, against closed forms.

use crate::{Numbers, steps};
use std::f64::consts::FRAC_PI_2;
use tumble_behaviors::{BehaviorError, BodyFlock, Helm, Search, Steering};
use tumble_core::articulated::{ArticulationBuilder, LinkBuilder};
use tumble_core::prelude::*;

/// No force at all.
fn none() -> Steering {
    Steering {
        avoidance: 0.0,
        matching: 0.0,
        clustering: 0.0,
        speed_rate: 0.0,
        boundary_stiffness: 0.0,
        ..Steering::default()
    }
}

fn world(dt: f64) -> World {
    World::new(Settings::default().with_dt(dt).with_gravity(Vec3::zeros())).unwrap()
}

fn fish(position: Vec3, velocity: Vec3) -> RigidBody {
    let body = RigidBody::new(Shape::cuboid(Vec3::new(0.4, 0.1, 0.2)).unwrap()).with_mass(2.0).with_velocity(velocity);
    body.with_pose(Pose::translation(position.x, position.y, position.z))
}

fn flock(world: &mut World, steering: Steering, helm: Helm, bodies: Vec<RigidBody>) -> Vec<ObjectId> {
    let mut flock = BodyFlock::new("fish", steering, helm).unwrap();
    let ids: Vec<ObjectId> = bodies.into_iter().map(|body| world.add(body).unwrap()).collect();
    ids.iter().for_each(|id| flock.push(*id));
    world.add(flock).unwrap();
    ids
}

fn nose(world: &World, id: ObjectId) -> Vec3 {
    world.part_state(id, 0).unwrap().pose.rotation * Vec3::x()
}

/// A nose that is off its course returns by `(1 + k·t)·e^(−k·t)`.
#[test]
fn the_nose_returns_critically_damped() {
    let k = 4.0;
    let off_at = |dt: f64| {
        let mut world = world(dt);
        let turned = Pose::from_parts(Vec3::zeros().into(), Quat::from_axis_angle(&Vec3::z_axis(), 0.3));
        let body = fish(Vec3::zeros(), 3.0 * Vec3::x()).with_pose(turned);
        let id = flock(&mut world, none(), Helm { agility: k, ..Helm::default() }, vec![body])[0];
        (1..=4)
            .map(|quarter| {
                steps(&mut world, (0.25 / dt).round() as usize);
                let (t, n) = (0.25 * f64::from(quarter), nose(&world, id));
                assert!((world.part_state(id, 0).unwrap().velocity - 3.0 * Vec3::x()).norm() < 1e-12);
                (n.y.atan2(n.x) - 0.3 * (1.0 + k * t) * (-k * t).exp()).abs()
            })
            .fold(0.0, f64::max)
    };
    let (coarse, fine) = (off_at(1.0 / 120.0), off_at(1.0 / 480.0));
    assert!(fine < 0.3 * coarse && fine < 1e-3, "of first order: {coarse:e}, {fine:e}");
}

/// Around the center of a spring a body turns at `√(k/m)`; its helm turns the nose at that rate, without a lag.
#[test]
fn the_turn_rate_reaches_the_commanded_one() {
    for (rate, start) in [(0.5f64, 0.0), (1.5, 1.2), (0.8, 2.8)] {
        let mut world = world(1.0 / 240.0);
        let steering = Steering { boundary_radius: 0.0, boundary_stiffness: 2.0 * rate * rate, ..none() };
        let wrong = Quat::from_axis_angle(&Vec3::y_axis(), start); // the nose is anywhere
        let body = fish(Vec3::zeros(), 10.0 * rate * Vec3::y());
        let body = body.with_pose(Pose::from_parts(Vec3::new(10.0, 0.0, 0.0).into(), wrong));
        let helm = Helm { bank_time: 0.5, ..Helm::default() };
        let id = flock(&mut world, steering, helm, vec![body])[0];
        steps(&mut world, 960);
        for _ in 0..240 {
            world.step().unwrap();
            let state = *world.part_state(id, 0).unwrap();
            assert!((state.angular_velocity - rate * Vec3::z()).norm() < 5e-3 * rate, "{}", state.angular_velocity);
            assert!(nose(&world, id).dot(&state.velocity.normalize()) > 1.0 - 1e-5);
            let inward = -state.position().normalize();
            let lean = (state.pose.rotation * Vec3::z()).dot(&inward);
            assert!((lean - (0.5 * rate * FRAC_PI_2).sin()).abs() < 5e-3, "{lean}");
        }
    }
}

#[test]
fn momentum_and_energy_are_kept_in_a_central_elastic_collision() {
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let mut world = world(dt);
        let bouncy = Material { restitution: 1.0, friction: 0.0, ..Material::default() };
        let ball = |x: f64, v: f64, mass: f64| {
            let body = RigidBody::new(Shape::sphere(0.2).unwrap()).with_mass(mass).with_material(bouncy);
            body.with_pose(Pose::translation(x, 0.0, 0.0)).with_velocity(Vec3::new(v, 0.0, 0.0))
        };
        let ids = flock(&mut world, none(), Helm::default(), vec![ball(-1.0, 2.0, 1.0), ball(1.0, -1.0, 3.0)]);
        steps(&mut world, (2.0 / dt) as usize);
        let [a, b] = [ids[0], ids[1]].map(|id| world.part_state(id, 0).unwrap().velocity);
        // the common velocity is −¼ m/s: v' = 2·v_c − v
        assert!((a - Vec3::new(-2.5, 0.0, 0.0)).norm() < 1e-9, "{a}");
        assert!((b - Vec3::new(0.5, 0.0, 0.0)).norm() < 1e-9, "{b}");
        // both have turned around
        assert!(nose(&world, ids[0]).x < -0.999 && nose(&world, ids[1]).x > 0.999);
    }
}

#[test]
fn bodies_that_collide_off_center_spin_and_find_their_course_again() {
    let mut world = world(1.0 / 240.0);
    let left = fish(Vec3::new(-1.0, 0.0, 0.06), 3.0 * Vec3::x());
    let right = fish(Vec3::new(1.0, 0.07, 0.0), -2.0 * Vec3::x());
    let about = Quat::from_axis_angle(&Vec3::z_axis(), std::f64::consts::PI);
    let right = right.with_pose(Pose::from_parts(Vec3::new(1.0, 0.07, 0.0).into(), about));
    let ids = flock(&mut world, none(), Helm::default(), vec![left, right]);
    let momentum = || 2.0 * (3.0 - 2.0) * Vec3::x();
    let mut fastest = 0.0f64;
    for _ in 0..960 {
        world.step().unwrap();
        let states = [ids[0], ids[1]].map(|id| *world.part_state(id, 0).unwrap());
        let now = 2.0 * (states[0].velocity + states[1].velocity);
        assert!((now - momentum()).norm() < 1e-9, "{now}");
        fastest = fastest.max(states[0].angular_velocity.norm());
    }
    assert!(fastest > 2.0, "the collision turns them: {fastest} rad/s");
    for id in ids {
        let state = world.part_state(id, 0).unwrap();
        assert!(state.velocity.norm() > 0.05, "{}", state.velocity);
        assert!(nose(&world, id).dot(&state.velocity.normalize()) > 0.9999, "{}", nose(&world, id));
        assert!(state.angular_velocity.norm() < 1e-2);
    }
}

#[test]
fn a_school_has_the_same_bits_for_both_searches_and_any_number_of_threads() {
    let run = |search, threads| {
        let mut world = world(1.0 / 120.0);
        world.set_settings(world.settings().with_threads(threads)).unwrap();
        let mut numbers = Numbers(9);
        let mut flock = BodyFlock::new("fish", Steering::default(), Helm::default()).unwrap().with_search(search);
        for _ in 0..150 {
            flock.push(world.add(fish(numbers.vector(8.0), numbers.vector(5.0))).unwrap());
        }
        world.add(flock).unwrap();
        steps(&mut world, 60);
        world.save()
    };
    let first = run(Search::Grid, 1);
    assert!(first == run(Search::BruteForce, 1) && first == run(Search::Grid, 3));
}

#[test]
fn a_body_without_speed_stops_its_spin_and_bad_constants_are_refused() {
    let mut world = world(1.0 / 240.0);
    let helm = Helm { agility: 5.0, ..Helm::default() };
    let id =
        flock(&mut world, none(), helm, vec![fish(Vec3::zeros(), Vec3::zeros()).with_angular_velocity(Vec3::z())])[0];
    steps(&mut world, 240);
    let spin = world.part_state(id, 0).unwrap().angular_velocity.z;
    assert!((spin - (-10.0f64).exp()).abs() < 1e-5, "{spin}");
    let bad = [
        Helm { agility: -1.0, ..Helm::default() },
        Helm { max_angular_acceleration: f64::NAN, ..Helm::default() },
        Helm { up: Vec3::zeros(), ..Helm::default() },
    ];
    for helm in bad {
        assert!(matches!(BodyFlock::new("fish", none(), helm), Err(BehaviorError::Range { .. })));
    }
}

/// Two halves of a fish, side by side, on a slide along the nose that a spring (N/m) holds. The root is the left half.
fn halves(world: &mut World, stiffness: f64, pose: Pose, velocity: Vec3) -> ObjectId {
    let half = |name: &str, joint: Joint, y: f64| {
        let shape = Shape::cuboid(Vec3::new(0.4, 0.05, 0.2)).unwrap();
        LinkBuilder::new(name, joint).with_shape(shape, Pose::translation(0.0, y, 0.0)).with_mass(1.0)
    };
    let slide = half("right", Joint::Prismatic { axis: Vec3::x() }, -0.025).with_spring(stiffness, 0.0);
    let body = ArticulationBuilder::new("halves").with_self_collision(false).link(half("left", Joint::Floating, 0.025));
    let body = body.link(slide.with_joint_damping(0.02 * stiffness).with_parent("left")).build().unwrap();
    let mut v = vec![0.0; body.model().dof()];
    v[3..6].copy_from_slice(velocity.as_slice());
    world.add(body.with_pose(pose).with_velocities(&v).unwrap()).unwrap()
}

/// The halves together are the fish of one piece: the same mass, center and inertia. So they go the same way and turn alike, the
/// closer the stiffer the spring and the shorter the step.
#[test]
fn an_articulated_body_is_steered_as_the_rigid_one_of_its_links() {
    let steering =
        Steering { boundary_radius: 2.0, boundary_stiffness: 2.0, desired_speed: 3.0, speed_rate: 1.0, ..none() };
    let start = Pose::from_parts(Vec3::new(1.5, 0.0, 0.0).into(), Quat::from_axis_angle(&Vec3::z_axis(), 0.9));
    let velocity = Vec3::new(1.0, 2.5, 0.2);
    let end = |rate: f64, stiffness: Option<f64>| {
        let mut world = world(1.0 / rate);
        let mut flock = BodyFlock::new("fish", steering, Helm::default()).unwrap();
        let id = match stiffness {
            None => world.add(fish(Vec3::zeros(), velocity).with_pose(start)).unwrap(),
            Some(stiffness) => halves(&mut world, stiffness, start, velocity),
        };
        assert!(BodyFlock::steers(world.object(id).unwrap()));
        flock.push(id);
        world.add(flock).unwrap();
        steps(&mut world, (2.0 * rate) as usize);
        let state = *world.part_state(id, 0).unwrap();
        (state.position(), state.pose.rotation)
    };
    // two kinds of objects integrate rotations each in its way, so the steps get shorter too
    let gaps = [(240.0, 1e3), (480.0, 1e4), (960.0, 1e5)].map(|(rate, stiffness)| {
        let (rigid, articulated) = (end(rate, None), end(rate, Some(stiffness)));
        assert!((rigid.0 - start.translation.vector).norm() > 1.0, "it flies");
        ((rigid.0 - articulated.0).norm(), rigid.1.angle_to(&articulated.1))
    });
    println!("gaps {gaps:?}");
    for (soft, stiff) in gaps.iter().zip(&gaps[1..]) {
        assert!(stiff.0 < 0.5 * soft.0 && stiff.1 < 0.5 * soft.1, "{gaps:?}");
    }
    assert!(gaps[2].0 < 1e-4 && gaps[2].1 < 1e-4, "{gaps:?}");
}

#[test]
fn a_body_that_does_not_float_is_not_steered() {
    let mut world = world(1.0 / 60.0);
    let shape = Shape::cuboid(Vec3::new(0.4, 0.1, 0.2)).unwrap();
    let link = LinkBuilder::new("arm", Joint::Revolute { axis: Vec3::z() }).with_shape(shape, Pose::identity());
    let arm = world.add(ArticulationBuilder::new("arm").link(link.with_mass(1.0)).build().unwrap()).unwrap();
    assert!(!BodyFlock::steers(world.object(arm).unwrap()));
    let mut flock = BodyFlock::new("fish", Steering::default(), Helm::default()).unwrap();
    flock.push(arm);
    let before = world.state_of(arm).unwrap().to_vec();
    world.add(flock).unwrap();
    steps(&mut world, 60);
    assert_eq!(world.state_of(arm).unwrap(), before);
}

/// A flock in moving air is the same flock in still air, seen from a frame that moves.
#[test]
fn a_flock_in_wind_drifts_with_it() {
    let wind = Vec3::new(-7.0, 2.0, 0.5);
    let paths = [Vec3::zeros(), wind].map(|wind| {
        let mut world = world(1.0 / 120.0);
        let steering = Steering { boundary_stiffness: 0.0, desired_speed: 4.0, ..Steering::default() };
        let mut numbers = Numbers(3);
        let bodies = (0..12).map(|_| fish(numbers.vector(4.0), numbers.vector(3.0) + wind)).collect();
        let ids = flock(&mut world, steering, Helm { wind, ..Helm::default() }, bodies);
        steps(&mut world, 360);
        ids.iter()
            .map(|id| {
                let state = *world.part_state(*id, 0).unwrap();
                (state.position() - 3.0 * wind, state.velocity - wind, state.pose.rotation)
            })
            .collect::<Vec<_>>()
    });
    for (still, moving) in paths[0].iter().zip(&paths[1]) {
        let gaps = [(still.0 - moving.0).norm(), (still.1 - moving.1).norm(), still.2.angle_to(&moving.2)];
        assert!(gaps.iter().all(|gap| *gap < 1e-7), "{gaps:?}");
    }
}
