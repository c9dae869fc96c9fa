//! Contact laws beside Coulomb's: rolling and torsional friction, friction that depends on speed and
//! direction, tangential restitution, adhesion; against closed forms and integrated equations.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

const RADIUS: f64 = 0.1;

fn surface(material: Material) -> RigidBody {
    RigidBody::fixed(Shape::half_space()).with_material(material)
}

/// A ball of 1 kg that touches the plane z = 0, which has the material.
fn ball_on(stepper: &str, dt: f64, material: Material, body: impl FnOnce(RigidBody) -> RigidBody) -> (World, ObjectId) {
    let mut world = world(stepper, dt);
    world.add_static(surface(material).with_name("floor")).unwrap();
    let ball = RigidBody::new(sphere(RADIUS)).with_mass(1.0);
    let ball = ball.with_material(Material { friction: material.friction, ..Material::default() });
    let id = world.add(body(ball.with_pose(Pose::translation(0.0, 0.0, RADIUS)))).unwrap();
    (world, id)
}

fn run(world: &mut World, seconds: f64) -> u32 {
    let dt = world.settings().dt;
    (0..(seconds / dt).round() as usize).map(|_| world.step().unwrap().unconverged).sum()
}

fn spin(world: &World, id: ObjectId) -> Vec3 {
    world.part_state(id, 0).unwrap().angular_velocity
}

/// A ball that rolls slows down by 5/7·(ρ/r)·g and stops after v²/2a, whatever its direction.
#[test]
fn a_rolling_ball_stops_where_rolling_friction_says() {
    let rho = 0.005;
    let deceleration = 5.0 / 7.0 * rho / RADIUS * G;
    for stepper in STEPPERS {
        for direction in [Vec3::x(), Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.28, 0.96, 0.0)] {
            for dt in [1.0 / 60.0, 1.0 / 240.0] {
                let (v, omega) = (direction, Vec3::z().cross(&direction) / RADIUS);
                let material = Material { rolling_friction: rho, ..Material::default() };
                let moving = |ball: RigidBody| ball.with_velocity(v).with_angular_velocity(omega);
                let (mut world, id) = ball_on(stepper, dt, material, moving);
                let unconverged = run(&mut world, 3.5);
                let way = position(&world, id) - Vec3::z() * RADIUS;
                let expected = 0.5 / deceleration * direction;
                assert!((way - expected).norm() < 1e-4 * expected.norm(), "{stepper} {dt}: {way} for {expected}");
                assert!(velocity(&world, id).norm() < 1e-9 && spin(&world, id).norm() < 1e-8, "{stepper}: stops");
                assert_eq!(unconverged, 0, "{stepper} {dt}");
            }
        }
    }
}

/// The frictions of a pair hold instead of the larger ones of both surfaces, also where they are smaller.
#[test]
fn a_pair_has_a_rolling_and_a_torsional_friction_of_its_own() {
    let (rho, patch) = (0.005, 0.002);
    for (pair, rolling, torsional) in [(true, rho, patch), (false, 4.0 * rho, 0.0)] {
        let material = Material { rolling_friction: 4.0 * rho, ..Material::default() };
        for (v, omega) in [(Vec3::x(), Vec3::y() / RADIUS), (Vec3::zeros(), 3.0 * Vec3::z())] {
            let moving = |ball: RigidBody| ball.with_velocity(v).with_angular_velocity(omega);
            let (mut world, id) = ball_on("time_stepping", 1.0 / 240.0, material, moving);
            let own = PairMaterial {
                rolling_friction: Some(rho),
                torsional_friction: Some(patch),
                ..PairMaterial::default()
            };
            let floor = world.find("floor").unwrap();
            if pair {
                world.set_pair_material(floor, id, own).unwrap();
            }
            assert_eq!(run(&mut world, 0.1), 0);
            let slowed = (v - velocity(&world, id)).norm() / 0.1;
            let braked = (3.0 - spin(&world, id).z) / 0.1 * 0.4 * RADIUS * RADIUS;
            let (expected, found) = match v == Vec3::zeros() {
                true => (torsional * G, braked),
                false => (5.0 / 7.0 * rolling / RADIUS * G, slowed),
            };
            assert!((found - expected).abs() < 1e-9, "{pair}, {v}: {found} for {expected}");
        }
    }
    let (mut world, id) = ball_on("time_stepping", 1.0 / 240.0, Material::default(), |ball| ball);
    let wrong = PairMaterial { rolling_friction: Some(-0.1), ..PairMaterial::default() };
    let error = world.set_pair_material(id, id, wrong).unwrap_err().to_string();
    assert!(error.contains("rolling friction of a pair") && error.contains("-0.1"), "{error}");
}

/// A ball on a slope rests if `tan θ < ρ/r`, else rolls with 5/7·(sin θ − ρ/r·cos θ)·g.
#[test]
fn a_ball_on_a_slope_rolls_if_and_only_if_rolling_friction_lets_it() {
    for stepper in STEPPERS {
        for (factor, rolls) in [(1.05, false), (0.8, true)] {
            let angle = 0.1f64;
            let rho = factor * RADIUS * angle.tan();
            let mut world = world(stepper, 1.0 / 240.0);
            let turn = Pose::rotation(Vec3::new(0.0, angle, 0.0));
            let material = Material { rolling_friction: rho, ..Material::default() };
            world.add_static(surface(material).with_pose(turn)).unwrap();
            let ball = RigidBody::new(sphere(RADIUS)).with_mass(1.0);
            let id = world.add(ball.with_pose(turn * Pose::translation(0.0, 0.0, RADIUS))).unwrap();
            assert_eq!(run(&mut world, 1.0), 0);
            let speed = velocity(&world, id).norm();
            let expected = if rolls { 5.0 / 7.0 * G * (angle.sin() - rho / RADIUS * angle.cos()) } else { 0.0 };
            assert!((speed - expected).abs() < 1e-4 * expected + 1e-9, "{stepper}: {speed} m/s for {expected}");
        }
    }
}

/// A ball that spins in place stops after I·ω/(σ·m·g) seconds.
#[test]
fn a_spinning_ball_stops_when_torsional_friction_says() {
    let sigma = 2.0 / 3.0 * 0.5 * 0.02; // a patch of 2 cm, friction 0.5, uniform pressure
    let inertia = 0.4 * RADIUS * RADIUS;
    for stepper in STEPPERS {
        for dt in [1.0 / 60.0, 1.0 / 240.0] {
            let material = Material { torsional_friction: sigma, ..Material::default() };
            let (mut world, id) = ball_on(stepper, dt, material, |b| b.with_angular_velocity(Vec3::z() * 20.0));
            let unconverged = run(&mut world, 0.5);
            let expected = 20.0 - sigma * G / inertia * 0.5;
            let rate = spin(&world, id).z;
            assert!((rate - expected).abs() < 1e-4 * expected, "{stepper} {dt}: {rate} for {expected}");
            assert_eq!(unconverged + run(&mut world, 1.0), 0);
            assert!(spin(&world, id).norm() < 1e-9 && velocity(&world, id).norm() < 1e-9, "{stepper}: stops");
        }
    }
}

/// Velocity and rate of a body that slides and spins on one point, 1 kg, by Runge–Kutta with fine steps.
fn slide_and_spin(mu: f64, sigma: f64, inertia: f64, (v, w): (f64, f64), seconds: f64) -> (f64, f64) {
    let rate = |(v, w): (f64, f64)| {
        let size = (mu * v).hypot(sigma * w).max(1e-300);
        (-G * mu * mu * v / size, -G * sigma * sigma * w / size / inertia)
    };
    let n = 20000;
    let h = seconds / f64::from(n);
    let on = |a: (f64, f64), k: (f64, f64), h: f64| (a.0 + h * k.0, a.1 + h * k.1);
    (0..n).fold((v, w), |at, _| {
        let k1 = rate(at);
        let k2 = rate(on(at, k1, 0.5 * h));
        let k3 = rate(on(at, k2, 0.5 * h));
        let k4 = rate(on(at, k3, h));
        on(at, ((k1.0 + 2.0 * k2.0 + 2.0 * k3.0 + k4.0) / 6.0, (k1.1 + 2.0 * k2.1 + 2.0 * k3.1 + k4.1) / 6.0), h)
    })
}

/// A body that slides and spins shares its friction between the two: it slides further than one that does
/// not spin, and the error of a step falls with it.
#[test]
fn friction_is_shared_between_sliding_and_spinning() {
    let (mu, sigma, inertia) = (0.3, 0.01, 0.004);
    for stepper in STEPPERS {
        let mut errors = Vec::new();
        for dt in [1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0] {
            let material = Material { friction: mu, torsional_friction: sigma, ..Material::default() };
            let locked = LockedAxes { rotation: [true, true, false], ..LockedAxes::default() };
            let moving = |ball: RigidBody| {
                let ball = ball.with_velocity(Vec3::new(0.6, 0.8, 0.0)).with_locked(locked);
                ball.with_angular_velocity(Vec3::z() * 30.0)
            };
            let (mut world, id) = ball_on(stepper, dt, material, moving);
            assert_eq!(run(&mut world, 0.3), 0, "{stepper} {dt}");
            let (v, w) = slide_and_spin(mu, sigma, inertia, (1.0, 30.0), 0.3);
            let error = (velocity(&world, id).norm() - v).abs().max((spin(&world, id).z - w).abs() / 30.0);
            errors.push(error);
            let alone = 1.0 - mu * G * 0.3;
            assert!(v > alone + 0.2, "spin takes friction from the slide: {v} m/s, {alone} without");
        }
        assert!(errors[2] < 1e-3 && errors[0] / errors[2] > 3.0, "{stepper}: {errors:?}");
    }
}

/// A superball (Garwin 1969, *Kinematics of an Ultraelastic Rough Ball*): with `e = e_t = 1` an impact reverses the
/// velocity of the contact point and keeps the energy.
#[test]
fn a_superball_bounces_as_garwin_says() {
    for stepper in STEPPERS {
        for reversal in [1.0, 0.6, 0.0] {
            let material =
                Material { restitution: 1.0, friction: 10.0, tangential_restitution: reversal, ..Material::default() };
            let moving = |ball: RigidBody| {
                let ball = ball.with_pose(Pose::translation(0.0, 0.0, 0.15));
                ball.with_velocity(Vec3::new(1.0, 0.0, -3.0)).with_angular_velocity(Vec3::y() * -40.0)
            };
            let (world, id) = ball_on(stepper, 1.0 / 240.0, material, moving);
            let mut world = no_gravity(world);
            let energy = |world: &World| {
                let (v, w) = (velocity(world, id), spin(world, id));
                0.5 * v.norm_squared() + 0.5 * 0.4 * RADIUS * RADIUS * w.norm_squared()
            };
            let before = energy(&world);
            run(&mut world, 0.05);
            // the velocity of the contact point is v − ω·r
            let slip = 1.0 + 40.0 * RADIUS;
            let impulse = -(1.0 + reversal) * slip / (1.0 + 1.0 / 0.4);
            let (v, w) = (1.0 + impulse, -40.0 - impulse / (0.4 * RADIUS));
            let (velocity, rate) = (velocity(&world, id), spin(&world, id));
            assert!((velocity - Vec3::new(v, 0.0, 3.0)).norm() < 1e-9, "{stepper} {reversal}: {velocity}");
            assert!((rate.y - w).abs() < 1e-7, "{stepper} {reversal}: {rate} for {w}");
            if reversal == 1.0 {
                assert!((energy(&world) / before - 1.0).abs() < 1e-10, "{stepper}");
            }
        }
    }
}

/// A surface with a grain: friction along x is half of that along y, and a slide turns towards x.
#[test]
fn friction_depends_on_the_direction_of_the_grain() {
    let mu = 0.4;
    for stepper in STEPPERS {
        for (turn, dt) in [(0.0, 1.0 / 240.0), (0.7, 1.0 / 240.0), (0.7, 1.0 / 960.0)] {
            let grain = Material { friction: mu, friction_scale: Vec3::new(0.5, 1.0, 1.0), ..Material::default() };
            let mut world = world(stepper, dt);
            let pose = Pose::rotation(Vec3::z() * turn);
            world.add_static(surface(grain).with_pose(pose)).unwrap();
            let body = RigidBody::new(cube(0.2)).with_mass(1.0);
            let body = body.with_material(Material { friction: mu, ..Material::default() });
            let body = body.with_locked(LockedAxes { rotation: [true; 3], ..LockedAxes::default() });
            let start = pose * Vec3::new(1.5, 1.5, 0.0);
            let id = world.add(body.with_pose(Pose::translation(0.0, 0.0, 0.1)).with_velocity(start)).unwrap();
            assert_eq!(run(&mut world, 0.3), 0);
            let rate = |v: Vec3| {
                let size = (0.5 * v.x).hypot(v.y);
                Vec3::new(-0.25 * v.x, -v.y, 0.0) * (mu * G / size)
            };
            let h = 0.3 / 10000.0;
            let expected = (0..10000).fold(Vec3::new(1.5, 1.5, 0.0), |v, _| {
                let k = rate(v + 0.5 * h * rate(v));
                v + h * k
            });
            let found = pose.inverse_transform_vector(&velocity(&world, id));
            let error = (found - expected).norm();
            assert!(error < 0.5 * dt, "{stepper} {turn} {dt}: {found} for {expected}");
        }
    }
}

/// Static friction holds a box on a slope that sliding friction would not; pushed, it slides with the
/// lower one.
#[test]
fn static_friction_holds_more_than_sliding_friction() {
    for stepper in STEPPERS {
        for (push, slides) in [(0.0, false), (0.5, true)] {
            let angle = 0.35f64;
            let material =
                Material { friction: 0.3, static_friction: 0.4, stribeck_speed: 0.01, ..Material::default() };
            let mut world = world(stepper, 1.0 / 240.0);
            let turn = Pose::rotation(Vec3::new(0.0, angle, 0.0));
            world.add_static(surface(material).with_pose(turn)).unwrap();
            let body = RigidBody::new(cube(0.2)).with_mass(1.0).with_material(material);
            let body = body.with_pose(turn * Pose::translation(0.0, 0.0, 0.1));
            let id = world.add(body.with_velocity(turn * Vec3::x() * push)).unwrap();
            assert_eq!(run(&mut world, 1.0), 0);
            let speed = velocity(&world, id).norm();
            let expected = if slides { push + G * (angle.sin() - 0.3 * angle.cos()) } else { 0.0 };
            assert!((speed - expected).abs() < 1e-6, "{stepper} {push}: {speed} m/s for {expected}");
        }
    }
}

/// A box hangs from a ceiling whose adhesion exceeds its weight, and falls from one that is weaker.
#[test]
fn adhesion_holds_up_to_its_force() {
    for stepper in STEPPERS {
        for (adhesion, holds) in [(1.05 * G, true), (0.95 * G, false)] {
            let mut world = world(stepper, 1.0 / 240.0);
            let ceiling = Pose::rotation(Vec3::x() * std::f64::consts::PI);
            let material = Material { adhesion, ..Material::default() };
            world.add_static(surface(material).with_pose(ceiling)).unwrap();
            let body = RigidBody::new(cube(0.2)).with_mass(1.0).with_pose(Pose::translation(0.0, 0.0, -0.1));
            let id = world.add(body).unwrap();
            run(&mut world, 1.0);
            let height = position(&world, id).z + 0.1;
            if holds {
                assert!(height.abs() < 1e-6 && velocity(&world, id).norm() < 1e-9, "{stepper}: {height} m");
                let force: f64 = world.contacts().iter().map(|c| if c.a == id { c.force.z } else { -c.force.z }).sum();
                assert!((force - G).abs() < 1e-6, "{stepper}: the ceiling holds it with {force} N");
            } else {
                assert!(height < -0.4, "{stepper}: falls to {height} m");
            }
        }
    }
}

/// Two balls that adhere and spin against each other in free space: their torsional and rolling friction
/// are moments of a pair, so momentum and angular momentum stay.
#[test]
fn friction_between_free_bodies_keeps_angular_momentum() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 240.0));
        let material = Material {
            adhesion: 5.0,
            torsional_friction: 0.01,
            rolling_friction: 0.002,
            friction: 0.3,
            ..Material::default()
        };
        let mut ball = |x: f64, omega: Vec3| {
            let body = RigidBody::new(sphere(RADIUS)).with_mass(1.0).with_material(material);
            world.add(body.with_pose(Pose::translation(x, 0.0, 0.0)).with_angular_velocity(omega)).unwrap()
        };
        let ids = [ball(-RADIUS, Vec3::new(9.0, 2.0, 1.0)), ball(RADIUS, Vec3::new(-4.0, -2.0, 0.5))];
        let sums = |world: &World| {
            let inertia = 0.4 * RADIUS * RADIUS;
            let each = ids.map(|id| {
                let (x, v, w) = (position(world, id), velocity(world, id), spin(world, id));
                (v, x.cross(&v) + inertia * w)
            });
            (each[0].0 + each[1].0, each[0].1 + each[1].1)
        };
        let before = sums(&world);
        run(&mut world, 1.5);
        let after = sums(&world);
        assert!((after.0 - before.0).norm() < 1e-12, "{stepper}: momentum {}", after.0);
        assert!((after.1 - before.1).norm() < 2e-5 * before.1.norm(), "{stepper}: {} for {}", after.1, before.1);
        let [a, b] = ids.map(|id| spin(&world, id).x);
        assert!((a - b).abs() < 1e-9, "{stepper}: spin together, {a} and {b} rad/s");
    }
}
