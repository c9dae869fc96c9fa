//! Contact that moves: what sweeps, rolls and slides keeps its energy, with the second order of the
//! step.

use crate::common::{G, ground, no_gravity, position, sphere, velocity};
use nalgebra::{UnitQuaternion, Vector3};
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

/// A world of a stepper by name; `dp` is `backtracking` with `dormand_prince`.
fn world(stepper: &str, dt: f64) -> World {
    if stepper != "dp" {
        return crate::common::world(stepper, dt);
    }
    let mut world = crate::common::world("backtracking", dt);
    let settings = world.settings().with_integrator(Integrator::DormandPrince);
    world.set_settings(settings).unwrap();
    world
}

fn smooth() -> Material {
    Material { restitution: 0.0, friction: 0.0, ..Material::default() }
}

/// Relative change of energy of a free bar that turns at 10 rad/s and sweeps a ball outwards, after
/// 0.5 s; energy is a constant of the motion.
fn sweeping_bar(stepper: &str, dt: f64) -> f64 {
    let mut world = no_gravity(world(stepper, dt));
    let bar = RigidBody::new(Shape::cuboid(Vec3::new(2.0, 0.1, 0.1)).unwrap()).with_mass(1.0).with_material(smooth());
    world.add(bar.with_name("bar").with_angular_velocity(Vec3::new(0.0, 0.0, 10.0))).unwrap();
    let ball = RigidBody::new(sphere(0.05)).with_mass(0.2).with_material(smooth()).with_name("ball");
    let velocity = Vec3::new(0.0, 3.0, 0.0);
    world.add(ball.with_pose(Pose::translation(0.3, 0.1, 0.0)).with_velocity(velocity)).unwrap();
    let before = world.energy().total();
    (0..(0.5 / dt).round() as usize).for_each(|_| {
        world.step().unwrap();
    });
    world.energy().total() / before - 1.0
}

/// Relative change of energy of a disc that rolls on its rim, its center nearly at rest.
fn rolling_disc(stepper: &str, dt: f64, seconds: f64) -> f64 {
    let (a, half, tilt) = (0.1f64, 1e-3, 0.5f64);
    let mut world = world(stepper, dt);
    ground(&mut world, 0.0, 10.0);
    let rough = Material { restitution: 0.0, friction: 10.0, ..Material::default() };
    let precession = (4.0 * G / (a * tilt.sin())).sqrt();
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tilt);
    let height = a * tilt.sin() + half * tilt.cos();
    // from the lowest point of the rim to the center
    let up = Vec3::new(0.0, tilt.cos(), tilt.sin());
    let body = RigidBody::new(Shape::cylinder(a, 2.0 * half).unwrap())
        .with_mass(0.5)
        .with_material(rough)
        .with_name("disc")
        .with_pose(Pose::from_parts(Vec3::new(0.0, 0.0, height).into(), rotation))
        .with_angular_velocity(precession * tilt.sin() * up);
    world.add(body).unwrap();
    let before = world.energy().total();
    (0..(seconds / dt).round() as usize).for_each(|_| {
        world.step().unwrap();
    });
    world.energy().total() / before - 1.0
}

/// Error of the speed of a ball that slides without friction from near the top of a fixed dome, after
/// 0.6 s, by the energy of its height.
fn dome(stepper: &str, dt: f64) -> f64 {
    let (radius, ball) = (1.0, 0.1);
    let mut world = world(stepper, dt);
    world.add_static(RigidBody::fixed(sphere(radius)).with_name("dome").with_material(smooth())).unwrap();
    let start = 0.3f64;
    let place = (radius + ball) * Vec3::new(start.sin(), 0.0, start.cos());
    let body = RigidBody::new(sphere(ball)).with_mass(1.0).with_material(smooth()).with_name("ball");
    let id = world.add(body.with_pose(Pose::translation(place.x, place.y, place.z))).unwrap();
    let before = world.energy().total();
    (0..(0.4 / dt).round() as usize).for_each(|_| {
        world.step().unwrap();
    });
    assert!((position(&world, id).norm() - 1.1).abs() < 0.01, "left the dome");
    (world.energy().total() - before) / (0.5 * velocity(&world, id).norm_squared())
}

/// A ball that is thrown along a fixed dome: it slides or rolls, slides, leaves it and flies. The contact has a radius `L` of
/// both balls, `θ` is the angle from the top, `N = m·(g·cos θ − L·θ'²)`.
///
/// ```text
/// rolls      7/5·L·θ'' = g·sin θ    until 2/7·m·g·sin θ = μ·N
/// slides     L·θ'' = g·sin θ − μ·N/m,  ω' = μ·N·r/I    until N = 0
/// ```
struct Thrown {
    friction: f64,
    /// s
    until: f64,
}

impl Thrown {
    const START: [f64; 2] = [0.2, 0.6];
    const RADII: [f64; 2] = [1.0, 0.2];

    fn reach() -> f64 {
        Thrown::RADII[0] + Thrown::RADII[1]
    }

    /// Rates of `θ`, `θ'`, `ω`, and the margin until the phase ends.
    fn rates(&self, rolls: bool, [angle, rate, _]: [f64; 3]) -> ([f64; 3], f64) {
        let (reach, r) = (Thrown::reach(), Thrown::RADII[1]);
        let normal = G * angle.cos() - reach * rate * rate;
        if rolls {
            let a = 5.0 / 7.0 * G * angle.sin();
            return ([rate, a / reach, a / r], self.friction * normal - 2.0 / 7.0 * G * angle.sin());
        }
        let friction = self.friction * normal;
        ([rate, (G * angle.sin() - friction) / reach, friction / (0.4 * r)], normal)
    }

    /// Returns the place (x, z), velocity and spin at the end, by steps of the fourth order with located ends of phases.
    fn exact(&self) -> [f64; 5] {
        let (reach, spin) = (Thrown::reach(), Thrown::reach() / Thrown::RADII[1] * Thrown::START[1]);
        let mut y = [Thrown::START[0], Thrown::START[1], if self.friction > 0.0 { spin } else { 0.0 }];
        let (mut time, mut rolls, mut flies) = (0.0, self.friction > 0.0, false);
        let step = |y: [f64; 3], rolls: bool, h: f64| {
            let add = |d: [f64; 3], h: f64| [0, 1, 2].map(|i| y[i] + h * d[i]);
            let a = self.rates(rolls, y).0;
            let b = self.rates(rolls, add(a, 0.5 * h)).0;
            let c = self.rates(rolls, add(b, 0.5 * h)).0;
            let d = self.rates(rolls, add(c, h)).0;
            [0, 1, 2].map(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
        };
        while time < self.until && !flies {
            let h = f64::min(1e-4, self.until - time);
            let mut next = (step(y, rolls, h), h);
            if self.rates(rolls, next.0).1 < 0.0 {
                let (mut low, mut high) = (0.0, h);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    let over = self.rates(rolls, step(y, rolls, middle)).1 < 0.0;
                    if over { high = middle } else { low = middle }
                }
                next = (step(y, rolls, high), high);
                (rolls, flies) = (false, !rolls);
            }
            (y, time) = (next.0, time + next.1);
        }
        let (left, [s, c]) = (self.until - time, [y[0].sin(), y[0].cos()]);
        let v = [reach * y[1] * c, -reach * y[1] * s];
        let fall = [0.0, -0.5 * G * left * left];
        [reach * s + v[0] * left + fall[0], reach * c + v[1] * left + fall[1], v[0], v[1] - G * left, y[2]]
    }

    /// Returns the largest error of place, velocity and spin of a stepper.
    fn error(&self, stepper: &str, dt: f64) -> f64 {
        let material = Material { friction: self.friction, ..smooth() };
        let mut world = world(stepper, dt);
        let [radius, r] = Thrown::RADII;
        world.add_static(RigidBody::fixed(sphere(radius)).with_name("dome").with_material(material)).unwrap();
        let ([angle, rate], reach) = (Thrown::START, Thrown::reach());
        let body = RigidBody::new(sphere(r))
            .with_mass(1.0)
            .with_material(material)
            .with_name("ball")
            .with_pose(Pose::translation(reach * angle.sin(), 0.0, reach * angle.cos()))
            .with_velocity(reach * rate * Vec3::new(angle.cos(), 0.0, -angle.sin()))
            .with_angular_velocity(Vec3::new(0.0, if self.friction > 0.0 { reach * rate / r } else { 0.0 }, 0.0));
        let id = world.add(body).unwrap();
        (0..(self.until / dt).round() as usize).for_each(|_| {
            world.step().unwrap();
        });
        let (x, v, w) = (position(&world, id), velocity(&world, id), world.part_state(id, 0).unwrap().angular_velocity);
        let now = [x.x, x.z, v.x, v.z, w.y];
        now.iter().zip(self.exact()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }
}

/// Relative error of the spin of a ball after an oblique impact on rough ground. An impact that sticks
/// leaves the contact point at rest and keeps the angular momentum about it: `ω = v/(r·(1 + 2/5))`.
fn spin_after_impact(stepper: &str, dt: f64, restitution: f64) -> f64 {
    let mut world = no_gravity(world(stepper, dt));
    ground(&mut world, restitution, 10.0);
    let rough = Material { restitution, friction: 10.0, ..Material::default() };
    let r = 0.1;
    let body = RigidBody::new(sphere(r)).with_mass(1.0).with_material(rough).with_name("ball");
    let id = world
        .add(body.with_pose(Pose::translation(0.0, 0.0, 0.2234)).with_velocity(Vec3::new(3.0, 0.0, -2.0)))
        .unwrap();
    (0..(0.2 / dt).round() as usize).for_each(|_| {
        world.step().unwrap();
    });
    let expected = 3.0 / (r * 1.4);
    world.part_state(id, 0).unwrap().angular_velocity.y / expected - 1.0
}

/// Relative change of the angular momentum of two rough balls that strike off center.
fn two_balls(stepper: &str, dt: f64, restitution: f64) -> f64 {
    let mut world = no_gravity(world(stepper, dt));
    let rough = Material { restitution, friction: 0.4, ..Material::default() };
    let ball = |name: &str, x: f64, y: f64, v: f64| {
        let body = RigidBody::new(sphere(0.1)).with_mass(1.0).with_material(rough).with_name(name);
        body.with_pose(Pose::translation(x, y, 0.0)).with_velocity(Vec3::new(v, 0.0, 0.0))
    };
    let ids = [ball("a", -0.5, 0.0, 4.0), ball("b", 0.5, 0.13, -1.0)].map(|body| world.add(body).unwrap());
    let momentum = |world: &World| -> Vec3 {
        let of = |id: &ObjectId| {
            let s = world.part_state(*id, 0).unwrap();
            s.position().cross(&s.velocity) + 0.4 * 0.01 * s.angular_velocity
        };
        ids.iter().map(of).sum()
    };
    let before = momentum(&world);
    (0..(0.4 / dt).round() as usize).for_each(|_| {
        world.step().unwrap();
    });
    (momentum(&world) - before).norm() / before.norm()
}

/// Errors at 60, 120, 240, 480 and 960 Hz.
fn errors(stepper: &str, of: fn(&str, f64) -> f64) -> [f64; 5] {
    let errors = [60.0, 120.0, 240.0, 480.0, 960.0].map(|hz| of(stepper, 1.0 / hz));
    println!("{stepper}: {errors:?}");
    errors
}

#[test]
fn a_bar_that_sweeps_a_ball_keeps_its_energy_to_second_order() {
    let of_time_stepping = errors("time_stepping", sweeping_bar);
    assert!(of_time_stepping[2].abs() < 1e-4);
    assert!(of_time_stepping.windows(2).all(|pair| pair[0].abs() > 3.6 * pair[1].abs()));
    let of_backtracking = errors("backtracking", sweeping_bar);
    assert!(of_backtracking[2].abs() < 1e-6);
    // from 60 to 960 Hz; between two of them the time at which the ball leaves the bar matters
    assert!(of_backtracking[0].abs() > 256.0 * of_backtracking[4].abs());
    // the local error is controlled
    let exact = errors("dp", sweeping_bar);
    assert!(exact.iter().all(|error| error.abs() < 1e-8) && exact[2].abs() < 1e-9);
}

#[test]
fn a_ball_that_slides_down_a_dome_keeps_its_energy_to_second_order() {
    let of_time_stepping = errors("time_stepping", dome);
    assert!(of_time_stepping[2].abs() < 5e-5);
    assert!(of_time_stepping.windows(2).all(|pair| pair[0].abs() > 3.2 * pair[1].abs()));
    // what is left is drift within the contact tolerance
    assert!(errors("backtracking", dome).iter().all(|error| error.abs() < 1e-5));
    let exact = errors("dp", dome);
    assert!(exact.iter().all(|error| error.abs() < 1e-5));
    assert!(exact.windows(2).all(|pair| pair[0].abs() > 12.0 * pair[1].abs()), "not of fourth order");
}

#[test]
fn a_disc_rolls_on_its_rim_without_loss() {
    for (stepper, bound) in [("time_stepping", 5e-3), ("backtracking", 1e-4), ("dp", 1e-4)] {
        let loss = rolling_disc(stepper, 1.0 / 240.0, 5.0);
        println!("{stepper}: {loss:e}");
        assert!(loss.abs() < bound, "{stepper}: {loss}");
    }
}

#[test]
fn the_spin_after_an_impact_is_exact_at_any_step() {
    for stepper in STEPPERS {
        for hz in [60.0, 100.0, 240.0, 300.0, 400.0, 1000.0, 4000.0] {
            for restitution in [0.0, 0.5] {
                let error = spin_after_impact(stepper, 1.0 / hz, restitution);
                println!("{stepper} at {hz} Hz, {restitution}: {error}");
                assert!(error.abs() < 1e-12, "{stepper} at {hz} Hz, restitution {restitution}: {error}");
            }
        }
    }
}

#[test]
fn a_collision_off_center_keeps_angular_momentum() {
    for stepper in STEPPERS {
        for hz in [60.0, 240.0, 400.0, 1000.0] {
            for restitution in [0.0, 0.7] {
                let error = two_balls(stepper, 1.0 / hz, restitution);
                println!("{stepper} at {hz} Hz, {restitution}: {error}");
                assert!(error < 1e-12, "{stepper} at {hz} Hz, restitution {restitution}: {error}");
            }
        }
    }
}

#[test]
fn a_ball_that_is_thrown_along_a_dome_slides_rolls_and_leaves_it() {
    for (friction, until) in [(0.0, 0.4), (0.0, 1.0), (0.3, 0.4), (0.3, 0.55), (0.3, 1.0)] {
        for (stepper, bounds) in [
            ("time_stepping", [1e-2, 2e-4, 1.2e-5]),
            ("backtracking", [4e-3, 2.5e-4, 2.5e-5]),
            ("dp", [1e-6, 1e-7, 1e-8]),
        ] {
            let thrown = Thrown { friction, until };
            for (hz, bound) in [60.0, 240.0, 960.0].into_iter().zip(bounds) {
                let error = thrown.error(stepper, 1.0 / hz);
                println!("{stepper} at {hz} Hz, friction {friction}, {until} s: {error:.2e}");
                assert!(error < bound, "{stepper} at {hz} Hz, friction {friction}, {until} s: {error}");
            }
        }
    }
}

/// A ball whose center of mass is beside its middle rolls on a plane: energy is a constant of the motion.
#[test]
fn a_ball_with_its_mass_beside_its_middle_keeps_its_energy() {
    for (stepper, most) in [("time_stepping", [1e-3, 6e-5, 4e-6]), ("backtracking", [1e-4; 3]), ("dp", [1e-8; 3])] {
        for (rate, most) in [60.0, 240.0, 960.0].into_iter().zip(most) {
            let mut world = world(stepper, 1.0 / rate);
            if stepper == "dp" {
                let settings = world.settings().with_integrator_tolerance(1e-11);
                world.set_settings(settings).unwrap();
            }
            let rough = Material { restitution: 0.0, friction: 5.0, ..Material::default() };
            world.add_static(RigidBody::fixed(Shape::half_space()).with_material(rough)).unwrap();
            let (center, spin) = (Vec3::new(0.05, 0.03, -0.06), Vec3::new(0.0, 5.0, 1.0));
            let ball = RigidBody::new(sphere(0.2)).with_mass(1.0).with_material(rough).with_center_of_mass(center);
            let ball = ball.with_pose(Pose::translation(0.0, 0.0, 0.2)).with_angular_velocity(spin);
            let ball = ball.with_velocity(spin.cross(&(center + 0.2 * Vec3::z())));
            world.add(ball).unwrap();
            let before = world.energy().total();
            (0..(0.3 * rate).round() as usize).for_each(|_| {
                world.step().unwrap();
            });
            let change = world.energy().total() / before - 1.0;
            assert!(change.abs() < most, "{stepper} at {rate} Hz: {change} of the energy");
        }
    }
}
