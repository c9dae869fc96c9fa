//! Minimum translation that separates two bodies, for overlaps that the contacts of their elements
//! do not resolve.
//!
//! ```text
//! D(n) = max over B of n·x − min over A of n·x      translation of A along n after which a plane across n separates the two (or their hulls)
//! D*   = min over n of D(n)                         the minimum translation, for convex bodies
//! ```
//!
//! A contact of two convex bodies at depth `g` with normal `n` resolves the overlap only if `D(n) =
//! g`: that translation separates the bodies. It does not if an element is flush with a side or
//! beyond it. Example: no corner of a box that was pushed straight into another one faces the side
//! on which it lies, and the face that it does face is out of range. Then A is moved along the best
//! `n` by `D(n)`, so that the two just touch. Their contacts there are used, each deepened by the
//! component of `D` along its normal.
//!
//! Candidate directions: face normals and cross products of edges (the separating axes; all of them
//! if they are few), axes, and the line of centers. For curved surfaces, or very many faces, a
//! local search from the best candidate follows. Every direction separates the two; only the
//! translation can be larger than the minimum.
//!
//! Bodies that are not convex have the depth of their deepest point, if that translation separates
//! them. Otherwise their hulls are separated, if much of one is inside the other.

use super::super::reduce::Collector;
use super::query::{NearestCache, Query};
use super::tolerances::DEEP_OVERLAP;
use super::{Body, BodyElements, elements, faces};
use crate::sdf::TOUCHING;
use crate::sdf::field::MeshField;
use crate::shape::ellipsoid;
use crate::{Contact, Mat3, NormalFrom, Pose, Vec3};
use arrayvec::ArrayVec;
use nalgebra::Point3;

/// The result of the element queries of two bodies.
pub(super) struct SampledDistance {
    /// Smallest signed distance of all sampled points, with or without contact, meters.
    pub min: f64,
}

/// Distance below which a point shows that the bodies overlap. This and the following are in radii
/// of the smaller body.
const OVERLAP_TOLERANCE: f64 = 1e-6;
/// Largest difference of equal depths.
const SAME_DEPTH: f64 = 1e-4;
/// Depth up to which the elements resolve the overlap: faces within this distance are considered.
const MIN_DEPTH: f64 = 2e-3;
/// Largest ratio of the translation along a contact's normal to its depth.
const MAX_TRANSLATION_RATIO: f64 = 1.1;
/// Maximum number of contacts of which the depth is limited.
const MAX_LIMITED: usize = 32;
/// Gap at which the two touch.
const TOUCH_GAP: f64 = 1e-5;
/// Margin of the contacts at which they touch.
const TOUCH_MARGIN: f64 = 0.02;
/// Smallest cosine between a contact's normal and the translation.
const MIN_ALIGNMENT: f64 = 0.7;

/// Maximum number of faces of a mesh that are tried; evenly spaced for finer meshes.
const MAX_FACES: usize = 256;
/// Maximum number of edge directions of a body; if there are more, none is tried.
const MAX_EDGE_DIRECTIONS: usize = 16;
/// Factor by which a direction must be better, so that the first of equal ones wins.
const IMPROVEMENT: f64 = 1.0 - 1e-6;
/// Maximum number of points of a mesh that are tested for being inside.
const MAX_POINTS: usize = 128;
/// Fraction of the points inside the other body above which two bodies are inside each other.
const MIN_INSIDE_FRACTION: f64 = 0.2;
/// Largest ratio of a translation to the minimum.
const MAX_EXCESS: f64 = 1.005;
/// Maximum number of halvings of a cone of directions, and of cones that wait.
const MAX_HALVINGS: u32 = 10;
const MAX_CONES: usize = 8 + 3 * (MAX_HALVINGS as usize + 1);
/// Maximum number of directions of branch and bound.
const MAX_SUPPORTS: usize = 4096;
/// Maximum number of vertices of meshes that they are compared with.
const MAX_POINT_TESTS: usize = 1 << 20;
/// First and last step of the local search, radians; steps are halved.
const FIRST_STEP: f64 = 0.1;
const LAST_STEP: f64 = 1e-4;
const MAX_STEPS: usize = 60;

/// Replaces the contacts if they do not separate the bodies. No contact stays deeper than the
/// translation along its normal that separates the bodies.
pub(super) fn separate(a: &Body, b: &Body, a_in_b: &Pose, size: f64, sampled: &SampledDistance, found: &mut Collector) {
    let (contact_depth, sampled_depth) = (-found.min_gap(), -sampled.min);
    let missing = sampled_depth >= -OVERLAP_TOLERANCE * size && contact_depth < sampled_depth - SAME_DEPTH * size;
    if a.field.is_linear() || b.field.is_linear() {
        return;
    }
    let pair = BodyPair { a, b, pose: a_in_b, rotation: *a_in_b.rotation.to_rotation_matrix().matrix(), size };
    let overlaps = missing || contact_depth.max(sampled_depth) > MIN_DEPTH * size;
    if !(overlaps || pair.is_crossed(found) || pair.is_pierced(found)) {
        return;
    }
    pair.limit_depths(found);
    let contact_depth = -found.min_gap();
    if !(a.field.is_convex() && b.field.is_convex()) {
        if (missing && contact_depth < SAME_DEPTH * size)
            || (contact_depth > DEEP_OVERLAP * size && pair.inside_fraction() > MIN_INSIDE_FRACTION)
        {
            pair.separate_nonconvex(found);
        }
        return;
    }
    let along = found.deepest().map_or(f64::INFINITY, |c| pair.overlap_along(&c.normal));
    let resolved = along <= contact_depth.max(MAX_TRANSLATION_RATIO * contact_depth) + SAME_DEPTH * size;
    if resolved && (contact_depth <= DEEP_OVERLAP * size || !pair.is_curved()) {
        return;
    }
    let (direction, depth) = pair.min_overlap();
    if resolved && along <= MAX_EXCESS * depth.min(contact_depth) {
        return;
    }
    if depth > SAME_DEPTH * size {
        pair.touching_contacts(direction, depth, None, found);
    }
}

/// Removes deep contacts that lie outside both bodies, if others overlap.
pub(super) fn remove_distant(a: &Body, b: &Body, a_in_b: &Pose, size: f64, found: &mut Collector) {
    if found.min_gap() >= -DEEP_OVERLAP * size || a.field.is_linear() || b.field.is_linear() {
        return;
    }
    let (of_a, of_b) = (a.bounds(), b.bounds());
    let is_near = |c: &Contact| {
        let at_a = a_in_b.inverse_transform_point(&c.point.into()).coords;
        let reach = (0.5 * -c.gap).max(0.0) + OVERLAP_TOLERANCE * size;
        let outside = |p: &Vec3, [low, high]: &[Vec3; 2]| (p - p.sup(low).inf(high)).norm();
        c.gap >= -DEEP_OVERLAP * size
            || c.feature == SEPARATION_FEATURE
            || outside(&at_a, &of_a).max(outside(&c.point, &of_b)) <= reach
    };
    if found.contains_like(|c| !is_near(c)) && found.contains_like(|c| c.gap < 0.0 && is_near(c)) {
        found.map_and_retain(found.limit(), |c| is_near(c));
    }
}

/// Two bodies in the frame of B.
struct BodyPair<'a> {
    a: &'a Body<'a>,
    b: &'a Body<'a>,
    pose: &'a Pose,
    rotation: Mat3,
    size: f64,
}

impl BodyPair<'_> {
    /// Returns `D(n)`, meters; `n` points from B to A.
    fn overlap_along(&self, n: &Vec3) -> f64 {
        self.b.elements.support(n) + self.a.elements.support(&-self.rotation.tr_mul(n))
            - n.dot(&self.pose.translation.vector)
    }

    /// Returns whether two primitives overlap along the normal of their deepest contact, although that
    /// is shallow: a side of one crosses the other between the elements. Meshes are not tested.
    fn is_crossed(&self, found: &Collector) -> bool {
        let convex = |body: &Body| body.mesh.is_none() && body.field.is_convex();
        convex(self.a)
            && convex(self.b)
            && found.deepest().is_some_and(|c| self.overlap_along(&c.normal) > MIN_DEPTH * self.size)
    }

    /// Returns whether an ellipsoid or a cone overlaps another primitive although no contact shows it: each
    /// passes through the other between its elements. A contact at a gap proves the opposite, as does
    /// a direction that separates the two.
    fn is_pierced(&self, found: &Collector) -> bool {
        let bodies = [self.a, self.b];
        let curved = |body: &&Body| matches!(body.elements, BodyElements::Ellipsoid(_) | BodyElements::Cone(_));
        if !bodies.iter().any(curved) || bodies.iter().any(|body| body.mesh.is_some()) {
            return false;
        }
        let proof = |c: &Contact| c.gap <= 0.0 || self.overlap_along(&c.normal) <= 0.0;
        let Some(n) = self.pose.translation.vector.try_normalize(1e-9 * self.size) else { return true };
        !found.contains_like(proof) && self.refine((n, self.overlap_along(&n))).1 > MIN_DEPTH * self.size
    }

    /// Limits the depth of the deepest contacts to the translation along their normals that separates
    /// the bodies, or their hulls.
    fn limit_depths(&self, found: &mut Collector) {
        for _ in 0..MAX_LIMITED {
            let Some(deepest) = found.deepest_mut().filter(|c| c.gap < -MIN_DEPTH * self.size) else { return };
            let depth = self.overlap_along(&deepest.normal).max(0.0);
            if -deepest.gap <= depth + OVERLAP_TOLERANCE * self.size {
                return;
            }
            deepest.gap = -depth;
        }
    }

    /// Returns the best direction of those tried, and its translation.
    fn min_overlap(&self) -> (Vec3, f64) {
        let off = self.pose.translation.vector;
        let mut best = (Vec3::z(), f64::INFINITY);
        let mut try_direction = |n: Vec3| {
            let depth = self.overlap_along(&n);
            if depth < IMPROVEMENT * best.1 {
                best = (n, depth);
            }
        };
        let mut either = |n: Vec3| {
            let n = if n.dot(&off) < 0.0 { -n } else { n };
            try_direction(n);
            try_direction(-n);
        };
        let turned = |n: Vec3| self.rotation * n;
        for k in [2, 0, 1] {
            either(Vec3::ith(k, 1.0));
            either(turned(Vec3::ith(k, 1.0)));
        }
        self.b.for_each_normal(&mut |n| either(n));
        self.a.for_each_normal(&mut |n| either(turned(n)));
        let [mut edges_a, edges_b] = [self.a, self.b].map(|body| body.edge_directions());
        edges_a.iter_mut().for_each(|direction| *direction = self.rotation * *direction);
        for (x, y) in edges_a.iter().flat_map(|x| edges_b.iter().map(move |y| (x, y))) {
            x.cross(y).try_normalize(1e-6).into_iter().for_each(&mut either);
        }
        // away from an axis, and from center to center
        for axis in [Vec3::z(), self.rotation.column(2).into_owned()] {
            (off - axis * axis.dot(&off)).try_normalize(1e-9 * self.size).into_iter().for_each(&mut either);
        }
        off.try_normalize(1e-9 * self.size).into_iter().for_each(&mut either);
        if self.is_curved() { self.refine(self.search_directions(best)) } else { best }
    }

    /// Returns whether the directions of separation are more than the candidates: a round surface, or
    /// a mesh of many sides.
    fn is_curved(&self) -> bool {
        [self.a, self.b].iter().any(|body| {
            body.field.is_round()
                || body.mesh.is_some_and(|mesh| mesh.faces().len() > MAX_FACES)
                || body.edge_directions().is_empty()
        })
    }

    /// Returns the point of `C` that is furthest along a unit direction.
    fn support_of_difference(&self, n: &Vec3) -> Vec3 {
        let of_a = self.rotation * self.a.elements.support_point(&-self.rotation.tr_mul(n));
        self.b.elements.support_point(n) - of_a - self.pose.translation.vector
    }

    /// Returns the best direction by branch and bound, and its translation.
    fn search_directions(&self, mut best: (Vec3, f64)) -> (Vec3, f64) {
        let axes = |octant: u32| std::array::from_fn(|k| Vec3::ith(k, if octant >> k & 1 == 0 { 1.0 } else { -1.0 }));
        let mut cones: ArrayVec<([Vec3; 3], u32), MAX_CONES> = (0..8).map(|octant| (axes(octant), 0)).collect();
        let points =
            |body: &Body| if let BodyElements::Mesh(elements) = &body.elements { elements.points.len() } else { 1 };
        let mut left = (MAX_POINT_TESTS / (points(self.a) + points(self.b))).min(MAX_SUPPORTS);
        while let Some((cone, halvings)) = cones.pop() {
            if left == 0 {
                break;
            }
            left -= 1;
            let middle = (cone[0] + cone[1] + cone[2]).normalize();
            let furthest = self.support_of_difference(&middle);
            let depth = furthest.dot(&middle);
            if depth < IMPROVEMENT * best.1 {
                best = (middle, depth);
            }
            let bound = cone.iter().map(|n| n.dot(&furthest)).fold(f64::INFINITY, f64::min);
            if bound >= best.1 / MAX_EXCESS || halvings == MAX_HALVINGS {
                continue;
            }
            let [a, b, c] = cone;
            let [ab, bc, ca] = [a + b, b + c, c + a].map(|n| n.normalize());
            for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                cones.push((part, halvings + 1));
            }
        }
        best
    }

    /// Separates two bodies of which one is not convex: by the deepest point, or by their hulls.
    fn separate_nonconvex(&self, found: &mut Collector) {
        if found.min_gap() > -DEEP_OVERLAP * self.size {
            self.add_faces(self.pose, found);
        }
        let deepest = found.deepest().copied().filter(|c| c.gap < -SAME_DEPTH * self.size);
        if let Some(c) = deepest.filter(|c| self.is_free_after(c.normal * (TOUCH_GAP * self.size - c.gap))) {
            self.touching_contacts(c.normal, -c.gap, Some(c), found);
        } else if self.inside_fraction() > MIN_INSIDE_FRACTION {
            let (direction, depth) = self.min_overlap();
            self.touching_contacts(direction, depth, None, found);
        }
    }

    /// Adds the deepest points of the faces of both, with A at `pose`.
    fn add_faces(&self, pose: &Pose, found: &mut Collector) {
        let inverse = pose.inverse();
        let caches = [NearestCache::new(), NearestCache::new()];
        let first = Query::new([self.a, self.b], pose, self.size, None, &caches[0]);
        let second = Query::new([self.b, self.a], &inverse, self.size, Some(pose), &caches[1]);
        faces([&first, &second], [self.a, self.b], found);
    }

    /// Returns whether the bodies do not overlap after A is moved by `shift`. A thin body with curved sides
    /// can go through the middle of a face, where neither has an element.
    fn is_free_after(&self, shift: Vec3) -> bool {
        let (mut out, mut moved) = (Vec::new(), *self.pose);
        moved.translation.vector += shift;
        let mut there = Collector::new(TOUCH_GAP * self.size, self.size, &mut out);
        let sampled = elements(self.a, self.b, &moved, self.size, &mut there);
        if sampled.min <= -SAME_DEPTH * self.size || there.min_gap() <= -SAME_DEPTH * self.size {
            return false;
        }
        if self.a.field.is_curved() || self.b.field.is_curved() {
            self.add_faces(&moved, &mut there);
        }
        there.min_gap() > -MIN_DEPTH * self.size
    }

    /// Returns the fraction of points inside or on the other body, for the body with the larger
    /// fraction.
    fn inside_fraction(&self) -> f64 {
        let inverse = self.pose.inverse();
        let [first, second] = [(self.a, self.b, self.pose), (self.b, self.a, &inverse)]
            .map(|(of, within, pose)| inside_fraction(of, within, pose, self.size));
        first.max(second)
    }

    fn refine(&self, (mut n, mut depth): (Vec3, f64)) -> (Vec3, f64) {
        let mut step = FIRST_STEP;
        for _ in 0..MAX_STEPS {
            let u = n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
            let v = n.cross(&u);
            let around = [u, v, -u, -v].map(|w| (n + w * step).normalize());
            let better = around
                .into_iter()
                .map(|m| (m, self.overlap_along(&m)))
                .min_by(|x, y| x.1.total_cmp(&y.1))
                .filter(|m| m.1 < depth);
            match better {
                Some(better) => (n, depth) = better,
                None if step < LAST_STEP => break,
                None => step *= 0.5,
            }
        }
        (n, depth)
    }

    /// Replaces the contacts by those at which A, moved by `depth` along `direction`, touches B,
    /// with their depths at the original pose. If none has the whole depth, one is added: `deepest`, of
    /// which the translation is that of a contact, else that of the support points, where the hulls touch.
    fn touching_contacts(&self, direction: Vec3, depth: f64, deepest: Option<Contact>, found: &mut Collector) {
        let shift = depth + TOUCH_GAP * self.size;
        let mut moved = *self.pose;
        moved.translation.vector += direction * shift;
        let limit = found.restart(TOUCH_MARGIN * self.size);
        elements(self.a, self.b, &moved, self.size, found);
        found.map_and_retain(limit, |contact| {
            let along = contact.normal.dot(&direction);
            contact.point -= 0.5 * shift * direction;
            contact.gap -= shift * along;
            along > MIN_ALIGNMENT
        });
        self.limit_depths(found);
        let convex = self.a.field.is_convex() && self.b.field.is_convex();
        let excessive = |c: &Contact| convex && self.overlap_along(&c.normal) > MAX_EXCESS * depth;
        if found.min_gap() > -(1.0 - TOUCH_MARGIN) * depth || found.deepest().is_some_and(excessive) {
            found.push(deepest.unwrap_or_else(|| self.support_contact(direction, depth)));
        }
    }

    /// Returns the contact of the support points across a direction: no flat parts touch there.
    fn support_contact(&self, direction: Vec3, depth: f64) -> Contact {
        let lowest = self.pose.translation.vector
            + self.rotation * self.a.elements.support_point(&-self.rotation.tr_mul(&direction));
        let highest = self.b.elements.support_point(&direction);
        // midway from the one that is deeper in the other body
        let of_a = self.b.field.bound(&lowest);
        let of_b = self.a.field.bound(&self.pose.inverse_transform_point(&highest.into()).coords);
        let half = 0.5 * depth * direction;
        let point = if of_a <= of_b { lowest + half } else { highest - half };
        Contact {
            point,
            normal: direction,
            gap: -depth,
            feature: SEPARATION_FEATURE,
            core_a: 0.0,
            core_b: 0.0,
            normal_from: NormalFrom::Edges,
            shapes: [0; 2],
        }
    }
}

/// Returns the fraction of a mesh's points inside another body; 0 for other shapes.
fn inside_fraction(of: &Body, within: &Body, pose: &Pose, size: f64) -> f64 {
    let BodyElements::Mesh(elements) = &of.elements else { return 0.0 };
    let every = elements.points.len().div_ceil(MAX_POINTS).max(1);
    let inside = |p: &Vec3| within.field.hit(p, &[], TOUCHING).distance < OVERLAP_TOLERANCE * size;
    let count = elements.points.iter().step_by(every).filter(|p| inside(&(pose * Point3::from(p.at)).coords)).count();
    count as f64 / elements.points.len().div_ceil(every).max(1) as f64
}

/// Feature of the only contact of two bodies.
const SEPARATION_FEATURE: u64 = 5 << 56;

impl Body<'_> {
    /// Returns the least and largest coordinates in its own frame.
    fn bounds(&self) -> [Vec3; 2] {
        [-1.0, 1.0].map(|sign| Vec3::from_fn(|k, _| sign * self.elements.support(&Vec3::ith(k, sign))))
    }

    /// Calls `visit` for the normals of flat faces.
    fn for_each_normal(&self, visit: &mut dyn FnMut(Vec3)) {
        match (&self.elements, self.mesh) {
            (BodyElements::Mesh(_), Some(mesh)) => mesh_normals(mesh, visit),
            (BodyElements::Box(_), _) => (0..3).for_each(|k| visit(Vec3::ith(k, 1.0))),
            (BodyElements::Cylinder { .. } | BodyElements::Cone(_), _) => visit(Vec3::z()),
            _ => {}
        }
    }

    /// Returns the directions of straight edges or straight sides; empty if there are too many.
    fn edge_directions(&self) -> ArrayVec<Vec3, MAX_EDGE_DIRECTIONS> {
        let mut edge_directions = ArrayVec::new();
        match &self.elements {
            BodyElements::Mesh(elements) => {
                for direction in &elements.edge_directions {
                    if edge_directions.iter().all(|w: &Vec3| w.dot(direction).abs() < 1.0 - 1e-9)
                        && edge_directions.try_push(*direction).is_err()
                    {
                        return ArrayVec::new();
                    }
                }
            }
            BodyElements::Box(_) => edge_directions.extend((0..3).map(|k| Vec3::ith(k, 1.0))),
            BodyElements::Round { half_length, .. } if *half_length == 0.0 => {}
            BodyElements::Round { .. } | BodyElements::Cylinder { .. } => edge_directions.push(Vec3::z()),
            BodyElements::Ellipsoid(_) | BodyElements::Cone(_) | BodyElements::Empty => {}
        }
        edge_directions
    }
}

/// Calls `visit` for the normals of a mesh's triangles, skipping most repetitions.
fn mesh_normals(mesh: &MeshField, visit: &mut dyn FnMut(Vec3)) {
    let mut last = Vec3::zeros();
    for t in (0..mesh.faces().len()).step_by(mesh.faces().len().div_ceil(MAX_FACES).max(1)) {
        let normal = mesh.face_normal(t);
        if normal.dot(&last) < 1.0 - 1e-12 {
            visit(normal);
            last = normal;
        }
    }
}

impl BodyElements<'_> {
    /// Returns the support function: the maximum of `n·x` over the body.
    pub(in crate::narrow) fn support(&self, n: &Vec3) -> f64 {
        match self {
            BodyElements::Mesh(elements) => elements.support(n).dot(n),
            BodyElements::Box(half) => half.dot(&n.abs()),
            BodyElements::Round { radius, half_length } => radius * n.norm() + half_length * n.z.abs(),
            BodyElements::Cylinder { radius, half_length } => radius * n.xy().norm() + half_length * n.z.abs(),
            BodyElements::Ellipsoid(half) => half.component_mul(n).norm(),
            BodyElements::Cone(cone) => cone.support(n),
            BodyElements::Empty => f64::INFINITY,
        }
    }

    /// Returns a point of the body that attains it.
    pub(super) fn support_point(&self, n: &Vec3) -> Vec3 {
        let sign = |x: f64| if x.abs() < 1e-9 { 0.0 } else { x.signum() };
        match self {
            BodyElements::Mesh(elements) => elements.support(n),
            BodyElements::Box(half) => n.map(sign).component_mul(half),
            BodyElements::Round { radius, half_length } => n * *radius + Vec3::z() * (sign(n.z) * half_length),
            BodyElements::Cylinder { radius, half_length } => {
                Vec3::new(n.x, n.y, 0.0).try_normalize(1e-9).unwrap_or_default() * *radius
                    + Vec3::z() * (sign(n.z) * half_length)
            }
            BodyElements::Ellipsoid(half) => ellipsoid::support_point(half, n),
            BodyElements::Cone(cone) => cone.support_point(n),
            BodyElements::Empty => Vec3::zeros(),
        }
    }
}
