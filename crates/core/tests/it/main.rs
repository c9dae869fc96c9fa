//! Physics proved: closed forms, conservation laws, determinism.

mod chains;
mod free;
mod friction;
mod impacts;
mod soft_rows;
mod solvers;
mod stacks;
mod common;
mod meshes;
mod paradox;
mod regressions;
mod regressions_rows;
mod state;
