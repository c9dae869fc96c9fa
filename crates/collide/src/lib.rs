//! Geometry for tumble: meshes, shapes, sphere trees, broad and narrow phase. Poses in, contacts out.

mod contact;
mod pose;

pub use contact::{Contact, NormalFrom};
pub use pose::{Aabb, Mat3, Pose, Quat, Vec3};
