//! Chains of spheres along the axis of a capsule.
//!
//! A capsule of radius `R` about a segment of length `L` is covered by `n` spheres of radius `R + h`
//! with centers on the segment, at equal distances, the first and the last `h` inside its ends:
//!
//! ```text
//! (R + h)² = R² + a²          a half distance between neighbors: they cover the side between them
//! L = 2 h + 2 (n − 1) a       an end sphere contains the ball of radius R about the end, h away
//! ```
//!
//! So all spheres extend `h` outside, the positive root of
//!
//! ```text
//! (m² − 1) h² + (2 R m² + L) h − L²/4 = 0,   m = n − 1
//! ```
//!
//! A chain from end to end has `L = 2 m a` instead and extends further.
//!
//! **Capsules of several shapes.** A cylinder with a sphere about each of its ends is a capsule too.
//! If the centers are within `δ` of the ends, radii included, the end spheres of the chain are `h − δ`
//! inside the ends, `h` is the root for `L + 2 δ`, and at least `δ`. The shapes contain the capsule
//! of radius `R − δ`, so the chain extends at most `h + δ` outside of them.

use tumble_core::collide::Vec3;

use super::fit::Form;

/// Largest deviation of a sphere at the end of a cylinder, as a fraction of the radius.
const ROUND: f64 = 0.01;
/// Relative error of containment.
const ROUNDING: f64 = 1e-9;

/// A capsule that is covered by spheres on its axis; a sphere if its ends are the same.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    pub ends: [Vec3; 2],
    pub radius: f64,
    /// Largest distance of the end spheres' centers from the ends, radii included.
    pub deviation: f64,
    /// The shape that its spheres are written instead of.
    pub shape: usize,
    /// Number of spheres.
    pub count: usize,
}

impl Chain {
    fn length(&self) -> f64 {
        (self.ends[1] - self.ends[0]).norm()
    }

    /// Returns whether it is one sphere.
    pub fn is_sphere(&self) -> bool {
        self.length() == 0.0
    }

    /// Returns by how much the radius of the spheres exceeds that of the capsule.
    fn excess(&self) -> f64 {
        excess(self.radius, self.length() + 2.0 * self.deviation, self.count).max(self.deviation)
    }

    /// Returns how far its spheres extend outside, meters.
    pub fn outward(&self) -> f64 {
        self.excess() + self.deviation
    }

    /// Returns the center and radius of each sphere.
    pub fn spheres(&self) -> Vec<(Vec3, f64)> {
        let (length, excess) = (self.length(), self.excess());
        let inset = excess - self.deviation;
        let fraction = |n: usize| match self.count {
            1 => 0.5,
            count => (inset + n as f64 / (count - 1) as f64 * (length - 2.0 * inset)) / length,
        };
        let center = |n: usize| self.ends[0] + (self.ends[1] - self.ends[0]) * fraction(n);
        (0..self.count).map(|n| (center(n), self.radius + excess)).collect()
    }

    fn contains(&self, center: &Vec3, radius: f64) -> bool {
        let along = self.ends[1] - self.ends[0];
        let square = along.norm_squared();
        let t = if square > 0.0 { ((center - self.ends[0]).dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
        (center - (self.ends[0] + along * t)).norm() + radius <= (self.radius + self.deviation) * (1.0 + ROUNDING)
    }
}

/// Returns how far `count` spheres extend outside a capsule.
fn excess(radius: f64, length: f64, count: usize) -> f64 {
    if length == 0.0 {
        return 0.0;
    }
    let square = ((count - 1) as f64).powi(2);
    let (a, b, c) = (square - 1.0, 2.0 * radius * square + length, 0.25 * length * length);
    // the discriminant is 0 for one sphere, except for rounding
    2.0 * c / (b + (b * b + 4.0 * a * c).max(0.0).sqrt())
}

/// Returns the capsules and spheres among the shapes of a link, and for each shape whether a chain
/// covers it.
pub(super) fn chains(forms: &[Form]) -> (Vec<Chain>, Vec<bool>) {
    let mut covered = vec![false; forms.len()];
    let mut chains: Vec<Chain> = Vec::new();
    for (shape, form) in forms.iter().enumerate() {
        let found = match form {
            Form::Capsule { radius, .. } => Some((*radius, 0.0)),
            Form::Cylinder { radius, .. } => end_deviation(form, forms).map(|by| (*radius, by)),
            Form::Mesh { .. } => None,
        };
        if let Some((radius, deviation)) = found {
            chains.push(Chain { ends: form.ends(), radius, deviation, shape, count: 1 });
            covered[shape] = true;
        }
    }
    // spheres inside other capsules or spheres
    let mut kept: Vec<Chain> = Vec::new();
    chains.sort_by(|a, b| b.radius.total_cmp(&a.radius).then(b.length().total_cmp(&a.length())));
    for chain in chains {
        if !chain.is_sphere() || !kept.iter().any(|other| other.contains(&chain.ends[0], chain.radius)) {
            kept.push(chain);
        }
    }
    kept.sort_by_key(|chain| chain.shape);
    (kept, covered)
}

/// Returns the largest deviation of the spheres about the ends of a cylinder, `None` if it is no
/// capsule with them.
fn end_deviation(cylinder: &Form, forms: &[Form]) -> Option<f64> {
    let Form::Cylinder { radius, .. } = cylinder else { return None };
    let deviation = |end: Vec3| {
        let spheres = forms.iter().filter_map(|form| match form {
            Form::Capsule { radius: own, length: 0.0, pose } => {
                Some((pose.translation.vector - end).norm() + (own - radius).abs())
            }
            _ => None,
        });
        spheres.fold(f64::INFINITY, f64::min)
    };
    let by = cylinder.ends().map(deviation).into_iter().fold(0.0, f64::max);
    (by <= ROUND * radius).then_some(if by <= ROUNDING * radius { 0.0 } else { by })
}
