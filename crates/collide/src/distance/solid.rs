//! Shapes as the distance sees them: a convex core with a radius, or the triangles of a mesh.

use super::depth::{EdgeArc, Faces};
use super::gjk::Convex;
use crate::sdf::DistanceField;
use crate::sdf::elements::{Edge, Elements};
use crate::shape::{Cone, ellipsoid};
use crate::{Aabb, MeshShape, Pose, Shape, Vec3};
use std::cmp::Ordering;

/// A convex body at a pose: all points within a radius of a core.
pub(super) struct Core<'a> {
    kind: Kind<'a>,
    pose: Pose,
    pub radius: f64,
}

#[derive(Clone, Copy)]
enum Kind<'a> {
    Point,
    /// A segment on the z axis, of this half length.
    Segment(f64),
    Box(Vec3),
    Cylinder {
        radius: f64,
        half: f64,
    },
    Cone(Cone),
    Ellipsoid(Vec3),
    Hull(&'a Elements),
}

impl<'a> Core<'a> {
    /// Returns the core of a shape at a pose; `None` if it is not convex, or not bounded.
    pub fn of(shape: &'a Shape, pose: &Pose) -> Option<Core<'a>> {
        let cylinder = |radius, half| Kind::Cylinder { radius, half };
        let (kind, radius) = match shape {
            Shape::HalfSpace | Shape::Compound(_) => return None,
            Shape::Sphere { radius } => (Kind::Point, *radius),
            Shape::Capsule { radius, half_length } => (Kind::Segment(*half_length), *radius),
            Shape::Box { half_extents } => (Kind::Box(*half_extents), 0.0),
            Shape::RoundedBox { half_extents, rounding } => (Kind::Box(half_extents.add_scalar(-rounding)), *rounding),
            Shape::Cylinder(c) => (cylinder(c.radius(), c.half_length()), 0.0),
            Shape::RoundedCylinder { core, rounding } => (cylinder(core.radius(), core.half_length()), *rounding),
            Shape::Cone { radius, height } => (Kind::Cone(Cone { radius: *radius, height: *height }), 0.0),
            Shape::Ellipsoid { half_axes } => (Kind::Ellipsoid(*half_axes), 0.0),
            Shape::Mesh(mesh) => (Kind::Hull(hull(mesh)?), 0.0),
        };
        Some(Core { kind, pose: *pose, radius })
    }

    /// Returns a box of the local axes at a pose.
    pub fn of_box(bounds: &Aabb, pose: &Pose) -> Core<'static> {
        let (center, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min));
        Core { kind: Kind::Box(half), pose: pose * nalgebra::Translation3::from(center), radius: 0.0 }
    }

    /// Returns the body moved by a vector.
    pub fn moved(&self, by: &Vec3) -> Core<'a> {
        Core { pose: nalgebra::Translation3::from(*by) * self.pose, ..*self }
    }

    /// Returns how far the bodies reach into one another along a unit normal from B towards A, meters:
    /// a translation by as much separates them.
    pub fn overlap(&self, b: &Core<'_>, normal: &Vec3) -> f64 {
        normal.dot(&(b.support(normal) - self.support(&-normal))) + self.radius + b.radius
    }

    /// Returns the faces and edges of the core; `None` if it is curved.
    pub fn faces(&self) -> Option<Faces> {
        let axes = [0, 1, 2].map(|k| self.pose.rotation * Vec3::ith(k, 1.0));
        let edge = |direction: Vec3| EdgeArc { direction, normals: None };
        Some(match &self.kind {
            Kind::Point => Faces::default(),
            Kind::Segment(_) => Faces { normals: Vec::new(), edges: vec![edge(axes[2])] },
            Kind::Box(_) => Faces { normals: axes.to_vec(), edges: axes.map(edge).into() },
            Kind::Hull(elements) => {
                let turned = |ends: [Vec3; 2]| ends.map(|n| self.pose.rotation * n);
                let edge = |edge: &Edge| EdgeArc {
                    direction: self.pose.rotation * (edge.ends[1] - edge.ends[0]),
                    normals: Some(turned(edge.normals)),
                };
                let edges: Vec<EdgeArc> = elements.edges.iter().map(edge).collect();
                // each face has edges, so their normals are those of all faces
                let mut normals: Vec<Vec3> = elements.edges.iter().flat_map(|edge| edge.normals).collect();
                normals
                    .sort_by(|x, y| x.iter().zip(y.iter()).fold(Ordering::Equal, |o, (x, y)| o.then(x.total_cmp(y))));
                normals.dedup();
                normals.iter_mut().for_each(|n| *n = self.pose.rotation * *n);
                Faces { normals, edges }
            }
            Kind::Cylinder { .. } | Kind::Cone(_) | Kind::Ellipsoid(_) => return None,
        })
    }

    /// Returns the position of the frame, inside or near the body.
    pub fn center(&self) -> Vec3 {
        self.pose.translation.vector
    }
}

impl Convex for Core<'_> {
    fn support(&self, n: &Vec3) -> Vec3 {
        let n = self.pose.rotation.inverse_transform_vector(n);
        let along = |half: f64| if n.z < 0.0 { -half } else { half };
        let local = match &self.kind {
            Kind::Point => Vec3::zeros(),
            Kind::Segment(half) => Vec3::z() * along(*half),
            Kind::Box(half) => half.zip_map(&n, |h, n| if n < 0.0 { -h } else { h }),
            Kind::Cylinder { radius, half } => {
                let outward = Vec3::new(n.x, n.y, 0.0).try_normalize(0.0).unwrap_or_default();
                outward * *radius + Vec3::z() * along(*half)
            }
            Kind::Cone(cone) => cone.support_point(&n),
            Kind::Ellipsoid(half) => ellipsoid::support_point(half, &n),
            Kind::Hull(elements) => elements.support(&n),
        };
        self.pose.transform_point(&local.into()).coords
    }
}

/// Returns the elements of a convex mesh.
fn hull(mesh: &MeshShape) -> Option<&Elements> {
    match mesh.surfaces() {
        [surface] if surface.field.is_convex() => Some(&surface.elements),
        _ => None,
    }
}
