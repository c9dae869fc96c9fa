//! Convex hulls as shapes: a hull of a box against the box, hulls against parry's, rays against the
//! planes of the faces.

use crate::against_parry::{to_parry, vector};
use crate::rng::Rng;
use parry3d_f64::query;
use parry3d_f64::shape::ConvexPolyhedron;
use tumble_collide::{Contact, Pose, Shape, ShapeError, TriMesh, Vec3, closest_points, contacts};

const MARGIN: f64 = 0.05;

fn deepest(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose) -> Option<f64> {
    let mut found: Vec<Contact> = Vec::new();
    contacts(a, pa, b, pb, MARGIN, &mut found);
    found.iter().map(|c| c.gap).min_by(f64::total_cmp)
}

fn corners(size: Vec3) -> Vec<Vec3> {
    TriMesh::cuboid(size).vertices
}

/// A random hull of `count` points within 0.3 m, with its center of mass as origin, as in the
/// `Shape`.
fn random_hull(rng: &mut Rng, count: usize) -> (Shape, Vec<Vec3>) {
    let points: Vec<Vec3> = (0..count).map(|_| rng.direction() * rng.between(0.1, 0.3)).collect();
    let shape = Shape::convex_hull(&points).unwrap();
    let center = shape.center_of_mass();
    (shape, points.iter().map(|p| p - center).collect())
}

#[test]
fn a_hull_of_a_box_is_the_box() {
    let mut rng = Rng::new(3);
    let size = Vec3::new(0.4, 0.6, 0.3);
    let mut points = corners(size);
    points.extend((0..200).map(|_| Vec3::from_fn(|k, _| size[k] * rng.between(-0.5, 0.5))));
    let (hull, cuboid) = (Shape::convex_hull(&points).unwrap(), Shape::cuboid(size).unwrap());
    let (own, reference) = (hull.mass_properties(700.0).unwrap(), cuboid.mass_properties(700.0).unwrap());
    assert!((own.mass - reference.mass).abs() < 1e-12 * reference.mass);
    assert!((own.inertia - reference.inertia).norm() < 1e-12 * reference.inertia.norm());
    assert!(hull.center_of_mass().norm() < 1e-15);
    let others = [(Shape::half_space(), 1e-12), (Shape::sphere(0.2).unwrap(), 1e-9)];
    let mut compared = 0;
    for (other, bound) in &others {
        for _ in 0..400 {
            // shallow overlaps and gaps
            let (a, b) = (rng.pose(0.05), Pose::identity());
            let direction = rng.direction();
            let up = if matches!(other, Shape::HalfSpace) { Vec3::z() } else { direction };
            let near = |reach: f64| a * shift(&a, up * reach);
            let Some(reach) = touching(&cuboid, near, other, &b) else { continue };
            let pose = near(reach + rng.between(-0.02, 0.03));
            let (own, reference) = (deepest(&hull, &pose, other, &b), deepest(&cuboid, &pose, other, &b));
            match (own, reference) {
                (Some(own), Some(reference)) => {
                    assert!((own - reference).abs() < *bound, "{other:?} {pose:?}: {own} {reference}");
                    compared += 1;
                }
                (own, reference) => assert!(own.or(reference).is_none_or(|gap| gap > MARGIN - bound)),
            }
        }
    }
    assert!(compared > 400, "{compared}");
}

/// Returns a translation in world axes as one in the axes of a pose.
fn shift(pose: &Pose, by: Vec3) -> Pose {
    let local = pose.rotation.inverse() * by;
    Pose::translation(local.x, local.y, local.z)
}

/// Returns the distance along a direction at which two shapes touch, by bisection of contacts.
fn touching(a: &Shape, at: impl Fn(f64) -> Pose, b: &Shape, pb: &Pose) -> Option<f64> {
    let (mut low, mut high) = (0.0, 1.5);
    let meets = |x: f64| deepest(a, &at(x), b, pb).is_some_and(|gap| gap <= 0.0);
    if !meets(low) || meets(high) {
        return None;
    }
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if meets(middle) { low = middle } else { high = middle }
    }
    Some(low)
}

/// Faces and edges of a hull at a pose: unit normals, directions, and its points.
struct Placed {
    normals: Vec<Vec3>,
    edges: Vec<Vec3>,
    points: Vec<Vec3>,
}

impl Placed {
    fn new(shape: &Shape, pose: &Pose) -> Placed {
        let Shape::Mesh(mesh) = shape else { panic!("a mesh") };
        let mesh = mesh.mesh();
        let corners = (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|v| pose.rotation * v));
        let normals = corners.clone().map(|[a, b, c]| (b - a).cross(&(c - a)).normalize()).collect();
        let edges = corners
            .flat_map(|[a, b, c]| [b - a, c - b, a - c])
            .filter(|e| e.iter().find(|x| **x != 0.0).is_some_and(|x| *x > 0.0));
        let points = mesh.vertices.iter().map(|v| pose.transform_point(&(*v).into()).coords).collect();
        Placed { normals, edges: edges.collect(), points }
    }

    fn reach(&self, n: &Vec3) -> f64 {
        self.points.iter().map(|p| p.dot(n)).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Returns the least translation that separates two overlapping hulls, over all separating axes.
fn least_translation(a: &Placed, b: &Placed) -> f64 {
    let crossed = a.edges.iter().flat_map(|u| b.edges.iter().filter_map(|v| u.cross(v).try_normalize(1e-9)));
    let own = a.normals.iter().chain(&b.normals).copied();
    own.chain(crossed).flat_map(|n| [n, -n]).map(|n| b.reach(&n) + a.reach(&-n)).fold(f64::INFINITY, f64::min)
}

/// Gaps agree with parry's. Overlaps are compared with the least translation by brute force: no contact
/// is shallower than allowed by the tolerances of the mode (`min_translation.rs`).
#[test]
fn hulls_agree_with_parry_and_with_the_least_translation() {
    let mut rng = Rng::new(11);
    let (mut apart, mut overlapping, mut same, mut worst) = (0, 0, 0, 0.0_f64);
    let (mut shallower, mut deeper) = (0.0_f64, 0.0_f64);
    let hulls: Vec<(Shape, Vec<Vec3>)> = (0..40).map(|n| random_hull(&mut rng, 6 + n)).collect();
    for case in 0..1500 {
        let [(a, points_a), (b, points_b)] = [rng.below(40), rng.below(40)].map(|n| &hulls[n]);
        let [theirs_a, theirs_b] = [points_a, points_b]
            .map(|points| ConvexPolyhedron::from_convex_hull(&points.iter().map(vector).collect::<Vec<_>>()).unwrap());
        let (pa, pb) = (rng.pose(0.3), Pose::identity());
        let theirs = query::contact(&to_parry(&pa), &theirs_a, &to_parry(&pb), &theirs_b, 0.04).unwrap();
        let Some(theirs) = theirs else { continue };
        let Some(gap) = deepest(a, &pa, b, &pb) else { panic!("case {case}: missed at {}", theirs.dist) };
        if theirs.dist > 0.0 {
            let pair = closest_points(a, &pa, b, &pb).unwrap();
            worst = worst.max((gap - theirs.dist).abs()).max((pair.distance - theirs.dist).abs());
            apart += 1;
        } else {
            let least = least_translation(&Placed::new(a, &pa), &Placed::new(b, &pb));
            let difference = -gap - least;
            (shallower, deeper) = (shallower.max(-difference), deeper.max(difference));
            same += usize::from(difference.abs() < 1e-6);
            overlapping += 1;
        }
    }
    println!(
        "{apart} apart, {worst:e} m; {overlapping} overlap, {same} the same, {shallower:e} m shallower, {deeper:e} m deeper"
    );
    assert!(apart > 80 && overlapping > 400, "{apart} {overlapping}");
    assert!(worst < 1e-14, "{worst:e}");
    assert!(20 * same > 19 * overlapping && shallower < 5e-4 && deeper < 1e-3);
}

#[test]
fn a_hull_on_a_half_space_is_as_deep_as_its_lowest_point() {
    let mut rng = Rng::new(12);
    let hulls: Vec<(Shape, Vec<Vec3>)> = (0..20).map(|n| random_hull(&mut rng, 6 + 2 * n)).collect();
    for n in 0..1000 {
        let (hull, points) = &hulls[n % hulls.len()];
        let pose = rng.pose(0.35);
        let lowest = points.iter().map(|p| pose.transform_point(&(*p).into()).z).fold(f64::INFINITY, f64::min);
        match deepest(hull, &pose, &Shape::half_space(), &Pose::identity()) {
            Some(gap) => assert!((gap - lowest).abs() < 1e-12, "{gap} {lowest}"),
            None => assert!(lowest > MARGIN),
        }
    }
}

#[test]
fn rays_enter_where_they_have_crossed_the_planes_of_all_faces() {
    let mut rng = Rng::new(17);
    let mut met = 0;
    for case in 0..40 {
        let (shape, _) = random_hull(&mut rng, 8 + 5 * case);
        let Shape::Mesh(mesh) = &shape else { panic!("a mesh") };
        let mesh = mesh.mesh();
        for _ in 0..250 {
            let origin = rng.direction();
            let direction = (rng.vec(0.3) - origin).normalize();
            // slabs: the last entry and the first exit
            let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
            for t in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(t);
                let normal = (b - a).cross(&(c - a)).normalize();
                let (height, speed) = (normal.dot(&(origin - a)), normal.dot(&direction));
                match speed < 0.0 {
                    true => enter = enter.max(-height / speed),
                    false => leave = leave.min(-height / speed),
                }
            }
            let expected = (enter < leave).then_some(enter);
            let found = shape.cast_ray(&Pose::identity(), &origin, &direction, f64::INFINITY).map(|hit| hit.distance);
            match (found, expected) {
                (Some(found), Some(expected)) => {
                    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
                    met += 1;
                }
                (found, expected) => {
                    assert!(found.is_none() && expected.is_none() || leave - enter < 1e-9, "{found:?} {expected:?}");
                }
            }
        }
    }
    assert!(met > 1000, "{met}");
}

#[test]
fn points_without_a_hull_are_one_clear_error() {
    let square =
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.3, 0.4]].map(|[x, y]| Vec3::new(x, y, 2.0 * x + y));
    let message = |points: &[Vec3]| match Shape::convex_hull(points) {
        Err(ShapeError::Mesh(error)) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let solid = |last: Vec3| [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z(), last];
    assert_eq!(message(&[]), "a convex hull of 0 points; it must have 4 to 10000000");
    assert_eq!(message(&square[..3]), "a convex hull of 3 points; it must have 4 to 10000000");
    assert_eq!(message(&square), "the 5 points of a convex hull lie in one plane; they must span a solid");
    assert_eq!(
        message(&[Vec3::zeros(); 4]),
        "the mesh is 0e0 m across, but must be at least 1e-30 m; is the unit right?"
    );
    assert_eq!(
        message(&solid(Vec3::new(0.0, f64::NAN, 1.0))),
        "vertex 5 is (0, NaN, 1), but coordinates must be finite"
    );
    assert!(message(&solid(Vec3::new(3e10, 0.0, 0.0))).starts_with("vertex 5 has a coordinate of 3e10 m"));
}
