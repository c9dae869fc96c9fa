//! Rays against all bodies of a world.
//!
//! The boxes of the bodies form a tree ([`BoxTree`]) that lives for one call, and every mesh has a
//! tree of its own triangles, built by its first ray. The trees only skip what a ray does not meet,
//! so the hits are those of a search over all parts, bit for bit. Few rays are searched for without
//! a tree. Of several parts at one distance, the first one added is hit.

use super::{Part, QueryFilter};
use crate::world::view::ObjectId;
use crate::world::{Core, World};
use tumble_collide::{Aabb, BoxTree, RayHit, Shape, Vec3};

/// Maximum number of rays that are searched for without a tree.
const FEW: usize = 4;
/// Minimum number of rays of a piece on one thread.
const RAYS: usize = 256;

/// A ray in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, meters.
    pub origin: Vec3,
    /// Direction, of any length above 0.
    pub direction: Vec3,
    /// Distance at which the ray ends, meters; may be infinite.
    pub max_distance: f64,
}

/// The first body that a ray enters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayCastHit {
    /// The object.
    pub id: ObjectId,
    /// Its part.
    pub part: usize,
    /// The shape of the part: the index of a compound's part; 0 for all other shapes.
    pub shape: usize,
    /// Distance from the origin of the ray, meters.
    pub distance: f64,
    /// Outward unit normal of the surface there, world axes.
    pub normal: Vec3,
    /// The face of the shape: see [`RayHit::face`].
    pub face: u32,
}

/// The parts of a cast.
struct Targets<'w> {
    /// Half-spaces and others without a finite box.
    unbounded: Vec<Part<'w>>,
    /// In the order of the tree's slots.
    bounded: Vec<Part<'w>>,
    tree: Option<BoxTree>,
}

impl World {
    /// Returns the first body that a ray enters; `None` if it meets nothing within its length, or
    /// has no direction. A ray that starts inside a convex shape does not meet that shape. A mesh
    /// is hit on its outside only.
    pub fn cast_ray(&self, ray: &Ray, filter: &QueryFilter) -> Option<RayCastHit> {
        Targets::new(self.parts_by(filter), false).first(ray)
    }

    /// Returns the hits of [`cast_ray`](Self::cast_ray) for many rays, on
    /// [`Settings::threads`](crate::Settings::threads) threads. The number of threads changes no
    /// bit.
    pub fn cast_rays(&self, rays: &[Ray], filter: &QueryFilter) -> Vec<Option<RayCastHit>> {
        self.core.cast(&Targets::new(self.parts_by(filter), rays.len() > FEW), rays)
    }
}

impl Core {
    /// Returns the first parts that rays enter, without those that `skip` selects.
    pub(crate) fn parts_along(&self, rays: &[Ray], skip: impl Fn(ObjectId, usize) -> bool) -> Vec<Option<RayCastHit>> {
        self.cast(&Targets::new(self.parts().filter_map(solid_unless(skip)), rays.len() > FEW), rays)
    }

    fn cast(&self, targets: &Targets<'_>, rays: &[Ray]) -> Vec<Option<RayCastHit>> {
        let mut hits = vec![None; rays.len()];
        let mut threads = self.threads.clone();
        threads.set(self.settings.threads);
        let (mut work, mut left) = (Vec::new(), &mut hits[..]);
        for piece in threads.pieces(rays.len(), RAYS) {
            let (first, rest) = std::mem::take(&mut left).split_at_mut(piece.len());
            work.push((&rays[piece], first));
            left = rest;
        }
        threads.each(work, |(rays, hits)| {
            hits.iter_mut().zip(rays).for_each(|(hit, ray)| *hit = targets.first(ray));
        });
        hits
    }

    /// Returns the distance to the first part that a ray enters, without those that `skip` selects.
    pub(crate) fn distance_along(&self, ray: &Ray, skip: impl Fn(ObjectId, usize) -> bool) -> Option<f64> {
        let seen = self.parts().filter_map(solid_unless(skip));
        let targets = Targets { unbounded: seen.collect(), bounded: Vec::new(), tree: None };
        targets.first(ray).map(|hit| hit.distance)
    }
}

/// Returns a part, with its shapes that are no triggers, if it stops rays of sensors and `skip` does not select it.
fn solid_unless<'w>(skip: impl Fn(ObjectId, usize) -> bool) -> impl Fn(Part<'w>) -> Option<Part<'w>> {
    move |part| if skip(part.id, part.part) { None } else { part.solid() }
}

impl<'w> Targets<'w> {
    fn new(parts: impl Iterator<Item = Part<'w>>, with_tree: bool) -> Targets<'w> {
        let (unbounded, mut bounded): (Vec<_>, Vec<_>) =
            parts.partition(|part| matches!(*part.shape, Shape::HalfSpace));
        let tree = with_tree.then(|| {
            let boxes: Vec<Aabb> = bounded.iter().map(|part| part.shape.tight_aabb(&part.pose)).collect();
            let tree = BoxTree::new(&boxes);
            bounded = tree.order().iter().map(|&k| bounded[k as usize].clone()).collect();
            tree
        });
        Targets { unbounded, bounded, tree }
    }

    fn first(&self, ray: &Ray) -> Option<RayCastHit> {
        let direction = ray.direction.try_normalize(0.0)?;
        if !(ray.origin.sum() + direction.sum()).is_finite() {
            return None;
        }
        let (mut limit, mut best) = (ray.max_distance, None::<(usize, RayCastHit)>);
        let mut meet = |part: &Part<'_>, limit: &mut f64| {
            let Some(RayHit { distance, normal, face, shape }) =
                part.shape.cast_ray(&part.pose, &ray.origin, &direction, *limit)
            else {
                return;
            };
            let row = part.entry.state_range.parts.start + part.part;
            if best.as_ref().is_none_or(|(other, hit)| distance < hit.distance || row < *other) {
                *limit = distance;
                let shape = shape as usize;
                best = Some((row, RayCastHit { id: part.id, part: part.part, shape, distance, normal, face }));
            }
        };
        self.unbounded.iter().for_each(|part| meet(part, &mut limit));
        match &self.tree {
            Some(tree) => {
                tree.visit_along(&ray.origin, &direction, &mut limit, |slot, limit| meet(&self.bounded[slot], limit))
            }
            None => self.bounded.iter().for_each(|part| meet(part, &mut limit)),
        }
        best.map(|(_, hit)| hit)
    }
}
