//! The linear algebra types that all crates share.

/// A vector in three dimensions. Frame and unit are stated at its use.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3×3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// A unit quaternion; in flat arrays and files its order is `x, y, z, w`.
pub type Quat = nalgebra::UnitQuaternion<f64>;
/// The pose of a body frame in the world, `X_WB`: rotate, then translate (meters).
pub type Pose = nalgebra::Isometry3<f64>;

/// An axis-aligned box in world axes, meters. Unbounded sides are `±∞`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least corner.
    pub min: Vec3,
    /// Greatest corner.
    pub max: Vec3,
}

impl Aabb {
    /// Returns the distance of two boxes, meters; 0 if they overlap.
    pub fn distance(&self, other: &Aabb) -> f64 {
        (self.min - other.max).sup(&(other.min - self.max)).sup(&Vec3::zeros()).norm()
    }

    /// Returns the box around two boxes.
    pub fn merged(&self, other: &Aabb) -> Aabb {
        Aabb { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    /// Returns whether the two boxes share a point; touching counts.
    pub fn overlaps(&self, other: &Aabb) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }

    /// Returns the box grown by `margin` meters on every side.
    pub fn grown(&self, margin: f64) -> Aabb {
        Aabb { min: self.min.add_scalar(-margin), max: self.max.add_scalar(margin) }
    }
}

impl Aabb {
    /// Returns the smallest box around points; empty (`min = +∞ > max = −∞`) for no points.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Aabb {
        let empty = Aabb { min: Vec3::repeat(f64::INFINITY), max: Vec3::repeat(f64::NEG_INFINITY) };
        points.into_iter().fold(empty, |b, p| Aabb { min: b.min.inf(&p), max: b.max.sup(&p) })
    }
}
