//! Contacts of sphere trees (the `spheres` mode) compared with parry's distance to the mesh itself:
//! none missed, none invented beyond the stated error.

use crate::against_parry::{to_parry, vector};
use crate::rng::Rng;
use crate::shared_meshes::text;
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Capsule, Cuboid, Shape as ParryShape, TriMesh as ParryMesh};
use tumble_collide::{
    Contact, ContactMode, NormalFrom, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3, contacts_in_mode,
};

struct Both {
    name: &'static str,
    ours: Shape,
    theirs: Box<dyn ParryShape>,
    /// Outward error of the tree, meters; 0 for primitives.
    error: f64,
    size: f64,
}

fn solid(name: &'static str, mesh: TriMesh) -> Both {
    // about 1 m across, independent of the file's unit
    let scale = 1.0 / mesh.diagonal();
    let ours = Shape::mesh(mesh.scaled(scale), &TreeSettings::octree()).unwrap();
    let Shape::Mesh(shape) = &ours else { panic!("{name} is no mesh") };
    let vertices = shape.mesh().vertices.iter().map(vector).collect();
    let theirs = Box::new(ParryMesh::new(vertices, shape.mesh().triangles.clone()).unwrap());
    let error = shape.tree().outward_error();
    let size = ours.bounding_radius();
    Both { name, theirs, error, size, ours }
}

fn primitive(name: &'static str, ours: Shape, theirs: Box<dyn ParryShape>) -> Both {
    let size = ours.bounding_radius();
    Both { name, ours, theirs, error: 0.0, size }
}

fn bodies() -> Vec<Both> {
    let cylinder = Shape::cylinder(0.2, 0.6).unwrap();
    let Shape::Cylinder(c) = &cylinder else { panic!("no cylinder") };
    let error = c.tree().outward_error();
    let theirs = ParryMesh::new(c.mesh().vertices.iter().map(vector).collect(), c.mesh().triangles.clone()).unwrap();
    let size = cylinder.bounding_radius();
    let mut all = vec![
        solid("box mesh", TriMesh::cuboid(Vec3::new(0.4, 0.6, 0.2))),
        solid("ring", TriMesh::torus(1.0, 0.3, 48, 24)),
        Both { name: "cylinder", ours: cylinder, theirs: Box::new(theirs), error, size },
        primitive("sphere", Shape::sphere(0.3).unwrap(), Box::new(Ball::new(0.3))),
        primitive(
            "box",
            Shape::cuboid(Vec3::new(0.6, 0.4, 0.8)).unwrap(),
            Box::new(Cuboid::new(vector(&Vec3::new(0.3, 0.2, 0.4)))),
        ),
        primitive("capsule", Shape::capsule(0.1, 0.8).unwrap(), Box::new(Capsule::new_z(0.4, 0.1))),
    ];
    for (name, file) in [("bunny", "bunny.obj"), ("spot", "spot.obj"), ("link", "panda_link5.obj")] {
        if let Some(obj) = text(file) {
            all.push(solid(name, TriMesh::from_obj(&obj).unwrap()));
        }
    }
    all
}

fn find_contacts(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose, margin: f64) -> Vec<Contact> {
    let mut out = Vec::new();
    contacts_in_mode(ContactMode::Spheres, a, pa, b, pb, margin, &mut out);
    for c in &out {
        assert!(
            (c.normal.norm() - 1.0).abs() < 1e-9 && c.gap <= margin && c.point.iter().all(|x| x.is_finite()),
            "{c:?}"
        );
    }
    assert!(out.len() <= 72, "{} contacts", out.len());
    out
}

#[test]
fn tree_contacts_agree_with_the_distance_to_the_mesh() {
    const MARGIN: f64 = 0.05;
    let all = bodies();
    let (mut apart, mut near, mut deep) = (0, 0, 0);
    for (i, a) in all.iter().enumerate() {
        for b in all[..=i].iter().filter(|b| a.error + b.error > 0.0) {
            let mut rng = Rng::new(i as u64);
            // parry takes milliseconds for a pair of fine meshes
            let cases = if a.error > 0.0 && b.error > 0.0 { 12 } else { 200 };
            for case in 0..cases {
                // centers at about the distance at which the two touch
                let away = rng.direction() * (a.size + b.size) * rng.between(0.3, 1.0);
                let (pa, pb) = (rng.pose(0.5), rng.pose(0.5));
                let pa = Pose::from_parts((pb.translation.vector + away).into(), pa.rotation);
                let distance =
                    query::distance(&to_parry(&pa), &*a.theirs, &to_parry(&pb), &*b.theirs).unwrap().distance;
                let found = find_contacts(&a.ours, &pa, &b.ours, &pb, MARGIN);
                let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
                let label = format!("{} on {}, case {case}: {least} but {distance}", a.name, b.name);
                assert!(least <= distance.max(1e-12) + 1e-6 || distance > MARGIN - 1e-6, "missed: {label}");
                if distance > 0.0 {
                    assert!(least >= distance - a.error - b.error - 1e-6, "invented: {label}");
                }
                match distance {
                    d if d > MARGIN => apart += 1,
                    d if d > 0.0 => near += 1,
                    _ => deep += 1,
                }
            }
        }
    }
    assert!(apart > 500 && near > 150 && deep > 500, "{apart} {near} {deep}");
}

#[test]
fn a_ring_hangs_on_a_peg_through_its_hole_without_contact() {
    let ring = Shape::mesh(TriMesh::torus(1.0, 0.25, 64, 32), &TreeSettings::octree()).unwrap();
    let peg = Shape::capsule(0.6, 4.0).unwrap();
    let here = Pose::identity();
    assert!(find_contacts(&ring, &here, &peg, &here, 0.0).is_empty(), "the hole is 0.75 wide");
    let touching = find_contacts(&ring, &Pose::translation(0.3, 0.0, 0.0), &peg, &here, 0.0);
    let deepest = touching.iter().min_by(|a, b| a.gap.total_cmp(&b.gap)).unwrap();
    // the ring's left inner side touches the peg's left, so the ring is pushed towards −x. An error
    // e of the gap turns the deepest normal by θ with 0.3 (1 − cos θ) < e = 0.036
    assert!(deepest.normal.x < -0.88 && deepest.point.x < -0.4 && deepest.gap < -0.15, "{deepest:?}");
}

#[test]
fn a_box_mesh_lies_flat_on_a_wide_base() {
    let shape = Shape::mesh(TriMesh::cuboid(Vec3::new(1.0, 1.0, 0.5)), &TreeSettings::octree()).unwrap();
    let error = shape.tree().unwrap().outward_error();
    let found =
        find_contacts(&shape, &Pose::translation(0.0, 0.0, 0.25), &Shape::half_space(), &Pose::identity(), 0.005);
    assert!((4..=9).contains(&found.len()), "{found:?}");
    assert!(
        found.iter().all(|c| c.gap >= -error
            && c.gap <= 0.005
            && c.normal == Vec3::z()
            && c.normal_from == NormalFrom::FaceOfB)
    );
    let low = found.iter().fold(Vec3::repeat(9.0), |m, c| m.inf(&c.point));
    let high = found.iter().fold(Vec3::repeat(-9.0), |m, c| m.sup(&c.point));
    assert!((high - low).x > 0.7 && (high - low).y > 0.7, "{low:?} {high:?}");
    // the face is even: it has the same offset everywhere
    assert!(found.iter().filter(|c| (c.gap + error).abs() < 1e-9).count() >= 3, "{found:?}");
}

#[test]
fn a_pin_stands_upright_on_its_base() {
    // the lower half of a bowling pin suffices: base of radius 26 mm, belly of 60 mm at 114 mm, 381
    // mm high
    let profile = [
        (0.0, 0.0),
        (0.026, 0.0),
        (0.045, 0.05),
        (0.06, 0.114),
        (0.05, 0.18),
        (0.025, 0.25),
        (0.032, 0.34),
        (0.015, 0.375),
        (0.0, 0.381),
    ];
    let pin = Shape::mesh(TriMesh::lathe(&profile, 32).unwrap(), &TreeSettings::octree()).unwrap();
    let error = pin.tree().unwrap().outward_error();
    let found = find_contacts(
        &pin,
        &Pose::translation(0.0, 0.0, pin.center_of_mass().z + error),
        &Shape::half_space(),
        &Pose::identity(),
        0.001,
    );
    let standing: Vec<_> = found.iter().filter(|c| c.gap.abs() < 1e-9).collect();
    assert!(standing.len() >= 3, "{found:?}");
    // its support reaches at least 15 mm from the axis in every direction
    for n in 0..16 {
        let way = Pose::rotation(Vec3::z() * (f64::from(n) * std::f64::consts::PI / 8.0)) * Vec3::x();
        let reach = standing.iter().map(|c| c.point.dot(&way)).fold(0.0, f64::max);
        assert!(reach > 0.01, "{n}: {reach} {standing:?}");
    }
}

#[test]
fn a_sphere_lies_in_a_cup() {
    let cup = TriMesh::lathe(&[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.5, 2.0), (1.5, 0.5), (0.0, 0.5)], 64).unwrap();
    let expected = std::f64::consts::PI * (4.0 * 2.0 - 2.25 * 1.5);
    assert!((cup.signed_volume() / expected - 1.0).abs() < 2e-3);
    let cup = Shape::mesh(cup, &TreeSettings::octree()).unwrap();
    let error = cup.tree().unwrap().outward_error();
    let sphere = Shape::sphere(0.4).unwrap();
    let at_height = |above: f64| {
        find_contacts(
            &sphere,
            &Pose::translation(0.3, 0.2, 0.5 + 0.4 + above - cup.center_of_mass().z),
            &cup,
            &Pose::identity(),
            0.0,
        )
    };
    let touching = at_height(0.0);
    assert!(
        !touching.is_empty() && touching.iter().all(|c| c.gap >= -error - 1e-9 && c.normal.z > 0.9),
        "{touching:?}"
    );
    assert!(at_height(1.01 * error).is_empty());
}

#[test]
fn poses_that_are_not_numbers_do_no_harm() {
    let all = bodies();
    let mut out = Vec::new();
    let mode = ContactMode::Spheres;
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        for a in &all {
            for b in &all {
                out.clear();
                contacts_in_mode(
                    mode,
                    &a.ours,
                    &Pose::translation(bad, 0.0, 0.0),
                    &b.ours,
                    &Pose::identity(),
                    0.1,
                    &mut out,
                );
                contacts_in_mode(
                    mode,
                    &b.ours,
                    &Pose::identity(),
                    &a.ours,
                    &Pose::translation(0.0, bad, 0.0),
                    0.1,
                    &mut out,
                );
                contacts_in_mode(
                    mode,
                    &a.ours,
                    &Pose::translation(bad, 0.0, 0.0),
                    &Shape::half_space(),
                    &Pose::identity(),
                    0.1,
                    &mut out,
                );
                assert!(out.iter().all(|c| c.gap <= 0.1), "{} {}: {out:?}", a.name, b.name);
            }
        }
    }
}

#[test]
fn cylinder_on_a_half_space_is_exact() {
    let (radius, half) = (0.5, 1.0);
    let shape = Shape::cylinder(radius, 2.0 * half).unwrap();
    let mut rng = Rng::new(3);
    for _ in 0..2000 {
        let (pose, ground) = (rng.pose(1.0), rng.pose(1.0));
        let (n, axis) = (ground.rotation * Vec3::z(), pose.rotation * Vec3::z());
        let cos = n.dot(&axis);
        let height = n.dot(&(pose.translation.vector - ground.translation.vector));
        let expected = height - half * cos.abs() - radius * (1.0 - cos * cos).max(0.0).sqrt();
        let found = find_contacts(&shape, &pose, &Shape::half_space(), &ground, 10.0);
        let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
        assert!((least - expected).abs() < 1e-4 * radius);
    }
    let standing =
        find_contacts(&shape, &Pose::translation(0.0, 0.0, 0.999), &Shape::half_space(), &Pose::identity(), 0.01);
    assert_eq!(standing.len(), 4);
    let lying = Pose::from_parts(
        Vec3::new(0.0, 0.0, 0.499).into(),
        Quat::from_scaled_axis(Vec3::x() * std::f64::consts::FRAC_PI_2),
    );
    let lying = find_contacts(&shape, &lying, &Shape::half_space(), &Pose::identity(), 0.01);
    assert_eq!(lying.len(), 2);
    assert!(lying.iter().all(|c| (c.gap + 0.001).abs() < 1e-12 && c.core_a == radius));
}

#[test]
fn boxes_around_shapes_hold_their_spheres_and_vertices() {
    let mut rng = Rng::new(11);
    for body in bodies() {
        for _ in 0..20 {
            let pose = rng.pose(1.0);
            let bounds = body.ours.aabb(&pose);
            let theirs = body.theirs.compute_aabb(&to_parry(&pose));
            for k in 0..3 {
                // no wider than the bounding sphere; exact for a primitive (parry's box of a
                // rotated mesh is loose)
                let width = bounds.max[k] - bounds.min[k];
                assert!(width <= 2.0 * (body.size + 2.0 * body.error) + 1e-9, "{}", body.name);
                let off = (bounds.min[k] - theirs.mins[k]).abs().max((bounds.max[k] - theirs.maxs[k]).abs());
                assert!(off < 1e-9 || body.error > 0.0, "{}", body.name);
            }
            if let Shape::Mesh(shape) = &body.ours {
                let outside = |p: Vec3| (0..3).any(|k| p[k] < bounds.min[k] || p[k] > bounds.max[k]);
                let bare = shape.mesh().vertices.iter().find(|v| outside((pose * nalgebra::Point3::from(**v)).coords));
                assert_eq!(bare, None, "{}", body.name);
            }
            if let Some(tree) = body.ours.tree() {
                for leaf in tree.leaves() {
                    let center = (pose * nalgebra::Point3::from(leaf.center)).coords;
                    for k in 0..3 {
                        assert!(bounds.min[k] <= center[k] - leaf.radius + 1e-9, "{}", body.name);
                        assert!(bounds.max[k] >= center[k] + leaf.radius - 1e-9, "{}", body.name);
                    }
                }
            }
        }
    }
}

#[test]
fn same_input_gives_the_same_bits() {
    let all = bodies();
    let run = || {
        let mut rng = Rng::new(21);
        let mut bits = Vec::new();
        for _ in 0..300 {
            let (a, b) = (&all[rng.below(all.len())], &all[rng.below(all.len())]);
            for c in find_contacts(&a.ours, &rng.pose(0.4), &b.ours, &rng.pose(0.4), 0.02) {
                bits.extend([c.point.x.to_bits(), c.normal.z.to_bits(), c.gap.to_bits(), c.feature]);
            }
        }
        bits
    };
    let first = run();
    assert!(first.len() > 1000);
    assert_eq!(first, run());
    let rebuilt = Shape::mesh(TriMesh::torus(1.0, 0.3, 48, 24), &TreeSettings::octree()).unwrap();
    let again = Shape::mesh(TriMesh::torus(1.0, 0.3, 48, 24), &TreeSettings::octree()).unwrap();
    assert_eq!(rebuilt.tree(), again.tree());
}

#[test]
fn mesh_shape_is_moved_to_its_center_of_mass() {
    let mesh = TriMesh::cuboid(Vec3::new(0.2, 0.4, 0.6)).translated(&Vec3::new(5.0, 6.0, 7.0));
    let shape = Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
    assert!((shape.center_of_mass() - Vec3::new(5.0, 6.0, 7.0)).norm() < 1e-12);
    let mass = shape.mass_properties(1000.0).unwrap();
    let expected = Shape::cuboid(Vec3::new(0.2, 0.4, 0.6)).unwrap().mass_properties(1000.0).unwrap();
    assert!((mass.mass - 48.0).abs() < 1e-9 && mass.center_of_mass == Vec3::zeros());
    assert!((mass.inertia - expected.inertia).norm() < 1e-9);
    assert!((shape.bounding_radius() - 0.14_f64.sqrt()).abs() < 1e-12);
}
