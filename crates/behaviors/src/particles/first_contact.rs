//! The first contact of a path with an obstacle.
//!
//! ```text
//! gap(t) = distance(shape at X(t), x(t)) − r
//!
//! ball     gap(t + τ) ≥ gap(t) − s·τ                     any shape
//! plane    gap(t + τ) ≥ gap(t) + u·τ − ½·A·τ²            a convex shape: it lies behind the plane of its closest point
//!          u = n·(v − V − ω × p)
//!          A = max(0, −n·a),  or |a| + 2·|ω|·w + |ω|²·(|p| + w·T) if the shape turns
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x(t)`, `v`, `a`, `r` | path of a particle, its velocity and acceleration; its radius |
//! | `X(t)`, `V`, `ω` | pose of the shape between those at the start and the end of the frame; its velocities |
//! | `n`, `p` | normal at the closest point; position relative to the origin of the part |
//! | `s` | bound on the relative speed: that of the particle and of the fastest point of the shape |
//! | `w`, `T` | bound on the speed relative to the origin of the part; time that is left |
//!
//! The first `τ` at which a bound is 0 is not after the first contact, so steps of that length pass no surface, however thin (conservative
//! advancement). Steps by planes are Newton's on a convex function, from the left: they converge by squares. They end where the surface is reached, or
//! where no plane is met in the time that is left; then there is no contact. The acceleration of free flight decays and does not turn, so `n·a` bounds
//! it in all the time that is left.
//!
//! Meshes need not be convex. There each step is that of the ball, which gets ahead slowly where a surface is met at a slant, and steps by planes from its end
//! are a trial: a surface that they reach is taken for the first one. So of several contacts with one mesh in a frame a later one may be taken.

use super::obstacles::Obstacle;
use super::path::Path;
use tumble_collide::Vec3;

/// Gap of a particle that lies on a surface, m.
pub(super) const TOUCHING: f64 = 1e-10;
/// Most steps along a path.
const STEPS: usize = 64;
/// Most steps of a trial.
const TRIALS: usize = 5;
/// Gap at which a surface is reached, m, per meter from the origin.
const REACHED: f64 = 1e-14;
/// Shortest step of the ball, as a share of the stretch.
const SHORTEST: f64 = 1e-6;

/// A stretch of a path within a frame.
pub(super) struct Stretch<'a> {
    pub path: &'a Path,
    /// Position at its end, m.
    pub end: &'a Vec3,
    /// Start and length, s; the start is counted from that of the frame.
    pub start: f64,
    pub length: f64,
    /// Length of the frame, s.
    pub dt: f64,
    /// Radius of the particle, m.
    pub radius: f64,
}

/// Velocities of a part over a frame, m/s and rad/s, and the position of its origin at the start, m.
#[derive(Clone, Copy)]
pub(super) struct Rates {
    pub start: Vec3,
    pub velocity: Vec3,
    pub angular: Vec3,
}

/// A time of a stretch.
#[derive(Clone, Copy)]
struct Instant {
    /// Time along the stretch, s.
    t: f64,
    /// m.
    gap: f64,
    /// Rate of the gap, `u`, m/s.
    rate: f64,
    /// Most that its rate falls, `A`, m/s².
    fall: f64,
    /// Gap at which the surface is reached, m.
    reached: f64,
}

impl Instant {
    /// Returns the time to where the bound of the plane is 0, s; infinite if it never is.
    fn to_plane(self) -> f64 {
        let root = (self.rate * self.rate + 2.0 * self.fall * self.gap).sqrt();
        match self.rate < 0.0 {
            true => 2.0 * self.gap / (root - self.rate),
            false if self.fall > 0.0 => (self.rate + root) / self.fall,
            false => f64::INFINITY,
        }
    }
}

impl Obstacle<'_> {
    /// Returns the time along a stretch at which it meets the surface first, s; 0 if it begins there. The gap is
    /// 0 to rounding then, unless it was below 0 at the start.
    pub fn meets(&self, stretch: &Stretch) -> Option<f64> {
        let speed = stretch.path.top_speed(stretch.length) + self.speed;
        let first = self.instant(stretch, 0.0);
        if first.gap <= 0.0 {
            return Some(0.0);
        }
        if first.gap > speed * stretch.length {
            return None;
        }
        if first.gap <= TOUCHING && self.presses(stretch) {
            return Some(0.0);
        }
        if self.convex { self.by_planes(stretch, first) } else { self.by_balls(stretch, first, speed) }
    }

    /// Returns whether a particle that lies on the surface stays there: a slide finds out how long.
    fn presses(&self, stretch: &Stretch) -> bool {
        let path = stretch.path;
        let n = self.gap(&path.x, stretch.start / stretch.dt, stretch.radius).1;
        let (rate, pull) = ((path.v - self.velocity(&path.x)).dot(&n), path.pull.dot(&n));
        !lifts(rate, pull) && (rate < 0.0 || pull < 0.0)
    }

    /// Returns the time along a stretch on the surface at which the gap has become `wide`, m, which it is at the end.
    pub fn leaves(&self, stretch: &Stretch, wide: f64) -> f64 {
        let (start, end) = (self.instant(stretch, 0.0).gap, self.end_gap(stretch));
        self.sign_change(stretch, wide, (0.0, start), (stretch.length, end))
    }

    /// Advances by planes.
    fn by_planes(&self, stretch: &Stretch, first: Instant) -> Option<f64> {
        let mut low = first;
        for _ in 0..STEPS {
            let t = low.t + low.to_plane();
            if t >= stretch.length {
                return None;
            }
            if t == low.t {
                return Some(t);
            }
            let next = self.instant(stretch, t);
            if next.gap <= next.reached {
                return Some(self.reach(stretch, low, next));
            }
            low = next;
        }
        self.last_resort(stretch, low)
    }

    /// Advances by balls, with trials by planes.
    fn by_balls(&self, stretch: &Stretch, first: Instant, speed: f64) -> Option<f64> {
        let (mut low, end) = (first, self.end_gap(stretch));
        for _ in 0..STEPS {
            if low.gap + end >= speed * (stretch.length - low.t) {
                return None; // the balls at both ends leave nothing between them
            }
            if let Some(time) = self.trial(stretch, low) {
                return Some(time);
            }
            let t = low.t + (low.gap / speed).max(SHORTEST * stretch.length);
            if t >= stretch.length {
                return None;
            }
            let next = self.instant(stretch, t);
            if next.gap <= next.reached {
                return Some(self.reach(stretch, low, next));
            }
            low = next;
        }
        self.last_resort(stretch, low)
    }

    /// Returns the time at which steps by planes reach the surface, if they do it soon.
    fn trial(&self, stretch: &Stretch, first: Instant) -> Option<f64> {
        let mut low = first;
        for _ in 0..TRIALS {
            let t = low.t + low.to_plane();
            if t >= stretch.length {
                return None;
            }
            let next = self.instant(stretch, t);
            if next.gap <= next.reached {
                return Some(self.reach(stretch, first, next));
            }
            if next.gap > 0.5 * low.gap {
                return None;
            }
            low = next;
        }
        None
    }

    /// Returns the time of the surface between two instants, of which the later one reached it, or is behind it by more than rounding.
    fn reach(&self, stretch: &Stretch, low: Instant, high: Instant) -> f64 {
        if high.gap >= -high.reached {
            high.t
        } else {
            self.sign_change(stretch, 0.0, (low.t, low.gap), (high.t, high.gap))
        }
    }

    /// Returns the time of a contact after more steps than there should be: a path that grazes the surface, or goes into it.
    fn last_resort(&self, stretch: &Stretch, low: Instant) -> Option<f64> {
        let end = self.end_gap(stretch);
        (end < 0.0).then(|| self.sign_change(stretch, 0.0, (low.t, low.gap), (stretch.length, end)))
    }

    fn end_gap(&self, stretch: &Stretch) -> f64 {
        self.gap(stretch.end, (stretch.start + stretch.length) / stretch.dt, stretch.radius).0
    }

    fn instant(&self, stretch: &Stretch, t: f64) -> Instant {
        let path = stretch.path;
        let (x, v) = if t == 0.0 { (path.x, path.v) } else { path.at(t) };
        let (gap, n) = self.gap(&x, (stretch.start + t) / stretch.dt, stretch.radius);
        let a = path.acceleration(&v);
        let (rate, fall) = match &self.rates {
            None => (v.dot(&n), -a.dot(&n)),
            Some(rates) => rates.of_gap(stretch, (stretch.start + t, stretch.length - t), [&x, &v, &a, &n]),
        };
        Instant { t, gap, rate, fall: fall.max(0.0), reached: REACHED * (1.0 + x.amax()) }
    }

    /// Returns the last time known before the gap minus `level`, m, changes its sign between two times, s, given with the gaps there;
    /// regula falsi (Illinois).
    fn sign_change(&self, stretch: &Stretch, level: f64, low: (f64, f64), high: (f64, f64)) -> f64 {
        let above =
            |t: f64| self.gap(&stretch.path.at(t).0, (stretch.start + t) / stretch.dt, stretch.radius).0 - level;
        let sign = if low.1 >= level { 1.0 } else { -1.0 };
        let (mut low, mut high) = ((low.0, sign * (low.1 - level)), (high.0, sign * (high.1 - level)));
        let (mut ends, mut last) = ((low.1, high.1), 0);
        for _ in 0..STEPS {
            let chord = (low.0 * ends.1 - high.0 * ends.0) / (ends.1 - ends.0);
            // rounding puts a root close to the later end there: halves then find how close
            let t = if chord < high.0 { chord } else { 0.5 * (low.0 + high.0) };
            if !(t > low.0 && t < high.0) {
                break;
            }
            let value = sign * above(t);
            let side = if value >= 0.0 { 1 } else { -1 };
            // an end that stays twice counts half
            let half = if side == last { 0.5 } else { 1.0 };
            if side > 0 {
                (low, ends) = ((t, value), (value, half * ends.1));
            } else {
                (high, ends) = ((t, value), (half * ends.0, value));
            }
            last = side;
            if low.1 < REACHED {
                break;
            }
        }
        low.0
    }
}

/// Returns whether a particle on a surface leaves it, with a rate of the gap, m/s, and an acceleration along the normal, m/s²: it gets
/// farther than rounding before it comes back.
pub(super) fn lifts(rate: f64, pull: f64) -> bool {
    rate > 0.0 && rate * rate > -2.0 * pull * TOUCHING
}

impl Rates {
    /// Returns the rate of a gap, m/s, and a bound on its fall, m/s², for a time of the frame and the time that is left, s, and
    /// position, velocity and acceleration of a particle and the normal there.
    fn of_gap(&self, stretch: &Stretch, (time, left): (f64, f64), [x, v, a, n]: [&Vec3; 4]) -> (f64, f64) {
        let arm = x - self.start - time * self.velocity;
        let rate = (v - self.velocity - self.angular.cross(&arm)).dot(n);
        let turn = self.angular.norm();
        if turn == 0.0 {
            return (rate, -a.dot(n));
        }
        let speed = stretch.path.top_speed(stretch.length) + self.velocity.norm();
        (rate, a.norm() + turn * (2.0 * speed + turn * (arm.norm() + speed * left)))
    }
}
