//! Settings of one degree of freedom of an articulated body: limits, damping, dry friction, a
//! spring, a drive (thesis §III.B.7, §IV.A.4).
//!
//! Limits, dry friction and drives become rows, which are solved together with all contacts. In
//! `time_stepping` damping, springs and drives are implicit over a step `h`:
//!
//! ```text
//! position drive    τ = k(q* − q − h·q̇⁺) + c(q̇* − q̇⁺)      row  q̇⁺ + R·λ = (k(q* − q) + c·q̇*)/(c + h·k),   R = 1/(h(c + h·k)),   |λ| ≤ h·τ_max
//! damping           τ = −c·q̇⁺                               row  q̇⁺ + R·λ = 0,                               R = 1/(h·c)
//! spring            τ = k(q₀ − (q + q⁺)/2)                   row  q̇⁺ + R·λ = q̇ − 4(q + ½h·q̇ − q₀)/h,        R = 4/(h²k)
//! velocity drive    any τ with |τ| ≤ τ_max                   row  q̇⁺ = q̇*,                                    |λ| ≤ h·τ_max
//! dry friction      against the motion, |τ| ≤ τ_f            row  q̇⁺ = 0,                                     |λ| ≤ h·τ_f
//! velocity limit    −q̇_max ≤ q̇⁺ ≤ q̇_max                      rows ±q̇⁺ + q̇_max ≥ 0 ⟂ λ ≥ 0
//! ```
//!
//! so no gain is too stiff for the step. `backtracking` does the same, with forces that hold over
//! the sub-step, if any soft row changes its velocity by more than half of it. Otherwise the rows are
//! those of the middle of the sub-step with `verlet` (implicit midpoint rule), with `rk4` and `dormand_prince` too where a
//! world has rigid joints, and with the other integrators damping, springs and position drives are forces, as accurate as
//! the integrator. The rule of springs is the
//! implicit midpoint rule, which keeps their energy: a spring far stiffer than the step resolves swings by `±q` from step to
//! step and needs damping to come to rest. With damping it becomes implicit up to the backward Euler method (`step/springs.rs`).
//!
//! Settings of degree of freedom `k` of a spherical joint act about axis `k` of the link. Rest positions and targets of the
//! three are the components of one rotation vector `g` in the joint's frame, and the positions are `q = g + log(G⁻¹·R)` with
//! `G = exp(g)`: a drive pulls about the axis of the rotation that is left, if its gains are equal, and springs along the
//! gradients of the components (`rotation_vector.rs`), so they have a potential with any stiffnesses.
//!
//! | symbol | meaning |
//! |---|---|
//! | `q, q̇` | position (rad or m) and velocity of the degree of freedom; `⁺` at the end of the step |
//! | `q₀` | rest position of the spring |
//! | `k, c` | stiffness, N·m/rad or N/m, and damping, N·m·s/rad or N·s/m |
//! | `λ = h·τ` | impulse of the row |
//! | `q̇_max` | [`DofSettings::max_velocity`]: a stop that takes whatever force it needs, like a limit |

use crate::articulated::model::playback::Playback;
use crate::constraint::loop_joint::WIDE;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Settings of one degree of freedom. Floating joints support only damping, dry friction and velocity limits. Degree of freedom
/// `k` of a spherical joint is the rotation about axis `k` of the link; its rest position and target are component `k` of a
/// rotation vector in the joint's frame, x, y or z.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DofSettings {
    /// Lower and upper limit of the position, rad or m. Those of degree of freedom `k` of a spherical joint are 0 and the
    /// half angle, at most π, of a cone about axis `k` of the joint's frame, x, y or z, in which the same axis of the link stays.
    pub limits: Option<[f64; 2]>,
    /// Lower and upper limit, rad, within 2π of 0, of the turn about axis `k` of a spherical joint of an articulated body: that of
    /// the link about the axis, after the shortest turn of the joint's axis to it. `None` for all other joints; a loop joint
    /// has [its own](crate::LoopJoint::set_twist_limits).
    pub twist_limits: Option<[f64; 2]>,
    /// Viscous damping, N·m·s/rad or N·s/m, at least 0.
    pub damping: f64,
    /// Dry friction: maximum torque or force that resists motion, N·m or N, at least 0.
    pub friction: f64,
    /// Spring towards a rest position.
    pub spring: Option<Spring>,
    /// Motor.
    pub drive: Drive,
    /// Largest speed, rad/s or m/s, above 0; infinite for none. An impact may exceed it until the forces of
    /// the same step act.
    pub max_velocity: f64,
    /// Force of the motor that is built in, N·m or N, above 0: the limit of drives that name none. Infinite
    /// if it is not known.
    pub effort: f64,
}

impl Default for DofSettings {
    fn default() -> DofSettings {
        DofSettings {
            limits: None,
            twist_limits: None,
            damping: 0.0,
            friction: 0.0,
            spring: None,
            drive: Drive::None,
            max_velocity: f64::INFINITY,
            effort: f64::INFINITY,
        }
    }
}

/// A linear spring on a joint. It is implicit, so no stiffness is too large for the step; damping brings it to rest.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Spring {
    /// Stiffness, N·m/rad or N/m, at least 0.
    pub stiffness: f64,
    /// Rest position, rad or m.
    pub rest: f64,
}

/// A motor on one degree of freedom.
#[derive(Clone, Debug, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub enum Drive {
    /// No motor. [`World::apply_generalized`](crate::World::apply_generalized) applies torques of
    /// the caller.
    #[default]
    None,
    /// A proportional–derivative drive.
    Position {
        /// Stiffness, N·m/rad or N/m, at least 0.
        stiffness: f64,
        /// Damping, N·m·s/rad or N·s/m, at least 0. Stiffness or damping must be above 0.
        damping: f64,
        /// Target position, rad or m.
        target: f64,
        /// Target velocity, rad/s or m/s.
        velocity: f64,
        /// Maximum torque or force, N·m or N; may be infinite.
        limit: f64,
    },
    /// Holds a velocity as far as its maximum torque allows.
    Velocity {
        /// Target velocity, rad/s or m/s.
        target: f64,
        /// Maximum torque or force, N·m or N; may be infinite.
        limit: f64,
    },
    /// Follows a recorded motion exactly while the maximum torque suffices. A joint that has fallen
    /// behind follows at full torque in `time_stepping` and may oscillate about the motion. In
    /// `backtracking` it follows only the velocity.
    Playback {
        /// Position over time.
        #[serde(with = "tumble_collide::shared")]
        motion: Arc<Playback>,
        /// Maximum torque or force, N·m or N; may be infinite.
        limit: f64,
    },
}

/// Couples one degree of freedom to another, like URDF's `mimic`: `q = multiplier·q_of + offset`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Coupling {
    /// Velocity coordinate of the coupled degree of freedom.
    pub dof: usize,
    /// Velocity coordinate of the degree of freedom that it follows.
    pub of: usize,
    /// Ratio.
    pub multiplier: f64,
    /// Position at which the other's is 0, rad or m.
    pub offset: f64,
}

impl DofSettings {
    /// Returns the first setting out of its range for a degree of freedom of a spherical joint.
    pub(crate) fn spherical_range_error(&self) -> Option<(&'static str, f64, &'static str)> {
        let below = self.limits.and_then(|[lo, cone]| {
            let lower = (lo != 0.0).then_some(("the lower limit of the cone", lo, "0: a cone has no lower limit"));
            lower.or((!(0.0..=PI).contains(&cone)).then_some(("the cone", cone, "0 to π rad; no limits for none")))
        });
        let twist = self.twist_limits.and_then(twist_fault);
        below.or(twist).or(DofSettings { limits: None, twist_limits: None, ..self.clone() }.range_error(true))
    }

    /// Returns the first setting out of its range: name, value, admissible range.
    pub(crate) fn range_error(&self, positional: bool) -> Option<(&'static str, f64, &'static str)> {
        let least =
            |what, value: f64| (!(value.is_finite() && value >= 0.0)).then_some((what, value, "finite and at least 0"));
        let finite = |what, value: f64| (!value.is_finite()).then_some((what, value, "finite"));
        let limit = |value: f64| {
            (value.is_nan() || value < 0.0).then_some(("the drive's limit", value, "at least 0; infinite for none"))
        };
        if let Some([lo, _]) = self.twist_limits {
            return Some((
                "the lower limit of the twist",
                lo,
                "absent: spherical joints of articulated bodies have one",
            ));
        }
        if !positional && (self.limits.is_some() || self.spring.is_some() || self.drive != Drive::None) {
            return Some((
                "the number of degrees of freedom of its joint with limits, springs or drives",
                1.0,
                "0: only revolute, prismatic and spherical joints have them",
            ));
        }
        let [lo, hi] = self.limits.unwrap_or([-1.0, 1.0]);
        if lo.is_nan() || hi.is_nan() || lo > hi || lo == f64::INFINITY || hi == f64::NEG_INFINITY {
            return Some(("the lower limit", lo, "a number that is not above the upper limit"));
        }
        let spring = self.spring.unwrap_or(Spring { stiffness: 0.0, rest: 0.0 });
        let most =
            |what, value: f64| (value.is_nan() || value <= 0.0).then_some((what, value, "above 0; infinite for none"));
        let own = least("damping", self.damping).or(least("friction", self.friction));
        let own = own.or(most("the velocity limit", self.max_velocity)).or(most("the effort", self.effort));
        let own = own
            .or(least("the spring's stiffness", spring.stiffness))
            .or(finite("the spring's rest position", spring.rest));
        own.or(match &self.drive {
            Drive::None => None,
            Drive::Position { stiffness, damping, target, velocity, limit: most } => {
                least("the drive's stiffness", *stiffness)
                    .or(least("the drive's damping", *damping))
                    .or(finite("the drive's target", *target))
                    .or(finite("the drive's velocity", *velocity))
                    .or(limit(*most))
                    .or((stiffness + damping <= 0.0).then_some((
                        "the sum of the drive's stiffness and damping",
                        0.0,
                        "above 0",
                    )))
            }
            Drive::Velocity { target, limit: most } => finite("the drive's target", *target).or(limit(*most)),
            Drive::Playback { limit: most, .. } => limit(*most),
        })
    }

    /// Returns the generalized force of the spring, for steps whose rows are not implicit.
    pub(crate) fn spring_force(&self, q: f64) -> f64 {
        self.spring.map_or(0.0, |s| s.stiffness * (s.rest - q))
    }

    /// Returns the generalized force of damping and of a position drive, for steps whose rows are
    /// not implicit.
    pub(crate) fn explicit_force(&self, q: f64, v: f64) -> f64 {
        let drive = match &self.drive {
            Drive::Position { stiffness, damping, target, velocity, limit } => {
                (stiffness * (target - q) + damping * (velocity - v)).clamp(-limit, *limit)
            }
            _ => 0.0,
        };
        drive - self.damping * v
    }
}

/// Returns what is wrong with the limits of a twist, rad: name, value, admissible range.
pub(crate) fn twist_fault([lo, hi]: [f64; 2]) -> Option<(&'static str, f64, &'static str)> {
    let far = lo.abs().max(hi.abs());
    let wrong = |what, value: f64, fine: bool, expected| (!fine).then_some((what, value, expected));
    wrong("the lower limit of the twist", lo, lo <= hi, "a number that is not above the upper limit")
        .or(wrong("the range of the twist", hi - lo, hi - lo <= WIDE, "at most 3π/2"))
        .or(wrong("a limit of the twist", far, far <= TAU, "within 2π of 0"))
}
