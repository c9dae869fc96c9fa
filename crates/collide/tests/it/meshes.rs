//! Readers, checks, generators and mass properties of meshes.

use crate::rng::Rng;
use crate::shared_meshes::text;
use std::f64::consts::PI;
use tumble_collide::{
    ClosedReport, Mat3, MeshDistance, MeshError, Pose, Quat, Shape, SphereTree, TreeSettings, TriMesh, Vec3,
    decode_text,
};

fn assert_near(found: f64, expected: f64, relative: f64, what: &str) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{what}: {found} instead of {expected}");
}

fn check(mesh: &mut TriMesh) -> ClosedReport {
    mesh.check_closed().unwrap()
}

#[test]
fn box_mesh_has_the_mass_of_a_box_wherever_it_is() {
    let half = Vec3::new(0.3, 0.5, 0.9);
    let expected = Shape::cuboid(2.0 * half).unwrap().mass_properties(700.0).unwrap();
    let turn = Quat::from_scaled_axis(Vec3::new(0.4, -0.7, 1.1));
    let offset = Vec3::new(30.0, -20.0, 10.0);
    let mut mesh = TriMesh::cuboid(2.0 * half);
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
fn fine_torus_and_sphere_tend_to_their_closed_forms() {
    let (big, small, n) = (1.0, 0.3, 400);
    let torus = TriMesh::torus(big, small, n, n).mass_properties(1.0);
    assert_near(torus.mass, 2.0 * PI * PI * big * small * small, 2e-4, "torus");
    // Izz = m (R² + 3/4 r²), Ixx = m (R²/2 + 5/8 r²)
    assert_near(torus.inertia[(2, 2)], torus.mass * (big * big + 0.75 * small * small), 2e-4, "torus Izz");
    assert_near(torus.inertia[(0, 0)], torus.mass * (0.5 * big * big + 0.625 * small * small), 2e-4, "torus Ixx");
    let sphere = TriMesh::icosphere(2.0, 6).mass_properties(1.0);
    assert_near(sphere.mass, 32.0 / 3.0 * PI, 1e-3, "sphere");
    assert_near(sphere.inertia[(1, 1)], 0.4 * sphere.mass * 4.0, 1e-3, "sphere I");
}

#[test]
fn every_generator_makes_a_faultless_solid_of_the_right_volume() {
    let cone = TriMesh::lathe(&[(0.0, 1.0), (0.5, 0.0), (0.0, 0.0)], 256).unwrap();
    let meshes = [
        ("box", TriMesh::cuboid(Vec3::new(2.0, 4.0, 6.0)), 48.0),
        ("uv sphere", TriMesh::uv_sphere(1.0, 128, 64), 4.0 / 3.0 * PI),
        ("icosphere", TriMesh::icosphere(1.0, 4), 4.0 / 3.0 * PI),
        ("cylinder", TriMesh::cylinder(0.5, 4.0, 128), PI),
        ("capsule", TriMesh::capsule(0.5, 2.0, 128, 32), 0.5 * PI + PI / 6.0),
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
        ("v 0 0 0\n\nf 1 1 0\n", "line 3: face 1 refers to vertex 0, but there are 1 vertices"),
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
    let mesh = TriMesh::cuboid(Vec3::new(1.0, 2.0, 3.0));
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
    let mut bytes = binary_stl(&TriMesh::cuboid(Vec3::repeat(2.0)));
    bytes[80..84].copy_from_slice(&42_949_672_u32.to_le_bytes());
    let message = TriMesh::from_stl(&bytes).unwrap_err().to_string();
    assert_eq!(message, "the STL header announces 42949672 triangles (2147483684 bytes), but the file has 684 bytes");
    assert!(matches!(TriMesh::from_stl(b"hello"), Err(MeshError::StlShort { size: 5 })));
    assert!(matches!(TriMesh::from_stl(b"solid x\nfacet\nvertex 1 2 x\n"), Err(MeshError::Syntax { line: 3, .. })));
    assert!(matches!(
        TriMesh::from_stl(b"solid x\nfacet\nvertex 1 2 3\nendfacet\n"),
        Err(MeshError::Syntax { line: 4, .. })
    ));
    let mut nan = binary_stl(&TriMesh::cuboid(Vec3::repeat(2.0)));
    nan[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(matches!(TriMesh::from_stl(&nan), Err(MeshError::NotFiniteInFace { face: 2, .. })));
}

/// The results stated in `bad/README.md`, as far as they are possible without remeshing.
#[test]
fn bad_meshes_are_mended_or_refused_with_a_reason() {
    let Some(spot) = text("spot.obj") else { return };
    let spot_volume = check(&mut TriMesh::from_obj(&spot).unwrap()).volume;
    assert_near(spot_volume, 0.679729, 1e-5, "spot, against trimesh");
    let read = |name: &str| TriMesh::from_obj(&text(&format!("bad/{name}.obj")).unwrap_or_default());
    let solid = |name: &str| {
        let mut mesh = read(name).unwrap();
        let report = mesh.check_closed().unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(!report.notes().is_empty(), "{name} must be reported");
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
    assert!(error("index_out_of_range").to_string().contains("face 13 refers to vertex 100, but there are 8"));
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
fn signed_distance_of_a_fine_sphere_is_that_of_a_sphere() {
    let sphere = MeshDistance::new(&TriMesh::icosphere(1.0, 5));
    let box_mesh = MeshDistance::new(&TriMesh::cuboid(Vec3::repeat(2.0)));
    for n in 0..500 {
        let p = Pose::rotation(Vec3::new(0.1, 0.2, 0.3) * f64::from(n))
            * nalgebra::Point3::new(0.005 * f64::from(n), 0.3, 0.1);
        assert!((sphere.closest(&p.coords).signed_distance - (p.coords.norm() - 1.0)).abs() < 2e-3);
        let q = p.coords.abs().add_scalar(-1.0);
        let expected = q.map(|x| x.max(0.0)).norm() + q.max().min(0.0);
        assert!((box_mesh.closest(&p.coords).signed_distance - expected).abs() < 1e-12);
    }
}

/// Damage to any byte gives a mesh or an error, never a panic, and a mesh that passes the check has
/// a volume.
#[test]
fn damaged_files_are_read_or_refused() {
    let sphere = TriMesh::icosphere(1.0, 1);
    let mut obj: String = sphere.vertices.iter().map(|v| format!("v {:.3} {:.3} {:.3}\n", v.x, v.y, v.z)).collect();
    obj.extend(sphere.triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1)));
    let (obj, stl) = (obj.into_bytes(), binary_stl(&sphere));
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
    // an unused vertex, a degenerate face and a doubled vertex come before the box that lacks its
    // last face
    let mut mesh = TriMesh::cuboid(Vec3::repeat(2.0));
    mesh.triangles.pop();
    mesh.triangles.iter_mut().flatten().for_each(|v| *v += 2);
    mesh.triangles.insert(0, [2, 2, 3]);
    mesh.vertices.splice(0..0, [Vec3::repeat(9.0), Vec3::repeat(-1.0)]);
    let error = mesh.check_closed().unwrap_err();
    let MeshError::Open { edges: 3, holes: 1, from, to, face, .. } = error else { panic!("{error}") };
    let corners = mesh.triangles[face - 1];
    assert!(corners.contains(&(from - 1)) && corners.contains(&(to - 1)), "{error}");
}

/// A prism of height 1 over a polygon, its faces as polygons, and the polygon's area by the
/// shoelace formula.
fn prism(outline: &[[f64; 2]]) -> (String, f64) {
    let n = outline.len();
    let vertices: String =
        [0.0, 1.0].iter().flat_map(|z| outline.iter().map(move |[x, y]| format!("v {x} {y} {z}\n"))).collect();
    let (bottom, top): (String, String) =
        ((1..=n).rev().map(|k| format!(" {k}")).collect(), (n + 1..=2 * n).map(|k| format!(" {k}")).collect());
    let sides: String =
        (0..n).map(|k| (k + 1, (k + 1) % n + 1)).map(|(a, b)| format!("f {a} {b} {} {}\n", b + n, a + n)).collect();
    let area: f64 =
        (0..n).map(|k| (outline[k], outline[(k + 1) % n])).map(|(p, q)| 0.5 * (p[0] * q[1] - q[0] * p[1])).sum();
    (format!("{vertices}f{bottom}\nf{top}\n{sides}"), area)
}

/// Returns the outlines, each starting at every one of its corners: a fan is valid from some of
/// them at best.
fn concave() -> Vec<Vec<[f64; 2]>> {
    let star = (0..20)
        .map(|k| (f64::from(k) * PI / 10.0, if k % 2 == 1 { 1.0 } else { 0.3 }))
        .map(|(a, r)| [r * a.cos(), r * a.sin()])
        .collect();
    let comb = (0..9)
        .flat_map(|k| [[f64::from(2 * k), 0.2 + f64::from(k % 2)], [f64::from(2 * k) + 0.5, 3.0]])
        .rev()
        .chain([[0.0, 0.0], [17.0, 0.0]])
        .collect();
    let outlines: [Vec<[f64; 2]>; 5] = [
        vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]],
        vec![[4.0, 0.0], [0.0, 2.0], [1.0, 0.0], [0.0, -2.0]],
        // a square with a square hole, joined by a cut that is traversed twice
        vec![
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ],
        star,
        comb,
    ];
    outlines
        .into_iter()
        .flat_map(|outline| (0..outline.len()).map(move |k| [&outline[k..], &outline[..k]].concat()))
        .collect()
}

#[test]
fn concave_faces_are_cut_without_folds() {
    for outline in concave() {
        let (obj, area) = prism(&outline);
        let mut mesh = TriMesh::from_obj(&obj).unwrap();
        assert_eq!(mesh.triangles.len(), 2 * (outline.len() - 2) + 2 * outline.len(), "{outline:?}");
        // the triangles of the two ends have the area of the outline: folds would have more
        let flat = |t: usize| {
            let [a, b, c] = mesh.corners(t);
            a.z == b.z && b.z == c.z
        };
        let ends: f64 = (0..mesh.triangles.len())
            .filter(|t| flat(*t))
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                0.5 * (b - a).cross(&(c - a)).norm()
            })
            .sum();
        assert_near(ends, 2.0 * area, 1e-12, &format!("{outline:?}"));
        assert_near(mesh.check_closed().unwrap().volume, area, 1e-12, &format!("{outline:?}"));
    }
}

#[test]
fn a_fan_that_is_right_stays_and_hostile_faces_end() {
    let (obj, _) = prism(&(0..64).map(|k| f64::from(k) * PI / 32.0).map(|a| [a.cos(), a.sin()]).collect::<Vec<_>>());
    let mesh = TriMesh::from_obj(&obj).unwrap();
    assert!(mesh.triangles[..62].iter().enumerate().all(|(k, t)| *t == [63, 62 - k as u32, 61 - k as u32]));
    // a zigzag with more corners than the limit, and a face that crosses itself
    let zigzag: String = (0..5001)
        .map(|k| format!("v {k} {} 0\n", k % 2 * 100))
        .chain(["f".into()])
        .chain((1..=5001).map(|k| format!(" {k}")))
        .collect();
    let error = TriMesh::from_obj(&zigzag).unwrap_err().to_string();
    assert!(error.starts_with("line 5002: a concave face has 5001 corners; at most 5000"), "{error}");
    let star: String =
        (0..7).map(|k| f64::from(3 * k) * PI / 3.5).map(|a| format!("v {} {} 0\n", a.cos(), a.sin())).collect();
    assert_eq!(TriMesh::from_obj(&(star + "f 1 2 3 4 5 6 7\n")).unwrap().triangles.len(), 5);
}

/// The L that a fan folds: the sheet over its notch has no thickness and is not part of the solid.
#[test]
fn a_sheet_over_a_notch_does_not_break_the_bound_of_a_tree() {
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let mut mesh = TriMesh::from_obj(&prism(&outline).0).unwrap();
    let fan = |from: u32, down: bool| {
        (1..5).map(move |k| if down { [from + 5, from + 5 - k, from + 4 - k] } else { [from, from + k, from + k + 1] })
    };
    mesh.triangles.splice(..8, fan(0, true).chain(fan(6, false)).collect::<Vec<_>>());
    assert!(mesh.check_closed().unwrap().crossing_faces > 0);
    // the distance from the L, exact outside
    let block = |p: &Vec3, x: f64, y: f64| {
        let q = (p - Vec3::new(0.5 * x, 0.5 * y, 0.5)).abs() - Vec3::new(0.5 * x, 0.5 * y, 0.5);
        q.sup(&Vec3::zeros()).norm()
    };
    let outside = |p: &Vec3| block(p, 2.0, 1.0).min(block(p, 1.0, 2.0));
    let distance = MeshDistance::new(&mesh);
    for p in [Vec3::new(1.25, 1.25, 0.0), Vec3::new(1.4, 1.2, 1.0), Vec3::new(1.1, 1.2, 0.0)] {
        assert_near(distance.closest(&p).signed_distance, outside(&p), 1e-12, "in the sheet");
    }
    for depth in 1..4 {
        let tree = SphereTree::build(&mesh, &TreeSettings { depth, ..TreeSettings::octree() }).unwrap();
        for sphere in tree.nodes() {
            let farthest = TriMesh::icosphere(sphere.radius, 2)
                .vertices
                .iter()
                .map(|d| outside(&(sphere.center + d)))
                .fold(0.0, f64::max);
            assert!(farthest <= sphere.outward + 1e-12, "{sphere:?} reaches {farthest}");
        }
    }
}

#[test]
fn obj_files_come_in_several_spellings() {
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let wanted = TriMesh::from_obj(plain).unwrap();
    let read = |bytes: &[u8]| TriMesh::from_obj(&decode_text(bytes).unwrap()).unwrap();
    assert_eq!(read(format!("\u{feff}{plain}").as_bytes()), wanted);
    assert_eq!(read(plain.replace('\n', "\r").as_bytes()), wanted);
    assert_eq!(read(plain.replace('\n', "\r\n").as_bytes()), wanted);
    assert_eq!(read(&[b"# caf\xe9 \xff\n", plain.as_bytes()].concat()), wanted);
    assert_eq!(read(plain.replace("1 3 2", "1 \\\n3 \\\r\n 2").as_bytes()), wanted);
    assert_eq!(read(format!("# ends in \\\n{plain}").as_bytes()), wanted);
    // line numbers are those of the file; a continued line has the first one's
    let (_, lines) = TriMesh::from_obj_with_lines(&plain.replace("1 3 2", "1 \\\n3 2")).unwrap();
    assert_eq!(lines, [5, 7, 8, 9]);
    assert_eq!(decode_text(b"v 0\0"), Err(3));
}

#[test]
fn stl_text_may_be_in_capitals() {
    let text = "solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\nendloop\nendfacet\nendsolid\n".to_owned() + &" ".repeat(80);
    let wanted = TriMesh::from_stl(text.as_bytes()).unwrap();
    assert_eq!(wanted.triangles.len(), 1);
    for other in [text.to_uppercase(), text.replace('\n', "\r"), format!("\u{feff}{text}")] {
        assert_eq!(TriMesh::from_stl(other.as_bytes()).unwrap(), wanted);
    }
}

#[test]
fn a_mesh_of_no_size_says_so() {
    let mut mesh = TriMesh::cuboid(Vec3::repeat(2e-120));
    assert!(
        matches!(mesh.check_closed(), Err(MeshError::TooSmall { diagonal }) if (diagonal / 1e-120 - 12.0_f64.sqrt()).abs() < 1e-12)
    );
    let mut line =
        TriMesh { vertices: vec![Vec3::zeros(), Vec3::x(), Vec3::x() * 2.0], triangles: vec![[0, 1, 2], [0, 2, 1]] };
    assert_eq!(
        line.check_closed().unwrap_err().to_string(),
        "none of the 2 triangles has an area; at least 4 are needed to close a solid"
    );
}

/// Returns a box of six quads as PLY, with an unknown property and element.
fn ply(encoding: &str, corners: &[[f32; 3]], quads: &[[i32; 4]]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {encoding} 1.0\ncomment made here\nelement vertex {}\nproperty float x\nproperty float y\nproperty uchar red\nproperty float z\n\
         element edge 1\nproperty int vertex1\nproperty list uchar double weights\nelement face {}\nproperty list uchar int vertex_indices\nproperty short group\nend_header\n",
        corners.len(), quads.len()
    )
    .into_bytes();
    let swap = encoding == "binary_big_endian";
    let mut put = |little: &[u8], word: String| match encoding {
        "ascii" => bytes.extend(format!("{word} ").bytes()),
        _ if swap => bytes.extend(little.iter().rev()),
        _ => bytes.extend(little),
    };
    for [x, y, z] in corners {
        put(&x.to_le_bytes(), x.to_string());
        put(&y.to_le_bytes(), y.to_string());
        put(&[200], "200".into());
        put(&z.to_le_bytes(), z.to_string());
    }
    put(&7_i32.to_le_bytes(), "7".into());
    put(&[2], "2".into());
    [0.5_f64, -1.5].iter().for_each(|w| put(&w.to_le_bytes(), w.to_string()));
    for quad in quads {
        put(&[4], "4".into());
        quad.iter().for_each(|k| put(&k.to_le_bytes(), k.to_string()));
        put(&(-3_i16).to_le_bytes(), "-3".into());
    }
    bytes
}

/// Reads the file with each byte replaced in turn: an error or a mesh, and no panic.
fn read_with_one_byte_changed(bytes: &[u8]) {
    for at in 0..bytes.len() {
        for with in [0, 9, b'-', b'9', 0xff] {
            let mut bytes = bytes.to_vec();
            bytes[at] = with;
            let _ = TriMesh::from_ply(&bytes);
        }
    }
}

#[test]
fn ply_is_read_in_all_three_encodings() {
    let corners: Vec<[f32; 3]> =
        (0..8).map(|k| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { 1.5 } else { -0.25 })).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let bytes = ply(encoding, &corners, &quads);
        let mut mesh = TriMesh::from_ply(&bytes).unwrap();
        assert_eq!(
            (mesh.vertices.len(), mesh.triangles.len(), mesh.triangles[..2].to_vec()),
            (8, 12, vec![[0, 2, 3], [0, 3, 1]]),
            "{encoding}"
        );
        assert_near(mesh.check_closed().unwrap().volume, 1.75_f64.powi(3), 1e-12, encoding);
        // a truncated file is an error that says so, and one with other bytes is an error or a mesh
        for end in 0..bytes.len() - 1 {
            assert!(TriMesh::from_ply(&bytes[..end]).is_err() || encoding == "ascii", "{encoding} cut at {end}");
        }
        read_with_one_byte_changed(&bytes);
    }
}

#[test]
fn ply_errors_name_the_place() {
    let good = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert_eq!(TriMesh::from_ply(good.as_bytes()).unwrap().triangles, [[0, 1, 2]]);
    assert_eq!(TriMesh::from_ply(good.replace('\n', "\r\n").as_bytes()).unwrap().triangles, [[0, 1, 2]]);
    let cases = [
        ("ply\n", "plx\n", "line 1: wanted `ply`"),
        ("ascii 1.0", "hex 1.0", "line 2: the format `hex`; wanted ascii"),
        ("vertex 3", "vertex 99999999999999999", "vertex 5: the file ends before it"),
        ("float y", "float q", "the element `vertex`: wanted properties x, y and z"),
        ("float y", "real y", "line 5: `real` is not a number type"),
        ("vertex_index", "corners", "the element `face`: wanted `property list"),
        ("end_header\n", "", "line 9: `0` where format, element"),
        ("1 0 0", "1 a 0", "vertex 2: `a` where a number should be"),
        ("3 0 1 2", "2 0 1", "face 1: 2 corners, but it needs at least 3"),
        ("3 0 1 2", "3 0 1 3", "face 1 refers to vertex 4, but there are 3 vertices"),
        ("3 0 1 2", "3 0 1 -1", "face 1 refers to vertex 0, but there are 3 vertices"),
        ("3 0 1 2", "3 0 1 1.5", "face 1: 1.5 where the number of a vertex should be"),
        ("3 0 1 2", "-3 0 1 2", "face 1: a list of -3 numbers"),
        ("1 0 0", "1 nan 0", "vertex 2 is (1, NaN, 0), but coordinates must be finite"),
    ];
    for (from, to, said) in cases {
        let error = TriMesh::from_ply(good.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(said), "{from} → {to}: {error}");
    }
}

/// Returns a tetrahedron as one strip of six, in the given encoding.
fn ply_of_strips(encoding: &str, strips: &[&[i32]]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {encoding} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element tristrips {}\nproperty list int int vertex_indices\nend_header\n",
        strips.len()
    )
    .into_bytes();
    let mut put = |little: [u8; 4], word: String| match encoding {
        "ascii" => bytes.extend(format!("{word} ").bytes()),
        "binary_big_endian" => bytes.extend(little.iter().rev()),
        _ => bytes.extend(little),
    };
    for x in [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]].as_flattened() {
        put((*x as f32).to_le_bytes(), x.to_string());
    }
    for strip in strips {
        put((strip.len() as i32).to_le_bytes(), strip.len().to_string());
        strip.iter().for_each(|v| put(v.to_le_bytes(), v.to_string()));
    }
    bytes
}

/// For any division into strips, the tetrahedron has four outward-wound faces and a sixth of a
/// cube's volume.
#[test]
fn ply_triangle_strips_are_read() {
    let cases: [&[&[i32]]; 5] = [
        // 0 2 1, then 1 2 3 by its turn, then 1 3 0, then 0 3 2
        &[&[0, 2, 1, 3, 0, 2]],
        &[&[0, 2, 1, 3, -1, 1, 3, 0, 2]],
        &[&[0, 2, 1, -1, 1, 2, 3, -1, 1, 3, 0, -1, 0, 3, 2, -1]],
        &[&[0, 2, 1, 3], &[-1, 1, 3, 0, 2, -1, -1]],
        // repeated vertices lead from one strip to the next without a restart
        &[&[0, 2, 1, 3, 3, 1, 1, 3, 0, 2]],
    ];
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for strips in cases {
            let mesh = TriMesh::from_ply(&ply_of_strips(encoding, strips)).unwrap();
            assert_eq!(mesh.triangles.len(), 4, "{encoding} {strips:?}");
            let report = mesh.clone().check_closed().unwrap();
            assert_eq!((report.flipped_faces, report.turned, report.notes()), (0, false, vec![]), "{strips:?}");
            assert_near(mesh.signed_volume(), 1.0 / 6.0, 1e-15, encoding);
        }
        let bytes = ply_of_strips(encoding, cases[2]);
        for end in 0..bytes.len() - 1 {
            assert!(TriMesh::from_ply(&bytes[..end]).is_err(), "{encoding} cut at {end}");
        }
        read_with_one_byte_changed(&bytes);
    }
}

#[test]
fn ply_errors_of_strips_name_the_place() {
    let said = |strips: &[&[i32]]| TriMesh::from_ply(&ply_of_strips("ascii", strips)).unwrap_err().to_string();
    let there = "there are 4 vertices";
    assert!(
        said(&[&[0, 2, 1, 3], &[0, 1, 4]])
            .contains(&format!("tristrips 2: it refers to vertex 4 (from 0), but {there}"))
    );
    assert!(said(&[&[0, 2, -2, 3]]).contains(&format!("tristrips 1: it refers to vertex -2 (from 0), but {there}")));
    assert!(said(&[&[0, 2, 1, -1, 0, 1]]).contains("tristrips 1: a strip of 2 vertices, but it needs at least 3"));
    assert!(said(&[&[0, 1, 1]]).contains("wanted elements `face` or `tristrips`; found: 4 vertex, 1 tristrips"));
    let text = String::from_utf8(ply_of_strips("ascii", &[&[0, 2, 1, 3]])).unwrap();
    let cases = [
        ("vertex_indices", "corners", "the element `tristrips`: wanted `property list … vertex_indices`"),
        ("4 0 2 1 3", "2000000000 0 2 1 3", "tristrips 1: a list of 2000000000 numbers"),
        ("4 0 2 1 3", "1000000000 0 2 1 3", "tristrips 1: the file ends before it"),
        ("4 0 2 1 3", "4 0 2 1 0.5", "tristrips 1: 0.5 where the number of a vertex should be"),
        ("tristrips 1", "tristrips 99999999999", "tristrips 2: the file ends before it"),
        ("tristrips", "trifans", "wanted elements `face` or `tristrips`; found: 4 vertex, 1 trifans"),
    ];
    for (from, to, said) in cases {
        let error = TriMesh::from_ply(text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(said), "{from} → {to}: {error}");
    }
}
