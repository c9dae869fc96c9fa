//! The Python class of the world and the functions behind its methods.

pub mod add;
pub mod bulk;
pub mod class;
pub mod contacts;
pub mod gc;
pub mod inner;
pub mod joints;
pub mod linearize;
pub mod load;
pub mod mimics;
pub mod pairs;
pub mod pickling;
pub mod query;
pub mod report;
pub mod rollout;
mod save_mjcf;
mod save_scene;
pub mod sensors;
pub mod shared;
pub mod simulate;
pub mod snapshot;
pub mod target;
