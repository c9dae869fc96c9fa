//! The `surface` mode: flat faces, aligned and crossed boxes, cylinders.

use crate::rng::Rng;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use tumble_collide::{Contact, NormalFrom, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3, contacts};

fn find_contacts(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose, margin: f64) -> Vec<Contact> {
    let mut out = Vec::new();
    contacts(a, pa, b, pb, margin, &mut out);
    for c in &out {
        assert!(
            (c.normal.norm() - 1.0).abs() < 1e-9 && c.gap <= margin && c.point.iter().all(|x| x.is_finite()),
            "{c:?}"
        );
    }
    let mut names: Vec<u64> = out.iter().map(|c| c.feature).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), out.len(), "features are distinct: {out:?}");
    out
}

fn mesh_box(x: f64, y: f64, z: f64) -> Shape {
    Shape::mesh(TriMesh::cuboid(Vec3::new(x, y, z)), &TreeSettings::octree()).unwrap()
}

fn turned(z: f64, angle: f64) -> Pose {
    Pose::from_parts(Vec3::new(0.0, 0.0, z).into(), Quat::from_scaled_axis(Vec3::z() * angle))
}

/// Returns the extent of the points in the horizontal plane.
fn spread(found: &[Contact]) -> Vec3 {
    let low = found.iter().fold(Vec3::repeat(9.0), |m, c| m.inf(&c.point));
    let high = found.iter().fold(Vec3::repeat(-9.0), |m, c| m.sup(&c.point));
    high - low
}

#[test]
fn a_mesh_box_touches_a_plane_with_its_four_corners() {
    let shape = mesh_box(1.0, 0.6, 0.4);
    let mut rng = Rng::new(1);
    for _ in 0..200 {
        let pose = turned(0.2 + 1e-5, rng.between(0.0, 6.3));
        let found = find_contacts(&shape, &pose, &Shape::half_space(), &Pose::identity(), 1e-3);
        assert_eq!(found.len(), 4, "{found:?}");
        for c in &found {
            assert!((c.gap - 1e-5).abs() < 1e-12 && c.normal == Vec3::z() && c.normal_from == NormalFrom::FaceOfB);
        }
    }
}

#[test]
fn boxes_of_the_same_size_touch_face_to_face() {
    // each as a mesh and as a primitive, aligned, and with the upper one moved slightly in either
    // direction
    let (mesh, block) = (mesh_box(1.0, 1.0, 1.0), Shape::cuboid(Vec3::repeat(1.0)).unwrap());
    for (a, b) in [(&mesh, &mesh), (&mesh, &block), (&block, &mesh)] {
        for shift in [0.0, 1e-9, -1e-9, 1e-7, -1e-5, 1e-3, 0.2] {
            for gap in [1e-4, 1e-7, 0.0, -1e-7, -1e-4] {
                let upper = Pose::translation(shift, -0.5 * shift, 1.0 + gap);
                let found = find_contacts(a, &upper, b, &Pose::identity(), 1e-3);
                assert!(found.iter().all(|c| (c.normal - Vec3::z()).norm() < 1e-6), "{shift} {gap}: {found:?}");
                assert!(found.iter().all(|c| (c.gap - gap).abs() < 1e-9), "{shift} {gap}: {found:?}");
                let wide = spread(&found);
                assert!(
                    wide.x > 1.0 - shift.abs() - 1e-6 && wide.y > 1.0 - 0.5 * shift.abs() - 1e-6,
                    "{shift} {gap}: {found:?}"
                );
                assert!((4..=9).contains(&found.len()));
            }
        }
    }
}

#[test]
fn a_rotated_box_on_another_touches_where_the_edges_cross() {
    let (mesh, block) = (mesh_box(1.0, 1.0, 1.0), Shape::cuboid(Vec3::repeat(1.0)).unwrap());
    for (a, b) in [(&mesh, &mesh), (&mesh, &block), (&block, &mesh)] {
        for gap in [1e-4, 0.0, -1e-4] {
            let found = find_contacts(a, &turned(1.0 + gap, FRAC_PI_4), b, &Pose::identity(), 1e-3);
            assert!(found.len() >= 4, "{found:?}");
            // the octagon in which the two squares overlap has its corners at (½, ½·tan 22.5°) and
            // the like
            for c in &found {
                let (x, y) = (c.point.x.abs(), c.point.y.abs());
                assert!(
                    (x.max(y) - 0.5).abs() < 1e-3 && (x.min(y) - 0.5 * (FRAC_PI_4 / 2.0).tan()).abs() < 1e-3,
                    "{c:?}"
                );
                assert!((c.normal - Vec3::z()).norm() < 1e-3 && (c.gap - gap).abs() < 1e-6, "{gap}: {c:?}");
            }
        }
    }
}

#[test]
fn a_bar_across_a_bar_has_the_corners_of_their_common_square() {
    // no corner of either is near the other
    let (mesh, block) = (mesh_box(2.0, 0.2, 0.2), Shape::cuboid(Vec3::new(2.0, 0.2, 0.2)).unwrap());
    for (a, b) in [(&mesh, &mesh), (&mesh, &block), (&block, &mesh)] {
        for gap in [1e-4, 0.0, -1e-4] {
            let found = find_contacts(a, &turned(0.2 + gap, FRAC_PI_2), b, &Pose::identity(), 1e-3);
            assert!(found.len() >= 4 && found.len() <= 9, "{found:?}");
            for c in &found {
                assert!((c.point.x.abs() - 0.1).abs() < 1e-3 && (c.point.y.abs() - 0.1).abs() < 1e-3, "{gap}: {c:?}");
                assert!((c.normal - Vec3::z()).norm() < 1e-3 && (c.gap - gap).abs() < 1e-6, "{gap}: {c:?}");
            }
        }
    }
}

#[test]
fn crossed_edges_meet_at_one_point() {
    // two boxes on edge, one along x, one along y: closest at the crossing, at ½√2 from each axis
    let reach = 0.5 * 2.0_f64.sqrt();
    let (mesh, block) = (mesh_box(2.0, 1.0, 1.0), Shape::cuboid(Vec3::new(2.0, 1.0, 1.0)).unwrap());
    let on_edge = |z: f64, yaw: f64| {
        let turn = Quat::from_scaled_axis(Vec3::z() * yaw) * Quat::from_scaled_axis(Vec3::x() * FRAC_PI_4);
        Pose::from_parts(Vec3::new(0.07, 0.11, z).into(), turn)
    };
    for (a, b) in [(&mesh, &mesh), (&mesh, &block), (&block, &mesh)] {
        for gap in [1e-3, 1e-6, -1e-6, -1e-3, -2e-2] {
            let found = find_contacts(a, &on_edge(2.0 * reach + gap, FRAC_PI_2), b, &on_edge(0.0, 0.0), 2e-3);
            let deepest = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)).unwrap();
            assert!((deepest.gap - gap).abs() < 1e-7 + 1e-3 * gap.abs(), "{gap}: {found:?}");
            assert!((deepest.normal - Vec3::z()).norm() < 1e-3, "{gap}: {found:?}");
            assert!((deepest.point.x - 0.07).abs() < 1e-2 && (deepest.point.y - 0.11).abs() < 1e-2, "{gap}: {found:?}");
        }
    }
}

#[test]
fn a_thin_plate_is_not_seen_from_its_other_side() {
    // a plate 1 mm thick lies on a box; its lower corners are near the box's top, its upper ones
    // not
    let (plate, block) = (mesh_box(0.4, 0.4, 0.001), mesh_box(1.0, 1.0, 1.0));
    for gap in [1e-4, 0.0, -1e-4] {
        let found = find_contacts(&plate, &Pose::translation(0.0, 0.0, 0.5005 + gap), &block, &Pose::identity(), 5e-4);
        assert!(
            found.len() >= 4 && found.iter().all(|c| (c.gap - gap).abs() < 1e-9 && c.normal.z > 0.999),
            "{gap}: {found:?}"
        );
        // the same from below, and a box that hangs from the plate's underside
        let found = find_contacts(&block, &Pose::translation(0.0, 0.0, -0.5005 - gap), &plate, &Pose::identity(), 5e-4);
        assert!(
            found.len() >= 4 && found.iter().all(|c| (c.gap - gap).abs() < 1e-9 && c.normal.z < -0.999),
            "{gap}: {found:?}"
        );
    }
}

#[test]
fn a_cylinder_on_a_box_touches_as_on_a_plane() {
    let cylinder = Shape::cylinder(0.2, 0.6).unwrap();
    for block in [mesh_box(2.0, 2.0, 0.2), Shape::cuboid(Vec3::new(2.0, 2.0, 0.2)).unwrap()] {
        let mut rng = Rng::new(9);
        for case in 0..300 {
            let standing = case % 3 == 0;
            let turn = match case % 3 {
                0 => Quat::from_scaled_axis(Vec3::z() * rng.between(0.0, 6.0)),
                1 => {
                    Quat::from_scaled_axis(Vec3::z() * rng.between(0.0, 6.0))
                        * Quat::from_scaled_axis(Vec3::x() * FRAC_PI_2)
                }
                _ => rng.pose(1.0).rotation,
            };
            let axis = turn * Vec3::z();
            let reach = 0.3 * axis.z.abs() + 0.2 * (1.0 - axis.z * axis.z).max(0.0).sqrt();
            let gap = rng.between(-1e-3, 1e-3);
            let pose = Pose::from_parts(Vec3::new(0.1, -0.2, 0.1 + reach + gap).into(), turn);
            let found = find_contacts(&cylinder, &pose, &block, &Pose::identity(), 2e-3);
            let least = found.iter().map(|c| c.gap).fold(9.0, f64::min);
            assert!((least - gap).abs() < 1e-8, "case {case}: {least} but {gap}: {found:?}");
            assert!(found.iter().all(|c| (c.normal - Vec3::z()).norm() < 1e-9), "case {case}: {found:?}");
            let wide = spread(&found);
            match case % 3 {
                0 => assert!(standing && found.len() >= 4 && wide.x > 0.27 && wide.y > 0.27, "{found:?}"),
                1 => assert!(wide.norm() > 0.5, "{found:?}"),
                _ => {}
            }
        }
    }
}

#[test]
fn a_sphere_in_a_groove_touches_both_sides() {
    // two boxes rotated by 45° make a groove; here one concave mesh does as well: a ring's hole and
    // a sphere in it
    let ring = Shape::mesh(TriMesh::torus(1.0, 0.25, 48, 24), &TreeSettings::octree()).unwrap();
    let sphere = Shape::sphere(0.9).unwrap();
    // the sphere sits on the hole: its center is (0.9 + 0.25) from the tube's middle circle
    let height = (1.15_f64.powi(2) - 1.0).sqrt();
    let found = find_contacts(&sphere, &Pose::translation(0.0, 0.0, height), &ring, &Pose::identity(), 0.01);
    assert!(found.len() >= 3, "{found:?}");
    let sum: Vec3 = found.iter().map(|c| c.normal).sum();
    assert!(found.iter().all(|c| c.gap.abs() < 0.01 && c.normal.z > 0.3), "{found:?}");
    assert!(sum.xy().norm() < 0.5 * found.len() as f64, "on all sides: {found:?}");
}

#[test]
fn the_round_side_of_a_cylinder_beside_an_edge_is_not_lost() {
    // a pose found at random; 11.5239 mm is parry's distance of a prism of 720 sides, which is 1 µm
    // short
    let half = Vec3::new(0.2, 0.3, 0.1) / (2.0 * 0.14_f64.sqrt());
    let (mesh, cylinder) = (mesh_box(2.0 * half.x, 2.0 * half.y, 2.0 * half.z), Shape::cylinder(0.1, 0.3).unwrap());
    let turn =
        nalgebra::Quaternion::new(0.846268223820806, -0.2642777604899751, -0.3376229903667359, 0.31622472236908467);
    let pose = Pose::from_parts(
        Vec3::new(0.18382241907346522, -0.5465112021749865, 0.20248664782432102).into(),
        Quat::from_quaternion(turn),
    );
    let found = find_contacts(&mesh, &pose, &cylinder, &Pose::identity(), 0.02);
    let least = found.iter().map(|c| c.gap).fold(9.0, f64::min);
    assert!((least - 0.011_523_9).abs() < 2e-6, "{found:?}");
}

#[test]
fn a_cylinder_across_the_straight_lines_of_a_smooth_surface_meets_their_middle() {
    // lines 0.2 m long that turn by 2π/1000: their ends are 41 mm from the cylinder that touches
    // their middles
    let drum = Shape::mesh(TriMesh::cylinder(1.0, 0.2, 1000), &TreeSettings::octree()).unwrap();
    let across = Quat::from_scaled_axis(Vec3::x() * FRAC_PI_2);
    for gap in [1e-3, 1e-5, -1e-5] {
        let pose = Pose::from_parts(Vec3::new(1.1 + gap, 0.0, 0.0).into(), across);
        let found = find_contacts(&Shape::cylinder(0.1, 0.6).unwrap(), &pose, &drum, &Pose::identity(), 2e-3);
        let deepest = found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap)).unwrap();
        assert!((deepest.gap - gap).abs() < 1e-5 && (deepest.normal - Vec3::x()).norm() < 1e-2, "{gap}: {found:?}");
    }
}

#[test]
fn a_rim_over_a_shallow_valley_meets_both_its_sides() {
    // a trough z = a|x|, and a cylinder tilted by τ across it, with its rim's lowest point above
    // the bottom. At an angle θ from there the rim is at z₀ − r sin τ cos θ, so the minimum above
    // the sides is at tan θ = ± a / sin τ, 0.4° here: both in one arc
    let (a, r, tilt, depth) = (2e-3, 0.1, 0.3_f64, 0.2);
    let profile = [(-0.5, 0.5 * a), (0.0, 0.0), (0.5, 0.5 * a), (0.5, -depth), (-0.5, -depth)];
    let vertices = [-0.4, 0.4].iter().flat_map(|y| profile.map(|(x, z)| Vec3::new(x, *y, z))).collect();
    // the triangles of either end, then two per side
    let mut triangles = vec![[0, 4, 1], [1, 4, 3], [1, 3, 2], [5, 6, 9], [6, 8, 9], [6, 7, 8]];
    triangles.extend((0..5_u32).flat_map(|n| [[n, (n + 1) % 5, n + 5], [(n + 1) % 5, (n + 1) % 5 + 5, n + 5]]));
    let trough = Shape::mesh(TriMesh { vertices, triangles }, &TreeSettings::octree()).unwrap();
    let cylinder = Shape::cylinder(r, 0.3).unwrap();
    // the mesh's frame is its center of mass
    let Shape::Mesh(shape) = &trough else { panic!("no mesh") };
    let bottom = shape.mesh().vertices[1] - Vec3::new(0.0, -0.4, 0.0);
    for turn in [0.0, 0.016, 0.3] {
        let rotation = Quat::from_scaled_axis(Vec3::x() * tilt) * Quat::from_scaled_axis(Vec3::z() * turn);
        let lift = r * tilt.sin() + 0.15 * tilt.cos() + 1e-3;
        let pose = Pose::from_parts((bottom + Vec3::z() * lift).into(), rotation);
        let found = find_contacts(&cylinder, &pose, &trough, &Pose::identity(), 2e-3);
        let theta = (a / tilt.sin()).atan();
        let gap = (1e-3 + r * tilt.sin() * (1.0 - theta.cos()) - a * r * theta.sin()) / a.hypot(1.0);
        for side in [-1.0, 1.0] {
            let normal = Vec3::new(-side * a, 0.0, 1.0).normalize();
            let one: Vec<&Contact> = found.iter().filter(|c| (c.normal - normal).norm() < 1e-9).collect();
            assert!(one.len() == 1 && (one[0].gap - gap).abs() < 1e-9, "{side}, turned by {turn}: {gap}, {found:?}");
        }
    }
}

#[test]
fn contacts_do_not_depend_on_earlier_queries() {
    let shapes = [
        Shape::mesh(TriMesh::torus(0.3, 0.1, 24, 12), &TreeSettings::octree()).unwrap(),
        mesh_box(0.6, 0.4, 0.2),
        Shape::cylinder(0.2, 0.6).unwrap(),
        Shape::capsule(0.1, 0.4).unwrap(),
        Shape::cuboid(Vec3::new(0.4, 0.6, 0.4)).unwrap(),
    ];
    let mut rng = Rng::new(77);
    let queries: Vec<(usize, usize, Pose)> = (0..200).map(|n| (n % 3, n / 3 % 5, rng.pose(0.25))).collect();
    let answer = |(a, b, pose): &(usize, usize, Pose)| {
        let mut out = Vec::new();
        contacts(&shapes[*a], pose, &shapes[*b], &Pose::identity(), 0.02, &mut out);
        out
    };
    let forwards: Vec<_> = queries.iter().map(answer).collect();
    let mut backwards: Vec<_> = queries.iter().rev().map(answer).collect();
    backwards.reverse();
    assert!(forwards.iter().filter(|found| !found.is_empty()).count() > 100);
    assert_eq!(forwards, backwards);
}

/// A bar through a box with a dent, both meshes. No vertex and no edge of either is as deep as
/// points inside the faces.
#[test]
fn two_meshes_deep_in_each_other_have_the_depth_of_the_deepest_face() {
    let (block, bar) = (dented_box(), mesh_box(6.0, 1.4, 0.8));
    // the bar's wide faces are at z = ±0.4, 0.6 below the box's; the bar's edges are 0.3 below y =
    // ±1; the box's own faces are 0.4 deep in the bar
    let straight = Pose::identity();
    // moved up by 0.1: one wide face is at z = 0.5, the other at z = −0.3, 0.7 below the box's
    // lower side
    let raised = Pose::translation(0.0, 0.0, 0.1);
    for (pose, depth) in [(straight, 0.6), (raised, 0.7)] {
        for (a, pa, b, pb) in [(&block, Pose::identity(), &bar, pose), (&bar, pose, &block, Pose::identity())] {
            let found = find_contacts(a, &pa, b, &pb, 1e-3);
            let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
            // to 4e-4 of the smaller radius, and never deeper
            assert!(least >= -depth - 1e-12 && least < -depth + 4e-4 * 3.0_f64.sqrt(), "{least} but {depth}");
        }
    }
}

/// Returns a cube of edge 2 about its center of mass, minus a pyramid of 0.01 in one side, which
/// moves that by 6e-5 (the deepest points are beside it in z).
fn dented_box() -> Shape {
    let mut mesh = TriMesh::cuboid(Vec3::repeat(2.0));
    let at = |mesh: &TriMesh, v: u32| mesh.vertices[v as usize];
    let side: Vec<[u32; 3]> =
        mesh.triangles.iter().copied().filter(|t| t.iter().all(|&v| at(&mesh, v).y > 0.0)).collect();
    mesh.triangles.retain(|t| !side.contains(t));
    let middle = mesh.vertices.len() as u32;
    mesh.vertices.push(Vec3::new(0.0, 0.99, 0.0));
    // the boundary of the side: edges of only one of its triangles
    let edges: Vec<[u32; 2]> = side.iter().flat_map(|t| (0..3).map(|k| [t[k], t[(k + 1) % 3]])).collect();
    let rim = edges.iter().filter(|[a, b]| !edges.contains(&[*b, *a]));
    mesh.triangles.extend(rim.map(|[a, b]| [*a, *b, middle]));
    Shape::mesh(mesh, &TreeSettings::octree()).unwrap()
}

/// The same bar and a box without a dent, both convex: the minimum translation is over the box's
/// upper side, `1 + 0.4`, or `1 + 0.3` for the raised one.
#[test]
fn convex_meshes_through_each_other_have_the_depth_of_the_least_translation() {
    let (block, bar) = (mesh_box(2.0, 2.0, 2.0), mesh_box(6.0, 1.4, 0.8));
    for (rise, depth) in [(0.0, 1.4), (0.1, 1.3)] {
        let found = find_contacts(&bar, &Pose::translation(0.0, 0.0, rise), &block, &Pose::identity(), 1e-3);
        let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
        assert!(
            (least + depth).abs() < 1e-9 && found.iter().all(|c| c.normal.z.abs() > 1.0 - 1e-9),
            "{least} but {depth}: {found:?}"
        );
        assert!(rise == 0.0 || found.iter().all(|c| c.normal.z > 0.0), "{found:?}");
        assert!(spread(&found).x > 1.9 && spread(&found).y > 1.3, "{found:?}");
    }
}

/// A prism of 200 sides beside the edge of a plate: the plate's edge is closest to the round side. Edges of the round side
/// that lie further on above the plate's face, at an inclination, are no contacts: rows of theirs would stop a gear's tooth
/// that passes. Their ends, at the rim of the prism, neither.
#[test]
fn edges_of_a_round_side_are_no_contacts_above_a_face_that_is_inclined_to_them() {
    let mesh = |mesh: TriMesh| Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
    let prism = mesh(TriMesh::cylinder(1.0, 0.5, 200));
    for thickness in [0.4, 0.5, 0.6] {
        // its face looks towards the prism at x = 1.02, from y = 0.3 on
        let plate = mesh_box(0.2, 1.0, thickness);
        let at = Pose::translation(1.12, 0.8, 0.0);
        let found = find_contacts(&prism, &Pose::identity(), &plate, &at, 0.2);
        let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
        assert!((least - (1.02_f64.hypot(0.3) - 1.0)).abs() < 2e-4, "{least}");
        for c in &found {
            // out of the prism, at the foot on its side
            let outward = Vec3::new(c.point.x, c.point.y, 0.0).normalize();
            let inclined = outward.cross(&c.normal).norm();
            assert!(inclined < 5.0 * std::f64::consts::TAU / 200.0, "{thickness}: {inclined} {c:?}");
        }
    }
}
