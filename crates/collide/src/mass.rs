//! Mass properties of the primitives in closed form.
//!
//! | symbol | meaning |
//! |---|---|
//! | `ρ`, `m` | density (kg/m³), mass (kg) |
//! | `I` | inertia about the center of mass, body axes (kg·m²) |
//! | `r`, `l` | radius and half length (m) |

use crate::{Mat3, Vec3};
use std::f64::consts::PI;

/// Mass, center of mass and inertia of a solid of uniform density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass: f64,
    /// Center of mass in the shape's own frame, meters.
    pub center_of_mass: Vec3,
    /// Inertia about the center of mass, in the shape's axes, kg·m².
    pub inertia: Mat3,
}

impl MassProperties {
    /// Returns the properties scaled to a total mass of `mass` kg.
    pub fn with_mass(&self, mass: f64) -> MassProperties {
        MassProperties { mass, inertia: self.inertia * (mass / self.mass), ..*self }
    }

    /// Returns the inertia about another point of the same frame: `I + m (|d|² 1 − d dᵀ)`, the
    /// parallel-axis theorem.
    pub fn inertia_about(&self, point: &Vec3) -> Mat3 {
        let d = self.center_of_mass - point;
        self.inertia + self.mass * (Mat3::identity() * d.norm_squared() - d * d.transpose())
    }

    fn centered(mass: f64, diagonal: Vec3) -> MassProperties {
        MassProperties { mass, center_of_mass: Vec3::zeros(), inertia: Mat3::from_diagonal(&diagonal) }
    }
}

/// `I = 2/5 m r²`.
pub(crate) fn sphere(radius: f64, density: f64) -> MassProperties {
    let mass = density * sphere_volume(radius);
    MassProperties::centered(mass, Vec3::repeat(0.4 * mass * radius * radius))
}

/// `Ixx = m (hy² + hz²) / 3` for half extents `h`.
pub(crate) fn cuboid(half: &Vec3, density: f64) -> MassProperties {
    let mass = density * cuboid_volume(half);
    let square = half.component_mul(half);
    MassProperties::centered(mass, (Vec3::repeat(square.sum()) - square) * (mass / 3.0))
}

/// `Izz = m r² / 2`, `Ixx = m (r² / 4 + l² / 3)`.
pub(crate) fn cylinder(radius: f64, half_length: f64, density: f64) -> MassProperties {
    let mass = density * cylinder_volume(radius, half_length);
    let across = mass * (radius * radius / 4.0 + half_length * half_length / 3.0);
    MassProperties::centered(mass, Vec3::new(across, across, mass * radius * radius / 2.0))
}

/// A cylinder and two hemispheres, whose centers of mass lie `3/8 r` outside the ends of the
/// cylinder.
pub(crate) fn capsule(radius: f64, half_length: f64, density: f64) -> MassProperties {
    let tube = cylinder(radius, half_length, density);
    let sphere = sphere(radius, density);
    let (r, l) = (radius, half_length);
    // both halves: 2/5 m r² about the cap's flat center, shifted to the middle of the capsule
    let across = sphere.mass * (0.4 * r * r + l * l + 0.75 * r * l);
    MassProperties::centered(
        tube.mass + sphere.mass,
        tube.inertia.diagonal() + Vec3::new(across, across, sphere.inertia[(2, 2)]),
    )
}

pub(crate) fn sphere_volume(radius: f64) -> f64 {
    4.0 / 3.0 * PI * radius.powi(3)
}

pub(crate) fn cuboid_volume(half: &Vec3) -> f64 {
    8.0 * half.product()
}

pub(crate) fn cylinder_volume(radius: f64, half_length: f64) -> f64 {
    2.0 * PI * radius * radius * half_length
}
