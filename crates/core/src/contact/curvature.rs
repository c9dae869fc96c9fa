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
}

impl Rounded {
    /// Returns a sphere about a core feature.
    pub fn sphere(core: f64) -> Rounded {
        Rounded { core, more: None }
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
        let (sphere, curved) = match shape {
            Shape::Ellipsoid { .. } => (0.0, true),
            Shape::Cylinder(_) | Shape::Cone { .. } => (core, core == 0.0),
            Shape::RoundedCylinder { rounding, .. } => (core, core == *rounding),
            _ => (core, false),
        };
        let local = || {
            let point = pose.inverse_transform_point(&point.into()).coords;
            shape.curvature(&point, &pose.inverse_transform_vector(&outward))
        };
        let Some(local) = curved.then(local).flatten() else { return Rounded::sphere(core) };
        let axes = pose.rotation.to_rotation_matrix().into_inner();
        Rounded { core: sphere, more: Some(axes * local * axes.transpose()) }
    }

    /// Returns `P·ṅ` for a rate of the normal, 1/s.
    pub fn rate(&self, normal: &Vec3) -> Vec3 {
        self.core * normal + self.by_curvature(normal)
    }

    /// Returns `Q·ṅ` for a rate of the normal, 1/s.
    pub fn by_curvature(&self, normal: &Vec3) -> Vec3 {
        self.more.map_or(Vec3::zeros(), |more| more * normal)
    }

    /// Returns the sum of both `Q`, if either has one.
    pub fn more_with(&self, other: &Rounded) -> Option<Mat3> {
        match (self.more, other.more) {
            (None, None) => None,
            (a, b) => Some(a.unwrap_or_else(Mat3::zeros) + b.unwrap_or_else(Mat3::zeros)),
        }
    }
}
