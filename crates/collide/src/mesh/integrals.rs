//! Exact volume integrals over a closed mesh, by signed tetrahedra.
//!
//! Each triangle `(a, b, c)` and a reference point `o` span a tetrahedron of signed volume `D/6`, `D = a·(b × c)`
//! with `o` as origin. Over it, `∫ x = D/24 s` and `∫ x xᵀ = D/120 (s sᵀ + a aᵀ + b bᵀ + c cᵀ)` with `s = a + b + c`.
//! Sums over a closed surface are exact for the solid. The reference is the middle of the bounding box, so that a
//! mesh far from the origin loses no digits. Source: Mirtich, *Fast and accurate computation of polyhedral mass
//! properties* (1996) for the problem; the tetrahedral form is in Blow and Binstock, *How to find the inertia tensor
//! of a 3D solid body* (2004).

use super::TriMesh;
use crate::{MassProperties, Mat3, Vec3};

impl TriMesh {
    /// Signed volume, m³: positive if the triangles are wound outwards. Means something only for a closed mesh.
    pub fn signed_volume(&self) -> f64 {
        self.moments().0
    }

    /// Mass, centre of mass and inertia of the solid at a uniform `density` (kg/m³). The mesh must be closed and
    /// wound outwards.
    pub fn mass_properties(&self, density: f64) -> MassProperties {
        let (volume, first, second) = self.moments();
        let center = first / volume;
        let about_center = second - center * center.transpose() * volume;
        MassProperties {
            mass: density * volume,
            center_of_mass: self.middle() + center,
            inertia: (Mat3::identity() * about_center.trace() - about_center) * density,
        }
    }

    fn middle(&self) -> Vec3 {
        let bounds = self.aabb();
        0.5 * (bounds.min + bounds.max)
    }

    /// `∫ 1`, `∫ x`, `∫ x xᵀ` about the middle of the bounding box.
    fn moments(&self) -> (f64, Vec3, Mat3) {
        let o = self.middle();
        let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
        for t in 0..self.triangles.len() {
            let [a, b, c] = self.corners(t).map(|p| p - o);
            let d = a.dot(&b.cross(&c));
            let s = a + b + c;
            volume += d / 6.0;
            first += s * (d / 24.0);
            second += (s * s.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose()) * (d / 120.0);
        }
        (volume, first, second)
    }
}
