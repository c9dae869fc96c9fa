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

/// `Ixx = m (ey² + ez²) / 5` for half axes `e`.
pub(crate) fn ellipsoid(half: &Vec3, density: f64) -> MassProperties {
    let mass = density * ellipsoid_volume(half);
    let square = half.component_mul(half);
    MassProperties::centered(mass, (Vec3::repeat(square.sum()) - square) * (mass / 5.0))
}

/// `Izz = 3/10 m r²`, `Ixx = 3/20 m r² + 3/80 m h²` about the center of mass, `h/4` above the base.
pub(crate) fn cone(radius: f64, height: f64, density: f64) -> MassProperties {
    let mass = density * cone_volume(radius, height);
    let across = mass * (3.0 / 20.0 * radius * radius + 3.0 / 80.0 * height * height);
    MassProperties::centered(mass, Vec3::new(across, across, 0.3 * mass * radius * radius))
}

/// A box of half extents `a` and all points within `r` of it: the box, slabs on its faces, quarter
/// cylinders along its edges, octants of a sphere at its corners.
///
/// ```text
/// ∫ x² dV = 8/3·a_x³·a_y·a_z                                            box
///         + 8/3·a_y·a_z·((a_x + r)³ − a_x³) + 8/3·r·a_x³·(a_y + a_z)    slabs
///         + 2/3·π·r²·a_x³ + 8·(a_y + a_z)·(π·r²·a_x²/4 + 2·a_x·r³/3 + π·r⁴/16)      edges
///         + 4/3·π·r³·a_x² + π·r⁴·a_x + 4/15·π·r⁵                        corners
/// ```
pub(crate) fn rounded_cuboid(core: &Vec3, r: f64, density: f64) -> MassProperties {
    let moment = Vec3::from_fn(|k, _| {
        let (a, b, c) = (core[k], core[(k + 1) % 3], core[(k + 2) % 3]);
        let faces = 8.0 / 3.0 * (b * c * (a + r).powi(3) + r * a.powi(3) * (b + c));
        let edge = PI * r * r * a * a / 4.0 + 2.0 / 3.0 * a * r.powi(3) + PI * r.powi(4) / 16.0;
        let edges = 2.0 / 3.0 * PI * r * r * a.powi(3) + 8.0 * (b + c) * edge;
        let corners = PI * r.powi(3) * (4.0 / 3.0 * a * a + r * a + 4.0 / 15.0 * r * r);
        density * (faces + edges + corners)
    });
    let mass = density * rounded_cuboid_volume(core, r);
    MassProperties::centered(mass, Vec3::repeat(moment.sum()) - moment)
}

/// A cylinder of radius `c` and half length `l` and all points within `r` of it. At a height `z`
/// above an end of the core the section is a disk of radius `c + w`, `w² = r² − z²`.
pub(crate) fn rounded_cylinder(c: f64, l: f64, r: f64, density: f64) -> MassProperties {
    let outer = c + r;
    // of both ends: ∫ (c + w)⁴ dz, ∫ (l + z)² (c + w)² dz
    let fourth = c.powi(4) * r
        + PI * c.powi(3) * r * r
        + 4.0 * c * c * r.powi(3)
        + 0.75 * PI * c * r.powi(4)
        + 8.0 / 15.0 * r.powi(5);
    let height = l * l * rounded_end(c, r)
        + 2.0 * l * (c * c * r * r / 2.0 + 2.0 * c * r.powi(3) / 3.0 + r.powi(4) / 4.0)
        + (c * c * r.powi(3) / 3.0 + PI * c * r.powi(4) / 8.0 + 2.0 / 15.0 * r.powi(5));
    let about = 0.5 * PI * density * (outer.powi(4) * 2.0 * l + 2.0 * fourth);
    let along = PI * density * (outer * outer * 2.0 / 3.0 * l.powi(3) + 2.0 * height);
    let across = 0.5 * about + along;
    MassProperties::centered(density * rounded_cylinder_volume(c, l, r), Vec3::new(across, across, about))
}

/// `∫ (c + w)² dz` over the rounded end of a cylinder.
fn rounded_end(c: f64, r: f64) -> f64 {
    c * c * r + 0.5 * PI * c * r * r + 2.0 / 3.0 * r.powi(3)
}

pub(crate) fn rounded_cuboid_volume(core: &Vec3, r: f64) -> f64 {
    let (faces, edges) = (core.x * core.y + core.y * core.z + core.z * core.x, core.sum());
    cuboid_volume(core) + 8.0 * r * faces + 2.0 * PI * r * r * edges + sphere_volume(r)
}

pub(crate) fn rounded_cylinder_volume(c: f64, l: f64, r: f64) -> f64 {
    2.0 * PI * ((c + r).powi(2) * l + rounded_end(c, r))
}

pub(crate) fn ellipsoid_volume(half: &Vec3) -> f64 {
    4.0 / 3.0 * PI * half.product()
}

pub(crate) fn cone_volume(radius: f64, height: f64) -> f64 {
    PI * radius * radius * height / 3.0
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
