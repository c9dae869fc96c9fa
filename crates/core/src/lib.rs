//! Dynamics for tumble: the traits, rigid bodies, contact rows, solvers, integrators, steppers and the world.

pub mod rows;
pub mod solver;
