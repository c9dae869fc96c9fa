//! Coupling of two joints by an equality row, whether they are loop joints or joints of articulated bodies.
//!
//! ```text
//! row        e = q − multiplier·q_of − offset        velocity  q̇ − multiplier·q̇_of        bias  q̈ − multiplier·q̈_of
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `q`, `q_of` | positions of the joint that follows and of that which it follows, rad or m |
//! | `q̈` | acceleration of a position at constant generalized velocities; 0 of a joint of an articulated body |
//!
//! Joints of articulated bodies count their turns. The angle of a revolute loop joint without limits does not: it has a
//! step of 2π where it passes ±π, so `e` has steps of 2π for the joint that follows and `multiplier·2π` for the other.
//! `e` is therefore taken modulo the largest number of which these steps are multiples:
//!
//! ```text
//! follows        2π          followed        2π·|m/n|          both        2π/n          with multiplier = m/n in lowest terms
//! ```
//!
//! Thus the ratio is exact over any number of turns. Two angles without limits have such a number only if the
//! multiplier is a ratio of whole numbers.
//!
//! A row acts on two objects at most (`constraint/rows.rs`). The two joints may join two dynamic objects altogether: two
//! hinges on the world, or any joints between links of two robots.

use crate::articulated::ArticulatedBody;
use crate::constraint::builder::RowBuilder;
use crate::constraint::loop_joint::{JointCoordinate, LoopJoint, LoopJointKind};
use crate::constraint::rows::RowSet;
use crate::object::part_state::{StateRange, Wrench};
use crate::object::{Constraint, Level, Object, RowTarget};
use crate::titled::titled;
use crate::world::World;
use crate::world::view::{ObjectId, WorldView};
use std::f64::consts::TAU;

/// Largest denominator and numerator of a multiplier between two angles without limits.
const MAX_DENOMINATOR: u32 = 1000;

/// A joint with one position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointRef {
    /// A loop joint with a position: an angle, a displacement or a length.
    LoopJoint(ObjectId),
    /// A degree of freedom of an articulated body: its index in `v`.
    Dof(ObjectId, usize),
}

impl JointRef {
    /// Returns the loop joint or the articulated body.
    pub fn object(&self) -> ObjectId {
        match self {
            JointRef::LoopJoint(id) | JointRef::Dof(id, _) => *id,
        }
    }
}

/// Why two joints cannot be coupled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MimicError {
    /// A joint is no joint with one position.
    #[error(
        "{}: {} is no joint that can be coupled: expected a loop joint with a position, other than a spherical one, or a revolute or prismatic joint of an articulated body",
        titled("mimic", name),
        if joint.is_empty() { "an object that was removed".into() } else { format!("'{joint}'") }
    )]
    Joint {
        /// Name of the coupling.
        name: String,
        /// Name of the object; empty if it was removed.
        joint: String,
    },
    /// Both joints are the same.
    #[error("{} couples a joint to itself; expected two joints", titled("mimic", .0))]
    Same(String),
    /// The joints move more than two objects.
    #[error(
        "{}: its joints join {count} dynamic objects; a row acts on at most two, such as two bodies on the world, or links of two robots",
        titled("mimic", name)
    )]
    Objects {
        /// Name of the coupling.
        name: String,
        /// Dynamic objects of both joints.
        count: usize,
    },
    /// A number is out of its range.
    #[error("{}: the {what} is {value}; it must be {expected}", titled("mimic", name))]
    Range {
        /// Name of the coupling.
        name: String,
        /// The number.
        what: &'static str,
        /// Value given.
        value: f64,
        /// Admissible range.
        expected: &'static str,
    },
}

/// A coupling of two joints: the position of one is `multiplier` times that of the other, plus `offset`. It makes no row
/// while a joint or a body of one is missing or not enabled.
///
/// ```
/// use tumble_core::prelude::*;
/// use tumble_core::{JointRef, LoopJoint, Mimic};
/// let mut world = World::default();
/// let arm = Shape::cuboid(Vec3::new(0.4, 0.1, 0.1))?;
/// let mut hinges = Vec::new();
/// for x in [0.0, 1.0] {
///     let arm = world.add(RigidBody::new(arm.clone()).with_mass(1.0).with_pose(Pose::translation(x, 0.0, 0.0)))?;
///     let hinge = LoopJoint::revolute_at(format!("hinge {x}"), &world, Some((arm, 0)), None, Vec3::new(x, 0.0, 0.0), Vec3::y())?;
///     hinges.push(JointRef::LoopJoint(world.add(hinge)?));
/// }
/// world.add(Mimic::between("mimic", &world, [hinges[1], hinges[0]], -2.0, 0.0)?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Mimic {
    name: String,
    joints: [JointRef; 2],
    /// Objects on which the row can act.
    objects: Vec<ObjectId>,
    multiplier: f64,
    offset: f64,
}

impl Mimic {
    /// Couples the first joint to the second one. The offset is in rad or m, as the position of the first.
    ///
    /// # Errors
    /// [`MimicError`] if a joint has no position, both are the same, they join more than two dynamic objects, or a number is
    /// out of its range.
    pub fn between(
        name: impl Into<String>,
        world: &World,
        joints: [JointRef; 2],
        multiplier: f64,
        offset: f64,
    ) -> Result<Mimic, MimicError> {
        let name = name.into();
        let mut objects = Vec::new();
        for joint in &joints {
            let known = objects_of(world, joint).ok_or_else(|| MimicError::Joint {
                name: name.clone(),
                joint: world.name(joint.object()).unwrap_or_default().to_string(),
            })?;
            objects.extend(known.into_iter().filter(|id| !objects.contains(id)).collect::<Vec<_>>());
        }
        let moves = |id: &&ObjectId| {
            let dof = world.object(**id).and_then(|object| object.integratable()).map_or(0, |i| i.state_sizes().dof);
            dof > 0 && world.status(**id).is_some_and(|status| status.mode == crate::Mode::Dynamic)
        };
        let count = objects.iter().filter(moves).count();
        if joints[0] == joints[1] {
            return Err(MimicError::Same(name));
        }
        if count > 2 {
            return Err(MimicError::Objects { name, count });
        }
        let mut mimic = Mimic { name, joints, objects, multiplier: 1.0, offset: 0.0 };
        mimic.set_ratio(multiplier, offset)?;
        match mimic.step(&world.view()) {
            Some(_) => Ok(mimic),
            None => Err(mimic.without_step()),
        }
    }

    /// Sets its name.
    pub(crate) fn set_name(&mut self, name: &str) {
        self.name = name.into();
    }

    fn without_step(&self) -> MimicError {
        let expected = "a ratio of whole numbers up to 1000 between two angles of loop joints without limits";
        self.range("multiplier", self.multiplier, expected)
    }

    /// Restores a coupling of an archive.
    pub(crate) fn restored(
        name: String,
        joints: [JointRef; 2],
        objects: Vec<ObjectId>,
        [multiplier, offset]: [f64; 2],
    ) -> Result<Mimic, MimicError> {
        let mut mimic = Mimic { name, joints, objects, multiplier: 1.0, offset: 0.0 };
        mimic.set_ratio(multiplier, offset)?;
        Ok(mimic)
    }

    /// Sets the multiplier and the offset, rad or m.
    fn set_ratio(&mut self, multiplier: f64, offset: f64) -> Result<(), MimicError> {
        if !multiplier.is_finite() || multiplier == 0.0 {
            return Err(self.range("multiplier", multiplier, "finite and not 0"));
        }
        if !offset.is_finite() {
            return Err(self.range("offset", offset, "finite"));
        }
        (self.multiplier, self.offset) = (multiplier, offset);
        Ok(())
    }

    fn range(&self, what: &'static str, value: f64, expected: &'static str) -> MimicError {
        MimicError::Range { name: self.name.clone(), what, value, expected }
    }

    /// Returns the joint that follows, and that which it follows.
    pub fn joints(&self) -> [JointRef; 2] {
        self.joints
    }

    /// Returns the multiplier and the offset, rad or m.
    pub fn ratio(&self) -> [f64; 2] {
        [self.multiplier, self.offset]
    }

    /// Returns the objects on which its row can act.
    pub(crate) fn objects(&self) -> &[ObjectId] {
        &self.objects
    }

    /// Returns `q − multiplier·q_of − offset`, rad or m; `None` while it makes no row.
    pub fn error(&self, view: &WorldView) -> Option<f64> {
        let [follower, leader] = self.joints.map(|joint| Position::of(joint, view));
        Some(self.error_of(&follower?, &leader?, self.step(view).unwrap_or(f64::INFINITY)))
    }

    /// Returns a coupling of the same joints with another multiplier and offset, rad or m.
    pub(crate) fn changed(&self, multiplier: f64, offset: f64, view: &WorldView) -> Result<Mimic, MimicError> {
        let mut changed = self.clone();
        changed.set_ratio(multiplier, offset)?;
        changed.step(view).ok_or_else(|| changed.without_step())?;
        Ok(changed)
    }

    /// Adds the wrenches of its force on the parts that loop joints join, each about the part's origin. Forces along joints
    /// of articulated bodies act between links, and are no loads.
    pub(crate) fn add_wrenches(&self, view: &WorldView, force: f64, out: &mut [Wrench]) {
        for (joint, factor) in self.joints.into_iter().zip([1.0, -self.multiplier]) {
            if let Some(Position::Loop(joint)) = Position::of(joint, view) {
                joint.add_wrenches(factor * force, view, out);
            }
        }
    }

    fn error_of(&self, follower: &Position, leader: &Position, step: f64) -> f64 {
        let error = follower.position() - self.multiplier * leader.position() - self.offset;
        if step.is_finite() { error - step * (error / step).round() } else { error }
    }

    /// Returns the step of the error: infinite if both positions are continuous, `None` if there is no common one.
    fn step(&self, view: &WorldView) -> Option<f64> {
        match self.joints.map(|joint| wraps(joint, view)) {
            [false, false] => Some(f64::INFINITY),
            [true, false] => Some(TAU),
            [false, true] => Some(TAU * self.multiplier.abs()),
            [true, true] => denominator(self.multiplier).map(|n| TAU / f64::from(n)),
        }
    }
}

/// Returns whether the position of a joint has a step of 2π.
fn wraps(joint: JointRef, view: &WorldView) -> bool {
    let JointRef::LoopJoint(id) = joint else { return false };
    view.get::<LoopJoint>(id).is_some_and(|joint| joint.kind().turns() && joint.dof().limits.is_none())
}

/// Returns the smallest whole number up to [`MAX_DENOMINATOR`] whose product with `ratio` is whole to rounding, and at most as
/// large.
fn denominator(ratio: f64) -> Option<u32> {
    (1..=MAX_DENOMINATOR).find(|n| {
        let product = ratio * f64::from(*n);
        let whole = (product - product.round()).abs() <= 4.0 * f64::EPSILON * product.abs();
        whole && product.round().abs() <= f64::from(MAX_DENOMINATOR)
    })
}

/// Returns the objects that a joint joins; `None` if it has no position, or is a spherical joint.
fn objects_of(world: &World, joint: &JointRef) -> Option<Vec<ObjectId>> {
    match joint {
        JointRef::LoopJoint(id) => {
            let joint = world.get::<LoopJoint>(*id)?;
            let coupled = joint.kind().has_position() && joint.kind() != LoopJointKind::Spherical;
            coupled.then(|| joint.sides().into_iter().filter_map(|side| side.part).map(|(id, _)| id).collect())
        }
        JointRef::Dof(id, dof) => world.get::<ArticulatedBody>(*id)?.position_of(*dof).map(|_| vec![*id]),
    }
}

/// The position of a joint in a view of the world, with what its row acts on.
enum Position {
    Loop(Box<JointCoordinate>),
    Dof { body: ObjectId, dof: usize, of: usize, position: f64 },
}

impl Position {
    fn of(joint: JointRef, view: &WorldView) -> Option<Position> {
        match joint {
            JointRef::LoopJoint(id) => {
                view.status(id).filter(|status| status.enabled)?;
                view.get::<LoopJoint>(id)?.joint_coordinate(view).map(Box::new).map(Position::Loop)
            }
            JointRef::Dof(body, dof) => {
                view.status(body).filter(|status| status.enabled)?;
                let object = view.get::<ArticulatedBody>(body)?;
                let x = view.state_range(body)?.x.start + object.position_of(dof)?;
                Some(Position::Dof { body, dof, of: object.model().dof(), position: view.x[x] })
            }
        }
    }

    fn position(&self) -> f64 {
        match self {
            Position::Loop(joint) => joint.position(),
            Position::Dof { position, .. } => *position,
        }
    }

    fn bias(&self) -> f64 {
        match self {
            Position::Loop(joint) => joint.bias(),
            Position::Dof { .. } => 0.0,
        }
    }

    /// Adds `factor` times the rate to the open row.
    fn add(&self, factor: f64, out: &mut RowBuilder) {
        match self {
            Position::Loop(joint) => joint.add(factor, out),
            Position::Dof { body, dof, of, .. } => {
                let mut jacobian = vec![0.0; *of];
                jacobian[*dof] = factor;
                out.on_coordinates(*body, &jacobian);
            }
        }
    }
}

impl Object for Mimic {
    fn name(&self) -> &str {
        &self.name
    }

    fn constraint(&self) -> Option<&dyn Constraint> {
        Some(self)
    }

    fn attached_to(&self, other: ObjectId) -> bool {
        self.joints.iter().any(|joint| joint.object() == other)
    }
}

impl Constraint for Mimic {
    fn partners(&self, out: &mut Vec<ObjectId>) -> bool {
        out.extend(&self.objects);
        true
    }

    fn rows(&self, _: &StateRange, view: &WorldView, _: Level, out: &mut RowBuilder) {
        let [Some(follower), Some(leader)] = self.joints.map(|joint| Position::of(joint, view)) else { return };
        let Some(step) = self.step(view) else { return out.refuse(self.without_step().to_string()) };
        let error = self.error_of(&follower, &leader, step);
        let bias_acceleration = follower.bias() - self.multiplier * leader.bias();
        out.row(RowTarget { bias_acceleration, ..RowTarget::new(RowSet::Equality, error) });
        follower.add(1.0, out);
        leader.add(-self.multiplier, out);
    }
}
