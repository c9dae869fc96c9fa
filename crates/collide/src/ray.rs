//! Ray casts against shapes.
//!
//! In the frame of the shape the ray is `o + t·d`, `|d| = 1`. Sphere: `t² + 2 t o·d + o² − r² = 0`.
//! A slab `|x| ≤ h` is entered and left at `(∓h − o)/d`; a point is inside a box if it is inside
//! all slabs (Kay and Kajiya, 1986). The side of a cylinder is a sphere in the two dimensions
//! across its axis. Triangles: Möller and Trumbore (1997), of a solid from outside only, of a mesh
//! from either side.

use crate::{Pose, Shape, TriMesh, Vec3};

impl Shape {
    /// Returns the distance along `direction` (any length above 0) at which a ray from `origin`
    /// enters the shape at `pose`, meters; world axes. `None` if it misses or starts inside.
    pub fn ray(&self, pose: &Pose, origin: &Vec3, direction: &Vec3) -> Option<f64> {
        let d = pose.rotation.inverse() * direction.try_normalize(0.0)?;
        let o = pose.rotation.inverse() * (origin - pose.translation.vector);
        match self {
            Shape::HalfSpace => (o.z > 0.0 && d.z < 0.0).then(|| -o.z / d.z),
            Shape::Sphere { radius } => sphere(&o, &d, *radius),
            Shape::Box { half_extents } => slabs(&o, &d, half_extents),
            Shape::Capsule { radius, half_length } => {
                let inside = (o - Vec3::z() * o.z.clamp(-half_length, *half_length)).norm() < *radius;
                let side = tube(&o, &d, *radius).filter(|t| (o.z + t * d.z).abs() <= *half_length);
                let caps = [-half_length, *half_length].map(|z| sphere(&(o - Vec3::z() * z), &d, *radius));
                side.into_iter().chain(caps.into_iter().flatten()).min_by(f64::total_cmp).filter(|_| !inside)
            }
            Shape::Cylinder(c) => {
                let (r, h) = (c.radius(), c.half_length());
                let side = tube(&o, &d, r).filter(|t| (o.z + t * d.z).abs() <= h);
                let end = -h.copysign(d.z) - o.z;
                let cap = Some(end / d.z).filter(|t| *t >= 0.0 && (o + d * *t).xy().norm() <= r);
                side.into_iter().chain(cap).min_by(f64::total_cmp)
            }
            Shape::Mesh(mesh) => {
                // a ray that misses the bounding sphere misses the mesh
                let near = o - d * o.dot(&d);
                if near.norm() > mesh.bounding_radius() { None } else { triangles(mesh.mesh(), &o, &d, 0.0) }
            }
        }
    }
}

impl TriMesh {
    /// Returns the distance along `direction` (any length above 0) at which a ray from `origin`
    /// first hits a triangle of the mesh at `pose`, from either side, meters; world axes.
    pub fn ray(&self, pose: &Pose, origin: &Vec3, direction: &Vec3) -> Option<f64> {
        let d = pose.rotation.inverse() * direction.try_normalize(0.0)?;
        let o = pose.rotation.inverse() * (origin - pose.translation.vector);
        triangles(self, &o, &d, f64::NEG_INFINITY)
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

fn slabs(o: &Vec3, d: &Vec3, half: &Vec3) -> Option<f64> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for k in 0..3 {
        if d[k] == 0.0 {
            if o[k].abs() > half[k] {
                return None;
            }
            continue;
        }
        let (a, b) = ((-half[k] - o[k]) / d[k], (half[k] - o[k]) / d[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter >= 0.0 && enter <= leave).then_some(enter)
}

/// Skips triangles whose signed volume with the ray is at most `least`: they are hit from behind.
fn triangles(mesh: &TriMesh, o: &Vec3, d: &Vec3, least: f64) -> Option<f64> {
    let hit = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let (ab, ac) = (b - a, c - a);
        let p = d.cross(&ac);
        let volume = ab.dot(&p);
        if volume <= least || volume == 0.0 {
            return None; // from behind, or edge on
        }
        let s = o - a;
        let (u, q) = (s.dot(&p) / volume, s.cross(&ab));
        let v = d.dot(&q) / volume;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| ac.dot(&q) / volume).filter(|t| *t >= 0.0)
    };
    (0..mesh.triangles.len()).filter_map(hit).min_by(f64::total_cmp)
}
