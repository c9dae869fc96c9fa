//! The surface of a part at a contact, as far as the motion of the contact depends on it.
//!
//! ```text
//! P = r·(1 − n·nᵀ) + Q          rate of the surface's point by its normal
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `r` | distance from the core feature to the surface, m |
//! | `Q` | curvature that is no sphere: of an ellipsoid, or of a rim ([`Shape::curvature`]) |

use crate::object::part_state::PartState;
use tumble_collide::{Mat3, Shape, Vec3};

/// A surface at a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rounded {
    /// `r`.
    pub core: f64,
    /// `Q`, world axes.
    more: Option<Mat3>,
    /// The radius of the rim or the longest half axis of the ellipsoid, m: over a small part of it `Q` holds.
    size: f64,
}

impl Rounded {
    /// Returns a sphere about a core feature.
    pub fn sphere(core: f64) -> Rounded {
        Rounded { core, more: None, size: 0.0 }
    }

    /// Returns the surface of one shape of a part, where it has a core radius (m), at a point (m) with an outward normal.
    pub fn of(
        shape: Option<&Shape>,
        state: &PartState,
        (index, core): (u32, f64),
        (point, outward): (Vec3, Vec3),
    ) -> Rounded {
        let placed = match shape {
            Some(Shape::Compound(compound)) => {
                compound.placed().nth(index as usize).map(|(shape, pose)| (shape, state.pose * pose))
            }
            other => other.map(|shape| (shape, state.pose)),
        };
        let Some((shape, pose)) = placed else { return Rounded::sphere(core) };
        let (sphere, curved, size) = match shape {
            Shape::Ellipsoid { half_axes } => (0.0, true, half_axes.max()),
            Shape::Cylinder(cylinder) => (core, core == 0.0, cylinder.radius()),
            Shape::Cone { radius, .. } => (core, core == 0.0, *radius),
            Shape::RoundedCylinder { core: inner, rounding } => (core, core == *rounding, inner.radius()),
            _ => (core, false, 0.0),
        };
        let local = || {
            let point = pose.inverse_transform_point(&point.into()).coords;
            shape.curvature(&point, &pose.inverse_transform_vector(&outward))
        };
        let Some(local) = curved.then(local).flatten() else { return Rounded::sphere(core) };
        let axes = pose.rotation.to_rotation_matrix().into_inner();
        Rounded { core: sphere, more: Some(axes * local * axes.transpose()), size }
    }

    /// Returns `P·ṅ` for a rate of the normal, 1/s.
    pub fn rate(&self, normal: &Vec3) -> Vec3 {
        self.core * normal + self.by_curvature(normal)
    }

    /// Returns `Q·ṅ` for a rate of the normal, 1/s.
    pub fn by_curvature(&self, normal: &Vec3) -> Vec3 {
        self.more.map_or(Vec3::zeros(), |more| more * normal)
    }

    /// Returns how far the normal and the point turn over the surface for a change of the normal against the material, rad: `Q` is
    /// that of the point where it is.
    pub fn turn(&self, normal: &Vec3) -> f64 {
        self.more.map_or(0.0, |more| normal.norm().max((more * normal).norm() / self.size))
    }

    /// Returns the sum of both `Q`, if either has one.
    pub fn more_with(&self, other: &Rounded) -> Option<Mat3> {
        match (self.more, other.more) {
            (None, None) => None,
            (a, b) => Some(a.unwrap_or_else(Mat3::zeros) + b.unwrap_or_else(Mat3::zeros)),
        }
    }
}
