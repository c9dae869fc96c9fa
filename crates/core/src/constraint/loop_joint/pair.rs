//! The rows of a loop joint between the frames of its two sides; the head of the module has the equations.

use super::transmission::Transmission;
use super::{Anchor, LoopJointKind, PartRef, near};
use crate::constraint::builder::RowBuilder;
use crate::constraint::rows::RowSet;
use crate::object::RowTarget;
use crate::object::part_state::PartState;
use crate::rotation_vector::RotationVector;
use crate::world::view::WorldView;
use nalgebra::RealField;
use smallvec::{SmallVec, smallvec};
use std::f64::consts::TAU;
use tumble_collide::{Quat, Vec3};

/// Motion of one side that a row measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Motion {
    /// Velocity of the side's material point at a world point.
    Point(Vec3),
    /// Angular velocity.
    Rotation,
}

/// A part of the velocity of a row: `factor` times a motion of one side along a unit vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Term {
    /// 0 for A, 1 for B.
    pub side: usize,
    pub motion: Motion,
    pub axis: Vec3,
    pub factor: f64,
}

/// The velocity of a row.
pub(super) type Terms = [Option<Term>; 4];

/// A row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct JointRow {
    pub terms: Terms,
    pub target: RowTarget,
    /// Degree of freedom whose drive it is the row of.
    pub drives: Option<usize>,
}

/// A position of a joint, with the row of its rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coordinate {
    /// rad or m.
    pub position: f64,
    /// rad/s or m/s.
    pub rate: f64,
    pub terms: Terms,
    /// Rate of the rate without any force.
    pub bias: f64,
}

impl Coordinate {
    /// Returns a row along its rate times a sign.
    pub fn row(&self, sign: f64, target: RowTarget) -> JointRow {
        let target = RowTarget { bias_acceleration: sign * self.bias, ..target };
        let terms = self.terms.map(|term| term.map(|term| Term { factor: sign * term.factor, ..term }));
        JointRow { terms, target, drives: None }
    }
}

/// One side in a view of the world.
pub(super) struct JointEnd {
    pub part: PartRef,
    /// State of the part, with the accelerations at zero force.
    pub part_state: PartState,
    frame: tumble_collide::Pose,
}

impl JointEnd {
    fn of(anchor: &Anchor, view: &WorldView) -> Option<JointEnd> {
        let Some((id, part)) = anchor.part else {
            return Some(JointEnd { part: None, part_state: PartState::default(), frame: anchor.frame });
        };
        view.status(id).filter(|s| s.enabled)?;
        // a missing part is reported by the row, which refuses it by name
        let mut part_state = view.part_state(id, part).copied().unwrap_or_default();
        (part_state.angular_acceleration, part_state.acceleration) =
            (part_state.bias_angular_acceleration, part_state.bias_acceleration);
        Some(JointEnd { part: Some((id, part)), frame: part_state.pose * anchor.frame, part_state })
    }

    pub fn p(&self) -> Vec3 {
        self.frame.translation.vector
    }

    pub fn axis(&self, k: usize) -> Vec3 {
        self.frame.rotation * Vec3::ith(k, 1.0)
    }

    /// Returns `p̈` of the side's material point at `p`.
    fn bias_acceleration_at(&self, p: &Vec3) -> Vec3 {
        self.part_state.acceleration_following(p, &self.part_state.velocity_at(p))
    }
}

/// Both sides in a view of the world.
pub(super) struct EndPair {
    pub a: JointEnd,
    pub b: JointEnd,
    /// Angle within π of which that of a revolute joint is.
    pub middle: f64,
}

impl EndPair {
    /// Returns the sides; `None` if one is missing or not enabled.
    pub fn of([a, b]: [&Anchor; 2], view: &WorldView, middle: f64) -> Option<EndPair> {
        Some(EndPair { a: JointEnd::of(a, view)?, b: JointEnd::of(b, view)?, middle })
    }

    fn omega(&self) -> Vec3 {
        self.a.part_state.angular_velocity - self.b.part_state.angular_velocity
    }

    fn alpha(&self) -> Vec3 {
        self.a.part_state.angular_acceleration - self.b.part_state.angular_acceleration
    }

    /// Returns `log(R_A·R_Bᵀ)`, world axes.
    pub fn rotation_error(&self) -> Vec3 {
        (self.a.frame.rotation * self.b.frame.rotation.inverse()).scaled_axis()
    }

    /// Returns the shortest rotation vector that takes `z_B` to `z_A`.
    pub fn axis_deviation(&self) -> Vec3 {
        let (za, zb) = (self.a.axis(2), self.b.axis(2));
        let (cross, cos) = (zb.cross(&za), zb.dot(&za));
        let sin = cross.norm();
        match sin {
            0.0 if cos < 0.0 => self.b.axis(0) * std::f64::consts::PI,
            0.0 => cross,
            _ => cross * (RealField::atan2(sin, cos) / sin),
        }
    }

    /// Calls `row` with the rows that hold what a kind does not leave free. `length` is that of a
    /// `Distance`.
    pub fn held(&self, kind: LoopJointKind, length: f64, by: &Transmission, row: &mut dyn FnMut(JointRow)) {
        match kind {
            LoopJointKind::Spherical => self.coincident_origins(row),
            LoopJointKind::Revolute => {
                self.coincident_origins(row);
                self.axis(row);
            }
            LoopJointKind::Fixed => {
                self.coincident_origins(row);
                self.equal_rotations(row);
            }
            LoopJointKind::Prismatic => {
                self.origin_along([0, 1], row);
                self.equal_rotations(row);
            }
            LoopJointKind::Cylindrical => {
                self.origin_along([0, 1], row);
                self.axis(row);
            }
            LoopJointKind::Planar => {
                self.origin_along([2], row);
                self.axis(row);
            }
            LoopJointKind::Universal => {
                self.coincident_origins(row);
                self.perpendicular(row);
            }
            LoopJointKind::Distance => {
                let Coordinate { position, terms, bias, .. } = self.length();
                row(equality(terms, position - length, bias));
            }
            LoopJointKind::Gear => self.gear(by, row),
            LoopJointKind::Rack => self.rack(by, row),
            LoopJointKind::Screw => {
                self.origin_along([0, 1], row);
                self.axis(row);
                self.thread(by, row);
            }
            LoopJointKind::Rope | LoopJointKind::Spring | LoopJointKind::Pulley => {}
        }
    }

    /// Adds the rows that keep the origins together. Between parts of one object they are measured in the frame of B
    /// and at one point: a motion that both parts share is then in no row, also while the origins are apart.
    fn coincident_origins(&self, row: &mut dyn FnMut(JointRow)) {
        if self.a.part.zip(self.b.part).is_some_and(|((a, _), (b, _))| a == b) {
            return self.origin_along([0, 1, 2], row);
        }
        let (pa, pb) = (self.a.p(), self.b.p());
        let (error, bias) = (pa - pb, self.a.bias_acceleration_at(&pa) - self.b.bias_acceleration_at(&pb));
        for (k, e) in WORLD_AXES.iter().enumerate() {
            row(translation([pa, pb], e, error[k], bias[k]));
        }
    }

    /// Adds the rows that keep A's origin at B's along some axes of B.
    fn origin_along<const N: usize>(&self, axes: [usize; N], row: &mut dyn FnMut(JointRow)) {
        let (p, state_b) = (self.a.p(), &self.b.part_state);
        let (d, rate) = (p - self.b.p(), self.a.part_state.velocity_at(&p));
        let slip = rate - state_b.velocity_at(&p);
        let slip_rate = self.a.bias_acceleration_at(&p) - state_b.acceleration_following(&p, &rate);
        for t in axes.map(|k| self.b.axis(k)) {
            let bias = t.dot(&slip_rate) + state_b.angular_velocity.cross(&t).dot(&slip);
            row(translation([p, p], &t, t.dot(&d), bias));
        }
    }

    /// Adds the rows that keep the rotations of the frames equal.
    fn equal_rotations(&self, row: &mut dyn FnMut(JointRow)) {
        let (error, bias) = (self.rotation_error(), self.alpha());
        for (k, e) in WORLD_AXES.iter().enumerate() {
            row(rotation(e, error[k], bias[k]));
        }
    }

    /// Adds the rows that keep `z_A` along `z_B`.
    fn axis(&self, row: &mut dyn FnMut(JointRow)) {
        let (error, omega, alpha) = (self.axis_deviation(), self.omega(), self.alpha());
        for t in [self.b.axis(0), self.b.axis(1)] {
            let bias = t.dot(&alpha) + self.b.part_state.angular_velocity.cross(&t).dot(&omega);
            row(rotation(&t, t.dot(&error), bias));
        }
    }

    /// Adds the row that keeps `z_A` perpendicular to `x_B`.
    fn perpendicular(&self, row: &mut dyn FnMut(JointRow)) {
        let (u, w) = (self.a.axis(2), self.b.axis(0));
        let c = u.cross(&w);
        let Some(n) = c.try_normalize(1e-9) else {
            // they are parallel: any axis across them opens the angle
            return row(rotation(&self.b.axis(1), RealField::atan2(u.dot(&w), c.norm()), 0.0));
        };
        let (omega_a, omega_b) = (self.a.part_state.angular_velocity, self.b.part_state.angular_velocity);
        let rate = omega_a.cross(&u).cross(&w) + u.cross(&omega_b.cross(&w));
        let turning = (rate - n * n.dot(&rate)) / c.norm();
        let bias = n.dot(&self.alpha()) + turning.dot(&self.omega());
        row(rotation(&n, RealField::atan2(u.dot(&w), c.norm()), bias));
    }

    /// Adds the row of two gears: `(n_A·θ_A + n_B·θ_B)/n_A`, within half a tooth.
    fn gear(&self, by: &Transmission, row: &mut dyn FnMut(JointRow)) {
        let [n, m] = by.teeth.map(f64::from);
        let [[a, bias_a], [b, bias_b]] = self.angles(by);
        let axes = by.references.map(|frame| frame.rotation * Vec3::z());
        let terms = [term(0, Motion::Rotation, axes[0], 1.0), term(1, Motion::Rotation, axes[1], m / n), None, None];
        row(equality(terms, near(n * a + m * b, 0.0) / n, bias_a + m / n * bias_b));
    }

    /// Adds the row of a pinion A on a rack B: `radius·θ_A − s_B`, within half a turn.
    fn rack(&self, by: &Transmission, row: &mut dyn FnMut(JointRow)) {
        let [[angle, bias], _] = self.angles(by);
        let [turns, slides] = by.references.map(|frame| frame.rotation * Vec3::z());
        let p = self.b.p();
        let s = slides.dot(&(p - by.references[1].translation.vector));
        let terms = [term(0, Motion::Rotation, turns, by.radius), term(1, Motion::Point(p), slides, -1.0), None, None];
        let bias = by.radius * bias - slides.dot(&self.b.bias_acceleration_at(&p));
        row(equality(terms, by.radius * near(angle - s / by.radius, 0.0), bias));
    }

    /// Adds the row of a screw: `s − pitch·θ/2π`, within half a turn.
    fn thread(&self, by: &Transmission, row: &mut dyn FnMut(JointRow)) {
        let (angle, along) = (self.angle(), self.displacement(2));
        let lead = by.pitch / TAU;
        let axis = self.b.axis(2);
        let [first, second, ..] = along.terms;
        let turn = |side: usize, factor: f64| term(side, Motion::Rotation, axis, factor);
        let error = lead * near(along.position / lead - angle.position, 0.0);
        row(equality([first, second, turn(0, -lead), turn(1, lead)], error, along.bias - lead * angle.bias));
    }

    /// Returns the angles of A and B about the z axes of their frames of reference, in (−π, π], and the rates
    /// of their rates without any force.
    fn angles(&self, by: &Transmission) -> [[f64; 2]; 2] {
        [(&self.a, by.references[0]), (&self.b, by.references[1])].map(|(end, frame)| {
            let (x, y, z) = (frame.rotation * Vec3::x(), frame.rotation * Vec3::y(), frame.rotation * Vec3::z());
            let angle = RealField::atan2(end.axis(0).dot(&y), end.axis(0).dot(&x));
            [angle, z.dot(&end.part_state.angular_acceleration)]
        })
    }

    /// Returns the positions that a kind leaves free, in the order of its degrees of freedom.
    pub fn coordinates(&self, kind: LoopJointKind, by: &Transmission) -> SmallVec<[Coordinate; 3]> {
        use LoopJointKind::*;
        match kind {
            Revolute => smallvec![self.angle()],
            Prismatic | Screw => smallvec![self.displacement(2)],
            Cylindrical => smallvec![self.displacement(2), self.angle()],
            Universal => self.cardan().into_iter().collect(),
            Planar => smallvec![self.displacement(0), self.displacement(1), self.angle()],
            Distance | Rope | Spring => smallvec![self.length()],
            Pulley => smallvec![self.lengths(by)],
            Spherical => self.rotations().into_iter().collect(),
            Fixed | Gear | Rack => SmallVec::new(),
        }
    }

    /// Returns a position whose rate is `w·ω`, where `w` changes by `turning` per second.
    fn rotation_along(&self, position: f64, w: &Vec3, turning: &Vec3) -> Coordinate {
        let omega = self.omega();
        Coordinate {
            position,
            rate: w.dot(&omega),
            terms: between([Motion::Rotation; 2], w),
            bias: w.dot(&self.alpha()) + turning.dot(&omega),
        }
    }

    /// Returns the angle of A about `z_B`, in (−π, π].
    fn angle(&self) -> Coordinate {
        let (x, axis) = (self.a.axis(0), self.b.axis(2));
        let position = RealField::atan2(x.dot(&self.b.axis(1)), x.dot(&self.b.axis(0)));
        self.rotation_along(position, &axis, &self.turning_of_b(&axis))
    }

    /// Returns the rate of a vector that is fixed to B.
    fn turning_of_b(&self, axis: &Vec3) -> Vec3 {
        self.b.part_state.angular_velocity.cross(axis)
    }

    /// Returns the rate of a vector that is fixed to A.
    fn turning_of_a(&self, axis: &Vec3) -> Vec3 {
        self.a.part_state.angular_velocity.cross(axis)
    }

    /// Returns the angles of a universal joint: of A about `z_A`, and about `x_B`, in (−π, π]. Their rates are along
    /// the reciprocal basis of both axes.
    fn cardan(&self) -> [Coordinate; 2] {
        let (u, x) = (self.a.axis(2), self.b.axis(0));
        let (u_rate, x_rate) = (self.turning_of_a(&u), self.turning_of_b(&x));
        let (s, s_rate) = (u.dot(&x), u_rate.dot(&x) + u.dot(&x_rate));
        let left = (1.0 - s * s).max(1e-9);
        let reciprocal = |own: &Vec3, own_rate: &Vec3, other: &Vec3, other_rate: &Vec3| {
            let w = own - s * other;
            let rate = own_rate - s_rate * other - s * other_rate;
            (w / left, rate / left + w * (2.0 * s * s_rate / (left * left)))
        };
        let [about_a, about_b] = [
            RealField::atan2(-self.a.axis(1).dot(&x), self.a.axis(0).dot(&x)),
            RealField::atan2(-u.dot(&self.b.axis(1)), u.dot(&self.b.axis(2))),
        ];
        let (w_a, turning_a) = reciprocal(&u, &u_rate, &x, &x_rate);
        let (w_b, turning_b) = reciprocal(&x, &x_rate, &u, &u_rate);
        [self.rotation_along(about_a, &w_a, &turning_a), self.rotation_along(about_b, &w_b, &turning_b)]
    }

    /// Returns the angle between `z_A` and `z_B`, in [0, π].
    pub fn swing(&self) -> Coordinate {
        let (u, w, omega) = (self.a.axis(2), self.b.axis(2), self.omega());
        let c = w.cross(&u);
        let angle = RealField::atan2(c.norm(), w.dot(&u));
        // while they are parallel the swing grows about the axis of the rotation across them
        let across = (omega - w * w.dot(&omega)).try_normalize(0.0).unwrap_or_else(|| self.b.axis(0));
        let (axis, turning) = match c.try_normalize(1e-9) {
            None => (across, Vec3::zeros()),
            Some(n) => {
                let rate = self.turning_of_b(&w).cross(&u) + w.cross(&self.turning_of_a(&u));
                (n, (rate - n * n.dot(&rate)) / c.norm())
            }
        };
        self.rotation_along(angle, &axis, &turning)
    }

    /// Returns the angle of A about its own `z_A` after the shortest turn of `z_B` to it, in (−π, π]. It has no
    /// value where the axes are opposite.
    pub fn twist(&self) -> Coordinate {
        let (u, w) = (self.a.axis(2), self.b.axis(2));
        let q = (self.b.frame.rotation.inverse() * self.a.frame.rotation).coords;
        let twist = 2.0 * RealField::atan2(q.z, q.w);
        let (u_rate, w_rate) = (self.turning_of_a(&u), self.turning_of_b(&w));
        let left = (1.0 + u.dot(&w)).max(1e-9);
        let turning = (u_rate + w_rate) / left - (u + w) * ((u_rate.dot(&w) + u.dot(&w_rate)) / (left * left));
        self.rotation_along(near(twist, 0.0), &((u + w) / left), &turning)
    }

    /// Returns the rotations of A about the axes of B's frame, whose positions are the rotation vector of A in B's frame.
    fn rotations(&self) -> [Coordinate; 3] {
        let turn = self.turn_from(&Vec3::zeros());
        [0, 1, 2].map(|k| {
            let axis = self.b.axis(k);
            self.rotation_along(turn[k], &axis, &self.turning_of_b(&axis))
        })
    }

    /// Returns the components of the rotation vector from the orientation whose rotation vector in B's frame is `from` to that
    /// of A, with the rows of their rates.
    pub fn turned_from(&self, from: &Vec3) -> [Coordinate; 3] {
        let to_world = self.b.frame.rotation;
        let vector = RotationVector::outside(self.turn_from(from), &(to_world.inverse() * self.omega()));
        [0, 1, 2].map(|k| {
            let [axis, turning] = vector.gradient(k).map(|v| to_world * v);
            self.rotation_along(vector.r[k], &axis, &(self.turning_of_b(&axis) + turning))
        })
    }

    /// Returns the rotation vector from the orientation whose rotation vector in B's frame is `from` to that of A, in
    /// B's frame.
    pub fn turn_from(&self, from: &Vec3) -> Vec3 {
        let turn = self.b.frame.rotation.inverse() * self.a.frame.rotation;
        if *from == Vec3::zeros() { turn.scaled_axis() } else { (turn * Quat::from_scaled_axis(-from)).scaled_axis() }
    }

    /// Returns the displacement of A's origin along an axis of B's frame.
    fn displacement(&self, k: usize) -> Coordinate {
        let (p, axis, state_b) = (self.a.p(), self.b.axis(k), &self.b.part_state);
        let rate = self.a.part_state.velocity_at(&p);
        let slip = rate - state_b.velocity_at(&p);
        let slip_rate = self.a.bias_acceleration_at(&p) - state_b.acceleration_following(&p, &rate);
        Coordinate {
            position: axis.dot(&(p - self.b.p())),
            rate: axis.dot(&slip),
            terms: between([Motion::Point(p); 2], &axis),
            bias: axis.dot(&slip_rate) + state_b.angular_velocity.cross(&axis).dot(&slip),
        }
    }

    /// Returns the distance of the origins.
    fn length(&self) -> Coordinate {
        let (pa, pb) = (self.a.p(), self.b.p());
        let rate = self.a.part_state.velocity_at(&pa) - self.b.part_state.velocity_at(&pb);
        let acceleration = self.a.bias_acceleration_at(&pa) - self.b.bias_acceleration_at(&pb);
        let (axis, [position, rate, bias]) = self.stretch(pa - pb, rate, acceleration);
        Coordinate { position, rate, terms: between([Motion::Point(pa), Motion::Point(pb)], &axis), bias }
    }

    /// Returns the length of the rope of a pulley.
    fn lengths(&self, by: &Transmission) -> Coordinate {
        let mut sum = Coordinate { position: 0.0, rate: 0.0, terms: [None; 4], bias: 0.0 };
        for (side, (end, factor)) in [(&self.a, 1.0), (&self.b, by.ratio)].into_iter().enumerate() {
            let p = end.p();
            let (rate, acceleration) = (end.part_state.velocity_at(&p), end.bias_acceleration_at(&p));
            let (axis, [length, rate, bias]) = self.stretch(p - by.ground[side], rate, acceleration);
            sum.position += factor * length;
            sum.rate += factor * rate;
            sum.bias += factor * bias;
            sum.terms[side] = term(side, Motion::Point(p), axis, factor);
        }
        sum
    }

    /// Returns the direction of a vector, its length, and the first two rates of the length.
    fn stretch(&self, d: Vec3, rate: Vec3, acceleration: Vec3) -> (Vec3, [f64; 3]) {
        let length = d.norm();
        // points that coincide part along any axis
        let axis = d.try_normalize(0.0).unwrap_or_else(|| self.b.axis(2));
        let along = axis.dot(&rate);
        let across = (rate.norm_squared() - along * along).max(0.0);
        let turning = if length > 0.0 { across / length } else { 0.0 };
        (axis, [length, along, axis.dot(&acceleration) + turning])
    }

    /// Adds a row.
    pub fn add(&self, row: &JointRow, out: &mut RowBuilder) {
        out.row(row.target);
        self.add_terms(&row.terms, 1.0, out);
    }

    /// Adds `scale` times a velocity to the open row.
    pub fn add_terms(&self, terms: &Terms, scale: f64, out: &mut RowBuilder) {
        for Term { side, motion, axis, factor } in terms.iter().flatten() {
            let Some((id, part)) = [&self.a, &self.b][*side].part else { continue };
            match motion {
                Motion::Point(p) => out.on_point(id, part, p, axis, scale * factor),
                Motion::Rotation => out.on_rotation(id, part, axis, scale * factor),
            };
        }
    }
}

const WORLD_AXES: [Vec3; 3] = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];

fn term(side: usize, motion: Motion, axis: Vec3, factor: f64) -> Option<Term> {
    Some(Term { side, motion, axis, factor })
}

/// Returns the motion of A less that of B, times a vector of any length.
fn between(motions: [Motion; 2], along: &Vec3) -> Terms {
    let (axis, length) = match along.norm() {
        length if (length - 1.0).abs() < 1e-12 => (*along, 1.0),
        0.0 => (Vec3::z(), 0.0),
        length => (along / length, length),
    };
    [term(0, motions[0], axis, length), term(1, motions[1], axis, -length), None, None]
}

fn equality(terms: Terms, error: f64, bias: f64) -> JointRow {
    let target = RowTarget { bias_acceleration: bias, ..RowTarget::new(RowSet::Equality, error) };
    JointRow { terms, target, drives: None }
}

fn translation(points: [Vec3; 2], axis: &Vec3, error: f64, bias: f64) -> JointRow {
    equality(between(points.map(Motion::Point), axis), error, bias)
}

fn rotation(axis: &Vec3, error: f64, bias: f64) -> JointRow {
    equality(between([Motion::Rotation; 2], axis), error, bias)
}
