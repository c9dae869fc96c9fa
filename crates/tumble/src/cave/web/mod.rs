//! A facet on the screens of web browsers (`--web`): phones, tablets, televisions. The facet's process
//! serves one page and a WebSocket for each of its facets; the page draws with the shaders of the renderer.
//!
//! ```text
//! frame ─► draw list ─► PortablePicture ─► Encoder ─► WebSocket ─► page: WebGPU or WebGL 2
//!                                          (changes)      ◄─ "drawn n"
//! all screens have drawn ───────────────────────── show n ─►
//! ```
//!
//! The process is the session's facet, so the browser takes part in the swap barrier through it, by a
//! time-out ([`crowd`]).

mod crowd;
mod encode;
mod frame_list;
mod link;
mod screen;

pub use frame_list::FrameList;
pub use screen::{KEY_VARIABLE, WebScreen, new_key, port_after, read_key};
