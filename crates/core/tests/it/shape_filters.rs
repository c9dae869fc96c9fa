//! Collision group, mask and sensor of single shapes of a compound.

use crate::common::*;
use tumble_core::collide::{CompoundPart, CompoundShape, Pose, Shape, Vec3};
use tumble_core::*;

const SENSOR: ShapeFilter = ShapeFilter { group: CollisionGroup::new(0).unwrap(), mask: u64::MAX, sensor: true };

fn group(n: u8) -> CollisionGroup {
    CollisionGroup::new(n).unwrap()
}

/// A dumbbell: cubes of 0.2 m at x = −0.5 and 0.5 m.
fn dumbbell() -> RigidBody {
    let at = |x: f64| CompoundPart::new(cube(0.2), Pose::translation(x, 0.0, 0.0));
    let shape = CompoundShape::new(vec![at(-0.5).with_name("left"), at(0.5).with_name("right")]).unwrap();
    RigidBody::new(Shape::Compound(shape.into())).with_mass(2.0).with_name("dumbbell")
}

/// A floor for each end, of groups 1 and 2.
fn floors(world: &mut World) -> [ObjectId; 2] {
    [(-0.5, 1), (0.5, 2)].map(|(x, n)| {
        let floor = RigidBody::fixed(cube(0.4)).with_pose(Pose::translation(x, 0.0, -0.3));
        world.add_static(floor.with_groups(group(n), u64::MAX)).unwrap()
    })
}

fn touched(world: &World) -> Vec<(usize, usize)> {
    let mut found: Vec<_> =
        world.contacts().iter().filter(|c| c.is_touching()).map(|c| (c.shape_a, c.shape_b)).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// The masked end falls through what carries the other end: the body turns about the end that rests.
#[test]
fn a_shape_collides_with_the_groups_of_its_own_mask() {
    for stepper in STEPPERS {
        for fixed in [0usize, 1] {
            let mut world = world(stepper, 1.0 / 120.0);
            let [left, right] = floors(&mut world);
            let through = ShapeFilter { mask: !(0b110u64), ..ShapeFilter::default() };
            let body = dumbbell().with_shape_filter(1 - fixed, through).with_pose(Pose::translation(0.0, 0.0, 0.0));
            let id = world.add(body).unwrap();
            for _ in 0..30 {
                world.step().unwrap();
            }
            let down = world.part_state(id, 0).unwrap().pose.rotation * Vec3::x();
            let lower = if fixed == 0 { down.z } else { -down.z };
            assert!(lower < -0.1, "{stepper}, {fixed}: the free end does not fall, {down:?}");
            let touching: Vec<ObjectId> = world.touching(id).into_iter().map(|(id, _)| id).collect();
            assert_eq!(touching, [[left], [right]][fixed], "{stepper}");
            assert!(touched(&world).iter().all(|(a, b)| a + b == fixed), "{stepper}: {:?}", touched(&world));
        }
    }
}

/// Group and mask of both shapes of a pair count, also if both bodies have filters: of four pairs of shapes one collides.
#[test]
fn shapes_of_two_bodies_are_compared_one_by_one() {
    let mut world = world("time_stepping", 1.0 / 120.0);
    let own = |n: u8, mask: u64| ShapeFilter { group: group(n), mask, sensor: false };
    let lower = dumbbell().with_shape_filter(0, own(1, 1 << 3)).with_shape_filter(1, own(2, 1 << 4));
    world.add_static(lower).unwrap();
    let upper = dumbbell().with_name("upper").with_pose(Pose::translation(0.0, 0.0, 0.2));
    let upper = upper.with_shape_filter(0, own(3, 1 << 1)).with_shape_filter(1, own(4, 1 << 1));
    let id = world.add(upper).unwrap();
    for _ in 0..30 {
        world.step().unwrap();
    }
    assert_eq!(touched(&world), [(0, 0)]);
    assert!((world.part_state(id, 0).unwrap().pose.rotation * Vec3::x()).z < -0.1);
    // with masks that allow both pairs of the same side, and no others, both are found
    let both = |body: &mut RigidBody| body.set_shape_filter(1, Some(own(4, 1 << 2)));
    let mut world = crate::common::world("time_stepping", 1.0 / 120.0);
    let lower = dumbbell().with_shape_filter(0, own(1, 1 << 3)).with_shape_filter(1, own(2, 1 << 4));
    world.add_static(lower).unwrap();
    let upper = dumbbell().with_name("upper").with_pose(Pose::translation(0.0, 0.0, 0.2));
    let mut upper = upper.with_shape_filter(0, own(3, 1 << 1));
    both(&mut upper);
    let id = world.add(upper).unwrap();
    for _ in 0..240 {
        world.step().unwrap();
    }
    assert_eq!(touched(&world), [(0, 0), (1, 1)]);
    assert!((position(&world, id).z - 0.2).abs() < 1e-4);
}

/// A body whose filters all are those of the body moves as one without any, bit for bit.
#[test]
fn filters_like_those_of_the_body_change_nothing() {
    let run = |body: RigidBody| {
        let mut world = world("time_stepping", 1.0 / 120.0);
        floors(&mut world);
        world
            .add(body.with_pose(Pose::translation(0.1, 0.02, 0.3)).with_angular_velocity(Vec3::new(0.4, 1.0, 2.0)))
            .unwrap();
        (0..120).for_each(|_| assert!(world.step().is_ok()));
        world.save()
    };
    let same = ShapeFilter::default();
    assert!(run(dumbbell()) == run(dumbbell().with_shape_filter(0, same).with_shape_filter(1, same)));
}

/// A shape that is a sensor has no contacts and reports what overlaps it, by its index; the other shape rests on the floor.
#[test]
fn a_shape_is_a_sensor() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 60.0));
        let id = world.add(dumbbell().with_shape_filter(1, SENSOR)).unwrap();
        let ball = RigidBody::new(sphere(0.05)).with_name("ball").with_pose(Pose::translation(0.5, 0.0, 1.0));
        let ball = world.add(ball.with_velocity(Vec3::new(0.0, 0.0, -1.0))).unwrap();
        let (mut events, mut before) = (Vec::new(), 0);
        for frame in 0..120 {
            world.step().unwrap();
            events.extend(world.events().iter().map(|e| (e.kind, e.a, e.shape_a, e.b)));
            if !world.touching(id).is_empty() && before == 0 {
                before = frame;
                assert_eq!(world.touching(id), [(ball, 0)], "{stepper}");
            }
        }
        let expected = [(EventKind::SensorBegin, id, 1, Some(ball)), (EventKind::SensorEnd, id, 1, Some(ball))];
        assert_eq!(events, expected, "{stepper}");
        assert!((velocity(&world, ball) - Vec3::new(0.0, 0.0, -1.0)).norm() < 1e-12, "{stepper}");
        assert!(velocity(&world, id).norm() < 1e-12, "{stepper}");
    }
}

/// Two sensors of one body report by themselves, and only groups that both masks allow.
#[test]
fn two_sensors_of_a_body_report_by_themselves() {
    let mut world = no_gravity(world("time_stepping", 1.0 / 60.0));
    let deaf = ShapeFilter { mask: 1 << 5, ..SENSOR };
    let id = world.add(dumbbell().with_shape_filter(0, deaf).with_shape_filter(1, SENSOR)).unwrap();
    for x in [-0.5, 0.5] {
        world.add(RigidBody::new(sphere(0.05)).with_pose(Pose::translation(x, 0.0, 0.0))).unwrap();
    }
    world.step().unwrap();
    assert_eq!(world.events().iter().map(|e| (e.kind, e.shape_a)).collect::<Vec<_>>(), [(EventKind::SensorBegin, 1)]);
    world.change_body(id, |body| body.set_shape_filter(0, Some(SENSOR))).unwrap();
    world.step().unwrap();
    assert_eq!(world.events().iter().map(|e| (e.kind, e.shape_a)).collect::<Vec<_>>(), [(EventKind::SensorBegin, 0)]);
}

/// Rays, overlaps, casts and depths find the shapes whose group and mask allow it, and no sensors.
#[test]
fn queries_honor_the_filters_of_shapes() {
    let mut world = world("time_stepping", 1.0 / 60.0);
    let own = ShapeFilter { group: group(3), mask: 1, sensor: false };
    let id = world.add(dumbbell().with_shape_filter(0, own).with_shape_filter(1, SENSOR)).unwrap();
    let ray = |x: f64| Ray { origin: Vec3::new(x, 0.0, 2.0), direction: -Vec3::z(), max_distance: f64::INFINITY };
    let all = QueryFilter::default();
    let hit = world.cast_ray(&ray(-0.5), &all).unwrap();
    assert_eq!((hit.id, hit.shape), (id, 0));
    assert!((hit.distance - 1.9).abs() < 1e-12);
    assert!(world.cast_ray(&ray(0.5), &all).is_none());
    let many: Vec<Ray> = [-0.5, 0.5].repeat(5).into_iter().map(ray).collect();
    let hits = world.cast_rays(&many, &all);
    assert!(hits.iter().enumerate().all(|(n, hit)| hit.is_some() == (n % 2 == 0)));
    let masked = QueryFilter { mask: !(1 << 3), ..QueryFilter::default() };
    assert!(world.cast_ray(&ray(-0.5), &masked).is_none());
    let grouped = QueryFilter { group: group(2), ..QueryFilter::default() };
    assert!(world.cast_ray(&ray(-0.5), &grouped).is_none());
    let found = |x: f64, filter: &QueryFilter| {
        let overlaps = world.overlaps(&sphere(0.15), &Pose::translation(x, 0.0, 0.0), filter).len();
        let cast = world.cast_shape(&sphere(0.05), &Pose::translation(x, 0.0, 1.0), &-Vec3::z(), 2.0, filter);
        (overlaps, cast.is_some(), world.contains(&Vec3::new(x, 0.0, 0.0), filter).len())
    };
    assert_eq!([found(-0.5, &all), found(0.5, &all)], [(1, true, 1), (0, false, 0)]);
    assert_eq!(found(-0.5, &masked), (0, false, 0));
    assert_eq!(world.point_depth(&Vec3::new(0.5, 0.0, 0.0), &all).unwrap().shape, 0);
}

/// A sensor between two solid parts is inside the bounds of what is found.
#[test]
fn closest_points_and_casts_do_not_find_a_sensor_between_solid_parts() {
    let mut world = world("time_stepping", 1.0 / 60.0);
    let at = |z: f64| CompoundPart::new(sphere(0.1), Pose::translation(0.0, 0.0, z));
    let balls = RigidBody::new(Shape::compound(vec![at(1.0), at(0.0), at(-1.0)]).unwrap()).with_mass(1.0);
    let id = world.add(balls.with_shape_filter(1, SENSOR)).unwrap();
    let (all, small, beside) = (QueryFilter::default(), sphere(0.05), Pose::translation(0.5, 0.0, 0.0));
    // the middle is at the height 0: the nearest solid parts are a meter above and below
    let found = world.closest_to_shape(&small, &beside, f64::INFINITY, &all).unwrap();
    assert!((found.distance - (1.25f64.sqrt() - 0.15)).abs() < 1e-12 && found.shapes[1] != 1, "{found:?}");
    let along = |direction: Vec3| world.cast_shape(&small, &beside, &direction, 9.0, &all);
    assert_eq!(along(-Vec3::x()), None);
    let hit = along(Vec3::new(-0.5, 0.0, 1.0)).unwrap();
    assert_eq!((hit.id, hit.shape), (id, 0));
}

/// Archives and forks have them; a filter of a shape that is not there is refused.
#[test]
fn filters_are_archived_and_checked() {
    let mut world = world("time_stepping", 1.0 / 60.0);
    let own = ShapeFilter { group: group(3), mask: 0b10, sensor: true };
    let id = world.add(dumbbell().with_shape_filter(1, own)).unwrap();
    let read = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    assert_eq!(read.get::<RigidBody>(read.ids()[0]).unwrap().shape_filters(), [(1, own)]);
    assert_eq!(world.fork().get::<RigidBody>(id).unwrap().shape_filter(1), own);
    let why = dumbbell().with_shape_filter(2, own).validate().unwrap_err().to_string();
    assert!(why.contains("below the number of parts"), "{why}");
    let why = dumbbell().with_shape_filter(1, own).with_one_way(Vec3::z()).validate().unwrap_err().to_string();
    assert!(why.contains("one-sided"), "{why}");
    assert!(RigidBody::new(cube(1.0)).with_shape_filter(0, own).validate().is_err());
}
