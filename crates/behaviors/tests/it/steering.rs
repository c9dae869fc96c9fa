//! The forces of the appendix by hand.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use tumble_behaviors::{BehaviorError, Flock, Flyer, Search, Steering};
use tumble_core::prelude::*;

/// A flock without forces, that sees 10 m in front; each test turns on its own.
fn none() -> Steering {
    Steering {
        avoidance: 0.0,
        matching: 0.0,
        clustering: 0.0,
        max_force: 1e9,
        visibility_distance: 10.0,
        inner_visibility_distance: 4.0,
        visibility_angle: 3.0 * FRAC_PI_4,
        inner_visibility_angle: FRAC_PI_4,
        speed_rate: 0.0,
        boundary_stiffness: 0.0,
        ..Steering::default()
    }
}

fn flyer(x: f64, y: f64) -> Flyer {
    Flyer { position: Vec3::new(x, y, 0.0), velocity: Vec3::zeros(), forward: Vec3::x(), mass: 2.0 }
}

fn force_on_first(steering: &Steering, flyers: &[Flyer]) -> Vec3 {
    let [grid, all] = [Search::Grid, Search::BruteForce].map(|search| steering.forces(search, flyers));
    assert_eq!(grid, all);
    grid[0]
}

fn assert_near(got: Vec3, by_hand: Vec3) {
    assert!((got - by_hand).norm() < 1e-12 * (1.0 + by_hand.norm()), "{got} is not {by_hand}");
}

#[test]
fn two_boids_avoid_each_other_by_hand() {
    let steering = Steering { avoidance: 6.0, ..none() };
    // 3-4-5: d = 5, u = (0.8, 0.6); w = (10 − 5)/(10 − 4) = 5/6 and the angle 36.87° is seen fully
    // Fa = −m·w·Ka/d·u = −2·(5/6)·6/5·u = −2·u
    assert_near(force_on_first(&steering, &[flyer(0.0, 0.0), flyer(4.0, 3.0)]), Vec3::new(-1.6, -1.2, 0.0));
    // the other sees the first behind it, at 143.13°, beyond 135°
    assert_eq!(steering.forces(Search::Grid, &[flyer(0.0, 0.0), flyer(4.0, 3.0)])[1], Vec3::zeros());
}

#[test]
fn matching_and_clustering_by_hand() {
    let mut other = flyer(4.0, 3.0);
    other.velocity = Vec3::new(0.0, -3.0, 1.0);
    let pair = [flyer(0.0, 0.0), other];
    // m·Kv·w·Δv = 2·0.3·(5/6)·(0, −3, 1)
    assert_near(force_on_first(&Steering { matching: 0.3, ..none() }, &pair), Vec3::new(0.0, -1.5, 0.5));
    // m·Kc·w·d·u = 2·0.6·(5/6)·(4, 3, 0)
    assert_near(force_on_first(&Steering { clustering: 0.6, ..none() }, &pair), Vec3::new(4.0, 3.0, 0.0));
}

#[test]
fn the_cone_of_visibility_by_hand() {
    let steering = Steering { clustering: 1.0, ..none() };
    let seen_at = |angle: f64, distance: f64| {
        let (sin, cos) = angle.sin_cos();
        force_on_first(&steering, &[flyer(0.0, 0.0), flyer(distance * cos, distance * sin)]).norm() / (2.0 * distance)
    };
    // the weight by angle is 1 up to 45°, a half at 90°, 0 from 135° on
    for (angle, weight) in [(0.0, 1.0), (0.7, 1.0), (FRAC_PI_2, 0.5), (2.0, (0.75 * PI - 2.0) / FRAC_PI_2)] {
        assert!((seen_at(angle, 2.0) - weight).abs() < 1e-12, "{angle}");
        assert!((seen_at(-angle, 2.0) - weight).abs() < 1e-12, "{angle} to the right");
        assert!((seen_at(angle, 8.5) - 0.25 * weight).abs() < 1e-12, "{angle}, (10 − 8.5)/(10 − 4) = ¼");
    }
    assert_eq!((seen_at(2.36, 2.0), seen_at(PI, 2.0), seen_at(0.0, 10.0), seen_at(0.0, 11.0)), (0.0, 0.0, 0.0, 0.0));
}

#[test]
fn a_sharp_edge_of_visibility_has_no_quotient_of_zeros() {
    let steering = Steering {
        clustering: 1.0,
        inner_visibility_distance: 10.0,
        inner_visibility_angle: 3.0 * FRAC_PI_4,
        ..none()
    };
    assert_near(force_on_first(&steering, &[flyer(0.0, 0.0), flyer(9.0, 0.0)]), Vec3::new(18.0, 0.0, 0.0));
    assert_eq!(force_on_first(&steering, &[flyer(0.0, 0.0), flyer(10.0, 0.0)]), Vec3::zeros());
}

/// Boid 0 sees one neighbor at 2 m: Fa = (−a, 0, 0), Fv = (0, b, 0), Fc = (c, 0, 0).
fn ranked(a: f64, b: f64, c: f64, max_force: f64) -> Vec3 {
    let mut other = flyer(2.0, 0.0);
    other.velocity = Vec3::new(0.0, 1.0, 0.0);
    // m = 2, w = 1, d = 2
    let steering = Steering { avoidance: a, matching: b / 2.0, clustering: c / 4.0, max_force, ..none() };
    force_on_first(&steering, &[flyer(0.0, 0.0), other])
}

#[test]
fn priority_under_the_limit_in_closed_form() {
    assert_near(ranked(3.0, 4.0, 2.0, 10.0), Vec3::new(-1.0, 4.0, 0.0)); // |Fa + Fv| = 5, all fit
    assert_near(ranked(3.0, 4.0, 2.0, 2.0), Vec3::new(-2.0, 0.0, 0.0)); // avoidance alone
    assert_near(ranked(3.0, 4.0, 2.0, 4.5), 4.5 * Vec3::new(-0.6, 0.8, 0.0)); // no clustering
    assert_near(ranked(3.0, 4.0, 2.0, 5.0), Vec3::new(-3.0, 4.0, 0.0)); // exactly at the limit
    assert_near(ranked(3.0, 4.0, 15.0, 6.5), 6.5 / 160.0_f64.sqrt() * Vec3::new(12.0, 4.0, 0.0)); // all three, cut
    assert_eq!(ranked(0.0, 0.0, 0.0, 0.0), Vec3::zeros()); // no 0/0
    assert_eq!(ranked(3.0, 4.0, 2.0, 0.0), Vec3::zeros());
}

#[test]
fn boids_at_one_point_part_along_x() {
    let steering = Steering { avoidance: 1.0, clustering: 1.0, matching: 1.0, max_force: 7.0, ..none() };
    for same in [flyer(0.0, 0.0), flyer(1e-320, -1e-320), flyer(-1e9, 1e12)] {
        let forces = steering.forces(Search::Grid, &[same, same]);
        assert_eq!(forces, [Vec3::new(-7.0, 0.0, 0.0), Vec3::new(7.0, 0.0, 0.0)]);
    }
    // nearly at one point: finite, along the line, at the limit
    let [a, b] = [flyer(0.0, 0.0), flyer(1e-300, 0.0)];
    assert!(steering.forces(Search::Grid, &[a, b]).iter().all(|force| force.norm() <= 7.0));
}

#[test]
fn the_boundary_is_a_spring_outside_its_radius() {
    let steering = Steering { boundary_stiffness: 3.0, boundary_radius: 5.0, boundary_center: Vec3::x(), ..none() };
    assert_eq!(force_on_first(&steering, &[flyer(6.0, 0.0)]), Vec3::zeros());
    assert_near(force_on_first(&steering, &[flyer(1.0, -7.0)]), Vec3::new(0.0, 6.0, 0.0)); // k·(7 − 5)
}

#[test]
fn constants_out_of_range_are_refused_by_name() {
    let bad = [
        Steering { max_force: -1.0, ..none() },
        Steering { visibility_distance: 0.0, ..none() },
        Steering { visibility_angle: f64::NAN, ..none() },
        Steering { boundary_center: Vec3::new(0.0, f64::INFINITY, 0.0), ..none() },
    ];
    for (steering, name) in bad.iter().zip(["max_force", "visibility_distance", "visibility_angle", "boundary_center"])
    {
        let error = Flock::new("flock", *steering).unwrap_err();
        assert!(matches!(error, BehaviorError::Range { what, .. } if what == name), "{error}");
        assert!(error.to_string().starts_with(name));
    }
}
