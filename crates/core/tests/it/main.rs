//! Physics proved: closed forms, conservation laws, determinism.

mod adaptive;
mod chains;
mod free;
mod friction;
mod impacts;
mod soft_rows;
mod solvers;
mod stacks;
mod articulated_closed;
mod articulated_laws;
mod articulated_random;
mod articulated_world;
mod closures;
mod closures_articulated;
mod closures_joints;
mod common;
mod limits;
mod meshes;
mod paradox;
mod regressions;
mod regressions_rows;
mod state;
