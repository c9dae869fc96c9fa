//! The shape that a query or a contact names: the part of a compound, against the same parts as bodies of their own.

use tumble_core::collide::{CompoundPart, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::prelude::*;
use tumble_core::{ObjectId, QueryFilter, Ray};

/// A generator of random numbers (xorshift).
struct Rng(u64);

impl Rng {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn vector(&mut self, half: f64) -> Vec3 {
        Vec3::new(2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0) * half
    }

    fn pose(&mut self, half: f64) -> Pose {
        Pose::from_parts(self.vector(half).into(), Quat::from_scaled_axis(self.vector(3.0)))
    }
}

/// Number of parts.
const PARTS: usize = 30;

/// Returns a world with a compound of 30 shapes that may overlap, and a world in which each is a body; the id of the
/// compound and those of the bodies.
fn worlds(seed: u64) -> (World, ObjectId, World, Vec<ObjectId>) {
    let mut rng = Rng(seed);
    let mesh = Shape::mesh(TriMesh::torus(0.5, 0.15, 20, 10), &TreeSettings::octree()).unwrap();
    let shapes = [
        Shape::sphere(0.4).unwrap(),
        Shape::cuboid(Vec3::new(0.5, 0.9, 0.7)).unwrap(),
        Shape::capsule(0.2, 0.8).unwrap(),
        Shape::cylinder(0.3, 0.8).unwrap(),
        mesh,
    ];
    let parts: Vec<(Shape, Pose)> = (0..PARTS).map(|k| (shapes[k % shapes.len()].clone(), rng.pose(3.0))).collect();
    let frame = rng.pose(2.0);
    let compound = parts.iter().map(|(shape, pose)| CompoundPart::new(shape.clone(), *pose)).collect();
    let (mut one, mut many) = (World::default(), World::default());
    let id = one.add(RigidBody::new(Shape::compound(compound).unwrap()).with_pose(frame)).unwrap();
    let add = |(shape, pose): &(Shape, Pose)| many.add(RigidBody::new(shape.clone()).with_pose(frame * pose)).unwrap();
    let ids = parts.iter().map(add).collect();
    (one, id, many, ids)
}

#[test]
fn a_ray_names_the_part_of_a_compound_and_its_face() {
    let filter = QueryFilter::default();
    let mut met = 0;
    for seed in 1..=3 {
        let (one, id, many, ids) = worlds(seed);
        let mut rng = Rng(seed + 10);
        let rays: Vec<Ray> = (0..6000)
            .map(|_| {
                // from outside of all parts, where the first part is that which the ray enters
                let origin = rng.vector(1.0).normalize() * 12.0;
                Ray { origin, direction: rng.vector(4.0) - origin, max_distance: f64::INFINITY }
            })
            .collect();
        let (found, wanted) = (one.cast_rays(&rays, &filter), many.cast_rays(&rays, &filter));
        for (ray, (found, wanted)) in rays.iter().zip(found.iter().zip(&wanted)) {
            assert_eq!(found.is_some(), wanted.is_some(), "{ray:?}");
            let (Some(found), Some(wanted)) = (found, wanted) else { continue };
            assert_eq!((found.id, ids[found.shape], found.face), (id, wanted.id, wanted.face), "{ray:?}");
            assert!((found.distance - wanted.distance).abs() < 1e-9 && (found.normal - wanted.normal).norm() < 1e-9);
            assert_eq!((found.part, wanted.shape), (0, 0));
            met += 1;
        }
    }
    assert!(met > 3000, "{met} hits");
}

#[test]
fn distances_overlaps_and_casts_name_the_part() {
    let (filter, ball) = (QueryFilter::default(), Shape::sphere(0.15).unwrap());
    let mut seen = [0; 4];
    for seed in 1..=3 {
        let (one, _, many, ids) = worlds(seed);
        let mut rng = Rng(seed + 20);
        for _ in 0..300 {
            let at = Pose::from_parts(rng.vector(3.5).into(), Quat::identity());
            let point = at.translation.vector;
            let (found, wanted) =
                (one.point_depth(&point, &filter).unwrap(), many.point_depth(&point, &filter).unwrap());
            assert_eq!(ids[found.shape], wanted.id);
            assert!((found.depth - wanted.depth).abs() < 1e-9);
            seen[0] += 1;
            let wanted = many.closest_to_shape(&ball, &at, f64::INFINITY, &filter).unwrap();
            if wanted.distance > 0.0 {
                let found = one.closest_to_shape(&ball, &at, f64::INFINITY, &filter).unwrap();
                assert_eq!(ids[found.shapes[1]], wanted.b.0);
                assert!((found.distance - wanted.distance).abs() < 1e-6);
                seen[1] += 1;
                let cast = |world: &World| world.cast_shape(&ball, &at, &-point, point.norm(), &filter);
                if let (Some(found), Some(wanted)) = (cast(&one), cast(&many)) {
                    assert!((found.distance - wanted.distance).abs() < 1e-3);
                    // two parts at the distance of the touch leave the choice to rounding
                    let rest = QueryFilter::default().ignoring(wanted.id);
                    let touch =
                        Pose::from_parts((point - point.normalize() * wanted.distance).into(), Quat::identity());
                    let next = many.closest_to_shape(&ball, &touch, f64::INFINITY, &rest).unwrap();
                    if next.distance > 1e-3 {
                        assert_eq!(ids[found.shape], wanted.id);
                        seen[3] += 1;
                    }
                }
            } else if let [only] = many.overlaps(&ball, &at, &filter).as_slice() {
                let found = one.overlaps(&ball, &at, &filter);
                assert_eq!(found.len(), 1);
                assert_eq!(ids[found[0].shape], only.id);
                seen[2] += 1;
            }
        }
    }
    assert!(seen.iter().zip([900, 400, 25, 100]).all(|(seen, least)| *seen >= least), "{seen:?}");
}

#[test]
fn a_contact_names_the_parts_of_both_compounds() {
    // a table of four legs, each leg on one of four posts in reverse order
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let mut table = vec![CompoundPart::new(Shape::cuboid(Vec3::new(2.4, 2.4, 0.1)).unwrap(), Pose::identity())];
    let leg = |&(x, y): &(f64, f64)| CompoundPart::new(Shape::sphere(0.1).unwrap(), Pose::translation(x, y, -0.5));
    table.extend(corners.iter().map(leg));
    let post = |&(x, y): &(f64, f64)| {
        CompoundPart::new(Shape::cuboid(Vec3::new(0.5, 0.5, 0.5)).unwrap(), Pose::translation(x, y, -0.85))
    };
    let posts = corners.iter().rev().map(post).collect();
    let mut world = World::default();
    let posts = world.add_static(RigidBody::fixed(Shape::compound(posts).unwrap())).unwrap();
    let table = world.add(RigidBody::new(Shape::compound(table).unwrap())).unwrap();
    for _ in 0..100 {
        world.step().unwrap();
    }
    let mut legs = Vec::new();
    for contact in world.contacts() {
        assert_eq!((contact.a, contact.b), (posts, table));
        assert_eq!(contact.shape_a, 4 - contact.shape_b, "leg {} on post {}", contact.shape_b, contact.shape_a);
        legs.push(contact.shape_b);
    }
    legs.sort_unstable();
    assert_eq!(legs, [1, 2, 3, 4]);
    let copy = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    let names = |world: &World| world.contacts().iter().map(|c| (c.shape_a, c.shape_b)).collect::<Vec<_>>();
    assert_eq!(names(&copy), names(&world));
}
