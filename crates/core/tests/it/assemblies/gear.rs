//! Meshes of involute spur gears.
//!
//! ```text
//! ψ(r) = π/(2z) − b/(2r_p) + inv α − inv α_r        half the angle of a tooth at radius r
//! inv x = tan x − x,    cos α_r = r_b/r,    r_b = r_p·cos α,    r_p = m·z/2
//! ```
//!
//! `m` module, `z` teeth, `α` = 20°, `b` play along the pitch circle.

use super::thread::Parts;
use std::f64::consts::{PI, TAU};
use tumble_core::collide::{TriMesh, Vec3};

/// Measures of a gear about z, m.
#[derive(Clone, Copy)]
pub struct Gear {
    pub module: f64,
    pub teeth: usize,
    /// Play along the pitch circle.
    pub play: f64,
    pub width: f64,
    /// Number of points of a flank.
    pub points: usize,
}

impl Gear {
    pub fn pitch_radius(&self) -> f64 {
        0.5 * self.module * self.teeth as f64
    }

    /// Returns the outline of a tooth about angle 0: radius and angle, counter-clockwise.
    fn tooth(&self) -> Vec<(f64, f64)> {
        let alpha: f64 = 20.0_f64.to_radians();
        let pitch = self.pitch_radius();
        let (base, tip, root) = (pitch * alpha.cos(), pitch + self.module, pitch - 1.25 * self.module);
        let inv = |x: f64| x.tan() - x;
        let half = |r: f64| {
            let at = (base / r).min(1.0).acos();
            0.5 * PI / self.teeth as f64 - 0.5 * self.play / pitch + inv(alpha) - inv(at)
        };
        let from = base.max(root);
        let flank = (0..self.points).map(|k| {
            let s = k as f64 / (self.points - 1) as f64;
            // equal steps of the roll angle
            let roll = |r: f64| ((r / base).powi(2) - 1.0).max(0.0).sqrt();
            let angle = roll(from) + s * (roll(tip) - roll(from));
            base * (1.0 + angle * angle).sqrt()
        });
        let rising: Vec<(f64, f64)> = flank.map(|r| (r, -half(r))).collect();
        let foot = (root, -half(from) - 0.01 * TAU / self.teeth as f64);
        let falling: Vec<(f64, f64)> = rising.iter().rev().map(|&(r, angle)| (r, -angle)).collect();
        [vec![foot], rising, falling, vec![(root, -foot.1)]].concat()
    }

    /// Returns radius and angle of the points of the outline, counter-clockwise.
    pub fn outline(&self) -> Vec<(f64, f64)> {
        (0..self.teeth)
            .flat_map(|tooth| {
                let at = TAU * tooth as f64 / self.teeth as f64;
                self.tooth().into_iter().map(move |(r, angle)| (r, at + angle))
            })
            .collect()
    }

    /// Returns the gear with a tooth on the x axis, centered at height 0.
    pub fn mesh(&self) -> TriMesh {
        self.twisted(0.0, 2)
    }

    /// Returns the gear as sections along z that are turned against each other by `twist` per length, rad/m.
    pub fn twisted(&self, twist: f64, sections: usize) -> TriMesh {
        let outline = self.outline();
        let mut out = Parts::default();
        let at = |k: usize| self.width * (k as f64 / (sections - 1) as f64 - 0.5);
        let rings: Vec<u32> = (0..sections)
            .map(|k| {
                let first = out.vertices.len() as u32;
                let place = |&(r, angle): &(f64, f64)| {
                    let (sin, cos) = (angle + twist * at(k)).sin_cos();
                    Vec3::new(r * cos, r * sin, at(k))
                };
                out.vertices.extend(outline.iter().map(place));
                first
            })
            .collect();
        rings.windows(2).for_each(|w| out.band(w[0], w[1], outline.len()));
        out.cap(rings[0], outline.len(), at(0), false);
        out.cap(rings[sections - 1], outline.len(), at(sections - 1), true);
        out.mesh()
    }
}

/// Returns a rack along x with `teeth` gaps and its pitch line at height 0 along y, teeth up; a gap is at the origin,
/// `before` gaps come before it.
pub fn rack(gear: &Gear, teeth: usize, before: usize) -> TriMesh {
    let (m, slope) = (gear.module, 20.0_f64.to_radians().tan());
    let pitch = PI * m;
    // half the width of a gap at the pitch line
    let half = 0.25 * pitch + 0.5 * gear.play;
    let mut profile = Vec::new();
    for k in 0..teeth {
        let x = (k as f64 - before as f64) * pitch;
        let edge = |y: f64| half + y * slope;
        profile.extend([
            (x - edge(m), m),
            (x - edge(-1.25 * m), -1.25 * m),
            (x + edge(-1.25 * m), -1.25 * m),
            (x + edge(m), m),
        ]);
    }
    let mut out = Parts::default();
    let n = profile.len() as u32;
    for z in [-0.5 * gear.width, 0.5 * gear.width] {
        out.vertices.extend(profile.iter().map(|&(x, y)| Vec3::new(x, y, z)));
        out.vertices.extend(profile.iter().map(|&(x, _)| Vec3::new(x, -4.0 * m, z)));
    }
    let at = |side: u32, low: u32, k: u32| 2 * n * side + n * low + k;
    for k in 0..n - 1 {
        out.quad(at(0, 1, k), at(0, 0, k), at(0, 0, k + 1), at(0, 1, k + 1));
        out.quad(at(1, 1, k), at(1, 1, k + 1), at(1, 0, k + 1), at(1, 0, k));
        out.quad(at(0, 0, k), at(1, 0, k), at(1, 0, k + 1), at(0, 0, k + 1));
        out.quad(at(0, 1, k), at(0, 1, k + 1), at(1, 1, k + 1), at(1, 1, k));
    }
    out.quad(at(0, 1, 0), at(1, 1, 0), at(1, 0, 0), at(0, 0, 0));
    out.quad(at(0, 1, n - 1), at(0, 0, n - 1), at(1, 0, n - 1), at(1, 1, n - 1));
    out.mesh()
}

/// Returns the distance of the outlines of two gears at these angles, `apart` along x, m: negative by the depth of the
/// deepest vertex if they overlap.
pub fn gap(gears: [&Gear; 2], angles: [f64; 2], apart: f64) -> f64 {
    let placed: Vec<Vec<Vec3>> = (0..2)
        .map(|k| {
            let at = |&(r, a): &(f64, f64)| {
                let (sin, cos) = (a + angles[k]).sin_cos();
                Vec3::new(r * cos + apart * k as f64, r * sin, 0.0)
            };
            gears[k].outline().iter().map(at).collect()
        })
        .collect();
    let mut least = f64::INFINITY;
    for (points, other) in [(&placed[0], &placed[1]), (&placed[1], &placed[0])] {
        for p in points {
            let (mut distance, mut winding) = (f64::INFINITY, 0.0);
            for (a, b) in other.iter().zip(other.iter().cycle().skip(1)) {
                let s = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                distance = distance.min((p - a - s * (b - a)).norm());
                winding += (a - p).cross(&(b - p)).z.atan2((a - p).dot(&(b - p)));
            }
            least = least.min(if winding > PI { -distance } else { distance });
        }
    }
    least
}
