//! Restitution and friction of a pair: the rules, and pairs with constants of their own.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

const HEIGHT: f64 = 0.9;

/// Ground and a ball whose underside is 0.9 m above it.
fn dropped(settings: Settings, ball: f64, floor: f64) -> (World, ObjectId, ObjectId) {
    let mut world = World::new(settings.with_dt(1.0 / 240.0)).unwrap();
    let floor = ground(&mut world, floor, 0.5);
    let body = RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0).with_material(Material {
        restitution: ball,
        friction: 0.5,
        ..Material::default()
    });
    let ball = world.add(body.with_pose(Pose::translation(0.0, 0.0, HEIGHT + 0.1))).unwrap();
    (world, ball, floor)
}

/// Returns the height of the first bounce, from the energy of the ball shortly after it.
fn rebound(world: &mut World, ball: ObjectId) -> f64 {
    let impact = (2.0 * HEIGHT / G).sqrt();
    while world.time() < impact + 0.01 {
        world.step().unwrap();
    }
    let (v, z) = (velocity(world, ball).z, position(world, ball).z - 0.1);
    z + v * v / (2.0 * G)
}

/// A ball that bounces on a floor with default constants rises to e²h.
#[test]
fn a_ball_bounces_on_a_plain_floor() {
    let (mut world, ball, _) = dropped(Settings::default(), 0.5, Material::default().restitution);
    let height = rebound(&mut world, ball);
    assert!((height - 0.25 * HEIGHT).abs() < 1e-3, "{height}");
}

#[test]
fn each_rule_gives_its_bounce() {
    let (a, b) = (0.8, 0.2);
    let expected = [0.2, 0.8, 0.5, 0.16, 0.4];
    for ((name, rule), e) in Combine::NAMES.iter().zip(expected) {
        let settings = Settings::default().with_combine_restitution(*rule);
        let (mut world, ball, floor) = dropped(settings, a, b);
        assert!((world.pair_material((floor, 0), (ball, 0)).unwrap().restitution - e).abs() < 1e-15);
        let height = rebound(&mut world, ball);
        assert!((height - e * e * HEIGHT).abs() < 1e-3, "{name}: {height}");
        assert_eq!(rule.name(), *name);
    }
}

#[test]
fn a_pair_has_a_bounce_of_its_own_whichever_side_is_named_first() {
    let own = |e| PairMaterial { restitution: Some(e), ..PairMaterial::default() };
    for swapped in [false, true] {
        let (mut world, ball, floor) = dropped(Settings::default(), 0.0, 0.0);
        let (a, b) = if swapped { (floor, ball) } else { (ball, floor) };
        world.set_pair_material(a, b, own(0.6)).unwrap();
        let mut fork = world.fork();
        let found = world.pair_material((ball, 0), (floor, 0)).unwrap();
        assert_eq!((found.restitution, found.friction), (0.6, 0.5), "friction goes by the rule");
        let height = rebound(&mut world, ball);
        assert!((height - 0.36 * HEIGHT).abs() < 1e-3, "{height}");
        rebound(&mut fork, ball);
        assert!(world.state() == fork.state(), "a fork has the same pairs");
    }
}

/// v²/2μg, as for a rule with the same μ.
#[test]
fn a_pair_has_a_friction_of_its_own() {
    let mut world = world("time_stepping", 1.0 / 240.0);
    let floor = ground(&mut world, 0.0, 0.9);
    let body = RigidBody::new(cube(0.2))
        .with_name("box")
        .with_mass(1.0)
        .with_material(Material { friction: 0.9, ..Material::default() });
    let body = body.with_pose(Pose::translation(0.0, 0.0, 0.1)).with_velocity(Vec3::new(2.0, 0.0, 0.0));
    let id = world.add(body).unwrap();
    world.set_pair_material(id, floor, PairMaterial { friction: Some(0.25), ..PairMaterial::default() }).unwrap();
    (0..480).for_each(|_| {
        world.step().unwrap();
    });
    let expected = 4.0 / (2.0 * 0.25 * G);
    assert!((position(&world, id).x - expected).abs() < 2e-3, "{} {expected}", position(&world, id).x);
}

#[test]
fn parts_go_before_objects_and_objects_before_materials() {
    let (mut world, ball, floor) = dropped(Settings::default(), 0.3, 0.1);
    world.get_mut::<RigidBody>(ball).unwrap().material.id = 7;
    world.get_mut::<RigidBody>(floor).unwrap().material.id = 9;
    let both = |restitution, friction| PairMaterial { restitution, friction, ..PairMaterial::default() };
    let found = |world: &World| {
        let found = world.pair_material((ball, 0), (floor, 0)).unwrap();
        (found.restitution, found.friction)
    };
    assert_eq!(found(&world), (0.3, 0.5));
    world.set_pair_material(PairSide::Material(9), PairSide::Material(7), both(Some(0.9), Some(0.1))).unwrap();
    assert_eq!(found(&world), (0.9, 0.1));
    world.set_pair_material(ball, floor, both(Some(0.8), None)).unwrap();
    assert_eq!(found(&world), (0.8, 0.1), "what an entry leaves open, the next one says");
    world.set_pair_material((floor, 0), (ball, 0), both(None, Some(0.4))).unwrap();
    assert_eq!(found(&world), (0.8, 0.4));
    world.set_pair_material(floor, ball, PairMaterial::default()).unwrap();
    assert_eq!(found(&world), (0.9, 0.4), "two times None takes a pair off");
}

#[test]
fn pairs_that_cannot_be_are_refused_and_go_with_their_objects() {
    let (mut world, ball, floor) = dropped(Settings::default(), 0.3, 0.1);
    let e = |e| PairMaterial { restitution: Some(e), ..PairMaterial::default() };
    let wrong = world.set_pair_material(ball, floor, e(1.5)).unwrap_err();
    assert_eq!(wrong.to_string(), "restitution of a pair is 1.5; it must be 0 to 1");
    let rough = PairMaterial { friction: Some(f64::INFINITY), ..PairMaterial::default() };
    assert!(world.set_pair_material(ball, floor, rough).is_err());
    assert!(world.set_pair_material(PairSide::Material(0), floor, e(0.5)).is_err());
    assert!(world.set_pair_material((ball, 1), floor, e(0.5)).is_err());
    world.set_pair_material(ball, floor, e(0.9)).unwrap();
    world.remove(ball).unwrap();
    assert_eq!(world.set_pair_material(ball, floor, e(0.5)).unwrap_err(), WorldError::Stale);
}
