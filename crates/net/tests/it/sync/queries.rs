//! The world of a facet answers queries as that of the server, for bodies, compounds with filters of their shapes, and links.

use super::simulated_session::viewer;
use tumble_core::collide::{CompoundPart, Pose, Shape, Vec3};
use tumble_core::{
    ArticulationBuilder, Collider, CollisionGroup, Joint, LinkBuilder, ObjectId, QueryFilter, Ray, RigidBody,
    ShapeFilter, World,
};
use tumble_net::sync::quantize::POSITION_ERROR_M;
use tumble_net::sync::{Mirror, Publisher};

fn falling() -> World {
    let mut world = World::default();
    world.add(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
    let at = |x: f64| CompoundPart::new(Shape::cuboid(Vec3::repeat(0.2)).unwrap(), Pose::translation(x, 0.0, 0.0));
    let bar =
        RigidBody::new(Shape::compound(vec![at(-0.3), at(0.0), at(0.3)]).unwrap()).with_name("bar").with_mass(2.0);
    let sensor = ShapeFilter { sensor: true, ..ShapeFilter::default() };
    let hidden = ShapeFilter { group: CollisionGroup::new(9).unwrap(), ..ShapeFilter::default() };
    let bar = bar.with_shape_filter(1, sensor).with_shape_filter(2, hidden);
    world.add(bar.with_pose(Pose::translation(0.0, 0.0, 1.0)).with_angular_velocity(Vec3::new(0.3, 1.0, 2.0))).unwrap();
    let ball = RigidBody::new(Shape::sphere(0.2).unwrap()).with_name("ball").with_mass(1.0);
    world.add(ball.with_pose(Pose::translation(1.0, 0.2, 1.5)).with_velocity(Vec3::new(-1.0, 0.0, 0.5))).unwrap();
    let part = Collider::new(Shape::capsule(0.05, 0.5).unwrap(), Pose::translation(0.0, 0.0, -0.3));
    let rod = |name: &str, parent: &str, z: f64| {
        let link = LinkBuilder::new(name, Joint::revolute(Vec3::y())).with_mass(1.0).with_collider(part.clone());
        let link = link.with_pose(Pose::translation(0.0, 0.0, z));
        if parent.is_empty() { link } else { link.with_parent(parent) }
    };
    let arm = ArticulationBuilder::new("arm").link(rod("upper", "", 2.0)).link(rod("lower", "upper", -0.6));
    world.add(arm.build().unwrap()).unwrap();
    world
}

#[test]
fn a_facet_answers_queries_as_the_server() {
    let mut world = falling();
    let (mut publisher, mut mirror) = (Publisher::new(&world, false, 0), Mirror::new(falling()));
    let filters = [
        QueryFilter::default(),
        QueryFilter { mask: !(1 << 9), ..QueryFilter::default() },
        QueryFilter::default().ignoring(world.find("ball").unwrap()),
    ];
    let probe = Shape::cuboid(Vec3::new(0.3, 0.2, 0.4)).unwrap();
    let (mut hits, mut met, mut last) = ([0; 3], 0, [0; 3]);
    for frame in 1..=60 {
        world.step().unwrap();
        let published = publisher.publish(&world, &viewer(frame), frame).unwrap();
        if published.fresh {
            mirror.apply_snapshot(&publisher.snapshot()).unwrap();
        }
        mirror.apply_state(frame, world.time(), &published.state).unwrap();
        let facet = mirror.world();
        let name = |world: &World, id: ObjectId| world.name(id).unwrap().to_string();
        // far from grazing anything, the two answers differ by the rounding of poses alone
        let near = 20.0 * POSITION_ERROR_M;
        for (filter, hits) in filters.iter().zip(&mut hits) {
            let rays: Vec<Ray> = (0..40)
                .map(|k| {
                    let (x, y) = (f64::from(k % 8) * 0.27 - 0.9, f64::from(k / 8) * 0.11 - 0.2);
                    Ray { origin: Vec3::new(x, y, 4.0), direction: Vec3::new(0.05, 0.02, -1.0), max_distance: 9.0 }
                })
                .collect();
            for (here, there) in facet.cast_rays(&rays, filter).iter().zip(world.cast_rays(&rays, filter)) {
                let (Some(here), Some(there)) = (here, there) else { panic!("a ray misses the ground") };
                // a ray beside an edge may pass it on one side alone
                let same = name(facet, here.id) == name(&world, there.id) && here.shape == there.shape;
                *hits += usize::from(same && (here.distance - there.distance).abs() < near);
            }
            let at = Pose::translation(0.1, 0.0, 0.9);
            let all = |world: &World| world.overlaps(&probe, &at, filter).iter().map(|f| f.depth).fold(0.0, f64::max);
            assert!((all(facet) - all(&world)).abs() < near);
            let cast =
                |world: &World| world.cast_shape(&probe, &Pose::translation(0.1, 0.0, 5.0), &-Vec3::z(), 9.0, filter);
            let (here, there) = (cast(facet).unwrap(), cast(&world).unwrap());
            assert!((here.distance - there.distance).abs() < near, "{here:?} instead of {there:?}");
            let closest = |world: &World| world.closest_to_shape(&probe, &at, 9.0, filter).unwrap().distance;
            assert!((closest(facet) - closest(&world)).abs() < near);
            let point = Vec3::new(0.0, 0.05, 0.8);
            let depth = |world: &World| world.point_depth(&point, filter).unwrap().depth;
            assert!((depth(facet) - depth(&world)).abs() < near);
            met += usize::from(all(&world) > 0.0);
        }
        let links = |world: &World| {
            let id = world.find("arm").unwrap();
            world.closest_points(id, world.find("bar").unwrap()).unwrap().unwrap().distance
        };
        assert!((links(facet) - links(&world)).abs() < near);
        last = hits;
    }
    assert!(last.iter().all(|hits| *hits > 60 * 40 * 9 / 10), "{last:?}");
    assert!(met > 10, "{met}");
}
