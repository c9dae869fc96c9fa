//! Wind, attractor, explosion and panels against closed forms.

use crate::{Numbers, steps};
use std::f64::consts::PI;
use tumble_behaviors::{Attractor, BehaviorError, DragLaw, Explosion, Panel, Panels, Targets, Wind, silhouette};
use tumble_core::Sleep;
use tumble_core::prelude::*;

const G: f64 = 9.81;

fn world(dt: f64, gravity: f64) -> World {
    World::new(Settings::default().with_dt(dt).with_gravity(Vec3::new(0.0, 0.0, -gravity))).unwrap()
}

fn ball(radius: f64, mass: f64) -> RigidBody {
    RigidBody::new(Shape::sphere(radius).unwrap()).with_mass(mass)
}

#[test]
fn terminal_velocities_of_both_laws_at_any_step() {
    let linear = DragLaw::Linear { coefficient: 0.4 };
    let quadratic = DragLaw::Quadratic { density: 1.2, coefficient: 0.47 };
    // c·v = m·g; ½·ρ·C·πr²·v² = m·g
    let mass = 0.2;
    let slow = mass * G / 0.4;
    let fast = (2.0 * mass * G / (1.2 * 0.47 * PI * 0.01)).sqrt();
    for dt in [1.0 / 30.0, 1.0 / 60.0, 1.0 / 240.0] {
        for (law, terminal) in [(linear, slow), (quadratic, fast)] {
            let wind = Vec3::new(3.0, -1.0, 0.0);
            let mut world = world(dt, G);
            let id = world.add(ball(0.1, mass)).unwrap();
            world.add(Wind::new("wind", wind, law).unwrap()).unwrap();
            steps(&mut world, (60.0 / dt) as usize);
            let error = world.body(id).unwrap().velocity() - wind + terminal * Vec3::z();
            assert!(error.norm() < 1e-9 * terminal, "{law:?} at {dt}: {error}");
        }
    }
}

#[test]
fn a_fall_with_quadratic_drag_converges_to_its_closed_form_in_first_order() {
    let law = DragLaw::Quadratic { density: 1.2, coefficient: 0.5 };
    let k = 0.5 * 1.2 * 0.5 * PI * 0.04 / 0.1;
    let terminal = (G / k).sqrt();
    // v = v_t·tanh(g·t/v_t) after 0.5 s
    let exact = terminal * (G * 0.5 / terminal).tanh();
    let errors = [60, 120, 240, 480].map(|rate| {
        let mut world = world(1.0 / f64::from(rate), G);
        let id = world.add(ball(0.2, 0.1)).unwrap();
        world.add(Wind::new("air", Vec3::zeros(), law).unwrap()).unwrap();
        steps(&mut world, rate as usize / 2);
        (world.body(id).unwrap().velocity().z + exact).abs()
    });
    println!("errors {errors:?} m/s");
    assert!(errors[0] < 0.02 * exact);
    assert!(errors.windows(2).all(|e| (e[0] / e[1] - 2.0).abs() < 0.1), "{errors:?}");
}

#[test]
fn silhouettes_against_shadows_of_many_points() {
    let mut numbers = Numbers(11);
    let mesh = TriMesh::cuboid(Vec3::new(0.4, 1.0, 0.6));
    let shapes = [
        Shape::sphere(0.7).unwrap(),
        Shape::cuboid(Vec3::new(0.4, 1.0, 0.6)).unwrap(),
        Shape::capsule(0.3, 0.8).unwrap(),
        Shape::cylinder(0.3, 0.8).unwrap(),
        Shape::mesh(mesh, &TreeSettings::octree()).unwrap(),
    ];
    for shape in &shapes {
        let d = numbers.vector(1.0).normalize();
        let (across, far) = (d.cross(&Vec3::ith(d.iamin(), 1.0)).normalize(), 5.0);
        let (up, n) = (d.cross(&across), 400);
        let at = |k: usize| ((k as f64 + 0.5) / n as f64 - 0.5) * 3.0;
        let hits = (0..n * n).filter(|k| {
            let origin = at(k % n) * across + at(k / n) * up - far * d;
            shape.cast_ray(&Pose::identity(), &origin, &d, 2.0 * far).is_some()
        });
        let counted = hits.count() as f64 * (3.0 / n as f64).powi(2);
        let area = silhouette(shape, &(7.0 * d));
        assert!((area - counted).abs() < 0.01 * counted, "{shape:?}: {area} is not {counted}");
    }
}

/// Returns the position after one orbit of an eccentric ellipse with `count` steps per orbit.
fn orbit(count: usize) -> (f64, f64) {
    let (strength, axis, eccentricity) = (4.0, 1.0f64, 0.3);
    let period = 2.0 * PI * (axis * axis * axis / strength).sqrt();
    let mut world = world(period / count as f64, 0.0);
    let start = Vec3::new(axis * (1.0 - eccentricity), 0.0, 0.0);
    let speed = (strength / axis * (1.0 + eccentricity) / (1.0 - eccentricity)).sqrt();
    let planet = ball(0.01, 3.0).with_pose(Pose::translation(start.x, 0.0, 0.0));
    let id = world.add(planet.with_velocity(speed * Vec3::y())).unwrap();
    world.add(Attractor::new("sun", Vec3::zeros(), strength, 0.0).unwrap()).unwrap();
    let energy = world.energy();
    steps(&mut world, count);
    // after one period the planet is where it was (Kepler)
    let drift = (world.energy().total() - energy.total()) / energy.total();
    ((world.body(id).unwrap().position() - start).norm(), drift.abs())
}

#[test]
fn an_orbit_closes_as_kepler_says_in_second_order() {
    let errors = [200, 400, 800].map(orbit);
    println!("gap after an orbit, m, and drift of energy: {errors:?}");
    assert!(errors[2].0 < 1e-3 && errors[2].1 < 1e-6);
    assert!(errors.windows(2).all(|e| (e[0].0 / e[1].0 - 4.0).abs() < 0.1), "{errors:?}");
}

#[test]
fn an_attractor_pulls_chosen_masses_only() {
    let mut world = world(0.01, 0.0);
    let at = |x: f64| ball(0.1, 2.0).with_pose(Pose::translation(x, 0.0, 0.0));
    let (one, other) = (world.add(at(2.0)).unwrap(), world.add(at(4.0)).unwrap());
    let field = Attractor::new("sun", Vec3::zeros(), 8.0, 1.5).unwrap();
    world.add(field.with_targets(Targets::Only(vec![one]))).unwrap();
    steps(&mut world, 1);
    // (2² + 1.5²)^{3/2} = 15.625
    let v = world.body(one).unwrap().velocity();
    assert!((v.x + 0.01 * 8.0 * 2.0 / 15.625).abs() < 1e-12 && v.yz().norm() == 0.0, "{v}");
    assert_eq!(world.body(other).unwrap().velocity(), Vec3::zeros());
}

fn ring(world: &mut World) -> Vec<ObjectId> {
    let arms = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| [2.0 * axis, -2.0 * axis]).concat();
    let add = |arm: &Vec3| world.add(ball(0.3, 0.5).with_pose(Pose::translation(arm.x, arm.y, arm.z + 5.0))).unwrap();
    arms.iter().map(add).collect()
}

/// Impulse on each ball of the ring: I·πr²/(4π·R²).
const SHARE: f64 = 12.0 * 0.09 / 16.0;

#[test]
fn the_momentum_of_an_explosion() {
    let x: f64 = 0.01 / 0.2; // h/(2·τ)
    for h in [0.02, 0.01, 0.005] {
        let x = 0.5 * h / 0.1;
        let mut world = world(h, 0.0);
        let balls = ring(&mut world);
        world.add(Explosion::new("blast", Vec3::new(0.0, 0.0, 5.0), 12.0, 0.0, 0.1).unwrap()).unwrap();
        steps(&mut world, 1);
        let first = world.body(balls[0]).unwrap().velocity().x;
        assert!((first - SHARE / 0.5 / 0.1 * h * (-x).exp()).abs() < 1e-12, "the force of the middle of the step");
        let sum: Vec3 = balls.iter().map(|id| 0.5 * world.body(*id).unwrap().velocity()).sum();
        assert!(sum.norm() < 1e-14, "{sum}");
    }
    // heavy enough to stay: the impulses are J·x/sinh x
    let mut world = world(0.01, 0.0);
    let heavy = world.add(ball(0.3, 5e6).with_pose(Pose::translation(0.0, 2.0, 5.0))).unwrap();
    world.add(Explosion::new("blast", Vec3::new(0.0, 0.0, 5.0), 12.0, 0.5, 0.1).unwrap()).unwrap();
    steps(&mut world, 50);
    assert_eq!(world.body(heavy).unwrap().velocity(), Vec3::zeros(), "before its time");
    steps(&mut world, 400);
    let got = 5e6 * world.body(heavy).unwrap().velocity().y;
    assert!((got - SHARE * x / x.sinh()).abs() < 1e-8, "{got}");
}

#[test]
fn an_explosion_strikes_at_once() {
    let mut world = world(0.01, 0.0);
    let balls = ring(&mut world);
    Explosion::new("blast", Vec3::new(0.0, 0.0, 5.0), 12.0, 0.0, 0.1).unwrap().strike(&mut world).unwrap();
    for id in balls {
        let body = world.body(id).unwrap();
        let out = (body.position() - 5.0 * Vec3::z()).normalize();
        assert!((0.5 * body.velocity() - SHARE * out).norm() < 1e-14);
        assert_eq!(body.angular_velocity(), Vec3::zeros());
    }
    // right in the middle a ball covers the whole sphere, and has no direction
    let id = world.add(ball(0.3, 1.0)).unwrap();
    Explosion::new("blast", Vec3::zeros(), 12.0, 0.0, 0.1).unwrap().strike(&mut world).unwrap();
    assert_eq!(world.body(id).unwrap().velocity(), Vec3::zeros());
}

#[test]
fn lift_and_drag_of_a_panel_by_hand() {
    let mut world = world(0.01, 0.0);
    let plate = RigidBody::new(Shape::cuboid(Vec3::new(1.0, 2.0, 0.01)).unwrap()).with_mass(1.0);
    let id = world.add(plate.with_velocity(Vec3::new(8.0, 0.0, -6.0))).unwrap();
    let panel = Panel {
        id,
        part: 0,
        point: Vec3::new(0.25, 0.0, 0.0),
        normal: Vec3::z(),
        area: 2.0,
        lift_slope: 5.0,
        drag: 0.02,
    };
    world.add(Panels::new("wing", 1.2, Vec3::zeros(), [panel]).unwrap()).unwrap();
    steps(&mut world, 1);
    // u = (−8, 0, 6), |u| = 10: ½·1.2·2·10·(5·6·z + 0.02·u) = 12·(−0.16, 0, 30.12)
    let body = world.body(id).unwrap();
    let gain = (body.velocity() - Vec3::new(8.0, 0.0, -6.0)) / 0.01;
    assert!((gain - 12.0 * Vec3::new(-0.16, 0.0, 30.12)).norm() < 1e-9, "{gain}");
    // torque about y: −¼·F_z; I_y = (1 + 1e-4)/12
    let spin = body.angular_velocity().y / 0.01;
    assert!((spin + 0.25 * 12.0 * 30.12 * 12.0 / 1.0001).abs() < 1e-6, "{spin}");
}

#[test]
fn a_plate_glides_at_the_ratio_of_its_lift_and_drag() {
    // held level at a slope α: steady where the force is vertical and carries the weight
    let (slope, area, a, c0, mass) = (0.1f64, 0.5, 6.0, 0.03, 0.4);
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let mut world = world(dt, G);
        let plate = RigidBody::new(Shape::cuboid(Vec3::new(0.5, 1.0, 0.01)).unwrap()).with_mass(mass);
        let turn = Quat::from_axis_angle(&Vec3::y_axis(), slope); // nose down
        let plate = tumble_behaviors::non_spinning(plate).with_pose(Pose::from_parts(Vec3::zeros().into(), turn));
        let id = world.add(plate).unwrap();
        let panel = Panel { id, part: 0, point: Vec3::zeros(), normal: Vec3::z(), area, lift_slope: a, drag: c0 };
        world.add(Panels::new("wing", 1.2, Vec3::zeros(), [panel]).unwrap()).unwrap();
        steps(&mut world, (200.0 / dt) as usize);
        // along the plate: k·c0·|u|·u_t = m·g·sin; across: k·(a + c0)·|u|·u_n = m·g·cos, k = ½·ρ·A
        let k = 0.5 * 1.2 * area;
        let (t, n) = (mass * G * slope.sin() / (k * c0), mass * G * slope.cos() / (k * (a + c0)));
        let speed = t.hypot(n).sqrt();
        let (t, n) = (t / speed, n / speed);
        let expected = turn * Vec3::new(t, 0.0, -n);
        let v = world.body(id).unwrap().velocity();
        assert!((v - expected).norm() < 1e-6, "{v} is not {expected}");
    }
}

#[test]
fn constants_of_fields_are_refused_by_name() {
    let nan = Vec3::new(0.0, f64::NAN, 0.0);
    let named = |result: Result<(), BehaviorError>, name: &str| {
        let error = result.unwrap_err();
        assert!(error.to_string().starts_with(name), "{error}");
    };
    let law = DragLaw::Linear { coefficient: -1.0 };
    named(Wind::new("", Vec3::zeros(), law).map(drop), "the drag coefficient");
    named(Wind::new("", nan, DragLaw::Linear { coefficient: 1.0 }).map(drop), "the velocity");
    named(Attractor::new("", Vec3::zeros(), 1.0, -1.0).map(drop), "the softening");
    named(Explosion::new("", Vec3::zeros(), 1.0, 0.0, 0.0).map(drop), "the decay");
    named(Explosion::new("", nan, 1.0, 0.0, 1.0).map(drop), "the center");
}

#[test]
fn bodies_sleep_after_an_explosion_has_decayed() {
    let mut world = World::new(Settings::default().with_dt(1.0 / 60.0).with_sleep(Some(Sleep::default()))).unwrap();
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let block = RigidBody::new(Shape::cuboid(Vec3::new(0.4, 0.4, 0.2)).unwrap()).with_mass(5.0);
    let block = world.add(block.with_pose(Pose::translation(1.0, 0.0, 0.1))).unwrap();
    let bang = Explosion::new("bang", Vec3::new(0.0, 0.0, 0.2), 0.1, 0.0, 0.02).unwrap();
    world.add(bang).unwrap();
    steps(&mut world, 180); // 150 times the time constant
    assert!(world.asleep(block));
}
