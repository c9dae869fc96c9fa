//! Exact volume integrals over a closed mesh, by signed tetrahedra.
//!
//! Each triangle `(a, b, c)` and a reference point `o` span a tetrahedron of signed volume `D/6`,
//! `D = a·(b × c)` with `o` as origin. Over it, `∫ x = D/24 s` and `∫ x xᵀ = D/120 (s sᵀ + a aᵀ + b
//! bᵀ + c cᵀ)` with `s = a + b + c`. Sums over a closed surface are exact for the solid. The
//! reference is the middle of the bounding box, so that a mesh far from the origin loses no digits.
//! Source: Mirtich, *Fast and accurate computation of polyhedral mass properties* (1996) for the
//! problem; Blow and Binstock, *How to find the inertia tensor of a 3D solid body* (2004) for the
//! tetrahedral form.

use super::TriMesh;
use crate::{MassProperties, Mat3, Vec3};

impl TriMesh {
    /// Returns the signed volume, m³: positive if the triangles are wound outwards. Meaningful only
    /// for a closed mesh. Volume that the surface encloses twice counts twice.
    pub fn signed_volume(&self) -> f64 {
        self.moments().volume
    }

    /// Returns mass, center of mass and inertia of the solid at a uniform `density` (kg/m³). The
    /// mesh must be closed and outward-wound. Volume that the surface encloses twice counts twice;
    /// see [`TriMesh::union_mass_properties`].
    pub fn mass_properties(&self, density: f64) -> MassProperties {
        self.moments().mass_properties(&self.middle(), density)
    }

    pub(super) fn middle(&self) -> Vec3 {
        let bounds = self.aabb();
        0.5 * (bounds.min + bounds.max)
    }

    /// Returns the moments about the middle of the bounding box.
    fn moments(&self) -> Moments {
        Moments::of((0..self.triangles.len()).map(|t| (self.corners(t), 1.0)), &self.middle())
    }
}

/// The integrals `∫ 1`, `∫ x`, `∫ x xᵀ` about an origin.
pub(super) struct Moments {
    pub volume: f64,
    first: Vec3,
    second: Mat3,
}

impl Moments {
    /// Integrates over the solid bounded by weighted triangles.
    pub fn of(triangles: impl Iterator<Item = ([Vec3; 3], f64)>, origin: &Vec3) -> Moments {
        let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
        for (corners, weight) in triangles {
            let [a, b, c] = corners.map(|p| p - origin);
            let d = weight * a.dot(&b.cross(&c));
            let s = a + b + c;
            volume += d / 6.0;
            first += s * (d / 24.0);
            second += (s * s.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose()) * (d / 120.0);
        }
        Moments { volume, first, second }
    }

    pub fn mass_properties(&self, origin: &Vec3, density: f64) -> MassProperties {
        let center = self.first / self.volume;
        let about_center = self.second - center * center.transpose() * self.volume;
        MassProperties {
            mass: density * self.volume,
            center_of_mass: origin + center,
            inertia: (Mat3::identity() * about_center.trace() - about_center) * density,
        }
    }
}
