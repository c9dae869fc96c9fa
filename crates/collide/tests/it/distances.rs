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
    let (mut apart, mut worst) = (0, [(0.0f64, String::new()), (0.0, String::new())]);
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
            let worst = &mut worst[usize::from(a.name == "cylinder" || b.name == "cylinder")];
            if error > worst.0 {
                *worst = (error, format!("{} and {}: {} here, {wanted} there", a.name, b.name, found.distance));
            }
            for (shape, pose, p) in [(a, &pose_a, found.points[0]), (b, &pose_b, found.points[1])] {
                assert!(shape.ours.closest_point(pose, &p).distance.abs() < 1e-6, "{} and {}", a.name, b.name);
            }
        } else if wanted == 0.0 && !format!("{} {}", a.name, b.name).contains("ring") {
            assert!(found.distance < 1e-6, "{} and {} overlap: {}", a.name, b.name, found.distance);
        }
    }
    assert!(apart > 2000, "{apart}");
    println!("{worst:?}");
    // the reference of cylinders is a prism
    assert!(worst[0].0 < 2e-5 && worst[1].0 < 1e-5, "{worst:?}");
}

/// Two points are the closest of two convex bodies iff each is the projection of the other: the
/// projections are tested by themselves.
#[test]
fn the_closest_points_of_convex_shapes_are_projections_of_one_another() {
    let mut rng = Rng::new(14);
    let corners: Vec<Vec3> = (0..60).map(|_| rng.direction() * (0.2 + 0.3 * rng.unit())).collect();
    let shapes = [
        Shape::sphere(0.3).unwrap(),
        Shape::capsule(0.15, 0.7).unwrap(),
        Shape::cuboid(Vec3::new(0.6, 0.8, 0.4)).unwrap(),
        Shape::cuboid(Vec3::new(0.01, 0.9, 0.5)).unwrap(),
        Shape::cylinder(0.3, 0.8).unwrap(),
        Shape::cylinder(0.5, 0.02).unwrap(),
        Shape::cone(0.3, 0.7).unwrap(),
        Shape::ellipsoid(Vec3::new(0.2, 0.3, 0.6)).unwrap(),
        Shape::rounded_cuboid(Vec3::new(0.5, 0.7, 0.3), 0.1).unwrap(),
        Shape::rounded_cylinder(0.3, 0.6, 0.1).unwrap(),
        Shape::convex_hull(&corners).unwrap(),
    ];
    let cases = 10_000 * if std::env::var_os("TUMBLE_SLOW").is_some() { 20 } else { 1 };
    let flat = |shape: &Shape| {
        matches!(
            shape,
            Shape::Box { .. }
                | Shape::Mesh(_)
                | Shape::Sphere { .. }
                | Shape::Capsule { .. }
                | Shape::RoundedBox { .. }
        )
    };
    // of pairs of flat and round cores, and of all others: distance, points, and normal times distance
    let (mut apart, mut worst) = (0, [[(0.0, 0); 3]; 2]);
    for case in 0..cases {
        let [a, b] = [&shapes[case % 11], &shapes[(case / 11) % 11]];
        // a third at random, a third at the distance of a touch, a third a hundred radii away
        let size = [0.7, 0.55, 60.0][case % 3];
        let [pa, mut pb] = [rng.pose(size), rng.pose(size)];
        if case % 3 == 1 {
            let pair = closest_points(a, &pa, b, &pb).unwrap();
            let rest = 10f64.powf(-9.0 * rng.unit());
            pb.translation.vector += pair.normal * (pair.distance - rest);
        }
        let pair = closest_points(a, &pa, b, &pb).unwrap();
        if pair.distance <= 0.0 {
            continue;
        }
        apart += 1;
        let scale = 1.0 + (pa.translation.vector - pb.translation.vector).norm();
        let errors = [(a, &pa, 1), (b, &pb, 0)].map(|(shape, pose, other)| {
            let on = shape.closest_point(pose, &pair.points[other]);
            let sign = if other == 1 { -1.0 } else { 1.0 };
            let turn = pair.distance * (on.normal - sign * pair.normal).norm();
            [
                (on.distance - pair.distance).abs() / scale,
                shape.closest_point(pose, &pair.points[1 - other]).distance.abs() / scale,
                turn,
            ]
        });
        for (k, worst) in worst[usize::from(!flat(a) || !flat(b))].iter_mut().enumerate() {
            let error: f64 = errors[0][k].max(errors[1][k]);
            *worst = if error > worst.0 { (error, case) } else { *worst };
        }
    }
    assert!(apart > cases / 2, "{apart}");
    let [flat, curved] = worst.map(|worst| worst.map(|(error, _)| error));
    assert!(flat[0].max(flat[1]) < 1e-14 && flat[2] < 1e-10, "{worst:?}");
    // the distance of curved shapes hardly depends on where on them it is taken
    assert!(curved[0].max(curved[1]) < 5e-9 && curved[2] < 1e-5, "{worst:?}");
}

/// The distance of two segments: the minimum of a quadratic over a square.
fn segments(p: [Vec3; 2], q: [Vec3; 2]) -> f64 {
    let ends = |x: Vec3, [a, b]: [Vec3; 2]| {
        let t = ((x - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (x - a - (b - a) * t).norm()
    };
    let mut least = ends(p[0], q).min(ends(p[1], q)).min(ends(q[0], p)).min(ends(q[1], p));
    let (d, e, r) = (p[1] - p[0], q[1] - q[0], q[0] - p[0]);
    let n = d.cross(&e);
    let (s, t) = (r.cross(&e).dot(&n) / n.norm_squared(), r.cross(&d).dot(&n) / n.norm_squared());
    if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
        least = least.min((r + e * t - d * s).norm());
    }
    least
}

/// The distance of a point and a triangle above its inside; infinity beside it.
fn above(x: &Vec3, [a, b, c]: &[Vec3; 3]) -> f64 {
    let n = (b - a).cross(&(c - a));
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).cross(&(x - *from)).dot(&n) >= 0.0);
    if inside { (x - a).dot(&n).abs() / n.norm() } else { f64::INFINITY }
}

#[test]
fn the_distance_of_meshes_is_the_least_of_all_their_triangles() {
    let mut rng = Rng::new(15);
    let mesh = |mesh| Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
    let shapes = [
        mesh(TriMesh::torus(0.5, 0.15, 10, 6)),
        mesh(TriMesh::torus(0.3, 0.1, 8, 5)),
        mesh(TriMesh::cuboid(Vec3::new(0.5, 0.3, 0.7))),
        mesh(TriMesh::cylinder(0.3, 0.8, 12)),
    ];
    let triangles = |shape: &Shape, pose: &Pose| -> Vec<[Vec3; 3]> {
        let Shape::Mesh(mesh) = shape else { panic!("no mesh") };
        let mesh = mesh.mesh();
        (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| pose.transform_point(&p.into()).coords)).collect()
    };
    let edges = |[a, b, c]: &[Vec3; 3]| [[*a, *b], [*b, *c], [*c, *a]];
    let (mut apart, mut worst) = (0, 0.0f64);
    for case in 0..600 {
        let [a, b] = [&shapes[case % 4], &shapes[case / 4 % 2]];
        let [pa, pb] = [rng.pose(0.7), rng.pose(0.7)];
        let pair = closest_points(a, &pa, b, &pb).unwrap();
        if pair.distance <= 0.0 {
            continue;
        }
        apart += 1;
        let mut least = f64::INFINITY;
        let of_b = triangles(b, &pb);
        for x in triangles(a, &pa) {
            for y in &of_b {
                let points = x.iter().map(|p| above(p, y)).chain(y.iter().map(|p| above(p, &x)));
                let lines = edges(&x).into_iter().flat_map(|p| edges(y).map(|q| segments(p, q)));
                least = points.chain(lines).fold(least, f64::min);
            }
        }
        worst = worst.max((pair.distance - least).abs());
        assert!((pair.points[0] - pair.points[1] - pair.normal * pair.distance).norm() < 1e-13);
    }
    assert!(apart > 200, "{apart}");
    assert!(worst < 1e-13, "{worst}");
}

/// A polytope with a radius around it, as its corners and the directions of its faces and edges.
struct Polytope {
    corners: Vec<Vec3>,
    faces: Vec<Vec3>,
    edges: Vec<Vec3>,
    radius: f64,
}

impl Polytope {
    fn of(shape: &Shape, pose: &Pose) -> Polytope {
        let axes = [0, 1, 2].map(|k| pose.rotation * Vec3::ith(k, 1.0));
        let at = |x: f64, y: f64, z: f64| pose.transform_point(&Vec3::new(x, y, z).into()).coords;
        match shape {
            Shape::Sphere { radius } => {
                Polytope { corners: vec![at(0.0, 0.0, 0.0)], faces: vec![], edges: vec![], radius: *radius }
            }
            Shape::Capsule { radius, half_length: half } => Polytope {
                corners: vec![at(0.0, 0.0, -half), at(0.0, 0.0, *half)],
                faces: vec![],
                edges: vec![axes[2]],
                radius: *radius,
            },
            Shape::Box { .. } | Shape::RoundedBox { .. } => {
                let (half, radius) = match shape {
                    Shape::RoundedBox { half_extents, rounding } => (half_extents.add_scalar(-rounding), *rounding),
                    Shape::Box { half_extents } => (*half_extents, 0.0),
                    _ => unreachable!(),
                };
                let sign = |n: usize, k: usize| if n >> k & 1 == 1 { half[k] } else { -half[k] };
                let corners = (0..8).map(|n| at(sign(n, 0), sign(n, 1), sign(n, 2))).collect();
                Polytope { corners, faces: axes.to_vec(), edges: axes.to_vec(), radius }
            }
            Shape::Mesh(mesh) => {
                let world = |v: &Vec3| pose.transform_point(&(*v).into()).coords;
                let corners: Vec<Vec3> = mesh.mesh().vertices.iter().map(world).collect();
                let (mut faces, mut edges) = (Vec::new(), Vec::new());
                for triangle in &mesh.mesh().triangles {
                    let [a, b, c] = triangle.map(|n| corners[n as usize]);
                    faces.push((b - a).cross(&(c - a)).normalize());
                    edges.extend([b - a, c - b, a - c]);
                }
                Polytope { corners, faces, edges, radius: 0.0 }
            }
            _ => panic!("curved"),
        }
    }

    /// Translation along a unit vector with which it leaves another one.
    fn way_out(&self, other: &Polytope, n: &Vec3) -> f64 {
        let low = self.corners.iter().map(|p| p.dot(n)).fold(f64::INFINITY, f64::min);
        let high = other.corners.iter().map(|p| p.dot(n)).fold(f64::NEG_INFINITY, f64::max);
        high - low + self.radius + other.radius
    }

    /// The least translation over the normals of all faces of both, and of all pairs of edges.
    fn least_way_out(&self, other: &Polytope) -> f64 {
        let crossed = self.edges.iter().flat_map(|x| other.edges.iter().map(|y| x.cross(y)));
        let all = self.faces.iter().chain(&other.faces).copied().chain(crossed.filter(|n| n.norm() > 1e-9));
        let both = all.flat_map(|n| [n.normalize(), -n.normalize()]);
        both.map(|n| self.way_out(other, &n)).fold(f64::INFINITY, f64::min)
    }
}

/// Compares depths with the least translation over all directions that can be the least one, and over random ones.
/// Returns the number of pairs that overlap.
fn depths_are_least(shapes: &[Shape], cases: usize, sampled: usize, seed: u64) -> usize {
    let (mut rng, mut overlapping) = (Rng::new(seed), 0);
    for case in 0..cases {
        let [a, b] = [&shapes[case % shapes.len()], &shapes[case / shapes.len() % shapes.len()]];
        let [pa, pb] = [rng.pose(0.3), rng.pose(0.3)];
        let pair = closest_points(a, &pa, b, &pb).unwrap();
        let [of_a, of_b] = [Polytope::of(a, &pa), Polytope::of(b, &pb)];
        let least = of_a.least_way_out(&of_b);
        if pair.distance > 0.0 || of_a.edges.len().max(of_b.edges.len()) == 0 {
            // spheres at one place have no normal, apart they have that of their centers
            continue;
        }
        overlapping += 1;
        let depth = -pair.distance;
        // of cores that all but touch the distance is known to rounding, and its direction less well
        let cores_overlap = least.is_finite() && least > of_a.radius + of_b.radius;
        if cores_overlap {
            assert!((depth - least).abs() < 1e-12, "case {case}: a depth of {depth} instead of {least}");
        } else {
            // the axes of a capsule or sphere and of the other body do not meet: the distance of the cores decides
            assert!(depth <= of_a.radius + of_b.radius + 1e-12, "case {case}: {depth}");
        }
        for _ in 0..sampled {
            let way = of_a.way_out(&of_b, &rng.direction());
            assert!(way > depth - 1e-12, "case {case}: {way} separates, and {depth} is said to be the least");
        }
        let way = of_a.way_out(&of_b, &pair.normal);
        let error = if cores_overlap { 1e-12 } else { 1e-9 };
        assert!((way - depth).abs() < error, "case {case}: {way} along the normal, and a depth of {depth}");
        assert!((pair.points[0] - pair.points[1] + pair.normal * depth).norm() < 1e-12, "case {case}");
        for (shape, pose, point) in [(a, &pa, &pair.points[0]), (b, &pb, &pair.points[1])] {
            let off = shape.closest_point(pose, point).distance;
            assert!(off.abs() < 1e-9, "case {case}: {point:?} is {off} beside the surface");
        }
        let moved = nalgebra::Translation3::from(pair.normal * depth) * pa;
        let rest = closest_points(a, &moved, b, &pb).unwrap();
        assert!(rest.distance.abs() < 1e-8, "case {case}: a distance of {} is left", rest.distance);
    }
    overlapping
}

fn slow() -> bool {
    std::env::var_os("TUMBLE_SLOW").is_some()
}

#[test]
fn the_depth_of_boxes_is_the_least_translation_of_all() {
    let sizes = [Vec3::new(0.6, 0.8, 0.4), Vec3::new(0.1, 0.9, 0.5), Vec3::repeat(0.5)];
    let boxes = sizes.map(|size| Shape::cuboid(size).unwrap());
    let overlapping = depths_are_least(&boxes, 10_000, if slow() { 2000 } else { 100 }, 16);
    assert!(overlapping > 5000, "{overlapping}");
}

#[test]
fn the_depth_of_polytopes_is_the_least_translation_of_all_full_length() {
    let mut rng = Rng::new(17);
    let mut hull = |count: usize| {
        let corners: Vec<Vec3> = (0..count).map(|_| rng.direction() * (0.3 + 0.3 * rng.unit())).collect();
        Shape::convex_hull(&corners).unwrap()
    };
    let shapes = [
        hull(4),
        hull(9),
        hull(20),
        Shape::convex_hull(&TriMesh::cylinder(0.3, 0.6, 12).vertices).unwrap(),
        Shape::cuboid(Vec3::new(0.6, 0.8, 0.4)).unwrap(),
        Shape::rounded_cuboid(Vec3::new(0.6, 0.5, 0.4), 0.1).unwrap(),
        Shape::capsule(0.15, 0.7).unwrap(),
        Shape::sphere(0.3).unwrap(),
    ];
    let (cases, sampled) = if slow() { (10_000, 2000) } else { (1200, 100) };
    let overlapping = depths_are_least(&shapes, cases, sampled, 18);
    assert!(overlapping > cases / 2, "{overlapping}");
}
