//! URDF: links, joints, masses and shapes of a robot from XML files.
//!
//! ```no_run
//! use tumble_scene::urdf::{UrdfOptions, load};
//!
//! let options = UrdfOptions { floating: true, ..UrdfOptions::default() };
//! let (robot, notes) = load("anymal.urdf", &options)?;
//! notes.iter().for_each(|note| println!("{note}"));
//! # Ok::<(), tumble_scene::urdf::UrdfError>(())
//! ```
//!
//! | element | meaning |
//! |---|---|
//! | `<inertial>` | mass, center of mass and inertia, rotated by its origin; a link without one is massless |
//! | `<joint>` revolute, continuous, prismatic, fixed | the joint of that type; fixed links are merged into their parents |
//! | `<joint>` planar | two massless prismatic joints `NAME/x`, `NAME/y` in the plane, then a revolute joint `NAME` about its normal |
//! | `<joint>` floating | a floating root if its parent is fixed to the base; else prismatic joints `NAME/x`, `/y`, `/z` and a spherical joint |
//! | `<limit>` | position limits; effort is the default force limit of drives; velocity is enforced with [`UrdfOptions::velocity_limits`] |
//! | `<dynamics>` | viscous damping and dry friction |
//! | `<mimic>` | a coupling of the two joints |
//! | `<collision>` | box, cylinder, sphere, capsule; meshes in STL, OBJ, PLY and COLLADA |
//! | `<visual>` | the same, with the color of its material. Its mesh need not be closed, is read when it is first drawn, and does not collide. If no visual of a link can be read, its collision shapes are drawn |
//!
//! Other elements (transmissions, sensors, extensions of simulators) are ignored. The root link is
//! fixed to the base, or floats with [`UrdfOptions::floating`].

mod chain;
mod error;
mod files;
mod fit;
mod joint;
pub(crate) mod link;
mod load;
mod options;
mod read;
mod self_collision;
mod solid;
mod spheres;
mod tree;
mod weigh;

pub use error::UrdfError;
pub use load::{UrdfModel, load, model, parse_model};
pub use options::{CollisionMeshes, MissingMeshes, UrdfOptions};
pub(crate) use read::{Content, read_file, read_text, text_of};
pub use self_collision::{JointPositions, MAX_POSES, Overlap};
pub use spheres::{LinkSpheres, PerLink, SphereOptions, SphereRobot, spherize};
