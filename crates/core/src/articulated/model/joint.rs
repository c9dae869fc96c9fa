//! The joints of a tree of links [RBDA §4.4].
//!
//! | joint | position numbers | velocity numbers | velocity of the link against its parent, at the joint |
//! |---|---|---|---|
//! | fixed | – | – | none: the link is folded into its parent when the model is built |
//! | revolute | angle, rad | rate, rad/s | `ω = axis·q̇` |
//! | prismatic | displacement, m | rate, m/s | `v = axis·q̇` |
//! | spherical | unit quaternion `x, y, z, w`, link to joint frame | `ω` in the link's axes, rad/s | `ω = R·q̇` |
//! | floating | position, m, then unit quaternion, link to world | `[ω; v]`, world axes, of the link's origin | as they stand; only for a root |

use tumble_collide::Vec3;

/// How a link moves against its parent. At position 0 (or the unit quaternion) the link's frame is the joint's frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Joint {
    /// Not at all.
    Fixed,
    /// Turns about a unit axis in the joint's frame through its origin.
    Revolute {
        /// Axis, unit, joint axes.
        axis: Vec3,
    },
    /// Slides along a unit axis in the joint's frame.
    Prismatic {
        /// Axis, unit, joint axes.
        axis: Vec3,
    },
    /// Turns freely about the joint's origin.
    Spherical,
    /// Moves freely: the root of a structure that is held by nothing.
    Floating,
}

impl Joint {
    /// A hinge about an axis of any length; made unit when the model is built.
    pub fn revolute(axis: Vec3) -> Joint {
        Joint::Revolute { axis }
    }

    /// A slider along an axis of any length; made unit when the model is built.
    pub fn prismatic(axis: Vec3) -> Joint {
        Joint::Prismatic { axis }
    }

    /// How many numbers say where it is.
    pub fn positions(&self) -> usize {
        match self {
            Joint::Fixed => 0,
            Joint::Revolute { .. } | Joint::Prismatic { .. } => 1,
            Joint::Spherical => 4,
            Joint::Floating => 7,
        }
    }

    /// How many numbers say how fast it moves: its degrees of freedom.
    pub fn dof(&self) -> usize {
        match self {
            Joint::Fixed => 0,
            Joint::Revolute { .. } | Joint::Prismatic { .. } => 1,
            Joint::Spherical => 3,
            Joint::Floating => 6,
        }
    }

    /// First of its position numbers that belongs to a quaternion.
    pub fn quaternion(&self) -> Option<usize> {
        match self {
            Joint::Spherical => Some(0),
            Joint::Floating => Some(3),
            _ => None,
        }
    }
}
