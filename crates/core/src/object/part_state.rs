//! The flat state's vocabulary: where an object's numbers lie, what readers see of it, and what acts on it.

use std::ops::Range;
use tumble_collide::{Pose, Vec3};

/// How many numbers an object needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StateSizes {
    /// Length of its stretch of the state `X`.
    pub x: usize,
    /// Degrees of freedom: length of its generalized velocity `v` and of its whitened velocity `u`.
    pub dof: usize,
    /// Rows in the site table: one per collidable part.
    pub parts: usize,
}

/// An object's place in the world's tables, told by the world.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StateRange {
    /// Its stretch of the state `X`.
    pub x: Range<usize>,
    /// Its stretch of generalized velocities, forces and whitened velocities.
    pub v: Range<usize>,
    /// Its rows of the site table.
    pub parts: Range<usize>,
}

/// One collidable part as readers see it: springs, boids, the detector, the renderer. World axes.
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
    /// What the angular acceleration would be if the generalized velocity did not change (`J̇·v`), rad/s²: zero for a body whose generalized
    /// velocity is `[ω; v]`.
    pub bias_angular_acceleration: Vec3,
    /// The same of the origin's acceleration, m/s².
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
    /// Position of the frame's origin, meters.
    pub fn position(&self) -> Vec3 {
        self.pose.translation.vector
    }

    /// Velocity of the material point that is now at world point `p`, m/s: `v + ω × r`.
    pub fn velocity_at(&self, p: &Vec3) -> Vec3 {
        self.velocity + self.angular_velocity.cross(&(p - self.position()))
    }

    /// Rate of change of [`velocity_at`](Self::velocity_at) seen from a point that is at `p` and moves at `p_rate`, m/s²:
    /// `a + α × r + ω × (ṗ − v)`. With `p_rate = velocity_at(p)` this is the material point's acceleration.
    pub fn acceleration_following(&self, p: &Vec3, p_rate: &Vec3) -> Vec3 {
        let r = p - self.position();
        self.acceleration + self.angular_acceleration.cross(&r) + self.angular_velocity.cross(&(p_rate - self.velocity))
    }
}

/// Torque about a site's origin and force, world axes, N·m and N.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Wrench {
    /// Torque about the origin of the site's frame.
    pub torque: Vec3,
    /// Force.
    pub force: Vec3,
}

impl Default for Wrench {
    fn default() -> Wrench {
        Wrench { torque: Vec3::zeros(), force: Vec3::zeros() }
    }
}

/// The force table: accumulated anew at each stage of each integrator, at that stage's state and time.
#[derive(Clone, Debug, Default)]
pub struct Forces {
    /// External wrench per site.
    pub wrenches: Vec<Wrench>,
    /// Generalized force per coordinate.
    pub generalized: Vec<f64>,
}

impl Forces {
    /// Adds a force (N, world axes) that acts at world point `p` on row `index` of the site table.
    pub fn add_at(&mut self, index: usize, part_state: &PartState, force: Vec3, p: &Vec3) {
        let wrench = &mut self.wrenches[index];
        wrench.force += force;
        wrench.torque += (p - part_state.position()).cross(&force);
    }

    pub(crate) fn slice(&self, state_range: &StateRange) -> ForceSlice<'_> {
        ForceSlice {
            wrenches: &self.wrenches[state_range.parts.clone()],
            generalized: &self.generalized[state_range.v.clone()],
        }
    }
}

/// One object's part of the force table.
#[derive(Clone, Copy, Debug)]
pub struct ForceSlice<'a> {
    /// Wrench per site of the object.
    pub wrenches: &'a [Wrench],
    /// Generalized force per coordinate of the object.
    pub generalized: &'a [f64],
}
