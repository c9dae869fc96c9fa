//! Ray casts against shapes.
//!
//! In the frame of the shape the ray is `o + t·d`, `|d| = 1`. Sphere: `t² + 2 t o·d + o² − r² = 0`.
//! A slab `|x| ≤ h` is entered and left at `(∓h − o)/d`; a point is inside a box if it is inside
//! all slabs (Kay and Kajiya, 1986). The side of a cylinder is a sphere in the two dimensions
//! across its axis. An ellipsoid is a sphere in scaled axes. Cones and rounded shapes are entered by
//! tangents ([`convex`]). Meshes search a tree of boxes ([`triangles`]).

mod box_tree;
mod convex;
mod triangles;

use crate::shape::cone::{Cone, ConePart};
use crate::{CompoundShape, Pose, Shape, TriMesh, Vec3};
pub use box_tree::BoxTree;
pub(crate) use triangles::RayMesh;
use triangles::ShearedRay;

/// The point at which a ray enters a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Distance from the origin of the ray, meters.
    pub distance: f64,
    /// Outward unit normal of the surface there, world axes.
    pub normal: Vec3,
    /// The face: the index of a mesh's triangle; 0 to 5 for −x, +x, −y, +y, −z and +z of a box; 0,
    /// 1 and 2 for the side, the −z end and the +z end of a cylinder; 0 and 1 for the side and the base
    /// of a cone; on a rounded edge the face whose normal is nearest; of a compound the face of the part
    /// that it enters; 0 for all others.
    pub face: u32,
    /// The shape: the index of a compound's part; 0 for all other shapes.
    pub shape: u32,
}

/// Maximum number of entries into one part of a compound that are inside other parts.
const MAX_ENTRIES: usize = 64;
/// Step behind such an entry, in radii of the compound.
const STEP: f64 = 1e-9;

/// A hit in the frame of the shape.
type LocalHit = (f64, Vec3, u32);

impl Shape {
    /// Returns where a ray from `origin` along `direction` (any length above 0, world axes) enters
    /// the shape at `pose` within `max_distance` meters. `None` if it misses, and for a convex shape
    /// if it starts inside; from inside a mesh it is where the ray enters again.
    ///
    /// The first ray builds the tree of a mesh.
    pub fn cast_ray(&self, pose: &Pose, origin: &Vec3, direction: &Vec3, max_distance: f64) -> Option<RayHit> {
        let inverse = pose.rotation.inverse();
        let d = inverse * direction.try_normalize(0.0)?;
        let o = inverse * (origin - pose.translation.vector);
        let ((distance, normal, face), shape) = match self {
            Shape::Compound(compound) => compound_entry(compound, &o, &d, max_distance)?,
            _ => (self.cast_local(&o, &d, max_distance)?, 0),
        };
        (distance <= max_distance).then(|| RayHit { distance, normal: pose.rotation * normal, face, shape })
    }

    /// Returns the entry into any shape but a compound.
    fn cast_local(&self, o: &Vec3, d: &Vec3, max: f64) -> Option<LocalHit> {
        match self {
            Shape::HalfSpace => (o.z > 0.0 && d.z < 0.0).then(|| (-o.z / d.z, Vec3::z(), 0)),
            Shape::Sphere { radius } => sphere(o, d, *radius).map(|t| (t, (o + d * t) / *radius, 0)),
            Shape::Box { half_extents } => slabs(o, d, half_extents),
            Shape::Capsule { radius, half_length } => {
                let inside = (o - Vec3::z() * o.z.clamp(-half_length, *half_length)).norm() < *radius;
                let side = tube(o, d, *radius).filter(|t| (o.z + t * d.z).abs() <= *half_length);
                let caps = [-half_length, *half_length].map(|z| sphere(&(o - Vec3::z() * z), d, *radius));
                let t =
                    side.into_iter().chain(caps.into_iter().flatten()).min_by(f64::total_cmp).filter(|_| !inside)?;
                let p = o + d * t;
                Some((t, (p - Vec3::z() * p.z.clamp(-half_length, *half_length)) / *radius, 0))
            }
            Shape::Cylinder(c) => {
                let (r, h) = (c.radius(), c.half_length());
                let side = tube(o, d, r).filter(|t| (o.z + t * d.z).abs() <= h);
                let end = -h.copysign(d.z) - o.z;
                let cap = Some(end / d.z).filter(|t| *t >= 0.0 && (o + d * *t).xy().norm() <= r);
                match (side, cap) {
                    (Some(t), cap) if cap.is_none_or(|cap| t <= cap) => {
                        let p = o + d * t;
                        Some((t, Vec3::new(p.x, p.y, 0.0) / r, 0))
                    }
                    (_, cap) => cap.map(|t| if d.z > 0.0 { (t, -Vec3::z(), 1) } else { (t, Vec3::z(), 2) }),
                }
            }
            Shape::Mesh(mesh) => {
                // a ray that misses the bounding sphere misses the mesh
                let near = o - d * o.dot(d);
                if near.norm() > mesh.bounding_radius() {
                    return None;
                }
                let hit = mesh.ray_mesh().cast(o, d, max)?;
                let [a, b, c] = mesh.mesh().corners(hit.triangle as usize);
                let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vec3::z);
                Some((hit.distance, normal, hit.triangle))
            }
            Shape::Compound(_) => None,
            Shape::Ellipsoid { half_axes } => {
                let scaled = d.component_div(half_axes);
                let length = scaled.norm();
                let t = sphere(&o.component_div(half_axes), &(scaled / length), 1.0)? / length;
                let normal = (o + d * t).component_div(half_axes).component_div(half_axes);
                Some((t, normal.normalize(), 0))
            }
            Shape::Cone { radius, height } => {
                let cone = Cone { radius: *radius, height: *height };
                let distance = |p: &Vec3| {
                    let (part, distance, normal) = cone.closest(p);
                    (distance, normal, u32::from(part == ConePart::Base))
                };
                convex::entry(o, d, self.bounding_radius(), max, distance)
            }
            Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {
                let (core, rounding) = self.core();
                let distance = |p: &Vec3| {
                    let at = core.closest_point(&Pose::identity(), p);
                    (at.distance - rounding, at.normal, self.face_of(&at.normal))
                };
                convex::entry(o, d, self.bounding_radius(), max, distance)
            }
        }
    }
}

impl Shape {
    /// Returns the face of a rounded shape that a normal belongs to: the one that it is closest to.
    fn face_of(&self, normal: &Vec3) -> u32 {
        let of_axis = |k: usize| 2 * k as u32 + u32::from(normal[k] > 0.0);
        match self {
            Shape::RoundedCylinder { .. } if normal.z.abs() <= normal.xy().norm() => 0,
            Shape::RoundedCylinder { .. } => 1 + u32::from(normal.z > 0.0),
            _ => of_axis(normal.iamax()),
        }
    }
}

/// Returns where a ray enters a part from outside of all others, and the index of that part.
fn compound_entry(compound: &CompoundShape, o: &Vec3, d: &Vec3, max: f64) -> Option<(LocalHit, u32)> {
    let nearest = o - d * o.dot(d);
    if nearest.norm() > compound.bounding_radius() {
        return None;
    }
    let step = STEP * compound.bounding_radius();
    let mut best: Option<(LocalHit, u32)> = None;
    for (n, part, own) in compound.active_parts() {
        let mut start = 0.0;
        for _ in 0..MAX_ENTRIES {
            let limit = best.map_or(max, |((distance, ..), _)| distance) - start;
            let Some(hit) = part.cast_ray(own, &(o + d * start), d, limit) else { break };
            let distance = start + hit.distance;
            if !compound.is_buried(n, &(o + d * distance)) {
                if best.is_none_or(|((nearest, ..), _)| distance < nearest) {
                    best = Some(((distance, hit.normal, hit.face), n as u32));
                }
                break;
            }
            // a part that is not convex may be entered again
            start = distance + step;
        }
    }
    best
}

impl TriMesh {
    /// Returns the distance along `direction` (any length above 0) at which a ray from `origin`
    /// first hits a triangle of the mesh at `pose`, from either side, meters; world axes.
    pub fn ray(&self, pose: &Pose, origin: &Vec3, direction: &Vec3) -> Option<f64> {
        let d = pose.rotation.inverse() * direction.try_normalize(0.0)?;
        let o = pose.rotation.inverse() * (origin - pose.translation.vector);
        let ray = ShearedRay::new(&o, &d);
        let hits = (0..self.triangles.len()).filter_map(|t| ray.meet(&self.corners(t)));
        hits.map(|(distance, _)| distance).min_by(f64::total_cmp)
    }
}

fn sphere(o: &Vec3, d: &Vec3, radius: f64) -> Option<f64> {
    // measured from the point of the ray nearest to the center, so that distant spheres keep their
    // digits
    let along = -o.dot(d);
    let left = radius * radius - (o + d * along).norm_squared();
    (left >= 0.0).then(|| along - left.sqrt()).filter(|t| *t >= 0.0)
}

/// The side of an infinite cylinder about z.
fn tube(o: &Vec3, d: &Vec3, radius: f64) -> Option<f64> {
    let across = d.xy().norm();
    if across == 0.0 {
        return None;
    }
    sphere(&Vec3::new(o.x, o.y, 0.0), &(Vec3::new(d.x, d.y, 0.0) / across), radius).map(|t| t / across)
}

fn slabs(o: &Vec3, d: &Vec3, half: &Vec3) -> Option<LocalHit> {
    let (mut enter, mut leave, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    for k in 0..3 {
        if d[k] == 0.0 {
            if o[k].abs() > half[k] {
                return None;
            }
            continue;
        }
        let (a, b) = ((-half[k] - o[k]) / d[k], (half[k] - o[k]) / d[k]);
        if a.min(b) > enter {
            (enter, axis) = (a.min(b), k);
        }
        leave = leave.min(a.max(b));
    }
    let upper = d[axis] < 0.0;
    let normal = Vec3::ith(axis, if upper { 1.0 } else { -1.0 });
    (enter >= 0.0 && enter <= leave).then_some((enter, normal, 2 * axis as u32 + u32::from(upper)))
}
