//! Physics proved: closed forms, conservation laws, determinism.

mod abm;
mod abm_lanes;
mod abm_reference;
mod abm_spatial;
mod free;
mod friction;
mod impacts;
mod solvers;
mod stacks;
mod common;
mod meshes;
mod paradox;
mod regressions;
mod regressions_rows;
mod state;
