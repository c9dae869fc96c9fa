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
//! **Degrees of freedom.** Each one that a kind leaves free has a position with a row of its rate (`Coordinate`):
//!
//! ```text
//! position                                     rate       w
//! angle about z_B      ∠(x_B, x_A)             w·ω        z_B
//! Cardan's angles      about z_A; about x_B    w·ω        reciprocal basis of (z_A, x_B)
//! rotation vector r    log(R_Bᵀ·R_A), per axis w·ω        x_B, y_B, z_B           drives pull along log(R_Bᵀ·R_A·R_*ᵀ)
//! springs of it        log(R_Bᵀ·R_A·R_*ᵀ)      w·ω        R_B·J⁻ᵀ(r)·e            J⁻¹(r) = 1 − ½[r] + c·[r]²
//! displacement         t·d,  t = x_B, y_B, z_B t·s(p_A)
//! length               |d|                     n·ḋ
//! swing (cone)         θ                       w·ω        n
//! twist                2·atan2(q_z, q_w)       w·ω        (z_A + z_B)/(1 + z_A·z_B)     q = R_Bᵀ·R_A
//! ```
//!
//! It has the settings of a degree of freedom ([`DofSettings`]), whose rows are those of a joint of an articulated body. A spherical joint has
//! limits of swing and twist instead of those of its rotations. Only the spring differs: with implicit rows it
//! is the implicit midpoint rule, which is stable at any stiffness and keeps energy,
//!
//! ```text
//! λ = −h·k·(q_½ − rest),    q_½ = q₀ + ½h·(q̇₀ + q̇₁)/2    as a soft row:    R = 4/(k·h²),    q̇* = q̇₀ − 4·(q_f − rest)/h
//! ```
//!
//! with `q_f = q₀ + ½h·q̇₀`, the position in the view. Otherwise springs, damping and position drives
//! are forces.
//!
//! **Armature** `I` is an inertia between the two sides along a degree of freedom: `M + JᵀIJ` instead of `M`. Bodies keep their
//! own masses, so it is a row ([`RowTarget::inertial`]), which has the same solution:
//!
//! ```text
//! λ = −I·(q̇⁺ − q̇₀)     as a soft row:    R = 1/I, target q̇₀
//! ```

mod at;
mod coordinate;
mod error;
mod force;
mod kind;
mod pair;
mod settings;
mod transmission;
mod turns;

pub use at::{Anchor, JointPlace};
pub(crate) use coordinate::JointCoordinate;
pub use error::LoopJointError;
pub use force::JointForce;
pub use kind::LoopJointKind;
pub use transmission::Transmission;
pub(crate) use turns::WIDE;

use crate::articulated::{DofSettings, Drive};
use crate::constraint::builder::RowBuilder;
use crate::constraint::dof_rows::DofState;
use crate::constraint::rows::RowSet;
use crate::object::part_state::{Forces, StateRange};
use crate::object::{Constraint, ForceGenerator, FrameState, Level, Object, RowTarget, SpringRow};
use crate::world::view::{ObjectId, WorldView};
use pair::{Coordinate, EndPair, JointRow, Motion, Term};
use smallvec::SmallVec;
use std::f64::consts::{PI, TAU};
use tumble_collide::Vec3;

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
    /// Settings of each degree of freedom; one of default settings for kinds without any.
    dofs: Vec<FreeDof>,
    cone: Option<f64>,
    twist_limits: Option<[f64; 2]>,
    /// `None` of a pulley that has the length by default, and of kinds without a length.
    length: Option<f64>,
    breaking_force: f64,
    breaking_torque: f64,
    transmission: Transmission,
    /// Itself in the world that it was added to.
    own: Option<ObjectId>,
}

/// The settings of a degree of freedom.
#[derive(Clone, Debug, Default, PartialEq)]
struct FreeDof {
    settings: DofSettings,
    /// kg·m² or kg.
    armature: f64,
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
            dofs: vec![FreeDof::default(); kind.dofs().max(1)],
            cone: None,
            twist_limits: None,
            length: (kind.has_length() && kind != LoopJointKind::Pulley).then_some(1.0),
            breaking_force: f64::INFINITY,
            breaking_torque: f64::INFINITY,
            transmission: Transmission::default(),
            own: None,
        })
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

    /// Returns the deviation of the sides in a view of the world; `None` while the joint makes no
    /// rows.
    pub fn position_error(&self, view: &WorldView) -> Option<PositionError> {
        let pair = self.pair(view)?;
        let (mut distance, mut angle) = (0.0, 0.0);
        pair.held(self.kind, self.length(), &self.transmission, &mut |row| {
            let turns = row.terms.iter().flatten().all(|term| term.motion == Motion::Rotation);
            *(if turns { &mut angle } else { &mut distance }) += row.target.error.powi(2);
        });
        let mut error = PositionError { distance: distance.sqrt(), angle: angle.sqrt() };
        if matches!(self.kind, LoopJointKind::Rope | LoopJointKind::Pulley) {
            let first = self.coordinates(&pair).first().map(|c| (c.position - self.length()).max(0.0));
            error.distance = first.unwrap_or_default();
        }
        Some(error)
    }

    /// Returns its position, rad or m, and its rate in a view of the world: those of its first degree of freedom, or of
    /// the swing of a spherical joint. `None` if it has none, or makes no rows.
    pub fn position(&self, view: &WorldView) -> Option<[f64; 2]> {
        if self.kind == LoopJointKind::Spherical {
            let swing = self.pair(view)?.swing();
            return Some([swing.position, swing.rate]);
        }
        self.position_at(0, view)
    }

    /// Returns the position of degree of freedom `k`, rad or m, and its rate in a view of the world; see
    /// [`LoopJointKind::dofs`]. `None` if there is no such degree of freedom, or the joint makes no rows.
    pub fn position_at(&self, k: usize, view: &WorldView) -> Option<[f64; 2]> {
        let coordinate = *self.coordinates(&self.pair(view)?).get(k)?;
        Some([coordinate.position, coordinate.rate])
    }

    fn pair(&self, view: &WorldView) -> Option<EndPair> {
        EndPair::of([&self.a, &self.b], view, self.middle(view))
    }

    /// Returns the positions of its degrees of freedom, with angles near the middle of their limits.
    fn coordinates(&self, pair: &EndPair) -> SmallVec<[Coordinate; 3]> {
        let mut all = pair.coordinates(self.kind, &self.transmission);
        for (k, coordinate) in all.iter_mut().enumerate() {
            let middle = match self.kind {
                LoopJointKind::Spherical => continue,
                LoopJointKind::Revolute => pair.middle,
                _ => self.middle_of_limits(k),
            };
            if self.kind.turns_at(k) {
                coordinate.position = near(coordinate.position, middle);
            }
        }
        all
    }

    /// Returns the positions that springs see, with the rows along which they pull.
    fn sprung(&self, pair: &EndPair, coordinates: &[Coordinate]) -> SmallVec<[Coordinate; 3]> {
        if self.kind != LoopJointKind::Spherical {
            return coordinates.into();
        }
        let from = self.goals(|dof| dof.spring.map(|spring| spring.rest));
        let turned = pair.turned_from(&from).into_iter().zip(from.iter());
        turned.map(|(turned, from)| Coordinate { position: from + turned.position, ..turned }).collect()
    }

    /// Returns the goals of a spherical joint, 0 where there is none.
    fn goals(&self, goal: impl Fn(&DofSettings) -> Option<f64>) -> Vec3 {
        Vec3::from_fn(|k, _| goal(&self.dofs[k].settings).unwrap_or(0.0))
    }

    /// Returns the positions that drives see, `goal + e` with the way `e` from there: an angle without limits goes the
    /// shorter way.
    fn driven(&self, pair: &EndPair, coordinates: &[Coordinate]) -> SmallVec<[f64; 3]> {
        let target = |dof: &DofSettings| match &dof.drive {
            Drive::Position { target, .. } => Some(*target),
            _ => None,
        };
        if self.kind == LoopJointKind::Spherical {
            let from = self.goals(target);
            return (from + pair.turn_from(&from)).iter().copied().collect();
        }
        let mut positions: SmallVec<[f64; 3]> = coordinates.iter().map(|coordinate| coordinate.position).collect();
        for (k, position) in positions.iter_mut().enumerate() {
            let settings = &self.dofs[k].settings;
            let turns = self.kind.turns_at(k) && settings.limits.is_none();
            if let (true, Some(target)) = (turns, target(settings)) {
                *position = near(*position, target);
            }
        }
        positions
    }

    /// Returns the limits of degree of freedom `k`, and the length of a rope.
    fn limits(&self, k: usize) -> Option<[f64; 2]> {
        let limits = self.dofs[k].settings.limits;
        match self.kind {
            LoopJointKind::Rope | LoopJointKind::Pulley => {
                let [lo, hi] = limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                Some([lo, hi.min(self.length())])
            }
            _ => limits,
        }
    }

    /// Calls `act` with the one-sided rows of the limits, in their order: coordinate, sign and gap.
    fn stops(&self, pair: &EndPair, coordinates: &[Coordinate], mut act: impl FnMut(&Coordinate, f64, f64)) {
        let mut both = |coordinate: &Coordinate, [lo, hi]: [f64; 2]| {
            let gaps = [(1.0, coordinate.position - lo), (-1.0, hi - coordinate.position)];
            gaps.into_iter().filter(|(_, gap)| gap.is_finite()).for_each(|(sign, gap)| act(coordinate, sign, gap));
        };
        for (k, coordinate) in coordinates.iter().enumerate() {
            self.limits(k).into_iter().for_each(|limits| both(coordinate, limits));
        }
        self.cone.into_iter().for_each(|cone| both(&pair.swing(), [f64::NEG_INFINITY, cone]));
        if let Some(limits) = self.twist_limits {
            let mut twist = pair.twist();
            twist.position = near(twist.position, 0.5 * (limits[0] + limits[1]));
            both(&twist, limits);
        }
    }

    /// Returns whether it has more than the rows that hold it.
    fn has_settings(&self) -> bool {
        let tightens = matches!(self.kind, LoopJointKind::Rope | LoopJointKind::Pulley);
        let free = self.dofs.iter().all(|dof| *dof == FreeDof::default());
        tightens || !free || self.cone.is_some() || self.twist_limits.is_some()
    }

    /// Calls `row` with all rows, in their order: held, limits, and for each degree of freedom velocity limits, friction,
    /// damping, spring, drive, armature.
    fn lay(&self, pair: &EndPair, level: Level, time: f64, row: &mut dyn FnMut(JointRow)) {
        pair.held(self.kind, self.length(), &self.transmission, row);
        if !self.has_settings() {
            return;
        }
        let coordinates = self.coordinates(pair);
        self.stops(pair, &coordinates, |coordinate, sign, gap| {
            row(coordinate.row(sign, RowTarget::new(RowSet::HalfLine, gap)));
        });
        let (sprung, driven) = (self.sprung(pair, &coordinates), self.driven(pair, &coordinates));
        for (k, (coordinate, dof)) in coordinates.iter().zip(&self.dofs).enumerate() {
            let (settings, limits) = (&dof.settings, dof.settings.limits);
            let state = DofState { q: driven[k], v: coordinate.rate, settings, limits };
            state.velocity_limits().for_each(|(sign, target)| row(coordinate.row(sign, target)));
            state.resistance(level, |target| row(coordinate.row(1.0, target)));
            let state = DofState { v: sprung[k].rate, ..state };
            if let (Some(target), Some(spring)) = (state.spring(level, sprung[k].position), settings.spring) {
                let (extension, damping) = (sprung[k].position - spring.rest, settings.damping);
                let spring = Some(SpringRow { extension, stiffness: spring.stiffness, damping });
                row(sprung[k].row(1.0, RowTarget { spring, ..target }));
            }
            let state = DofState { v: coordinate.rate, ..state };
            if let Some(target) = state.drive(level, time) {
                row(JointRow { drives: Some(k), ..coordinate.row(1.0, target) });
            }
            if dof.armature > 0.0 {
                row(coordinate.row(1.0, RowTarget::inertia(dof.armature)));
            }
        }
    }

    /// Calls `act` with the coordinates along which springs, damping and drives are forces and no rows, with the
    /// index of the degree of freedom, and with the forces: all of them, and that of the drive.
    fn explicit_forces(&self, pair: &EndPair, mut act: impl FnMut(&Coordinate, usize, [f64; 2])) {
        let coordinates = self.coordinates(pair);
        let (sprung, driven) = (self.sprung(pair, &coordinates), self.driven(pair, &coordinates));
        for (k, (coordinate, FreeDof { settings, .. })) in coordinates.iter().zip(&self.dofs).enumerate() {
            let resisted = settings.explicit_force(driven[k], coordinate.rate);
            let drive = resisted + settings.damping * coordinate.rate;
            act(&sprung[k], k, [settings.spring_force(sprung[k].position), 0.0]);
            act(coordinate, k, [resisted, drive]);
        }
    }

    /// Sets its name.
    pub(crate) fn set_name(&mut self, name: &str) {
        self.name = name.into();
    }

    fn without(&self, parameter: &'static str) -> LoopJointError {
        LoopJointError::Parameter { name: self.name.clone(), kind: self.kind, parameter }
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
pub(crate) fn near(angle: f64, middle: f64) -> f64 {
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

    fn attached_to(&self, other: ObjectId) -> bool {
        [&self.a, &self.b].into_iter().any(|side| side.is_on(other))
    }

    fn frame_state(&self) -> Option<&dyn FrameState> {
        self.counts_turns().then_some(self)
    }

    fn force(&self) -> Option<&dyn ForceGenerator> {
        self.dofs.iter().any(|dof| *dof != FreeDof::default()).then_some(self)
    }
}

impl Constraint for LoopJoint {
    fn partners(&self, out: &mut Vec<ObjectId>) -> bool {
        out.extend([&self.a, &self.b].into_iter().filter_map(|end| end.part).map(|(id, _)| id));
        true
    }

    fn joined_parts(&self) -> Option<[(ObjectId, usize); 2]> {
        Some([self.a.part?, self.b.part?]).filter(|_| self.kind.holds_together())
    }

    fn rows(&self, _me: &StateRange, view: &WorldView, level: Level, out: &mut RowBuilder) {
        let Some(pair) = self.pair(view) else { return };
        self.lay(&pair, level, view.time, &mut |row| pair.add(&row, out));
    }

    fn gaps(&self, _me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        if !self.has_settings() {
            return;
        }
        let Some(pair) = self.pair(view) else { return };
        self.stops(&pair, &self.coordinates(&pair), |_, _, gap| out.push(gap));
    }
}

impl ForceGenerator for LoopJoint {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        if view.implicit {
            return;
        }
        let Some(pair) = self.pair(view) else { return };
        self.explicit_forces(&pair, |coordinate, _, [force, _]| {
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
        let Some(pair) = self.pair(view).filter(|_| self.dofs.iter().any(|dof| dof.settings.spring.is_some())) else {
            return 0.0;
        };
        let springs = self.dofs.iter().map(|dof| dof.settings.spring);
        let stretched = springs.zip(self.sprung(&pair, &self.coordinates(&pair)));
        stretched.map(|(spring, q)| spring.map_or(0.0, |s| 0.5 * s.stiffness * (q.position - s.rest).powi(2))).sum()
    }

    fn kinetic(&self, view: &WorldView) -> f64 {
        let Some(pair) = self.pair(view).filter(|_| self.dofs.iter().any(|dof| dof.armature > 0.0)) else { return 0.0 };
        let rates = self.coordinates(&pair).into_iter().map(|coordinate| coordinate.rate);
        self.dofs.iter().zip(rates).map(|(dof, rate)| 0.5 * dof.armature * rate * rate).sum()
    }
}
