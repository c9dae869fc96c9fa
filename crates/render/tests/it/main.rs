//! One binary for all tests of the crate; what needs a graphics adapter says so visibly where there is none.

mod cameras;
mod cast;
mod facets;
mod goldens;
mod lists;
mod meshes;
mod pictures;
mod projectors;
mod shading;
mod support;
