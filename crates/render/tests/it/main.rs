//! One binary for all tests of the crate; what needs a graphics adapter says so visibly where there is none.

mod cameras;
mod lists;
mod meshes;
mod pictures;
mod shading;
mod support;
