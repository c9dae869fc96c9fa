//! The scenes: equal bodies between planes.

/// Radius of every sphere, meters.
pub const RADIUS: f64 = 0.1;
/// Edge of every box, meters.
pub const EDGE: f64 = 0.4;

/// The shape of all bodies of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {
    /// A sphere of [`RADIUS`].
    Sphere,
    /// A cube of [`EDGE`].
    Box,
}

/// A half-space: everything with `(p − point)·normal ≤ 0` is solid.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// A point of its surface, meters.
    pub point: [f64; 3],
    /// Outward unit normal.
    pub normal: [f64; 3],
}

/// Equal bodies at rest, and the planes around them.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name on the command line and in the table.
    pub name: String,
    /// The shape of the bodies.
    pub body: Body,
    /// Centers at the start, meters.
    pub centers: Vec<[f64; 3]>,
    /// The planes.
    pub planes: Vec<Plane>,
}

const FLOOR: Plane = Plane { point: [0.0; 3], normal: [0.0, 0.0, 1.0] };

/// Returns `n` spheres on a cubic grid of 0.24 m, in a box as wide as the grid. Each is shifted
/// sideways by up to 15 mm, so that no column is stable.
pub fn spheres(n: usize) -> Scene {
    let side = (1..).find(|s| s * s * s >= n).expect("some cube exceeds n");
    let half = 0.12 * side as f64;
    let mut random = Random(n as u64);
    let place = |i: usize| 0.24 * (i as f64 + 0.5) - half;
    let center = |i: usize| {
        let (x, y, z) = (i % side, i / side % side, i / (side * side));
        [place(x) + random.within(0.015), place(y) + random.within(0.015), 0.12 + 0.24 * z as f64]
    };
    let centers = (0..n).map(center).collect();
    let walls = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
    let walls = walls.map(|normal| Plane { point: normal.map(|x| -half * x), normal });
    Scene {
        name: format!("spheres-{n}"),
        body: Body::Sphere,
        centers,
        planes: [FLOOR].into_iter().chain(walls).collect(),
    }
}

/// Returns a wall of cubes on the floor, `rows` in its lowest row and one on top, 20 mm between
/// neighbors; 10 rows are 55 cubes, 20 are 210.
pub fn pyramid(rows: usize) -> Scene {
    let row = |k: usize| {
        let count = rows - k;
        (0..count).map(move |i| [(i as f64 - 0.5 * (count - 1) as f64) * (EDGE + 0.02), 0.0, EDGE * (k as f64 + 0.5)])
    };
    let centers: Vec<_> = (0..rows).flat_map(row).collect();
    Scene { name: format!("pyramid-{}", centers.len()), body: Body::Box, centers, planes: vec![FLOOR] }
}

/// splitmix64.
pub(crate) struct Random(pub u64);

impl Random {
    /// Returns a number between `−bound` and `bound`.
    pub fn within(&mut self, bound: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^= x >> 31;
        bound * (2.0 * (x >> 11) as f64 / (1u64 << 53) as f64 - 1.0)
    }
}
