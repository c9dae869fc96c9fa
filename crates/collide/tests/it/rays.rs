//! Rays against shapes: closed forms, and every shape against parry.

use crate::rng::Rng;
use parry3d_f64::math::{Pose as ParryPose, Vector};
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::{Ball, Capsule, Cuboid, Cylinder};
use tumble_collide::{Aabb, BoxTree, Pose, Shape, TreeSettings, TriMesh, Vec3};

/// Returns the distance at which a ray of any length enters a shape.
fn ray(shape: &Shape, pose: &Pose, origin: &Vec3, direction: &Vec3) -> Option<f64> {
    shape.cast_ray(pose, origin, direction, f64::INFINITY).map(|hit| hit.distance)
}

#[test]
fn a_ray_enters_where_geometry_says() {
    let at = Pose::translation(0.0, 0.0, 2.0);
    let down = Vec3::new(0.0, 0.0, -3.0);
    let sphere = Shape::sphere(0.5).unwrap();
    assert_eq!(
        ray(&sphere, &at, &Vec3::new(0.0, 0.0, 10.0), &down),
        Some(7.5),
        "10 - 2 - 0.5, whatever the length of the direction"
    );
    assert_eq!(ray(&sphere, &at, &Vec3::new(0.0, 0.0, 2.1), &down), None, "from inside");
    assert_eq!(ray(&sphere, &at, &Vec3::new(0.0, 0.0, 1.0), &down), None, "behind");
    assert_eq!(ray(&sphere, &at, &Vec3::new(0.6, 0.0, 10.0), &down), None, "beside");
    let floor = Shape::half_space();
    let slanted = Vec3::new(3.0, 0.0, -4.0);
    assert!(
        (ray(&floor, &at, &Vec3::new(0.0, 0.0, 6.0), &slanted).unwrap() - 5.0).abs() < 1e-15,
        "a right triangle of 3, 4 and 5"
    );
    assert_eq!(ray(&floor, &at, &Vec3::new(0.0, 0.0, 1.0), &slanted), None, "from below");
    assert_eq!(ray(&floor, &at, &Vec3::new(0.0, 0.0, 6.0), &Vec3::zeros()), None, "no direction");
}

#[test]
fn rays_agree_with_parry() {
    let mut rng = Rng::new(5);
    let half = Vec3::new(0.3, 0.5, 0.7);
    let sharp = TriMesh::cuboid(2.0 * half);
    let cases: [(Shape, Box<dyn RayCast>); 5] = [
        (Shape::sphere(0.6).unwrap(), Box::new(Ball::new(0.6))),
        (Shape::cuboid(2.0 * half).unwrap(), Box::new(Cuboid::new(Vector::new(0.3, 0.5, 0.7)))),
        (
            Shape::capsule(0.3, 1.2).unwrap(),
            Box::new(Capsule::new(Vector::new(0.0, 0.0, -0.6), Vector::new(0.0, 0.0, 0.6), 0.3)),
        ),
        // parry's stands on y
        (Shape::cylinder(0.4, 1.0).unwrap(), Box::new(Cylinder::new(0.5, 0.4))),
        (Shape::mesh(sharp, &TreeSettings::octree()).unwrap(), Box::new(Cuboid::new(Vector::new(0.3, 0.5, 0.7)))),
    ];
    for (index, (shape, theirs)) in cases.iter().enumerate() {
        let mut met = 0;
        for _ in 0..10_000 {
            let mut vector =
                |size: f64| Vec3::new(rng.between(-size, size), rng.between(-size, size), rng.between(-size, size));
            let (origin, aim) = (vector(3.0), vector(0.8));
            if origin.norm() < 1.0 {
                continue;
            }
            let direction = (aim - origin).normalize();
            let turned = |v: Vec3| if index == 3 { Vector::new(v.x, v.z, -v.y) } else { Vector::new(v.x, v.y, v.z) };
            let wanted =
                theirs.cast_ray(&ParryPose::IDENTITY, &Ray::new(turned(origin), turned(direction)), f64::MAX, true);
            let found = ray(shape, &Pose::identity(), &origin, &direction);
            met += usize::from(found.is_some());
            match (found, wanted) {
                // its cylinders are iterated
                (Some(a), Some(b)) => {
                    assert!((a - b).abs() < if index == 3 { 1e-6 } else { 1e-9 }, "shape {index}: {a} here, {b} there")
                }
                (None, None) => {}
                other => panic!("shape {index} from {origin:?} along {direction:?}: {other:?}"),
            }
        }
        assert!(met > 1000, "shape {index} was met {met} times");
    }
}

/// Normals are gradients of the signed distance, faces are those whose plane the point lies on.
#[test]
fn hits_have_the_normal_and_the_face_of_the_surface() {
    let mut rng = Rng::new(6);
    let half = Vec3::new(0.3, 0.5, 0.7);
    let shapes = [
        Shape::sphere(0.6).unwrap(),
        Shape::cuboid(2.0 * half).unwrap(),
        Shape::capsule(0.3, 1.2).unwrap(),
        Shape::cylinder(0.4, 1.0).unwrap(),
        Shape::mesh(TriMesh::torus(0.6, 0.2, 24, 12), &TreeSettings::octree()).unwrap(),
    ];
    for (index, shape) in shapes.iter().enumerate() {
        let mut met = 0;
        for _ in 0..10_000 {
            let pose = rng.pose(1.0);
            let origin = pose.translation.vector + 3.0 * rng.direction();
            let direction = pose.translation.vector + rng.direction() * 0.7 - origin;
            let Some(hit) = shape.cast_ray(&pose, &origin, &direction, f64::INFINITY) else { continue };
            met += 1;
            let p = origin + direction.normalize() * hit.distance;
            assert!(
                shape.closest_point(&pose, &p).distance.abs() < 1e-12,
                "shape {index}: the point is on the surface"
            );
            assert!((hit.normal.norm() - 1.0).abs() < 1e-12 && hit.normal.dot(&direction) <= 1e-12);
            let above = shape.closest_point(&pose, &(p + 1e-6 * hit.normal));
            assert!((above.distance - 1e-6).abs() < 1e-11, "shape {index}: {} above", above.distance);
            let local = pose.inverse_transform_point(&p.into()).coords;
            let out = pose.rotation.inverse() * hit.normal;
            match shape {
                Shape::Box { .. } => {
                    let (axis, upper) = ((hit.face / 2) as usize, hit.face % 2 == 1);
                    assert!((local[axis] - if upper { half[axis] } else { -half[axis] }).abs() < 1e-12);
                }
                Shape::Cylinder(_) => {
                    let wanted = if out.z < -0.5 {
                        1
                    } else if out.z > 0.5 {
                        2
                    } else {
                        0
                    };
                    assert_eq!(hit.face, wanted);
                }
                Shape::Mesh(mesh) => {
                    let [a, b, c] = mesh.mesh().corners(hit.face as usize);
                    let n = (b - a).cross(&(c - a)).normalize();
                    assert!((n - out).norm() < 1e-12 && n.dot(&(local - a)).abs() < 1e-12);
                }
                _ => assert_eq!(hit.face, 0),
            }
            assert!(shape.cast_ray(&pose, &origin, &direction, hit.distance * (1.0 - 1e-9)).is_none(), "too short");
        }
        assert!(met > 2000, "shape {index} was met {met} times");
    }
}

/// Every triangle by itself is the reference of the tree; the bits are the same.
#[test]
fn rays_on_meshes_are_those_of_all_triangles() {
    let mut rng = Rng::new(7);
    for mesh in
        [TriMesh::torus(0.6, 0.2, 40, 20), TriMesh::icosphere(0.7, 3), TriMesh::cuboid(Vec3::new(1.0, 1e-3, 0.2))]
    {
        let shape = Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
        let Shape::Mesh(data) = &shape else { panic!("no mesh") };
        let mesh = data.mesh();
        let mut met = 0;
        for case in 0..10_000 {
            // along the axes too, from near and far, and through vertices and edges
            let target = match case % 4 {
                0 => mesh.vertices[case % mesh.vertices.len()],
                1 => {
                    0.5 * (mesh.corners(case % mesh.triangles.len())[0] + mesh.corners(case % mesh.triangles.len())[1])
                }
                _ => 0.8 * rng.direction(),
            };
            let toward = if case % 8 < 4 { rng.direction() } else { Vec3::ith(case % 3, 1.0) };
            let origin = target - toward * rng.between(0.0, if case % 16 == 3 { 1e6 } else { 3.0 });
            let hit = shape.cast_ray(&Pose::identity(), &origin, &toward, f64::INFINITY);
            let single = |t: usize| {
                let one = TriMesh { vertices: mesh.corners(t).to_vec(), triangles: vec![[0, 1, 2]] };
                let [a, b, c] = mesh.corners(t);
                let front = (b - a).cross(&(c - a)).dot(&toward) < 0.0;
                one.ray(&Pose::identity(), &origin, &toward).filter(|_| front)
            };
            let wanted = (0..mesh.triangles.len()).filter_map(single).min_by(f64::total_cmp);
            assert_eq!(hit.map(|hit| hit.distance), wanted, "case {case} from {origin:?} along {toward:?}");
            met += usize::from(hit.is_some());
        }
        assert!(met > 3000, "{met} hits");
    }
}

/// A ray at a vertex or an edge of a closed mesh from outside meets it: there are no gaps.
#[test]
fn no_ray_passes_between_two_triangles() {
    let mut rng = Rng::new(8);
    let shape = Shape::mesh(TriMesh::icosphere(1.0, 3), &TreeSettings::octree()).unwrap();
    let Shape::Mesh(data) = &shape else { panic!("no mesh") };
    for case in 0..10_000 {
        let corners = data.mesh().corners(case % data.mesh().triangles.len());
        let weight = rng.unit();
        let target = corners[0] * weight + corners[1] * (1.0 - weight);
        let origin = 3.0 * rng.direction();
        // inside the sphere of the inscribed radius on the way: it must be met
        let hit = shape.cast_ray(&Pose::identity(), &origin, &(0.9 * target - origin), f64::INFINITY);
        assert!(hit.is_some_and(|hit| hit.distance < (0.9 * target - origin).norm()), "case {case}");
    }
}

/// The boxes of the tree that a ray meets are those of a search over all boxes.
#[test]
fn a_tree_of_boxes_visits_every_box_on_the_way() {
    let mut rng = Rng::new(9);
    let boxes: Vec<Aabb> = (0..2000)
        .map(|k| {
            let center = 10.0 * Vec3::new(rng.unit(), rng.unit(), if k % 3 == 0 { 0.0 } else { rng.unit() });
            let half = Vec3::new(rng.unit(), rng.unit(), rng.unit()) * if k % 5 == 0 { 0.0 } else { 0.3 };
            Aabb { min: center - half, max: center + half }
        })
        .collect();
    let tree = BoxTree::new(&boxes);
    for case in 0..10_000 {
        let target = 0.5 * (boxes[case % 2000].min + boxes[case % 2000].max);
        let direction = if case % 2 == 0 { rng.direction() } else { Vec3::ith(case % 3, -1.0) };
        let origin = target - direction * rng.between(0.0, 20.0);
        let max = rng.between(0.0, 30.0);
        let mut visited = vec![false; boxes.len()];
        tree.visit_along(&origin, &direction, &mut max.clone(), |slot, _| visited[tree.order()[slot] as usize] = true);
        for (k, b) in boxes.iter().enumerate() {
            let (mut enter, mut leave) = (0.0f64, max);
            for axis in 0..3 {
                if direction[axis] == 0.0 {
                    if origin[axis] < b.min[axis] || origin[axis] > b.max[axis] {
                        enter = f64::INFINITY;
                    }
                    continue;
                }
                let planes = [b.min[axis], b.max[axis]].map(|x| (x - origin[axis]) / direction[axis]);
                enter = enter.max(planes[0].min(planes[1]));
                leave = leave.min(planes[0].max(planes[1]));
            }
            assert!(visited[k] || enter > leave, "case {case}: box {k} is on the way");
        }
    }
    let mut count = 0;
    BoxTree::new(&[]).visit_along(&Vec3::zeros(), &Vec3::x(), &mut 1.0, |_, _| count += 1);
    assert_eq!(count, 0, "an empty tree");
}
