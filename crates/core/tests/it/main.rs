//! Physics proved: closed forms, conservation laws, determinism.

mod abm;
mod abm_reference;
mod adaptive;
mod articulated_closed;
mod articulated_laws;
mod articulated_random;
mod articulated_world;
mod chains;
mod closures;
mod closures_joints;
mod common;
mod free;
mod friction;
mod impacts;
mod limits;
mod meshes;
mod paradox;
mod regressions;
mod regressions_rows;
mod soft_rows;
mod solvers;
mod stacks;
mod state;
