//! Distances: points against parry and brute force, pairs of shapes against parry.

use crate::against_parry::{to_parry, vector};
use crate::rng::Rng;
use parry3d_f64::query;
use parry3d_f64::shape::{
    Ball, Capsule, ConvexPolyhedron, Cuboid, HalfSpace, Shape as ParryShape, TriMesh as ParryMesh,
};
use tumble_collide::{Pose, Shape, TreeSettings, TriMesh, Vec3, closest_points};

struct Both {
    name: &'static str,
    ours: Shape,
    theirs: Box<dyn ParryShape>,
}

fn mesh(name: &'static str, mesh: TriMesh) -> Both {
    let ours = Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
    let Shape::Mesh(shape) = &ours else { panic!("no mesh") };
    let vertices = shape.mesh().vertices.iter().map(vector).collect();
    let theirs = Box::new(ParryMesh::new(vertices, shape.mesh().triangles.clone()).unwrap());
    Both { name, ours, theirs }
}

fn all() -> Vec<Both> {
    let prism = TriMesh::cylinder(0.3, 0.8, 1440);
    let prism = ConvexPolyhedron::from_convex_hull(&prism.vertices.iter().map(vector).collect::<Vec<_>>()).unwrap();
    let both = |name, ours, theirs: Box<dyn ParryShape>| Both { name, ours, theirs };
    vec![
        both("half-space", Shape::half_space(), Box::new(HalfSpace::new(parry3d_f64::math::Vector::Z))),
        both("sphere", Shape::sphere(0.4).unwrap(), Box::new(Ball::new(0.4))),
        both("capsule", Shape::capsule(0.2, 0.8).unwrap(), Box::new(Capsule::new_z(0.4, 0.2))),
        both(
            "box",
            Shape::cuboid(Vec3::new(0.6, 0.8, 0.4)).unwrap(),
            Box::new(Cuboid::new(vector(&Vec3::new(0.3, 0.4, 0.2)))),
        ),
        // a prism of 1440 sides, since parry's cylinder lies along y: 7e-7 m inside
        both("cylinder", Shape::cylinder(0.3, 0.8).unwrap(), Box::new(prism)),
        mesh("ring", TriMesh::torus(0.5, 0.15, 24, 12)),
        mesh("block", TriMesh::cuboid(Vec3::new(0.5, 0.3, 0.7))),
    ]
}

#[test]
fn the_closest_points_of_surfaces_agree_with_parry() {
    let mut rng = Rng::new(11);
    for Both { name, ours, theirs } in all() {
        for _ in 0..10_000 {
            let (pose, point) = (rng.pose(0.5), 1.2 * rng.direction() * rng.unit());
            let found = ours.closest_point(&pose, &point);
            let wanted = theirs.project_point(&to_parry(&pose), vector(&point), false);
            let distance = (Vec3::new(wanted.point.x, wanted.point.y, wanted.point.z) - point).norm();
            let meshes = name == "ring" || name == "block";
            // parry does not determine the inside of a mesh, and its iteration ends at about 1e-6
            let close = if name == "cylinder" { 4e-6 } else { 1e-9 };
            assert!(
                (found.distance.abs() - distance).abs() < close,
                "{name}: {} here, {distance} there",
                found.distance
            );
            assert!(meshes || (found.distance < 0.0) == wanted.is_inside || distance < close, "{name}");
            assert!(((found.point - point).norm() - found.distance.abs()).abs() < 1e-12, "{name}: point");
            assert!((point - found.point - found.normal * found.distance).norm() < 1e-12, "{name}: normal");
        }
    }
}

#[test]
fn the_inside_of_a_mesh_is_that_of_its_solid() {
    let mut rng = Rng::new(12);
    let ring = Shape::mesh(TriMesh::torus(0.5, 0.15, 96, 48), &TreeSettings::octree()).unwrap();
    let mut inside = 0;
    for _ in 0..10_000 {
        let p = 0.8 * rng.direction() * rng.unit();
        let distance = (p.xy().norm() - 0.5).hypot(p.z) - 0.15;
        if distance.abs() > 2e-3 {
            assert_eq!(ring.closest_point(&Pose::identity(), &p).distance < 0.0, distance < 0.0);
            inside += usize::from(distance < 0.0);
        }
    }
    assert!(inside > 500, "{inside}");
}

#[test]
fn the_distances_of_shapes_agree_with_parry() {
    let mut rng = Rng::new(13);
    let all = all();
    let (mut apart, mut worst) = (0, (0.0f64, String::new()));
    for case in 0..10_000 {
        let [a, b] = [&all[case % 7], &all[(case / 7) % 7]];
        let [pose_a, pose_b] = [rng.pose(1.5), rng.pose(1.5)];
        let found = closest_points(&a.ours, &pose_a, &b.ours, &pose_b);
        if a.name == "half-space" && b.name == "half-space" {
            assert_eq!(found, None);
            continue;
        }
        let found = found.unwrap();
        let Ok(wanted) = query::distance(&to_parry(&pose_a), &*a.theirs, &to_parry(&pose_b), &*b.theirs) else {
            continue;
        };
        let wanted = wanted.distance;
        if wanted > 1e-3 {
            apart += 1;
            let between = found.points[0] - found.points[1];
            assert!((between - found.normal * found.distance).norm() < 1e-9, "{} and {}", a.name, b.name);
            let error = (found.distance - wanted).abs();
            if error > worst.0 {
                worst = (error, format!("{} and {}: {} here, {wanted} there", a.name, b.name, found.distance));
            }
            for (shape, pose, p) in [(a, &pose_a, found.points[0]), (b, &pose_b, found.points[1])] {
                assert!(shape.ours.closest_point(pose, &p).distance.abs() < 1e-6, "{} and {}", a.name, b.name);
            }
        } else if wanted == 0.0 && !format!("{} {}", a.name, b.name).contains("ring") {
            assert!(found.distance < 1e-6, "{} and {} overlap: {}", a.name, b.name, found.distance);
        }
    }
    assert!(apart > 2000, "{apart}");
    assert!(worst.0 < 2e-5, "{worst:?}");
}
