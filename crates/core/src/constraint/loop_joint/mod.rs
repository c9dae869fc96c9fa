//! Loop joints: joints by equality rows between any two parts of any two objects (future work of
//! the thesis, §VI).
//!
//! Each side has a frame in its part's axes: origin `p`, axes `x y z`. `s(q) = v_A(q) − v_B(q)` is
//! the velocity of A's material point at `q` relative to B's, `ω = ω_A − ω_B`, and `d = p_A − p_B`:
//!
//! ```text
//! rows                        error                       velocity           bias J̇·v
//! origins     e = X, Y, Z     e·d                         e·ṗ_A − e·ṗ_B      e·(p̈_A − p̈_B)
//! line        t = x_B, y_B    t·d                         t·s(p_A)           t·ds/dt + (ω_B × t)·s
//! plane       t = z_B         as a line
//! rotation    e = X, Y, Z     e·log(R_A·R_Bᵀ)             e·ω                e·(α_A − α_B)
//! axis        t = x_B, y_B    t·(z_B × z_A)·θ/sin θ       t·ω                t·(α_A − α_B) + (ω_B × t)·ω
//! across      n = z_A × x_B   asin(z_A·x_B)               n·ω/|n|            n·(α_A − α_B)/|n| + d(n/|n|)/dt·ω
//! distance    n = d/|d|       |d| − length                n·ḋ                n·d̈ + (|ḋ|² − (n·ḋ)²)/|d|
//! gear        z_A, z_B        θ_A + θ_B·n_B/n_A           z_A·ω_A + z_B·ω_B·n_B/n_A
//! rack        z_A, z_B        radius·θ_A − s_B            radius·z_A·ω_A − z_B·ṗ_B
//! screw       t = z_B         t·d − pitch·θ/2π            t·s(p_A) − t·ω·pitch/2π
//! swing       n = z_B × z_A/|…|  θ                        n·ω                n·(α_A − α_B) + dn/dt·ω
//!
//! spherical = origins    revolute = origins + axis    fixed = origins + rotation    prismatic = line + rotation
//! cylindrical = line + axis    planar = plane + axis    universal = origins + across
//!
//! Angles have no count of turns, except those of revolute joints with wide limits (`turns.rs`). The errors of gears, racks and screws need none: they are taken modulo a
//! tooth or a turn, so the ratio is exact over any number of turns.
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `X, Y, Z` | axes of the world: they do not turn, so these rows are smooth in any pose |
//! | `x_B, y_B, z_B` | axes of B's frame; most joints keep `z_A` on `z_B` |
//! | `p̈`, `α` | accelerations at constant generalized velocities: `ω × (ω × r)` of a rigid body, plus the terms of the joints above a link |
//! | `θ` | the angle between `z_A` and `z_B` |
//!
//! Velocities and biases are exact in any pose. Those of the origin and line rows are the
//! derivatives of their errors (`s(p_A)` contains the arm on which B's axes turn). The error of a
//! rotation is exact to first order and vanishes only at the solution: the position correction
//! reaches it in Newton steps.
//!
//! **Position.** Some kinds have one: the angle of A about `z_B` from `x_B`, the displacement
//! `z_B·d`, the length `|d|`, or the swing `θ` of a spherical joint, whose limit is a cone. It has the settings of a degree of freedom ([`DofSettings`]), whose
//! rows are those of a joint of an articulated body. A spherical joint has dry friction, damping and velocity
//! limits about each axis of B's frame instead, and no spring or drive. Only the spring differs: with implicit rows it
//! is the implicit midpoint rule, which is stable at any stiffness and keeps energy,
//!
//! ```text
//! λ = −h·k·(q_½ − rest),    q_½ = q₀ + ½h·(q̇₀ + q̇₁)/2    as a soft row:    R = 4/(k·h²),    q̇* = q̇₀ − 4·(q_f − rest)/h
//! ```
//!
//! with `q_f = q₀ + ½h·q̇₀`, the position in the view. Otherwise springs, damping and position drives
//! are forces.

mod at;
mod coordinate;
mod error;
mod force;
mod kind;
mod pair;
mod transmission;
mod turns;

pub use at::{Anchor, JointPlace};
pub(crate) use coordinate::JointCoordinate;
pub use error::LoopJointError;
pub use force::JointForce;
pub use kind::LoopJointKind;
pub use transmission::Transmission;

use crate::articulated::{DofSettings, Drive};
use crate::constraint::builder::RowBuilder;
use crate::constraint::dof_rows::DofState;
use crate::constraint::rows::RowSet;
use crate::object::part_state::{Forces, StateRange};
use crate::object::{Constraint, ForceGenerator, FrameState, Level, Object, RowTarget};
use crate::world::view::{ObjectId, WorldView};
use pair::{Coordinate, EndPair, JointRow, Motion, Term};
use std::f64::consts::{PI, TAU};

#[cfg(test)]
mod tests;

/// Deviation of the two sides from the constraint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PositionError {
    /// Distance of the origins, m, without the displacements that are free. For a rope, its excess
    /// length.
    pub distance: f64,
    /// Angle between the frames, rad, without the rotations that are free.
    pub angle: f64,
}

/// A joint between two parts of any objects. It makes no rows while a side is missing or not
/// enabled. A broken joint is disabled; [`World::set_enabled`](crate::World::set_enabled) mends it.
///
/// ```
/// # use tumble_core::{LoopJoint, RigidBody, Settings, World, collide::{Shape, Vec3}};
/// # let mut world = World::new(Settings::default())?;
/// # let door = world.add(RigidBody::new(Shape::cuboid(Vec3::new(0.8, 0.04, 2.0))?).with_name("door").with_mass(20.0))?;
/// # let (point, axis) = (Vec3::new(-0.4, 0.0, 0.0), Vec3::z());
/// let hinge = LoopJoint::revolute_at("hinge", &world, Some((door, 0)), None, point, axis)?;
/// world.add(hinge.with_limits([-1.0, 1.0])?.with_breaking_force(5000.0)?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct LoopJoint {
    name: String,
    kind: LoopJointKind,
    a: Anchor,
    b: Anchor,
    dof: DofSettings,
    length: f64,
    breaking_force: f64,
    breaking_torque: f64,
    transmission: Transmission,
    /// Itself in the world that it was added to.
    own: Option<ObjectId>,
}

type PartRef = Option<(ObjectId, usize)>;

impl LoopJoint {
    /// Joins two frames. Frames that do not coincide are brought together at
    /// [`recovery_speed`](crate::Settings::recovery_speed). The length of a distance, a rope or a spring
    /// is 1 m until it is [set](Self::with_length).
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
        if kind.joins_two_parts() && (a.part.is_none() || b.part.is_none()) {
            return Err(LoopJointError::OnePart(name, kind.name()));
        }
        if a.part == b.part {
            return Err(LoopJointError::SamePart(name));
        }
        if [a, b].iter().any(|side| side.frame.to_homogeneous().iter().any(|x| !x.is_finite())) {
            return Err(LoopJointError::NotFinite(name));
        }
        Ok(LoopJoint {
            name,
            kind,
            a,
            b,
            dof: DofSettings::default(),
            length: 1.0,
            breaking_force: f64::INFINITY,
            breaking_torque: f64::INFINITY,
            transmission: Transmission::default(),
            own: None,
        })
    }

    /// Sets the constants of a gear, a rack, a screw or a pulley. The length of a pulley that was made
    /// without one follows them: its rope is taut in the poses in which it was made.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for a constant out of its range.
    pub fn set_transmission(&mut self, transmission: Transmission) -> Result<(), LoopJointError> {
        if let Some((what, value, expected)) = transmission.range_error() {
            return Err(LoopJointError::Range { name: self.name.clone(), what, value, expected });
        }
        if self.kind == LoopJointKind::Pulley && self.length == self.transmission.rope_length() {
            self.length = transmission.rope_length();
        }
        self.transmission = transmission;
        Ok(())
    }

    /// Sets the teeth of two gears, the radius of a pinion, m, the pitch of a screw, m, or the ratio of a
    /// pulley, by a change of its constants.
    ///
    /// # Errors
    /// As [`set_transmission`](Self::set_transmission).
    pub fn with_transmission(mut self, change: impl FnOnce(&mut Transmission)) -> Result<Self, LoopJointError> {
        let mut transmission = self.transmission;
        change(&mut transmission);
        self.set_transmission(transmission)?;
        Ok(self)
    }

    /// Returns the constants of a gear, a rack, a screw or a pulley.
    pub fn transmission(&self) -> &Transmission {
        &self.transmission
    }

    /// Sets the settings of its position: limits, damping, friction, spring and drive. Those of a
    /// revolute joint are about an angle in (−π, π] without limits, and within π of the middle of its
    /// limits with them; with limits more than 3π/2 apart the angle is followed from frame to frame instead, so it does not
    /// pass its stops. A joint of a world gets other limits by [`World::change_joint`](crate::World::change_joint). The limits of a spherical joint are 0 and the half angle of a cone.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for a setting out of its range, and for limits that exclude the length that the joint
    /// keeps; [`LoopJointError::Kind`] for a joint without a position.
    pub fn set_dof(&mut self, dof: DofSettings) -> Result<(), LoopJointError> {
        if dof != DofSettings::default() && !self.kind.has_position() {
            return Err(self.wrong_kind("limits, damping, friction, springs and drives"));
        }
        if self.kind == LoopJointKind::Spherical {
            if dof.spring.is_some() || dof.drive != Drive::None {
                return Err(self.wrong_kind("springs and drives"));
            }
            let lower = dof.limits.map_or(0.0, |[lo, _]| lo);
            self.check("the lower limit of its swing", lower, lower == 0.0, "0: a cone has no lower limit")?;
        }
        if let Some((what, value, expected)) = dof.range_error(true) {
            return Err(LoopJointError::Range { name: self.name.clone(), what, value, expected });
        }
        let span = dof.limits.map_or(0.0, |[lo, hi]| hi - lo);
        if self.kind == LoopJointKind::Revolute && span > TAU {
            return Err(LoopJointError::Range {
                name: self.name.clone(),
                what: "the range of its limits",
                value: span,
                expected: "at most 2π: its angle has no count of turns",
            });
        }
        if let Some(limits) = dof.limits {
            self.check_limits(limits, self.length)?;
        }
        if let (LoopJointKind::Spring, Some(spring)) = (self.kind, dof.spring) {
            self.length = spring.rest;
        }
        self.dof = dof;
        Ok(())
    }

    /// Sets the length of a distance, a rope or a spring, m.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for a length that is not finite and at least 0, or that the limits exclude,
    /// [`LoopJointError::Kind`] for a joint without a length.
    pub fn set_length(&mut self, length: f64) -> Result<(), LoopJointError> {
        if !self.kind.has_length() {
            return Err(self.wrong_kind("length"));
        }
        self.check("the length", length, length.is_finite() && length >= 0.0, "finite and at least 0")?;
        if let Some(limits) = self.dof.limits {
            self.check_limits(limits, length)?;
        }
        self.length = length;
        if let (LoopJointKind::Spring, Some(spring)) = (self.kind, &mut self.dof.spring) {
            spring.rest = length;
        }
        Ok(())
    }

    /// Sets the force, N, and the torque about its point, N·m, above which the joint breaks; infinite
    /// if it does not.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for a number that is not above 0.
    pub fn set_breaking(&mut self, force: f64, torque: f64) -> Result<(), LoopJointError> {
        self.check("the breaking force", force, force > 0.0, "above 0; infinite for none")?;
        self.check("the breaking torque", torque, torque > 0.0, "above 0; infinite for none")?;
        (self.breaking_force, self.breaking_torque) = (force, torque);
        Ok(())
    }

    /// Sets the settings of its position.
    ///
    /// # Errors
    /// As [`set_dof`](Self::set_dof).
    pub fn with_dof(mut self, dof: DofSettings) -> Result<Self, LoopJointError> {
        self.set_dof(dof)?;
        Ok(self)
    }

    /// Sets the limits of its position, rad or m.
    ///
    /// # Errors
    /// As [`set_dof`](Self::set_dof).
    pub fn with_limits(self, limits: [f64; 2]) -> Result<Self, LoopJointError> {
        let dof = DofSettings { limits: Some(limits), ..self.dof.clone() };
        self.with_dof(dof)
    }

    /// Sets the largest swing of a spherical joint, rad: the half angle of a cone about the z axis of B's frame in
    /// which the z axis of A's stays.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for an angle below 0, [`LoopJointError::Kind`] for another kind.
    pub fn with_cone(self, angle: f64) -> Result<Self, LoopJointError> {
        match self.kind {
            LoopJointKind::Spherical => self.with_limits([0.0, angle]),
            _ => Err(self.wrong_kind("cone")),
        }
    }

    /// Sets the largest speed of its position, of a spherical joint that about each axis, rad/s or m/s.
    ///
    /// # Errors
    /// As [`set_dof`](Self::set_dof).
    pub fn with_max_velocity(self, max_velocity: f64) -> Result<Self, LoopJointError> {
        let dof = DofSettings { max_velocity, ..self.dof.clone() };
        self.with_dof(dof)
    }

    /// Sets the length of a distance, a rope or a spring, m.
    ///
    /// # Errors
    /// As [`set_length`](Self::set_length).
    pub fn with_length(mut self, length: f64) -> Result<Self, LoopJointError> {
        self.set_length(length)?;
        Ok(self)
    }

    /// Sets the force above which it breaks, N.
    ///
    /// # Errors
    /// As [`set_breaking`](Self::set_breaking).
    pub fn with_breaking_force(mut self, force: f64) -> Result<Self, LoopJointError> {
        self.set_breaking(force, self.breaking_torque)?;
        Ok(self)
    }

    /// Sets the torque above which it breaks, N·m.
    ///
    /// # Errors
    /// As [`set_breaking`](Self::set_breaking).
    pub fn with_breaking_torque(mut self, torque: f64) -> Result<Self, LoopJointError> {
        self.set_breaking(self.breaking_force, torque)?;
        Ok(self)
    }

    /// Returns the motion that the joint leaves free.
    pub fn kind(&self) -> LoopJointKind {
        self.kind
    }

    /// Returns its two sides, A and B.
    pub fn sides(&self) -> [Anchor; 2] {
        [self.a, self.b]
    }

    /// Joins another frame of the second side, which is finite.
    pub(crate) fn set_second_side(&mut self, b: Anchor) {
        self.b = b;
    }

    /// Returns the settings of its position.
    pub fn dof(&self) -> &DofSettings {
        &self.dof
    }

    /// Returns the largest swing of a spherical joint, rad; `None` without one.
    pub fn cone(&self) -> Option<f64> {
        self.dof.limits.filter(|_| self.kind == LoopJointKind::Spherical).map(|[_, cone]| cone)
    }

    /// Returns the length of a distance, a rope or a spring, m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Returns the force, N, and the torque, N·m, above which it breaks.
    pub fn breaking(&self) -> [f64; 2] {
        [self.breaking_force, self.breaking_torque]
    }

    /// Returns the deviation of the sides in a view of the world; `None` while the joint makes no
    /// rows.
    pub fn position_error(&self, view: &WorldView) -> Option<PositionError> {
        let pair = self.pair(view)?;
        let (mut distance, mut angle) = (0.0, 0.0);
        pair.held(self.kind, self.length, &self.transmission, &mut |row| {
            let turns = row.terms.iter().flatten().all(|term| term.motion == Motion::Rotation);
            *(if turns { &mut angle } else { &mut distance }) += row.target.error.powi(2);
        });
        let mut error = PositionError { distance: distance.sqrt(), angle: angle.sqrt() };
        if matches!(self.kind, LoopJointKind::Rope | LoopJointKind::Pulley) {
            error.distance =
                pair.coordinate(self.kind, &self.transmission).map_or(0.0, |c| (c.position - self.length).max(0.0));
        }
        Some(error)
    }

    /// Returns its position, rad or m, and its rate in a view of the world; `None` if it has none, or
    /// makes no rows.
    pub fn position(&self, view: &WorldView) -> Option<[f64; 2]> {
        let coordinate = self.coordinate(&self.pair(view)?)?;
        Some([coordinate.position, coordinate.rate])
    }

    fn pair(&self, view: &WorldView) -> Option<EndPair> {
        EndPair::of([&self.a, &self.b], view, self.middle(view))
    }

    /// Returns its position with the angle of a revolute joint near its limits or its target.
    fn coordinate(&self, pair: &EndPair) -> Option<Coordinate> {
        let mut coordinate = pair.coordinate(self.kind, &self.transmission)?;
        if self.kind == LoopJointKind::Revolute {
            coordinate.position = near(coordinate.position, pair.middle);
        }
        Some(coordinate)
    }

    /// Returns the angle that the drive turns about: without limits it goes the shorter way.
    fn driven(&self, position: f64) -> f64 {
        match (&self.dof.drive, self.dof.limits, self.kind) {
            (Drive::Position { target, .. }, None, LoopJointKind::Revolute) => near(position, *target),
            _ => position,
        }
    }

    fn limits(&self) -> Option<[f64; 2]> {
        match (self.kind, self.dof.limits) {
            (LoopJointKind::Rope | LoopJointKind::Pulley, limits) => {
                let [lo, hi] = limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                Some([lo, hi.min(self.length)])
            }
            (LoopJointKind::Spherical, Some([_, cone])) => Some([f64::NEG_INFINITY, cone]),
            (_, limits) => limits,
        }
    }

    /// Calls `row` with all rows, in their order: held, limits, velocity limits, friction, damping, spring, drive.
    fn lay(&self, pair: &EndPair, level: Level, time: f64, row: &mut dyn FnMut(JointRow)) {
        pair.held(self.kind, self.length, &self.transmission, row);
        let Some(coordinate) = self.coordinate(pair) else { return };
        for (sign, gap) in self.gaps_of(coordinate.position) {
            row(coordinate.row(sign, RowTarget::new(RowSet::HalfLine, gap)));
        }
        if self.kind == LoopJointKind::Spherical {
            return pair.rotations().iter().for_each(|about| self.lay_resistance(about, level, row));
        }
        self.lay_resistance(&coordinate, level, row);
        let Coordinate { position, rate, .. } = coordinate;
        if let (Some(spring), Some(soft)) = (self.dof.spring.filter(|s| s.stiffness > 0.0), level.soft_step()) {
            let h = level.h();
            let velocity = rate - 4.0 * (position - spring.rest) * soft / (h * h);
            let compliance = 4.0 / (spring.stiffness * h * h);
            let share = level.share();
            let target = RowTarget { velocity, compliance, share, ..RowTarget::new(RowSet::Equality, 0.0) };
            row(coordinate.row(1.0, target));
        }
        if let Some(target) = self.state(&coordinate).drive(level, time) {
            row(JointRow { drives: true, ..coordinate.row(1.0, target) });
        }
    }

    /// Calls `row` with the rows of the velocity limit, friction and damping of a coordinate.
    fn lay_resistance(&self, coordinate: &Coordinate, level: Level, row: &mut dyn FnMut(JointRow)) {
        let state = self.state(coordinate);
        state.velocity_limits().for_each(|(sign, target)| row(coordinate.row(sign, target)));
        state.resistance(level, |target| row(coordinate.row(1.0, target)));
    }

    fn state(&self, coordinate: &Coordinate) -> DofState<'_> {
        DofState { q: self.driven(coordinate.position), v: coordinate.rate, settings: &self.dof }
    }

    fn gaps_of(&self, position: f64) -> impl Iterator<Item = (f64, f64)> + use<> {
        let gaps = self.limits().map(|[lo, hi]| [(1.0, position - lo), (-1.0, hi - position)]);
        gaps.into_iter().flatten().filter(|(_, gap)| gap.is_finite())
    }

    /// Calls `act` with the coordinates along which springs, damping and drives are forces and no rows, and with
    /// these forces.
    fn explicit_forces(&self, pair: &EndPair, mut act: impl FnMut(&Coordinate, f64)) {
        if self.kind == LoopJointKind::Spherical {
            return pair.rotations().iter().for_each(|about| act(about, -self.dof.damping * about.rate));
        }
        let Some(coordinate) = self.coordinate(pair) else { return };
        let driven = self.driven(coordinate.position);
        let force = self.dof.spring_force(coordinate.position) + self.dof.explicit_force(driven, coordinate.rate);
        act(&coordinate, force);
    }

    fn wrong_kind(&self, what: &'static str) -> LoopJointError {
        LoopJointError::Kind { name: self.name.clone(), kind: self.kind.name(), what }
    }

    /// Checks that limits allow the length that the joint keeps.
    fn check_limits(&self, [lower, upper]: [f64; 2], length: f64) -> Result<(), LoopJointError> {
        match self.kind.limits_fault([lower, upper], length) {
            Some((what, value, expected)) => {
                Err(LoopJointError::Range { name: self.name.clone(), what, value, expected })
            }
            None => Ok(()),
        }
    }

    fn check(&self, what: &'static str, value: f64, fine: bool, expected: &'static str) -> Result<(), LoopJointError> {
        match fine {
            true => Ok(()),
            false => Err(LoopJointError::Range { name: self.name.clone(), what, value, expected }),
        }
    }
}

/// Returns an angle plus the number of turns that takes it within π of `middle`.
fn near(angle: f64, middle: f64) -> f64 {
    let turns = ((middle - angle + PI) / TAU).floor();
    angle + TAU * turns
}

impl Object for LoopJoint {
    fn name(&self) -> &str {
        &self.name
    }

    fn constraint(&self) -> Option<&dyn Constraint> {
        Some(self)
    }

    fn frame_state(&self) -> Option<&dyn FrameState> {
        self.counts_turns().then_some(self)
    }

    fn force(&self) -> Option<&dyn ForceGenerator> {
        (self.dof != DofSettings::default()).then_some(self)
    }
}

impl Constraint for LoopJoint {
    fn partners(&self, out: &mut Vec<ObjectId>) -> bool {
        out.extend([&self.a, &self.b].into_iter().filter_map(|end| end.part).map(|(id, _)| id));
        true
    }

    fn rows(&self, _me: &StateRange, view: &WorldView, level: Level, out: &mut RowBuilder) {
        let Some(pair) = self.pair(view) else { return };
        self.lay(&pair, level, view.time, &mut |row| pair.add(&row, out));
    }

    fn gaps(&self, _me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        let coordinate = self.limits().and_then(|_| self.coordinate(&self.pair(view)?));
        out.extend(coordinate.into_iter().flat_map(|c| self.gaps_of(c.position)).map(|(_, gap)| gap));
    }
}

impl ForceGenerator for LoopJoint {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        if view.implicit {
            return;
        }
        let Some(pair) = self.pair(view) else { return };
        self.explicit_forces(&pair, |coordinate, force| {
            for Term { side, motion, axis, factor } in coordinate.terms.into_iter().flatten() {
                let end = [&pair.a, &pair.b][side];
                let Some((id, part)) = end.part else { continue };
                let Some(index) = view.state_range(id).map(|range| range.parts.start + part) else { continue };
                match motion {
                    Motion::Point(p) => out.add_at(index, &end.part_state, factor * force * axis, &p),
                    Motion::Rotation => out.wrenches[index].torque += factor * force * axis,
                }
            }
        });
    }

    fn potential(&self, view: &WorldView) -> f64 {
        let Some(spring) = self.dof.spring else { return 0.0 };
        let coordinate = self.pair(view).and_then(|pair| self.coordinate(&pair));
        coordinate.map_or(0.0, |c| 0.5 * spring.stiffness * (c.position - spring.rest).powi(2))
    }
}
