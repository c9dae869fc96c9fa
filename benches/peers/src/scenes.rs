//! The scenes of the benchmark `piles`.

mod mechanisms;
mod published;
mod standing;

use crate::random::Random;
use crate::scene::{Body, FRICTION, Plane, Scene, Shape};

/// Radius of every sphere, meters.
pub const RADIUS: f64 = 0.1;
/// Edge of the cubes of towers and pyramids, meters.
const EDGE: f64 = 0.4;
/// Range of the edges of boxes of random size, meters.
const EDGES: [f64; 2] = [0.08, 0.2];
/// Distance of neighbors in the grid of falling boxes, meters.
const LOOSE: f64 = 0.3;

const FLOOR: Plane = Plane { point: [0.0; 3], normal: [0.0, 0.0, 1.0] };

/// Returns all scenes, in the order of the table.
pub fn all() -> Vec<Scene> {
    let mut scenes = vec![spheres(100), spheres(500), spheres(1000)];
    scenes.extend([2000, 4000, 8000].map(|n| large(spheres(n))));
    scenes.extend([pyramid(10), pyramid(20), pyramid(40), large(pyramid(100))]);
    scenes.extend([10, 30, 100, 300].map(tower));
    scenes.push(random_towers());
    scenes.push(boxes(200, 0.0, 60));
    for (n, e, rate) in [(200, 0.0, 240), (200, 0.2, 60), (200, 0.2, 240)] {
        scenes.push(large(boxes(n, e, rate)));
    }
    for (e, rate) in [(0.0, 60), (0.0, 240), (0.2, 60), (0.2, 240)] {
        scenes.push(large(boxes(1000, e, rate)));
    }
    scenes.extend(published::all());
    scenes.extend(mechanisms::all());
    scenes.extend(standing::all());
    scenes
}

fn large(scene: Scene) -> Scene {
    Scene { large: true, ..scene }
}

fn scene(name: String, bodies: Vec<Body>) -> Scene {
    Scene {
        name,
        bodies,
        hulls: Vec::new(),
        joints: Vec::new(),
        planes: vec![FLOOR],
        friction: FRICTION,
        restitution: 0.0,
        rate: 60,
        measured: [1.0, 4.0],
        stands: true,
        large: false,
    }
}

/// Returns `n` spheres on a cubic grid of 0.24 m, in a box as wide as the grid. Each is shifted
/// sideways by up to 15 mm, so that no column is stable.
fn spheres(n: usize) -> Scene {
    let side = (1..).find(|s| s * s * s >= n).expect("some cube exceeds n");
    let half = 0.12 * side as f64;
    let mut random = Random(n as u64);
    let place = |i: usize| 0.24 * (i as f64 + 0.5) - half;
    let body = |i: usize| {
        let (x, y, z) = (i % side, i / side % side, i / (side * side));
        let center = [place(x) + random.within(0.015), place(y) + random.within(0.015), 0.12 + 0.24 * z as f64];
        Body::new(Shape::Sphere(RADIUS), center)
    };
    let bodies = (0..n).map(body).collect();
    Scene { planes: walled(half), stands: false, ..scene(format!("spheres-{n}"), bodies) }
}

/// Returns a wall of cubes on the floor, `rows` in its lowest row and one on top, 20 mm between
/// neighbors; 10 rows are 55 cubes, 20 are 210.
fn pyramid(rows: usize) -> Scene {
    let row = |k: usize| {
        let count = rows - k;
        (0..count).map(move |i| [(i as f64 - 0.5 * (count - 1) as f64) * (EDGE + 0.02), 0.0, EDGE * (k as f64 + 0.5)])
    };
    let bodies: Vec<Body> = (0..rows).flat_map(row).map(cube).collect();
    scene(format!("pyramid-{}", bodies.len()), bodies)
}

/// Returns one tower of cubes.
pub fn tower(floors: usize) -> Scene {
    let bodies = (0..floors).map(|i| cube([0.0, 0.0, EDGE * (i as f64 + 0.5)])).collect();
    Scene { measured: [0.0, 10.0], ..scene(format!("tower-{floors}"), bodies) }
}

fn cube(center: [f64; 3]) -> Body {
    Body::new(Shape::Box([EDGE; 3]), center)
}

/// Returns 16 towers, 1 m apart, of 12 boxes of random size.
fn random_towers() -> Scene {
    let mut random = Random(5);
    let mut bodies = Vec::new();
    for tower in 0..16 {
        let mut top = 0.0;
        for _ in 0..12 {
            let size = random_size(&mut random);
            bodies.push(Body::new(Shape::Box(size), [tower as f64, 0.0, top + 0.5 * size[2]]));
            top += size[2];
        }
    }
    Scene { rate: 240, measured: [0.0, 4.0], ..scene("towers-random".into(), bodies) }
}

/// Returns `n` boxes of random size on a grid about three times as high as wide, in a box as wide
/// as the grid. Each is shifted sideways by up to 40 mm, so that they fall on edges and topple.
fn boxes(n: usize, restitution: f64, rate: usize) -> Scene {
    let side = (n as f64 / 3.0).cbrt().round() as usize;
    let half = 0.5 * LOOSE * side as f64;
    let mut random = Random(n as u64);
    let place = |i: usize| LOOSE * (i as f64 + 0.5) - half;
    let body = |i: usize| {
        let size = random_size(&mut random);
        let (x, y) = (place(i % side) + random.within(0.04), place(i / side % side) + random.within(0.04));
        Body::new(Shape::Box(size), [x, y, 0.2 + LOOSE * (i / (side * side)) as f64])
    };
    let bodies = (0..n).map(body).collect();
    let name = format!("boxes-{n}-e{restitution}-{rate}hz");
    let (planes, measured) = (walled(half), [0.0, 4.0]);
    Scene { planes, restitution, rate, measured, stands: false, ..scene(name, bodies) }
}

fn random_size(random: &mut Random) -> [f64; 3] {
    [(); 3].map(|()| 0.5 * (EDGES[0] + EDGES[1]) + random.within(0.5 * (EDGES[1] - EDGES[0])))
}

/// Returns the floor and four walls at distance `half` from the middle.
fn walled(half: f64) -> Vec<Plane> {
    let walls = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
    let walls = walls.map(|normal| Plane { point: normal.map(|x| -half * x), normal });
    [FLOOR].into_iter().chain(walls).collect()
}
