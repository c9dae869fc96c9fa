//! Many worlds at once: the class `Batch`, and the one way in which batches and rollouts share
//! worlds among threads.

pub mod bodies;
pub mod class;
pub mod crew;
pub mod drives;
pub mod fields;
pub mod member;
pub mod pickling;
pub mod policy;
