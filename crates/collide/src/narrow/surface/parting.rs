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
//! Directions tried: normals of faces and products of edges (the separating axes; all of them where they are few), axes and centres. Where surfaces are
//! bent or have very many faces, a search from the best of them follows. Any of them parts the two: only how far is more than the least.
//!
//! Bodies that are not convex have the depth of their deepest place, if the two are free when moved so far; else their hulls are parted, if much of one is
//! in the other.

use super::super::reduce::Collector;
use super::deep::DEEP;
use super::pass::{Memory, Pass};
use super::{Body, Source, elements, faces};
use crate::surface::TOUCHING;
use crate::surface::elements::Elements;
use crate::surface::field::MeshField;
use crate::{Contact, Mat3, NormalFrom, Pose, Vec3};
use arrayvec::ArrayVec;
use nalgebra::Point3;

/// What the elements made of two bodies.
pub(super) struct Seen {
    /// The least signed distance of any place that was looked at, whether it made a contact or not, metres.
    pub least: f64,
}

/// All in radii of the smaller body. A place this near or inside is evidence that the two overlap.
const TOUCHED: f64 = 1e-6;
/// Depths that differ by less are the same.
const SAME: f64 = 1e-4;
/// Overlaps below this are told by the elements: faces that far away are looked for.
const SHALLOW: f64 = 2e-3;
/// By how much, as a factor, the way along a contact's normal may be longer than its depth.
const LONGER: f64 = 1.1;
/// The gap at which the two touch.
const CLEAR: f64 = 1e-5;
/// How far contacts are looked for where they touch.
const NEAR: f64 = 0.02;
/// Cosine of a contact's normal and the way out.
const ALONG: f64 = 0.7;

/// Faces of a mesh that are tried at most; of finer ones every so manieth.
const MOST_FACES: usize = 256;
/// Directions of edges of a body; of one that has more none is tried.
const MOST_WAYS: usize = 16;
/// A direction must be better by this to count, so that the first of equal ones does.
const BETTER: f64 = 1.0 - 1e-6;
/// Points of a mesh that are asked whether they are inside, at most.
const MOST_POINTS: usize = 128;
/// Two are in each other if so much of one is.
const MUCH: f64 = 0.2;
/// Steps of the search from the best direction: from the first, radians, halved, down to the last.
const FIRST_STEP: f64 = 0.1;
const LAST_STEP: f64 = 1e-4;
const MOST_STEPS: usize = 60;

/// Corrects what was found where it does not part the two.
pub(super) fn part(a: &Body, b: &Body, a_in_b: &Pose, size: f64, seen: &Seen, found: &mut Collector) {
    let (told, reached) = (-found.least(), -seen.least);
    let missing = reached >= -TOUCHED * size && told < reached - SAME * size;
    if !(missing || told.max(reached) > SHALLOW * size) || a.field.linear() || b.field.linear() {
        return;
    }
    let two = Two { a, b, pose: a_in_b, rotation: *a_in_b.rotation.to_rotation_matrix().matrix(), size };
    if !(a.field.convex() && b.field.convex()) {
        if (missing && told < SAME * size) || (told > DEEP * size && two.share_inside() > MUCH) {
            two.part_hollow(found);
        }
        return;
    }
    if found.deepest().is_some_and(|c| two.overlap(&c.normal) <= told.max(LONGER * told) + SAME * size) {
        return;
    }
    let (way, depth) = two.least();
    if depth > SAME * size {
        two.touching(way, depth, found);
    }
}

/// Two bodies in the frame of B.
struct Two<'a> {
    a: &'a Body<'a>,
    b: &'a Body<'a>,
    pose: &'a Pose,
    rotation: Mat3,
    size: f64,
}

impl Two<'_> {
    /// `D(n)`, metres; `n` from B to A.
    fn overlap(&self, n: &Vec3) -> f64 {
        self.b.source.highest(n) + self.a.source.highest(&-self.rotation.tr_mul(n))
            - n.dot(&self.pose.translation.vector)
    }

    /// The direction along which they are parted soonest, of those tried, and how far that is.
    fn least(&self) -> (Vec3, f64) {
        let off = self.pose.translation.vector;
        let mut best = (Vec3::z(), f64::INFINITY);
        let mut try_way = |n: Vec3| {
            let depth = self.overlap(&n);
            if depth < BETTER * best.1 {
                best = (n, depth);
            }
        };
        let mut either = |n: Vec3| {
            let n = if n.dot(&off) < 0.0 { -n } else { n };
            try_way(n);
            try_way(-n);
        };
        let turned = |n: Vec3| self.rotation * n;
        for k in [2, 0, 1] {
            either(Vec3::ith(k, 1.0));
            either(turned(Vec3::ith(k, 1.0)));
        }
        self.b.each_normal(&mut |n| either(n));
        self.a.each_normal(&mut |n| either(turned(n)));
        let [mut ways_a, ways_b] = [self.a, self.b].map(|body| body.ways());
        ways_a.iter_mut().for_each(|way| *way = self.rotation * *way);
        for (x, y) in ways_a.iter().flat_map(|x| ways_b.iter().map(move |y| (x, y))) {
            x.cross(y).try_normalize(1e-6).into_iter().for_each(&mut either);
        }
        // straight away from an axis, and from centre to centre
        for axis in [Vec3::z(), self.rotation.column(2).into_owned()] {
            (off - axis * axis.dot(&off)).try_normalize(1e-9 * self.size).into_iter().for_each(&mut either);
        }
        off.try_normalize(1e-9 * self.size).into_iter().for_each(&mut either);
        let many = |body: &Body| {
            body.field.round()
                || body.mesh.is_some_and(|mesh| mesh.faces().len() > MOST_FACES)
                || body.ways().is_empty()
        };
        if many(self.a) || many(self.b) { self.refine(best) } else { best }
    }

    /// Two of which one is not convex: by the deepest place, or by their hulls.
    fn part_hollow(&self, found: &mut Collector) {
        if found.least() > -DEEP * self.size {
            let inverse = self.pose.inverse();
            let memories = [Memory::new(), Memory::new()];
            let first = Pass::new([self.a, self.b], self.pose, self.size, None, &memories[0]);
            let second = Pass::new([self.b, self.a], &inverse, self.size, Some(self.pose), &memories[1]);
            faces([&first, &second], [self.a, self.b], found);
        }
        let deepest = found.deepest().copied().filter(|c| c.gap < -SAME * self.size);
        if let Some(c) = deepest.filter(|c| self.are_free(c.normal * (CLEAR * self.size - c.gap))) {
            self.touching(c.normal, -c.gap, found);
        } else if self.share_inside() > MUCH {
            let (way, depth) = self.least();
            self.touching(way, depth, found);
        }
    }

    /// Whether they do not overlap where A is moved by so much.
    fn are_free(&self, shift: Vec3) -> bool {
        let (mut out, mut moved) = (Vec::new(), *self.pose);
        moved.translation.vector += shift;
        let mut there = Collector::new(CLEAR * self.size, self.size, &mut out);
        let seen = elements(self.a, self.b, &moved, self.size, &mut there);
        seen.least > -SAME * self.size && there.least() > -SAME * self.size
    }

    /// Which share of the points of the one that has more of them there is inside the other one, or on it.
    fn share_inside(&self) -> f64 {
        let inverse = self.pose.inverse();
        let [first, second] = [(self.a, self.b, self.pose), (self.b, self.a, &inverse)]
            .map(|(of, within, pose)| share_inside(of, within, pose, self.size));
        first.max(second)
    }

    fn refine(&self, (mut n, mut depth): (Vec3, f64)) -> (Vec3, f64) {
        let mut step = FIRST_STEP;
        for _ in 0..MOST_STEPS {
            let u = n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
            let v = n.cross(&u);
            let around = [u, v, -u, -v].map(|w| (n + w * step).normalize());
            let better = around
                .into_iter()
                .map(|m| (m, self.overlap(&m)))
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

    /// The contacts that the two have where A, moved by `depth` along `way`, touches B, as deep as they are where it is.
    fn touching(&self, way: Vec3, depth: f64, found: &mut Collector) {
        let shift = depth + CLEAR * self.size;
        let mut moved = *self.pose;
        moved.translation.vector += way * shift;
        let limit = found.restart(NEAR * self.size);
        elements(self.a, self.b, &moved, self.size, found);
        found.retain_back(limit, |contact| {
            let along = contact.normal.dot(&way);
            contact.point -= 0.5 * shift * way;
            contact.gap -= shift * along;
            along > ALONG
        });
        if found.least() > -(1.0 - NEAR) * depth {
            // nothing flat meets: the outermost places do
            let lowest =
                self.pose.translation.vector + self.rotation * self.a.source.outermost(&-self.rotation.tr_mul(&way));
            let point = 0.5 * (lowest + self.b.source.outermost(&way));
            found.push(Contact {
                point,
                normal: way,
                gap: -depth,
                feature: PARTED,
                core_a: 0.0,
                core_b: 0.0,
                normal_from: NormalFrom::Edges,
            });
        }
    }
}

/// Of a mesh's points; 0 of others.
fn share_inside(of: &Body, within: &Body, pose: &Pose, size: f64) -> f64 {
    let Source::Mesh(elements) = &of.source else { return 0.0 };
    let every = elements.points.len().div_ceil(MOST_POINTS).max(1);
    let inside = |p: &Vec3| within.field.hit(p, &[], TOUCHING).distance < TOUCHED * size;
    let count = elements.points.iter().step_by(every).filter(|p| inside(&(pose * Point3::from(p.at)).coords)).count();
    count as f64 / elements.points.len().div_ceil(every).max(1) as f64
}

/// Names the contact of two bodies that have no other.
const PARTED: u64 = 5 << 56;

impl Body<'_> {
    /// Normals of flat faces.
    fn each_normal(&self, each: &mut dyn FnMut(Vec3)) {
        match (&self.source, self.mesh) {
            (Source::Mesh(_), Some(mesh)) => mesh_normals(mesh, each),
            (Source::Box(_), _) => (0..3).for_each(|k| each(Vec3::ith(k, 1.0))),
            (Source::Cylinder { .. }, _) => each(Vec3::z()),
            _ => {}
        }
    }

    /// Directions of its straight edges, or of its straight sides; none if they are many.
    fn ways(&self) -> ArrayVec<Vec3, MOST_WAYS> {
        let mut ways = ArrayVec::new();
        match &self.source {
            Source::Mesh(elements) => {
                for way in &elements.ways {
                    if ways.iter().all(|w: &Vec3| w.dot(way).abs() < 1.0 - 1e-9) && ways.try_push(*way).is_err() {
                        return ArrayVec::new();
                    }
                }
            }
            Source::Box(_) => ways.extend((0..3).map(|k| Vec3::ith(k, 1.0))),
            Source::Round { half_length, .. } if *half_length == 0.0 => {}
            Source::Round { .. } | Source::Cylinder { .. } => ways.push(Vec3::z()),
            Source::Nothing => {}
        }
        ways
    }
}

/// Normals of a mesh's triangles, most of the repeated ones once.
fn mesh_normals(mesh: &MeshField, each: &mut dyn FnMut(Vec3)) {
    let mut last = Vec3::zeros();
    for t in (0..mesh.faces().len()).step_by(mesh.faces().len().div_ceil(MOST_FACES).max(1)) {
        let normal = mesh.face_normal(t);
        if normal.dot(&last) < 1.0 - 1e-12 {
            each(normal);
            last = normal;
        }
    }
}

impl Source<'_> {
    /// The greatest `n·x` of the body.
    fn highest(&self, n: &Vec3) -> f64 {
        match self {
            Source::Mesh(elements) => highest(elements, n).dot(n),
            Source::Box(half) => half.dot(&n.abs()),
            Source::Round { radius, half_length } => radius * n.norm() + half_length * n.z.abs(),
            Source::Cylinder { radius, half_length } => radius * n.xy().norm() + half_length * n.z.abs(),
            Source::Nothing => f64::INFINITY,
        }
    }

    /// A place that has it.
    fn outermost(&self, n: &Vec3) -> Vec3 {
        let sign = |x: f64| if x.abs() < 1e-9 { 0.0 } else { x.signum() };
        match self {
            Source::Mesh(elements) => highest(elements, n),
            Source::Box(half) => n.map(sign).component_mul(half),
            Source::Round { radius, half_length } => n * *radius + Vec3::z() * (sign(n.z) * half_length),
            Source::Cylinder { radius, half_length } => {
                Vec3::new(n.x, n.y, 0.0).try_normalize(1e-9).unwrap_or_default() * *radius
                    + Vec3::z() * (sign(n.z) * half_length)
            }
            Source::Nothing => Vec3::zeros(),
        }
    }
}

/// The vertex of a mesh that is furthest along `n`.
fn highest(elements: &Elements, n: &Vec3) -> Vec3 {
    let further = |best: (f64, Vec3), p: Vec3| if p.dot(n) > best.0 { (p.dot(n), p) } else { best };
    elements.points.iter().map(|p| p.at).fold((f64::NEG_INFINITY, Vec3::zeros()), further).1
}
