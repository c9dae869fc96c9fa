//! The motion of a contact: how its normal and its point follow the two bodies.
//!
//! The contact point is not a material point of a rounded surface: a sphere that spins in place has
//! a centripetal acceleration at its lowest point, and yet does not rise (thesis Fig. 17). So the
//! velocity `ṗ` of the point and the rate `ṅ` of the normal follow from the core features that carry
//! the contact. With `s = v_A(p) − v_B(p)`:
//!
//! ```text
//! rate of the rows          ds/dt = [a + α×r + ω×(ṗ − v)]_A − [ … ]_B        d²gap/dt² = n·ds/dt + ṅ·s
//! contact after t seconds   n(t) = n + t·ṅ, normalized        p(t) = p + t·ṗ ± ½·gap·n
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `a`, `α`, `v`, `ω` | accelerations and velocities of a part |
//! | `r` | contact point, from the part's origin |
//! | `±` | + if `ṗ` is that of A's surface, − of B's: the point is on the surface when the gap has closed |

use super::detect::ContactConstraint;
use super::rim::rim_rate;
use crate::object::part_state::PartState;
use crate::world::Core;
use tumble_collide::{Contact, NormalFrom, Shape, Vec3};

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
    /// Rate of the relative velocity as the contact moves, without the next two, m/s², world axes.
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

/// Maximum angle by which the normal of a contact that lasts turns, rad: an edge that slides past a corner has
/// a contact for a moment.
const MAX_TURN: f64 = 0.5;

/// The accelerations of a part.
#[derive(Clone, Copy)]
enum Carried {
    /// The present ones.
    Now,
    /// Those at constant generalized velocity.
    AtConstantVelocity,
}

/// Returns the rate of a normal that points from B's core point to A's, for the relative velocity
/// of the two. Two sharp features have none: their core points meet as the gap closes, and have no direction there.
fn turning(c: &Contact, gap: f64, relative: Vec3) -> Vec3 {
    let (cores, distance) = (c.core_a + c.core_b, c.core_a + c.core_b + gap);
    if cores > 0.0 && distance > 0.0 { across(relative, &c.normal) / distance } else { Vec3::zeros() }
}

/// Returns the part of `v` across a unit direction.
fn across(v: Vec3, along: &Vec3) -> Vec3 {
    v - along * along.dot(&v)
}

impl ContactConstraint {
    /// Returns the motion of the contact for the present velocities.
    pub fn motion(&self, a: &PartState, b: &PartState) -> ContactMotion {
        let (c, n, gap) = (&self.contact, &self.contact.normal, self.gap_found());
        let (core_a, core_b) = (c.point + n * (0.5 * gap + c.core_a), self.point_b() - n * (0.5 * gap + c.core_b));
        let (va, vb) = (a.velocity_at(&core_a), b.velocity_at(&core_b));
        let with_a =
            |n_rate: Vec3| ContactMotion { normal_rate: n_rate, point_rate: va - c.core_a * n_rate, side: -0.5 };
        let with_b =
            |n_rate: Vec3| ContactMotion { normal_rate: n_rate, point_rate: vb + c.core_b * n_rate, side: 0.5 };
        let line = |along: &Vec3, owner: &PartState| {
            turning(c, gap, across(va - vb, along)) + along * along.dot(&owner.angular_velocity.cross(n))
        };
        match &c.normal_from {
            NormalFrom::FaceOfA => with_b(a.angular_velocity.cross(n)),
            NormalFrom::FaceOfB => with_a(b.angular_velocity.cross(n)),
            NormalFrom::CorePoints => with_a(turning(c, gap, va - vb)),
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

    /// Returns the velocity of the contact point over the material of a cylinder's rim on a plane,
    /// m/s.
    fn along_rim<'s>(
        &self,
        motion: &ContactMotion,
        [a, b]: [&PartState; 2],
        shape: impl Fn(u32) -> Option<&'s Shape>,
    ) -> Vec3 {
        let (c, n) = (&self.contact, &self.contact.normal);
        let rate = match c.normal_from {
            NormalFrom::FaceOfA if c.core_b == 0.0 => shape(self.b).and_then(|shape| {
                let point = self.point_b() - 0.5 * self.gap_found() * n;
                rim_rate(shape, b, &point, &-n, &-motion.normal_rate)
            }),
            NormalFrom::FaceOfB if c.core_a == 0.0 => shape(self.a).and_then(|shape| {
                let point = c.point + 0.5 * self.gap_found() * n;
                rim_rate(shape, a, &point, n, &motion.normal_rate)
            }),
            _ => None,
        };
        rate.unwrap_or_default()
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
        moves: impl Fn(u32) -> bool,
        shape: impl Fn(u32) -> Option<&'s Shape>,
    ) {
        let Contact { point, normal, .. } = self.contact;
        let mut motion = self.motion(a, b);
        motion.point_rate += self.along_rim(&motion, [a, b], shape);
        let (rate, mut of_links, mut of_driven) = (self.rate(&motion, [a, b]), Vec3::zeros(), Vec3::zeros());
        for (sign, part, state) in [(1.0, self.a, a), (-1.0, self.b, b)] {
            if moves(part) {
                of_links += sign * self.carried(state, Carried::AtConstantVelocity);
            } else {
                of_driven += sign * self.carried(state, Carried::Now);
            }
        }
        let left = time - self.found_at;
        if left.abs() * motion.normal_rate.norm() > MAX_TURN || self.contact.normal_from == NormalFrom::Edges {
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
    constraint.move_to(time, parts, |part| entry(part).moves(), shape);
    constraint.moved.time > 0.0
}

/// Returns the present motion of a contact, with that of a lowest point along its rim.
pub(crate) fn of(core: &Core, constraint: &ContactConstraint) -> ContactMotion {
    let parts = [constraint.a, constraint.b].map(|part| &core.derived.part_states[part as usize]);
    let shape = |part: u32| {
        let owner = core.owners[part as usize];
        core.objects().at(owner.place as usize).object.collidable()?.shape(owner.part as usize)
    };
    let mut motion = constraint.motion(parts[0], parts[1]);
    motion.point_rate += constraint.along_rim(&motion, parts, shape);
    motion
}
