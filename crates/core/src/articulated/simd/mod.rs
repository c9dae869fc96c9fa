//! Forward dynamics in SIMD registers: several states of a model, or several angles of one state,
//! per instruction.

pub(in crate::articulated) mod batch;
pub(in crate::articulated) mod joint_sin_cos;
pub(in crate::articulated) mod lanes;
