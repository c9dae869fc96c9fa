//! A straight element (an edge, an axis) against a field: the minimum distance along it, and the
//! ends of its parts that lie on a face.
//!
//! **Search along an edge.** Against a convex body `d_B` is convex along a line, so two tangents
//! intersect below the minimum (Kelley 1960, *The cutting-plane method*). If the intersection is
//! above the margin, the search ends; otherwise it is the next sample. On flat faces a few samples
//! are exact.
//!
//! For other bodies an edge is not searched if bounds at a few places show that it is out of reach
//! (each excludes as much of the edge as it exceeds the margin). A long edge is first divided into
//! parts (`line_parts.rs`): those over faces and valleys need no search, those over a ridge are one
//! piece. The others are halved into short pieces, and pieces too far away are dropped (`d_B`
//! changes by at most 1 m per meter). Within a piece the function is treated as convex until a
//! sample lies below the tangent of another one. Then B has a valley between them, perhaps with a
//! second minimum, so that part is halved a few times.
//!
//! If an edge or a corner of B is closest, the minimum of the distance from it has a closed form
//! ([`Hyperbola`]). That place is sampled next. If the same edge or corner is closest there, it is
//! the minimum. Results:
//!
//! - a kink between two slopes: the line crosses an edge of B (or, inside, the ridge between two
//!   faces). The normal is the combination of the two normals that is perpendicular to the line;
//! - a face on which the edge lies, or over which it is slightly inclined. The two ends of this
//!   part are contacts (corners of the contact area), except for the ends of the edge itself, which
//!   are tested as points.

use super::super::reduce::Collector;
use super::hyperbola::Hyperbola;
use super::line_parts::{Curvature, Part};
use super::query::{Normals, Query};
use super::tolerances::{FLAT_SLOPE, LEVEL_SLOPE, MAX_PIECE, SLOPE_ROUNDING};
use crate::sdf::elements::{Edge, max_slope};
use crate::sdf::field::Segment;
use crate::sdf::{FACING, Feature, Hit, TOUCHING, facing};
use crate::{NormalFrom, Vec3};
use nalgebra::RealField;

/// Maximum length of a piece if both faces of the edge belong to a smooth surface, in the same
/// unit; its ends suffice.
const MAX_SMOOTH_PIECE: f64 = 0.06;
/// Number of times that what bounds leave of a line is halved, to show that it is out of reach.
const MAX_CLEARED: u32 = 2;
/// Maximum number of samples for the end of a flat part.
const MAX_END_SAMPLES: usize = 20;
/// Maximum number of samples for a minimum; a third of them are bisections.
const MAX_SAMPLES: usize = 90;
/// Maximum number of halvings of a part over a valley.
const MAX_SPLITS: u32 = 5;
/// Smallest distance of a foot from an existing sample, as a fraction of the remaining interval.
const MIN_FOOT_OFFSET: f64 = 1e-6;
/// Least depth below a face that is not the nearest one at which walls in front of an edge are looked for, in the same unit.
const OTHER_FACE: f64 = 1e-6;
/// Distance below a tangent that exceeds rounding, as a fraction of the smaller body's radius.
const CONVEXITY_TOLERANCE: f64 = 1e-9;
/// Largest slope of an axis over a face at which its surface meets the face where the axis leaves it, as far as a step turns it.
const STEEPEST: f64 = 0.2;

/// A straight element in the frame of the field.
struct Line<'a> {
    start: Vec3,
    along: Vec3,
    length: f64,
    radius: f64,
    normals: &'a [Vec3],
    index: u32,
    /// The edge, if the element is an edge of a mesh.
    edge: Option<&'a Edge>,
    /// Whether it is the axis of a cylinder, whose surface is its radius away only across the axis; that of a
    /// capsule is everywhere.
    is_axis: bool,
}

/// The distance and slope at a place on a line.
#[derive(Clone, Copy)]
struct Sample {
    s: f64,
    slope: f64,
    hit: Hit,
}

impl Sample {
    /// Returns whether the line lies on a face here, or along a straight round side.
    fn is_flat(&self) -> bool {
        match self.hit.feature {
            Feature::Face => self.hit.facing && self.slope.abs() < FLAT_SLOPE,
            _ => self.slope.abs() <= LEVEL_SLOPE,
        }
    }

    /// Returns whether nothing between here and another place is within the limit: the distance changes by at most 1 m per meter.
    fn is_clear(&self, line: &Line, s: f64, found: &Collector) -> bool {
        self.hit.nearest - (s - self.s).abs() - line.radius > found.limit()
    }

    /// Returns the tangent at another place.
    fn height(&self, s: f64) -> f64 {
        self.hit.distance + self.slope * (s - self.s)
    }

    /// Returns the distance along the line from the edge or corner that is closest here.
    fn hyperbola(&self, line: &Line) -> Option<Hyperbola> {
        Hyperbola::new(&self.hit, self.s, self.slope, &line.along)
    }
}

impl Query<'_> {
    #[allow(clippy::too_many_arguments)]
    pub(super) fn edge(
        &self,
        ends: &[Vec3; 2],
        radius: f64,
        normals: &[Vec3],
        index: u32,
        edge: Option<&Edge>,
        found: &mut Collector,
    ) {
        if self.least_height(ends) - radius > found.limit() {
            return;
        }
        let [start, end] = ends.map(|p| self.to_field(&p));
        let (middle, length) = (0.5 * (start + end), (end - start).norm());
        let clear = self.field.bound(&middle) - radius - found.limit();
        if length <= 0.0 || clear > 0.5 * length {
            return;
        }
        let normals: Normals = normals.iter().map(|n| self.rotation * n).collect();
        let is_axis = self.is_cylinder && radius > 0.0;
        let line =
            Line { start, along: (end - start) / length, length, radius, normals: &normals, index, edge, is_axis };
        if self.field.is_convex() {
            let start = self.sample(&line, 0.0);
            // a convex distance is above its tangent
            let least = start.hit.distance.min(start.height(length)) - radius;
            if start.slope < FLAT_SLOPE && least <= found.limit() {
                self.search(&line, start, self.sample(&line, length), found);
            }
        } else if clear <= 0.0
            || !self.is_clear(&line, (0.0, 0.5 * length - clear), MAX_CLEARED, found)
            || !self.is_clear(&line, (0.5 * length + clear, length), MAX_CLEARED, found)
        {
            self.by_parts(&line, found);
        }
    }

    /// Returns whether bounds of the distance at the middle of a range of a line, and `times` more in what is left of it on
    /// either side, show that none of it is within the limit.
    fn is_clear(&self, line: &Line, (from, to): (f64, f64), times: u32, found: &Collector) -> bool {
        if from >= to {
            return true;
        }
        let middle = 0.5 * (from + to);
        let clear = self.field.bound(&line.at(middle)) - line.radius - found.limit();
        clear > 0.0
            && (clear >= middle - from
                || (times > 0
                    && self.is_clear(line, (from, middle - clear), times - 1, found)
                    && self.is_clear(line, (middle + clear, to), times - 1, found)))
    }

    /// Searches a line whose distance is not convex: a long edge by the parts on which it is.
    fn by_parts(&self, line: &Line, found: &mut Collector) {
        let mut last = None;
        let whole = Segment { start: line.start, along: line.along, from: 0.0, to: line.length };
        for Part { from, to, curvature } in self.parts_of(line.edge, &whole, line.normals, found.limit()) {
            last = match curvature {
                Curvature::Concave => None,
                Curvature::Convex => self.piece(line, (from, last), (to, None), found)[1],
                Curvature::Unknown => self.halve(line, (from, last), (to, None), found)[1],
            };
        }
    }

    /// Searches a piece between two places, which can have been sampled before. Returns the samples
    /// at them.
    fn halve(
        &self,
        line: &Line,
        low: (f64, Option<Sample>),
        high: (f64, Option<Sample>),
        found: &mut Collector,
    ) -> [Option<Sample>; 2] {
        let (from, to) = (low.0, high.0);
        if low.1.is_some_and(|low| low.is_clear(line, to, found)) {
            return [low.1, None];
        }
        let smooth = line.edge.is_some_and(|edge| edge.end_tolerance > 0.0);
        if !self.is_one_piece(to - from, smooth) && to - from > 1e-3 * line.length {
            let middle = 0.5 * (from + to);
            let reaches = |from: f64, to: f64, found: &Collector| {
                self.field.bound(&line.at(0.5 * (from + to))) - 0.5 * (to - from) - line.radius <= found.limit()
            };
            let [mut first, mut between, mut last] = [low.1, None, high.1];
            if reaches(from, middle, found) {
                [first, between] = self.halve(line, low, (middle, None), found);
            }
            if reaches(middle, to, found) {
                [_, last] = self.halve(line, (middle, between), high, found);
            }
            return [first, last];
        }
        self.piece(line, low, high, found)
    }

    /// Searches a piece whose distance is treated as convex. Returns the samples at its ends.
    fn piece(
        &self,
        line: &Line,
        low: (f64, Option<Sample>),
        high: (f64, Option<Sample>),
        found: &mut Collector,
    ) -> [Option<Sample>; 2] {
        // the minimum of a piece that rises steeply from either end is at that end
        let start = low.1.unwrap_or_else(|| self.sample(line, low.0));
        if high.1.is_none() && (start.slope >= FLAT_SLOPE || start.is_clear(line, high.0, found)) {
            return [Some(start), None];
        }
        let end = high.1.unwrap_or_else(|| self.sample(line, high.0));
        self.search(line, start, end, found);
        [Some(start), Some(end)]
    }

    /// Returns whether the distance along an edge of this length is treated as convex.
    pub(super) fn is_one_piece(&self, length: f64, smooth: bool) -> bool {
        self.field.is_convex() || length <= if smooth { MAX_SMOOTH_PIECE } else { MAX_PIECE } * self.size
    }

    fn sample(&self, line: &Line, s: f64) -> Sample {
        let end = if s == 0.0 {
            Some(0)
        } else if s == line.length {
            Some(1)
        } else {
            None
        };
        let name = end.and_then(|end: usize| line.edge.map(|edge| edge.points[end]));
        let at = line.at(s);
        let hit = self.hit_at(&at, name, line.normals, TOUCHING);
        let hit = self.wall_in_front(line, s, &hit).unwrap_or(hit);
        let slope = hit.normal.dot(&line.along);
        // the surface of a round element is its radius away only perpendicular to the axis
        self.record(&hit, if slope.abs() <= SLOPE_ROUNDING { line.radius } else { 0.0 });
        Sample { s, slope, hit }
    }

    /// Returns the hit of the nearest wall at `s` if an end of the edge meets that wall head-on and is less deep in it than
    /// in the face of `hit`, which lies further away: the wall stops the end, whose vertex makes the contact.
    fn wall_in_front(&self, line: &Line, s: f64, hit: &Hit) -> Option<Hit> {
        if hit.distance >= hit.nearest.min(-OTHER_FACE * self.size) || line.normals.is_empty() {
            return None;
        }
        let wall = self.field.hit(&line.at(s), &[], TOUCHING);
        let is_in_front = line.normals.iter().all(|n| n.dot(&wall.normal).abs() <= FACING);
        let rise = wall.normal.dot(&line.along);
        let lowest = wall.distance - (rise * s).max(rise * (s - line.length));
        (is_in_front && lowest > hit.distance).then_some(Hit { facing: false, ..wall })
    }

    /// Searches between two samples: the minimum, if it is not at one of them, and the exit from a
    /// face on which the line lies.
    fn search(&self, line: &Line, low: Sample, high: Sample, found: &mut Collector) {
        let nonconvex = !self.field.is_convex() && self.is_nonconvex(&low, &high);
        if !nonconvex && (high.slope - low.slope <= LEVEL_SLOPE || ends_suffice(line, &low, &high)) {
            return;
        }
        match (low.is_flat(), high.is_flat()) {
            (true, false) => self.end_of_face(line, &low, high, found),
            (false, true) => self.end_of_face(line, &high, low, found),
            _ => {}
        }
        self.minima(line, low, high, low.is_flat() != high.is_flat(), MAX_SPLITS, found);
    }

    /// Searches the minima between two samples; parts beyond a ridge are halved at most `halvings`
    /// times. `on_face`: the face on which the line lies is known.
    fn minima(&self, line: &Line, low: Sample, high: Sample, on_face: bool, halvings: u32, found: &mut Collector) {
        match (low.slope < -LEVEL_SLOPE, high.slope > LEVEL_SLOPE) {
            (true, true) => {
                let Some([to, from]) = self.descend(line, low, high, on_face, found) else { return };
                self.search_nonconvex(line, [low, to], false, halvings, found);
                self.search_nonconvex(line, [from, high], true, halvings, found);
            }
            (false, false) => {}
            (_, rises) => self.search_nonconvex(line, [low, high], rises, halvings, found),
        }
    }

    /// Searches a part that rises from a minimum, or falls to one, at both ends. It has further
    /// minima if a sample lies below the tangent of another.
    fn search_nonconvex(
        &self,
        line: &Line,
        [low, high]: [Sample; 2],
        rises: bool,
        halvings: u32,
        found: &mut Collector,
    ) {
        let length = high.s - low.s;
        // the distance changes by at most 1 m per meter
        let least = 0.5 * (low.hit.distance + high.hit.distance - length) - line.radius;
        if halvings == 0 || self.field.is_convex() || least > found.limit() || !self.is_nonconvex(&low, &high) {
            return;
        }
        // two faces that meet in a valley are as high as both tangents at their intersection
        let (s, _) = tangent_intersection(&low, &high);
        let s = if halvings == MAX_SPLITS && s > low.s + 0.01 * length && s < high.s - 0.01 * length {
            s
        } else {
            0.5 * (low.s + high.s)
        };
        let middle = self.sample(line, s);
        match rises {
            true if middle.slope < -LEVEL_SLOPE => self.minima(line, middle, high, false, halvings - 1, found),
            false if middle.slope > LEVEL_SLOPE => self.minima(line, low, middle, false, halvings - 1, found),
            _ => {
                self.search_nonconvex(line, [low, middle], rises, halvings - 1, found);
                self.search_nonconvex(line, [middle, high], rises, halvings - 1, found);
            }
        }
    }

    /// Returns whether one of two samples lies below the tangent of the other: the distance is not
    /// convex between them.
    fn is_nonconvex(&self, low: &Sample, high: &Sample) -> bool {
        let slack = CONVEXITY_TOLERANCE * self.size;
        low.hit.distance < high.height(low.s) - slack || high.hit.distance < low.height(high.s) - slack
    }

    /// Finds the minimum between two opposite slopes by tangents and adds a contact if it is within
    /// the limit. Returns the samples next to it; `None` if it is beyond the limit.
    fn descend(
        &self,
        line: &Line,
        mut low: Sample,
        mut high: Sample,
        mut on_face: bool,
        found: &mut Collector,
    ) -> Option<[Sample; 2]> {
        // without kinks the search ends where the slope vanishes
        let tolerance = if self.field.is_smooth() { 1e-15 } else { 1e-9 } * self.size;
        let limit = found.limit() + line.radius;
        for n in 0..MAX_SAMPLES {
            let (s, level) = tangent_intersection(&low, &high);
            let least = low.hit.distance.min(high.hit.distance);
            // tangents that intersect above a sample are no bound: not convex here
            let convex = level <= least + tolerance;
            if convex && level > limit {
                return None;
            }
            if (convex && least - level < tolerance) || high.s - low.s < tolerance {
                break;
            }
            let foot = if n % 3 < 2 { self.foot_between(line, &low, &high) } else { None };
            let s = match n % 3 {
                _ if let Some(foot) = foot => foot,
                0 if convex => s.clamp(low.s, high.s),
                1 => low.s - low.slope * (high.s - low.s) / (high.slope - low.slope),
                _ => 0.5 * (low.s + high.s),
            };
            let sample = self.sample(line, s);
            let level = sample.slope.abs() <= LEVEL_SLOPE;
            if sample.is_flat() && !on_face {
                on_face = true;
                self.face(line, &sample, low, high, found);
            } else if level {
                self.bottom(line, sample.s, sample.hit, found);
            }
            if level {
                return Some([sample; 2]);
            }
            if sample.slope < 0.0 {
                low = sample;
            } else {
                high = sample;
            }
        }
        self.kink(line, &low, &high, found);
        Some([low, high])
    }

    /// Returns the foot on the feature that is closest at the lower of two samples, or else at the
    /// other, if it lies between them.
    fn foot_between(&self, line: &Line, low: &Sample, high: &Sample) -> Option<f64> {
        if self.field.is_round() {
            return None;
        }
        let margin = MIN_FOOT_OFFSET * (high.s - low.s);
        let samples = if low.hit.distance < high.hit.distance { [low, high] } else { [high, low] };
        samples
            .iter()
            .filter_map(|sample| Some(sample.hyperbola(line)?.foot))
            .find(|s| *s > low.s + margin && *s < high.s - margin)
    }

    /// Adds the contact of a minimum between two slopes.
    fn kink(&self, line: &Line, low: &Sample, high: &Sample, found: &mut Collector) {
        let (s, level) = tangent_intersection(low, high);
        let (a, b) = (high.slope, -low.slope);
        let sum = low.hit.normal * a + high.hit.normal * b;
        let length = sum.norm();
        if length.is_nan() || length <= 1e-9 * (a + b) {
            return;
        }
        let nearest = if low.hit.distance < high.hit.distance { low } else { high };
        // two faces at depth `level` meet in an edge further up
        let distance = level * (a + b) / length;
        let edge = Hit { distance, normal: sum / length, ..nearest.hit };
        if distance >= 0.0 || self.is_surface(&line.at(s), &edge) {
            self.bottom(line, s, edge, found);
        } else {
            self.bottom(line, nearest.s, nearest.hit, found);
        }
    }

    fn bottom(&self, line: &Line, s: f64, hit: Hit, found: &mut Collector) {
        if line.is_axis && hit.normal.dot(&line.along).abs() > SLOPE_ROUNDING {
            return;
        }
        let fits = facing(line.normals, &hit.normal) && line.is_closest(&hit.normal);
        if self.second.is_some()
            && matches!(hit.feature, Feature::Edge(_))
            && self.is_duplicate(&line.at(s), line.radius, &hit, found)
        {
            return; // that edge has found it
        }
        self.push_if(fits, &line.at(s), line.radius, &hit, line_normal(line, &hit), line.feature(0), found);
    }

    /// Adds contacts at the two ends of a part that lies on a face.
    fn face(&self, line: &Line, sample: &Sample, low: Sample, high: Sample, found: &mut Collector) {
        let from = self.exit_place(line, sample, low);
        let to = self.exit_place(line, sample, high);
        if to - from < 1e-3 * self.size {
            self.push_on_face(line, sample, sample.s, 1, found);
        } else {
            self.push_on_face(line, sample, from, 1, found);
            self.push_on_face(line, sample, to, 2, found);
        }
    }

    /// Adds a contact at the end, towards `outer`, of a part that lies on a face and starts at
    /// `sample`.
    fn end_of_face(&self, line: &Line, sample: &Sample, outer: Sample, found: &mut Collector) {
        if sample.hit.distance.min(sample.height(outer.s)) - line.radius > found.limit() {
            return;
        }
        let (s, tolerance) = (self.exit_place(line, sample, outer), 1e-6 * self.size);
        // an end of the element is tested as a point
        let is_end = |s: f64| s <= tolerance || s >= line.length - tolerance;
        if (s - sample.s).abs() > tolerance || !is_end(s) {
            self.push_on_face(line, sample, s, if outer.s > sample.s { 2 } else { 1 }, found);
        }
    }

    /// Returns where the line leaves the face under `sample`, towards `outer`. In closed form if
    /// the edge that bounds the face is closest at `outer`, else by the intersection of tangents.
    fn exit_place(&self, line: &Line, sample: &Sample, mut outer: Sample) -> f64 {
        let tolerance = 1e-9 * self.size;
        for _ in 0..MAX_END_SAMPLES {
            let turn = outer.slope - sample.slope;
            let rise = outer.hit.distance - sample.height(outer.s);
            if rise < tolerance || turn.abs() <= LEVEL_SLOPE {
                return outer.s;
            }
            // the edge can end before that place: the next sample shows it
            let s = self.exit_in_closed_form(line, sample, &outer, tolerance).unwrap_or(outer.s - rise / turn);
            if (s - sample.s) * (outer.s - sample.s) <= 0.0 || (s - outer.s) * (sample.s - outer.s) <= 0.0 {
                return sample.s;
            }
            outer = self.sample(line, s);
        }
        outer.s
    }

    /// Returns the exit if the closest feature at `outer` bounds that face: its distance is tangent
    /// to the plane of the face.
    fn exit_in_closed_form(&self, line: &Line, sample: &Sample, outer: &Sample, tolerance: f64) -> Option<f64> {
        if self.field.is_round() {
            return None;
        }
        let hyperbola = outer.hyperbola(line)?;
        let s = hyperbola.at_slope(sample.slope)?;
        let between = (s - sample.s) * (outer.s - sample.s) > 0.0 && (s - outer.s) * (sample.s - outer.s) > 0.0;
        (between && (hyperbola.height(s) - sample.height(s)).abs() < tolerance).then_some(s)
    }

    fn push_on_face(&self, line: &Line, sample: &Sample, s: f64, part: u64, found: &mut Collector) {
        // the surface of a cylinder is its radius away across the axis alone
        let nearer = 1.0 - (1.0 - sample.slope * sample.slope).max(0.0).sqrt();
        let hit = Hit { distance: sample.height(s) + line.radius * nearer, ..sample.hit };
        if line.radius > 0.0 && sample.slope.abs() > STEEPEST {
            return;
        }
        // a rod along a face reaches both ends of it, tilted or not
        let slope = if matches!(hit.feature, Feature::Line(_)) { STEEPEST } else { SLOPE_ROUNDING };
        if hit.facing && (hit.feature == Feature::Face || line.is_closest_within(&hit.normal, slope)) {
            let fits = line.may_roll_onto(&hit.normal);
            self.push_if(fits, &line.at(s), line.radius, &hit, line_normal(line, &hit), line.feature(part), found);
        }
    }
}

impl Line<'_> {
    fn at(&self, s: f64) -> Vec3 {
        self.start + self.along * s
    }

    /// Returns whether no direction from the edge into one of its faces leads closer.
    fn is_closest(&self, normal: &Vec3) -> bool {
        self.is_closest_within(normal, SLOPE_ROUNDING)
    }

    /// Returns whether no direction from the edge into one of its faces leads closer at more than a slope.
    fn is_closest_within(&self, normal: &Vec3, slope: f64) -> bool {
        let [n1, n2] = self.normals else { return true };
        let cos = n1.dot(n2);
        // into the first face is −(n₂ − n₁ cos)
        [n2 - n1 * cos, n1 - n2 * cos].iter().all(|out| normal.dot(out) <= slope)
    }

    /// Returns whether a face with this normal is inclined so little to the faces of the edge that the body may roll
    /// onto it. At a larger inclination a neighboring edge of the smooth part meets it first.
    fn may_roll_onto(&self, normal: &Vec3) -> bool {
        let [n1, n2] = self.normals else { return true };
        let (cos, sin) = (n1.dot(n2), n1.cross(n2).norm());
        let most = f64::from(max_slope(RealField::atan2(sin, cos)));
        // into the first face is −(n₂ − n₁ cos)/sin
        [n2 - n1 * cos, n1 - n2 * cos].iter().all(|out| normal.dot(out) <= most * sin + SLOPE_ROUNDING)
    }

    fn feature(&self, part: u64) -> u64 {
        1 << 58 | u64::from(self.index) << 2 | part
    }
}

/// Returns the intersection of the tangents of two samples: place and height.
fn tangent_intersection(low: &Sample, high: &Sample) -> (f64, f64) {
    let fall = high.hit.distance - low.hit.distance + low.slope * low.s - high.slope * high.s;
    let s = fall / (low.slope - high.slope);
    (s, low.hit.distance + low.slope * (s - low.s))
}

/// Returns whether an edge of a smooth surface is deeper than the lower of its ends by less than
/// the stated error, and that end has a contact.
fn ends_suffice(line: &Line, low: &Sample, high: &Sample) -> bool {
    let Some(edge) = line.edge else { return false };
    let end = if low.hit.distance < high.hit.distance { low } else { high };
    let whole = low.s == 0.0 && high.s == line.length;
    let turns = low.slope < 0.0 && high.slope > 0.0;
    let least = if turns { tangent_intersection(low, high).1 } else { end.hit.distance };
    whole && end.hit.feature == Feature::Face && end.hit.facing && end.hit.distance - least < edge.end_tolerance
}

/// Returns the feature that determines the normal of a line's contact.
fn line_normal(line: &Line, hit: &Hit) -> NormalFrom {
    match hit.feature {
        Feature::Face => NormalFrom::FaceOfB,
        Feature::Line(_) | Feature::Edge(_) => NormalFrom::Edges,
        Feature::Point => NormalFrom::LineOfA(line.along),
    }
}
