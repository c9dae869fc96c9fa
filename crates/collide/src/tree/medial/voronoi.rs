//! Voronoi vertices as spheres: the sphere through the corners of each Delaunay cell, and how it lies to the solid.
//!
//! ```text
//! u = b − a, v = c − a, w = d − a
//! o = a + (|u|² v×w + |v|² w×u + |w|² u×v) / (2 u·(v×w))
//! ```
//!
//! `u·(v×w)` is taken from the exact predicate, since it is what goes wrong in slivers. Eight corners of a large box
//! around the points are sites too: the cells of all others then end, so that each point of the surface lies in some
//! sphere (see [`super::adaptive`]).

use super::delaunay::{Delaunay, orient};
use crate::tree::sphere::Sphere;
use crate::{Aabb, MeshDistance, Vec3};

/// Half the side of the box around, in diagonals of what is inside.
const BOX: f64 = 1.5;
/// A sphere whose corners are not at one distance to this part of the radius has no center in floating point.
const ROUND: f64 = 1e-4;

/// What is known of a Voronoi vertex.
#[derive(Clone, Copy, Debug)]
pub(in crate::tree) struct VoronoiSphere {
    /// Holds its four forming points (meters).
    pub sphere: Sphere,
    /// Of the center, meters, negative inside the solid; positive infinity for centers well outside of the points' box,
    /// which are not looked up.
    pub signed_distance: f64,
    /// Whether the center is inside the solid.
    pub internal: bool,
}

/// A tetrahedralization of sites within a large box, and the sphere of each cell.
pub(in crate::tree) struct Voronoi<'a> {
    pub delaunay: Delaunay,
    distance: &'a MeshDistance,
    /// Around what can be inside the solid.
    bounds: Aabb,
    /// By cell; `None` for ghosts, dead cells and slivers beyond floating point.
    spheres: Vec<Option<VoronoiSphere>>,
}

/// Number of corners of the box, which are the first vertices.
pub(in crate::tree) const CORNERS: usize = 8;

impl<'a> Voronoi<'a> {
    /// Of `sites`, which are vertices from [`CORNERS`] on. `solid` is the box of the solid, which all sites ever to be
    /// inserted must lie in; `None` if it is not finite or is a single point.
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

    /// The sphere of a cell.
    pub fn sphere(&self, cell: u32) -> Option<&VoronoiSphere> {
        self.spheres.get(cell as usize)?.as_ref()
    }

    /// Inserts a site, walking from `hint`; whether it was new. The changes are the tetrahedralization's `created` and
    /// `removed`.
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

    /// The signed distance of a cell's center, looked up if it was not yet.
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

/// The sphere about the center of the sphere through four points, grown to hold them all; `None` where floating point
/// does not give it.
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
