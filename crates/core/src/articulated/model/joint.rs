//! The joints of a tree of links [RBDA §4.4].
//!
//! | joint | position numbers | velocity numbers | velocity of the link relative to its parent, at the joint |
//! |---|---|---|---|
//! | fixed | – | – | none: the link is folded into its parent when the model is built |
//! | revolute | angle, rad | rate, rad/s | `ω = axis·q̇` |
//! | prismatic | displacement, m | rate, m/s | `v = axis·q̇` |
//! | spherical | unit quaternion `x, y, z, w`, link to joint frame | `ω` in the link's axes, rad/s | `ω = R·q̇` |
//! | floating | position, m, then unit quaternion, link to world | `[ω; v]`, world axes, of the link's origin | `[ω; v]`; only for a root |

use tumble_collide::Vec3;

/// Motion of a link relative to its parent. At position 0 (or the unit quaternion) the link's frame
/// is the joint's frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Joint {
    /// No motion.
    Fixed,
    /// Rotation about a unit axis through the joint's origin.
    Revolute {
        /// Axis, unit, joint axes.
        axis: Vec3,
    },
    /// Translation along a unit axis in the joint's frame.
    Prismatic {
        /// Axis, unit, joint axes.
        axis: Vec3,
    },
    /// Free rotation about the joint's origin.
    Spherical,
    /// Free motion: the root of a tree that is attached to nothing.
    Floating,
}

impl Joint {
    /// Makes a revolute joint about an axis of any length above 0, which is normalized when the
    /// model is built.
    pub fn revolute(axis: Vec3) -> Joint {
        Joint::Revolute { axis }
    }

    /// Makes a prismatic joint along an axis of any length above 0, which is normalized when the
    /// model is built.
    pub fn prismatic(axis: Vec3) -> Joint {
        Joint::Prismatic { axis }
    }

    /// Returns the number of position numbers.
    pub fn positions(&self) -> usize {
        match self {
            Joint::Fixed => 0,
            Joint::Revolute { .. } | Joint::Prismatic { .. } => 1,
            Joint::Spherical => 4,
            Joint::Floating => 7,
        }
    }

    /// Returns the number of velocity numbers: its degrees of freedom.
    pub fn dof(&self) -> usize {
        match self {
            Joint::Fixed => 0,
            Joint::Revolute { .. } | Joint::Prismatic { .. } => 1,
            Joint::Spherical => 3,
            Joint::Floating => 6,
        }
    }

    /// Returns the index of its first quaternion component among its position numbers.
    pub fn quaternion(&self) -> Option<usize> {
        match self {
            Joint::Spherical => Some(0),
            Joint::Floating => Some(3),
            _ => None,
        }
    }
}
