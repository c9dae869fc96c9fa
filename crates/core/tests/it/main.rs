//! Physics proved: closed forms, conservation laws, determinism.

mod adaptive;
mod free;
mod friction;
mod impacts;
mod solvers;
mod stacks;
mod common;
mod limits;
mod meshes;
mod paradox;
mod regressions;
mod regressions_rows;
mod state;
