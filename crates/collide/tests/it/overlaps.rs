//! Overlaps of aligned bodies, in which no corner of either lies deep in the other: the contacts
//! separate them by the minimum translation, known in closed form.

use tumble_collide::{Contact, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3, contacts};

fn mesh(mesh: TriMesh) -> Shape {
    Shape::mesh(mesh, &TreeSettings::octree()).unwrap()
}

fn cube() -> Shape {
    mesh(TriMesh::cuboid(Vec3::repeat(1.0)))
}

fn find_contacts(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose) -> Vec<Contact> {
    let mut out = Vec::new();
    contacts(a, pa, b, pb, 1e-3, &mut out);
    let mut names: Vec<u64> = out.iter().map(|c| c.feature).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), out.len(), "features are distinct: {out:?}");
    out
}

/// Checks that the deepest contact has this depth and separates the two along this direction.
fn check_separation(label: &str, found: &[Contact], depth: f64, direction: Vec3, slack: f64) {
    let deepest = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)).unwrap_or_else(|| panic!("{label}: no contact"));
    assert!(
        (deepest.gap + depth).abs() < slack && deepest.normal.dot(&direction) > 1.0 - 1e-3,
        "{label}: {depth} along {direction:?}, but {deepest:?}"
    );
    // none pushes in the opposite direction
    assert!(found.iter().filter(|c| c.gap < 0.0).all(|c| c.normal.dot(&direction) > 0.0), "{label}: {found:?}");
}

const OVERLAPS: [f64; 10] = [1e-3, 5e-3, 0.01, 0.015, 0.02, 0.03, 0.05, 0.1, 0.3, 0.49];

#[test]
fn aligned_cubes_separate_by_their_overlap() {
    let (mesh, block) = (cube(), Shape::cuboid(Vec3::repeat(1.0)).unwrap());
    for (a, b) in [(&mesh, &mesh), (&mesh, &block), (&block, &mesh)] {
        for overlap in OVERLAPS {
            for (k, shift) in [
                (2, Vec3::zeros()),
                (0, Vec3::zeros()),
                (2, Vec3::new(1e-9, 0.7e-9, 0.0)),
                (2, Vec3::new(1e-4, 1e-3, 0.0)),
                (2, Vec3::new(0.01, 0.007, 0.0)),
            ] {
                let direction = Vec3::ith(k, 1.0);
                for (direction, yaw) in
                    [(direction, 0.0), (-direction, 0.0), (direction, if k == 2 { 0.05 } else { 0.0 })]
                {
                    let pose = Pose::from_parts(
                        (direction * (1.0 - overlap) + shift).into(),
                        Quat::from_scaled_axis(Vec3::z() * yaw),
                    );
                    check_separation(
                        &format!("{overlap} {shift:?} {yaw}"),
                        &find_contacts(a, &pose, b, &Pose::identity()),
                        overlap,
                        direction,
                        1e-9,
                    );
                }
            }
        }
    }
}

#[test]
fn aligned_cylinders_separate_by_their_overlap() {
    let cylinder = Shape::cylinder(0.5, 1.0).unwrap();
    let (block, cube) = (Shape::cuboid(Vec3::repeat(1.0)).unwrap(), cube());
    for overlap in OVERLAPS {
        for (name, other) in [("cylinder", &cylinder), ("block", &block), ("cube", &cube)] {
            for (a, b) in [(&cylinder, other), (other, &cylinder)] {
                let stacked = Pose::translation(0.0, 0.0, 1.0 - overlap);
                check_separation(
                    &format!("{overlap} stacked on {name}"),
                    &find_contacts(a, &stacked, b, &Pose::identity()),
                    overlap,
                    Vec3::z(),
                    1e-9,
                );
                let beside = Pose::translation(1.0 - overlap, 0.0, 0.0);
                check_separation(
                    &format!("{overlap} beside {name}"),
                    &find_contacts(a, &beside, b, &Pose::identity()),
                    overlap,
                    Vec3::x(),
                    1e-9,
                );
            }
        }
    }
}

/// Meshes of many faces: their sides are as flat, or within a known chord of the circle.
#[test]
fn aligned_fine_meshes_separate_by_their_overlap() {
    let fine = mesh(TriMesh::cylinder(0.5, 1.0, 32));
    for overlap in OVERLAPS {
        check_separation(
            "stacked",
            &find_contacts(&fine, &Pose::translation(0.0, 0.0, 1.0 - overlap), &fine, &Pose::identity()),
            overlap,
            Vec3::z(),
            1e-6,
        );
        // the corners of the two prisms are at ±0.5
        let beside = find_contacts(&fine, &Pose::translation(1.0 - overlap, 0.0, 0.0), &fine, &Pose::identity());
        let deepest = beside.iter().map(|c| -c.gap).fold(0.0, f64::max);
        let chord = 1.0 - (std::f64::consts::PI / 32.0).cos();
        assert!(deepest > overlap - 2.0 * chord && deepest < overlap + 1e-9, "{overlap}: {beside:?}");
        assert!(beside.iter().filter(|c| c.gap < 0.0).all(|c| c.normal.x > 0.0), "{overlap}: {beside:?}");
    }
}

/// Returns a prism over an L: a unit square without a quarter, one high.
fn angle() -> Shape {
    let outline = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 0.5), (0.5, 1.0), (0.0, 1.0)];
    let vertices = [0.0, 1.0].iter().flat_map(|z| outline.map(|(x, y)| Vec3::new(x, y, *z))).collect();
    let sides = (0..6).flat_map(|k| [[k, (k + 1) % 6, (k + 1) % 6 + 6], [k, (k + 1) % 6 + 6, k + 6]]);
    let ends = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
        .into_iter()
        .flat_map(|[a, b, c]| [[c, b, a], [a + 6, b + 6, c + 6]]);
    mesh(TriMesh { vertices, triangles: sides.chain(ends).collect() })
}

#[test]
fn aligned_angles_separate_by_their_overlap() {
    let angle = angle();
    for overlap in OVERLAPS.into_iter().filter(|x| *x < 0.2) {
        // on each other, and heel to toe
        for direction in [Vec3::z(), Vec3::x()] {
            check_separation(
                &format!("{overlap} {direction:?}"),
                &find_contacts(&angle, &Pose::from(direction * (1.0 - overlap)), &angle, &Pose::identity()),
                overlap,
                direction,
                1e-3,
            );
        }
    }
}

/// Coincident bodies have several equal directions. Any of them is valid: after a translation that
/// satisfies all contacts they are separated.
#[test]
fn coincident_bodies_are_separated() {
    let turned = Quat::from_scaled_axis(Vec3::new(0.2, 0.4, 0.6));
    for (name, shape) in [
        ("cube", cube()),
        ("cylinder", Shape::cylinder(0.5, 1.0).unwrap()),
        ("sphere", mesh(TriMesh::icosphere(0.5, 2))),
        ("ring", mesh(TriMesh::torus(0.4, 0.12, 32, 16))),
    ] {
        for pose in [Pose::identity(), Pose::from_parts(Vec3::zeros().into(), turned)] {
            for shift in [0.0, 1e-6, 1e-3, 0.02, 0.1] {
                let a = Pose::from_parts((pose.translation.vector + Vec3::z() * shift).into(), pose.rotation);
                let found = find_contacts(&shape, &a, &shape, &pose);
                assert!(found.iter().any(|c| c.gap < 0.0), "{name} {shift}: {found:?}");
                let direction = separating_translation(&found);
                let free = Pose::from_parts((a.translation.vector + direction * (1.0 + 1e-4)).into(), a.rotation);
                let left = find_contacts(&shape, &free, &shape, &pose);
                assert!(
                    left.iter().all(|c| c.gap > -1e-4),
                    "{name} {shift}: moved by {direction:?} leaves {left:?} of {found:?}"
                );
            }
        }
    }
}

/// Returns a short translation that resolves all contacts, by projections (Kaczmarz 1937).
fn separating_translation(found: &[Contact]) -> Vec3 {
    let mut direction = Vec3::zeros();
    for contact in found.iter().cycle().take(2000 * found.len()) {
        direction += contact.normal * (-contact.gap - contact.normal.dot(&direction)).max(0.0);
    }
    direction
}
