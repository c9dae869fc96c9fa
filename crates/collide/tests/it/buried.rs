//! Meshes of overlapping shells: features inside another shell have no contacts.

use crate::rng::Rng;
use tumble_collide::{Contact, ContactMode, MeshDistance, Pose, Shape, TreeSettings, TriMesh, Vec3, contacts_in_mode};

/// Returns boxes, given by half extents and center, as one mesh.
fn boxes(all: &[(Vec3, Vec3)]) -> TriMesh {
    let mut mesh = TriMesh { vertices: Vec::new(), triangles: Vec::new() };
    for (half, center) in all {
        let one = TriMesh::cuboid(2.0 * half).translated(center);
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(one.vertices);
        mesh.triangles.extend(one.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    mesh
}

/// Returns the shape, and the pose that places the mesh's own origin at the world's.
fn shape(mesh: &TriMesh) -> (Shape, Pose) {
    let shape = Shape::mesh(mesh.clone(), &TreeSettings::octree()).unwrap();
    let Shape::Mesh(made) = &shape else { panic!("no mesh") };
    let offset = mesh.aabb().min - made.mesh().aabb().min;
    (shape, Pose::from_parts(offset.into(), Default::default()))
}

fn find_contacts(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose, margin: f64) -> Vec<Contact> {
    let mut out = Vec::new();
    contacts_in_mode(ContactMode::Surface, a, pa, b, pb, margin, &mut out);
    out
}

/// Returns a tall box, and a lower one that extends into its side.
fn step() -> TriMesh {
    boxes(&[(Vec3::repeat(0.5), Vec3::zeros()), (Vec3::new(0.5, 0.4, 0.25), Vec3::new(0.8, 0.0, -0.15))])
}

#[test]
fn buried_corners_do_not_touch_a_plane() {
    let (shape, pose) = shape(&step());
    // the lower box's bottom is 0.1 above the taller one's; the plane is 0.15 above that
    let ground = Pose::translation(0.0, 0.0, -0.35);
    let found = find_contacts(&shape, &pose, &Shape::half_space(), &ground, 0.01);
    let place = |c: &Contact| c.point - 0.5 * c.gap.abs() * c.normal;
    for c in &found {
        let p = place(c);
        let corner = if p.x > 0.6 { Vec3::new(1.3, 0.4, -0.4) } else { Vec3::new(0.5, 0.5, -0.5) };
        assert!((p.abs() - corner.abs()).norm() < 1e-9, "{p:?} is no free corner: {found:?}");
        assert!((c.gap - (corner.z + 0.35)).abs() < 1e-9 && c.normal == Vec3::z());
    }
    // all four corners of the one, two of the other
    assert_eq!(found.len(), 6, "{found:?}");
}

#[test]
fn a_sphere_in_the_seam_touches_both_boxes() {
    let (shape, pose) = shape(&step());
    let (r, deep) = (0.05, 1e-4);
    let sphere = Shape::sphere(r).unwrap();
    // the taller one's side is x = 0.5, the lower one's top z = 0.1
    let at = Pose::translation(0.5 + r - deep, 0.03, 0.1 + r - 2.0 * deep);
    let mut found = find_contacts(&sphere, &at, &shape, &pose, 1e-3);
    found.sort_by(|a, b| a.gap.total_cmp(&b.gap));
    let gaps: Vec<(f64, Vec3)> = found.iter().map(|c| (c.gap, c.normal)).collect();
    assert_eq!(gaps.len(), 2, "{found:?}");
    for ((gap, normal), (depth, way)) in gaps.iter().zip([(2.0 * deep, Vec3::z()), (deep, Vec3::x())]) {
        assert!((gap + depth).abs() < 1e-9 && (normal - way).norm() < 1e-9, "{found:?}");
    }
    assert_ne!(found[0].feature, found[1].feature);
}

#[test]
fn gaps_are_those_of_the_union() {
    let meshes = [
        step(),
        boxes(&[
            (Vec3::new(0.5, 0.1, 0.1), Vec3::zeros()),
            (Vec3::new(0.1, 0.5, 0.1), Vec3::new(0.1, 0.05, 0.03)),
            (Vec3::repeat(0.02), Vec3::zeros()),
        ]),
    ];
    let mut rng = Rng::new(6);
    for mesh in &meshes {
        let (shape, pose) = shape(mesh);
        let union = MeshDistance::new(mesh);
        let (sphere, mut near) = (Shape::sphere(0.03).unwrap(), 0);
        for _ in 0..8000 {
            let p = rng.vec(1.0);
            let truth = union.closest(&p).signed_distance - 0.03;
            // apart, and overlapping with the sphere's center outside
            if (-0.03..0.05).contains(&truth) {
                near += 1;
                let found =
                    find_contacts(&sphere, &Pose::from_parts(p.into(), Default::default()), &shape, &pose, 0.05);
                let gap = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
                assert!((gap - truth).abs() < 1e-9, "at {p:?}: {gap} but {truth}");
            }
        }
        assert!(near > 100, "only {near} near");
    }
}

#[test]
fn no_contact_lies_inside_the_union() {
    let mesh = step();
    let ((shape, pose), union) = (shape(&mesh), MeshDistance::new(&mesh));
    let block = Shape::cuboid(Vec3::new(0.4, 0.2, 0.3)).unwrap();
    let (mut rng, mut count) = (Rng::new(8), 0);
    for _ in 0..5000 {
        let other = rng.pose(1.0);
        let found = find_contacts(&block, &other, &shape, &pose, 0.01);
        // in deep overlaps, points on the surface are exact along the normal only
        for c in found.iter().filter(|c| c.gap > -0.02) {
            let on_mesh = c.point - 0.5 * c.gap * c.normal;
            count += 1;
            assert!(union.closest(&on_mesh).signed_distance.abs() < 1e-6 + c.gap.abs(), "{c:?}");
        }
    }
    assert!(count > 300, "only {count} contacts");
}

#[test]
fn a_shell_within_another_changes_nothing() {
    let (alone, pose) = shape(&boxes(&[(Vec3::repeat(0.5), Vec3::zeros())]));
    let (both, pose_of_both) =
        shape(&boxes(&[(Vec3::repeat(0.5), Vec3::zeros()), (Vec3::repeat(0.45), Vec3::zeros())]));
    let mut rng = Rng::new(9);
    let block = Shape::cuboid(Vec3::new(0.4, 0.2, 0.3)).unwrap();
    let mut touching = 0;
    for _ in 0..300 {
        let other = rng.pose(0.9);
        let [one, two] = [(&alone, &pose), (&both, &pose_of_both)]
            .map(|(shape, pose)| find_contacts(&block, &other, shape, pose, 0.01));
        assert_eq!(one.len(), two.len());
        touching += usize::from(!one.is_empty());
        for (c, d) in one.iter().zip(&two) {
            assert!((c.point - d.point).norm() < 1e-9 && (c.gap - d.gap).abs() < 1e-9, "{c:?} {d:?}");
        }
    }
    assert!(touching > 50, "only {touching} touch");
}
