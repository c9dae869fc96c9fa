//! A cylinder against a field: its axis against other round bodies, and its two rims.
//!
//! ```text
//! w(φ)                    unit direction from the rim's middle m, across the axis        x(φ) = m + r·w(φ)
//! slope  g = n·(u × w)    per metre along the rim; n the field's normal at x, u the axis
//! tangent plane at w₀     d(x₀) + r·n₀·(w − w₀)
//! ```
//!
//! A rim is cut into arcs, and those are halved that may be in reach (`d` changes by at most 1 m per metre), until an arc is short or the
//! body is flat below it. Where `d` falls into an arc from both ends, the lowest place is found as along an edge, by tangents (Kelley 1960): planes,
//! of which the higher one counts. On a circle both the lowest place of a plane and the places where two planes are level have closed forms:
//! with `θ` from the middle of the arc and `t = tan θ/2`, `A cos θ + B sin θ = C` is `(C + A) t² − 2 B t + C − A = 0`.
//!
//! Of a convex body's `d` an arc has one lowest place: the higher one of two planes has no more. Where a look lies below the tangent plane of
//! another, the body has a valley between them, and there may be a second: that part is halved until its slope tells.
//!
//! A rim that hardly tilts over a face rests on four fixed points instead.

use super::super::reduce::Collector;
use super::line::{LEVEL, PIECE};
use super::pass::{Pass, point_normal};
use crate::Vec3;
use crate::surface::{Feature, Hit, OVERHANG, facing};

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
struct Look {
    way: Vec3,
    slope: f64,
    hit: Hit,
}

/// Directions that a rim is cut at; every third is a fixed point that carries.
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
/// An arc of 30° is halved at least once, and never more often than this.
const MOST_HALVED: u32 = 7;
/// Looks within an arc at most; from the half on, every other one halves it.
const LOOKS: usize = 40;
/// Halvings of a part of an arc over a valley, at most.
const MOST_PARTED: u32 = 6;
/// How far below a tangent plane is no rounding, as a part of the smaller body's radius.
const VALLEY: f64 = 1e-9;
/// Sine of the tilt below which a rim rests on its fixed points.
const TILTED: f64 = 1e-4;
/// Sine of the tilt above which it rests on one point.
const STEEP: f64 = 0.2;
/// Sine of the tilt above which the cylinder lies.
const LYING: f64 = 0.99;

impl Pass<'_> {
    /// The axis, and on each rim fixed points and the lowest ones.
    pub(super) fn cylinder(&self, radius: f64, half_length: f64, found: &mut Collector) {
        let ends = [-half_length, half_length].map(|z| Vec3::z() * z);
        if self.field.round() {
            self.edge(&ends, radius, &[], 0, None, found);
        }
        for side in 0..2 {
            let axis = self.rotation.column(2).into_owned();
            let up = if side == 0 { -axis } else { axis };
            let rim = Rim { middle: self.place(&ends[side as usize]), up, axis, radius, side };
            if self.field.bound(&rim.middle) - rim.radius <= found.limit() {
                self.rim(&rim, found);
            }
        }
    }

    fn rim(&self, rim: &Rim, found: &mut Collector) {
        let (x, y) = (self.rotation.column(0).into_owned(), self.rotation.column(1).into_owned());
        let ways: [Vec3; RIM] = std::array::from_fn(|n| x * RIM_POINTS[n].0 + y * RIM_POINTS[n].1);
        for n in (0..RIM).step_by(3) {
            let at = rim.at(&ways[n]);
            if self.field.bound(&at) <= found.limit() {
                let hit = self.field.hit(&at, &[ways[n], rim.up], OVERHANG);
                if hit.facing && across(&hit.normal, &rim.up).norm() < STEEP {
                    self.push(&at, 0.0, &hit, point_normal(&hit), rim.feature(n as u64), found);
                }
            }
        }
        for n in 0..RIM {
            let mut part = (RIM + 64 * n) as u64;
            self.arc(rim, &ways[n], &ways[(n + 1) % RIM], 0, &mut part, found);
        }
    }

    /// A piece of a rim that may be in reach. `part` numbers the contacts that it makes.
    fn arc(&self, rim: &Rim, from: &Vec3, to: &Vec3, halved: u32, part: &mut u64, found: &mut Collector) {
        let middle = (from + to).normalize();
        let reach = (middle - from).norm() * rim.radius;
        if self.field.bound(&rim.at(&middle)) - reach > found.limit() {
            return;
        }
        let short = halved >= MOST_HALVED || reach <= 0.5 * PIECE * self.size;
        if halved > 0 {
            let (low, high) = (self.look_on(rim, from), self.look_on(rim, to));
            if short || self.field.convex() || self.flat(rim, &low, &high) {
                return match (low.slope < 0.0, high.slope < 0.0) {
                    (true, false) => self.lowest(rim, low, high, MOST_PARTED, part, found),
                    (falls, too) if falls == too && !self.field.convex() => {
                        self.rim_valley(rim, [low, high], !falls, MOST_PARTED, part, found)
                    }
                    _ => {}
                };
            }
        }
        self.arc(rim, from, &middle, halved + 1, part, found);
        self.arc(rim, &middle, to, halved + 1, part, found);
    }

    fn look_on(&self, rim: &Rim, way: &Vec3) -> Look {
        let at = rim.at(way);
        let hit = self.field.hit(&at, &[*way, rim.up], OVERHANG);
        self.note(&hit, 0.0);
        Look { way: *way, slope: hit.normal.dot(&rim.axis.cross(way)), hit }
    }

    /// Whether one face is below both.
    fn flat(&self, rim: &Rim, low: &Look, high: &Look) -> bool {
        let face = |look: &Look| look.hit.feature == Feature::Face && look.hit.facing;
        let level = low.height(rim, &high.way) - high.hit.distance;
        face(low) && face(high) && (low.hit.normal - high.hit.normal).norm() < 1e-9 && level.abs() < 1e-9 * self.size
    }

    /// The lowest place of an arc between two slopes, and of its parts beyond a ridge; `halvings` of those at most.
    fn lowest(&self, rim: &Rim, low: Look, high: Look, halvings: u32, part: &mut u64, found: &mut Collector) {
        let Some(bottom) = self.rim_descend(rim, low, high, part, found) else { return };
        if !self.field.convex() {
            self.rim_valley(rim, [low, bottom], false, halvings, part, found);
            self.rim_valley(rim, [bottom, high], true, halvings, part, found);
        }
    }

    /// A part of an arc that rises from a lowest place, or falls to one, at both ends: further lowest places where it has a ridge.
    fn rim_valley(
        &self,
        rim: &Rim,
        [low, high]: [Look; 2],
        rises: bool,
        halvings: u32,
        part: &mut u64,
        found: &mut Collector,
    ) {
        let slack = VALLEY * self.size;
        let dips = low.hit.distance < high.height(rim, &low.way) - slack
            || high.hit.distance < low.height(rim, &high.way) - slack;
        if halvings == 0 || !dips {
            return;
        }
        let middle = self.look_on(rim, &(low.way + high.way).normalize());
        match rises {
            true if middle.slope < -LEVEL => self.lowest(rim, middle, high, halvings - 1, part, found),
            false if middle.slope > LEVEL => self.lowest(rim, low, middle, halvings - 1, part, found),
            _ => {
                self.rim_valley(rim, [low, middle], rises, halvings - 1, part, found);
                self.rim_valley(rim, [middle, high], rises, halvings - 1, part, found);
            }
        }
    }

    /// The lowest place that tangents lead to, a contact if it is in reach; `None` where it cannot be.
    fn rim_descend(
        &self,
        rim: &Rim,
        mut low: Look,
        mut high: Look,
        part: &mut u64,
        found: &mut Collector,
    ) -> Option<Look> {
        let tolerance = 1e-10 * self.size;
        let mut kink = None;
        for n in 0..LOOKS {
            let (mut way, level) = meeting(rim, &low, &high);
            let least = low.hit.distance.min(high.hit.distance);
            // not convex where the tangents meet above what was seen
            let convex = level <= least + tolerance;
            if convex && level > found.limit() {
                return None;
            }
            if (high.way - low.way).norm() * rim.radius < tolerance || (convex && least - level < tolerance) {
                kink = Some((way, level)).filter(|_| convex);
                break;
            }
            if !convex || (n > LOOKS / 2 && n % 2 == 0) {
                way = (low.way + high.way).normalize();
            }
            let look = self.look_on(rim, &way);
            let before = least;
            if look.slope < -LEVEL {
                low = look;
            } else if look.slope > LEVEL {
                high = look;
            } else {
                (low, high) = (look, look);
                break;
            }
            // converged to a smooth bottom
            if (before - look.hit.distance).abs() < 1e-13 * self.size && look.slope.abs() < 1e-5 {
                break;
            }
        }
        let best = if low.hit.distance <= high.hit.distance { low } else { high };
        let (mut way, mut hit) = (best.way, best.hit);
        if let Some((at, level)) = kink.filter(|_| hit.distance < 0.0)
            && let Some(normal) = ridge(&low, &high)
        {
            // two faces at depth `level` meet in an edge further up
            let faces = facing(&[at, rim.up], &normal.0);
            (way, hit) = (at, Hit { distance: level * normal.1, normal: normal.0, facing: faces, ..hit });
        }
        let tilt = across(&hit.normal, &rim.up).norm();
        if !hit.facing || tilt < TILTED {
            return Some(best);
        }
        // one that lies has its axis for a core
        let core = if tilt > LYING { rim.radius } else { 0.0 };
        let hit = Hit { distance: hit.distance + core, ..hit };
        self.push(&(rim.at(&way) + hit.normal * core), core, &hit, point_normal(&hit), rim.feature(*part), found);
        *part += 1;
        Some(best)
    }
}

impl Look {
    /// The tangent plane at another place.
    fn height(&self, rim: &Rim, way: &Vec3) -> f64 {
        self.hit.distance + rim.radius * self.hit.normal.dot(&(way - self.way))
    }
}

impl Rim {
    fn at(&self, way: &Vec3) -> Vec3 {
        self.middle + way * self.radius
    }

    fn feature(&self, part: u64) -> u64 {
        1 << 57 | self.side << 16 | part
    }
}

/// The lowest place of the higher one of two tangent planes within the arc between them, and its height.
fn meeting(rim: &Rim, low: &Look, high: &Look) -> (Vec3, f64) {
    let inside = |way: &Vec3| low.way.cross(way).dot(&rim.axis) >= 0.0 && way.cross(&high.way).dot(&rim.axis) >= 0.0;
    for (one, other) in [(low, high), (high, low)] {
        let bottom = across(&-one.hit.normal, &rim.up).try_normalize(1e-12).filter(inside);
        if let Some(way) = bottom
            && one.height(rim, &way) >= other.height(rim, &way)
        {
            return (way, one.height(rim, &way));
        }
    }
    let middle = (low.way + high.way).normalize();
    let aside = rim.axis.cross(&middle);
    let turn = low.hit.normal - high.hit.normal;
    let (a, b) = (turn.dot(&middle), turn.dot(&aside));
    let c = turn_offset(rim, low, high);
    let root = b + (a * a + b * b - c * c).max(0.0).sqrt().copysign(b);
    let t = if root != 0.0 { (c - a) / root } else { 0.0 };
    let way = (middle * (1.0 - t * t) + aside * (2.0 * t)) / (1.0 + t * t);
    let way = if inside(&way) { way } else { middle };
    (way, low.height(rim, &way).max(high.height(rim, &way)))
}

/// `(n₁ − n₂)·w` where the two tangent planes are level.
fn turn_offset(rim: &Rim, low: &Look, high: &Look) -> f64 {
    (high.hit.distance - low.hit.distance) / rim.radius + low.hit.normal.dot(&low.way) - high.hit.normal.dot(&high.way)
}

/// The normal of the ridge between two faces across the rim, and how much deeper it is than they are.
fn ridge(low: &Look, high: &Look) -> Option<(Vec3, f64)> {
    let (a, b) = (high.slope, -low.slope);
    let sum = low.hit.normal * a + high.hit.normal * b;
    let length = sum.norm();
    (a > LEVEL && b > LEVEL && length > 1e-9 * (a + b)).then(|| (sum / length, (a + b) / length))
}

/// The part of `v` across a unit direction.
fn across(v: &Vec3, along: &Vec3) -> Vec3 {
    v - along * along.dot(v)
}
