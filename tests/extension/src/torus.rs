//! A rigid body with a surface of its own: an exact torus, without a mesh.
//!
//! ```text
//! gap = |p − c| − r − s        c: the point of the circle of radius R that is nearest to p
//! gap = n·c − d − r            c: the lowest point of the circle above the plane n·x = d
//! I = m·diag(½·R² + ⅝·r², ½·R² + ⅝·r², R² + ¾·r²)
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `R`, `r` | radius of the circle in the middle of the tube, and of the tube; the axis is z |
//! | `p`, `s` | center and radius of a sphere |
//!
//! A sphere in the hole and a plane below can touch it in several places, so contacts are also made at the
//! points of the circle 120° before and after `c`.

use std::f64::consts::TAU;
use tumble_core::collide::{Contact, Mat3, NormalFrom, Pose, Shape, Vec3};
use tumble_core::*;

/// A torus: everything is as of a rigid body, except its contacts with spheres and half-spaces.
#[derive(Clone)]
pub struct Torus {
    body: RigidBody,
    major: f64,
    minor: f64,
}

impl Torus {
    /// Makes a torus of a mass, kg, with the radii of its circle and its tube, m. `None` for radii that make none.
    pub fn new(mass: f64, major: f64, minor: f64) -> Option<Torus> {
        let around = Shape::cylinder(major + minor, 2.0 * minor).ok().filter(|_| major > minor)?;
        let (big, small) = (major * major, minor * minor);
        let across = 0.5 * big + 0.625 * small;
        let inertia = mass * Mat3::from_diagonal(&Vec3::new(across, across, big + 0.75 * small));
        Some(Torus { body: RigidBody::new(around).with_mass_and_inertia(mass, inertia), major, minor })
    }
    /// Changes the body: its pose, velocity, material and the like.
    pub fn with(self, change: impl FnOnce(RigidBody) -> RigidBody) -> Torus {
        Torus { body: change(self.body), ..self }
    }

    /// Calls `work` for the point of the circle along `toward`, and for those 120° before and after it: its number, the
    /// point and the direction of the circle there, world axes.
    fn each_point(&self, pose: &Pose, toward: &Vec3, mut work: impl FnMut(u64, Vec3, Vec3)) {
        let angle = toward.y.atan2(toward.x);
        for k in 0..3 {
            let (sin, cos) = (angle + TAU / 3.0 * k as f64).sin_cos();
            let point = pose.transform_point(&Vec3::new(self.major * cos, self.major * sin, 0.0).into()).coords;
            work(k, point, pose.rotation * Vec3::new(-sin, cos, 0.0));
        }
    }

    fn meets_sphere(&self, pose: &Pose, center: &Vec3, radius: f64, margin: f64, out: &mut Vec<Contact>) {
        let local = pose.inverse_transform_point(&(*center).into()).coords;
        self.each_point(pose, &local, |feature, point, along| {
            let arm = point - center;
            let (distance, gap) = (arm.norm(), arm.norm() - self.minor - radius);
            if gap <= margin && distance > 0.0 {
                let normal = arm / distance;
                let (core_a, core_b, normal_from) = (self.minor, radius, NormalFrom::LineOfA(along));
                let point = center + (radius + 0.5 * gap) * normal;
                out.push(Contact { point, normal, gap, feature, core_a, core_b, normal_from, shapes: [0; 2] });
            }
        });
    }

    fn meets_plane(&self, pose: &Pose, plane: &Pose, margin: f64, out: &mut Vec<Contact>) {
        let normal = plane.rotation * Vec3::z();
        let down = pose.rotation.inverse() * -normal;
        // a torus that stands rolls about its axis, where its core then is; one that lies tilts about its tube
        let standing = down.xy().norm();
        let core_a = self.minor + if standing > 0.5 { self.major / standing } else { 0.0 };
        self.each_point(pose, &down, |feature, point, _| {
            let gap = normal.dot(&(point - plane.translation.vector)) - self.minor;
            if gap <= margin {
                let (core_b, normal_from) = (0.0, NormalFrom::FaceOfB);
                let point = point - (self.minor + 0.5 * gap) * normal;
                out.push(Contact { point, normal, gap, feature, core_a, core_b, normal_from, shapes: [0; 2] });
            }
        });
    }
}

impl Intersect for Torus {
    fn contacts(&self, own: &IntersectPart, other: &IntersectPart, margin: f64, out: &mut Vec<Contact>) -> bool {
        match other.shape {
            Shape::Sphere { radius } => {
                self.meets_sphere(own.pose, &other.pose.translation.vector, *radius, margin, out);
                true
            }
            Shape::HalfSpace => {
                self.meets_plane(own.pose, other.pose, margin, out);
                true
            }
            _ => false,
        }
    }
}

impl Collidable for Torus {
    fn shape(&self, _part: usize) -> Option<&Shape> {
        Some(self.body.shape())
    }
    fn intersect(&self, _part: usize) -> Option<&dyn Intersect> {
        Some(self)
    }
    fn material(&self, part: usize) -> Material {
        self.body.collidable().map_or_else(Material::default, |body| body.material(part))
    }
}

impl Object for Torus {
    fn new_cache(&self) -> Cache {
        self.body.new_cache()
    }
    fn refresh(&self, x: &[f64], cache: &mut Cache, part_states: &mut [PartState]) {
        self.body.refresh(x, cache, part_states);
    }
    fn integratable(&self) -> Option<&dyn Integratable> {
        self.body.integratable()
    }
    fn collidable(&self) -> Option<&dyn Collidable> {
        Some(self)
    }
}
