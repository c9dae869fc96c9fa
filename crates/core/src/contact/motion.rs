//! The motion of a contact: how its normal and its point follow the two bodies.
//!
//! The contact point is not a material point of a rounded surface: a sphere that spins in place has
//! a centripetal acceleration at its lowest point, and yet does not rise (thesis Fig. 17). So the
//! velocity `ṗ` of the point and the rate `ṅ` of the normal follow from the core features that carry
//! the contact (`curvature.rs`). With `s = v_A(p) − v_B(p)`:
//!
//! ```text
//! normal of two core points     (P_A + P_B + gap)·ṅ = (1 − n·nᵀ)·[v_A(p_A) + P_A·(ω_A×n) − v_B(p_B) + P_B·(ω_B×n)]
//! point on A, or on B           ṗ = v_A(p_A) + P_A·(ω_A×n − ṅ),      ṗ = v_B(p_B) + P_B·(ṅ − ω_B×n)
//! rate of the rows          ds/dt = [a + α×r + ω×(ṗ − v)]_A − [ … ]_B        d²gap/dt² = n·ds/dt + ṅ·s
//! contact after t seconds   n(t) = n + t·ṅ, normalized        p(t) = p + t·ṗ ± ½·gap·n
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `a`, `α`, `v`, `ω` | accelerations and velocities of a part |
//! | `r` | contact point, from the part's origin |
//! | `P` | rate of a surface's point by the normal: `r·(1 − n·nᵀ)` for a sphere of radius `r` about a core feature |
//! | `±` | + if `ṗ` is that of A's surface, − of B's: the point is on the surface when the gap has closed |

use super::curvature::Rounded;
use super::detect::ContactConstraint;
use crate::object::collidable::ContactFrame;
use crate::object::part_state::PartState;
use crate::world::Core;
use nalgebra::{ComplexField, RealField};
use tumble_collide::{Contact, Mat3, NormalFrom, Shape, Vec3};

/// Rates of a contact's normal and point, world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactMotion {
    /// `ṅ`, 1/s.
    pub normal_rate: Vec3,
    /// `ṗ` of the surface that carries the point, m/s.
    pub point_rate: Vec3,
    /// −½ if that is A's surface, ½ for B's, 0 for the middle of two edges.
    side: f64,
}

/// Time and place of a contact, if not those of the detection.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moved {
    /// Time since the detection, s.
    pub time: f64,
    /// Displacement of the contact point until then, m.
    pub way: Vec3,
    /// Rate of the relative velocity as the contact moves, without the next two, m/s², world axes. That of the origin of a part
    /// beside its center of mass is included.
    pub rate: Vec3,
    /// That by the accelerations of links at constant generalized velocity.
    pub of_links: Vec3,
    /// That by the accelerations of parts that no force moves.
    pub of_driven: Vec3,
    /// Change of the gap until then that the row does not have, m: its normal turns, and its bodies rotate.
    pub turned: f64,
}

impl Moved {
    /// Returns whether rows change during the step.
    pub fn changes(&self) -> bool {
        [self.rate, self.of_links, self.of_driven].into_iter().any(|rate| rate != Vec3::zeros())
    }
}

/// Maximum angle by which the normal of a contact that lasts turns, and by which it turns over a surface whose curvature varies, rad:
/// an edge that slides past a corner has a contact for a moment, and the lowest point of a disc that falls flat runs around its rim.
const MAX_TURN: f64 = 0.5;
/// A smaller radius of curvature, in parts of the mean one, is that of a sharp feature.
const SHARP: f64 = 1e-9;

/// The object that carries a part.
#[derive(Clone, Copy)]
enum Carrier {
    /// Its rows are those of the time of the contact.
    Body,
    /// Its rows are those of the configuration of the step.
    Link,
    /// No force moves it.
    Driven,
}

/// The accelerations of a part.
#[derive(Clone, Copy)]
enum Carried {
    /// The present ones.
    Now,
    /// Those at constant generalized velocity.
    AtConstantVelocity,
}

/// Returns the rate of a normal that points from B's core point to A's, for the relative velocity of the two, the sum of
/// their core radii and the gap, m, and the sum of their other curvatures. Features that are sharp in a direction have none
/// there: their core points meet as the gap closes.
fn turning(normal: &Vec3, relative: Vec3, (cores, gap): (f64, f64), more: Option<Mat3>) -> Vec3 {
    let Some(more) = more else {
        let turns = cores > 0.0 && cores + gap > 0.0;
        return if turns { across(relative, normal) / (cores + gap) } else { Vec3::zeros() };
    };
    let [_, t, b] = ContactFrame::new(Vec3::zeros(), *normal).axes;
    let (tt, tb, bb) = (t.dot(&(more * t)), t.dot(&(more * b)), b.dot(&(more * b)));
    let angle = 0.5 * RealField::atan2(2.0 * tb, tt - bb);
    let (sin, cos) = ComplexField::sin_cos(angle);
    let (mean, half) = (0.5 * (tt + bb), ComplexField::hypot(0.5 * (tt - bb), tb));
    let along = |axis: Vec3, radius: f64| {
        let turns = radius + cores > SHARP * mean && radius + cores + gap > 0.0;
        if turns { axis * (axis.dot(&relative) / (radius + cores + gap)) } else { Vec3::zeros() }
    };
    along(cos * t + sin * b, mean + half) + along(cos * b - sin * t, mean - half)
}

/// Returns the part of `v` across a unit direction.
fn across(v: Vec3, along: &Vec3) -> Vec3 {
    v - along * along.dot(&v)
}

impl ContactConstraint {
    /// Returns the motion of the contact for the present velocities, with spheres about the core features.
    pub fn motion(&self, a: &PartState, b: &PartState) -> ContactMotion {
        self.motion_on([a, b], [Rounded::sphere(self.contact.core_a), Rounded::sphere(self.contact.core_b)])
    }

    /// Returns the motion of the contact of two surfaces.
    fn motion_on(&self, [a, b]: [&PartState; 2], [on_a, on_b]: [Rounded; 2]) -> ContactMotion {
        let (c, n, gap) = (&self.contact, &self.contact.normal, self.gap_found());
        let (core_a, core_b) = (c.point + n * (0.5 * gap + on_a.core), self.point_b() - n * (0.5 * gap + on_b.core));
        let va = a.velocity_at(&core_a) + on_a.by_curvature(&a.angular_velocity.cross(n));
        let vb = b.velocity_at(&core_b) - on_b.by_curvature(&b.angular_velocity.cross(n));
        let with_a =
            |n_rate: Vec3| ContactMotion { normal_rate: n_rate, point_rate: va - on_a.rate(&n_rate), side: -0.5 };
        let with_b =
            |n_rate: Vec3| ContactMotion { normal_rate: n_rate, point_rate: vb + on_b.rate(&n_rate), side: 0.5 };
        let (distance, more) = ((on_a.core + on_b.core, gap), on_a.more_with(&on_b));
        let line = |along: &Vec3, owner: &PartState| {
            let rolls = along * along.dot(&owner.angular_velocity.cross(n));
            let relative = va - vb - more.map_or(Vec3::zeros(), |more| more * rolls);
            let aside = n.cross(along);
            let more = more.map(|more| aside.dot(&(more * aside)) * Mat3::identity());
            turning(n, across(relative, along), distance, more) + rolls
        };
        match &c.normal_from {
            NormalFrom::FaceOfA => with_b(a.angular_velocity.cross(n)),
            NormalFrom::FaceOfB => with_a(b.angular_velocity.cross(n)),
            NormalFrom::CorePoints => with_a(turning(n, va - vb, distance, more)),
            NormalFrom::LineOfA(along) => with_b(line(along, a)),
            NormalFrom::LineOfB(along) => with_a(line(along, b)),
            NormalFrom::Edges => ContactMotion { normal_rate: Vec3::zeros(), point_rate: 0.5 * (va + vb), side: 0.0 },
        }
    }

    /// Returns the rate of the relative velocity along the contact's axes, as the *contact* moves,
    /// m/s²; the first is the second derivative of the gap.
    pub fn acceleration(&self, a: &PartState, b: &PartState) -> Vec3 {
        let rate =
            self.rate(&self.motion(a, b), [a, b]) + self.carried(a, Carried::Now) - self.carried(b, Carried::Now);
        Vec3::from(self.frame.axes.map(|axis| axis.dot(&rate)))
    }

    /// Returns the rate of the relative velocity by the motion of the contact alone, m/s².
    fn rate(&self, motion: &ContactMotion, [a, b]: [&PartState; 2]) -> Vec3 {
        let slides = |s: &PartState| s.angular_velocity.cross(&(motion.point_rate - s.velocity));
        slides(a) - slides(b) + self.contact.normal * motion.normal_rate.dot(&self.velocity(a, b))
    }

    /// Returns the acceleration of a part's frame at the contact point, m/s²: `a + α×r`.
    fn carried(&self, s: &PartState, which: Carried) -> Vec3 {
        let (linear, angular) = match which {
            Carried::Now => (s.acceleration, s.angular_acceleration),
            Carried::AtConstantVelocity => (s.bias_acceleration, s.bias_angular_acceleration),
        };
        linear + angular.cross(&(self.contact.point - s.position()))
    }

    /// Returns the surfaces of both parts at the contact.
    fn surfaces<'s>(&self, [a, b]: [&PartState; 2], shape: impl Fn(u32) -> Option<&'s Shape>) -> [Rounded; 2] {
        let (c, n) = (&self.contact, self.contact.normal);
        let half = 0.5 * self.gap_found() * n;
        let on_a = Rounded::of(shape(self.a), a, (c.shapes[0], c.core_a), (c.point + half, -n));
        let on_b = Rounded::of(shape(self.b), b, (c.shapes[1], c.core_b), (self.point_b() - half, n));
        [on_a, on_b]
    }

    /// Returns the point of the contact on a part that is at `state`, the start of the step, m: where
    /// the lever arm is that of the contact's time.
    pub fn point_on(&self, part: u32, state: &PartState) -> Vec3 {
        match self.moved {
            Moved { time: 0.0, .. } if part == self.a => self.contact.point,
            Moved { time: 0.0, .. } => self.point_b(),
            Moved { time, way, .. } => self.contact.point + way - time * state.velocity,
        }
    }

    /// Returns the gap at the start of the step as the row of the contact sees it, m: its velocity
    /// times the time since then adds up to the gap.
    pub fn gap_of_row(&self) -> f64 {
        self.contact.gap + self.moved.turned
    }

    /// Returns the gap at the time at which the contact was found, m.
    fn gap_found(&self) -> f64 {
        self.gap_of_row() + self.contact.normal.dot(&self.offset)
    }

    /// Takes back a motion of the contact within the step.
    pub fn stay(&mut self) {
        if self.moved.time > 0.0 {
            self.moved = Moved::default();
            self.frame = self.frame_at(self.contact.point, self.contact.normal);
        }
    }

    /// Moves frame and point to `time` seconds after the start of the step, in free motion that closes
    /// the gap until then. A contact that does not last until then stays where it was found, and
    /// so does one of two edges: it does not say how it moves along them.
    fn move_to<'s>(
        &mut self,
        time: f64,
        [a, b]: [&PartState; 2],
        carrier: impl Fn(u32) -> Carrier,
        shape: impl Fn(u32) -> Option<&'s Shape>,
    ) {
        let Contact { point, normal, .. } = self.contact;
        let surfaces = self.surfaces([a, b], shape);
        let motion = self.motion_on([a, b], surfaces);
        let (mut rate, mut of_links, mut of_driven) = (self.rate(&motion, [a, b]), Vec3::zeros(), Vec3::zeros());
        for (sign, part, state) in [(1.0, self.a, a), (-1.0, self.b, b)] {
            match carrier(part) {
                Carrier::Body => rate += sign * self.carried(state, Carried::AtConstantVelocity),
                Carrier::Link => of_links += sign * self.carried(state, Carried::AtConstantVelocity),
                Carrier::Driven => of_driven += sign * self.carried(state, Carried::Now),
            }
        }
        let left = time - self.found_at;
        let over = |on: &Rounded, s: &PartState| on.turn(&(s.angular_velocity.cross(&normal) - motion.normal_rate));
        let turn = motion.normal_rate.norm().max(over(&surfaces[0], a)).max(over(&surfaces[1], b));
        if left.abs() * turn > MAX_TURN || self.contact.normal_from == NormalFrom::Edges {
            return;
        }
        let way = self.found_at * a.velocity + left * motion.point_rate - motion.side * self.gap_found() * normal;
        self.moved = Moved { time, way, rate, of_links, of_driven, ..self.moved };
        self.frame = self.frame_at(point + way, (normal + left * motion.normal_rate).normalize());
    }
}

/// Parts that are slower, m/s and rad/s, keep their contacts where they are.
const STILL: f64 = 1e-6;

/// Moves a contact to `time` seconds after the start of the step, unless both parts are still. Returns
/// whether it has moved.
pub(crate) fn move_in_step(core: &Core, constraint: &mut ContactConstraint, time: f64) -> bool {
    let parts = [constraint.a, constraint.b].map(|part| &core.derived.part_states[part as usize]);
    let speed = |s: &PartState| s.velocity.norm_squared().max(s.angular_velocity.norm_squared());
    if parts.into_iter().all(|part| speed(part) < STILL * STILL) {
        return false;
    }
    let owner = |part: u32| core.owners[part as usize];
    let entry = |part: u32| core.objects().at(owner(part).place as usize);
    let shape = |part: u32| entry(part).object.collidable()?.shape(owner(part).part as usize);
    let carrier = |part: u32| match entry(part) {
        entry if !entry.moves() => Carrier::Driven,
        entry if entry.object.integratable().is_some_and(|body| body.holds_velocity()) => Carrier::Link,
        _ => Carrier::Body,
    };
    constraint.move_to(time, parts, carrier, shape);
    constraint.moved.time > 0.0
}

/// Returns the present motion of a contact.
pub(crate) fn of(core: &Core, constraint: &ContactConstraint) -> ContactMotion {
    let parts = [constraint.a, constraint.b].map(|part| &core.derived.part_states[part as usize]);
    let shape = |part: u32| {
        let owner = core.owners[part as usize];
        core.objects().at(owner.place as usize).object.collidable()?.shape(owner.part as usize)
    };
    constraint.motion_on(parts, constraint.surfaces(parts, shape))
}
