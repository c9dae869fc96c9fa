//! Voronoi spheres: the sphere through the corners of each Delaunay cell, and its relation to the
//! solid.
//!
//! ```text
//! u = b − a, v = c − a, w = d − a
//! o = a + (|u|² v×w + |v|² w×u + |w|² u×v) / (2 u·(v×w))
//! ```
//!
//! `u·(v×w)` comes from the exact predicate, since slivers make it inaccurate. Eight corners of a
//! large box around the points are sites too. They make the cells of all other sites bounded, so
//! each point of the surface lies in some sphere (see [`super::adaptive`]).

use super::delaunay::{Delaunay, orient};
use crate::tree::sphere::Sphere;
use crate::{Aabb, MeshDistance, Vec3};

/// Half the side of the surrounding box, in diagonals of the solid.
const BOX: f64 = 1.5;
/// Largest relative difference of the corners' distances from the center; beyond it, floating point
/// gives no center.
const ROUND: f64 = 1e-4;

/// The sphere of a Voronoi vertex.
#[derive(Clone, Copy, Debug)]
pub(in crate::tree) struct VoronoiSphere {
    /// Contains the four corners of the cell; meters.
    pub sphere: Sphere,
    /// Signed distance of the center, meters, negative inside the solid. Positive infinity for
    /// centers well outside the box of the points, whose distance is not computed.
    pub signed_distance: f64,
    /// Whether the center is inside the solid.
    pub internal: bool,
}

/// A tetrahedralization of sites within a large box, with the sphere of each cell.
pub(in crate::tree) struct Voronoi<'a> {
    pub delaunay: Delaunay,
    distance: &'a MeshDistance,
    /// Box around all centers that can be inside the solid.
    bounds: Aabb,
    /// By cell; `None` for ghosts, removed cells, and slivers beyond floating point.
    spheres: Vec<Option<VoronoiSphere>>,
}

/// Number of corners of the box. They are the first vertices.
pub(in crate::tree) const CORNERS: usize = 8;

impl<'a> Voronoi<'a> {
    /// Builds the tetrahedralization of `sites`, which are the vertices from [`CORNERS`] on.
    /// `solid` is the box of the solid, which must contain all sites, later ones included. Returns
    /// `None` if it is not finite or is a single point.
    pub fn new(sites: &[Vec3], solid: &Aabb, distance: &'a MeshDistance) -> Option<Voronoi<'a>> {
        let middle = 0.5 * (solid.min + solid.max);
        let half = BOX * (solid.max - solid.min).norm();
        if !(half > 0.0 && half.is_finite()) {
            return None;
        }
        let corner = |n: usize| {
            let sign = |bit: usize| if n >> bit & 1 == 0 { -half } else { half };
            middle + Vec3::new(sign(0), sign(1), sign(2))
        };
        let points: Vec<Vec3> = (0..CORNERS).map(corner).chain(sites.iter().copied()).collect();
        let delaunay = Delaunay::new(&points)?;
        let mut created = Voronoi {
            spheres: vec![None; delaunay.cell_count()],
            delaunay,
            distance,
            bounds: solid.grown(1e-3 * half),
        };
        for c in 0..created.delaunay.cell_count() as u32 {
            created.refresh(c);
        }
        Some(created)
    }

    /// Returns the sphere of a cell.
    pub fn sphere(&self, cell: u32) -> Option<&VoronoiSphere> {
        self.spheres.get(cell as usize)?.as_ref()
    }

    /// Inserts a site, walking from `hint`. Returns whether it was new. The tetrahedralization
    /// lists the changes in `created` and `removed`.
    pub fn insert(&mut self, p: Vec3, hint: u32) -> bool {
        if self.delaunay.insert(p, hint).is_none() {
            return false;
        }
        self.spheres.resize(self.delaunay.cell_count(), None);
        for n in 0..self.delaunay.removed().len() {
            self.spheres[self.delaunay.removed()[n] as usize] = None;
        }
        for n in 0..self.delaunay.created().len() {
            self.refresh(self.delaunay.created()[n]);
        }
        true
    }

    /// Returns the signed distance of a cell's center, computed on first use.
    pub fn signed_distance(&mut self, cell: u32) -> f64 {
        let distance = self.distance;
        self.spheres.get_mut(cell as usize).and_then(Option::as_mut).map_or(f64::INFINITY, |b| {
            if b.signed_distance == f64::INFINITY {
                b.signed_distance = distance.closest(&b.sphere.center).signed_distance;
            }
            b.signed_distance
        })
    }

    fn refresh(&mut self, cell: u32) {
        if !self.delaunay.is_finite(cell) {
            return;
        }
        self.spheres[cell as usize] = circumscribed(&self.delaunay.corners(cell)).map(|sphere| {
            let may_be_inside =
                (0..3).all(|k| sphere.center[k] >= self.bounds.min[k] && sphere.center[k] <= self.bounds.max[k]);
            let signed_distance =
                if may_be_inside { self.distance.closest(&sphere.center).signed_distance } else { f64::INFINITY };
            VoronoiSphere { sphere, signed_distance, internal: signed_distance < 0.0 }
        });
    }
}

/// Returns the sphere about the circumcenter of four points, grown to contain them all; `None` if
/// floating point does not determine it.
pub(in crate::tree) fn circumscribed(corners: &[Vec3; 4]) -> Option<Sphere> {
    let [a, b, c, d] = corners;
    let (u, v, w) = (b - a, c - a, d - a);
    let scaled = v.cross(&w) * u.norm_squared() + w.cross(&u) * v.norm_squared() + u.cross(&v) * w.norm_squared();
    let center = a - scaled / (2.0 * orient(a, b, c, d));
    if !center.iter().all(|x| x.is_finite()) {
        return None;
    }
    let squares = corners.map(|p| (p - center).norm_squared());
    let least = squares.iter().copied().fold(f64::INFINITY, f64::min).sqrt();
    let radius = squares.iter().copied().fold(0.0, f64::max).sqrt() * (1.0 + 1e-12);
    (radius.is_finite() && radius - least <= ROUND * radius).then_some(Sphere { center, radius })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriMesh;

    #[test]
    fn the_sphere_through_four_points_of_a_known_one() {
        let center = Vec3::new(1.0, -2.0, 3.0);
        let on = |x: f64, y: f64, z: f64| center + Vec3::new(x, y, z).normalize() * 0.7;
        let sphere =
            circumscribed(&[on(1.0, 0.0, 0.2), on(0.0, 1.0, 0.1), on(-1.0, 0.3, 0.0), on(0.1, 0.2, 1.0)]).unwrap();
        assert!((sphere.center - center).norm() < 1e-14 && (sphere.radius - 0.7).abs() < 1e-11);
        let flat = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(1.0, 2.0, 0.0)];
        assert_eq!(circumscribed(&flat), None);
    }

    #[test]
    fn inner_spheres_of_a_sphere_are_the_sphere() {
        let mesh = TriMesh::icosphere(1.0, 2);
        let distance = MeshDistance::new(&mesh);
        let voronoi = Voronoi::new(&mesh.vertices, &mesh.aabb(), &distance).unwrap();
        let inner: Vec<_> =
            voronoi.delaunay.finite_cells().filter_map(|c| voronoi.sphere(c)).filter(|b| b.internal).collect();
        assert!(!inner.is_empty());
        for b in inner {
            // vertices are on the unit sphere to rounding, which slivers magnify
            assert!((b.sphere.radius - 1.0).abs() < 1e-3 && b.sphere.center.norm() < 1e-3, "{b:?}");
        }
    }
}
