//! Real-time dynamics for interactive and immersive environments.
//!
//! One library over its crates: geometry ([`collide`]), dynamics ([`core`](mod@core)), scene files ([`scene`]), recordings ([`net`]) and
//! pictures ([`render`]). The `tumble` command is built on it. Units, sizes, frames and signs, beside those of Python and scenes: `docs/conventions.md`.
//!
//! ```
//! let scene = tumble::scene::resolve_scene("stack", &[])?.load()?;
//! let (mut world, _notes) = scene.build()?;
//! world.step()?;
//! assert_eq!(world.frame(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use tumble_collide as collide;
pub use tumble_core as core;
pub use tumble_net as net;
pub use tumble_render as render;
pub use tumble_scene as scene;

pub mod table;
pub mod whole;
