//! Loop joints: joints by equality rows between any two parts of any two objects (future work of
//! the thesis, §VI).
//!
//! Each side has a frame in its part's axes: origin `p`, axes `x y z`. `s(q) = v_A(q) − v_B(q)` is
//! the velocity of A's material point at `q` relative to B's, and `ω = ω_A − ω_B`:
//!
//! ```text
//! rows                        error                       velocity           bias J̇·v
//! origins     e = X, Y, Z     e·(p_A − p_B)               e·ṗ_A − e·ṗ_B      e·(p̈_A − p̈_B)
//! line        t = x_B, y_B    t·(p_A − p_B)               t·s(p_A)           t·ds/dt + (ω_B × t)·s
//! rotation    e = X, Y, Z     e·log(R_A·R_Bᵀ)             e·ω                e·(α_A − α_B)
//! axis        t = x_B, y_B    t·(z_B × z_A)·θ/sin θ       t·ω                t·(α_A − α_B) + (ω_B × t)·ω
//!
//! spherical = origins    revolute = origins + axis    fixed = origins + rotation    prismatic = line + rotation
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `X, Y, Z` | axes of the world: they do not turn, so these rows are smooth in any pose |
//! | `x_B, y_B, z_B` | axes of B's frame; revolute and prismatic joints keep `z_A` on `z_B` |
//! | `p̈`, `α` | accelerations at constant generalized velocities: `ω × (ω × r)` of a rigid body, plus the terms of the joints above a link |
//! | `θ` | the angle between `z_A` and `z_B` |
//!
//! Velocities and biases are exact in any pose. Those of the origin and line rows are the
//! derivatives of their errors (`s(p_A)` contains the arm on which B's axes turn). The error of a
//! rotation is exact to first order and vanishes only at the solution: the position correction
//! reaches it in Newton steps.

use crate::constraint::builder::RowBuilder;
use crate::constraint::rows::RowSet;
use crate::object::part_state::{PartState, StateRange};
use crate::object::{Constraint, Level, Object, RowTarget};
use crate::world::World;
use crate::world::view::{ObjectId, WorldView};
use nalgebra::{RealField, Rotation3, Translation3};
use tumble_collide::{Mat3, Pose, Quat, Vec3};

#[cfg(test)]
mod tests;

/// The motion that a loop joint leaves free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum LoopJointKind {
    /// The origins coincide; all rotations are free. Three rows.
    Spherical,
    /// The origins and the z axes coincide; one rotation is free. Five rows.
    Revolute,
    /// Both frames coincide. Six rows.
    Fixed,
    /// All but the displacement along the z axes is held: a piston in its cylinder. Five rows.
    Prismatic,
}

/// One side of a loop joint: a frame fixed to a part, or to the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Object and part; `None` for the world.
    pub part: Option<(ObjectId, usize)>,
    /// The frame in the part's axes, or in the world's if there is no part; m.
    pub frame: Pose,
}

impl Anchor {
    /// Returns a frame of the world.
    pub fn world(frame: Pose) -> Anchor {
        Anchor { part: None, frame }
    }

    /// Returns a frame fixed to one part of an object.
    pub fn on(id: ObjectId, part: usize, frame: Pose) -> Anchor {
        Anchor { part: Some((id, part)), frame }
    }
}

/// Why a loop joint cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoopJointError {
    /// Both sides are the world.
    #[error("loop joint '{0}' joins the world to itself; one side must be a part of an object")]
    NoPart(String),
    /// Both sides are the same part.
    #[error("loop joint '{0}' joins a part to itself; its sides must be two parts, or a part and the world")]
    SamePart(String),
    /// The object or part of a side does not exist.
    #[error("loop joint '{name}': there is no such object, or it has no part {part}")]
    Gone {
        /// Loop joint.
        name: String,
        /// Part of the side.
        part: usize,
    },
    /// A frame, point or axis is not finite.
    #[error("loop joint '{0}': a frame, point or axis is not finite")]
    NotFinite(String),
    /// The axis has length 0.
    #[error("loop joint '{0}': the axis has length 0; it must have a direction")]
    Axis(String),
}

/// Deviation of the two sides from the constraint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PositionError {
    /// Distance of the origins, m; of a prismatic joint, the distance from its line.
    pub distance: f64,
    /// Angle between the frames, rad; of a revolute joint, between its axes; 0 for a spherical
    /// joint.
    pub angle: f64,
}

/// A joint between two parts of any objects. It has no state. It makes no rows while a side is
/// missing or not enabled.
///
/// ```
/// # use tumble_core::{LoopJoint, RigidBody, Settings, World, collide::{Shape, Vec3}};
/// # let mut world = World::new(Settings::default())?;
/// # let door = world.add(RigidBody::new(Shape::cuboid(Vec3::new(0.8, 0.04, 2.0))?).with_name("door").with_mass(20.0))?;
/// # let (point, axis) = (Vec3::new(-0.4, 0.0, 0.0), Vec3::z());
/// let hinge = LoopJoint::revolute_at("hinge", &world, Some((door, 0)), None, point, axis)?;
/// world.add(hinge)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct LoopJoint {
    name: String,
    kind: LoopJointKind,
    a: Anchor,
    b: Anchor,
}

type PartRef = Option<(ObjectId, usize)>;

impl LoopJoint {
    /// Joins two frames. Frames that do not coincide are brought together at
    /// [`recovery_speed`](crate::Settings::recovery_speed).
    ///
    /// # Errors
    /// [`LoopJointError::NoPart`] or [`LoopJointError::SamePart`] for sides that are the same,
    /// [`LoopJointError::NotFinite`] for frames that are not finite.
    pub fn new(
        name: impl Into<String>,
        kind: LoopJointKind,
        a: Anchor,
        b: Anchor,
    ) -> Result<LoopJoint, LoopJointError> {
        let name = name.into();
        if a.part.is_none() && b.part.is_none() {
            return Err(LoopJointError::NoPart(name));
        }
        if a.part == b.part {
            return Err(LoopJointError::SamePart(name));
        }
        if [a, b].iter().any(|side| side.frame.to_homogeneous().iter().any(|x| !x.is_finite())) {
            return Err(LoopJointError::NotFinite(name));
        }
        Ok(LoopJoint { name, kind, a, b })
    }

    /// Joins two parts in their present poses by a spherical joint at a world point (m).
    ///
    /// # Errors
    /// [`LoopJointError`] if the sides are the same, a part does not exist, or the point is not
    /// finite.
    pub fn spherical_at(
        name: impl Into<String>,
        world: &World,
        a: PartRef,
        b: PartRef,
        point: Vec3,
    ) -> Result<LoopJoint, LoopJointError> {
        LoopJoint::at(name.into(), LoopJointKind::Spherical, world, [a, b], point, Vec3::z())
    }

    /// Joins two parts in their present poses by a revolute joint at a world point (m) about a
    /// world axis (any length but 0).
    ///
    /// # Errors
    /// [`LoopJointError`] if the sides are the same, a part does not exist, or the point or axis is
    /// not valid.
    pub fn revolute_at(
        name: impl Into<String>,
        world: &World,
        a: PartRef,
        b: PartRef,
        point: Vec3,
        axis: Vec3,
    ) -> Result<LoopJoint, LoopJointError> {
        LoopJoint::at(name.into(), LoopJointKind::Revolute, world, [a, b], point, axis)
    }

    /// Joins two parts rigidly in their present poses. The world point (m) is the origin of both
    /// frames; it affects only the reported errors.
    ///
    /// # Errors
    /// [`LoopJointError`] if the sides are the same, a part does not exist, or the point is not
    /// finite.
    pub fn fixed_at(
        name: impl Into<String>,
        world: &World,
        a: PartRef,
        b: PartRef,
        point: Vec3,
    ) -> Result<LoopJoint, LoopJointError> {
        LoopJoint::at(name.into(), LoopJointKind::Fixed, world, [a, b], point, Vec3::z())
    }

    /// Joins two parts in their present poses by a prismatic joint along a world axis (any length
    /// but 0) through a world point (m).
    ///
    /// # Errors
    /// [`LoopJointError`] if the sides are the same, a part does not exist, or the point or axis is
    /// not valid.
    pub fn prismatic_at(
        name: impl Into<String>,
        world: &World,
        a: PartRef,
        b: PartRef,
        point: Vec3,
        axis: Vec3,
    ) -> Result<LoopJoint, LoopJointError> {
        LoopJoint::at(name.into(), LoopJointKind::Prismatic, world, [a, b], point, axis)
    }

    fn at(
        name: String,
        kind: LoopJointKind,
        world: &World,
        parts: [PartRef; 2],
        point: Vec3,
        axis: Vec3,
    ) -> Result<LoopJoint, LoopJointError> {
        if point.iter().chain(axis.iter()).any(|x| !x.is_finite()) {
            return Err(LoopJointError::NotFinite(name));
        }
        let Some(z) = axis.try_normalize(0.0) else { return Err(LoopJointError::Axis(name)) };
        let x = z.cross(&Vec3::ith(z.iamin(), 1.0)).normalize();
        let axes = Mat3::from_columns(&[x, z.cross(&x), z]);
        let rotation = Quat::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        let frame = Pose::from_parts(Translation3::from(point), rotation);
        let mut sides = [Anchor::world(frame); 2];
        for (side, part) in sides.iter_mut().zip(parts) {
            if let Some((id, part)) = part {
                let part_state =
                    world.part_state(id, part).ok_or_else(|| LoopJointError::Gone { name: name.clone(), part })?;
                *side = Anchor::on(id, part, part_state.pose.inverse() * frame);
            }
        }
        LoopJoint::new(name, kind, sides[0], sides[1])
    }

    /// Returns the motion that the joint leaves free.
    pub fn kind(&self) -> LoopJointKind {
        self.kind
    }

    /// Returns its two sides, A and B.
    pub fn sides(&self) -> [Anchor; 2] {
        [self.a, self.b]
    }

    /// Returns the deviation of the sides in a view of the world; `None` while the joint makes no
    /// rows.
    pub fn position_error(&self, view: &WorldView) -> Option<PositionError> {
        let pair = EndPair { a: JointEnd::of(&self.a, view)?, b: JointEnd::of(&self.b, view)? };
        let mut d = pair.a.p() - pair.b.p();
        if self.kind == LoopJointKind::Prismatic {
            let z = pair.b.axis(2);
            d -= z * z.dot(&d);
        }
        let angle = match self.kind {
            LoopJointKind::Spherical => 0.0,
            LoopJointKind::Revolute => pair.axis_deviation().norm(),
            LoopJointKind::Fixed | LoopJointKind::Prismatic => pair.rotation_error().norm(),
        };
        Some(PositionError { distance: d.norm(), angle })
    }
}

/// One side in a view of the world.
struct JointEnd {
    part: PartRef,
    /// State of the part, with the accelerations at zero force.
    part_state: PartState,
    frame: Pose,
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

    fn p(&self) -> Vec3 {
        self.frame.translation.vector
    }

    fn axis(&self, k: usize) -> Vec3 {
        self.frame.rotation * Vec3::ith(k, 1.0)
    }

    /// Returns `p̈` of the side's material point at `p`.
    fn bias_acceleration_at(&self, p: &Vec3) -> Vec3 {
        self.part_state.acceleration_following(p, &self.part_state.velocity_at(p))
    }
}

struct EndPair {
    a: JointEnd,
    b: JointEnd,
}

impl EndPair {
    fn sides(&self) -> [(&JointEnd, f64); 2] {
        [(&self.a, 1.0), (&self.b, -1.0)]
    }

    fn omega(&self) -> Vec3 {
        self.a.part_state.angular_velocity - self.b.part_state.angular_velocity
    }

    fn alpha(&self) -> Vec3 {
        self.a.part_state.angular_acceleration - self.b.part_state.angular_acceleration
    }

    /// Returns `log(R_A·R_Bᵀ)`, world axes.
    fn rotation_error(&self) -> Vec3 {
        (self.a.frame.rotation * self.b.frame.rotation.inverse()).scaled_axis()
    }

    /// Returns the shortest rotation vector that takes `z_B` to `z_A`.
    fn axis_deviation(&self) -> Vec3 {
        let (za, zb) = (self.a.axis(2), self.b.axis(2));
        let (cross, cos) = (zb.cross(&za), zb.dot(&za));
        let sin = cross.norm();
        match sin {
            0.0 if cos < 0.0 => self.b.axis(0) * std::f64::consts::PI,
            0.0 => cross,
            _ => cross * (RealField::atan2(sin, cos) / sin),
        }
    }

    /// Adds the rows that keep the origins together.
    fn coincident_origins(&self, out: &mut RowBuilder) {
        let (pa, pb) = (self.a.p(), self.b.p());
        let (error, bias) = (pa - pb, self.a.bias_acceleration_at(&pa) - self.b.bias_acceleration_at(&pb));
        for (k, e) in WORLD_AXES.iter().enumerate() {
            self.translation(out, [&pa, &pb], e, error[k], bias[k]);
        }
    }

    /// Adds the rows that keep A's origin on the line through B's origin along `z_B`.
    fn origin_on_line(&self, out: &mut RowBuilder) {
        let (p, state_b) = (self.a.p(), &self.b.part_state);
        let (d, rate) = (p - self.b.p(), self.a.part_state.velocity_at(&p));
        let slip = rate - state_b.velocity_at(&p);
        let slip_rate = self.a.bias_acceleration_at(&p) - state_b.acceleration_following(&p, &rate);
        for t in [self.b.axis(0), self.b.axis(1)] {
            let bias = t.dot(&slip_rate) + state_b.angular_velocity.cross(&t).dot(&slip);
            self.translation(out, [&p, &p], &t, t.dot(&d), bias);
        }
    }

    /// Adds the rows that keep the rotations of the frames equal.
    fn equal_rotations(&self, out: &mut RowBuilder) {
        let (error, bias) = (self.rotation_error(), self.alpha());
        for (k, e) in WORLD_AXES.iter().enumerate() {
            self.rotation(out, e, error[k], bias[k]);
        }
    }

    /// Adds the rows that keep `z_A` along `z_B`.
    fn axis(&self, out: &mut RowBuilder) {
        let (error, omega, alpha) = (self.axis_deviation(), self.omega(), self.alpha());
        for t in [self.b.axis(0), self.b.axis(1)] {
            let bias = t.dot(&alpha) + self.b.part_state.angular_velocity.cross(&t).dot(&omega);
            self.rotation(out, &t, t.dot(&error), bias);
        }
    }

    fn translation(&self, out: &mut RowBuilder, points: [&Vec3; 2], axis: &Vec3, error: f64, bias: f64) {
        let row = out.row(RowTarget { bias_acceleration: bias, ..RowTarget::new(RowSet::Equality, error) });
        for ((end, sign), p) in self.sides().into_iter().zip(points) {
            end.part.into_iter().for_each(|(id, part)| {
                row.on_point(id, part, p, axis, sign);
            });
        }
    }

    fn rotation(&self, out: &mut RowBuilder, axis: &Vec3, error: f64, bias: f64) {
        let row = out.row(RowTarget { bias_acceleration: bias, ..RowTarget::new(RowSet::Equality, error) });
        for (end, sign) in self.sides() {
            end.part.into_iter().for_each(|(id, part)| {
                row.on_rotation(id, part, axis, sign);
            });
        }
    }
}

const WORLD_AXES: [Vec3; 3] = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];

impl Object for LoopJoint {
    fn name(&self) -> &str {
        &self.name
    }

    fn constraint(&self) -> Option<&dyn Constraint> {
        Some(self)
    }
}

impl Constraint for LoopJoint {
    fn partners(&self, out: &mut Vec<ObjectId>) -> bool {
        out.extend([&self.a, &self.b].into_iter().filter_map(|end| end.part).map(|(id, _)| id));
        true
    }

    fn rows(&self, _me: &StateRange, view: &WorldView, _level: Level, out: &mut RowBuilder) {
        let (Some(a), Some(b)) = (JointEnd::of(&self.a, view), JointEnd::of(&self.b, view)) else { return };
        let pair = EndPair { a, b };
        match self.kind {
            LoopJointKind::Prismatic => pair.origin_on_line(out),
            _ => pair.coincident_origins(out),
        }
        match self.kind {
            LoopJointKind::Spherical => {}
            LoopJointKind::Revolute => pair.axis(out),
            LoopJointKind::Fixed | LoopJointKind::Prismatic => pair.equal_rotations(out),
        }
    }
}
