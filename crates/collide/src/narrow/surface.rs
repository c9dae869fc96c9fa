//! The `surface` mode: elements of each body against the signed distance of the other.
//!
//! ```text
//! point x        d_B(x) where it is
//! edge x(s)      min over s of d_B(x(s))      slope g(s) = n(x(s))·u,  u the edge's direction, n the field's normal
//! core           the same for the points and axes of rounded bodies, less their radius
//! ```
//!
//! **Search along an edge.** Against a convex body `d_B` is convex along a line, so two tangents meet below the minimum
//! (Kelley 1960, *The cutting-plane method*): where that is above the margin, the search ends; else their meeting point
//! is the next place to look. On flat faces a few looks are exact. Other bodies: the edge is first halved into short pieces, and those
//! that are too far to reach the margin are dropped (`d_B` changes by at most 1 m per metre). Within a piece that is kept the function
//! is treated as convex.
//! What comes out:
//!
//! - a kink, two slopes: an edge of B (or the ridge between two faces, inside) is crossed. The normal is the combination of the two that is
//!   perpendicular to the edge;
//! - a face that the edge lies on, or slopes gently over. Its two ends are contacts, the corners of the area of contact, unless they are the
//!   edge's own ends, which are points and speak for themselves.
//!
//! Source for elements against fields: Macklin et al., *Local optimization for robust signed distance field collision* (2020), whose
//! search of a face we do not need, since edges and vertices of both bodies are exact.

use super::reduce::Collector;
use crate::surface::elements::{Edge, Elements};
use crate::surface::field::MeshField;
use crate::surface::{Feature, Field, Hit, OVERHANG, TOUCHING, facing};
use crate::{Contact, Mat3, NormalFrom, Pose, SphereTree, Vec3};
use arrayvec::ArrayVec;
use std::cell::Cell;

/// A body as the pass sees it that takes its elements.
pub(super) enum Source<'a> {
    /// A mesh, culled by its tree.
    Mesh(&'a SphereTree, &'a Elements),
    /// A block's corners and edges.
    Box(Vec3),
    /// All within a radius of the segment `±half_length` on z; a ball if that is 0.
    Round { radius: f64, half_length: f64 },
    /// Rims and axis.
    Cylinder { radius: f64, half_length: f64 },
    /// A half-space has no elements.
    Nothing,
}

/// A body in the `surface` mode.
pub(super) struct Body<'a> {
    pub source: Source<'a>,
    pub field: &'a dyn Field,
    /// The field again, where it is a mesh's.
    pub mesh: Option<&'a MeshField>,
    pub radius: f64,
}

/// Normals of an element, in the frame of the field.
type Normals = ArrayVec<Vec3, 12>;

/// Pieces that an edge is halved into against a body that is not convex, in radii of the smaller body.
const PIECE: f64 = 0.03;
/// Slopes that differ by this are the same.
const LEVEL: f64 = 1e-7;
/// An edge that slopes less than this over a face lies on it.
const LYING_EDGE: f64 = 0.15;
/// Slopes across an edge down to this are rounding's.
const ASIDE: f64 = 1e-6;
/// Looks along a piece of an edge at most, for the minimum and for each end of a flat bottom.
const LOOKS: usize = 20;

/// All contacts of `a` and `b`.
pub(super) fn surface(a: &Body, pose_a: &Pose, b: &Body, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    let a_in_b = pose_b.inv_mul(pose_a);
    let size = a.radius.min(b.radius);
    let mut found = Collector::new(margin, size, out);
    Pass::new(&a_in_b, b, size, None).run(&a.source, &mut found);
    Pass::new(&a_in_b.inverse(), a, size, Some(&a_in_b)).run(&b.source, &mut found);
    found.finish(pose_b);
}

/// The elements of one body against the field of the other.
struct Pass<'a> {
    pose: &'a Pose,
    rotation: Mat3,
    field: &'a dyn Field,
    mesh: Option<&'a MeshField>,
    size: f64,
    /// In the second pass, where the field is A's: the pose of A in B.
    second: Option<&'a Pose>,
    /// What a mesh's field says of points of a mesh, by their names: each is the end of several edges.
    seen: [Cell<Option<(u32, Hit)>>; SEEN],
}

/// Points that are remembered.
const SEEN: usize = 128;

/// A straight element in the frame of the field.
struct Line<'a> {
    start: Vec3,
    along: Vec3,
    length: f64,
    radius: f64,
    normals: &'a [Vec3],
    index: u32,
    /// The edge of a mesh that it is.
    edge: Option<&'a Edge>,
}

/// A look at a place on a line.
#[derive(Clone, Copy)]
struct Look {
    s: f64,
    slope: f64,
    hit: Hit,
}

impl Look {
    /// Whether the line lies here on a face, or along a straight round side.
    fn lies(&self) -> bool {
        match self.hit.feature {
            Feature::Face => self.hit.facing && self.slope.abs() < LYING_EDGE,
            _ => self.slope.abs() <= LEVEL,
        }
    }

    /// The tangent at another place.
    fn height(&self, s: f64) -> f64 {
        self.hit.distance + self.slope * (s - self.s)
    }
}

impl<'a> Pass<'a> {
    fn new(pose: &'a Pose, other: &Body<'a>, size: f64, second: Option<&'a Pose>) -> Pass<'a> {
        let rotation = *pose.rotation.to_rotation_matrix().matrix();
        Pass { pose, rotation, field: other.field, mesh: other.mesh, size, second, seen: [const { Cell::new(None) }; SEEN] }
    }

    fn run(&self, source: &Source, found: &mut Collector) {
        match source {
            Source::Mesh(tree, elements) => self.node(tree, elements, 0, found),
            Source::Box(half) => self.block(half, found),
            Source::Round { radius, half_length } => self.round(*radius, *half_length, found),
            Source::Cylinder { radius, half_length } => self.cylinder(*radius, *half_length, found),
            Source::Nothing => {}
        }
    }

    fn place(&self, local: &Vec3) -> Vec3 {
        self.rotation * local + self.pose.translation.vector
    }

    fn node(&self, tree: &SphereTree, elements: &Elements, index: usize, found: &mut Collector) {
        let ball = &tree.nodes()[index];
        if self.field.bound(&self.place(&ball.center)) - ball.radius > found.limit() {
            return;
        }
        for point in elements.points_of(index) {
            let at = self.place(&point.at);
            if self.field.bound(&at) <= found.limit() {
                let normals: Normals = elements.normals_of(point).iter().map(|n| self.rotation * n).collect();
                self.vertex(&at, &normals, elements.ways_of(point), point.index, found);
            }
        }
        if !self.field.linear() {
            for edge in elements.edges_of(index) {
                self.edge(&edge.ends, 0.0, &edge.normals, edge.index, Some(edge), found);
            }
        }
        for child in ball.child_range() {
            self.node(tree, elements, child, found);
        }
    }

    fn block(&self, half: &Vec3, found: &mut Collector) {
        let signs = |corner: u32| Vec3::from_fn(|k, _| if corner >> k & 1 == 1 { 1.0 } else { -1.0 });
        for corner in 0..8 {
            let normals: Normals = (0..3).map(|k| self.rotation.column(k) * signs(corner)[k]).collect();
            let ways: [Vec3; 3] = std::array::from_fn(|k| Vec3::ith(k, -signs(corner)[k]));
            self.point(&self.place(&signs(corner).component_mul(half)), 0.0, &normals, &ways, corner, found);
        }
        if self.field.linear() {
            return;
        }
        for corner in 0..8 {
            for k in (0..3).filter(|&k| corner >> k & 1 == 0) {
                let ends = [corner, corner | 1 << k].map(|c| signs(c).component_mul(half));
                let normals = [1, 2].map(|n| Vec3::ith((k + n) % 3, signs(corner)[(k + n) % 3]));
                self.edge(&ends, 0.0, &normals, 3 * corner + k as u32, None, found);
            }
        }
    }

    fn round(&self, radius: f64, half_length: f64, found: &mut Collector) {
        let ends = [-half_length, half_length].map(|z| Vec3::z() * z);
        for (n, end) in ends.iter().enumerate().take(if half_length > 0.0 { 2 } else { 1 }) {
            self.core_point(&self.place(end), radius, n as u32, found);
        }
        if half_length > 0.0 && !self.field.linear() {
            self.edge(&ends, radius, &[], 0, None, found);
        }
    }

    /// The end of a rounded body: every place of a mesh that it touches, the closest of others.
    fn core_point(&self, at: &Vec3, radius: f64, index: u32, found: &mut Collector) {
        let Some(mesh) = self.mesh else { return self.point(at, radius, &[], &[], index, found) };
        if self.field.bound(at) - radius > found.limit() {
            return;
        }
        let reach = (radius + found.limit()).max(0.0);
        mesh.minima(at, reach, &mut |name, hit| {
            let feature = (3 << 60 | u64::from(index) << 59) ^ (name & ((1 << 59) - 1)) ^ (name >> 62 << 57);
            self.push(at, radius, &hit, point_normal(&hit), feature, found);
        });
    }

    /// A point with its normals in the field's frame; `ways` are the directions of its edges in the element's own.
    ///
    /// Straight above or below a face it counts wherever it is. Near an edge or corner of the other body it counts only if it is
    /// closest there: where one of its edges leads closer, that edge or its face makes the contact.
    fn point(&self, at: &Vec3, radius: f64, normals: &[Vec3], ways: &[Vec3], index: u32, found: &mut Collector) {
        if self.field.bound(at) - radius > found.limit() {
            return;
        }
        self.point_at(at, radius, self.field.hit(at, normals, OVERHANG), ways, index, found);
    }

    /// A point of a mesh, known to be in reach.
    fn vertex(&self, at: &Vec3, normals: &[Vec3], ways: &[Vec3], index: u32, found: &mut Collector) {
        self.point_at(at, 0.0, self.hit_of(at, Some(index), normals, OVERHANG), ways, index, found);
    }

    /// What the field says of a place that may have a name.
    fn hit_of(&self, at: &Vec3, name: Option<u32>, normals: &[Vec3], beside: f64) -> Hit {
        let (Some(mesh), Some(name)) = (self.mesh, name) else { return self.field.hit(at, normals, beside) };
        let seen = &self.seen[name as usize % SEEN];
        let nearest = match seen.get() {
            Some((n, hit)) if n == name => hit,
            _ => mesh.nearest(at),
        };
        seen.set(Some((name, nearest)));
        mesh.hit_by(at, nearest, normals, beside)
    }

    fn point_at(&self, at: &Vec3, radius: f64, hit: Hit, ways: &[Vec3], index: u32, found: &mut Collector) {
        let down = self.rotation.tr_mul(&hit.normal);
        let closest = hit.feature == Feature::Face || ways.iter().all(|way| down.dot(way) >= -ASIDE);
        self.push_if(hit.facing && closest, at, radius, &hit, point_normal(&hit), u64::from(index), found);
    }

    fn push(&self, at: &Vec3, radius: f64, hit: &Hit, normal_from: NormalFrom, feature: u64, found: &mut Collector) {
        self.push_if(true, at, radius, hit, normal_from, feature, found);
    }

    /// One contact: a core point of the element and what the field says there. One that does not `fit` is kept in
    /// reserve.
    #[allow(clippy::too_many_arguments)]
    fn push_if(&self, fits: bool, at: &Vec3, radius: f64, hit: &Hit, normal_from: NormalFrom, feature: u64, found: &mut Collector) {
        let gap = hit.distance - radius;
        if gap.is_nan() || gap > found.limit() {
            return;
        }
        let contact = Contact {
            point: at - hit.normal * (radius + 0.5 * gap),
            normal: hit.normal,
            gap,
            feature: feature << 1 | u64::from(self.second.is_some()),
            core_a: radius,
            core_b: hit.core,
            normal_from,
        };
        let contact = match self.second {
            None => contact,
            Some(pose) => turned(contact, pose).flipped(),
        };
        if fits {
            found.push(contact);
        } else {
            found.push_spare(contact);
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn edge(&self, ends: &[Vec3; 2], radius: f64, normals: &[Vec3], index: u32, edge: Option<&Edge>, found: &mut Collector) {
        let [start, end] = ends.map(|p| self.place(&p));
        let (middle, length) = (0.5 * (start + end), (end - start).norm());
        if length <= 0.0 || self.field.bound(&middle) - 0.5 * length - radius > found.limit() {
            return;
        }
        let normals: Normals = normals.iter().map(|n| self.rotation * n).collect();
        let line = Line { start, along: (end - start) / length, length, radius, normals: &normals, index, edge };
        if self.field.convex() {
            let ends = [0.0, length].map(|s| self.look(&line, s));
            self.search(&line, ends[0], ends[1], found);
        } else {
            self.halve(&line, 0.0, length, found);
        }
    }

    /// A piece that may be in reach.
    fn halve(&self, line: &Line, from: f64, to: f64, found: &mut Collector) {
        if to - from > PIECE * self.size && to - from > 1e-3 * line.length {
            let middle = 0.5 * (from + to);
            for (from, to) in [(from, middle), (middle, to)] {
                if self.field.bound(&line.at(0.5 * (from + to))) - 0.5 * (to - from) - line.radius <= found.limit() {
                    self.halve(line, from, to, found);
                }
            }
        } else {
            self.search(line, self.look(line, from), self.look(line, to), found);
        }
    }

    fn look(&self, line: &Line, s: f64) -> Look {
        let end = if s == 0.0 { Some(0) } else if s == line.length { Some(1) } else { None };
        let name = end.and_then(|end: usize| line.edge.map(|edge| edge.points[end]));
        let hit = self.hit_of(&line.at(s), name, line.normals, TOUCHING);
        Look { s, slope: hit.normal.dot(&line.along), hit }
    }

    /// The minimum between two looks, if it is not at one of them, and where the line leaves a face that it lies on.
    fn search(&self, line: &Line, mut low: Look, mut high: Look, found: &mut Collector) {
        if high.slope - low.slope <= LEVEL || ends_will_do(line, &low, &high) {
            return;
        }
        let mut on_face = low.lies() != high.lies();
        match (low.lies(), high.lies()) {
            (true, false) => self.end_of_face(line, &low, high, found),
            (false, true) => self.end_of_face(line, &high, low, found),
            _ => {}
        }
        if low.slope > -LEVEL || high.slope < LEVEL {
            return;
        }
        let tolerance = 1e-9 * self.size;
        let limit = found.limit() + line.radius;
        for _ in 0..LOOKS {
            let (s, level) = meeting(&low, &high);
            if level > limit {
                return;
            }
            if low.hit.distance.min(high.hit.distance) - level < tolerance || high.s - low.s < tolerance {
                break;
            }
            let look = self.look(line, s.clamp(low.s, high.s));
            if !on_face && (look.lies() || look.slope.abs() <= LEVEL) {
                on_face = true;
                self.face(line, &look, low, high, found);
            }
            if look.slope.abs() <= LEVEL {
                return;
            }
            if look.slope < 0.0 {
                low = look;
            } else {
                high = look;
            }
        }
        self.kink(line, &low, &high, found);
    }

    /// A minimum between two slopes.
    fn kink(&self, line: &Line, low: &Look, high: &Look, found: &mut Collector) {
        let (s, level) = meeting(low, high);
        let (a, b) = (high.slope, -low.slope);
        let sum = low.hit.normal * a + high.hit.normal * b;
        let length = sum.norm();
        if length.is_nan() || length <= 1e-9 * (a + b) {
            return;
        }
        if self.look(line, s).hit.distance - level > 1e-6 * self.size {
            return; // not convex here: what the tangents say is no place on the surface
        }
        let nearest = if low.hit.distance < high.hit.distance { low } else { high };
        if self.second.is_some() && matches!(nearest.hit.feature, Feature::Edge(_)) {
            return; // that edge has found it
        }
        // two faces at depth `level` meet in an edge further up
        let distance = level * (a + b) / length;
        let hit = Hit { distance, normal: sum / length, ..nearest.hit };
        let fits = facing(line.normals, &hit.normal) && line.is_closest(&hit.normal);
        self.push_if(fits, &line.at(s), line.radius, &hit, line_normal(line, &hit), line.feature(0), found);
    }

    /// A part that lies on a face: its two ends.
    fn face(&self, line: &Line, look: &Look, low: Look, high: Look, found: &mut Collector) {
        let from = self.leaves(line, look, low);
        let to = self.leaves(line, look, high);
        if to - from < 1e-3 * self.size {
            self.push_on_face(line, look, look.s, 1, found);
        } else {
            self.push_on_face(line, look, from, 1, found);
            self.push_on_face(line, look, to, 2, found);
        }
    }

    /// The end of a part that lies on a face and begins at `look`, on the side of `outer`.
    fn end_of_face(&self, line: &Line, look: &Look, outer: Look, found: &mut Collector) {
        let s = self.leaves(line, look, outer);
        // at the very start it is the element's own end, or another piece's
        if (s - look.s).abs() > 1e-6 * self.size {
            self.push_on_face(line, look, s, if outer.s > look.s { 2 } else { 1 }, found);
        }
    }

    /// Where the line leaves the face that is under `look`, towards `outer`: where the tangents of the two meet.
    fn leaves(&self, line: &Line, look: &Look, mut outer: Look) -> f64 {
        let tolerance = 1e-9 * self.size;
        for _ in 0..LOOKS {
            let turn = outer.slope - look.slope;
            let rise = outer.hit.distance - look.height(outer.s);
            if rise < tolerance || turn.abs() <= LEVEL {
                return outer.s;
            }
            let s = outer.s - rise / turn;
            if (s - look.s) * (outer.s - look.s) <= 0.0 || (s - outer.s) * (look.s - outer.s) <= 0.0 {
                return look.s;
            }
            outer = self.look(line, s);
        }
        outer.s
    }

    fn push_on_face(&self, line: &Line, look: &Look, s: f64, part: u64, found: &mut Collector) {
        let hit = Hit { distance: look.height(s), ..look.hit };
        if line.radius > 0.0 && look.slope.abs() > ASIDE {
            return; // the surface of a cylinder is its radius away across the axis alone
        }
        if hit.facing && (hit.feature == Feature::Face || line.is_closest(&hit.normal)) {
            self.push(&line.at(s), line.radius, &hit, line_normal(line, &hit), line.feature(part), found);
        }
    }

    /// The axis, and on each rim fixed points and the lowest ones.
    fn cylinder(&self, radius: f64, half_length: f64, found: &mut Collector) {
        let ends = [-half_length, half_length].map(|z| Vec3::z() * z);
        if self.field.round() {
            self.edge(&ends, radius, &[], 0, None, found);
        }
        for side in 0..2 {
            let up = self.rotation.column(2) * if side == 0 { -1.0 } else { 1.0 };
            let rim = Rim { middle: self.place(&ends[side as usize]), up, radius, side };
            self.rim(&rim, found);
        }
    }

    fn rim(&self, rim: &Rim, found: &mut Collector) {
        if self.field.bound(&rim.middle) - rim.radius > found.limit() {
            return;
        }
        let (x, y) = (self.rotation.column(0).into_owned(), self.rotation.column(1).into_owned());
        let ways: [Vec3; RIM] = std::array::from_fn(|n| x * RIM_POINTS[n].0 + y * RIM_POINTS[n].1);
        let hits = ways.map(|way| self.field.hit(&rim.at(&way), &[way, rim.up], OVERHANG));
        for n in 0..RIM {
            let hit = &hits[n];
            if n % 3 == 0 && hit.facing && across(&hit.normal, &rim.up).norm() < STEEP {
                self.push(&rim.at(&ways[n]), 0.0, hit, point_normal(hit), rim.feature(n as u64), found);
            }
            let (before, after) = (&hits[(n + RIM - 1) % RIM], &hits[(n + 1) % RIM]);
            if hit.distance <= before.distance && hit.distance < after.distance {
                self.lowest(rim, ways[n], *hit, RIM as u64 + n as u64, found);
            }
        }
    }

    /// Slides along a rim from a fixed point to the lowest one near it.
    fn lowest(&self, rim: &Rim, mut way: Vec3, mut hit: Hit, part: u64, found: &mut Collector) {
        for _ in 0..LOOKS {
            let down = across(&-hit.normal, &rim.up);
            let tilt = down.norm();
            if tilt < TILTED {
                return; // the fixed points will do
            }
            let mut next = down / tilt;
            let mut look = self.field.hit(&rim.at(&next), &[next, rim.up], OVERHANG);
            // the way may turn back and forth over a ridge: half of it then
            for _ in 0..4 {
                if look.distance <= hit.distance {
                    break;
                }
                next = (next + way).try_normalize(1e-9).unwrap_or(way);
                look = self.field.hit(&rim.at(&next), &[next, rim.up], OVERHANG);
            }
            let better = hit.distance - look.distance;
            if better <= 0.0 {
                break;
            }
            (way, hit) = (next, look);
            if better < 1e-12 * self.size {
                break;
            }
        }
        let tilt = across(&hit.normal, &rim.up).norm();
        if !hit.facing || tilt < TILTED {
            return;
        }
        // one that lies has its axis for a core
        let core = if tilt > LYING { rim.radius } else { 0.0 };
        let hit = Hit { distance: hit.distance + core, ..hit };
        let at = rim.at(&way) + hit.normal * core;
        self.push(&at, core, &hit, point_normal(&hit), rim.feature(part), found);
    }
}

/// A circle at the end of a cylinder, in the frame of the field.
struct Rim {
    middle: Vec3,
    up: Vec3,
    radius: f64,
    side: u64,
}

/// Places on a rim that are looked at; every third is a fixed point that carries.
const RIM: usize = 12;
/// Cosine and sine of multiples of 30°.
const RIM_POINTS: [(f64, f64); RIM] = [
    (1.0, 0.0),
    (COS_30, 0.5),
    (0.5, COS_30),
    (0.0, 1.0),
    (-0.5, COS_30),
    (-COS_30, 0.5),
    (-1.0, 0.0),
    (-COS_30, -0.5),
    (-0.5, -COS_30),
    (0.0, -1.0),
    (0.5, -COS_30),
    (COS_30, -0.5),
];
const COS_30: f64 = 0.866_025_403_784_438_6;
/// Sine of the tilt below which a rim rests on its fixed points.
const TILTED: f64 = 1e-4;
/// Sine of the tilt above which it rests on one point.
const STEEP: f64 = 0.2;
/// Sine of the tilt above which the cylinder lies.
const LYING: f64 = 0.99;

impl Rim {
    fn at(&self, way: &Vec3) -> Vec3 {
        self.middle + way * self.radius
    }

    fn feature(&self, part: u64) -> u64 {
        1 << 57 | self.side << 8 | part
    }
}

impl Line<'_> {
    fn at(&self, s: f64) -> Vec3 {
        self.start + self.along * s
    }

    /// Whether going from the edge into either of its faces leads no closer.
    fn is_closest(&self, normal: &Vec3) -> bool {
        let [n1, n2] = self.normals else { return true };
        let cos = n1.dot(n2);
        // into the first face is −(n₂ − n₁ cos)
        [n2 - n1 * cos, n1 - n2 * cos].iter().all(|out| normal.dot(out) <= ASIDE)
    }

    fn feature(&self, part: u64) -> u64 {
        1 << 58 | u64::from(self.index) << 2 | part
    }
}

/// The part of `v` across a unit direction.
fn across(v: &Vec3, along: &Vec3) -> Vec3 {
    v - along * along.dot(v)
}

/// Where the tangents of two looks meet: place and height.
fn meeting(low: &Look, high: &Look) -> (f64, f64) {
    let fall = high.hit.distance - low.hit.distance + low.slope * low.s - high.slope * high.s;
    let s = fall / (low.slope - high.slope);
    (s, low.hit.distance + low.slope * (s - low.s))
}

/// Whether an edge of a smooth surface is no deeper than one of its ends, which counts, by more than the stated error.
fn ends_will_do(line: &Line, low: &Look, high: &Look) -> bool {
    let Some(edge) = line.edge else { return false };
    let end = if low.hit.distance < high.hit.distance { low } else { high };
    let whole = low.s == 0.0 && high.s == line.length;
    let turns = low.slope < 0.0 && high.slope > 0.0;
    let least = if turns { meeting(low, high).1 } else { end.hit.distance };
    whole && end.hit.feature == Feature::Face && end.hit.facing && end.hit.distance - least < edge.spared
}

/// What the normal of a point's contact turns with.
fn point_normal(hit: &Hit) -> NormalFrom {
    match hit.feature {
        Feature::Face => NormalFrom::FaceOfB,
        Feature::Line(along) | Feature::Edge(along) => NormalFrom::LineOfB(along),
        Feature::Point => NormalFrom::CorePoints,
    }
}

/// What the normal of a line's contact turns with.
fn line_normal(line: &Line, hit: &Hit) -> NormalFrom {
    match hit.feature {
        Feature::Face => NormalFrom::FaceOfB,
        Feature::Line(_) | Feature::Edge(_) => NormalFrom::Edges,
        Feature::Point => NormalFrom::LineOfA(line.along),
    }
}

/// The same contact in another frame.
fn turned(contact: Contact, pose: &Pose) -> Contact {
    let normal_from = match contact.normal_from {
        NormalFrom::LineOfA(along) => NormalFrom::LineOfA(pose.rotation * along),
        NormalFrom::LineOfB(along) => NormalFrom::LineOfB(pose.rotation * along),
        other => other,
    };
    let point = (pose * nalgebra::Point3::from(contact.point)).coords;
    Contact { point, normal: pose.rotation * contact.normal, normal_from, ..contact }
}
