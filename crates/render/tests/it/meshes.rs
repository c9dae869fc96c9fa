//! Mesh constructors against closed forms: volume by the divergence theorem, area, orientation,
//! crease splitting.

use nalgebra::Vector3;
use std::f32::consts::PI;
use tumble_render::{MeshData, RenderError};

/// Six times the signed volume under each triangle, summed.
fn volume(mesh: &MeshData) -> f32 {
    triangles(mesh).map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum()
}

fn area(mesh: &MeshData) -> f32 {
    triangles(mesh).map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0).sum()
}

fn triangles(mesh: &MeshData) -> impl Iterator<Item = [Vector3<f32>; 3]> {
    mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| Vector3::from(mesh.positions[i as usize])))
}

/// Largest angle between a vertex normal and the normal of a triangle that uses it.
fn worst_normal(mesh: &MeshData) -> f32 {
    let mut worst = 0f32;
    for t in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| Vector3::from(mesh.positions[i as usize]));
        let face = (b - a).cross(&(c - a));
        worst = t.iter().fold(worst, |w, &i| w.max(face.angle(&Vector3::from(mesh.normals[i as usize]))));
    }
    worst
}

#[test]
fn solids_have_their_volume_and_outward_normals() {
    let (r, h) = (0.7f32, 1.1f32);
    let solids = [
        ("box", MeshData::cuboid([2.0, 4.0, 6.0]), 48.0, 88.0, 1e-3),
        ("unit box", MeshData::unit_box(), 1.0, 6.0, 1e-3),
        ("sphere", MeshData::uv_sphere(r, 64), 4.0 / 3.0 * PI * r * r * r, 4.0 * PI * r * r, 0.05),
        ("cylinder", MeshData::cylinder(r, 2.0 * h, 128), PI * r * r * 2.0 * h, 2.0 * PI * r * (r + 2.0 * h), 0.05),
        (
            "capsule",
            MeshData::capsule(r, 2.0 * h, 128),
            PI * r * r * (2.0 * h + 4.0 / 3.0 * r),
            2.0 * PI * r * (2.0 * h + 2.0 * r),
            0.05,
        ),
    ];
    for (name, mesh, true_volume, true_area, normal_tolerance) in solids {
        mesh.validate().expect(name);
        assert!((volume(&mesh) / true_volume - 1.0).abs() < 2e-3, "{name}: volume {} not {true_volume}", volume(&mesh));
        assert!((area(&mesh) / true_area - 1.0).abs() < 2e-3, "{name}: area {} not {true_area}", area(&mesh));
        assert!(worst_normal(&mesh) < normal_tolerance, "{name}: a normal is off by {}", worst_normal(&mesh));
        assert!(
            mesh.normals.iter().all(|n| (Vector3::from(*n).norm() - 1.0).abs() < 1e-5),
            "{name}: normals of length 1"
        );
    }
}

#[test]
fn a_rounded_box_is_the_sum_of_a_box_and_a_ball() {
    // Steiner: V = V0 + A0 r + (sum of the 12 edges) pi r^2 / 4 + 4/3 pi r^3 for the core of half
    // extents h - r
    let (half, r) = ([1.0f32, 1.5, 2.0], 0.4f32);
    let [a, b, c] = half.map(|h| 2.0 * (h - r));
    let expected =
        a * b * c + 2.0 * (a * b + b * c + c * a) * r + (a + b + c) * PI * r * r + 4.0 / 3.0 * PI * r * r * r;
    let mesh = MeshData::rounded_cuboid(half.map(|h| 2.0 * h), r, 12);
    assert!((volume(&mesh) / expected - 1.0).abs() < 2e-3, "{} not {expected}", volume(&mesh));
    assert!(worst_normal(&mesh) < 0.1, "{}", worst_normal(&mesh));
}

#[test]
fn creases_split_and_smooth_edges_do_not() {
    let cube = MeshData::unit_box();
    let mut points: Vec<[f32; 3]> = cube.positions.clone();
    points.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
    points.dedup();
    assert_eq!(points.len(), 8);
    let at = |p: &[f32; 3]| points.iter().position(|q| q == p).expect("a corner") as u32;
    let faces: Vec<[u32; 3]> =
        cube.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| at(&cube.positions[i as usize]))).collect();
    let sharp = MeshData::from_triangles(&points, &faces, 0.5).expect("valid");
    assert_eq!(sharp.positions.len(), 24, "each corner of a cube splits in three");
    assert!(worst_normal(&sharp) < 1e-3);
    let soft = MeshData::from_triangles(&points, &faces, PI).expect("valid");
    assert_eq!(soft.positions.len(), 8, "no split at a crease angle of 180 degrees");
    for (p, n) in soft.positions.iter().zip(&soft.normals) {
        // weighted by angle, each of the three faces counts 90 degrees: the normal is the diagonal
        // however faces are cut
        assert!((Vector3::from(*n) - Vector3::from(*p).normalize()).norm() < 1e-5, "{n:?} at {p:?}");
    }
}

#[test]
fn bad_meshes_are_refused() {
    let p = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let message = |r: Result<MeshData, RenderError>| r.expect_err("refused").to_string();
    assert!(message(MeshData::from_triangles(&p, &[[0, 1, 3]], 0.5)).contains("index 3 in a mesh of 3 vertices"));
    assert!(
        message(MeshData::from_triangles(&[[0.0; 3], [f32::NAN; 3], [1.0; 3]], &[[0, 1, 2]], 0.5))
            .contains("position 1")
    );
    let flat = MeshData::from_triangles(&p, &[[0, 1, 1], [0, 1, 2]], 0.5).expect("flat triangles are dropped");
    assert_eq!(flat.indices.len(), 3);
    let mut torn = MeshData::unit_box();
    torn.normals.pop();
    assert!(torn.validate().expect_err("refused").to_string().contains("23 normals for 24 positions"));
}
