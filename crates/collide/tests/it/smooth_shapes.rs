//! Ellipsoids, cones, rounded boxes and rounded cylinders: contacts with all convex shapes in random
//! poses, with a proof of each distance, and beside parry; mass, bounds, rays and closest points
//! against other sources.
//!
//! The proof of a distance `g` with normal `n` between convex bodies is a pair of bounds. The points of
//! the contact lie in both bodies, so the distance is at most `g`. The planes across `n` through the
//! support points separate the bodies by `−D(n)`, so it is at least that. In an overlap a translation
//! by `D(n)` along `n` separates them, and no other direction of many needs less.

use crate::against_parry::{to_parry, vector};
use crate::rng::Rng;
use parry3d_f64::math::{Rotation, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Capsule, Cone, Cuboid, Cylinder, RoundShape, SupportMap};
use tumble_collide::{CompoundPart, Contact, Pose, Shape, TreeSettings, TriMesh, Vec3, closest_points, contacts};

/// A convex shape with its support function by the formulas of this file.
struct Piece {
    name: &'static str,
    shape: Shape,
    support: Box<dyn Fn(&Vec3) -> f64>,
    /// The same shape of parry, if it has it; along y, and with its center `lift` meters higher.
    parry: Option<(Box<dyn SupportMap>, bool, f64)>,
}

const NEW: [&str; 4] = ["ellipsoid", "cone", "rounded box", "rounded cylinder"];
const KINDS: usize = 10;

fn random_piece(rng: &mut Rng, kind: usize) -> Piece {
    let size = [0; 3].map(|_| rng.between(0.2, 0.8));
    let [a, b, c] = size;
    let v = Vec3::from(size);
    let smallest = v.min();
    let piece = |name, shape, support, parry| Piece { name, shape, support, parry };
    let boxed = |h: Vec3, r: f64| move |n: &Vec3| h.dot(&n.abs()) + r * n.norm();
    let tube =
        |radius: f64, half: f64, r: f64| move |n: &Vec3| radius * n.xy().norm() + half * n.z.abs() + r * n.norm();
    let r = smallest * rng.between(0.1, 0.9);
    match kind {
        0 => {
            let support = move |n: &Vec3| (a * a * n.x * n.x + b * b * n.y * n.y + c * c * n.z * n.z).sqrt();
            piece("ellipsoid", Shape::ellipsoid(2.0 * v).unwrap(), Box::new(support), None)
        }
        1 => {
            let support = move |n: &Vec3| (0.75 * b * n.z).max(a * n.xy().norm() - 0.25 * b * n.z);
            let parry: (Box<dyn SupportMap>, bool, f64) = (Box::new(Cone::new(0.5 * b, a)), true, 0.25 * b);
            piece("cone", Shape::cone(a, b).unwrap(), Box::new(support), Some(parry))
        }
        2 => {
            let core = v.add_scalar(-r);
            let parry = RoundShape { inner_shape: Cuboid::new(vector(&core)), border_radius: r };
            let shape = Shape::rounded_cuboid(2.0 * v, r).unwrap();
            piece("rounded box", shape, Box::new(boxed(core, r)), Some((Box::new(parry), false, 0.0)))
        }
        3 => {
            let r = r.min(0.9 * a).min(0.9 * b);
            let parry = RoundShape { inner_shape: Cylinder::new(b - r, a - r), border_radius: r };
            let shape = Shape::rounded_cylinder(a, 2.0 * b, r).unwrap();
            piece("rounded cylinder", shape, Box::new(tube(a - r, b - r, r)), Some((Box::new(parry), true, 0.0)))
        }
        4 => piece(
            "sphere",
            Shape::sphere(a).unwrap(),
            Box::new(move |n| a * n.norm()),
            Some((Box::new(Ball::new(a)), false, 0.0)),
        ),
        5 => {
            let support = move |n: &Vec3| 0.5 * a * n.norm() + b * n.z.abs();
            let parry = Box::new(Capsule::new_z(b, 0.5 * a));
            piece("capsule", Shape::capsule(0.5 * a, 2.0 * b).unwrap(), Box::new(support), Some((parry, false, 0.0)))
        }
        6 => piece(
            "box",
            Shape::cuboid(2.0 * v).unwrap(),
            Box::new(boxed(v, 0.0)),
            Some((Box::new(Cuboid::new(vector(&v))), false, 0.0)),
        ),
        7 => piece(
            "cylinder",
            Shape::cylinder(a, 2.0 * b).unwrap(),
            Box::new(tube(a, b, 0.0)),
            Some((Box::new(Cylinder::new(b, a)), true, 0.0)),
        ),
        8 => {
            let mesh = Shape::mesh(TriMesh::cuboid(2.0 * v), &TreeSettings::octree()).unwrap();
            piece("box mesh", mesh, Box::new(boxed(v, 0.0)), Some((Box::new(Cuboid::new(vector(&v))), false, 0.0)))
        }
        _ => {
            let points: Vec<Vec3> = (0..12).map(|_| rng.direction() * a).collect();
            let shape = Shape::convex_hull(&points).unwrap();
            let center = shape.center_of_mass();
            let support = move |n: &Vec3| points.iter().map(|p| (p - center).dot(n)).fold(f64::NEG_INFINITY, f64::max);
            piece("hull", shape, Box::new(support), None)
        }
    }
}

/// A shape of parry in the frame of ours.
struct Turned<'a>(&'a dyn SupportMap, bool, f64);

impl SupportMap for Turned<'_> {
    fn local_support_point(&self, dir: Vector) -> Vector {
        // y of parry's cones and cylinders is our z
        let turn = if self.1 { Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2) } else { Rotation::IDENTITY };
        turn * self.0.local_support_point(turn.inverse() * dir) + Vector::new(0.0, 0.0, self.2)
    }
}

/// Returns `D(n)`: the translation of A along `n` after which a plane across `n` separates the two.
fn overlap(a: &Piece, pa: &Pose, b: &Piece, pb: &Pose, n: &Vec3) -> f64 {
    let own = |pose: &Pose, n: Vec3| pose.rotation.inverse_transform_vector(&n);
    (b.support)(&own(pb, *n)) + (a.support)(&own(pa, -n)) - n.dot(&(pa.translation.vector - pb.translation.vector))
}

fn deepest(found: &[Contact]) -> Option<&Contact> {
    found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap))
}

const MARGIN: f64 = 0.25;

/// Calls `each` for random pairs of which one is new, with their contacts; translations up to `reach`.
fn for_pairs(seed: u64, cases: usize, reach: f64, mut each: impl FnMut(&str, [&Piece; 2], [&Pose; 2], &[Contact])) {
    for ka in 0..NEW.len() {
        for kb in 0..KINDS {
            let mut rng = Rng::new(seed + 100 * ka as u64 + kb as u64);
            for case in 0..cases {
                let (a, b) = (random_piece(&mut rng, ka), random_piece(&mut rng, kb));
                let (pa, pb) = (rng.pose(reach), rng.pose(0.1 * reach));
                let mut found = Vec::new();
                contacts(&a.shape, &pa, &b.shape, &pb, MARGIN, &mut found);
                let label =
                    format!("{} and {}, case {case}: {:?} at {pa:?}, {:?} at {pb:?}", a.name, b.name, a.shape, b.shape);
                each(&label, [&a, &b], [&pa, &pb], &found);
            }
        }
    }
}

#[test]
fn distances_are_proved_by_points_and_planes() {
    let (mut near, mut far) = (0, 0);
    for_pairs(1, 200, 1.2, |label, [a, b], [pa, pb], found| {
        let Some(contact) = deepest(found) else {
            // a plane between the two, from the closest points
            let pair = closest_points(&a.shape, pa, &b.shape, pb).unwrap();
            let apart = -overlap(a, pa, b, pb, &pair.normal);
            assert!(apart > MARGIN - 1e-6, "nothing found, but {apart} m apart along {:?}: {label}", pair.normal);
            far += 1;
            return;
        };
        if contact.gap < 1e-6 {
            return;
        }
        near += 1;
        let apart = -overlap(a, pa, b, pb, &contact.normal);
        assert!(
            (apart - contact.gap).abs() < 2e-7,
            "gap {}, but {apart} along the normal: {label}\n{found:?}",
            contact.gap
        );
        let half = 0.5 * contact.gap * contact.normal;
        for (piece, pose, at) in [(a, pa, contact.point + half), (b, pb, contact.point - half)] {
            let off = piece.shape.closest_point(pose, &at).distance;
            // edges on round sides are searched until the gap is known, and the place then is to its root; along
            // the side of a cylinder it is known less
            let cylinder = a.name.contains("cylinder") || b.name.contains("cylinder");
            assert!(off.abs() < if cylinder { 1e-3 } else { 1e-5 }, "a point {off} m off {}: {label}", piece.name);
        }
    });
    assert!(near > 1000 && far > 1000, "{near} near, {far} far");
}

/// Returns the signed distance by parry: GJK if they are apart, EPA if not.
fn by_parry(a: &Piece, pa: &Pose, b: &Piece, pb: &Pose) -> Option<f64> {
    let (Some((of_a, turned_a, lift_a)), Some((of_b, turned_b, lift_b))) = (&a.parry, &b.parry) else { return None };
    let (one, other) = (Turned(&**of_a, *turned_a, *lift_a), Turned(&**of_b, *turned_b, *lift_b));
    let between = to_parry(&pa.inv_mul(pb));
    let distance = query::details::distance_support_map_support_map(&between, &one, &other);
    if distance > 0.0 {
        return Some(distance);
    }
    Some(query::details::contact_support_map_support_map(&between, &one, &other, 0.0)?.dist)
}

#[test]
fn cones_and_rounded_shapes_agree_with_parry() {
    let (mut near, mut deep, mut differ) = (0, 0, Vec::new());
    for_pairs(3, 80, 0.9, |label, [a, b], [pa, pb], found| {
        let Some(contact) = deepest(found) else { return };
        let Some(distance) = by_parry(a, pa, b, pb) else { return };
        if distance > 1e-4 {
            near += 1;
            assert!((contact.gap - distance).abs() < 1e-5, "gap {}, parry {distance}: {label}", contact.gap);
        } else if distance < -1e-4 {
            deep += 1;
            // EPA ends early on curved shapes
            differ.push((contact.gap - distance).abs() / distance.abs());
        }
    });
    differ.sort_by(f64::total_cmp);
    let at = |share: f64| differ[(share * (differ.len() - 1) as f64) as usize];
    println!(
        "{near} gaps; {deep} overlaps, of which 90 % agree to {:.1e}, 99 % to {:.1e}, all to {:.1e}",
        at(0.9),
        at(0.99),
        at(1.0)
    );
    assert!(near > 300 && deep > 800 && at(0.9) < 1e-3 && at(1.0) < 0.12, "{near} {deep}");
}

#[test]
fn overlaps_are_resolved_by_a_translation_that_is_nearly_the_least() {
    let (mut count, mut low, mut high) = (0, (0.0, String::new()), (0.0, String::new()));
    let mut excess = Vec::new();
    for_pairs(2, 30, 0.7, |label, [a, b], [pa, pb], found| {
        let mut rng = Rng::new(9);
        let Some(contact) = deepest(found).filter(|c| c.gap < -1e-6) else { return };
        count += 1;
        let depth = -contact.gap;
        let along = overlap(a, pa, b, pb, &contact.normal);
        assert!(along > 0.0, "{label}");
        // the least of many directions
        let mut least = along;
        for _ in 0..400 {
            let mut n = rng.direction();
            let mut step = 0.3;
            let mut there = overlap(a, pa, b, pb, &n);
            while step > 1e-4 && there < 1.6 * least {
                let next = (n + rng.direction() * step).normalize();
                let value = overlap(a, pa, b, pb, &next);
                if value < there { (n, there) = (next, value) } else { step *= 0.9 }
            }
            least = least.min(there);
        }
        let by = (depth - least) / depth;
        excess.push(by);
        let text = || format!("depth {depth}, {along} along its normal, least {least}: {label}\n{found:?}");
        if by > high.0 {
            high = (by, text());
        } else if by < low.0 {
            low = (by, text());
        }
    });
    excess.sort_by(f64::total_cmp);
    let at = |share: f64| excess[(share * (excess.len() - 1) as f64) as usize];
    println!(
        "{count} overlaps: depth over the least, relative: min {:.2e}, 1 % {:.2e}, median {:.2e}, 99 % {:.2e}, max {:.2e}",
        at(0.0),
        at(0.01),
        at(0.5),
        at(0.99),
        at(1.0)
    );
    assert!(count > 800 && low.0 > -0.09 && high.0 < 0.06, "{} to {}:\n{}\n{}", low.0, high.0, low.1, high.1);
}

/// Returns a fine mesh of the surface, whose errors fall with the squares of its facets.
fn of_mesh(shape: &Shape) -> Shape {
    Shape::mesh(shape.surface_mesh(400), &TreeSettings::octree()).unwrap()
}

#[test]
fn masses_are_those_of_fine_meshes() {
    let mut rng = Rng::new(11);
    for kind in [0, 1] {
        let Piece { shape, name, .. } = random_piece(&mut rng, kind);
        let (own, other) = (shape.mass_properties(3.0).unwrap(), of_mesh(&shape).mass_properties(3.0).unwrap());
        assert!((own.mass / other.mass - 1.0).abs() < 2e-3, "{name}: {} {}", own.mass, other.mass);
        let (mine, theirs) = (own.inertia.diagonal(), other.inertia.diagonal());
        assert!((mine - theirs).norm() < 4e-3 * mine.norm(), "{name}: {mine:?} {theirs:?}");
        assert!(of_mesh(&shape).center_of_mass().norm() < 1e-3, "{name}: the origin is not the center of mass");
    }
}

/// The moments of a box and a cylinder with rounded edges by quadrature of their section.
#[test]
fn rounded_masses_are_those_of_a_quadrature() {
    let steps = 400_000;
    // the section at height z is a rounded rectangle or a disk
    let (half, r) = (Vec3::new(0.3, 0.5, 0.4), 0.15);
    let (radius, length) = (0.45, 0.8);
    let [mut box_sums, mut tube_sums] = [[0.0; 3]; 2];
    for n in 0..steps {
        let z = 0.4 * (n as f64 + 0.5) / steps as f64;
        let beyond = (z - (0.4 - r)).max(0.0);
        let w = (r * r - beyond * beyond).max(0.0).sqrt();
        let dz = 2.0 * 0.4 / steps as f64;
        let (a, b) = (half.x - r, half.y - r);
        // of a rectangle and all points within w of it: area, and ∫ x² dA
        let pi = std::f64::consts::PI;
        let area = 4.0 * a * b + 4.0 * w * (a + b) + pi * w * w;
        let square = 4.0 / 3.0 * b * (a + w).powi(3)
            + 4.0 / 3.0 * w * a.powi(3)
            + 4.0 * (a * a * pi * w * w / 4.0 + 2.0 * a * w.powi(3) / 3.0 + pi * w.powi(4) / 16.0);
        for (sum, x) in box_sums.iter_mut().zip([area, square, area * z * z]) {
            *sum += x * dz;
        }
        let rho = radius - r + w;
        for (sum, x) in tube_sums.iter_mut().zip([pi * rho * rho, 0.5 * pi * rho.powi(4), pi * rho * rho * z * z]) {
            *sum += x * dz;
        }
    }
    let boxed = Shape::rounded_cuboid(2.0 * half, r).unwrap().mass_properties(1.0).unwrap();
    let tube = Shape::rounded_cylinder(radius, length, r).unwrap().mass_properties(1.0).unwrap();
    let near = |x: f64, y: f64| assert!((x / y - 1.0).abs() < 1e-8, "{x} {y}");
    near(boxed.mass, box_sums[0]);
    near(boxed.inertia[(1, 1)], box_sums[1] + box_sums[2]);
    near(tube.mass, tube_sums[0]);
    near(tube.inertia[(2, 2)], tube_sums[1]);
    near(tube.inertia[(0, 0)], 0.5 * tube_sums[1] + tube_sums[2]);
}

#[test]
fn boxes_are_tight_and_rays_enter_where_the_surface_is() {
    let mut rng = Rng::new(21);
    let (mut hits, mut misses) = (0, 0);
    for case in 0..4000 {
        let Piece { shape, support, name, .. } = random_piece(&mut rng, case % 4);
        let pose = rng.pose(1.0);
        let own = |n: Vec3| (support)(&pose.rotation.inverse_transform_vector(&n)) + n.dot(&pose.translation.vector);
        let bounds = shape.tight_aabb(&pose);
        for k in 0..3 {
            let (high, low) = (own(Vec3::ith(k, 1.0)), -own(Vec3::ith(k, -1.0)));
            assert!(bounds.max[k] >= high && bounds.max[k] < high + 1e-9, "{name}: {} {high}", bounds.max[k]);
            assert!(bounds.min[k] <= low && bounds.min[k] > low - 1e-9, "{name}: {} {low}", bounds.min[k]);
        }
        let from = rng.vec(3.0);
        let along = (pose.translation.vector + rng.vec(0.6) - from).normalize();
        let signed = |p: &Vec3| shape.closest_point(&pose, p).distance;
        match shape.cast_ray(&pose, &from, &along, 10.0) {
            Some(hit) => {
                hits += 1;
                let at = from + along * hit.distance;
                let found = shape.closest_point(&pose, &at);
                assert!(
                    found.distance.abs() < 1e-9 && hit.normal.dot(&along) < 1e-9,
                    "{name} {hit:?}: {}",
                    found.distance
                );
                assert!(
                    (0..100).all(|k| signed(&(from + along * (hit.distance * f64::from(k) / 100.0))) > -1e-9),
                    "{name}"
                );
            }
            None => {
                misses += 1;
                let inside = signed(&from) < 0.0;
                assert!(inside || (0..400).all(|k| signed(&(from + along * (f64::from(k) / 60.0))) > -1e-6), "{name}");
            }
        }
    }
    assert!(hits > 100 && misses > 100, "{hits} {misses}");
}

#[test]
fn closest_points_are_those_of_a_fine_mesh() {
    let mut rng = Rng::new(31);
    for kind in 0..4 {
        let Piece { shape, name, .. } = random_piece(&mut rng, kind);
        let fine = of_mesh(&shape);
        let lift = Pose::translation(0.0, 0.0, fine.center_of_mass().z);
        for _ in 0..300 {
            let p = rng.vec(1.0);
            let (own, other) = (shape.closest_point(&Pose::identity(), &p), fine.closest_point(&lift, &p));
            assert!((own.distance - other.distance).abs() < 1e-2, "{name} {p:?}: {own:?} {other:?}");
            // the point is on the surface, at that distance
            let again = shape.closest_point(&Pose::identity(), &own.point).distance;
            assert!(
                again.abs() < 1e-12 && ((own.point - p).norm() - own.distance.abs()).abs() < 1e-12,
                "{name} {p:?}: {own:?} {again}"
            );
        }
    }
}

#[test]
fn they_are_parts_of_compounds_and_survive_archives() {
    let mut rng = Rng::new(41);
    for kind in 0..4 {
        let Piece { shape, .. } = random_piece(&mut rng, kind);
        let part = |z: f64| CompoundPart::new(shape.clone(), Pose::translation(0.0, 0.0, z));
        let pair = Shape::compound(vec![part(-1.0), part(1.0)]).unwrap();
        assert!((pair.volume() - 2.0 * shape.volume()).abs() < 1e-12);
        let (mut whole, mut single) = (Vec::new(), Vec::new());
        contacts(&pair, &Pose::translation(0.0, 0.0, 2.0), &Shape::half_space(), &Pose::identity(), 0.3, &mut whole);
        contacts(&shape, &Pose::translation(0.0, 0.0, 1.0), &Shape::half_space(), &Pose::identity(), 0.3, &mut single);
        assert_eq!(whole.len(), single.len());
    }
}

#[test]
fn wrong_sizes_are_errors() {
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-7] {
        assert!(Shape::ellipsoid(Vec3::new(1.0, size, 1.0)).is_err(), "{size}");
        assert!(Shape::cone(size, 1.0).is_err() && Shape::cone(1.0, size).is_err(), "{size}");
    }
    for rounding in [-0.1, 0.2, 0.3, f64::NAN, f64::INFINITY] {
        let text = Shape::rounded_cuboid(Vec3::new(1.0, 0.4, 1.0), rounding).unwrap_err().to_string();
        assert!(text.contains("less than 0.2 m"), "{text}");
        assert!(Shape::rounded_cylinder(0.2, 1.0, rounding).is_err());
    }
    assert!(matches!(Shape::rounded_cuboid(Vec3::repeat(1.0), 0.0), Ok(Shape::Box { .. })));
    assert!(matches!(Shape::rounded_cylinder(0.2, 1.0, 0.0), Ok(Shape::Cylinder(_))));
}

/// The tip of a slender cone lies on its bounding sphere, where rays begin.
#[test]
fn a_ray_along_its_axis_meets_the_tip_of_a_cone() {
    for height in [0.3, 0.37, 0.51, 0.9] {
        let cone = Shape::cone(0.1, height).unwrap();
        for drop in [0.1, 1.0 / 3.0, 2.0, 100.0] {
            let top = 0.75 * height;
            let hit = cone.cast_ray(&Pose::identity(), &Vec3::new(0.0, 0.0, top + drop), &-Vec3::z(), 1e3);
            let distance = hit.expect("it is on its way").distance;
            assert!((distance - drop).abs() < 1e-12 * (1.0 + drop), "{height}: {distance} for {drop}");
        }
    }
}
