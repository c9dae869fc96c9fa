//! One binary for all integration tests of the crate.

mod against_parry;
mod broad;
mod hull;
mod mesh_contacts;
mod meshes;
mod primitives;
mod rng;
mod shared_meshes;
mod surface;
mod surface_parry;
mod trees;
