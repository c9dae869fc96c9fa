//! Geometry for tumble: meshes, shapes, sphere trees, broad and narrow phase. Poses in, contacts out.
//!
//! - [`Shape`]: what a body is made of; its [`Aabb`], volume and [`MassProperties`].
//! - [`contacts`]: the narrow phase, one small file per family of pairs.
//! - [`BroadPhase`]: which pairs are worth asking about.

mod broad;
mod contact;
mod error;
mod mass;
mod mesh;
mod narrow;
mod pose;
mod shape;
mod solid;
mod tree;

pub use broad::{BroadPhase, BruteForce, SweepAndPrune};
pub use contact::{Contact, NormalFrom};
pub use error::{MeshError, ShapeError};
pub use mass::MassProperties;
pub use mesh::{ClosedReport, ClosestPoint, MeshDistance, TriMesh};
pub use narrow::contacts;
pub use pose::{Aabb, Mat3, Pose, Quat, Vec3};
pub use shape::Shape;
pub use solid::{CylinderShape, MeshShape};
pub use tree::{Builder, SphereNode, SphereTree, TreeSettings};
