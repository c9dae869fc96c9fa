//! Real-time dynamics for interactive and immersive environments.
//!
//! Reexports the crates: geometry ([`collide`]), dynamics ([`dynamics`]), flocks, particles, cloth and
//! force fields ([`behaviors`]), scene files ([`scene`]), networking and recordings (`net`) and pictures (`render`). The `tumble` command is built on this
//! library. `docs/conventions.md` compares units, sizes, frames and signs with those of Python and
//! of scene files.
//!
//! | feature | adds | default |
//! |---|---|---|
//! | `render` | the module `render`: draw lists, the wgpu renderer, windows | yes |
//! | `net` | the module `net`: recordings (MCAP), facets of a cave over shared memory and UDP | yes |
//! | `sound` | the module `sound`: the sound of a run as a WAV file | yes |
//! | `command` | the dependencies of the `tumble` command; implies `render` and `net` | yes |
//!
//! With `default-features = false` the library holds `collide`, `dynamics`, `behaviors` and `scene` only.
//!
//! ```
//! let scene = tumble::scene::resolve_scene("stack", &[])?.load()?;
//! let (mut world, _notes) = scene.build()?;
//! world.step()?;
//! assert_eq!(world.frame(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(feature = "sound")]
pub mod sound;

pub use tumble_behaviors as behaviors;
pub use tumble_collide as collide;
pub use tumble_core as dynamics;
#[cfg(feature = "net")]
pub use tumble_net as net;
#[cfg(feature = "render")]
pub use tumble_render as render;
pub use tumble_scene as scene;
