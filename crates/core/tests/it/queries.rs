//! Queries of a world against brute force over its bodies, and against closed forms.

use tumble_core::collide::{Pose, Quat, Shape, TreeSettings, TriMesh, Vec3, closest_points, contacts};
use tumble_core::*;

/// A generator of random numbers (splitmix64).
struct Rng(u64);

impl Rng {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn vector(&mut self, half: f64) -> Vec3 {
        Vec3::new(2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0) * half
    }

    fn pose(&mut self, half: f64) -> Pose {
        Pose::from_parts(self.vector(half).into(), Quat::from_scaled_axis(self.vector(3.0)))
    }
}

fn shapes() -> Vec<Shape> {
    let mesh = |mesh| Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
    vec![
        Shape::sphere(0.4).unwrap(),
        Shape::cuboid(Vec3::new(0.5, 0.9, 0.7)).unwrap(),
        Shape::capsule(0.2, 0.8).unwrap(),
        Shape::cylinder(0.3, 0.8).unwrap(),
        mesh(TriMesh::torus(0.5, 0.15, 20, 10)),
    ]
}

/// Returns a world of many bodies above a floor, and what each one is.
fn crowd(count: usize) -> (World, Vec<(ObjectId, Shape, Pose)>) {
    let (mut world, mut rng, shapes) = (World::default(), Rng(3), shapes());
    let mut all = Vec::new();
    for k in 0..count {
        let (shape, pose) = (shapes[k % shapes.len()].clone(), rng.pose(6.0));
        let id = world.add(RigidBody::new(shape.clone()).with_pose(pose)).unwrap();
        all.push((id, shape, pose));
    }
    let pose = Pose::translation(0.0, 0.0, -6.5);
    let id = world.add(RigidBody::fixed(Shape::half_space()).with_pose(pose)).unwrap();
    all.push((id, Shape::half_space(), pose));
    // the frame of a part is at the center of mass
    for (id, _, pose) in &mut all {
        *pose = world.part_state(*id, 0).unwrap().pose;
    }
    (world, all)
}

#[test]
fn rays_hit_what_the_nearest_of_all_bodies_is() {
    let (mut world, all) = crowd(300);
    let mut rng = Rng(5);
    let rays: Vec<Ray> = (0..10_000)
        .map(|k| Ray {
            origin: rng.vector(8.0),
            direction: if k % 7 == 0 { -Vec3::z() } else { rng.vector(2.0) },
            max_distance: if k % 3 == 0 { 5.0 * rng.unit() } else { f64::INFINITY },
        })
        .collect();
    let filter = QueryFilter::default();
    let hits = world.cast_rays(&rays, &filter);
    let mut met = 0;
    for (ray, hit) in rays.iter().zip(&hits) {
        let mut wanted: Option<RayCastHit> = None;
        for (id, shape, pose) in &all {
            let found = shape.cast_ray(pose, &ray.origin, &ray.direction, ray.max_distance);
            if let Some(found) = found.filter(|f| wanted.is_none_or(|w| f.distance < w.distance)) {
                let (distance, normal, face) = (found.distance, found.normal, found.face);
                wanted = Some(RayCastHit { id: *id, part: 0, shape: 0, distance, normal, face });
            }
        }
        // the direction is normalized twice in one of them
        let same = |a: &RayCastHit, b: &RayCastHit| {
            a.id == b.id
                && a.face == b.face
                && (a.distance - b.distance).abs() < 1e-12
                && (a.normal - b.normal).norm() < 1e-12
        };
        assert!(
            hit.zip(wanted).is_some_and(|(a, b)| same(&a, &b)) || (hit.is_none() && wanted.is_none()),
            "{ray:?}: {hit:?} instead of {wanted:?}"
        );
        met += usize::from(hit.is_some());
    }
    assert!(met > 4000, "{met} hits");
    for ray in rays.iter().step_by(97) {
        let at = rays.iter().position(|other| other == ray).unwrap();
        assert_eq!(world.cast_ray(ray, &filter), hits[at], "one by one, without a tree");
    }
    let threads = world.settings().with_threads(3);
    world.set_settings(threads).unwrap();
    assert_eq!(world.cast_rays(&rays, &filter), hits, "on three threads");
}

#[test]
fn rays_without_sense_meet_nothing() {
    let (world, _) = crowd(10);
    let ray = |origin: f64, direction: f64, max_distance| Ray {
        origin: Vec3::repeat(origin),
        direction: Vec3::repeat(direction),
        max_distance,
    };
    let odd = [
        ray(0.0, 0.0, 9.0),
        ray(f64::NAN, -1.0, 9.0),
        ray(9.0, f64::NAN, 9.0),
        ray(9.0, -1.0, f64::NAN),
        ray(9.0, -1.0, -1.0),
    ];
    assert!(world.cast_rays(&odd, &QueryFilter::default()).iter().all(Option::is_none));
    assert!(world.cast_rays(&[], &QueryFilter::default()).is_empty());
}

#[test]
fn overlaps_are_those_of_all_contacts() {
    let (world, all) = crowd(200);
    let (mut rng, shapes, mut met) = (Rng(6), shapes(), 0);
    for case in 0..10_000 {
        let (shape, pose) = (&shapes[case % shapes.len()], rng.pose(6.5));
        let found = world.overlaps(shape, &pose, &QueryFilter::default());
        // 50 of the bodies are the reference
        for (id, other, at) in all.iter().skip(case % 4).step_by(4) {
            let mut list = Vec::new();
            contacts(shape, &pose, other, at, 0.0, &mut list);
            let depth = list.iter().map(|c| -c.gap).fold(0.0, f64::max);
            let ours = found.iter().find(|f| f.id == *id).map_or(0.0, |f| f.depth);
            assert_eq!(ours, depth, "case {case}");
            met += usize::from(depth > 0.0);
        }
    }
    assert!(met > 500, "{met} overlaps");
}

#[test]
fn the_nearest_body_of_a_shape_is_the_nearest_of_all() {
    let (world, all) = crowd(60);
    let (mut rng, shapes) = (Rng(7), shapes());
    for case in 0..10_000 {
        let (shape, pose) = (&shapes[case % shapes.len()], rng.pose(7.0));
        let found = world.closest_to_shape(shape, &pose, f64::INFINITY, &QueryFilter::default()).unwrap();
        let least = all.iter().filter_map(|(_, other, at)| closest_points(shape, &pose, other, at));
        let least = least.map(|pair| pair.distance).fold(f64::INFINITY, f64::min);
        assert!((found.distance - least).abs() < 1e-9, "case {case}: {} instead of {least}", found.distance);
        let below = world.closest_to_shape(shape, &pose, found.distance - 1e-9, &QueryFilter::default());
        assert_eq!(below, None, "further than asked for");
    }
    let (a, b) = (all[0].0, all[1].0);
    let pair = closest_points(&all[0].1, &all[0].2, &all[1].1, &all[1].2).unwrap();
    let found = world.closest_points(a, b).unwrap().unwrap();
    assert_eq!((found.distance, found.points, found.normal), (pair.distance, pair.points, pair.normal));
    assert_eq!((found.a, found.b), (Some((a, 0)), (b, 0)));
}

#[test]
fn points_are_as_deep_as_in_the_deepest_of_all_bodies() {
    let (world, all) = crowd(300);
    let (mut rng, mut inside) = (Rng(8), 0);
    for case in 0..10_000 {
        let point = rng.vector(7.0);
        let depths: Vec<f64> = all.iter().map(|(_, shape, at)| -shape.closest_point(at, &point).distance).collect();
        let found = world.point_depth(&point, &QueryFilter::default()).unwrap();
        let deepest = depths.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert_eq!(found.depth, deepest, "case {case}");
        assert!((point - found.point + found.normal * found.depth).norm() < 1e-12);
        let wanted: Vec<ObjectId> = (0..all.len()).filter(|&k| depths[k] >= 0.0).map(|k| all[k].0).collect();
        let ids: Vec<ObjectId> = world.contains(&point, &QueryFilter::default()).iter().map(|(id, _)| *id).collect();
        assert_eq!(ids, wanted, "case {case}");
        inside += wanted.len();
    }
    assert!(inside > 500, "{inside}");
    let empty = World::default();
    assert_eq!(empty.point_depth(&Vec3::zeros(), &QueryFilter::default()), None);
}

/// A sphere that is cast meets what a ray meets whose targets are larger by its radius; in general
/// the shape touches at the distance of the hit and overlaps nothing before.
#[test]
fn a_cast_shape_touches_where_it_stops_and_nothing_before_full_length() {
    let (world, all) = crowd(60);
    let (mut rng, shapes, filter, mut met) = (Rng(9), shapes(), QueryFilter::default(), 0);
    // a minute at full length
    let cases = if std::env::var_os("TUMBLE_SLOW").is_some() { 10_000 } else { 2000 };
    for case in 0..cases {
        let (shape, pose) = (&shapes[case % shapes.len()], rng.pose(9.0));
        let direction = (rng.vector(3.0) - pose.translation.vector).normalize();
        let moved = |t: f64| nalgebra::Translation3::from(direction * t) * pose;
        let distance = |t: f64| world.closest_to_shape(shape, &moved(t), f64::INFINITY, &filter).unwrap().distance;
        let Some(hit) = world.cast_shape(shape, &pose, &direction, 20.0, &filter) else {
            // only a touch by less than a thousandth of the way could be missing
            assert!((0..200).all(|k| distance(0.1 * f64::from(k)) > 0.0), "case {case} meets something");
            continue;
        };
        met += 1;
        let there = distance(hit.distance);
        // what passes a ring closely counts as touching
        let ring = case % 5 == 4 || all.iter().position(|(id, _, _)| *id == hit.id).unwrap() % 5 == 4;
        let gap = if ring { 2e-2 } else { 1e-8 };
        assert!(if hit.distance == 0.0 { there < 1e-8 } else { there > -1e-8 && there < gap }, "case {case}: {there}");
        let before = (0..20).map(|k| hit.distance * f64::from(k) / 20.0);
        assert!(hit.distance == 0.0 || before.clone().all(|t| distance(t) > 0.0), "case {case} overlaps on the way");
        if case % 5 == 0 && hit.distance > 0.0 {
            // a sphere on a sphere, box, capsule or plane: exact
            let id = all.iter().position(|(id, _, _)| *id == hit.id).unwrap();
            if id % 5 < 3 {
                let gap = closest_points(shape, &moved(hit.distance), &all[id].1, &all[id].2).unwrap().distance;
                assert!(gap.abs() < 1e-8, "case {case}: a gap of {gap}");
            }
        }
    }
    assert!(met > 1000, "{met}");
    // closed form: a sphere of 0.5 m falls on the edge of a step
    let mut world = World::default();
    let step = Shape::cuboid(Vec3::repeat(2.0)).unwrap();
    world.add_static(RigidBody::fixed(step)).unwrap();
    let ball = Shape::sphere(0.5).unwrap();
    let start = Pose::translation(1.3, 0.0, 5.0);
    let hit = world.cast_shape(&ball, &start, &-Vec3::z(), 10.0, &filter).unwrap();
    assert!((hit.distance - (4.0 - (0.25f64 - 0.09).sqrt())).abs() < 1e-8, "{}", hit.distance);
    assert!(
        (hit.normal - Vec3::new(0.6, 0.0, 0.8)).norm() < 1e-6 && (hit.point - Vec3::new(1.0, 0.0, 1.0)).norm() < 1e-8
    );
}

#[test]
fn queries_obey_groups_masks_and_switches() {
    let mut world = World::default();
    let ball = |height: f64, group: u8, mask: u64| {
        let mut body = RigidBody::new(Shape::sphere(0.5).unwrap()).with_pose(Pose::translation(0.0, 0.0, height));
        (body.group, body.mask) = (CollisionGroup::new(group).unwrap(), mask);
        body
    };
    let high = world.add(ball(6.0, 1, u64::MAX)).unwrap();
    let middle = world.add(ball(4.0, 2, !0b1)).unwrap();
    let low = world.add(ball(2.0, 3, u64::MAX)).unwrap();
    let ray = Ray { origin: Vec3::new(0.0, 0.0, 9.0), direction: -Vec3::z(), max_distance: 100.0 };
    let hit = |world: &World, filter: &QueryFilter| world.cast_ray(&ray, filter).map(|hit| (hit.id, hit.distance));
    let all = QueryFilter::default();
    assert_eq!(hit(&world, &all), Some((high, 2.5)));
    let without = all.clone().ignoring(high);
    assert_eq!(hit(&world, &without), Some((low, 6.5)), "the middle one does not collide with group 0");
    let other = QueryFilter { group: CollisionGroup::new(5).unwrap(), mask: 0b100, ..all.clone() };
    assert_eq!(hit(&world, &other), Some((middle, 4.5)), "group 5 finds group 2 alone");
    world.set_collidable(high, false).unwrap();
    assert_eq!(hit(&world, &all), Some((low, 6.5)), "what does not collide is not found");
    world.set_collidable(high, true).unwrap();
    world.set_enabled(high, false).unwrap();
    assert_eq!(hit(&world, &all), Some((low, 6.5)), "what is disabled is not found");
    assert_eq!(world.contains(&Vec3::new(0.0, 0.0, 6.0), &all), vec![]);
    assert_eq!(world.contains(&Vec3::new(0.0, 0.0, 2.0), &all), vec![(low, 0)]);
    world.remove(high).unwrap();
    assert!(world.closest_points(high, low).is_err());
    assert_eq!(world.closest_points(middle, low).unwrap().unwrap().distance, 1.0);
}
