//! Dynamics of a tree of links, one algorithm per file: kinematics, the articulated-body method and
//! what its factors give, the mass matrix, inverse dynamics and derivatives.

pub(in crate::articulated) mod abm;
pub(in crate::articulated) mod crba;
pub(in crate::articulated) mod derivatives;
pub(in crate::articulated) mod dynamics;
pub(in crate::articulated) mod energy;
pub(in crate::articulated) mod factor;
pub(in crate::articulated) mod free_motion;
pub(in crate::articulated) mod jacobian;
pub(in crate::articulated) mod kinematics;
pub(in crate::articulated) mod rnea;
pub(in crate::articulated) mod same_place;
pub(in crate::articulated) mod singular;
pub(in crate::articulated) mod whiten;
