//! Names of shapes: on bodies and links, in contacts, hits, events, forks and archives.

use tumble_core::collide::{CompoundPart, Pose, Shape, Vec3};
use tumble_core::prelude::*;
use tumble_core::{ArticulationBuilder, Collider, EventKind, Joint, LinkBuilder, LinkMass, ObjectId, QueryFilter, Ray};

fn sphere(radius: f64) -> Shape {
    Shape::sphere(radius).unwrap()
}

fn ball(x: f64) -> CompoundPart {
    CompoundPart::new(sphere(0.1), Pose::translation(x, 0.0, 0.0))
}

/// A bar with a nameless ball at x = 0 and named ones at ±1 m, all 0.1 m above the ground.
fn bar() -> RigidBody {
    let parts = vec![ball(0.0), ball(-1.0).with_name("left"), ball(1.0).with_name("right")];
    RigidBody::new(Shape::compound(parts).unwrap()).with_name("bar").with_pose(Pose::translation(0.0, 0.0, 0.0999))
}

fn world() -> World {
    let mut world = World::default();
    let floor = RigidBody::fixed(Shape::half_space()).with_name("floor").with_shape_name("surface");
    world.add_static(floor).unwrap();
    world
}

fn archived(world: &World) -> World {
    World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap()
}

/// Names of both shapes of each contact, by the sign of the x coordinate of its point.
fn touching(world: &World) -> Vec<(i32, [Option<String>; 2])> {
    let name = |id, part, shape| world.shape_name(id, part, shape).map(str::to_owned);
    let of = |c: &tumble_core::ContactPoint| {
        let sides = [(c.a, c.part_a, c.shape_a), (c.b, c.part_b, c.shape_b)];
        let mut names = sides.map(|(id, part, shape)| name(id, part, shape));
        if names[0].as_deref() == Some("surface") {
            names.swap(0, 1);
        }
        ((2.0 * c.point.x).round() as i32, names)
    };
    let mut all: Vec<_> = world.contacts().iter().map(of).collect();
    all.sort();
    all
}

#[test]
fn contacts_and_hits_say_the_names_of_shapes() {
    let mut world = world();
    let id = world.add(bar()).unwrap();
    world.step().unwrap();
    let named = |name: &str| [Some(name.to_owned()), Some("surface".to_owned())];
    let wanted = [(-2, named("left")), (0, [None, Some("surface".to_owned())]), (2, named("right"))];
    assert_eq!(touching(&world), wanted);
    let fork = world.fork();
    assert_eq!(touching(&fork), wanted);
    let again = archived(&world);
    assert_eq!(touching(&again), wanted);
    let rays = [-1.0, 0.0, 1.0].map(|x| Ray {
        origin: Vec3::new(x, 0.0, 2.0),
        direction: -Vec3::z(),
        max_distance: f64::INFINITY,
    });
    let hits = again.cast_rays(&rays, &QueryFilter::default()).into_iter().map(|hit| hit.unwrap());
    let names: Vec<_> = hits.map(|hit| again.shape_name(hit.id, hit.part, hit.shape).map(str::to_owned)).collect();
    assert_eq!(names, [Some("left".into()), None, Some("right".into())]);
    let body = again.get::<RigidBody>(id).unwrap();
    assert_eq!(["left", "right", "middle"].map(|name| body.shape_named(name)), [Some(1), Some(2), None]);
}

#[test]
fn an_event_says_the_shape_that_is_hit_hardest() {
    for flipped in [false, true] {
        let mut world = World::default();
        // the heavy end falls on the anvil, which is added before the bar or after it
        let anvil =
            || RigidBody::fixed(sphere(0.2)).with_shape_name("horn").with_pose(Pose::translation(1.0, 0.0, -0.2));
        let falling = bar().with_pose(Pose::translation(0.0, 0.0, 0.2)).with_velocity(-3.0 * Vec3::z());
        let bar = match flipped {
            false => {
                world.add_static(anvil()).unwrap();
                world.add(falling).unwrap()
            }
            true => {
                let id = world.add(falling).unwrap();
                world.add_static(anvil()).unwrap();
                id
            }
        };
        let event = loop {
            assert!(world.time() < 1.0, "no contact");
            world.step().unwrap();
            if let Some(event) = world.events().iter().find(|event| event.kind == EventKind::ContactBegin) {
                break *event;
            }
        };
        let sides = [(event.a, event.part_a, event.shape_a), (event.b.unwrap(), event.part_b, event.shape_b)];
        let names = sides.map(|(id, part, shape)| world.shape_name(id, part, shape));
        assert_eq!(names, if flipped { [Some("right"), Some("horn")] } else { [Some("horn"), Some("right")] });
        assert_eq!(sides[usize::from(!flipped)], (bar, 0, 2));
        let again = archived(&world);
        assert_eq!(again.events(), world.events());
    }
}

/// An arm of one moving link, whose hand and the plate on the base are fixed links.
fn arm() -> ArticulationBuilder {
    let at = |x: f64| Pose::translation(x, 0.0, 0.0);
    let named = |name: &str, x: f64| Collider::new(sphere(0.1), at(x)).with_name(name);
    let mass = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: tumble_core::collide::Mat3::identity() };
    let pads = Shape::compound(vec![ball(-0.5).with_name("inner"), ball(0.5)]).unwrap();
    let base = LinkBuilder::new("base", Joint::Fixed).with_collider(named("pad", 0.0));
    let plate = LinkBuilder::new("plate", Joint::Fixed).with_parent("base").with_collider(named("pad", 0.3));
    let upper = LinkBuilder::new("upper", Joint::revolute(Vec3::y())).with_parent("base").with_mass_properties(mass);
    let upper = upper.with_shape(sphere(0.1), at(2.0)).with_shape_name("pad").with_shape(sphere(0.1), at(2.5));
    let hand = LinkBuilder::new("hand", Joint::Fixed).with_parent("upper").with_mass_properties(mass);
    let hand = hand.with_collider(named("pad", 3.0)).with_collider(Collider::new(pads, at(4.0)));
    ArticulationBuilder::new("arm").link(base).link(plate).link(upper).link(hand)
}

#[test]
fn fixed_links_have_shapes_of_their_own() {
    let body = arm().build().unwrap();
    let frame = |link: &str| body.model().frame_index(link).unwrap();
    let names = |link: &str| body.shapes_of(frame(link)).map(|(_, _, name)| name.unwrap_or("")).collect::<Vec<_>>();
    assert_eq!(["base", "plate", "upper"].map(names), [vec!["pad"], vec!["pad"], vec!["pad", ""]]);
    assert_eq!(names("hand"), ["pad", "inner", ""]);
    for (link, name, number) in [("base", "pad", 0), ("plate", "pad", 0), ("upper", "pad", 0), ("hand", "inner", 1)] {
        let (part, shape) = body.shape_named(link, name).unwrap();
        assert_eq!(body.shape_number(part, shape), number, "{link} {name}");
        assert_eq!(body.frame_of(part), Some(frame(link)));
    }
    // parts: the moving link, the base, then the shapes
    assert_eq!([0, 1].map(|part| body.frame_of(part)), [Some(frame("upper")), None]);
    assert_eq!(body.shape_named("upper", "inner"), None);
    assert_eq!(body.shape_named("nothing", "pad"), None);
    let mut world = World::default();
    let id = world.add(body).unwrap();
    let again = archived(&world);
    let ray = Ray { origin: Vec3::new(3.5, 0.0, 5.0), direction: -Vec3::z(), max_distance: 9.0 };
    for world in [&world, &again] {
        let hit = world.cast_rays(&[ray], &QueryFilter::default())[0].unwrap();
        assert_eq!((hit.id, world.shape_name(hit.id, hit.part, hit.shape)), (id, Some("inner")));
        assert_eq!(world.part_name(hit.id, hit.part), Some("hand"));
    }
    assert_eq!(again.part_name(again.find("arm").unwrap(), 1), None);
    assert_eq!(world.shape_name(ObjectId::default(), 0, 0), None);
}

#[test]
fn a_name_that_occurs_twice_is_an_error_with_both_places() {
    let two = Shape::compound(vec![ball(0.0).with_name("pad"), ball(1.0), ball(2.0).with_name("pad")]);
    assert_eq!(
        two.unwrap_err().to_string(),
        "parts 1 and 3 of a compound are both named 'pad'; give the shapes of one body different names"
    );
    let error = |link: LinkBuilder| arm().link(link.with_parent("upper")).build().err().unwrap().to_string();
    let extra = |name: &str| {
        let named = Collider::new(sphere(0.1), Pose::identity()).with_name(name);
        LinkBuilder::new("more", Joint::Fixed).with_collider(named.clone()).with_collider(named)
    };
    assert_eq!(
        error(extra("pad")),
        "articulated body 'arm', link 'more': shapes 0 and 1 are both named 'pad'; give the shapes of one body or link different names"
    );
    assert!(error(extra("")).contains("the name of a shape is ''"));
    let whole = Shape::compound(vec![ball(0.0), ball(1.0)]).unwrap();
    let collider = Collider::new(whole.clone(), Pose::identity()).with_name("whole");
    assert!(error(LinkBuilder::new("more", Joint::Fixed).with_collider(collider)).contains("name its parts"));
    let error = RigidBody::new(whole.clone()).with_shape_name("whole").validate().unwrap_err().to_string();
    assert!(error.contains("'whole'") && error.contains("name its parts"), "{error}");
    assert!(RigidBody::new(sphere(0.1)).with_shape_name("").validate().is_err());
    let inside = CompoundPart::new(whole, Pose::identity()).with_name("inside");
    let error = Shape::compound(vec![ball(9.0), inside]).unwrap_err().to_string();
    assert!(error.contains("part 2") && error.contains("'inside'"), "{error}");
    assert!(Shape::compound(vec![ball(0.0).with_name("")]).unwrap_err().to_string().contains("part 1"));
}
