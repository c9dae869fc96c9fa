//! The `surface` mode compared with parry's distances and with brute force, over random poses near
//! contact: missed and invented contacts, and differences of depth. `TUMBLE_SLOW=1` runs 10,000
//! poses of meshes on each primitive and 280,000 of meshes on meshes.
//!
//! For separated bodies the reference is parry's distance. For overlapping ones it is the deepest
//! point of either surface in the other solid, by brute force over vertices and points inside the
//! triangles, with signed distances that the mode does not use: [`MeshDistance`] and formulas of
//! this file.

use crate::against_parry::{to_parry, vector};
use crate::brute_force::{self, Kind};
use crate::rng::Rng;
use crate::shared_meshes::text;
use nalgebra::Point3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::{self, ClosestPoints};
use parry3d_f64::shape::{Ball, Capsule, ConvexPolyhedron, Cuboid, Shape as ParryShape, TriMesh as ParryMesh};
use tumble_collide::{Contact, MeshDistance, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3, contacts};

/// The stated error: 2e-4 of a diagonal per mesh (they are 1 m), and parry's own rounding.
const ERROR: f64 = 4e-4 + 1e-5;
const MARGIN: f64 = 0.02;
/// Difference of parry's prism from a cylinder: `0.1 (1 − cos(π/720))`.
const ROUNDING: f64 = 1e-6;
/// Overlaps up to this depth are counted separately: vertices and edges determine their depth;
/// faces are searched in deeper ones only.
const SHALLOW: f64 = 0.02;

struct Body {
    name: &'static str,
    ours: Shape,
    theirs: Box<dyn ParryShape>,
    distance: Option<MeshDistance>,
    /// Points of the surface, for brute force.
    samples: Vec<Vec3>,
}

fn solid(name: &'static str, mesh: TriMesh) -> Body {
    let scale = 1.0 / mesh.diagonal();
    let ours = Shape::mesh(mesh.scaled(scale), &TreeSettings::octree()).unwrap();
    let Shape::Mesh(shape) = &ours else { panic!("{name} is no mesh") };
    let mesh = shape.mesh();
    let vertices = mesh.vertices.iter().map(vector).collect();
    let theirs = Box::new(ParryMesh::new(vertices, mesh.triangles.clone()).unwrap());
    let mut samples = mesh.vertices.clone();
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let steps = ((b - a).norm().max((c - a).norm()) / 0.05).ceil().clamp(2.0, 12.0) as u32;
        for i in 0..=steps {
            for j in 0..=steps - i {
                samples.push(
                    a + (b - a) * (f64::from(i) / f64::from(steps)) + (c - a) * (f64::from(j) / f64::from(steps)),
                );
            }
        }
    }
    let distance = Some(MeshDistance::new(mesh));
    Body { name, theirs, distance, samples, ours }
}

fn primitives() -> Vec<Body> {
    let body =
        |name, ours, theirs: Box<dyn ParryShape>| Body { name, ours, theirs, distance: None, samples: Vec::new() };
    // parry's cylinder is along y; a prism of many sides is equivalent
    let prism = TriMesh::cylinder(0.1, 0.3, 720);
    let prism = ConvexPolyhedron::from_convex_hull(&prism.vertices.iter().map(vector).collect::<Vec<_>>()).unwrap();
    let half = Vec3::new(0.15, 0.1, 0.2);
    vec![
        body("sphere", Shape::sphere(0.15).unwrap(), Box::new(Ball::new(0.15))),
        body("capsule", Shape::capsule(0.05, 0.4).unwrap(), Box::new(Capsule::new_z(0.2, 0.05))),
        body("block", Shape::cuboid(2.0 * half).unwrap(), Box::new(Cuboid::new(vector(&half)))),
        body("cylinder", Shape::cylinder(0.1, 0.3).unwrap(), Box::new(prism)),
    ]
}

fn meshes() -> Vec<Body> {
    let mut all = vec![
        solid("box mesh", TriMesh::cuboid(Vec3::new(0.4, 0.6, 0.2))),
        solid("ring", TriMesh::torus(1.0, 0.3, 32, 16)),
        solid("round", TriMesh::icosphere(1.0, 3)),
        solid("wedge", TriMesh::lathe(&[(0.0, 0.0), (0.5, 0.0), (0.1, 0.8), (0.0, 0.9)], 5).unwrap()),
        solid("waist", TriMesh::lathe(&[(0.0, 0.0), (0.5, 0.0), (0.2, 0.3), (0.5, 0.6), (0.0, 0.6)], 7).unwrap()),
        solid("bumps", bumps()),
    ];
    for (name, file) in [("bunny", "bunny.obj"), ("spot", "spot.obj"), ("link", "panda_link5.obj")] {
        if let Some(obj) = text(file) {
            all.push(solid(name, TriMesh::from_obj(&obj).unwrap()));
        }
    }
    all
}

/// Returns a sphere with a wavy surface: not convex, not symmetric.
fn bumps() -> TriMesh {
    let mut mesh = TriMesh::icosphere(0.4, 3);
    for v in &mut mesh.vertices {
        *v *= 1.0 + 0.15 * (11.0 * v.x).sin() * (9.0 * v.y + 1.0).cos() * (13.0 * v.z + 2.0).sin();
    }
    mesh
}

/// Returns the signed distance of a body at a point of its own frame.
fn signed(body: &Body, p: &Vec3) -> f64 {
    if let Some(distance) = &body.distance {
        return distance.closest(p).signed_distance;
    }
    let corner = |q: Vec3| q.sup(&Vec3::zeros()).norm() + q.max().min(0.0);
    match &body.ours {
        Shape::Sphere { radius } => p.norm() - radius,
        Shape::Capsule { radius, half_length } => {
            (p - Vec3::z() * p.z.clamp(-half_length, *half_length)).norm() - radius
        }
        Shape::Box { half_extents } => corner(p.abs() - half_extents),
        Shape::Cylinder(c) => {
            corner(Vec3::new(p.xy().norm() - c.radius(), p.z.abs() - c.half_length(), f64::NEG_INFINITY))
        }
        _ => panic!("no formula"),
    }
}

fn deepest_sample(a: &Body, pa: &Pose, b: &Body, pb: &Pose) -> f64 {
    let least = |x: &Body, px: &Pose, y: &Body, py: &Pose| {
        let to = py.inv_mul(px);
        x.samples.iter().map(|p| signed(y, &(to * Point3::from(*p)).coords)).fold(f64::INFINITY, f64::min)
    };
    least(a, pa, b, pb).min(least(b, pb, a, pa))
}

#[derive(Default, Debug)]
struct Counts {
    apart: u32,
    near: u32,
    /// All overlapping poses, and those compared with brute force.
    met: u32,
    overlapping: u32,
    missed: u32,
    invented: u32,
    shallow: u32,
    /// Deep overlaps, shallow overlaps.
    shallower: [u32; 2],
    turned: u32,
    /// Close poses in which no contact of the same depth (within the stated error) has parry's
    /// normal: with a vertex closest to a flat face (by brute force), and others.
    other_normals: [u32; 2],
    worst_apart: f64,
    worst_depth: f64,
}

fn find_contacts(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose) -> Vec<Contact> {
    let mut out = Vec::new();
    contacts(a, pa, b, pb, MARGIN, &mut out);
    assert!(out.len() <= 72 && out.iter().all(|c| c.gap <= MARGIN && (c.normal.norm() - 1.0).abs() < 1e-9));
    out
}

/// Returns parry's distance of the two, up to a little more than the margin, and the vector from
/// its closest point of B to that of A.
fn apart(a: &Body, pa: &Pose, b: &Body, pb: &Pose) -> (f64, Option<Vec3>) {
    match query::closest_points(&to_parry(pa), &*a.theirs, &to_parry(pb), &*b.theirs, 1.1 * MARGIN).unwrap() {
        ClosestPoints::WithinMargin(x, y) => {
            ((x - y).length(), Some(x - y).map(|l: Vector| Vec3::new(l.x, l.y, l.z).normalize()))
        }
        ClosestPoints::Intersecting => (0.0, None),
        ClosestPoints::Disjoint => (f64::INFINITY, None),
    }
}

/// Compares random poses at about the distance at which the two touch; parry's distance gives the
/// displacement.
fn compare(a: &Body, b: &Body, cases: usize, brute: usize, rng: &mut Rng, counts: &mut Counts) {
    for case in 0..cases {
        let (pa, pb) = (rng.pose(0.3), rng.pose(0.3));
        let way = rng.direction();
        let mut pa = Pose::from_parts((pb.translation.vector + way * 3.0).into(), pa.rotation);
        // moves along the direction as far as parry's distance allows, a few times; then close,
        // slightly too far or much too far
        for _ in 0..4 {
            let free = query::distance(&to_parry(&pa), &*a.theirs, &to_parry(&pb), &*b.theirs).unwrap().distance;
            pa.translation.vector -= way * free;
        }
        pa.translation.vector -= way * if case % 4 == 0 { rng.between(0.0, 0.2) } else { rng.between(-0.02, 0.02) };
        let deep = case % (cases / brute.min(cases)) == 0;
        check_pose(&format!("{} on {}, case {case}", a.name, b.name), (a, &pa), (b, &pb), deep, counts);
    }
}

/// Like [`compare`], for pairs whose distance is slow in parry: tests which places along a line
/// touch, and then several poses close to there.
fn compare_by_halves(a: &Body, b: &Body, cases: usize, brute: usize, rng: &mut Rng, counts: &mut Counts) {
    for way_number in 0..cases.div_ceil(POSES) {
        let (pa, pb) = (rng.pose(0.3), rng.pose(0.3));
        let way = rng.direction();
        let place = |t: f64| Pose::from_parts((pb.translation.vector + way * t).into(), pa.rotation);
        let (mut touching, mut free) = (0.0, 1.5);
        for _ in 0..12 {
            let middle = 0.5 * (touching + free);
            let meets =
                query::intersection_test(&to_parry(&place(middle)), &*a.theirs, &to_parry(&pb), &*b.theirs).unwrap();
            (touching, free) = if meets.intersecting { (middle, free) } else { (touching, middle) };
        }
        for n in 0..POSES.min(cases - way_number * POSES) {
            let case = way_number * POSES + n;
            let turn = Quat::from_scaled_axis(rng.vec(0.02));
            let deeper = if n == 0 { rng.between(0.0, 0.2) } else { rng.between(-0.02, 0.02) };
            let pa = Pose::from_parts((pb.translation.vector + way * (free - deeper)).into(), turn * pa.rotation);
            let deep = way_number % (cases / POSES / brute.min(cases / POSES)) == 0 && n < 2;
            check_pose(&format!("{} on {}, case {case}", a.name, b.name), (a, &pa), (b, &pb), deep, counts);
        }
    }
}

/// Number of poses along one line.
const POSES: usize = 5;

/// Compares one pose with parry, and, if they overlap and `deep` is set, with brute force.
fn check_pose(label: &str, (a, pa): (&Body, &Pose), (b, pb): (&Body, &Pose), deep: bool, counts: &mut Counts) {
    let (distance, line) = apart(a, pa, b, pb);
    let found = find_contacts(&a.ours, pa, &b.ours, pb);
    let deepest = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap));
    let gap = deepest.map_or(f64::INFINITY, |c| c.gap);
    let label = || eprintln!("{label}: {gap} but {distance}; {}", pose_bits(pa, pb));
    let inside = |x: &Body, px: &Pose, y: &Body, py: &Pose| {
        let p = x.samples.first().copied().unwrap_or_default();
        signed(y, &(py.inv_mul(px) * Point3::from(p)).coords) < 0.0
    };
    // parry's meshes are hollow
    let contained = distance > 0.0 && (inside(a, pa, b, pb) || inside(b, pb, a, pa));
    if distance > ERROR && !contained {
        counts.apart += 1;
        if distance < MARGIN - ERROR {
            counts.near += 1;
            if gap > distance + ERROR {
                counts.missed += 1;
                label();
            } else {
                counts.worst_apart = counts.worst_apart.max((gap - distance).abs());
            }
        }
        if gap < distance - ERROR {
            counts.invented += 1;
            label();
        }
        let rounding = if b.distance.is_none() { ROUNDING } else { 1e-9 };
        let turned = |c: &Contact| line.is_some_and(|line| line.dot(&c.normal) < 1.0_f64.to_radians().cos());
        if (1e-3..MARGIN - ERROR).contains(&distance) && found.iter().filter(|c| c.gap < distance + ERROR).all(turned) {
            label();
            counts.other_normals[usize::from(!closest_is_face((a, pa), (b, pb), distance))] += 1;
        }
        if distance > 1e-3
            && (gap - distance).abs() < rounding
            // of contacts of equal depth, parry returns one
            && found.iter().filter(|c| c.gap < gap + rounding).all(turned)
        {
            label();
            counts.turned += 1;
        }
    } else if (distance <= 0.0 || contained) && gap > ERROR {
        counts.missed += 1;
        label();
    } else if (distance <= 0.0 || contained) && deep {
        counts.overlapping += 1;
        let truth = deepest_sample(a, pa, b, pb);
        let shallow = truth > -SHALLOW;
        counts.shallow += u32::from(shallow);
        if gap > truth + ERROR {
            eprintln!("depth {truth}:");
            label();
            counts.shallower[usize::from(shallow)] += 1;
            counts.worst_depth = counts.worst_depth.max(gap - truth);
        }
    }
    counts.met += u32::from(distance <= 0.0 || contained);
}

/// Returns whether a vertex of one is closest to the inside of a face of the other, by brute force
/// if both are meshes; otherwise true.
fn closest_is_face((a, pa): (&Body, &Pose), (b, pb): (&Body, &Pose), distance: f64) -> bool {
    let (Shape::Mesh(x), Shape::Mesh(y), Some(field)) = (&a.ours, &b.ours, &b.distance) else { return true };
    let all = brute_force::closest(x.mesh(), pa, y.mesh(), pb, field, 1e-9);
    assert!(
        (all[0].distance - distance).abs() < 1e-9,
        "{} on {}: {} but parry says {distance}",
        a.name,
        b.name,
        all[0].distance
    );
    all.iter().any(|c| c.kind == Kind::Face)
}

/// Returns the bits of two poses as text.
fn pose_bits(pa: &Pose, pb: &Pose) -> String {
    let of = |p: &Pose| format!("{:?} {:?}", p.translation.vector.as_slice(), p.rotation.coords.as_slice());
    format!("{} {}", of(pa), of(pb))
}

/// Compares meshes with the primitive of this name; about `poses` poses in all, of which `brute` of
/// each pair are compared with brute force.
fn on_primitive(name: &str, poses: usize, brute: usize) {
    let (meshes, primitives) = (meshes(), primitives());
    let (i, b) = primitives.iter().enumerate().find(|(_, b)| b.name == name).unwrap();
    let mut counts = Counts::default();
    for (j, a) in meshes.iter().enumerate() {
        compare(a, b, poses / meshes.len() + 1, brute, &mut Rng::new((10 * i + j) as u64), &mut counts);
    }
    println!("meshes on {name}: {counts:?}");
    agree(&counts);
}

/// Compares meshes with meshes; about `poses` poses in all, of which `brute` of each pair are
/// compared with brute force.
fn on_meshes(poses: usize, brute: usize) {
    let meshes = meshes();
    let pairs = meshes.len() * (meshes.len() + 1) / 2;
    let mut counts = Counts::default();
    for (i, a) in meshes.iter().enumerate() {
        for (j, b) in meshes[..=i].iter().enumerate() {
            compare_by_halves(a, b, poses / pairs + 1, brute, &mut Rng::new((1000 + 10 * i + j) as u64), &mut counts);
        }
    }
    println!("meshes on meshes: {counts:?}");
    agree(&counts);
    assert_eq!(counts.other_normals[0], 0, "a flat face is closest, and no contact has its normal");
}

fn agree(c: &Counts) {
    assert!(c.near > 20 && c.overlapping > 10, "{c:?}");
    assert_eq!((c.missed, c.invented, c.turned, c.shallower), (0, 0, 0, [0, 0]), "{c:?}");
}

fn is_slow() -> bool {
    std::env::var_os("TUMBLE_SLOW").is_some()
}

#[test]
fn surface_contacts_agree_with_parry() {
    for name in ["sphere", "capsule", "block", "cylinder"] {
        on_primitive(name, 300, 3);
    }
    on_meshes(400, 1);
}

#[test]
fn meshes_on_spheres_and_capsules_agree_with_parry_full_length() {
    if is_slow() {
        on_primitive("sphere", 10_000, 100);
        on_primitive("capsule", 10_000, 100);
    }
}

#[test]
fn meshes_on_boxes_agree_with_parry_full_length() {
    if is_slow() {
        on_primitive("block", 10_000, 100);
    }
}

#[test]
fn meshes_on_cylinders_agree_with_parry_full_length() {
    if is_slow() {
        on_primitive("cylinder", 10_000, 100);
    }
}

#[test]
fn meshes_on_meshes_agree_with_parry_full_length() {
    if is_slow() {
        on_meshes(280_000, 20);
    }
}

#[test]
fn meshes_on_a_half_space_are_exact() {
    let slow = is_slow();
    let mut rng = Rng::new(4);
    for body in meshes() {
        let Shape::Mesh(shape) = &body.ours else { continue };
        for _ in 0..if slow { 2000 } else { 200 } {
            let turn: Quat = rng.pose(1.0).rotation;
            let lowest = shape.mesh().vertices.iter().map(|v| (turn * v).z).fold(f64::INFINITY, f64::min);
            let gap = rng.between(-0.1, 0.9 * MARGIN);
            let pose = Pose::from_parts(Vec3::new(0.3, 0.2, gap - lowest).into(), turn);
            let found = find_contacts(&body.ours, &pose, &Shape::half_space(), &Pose::identity());
            let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
            assert!((least - gap).abs() < 1e-12, "{}: {least} but {gap}", body.name);
            assert!(found.iter().all(|c| c.normal == Vec3::z()));
        }
    }
}

/// An edge of the box passes below the flat base of the wedge and beyond a corner of it: where the
/// base's edge would be crossed it has already ended.
#[test]
fn an_edge_ends_at_its_corner() {
    let all = meshes();
    let [a, b] = ["wedge", "box mesh"].map(|name| all.iter().find(|b| b.name == name).unwrap());
    let pose = |t: [f64; 3], q: [f64; 4]| {
        Pose::from_parts(Vec3::from(t).into(), Quat::new_normalize(nalgebra::Quaternion::from_vector(q.into())))
    };
    let pa = pose(
        [0.2069119298842264, 0.20855159641010135, -0.2993257480564795],
        [0.6342206306288174, 0.5419454537867789, 0.39955081511607654, 0.380024292571812],
    );
    let pb = pose(
        [0.02536194900253591, -0.19192266397821206, 0.19823866505207138],
        [0.09169844050522347, 0.38733862619982207, 0.036220080719898226, 0.9166505825095997],
    );
    let (distance, _) = apart(a, &pa, b, &pb);
    let least = find_contacts(&a.ours, &pa, &b.ours, &pb).iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
    assert!((least - distance).abs() < 1e-9, "{least} but {distance}");
}
