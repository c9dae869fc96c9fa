//! Mass, center of mass and inertia of links, changed while a world runs.

use tumble_core::collide::{Mat3, Pose, Shape, Vec3};
use tumble_core::prelude::*;
use tumble_core::{
    ArticulatedBody, ArticulationBuilder, Collider, CollisionGroup, Joint, LinkBuilder, LinkMass, ObjectId, STEPPERS,
    stepper_by_name,
};

const G: f64 = 9.81;

fn mass(mass: f64, center: Vec3) -> LinkMass {
    LinkMass { mass, center, inertia: Mat3::from_diagonal(&(mass * Vec3::new(0.02, 0.03, 0.04))) }
}

/// A floating trunk with an arm; a hand is fixed to the arm and a finger to the hand.
fn robot(masses: [LinkMass; 4]) -> ArticulatedBody {
    let turned = |x: f64| Pose::new(Vec3::new(x, 0.1, -0.2), Vec3::new(0.3, -0.2, 0.5 + x));
    let [trunk, arm, hand, finger] = masses;
    let ball = |link: LinkBuilder| link.with_shape(Shape::sphere(0.1).unwrap(), Pose::identity());
    let link = |name: &str, joint, parent: &str, x: f64, mass| {
        ball(LinkBuilder::new(name, joint).with_parent(parent).with_pose(turned(x))).with_mass_properties(mass)
    };
    let trunk = ball(LinkBuilder::new("trunk", Joint::Floating)).with_mass_properties(trunk);
    ArticulationBuilder::new("robot")
        .link(trunk)
        .link(link("arm", Joint::revolute(Vec3::new(1.0, 2.0, 0.5)), "trunk", 0.3, arm).with_velocity(3.0))
        .link(link("hand", Joint::Fixed, "arm", 0.4, hand))
        .link(link("finger", Joint::Fixed, "hand", 0.2, finger))
        .build()
        .unwrap()
        .with_pose(Pose::translation(0.0, 0.0, 0.6))
}

const NAMES: [&str; 4] = ["trunk", "arm", "hand", "finger"];

fn one() -> [LinkMass; 4] {
    [2.0, 1.0, 0.5, 0.1].map(|m| mass(m, Vec3::new(0.01, 0.02, -0.03)))
}

fn other() -> [LinkMass; 4] {
    [3.0, 0.7, 1.5, 0.9].map(|m| mass(m, Vec3::new(-0.02, 0.05, 0.01 * m)))
}

fn on_floor(stepper: &str, body: ArticulatedBody) -> (World, ObjectId) {
    let mut world = World::default();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world.add_static(RigidBody::fixed(Shape::half_space())).unwrap();
    let id = world.add(body).unwrap();
    (world, id)
}

fn steps(world: &mut World, n: usize) {
    for _ in 0..n {
        world.step().unwrap();
    }
}

/// A body whose masses were set moves with the bits of one that was made with them, also over contacts.
#[test]
fn set_masses_give_the_bits_of_a_body_built_with_them() {
    for stepper in STEPPERS {
        let (mut built, _) = on_floor(stepper, robot(other()));
        let (mut set, id) = on_floor(stepper, robot(one()));
        for (name, mass) in NAMES.iter().zip(other()) {
            set.set_link_mass(id, name, mass).unwrap();
        }
        let body: &ArticulatedBody = set.get(id).unwrap();
        assert_eq!(*body.model(), *robot(other()).model());
        steps(&mut built, 200);
        steps(&mut set, 200);
        assert!(!set.contacts().is_empty());
        assert!(built.state_of(id) == set.state_of(id), "{stepper}");
    }
}

/// In a world that runs: from there on it moves as a body with these masses in the same state.
#[test]
fn masses_that_are_set_in_motion_count_from_then_on() {
    let mut world = World::default();
    let id = world.add(robot(one())).unwrap();
    steps(&mut world, 50);
    let mut fresh = World::default();
    let other_id = fresh.add(robot(other())).unwrap();
    fresh.write_state_of(other_id, world.state_of(id).unwrap()).unwrap();
    for (name, mass) in NAMES.iter().zip(other()) {
        world.set_link_mass(id, name, mass).unwrap();
    }
    for (world, id) in [(&mut world, id), (&mut fresh, other_id)] {
        world.set_armature(id, "arm", 0.3).unwrap();
    }
    for step in 0..100 {
        let pairs = world.state_of(id).unwrap().iter().zip(fresh.state_of(other_id).unwrap());
        let gap = pairs.fold(0.0, |gap: f64, (a, b)| gap.max((a - b).abs()));
        assert!(gap < 1e-12, "step {step}: {gap:e}");
        world.step().unwrap();
        fresh.step().unwrap();
    }
}

/// The period of small swings `2π √((I + m·L²) / (m·g·L))` of a pendulum with a bob that is fixed to its rod, before
/// and after the mass of the bob is set: half a period passes between two rests.
#[test]
fn the_period_of_a_pendulum_is_that_of_its_new_bob() {
    let rod = LinkBuilder::new("rod", Joint::revolute(Vec3::y())).with_position(0.01);
    let rod =
        rod.with_mass_properties(LinkMass { mass: 1.0, center: -0.5 * Vec3::z(), inertia: Mat3::identity() / 12.0 });
    let bob = LinkBuilder::new("bob", Joint::Fixed).with_parent("rod").with_pose(Pose::translation(0.0, 0.0, -1.0));
    let pendulum = ArticulationBuilder::new("pendulum").link(rod).link(bob.with_mass_properties(LinkMass::none()));
    for bob in [0.0, 2.5] {
        let mut world = World::new(Settings::default().with_dt(1e-3)).unwrap();
        let id = world.add(pendulum.build().unwrap()).unwrap();
        world.set_link_mass(id, "bob", LinkMass::point(bob, Vec3::zeros())).unwrap();
        let (inertia, moment) = (1.0 / 3.0 + bob, 0.5 + bob);
        let period = std::f64::consts::TAU * (inertia / (moment * G)).sqrt();
        let speed = |world: &World| world.state_of(id).unwrap()[1];
        world.step().unwrap();
        let (mut before, mut rest) = (speed(&world), 0.0);
        while rest == 0.0 {
            world.step().unwrap();
            let now = speed(&world);
            if before < 0.0 && now >= 0.0 {
                rest = world.time() - 1e-3 * now / (now - before);
            }
            before = now;
        }
        // the amplitude of 0.01 rad makes the period longer by 6e-6
        assert!((rest - period / 2.0).abs() < 2e-5 * period, "{bob}: {rest} {}", period / 2.0);
    }
}

/// The mass of a link is its own; the moving link has those of all links that are fixed to it.
#[test]
fn a_link_has_its_own_mass_and_its_carrier_all() {
    let [_, arm, hand, finger] = one();
    let body = robot(one());
    assert_eq!(NAMES.map(|name| body.link_mass(name)), one().map(Some));
    assert_eq!(body.link_mass("foot"), None);
    let sum = |body: &ArticulatedBody| body.model().links()[1].mass;
    assert!((sum(&body).mass - (arm.mass + hand.mass + finger.mass)).abs() < 1e-15);
    // two point masses about their common center
    let point = |m: f64, x: f64| LinkMass::point(m, Vec3::new(x, 0.0, 0.0));
    let at = |x: f64| Pose::translation(x, 0.0, 0.0);
    let bar = LinkBuilder::new("bar", Joint::revolute(Vec3::z())).with_mass_properties(point(1.0, 1.0));
    let tip = LinkBuilder::new("tip", Joint::Fixed)
        .with_parent("bar")
        .with_pose(at(2.0))
        .with_mass_properties(point(1.0, 0.0));
    let body = ArticulationBuilder::new("bar").link(bar).link(tip).build().unwrap();
    let body = body.with_link_mass("tip", point(3.0, 1.0)).unwrap();
    let all = body.model().links()[0].mass;
    // 1 kg at 1 m and 3 kg at 3 m: center 2.5 m, inertia 1·1.5² + 3·0.5² = 3 kg·m²
    assert!((all.mass - 4.0).abs() < 1e-15 && (all.center.x - 2.5).abs() < 1e-15);
    assert!((all.inertia[(2, 2)] - 3.0).abs() < 1e-14 && all.inertia[(0, 0)].abs() < 1e-14);
}

/// A fork with other masses and the world that it came from do not disturb each other.
#[test]
fn a_fork_has_masses_of_its_own() {
    let mut world = World::default();
    let id = world.add(robot(one())).unwrap();
    let mut untouched = world.fork();
    steps(&mut world, 10);
    let mut fork = world.fork();
    fork.set_link_mass(id, "hand", mass(9.0, Vec3::zeros())).unwrap();
    steps(&mut fork, 40);
    steps(&mut world, 40);
    steps(&mut untouched, 50);
    assert!(world.save() == untouched.save());
    assert!(world.state_of(id) != fork.state_of(id));
    let archive = fork.archive(&[]).unwrap();
    let mut read = World::from_archive(&archive, &mut |_| unreachable!()).unwrap();
    steps(&mut read, 30);
    steps(&mut fork, 30);
    assert!(read.save() == fork.save());
}

#[test]
fn wrong_masses_change_nothing() {
    let mut world = World::default();
    let id = world.add(robot(one())).unwrap();
    let ball = world.add(RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("ball")).unwrap();
    let before = world.get::<ArticulatedBody>(id).unwrap().model().clone();
    let mut fault = |id, link: &str, mass| world.set_link_mass(id, link, mass).unwrap_err().to_string();
    let point = |m| LinkMass::point(m, Vec3::zeros());
    assert!(fault(id, "hand", point(-1.0)).contains("link 'hand': mass is -1; it must be finite and at least 0 kg"));
    assert!(fault(id, "hand", LinkMass { center: Vec3::repeat(f64::NAN), ..point(1.0) }).contains("center of mass"));
    assert!(fault(id, "foot", point(1.0)).contains("no link named 'foot'"));
    assert!(fault(ball, "hand", point(1.0)).contains("'ball'"));
    world.set_link_mass(id, "hand", LinkMass::none()).unwrap();
    world.set_link_mass(id, "finger", LinkMass::none()).unwrap();
    let error = world.set_link_mass(id, "arm", LinkMass::none()).unwrap_err().to_string();
    assert!(error.contains("link 'arm' and its descendants have no inertia"), "{error}");
    let body: &ArticulatedBody = world.get(id).unwrap();
    assert_eq!((body.link_mass("arm"), body.model().links()[1].mass), (Some(one()[1]), one()[1]));
    for (name, mass) in NAMES.iter().zip(one()) {
        world.set_link_mass(id, name, mass).unwrap();
    }
    assert_eq!(*world.get::<ArticulatedBody>(id).unwrap().model(), before);
}

/// Masses and densities of single shapes of a link, and the density of water of the others.
#[test]
fn shapes_of_a_link_have_masses_of_their_own() {
    let cube = || Shape::cuboid(Vec3::repeat(0.1)).unwrap();
    let at = |x: f64| Pose::translation(x, 0.0, 0.0);
    let link = LinkBuilder::new("link", Joint::Floating).with_shape(cube(), at(0.0)).with_shape_mass(3.0);
    let link = link.with_shape(cube(), at(1.0)).with_shape_density(2000.0).with_shape(cube(), at(2.0));
    let body = ArticulationBuilder::new("cubes").link(link.clone()).build().unwrap();
    let mass = body.link_mass("link").unwrap();
    // 3 kg at 0, 2 kg at 1 m and 1 kg at 2 m
    assert!((mass.mass - 6.0).abs() < 1e-12 && (mass.center.x - 4.0 / 6.0).abs() < 1e-12);
    let error = ArticulationBuilder::new("cubes").link(link.with_mass(1.0)).build().err().unwrap().to_string();
    assert!(error.contains("it has a mass, and a shape of it has one too"), "{error}");
}

/// Groups of all shapes, of one link, and of links in the builder.
#[test]
fn groups_of_links() {
    let group = |n| CollisionGroup::new(n).unwrap();
    let ball = |x: f64| Collider::new(Shape::sphere(0.1).unwrap(), Pose::translation(x, 0.0, 0.0));
    let link = LinkBuilder::new("a", Joint::Floating).with_groups(group(3), 0b11).with_collider(ball(1.0));
    let link = link.with_shape(Shape::sphere(0.1).unwrap(), Pose::identity());
    let fixed = LinkBuilder::new("b", Joint::revolute(Vec3::x())).with_parent("a").with_collider(ball(0.0));
    let mut body = ArticulationBuilder::new("body").link(link).link(fixed).build().unwrap();
    let filters = |body: &ArticulatedBody| body.colliders().map(|(_, c)| (c.group, c.mask)).collect::<Vec<_>>();
    let all = (group(0), u64::MAX);
    assert_eq!(filters(&body), [all, (group(3), 0b11), all]);
    body.change_link_groups("b", |_, _| (group(5), 0)).unwrap();
    assert_eq!(filters(&body), [all, (group(3), 0b11), (group(5), 0)]);
    body.set_groups(group(7), 6);
    assert_eq!(filters(&body), [(group(7), 6); 3]);
    assert!(body.change_link_groups("c", |own, all| (own, all)).unwrap_err().to_string().contains("no link named 'c'"));
}
