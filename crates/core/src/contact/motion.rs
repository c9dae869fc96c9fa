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
use crate::object::collidable::ContactFrame;
use crate::object::part_state::PartState;
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

/// Where a contact is at another time than that of the detection.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moved {
    /// Time since the detection, s.
    pub time: f64,
    /// Displacement of the contact point until then, m.
    pub way: Vec3,
    /// Rate of the relative velocity in free motion, as the contact moves, m/s², world axes.
    pub rate: Vec3,
}

/// Maximum angle by which the normal of a contact that lasts turns, rad: an edge that slides past a corner has
/// a contact for a moment.
const MAX_TURN: f64 = 0.5;

/// Returns the rate of a normal that points from B's core point to A's, for the relative velocity
/// of the two.
fn turning(c: &Contact, gap: f64, relative: Vec3) -> Vec3 {
    let distance = c.core_a + c.core_b + gap;
    if distance > 0.0 { across(relative, &c.normal) / distance } else { Vec3::zeros() }
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
        let rate = self.rate(&self.motion(a, b), [a, b], PartState::acceleration_following);
        Vec3::from(self.frame.axes.map(|axis| axis.dot(&rate)))
    }

    fn rate(
        &self,
        motion: &ContactMotion,
        [a, b]: [&PartState; 2],
        following: impl Fn(&PartState, &Vec3, &Vec3) -> Vec3,
    ) -> Vec3 {
        let Contact { point, normal, .. } = &self.contact;
        let of = |s: &PartState| following(s, point, &motion.point_rate);
        of(a) - of(b) + normal * motion.normal_rate.dot(&self.velocity(a, b))
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

    /// Returns the gap at the time at which the contact was found, m.
    fn gap_found(&self) -> f64 {
        self.contact.gap + self.contact.normal.dot(&self.offset)
    }

    /// Moves frame and point to `time` seconds after the start of the step, in free motion that closes
    /// the gap until then. A contact that does not last until then stays where it was found.
    pub fn move_to<'s>(&mut self, time: f64, [a, b]: [&PartState; 2], shape: impl Fn(u32) -> Option<&'s Shape>) {
        let Contact { point, normal, .. } = self.contact;
        let mut motion = self.motion(a, b);
        motion.point_rate += self.along_rim(&motion, [a, b], shape);
        let rate = self.rate(&motion, [a, b], PartState::bias_acceleration_following);
        let left = time - self.found_at;
        if left.abs() * motion.normal_rate.norm() > MAX_TURN {
            return;
        }
        let way = self.found_at * a.velocity + left * motion.point_rate - motion.side * self.gap_found() * normal;
        self.moved = Moved { time, way, rate };
        self.frame = ContactFrame::new(point + way, (normal + left * motion.normal_rate).normalize());
    }
}
