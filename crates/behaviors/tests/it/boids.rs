//! Heading and bank of single boids.

use crate::{Numbers, boid, steps, world};
use std::f64::consts::FRAC_PI_2;
use tumble_behaviors::{BehaviorError, Boid};
use tumble_core::prelude::*;

#[test]
fn the_nose_points_along_any_velocity() {
    let mut numbers = Numbers(3);
    for k in 0..2000 {
        let near = [1.0, 1e-3, 1e-7, 1e-11, 1e-13, 1e-200, 0.0][k % 7];
        let across = near * numbers.vector(1.0);
        let velocity = Vec3::new(if k % 2 == 0 { -1.0 } else { 1.0 } * (1.0 + across.x), across.y, across.z) * 7.0;
        let heading = Boid::heading(&velocity);
        assert!((heading * Vec3::x() - velocity.normalize()).norm() < 1e-12, "{velocity}");
        assert!((heading.into_inner().norm() - 1.0).abs() < 1e-15);
        // the shortest rotation has its axis across x
        assert_eq!(heading.into_inner().coords.x, 0.0);
    }
    assert_eq!(Boid::heading(&Vec3::zeros()), Quat::identity());
}

#[test]
fn straight_back_is_half_a_turn_about_z() {
    for back in [-1e-6, -1.0, -30.0] {
        let heading = Boid::heading(&Vec3::new(back, 0.0, 0.0));
        assert!((heading * Vec3::z() - Vec3::z()).norm() < 1e-15, "not upside down");
        assert!((heading * Vec3::y() + Vec3::y()).norm() < 1e-15);
    }
}

#[test]
fn a_boid_that_flies_straight_back_banks_into_its_turn() {
    // left of a boid that flies along −x is −y: 2 kg at 5 m/s, 4 N to the left turn it at 0.4 rad/s
    let boid = Boid::new(Shape::sphere(0.1).unwrap(), 2.0).unwrap();
    let (back, left) = (Vec3::new(-5.0, 0.0, 0.0), Vec3::new(0.0, -4.0, 0.0));
    assert!((boid.wanted_bank(&back, &left) + 0.4 * FRAC_PI_2).abs() < 1e-15);
    assert!((boid.wanted_bank(&back, &-left) - 0.4 * FRAC_PI_2).abs() < 1e-15);
    // at most a quarter turn; none at rest, none by a force along the velocity
    assert_eq!(boid.wanted_bank(&back, &(1e3 * left)), -FRAC_PI_2);
    assert_eq!(boid.wanted_bank(&Vec3::zeros(), &left), 0.0);
    assert_eq!(boid.wanted_bank(&back, &back).abs(), 0.0);
}

#[test]
fn a_steady_turn_has_the_bank_of_its_rate() {
    // a force across the velocity: a circle at 10 m/s with 0.5 rad/s to the left, through v = −x
    let mut world = world();
    let id = world.add(boid(Vec3::zeros(), Vec3::new(10.0, 0.0, 0.0))).unwrap();
    world
        .add_force("turn", move |view, out| out.act_on(view, id, |state| 0.5 * Vec3::z().cross(&state.velocity)))
        .unwrap();
    let mut most_back = 1.0f64;
    for frame in 0..2400 {
        world.step().unwrap();
        let state = world.part_state(id, 0).unwrap();
        let nose = state.pose.rotation * Vec3::x();
        assert!((nose - state.velocity.normalize()).norm() < 1e-12);
        most_back = most_back.min(nose.x);
        if frame > 600 {
            // by ¼π to the left: the up axis leans by sin 45° to the center of the circle
            let lean = (state.pose.rotation * Vec3::z()).dot(&Vec3::z().cross(&nose));
            assert!((lean - (0.5 * FRAC_PI_2).sin()).abs() < 1e-4, "{lean}");
        }
    }
    assert!(most_back < -0.9999);
    // one turn takes 4π s: after 20 s the velocity has turned by 10 rad
    let v = world.part_state(id, 0).unwrap().velocity;
    assert!((v.y.atan2(v.x) - (10.0 - 4.0 * std::f64::consts::PI)).abs() < 1e-3, "{v}");
}

#[test]
fn no_length_of_a_step_makes_the_roll_unstable() {
    for dt in [1.0 / 240.0, 0.1, 0.5] {
        let mut world = World::new(Settings::default().with_dt(dt).with_gravity(Vec3::zeros())).unwrap();
        let id = world.add(boid(Vec3::zeros(), Vec3::x())).unwrap();
        world.write_state_of(id, &[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]).unwrap();
        for _ in 0..400 {
            world.step().unwrap();
            assert!(world.state_of(id).unwrap()[3].abs() < 1.5);
        }
        assert!(world.state_of(id).unwrap()[3].abs() < 2e-3, "{dt}: {}", world.state_of(id).unwrap()[3]);
    }
}

#[test]
fn boids_collide_as_points_of_their_mass() {
    let mut world = world();
    let bouncy = Material { restitution: 1.0, friction: 0.5, ..Material::default() };
    let one = |x: f64, v: f64| boid(Vec3::new(x, 0.0, 0.0), Vec3::new(v, 0.0, 0.0)).with_material(bouncy);
    let (a, b) = (world.add(one(-1.0, 3.0)).unwrap(), world.add(one(1.0, -1.0)).unwrap());
    steps(&mut world, 120);
    // equal masses exchange their velocities
    let [a, b] = [a, b].map(|id| world.part_state(id, 0).unwrap().velocity.x);
    assert!((a + 1.0).abs() < 1e-9 && (b - 3.0).abs() < 1e-9, "{a}, {b}");
}

#[test]
fn constants_out_of_range_are_refused() {
    let sphere = || Shape::sphere(0.1).unwrap();
    for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Boid::new(sphere(), mass), Err(BehaviorError::Range { .. })));
    }
    let fine = || Boid::new(sphere(), 1.0).unwrap();
    assert!(fine().with_bank(-1.0, 1.0).is_err() && fine().with_bank(1.0, 0.0).is_err());
    assert!(world().add(fine().with_velocity(Vec3::new(f64::NAN, 0.0, 0.0))).is_err());
}
