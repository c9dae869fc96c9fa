//! A cylinder against a field: its axis against other round bodies, and its two rims.
//!
//! ```text
//! w(φ)                    unit direction from the rim's middle m, across the axis        x(φ) = m + r·w(φ)
//! slope  g = n·(u × w)    per meter along the rim; n the field's normal at x, u the axis
//! tangent plane at w₀     d(x₀) + r·n₀·(w − w₀)
//! ```
//!
//! A rim is divided into arcs. Arcs within the margin are halved (`d` changes by at most 1 m per
//! meter) until an arc is short or the body below it is flat. If `d` falls into an arc from both
//! ends, its minimum is found by tangents as along an edge (Kelley 1960); the higher of two tangent
//! planes applies. On a circle the minimum of a plane and the intersections of two planes have
//! closed forms. With `θ` from the middle of the arc and `t = tan θ/2`, `A cos θ + B sin θ = C`
//! becomes `(C + A) t² − 2 B t + C − A = 0`.
//!
//! For a convex body `d` has one minimum on an arc, as the higher of two planes has. If a sample
//! lies below the tangent plane of another, the body has a valley between them and perhaps a second
//! minimum. That part is halved until the slope decides.
//!
//! A rim that is nearly parallel to a face rests on four fixed points instead.

use super::super::reduce::Collector;
use super::query::{Query, point_normal};
use super::tolerances::{LEVEL_SLOPE, MAX_PIECE};
use crate::Vec3;
use crate::sdf::{Feature, Hit, OVERHANG, facing};

/// A circle at the end of a cylinder, in the frame of the field.
pub(super) struct Rim {
    pub middle: Vec3,
    /// Away from the body.
    pub up: Vec3,
    /// Axis of rotation of the directions, the same for both rims.
    pub axis: Vec3,
    pub radius: f64,
    pub side: u64,
    /// Components of the normal of the side across the axis and against `up`: 1 and 0 for a cylinder.
    pub slope: (f64, f64),
}

/// The distance and slope at a place on a rim.
#[derive(Clone, Copy)]
struct RimSample {
    direction: Vec3,
    slope: f64,
    hit: Hit,
}

/// Number of directions at which a rim is divided; every third is a fixed support point.
const RIM_DIRECTIONS: usize = 12;
/// Cosine and sine of multiples of 30°.
const RIM_POINTS: [(f64, f64); RIM_DIRECTIONS] = [
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
/// Maximum number of halvings of an arc of 30°; it is halved at least once.
const MAX_HALVINGS: u32 = 7;
/// Maximum number of samples within an arc; in the second half every other one is a bisection.
const MAX_SAMPLES: usize = 40;
/// Maximum number of halvings of a part of an arc over a valley.
const MAX_SPLITS: u32 = 6;
/// Distance below a tangent plane that exceeds rounding, as a fraction of the smaller body's
/// radius.
const CONVEXITY_TOLERANCE: f64 = 1e-9;
/// Sine of the tilt below which a rim rests on its fixed points.
const MIN_TILT: f64 = 1e-4;
/// Sine of the tilt above which it rests on one point.
const STEEP_TILT: f64 = 0.2;
/// Sine of the tilt above which the cylinder lies on its side.
const SIDE_TILT: f64 = 0.99;

impl Query<'_> {
    /// Queries the axis, and on each rim the fixed points and the lowest ones.
    pub(super) fn cylinder(&self, radius: f64, half_length: f64, found: &mut Collector) {
        let ends = [-half_length, half_length].map(|z| Vec3::z() * z);
        if self.field.is_round() {
            self.edge(&ends, radius, &[], 0, None, found);
        }
        for side in 0..2 {
            let axis = self.rotation.column(2).into_owned();
            let up = if side == 0 { -axis } else { axis };
            let rim = Rim { middle: self.to_field(&ends[side as usize]), up, axis, radius, side, slope: (1.0, 0.0) };
            if self.field.bound(&rim.middle) - rim.radius <= found.limit() {
                self.rim(&rim, found);
            }
        }
    }

    pub(super) fn rim(&self, rim: &Rim, found: &mut Collector) {
        let (x, y) = (self.rotation.column(0).into_owned(), self.rotation.column(1).into_owned());
        let directions: [Vec3; RIM_DIRECTIONS] = std::array::from_fn(|n| x * RIM_POINTS[n].0 + y * RIM_POINTS[n].1);
        for n in (0..RIM_DIRECTIONS).step_by(3) {
            let at = rim.at(&directions[n]);
            if self.field.bound(&at) <= found.limit() {
                let hit = self.field.hit(&at, &rim.normals(&directions[n]), OVERHANG);
                let below = rim.slope.1 == 0.0 || hit.normal.dot(&rim.up) < 0.0;
                if hit.facing && below && across(&hit.normal, &rim.up).norm() < STEEP_TILT {
                    self.push(&at, 0.0, &hit, point_normal(&hit), rim.feature(n as u64), found);
                }
            }
        }
        for n in 0..RIM_DIRECTIONS {
            let mut part = (RIM_DIRECTIONS + 64 * n) as u64;
            self.arc(rim, &directions[n], &directions[(n + 1) % RIM_DIRECTIONS], 0, &mut part, found);
        }
    }

    /// Queries an arc of a rim that can be within the limit. `part` numbers its contacts.
    fn arc(&self, rim: &Rim, from: &Vec3, to: &Vec3, halved: u32, part: &mut u64, found: &mut Collector) {
        let middle = (from + to).normalize();
        let reach = (middle - from).norm() * rim.radius;
        if self.field.bound(&rim.at(&middle)) - reach > found.limit() {
            return;
        }
        let short = halved >= MAX_HALVINGS || reach <= 0.5 * MAX_PIECE * self.size;
        if halved > 0 {
            let (low, high) = (self.sample_rim(rim, from), self.sample_rim(rim, to));
            if short || self.field.is_convex() || self.flat(rim, &low, &high) {
                return match (low.slope < 0.0, high.slope < 0.0) {
                    (true, false) => self.search_arc(rim, low, high, MAX_SPLITS, part, found),
                    (falls, too) if falls == too && !self.field.is_convex() => {
                        self.search_nonconvex_arc(rim, [low, high], !falls, MAX_SPLITS, part, found)
                    }
                    _ => {}
                };
            }
        }
        self.arc(rim, from, &middle, halved + 1, part, found);
        self.arc(rim, &middle, to, halved + 1, part, found);
    }

    fn sample_rim(&self, rim: &Rim, direction: &Vec3) -> RimSample {
        let at = rim.at(direction);
        let hit = self.field.hit(&at, &rim.normals(direction), OVERHANG);
        self.record(&hit, 0.0);
        RimSample { direction: *direction, slope: hit.normal.dot(&rim.axis.cross(direction)), hit }
    }

    /// Returns whether the same face is below both.
    fn flat(&self, rim: &Rim, low: &RimSample, high: &RimSample) -> bool {
        let face = |sample: &RimSample| sample.hit.feature == Feature::Face && sample.hit.facing;
        let level = low.height(rim, &high.direction) - high.hit.distance;
        face(low) && face(high) && (low.hit.normal - high.hit.normal).norm() < 1e-9 && level.abs() < 1e-9 * self.size
    }

    /// Searches the minimum of an arc between two opposite slopes, and in its parts beyond a ridge,
    /// with at most `halvings` halvings.
    fn search_arc(
        &self,
        rim: &Rim,
        low: RimSample,
        high: RimSample,
        halvings: u32,
        part: &mut u64,
        found: &mut Collector,
    ) {
        let Some(bottom) = self.descend_arc(rim, low, high, part, found) else { return };
        if !self.field.is_convex() {
            self.search_nonconvex_arc(rim, [low, bottom], false, halvings, part, found);
            self.search_nonconvex_arc(rim, [bottom, high], true, halvings, part, found);
        }
    }

    /// Searches a part of an arc that rises from a minimum, or falls to one, at both ends. It has
    /// further minima if it contains a ridge.
    fn search_nonconvex_arc(
        &self,
        rim: &Rim,
        [low, high]: [RimSample; 2],
        rises: bool,
        halvings: u32,
        part: &mut u64,
        found: &mut Collector,
    ) {
        let slack = CONVEXITY_TOLERANCE * self.size;
        let dips = low.hit.distance < high.height(rim, &low.direction) - slack
            || high.hit.distance < low.height(rim, &high.direction) - slack;
        if halvings == 0 || !dips {
            return;
        }
        let middle = self.sample_rim(rim, &(low.direction + high.direction).normalize());
        match rises {
            true if middle.slope < -LEVEL_SLOPE => self.search_arc(rim, middle, high, halvings - 1, part, found),
            false if middle.slope > LEVEL_SLOPE => self.search_arc(rim, low, middle, halvings - 1, part, found),
            _ => {
                self.search_nonconvex_arc(rim, [low, middle], rises, halvings - 1, part, found);
                self.search_nonconvex_arc(rim, [middle, high], rises, halvings - 1, part, found);
            }
        }
    }

    /// Finds the minimum by tangents and adds a contact if it is within the limit; `None` if it is
    /// beyond.
    fn descend_arc(
        &self,
        rim: &Rim,
        mut low: RimSample,
        mut high: RimSample,
        part: &mut u64,
        found: &mut Collector,
    ) -> Option<RimSample> {
        let tolerance = if self.field.is_smooth() { 1e-15 } else { 1e-10 } * self.size;
        let mut kink = None;
        for n in 0..MAX_SAMPLES {
            let (mut direction, level) = tangent_intersection(rim, &low, &high);
            let least = low.hit.distance.min(high.hit.distance);
            // not convex if the tangents intersect above a sample
            let convex = level <= least + tolerance;
            if convex && level > found.limit() {
                return None;
            }
            if (high.direction - low.direction).norm() * rim.radius < tolerance || (convex && least - level < tolerance)
            {
                kink = Some((direction, level)).filter(|_| convex);
                break;
            }
            if !convex || (n > MAX_SAMPLES / 2 && n % 2 == 0) {
                direction = (low.direction + high.direction).normalize();
            }
            let sample = self.sample_rim(rim, &direction);
            let before = least;
            if sample.slope < -LEVEL_SLOPE {
                low = sample;
            } else if sample.slope > LEVEL_SLOPE {
                high = sample;
            } else {
                (low, high) = (sample, sample);
                break;
            }
            // converged to a smooth minimum
            if (before - sample.hit.distance).abs() < 1e-13 * self.size && sample.slope.abs() < 1e-5 {
                break;
            }
        }
        let best = if low.hit.distance <= high.hit.distance { low } else { high };
        let (mut direction, mut hit) = (best.direction, best.hit);
        if let Some((at, level)) = kink.filter(|_| hit.distance < 0.0)
            && let Some(normal) = ridge(&low, &high)
        {
            // two faces at depth `level` meet in an edge further up
            let faces = facing(&rim.normals(&at), &normal.0);
            let edge = Hit { distance: level * normal.1, normal: normal.0, facing: faces, ..hit };
            if self.is_surface(&rim.at(&at), &edge) {
                (direction, hit) = (at, edge);
            }
        }
        let tilt = across(&hit.normal, &rim.up).norm();
        if !hit.facing || tilt < MIN_TILT {
            return Some(best);
        }
        // the core of a cylinder on its side, or of a cone, is its axis
        let core = if rim.lies_on_side(&hit.normal, &direction, tilt) { rim.radius / rim.slope.0 } else { 0.0 };
        let hit = Hit { distance: hit.distance + core, ..hit };
        self.push(&(rim.at(&direction) + hit.normal * core), core, &hit, point_normal(&hit), rim.feature(*part), found);
        *part += 1;
        Some(best)
    }
}

impl RimSample {
    /// Returns the tangent plane at another place.
    fn height(&self, rim: &Rim, direction: &Vec3) -> f64 {
        self.hit.distance + rim.radius * self.hit.normal.dot(&(direction - self.direction))
    }
}

impl Rim {
    fn at(&self, direction: &Vec3) -> Vec3 {
        self.middle + direction * self.radius
    }

    /// Returns the normals of the two surfaces that meet in the rim.
    fn normals(&self, direction: &Vec3) -> [Vec3; 2] {
        let (across, along) = self.slope;
        match along == 0.0 {
            true => [*direction, self.up],
            false => [direction * across - self.up * along, self.up],
        }
    }

    /// Returns whether the side lies on a surface with this normal, across the axis by `tilt`.
    fn lies_on_side(&self, normal: &Vec3, direction: &Vec3, tilt: f64) -> bool {
        match self.slope.1 == 0.0 {
            true => tilt > SIDE_TILT,
            false => -normal.dot(&self.normals(direction)[0]) > SIDE_TILT,
        }
    }

    fn feature(&self, part: u64) -> u64 {
        1 << 57 | self.side << 16 | part
    }
}

/// Returns the minimum of the higher of two tangent planes within the arc between them, and its
/// height.
fn tangent_intersection(rim: &Rim, low: &RimSample, high: &RimSample) -> (Vec3, f64) {
    let inside = |direction: &Vec3| {
        low.direction.cross(direction).dot(&rim.axis) >= 0.0 && direction.cross(&high.direction).dot(&rim.axis) >= 0.0
    };
    for (one, other) in [(low, high), (high, low)] {
        let bottom = across(&-one.hit.normal, &rim.up).try_normalize(1e-12).filter(inside);
        if let Some(direction) = bottom
            && one.height(rim, &direction) >= other.height(rim, &direction)
        {
            return (direction, one.height(rim, &direction));
        }
    }
    let middle = (low.direction + high.direction).normalize();
    let aside = rim.axis.cross(&middle);
    let turn = low.hit.normal - high.hit.normal;
    let (a, b) = (turn.dot(&middle), turn.dot(&aside));
    let c = turn_offset(rim, low, high);
    let root = b + (a * a + b * b - c * c).max(0.0).sqrt().copysign(b);
    let t = if root != 0.0 { (c - a) / root } else { 0.0 };
    let direction = (middle * (1.0 - t * t) + aside * (2.0 * t)) / (1.0 + t * t);
    let direction = if inside(&direction) { direction } else { middle };
    (direction, low.height(rim, &direction).max(high.height(rim, &direction)))
}

/// Returns `(n₁ − n₂)·w` where the two tangent planes intersect.
fn turn_offset(rim: &Rim, low: &RimSample, high: &RimSample) -> f64 {
    (high.hit.distance - low.hit.distance) / rim.radius + low.hit.normal.dot(&low.direction)
        - high.hit.normal.dot(&high.direction)
}

/// Returns the normal of the ridge between two faces across the rim, and the ratio of its depth to
/// theirs.
fn ridge(low: &RimSample, high: &RimSample) -> Option<(Vec3, f64)> {
    let (a, b) = (high.slope, -low.slope);
    let sum = low.hit.normal * a + high.hit.normal * b;
    let length = sum.norm();
    (a > LEVEL_SLOPE && b > LEVEL_SLOPE && length > 1e-9 * (a + b)).then(|| (sum / length, (a + b) / length))
}

/// Returns the component of `v` perpendicular to a unit direction.
fn across(v: &Vec3, along: &Vec3) -> Vec3 {
    v - along * along.dot(v)
}
