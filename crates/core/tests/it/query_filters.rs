//! Filters of queries: parts of links, and queries as a body.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

/// A robot along x: a base at 0, a link at 1 with a fixed "tip" at 2, and a link at 3.
fn robot() -> ArticulatedBody {
    let shape = |x: f64| Collider::new(cube(0.4), Pose::translation(x, 0.0, 0.0));
    let base = LinkBuilder::new("base", Joint::Fixed).with_collider(shape(0.0));
    let link = |name: &str| LinkBuilder::new(name, Joint::revolute(Vec3::z())).with_mass(1.0);
    let arm = link("arm").with_parent("base").with_shape(cube(0.4), Pose::translation(1.0, 0.0, 0.0));
    let tip = LinkBuilder::new("tip", Joint::Fixed).with_parent("arm").with_collider(shape(2.0));
    let hand = link("hand").with_parent("arm").with_shape(cube(0.4), Pose::translation(3.0, 0.0, 0.0));
    ArticulationBuilder::new("robot").link(base).link(arm).link(tip).link(hand).build().unwrap()
}

fn seen(world: &World, filter: &QueryFilter) -> Vec<String> {
    let down = |x: f64| Ray { origin: Vec3::new(x, 0.0, 5.0), direction: -Vec3::z(), max_distance: 10.0 };
    let hits = [0.0, 1.0, 2.0, 3.0, 6.0, 7.0].map(|x| world.cast_ray(&down(x), filter));
    let name = |hit: RayCastHit| world.part_name(hit.id, hit.part).or(world.name(hit.id)).unwrap().to_string();
    hits.into_iter().flatten().map(name).collect()
}

fn scene() -> (World, ObjectId, [ObjectId; 2]) {
    let mut world = no_gravity(world("time_stepping", 1.0 / 60.0));
    let robot = world.add(robot()).unwrap();
    let bodies = [("red", 6.0, 1), ("blue", 7.0, 2)].map(|(name, x, n)| {
        let body = RigidBody::new(cube(0.4)).with_name(name).with_pose(Pose::translation(x, 0.0, 0.0));
        world.add(body.with_groups(CollisionGroup::new(n).unwrap(), u64::MAX)).unwrap()
    });
    (world, robot, bodies)
}

#[test]
fn links_are_ignored_one_by_one() {
    let (world, robot, [red, _]) = scene();
    let all = QueryFilter::default();
    assert_eq!(seen(&world, &all), ["base", "arm", "tip", "hand", "red", "blue"]);
    let body = world.get::<ArticulatedBody>(robot).unwrap();
    let without = |links: &[&str]| {
        let parts = links.iter().flat_map(|link| body.parts_of_link(link).unwrap());
        QueryFilter::default().ignoring_parts(robot, parts)
    };
    // a fixed link is another one than its carrier
    assert_eq!(seen(&world, &without(&["arm"])), ["base", "tip", "hand", "red", "blue"]);
    assert_eq!(seen(&world, &without(&["tip", "base"])), ["arm", "hand", "red", "blue"]);
    assert_eq!(seen(&world, &without(&["hand"]).ignoring(red)), ["base", "arm", "tip", "blue"]);
    assert!(body.parts_of_link("foot").is_err());
}

#[test]
fn a_query_as_a_body_finds_what_it_collides_with() {
    let (mut world, robot, [red, blue]) = scene();
    let as_red = QueryFilter::default().acting_as(red);
    assert_eq!(seen(&world, &as_red), ["base", "arm", "tip", "hand", "blue"]);
    // its mask, and that of the others
    world.change_body(red, |body| body.mask = !(1 << 2)).unwrap();
    assert_eq!(seen(&world, &as_red), ["base", "arm", "tip", "hand"]);
    world.change_body(red, |body| body.mask = u64::MAX).unwrap();
    world.change_body(blue, |body| body.mask = !(1 << 1)).unwrap();
    assert_eq!(seen(&world, &as_red), ["base", "arm", "tip", "hand"]);
    world.change_body(blue, |body| body.mask = u64::MAX).unwrap();
    // pairs that do not collide
    let never = PairMaterial { collides: Some(false), ..PairMaterial::default() };
    world.set_pair_material(PairSide::Object(red), PairSide::Object(blue), never).unwrap();
    assert_eq!(seen(&world, &as_red), ["base", "arm", "tip", "hand"]);
    assert_eq!(seen(&world, &QueryFilter::default().acting_as(blue)), ["base", "arm", "tip", "hand"]);
    let hand = world.get::<ArticulatedBody>(robot).unwrap().parts_of_link("hand").unwrap()[0];
    world.set_pair_material(PairSide::Object(red), PairSide::Part(robot, hand), never).unwrap();
    assert_eq!(seen(&world, &as_red), ["base", "arm", "tip"]);
    // a link: its own body without its neighbors
    let as_hand = QueryFilter::default().acting_as_parts(robot, [hand]);
    assert_eq!(seen(&world, &as_hand), ["base", "blue"]);
    // the filter of the query counts too
    let masked = QueryFilter { mask: 1 << 2, ..as_hand.clone() };
    assert_eq!(seen(&world, &masked), ["blue"]);
    // a removed object collides with nothing
    world.remove(red).unwrap();
    assert_eq!(seen(&world, &as_red), [""; 0]);
}

#[test]
fn closest_points_of_links_are_those_of_their_own_shapes() {
    let (world, robot, [red, _]) = scene();
    let body = world.get::<ArticulatedBody>(robot).unwrap();
    let parts = |link: &str| body.parts_of_link(link).unwrap();
    let between = |a: &str, b: &str| {
        let (a, b) = (parts(a), parts(b));
        world.closest_points_of((robot, Some(&a)), (robot, Some(&b))).unwrap().unwrap()
    };
    // cubes of 0.4 m, 1 m apart; a fixed link is another one than its carrier
    for (a, b, distance) in [("base", "arm", 0.6), ("arm", "tip", 0.6), ("base", "hand", 2.6), ("hand", "base", 2.6)] {
        let found = between(a, b);
        assert!((found.distance - distance).abs() < 1e-9, "{a} {b}: {}", found.distance);
        assert_eq!(found.a, Some((robot, parts(a)[0])));
        assert_eq!(found.b, (robot, parts(b)[0]));
    }
    let tip = parts("tip");
    let far = |a: (ObjectId, Option<&[usize]>)| world.closest_points_of(a, (red, None)).unwrap().unwrap().distance;
    assert!((far((robot, Some(&tip))) - 3.6).abs() < 1e-9 && (far((robot, None)) - 2.6).abs() < 1e-9);
    assert_eq!(far((robot, None)), world.closest_points(robot, red).unwrap().unwrap().distance);
    // a part without a shape has no distance
    assert_eq!(world.closest_points_of((robot, Some(&[])), (red, None)).unwrap(), None);
}
