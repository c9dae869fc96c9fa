//! Readers, checks, generators and mass properties of meshes.

use crate::rng::Rng;
use crate::shared_meshes::text;
use std::f64::consts::PI;
use tumble_collide::{ClosedReport, Mat3, MeshDistance, MeshError, Pose, Quat, Shape, TriMesh, Vec3};

fn assert_near(found: f64, expected: f64, relative: f64, what: &str) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{what}: {found} instead of {expected}");
}

fn check(mesh: &mut TriMesh) -> ClosedReport {
    mesh.check_closed().unwrap()
}

#[test]
fn box_mesh_has_the_mass_of_a_box_wherever_it_is() {
    let half = Vec3::new(0.3, 0.5, 0.9);
    let expected = Shape::cuboid(half).unwrap().mass_properties(700.0).unwrap();
    let turn = Quat::from_scaled_axis(Vec3::new(0.4, -0.7, 1.1));
    let offset = Vec3::new(30.0, -20.0, 10.0);
    let mut mesh = TriMesh::box_(half);
    mesh.vertices.iter_mut().for_each(|v| *v = turn * *v + offset);
    let found = mesh.mass_properties(700.0);
    let r = turn.to_rotation_matrix();
    let inertia: Mat3 = r.matrix() * expected.inertia * r.matrix().transpose();
    assert_near(found.mass, expected.mass, 1e-12, "mass");
    assert!((found.center_of_mass - offset).norm() < 1e-12);
    assert!((found.inertia - inertia).norm() < 1e-11 * inertia.norm());
    // parallel axes: about the origin it is I + m (d² 1 − d dᵀ)
    let shifted = inertia + expected.mass * (Mat3::identity() * offset.norm_squared() - offset * offset.transpose());
    assert!((found.inertia_about(&Vec3::zeros()) - shifted).norm() < 1e-11 * shifted.norm());
}

#[test]
fn fine_torus_and_ball_tend_to_their_closed_forms() {
    let (big, small, n) = (1.0, 0.3, 400);
    let torus = TriMesh::torus(big, small, n, n).mass_properties(1.0);
    assert_near(torus.mass, 2.0 * PI * PI * big * small * small, 2e-4, "torus");
    // Izz = m (R² + 3/4 r²), Ixx = m (R²/2 + 5/8 r²)
    assert_near(torus.inertia[(2, 2)], torus.mass * (big * big + 0.75 * small * small), 2e-4, "torus Izz");
    assert_near(torus.inertia[(0, 0)], torus.mass * (0.5 * big * big + 0.625 * small * small), 2e-4, "torus Ixx");
    let ball = TriMesh::icosphere(2.0, 6).mass_properties(1.0);
    assert_near(ball.mass, 32.0 / 3.0 * PI, 1e-3, "ball");
    assert_near(ball.inertia[(1, 1)], 0.4 * ball.mass * 4.0, 1e-3, "ball I");
}

#[test]
fn every_generator_makes_a_faultless_solid_of_the_right_volume() {
    let cone = TriMesh::lathe(&[(0.0, 1.0), (0.5, 0.0), (0.0, 0.0)], 256).unwrap();
    let meshes = [
        ("box", TriMesh::box_(Vec3::new(1.0, 2.0, 3.0)), 48.0),
        ("uv sphere", TriMesh::uv_sphere(1.0, 128, 64), 4.0 / 3.0 * PI),
        ("icosphere", TriMesh::icosphere(1.0, 4), 4.0 / 3.0 * PI),
        ("cylinder", TriMesh::cylinder(0.5, 2.0, 128), PI),
        ("capsule", TriMesh::capsule(0.5, 1.0, 128, 32), 0.5 * PI + PI / 6.0),
        ("torus", TriMesh::torus(1.0, 0.25, 128, 64), 2.0 * PI * PI / 16.0),
        ("cone", cone, PI * 0.25 / 3.0),
    ];
    for (name, mut mesh, volume) in meshes {
        let before = mesh.clone();
        let report = check(&mut mesh);
        assert_eq!((report.notes(), report.shells), (vec![], 1), "{name}");
        assert_eq!(before.triangles.len(), mesh.triangles.len(), "{name}");
        assert_near(report.volume, volume, 5e-3, name);
    }
}

#[test]
fn lathe_refuses_profiles_that_make_no_solid() {
    let bad: [&[(f64, f64)]; 5] = [
        &[(0.0, 0.0), (0.0, 1.0)],
        &[(0.1, 0.0), (1.0, 0.5), (0.0, 1.0)],
        &[(0.0, 0.0), (-1.0, 0.5), (0.0, 1.0)],
        &[(0.0, 0.0), (1.0, f64::NAN), (0.0, 1.0)],
        &[(0.0, 0.0), (1.0, 0.5), (1.0, 0.5), (0.0, 1.0)],
    ];
    for profile in bad {
        assert!(matches!(TriMesh::lathe(profile, 16), Err(MeshError::Profile { .. })), "{profile:?}");
    }
}

#[test]
fn obj_forms_are_read() {
    let obj = "# a tetrahedron and a quad\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nv 0 0 1\nf 1/1/1 3//1 2/5\nf -4 -3 -1\nf 1 2 3 4\n";
    let mesh = TriMesh::from_obj(obj).unwrap();
    assert_eq!(mesh.vertices.len(), 4);
    assert_eq!(mesh.triangles, vec![[0, 2, 1], [0, 1, 3], [0, 1, 2], [0, 2, 3]]);
}

#[test]
fn obj_errors_name_the_line() {
    let cases = [
        ("v 0 0\n", "line 1: a vertex of fewer than 3 numbers"),
        ("v 0 0 0\nv 0 x 0\n", "line 2: `x` where a coordinate should be"),
        ("v 0 0 0\nf 1 1\n", "line 2: a face of 2 corners, but it needs at least 3"),
        ("v 0 0 0\nf 1 1 q/2\n", "line 2: `q/2` where a vertex number should be"),
        ("v 0 0 0\n\nf 1 1 0\n", "line 3: face 1 points at vertex 0, but there are 1 vertices"),
        ("v 0 0 nan\n", "line 1: vertex 1 is (0, 0, NaN), but coordinates must be finite"),
        ("", "the mesh has no triangles; at least 4 are needed to close a solid"),
    ];
    for (obj, message) in cases {
        assert_eq!(TriMesh::from_obj(obj).unwrap_err().to_string(), message);
    }
}

fn binary_stl(mesh: &TriMesh) -> Vec<u8> {
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for t in 0..mesh.triangles.len() {
        bytes.extend([0; 12]);
        mesh.corners(t).iter().flatten().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_text_and_binary_agree_and_are_welded() {
    let mesh = TriMesh::box_(Vec3::new(0.5, 1.0, 1.5));
    let mut from_binary = TriMesh::from_stl(&binary_stl(&mesh)).unwrap();
    let mut lines = String::from("solid box\n");
    for t in 0..12 {
        let [a, b, c] = mesh.corners(t).map(|v| format!("vertex {} {} {:e}\n", v.x, v.y, v.z));
        lines += &format!("facet normal 0 0 0\nouter loop\n{a}{b}{c}endloop\nendfacet\n");
    }
    lines += "endsolid box\n";
    assert_eq!(TriMesh::from_stl(lines.as_bytes()).unwrap(), from_binary);
    assert_eq!(from_binary.vertices.len(), 8);
    assert_near(check(&mut from_binary).volume, 6.0, 1e-12, "volume");
}

#[test]
fn stl_that_lies_about_its_size_is_one_clear_error() {
    let mut bytes = binary_stl(&TriMesh::box_(Vec3::repeat(1.0)));
    bytes[80..84].copy_from_slice(&42_949_672_u32.to_le_bytes());
    let message = TriMesh::from_stl(&bytes).unwrap_err().to_string();
    assert_eq!(message, "the STL header announces 42949672 triangles (2147483684 bytes), but the file has 684 bytes");
    assert!(matches!(TriMesh::from_stl(b"hello"), Err(MeshError::StlShort { size: 5 })));
    assert!(matches!(TriMesh::from_stl(b"solid x\nfacet\nvertex 1 2 x\n"), Err(MeshError::Syntax { line: 3, .. })));
    assert!(matches!(
        TriMesh::from_stl(b"solid x\nfacet\nvertex 1 2 3\nendfacet\n"),
        Err(MeshError::Syntax { line: 4, .. })
    ));
    let mut nan = binary_stl(&TriMesh::box_(Vec3::repeat(1.0)));
    nan[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(matches!(TriMesh::from_stl(&nan), Err(MeshError::NotFiniteInFace { face: 2, .. })));
}

/// The outcomes that `bad/README.md` asks for, as far as they can be had without a repairing remesher.
#[test]
fn bad_meshes_are_mended_or_refused_with_a_reason() {
    let Some(spot) = text("spot.obj") else { return };
    let spot_volume = check(&mut TriMesh::from_obj(&spot).unwrap()).volume;
    assert_near(spot_volume, 0.679729, 1e-5, "spot, against trimesh");
    let read = |name: &str| TriMesh::from_obj(&text(&format!("bad/{name}.obj")).unwrap_or_default());
    let solid = |name: &str| {
        let mut mesh = read(name).unwrap();
        let report = mesh.check_closed().unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(!report.notes().is_empty(), "{name} must be told");
        report
    };
    let error = |name: &str| read(name).and_then(|mut m| m.check_closed()).unwrap_err();

    let report = solid("degenerate");
    assert_eq!(report.degenerate_faces, 3);
    assert_near(report.volume, spot_volume, 1e-9, "degenerate");
    assert!(solid("inside_out").turned);
    assert_near(solid("inside_out").volume, spot_volume, 1e-9, "inside_out");
    let report = solid("flipped_some");
    assert!((150..=180).contains(&report.flipped_faces), "{report:?}");
    assert_near(report.volume, spot_volume, 1e-9, "flipped_some");
    let report = solid("dup_shell");
    assert_eq!(report.duplicate_faces, 1654);
    assert_near(report.volume, spot_volume, 1e-9, "dup_shell");
    let report = solid("nonmanifold_edge");
    assert_eq!(report.nonmanifold_edges, 1);
    assert_near(report.volume, 2.0, 1e-9, "nonmanifold_edge");
    assert_eq!(solid("self_intersecting").shells, 2);

    assert!(matches!(error("flat"), MeshError::NoVolume { .. }));
    assert_eq!(error("empty"), MeshError::Empty);
    assert!(error("nan_vertex").to_string().contains("vertex 18 "), "{}", error("nan_vertex"));
    assert!(error("inf_vertex").to_string().contains("vertex 18 "), "{}", error("inf_vertex"));
    assert!(error("index_out_of_range").to_string().contains("face 13 points at vertex 100, but there are 8"));
    // 36 faces around one point leave one hole
    assert!(
        matches!(error("open_hole"), MeshError::Open { holes: 1, edges, first_hole, .. } if edges == first_hole),
        "{}",
        error("open_hole")
    );
    assert!(
        matches!(error("nonmanifold_fin"), MeshError::NonManifold { faces: 3, open: 2, face: 13, .. }),
        "{}",
        error("nonmanifold_fin")
    );
    for name in ["nan_vertex", "inf_vertex", "index_out_of_range", "open_hole", "nonmanifold_fin", "flat"] {
        eprintln!("{name}: {}", error(name));
    }
}

#[test]
fn good_meshes_are_closed_with_the_volume_that_trimesh_finds() {
    for (name, volume) in
        [("bunny", 0.749334), ("torus", 1.21878), ("panda_link5", 0.0034191), ("cow", 53.5674), ("fertility", 432186.0)]
    {
        let Some(obj) = text(&format!("{name}.obj")) else { return };
        let mut mesh = TriMesh::from_obj(&obj).unwrap();
        let report = check(&mut mesh);
        // trimesh counts twice what the cow's surface goes around twice
        assert_near(mesh.signed_volume(), volume, 2e-5, name);
        let overlap = mesh.signed_volume() - report.volume;
        assert!(overlap >= 0.0 && (report.crossing_faces > 0 || overlap < 1e-12 * volume), "{name}: {overlap}");
    }
}

#[test]
fn signed_distance_of_a_fine_ball_is_that_of_a_ball() {
    let ball = MeshDistance::new(&TriMesh::icosphere(1.0, 5));
    let box_mesh = MeshDistance::new(&TriMesh::box_(Vec3::repeat(1.0)));
    for n in 0..500 {
        let p = Pose::rotation(Vec3::new(0.1, 0.2, 0.3) * f64::from(n))
            * nalgebra::Point3::new(0.005 * f64::from(n), 0.3, 0.1);
        assert!((ball.closest(&p.coords).signed_distance - (p.coords.norm() - 1.0)).abs() < 2e-3);
        let q = p.coords.abs().add_scalar(-1.0);
        let expected = q.map(|x| x.max(0.0)).norm() + q.max().min(0.0);
        assert!((box_mesh.closest(&p.coords).signed_distance - expected).abs() < 1e-12);
    }
}

/// Damage to any byte gives a mesh or an error, never a panic, and a mesh that passes the check has a volume.
#[test]
fn damaged_files_are_read_or_refused() {
    let ball = TriMesh::icosphere(1.0, 1);
    let mut obj: String = ball.vertices.iter().map(|v| format!("v {:.3} {:.3} {:.3}\n", v.x, v.y, v.z)).collect();
    obj.extend(ball.triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1)));
    let (obj, stl) = (obj.into_bytes(), binary_stl(&ball));
    let mut rng = Rng::new(9);
    let (mut read, mut refused) = (0, 0);
    for case in 0..6000 {
        let mut bytes = if case % 2 == 0 { obj.clone() } else { stl.clone() };
        for _ in 0..1 + rng.below(4) {
            let place = rng.below(bytes.len());
            bytes[place] = if case % 4 < 2 { b"0123456789-+.e/ \nvf"[rng.below(19)] } else { rng.below(256) as u8 };
        }
        if rng.below(8) == 0 {
            bytes.truncate(rng.below(bytes.len()));
        }
        let mesh =
            if case % 2 == 0 { TriMesh::from_obj(&String::from_utf8_lossy(&bytes)) } else { TriMesh::from_stl(&bytes) };
        match mesh.and_then(|mut m| m.check_closed()) {
            Ok(report) => {
                assert!(report.volume > 0.0);
                read += 1;
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        }
    }
    assert!(read > 100 && refused > 1000, "{read} {refused}");
}

#[test]
fn errors_number_faces_as_the_user_sees_them() {
    // an unused vertex, a degenerate face and a doubled vertex come before the box that lacks its last face
    let mut mesh = TriMesh::box_(Vec3::repeat(1.0));
    mesh.triangles.pop();
    mesh.triangles.iter_mut().flatten().for_each(|v| *v += 2);
    mesh.triangles.insert(0, [2, 2, 3]);
    mesh.vertices.splice(0..0, [Vec3::repeat(9.0), Vec3::repeat(-1.0)]);
    let error = mesh.check_closed().unwrap_err();
    let MeshError::Open { edges: 3, holes: 1, from, to, face, .. } = error else { panic!("{error}") };
    let corners = mesh.triangles[face - 1];
    assert!(corners.contains(&(from - 1)) && corners.contains(&(to - 1)), "{error}");
}
