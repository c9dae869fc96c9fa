//! Geometry: triangle meshes, shapes, sphere trees, broad phase and narrow phase.
//!
//! - [`Shape`]: the geometry of one part of a body, with its [`Aabb`], volume and
//!   [`MassProperties`].
//! - [`contacts`]: the narrow phase, with one small file per family of shape pairs. It returns
//!   [`Contact`]s.
//! - [`BroadPhase`]: finds the pairs of boxes that overlap.
//! - [`TriMesh`]: triangle meshes, read from OBJ, PLY and STL, checked, repaired, generated and
//!   integrated.
//! - [`SphereTree`]: nested spheres around a mesh, used for collision and level of detail.
//!
//! Invariants: this crate knows no velocity and no time. The same input gives the same bits. Data
//! from files and users never causes a panic. Lengths are in meters and directions in world axes,
//! unless the item says otherwise.
//!
//! ```
//! use tumble_collide::{Pose, Shape, TreeSettings, TriMesh, contacts};
//!
//! let ring = Shape::mesh(TriMesh::torus(1.0, 0.25, 48, 24), &TreeSettings::octree())?;
//! let mut found = Vec::new();
//! contacts(&ring, &Pose::translation(0.0, 0.0, 0.25), &Shape::half_space(), &Pose::identity(), 0.001, &mut found);
//! assert!(found.len() >= 3 && found.iter().all(|c| c.normal.z == 1.0));
//! # Ok::<(), tumble_collide::ShapeError>(())
//! ```

#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod archive;
mod broad;
mod bytes;
mod cache;
mod contact;
mod distance;
mod error;
mod mass;
mod mesh;
mod narrow;
mod pose;
mod ray;
mod sdf;
mod shape;
mod tree;
mod union_find;

#[doc(hidden)]
pub use archive::shared;
pub use broad::{BroadPhase, BruteForce, SweepAndPrune};
pub use cache::TreeCache;
pub use contact::{Contact, ContactMode, NormalFrom};
pub use distance::{ClosestPair, SurfacePoint, closest_points};
pub use error::{MeshError, ShapeError};
pub use mass::MassProperties;
pub use mesh::{
    ClosedReport, ClosestPoint, MeshDistance, PolygonTriangulator, RepairReport, RepairSettings, TriMesh,
    WindingNumber, decode_text, obj_lines,
};
#[doc(hidden)]
pub use narrow::closest_point_within;
pub use narrow::{contacts, contacts_in_mode};
pub use pose::{Aabb, Mat3, Pose, Quat, Vec3};
pub use ray::{BoxTree, RayHit};
pub use shape::{CompoundPart, CompoundShape, CylinderShape, MeshShape, Shape};
pub use tree::{
    Builder, CachedTree, CoveredShape, Covering, CoveringSphere, LevelQuality, LevelSphere, MeshId, Progress,
    QualitySettings, SolidSamples, SphereNode, SphereTree, StageCount, SurfacePiece, TreeFile, TreeFileError,
    TreeSettings, align_columns, grow_to_cover,
};
pub use union_find::UnionFind;
