//! One binary for all integration tests of the crate.

mod broad;
mod primitives;
mod rng;
