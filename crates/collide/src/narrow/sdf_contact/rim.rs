//! A cylinder against a field: its axis against other round bodies, and its two rims.
//!
//! ```text
//! w(φ)                    unit direction from the rim's middle m, across the axis        x(φ) = m + r·w(φ)
//! slope  g = n·(u × w)    per meter along the rim; n the field's normal at x, u the axis
//! tangent plane at w₀     d(x₀) + r·n₀·(w − w₀)
//! ```
//!
//! A rim is cut into arcs, and those are halved that may be in reach (`d` changes by at most 1 m per meter), until an arc is short or the
//! body is flat below it. Where `d` falls into an arc from both ends, the lowest place is found as along an edge, by tangents (Kelley 1960): planes,
//! of which the higher one counts. On a circle both the lowest place of a plane and the places where two planes are level have closed forms:
//! with `θ` from the middle of the arc and `t = tan θ/2`, `A cos θ + B sin θ = C` is `(C + A) t² − 2 B t + C − A = 0`.
//!
//! Of a convex body's `d` an arc has one lowest place: the higher one of two planes has no more. Where a look lies below the tangent plane of
//! another, the body has a valley between them, and there may be a second: that part is halved until its slope tells.
//!
//! A rim that hardly tilts over a face rests on four fixed points instead.

use super::super::reduce::Collector;
use super::query::{Query, point_normal};
use super::tolerances::{LEVEL_SLOPE, MAX_PIECE};
use crate::Vec3;
use crate::sdf::{Feature, Hit, OVERHANG, facing};

/// A circle at the end of a cylinder, in the frame of the field.
struct Rim {
    middle: Vec3,
    /// Out of the body.
    up: Vec3,
    /// Directions go around this, the same for both rims.
    axis: Vec3,
    radius: f64,
    side: u64,
}

/// A look at a place on a rim.
#[derive(Clone, Copy)]
struct RimSample {
    direction: Vec3,
    slope: f64,
    hit: Hit,
}

/// Directions that a rim is cut at; every third is a fixed point that carries.
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
/// An arc of 30° is halved at least once, and never more often than this.
const MAX_HALVINGS: u32 = 7;
/// Looks within an arc at most; from the half on, every other one halves it.
const MAX_SAMPLES: usize = 40;
/// Halvings of a part of an arc over a valley, at most.
const MAX_SPLITS: u32 = 6;
/// How far below a tangent plane is no rounding, as a part of the smaller body's radius.
const CONVEXITY_TOLERANCE: f64 = 1e-9;
/// Sine of the tilt below which a rim rests on its fixed points.
const MIN_TILT: f64 = 1e-4;
/// Sine of the tilt above which it rests on one point.
const STEEP_TILT: f64 = 0.2;
/// Sine of the tilt above which the cylinder lies.
const SIDE_TILT: f64 = 0.99;

impl Query<'_> {
    /// The axis, and on each rim fixed points and the lowest ones.
    pub(super) fn cylinder(&self, radius: f64, half_length: f64, found: &mut Collector) {
        let ends = [-half_length, half_length].map(|z| Vec3::z() * z);
        if self.field.is_round() {
            self.edge(&ends, radius, &[], 0, None, found);
        }
        for side in 0..2 {
            let axis = self.rotation.column(2).into_owned();
            let up = if side == 0 { -axis } else { axis };
            let rim = Rim { middle: self.to_field(&ends[side as usize]), up, axis, radius, side };
            if self.field.bound(&rim.middle) - rim.radius <= found.limit() {
                self.rim(&rim, found);
            }
        }
    }

    fn rim(&self, rim: &Rim, found: &mut Collector) {
        let (x, y) = (self.rotation.column(0).into_owned(), self.rotation.column(1).into_owned());
        let directions: [Vec3; RIM_DIRECTIONS] = std::array::from_fn(|n| x * RIM_POINTS[n].0 + y * RIM_POINTS[n].1);
        for n in (0..RIM_DIRECTIONS).step_by(3) {
            let at = rim.at(&directions[n]);
            if self.field.bound(&at) <= found.limit() {
                let hit = self.field.hit(&at, &[directions[n], rim.up], OVERHANG);
                if hit.facing && across(&hit.normal, &rim.up).norm() < STEEP_TILT {
                    self.push(&at, 0.0, &hit, point_normal(&hit), rim.feature(n as u64), found);
                }
            }
        }
        for n in 0..RIM_DIRECTIONS {
            let mut part = (RIM_DIRECTIONS + 64 * n) as u64;
            self.arc(rim, &directions[n], &directions[(n + 1) % RIM_DIRECTIONS], 0, &mut part, found);
        }
    }

    /// A piece of a rim that may be in reach. `part` numbers the contacts that it makes.
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
        let hit = self.field.hit(&at, &[*direction, rim.up], OVERHANG);
        self.record(&hit, 0.0);
        RimSample { direction: *direction, slope: hit.normal.dot(&rim.axis.cross(direction)), hit }
    }

    /// Whether one face is below both.
    fn flat(&self, rim: &Rim, low: &RimSample, high: &RimSample) -> bool {
        let face = |sample: &RimSample| sample.hit.feature == Feature::Face && sample.hit.facing;
        let level = low.height(rim, &high.direction) - high.hit.distance;
        face(low) && face(high) && (low.hit.normal - high.hit.normal).norm() < 1e-9 && level.abs() < 1e-9 * self.size
    }

    /// The lowest place of an arc between two slopes, and of its parts beyond a ridge; `halvings` of those at most.
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

    /// A part of an arc that rises from a lowest place, or falls to one, at both ends: further lowest places where it has a ridge.
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

    /// The lowest place that tangents lead to, a contact if it is in reach; `None` where it cannot be.
    fn descend_arc(
        &self,
        rim: &Rim,
        mut low: RimSample,
        mut high: RimSample,
        part: &mut u64,
        found: &mut Collector,
    ) -> Option<RimSample> {
        let tolerance = 1e-10 * self.size;
        let mut kink = None;
        for n in 0..MAX_SAMPLES {
            let (mut direction, level) = tangent_intersection(rim, &low, &high);
            let least = low.hit.distance.min(high.hit.distance);
            // not convex where the tangents meet above what was seen
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
            // converged to a smooth bottom
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
            let faces = facing(&[at, rim.up], &normal.0);
            (direction, hit) = (at, Hit { distance: level * normal.1, normal: normal.0, facing: faces, ..hit });
        }
        let tilt = across(&hit.normal, &rim.up).norm();
        if !hit.facing || tilt < MIN_TILT {
            return Some(best);
        }
        // one that lies has its axis for a core
        let core = if tilt > SIDE_TILT { rim.radius } else { 0.0 };
        let hit = Hit { distance: hit.distance + core, ..hit };
        self.push(&(rim.at(&direction) + hit.normal * core), core, &hit, point_normal(&hit), rim.feature(*part), found);
        *part += 1;
        Some(best)
    }
}

impl RimSample {
    /// The tangent plane at another place.
    fn height(&self, rim: &Rim, direction: &Vec3) -> f64 {
        self.hit.distance + rim.radius * self.hit.normal.dot(&(direction - self.direction))
    }
}

impl Rim {
    fn at(&self, direction: &Vec3) -> Vec3 {
        self.middle + direction * self.radius
    }

    fn feature(&self, part: u64) -> u64 {
        1 << 57 | self.side << 16 | part
    }
}

/// The lowest place of the higher one of two tangent planes within the arc between them, and its height.
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

/// `(n₁ − n₂)·w` where the two tangent planes are level.
fn turn_offset(rim: &Rim, low: &RimSample, high: &RimSample) -> f64 {
    (high.hit.distance - low.hit.distance) / rim.radius + low.hit.normal.dot(&low.direction)
        - high.hit.normal.dot(&high.direction)
}

/// The normal of the ridge between two faces across the rim, and how much deeper it is than they are.
fn ridge(low: &RimSample, high: &RimSample) -> Option<(Vec3, f64)> {
    let (a, b) = (high.slope, -low.slope);
    let sum = low.hit.normal * a + high.hit.normal * b;
    let length = sum.norm();
    (a > LEVEL_SLOPE && b > LEVEL_SLOPE && length > 1e-9 * (a + b)).then(|| (sum / length, (a + b) / length))
}

/// The part of `v` across a unit direction.
fn across(v: &Vec3, along: &Vec3) -> Vec3 {
    v - along * along.dot(v)
}
