//! Physics proved: closed forms, conservation laws, determinism.

mod free;
mod friction;
mod impacts;
mod stacks;
mod common;
mod paradox;
mod state;
