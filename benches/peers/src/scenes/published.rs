//! Scenes that Box3D publishes (`shared/benchmarks.c`) and Rapier ships (`b3d_*`), at their sizes
//! and smaller. Lengths and densities are theirs; z is up, and gravity and friction are those of
//! all scenes here.

use super::{FLOOR, large, scene};
use crate::random::Random;
use crate::scene::{Body, Joint, Mode, Plane, Scene, Shape};
use std::f64::consts::PI;
use tumble_collide::{TriMesh, Vec3};

/// Density of the cubes of pyramids, kg/m³.
const LIGHT: f64 = 100.0;
/// Height of the axis of the drum over the floor, meters.
const AXIS: f64 = 21.0;

pub(super) fn all() -> Vec<Scene> {
    vec![
        large_pyramid(20),
        large_pyramid(40),
        large(large_pyramid(100)),
        many_pyramids(4),
        large(many_pyramids(14)),
        joint_grid(10),
        joint_grid(20),
        large(joint_grid(30)),
        large(joint_grid(100)),
        washer(8),
        large(washer(20)),
        convex_pile(2),
        large(convex_pile(80)),
    ]
}

/// Returns a wall of cubes of 1 m that touch each other on all sides, `base` in its lowest row.
fn large_pyramid(base: usize) -> Scene {
    let bodies = wall([0.0, 0.0], base);
    scene(format!("large-pyramid-{base}"), bodies)
}

/// Returns `side` rows of `side` walls with ten cubes of 1 m in the lowest row, 1 m between walls
/// of a row.
fn many_pyramids(side: usize) -> Scene {
    let extent = 5.5 * side as f64;
    let rows = 2.0 * (extent - 1.0) / (side - 1) as f64;
    let place = |i: usize| [11.0 * (i % side) as f64 - extent, rows * (i / side) as f64 - extent];
    let bodies = (0..side * side).flat_map(|i| wall(place(i), 10)).collect();
    scene(format!("many-pyramids-{side}x{side}"), bodies)
}

fn wall(place: [f64; 2], base: usize) -> Vec<Body> {
    let row = |k: usize| {
        let count = base - k;
        (0..count).map(move |i| [i as f64 - 0.5 * (count - 1) as f64, k as f64 + 0.5])
    };
    let cube =
        |[x, z]: [f64; 2]| Body { density: LIGHT, ..Body::new(Shape::Box([1.0; 3]), [place[0] + x, place[1], z]) };
    (0..base).flat_map(row).map(cube).collect()
}

/// Returns a curtain of `n` by `n` spheres of 0.4 m, 1 m apart, each joined to its four neighbors
/// halfway. The uppermost row is fixed.
fn joint_grid(n: usize) -> Scene {
    let body = |i: usize| {
        let mode = if i < n { Mode::Fixed } else { Mode::Dynamic };
        Body { mode, ..Body::new(Shape::Sphere(0.4), [(i % n) as f64, 0.0, -((i / n) as f64)]) }
    };
    let down = |i: usize| Joint { bodies: [i, i + n], anchors: [[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]] };
    let aside = |i: usize| Joint { bodies: [i, i + 1], anchors: [[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]] };
    let downs = (0..n * (n - 1)).map(down);
    // joints of two fixed bodies have no effect
    let asides = (n..n * n).filter(|i| i % n < n - 1).map(aside);
    let joints = downs.chain(asides).collect();
    let bodies = (0..n * n).map(body).collect();
    Scene { joints, planes: Vec::new(), measured: [0.0, 4.0], ..scene(format!("joint-grid-{n}"), bodies) }
}

/// Returns a drum of 36 staves and four vanes, 28 m wide within, that turns by 25° a second with
/// `side`³ cubes of 0.4 m in it.
fn washer(side: usize) -> Scene {
    let (staves, vanes) =
        ((0..36).map(|i| stave(i, 0.1, [16.0, 18.0])), (0..4).map(|i| stave(9 * i, 0.0, [14.0, 16.0])));
    let mut hulls = Vec::new();
    let mut bodies = Vec::new();
    for (mesh, center) in staves.chain(vanes) {
        let mode = Mode::Turning(25.0 * PI / 180.0);
        bodies.push(Body { mode, ..Body::new(Shape::Hull(hulls.len()), center) });
        hulls.push(mesh);
    }
    let place = |i: usize| 0.8 * i as f64 - 0.4 * side as f64;
    let cube = |i: usize| {
        let (x, y, z) = (i % side, i / side % side, i / (side * side));
        Body::new(Shape::Box([0.4; 3]), [x, y, z].map(place))
    };
    let cubes = side.pow(3);
    bodies.extend((0..cubes).map(cube));
    let planes = vec![Plane { point: [0.0, 0.0, -AXIS], ..FLOOR }];
    let measured = [0.0, 4.0];
    Scene { hulls, planes, measured, stands: false, ..scene(format!("washer-{cubes}"), bodies) }
}

/// Returns a part of the drum about its center of mass, and that center: a tenth of a turn of 36,
/// and `wider` of it on both sides, between two radii, 20 m long.
fn stave(i: usize, wider: f64, radii: [f64; 2]) -> (TriMesh, [f64; 3]) {
    let step = PI / 18.0;
    let angles = [i as f64 - wider, i as f64 + 1.0 + wider].map(|k| k * step);
    let corner = |k: usize| {
        let (s, c) = angles[k & 1].sin_cos();
        let radius = radii[k >> 1 & 1];
        Vec3::new(radius * c, if k < 4 { -10.0 } else { 10.0 }, radius * s)
    };
    centered((0..8).map(corner).collect())
}

/// Returns 64 equal polyhedra in each of a number of layers above the floor: hulls of 32 points on a
/// sphere of 2 m, 4 m apart.
fn convex_pile(layers: usize) -> Scene {
    let mut random = Random(42);
    let mut point = || {
        let v = Vec3::new(random.within(1.0), random.within(1.0), random.within(1.0));
        2.0 * v.normalize()
    };
    let (hull, _) = centered((0..32).map(|_| point()).collect());
    let place = |i: usize| 4.0 * (i as f64 - 4.0);
    let body = |i: usize| {
        let center = [place(i % 8), place(i / 8 % 8), 2.0 + 4.0 * (i / 64) as f64];
        Body::new(Shape::Hull(0), center)
    };
    let bodies: Vec<Body> = (0..64 * layers).map(body).collect();
    let name = format!("convex-pile-{}", bodies.len());
    Scene { hulls: vec![hull], measured: [0.0, 4.0], stands: false, ..scene(name, bodies) }
}

/// Returns the hull of points about its center of mass, and that center.
fn centered(points: Vec<Vec3>) -> (TriMesh, [f64; 3]) {
    let count = points.len() as u32;
    // triangles that use all points; the hull is that of the points
    let triangles = (0..count).map(|i| [i, (i + 1) % count, (i + 2) % count]).collect();
    let hull = TriMesh { vertices: points, triangles }.convex_hull().expect("the points span a solid");
    let center = hull.mass_properties(1.0).center_of_mass;
    (hull.translated(&-center), center.into())
}
