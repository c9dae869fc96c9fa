//! The least translation that parts two bodies, where the contacts of their elements do not.
//!
//! ```text
//! D(n) = max over B of n·x − min over A of n·x      how far A goes along n until a plane across n is between the two (or their hulls)
//! D*   = min over n of D(n)                         the least translation, of convex bodies
//! ```
//!
//! A contact at depth `g` with normal `n` of two convex bodies is right about the whole of them only if `D(n) = g`: moved so far they are apart. It is not
//! where an element lies flush with a side, or beyond it: no corner of a block pushed straight into another one faces the side that it lies on, and the
//! face that it does face is further away than elements look. Then A is moved along the best `n` by `D(n)`, where the two only touch; the contacts that
//! they have there are those sought, all deeper by the part of `D` along their normals.
//!
//! Directions tried: normals of faces and products of edges (the separating axes; all of them where they are few), axes and centers. Where surfaces are
//! bent or have very many faces, a search from the best of them follows. Any of them parts the two: only how far is more than the least.
//!
//! Bodies that are not convex have the depth of their deepest place, if the two are free when moved so far; else their hulls are parted, if much of one is
//! in the other.

use super::super::reduce::Collector;
use super::query::{NearestCache, Query};
use super::tolerances::DEEP_OVERLAP;
use super::{Body, BodyElements, elements, faces};
use crate::sdf::TOUCHING;
use crate::sdf::elements::Elements;
use crate::sdf::field::MeshField;
use crate::{Contact, Mat3, NormalFrom, Pose, Vec3};
use arrayvec::ArrayVec;
use nalgebra::Point3;

/// What the elements made of two bodies.
pub(super) struct SampledDistance {
    /// The least signed distance of any place that was looked at, whether it made a contact or not, meters.
    pub min: f64,
}

/// All in radii of the smaller body. A place this near or inside is evidence that the two overlap.
const OVERLAP_TOLERANCE: f64 = 1e-6;
/// Depths that differ by less are the same.
const SAME_DEPTH: f64 = 1e-4;
/// Overlaps below this are told by the elements: faces that far away are looked for.
const MIN_DEPTH: f64 = 2e-3;
/// By how much, as a factor, the way along a contact's normal may be longer than its depth.
const MAX_TRANSLATION_RATIO: f64 = 1.1;
/// The gap at which the two touch.
const TOUCH_GAP: f64 = 1e-5;
/// How far contacts are looked for where they touch.
const TOUCH_MARGIN: f64 = 0.02;
/// Cosine of a contact's normal and the way out.
const MIN_ALIGNMENT: f64 = 0.7;

/// Faces of a mesh that are tried at most; of finer ones every so manieth.
const MAX_FACES: usize = 256;
/// Directions of edges of a body; of one that has more none is tried.
const MAX_EDGE_DIRECTIONS: usize = 16;
/// A direction must be better by this to count, so that the first of equal ones does.
const IMPROVEMENT: f64 = 1.0 - 1e-6;
/// Points of a mesh that are asked whether they are inside, at most.
const MAX_POINTS: usize = 128;
/// Two are in each other if so much of one is.
const MIN_INSIDE_FRACTION: f64 = 0.2;
/// Steps of the search from the best direction: from the first, radians, halved, down to the last.
const FIRST_STEP: f64 = 0.1;
const LAST_STEP: f64 = 1e-4;
const MAX_STEPS: usize = 60;

/// Corrects what was found where it does not part the two.
pub(super) fn separate(a: &Body, b: &Body, a_in_b: &Pose, size: f64, sampled: &SampledDistance, found: &mut Collector) {
    let (contact_depth, sampled_depth) = (-found.min_gap(), -sampled.min);
    let missing = sampled_depth >= -OVERLAP_TOLERANCE * size && contact_depth < sampled_depth - SAME_DEPTH * size;
    if !(missing || contact_depth.max(sampled_depth) > MIN_DEPTH * size) || a.field.is_linear() || b.field.is_linear() {
        return;
    }
    let pair = BodyPair { a, b, pose: a_in_b, rotation: *a_in_b.rotation.to_rotation_matrix().matrix(), size };
    if !(a.field.is_convex() && b.field.is_convex()) {
        if (missing && contact_depth < SAME_DEPTH * size)
            || (contact_depth > DEEP_OVERLAP * size && pair.inside_fraction() > MIN_INSIDE_FRACTION)
        {
            pair.separate_nonconvex(found);
        }
        return;
    }
    if found.deepest().is_some_and(|c| {
        pair.overlap_along(&c.normal) <= contact_depth.max(MAX_TRANSLATION_RATIO * contact_depth) + SAME_DEPTH * size
    }) {
        return;
    }
    let (direction, depth) = pair.min_overlap();
    if depth > SAME_DEPTH * size {
        pair.touching_contacts(direction, depth, found);
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
    /// `D(n)`, meters; `n` from B to A.
    fn overlap_along(&self, n: &Vec3) -> f64 {
        self.b.elements.support(n) + self.a.elements.support(&-self.rotation.tr_mul(n))
            - n.dot(&self.pose.translation.vector)
    }

    /// The direction along which they are parted soonest, of those tried, and how far that is.
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
        // straight away from an axis, and from center to center
        for axis in [Vec3::z(), self.rotation.column(2).into_owned()] {
            (off - axis * axis.dot(&off)).try_normalize(1e-9 * self.size).into_iter().for_each(&mut either);
        }
        off.try_normalize(1e-9 * self.size).into_iter().for_each(&mut either);
        let many = |body: &Body| {
            body.field.is_round()
                || body.mesh.is_some_and(|mesh| mesh.faces().len() > MAX_FACES)
                || body.edge_directions().is_empty()
        };
        if many(self.a) || many(self.b) { self.refine(best) } else { best }
    }

    /// Two of which one is not convex: by the deepest place, or by their hulls.
    fn separate_nonconvex(&self, found: &mut Collector) {
        if found.min_gap() > -DEEP_OVERLAP * self.size {
            let inverse = self.pose.inverse();
            let caches = [NearestCache::new(), NearestCache::new()];
            let first = Query::new([self.a, self.b], self.pose, self.size, None, &caches[0]);
            let second = Query::new([self.b, self.a], &inverse, self.size, Some(self.pose), &caches[1]);
            faces([&first, &second], [self.a, self.b], found);
        }
        let deepest = found.deepest().copied().filter(|c| c.gap < -SAME_DEPTH * self.size);
        if let Some(c) = deepest.filter(|c| self.is_free_after(c.normal * (TOUCH_GAP * self.size - c.gap))) {
            self.touching_contacts(c.normal, -c.gap, found);
        } else if self.inside_fraction() > MIN_INSIDE_FRACTION {
            let (direction, depth) = self.min_overlap();
            self.touching_contacts(direction, depth, found);
        }
    }

    /// Whether they do not overlap where A is moved by so much.
    fn is_free_after(&self, shift: Vec3) -> bool {
        let (mut out, mut moved) = (Vec::new(), *self.pose);
        moved.translation.vector += shift;
        let mut there = Collector::new(TOUCH_GAP * self.size, self.size, &mut out);
        let sampled = elements(self.a, self.b, &moved, self.size, &mut there);
        sampled.min > -SAME_DEPTH * self.size && there.min_gap() > -SAME_DEPTH * self.size
    }

    /// Which share of the points of the one that has more of them there is inside the other one, or on it.
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

    /// The contacts that the two have where A, moved by `depth` along `direction`, touches B, as deep as they are where it is.
    fn touching_contacts(&self, direction: Vec3, depth: f64, found: &mut Collector) {
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
        if found.min_gap() > -(1.0 - TOUCH_MARGIN) * depth {
            // nothing flat meets: the outermost places do
            let lowest = self.pose.translation.vector
                + self.rotation * self.a.elements.support_point(&-self.rotation.tr_mul(&direction));
            let point = 0.5 * (lowest + self.b.elements.support_point(&direction));
            found.push(Contact {
                point,
                normal: direction,
                gap: -depth,
                feature: SEPARATION_FEATURE,
                core_a: 0.0,
                core_b: 0.0,
                normal_from: NormalFrom::Edges,
            });
        }
    }
}

/// Of a mesh's points; 0 of others.
fn inside_fraction(of: &Body, within: &Body, pose: &Pose, size: f64) -> f64 {
    let BodyElements::Mesh(elements) = &of.elements else { return 0.0 };
    let every = elements.points.len().div_ceil(MAX_POINTS).max(1);
    let inside = |p: &Vec3| within.field.hit(p, &[], TOUCHING).distance < OVERLAP_TOLERANCE * size;
    let count = elements.points.iter().step_by(every).filter(|p| inside(&(pose * Point3::from(p.at)).coords)).count();
    count as f64 / elements.points.len().div_ceil(every).max(1) as f64
}

/// Names the contact of two bodies that have no other.
const SEPARATION_FEATURE: u64 = 5 << 56;

impl Body<'_> {
    /// Normals of flat faces.
    fn for_each_normal(&self, visit: &mut dyn FnMut(Vec3)) {
        match (&self.elements, self.mesh) {
            (BodyElements::Mesh(_), Some(mesh)) => mesh_normals(mesh, visit),
            (BodyElements::Box(_), _) => (0..3).for_each(|k| visit(Vec3::ith(k, 1.0))),
            (BodyElements::Cylinder { .. }, _) => visit(Vec3::z()),
            _ => {}
        }
    }

    /// Directions of its straight edges, or of its straight sides; none if they are many.
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
            BodyElements::Empty => {}
        }
        edge_directions
    }
}

/// Normals of a mesh's triangles, most of the repeated ones once.
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
    /// The greatest `n·x` of the body.
    fn support(&self, n: &Vec3) -> f64 {
        match self {
            BodyElements::Mesh(elements) => support(elements, n).dot(n),
            BodyElements::Box(half) => half.dot(&n.abs()),
            BodyElements::Round { radius, half_length } => radius * n.norm() + half_length * n.z.abs(),
            BodyElements::Cylinder { radius, half_length } => radius * n.xy().norm() + half_length * n.z.abs(),
            BodyElements::Empty => f64::INFINITY,
        }
    }

    /// A place that has it.
    fn support_point(&self, n: &Vec3) -> Vec3 {
        let sign = |x: f64| if x.abs() < 1e-9 { 0.0 } else { x.signum() };
        match self {
            BodyElements::Mesh(elements) => support(elements, n),
            BodyElements::Box(half) => n.map(sign).component_mul(half),
            BodyElements::Round { radius, half_length } => n * *radius + Vec3::z() * (sign(n.z) * half_length),
            BodyElements::Cylinder { radius, half_length } => {
                Vec3::new(n.x, n.y, 0.0).try_normalize(1e-9).unwrap_or_default() * *radius
                    + Vec3::z() * (sign(n.z) * half_length)
            }
            BodyElements::Empty => Vec3::zeros(),
        }
    }
}

/// The vertex of a mesh that is furthest along `n`.
fn support(elements: &Elements, n: &Vec3) -> Vec3 {
    let further = |best: (f64, Vec3), p: Vec3| if p.dot(n) > best.0 { (p.dot(n), p) } else { best };
    elements.points.iter().map(|p| p.at).fold((f64::NEG_INFINITY, Vec3::zeros()), further).1
}
