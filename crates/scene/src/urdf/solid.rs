//! The solid of a link by formula, against which its spheres are measured.

use tumble_core::collide::{Aabb, MeshDistance, Pose, SolidSamples, Vec3};

use super::fit::{FittedSphere, Form};

/// The union of the shapes of a link.
pub(super) struct Solid {
    shapes: Vec<Shape>,
    bounds: Aabb,
}

/// A shape; poses are of the link in the frame of the shape.
enum Shape {
    Capsule { radius: f64, half: f64, pose: Pose },
    Cylinder { radius: f64, half: f64, pose: Pose },
    Mesh(Box<MeshDistance>),
}

/// How spheres of a link compare with it.
pub(super) struct Figures {
    /// Mean by area of the distance of the exposed surface of the spheres outside the link, meters.
    pub mean_outward: f64,
    /// Volume of the link, m³.
    pub volume: f64,
    /// Volume of the spheres outside the link, m³.
    pub volume_outside: f64,
}

impl Solid {
    pub fn of(forms: &[Form]) -> Solid {
        let corners = |form: &Form| {
            let shape = form.covered();
            let bulge = shape.bulge;
            let mesh = Aabb::around(shape.solid().vertices.iter().copied());
            [mesh.min.add_scalar(-bulge), mesh.max.add_scalar(bulge)]
        };
        Solid { shapes: forms.iter().map(Shape::of).collect(), bounds: Aabb::around(forms.iter().flat_map(corners)) }
    }

    /// Returns the signed distance, exact for points outside, meters.
    pub fn distance(&self, p: &Vec3) -> f64 {
        self.shapes.iter().map(|shape| shape.distance(p)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the box around it.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Measures spheres.
    pub fn measure(&self, spheres: &[FittedSphere]) -> Figures {
        let reach = spheres.iter().map(|sphere| sphere.outward).fold(0.0, f64::max);
        let balls: Vec<(Vec3, f64)> = spheres.iter().map(|s| (s.center, s.radius)).collect();
        let distance = |p: &Vec3| self.distance(p);
        let samples = SolidSamples::new(&self.bounds, reach, &distance);
        Figures {
            mean_outward: samples.mean_protrusion(&balls),
            volume: samples.volume(),
            volume_outside: samples.volume_outside(&balls),
        }
    }
}

impl Shape {
    fn of(form: &Form) -> Shape {
        match form {
            Form::Capsule { radius, length, pose } => {
                Shape::Capsule { radius: *radius, half: 0.5 * length, pose: pose.inverse() }
            }
            Form::Cylinder { radius, length, pose } => {
                Shape::Cylinder { radius: *radius, half: 0.5 * length, pose: pose.inverse() }
            }
            Form::Mesh { given, closed } => Shape::Mesh(Box::new(MeshDistance::new(closed.as_ref().unwrap_or(given)))),
        }
    }

    fn distance(&self, p: &Vec3) -> f64 {
        let local = |pose: &Pose| (pose * nalgebra::Point3::from(*p)).coords;
        match self {
            Shape::Capsule { radius, half, pose } => {
                let q = local(pose);
                (q - Vec3::z() * q.z.clamp(-half, *half)).norm() - radius
            }
            Shape::Cylinder { radius, half, pose } => {
                let q = local(pose);
                let [side, end] = [q.x.hypot(q.y) - radius, q.z.abs() - half];
                side.max(0.0).hypot(end.max(0.0)) + side.max(end).min(0.0)
            }
            Shape::Mesh(mesh) => mesh.closest(p).signed_distance,
        }
    }
}
