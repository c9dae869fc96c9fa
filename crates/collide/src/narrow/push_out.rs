//! Ellipsoids, cylinders and rounded cylinders whose center is inside a mesh that is not convex, or whose axis is
//! and nothing else shows it: the least translation nearby that takes them out.
//!
//! Such a body has no vertices, and its contacts are the places where its surface is parallel to that of the
//! mesh. Deep inside there may be none, or only those with a wall that is not the nearest. So the body is moved
//! out along the normal of the nearest face, and the translation is then shortened. Outside, distances are
//! exact ([`surfaces_apart`]):
//!
//! ```text
//! v₀ = n·s                     s: the first of h(−n) − d(c) and longer ones after which the two are apart
//! v  ← n·(n·v − g)             the shortest translation onto the tangent plane of the closest points
//! v  ← (v + vₒ)/2              if they overlap after v, back towards vₒ, the last after which they are apart
//! ```
//!
//! The second line is a fixed-point iteration for the least `|v|` at which the two touch: there `v` is parallel
//! to `n` and `g = 0`. It ends at a local minimum, or in a groove between two walls at a translation
//! that no tangent plane shortens.
//!
//! | symbol | meaning |
//! |---|---|
//! | `c` | point of the smooth body inside the mesh; `d(c)` its signed distance, below 0 |
//! | `v` | translation of A, m |
//! | `g`, `n` | distance of the two after `v`, and its direction from B to A |
//! | `h` | support function of the smooth body about the point inside |

use super::{contacts_without_push, with_body};
use crate::distance::surfaces_apart;
use crate::sdf::{DistanceField, TOUCHING};
use crate::{ClosestPair, Contact, ContactMode, NormalFrom, Pose, Shape, Vec3};

/// Maximum number of translations that are tried for the first one out.
const MAX_LONGER: usize = 32;
/// Maximum number of translations that are tried for shorter ones.
const MAX_SHORTER: usize = 16;
/// Number of axes of the two bodies along which a way out is tried.
const AXES: usize = 2;
/// Maximum number of samples of an axis.
const MAX_SAMPLES: f64 = 64.0;
/// Ratio of two translations that are tried for the first one out.
const LONGER: f64 = 1.25;
/// Gain at which the search ends, as a fraction of the translation.
const MIN_GAIN: f64 = 1e-3;
/// Fraction of a distance that a step leaves, so that the two stay apart.
const LEFT: f64 = 1e-4;
/// Margin of the contacts after the translation, in radii of the smaller body.
const MARGIN: f64 = 0.02;
/// Smallest cosine between a contact's normal and the translation.
const MIN_ALIGNMENT: f64 = 0.7;
/// Cosine above which the translation is that of a contact.
const ALIGNED: f64 = 1.0 - 1e-6;
/// Feature of the contact of the closest points.
const FEATURE: u64 = 6 << 56;

/// A place where a smooth body is searched for points inside a mesh.
#[derive(Clone, Copy)]
pub(super) enum Place {
    Center,
    /// The axis of a cylinder, whose side may go through the middle of a face, where neither has an element.
    Axis,
}

/// Appends the contacts of a smooth body that has a point of `place` inside a mesh that is not convex. Returns
/// false for all other pairs.
pub(super) fn push_out(
    place: Place,
    (a, pose_a): (&Shape, &Pose),
    (b, pose_b): (&Shape, &Pose),
    margin: f64,
    out: &mut Vec<Contact>,
) -> bool {
    let Some(pair) = Pair::inside(place, (a, pose_a), (b, pose_b), 1.0)
        .or_else(|| Pair::inside(place, (b, pose_b), (a, pose_a), -1.0))
    else {
        return false;
    };
    let Some((v, touch)) = pair.least_way_out() else { return false };
    let direction = v.normalize();
    let (depth, first) = (v.norm() - (touch[0] - touch[1]).norm(), out.len());
    let size = a.bounding_radius().min(b.bounding_radius());
    contacts_without_push(ContactMode::Surface, (a, &moved(pose_a, &v)), (b, pose_b), MARGIN * size, out);
    let mut kept = first;
    for n in first..out.len() {
        let along = out[n].normal.dot(&direction);
        let contact = Contact { point: out[n].point - 0.5 * v, gap: out[n].gap - v.norm() * along, ..out[n] };
        if along > MIN_ALIGNMENT && out[n].gap > -MARGIN * size && contact.gap <= margin {
            out[kept] = contact;
            kept += 1;
        }
    }
    out.truncate(kept);
    if out[first..].iter().all(|c| c.normal.dot(&direction) < ALIGNED || c.gap > -(1.0 - MARGIN) * depth) {
        out.push(Contact {
            point: 0.5 * (touch[0] + touch[1]) - 0.5 * v,
            normal: direction,
            gap: -depth,
            feature: FEATURE,
            core_a: 0.0,
            core_b: 0.0,
            normal_from: NormalFrom::Edges,
            shapes: [0; 2],
        });
    }
    true
}

fn moved(pose: &Pose, v: &Vec3) -> Pose {
    Pose::from_parts((pose.translation.vector + v).into(), pose.rotation)
}

/// A smooth body with a point inside a mesh.
struct Pair<'a> {
    smooth: &'a Shape,
    pose: &'a Pose,
    mesh: &'a Shape,
    pose_mesh: &'a Pose,
    point: Vec3,
    /// 1 if the smooth body is A, −1 if it is B.
    sign: f64,
}

impl<'a> Pair<'a> {
    /// Returns the pair of a smooth body and a mesh that is not convex, if the body has a point of `place` inside.
    fn inside(
        place: Place,
        (smooth, pose): (&'a Shape, &'a Pose),
        (other, pose_mesh): (&'a Shape, &'a Pose),
        sign: f64,
    ) -> Option<Pair<'a>> {
        let Shape::Mesh(mesh) = other else { return None };
        let half_length = match (smooth, place) {
            (Shape::Ellipsoid { .. } | Shape::Cylinder(_) | Shape::RoundedCylinder { .. }, Place::Center) => 0.0,
            (Shape::Cylinder(core) | Shape::RoundedCylinder { core, .. }, Place::Axis) => core.half_length(),
            _ => return None,
        };
        let [surface] = mesh.surfaces() else { return None };
        if surface.field.is_convex() {
            return None;
        }
        let to_mesh = pose_mesh.inv_mul(pose);
        // a length within which the axis may be inside unseen
        let overlooked = 2.0 * half_length / MAX_SAMPLES;
        let mut z = -half_length;
        while z <= half_length {
            let at = Vec3::z() * z;
            let local = to_mesh.transform_point(&at.into()).coords;
            let mut distance = surface.field.bound(&local);
            if distance < overlooked.max(f64::MIN_POSITIVE) {
                distance = surface.field.hit(&local, &[], TOUCHING).nearest;
            }
            if distance < 0.0 {
                let point = pose.transform_point(&at.into()).coords;
                return Some(Pair { smooth, pose, mesh: other, pose_mesh, point, sign });
            }
            z += distance.max(overlooked).max(f64::MIN_POSITIVE);
        }
        None
    }

    /// Returns the shortest translation of A that is found, and the points that are then closest.
    fn least_way_out(&self) -> Option<(Vec3, [Vec3; 2])> {
        let nearest = self.mesh.closest_point(self.pose_mesh, &self.point);
        let axes = [self.pose, self.pose_mesh].map(|pose| *pose.rotation.to_rotation_matrix().matrix());
        let from = self.mesh.bounding_radius() + (self.point - self.pose_mesh.translation.vector).norm();
        let along_axis = |n: Vec3| {
            let hit = self.mesh.cast_ray(self.pose_mesh, &(self.point + n * from), &-n, from)?;
            Some(n * (from - hit.distance + self.height(&n)))
        };
        let signs = [1.0, -1.0].into_iter();
        let mut starts: Vec<Vec3> =
            signs.flat_map(|s| (0..6).filter_map(move |n| along_axis(axes[n % 2].column(n / 2) * s))).collect();
        starts.sort_by(|x, y| x.norm_squared().total_cmp(&y.norm_squared()));
        starts.truncate(AXES);
        starts.insert(0, nearest.normal * (self.height(&nearest.normal) - nearest.distance));
        let mut best: Option<(Vec3, [Vec3; 2])> = None;
        for start in starts {
            let is_shorter = |v: &Vec3| best.is_none_or(|best| v.norm() < best.0.norm());
            if is_shorter(&start)
                && let Some(found) = self.first_way_out(start).map(|first| self.shortened(first))
                && is_shorter(&found.0)
            {
                best = Some(found);
            }
        }
        best.map(|(v, points)| if self.sign > 0.0 { (v, points) } else { (-v, points.map(|p| p - v)) })
    }

    /// Returns how far the smooth body reaches against a direction from the point inside.
    fn height(&self, n: &Vec3) -> f64 {
        let (core, radius) = self.smooth.core();
        let mut height = radius + n.dot(&(self.point - self.pose.translation.vector));
        with_body(&core, 0, &mut |body| height += body.elements.support(&-(self.pose.rotation.inverse() * n)));
        height
    }

    /// Returns the closest points after the smooth body is moved; `None` if the two overlap.
    fn apart_after(&self, v: &Vec3) -> Option<ClosestPair> {
        surfaces_apart(self.smooth, &moved(self.pose, v), self.mesh, self.pose_mesh).ok()
    }

    /// Returns the first translation along `start` and at least as long after which the two are apart.
    fn first_way_out(&self, start: Vec3) -> Option<(Vec3, ClosestPair)> {
        let mut v = start * (1.0 + LEFT);
        for _ in 0..MAX_LONGER {
            if let Some(pair) = self.apart_after(&v) {
                return Some((v, pair));
            }
            v *= LONGER;
        }
        None
    }

    /// Returns a translation that is shorter, as far as tangent planes lead, and the points that are then closest.
    fn shortened(&self, (mut v, mut pair): (Vec3, ClosestPair)) -> (Vec3, [Vec3; 2]) {
        let mut next = None;
        for _ in 0..MAX_SHORTER {
            let toward = next.unwrap_or_else(|| {
                let along = pair.normal.dot(&v);
                pair.normal * (along - pair.distance * (1.0 - LEFT))
            });
            if toward.norm() > v.norm() * (1.0 - MIN_GAIN) {
                break;
            }
            match self.apart_after(&toward) {
                Some(found) => (v, pair, next) = (toward, found, None),
                None => next = Some(0.5 * (toward + v)),
            }
        }
        // along the translation itself no shorter distance makes them overlap
        for _ in 0..MAX_SHORTER {
            if pair.distance <= MIN_GAIN * v.norm() {
                break;
            }
            let shorter = v * (1.0 - (1.0 - LEFT) * pair.distance / v.norm());
            let Some(found) = self.apart_after(&shorter) else { break };
            (v, pair) = (shorter, found);
        }
        (v, pair.points)
    }
}
