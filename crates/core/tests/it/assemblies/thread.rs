//! Meshes of screw threads: a profile that is swept along a helix, without any approximation of the profile.
//!
//! ```text
//! vertex (i, j)   angle 2π·i/n, radius r_j, height P·i/n + s_j        row (i, m) is (i + n, 0): the next turn
//! ends            a wall from the helix to a ring, and the face in which the thread begins
//! ```

use std::f64::consts::TAU;
use tumble_core::collide::{TriMesh, Vec3};

/// Measures of a trapezoidal thread about z, m.
#[derive(Clone, Copy)]
pub struct Thread {
    pub pitch: f64,
    /// Radii of root and crest of the external thread.
    pub root: f64,
    pub crest: f64,
    /// Number of facets of a turn.
    pub facets: usize,
    pub turns: usize,
}

impl Thread {
    /// Returns the profile over a pitch: radius and height. `gap` is the play to each side, positive for an internal
    /// thread, which begins at its largest radius.
    fn profile(&self, gap: f64, internal: bool) -> [(f64, f64); 4] {
        let p = self.pitch;
        // flanks of an eighth of the pitch; the crest of one is as wide as the root of the other, less the play
        let (quarter, flank) = (0.25 * p, 0.25 * p);
        match internal {
            false => [
                (self.root, 0.0),
                (self.crest, flank),
                (self.crest, flank + quarter),
                (self.root, 2.0 * flank + quarter),
            ],
            true => {
                let (inner, outer) = (self.root + gap, self.crest + gap);
                // the tooth of the nut stands in the groove of the bolt, narrower by the play at both flanks
                [
                    (outer, gap),
                    (inner, flank + gap),
                    (inner, flank + quarter - gap),
                    (outer, 2.0 * flank + quarter - gap),
                ]
            }
        }
    }

    fn columns(&self) -> usize {
        (self.turns + 1) * self.facets + 1
    }

    /// Appends the threaded surface with its ends and walls to rings at heights below and above. Returns the first
    /// vertices of both rings, of `facets` points each. `down` is the height of the lower ring.
    fn sweep(&self, profile: &[(f64, f64); 4], ring: f64, [down, up]: [f64; 2], out: &mut Parts) -> [u32; 2] {
        let (n, m) = (self.facets, profile.len());
        let last = self.turns * n;
        let first = out.vertices.len() as u32;
        for i in 0..self.columns() {
            let rows = if i <= last { m } else { 1 };
            for &(r, s) in &profile[..rows] {
                out.point(r, i as f64 / n as f64, self.pitch * i as f64 / n as f64 + s);
            }
        }
        let at = |i: usize, j: usize| {
            let (i, j) = if j == m { (i + n, 0) } else { (i, j) };
            first + if i <= last { i * m + j } else { (last + 1) * m + i - last - 1 } as u32
        };
        for i in 0..last {
            (0..m).for_each(|j| out.quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)));
        }
        let rings = [down, up].map(|z| out.ring(ring, n, z, |_| 1.0));
        let on = |ring: u32, k: usize| ring + (k % n) as u32;
        for k in 0..n {
            out.quad(on(rings[0], k), on(rings[0], k + 1), at(k + 1, 0), at(k, 0));
            out.quad(at(last + k, 0), at(last + k + 1, 0), on(rings[1], k + 1), on(rings[1], k));
        }
        // where the thread begins and ends: its profile, and a sliver to the ring
        let [begin, end] = [0, last].map(|i| [0, 1, 2, 3, 4].map(|j| at(i, j)));
        for [a, b, c] in [[0, 1, 3], [1, 2, 3]] {
            out.triangle(begin[a], begin[b], begin[c]);
            out.triangle(end[a], end[c], end[b]);
        }
        for [a, b] in [[0, 3], [3, 4]] {
            out.triangle(rings[0], begin[a], begin[b]);
            out.triangle(rings[1], end[b], end[a]);
        }
        rings
    }

    /// Returns a bolt: its thread begins at height 0, and a hexagonal head is below it.
    pub fn bolt(&self, head: f64) -> TriMesh {
        let mut out = Parts::default();
        let (n, p) = (self.facets, self.pitch);
        let top = p * (self.turns + 2) as f64;
        let [mut low, high] = self.sweep(&self.profile(0.0, false), 0.98 * self.root, [-0.5 * p, top], &mut out);
        for (radius, z) in [(head, -0.5 * p), (head, -2.5 * p)] {
            let next = out.ring(radius, n, z, hexagon);
            out.band(next, low, n);
            low = next;
        }
        out.cap(low, n, -2.5 * p, false);
        out.cap(high, n, top, true);
        out.mesh()
    }

    /// Returns a hexagonal nut for the bolt, with play to each side; its thread begins at height 0.
    pub fn nut(&self, play: f64, across: f64) -> TriMesh {
        let mut out = Parts::default();
        let (n, p) = (self.facets, self.pitch);
        let (down, up) = (-0.25 * p, p * (self.turns as f64 + 1.25));
        let hole = self.sweep(&self.profile(play, true), 1.02 * (self.crest + play), [down, up], &mut out);
        let [low, high] = [down, up].map(|z| out.ring(across, n, z, hexagon));
        // inside out: the hole is the outside
        out.band(hole[1], high, n);
        out.band(low, hole[0], n);
        out.band(high, low, n);
        out.faces[..].iter_mut().for_each(|face| face.swap(1, 2));
        out.mesh()
    }
}

/// Radius of a hexagon in units of its corner's, at an angle in turns.
fn hexagon(turn: f64) -> f64 {
    let (sixth, half) = (TAU / 6.0, TAU / 12.0);
    half.cos() / ((turn * TAU).rem_euclid(sixth) - half).cos()
}

/// Vertices and faces of a mesh in the making.
#[derive(Default)]
pub struct Parts {
    pub vertices: Vec<Vec3>,
    pub faces: Vec<[u32; 3]>,
}

impl Parts {
    fn point(&mut self, r: f64, turn: f64, z: f64) -> u32 {
        let (sin, cos) = (turn * TAU).sin_cos();
        self.vertices.push(Vec3::new(r * cos, r * sin, z));
        self.vertices.len() as u32 - 1
    }

    /// Adds a ring of `n` points and returns the first one.
    pub fn ring(&mut self, r: f64, n: usize, z: f64, shape: impl Fn(f64) -> f64) -> u32 {
        let first = self.vertices.len() as u32;
        for k in 0..n {
            let turn = k as f64 / n as f64;
            self.point(r * shape(turn), turn, z);
        }
        first
    }

    pub fn triangle(&mut self, a: u32, b: u32, c: u32) {
        self.faces.push([a, b, c]);
    }

    /// Adds a quadrangle, counter-clockwise from outside.
    pub fn quad(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.triangle(a, b, c);
        self.triangle(a, c, d);
    }

    /// Joins two rings of `n` points, the lower one first for an outside that looks away from the axis.
    pub fn band(&mut self, low: u32, high: u32, n: usize) {
        for k in 0..n as u32 {
            let next = (k + 1) % n as u32;
            self.quad(low + k, low + next, high + next, high + k);
        }
    }

    /// Closes a ring of `n` points by a fan that looks up or down.
    pub fn cap(&mut self, ring: u32, n: usize, z: f64, up: bool) {
        let center = self.point(0.0, 0.0, z);
        for k in 0..n as u32 {
            let next = (k + 1) % n as u32;
            if up { self.triangle(center, ring + k, ring + next) } else { self.triangle(center, ring + next, ring + k) }
        }
    }

    pub fn mesh(self) -> TriMesh {
        TriMesh { vertices: self.vertices, triangles: self.faces }
    }
}
