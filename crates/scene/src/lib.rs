//! Scene files: TOML text to a typed, checked description of a world.
//!
//! A scene is read in one pass that finds all its problems. Each is reported with file, line, column,
//! the value and the expected value; see [`SceneError`]. The result, a [`SceneFile`], has no unresolved
//! references and no number that is not finite: meshes and materials are indices, defaults are filled
//! in, grids are expanded to bodies.
//!
//! # The format
//!
//! SI units, radians except in keys that end in `_deg`, z up, right-handed. Quaternions are
//! `[x, y, z, w]`. Every table and key is optional unless it is marked *required*.
//!
//! ```toml
//! description = "A ball on a plane"
//!
//! [world]                          # WorldSettings
//! dt_s = 0.005
//! stepper = "backtracking"
//!
//! [materials.rubber]               # MaterialSpec
//! friction = 0.8
//! restitution = 0.7
//! color = "#c03028"
//!
//! [[body]]                         # BodySpec
//! name = "floor"                   # required, unique
//! mode = "static"
//! shape = { type = "half_space" }  # required
//!
//! [[body]]
//! name = "ball"
//! shape = { type = "sphere", radius_m = 0.1 }
//! mass_kg = 0.2                    # or density_kg_per_m3; a dynamic body requires one
//! position_m = [0, 0, 1]
//! material = "rubber"
//!
//! [camera]                         # CameraSpec
//! eye_m = [2, -3, 1]
//! target_m = [0, 0, 0.3]
//! ```
//!
//! `[[articulated]]` is [`ArticulatedSpec`], a tree of links written out or read from a URDF ([`urdf`]),
//! and `[[loop_joint]]` is [`LoopJointSpec`], which joins parts of any objects. `[meshes.NAME]` is
//! [`MeshSpec`]; `[[grid]]` repeats a body, see [`BodySpec`] for its keys; `[[light]]`, `[sky]` and
//! `[ground]` are [`LightSpec`], [`SkySpec`] and [`GroundSpec`]; `[cave]` is [`CavePlace`], and caves have
//! files of their own ([`cave`]). `scenes/README.md` has a table of all keys.
//!
//! ```
//! let scene = tumble_scene::resolve_scene("stack", &[])?.load()?;
//! assert_eq!(scene.bodies.iter().filter(|b| b.mode == tumble_scene::Mode::Dynamic).count(), 10);
//!
//! let error = tumble_scene::SceneFile::parse("[world]\ndt = 0.1\n", "my.toml").unwrap_err();
//! assert_eq!(error.to_string(), "my.toml:2:1: unknown key `dt` in [world]; did you mean `dt_s`?");
//! # Ok::<(), tumble_scene::SceneError>(())
//! ```

mod appearance;
mod articulated;
mod assemble;
mod body;
mod bound;
mod build;
pub mod cave;
mod collada;
mod error;
mod fields;
mod file;
mod format;
mod grid;
mod joint;
mod link;
mod link_shapes;
mod lists;
mod log;
mod loop_joint;
mod material;
mod mesh;
mod mount;
mod notes;
mod on_floor;
mod pair;
mod profile;
mod renamed;
mod rotation;
mod shape;
mod shipped;
mod slow;
mod suggest;
pub mod urdf;
mod view;
mod visual_mesh;
mod world;

pub use appearance::{AppearanceSpec, Color, Pattern};
pub use articulated::ArticulatedSpec;
pub use body::{BodySpec, MassSpec};
pub use build::{BuildError, Notes, read_solid, read_triangles};
pub use error::{Invalid, Problem, SceneError};
pub use file::{LoadOptions, MAX_BYTES, SceneFile};
pub use format::FileKind;
pub use joint::{JointSpec, MimicSpec};
pub use link::{Geometry, LinkMassSpec, LinkShape, LinkSpec, Surface};
pub use link_shapes::read_mesh_bytes;
pub use loop_joint::{LoopJointKind, LoopJointSpec, PartSpec};
pub use material::MaterialSpec;
pub use mesh::{MeshSource, MeshSpec};
pub use mount::Mounts;
pub use notes::{overlap_notes, visual_notes};
pub use pair::{PairSideSpec, PairSpec};
pub use shape::ShapeSpec;
pub use shipped::{SceneSource, Shipped, resolve_scene, shipped};
pub use slow::{building_surface, set_slow_load_listener};
pub use tumble_core::{Combine, Mode};
pub use view::{CameraSpec, CavePlace, GroundSpec, LightKind, LightSpec, SkySpec};
pub use world::{Integrator, Solver, Stepper, UnknownName, WorldSettings, combine_by_name};
