//! A cone against a field: its tip, its rim, and the straight lines of its side against other curved
//! surfaces. Points, edges and axes of the other body are tested against the cone's own field.
//!
//! ```text
//! side      n(φ) = c·w(φ) + s·z,   w a unit direction across the axis; one tangent plane per line of the side
//! cylinder, cone    n·u = −s_B on both, u the other's axis: two φ, in closed form
//! ellipsoid         min of D(n(φ)) over φ, by golden sections beside the lowest of 24 samples
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `c`, `s` | components of the side's normal across and along the axis (`s_B` of the other; 0 for a cylinder) |
//! | `D` | minus the gap along a normal (`min_translation`) |

use super::super::reduce::Collector;
use super::BodyElements;
use super::query::{Query, point_normal};
use super::rim::Rim;
use super::tolerances::SLOPE_ROUNDING;
use crate::sdf::{Feature, Hit, OVERHANG};
use crate::shape::cone::{Cone, ConePart};
use crate::{NormalFrom, Vec3};
use nalgebra::ComplexField;
use std::f64::consts::TAU;

/// Number of normals of the side at which the gap to an ellipsoid is sampled.
const SAMPLES: usize = 24;
/// Steps of the golden section: they leave 1e-9 rad.
const MAX_STEPS: usize = 44;
/// The golden section.
const GOLDEN_SECTION: f64 = 0.618_033_988_749_894_9;
/// Largest difference between the gap along a normal and the distance of the point, in radii of the
/// smaller body.
const ABOVE: f64 = 1e-6;

impl Query<'_> {
    pub(super) fn query_cone(&self, cone: &Cone, found: &mut Collector) {
        let reach = cone.side_length();
        if self.field.bound(&self.pose.translation.vector) - reach > found.limit() {
            return;
        }
        self.record_center();
        self.tip(cone, found);
        let (axis, base) = (self.rotation.column(2).into_owned(), Vec3::z() * cone.base());
        let rim = Rim {
            middle: self.to_field(&base),
            up: -axis,
            axis,
            radius: cone.radius,
            side: 0,
            slope: cone.side_normal(),
        };
        if self.field.bound(&rim.middle) - rim.radius <= found.limit() {
            self.rim(&rim, found);
        }
        self.side(cone, found);
    }

    /// Queries the tip; it counts if no line of the side leads closer.
    fn tip(&self, cone: &Cone, found: &mut Collector) {
        let at = self.to_field(&(Vec3::z() * cone.tip()));
        if self.field.bound(&at) > found.limit() {
            return;
        }
        let (across, along) = cone.side_normal();
        let mut normals = [Vec3::z(); 7];
        for (n, normal) in normals.iter_mut().enumerate().skip(1) {
            let (sin, cos) = ComplexField::sin_cos(TAU * n as f64 / 6.0);
            *normal = Vec3::new(cos, sin, 0.0) * across + Vec3::z() * along;
        }
        let hit = self.field.hit(&at, &normals.map(|n| self.rotation * n), OVERHANG);
        self.record(&hit, 0.0);
        let down = self.rotation.tr_mul(&hit.normal);
        // the steepest line of the side
        let fall = along * down.xy().norm() + across * down.z;
        let closest = hit.feature == Feature::Face || fall <= SLOPE_ROUNDING;
        self.push_if(hit.facing && closest, &at, 0.0, &hit, point_normal(&hit), 1 << 58, found);
    }

    /// Queries the side against the curved side of another body.
    fn side(&self, cone: &Cone, found: &mut Collector) {
        match *self.other {
            BodyElements::Cylinder { radius, half_length } => {
                let line = |w: Vec3| [-half_length, half_length].map(|z| w * radius + Vec3::z() * z);
                self.side_on_lines(cone, (1.0, 0.0), line, found);
            }
            // once per pair
            BodyElements::Cone(other) if self.second.is_none() => {
                let line = |w: Vec3| [Vec3::z() * other.tip(), w * other.radius + Vec3::z() * other.base()];
                self.side_on_lines(cone, other.side_normal(), line, found);
            }
            BodyElements::Ellipsoid(_) => self.side_on_ellipsoid(cone, found),
            _ => {}
        }
    }

    /// Queries the two tangent planes that the side shares with another straight side, whose normals have
    /// the components `slope` across and along its axis z, and whose lines are `line`.
    fn side_on_lines(&self, cone: &Cone, slope: (f64, f64), line: impl Fn(Vec3) -> [Vec3; 2], found: &mut Collector) {
        // the other's axis in this cone's frame
        let u = self.rotation.tr_mul(&Vec3::z());
        let (across, along) = cone.side_normal();
        let tilt = u.xy().norm();
        let cosine = (-slope.1 - along * u.z) / (across * tilt);
        if tilt < 1e-9 || cosine.abs() > 1.0 {
            return;
        }
        let (x, y) = (Vec3::new(u.x, u.y, 0.0) / tilt, Vec3::new(-u.y, u.x, 0.0) / tilt);
        let sine = (1.0 - cosine * cosine).sqrt();
        for (part, w) in [x * cosine + y * sine, x * cosine - y * sine].into_iter().enumerate() {
            // out of this cone, in the frame of the field
            let n = self.rotation * (w * across + Vec3::z() * along);
            let own = [Vec3::z() * cone.tip(), w * cone.radius + Vec3::z() * cone.base()].map(|p| self.to_field(&p));
            let Some(outward) = Vec3::new(-n.x, -n.y, 0.0).try_normalize(1e-9) else { continue };
            let other = line(outward);
            let Some([a, b]) = crossing(&own, &other, &n) else { continue };
            let gap = n.dot(&(b - a));
            if gap <= found.limit() && (self.field.hit(&a, &[n], 0.0).nearest - gap).abs() < ABOVE * self.size {
                let hit =
                    Hit { distance: gap, nearest: gap, normal: -n, core: 0.0, feature: Feature::Point, facing: true };
                self.record(&hit, 0.0);
                self.push(&a, 0.0, &hit, NormalFrom::Edges, (1 << 58) | (1 + part as u64), found);
            }
        }
    }

    /// Queries the tangent planes of the side that come closest to an ellipsoid.
    fn side_on_ellipsoid(&self, cone: &Cone, found: &mut Collector) {
        let (across, along) = cone.side_normal();
        let own = |angle: f64| {
            let (sin, cos) = ComplexField::sin_cos(angle);
            Vec3::new(cos, sin, 0.0)
        };
        let normal = |w: &Vec3| self.rotation * (w * across + Vec3::z() * along);
        // the gap along the normal of a line of the side
        let gap = |angle: f64| {
            let n = normal(&own(angle));
            -self.other.support(&-n) - n.dot(&self.to_field(&(Vec3::z() * cone.tip())))
        };
        let step = TAU / SAMPLES as f64;
        let samples: [f64; SAMPLES] = std::array::from_fn(|k| gap(step * k as f64));
        let best = (1..SAMPLES).fold(0, |best, k| if samples[k] > samples[best] { k } else { best }) as f64;
        let angle = greatest(gap, step * (best - 1.0), step * (best + 1.0));
        let (w, height) = (own(angle), gap(angle));
        let n = normal(&w);
        let on_b = self.other.support_point(&-n);
        // of separated bodies that is the closest pair, if it is on the side; an overlapping point has to
        // be nearest to this side
        let (part, nearest, _) = cone.closest(&self.pose.inverse_transform_point(&on_b.into()).coords);
        if height > found.limit() || part != ConePart::Side || (nearest - height).abs() > ABOVE * self.size {
            return;
        }
        let line = self.rotation * (w * along - Vec3::z() * across);
        let at = on_b - n * height;
        let core = (at - self.to_field(&(Vec3::z() * cone.tip()))).dot(&line) * cone.radius / cone.height;
        let of_b = self.field.hit(&on_b, &[], 0.0).core;
        let hit =
            Hit { distance: height, nearest: height, normal: -n, core: of_b, feature: Feature::Point, facing: true };
        self.record(&hit, 0.0);
        let behind = Hit { distance: height + core, ..hit };
        self.push(&(at - n * core), core, &behind, NormalFrom::LineOfA(line), 1 << 58 | 1, found);
    }
}

/// Returns the place in an interval where a function with one maximum there is greatest.
fn greatest(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let mut inner = [high - GOLDEN_SECTION * (high - low), low + GOLDEN_SECTION * (high - low)];
    let mut values = inner.map(&f);
    for _ in 0..MAX_STEPS {
        if values[0] > values[1] {
            (high, inner[1], values[1]) = (inner[1], inner[0], values[0]);
            inner[0] = high - GOLDEN_SECTION * (high - low);
            values[0] = f(inner[0]);
        } else {
            (low, inner[0], values[0]) = (inner[0], inner[1], values[1]);
            inner[1] = low + GOLDEN_SECTION * (high - low);
            values[1] = f(inner[1]);
        }
    }
    0.5 * (low + high)
}

/// Returns the points of two segments that coincide when seen along `n`; `None` if they do not cross.
fn crossing(a: &[Vec3; 2], b: &[Vec3; 2], n: &Vec3) -> Option<[Vec3; 2]> {
    let (along_a, along_b, offset) = (a[1] - a[0], b[1] - b[0], b[0] - a[0]);
    let area = along_a.cross(&along_b).dot(n);
    if area.abs() < 1e-9 * along_a.norm() * along_b.norm() {
        return None;
    }
    let s = offset.cross(&along_b).dot(n) / area;
    let t = offset.cross(&along_a).dot(n) / area;
    let inside = |s: f64| (0.0..=1.0).contains(&s);
    (inside(s) && inside(t)).then(|| [a[0] + along_a * s, b[0] + along_b * t])
}
