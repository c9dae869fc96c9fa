//! Scene files: TOML text to a typed, checked description of a world.
//!
//! A scene is read in one pass that finds all its problems. Each is reported with file, line,
//! column, the value and the expected value; see [`SceneError`]. The result, a [`SceneFile`], has
//! no unresolved references and no number that is not finite: meshes and materials are indices,
//! defaults are filled in, grids are expanded to bodies.
//!
//! # The format
//!
//! SI units, radians except in keys that end in `_deg`, z up, right-handed. Quaternions are `[x, y,
//! z, w]`. Every table and key is optional unless it is marked *required*.
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
//! `[[articulated]]` is [`ArticulatedSpec`], a tree of links written out or read from a URDF
//! ([`urdf`]), and `[[loop_joint]]` is [`LoopJointSpec`], which joins parts of any objects.
//! `[[cloth]]` and `[[jelly]]` are [`SoftSpec`], `[[particle_system]]` is [`ParticleSystemSpec`], `[[flock]]` is
//! [`FlockSpec`] and `[[field]]` is [`FieldSpec`].
//! `[meshes.NAME]` is [`MeshSpec`]; `[[grid]]` repeats a body, see [`BodySpec`] for its keys;
//! `[[light]]`, `[sky]` and `[ground]` are [`LightSpec`], [`SkySpec`] and [`GroundSpec`]; `[cave]`
//! is [`CavePlace`], and caves have files of their own ([`cave`]). `scenes/README.md` has a table
//! of all keys.
//!
//! ```
//! let scene = tumble_scene::resolve_scene("stack", &[])?.load()?;
//! assert_eq!(scene.bodies.iter().filter(|b| b.mode == tumble_scene::Mode::Dynamic).count(), 10);
//!
//! let error = tumble_scene::SceneFile::parse("[world]\ndt = 0.1\n", "my.toml").unwrap_err();
//! assert_eq!(error.to_string(), "my.toml:2:1: unknown key `dt` in [world]; did you mean `dt_s`?");
//! # Ok::<(), tumble_scene::SceneError>(())
//! ```

mod build;
pub mod cave;
mod error;
pub mod mjcf;
mod notes;
mod open;
mod parse;
mod save;
pub mod sdformat;
pub mod urdf;
mod xml;

pub use build::error::BuildError;
pub use build::event::place as part_by_name;
pub use build::grid::{ValueGrid, read_grid};
pub use build::heights::{HeightGrid, read_heights};
pub use build::mesh_files::{read_mesh_bytes, read_solid, read_triangles};
pub use build::slow::{building_surface, set_slow_load_listener};
pub use build::textures::{MAX_TEXTURE_SIDE, check_texture};
pub use error::SceneError;
pub use notes::{Notes, overlap_notes, visual_notes};
pub use open::LoadOptions;
pub use open::format::FileKind;
pub use open::plain::{open_file, read_file};
pub use open::shipped::{SceneSource, Shipped, resolve_scene, shipped};
pub use parse::appearance::{AppearanceSpec, Color, Pattern};
pub use parse::articulated::ArticulatedSpec;
pub use parse::axis::axis_by_name;
pub use parse::behavior::BehaviorSpecs;
pub use parse::behavior::field::{FieldKind, FieldSpec, PanelSpec};
pub use parse::behavior::flock::{BodyFlockSpec, BoidGroupSpec, FlockSpec};
pub use parse::behavior::particles::{EmitterSpec, ParticleSystemSpec};
pub use parse::behavior::soft::{Grid, SoftSpec};
pub use parse::body::{BodySpec, MassSpec};
pub use parse::event::{EventSpec, TemplateSpec};
pub use parse::file::{MAX_BYTES, SceneFile};
pub use parse::joint::{JointSpec, MimicSpec};
pub use parse::link::{Geometry, LinkMassSpec, LinkShape, LinkSpec, Surface};
pub use parse::loop_joint::{LoopDofSpec, LoopJointSpec, PartSpec};
pub use parse::material::MaterialSpec;
pub use parse::mesh::{MeshSource, MeshSpec};
pub use parse::mimic::{JointMimicSpec, JointSideSpec};
pub use parse::mount::{Mounts, facing};
pub use parse::pair::{PairSideSpec, PairSpec};
pub use parse::problem::{Invalid, Problem};
pub use parse::sensor::{SensorPlaceSpec, SensorSpec};
pub use parse::shape::{CompoundPartSpec, PartFilter, PartSurface, ShapeSpec};
pub use parse::terrain::{Heights, HullPoints};
pub use parse::view::{CameraSpec, CavePlace, GroundSpec, LightKind, LightSpec, SkySpec};
pub use parse::world::{Integrator, Solver, Stepper, UnknownName, WorldSettings, combine_by_name};
pub use save::{SaveError, SavedWorld, SceneWriter};
pub use tumble_core::LoopJointKind;
pub use tumble_core::{Combine, Mode};
