//! The entry of a ray into a convex solid, by its signed distance.
//!
//! ```text
//! f(t) = d(o + t·v)      convex in t,   f' = n·v,   n the gradient of the distance
//! t  ←  t − f/f'         Newton's method from outside: it never passes the first root
//! ```
//!
//! Where `f' ≥ 0` the ray has passed its nearest point and misses. The steps are those of a polyhedron
//! of tangent planes; at a grazing entry they halve the way.

use super::LocalHit;
use crate::Vec3;

/// Maximum number of steps; about six are taken.
const MAX_STEPS: usize = 100;
/// Distance at which the surface is reached, as a fraction of the radius of the solid.
const REACHED: f64 = 1e-14;
/// Distance from the bounding sphere at which a ray begins, as a fraction of its radius.
const OUTSIDE: f64 = 1e-9;

/// Returns where a ray from `o` along the unit direction `v` enters a solid within `radius` of the
/// origin. `distance` returns the signed distance of a point, the outward normal and the face.
pub(super) fn entry(
    o: &Vec3,
    v: &Vec3,
    radius: f64,
    max: f64,
    distance: impl Fn(&Vec3) -> (f64, Vec3, u32),
) -> Option<LocalHit> {
    // from a little outside of the bounding sphere on, so that distant rays keep their digits: a solid may touch
    // the sphere where the ray enters it, as the tip of a cone does
    let radius = radius * (1.0 + OUTSIDE);
    let along = -o.dot(v);
    let nearest = o + v * along;
    if nearest.norm_squared() > radius * radius {
        return None;
    }
    let half = (radius * radius - nearest.norm_squared()).sqrt();
    // counted from the nearest point to the origin
    let start = (-half).max(-along);
    let place = |s: f64| nearest + v * s;
    if distance(&place(start)).0 < 0.0 {
        return None;
    }
    let mut s = start;
    for _ in 0..MAX_STEPS {
        let (f, normal, face) = distance(&place(s));
        let slope = normal.dot(v);
        if f <= REACHED * radius {
            return (slope < 0.0).then_some((along + s, normal, face));
        }
        if slope >= 0.0 || s > half.min(max - along) {
            return None;
        }
        s -= f / slope;
    }
    // a grazing ray
    None
}
