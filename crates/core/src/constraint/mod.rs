//! Constraint rows, how constraints and contacts lay them, and loop joints.

pub(crate) mod builder;
pub(crate) mod dof_rows;
mod gram;
pub(crate) mod loop_joint;
pub(crate) mod mimic;
pub mod rows;
