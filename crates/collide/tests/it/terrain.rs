//! Height fields and terrain: volumes by prisms, surfaces by interpolation, rays by brute force, bad
//! input.

use crate::rng::Rng;
use tumble_collide::{MeshDistance, MeshError, Pose, Shape, TriMesh, Vec3, contacts};

const COLUMNS: usize = 24;
const ROWS: usize = 17;
const SIZE: [f64; 2] = [4.0, 3.0];

fn hills(rng: &mut Rng) -> Vec<f64> {
    (0..COLUMNS * ROWS).map(|_| rng.between(-0.2, 0.3)).collect()
}

/// Height of the field at a point: linear in each of the two triangles of a cell.
fn height(heights: &[f64], x: f64, y: f64) -> f64 {
    let u = (x / SIZE[0] + 0.5) * (COLUMNS - 1) as f64;
    let v = (y / SIZE[1] + 0.5) * (ROWS - 1) as f64;
    let (i, j) = ((u as usize).min(COLUMNS - 2), (v as usize).min(ROWS - 2));
    let (u, v) = (u - i as f64, v - j as f64);
    let h = |di: usize, dj: usize| heights[(j + dj) * COLUMNS + i + di];
    match u > v {
        true => h(0, 0) + u * (h(1, 0) - h(0, 0)) + v * (h(1, 1) - h(1, 0)),
        false => h(0, 0) + v * (h(0, 1) - h(0, 0)) + u * (h(1, 1) - h(0, 1)),
    }
}

/// Pose at which the frame of the mesh is the world's.
fn placed(shape: &Shape) -> Pose {
    Pose::from_parts(shape.center_of_mass().into(), nalgebra::one())
}

#[test]
fn the_volume_is_that_of_its_prisms_and_the_mass_that_of_a_box_if_flat() {
    let mut rng = Rng::new(1);
    let heights = hills(&mut rng);
    let field = Shape::height_field(&heights, COLUMNS, SIZE, Some(0.7)).unwrap();
    let bottom = heights.iter().copied().fold(f64::INFINITY, f64::min) - 0.7;
    let cell = SIZE[0] / (COLUMNS - 1) as f64 * SIZE[1] / (ROWS - 1) as f64;
    let mut volume = 0.0;
    for j in 0..ROWS - 1 {
        for i in 0..COLUMNS - 1 {
            let h = |di: usize, dj: usize| heights[(j + dj) * COLUMNS + i + di] - bottom;
            volume += cell / 6.0 * (2.0 * h(0, 0) + h(1, 0) + h(0, 1) + 2.0 * h(1, 1));
        }
    }
    assert!((field.volume() - volume).abs() < 1e-12 * volume, "{} {volume}", field.volume());

    let flat = Shape::height_field(&[0.5; COLUMNS * ROWS], COLUMNS, SIZE, None).unwrap();
    let slab = Shape::cuboid(Vec3::new(SIZE[0], SIZE[1], 0.4)).unwrap();
    let (own, reference) = (flat.mass_properties(900.0).unwrap(), slab.mass_properties(900.0).unwrap());
    assert!((own.mass - reference.mass).abs() < 1e-11 * reference.mass, "{} {}", own.mass, reference.mass);
    assert!((own.inertia - reference.inertia).norm() < 1e-11 * reference.inertia.norm());
    assert!((flat.center_of_mass() - Vec3::new(0.0, 0.0, 0.3)).norm() < 1e-12);
}

#[test]
fn rays_points_and_spheres_meet_the_surface_where_interpolation_says() {
    let mut rng = Rng::new(2);
    let heights = hills(&mut rng);
    let field = Shape::height_field(&heights, COLUMNS, SIZE, None).unwrap();
    let pose = placed(&field);
    let mut slanted = 0;
    for n in 0..10_000 {
        let (x, y) = (rng.between(-1.95, 1.95), rng.between(-1.45, 1.45));
        let surface = height(&heights, x, y);
        let (origin, direction) = (Vec3::new(x, y, 2.0), -Vec3::z());
        let hit = field.cast_ray(&pose, &origin, &direction, 10.0).unwrap();
        assert!((hit.distance - (2.0 - surface)).abs() < 1e-12, "{x} {y}: {} {surface}", hit.distance);
        // a ray at an angle enters where it is first below the surface, in steps
        let aim = Vec3::new(rng.between(-1.9, 1.9), rng.between(-1.4, 1.4), -0.1) - origin;
        let found = field.cast_ray(&pose, &origin, &aim, f64::INFINITY).map(|hit| hit.distance / aim.norm());
        let below = |s: f64| {
            let p = origin + aim * s;
            p.z < height(&heights, p.x, p.y)
        };
        if n % 10 == 0 {
            let found = found.unwrap();
            let clear = (1..400).map(|k| found * (1.0 - 1e-9) * f64::from(k) / 400.0).all(|s| !below(s));
            let p = origin + aim * found;
            assert!(clear && (p.z - height(&heights, p.x, p.y)).abs() < 1e-9);
            slanted += 1;
        }
        let depth = rng.between(-0.1, 0.1);
        let inside = field.closest_point(&pose, &Vec3::new(x, y, surface + depth)).distance < 0.0;
        assert_eq!(inside, depth < 0.0, "{x} {y} {depth}");
    }
    assert_eq!(slanted, 1000);
    // the lowest point of a small sphere touches a face from above
    let sphere = Shape::sphere(0.05).unwrap();
    let reference = MeshDistance::new(&TriMesh::height_field(&heights, COLUMNS, SIZE, None).unwrap());
    for _ in 0..500 {
        let at = Vec3::new(rng.between(-1.8, 1.8), rng.between(-1.3, 1.3), 0.0);
        let at = at + Vec3::z() * (height(&heights, at.x, at.y) + rng.between(0.0, 0.05));
        let mut found = Vec::new();
        contacts(&sphere, &Pose::from_parts(at.into(), nalgebra::one()), &field, &pose, 0.05, &mut found);
        let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
        let expected = reference.closest(&at).signed_distance - 0.05;
        assert!((least - expected).abs() < 1e-9, "{least} {expected}");
    }
}

/// An open surface over a disk, with a hole.
fn open_ring() -> TriMesh {
    let ring = TriMesh::lathe(&[(0.0, -0.1), (1.0, 0.0), (2.0, 0.3), (0.0, 2.0)], 16).unwrap();
    let upper = |t: &[u32; 3]| {
        let corners = t.map(|v| ring.vertices[v as usize]);
        corners.iter().all(|c| c.z < 0.5) && corners.iter().all(|c| c.xy().norm() > 0.5)
    };
    let triangles = ring.triangles.iter().filter(|t| upper(t)).copied().collect();
    TriMesh { vertices: ring.vertices, triangles }
}

#[test]
fn an_open_surface_becomes_the_solid_below_it() {
    let surface = open_ring();
    assert!(surface.clone().check_closed().is_err(), "open");
    // the horizontal area of a ring of 16 sides, times the thickness
    let area = 16.0 / 2.0 * (std::f64::consts::TAU / 16.0).sin() * (4.0 - 1.0);
    for thickness in [0.01, 0.5] {
        let mut solid = surface.terrain(Some(thickness)).unwrap();
        let report = solid.check_closed().unwrap();
        assert_eq!((report.shells, report.flipped_faces, report.crossing_faces), (1, 0, 0));
        assert!((solid.signed_volume() - area * thickness).abs() < 1e-12, "{}", solid.signed_volume());
    }
    // a tenth of 4 m, and wound either way
    let turned = TriMesh { triangles: surface.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect(), ..surface };
    let solid = Shape::terrain(&turned, None).unwrap();
    assert!((solid.volume() - area * 0.4).abs() < 1e-12);
    let down = solid.cast_ray(&placed(&solid), &Vec3::new(1.5, 0.0, 5.0), &-Vec3::z(), 10.0).unwrap();
    assert!((down.distance - 4.85).abs() < 1e-12 && down.normal.z > 0.5, "{down:?}");
}

#[test]
fn wrong_heights_and_surfaces_are_one_clear_error() {
    let field =
        |heights: &[f64], columns, size, thickness| match TriMesh::height_field(heights, columns, size, thickness) {
            Err(error) => error.to_string(),
            Ok(mesh) => panic!("{} triangles", mesh.triangles.len()),
        };
    let needs = "but needs at least 2 full rows of at least 2";
    assert_eq!(field(&[], 3, SIZE, None), format!("the height field has 0 heights in rows of 3, {needs}"));
    assert_eq!(field(&[0.0; 7], 3, SIZE, None), format!("the height field has 7 heights in rows of 3, {needs}"));
    assert_eq!(field(&[0.0; 4], 0, SIZE, None), format!("the height field has 4 heights in rows of 0, {needs}"));
    for (value, shown) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (-2e9, "-2000000000")] {
        let mut heights = [0.0; 12];
        heights[7] = value;
        let expected = format!(
            "the height field has a height of {shown} m in row 2, column 4, but heights must be finite and within 1e9 m"
        );
        assert_eq!(field(&heights, 4, SIZE, None), expected);
    }
    let length = "but it must be above 0 and at most 1e9 m";
    assert_eq!(field(&[0.0; 4], 2, [0.0, 1.0], None), format!("the height field has a size x of 0 m, {length}"));
    assert_eq!(field(&[0.0; 4], 2, [1.0, f64::NAN], None), format!("the height field has a size y of NaN m, {length}"));
    assert_eq!(field(&[0.0; 4], 2, SIZE, Some(-1.0)), format!("the height field has a thickness of -1 m, {length}"));

    let wall = TriMesh {
        vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 1]].map(|p| Vec3::from(p.map(f64::from))).to_vec(),
        triangles: vec![[0, 1, 2], [0, 1, 3]],
    };
    let error = wall.terrain(None).unwrap_err();
    assert_eq!(error.face(), Some(2));
    assert_eq!(
        error.to_string(),
        "face 2 is turned by 90.0° from the direction of extrusion; all faces must look to one side of it, none along it"
    );
    assert_eq!(TriMesh::default().terrain(None), Err(MeshError::Empty));
    assert_eq!(
        open_ring().terrain(Some(0.0)).unwrap_err().to_string(),
        "the thickness is 0 m, but must be above 0 and at most 1e9 m"
    );
}

#[test]
fn spheres_touch_a_flat_field_of_any_resolution() {
    for count in [2, 3, 10, 33, 64, 101] {
        let field = Shape::height_field(&vec![0.0; count * count], count, [4.0, 4.0], Some(0.2)).unwrap();
        let pose = placed(&field);
        for (x, y) in [(0.013, 0.007), (-1.5, 0.3), (1.9, -1.9)] {
            let mut found = Vec::new();
            let sphere = Shape::sphere(0.1).unwrap();
            contacts(&sphere, &Pose::translation(x, y, 0.099), &field, &pose, 0.05, &mut found);
            let gaps: Vec<f64> = found.iter().map(|c| c.gap).collect();
            assert!(gaps.len() == 1 && (gaps[0] + 0.001).abs() < 1e-12, "{count} {x} {y}: {gaps:?}");
        }
    }
}
