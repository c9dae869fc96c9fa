//! Ranges of the flat state, the state of parts, and the table of forces.

use std::ops::Range;
use tumble_collide::{Pose, Vec3};

/// Numbers of entries that an object needs in the world's tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StateSizes {
    /// Length of its range of the state `X`.
    pub x: usize,
    /// Degrees of freedom: length of its generalized velocity `v` and of its whitened velocity `u`.
    pub dof: usize,
    /// Rows in the table of part states: one per part.
    pub parts: usize,
}

/// An object's ranges in the world's tables. The world assigns them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StateRange {
    /// Range of the state `X`.
    pub x: Range<usize>,
    /// Range of generalized velocities, forces and whitened velocities.
    pub v: Range<usize>,
    /// Rows of the table of part states.
    pub parts: Range<usize>,
}

/// Pose, velocity and acceleration of one part, which all readers use: forces, constraints,
/// detection, renderers. World axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartState {
    /// Pose of the part's frame in the world, `X_WB`.
    pub pose: Pose,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vec3,
    /// Velocity of the frame's origin, m/s.
    pub velocity: Vec3,
    /// Angular acceleration, rad/s².
    pub angular_acceleration: Vec3,
    /// Acceleration of the frame's origin, m/s².
    pub acceleration: Vec3,
    /// Angular acceleration at constant generalized velocity (`J̇·v`), rad/s²: zero for a body
    /// whose generalized velocity is `[ω; v]`.
    pub bias_angular_acceleration: Vec3,
    /// Acceleration of the frame's origin at constant generalized velocity, m/s².
    pub bias_acceleration: Vec3,
}

impl Default for PartState {
    fn default() -> PartState {
        let zero = Vec3::zeros();
        PartState {
            pose: Pose::identity(),
            angular_velocity: zero,
            velocity: zero,
            angular_acceleration: zero,
            acceleration: zero,
            bias_angular_acceleration: zero,
            bias_acceleration: zero,
        }
    }
}

impl PartState {
    /// Returns the position of the frame's origin, meters.
    pub fn position(&self) -> Vec3 {
        self.pose.translation.vector
    }

    /// Returns the velocity of the material point at world point `p`, m/s: `v + ω × r`.
    pub fn velocity_at(&self, p: &Vec3) -> Vec3 {
        self.velocity + self.angular_velocity.cross(&(p - self.position()))
    }

    /// Returns the rate of change of [`velocity_at`](Self::velocity_at) along a point that is at
    /// `p` and moves at `p_rate`, m/s²: `a + α × r + ω × (ṗ − v)`. With `p_rate = velocity_at(p)`
    /// this is the material point's acceleration.
    pub fn acceleration_following(&self, p: &Vec3, p_rate: &Vec3) -> Vec3 {
        let r = p - self.position();
        self.acceleration + self.angular_acceleration.cross(&r) + self.angular_velocity.cross(&(p_rate - self.velocity))
    }
}

/// A material point of a part, and directions at it.
#[derive(Clone, Copy, Debug)]
pub struct PartPoint<'a> {
    /// Part of the object.
    pub part: usize,
    /// State of the part.
    pub part_state: &'a PartState,
    /// World point, m.
    pub point: Vec3,
    /// Directions, world axes, at least one.
    pub axes: &'a [Vec3],
}

impl PartPoint<'_> {
    /// Returns the vector from the part's origin to the point, m.
    pub fn arm(&self) -> Vec3 {
        self.point - self.part_state.position()
    }
}

/// A torque about the origin of a part's frame and a force, world axes, N·m and N.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Wrench {
    /// Torque about the origin of the part's frame, N·m.
    pub torque: Vec3,
    /// Force, N.
    pub force: Vec3,
}

impl Default for Wrench {
    fn default() -> Wrench {
        Wrench { torque: Vec3::zeros(), force: Vec3::zeros() }
    }
}

/// The table of forces, accumulated anew at each stage of an integrator, at the state and time of
/// that stage.
#[derive(Clone, Debug, Default)]
pub struct Forces {
    /// External wrench per part.
    pub wrenches: Vec<Wrench>,
    /// Generalized force per degree of freedom.
    pub generalized: Vec<f64>,
}

impl Forces {
    /// Adds a force (N, world axes) at world point `p` of the part in row `index` of the table of
    /// part states.
    pub fn add_at(&mut self, index: usize, part_state: &PartState, force: Vec3, p: &Vec3) {
        let wrench = &mut self.wrenches[index];
        wrench.force += force;
        wrench.torque += (p - part_state.position()).cross(&force);
    }

    pub(crate) fn slice<'a>(&'a self, state_range: &StateRange, part_states: &'a [PartState]) -> ForceSlice<'a> {
        ForceSlice {
            part_states,
            wrenches: &self.wrenches[state_range.parts.clone()],
            generalized: &self.generalized[state_range.v.clone()],
        }
    }
}

/// The range of one object in the table of forces.
#[derive(Clone, Copy, Debug)]
pub struct ForceSlice<'a> {
    /// State per part of the object.
    pub part_states: &'a [PartState],
    /// Wrench per part of the object.
    pub wrenches: &'a [Wrench],
    /// Generalized force per degree of freedom of the object.
    pub generalized: &'a [f64],
}

/// A force that acts at a point of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLoad {
    /// Part of the object.
    pub part: usize,
    /// The point, world axes, m.
    pub point: Vec3,
    /// The force, world axes, N.
    pub force: Vec3,
}
