//! Defective meshes: each defect, generated here or in the public files, has its stated result.

use crate::rng::Rng;
use crate::shared_meshes::text;
use crate::winding::{both, inside_out};
use tumble_collide::{MeshDistance, MeshError, RepairReport, RepairSettings, TriMesh, Vec3, WindingNumber};

fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() <= tolerance, "{what}: {found} instead of {expected}");
}

fn repaired(mut mesh: TriMesh) -> (TriMesh, RepairReport) {
    let report = mesh.repair(&RepairSettings::default()).unwrap();
    (mesh, report)
}

/// Returns the mesh without the faces for which `gone` is true.
fn without(mut mesh: TriMesh, gone: impl Fn(&[Vec3; 3]) -> bool) -> TriMesh {
    mesh.triangles =
        (0..mesh.triangles.len()).filter(|&t| !gone(&mesh.corners(t))).map(|t| mesh.triangles[t]).collect();
    mesh
}

fn all(corners: &[Vec3; 3], holds: impl Fn(&Vec3) -> bool) -> bool {
    corners.iter().all(holds)
}

#[test]
fn box_without_two_sides_is_closed_flat() {
    let open =
        without(TriMesh::cuboid(Vec3::new(2.0, 4.0, 6.0)), |c| all(c, |p| p.z == 3.0) || all(c, |p| p.z == -3.0));
    let mut strict = open.clone();
    let error = strict.check_closed().unwrap_err();
    assert!(matches!(error, MeshError::Open { holes: 2, edges: 8, .. }), "{error}");
    assert_eq!(strict, open);
    let (_, report) = repaired(open);
    assert_eq!((report.filled_holes, report.longest_hole, report.filled_faces), (2, 4, 4));
    near(report.closed.volume, 48.0, 1e-12, "volume");
    assert_eq!(report.notes(), ["2 hole(s) were filled with 4 faces; the longest has 4 edges"]);
}

/// A hole in a fine sphere is closed by a nearly flat cap: the missing volume is at most that of
/// the cap, `πh²(3r − h)/3`, and the filling lies within the sphere.
#[test]
fn hole_in_a_sphere_is_closed_within_the_cap() {
    for (height, edges) in [(0.995, 20), (0.8, 40), (-0.2, 40)] {
        let sphere = TriMesh::icosphere(1.0, 5);
        let full = sphere.signed_volume();
        let (mesh, report) = repaired(without(sphere, |c| c.iter().any(|p| p.z > height)));
        let h = 1.0 - height + 0.05;
        let cap = std::f64::consts::PI * h * h * (3.0 - h) / 3.0;
        assert!(report.longest_hole > edges, "{report:?}");
        assert_eq!(
            (report.filled_holes, report.closed.crossing_faces, report.filled_faces),
            (1, 0, report.longest_hole - 2)
        );
        assert!(
            full - report.closed.volume <= cap && report.closed.volume < full,
            "{height}: {} of {full}",
            report.closed.volume
        );
        assert!(mesh.vertices.iter().all(|p| p.norm() <= 1.0 + 1e-12));
    }
}

/// A hole with 640 boundary edges exceeds the limit of dynamic programming; its boundary is planar,
/// so the volume has a closed form.
#[test]
fn long_rim_is_filled_in_its_plane() {
    let sides = 640;
    // a cylinder without its lid, pressed into a star so that the boundary is not convex
    let mut star = TriMesh::cylinder(1.0, 1.0, sides);
    for v in &mut star.vertices {
        let squeeze = 1.0 + 0.4 * (5.0 * v.y.atan2(v.x)).sin();
        (v.x, v.y) = (v.x * squeeze, v.y * squeeze);
    }
    let volume = star.signed_volume();
    let (_, report) = repaired(without(star, |c| all(c, |p| p.z == 0.5)));
    assert_eq!((report.filled_holes, report.longest_hole, report.filled_faces), (1, sides, sides - 2));
    near(report.closed.volume, volume, 1e-9, "volume");
    assert_eq!(report.closed.crossing_faces, 0);
    let mut mesh = without(TriMesh::cylinder(1.0, 1.0, sides), |c| all(c, |p| p.z == 0.5));
    let error = mesh.repair(&RepairSettings { hole_edges: 100, ..RepairSettings::default() }).unwrap_err();
    assert!(
        error.to_string().ends_with("repair failed: its longest hole has 640 edges; at most 100 are filled"),
        "{error}"
    );
}

#[test]
fn fins_walls_and_debris_go() {
    let unit = TriMesh::cuboid(Vec3::repeat(1.0));
    // a fin of two triangles over an edge of the box
    let mut fin = unit.clone();
    let edge = fin.triangles[0];
    fin.vertices.extend([Vec3::new(2.0, 2.0, 2.0), Vec3::new(3.0, 2.0, 2.0)]);
    fin.triangles.extend([[edge[0], edge[1], 8], [edge[1], 9, 8]]);
    let error = fin.clone().check_closed().unwrap_err();
    assert!(matches!(error, MeshError::NonManifold { faces: 3, face: 13, .. }), "{error}");
    let (mesh, report) = repaired(fin);
    assert_eq!((report.dangling_pieces, report.dangling_faces, mesh.triangles.len()), (1, 2, 12));
    near(report.closed.volume, 1.0, 1e-12, "fin");
    // a wall across the middle: the shells of two boxes without their common sides, and one sheet
    // for both
    let lower = without(TriMesh::cuboid(Vec3::repeat(1.0)), |c| all(c, |p| p.z == 0.5));
    let upper = without(unit.clone().translated(&Vec3::z()), |c| all(c, |p| p.z == 0.5));
    let wall = without(unit.clone(), |c| !all(c, |p| p.z == 0.5));
    let (_, report) = repaired(both(&both(&lower, &upper), &wall));
    assert_eq!((report.dangling_pieces, report.dangling_faces), (1, 2));
    near(report.closed.volume, 2.0, 1e-12, "wall");
    // a stray triangle beside it
    let speck =
        TriMesh { vertices: vec![Vec3::x(), Vec3::x() * 1.02, Vec3::new(1.0, 0.02, 0.0)], triangles: vec![[0, 1, 2]] };
    let (_, report) = repaired(both(&unit, &speck));
    assert_eq!((report.debris_pieces, report.debris_faces, report.filled_holes), (1, 1, 0));
    near(report.closed.volume, 1.0, 1e-12, "speck");
}

#[test]
fn cracks_close_within_the_tolerance_given() {
    // each face of the sphere separately, its corners displaced by up to 1e-5
    let sphere = TriMesh::icosphere(1.0, 3);
    let mut rng = Rng::new(3);
    let vertices: Vec<Vec3> =
        (0..sphere.triangles.len()).flat_map(|t| sphere.corners(t)).map(|p| p + rng.vec(5e-6)).collect();
    let soup = TriMesh {
        triangles: (0..vertices.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        vertices,
    };
    let mut mesh = soup.clone();
    let report = mesh.repair(&RepairSettings { weld: 1e-4, ..RepairSettings::default() }).unwrap();
    assert_eq!((report.welded_vertices, report.filled_holes), (soup.vertices.len() - sphere.vertices.len(), 0));
    near(report.closed.volume, sphere.signed_volume(), 1e-4, "volume");
    for weld in [-1.0, f64::NAN, 1e-20, 1.0] {
        let error = soup.clone().repair(&RepairSettings { weld, ..RepairSettings::default() }).unwrap_err();
        assert!(matches!(error, MeshError::Settings { .. }), "{error}");
    }
}

/// Two tetrahedra that share a corner, each without one face: two boundaries through the same
/// vertex.
#[test]
fn holes_that_share_a_vertex_are_filled_each_for_itself() {
    let v = Vec3::new;
    let vertices = vec![
        v(0.0, 0.0, 0.0),
        v(1.0, 0.0, 0.0),
        v(0.0, 1.0, 0.0),
        v(0.0, 0.0, 1.0),
        v(-1.0, 0.0, 0.0),
        v(0.0, -1.0, 0.0),
        v(0.0, 0.0, -1.0),
    ];
    // without [0, 2, 1] and [0, 4, 5]
    let triangles = vec![[0, 1, 3], [0, 3, 2], [1, 2, 3], [0, 6, 4], [0, 5, 6], [4, 6, 5]];
    let (_, report) = repaired(TriMesh { vertices, triangles });
    assert_eq!((report.filled_holes, report.filled_faces, report.longest_hole), (2, 2, 3));
    near(report.closed.volume, 1.0 / 3.0, 1e-12, "volume");
}

#[test]
fn failed_repairs_are_errors_that_name_the_face() {
    // a Möbius band has only one side
    let mut band = TriMesh::default();
    let n = 12;
    for k in 0..n {
        let turn = std::f64::consts::PI * f64::from(k) / f64::from(n);
        let around = Vec3::new((2.0 * turn).cos(), (2.0 * turn).sin(), 0.0);
        let across = around * turn.cos() + Vec3::z() * turn.sin();
        band.vertices.extend([around + across * 0.2, around - across * 0.2]);
    }
    for k in 0..n as u32 {
        let (a, b) = (2 * k, 2 * k + 1);
        let (c, d) = if k + 1 < n as u32 { (a + 2, b + 2) } else { (1, 0) };
        band.triangles.extend([[a, b, c], [c, b, d]]);
    }
    let before = band.clone();
    let error = band.repair(&RepairSettings::default()).unwrap_err();
    assert!(
        matches!(&error, MeshError::BeyondRepair { error, .. } if matches!(**error, MeshError::NonManifold { .. })),
        "{error}"
    );
    assert_eq!(band, before);
    // one triangle encloses nothing
    let mut lone = TriMesh { vertices: vec![Vec3::x(), Vec3::y(), Vec3::z()], triangles: vec![[0, 1, 2]] };
    let error = lone.repair(&RepairSettings::default()).unwrap_err();
    assert!(error.to_string().contains("of face 1;"), "{error}");
    let mut nan = TriMesh::cuboid(Vec3::repeat(2.0));
    nan.vertices[2].y = f64::NAN;
    assert!(matches!(nan.repair(&RepairSettings::default()), Err(MeshError::NotFinite { vertex: 3, .. })));
}

/// Every file of the public folder has its stated result, strict and with repair, in bounded time.
#[test]
fn public_bad_meshes_have_their_stated_outcome() {
    let Some(spot) = text("spot.obj") else { return };
    let spot = TriMesh::from_obj(&spot).unwrap().signed_volume();
    let read = |name: &str| text(&format!("bad/{name}.obj")).map(|obj| TriMesh::from_obj(&obj)).unwrap();
    for name in ["empty", "index_out_of_range", "nan_vertex", "inf_vertex"] {
        let error = read(name).unwrap_err();
        eprintln!("{name}: {error}");
    }
    // name, strict volume (none: an error), repaired volume
    let cases = [
        ("open_hole", None, Some(spot)),
        ("nonmanifold_edge", Some(2.0), Some(2.0)),
        ("nonmanifold_fin", None, Some(1.0)),
        ("self_intersecting", None, None),
        ("degenerate", Some(spot), Some(spot)),
        ("flipped_some", Some(spot), Some(spot)),
        ("inside_out", Some(spot), Some(spot)),
        ("dup_shell", Some(spot), Some(spot)),
        ("flat", None, None),
    ];
    for (name, strict, repaired_volume) in cases {
        let mut mesh = read(name).unwrap();
        let mut copy = mesh.clone();
        let (found, repaired) = (mesh.check_closed(), copy.repair(&RepairSettings::default()));
        eprintln!("{name}: {}", found.as_ref().map_or_else(|e| e.to_string(), |r| r.notes().join("; ")));
        eprintln!("{name}, repaired: {}", repaired.as_ref().map_or_else(|e| e.to_string(), |r| r.notes().join("; ")));
        if name == "self_intersecting" {
            let report = found.unwrap();
            assert!(report.crossing_faces > 0 && report.doubtful == 0.0);
            check_union(&mesh, report.volume);
            continue;
        }
        assert_eq!((found.is_ok(), repaired.is_ok()), (strict.is_some(), repaired_volume.is_some()), "{name}");
        if let Some(volume) = strict {
            near(found.unwrap().volume, volume, 1e-9, name);
        }
        if let Some(volume) = repaired_volume {
            // the filling of 36 faces of spot differs from them slightly
            near(repaired.unwrap().closed.volume, volume, if name == "open_hole" { 1e-2 * volume } else { 1e-9 }, name);
        }
    }
}

/// Compares the volume with a count of grid points whose winding number is above 1/2.
fn check_union(mesh: &TriMesh, volume: f64) {
    let (winding, bounds, n) = (WindingNumber::new(mesh), mesh.aabb(), 60);
    let step = (bounds.max - bounds.min) / f64::from(n);
    let mut count = 0;
    for k in 0..n * n * n {
        let at = Vec3::new(f64::from(k % n), f64::from(k / n % n), f64::from(k / n / n)).add_scalar(0.5);
        count += u32::from(winding.contains(&(bounds.min + at.component_mul(&step))));
    }
    near(f64::from(count) * step.product(), volume, 2e-3 * volume, "by grid");
}

/// Random soups, and a good mesh with random damage, are read, checked, repaired and measured
/// without a panic; the result of a repair is closed.
#[test]
fn soups_and_damaged_meshes_end_in_a_solid_or_an_error() {
    let mut rng = Rng::new(2026);
    let (mut solids, mut errors) = (0, 0);
    for case in 0..900 {
        let mut mesh = if case % 3 == 0 { soup(&mut rng) } else { damaged(&mut rng) };
        if case % 7 == 0 {
            mesh = both(&mesh, &inside_out(TriMesh::icosphere(0.4, 1).translated(&rng.vec(1.0))));
        }
        let weld = if case % 5 == 0 { 0.005 * mesh.diagonal() } else { 0.0 };
        let strict = mesh.clone().check_closed();
        match mesh.repair(&RepairSettings { weld, ..RepairSettings::default() }) {
            Ok(report) => {
                solids += 1;
                assert!(report.closed.volume > 0.0);
                let again = mesh.check_closed().unwrap();
                assert_eq!((again.degenerate_faces, again.flipped_faces, again.welded_vertices), (0, 0, 0));
                let distance = MeshDistance::new(&mesh);
                for _ in 0..4 {
                    assert!(distance.closest(&rng.vec(1.5)).signed_distance.is_finite());
                }
            }
            Err(error) => {
                assert!(strict.is_err() || weld > 0.0, "refused to repair what is closed: {error}");
                errors += 1;
            }
        }
    }
    assert!(solids > 200 && errors > 100, "{solids} {errors}");
}

/// Returns a few vertices, on a coarse grid so that they often coincide, and random triangles
/// between them.
fn soup(rng: &mut Rng) -> TriMesh {
    let count = 4 + rng.below(12);
    let vertices = (0..count).map(|_| rng.vec(1.0).map(|x| (x * 3.0).round() / 3.0)).collect();
    let triangles = (0..2 + rng.below(40)).map(|_| [0; 3].map(|_: u32| rng.below(count) as u32)).collect();
    TriMesh { vertices, triangles }
}

fn damaged(rng: &mut Rng) -> TriMesh {
    let mut mesh = if rng.below(2) == 0 { TriMesh::icosphere(1.0, 2) } else { TriMesh::torus(1.0, 0.3, 12, 8) };
    for _ in 0..1 + rng.below(6) {
        let (faces, vertices) = (mesh.triangles.len(), mesh.vertices.len());
        let t = rng.below(faces);
        match rng.below(7) {
            0 => drop(mesh.triangles.remove(t)),
            1 => mesh.triangles[t].swap(0, 1),
            2 => mesh.triangles[t][rng.below(3)] = rng.below(vertices) as u32,
            3 => mesh.triangles.push([0; 3].map(|_: u32| rng.below(vertices) as u32)),
            4 => mesh.vertices[rng.below(vertices)] = rng.vec(1.2),
            5 => mesh.triangles.push(mesh.triangles[t]),
            _ => {
                let at = mesh.vertices[rng.below(vertices)];
                mesh = without(mesh, |c| c.iter().any(|p| (p - at).norm() < 0.3));
            }
        }
        if mesh.triangles.is_empty() {
            return TriMesh::icosphere(1.0, 0);
        }
    }
    mesh
}
