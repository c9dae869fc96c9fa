//! All tests of the crate in one binary. Tests that need a graphics adapter print that they are
//! skipped if there is none.

mod cameras;
mod cast;
mod colors;
mod curved;
mod facets;
mod goldens;
mod lists;
mod meshes;
mod particles;
mod pictures;
mod portable;
mod projectors;
mod resolution;
mod shading;
mod soft;
mod support;
