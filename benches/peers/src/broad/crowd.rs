//! Bounding boxes of spheres that fly in a closed space and reverse at its walls.

use crate::random::Random;
use crate::scenes::RADIUS;
use tumble_collide::{Aabb, Vec3};

/// Space per sphere, as an edge in meters: the density of the piles at the start.
const PITCH: f64 = 0.24;

/// The kind of a crowd.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// In a cube, moving by 1 % of a radius per step.
    Slow,
    /// In a cube, moving by a whole radius per step.
    Fast,
    /// Slow, with every other one static.
    HalfStatic,
    /// Slow, inside a static box that overlaps all.
    Huge,
    /// Slow, in a single layer.
    Layer,
    /// Slow, ten by ten and as high as necessary.
    Tower,
    /// Slow, with one in a hundred removed and inserted elsewhere in each step.
    Churn,
    /// Slow, of sizes from 1 to 30, the large ones rare.
    Sizes,
}

impl Kind {
    /// All kinds, with their names.
    pub const ALL: [(Kind, &'static str); 8] = [
        (Kind::Slow, "slow"),
        (Kind::Fast, "fast"),
        (Kind::HalfStatic, "half static"),
        (Kind::Huge, "in one huge box"),
        (Kind::Layer, "flat layer"),
        (Kind::Tower, "tower"),
        (Kind::Churn, "1 % replaced"),
        (Kind::Sizes, "sizes 1 to 30"),
    ];
}

/// Boxes, and how they move.
pub struct Crowd {
    /// World boxes, meters.
    pub boxes: Vec<Aabb>,
    /// Whether each moves.
    pub moving: Vec<bool>,
    /// Whether each was removed and inserted again by the last step.
    pub replaced: Vec<bool>,
    velocities: Vec<Vec3>,
    kind: Kind,
    half: Vec3,
    random: Random,
    turn: usize,
}

impl Crowd {
    /// Makes `n` boxes in a space of constant density.
    pub fn new(kind: Kind, n: usize) -> Crowd {
        let side = |k: f64| 0.5 * PITCH * k;
        let half = match kind {
            Kind::Layer => Vec3::new(side((n as f64).sqrt()), side((n as f64).sqrt()), 0.01),
            Kind::Tower => Vec3::new(side(10.0), side(10.0), side(n as f64 / 100.0)),
            _ => Vec3::repeat(side((n as f64).cbrt())),
        };
        let mut random = Random(n as u64);
        let mut crowd = Crowd {
            boxes: Vec::new(),
            moving: Vec::new(),
            replaced: vec![false; n],
            velocities: Vec::new(),
            kind,
            half,
            random: Random(0),
            turn: 0,
        };
        let speed = if kind == Kind::Fast { RADIUS } else { 0.01 * RADIUS };
        for i in 0..n {
            let center = half.map(|h| random.within(h));
            let direction = Vec3::from_fn(|_, _| random.within(1.0));
            crowd.boxes.push(ball(center, size(kind, &mut random)));
            crowd.velocities.push(direction * (speed / direction.norm().max(0.1)));
            crowd.moving.push(kind != Kind::HalfStatic || i % 2 == 0);
        }
        if kind == Kind::Huge {
            (crowd.boxes[0], crowd.moving[0]) = (Aabb { min: -half, max: half }, false);
        }
        crowd.random = random;
        crowd
    }

    /// Advances by one step.
    pub fn advance(&mut self) {
        for ((b, v), _) in
            self.boxes.iter_mut().zip(&mut self.velocities).zip(&self.moving).filter(|(_, moves)| **moves)
        {
            b.min += *v;
            b.max += *v;
            for k in 0..3 {
                let center = 0.5 * (b.min[k] + b.max[k]);
                if center * v[k] > 0.0 && center.abs() > self.half[k] {
                    v[k] = -v[k];
                }
            }
        }
        if self.kind == Kind::Churn {
            self.replaced.fill(false);
            self.turn = (self.turn + 1) % 100;
            for i in (self.turn..self.boxes.len()).step_by(100) {
                let center = self.half.map(|h| self.random.within(h));
                (self.boxes[i], self.replaced[i]) = (ball(center, RADIUS), true);
            }
        }
    }
}

fn ball(center: Vec3, radius: f64) -> Aabb {
    Aabb { min: center.add_scalar(-radius), max: center.add_scalar(radius) }
}

/// Returns half the width of a box; of mixed sizes, a fraction s^-3 is larger than s times the
/// smallest.
fn size(kind: Kind, random: &mut Random) -> f64 {
    let uniform = 0.5 * (1.0 + random.within(1.0));
    if kind == Kind::Sizes { 0.5 * RADIUS * (1.0 - uniform).max(1e-9).cbrt().recip().min(30.0) } else { RADIUS }
}
