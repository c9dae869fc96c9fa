//! Surface constants of the shapes of links, and shapes of links that collide on one side only.

use tumble_core::articulated::{LinkMass, ModelBuilder};
use tumble_core::collide::{CompoundPart, Mat3, Pose, Shape, Vec3};
use tumble_core::prelude::*;
use tumble_core::{ArticulatedBody, Collider, DofSettings, Drive, Joint, ObjectId, stepper_by_name};

const G: f64 = 9.81;

fn of_friction(friction: f64) -> Material {
    Material { friction, ..Material::default() }
}

fn sphere(radius: f64) -> Shape {
    Shape::sphere(radius).unwrap()
}

fn mass(mass: f64) -> LinkMass {
    LinkMass { mass, center: Vec3::zeros(), inertia: Mat3::identity() }
}

/// A carriage of 1 kg that slides along x, and on it a load of 2 kg that slides along z and carries two balls, of which
/// the second one touches the floor.
fn carriage(collider: Collider) -> ArticulatedBody {
    let mut builder = ModelBuilder::new();
    let along = |axis| Joint::Prismatic { axis };
    let carriage = builder.link("carriage", None, along(Vec3::x()), Pose::identity(), mass(1.0));
    builder.link("load", Some(carriage), along(Vec3::z()), Pose::translation(0.0, 0.0, 0.1), mass(2.0));
    let mut body = ArticulatedBody::new("sled", builder.build().unwrap()).with_velocities(&[20.0, 0.0]).unwrap();
    body.add_collider("load", collider).unwrap();
    body
}

fn balls() -> Collider {
    let ball = |x: f64, z: f64| CompoundPart::new(sphere(0.1), Pose::translation(x, 0.0, z));
    let balls = Shape::compound(vec![ball(-0.5, 0.3), ball(0.5, 0.0)]).unwrap();
    // a rough material of the whole, which neither ball has
    Collider::new(balls, Pose::identity()).with_material(of_friction(0.9))
}

/// The friction of the pair is the geometric mean; that of the floor is 1.
fn on_floor(stepper: &str, body: ArticulatedBody) -> (World, ObjectId) {
    let mut world = World::new(Settings::default().with_dt(1.0 / 500.0)).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world.add_static(RigidBody::fixed(Shape::half_space()).with_material(of_friction(1.0))).unwrap();
    let id = world.add(body).unwrap();
    (world, id)
}

/// Runs for half a second and returns the loss of speed along x, m/s.
fn brake(world: &mut World, id: ObjectId) -> f64 {
    let speed = |world: &World| world.state_of(id).unwrap()[2];
    let before = speed(world);
    for _ in 0..250 {
        world.step().unwrap();
    }
    before - speed(world)
}

/// The load of 2 kg presses with its weight, and friction brakes all 3 kg.
fn wanted(friction: f64) -> f64 {
    0.5 * friction * 2.0 * G / 3.0
}

#[test]
fn a_part_of_a_link_brakes_with_its_own_friction() {
    for stepper in ["time_stepping", "backtracking"] {
        let own = |first: f64, second: f64| {
            balls().with_shape_material(0, of_friction(first)).with_shape_material(1, of_friction(second))
        };
        let (mut world, id) = on_floor(stepper, carriage(own(0.7, 0.04)));
        let loss = brake(&mut world, id);
        assert!((loss - wanted(0.2)).abs() < 1e-6, "{stepper}: {loss} instead of {}", wanted(0.2));
        // in an archive, then changed there, then that of the whole again
        let mut world = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
        let id = world.find("sled").unwrap();
        let part = world.get::<ArticulatedBody>(id).unwrap().colliders_of(Some(1)).next().unwrap();
        let change = |world: &mut World, material| {
            world.get_mut::<ArticulatedBody>(id).unwrap().set_shape_material(part, 1, material).unwrap();
        };
        let loss = brake(&mut world, id);
        assert!((loss - wanted(0.2)).abs() < 1e-6, "{stepper}, archived: {loss}");
        change(&mut world, Some(of_friction(0.25)));
        let loss = brake(&mut world, id);
        assert!((loss - wanted(0.5)).abs() < 1e-6, "{stepper}, changed: {loss}");
        change(&mut world, None);
        let loss = brake(&mut world, id);
        assert!((loss - wanted(0.9_f64.sqrt())).abs() < 1e-6, "{stepper}, of the whole: {loss}");
    }
}

#[test]
fn wrong_surfaces_of_shapes_are_errors() {
    let error = |collider: Collider| {
        let mut body = carriage(balls());
        body.add_collider("load", collider).unwrap_err().to_string()
    };
    let wrong = error(balls().with_shape_material(2, of_friction(0.1)));
    assert_eq!(
        wrong,
        "articulated body 'sled', link 'load': index of a shape with a material is 2; it must be below the number of parts of a compound"
    );
    let whole = Collider::new(sphere(0.1), Pose::identity());
    assert!(error(whole.clone().with_shape_material(0, of_friction(0.1))).contains("index of a shape"));
    assert!(error(balls().with_shape_material(0, of_friction(-0.1))).contains("friction"));
    assert!(error(whole.clone().with_one_way(Vec3::zeros())).contains("one-way direction is 0"));
    assert!(error(whole.with_one_way(Vec3::repeat(f64::NAN))).contains("one-way direction is NaN"));
    let mut body = carriage(balls());
    let part = body.colliders_of(Some(1)).next().unwrap();
    for (part, shape, friction) in [(part, 2, 0.1), (part + 1, 0, 0.1), (0, 0, 0.1), (part, 0, -1.0)] {
        let error = body.set_shape_material(part, shape, Some(of_friction(friction))).unwrap_err().to_string();
        assert!(error.starts_with("articulated body 'sled', link"), "{error}");
    }
}

/// A platform of 10 kg that a stiff drive holds at z = 1 m, or that is fixed to the base; 0.1 m thick.
fn platform(moves: bool, one_way: Option<Vec3>) -> ArticulatedBody {
    let mut builder = ModelBuilder::new();
    let joint = if moves { Joint::Prismatic { axis: Vec3::z() } } else { Joint::Fixed };
    builder.link("stand", None, Joint::Fixed, Pose::identity(), LinkMass::none());
    builder.link("platform", Some(0), joint, Pose::translation(0.0, 0.0, 1.0), mass(10.0));
    builder.link("other", Some(0), Joint::revolute(Vec3::z()), Pose::translation(9.0, 0.0, 0.0), mass(1.0));
    let mut body = ArticulatedBody::new("lift", builder.build().unwrap());
    if moves {
        // the spring carries the weight at rest
        let (stiffness, damping) = (1e5, 2e3);
        let drive =
            Drive::Position { stiffness, damping, target: 10.0 * G / stiffness, velocity: 0.0, limit: f64::INFINITY };
        body.set_dof(0, DofSettings { drive, ..DofSettings::default() }).unwrap();
    }
    // the shape is turned: its own y axis points up
    let turned = Pose::new(Vec3::zeros(), std::f64::consts::FRAC_PI_2 * Vec3::x());
    let mut plate = Collider::new(Shape::cuboid(Vec3::new(2.0, 0.1, 2.0)).unwrap(), turned);
    plate.one_way = one_way;
    body.add_collider("platform", plate).unwrap();
    body
}

/// A ball is thrown up from below the platform. Returns how high it gets and where it rests, m.
fn thrown(body: ArticulatedBody) -> [f64; 2] {
    let mut world = World::new(Settings::default().with_dt(1.0 / 500.0)).unwrap();
    world.add(body).unwrap();
    let ball = RigidBody::new(sphere(0.1)).with_mass(0.1).with_velocity(6.0 * Vec3::z());
    let ball = world.add(ball).unwrap();
    let (mut most, height) = (0.0_f64, |world: &World| world.body(ball).unwrap().position().z);
    for _ in 0..1000 {
        world.step().unwrap();
        most = most.max(height(&world));
    }
    [most, height(&world)]
}

#[test]
fn a_platform_of_a_link_is_entered_from_below() {
    let peak = 6.0 * 6.0 / (2.0 * G);
    for moves in [false, true] {
        let [most, rest] = thrown(platform(moves, Some(3.0 * Vec3::y())));
        assert!((most - peak).abs() < 1e-4, "{moves}: {most} m instead of {peak} m");
        // on the platform, which the weight of the ball presses down by 1e-5 m
        assert!((rest - 1.15).abs() < 1e-3, "{moves}: {rest} m");
        let [most, _] = thrown(platform(moves, None));
        assert!((most - 0.85).abs() < 1e-2, "{moves}: {most} m");
        // turned around, it lets nothing through from below
        let [most, _] = thrown(platform(moves, Some(-Vec3::y())));
        assert!((most - 0.85).abs() < 1e-2, "{moves}: {most} m");
    }
}

#[test]
fn a_one_sided_link_is_one_in_an_archive() {
    let mut world = World::default();
    world.add(platform(true, Some(Vec3::y()))).unwrap();
    let again = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    let body = again.get::<ArticulatedBody>(again.ids()[0]).unwrap();
    let collider = body.colliders().next().unwrap().1;
    assert_eq!(collider.one_way, Some(Vec3::y()));
}
