//! Solids given by signed distances: closed, with volume and inertia that converge with the square of the
//! cell, and contacts of their surface.

use tumble_collide::{Pose, Shape, TriMesh, Vec3, contacts};

fn ring(p: &Vec3) -> f64 {
    Vec3::new(p.xy().norm() - 0.3, p.z, 0.0).norm() - 0.1
}

#[test]
fn the_errors_of_a_ring_fall_with_the_square_of_the_cell() {
    let (major, minor) = (0.3_f64, 0.1_f64);
    let volume = 2.0 * std::f64::consts::PI.powi(2) * major * minor * minor;
    let about = volume * (major * major + 0.75 * minor * minor);
    let errors = [16, 32, 64].map(|cells| {
        let shape = Shape::sdf(ring, Vec3::repeat(-0.5), Vec3::repeat(0.5), cells).unwrap();
        let Shape::Mesh(mesh) = &shape else { panic!("no mesh") };
        let farthest =
            mesh.mesh().vertices.iter().map(|v| ring(&(v + mesh.center_of_mass())).abs()).fold(0.0, f64::max);
        assert!(farthest < 2e-3 / cells as f64, "{farthest}");
        let unit = shape.mass_properties(1.0).unwrap();
        [unit.mass / volume - 1.0, unit.inertia[(2, 2)] / about - 1.0]
    });
    println!("{errors:?}");
    for k in 0..2 {
        assert!(errors[2][k].abs() < 0.01);
        for n in 0..2 {
            let ratio = errors[n][k] / errors[n + 1][k];
            assert!((3.0..5.5).contains(&ratio), "{errors:?}");
        }
    }
}

/// Random sums of waves have surfaces of any topology. The surface is closed and faces outward.
#[test]
fn any_surface_is_closed() {
    for seed in 0..30 {
        let s = f64::from(seed);
        let wave = move |p: &Vec3| {
            let bumps = (7.0 * p.x + s).sin() + (9.0 * p.y - 2.0 * s).sin() + (8.0 * p.z + 0.7 * s).cos();
            p.norm() - 0.35 + 0.12 * bumps
        };
        let mut mesh = TriMesh::isosurface(wave, Vec3::repeat(-1.0), Vec3::repeat(1.0), 24).unwrap();
        mesh.check_closed().unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        assert!(mesh.signed_volume() > 0.0, "seed {seed}");
    }
}

#[test]
fn a_grid_has_the_surface_of_its_function() {
    let (counts, low, step) = ([41, 41, 21], Vec3::new(-0.5, -0.5, -0.25), Vec3::repeat(0.025));
    let mut values = Vec::new();
    for z in 0..counts[2] {
        for y in 0..counts[1] {
            values.extend((0..counts[0]).map(|x| ring(&(low + 0.025 * Vec3::new(x as f64, y as f64, z as f64)))));
        }
    }
    let mesh = TriMesh::isosurface_of_grid(&values, counts, low, step).unwrap();
    let by_function = TriMesh::isosurface(ring, low, -low, 40).unwrap();
    assert_eq!(mesh.triangles, by_function.triangles);
    assert!((mesh.signed_volume() / by_function.signed_volume() - 1.0).abs() < 0.01);
    let shape = Shape::mesh(mesh, &tumble_collide::TreeSettings::octree()).unwrap();
    let mut found = Vec::new();
    contacts(&shape, &Pose::translation(0.0, 0.0, 0.1), &Shape::half_space(), &Pose::identity(), 0.01, &mut found);
    let deepest = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
    assert!(found.len() >= 3 && deepest.abs() < 2e-3 && found.iter().all(|c| c.normal.z == 1.0), "{found:?}");
}

#[test]
fn wrong_grids_are_errors_that_say_why() {
    let ball = |p: &Vec3| p.norm() - 0.3;
    let (low, high) = (Vec3::repeat(-0.5), Vec3::repeat(0.5));
    let text = |made: Result<TriMesh, tumble_collide::MeshError>| made.unwrap_err().to_string();
    assert!(text(TriMesh::isosurface(ball, low, Vec3::repeat(0.2), 10)).contains("border"));
    assert!(text(TriMesh::isosurface(|p| ball(p) + 1.0, low, high, 10)).contains("no grid point is inside"));
    assert!(text(TriMesh::isosurface(|_| f64::NAN, low, high, 10)).contains("NaN"));
    assert!(text(TriMesh::isosurface(ball, high, low, 10)).contains("empty"));
    assert!(text(TriMesh::isosurface(ball, low, high, 1)).contains("cells"));
    assert!(text(TriMesh::isosurface(ball, low, high, 100_000)).contains("at most"));
    assert!(text(TriMesh::isosurface_of_grid(&[1.0; 9], [2, 2, 2], low, high)).contains("9 values"));
}
