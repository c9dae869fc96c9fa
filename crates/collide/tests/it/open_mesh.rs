//! Open surfaces as solids: volumes in closed form, distances and rays by brute force over the given
//! triangles, junctions, walls back to back, random triangles.

use crate::rng::Rng;
use tumble_collide::{MeshError, Pose, Shape, TriMesh, Vec3};

/// Pose at which the frame of the mesh is the world's.
fn placed(shape: &Shape) -> Pose {
    Pose::from_parts(shape.center_of_mass().into(), nalgebra::one())
}

fn inward(mut mesh: TriMesh) -> TriMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

fn keep(mesh: &TriMesh, kept: impl Fn([Vec3; 3]) -> bool) -> TriMesh {
    let triangles = (0..mesh.triangles.len()).filter(|&t| kept(mesh.corners(t))).map(|t| mesh.triangles[t]).collect();
    TriMesh { vertices: mesh.vertices.clone(), triangles }
}

fn quad(corners: [[f64; 3]; 4]) -> TriMesh {
    TriMesh { vertices: corners.map(Vec3::from).to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] }
}

fn joined(parts: &[TriMesh]) -> TriMesh {
    let mut all = TriMesh { vertices: Vec::new(), triangles: Vec::new() };
    for part in parts {
        let first = all.vertices.len() as u32;
        all.vertices.extend(&part.vertices);
        all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    all
}

/// A closed, tessellated box whose faces look inward.
fn room(size: Vec3, cells: usize) -> TriMesh {
    let mut parts = Vec::new();
    for axis in 0..3 {
        for side in [-0.5, 0.5] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for n in 0..cells * cells {
                let at = |i: usize, j: usize| {
                    let mut p = [0.0; 3];
                    p[axis] = side * size[axis];
                    p[u] = size[u] * ((n % cells + i) as f64 / cells as f64 - 0.5);
                    p[v] = size[v] * ((n / cells + j) as f64 / cells as f64 - 0.5);
                    p
                };
                let cell = quad([at(0, 0), at(1, 0), at(1, 1), at(0, 1)]);
                parts.push(if side > 0.0 { inward(cell) } else { cell });
            }
        }
    }
    joined(&parts)
}

#[track_caller]
fn has_volume(mesh: &TriMesh, thickness: f64, centered: bool, wanted: f64) {
    let solid = Shape::open_mesh(mesh, Some(thickness), centered).unwrap();
    assert!((solid.volume() - wanted).abs() < 1e-11 * wanted, "{} instead of {wanted}", solid.volume());
}

#[test]
fn rooms_tunnels_and_walls_have_the_volume_of_their_walls() {
    let (size, t) = (Vec3::new(4.0, 3.0, 2.5), 0.2);
    let inner = size.product();
    for cells in [1, 5] {
        let closed = room(size, cells);
        has_volume(&closed, t, false, size.add_scalar(2.0 * t).product() - inner);
        has_volume(&closed, t, true, size.add_scalar(t).product() - size.add_scalar(-t).product());
        // without the wall at the greatest x
        let open = keep(&closed, |c| c.iter().any(|p| p.x < 0.5 * size.x - 1e-9));
        let outer = (size.x + t) * (size.y + 2.0 * t) * (size.z + 2.0 * t);
        has_volume(&open, t, false, outer - inner);
    }
    // a wall that is seen from both sides
    let wall = quad([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 0.0, 2.0], [0.0, 0.0, 2.0]]);
    has_volume(&wall, 0.1, false, 3.0 * 2.0 * 0.1);
    has_volume(&wall, 0.1, true, 3.0 * 2.0 * 0.1);
    // a tunnel of n sides with its floor at the distance a from its axis
    let (n, radius, length) = (24.0, 2.0, 10.0);
    let tube = inward(keep(&TriMesh::cylinder(radius, length, 24), |[a, b, c]| {
        (b - a).cross(&(c - a)).normalize().z.abs() < 0.5
    }));
    let angle = std::f64::consts::PI / n;
    let apothem = radius * angle.cos();
    has_volume(&tube, t, false, n * angle.tan() * ((apothem + t).powi(2) - apothem.powi(2)) * length);
}

/// Distance to the triangles of a mesh, and whether the closest point is inside a face.
fn distance(mesh: &TriMesh, p: &Vec3) -> (f64, Vec3) {
    let mut best = (f64::INFINITY, Vec3::zeros());
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(&(c - a)).normalize();
        let height = normal.dot(&(p - a));
        let foot = p - normal * height;
        let inside = [(a, b), (b, c), (c, a)].iter().all(|(u, v)| (v - u).cross(&(foot - u)).dot(&normal) >= 0.0);
        let mut near = if inside { (height.abs(), foot) } else { (f64::INFINITY, foot) };
        for (u, v) in [(a, b), (b, c), (c, a)] {
            let s = ((p - u).dot(&(v - u)) / (v - u).norm_squared()).clamp(0.0, 1.0);
            let q = u + (v - u) * s;
            if (p - q).norm() < near.0 {
                near = ((p - q).norm(), q);
            }
        }
        if near.0 < best.0 {
            best = near;
        }
    }
    best
}

/// Compares the free side of a solid with the surface that it was made of.
#[track_caller]
fn free_side_is_that_of(mesh: &TriMesh, thickness: f64, rng: &mut Rng, near_a_back: impl Fn(&Vec3) -> bool) {
    let solid = Shape::open_mesh(mesh, Some(thickness), false).unwrap();
    let pose = placed(&solid);
    for _ in 0..400 {
        let t = (rng.between(0.0, 1.0) * mesh.triangles.len() as f64) as usize % mesh.triangles.len();
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(&(c - a)).normalize();
        let (mut u, mut v) = (rng.between(0.0, 1.0), rng.between(0.0, 1.0));
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let foot = a + (b - a) * u + (c - a) * v;
        let p = foot + normal * rng.between(0.0, thickness);
        let (wanted, closest) = distance(mesh, &p);
        if (closest - foot).norm() > 1e-9 {
            continue; // another part of the surface is nearer
        }
        if near_a_back(&p) {
            continue;
        }
        let found = solid.closest_point(&pose, &p);
        assert!((found.distance - wanted).abs() < 1e-9, "{} instead of {wanted} at {p:?}", found.distance);
        let hit = solid.cast_ray(&pose, &p, &-normal, 1.0).unwrap();
        assert!((hit.distance - wanted).abs() < 1e-9, "{} instead of {wanted}", hit.distance);
        // and the solid begins there
        let below = solid.closest_point(&pose, &(foot - normal * 1e-7)).distance;
        assert!(below < 0.0, "{below} just behind the surface at {foot:?}");
    }
}

/// A floor of two rectangles with a wall between them, whose faces look along x.
fn junction() -> TriMesh {
    joined(&[
        quad([[-2.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [-2.0, 1.0, 0.0]]),
        quad([[0.0, -1.0, 0.0], [2.0, -1.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]]),
        quad([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.5], [0.0, -1.0, 1.5]]),
    ])
}

#[test]
fn the_free_side_is_the_given_surface() {
    let mut rng = Rng::new(5);
    let size = Vec3::new(4.0, 3.0, 2.5);
    free_side_is_that_of(&room(size, 3), 0.2, &mut rng, |_| false);
    free_side_is_that_of(&keep(&room(size, 3), |c| c[0].x < 1.9), 0.2, &mut rng, |_| false);
    free_side_is_that_of(&junction(), 0.1, &mut rng, |p| p.x < 0.0 && p.x > -0.21);
    // a wall that stands on a floor without a common edge
    let floor = quad([[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]]);
    let wall = quad([[0.3, -1.0, 0.0], [0.3, 1.0, 0.0], [0.3, 1.0, 1.5], [0.3, -1.0, 1.5]]);
    free_side_is_that_of(&joined(&[floor, wall]), 0.1, &mut rng, |p| p.x < 0.3 && p.x > 0.09);
    // inside and outside of a sphere with a hole
    let bowl = keep(&TriMesh::icosphere(1.0, 3), |c| c[0].z < 0.4);
    free_side_is_that_of(&bowl, 0.1, &mut rng, |_| false);
    free_side_is_that_of(&inward(bowl), 0.1, &mut rng, |_| false);
    // creased at random
    for _ in 0..4 {
        let mut hills = TriMesh::icosphere(1.0, 2);
        hills.vertices.iter_mut().for_each(|v| *v *= rng.between(0.85, 1.0));
        free_side_is_that_of(&inward(keep(&hills, |c| c[0].y < 0.5)), 0.02, &mut rng, |_| false);
    }
}

#[test]
fn what_is_behind_a_wall_stays_free() {
    // two rooms whose walls are 0.1 m apart, a pillar of four faces, and a table, a closed box
    let west = room(Vec3::new(4.0, 4.0, 3.0), 1).translated(&Vec3::new(-2.05, 0.0, 1.5));
    let east = room(Vec3::new(4.0, 4.0, 3.0), 1).translated(&Vec3::new(2.05, 0.0, 1.5));
    let pillar = keep(&TriMesh::cuboid(Vec3::new(0.3, 0.3, 2.0)), |c| c.iter().any(|p| p.z != c[0].z))
        .translated(&Vec3::new(2.0, 1.0, 1.0));
    let table = TriMesh::cuboid(Vec3::new(1.0, 1.0, 0.8)).translated(&Vec3::new(2.0, -1.0, 0.4));
    let table_volume = table.signed_volume();
    let house = joined(&[west, east, pillar, table]);
    let solid = Shape::open_mesh(&house, Some(1.0), false).unwrap();
    let pose = placed(&solid);
    let free = |p: [f64; 3]| solid.closest_point(&pose, &Vec3::from(p)).distance > 0.0;
    for x in [-0.051, -2.0, 0.051, 1.0, 4.049] {
        assert!(free([x, 0.3, 0.001]) && free([x, 1.999, 2.999]), "{x}");
    }
    assert!(free([2.151, 1.0, 1.0]) && free([2.0, 1.151, 0.1]) && !free([2.149, 1.0, 1.0]));
    assert!(free([2.501, -1.0, 0.4]) && !free([2.0, -1.0, 0.4]) && !free([2.499, -1.0, 0.799]));
    assert!(!free([-0.06 + 0.02, 0.0, 1.0]), "the wall is solid");
    let alone = Shape::open_mesh(&TriMesh::cuboid(Vec3::new(1.0, 1.0, 0.8)), Some(0.1), true).unwrap();
    assert!((alone.volume() - table_volume).abs() < 1e-12);
}

#[test]
fn faces_that_disagree_are_turned_to_the_greater_part() {
    let mut floor = room(Vec3::new(2.0, 2.0, 2.0), 6);
    floor = keep(&floor, |c| c.iter().all(|p| p.z < -0.9));
    for n in [3, 20, 41] {
        floor.triangles[n].swap(1, 2);
    }
    let solid = Shape::open_mesh(&floor, Some(0.1), false).unwrap();
    let top = placed(&solid);
    let hit = solid.cast_ray(&top, &Vec3::new(0.1, 0.2, 1.0), &-Vec3::z(), 5.0).unwrap();
    assert!((hit.distance - 2.0).abs() < 1e-12, "{}", hit.distance);
    assert!((solid.volume() - 0.4).abs() < 1e-12);
}

#[test]
fn any_triangles_make_a_solid_or_an_error() {
    let mut rng = Rng::new(9);
    let mut made = 0;
    for _ in 0..600 {
        let count = 4 + (rng.between(0.0, 1.0) * 12.0) as usize;
        let vertices = (0..count).map(|_| Vec3::from(std::array::from_fn(|_| rng.between(-1.0, 1.0)))).collect();
        let mut pick = || (rng.between(0.0, 1.0) * count as f64) as u32 % count as u32;
        let triangles = (0..count).map(|_| [pick(), pick(), pick()]).collect();
        let mesh = TriMesh { vertices, triangles };
        match mesh.thickened(Some(0.05), made % 2 == 0) {
            Ok(mut solid) => {
                // a fold can leave nothing; the surface is closed in any case
                let checked = solid.check_closed();
                assert!(matches!(checked, Ok(_) | Err(MeshError::NoVolume { .. })), "{checked:?} {mesh:?}");
                made += 1;
            }
            Err(MeshError::Flat { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
    assert!(made > 500, "{made}");
}

#[test]
fn wrong_thicknesses_and_surfaces_are_errors() {
    let floor = quad([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    for wrong in [0.0, -1.0, f64::NAN, 1e10] {
        let error = floor.thickened(Some(wrong), false).unwrap_err().to_string();
        assert!(error.contains("thickness") && error.contains("above 0"), "{error}");
    }
    let line = quad([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
    assert!(matches!(line.thickened(None, false), Err(MeshError::Flat { .. })));
    // the default thickness is a hundredth of the diagonal
    let volume = Shape::open_mesh(&floor, None, false).unwrap().volume();
    assert!((volume - 0.01 * 2f64.sqrt()).abs() < 1e-12, "{volume}");
}
