//! Structured light: patterns for projectors, and the places of the projector in photographs of them.

mod code;
mod decode;
mod folder;
mod photo;

pub use code::Pattern;
pub use decode::{Decoded, Decoder, Refused};
pub use folder::photographs;
pub use photo::Photo;
