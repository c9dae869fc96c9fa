//! Checks, generators, triangulation and mass properties of meshes.

use crate::shared_meshes::text;
use std::f64::consts::PI;
use tumble_collide::{
    ClosedReport, Mat3, MeshDistance, MeshError, Pose, Quat, Shape, SphereTree, TreeSettings, TriMesh, Vec3,
};

pub fn assert_near(found: f64, expected: f64, relative: f64, what: &str) {
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
