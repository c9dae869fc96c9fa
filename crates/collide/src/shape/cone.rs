//! Cones about their centers of mass: the base at `z = −h/4`, the tip at `z = 3h/4`.
//!
//! ```text
//! side     n(w) = (h·w + r·z)/L,   L² = h² + r²,   w a unit direction across the axis
//! section  s = (p − tip)·(r·w − h·z)/L                place along the side, from the tip, 0 to L
//! ```

use crate::Vec3;

/// A cone along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cone {
    pub radius: f64,
    pub height: f64,
}

/// The nearest part of a cone's surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ConePart {
    Side,
    Base,
    Rim,
    Tip,
}

impl Cone {
    pub fn base(&self) -> f64 {
        -0.25 * self.height
    }

    pub fn tip(&self) -> f64 {
        0.75 * self.height
    }

    /// Returns the length of the side from the tip to the rim, meters.
    pub fn side_length(&self) -> f64 {
        (self.radius * self.radius + self.height * self.height).sqrt()
    }

    /// Returns the components of the side's normal across and along the axis.
    pub fn side_normal(&self) -> (f64, f64) {
        let length = self.side_length();
        (self.height / length, self.radius / length)
    }

    /// Returns the unit direction across the axis to a point; x on the axis.
    pub fn outward(&self, p: &Vec3) -> Vec3 {
        Vec3::new(p.x, p.y, 0.0).try_normalize(1e-12 * self.radius).unwrap_or_else(Vec3::x)
    }

    /// Returns the signed distances of a point from the side's and the base's planes, and its place
    /// along the side from the tip, meters.
    pub fn planes(&self, p: &Vec3) -> (f64, f64, f64) {
        let (across, along) = self.side_normal();
        let (r, z) = (p.xy().norm(), p.z - self.tip());
        (across * r + along * z, self.base() - p.z, along * r - across * z)
    }

    /// Returns the part of the surface closest to a point, with signed distance and outward normal.
    pub fn closest(&self, p: &Vec3) -> (ConePart, f64, Vec3) {
        let (side, base, place) = self.planes(p);
        let (across, along) = self.side_normal();
        let outward = self.outward(p);
        let normal = outward * across + Vec3::z() * along;
        let r = p.xy().norm();
        if side <= 0.0 && base <= 0.0 {
            return if side >= base { (ConePart::Side, side, normal) } else { (ConePart::Base, base, -Vec3::z()) };
        }
        if base >= 0.0 && r <= self.radius {
            return (ConePart::Base, base, -Vec3::z());
        }
        if side >= 0.0 && (0.0..=self.side_length()).contains(&place) {
            return (ConePart::Side, side, normal);
        }
        let (part, from) = match place < 0.0 {
            true => (ConePart::Tip, Vec3::z() * self.tip()),
            false => (ConePart::Rim, outward * self.radius + Vec3::z() * self.base()),
        };
        let offset = p - from;
        let distance = offset.norm();
        (part, distance, offset.try_normalize(0.0).unwrap_or(normal))
    }

    /// Returns the point farthest along a direction; the middle of the base, or of the rim, where many
    /// are.
    pub fn support_point(&self, n: &Vec3) -> Vec3 {
        let across = n.xy().norm();
        if n.z * self.height > across * self.radius {
            return Vec3::z() * self.tip();
        }
        let outward = Vec3::new(n.x, n.y, 0.0).try_normalize(1e-9 * n.norm()).unwrap_or_default();
        outward * self.radius + Vec3::z() * self.base()
    }

    /// Returns the largest `n·x`, meters.
    pub fn support(&self, n: &Vec3) -> f64 {
        (n.z * self.tip()).max(n.xy().norm() * self.radius + n.z * self.base())
    }
}
