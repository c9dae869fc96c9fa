//! Boxes and cylinders with rounded edges: all points within a radius of a smaller core.
//!
//! ```text
//! d(p) = d_core(p) − r outside the core; the normal is that of the core
//! contact at gap g of the cores:   gap g − r_a − r_b,   core_a + r_a,   core_b + r_b
//! ```

use super::{half, positive};
use crate::{Contact, CylinderShape, Shape, ShapeError, Vec3};
use std::sync::Arc;

impl Shape {
    /// Returns a box with edges of `size` along x, y and z, whose edges and corners are rounded by the
    /// radius `rounding`, meters. The faces are where those of [`Shape::cuboid`] are. A rounding of 0
    /// is a plain box.
    ///
    /// ```
    /// use tumble_collide::{Shape, Vec3};
    /// let die = Shape::rounded_cuboid(Vec3::repeat(0.02), 0.004)?;
    /// assert!(die.volume() < 0.02_f64.powi(3) && die.volume() > 0.9 * 0.02_f64.powi(3));
    /// # Ok::<(), tumble_collide::ShapeError>(())
    /// ```
    ///
    /// # Errors
    /// [`ShapeError::Length`] if an edge is not finite and above 0, [`ShapeError::Rounding`] if the
    /// rounding is below 0 or not less than half the shortest edge.
    pub fn rounded_cuboid(size: Vec3, rounding: f64) -> Result<Shape, ShapeError> {
        let plain = Shape::cuboid(size)?;
        let Shape::Box { half_extents } = plain else { return Ok(plain) };
        if rounding == 0.0 {
            return Ok(plain);
        }
        check(rounding, half_extents.min())?;
        Ok(Shape::RoundedBox { half_extents, rounding })
    }

    /// Returns a cylinder along z of `radius` and `length`, whose rims are rounded by the radius
    /// `rounding`, meters. Side and ends are where those of [`Shape::cylinder`] are. A rounding of 0 is
    /// a plain cylinder.
    ///
    /// # Errors
    /// [`ShapeError::Length`] if a size is not finite and above 0, [`ShapeError::Rounding`] if the
    /// rounding is below 0 or not less than the radius and half the length.
    pub fn rounded_cylinder(radius: f64, length: f64, rounding: f64) -> Result<Shape, ShapeError> {
        positive("radius of a cylinder", radius)?;
        let half_length = half("length of a cylinder", length)?;
        if rounding == 0.0 {
            return Shape::cylinder(radius, length);
        }
        check(rounding, radius.min(half_length))?;
        let core = CylinderShape::new(radius - rounding, 2.0 * (half_length - rounding))?;
        Ok(Shape::RoundedCylinder { core: Arc::new(core), rounding })
    }

    /// Returns the core of a rounded shape and its radius; any other shape itself and 0.
    pub fn core(&self) -> (Shape, f64) {
        match self {
            Shape::RoundedBox { half_extents, rounding } => {
                (Shape::Box { half_extents: half_extents.add_scalar(-rounding) }, *rounding)
            }
            Shape::RoundedCylinder { core, rounding } => (Shape::Cylinder(core.clone()), *rounding),
            other => (other.clone(), 0.0),
        }
    }

    /// Returns whether the shape is the core of [`Shape::core`] with a radius.
    pub(crate) fn is_rounded(&self) -> bool {
        matches!(self, Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. })
    }
}

/// Returns the contact of two bodies that are `a` and `b` thicker all around, meters.
pub(crate) fn thickened(contact: Contact, a: f64, b: f64) -> Contact {
    Contact {
        point: contact.point + contact.normal * (0.5 * (b - a)),
        gap: contact.gap - a - b,
        core_a: contact.core_a + a,
        core_b: contact.core_b + b,
        ..contact
    }
}

pub(super) fn check(rounding: f64, limit: f64) -> Result<(), ShapeError> {
    // the core keeps a thickness, so that its faces have normals
    if rounding > 0.0 && limit.is_finite() && rounding <= limit * (1.0 - LEAST_CORE) {
        Ok(())
    } else {
        Err(ShapeError::Rounding { rounding, limit })
    }
}

/// Smallest half extent of a core, as a fraction of that of its shape.
const LEAST_CORE: f64 = 1e-3;
