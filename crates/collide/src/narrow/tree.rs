//! Sphere trees against each other and against primitives: the method of the thesis, which takes
//! point and normal from leaf spheres.
//!
//! Source: thesis §IV.B.3.a–b. Two trees are traversed together; the larger sphere is replaced by
//! its children first. For a primitive, its signed distance at a sphere's center is evaluated. That
//! changes by at most 1 m per meter, so a sphere further away than `margin` contains no leaf within
//! it. The feature of a contact is the pair of leaf indices.

use super::reduce::Collector;
use super::segment::closest_on_segment;
use super::sphere::point_box;
use crate::shape::cone::{Cone, ConePart};
use crate::shape::ellipsoid;
use crate::{Contact, NormalFrom, Pose, Shape, SphereTree, Vec3};
use nalgebra::Point3;

/// Two trees in B's frame.
struct TreePair<'a> {
    a: &'a SphereTree,
    b: &'a SphereTree,
    a_in_b: Pose,
}

pub(super) fn tree_tree(
    a: &SphereTree,
    pose_a: &Pose,
    b: &SphereTree,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let pair = TreePair { a, b, a_in_b: pose_b.inv_mul(pose_a) };
    let smaller = a.nodes()[0].radius.min(b.nodes()[0].radius);
    let mut found = Collector::new(margin, smaller, out);
    pair.visit(0, &pair.center_in_b(0), 0, &mut found);
    found.finish(pose_b);
}

impl TreePair<'_> {
    /// Returns the center of a sphere of A in B's frame.
    fn center_in_b(&self, na: usize) -> Vec3 {
        (self.a_in_b * Point3::from(self.a.nodes()[na].center)).coords
    }

    /// Visits a pair of spheres, A's at `center_a`, which is computed once for all spheres of B.
    fn visit(&self, na: usize, center_a: &Vec3, nb: usize, found: &mut Collector) {
        let (a, b) = (&self.a.nodes()[na], &self.b.nodes()[nb]);
        // spheres that are too small to reach a deep limit are excluded
        let reach = (a.radius + b.radius + found.limit()).max(0.0);
        if (center_a - b.center).norm_squared() > reach * reach {
            return;
        }
        if a.is_leaf() && b.is_leaf() {
            let feature = (na as u64) << 32 | nb as u64;
            found.push(Contact::between_cores((*center_a, a.radius), (b.center, b.radius), feature));
        } else if b.is_leaf() || (!a.is_leaf() && a.radius >= b.radius) {
            a.child_range().for_each(|child| self.visit(child, &self.center_in_b(child), nb, found));
        } else {
            b.child_range().for_each(|child| self.visit(na, center_a, child, found));
        }
    }
}

/// Signed distance of a primitive at a point, in its own frame.
struct PrimitiveSample {
    distance: f64,
    normal: Vec3,
    core: f64,
    face: bool,
}

/// Appends the contacts of a tree (A) and a half-space, sphere, box, capsule, ellipsoid or cone (B).
pub(super) fn tree_primitive(
    a: &SphereTree,
    pose_a: &Pose,
    b: &Shape,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let a_in_b = pose_b.inv_mul(pose_a);
    let mut found = Collector::new(margin, a.nodes()[0].radius.min(b.bounding_radius()), out);
    visit(a, &a_in_b, b, 0, &mut found);
    found.finish(pose_b);
}

fn visit(tree: &SphereTree, pose: &Pose, primitive: &Shape, node: usize, found: &mut Collector) {
    let sphere = &tree.nodes()[node];
    let center = (pose * Point3::from(sphere.center)).coords;
    let Some(sample) = sample_primitive(primitive, &center) else { return };
    let gap = sample.distance - sphere.radius;
    if gap > found.limit() {
        return;
    }
    if !sphere.is_leaf() {
        sphere.child_range().for_each(|child| visit(tree, pose, primitive, child, found));
        return;
    }
    found.push(Contact {
        point: center - sample.normal * (sphere.radius + 0.5 * gap),
        normal: sample.normal,
        gap,
        feature: (node as u64) << 32,
        core_a: sphere.radius,
        core_b: sample.core,
        normal_from: if sample.face { NormalFrom::FaceOfB } else { NormalFrom::CorePoints },
        shapes: [0; 2],
    });
}

/// Returns signed distance and outward normal of a primitive at `p`; `None` for shapes without such
/// a formula here.
fn sample_primitive(primitive: &Shape, p: &Vec3) -> Option<PrimitiveSample> {
    match primitive {
        Shape::HalfSpace => Some(PrimitiveSample { distance: p.z, normal: Vec3::z(), core: 0.0, face: true }),
        Shape::Sphere { radius } => Some(sample_round(p, *radius)),
        Shape::Capsule { radius, half_length } => {
            let u = Vec3::z() * *half_length;
            Some(sample_round(&(p - u * closest_on_segment(p, &u)), *radius))
        }
        Shape::Box { half_extents } => point_box(p, half_extents).map(|f| PrimitiveSample {
            distance: f.distance,
            normal: f.normal,
            core: 0.0,
            face: f.face,
        }),
        Shape::Ellipsoid { half_axes } => {
            let found = ellipsoid::closest(half_axes, p);
            let core = ellipsoid::mean_radius(half_axes, &found.normal);
            Some(PrimitiveSample { distance: found.distance, normal: found.normal, core, face: false })
        }
        Shape::Cone { radius, height } => {
            let (part, distance, normal) = Cone { radius: *radius, height: *height }.closest(p);
            Some(PrimitiveSample { distance, normal, core: 0.0, face: part == ConePart::Base })
        }
        Shape::Cylinder(_)
        | Shape::Mesh(_)
        | Shape::Compound(_)
        | Shape::RoundedBox { .. }
        | Shape::RoundedCylinder { .. } => None,
    }
}

/// Returns the sample of a sphere about a core point; `offset` is the vector from there. At the
/// core the normal is x.
fn sample_round(offset: &Vec3, radius: f64) -> PrimitiveSample {
    let length = offset.norm();
    let normal = if length > 1e-300 { offset / length } else { Vec3::x() };
    PrimitiveSample { distance: length - radius, normal, core: radius, face: false }
}
